//! `grade explain`: one scene of a submission in full.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use fuzzing::campaign::{self, Discovery};
use fuzzing::draw::Scope;
use fuzzing::report::text;
use fuzzing::shrink::{Effort, measure};
use grader::grading::{Checks, Grading, SceneResult};
use grader::submission::Submission;
use grader::suite::selection::{self, Candidate};
use grader::suite::{Case, Suite};
use grader::verdict::Verdict;

use crate::args::{JudgeArgs, RunArgs, SuiteArgs};
use crate::inputs::{Inputs, Judging, open_oracle};
use crate::interrupt::Interrupt;
use crate::output::{print, written};
use crate::progress::Progress;
use crate::scenes::Scenes;
use crate::stop::{Exit, Stop};
use crate::submission::{named_assignment, open_path};
use crate::terminal::width;

/// Explain one scene that failed: the findings, the first step that is wrong by itself, and its equation with the numbers put in
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade explain Spring/compressed-strut-explicit my-simulator
  grade explain assets/Spring/compressed-strut-explicit.xml my-simulator --assignment t1m1

Exit codes: 0 the scene passed, 1 it failed, 2 bad usage or input, 3 it could not be judged, 130 interrupted (Ctrl-C).")]
pub(crate) struct ExplainArgs {
    /// The scene: GROUP/SCENE, as reports name it, or the path of its file
    #[arg(value_name = "SCENE")]
    scene: String,

    /// Submission: a program, a folder with submission.toml, or a folder of traces. All its scenes are graded, as a
    /// mistake is proven by many
    #[arg(value_name = "SUBMISSION")]
    submission: PathBuf,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    judge: JudgeArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl ExplainArgs {
    /// Grades all scenes, and explains one.
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let interrupt = Interrupt::listen()?;
        let of_submission = named_assignment(&self.submission);
        let judging = Judging { of_submission: of_submission.as_deref(), ..self.judge.judging() };
        let inputs = self.suite.read_for(&judging)?;
        let id = find(&inputs.suite, &self.scene)?.id.clone();
        let oracle = open_oracle(&inputs.expected)?;
        let progress = Progress::new(!self.judge.no_progress, interrupt.clone());
        let (submission, protection) = open_path(&self.submission, &self.run, &inputs, &[])?;
        let scenes = Scenes::new(&progress, None);
        let grader = inputs.grader(&oracle, Checks::default(), &scenes);
        let grading = grader.grade(&submission, protection);
        if let Some(interrupted) = grading.interrupted {
            return Err(Stop(Exit::Interrupted, interrupted.to_string()));
        }
        let mut all = grading.features.iter().flat_map(|feature| &feature.scenes);
        let scene =
            all.find(|scene| scene.id == id).ok_or_else(|| Stop::fault("a scene is missing"))?;
        progress.show("shrinking the scene");
        let smallest = smallest(&submission, &inputs, &grading, scene, &interrupt);
        drop(progress);
        if let Some(smallest) = smallest {
            print(&written(|out| text::write_smallest(out, &smallest, width()))?)?;
        }
        print(&written(|out| report::explanation::write(out, &grading, scene, width()))?)?;
        Ok(match scene.comparison.verdict {
            Verdict::Pass => Exit::Passed,
            Verdict::Fail(_) => Exit::Failed,
            Verdict::GraderFault(_) => Exit::GraderFault,
        })
    }
}

/// How much shrinking may cost: a reader waits for it.
const EFFORT: Effort = Effort { runs: 600, time: Duration::from_secs(10) };

/// The smallest scene in which a program fails as in this one, if that is smaller.
fn smallest(
    submission: &Submission,
    inputs: &Inputs,
    grading: &Grading,
    result: &SceneResult,
    interrupt: &Interrupt,
) -> Option<Discovery> {
    let Submission::Program(program) = submission else { return None };
    let case = inputs.suite.cases.iter().find(|case| case.id == result.id)?;
    if result.comparison.verdict.is_pass() || case.format() != "xml" {
        return None;
    }
    let mut proven = grading.findings.list.iter().filter(|finding| finding.is_proven());
    let proven = proven.find(|finding| finding.scenes.contains(&case.id)).cloned();
    let scope = inputs.assignment.as_ref().map(|assignment| Scope::of(assignment.scope()));
    let scope = scope.unwrap_or_else(Scope::all);
    let found = campaign::smallest(program, (&scope, EFFORT), &case.scene, proven, &|| {
        interrupt.is_requested()
    })?;
    (measure(&found.shrunk.scene) < measure(&case.scene)).then_some(found)
}

/// The scene of this name, or in this file, or the only one that the pattern chooses.
fn find<'a>(suite: &'a Suite, name: &str) -> Result<&'a Case, Stop> {
    if let Ok(path) = scene::input::real_path(name.as_ref()) {
        let is_it = |case: &&Case| {
            let file = case.files.first();
            file.is_some_and(|file| {
                scene::input::real_path(&file.path).ok().as_ref() == Some(&path)
            })
        };
        if let Some(case) = suite.cases.iter().find(is_it) {
            return Ok(case);
        }
    }
    let candidates: Vec<Candidate<'_>> = suite.cases.iter().map(Candidate::from).collect();
    let chosen = selection::choose(&[name.to_owned()], &candidates).map_err(Stop::bad_input)?;
    let chosen = suite.cases.iter().zip(chosen).filter(|(_, chosen)| *chosen);
    let chosen: Vec<&Case> = chosen.map(|(case, _)| case).collect();
    match chosen.as_slice() {
        [case] => Ok(case),
        [first, ..] => Err(Stop::bad_input(format!(
            "{name}: {} scenes\n  help: name one, such as {}",
            chosen.len(),
            first.id
        ))),
        [] => Err(Stop::bad_input(format!("{name}: no such scene"))),
    }
}
