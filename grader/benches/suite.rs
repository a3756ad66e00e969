//! Cost of grading a whole suite. See README.md in this folder.

#[path = "../../simulator/benches/harness/mod.rs"]
mod harness;

use std::path::{Path, PathBuf};
use std::time::Duration;

use grader::grading::{Grader, GradingOutcome};
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::Submission;
use grader::suite::{Section, Suite};
use harness::Harness;
use scene::ParseOptions;
use simulator::solver::linear::LinearSolver;

fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a crate of a workspace")
}

/// The folder of the course's data, if it is there.
fn course() -> Option<PathBuf> {
    let beside = workspace().join("../shared/fosssim");
    let folder = std::env::var_os("SPRING_ORACLE_FOSSSIM").map_or(beside, PathBuf::from);
    folder.join("scenes").is_dir().then_some(folder)
}

/// The built-in simulator on every scene of the sections, against the traces of `expected`.
fn suite(
    harness: &Harness,
    name: &str,
    sections: &[(Section, PathBuf)],
    expected: &Path,
    rubric: &Rubric,
) {
    let suite = Suite::load(sections, &ParseOptions::default()).expect("the scenes can be read");
    let oracle = Oracle::open(expected).expect("the manifest can be read");
    let states: u64 = suite.cases.iter().map(|case| case.scene.n_steps() + 1).sum();
    harness.run(&format!("suite/{name}"), states, || {
        let submission = Submission::BuiltIn(LinearSolver::Auto);
        let grading = Grader::new(&suite, &oracle, rubric).grade(&submission, None);
        assert!(grading.outcome() == GradingOutcome::Passed, "{name} does not pass");
        grading
    });
}

fn shipped(harness: &Harness) {
    let folder = |name: &str| workspace().join(name);
    let sections = [
        (Section::Required, folder("assets")),
        (Section::ExtraCredit, folder("extracreditassets")),
    ];
    let rubric = Rubric::load(&folder("assets/rubric.toml")).expect("the rubric can be read");
    suite(harness, "shipped", &sections, &folder("expected"), &rubric);
}

fn courses(harness: &Harness) {
    let Some(course) = course() else { return };
    let sections = [(Section::Required, course.join("scenes"))];
    suite(harness, "course", &sections, &course.join("traces"), &Rubric::default());
}

/// A run over a suite takes long for a bench: few of them are enough.
fn main() {
    let harness = Harness::new(10, Duration::from_millis(500));
    shipped(&harness);
    courses(&harness);
}
