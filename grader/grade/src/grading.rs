//! `grade`: grades one submission on the suite.

use std::io::{self, Write};
use std::path::Path;

use grader::events::{Event, Observer, Task};
use grader::grading::{Checks, Grading, GradingOutcome};
use grader::submission::folder;

use crate::args::{Format, GradeArgs, Judging};
use crate::inputs::open_oracle;
use crate::interrupt::Interrupt;
use crate::output::put;
use crate::progress::Progress;
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_submission;

pub(super) fn grade(args: &GradeArgs) -> Result<Exit, Stop> {
    let of_submission = args.submission.as_deref().and_then(named_assignment);
    let judging = Judging { of_submission: of_submission.as_deref(), ..args.judge.judging() };
    let mut inputs = args.suite.read_for(&judging)?;
    let is_whole = args.only.is_empty();
    if !is_whole {
        let total = inputs.suite.cases.len();
        inputs.suite.keep_only(&args.only).map_err(Stop::bad_input)?;
        complain("note", format!("{} of {total} scenes are graded", inputs.suite.cases.len()));
    }
    let oracle = open_oracle(&inputs.expected)?;
    let interrupt = Interrupt::listen()?;
    let progress = Progress::new(!args.judge.no_progress, interrupt.clone());
    progress.notice(Event::Task(Task::Opening));
    let opened = open_submission(args, &inputs);
    interrupt.check("the submission was not built; no scene was graded")?;
    let (submission, protection) = opened?;
    // With --only, run nothing but the chosen scenes.
    let checks = Checks {
        jacobians: !args.judge.no_jacobians,
        probe: !args.judge.no_jacobians && is_whole,
        altered: is_whole,
        hidden: is_whole,
    };
    let mut grading = inputs.grader(&oracle, checks, &progress).grade(&submission, protection);
    drop(progress);
    if is_whole && !grading.is_own && grading.interrupted.is_none() {
        grading.fitting = inputs.fitting(&grading);
    }
    if let Some(interrupted) = grading.interrupted {
        // A program could mistake a partial JSON or JUnit report for a complete one.
        if args.format == Format::Text {
            deliver(args, &grading)?;
        }
        return Err(Stop(Exit::Interrupted, interrupted.to_string()));
    }
    deliver(args, &grading)?;
    Ok(match grading.outcome() {
        // Without the hidden scenes, this is the best result possible.
        GradingOutcome::Passed | GradingOutcome::PassedShipped => Exit::Passed,
        GradingOutcome::Failed => Exit::Failed,
        GradingOutcome::GraderFault => Exit::GraderFault,
    })
}

/// The assignment that the submission names; `None` if it names none, or cannot be read, which is reported when it is
/// opened.
pub(super) fn named_assignment(submission: &Path) -> Option<String> {
    let is_folder = submission.is_dir() && folder::is_submission(submission);
    is_folder.then(|| folder::assignment_of(submission).ok().flatten()).flatten()
}

/// Writes the report to the requested output.
pub(super) fn deliver(args: &GradeArgs, grading: &Grading) -> Result<(), Stop> {
    let bytes = render(grading, args.format, |out| {
        report::text::write(out, grading, report::text::TextOptions { details: args.judge.details })
    })?;
    put(&bytes, args.output.as_deref())
}

/// Renders the report in a format; `text` writes the text format.
pub(super) fn render(
    grading: &Grading,
    format: Format,
    text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<Vec<u8>, Stop> {
    let mut bytes = Vec::new();
    match format {
        Format::Text => text(&mut bytes).map_err(Stop::fault)?,
        Format::Json => bytes = report::json::render(grading).map_err(Stop::fault)?.into_bytes(),
        Format::Junit => bytes = report::junit::render(grading).map_err(Stop::fault)?.into_bytes(),
    }
    Ok(bytes)
}
