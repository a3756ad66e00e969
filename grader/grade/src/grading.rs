//! `grade`: grades one submission on the suite.

use std::io::{self, Write};

use grader::events::{Event, Observer, Task};
use grader::grading::{Checks, Grading, GradingOutcome};

use crate::args::{Format, GradeArgs};
use crate::inputs::open_oracle;
use crate::interrupt::Interrupt;
use crate::output::put;
use crate::pages::Pages;
use crate::progress::Progress;
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_submission;

pub(super) fn grade(args: &GradeArgs) -> Result<Exit, Stop> {
    let mut inputs = args.suite.read_with(args.judge.hidden.as_deref(), args.judge.criteria)?;
    let is_whole = args.only.is_empty();
    if !is_whole {
        let total = inputs.suite.cases.len();
        inputs.suite.keep_only(&args.only).map_err(Stop::bad_input)?;
        complain("note", format!("{} of {total} scenes are graded", inputs.suite.cases.len()));
    }
    let oracle = open_oracle(&inputs.expected)?;
    let pages = args.html.as_deref().map(Pages::open).transpose()?;
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
        recordings: args.html.is_some(),
    };
    let grading = inputs.grader(&oracle, checks, &progress).grade(&submission, protection);
    drop(progress);
    if let Some(interrupted) = grading.interrupted {
        // A program could mistake a partial JSON or JUnit report for a complete one.
        if args.format == Format::Text {
            deliver(args, &grading)?;
        }
        return Err(Stop(Exit::Interrupted, interrupted.to_string()));
    }
    deliver(args, &grading)?;
    if let Some(pages) = pages {
        pages.write("", |sink| report::html::submission(&grading, &inputs.suite, &[], sink))?;
        pages.announce();
    }
    Ok(match grading.outcome() {
        // Without the hidden scenes, this is the best result possible.
        GradingOutcome::Passed | GradingOutcome::PassedShipped => Exit::Passed,
        GradingOutcome::Failed => Exit::Failed,
        GradingOutcome::GraderFault => Exit::GraderFault,
    })
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
