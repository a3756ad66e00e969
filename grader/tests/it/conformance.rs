//! Compares the course's own traces of its own scenes with the built-in simulator, where they are available.

use needs::needs;
use test_support::course;

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
    let course = course();
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
