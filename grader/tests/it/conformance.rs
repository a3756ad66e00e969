//! Compares the course's own traces of its own scenes with the built-in simulator, where they are available.

use std::path::PathBuf;
use test_support::root;

use grader::grading::{Grader, GradingOutcome};
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::Submission;
use grader::suite::{Section, Suite};
use scene::ParseOptions;
use simulator::solver::linear::LinearSolver;

/// The folder of the course's data, if it is available.
fn course() -> Option<PathBuf> {
    let beside = root().join("../shared/fosssim");
    let folder = std::env::var_os("SPRING_ORACLE_FOSSSIM").map_or(beside, PathBuf::from);
    folder.join("scenes").is_dir().then_some(folder)
}

#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says why")]
fn the_courses_own_traces_are_reproduced() {
    let Some(course) = course() else {
        eprintln!("skipped: no scenes of the course; set SPRING_ORACLE_FOSSSIM to their folder");
        return;
    };
    let sections = [(Section::Required, course.join("scenes"))];
    let suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
    assert!(suite.cases.len() >= 45 && suite.warnings.is_empty());
    let oracle = Oracle::open(&course.join("traces")).unwrap();
    // The default rubric is the course's criteria.
    for solver in [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse] {
        reproduces(&suite, &oracle, solver);
    }
}

fn reproduces(suite: &Suite, oracle: &Oracle, solver: LinearSolver) {
    let submission = Submission::BuiltIn(solver);
    let rubric = Rubric::default();
    let grading = Grader::new(suite, oracle, &rubric).grade(&submission, None);
    for result in &grading.features {
        for scene in &result.scenes {
            assert!(
                scene.comparison.verdict.is_pass(),
                "{solver:?}, {}: {:?}",
                scene.id,
                scene.comparison
            );
            let largest = scene.comparison.position.largest.max(scene.comparison.velocity.largest);
            // Ten times better than required: rounding leaves 4e-12 on the worst scene.
            assert!(largest < 1e-11, "{solver:?}, {}: {largest:e}", scene.id);
        }
    }
    assert_eq!(grading.outcome(), GradingOutcome::Passed);
}
