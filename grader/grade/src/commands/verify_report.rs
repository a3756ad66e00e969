//! `grade verify-report`: grades a submission again, and compares with a report.
//!
//! The report is a file of a student. It selects the assignment and the scenes; programs have the rights, and scenes the
//! tolerances, of this command line.

use std::path::PathBuf;

use clap::Args;
use grader::boundary::door::Door;
use grader::boundary::printed::RawUse;
use grader::boundary::seal::Secret;
use grader::grading::events::{Event, Observer, Task};
use grader::grading::{Checks, Hidden, NotRunReason};
use grader::suite::assignment::ALL;
use report::provenance::StoredReport;

use crate::args::{JudgeArgs, RunArgs, SuiteArgs};
use crate::inputs::{Judging, open_oracle};
use crate::interrupt::Interrupt;
use crate::output::print;
use crate::progress::Progress;
use crate::provenance::{options, provenance};
use crate::stop::{Exit, Stop};
use crate::submission::open_path;

/// Maximum number of lines of a list of differences: a report may name any number of scenes.
const SHOWN: usize = 200;

/// Grade the submission of a JSON report again: which inputs changed, and do the same verdicts and points come out?
#[derive(Args)]
#[command(mut_arg("assignment", |arg| arg.help("Grade again for this assignment [default: that of the report]")))]
#[command(after_help = "\
Examples:
  grade verify-report reports/ada.json hand-ins/ada

Exit codes: 0 the same comes out, 1 something differs, 2 bad usage or input, 3 grader fault, 130 interrupted (Ctrl-C).")]
pub(crate) struct VerifyReportArgs {
    /// The report, as JSON
    #[arg(value_name = "FILE")]
    report: PathBuf,

    /// The submission to grade again: a program, a folder with submission.toml, or a folder of traces
    #[arg(value_name = "SUBMISSION")]
    submission: PathBuf,

    #[command(flatten)]
    judge: JudgeArgs,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl VerifyReportArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let interrupt = Interrupt::listen()?;
        let (file, path) = (self.report.display(), self.submission.as_path());
        let text = Door::Report.text(&self.report);
        let text = text.map_err(Stop::about(&self.report))?;
        let old = StoredReport::parse(&text);
        let old = old.map_err(|error| Stop::bad_input(format!("{file}:{error}")))?;
        let judge = &self.judge;
        // A report without an assignment is one of every scene, whatever the rubric says now.
        let of_report = old.assignment.as_ref().map_or(ALL, |name| name.raw(RawUse::Comparison));
        let assignment = Some(judge.assignment.as_deref().unwrap_or(of_report));
        let mut inputs = self.suite.read_for(&Judging { assignment, ..judge.judging() })?;
        let all = inputs.suite.cases.len();
        if !old.is_whole() {
            inputs.suite.cases.retain(|case| old.has_scene(&case.id));
        }
        let marks = old.marks();
        let rule = inputs.rubric.creative();
        let is_mark = |mark: &f64| rule.mark(&mark.to_string()).is_ok();
        if !marks.iter().copied().flatten().flatten().all(is_mark) {
            return Err(Stop::bad_input(format!(
                "{file}: a mark of the creative scene is out of range"
            )));
        }
        let oracle = open_oracle(&inputs.expected)?;
        let progress = Progress::new(!judge.no_progress, interrupt.clone());
        progress.notice(Event::Task(Task::Opening));
        let options = options(judge, &self.run, old.is_whole());
        let provenance = provenance(&inputs, &oracle, options, Some(path))?;
        let (submission, protection) = open_path(path, &self.run, &inputs, &[])?;
        let secret = Secret::random().map_err(Stop::fault)?;
        let checks = Checks {
            jacobians: !judge.no_jacobians,
            probe: !judge.no_jacobians && old.is_whole(),
            altered: old.is_whole().then_some(secret),
            hidden: old.is_whole(),
            is_alone: false,
            recordings: false,
        };
        let mut grader = inputs.grader(&oracle, checks, &progress);
        grader.functions = grader.functions.filter(|_| old.is_whole());
        let mut grading = grader.grade(&submission, protection);
        if let Some(marks) = marks {
            grading.add_marks(rule, marks);
        }
        drop(progress);
        interrupt.check("the report was not verified")?;
        grading.provenance = Some(provenance);
        let new = report::json::render(&grading).map_err(Stop::fault)?;
        let new = StoredReport::parse(&new.into()).map_err(Stop::fault)?;
        let mut text = format!("Graded again: {}\n", path.display());
        let unknown = || "unknown".to_owned();
        let (then, now) = (old.files(), new.files());
        let same = if then == now { "as in the report" } else { "not those of the report" };
        text += &format!("  files: {}, {same}\n", now.unwrap_or_else(unknown));
        let names = |protection: &Vec<sandbox::Protection>| {
            protection.iter().map(|protection| protection.name()).collect::<Vec<_>>().join(" ")
        };
        text += &match &grading.protection {
            None => "  protection: not needed, no program ran\n".to_owned(),
            Some(protection) if protection.is_empty() => "  protection: none\n".to_owned(),
            Some(protection) => format!("  protection: {}\n", names(protection)),
        };
        let graded = inputs.suite.cases.len();
        let selected = if old.is_whole() { "" } else { ", the selection of the report" };
        text += &format!("  scenes: {graded} of {all}{selected}\n");
        if let Hidden::NotRun { reason: NotRunReason::WithoutNamespaces, .. } = &grading.hidden {
            text +=
                "  hidden scenes: not run, for the system refuses programs their own namespaces\n";
        }
        if let Some(adjusted) = old.adjusted() {
            text += &format!(
                "  adjustments: {adjusted} points, which only the report says; compare them with the teacher's file\n"
            );
        }
        if marks.is_some() {
            text +=
                "  marks of the creative scene: those of the report; compare them with the sheet\n";
        }
        let (inputs, results) = (old.changed_inputs(&new), old.different_results(&new));
        for (title, lines) in
            [("Inputs that changed:", &inputs), ("Results that differ:", &results)]
        {
            if !lines.is_empty() {
                text += &format!("{title}\n");
                lines.iter().take(SHOWN).for_each(|line| text += &format!("  {line}\n"));
            }
            if lines.len() > SHOWN {
                text += &format!("  and {} more\n", lines.len() - SHOWN);
            }
        }
        let parts = old.different_parts(&new);
        if results.is_empty() && !parts.is_empty() {
            let parts = parts.join(", ");
            text +=
                &format!("Parts that differ, whose numbers may depend on the machine: {parts}\n");
        }
        let same_inputs =
            if inputs.is_empty() { "from the same inputs" } else { "from changed inputs" };
        let path = path.display();
        text += &match results.len() {
            0 => format!("{path}: the same verdicts and points come out, {same_inputs}\n"),
            count => format!("{path}: verdicts and points that differ: {count}, {same_inputs}\n"),
        };
        print(text.as_bytes())?;
        Ok(Exit::of(results.is_empty()))
    }
}
