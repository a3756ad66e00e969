//! `grade verify-report`: grades the submission of a report again, and compares.

use std::collections::HashSet;
use std::path::Path;

use clap::ValueEnum;
use grader::events::{Event, Observer, Task};
use grader::grading::Checks;
use grader::submission::Submission;
use report::provenance::StoredReport;
use simulator::solver::linear::LinearSolver;

use crate::args::{CriteriaArg, Judging, RunArgs, VerifyReportArgs};
use crate::inputs::open_oracle;
use crate::interrupt::Interrupt;
use crate::output::print;
use crate::progress::Progress;
use crate::provenance::provenance;
use crate::stop::{Exit, Stop};
use crate::submission::open_path;

pub(super) fn verify(args: &VerifyReportArgs) -> Result<Exit, Stop> {
    let interrupt = Interrupt::listen()?;
    let file = args.report.display();
    let unusable = |error: &dyn std::fmt::Display| Stop::bad_input(format!("{file}:{error}"));
    let text =
        std::fs::read_to_string(&args.report).map_err(|error| unusable(&format!(" {error}")))?;
    let old = StoredReport::parse(&text).map_err(|error| unusable(&error))?;
    let options = old.options();
    let criteria = options.criteria.as_deref().map(|name| {
        CriteriaArg::from_str(name, false).map_err(|error| unusable(&format!(" {error}")))
    });
    let judging = Judging {
        hidden: args.hidden.as_deref(),
        criteria: criteria.transpose()?,
        // A report without an assignment is one of every scene, whatever the rubric says now.
        assignment: Some(old.assignment.as_deref().unwrap_or(grader::assignment::ALL)),
        of_submission: None,
    };
    let mut inputs = args.suite.read_for(&judging)?;
    if !options.whole {
        let graded: HashSet<&str> = old.scenes().collect();
        inputs.suite.cases.retain(|case| graded.contains(case.id.as_str()));
    }
    let oracle = open_oracle(&inputs.expected)?;
    let run = RunArgs {
        unprotected: options.unprotected,
        limit: options.limits.clone(),
        readable: options.readable.iter().map(Into::into).collect(),
    };
    let path = args.submission.as_deref().or(old.path().map(Path::new));
    let progress = Progress::new(!args.no_progress, interrupt.clone());
    progress.notice(Event::Task(Task::Opening));
    let provenance = provenance(&inputs, &oracle, options.clone(), path)?;
    let (submission, protection) = match path {
        None => (Submission::BuiltIn(LinearSolver::Auto), None),
        Some(path) if path.exists() => open_path(path, &run, &inputs, &[])?,
        Some(path) => {
            return Err(Stop::bad_input(format!(
                "{}: the submission of the report is not there\n  help: name it: grade verify-report {file} SUBMISSION",
                path.display()
            )));
        }
    };
    let checks = Checks {
        jacobians: options.jacobians,
        probe: options.jacobians && options.whole,
        altered: options.whole,
        hidden: options.whole,
        is_alone: false,
        recordings: false,
    };
    let mut grading = inputs.grader(&oracle, checks, &progress).grade(&submission, protection);
    if let Some(marks) = old.marks() {
        grading.add_marks(inputs.rubric.creative(), marks);
    }
    drop(progress);
    interrupt.check("the report was not verified")?;
    grading.provenance = Some(provenance);
    let new = report::json::render(&grading).map_err(Stop::fault)?;
    let new = StoredReport::parse(&new).map_err(Stop::fault)?;
    let (inputs, results) = (old.changed_inputs(&new), old.different_results(&new));
    let mut text = String::new();
    for (title, lines) in [("Inputs that changed:", &inputs), ("Results that differ:", &results)] {
        if !lines.is_empty() {
            text += &format!("{title}\n");
            lines.iter().for_each(|line| text += &format!("  {line}\n"));
        }
    }
    let same_inputs =
        if inputs.is_empty() { "from the same inputs" } else { "from changed inputs" };
    text += &match results.is_empty() {
        true => {
            format!("{}: the same verdicts and points come out, {same_inputs}\n", old.submission)
        }
        false => {
            let count = results.len();
            format!("{}: verdicts and points that differ: {count}, {same_inputs}\n", old.submission)
        }
    };
    print(text.as_bytes())?;
    Ok(if results.is_empty() { Exit::Passed } else { Exit::Failed })
}
