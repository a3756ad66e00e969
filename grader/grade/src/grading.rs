//! `grade` itself: a submission over the suite.

use std::io::{self, Write};

use grader::altered;
use grader::events::{Event, Observer, Task};
use grader::grading::{self, Grading, Outcome};
use grader::jacobian::{self, JacobianReport};
use grader::oracle::Oracle;
use grader::probe;

use grader::submission::Submission;
use sandbox::Protection;

use crate::args::{Format, GradeArgs};
use crate::inputs::{Inputs, open_oracle};
use crate::interrupt::Interrupt;
use crate::output::put;
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
    let interrupt = Interrupt::listen()?;
    let progress = Progress::new(!args.judge.no_progress, interrupt.clone());
    progress.notice(Event::Task(Task::Opening));
    let opened = open_submission(args, &inputs);
    interrupt.check("the submission was not built, and no scene is graded")?;
    let (submission, protection) = opened?;
    // Whoever picks scenes wants to see those, and soon.
    let what = What {
        jacobians: !args.judge.no_jacobians,
        probe: !args.judge.no_jacobians && is_whole,
        altered: is_whole,
        hidden: is_whole,
    };
    let grading = grade_one(&inputs, &oracle, &submission, protection, what, &progress);
    drop(progress);
    if let Some(interrupted) = grading.interrupted {
        // A partial report that a program takes for a whole one is worse than none.
        if args.format == Format::Text {
            deliver(args, &grading)?;
        }
        return Err(Stop(Exit::Interrupted, interrupted.to_string()));
    }
    deliver(args, &grading)?;
    Ok(match grading.outcome() {
        // Whoever has no hidden scenes cannot do better.
        Outcome::Passed | Outcome::PassedShipped => Exit::Passed,
        Outcome::Failed => Exit::Failed,
        Outcome::GraderFault => Exit::GraderFault,
    })
}

/// What is done beside the shipped scenes.
#[derive(Clone, Copy)]
pub(super) struct What {
    /// The built-in simulator's Jacobians are checked.
    pub(super) jacobians: bool,
    /// A program's forces and Jacobians are measured.
    pub(super) probe: bool,
    /// A program is run on altered scenes, where nothing else shows that it simulates.
    pub(super) altered: bool,
    /// Hidden scenes are run.
    pub(super) hidden: bool,
}

/// Grades one submission.
pub(super) fn grade_one(
    inputs: &Inputs,
    oracle: &Oracle,
    submission: &Submission,
    protection: Option<Vec<Protection>>,
    what: What,
    observer: &dyn Observer,
) -> Grading {
    let jacobians = match submission {
        Submission::BuiltIn(_) if what.jacobians => {
            observer.notice(Event::Task(Task::Jacobians));
            jacobian::check_all(jacobian::Config::default())
        }
        _ => JacobianReport::default(),
    };
    let Inputs { suite, rubric, .. } = inputs;
    let mut grading =
        grading::grade_observed(suite, submission, oracle, rubric, jacobians, observer);
    grading.protection = protection;
    if let (Submission::Program(program), true) = (submission, what.probe && !observer.is_stopped())
    {
        observer.notice(Event::Task(Task::Probe));
        grading.probing = Some(probe::probe(program, |_| true));
    }
    if let (Submission::Program(program), true) =
        (submission, what.altered && !observer.is_stopped())
    {
        observer.notice(Event::Task(Task::Altered));
        grading.copied = altered::of_program(suite, program, &grading);
    }
    match (&inputs.hidden, submission) {
        // Nobody can have made traces of scenes that are hidden.
        (Some(_), Submission::Traces(_)) | (None, _) => grading.hidden = inputs.hidden_not_run(),
        (Some(_), _) if !what.hidden => grading.hidden = inputs.hidden_not_run(),
        // Last of all: see `grader::hidden`.
        (Some((hidden, _)), _) => hidden.grade(submission, rubric, &mut grading, observer),
    }
    if observer.is_stopped() {
        grading.interrupt(suite);
    }
    grading
}

/// Writes the report where it is wanted.
pub(super) fn deliver(args: &GradeArgs, grading: &Grading) -> Result<(), Stop> {
    let bytes = render(grading, args.format, |out| {
        report::text::write(out, grading, report::text::Config { details: args.judge.details })
    })?;
    put(&bytes, args.output.as_deref())
}

/// The report in the format wanted; `text` writes it for people.
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
