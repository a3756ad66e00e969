//! Tests that the scenes catch planted mistakes.
//!
//! [`student`] is the second simulator of the self-test, written independently of the first; the two must agree on
//! every scene. [`mistake`] changes it in one place at a time; every such student must fail at least two scenes. The
//! results are the table `docs/mistakes.md`, which `UPDATE_DOCS=1 cargo test --release -p selftest mistakes` rewrites.
//!
//! The course's own scenes and traces are used if present, beside the workspace in `../shared/fosssim`; they are not
//! part of the project.

mod assignments;
mod calibrated;
mod findings;
mod judging;
mod probing;
mod table;
mod tasks;

use std::collections::BTreeSet;
use std::sync::LazyLock;
use test_support::{assert_document, root, suite};

use grader::submission::Submission;
use grader::suite::{Section, Suite};
use rayon::prelude::*;
use scene::ParseOptions;
use selftest::mistake;
use selftest::student::{self, Student};
use simulator::solver::linear::LinearSolver;

use judging::{Graded, compare_states, excess, states_of};
use table::Table;

/// Minimum number of scenes that must catch each mistake.
const ENOUGH: usize = 2;

/// Every mistake on every scene on which it can have an effect.
static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let scenes = Graded::all(&own_suite(), &root().join("expected"));
    // If the student itself were wrong, every mistake would appear to be caught.
    assert_eq!(failing(&Student::faultless(), &scenes), [""; 0], "fail the faultless student");
    Table::new(mistake::all(), &scenes)
});

/// Scenes that a fixed tolerance can judge: excludes chaotic ones, on which correct programs diverge.
fn own_suite() -> Suite {
    let mut suite = whole_suite();
    suite.cases.retain(|case| case.feature.group != "LongRuns");
    suite
}

/// Every scene that the student supports.
fn whole_suite() -> Suite {
    let mut suite = suite();
    suite.cases.retain(|case| student::knows(&case.scene));
    suite
}

/// The course's scenes with the traces of its own oracle; prints a reason if they are missing.
fn courses_scenes() -> Option<Vec<Graded>> {
    let folder = root().join("../shared/fosssim");
    if !folder.is_dir() {
        skip(&format!("the course's scenes are not at {}", folder.display()));
        return None;
    }
    let sections = [(Section::Required, folder.join("scenes"))];
    let suite = Suite::load(&sections, &ParseOptions::default()).expect("the scenes can be read");
    Some(Graded::all(&suite, &folder.join("traces")))
}

#[expect(clippy::print_stderr, reason = "a test that is skipped says why")]
fn skip(reason: &str) {
    eprintln!("skipped: {reason}");
}

#[test]
fn the_second_implementation_agrees_on_every_scene() {
    let disagree = |case: &grader::suite::Case| {
        let states = states_of(&mut Student::faultless().simulate(&case.scene), &case.scene);
        let mut builtin =
            Submission::BuiltIn(LinearSolver::Auto).states(case).expect("the simulator starts");
        let comparison = compare_states(&states, builtin.as_mut(), &case.scene);
        let excess = excess(&comparison);
        let fault = format!("{}: {}, {excess:e} times the tolerance", case.id, comparison.verdict);
        (!comparison.verdict.is_pass()).then_some(fault)
    };
    let faults: Vec<String> = own_suite().cases.par_iter().filter_map(disagree).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_second_implementation_agrees_with_the_courses_oracle() {
    let Some(scenes) = courses_scenes() else { return };
    assert_eq!(failing(&Student::faultless(), &scenes), [""; 0]);
}

#[test]
fn every_mistake_is_caught_by_at_least_two_scenes() {
    let escaped: Vec<String> = TABLE
        .rows
        .iter()
        .filter(|row| row.caught_by.len() < ENOUGH)
        .map(|row| {
            let mistake = &row.mistake;
            format!("{}, {}: {:?}", mistake.subject, mistake.description, row.caught_by)
        })
        .collect();
    assert!(escaped.is_empty(), "caught by fewer than {ENOUGH} scenes:\n{}", escaped.join("\n"));
}

#[test]
fn no_mistake_is_planted_twice() {
    let mistakes = mistake::all();
    let names: BTreeSet<_> = mistakes.iter().map(|m| (m.subject, m.description)).collect();
    assert_eq!(names.len(), mistakes.len());
}

#[test]
#[ignore = "it takes half a minute"]
fn course_scenes_miss_mistakes_that_ours_catch() {
    let Some(scenes) = courses_scenes() else { return };
    let missed: Vec<_> = mistake::all().into_iter().filter(|m| m.missed_by_the_course).collect();
    assert_eq!(missed.len(), 5);
    for mistake in missed {
        let failing = failing(&mistake.student(), &scenes);
        assert_eq!(failing, [""; 0], "{}, {}", mistake.subject, mistake.description);
    }
}

/// Names of the scenes that `student` fails.
fn failing<'a>(student: &Student, scenes: &'a [Graded]) -> Vec<&'a str> {
    let fails = |graded: &&Graded| !graded.compare(student).verdict.is_pass();
    scenes.par_iter().filter(fails).map(|graded| graded.id.as_str()).collect()
}

#[test]
fn the_table_in_the_docs_is_up_to_date() {
    let command = "cargo test --release -p selftest mistakes";
    assert_document("mistakes.md", &(TABLE.markdown() + &assignments::markdown()), command);
}
