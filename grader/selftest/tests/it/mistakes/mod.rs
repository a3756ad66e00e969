//! Shows, by running mistaken simulators, that the scenes catch mistakes.
//!
//! [`student`] is a second simulator of the self-test, written without the first; the two must agree on every
//! scene. [`mistake`] spoils it in one place at a time; every such student must fail at least two scenes. What
//! comes of it is the table `docs/mistakes.md`, which `UPDATE_DOCS=1 cargo test --release -p selftest
//! mistakes` writes anew.
//!
//! The course's own scenes and traces are used where they are, beside the workspace in
//! `../shared/fosssim`; they are no part of the project.

mod calibrated;
mod explaining;
mod judging;
mod probing;
mod table;

use std::collections::BTreeSet;
use std::sync::LazyLock;
use test_support::{assert_document, root, suite};

use grader::submission::Submission;
use grader::suite::{Section, Suite};
use rayon::prelude::*;
use selftest::mistake;
use selftest::student::{self, Student};
use simulator::scene::ParseOptions;
use simulator::solver::linear::LinearSolver;

use judging::{Graded, compare_states, excess, states_of};
use table::Table;

/// How many scenes at least must catch a mistake.
const ENOUGH: usize = 2;

/// Every mistake on every scene where it can matter.
static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let scenes = Graded::all(&own_suite(), &root().join("expected"));
    // Were the student wrong to begin with, every mistake would seem to be caught.
    assert_eq!(failing(&Student::faultless(), &scenes), [""; 0], "fail the faultless student");
    Table::new(mistake::all(), &scenes)
});

/// Scenes that a fixed tolerance can judge: no chaotic ones, where correct programs part.
fn own_suite() -> Suite {
    let mut suite = whole_suite();
    suite.cases.retain(|case| case.feature.group != "LongRuns");
    suite
}

/// Every scene that the student knows.
fn whole_suite() -> Suite {
    let mut suite = suite();
    suite.cases.retain(|case| student::knows(&case.scene));
    suite
}

/// The course's scenes with the traces of its own oracle; a printed reason where they are not there.
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
fn the_courses_own_scenes_miss_what_ours_catch() {
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
    assert_document("mistakes.md", &TABLE.markdown(), command);
}
