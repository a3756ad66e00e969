//! Drawn programs, and the self-test's documents. `ci/selftest.sh` runs the planted mistakes and the correct variants.

use std::collections::{BTreeSet, HashMap};

use test_support::{root, sample, seed, suite};

use diagnosis::findings::Thresholds;
use grader::boundary::seal::Secret;
use grader::compare::Criteria;
use grader::grading;
use grader::grading::altered::{self, Copied, Passed};
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::StateSource;
use grader::suite::{Case, Suite};
use grader::verdict::Verdict;
use rayon::prelude::*;
use selftest::drawn::{self, Inputs, Plan};
use selftest::student::Student;
use selftest::{in_process, mistake, report};

/// The scenes that the second simulator supports, with their oracle and rubric.
fn inputs() -> (Suite, Oracle, Rubric) {
    let mut suite = suite();
    in_process::known(&mut suite);
    let oracle = Oracle::open(&root().join("expected")).expect("there is an oracle");
    let rubric_path = root().join("assets/rubric.toml");
    let rubric = Rubric::load(&rubric_path).expect("there is a rubric");
    (suite, oracle, rubric)
}

/// Findings on drawn programs: some are unfinished, some have several mistakes.
#[test]
fn drawn_programs_are_judged_correctly() {
    let (suite, oracle, rubric) = inputs();
    let inputs = Inputs { suite: &suite, oracle: &oracle, rubric: &rubric };
    let plan = Plan { first: 0, count: 6, seed: seed() };
    let results = drawn::run(inputs, plan, &Thresholds::default());
    let rates = report::drawn::rates(&results);
    let of = |name: &str| rates.iter().find(|rate| rate.name.starts_with(name)).expect("a rate");
    let details = report::drawn::details(&results);
    assert!(of("mistakes caught").is_met(), "{details}");
    // Of 200 programs, one may have a false finding, and of 30, one may not be named first: `ci/selftest.sh` draws enough
    // programs to see that.
    assert!(of("programs with a false").rate.right <= 1, "{details}");
    let named = of("one mistake: named").rate;
    assert!(named.right + 1 >= named.all, "{details}");
}

/// A simulator with a mistake, or with two, loses no scene that it passes. A scene on which one of the two can have no effect
/// passes as with the other alone.
fn assert_no_copies(count: usize) {
    let (suite, oracle, rubric) = inputs();
    let criteria = |case: &Case| rubric.criteria(case, oracle.calibrated(case));
    let criteria: Vec<Criteria> = suite.cases.iter().map(criteria).collect();
    let cases: Vec<(&Case, &Criteria)> = suite.cases.iter().zip(&criteria).collect();
    let passes = |student: &Student, (case, criteria): (&Case, &Criteria)| {
        let start = || Ok(Box::new(student.simulate(&case.scene)) as Box<dyn StateSource>);
        let (comparison, _) = grading::judge(case, &oracle, criteria.clone(), start);
        comparison.verdict.is_pass()
    };
    assert!(cases.par_iter().all(|one| passes(&Student::faultless(), *one)));

    let mistakes = mistake::possible(&suite, mistake::all());
    let matters = |number: usize, case: &Case| mistakes[number].can_matter_on(&case.scene);
    let judge = |number: usize| -> Vec<bool> {
        let student = mistakes[number].student();
        let passes = |one: &(&Case, &Criteria)| !matters(number, one.0) || passes(&student, *one);
        cases.par_iter().map(passes).collect()
    };
    let other = |number: usize| (number + 121) % mistakes.len();
    let chosen = sample(0..mistakes.len(), count);
    let needed: BTreeSet<usize> = chosen.iter().flat_map(|one| [*one, other(*one)]).collect();
    let judged: HashMap<usize, Vec<bool>> =
        needed.into_par_iter().map(|number| (number, judge(number))).collect();
    let together = |student: &Student, numbers: [usize; 2]| -> Vec<bool> {
        let each = numbers.map(|number| &judged[&number]);
        let passes = |(place, one): (usize, &(&Case, &Criteria))| {
            let is_shared = numbers.iter().all(|number| matters(*number, one.0));
            if is_shared { passes(student, *one) } else { each.iter().all(|each| each[place]) }
        };
        cases.par_iter().enumerate().map(passes).collect()
    };

    let copied = |student: &Student, is_passed: &[bool]| -> Option<Copied> {
        let other_root = rubric.other_root();
        let passed = cases.iter().zip(is_passed).filter(|(_, is_passed)| **is_passed);
        let passed: Vec<Passed<'_>> =
            passed.map(|((case, criteria), _)| Passed { case, criteria, other_root }).collect();
        let run = |case: &Case| -> Result<Box<dyn StateSource>, Verdict> {
            Ok(Box::new(student.simulate(&case.scene)))
        };
        let copied = altered::look_for_copies(&suite, &passed, Secret(seed()), &run);
        copied.filter(|copied| !copied.withdrawn.is_empty())
    };
    let wrongly = |number: usize| -> Vec<String> {
        let numbers = [number, other(number)];
        let [first, second] = numbers.map(|number| &mistakes[number]);
        let (one, both) = (first.student(), first.and(second));
        let copied = [copied(&one, &judged[&number]), copied(&both, &together(&both, numbers))];
        let words = [first.description, second.description];
        let of = |copied: Copied| format!("{} {words:?}: {copied:?}", first.subject);
        copied.into_iter().flatten().map(of).collect()
    };
    let wrongly: Vec<String> = chosen.into_par_iter().flat_map_iter(wrongly).collect();
    assert!(wrongly.is_empty(), "{}", wrongly.join("\n"));
}

#[test]
fn sampled_mistakes_are_not_taken_for_copies() {
    assert_no_copies(2);
}

#[test]
#[ignore = "long: a minute"]
fn long_mistakes_are_not_taken_for_copies() {
    assert_no_copies(usize::MAX);
}
