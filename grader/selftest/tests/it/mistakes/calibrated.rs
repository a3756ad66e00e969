//! Mistakes of the second simulator, judged by calibrated tolerances.

use grader::compare::{Calibrated, Comparison, Criteria, Expectation, compare};
use grader::oracle::Oracle;
use grader::suite::{Case, find_trace};
use grader::verdict::{Failure, Verdict};
use rayon::prelude::*;
use scene::trace;
use test_support::root;

use super::{ENOUGH, whole_suite};
use selftest::mistake::{self, Mistake};
use selftest::student::Student;

fn judge(case: &Case, student: &Student, calibrated: Calibrated) -> Comparison {
    let expectation = Expectation::of(&case.scene);
    let folder = root().join("expected");
    let (path, format) = find_trace(&folder, &case.id).expect("a trace");
    let mut oracle = trace::open(&path, format, expectation.shape).expect("a trace");
    let mut run = student.simulate(&case.scene);
    compare(oracle.as_mut(), &mut run, expectation, Criteria::Calibrated(calibrated))
}

/// Every scene with its stored envelope.
fn cases() -> Vec<(Case, Calibrated)> {
    let oracle = Oracle::open(&root().join("expected")).expect("an oracle");
    let with = |case: Case| {
        let calibrated = oracle.calibrated(&case).expect("an envelope for each scene");
        (case, calibrated)
    };
    whole_suite().cases.into_iter().map(with).collect()
}

#[test]
fn the_second_implementation_uses_a_small_part_of_the_tolerances() {
    let used = |(case, calibrated): &(Case, Calibrated)| {
        let found = judge(case, &Student::faultless(), calibrated.clone());
        assert_eq!(found.verdict, Verdict::Pass, "{}", case.id);
        (found.allowed.expect("calibrated tolerances").used, case.id.clone())
    };
    let all: Vec<(f64, String)> = cases().par_iter().map(used).collect();
    let worst = all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("scenes");
    // The factor of ten is a margin for programs that differ in other ways.
    assert!(worst.0 < 0.2, "{worst:?}");
}

#[test]
fn every_mistake_is_caught_by_two_scenes_under_calibrated_tolerances_too() {
    let cases = cases();
    let catches = |mistake: &Mistake, (case, calibrated): &(Case, Calibrated)| {
        let found = judge(case, &mistake.student(), calibrated.clone());
        match found.verdict {
            // Close verdicts are no evidence: they depend on rounding errors.
            Verdict::Fail(Failure::Differs) => found.allowed.is_some_and(|a| a.used > 10.0),
            verdict => !verdict.is_pass(),
        }
    };
    let escapes = |mistake: &Mistake| {
        let scenes = cases.iter().filter(|(case, _)| mistake.can_matter_on(&case.scene));
        let caught = scenes.filter(|scene| catches(mistake, scene)).take(ENOUGH).count();
        (caught < ENOUGH).then(|| format!("{}, {}", mistake.subject, mistake.description))
    };
    let escaped: Vec<String> = mistake::all().par_iter().filter_map(escapes).collect();
    assert!(escaped.is_empty(), "{}", escaped.join("\n"));
}
