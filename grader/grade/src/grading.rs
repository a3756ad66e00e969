//! `grade`: grades one submission on the suite.

use std::io::{self, Write};
use std::path::Path;

use grader::events::{Event, Observer, Task};
use grader::grading::{Checks, Grading, GradingOutcome};
use grader::submission::folder;

use crate::args::{Format, GradeArgs, Judging};
use crate::inputs::{Inputs, open_oracle};
use crate::interrupt::Interrupt;
use crate::last_failed;
use crate::output::put;
use crate::pages::Pages;
use crate::progress::Progress;
use crate::scenes::Scenes;
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_submission;
use crate::watch;

/// Grades the submission; with `--watch`, again after each change.
pub(super) fn grade(args: &GradeArgs) -> Result<Exit, Stop> {
    if args.fail_fast.is_some() && args.format != Format::Text {
        return Err(Stop::bad_input(
            "--fail-fast ends a run before it is complete\n  help: it works with --format text",
        ));
    }
    let interrupt = Interrupt::listen()?;
    let Some(submission) = args.submission.as_deref().filter(|_| args.watch) else {
        return grade_once(args, &interrupt);
    };
    loop {
        let files = watch::files(submission);
        let graded = grade_once(args, &interrupt);
        if interrupt.is_requested() {
            return graded;
        }
        if let Err(Stop(_, message)) = &graded {
            complain("error", message);
        }
        complain("note", format!("waiting for changes of {}", submission.display()));
        if !watch::wait(submission, &files, &interrupt) {
            return graded;
        }
    }
}

fn grade_once(args: &GradeArgs, interrupt: &Interrupt) -> Result<Exit, Stop> {
    let of_submission = args.submission.as_deref().and_then(named_assignment);
    let judging = Judging { of_submission: of_submission.as_deref(), ..args.judge.judging() };
    let mut inputs = args.suite.read_for(&judging)?;
    let record = args.submission.as_deref().or(args.traces.as_deref());
    let record = last_failed::file(record, &inputs.expected);
    let only = choose(args, &inputs, record.as_deref());
    let is_whole = only.is_empty();
    if !is_whole {
        let total = inputs.suite.cases.len();
        inputs.suite.keep_only(&only).map_err(Stop::bad_input)?;
        complain("note", format!("{} of {total} scenes are graded", inputs.suite.cases.len()));
    }
    let oracle = open_oracle(&inputs.expected)?;
    let pages = args.html.as_deref().map(Pages::open).transpose()?;
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
    let scenes = Scenes::new(&progress, args.fail_fast.map(|count| count as usize));
    let mut grading = inputs.grader(&oracle, checks, &scenes).grade(&submission, protection);
    let (has_ended, slowest) = (scenes.has_ended(), scenes.slowest(args.durations.unwrap_or(0)));
    drop(progress);
    if is_whole && !grading.is_own && grading.interrupted.is_none() {
        grading.fitting = inputs.fitting(&grading);
    }
    if let Some(record) = &record {
        last_failed::store(record, &grading);
    }
    if let Some(interrupted) = grading.interrupted {
        // A program could mistake a partial JSON or JUnit report for a complete one.
        if args.format == Format::Text {
            deliver(args, &grading)?;
        }
        if interrupt.is_requested() || !has_ended {
            return Err(Stop(Exit::Interrupted, interrupted.to_string()));
        }
        complain("note", format!("ended by --fail-fast: {interrupted}"));
        return Ok(Exit::Failed);
    }
    deliver(args, &grading)?;
    for (time, scene) in slowest {
        complain("note", format!("{:8.3} s  {scene}", time.as_secs_f64()));
    }
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

/// The patterns of the scenes to grade; none for all scenes.
fn choose(args: &GradeArgs, inputs: &Inputs, record: Option<&Path>) -> Vec<String> {
    if !args.last_failed {
        return args.only.clone();
    }
    let known = record.map(last_failed::load).unwrap_or_default();
    let names = inputs.suite.cases.iter().map(|case| case.id.clone());
    let chosen: Vec<String> = names.filter(|name| known.contains(name)).collect();
    if chosen.is_empty() {
        complain("note", "no failed scene is known from before; all scenes are graded");
    }
    chosen
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
