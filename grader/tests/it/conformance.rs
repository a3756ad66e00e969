//! Compares the course's traces of its scenes with the built-in simulator, where they are available.

use std::path::Path;

use needs::needs;
use test_support::{course, course_on_elastic_bodies};

use grader::grading::{Grader, GradingOutcome};
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::Submission;
use grader::suite::{Section, Suite};
use scene::ParseOptions;
use simulator::solver::linear::LinearSolver;

#[needs("test -d ${SPRING_ORACLE_FOSSSIM:-../shared/fosssim}")]
#[test]
fn the_courses_own_traces_are_reproduced() {
    // Ten times better than required: rounding leaves 4e-12 on the worst scene.
    holds(&course(), 45, 1e-11);
}

#[needs("test -d ${SPRING_ORACLE_ELASTIC:-../shared/elastic}")]
#[test]
fn the_courses_own_traces_of_elastic_bodies_are_reproduced() {
    // A triangle amplifies rounding to 3e-11.
    holds(&course_on_elastic_bodies(), 27, 1e-10);
}

/// The scenes below `course`, at least so many, have the traces there, with residuals up to `largest`.
fn holds(course: &Path, least: usize, largest: f64) {
    let sections = [(Section::Required, course.join("scenes"))];
    let suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
    assert!(suite.cases.len() >= least && suite.warnings.is_empty());
    let oracle = Oracle::open(&course.join("traces")).unwrap();
    // The default rubric is the course's criteria.
    for solver in [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse] {
        reproduces(&suite, &oracle, solver, largest);
    }
}

fn reproduces(suite: &Suite, oracle: &Oracle, solver: LinearSolver, bound: f64) {
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
            assert!(largest < bound, "{solver:?}, {}: {largest:e}", scene.id);
        }
    }
    assert_eq!(grading.outcome(), GradingOutcome::Passed);
}
