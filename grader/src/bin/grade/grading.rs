//! `grade` itself: a submission over the suite.

use std::io::{self, Write};

use grader::grading::{self, Grading, Outcome};
use grader::jacobian::{self, JacobianReport};
use grader::probe;
use grader::report;
use grader::submission::Submission;
use grader::suite::Case;

use crate::args::{Format, GradeArgs};
use crate::inputs::{Inputs, open_oracle};
use crate::output::put;
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_submission;

pub(super) fn grade(args: &GradeArgs) -> Result<Exit, Stop> {
    let Inputs { mut suite, expected, rubric } = args.suite.read()?;
    if let Some(text) = &args.only {
        let total = suite.cases.len();
        let integrator = simulator::vocabulary().integrator(text).map(|schema| schema.name);
        let is_wanted =
            |case: &Case| case.id.contains(text) || integrator == Some(case.feature.integrator);
        suite.cases.retain(is_wanted);
        if suite.cases.is_empty() {
            let message = format!(
                "no scene's name contains {text:?}, and no scene's integrator is called so"
            );
            return Err(Stop::bad_input(message));
        }
        complain("note", format!("{} of {total} scenes are graded", suite.cases.len()));
    }
    let oracle = open_oracle(&expected)?;
    let (submission, protection) = open_submission(args, &rubric, &expected)?;
    let jacobians = match submission {
        Submission::BuiltIn(_) => jacobian::check_all(jacobian::Config::default()),
        _ => JacobianReport::default(),
    };
    let mut grading = grading::grade(&suite, &submission, &oracle, &rubric, jacobians);
    grading.protection = protection;
    // Whoever picks scenes wants to see those, and soon.
    if let (Submission::Program(program), None) = (&submission, &args.only) {
        grading.probing = Some(probe::probe(program, |_| true));
    }
    deliver(args, &grading)?;
    Ok(match grading.outcome() {
        Outcome::Passed => Exit::Passed,
        Outcome::Failed => Exit::Failed,
        Outcome::GraderFault => Exit::GraderFault,
    })
}

/// Writes the report where it is wanted.
pub(super) fn deliver(args: &GradeArgs, grading: &Grading) -> Result<(), Stop> {
    let bytes = render(grading, args.format, |out| {
        report::text::write(out, grading, report::text::Config { details: args.details })
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
