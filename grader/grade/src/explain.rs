//! `grade explain`: one scene of a submission in full.

use grader::grading::Checks;
use grader::suite::selection::{self, Candidate};
use grader::suite::{Case, Suite};
use grader::verdict::Verdict;

use crate::args::{ExplainArgs, Judging};
use crate::grading::named_assignment;
use crate::inputs::open_oracle;
use crate::interrupt::Interrupt;
use crate::output::put;
use crate::progress::Progress;
use crate::scenes::Scenes;
use crate::stop::{Exit, Stop};
use crate::submission::open_path;

/// Grades all scenes, and explains one.
pub(super) fn explain(args: &ExplainArgs) -> Result<Exit, Stop> {
    let interrupt = Interrupt::listen()?;
    let of_submission = named_assignment(&args.submission);
    let judging = Judging { of_submission: of_submission.as_deref(), ..args.judge.judging() };
    let inputs = args.suite.read_for(&judging)?;
    let id = find(&inputs.suite, &args.scene)?.id.clone();
    let oracle = open_oracle(&inputs.expected)?;
    let progress = Progress::new(!args.judge.no_progress, interrupt.clone());
    let (submission, protection) = open_path(&args.submission, &args.run, &inputs, &[])?;
    let checks = Checks::default();
    let scenes = Scenes::new(&progress, None);
    let grading = inputs.grader(&oracle, checks, &scenes).grade(&submission, protection);
    drop(progress);
    if let Some(interrupted) = grading.interrupted {
        return Err(Stop(Exit::Interrupted, interrupted.to_string()));
    }
    let mut all = grading.features.iter().flat_map(|feature| &feature.scenes);
    let scene =
        all.find(|scene| scene.id == id).ok_or_else(|| Stop::fault("a scene is missing"))?;
    let mut bytes = Vec::new();
    report::explanation::write(&mut bytes, &grading, scene).map_err(Stop::fault)?;
    put(&bytes, None)?;
    Ok(match scene.comparison.verdict {
        Verdict::Pass => Exit::Passed,
        Verdict::Fail(_) => Exit::Failed,
        Verdict::GraderFault(_) => Exit::GraderFault,
    })
}

/// The scene of this name, or in this file, or the only one that the pattern chooses.
fn find<'a>(suite: &'a Suite, name: &str) -> Result<&'a Case, Stop> {
    if let Ok(path) = std::fs::canonicalize(name) {
        let is_it = |case: &&Case| {
            let file = case.files.first();
            file.is_some_and(|file| std::fs::canonicalize(&file.path).ok().as_ref() == Some(&path))
        };
        if let Some(case) = suite.cases.iter().find(is_it) {
            return Ok(case);
        }
    }
    let candidates: Vec<Candidate<'_>> = suite.cases.iter().map(Candidate::from).collect();
    let chosen = selection::choose(&[name.to_owned()], &candidates).map_err(Stop::bad_input)?;
    let chosen: Vec<&Case> = suite
        .cases
        .iter()
        .zip(chosen)
        .filter(|(_, chosen)| *chosen)
        .map(|(case, _)| case)
        .collect();
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
