//! Tests that the scenes catch planted mistakes.
//!
//! [`student`] is the second simulator of the self-test, written independently of the first; the two must agree on
//! every scene. [`mistake`] changes it in one place at a time; every such student must fail at least two scenes. The
//! results are the table `docs/mistakes.md`, which `UPDATE_DOCS=1 cargo test --release -p selftest mistakes -- --include-ignored` rewrites. Each run draws some mistakes
//! anew; the tests of all mistakes are long.
//!
//! The course's own scenes and traces are used if `../shared/fosssim` has them; they are not
//! part of the project.

mod assignments;
mod calibrated;
mod cost;
mod findings;
mod judging;
mod probing;
mod table;
mod tasks;

use needs::needs;
use std::collections::BTreeSet;
use test_support::{assert_document, course, root, sample, suite};

use grader::submission::Submission;
use grader::suite::{Section, Suite};
use rayon::prelude::*;
use scene::{ParseOptions, Scene};
use selftest::mistake::{self, Mistake};
use selftest::student::{self, Student};
use simulator::solver::linear::LinearSolver;

use judging::{Graded, compare_states, excess, states_of};
use table::Table;

/// Writes `docs/mistakes.md`.
const COMMAND: &str = "cargo test --release -p selftest mistakes -- --include-ignored";

/// Minimum number of scenes that must catch each mistake.
const ENOUGH: usize = 2;

/// Mistakes on every scene on which they can have an effect.
fn table(mistakes: Vec<Mistake>) -> Table {
    let scenes = Graded::all(&own_suite(), &root().join("expected"));
    // If the student itself were wrong, every mistake would appear to be caught.
    assert_eq!(failing(&Student::faultless(), &scenes), [""; 0], "fail the faultless student");
    let table = Table::new(mistakes, &scenes);
    let escaped = table.rows.iter().filter(|row| row.caught_by.len() < ENOUGH).map(|row| {
        let mistake = &row.mistake;
        format!("{}, {}: {:?}", mistake.subject, mistake.description, row.caught_by)
    });
    let escaped: Vec<String> = escaped.collect();
    assert!(escaped.is_empty(), "caught by fewer than {ENOUGH} scenes:\n{}", escaped.join("\n"));
    table
}

/// Scenes that a fixed tolerance can judge: excludes chaotic ones, on which correct programs diverge.
fn own_suite() -> Suite {
    let mut suite = suite();
    let is_known = |scene: &Scene| student::knows(scene) || student::knows_in_space(scene);
    suite.cases.retain(|case| is_known(&case.scene) && case.feature.group != "LongRuns");
    suite
}

/// The mistakes of the table.
fn documented() -> Vec<Mistake> {
    mistake::all().into_iter().chain(mistake::in_space()).collect()
}

/// Every scene that the student supports in the plane.
fn whole_suite() -> Suite {
    let mut suite = suite();
    suite.cases.retain(|case| student::knows(&case.scene));
    suite
}

/// The course's scenes with the course's traces.
fn courses_scenes() -> Vec<Graded> {
    let folder = course();
    let sections = [(Section::Required, folder.join("scenes"))];
    let suite = Suite::load(&sections, &ParseOptions::default()).expect("the scenes can be read");
    Graded::all(&suite, &folder.join("traces"))
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

#[needs("test -d ${SPRING_ORACLE_FOSSSIM:-../shared/fosssim}")]
#[test]
fn the_second_implementation_agrees_with_the_courses_oracle() {
    let scenes = courses_scenes();
    assert_eq!(failing(&Student::faultless(), &scenes), [""; 0]);
}

#[test]
fn sampled_mistakes_are_caught_in_each_assignment_and_documented() {
    let table = table(sample(documented(), 20));
    assignments::assert_caught(&table);
    let document = std::fs::read_to_string(root().join("docs/mistakes.md")).unwrap();
    for row in &table.rows {
        let row = row.markdown();
        assert!(document.contains(&row), "docs/mistakes.md lacks {row}help: {COMMAND}");
    }
}

#[test]
#[ignore = "long: a minute"]
fn long_every_mistake_is_caught_in_each_assignment_and_documented() {
    let table = table(documented());
    let catches = assignments::assert_caught(&table);
    let names: Vec<&str> = catches.iter().map(|catch| &*catch.assignment.name).collect();
    let known = [
        "all",
        "elastodynamics",
        "fast-mass-spring",
        "higher-order",
        "t1m1",
        "t1m2",
        "t1m3",
        "t4m1",
    ];
    assert_eq!(names, known);
    let document = table.markdown() + &assignments::markdown(&catches) + &cost::markdown(&table);
    assert_document("mistakes.md", &document, COMMAND);
}

#[test]
fn no_mistake_is_planted_twice() {
    let mistakes = documented();
    let names: BTreeSet<_> = mistakes.iter().map(|m| (m.subject, m.description)).collect();
    assert_eq!(names.len(), mistakes.len());
}

#[needs("test -d ${SPRING_ORACLE_FOSSSIM:-../shared/fosssim}")]
#[test]
fn course_scenes_miss_mistakes_that_ours_catch() {
    let scenes = courses_scenes();
    let missed: Vec<_> = mistake::all().into_iter().filter(|m| m.missed_by_the_course).collect();
    assert_eq!(missed.len(), 5);
    for mistake in sample(missed, 1) {
        let failing = failing(&mistake.student(), &scenes);
        assert_eq!(failing, [""; 0], "{}, {}", mistake.subject, mistake.description);
    }
}

/// Names of the scenes that `student` fails.
fn failing<'a>(student: &Student, scenes: &'a [Graded]) -> Vec<&'a str> {
    let fails = |graded: &&Graded| !graded.compare(student).verdict.is_pass();
    scenes.par_iter().filter(fails).map(|graded| graded.id.as_str()).collect()
}
