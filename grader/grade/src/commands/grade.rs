//! `grade`: grades one submission on the suite.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::parser::ValueSource;
use grader::boundary::seal::Secret;
use grader::grading::events::{Event, Observer, Task};
use grader::grading::{Checks, GradingOutcome};
use grader::submission::Submission;
use platforms::gradescope::score::Score;
use platforms::shell_word;
use sandbox::Protection;
use simulator::solver::linear::LinearSolver;

use crate::args::{Format, JudgeArgs, OnlyArgs, ReportArgs, RunArgs, SuiteArgs, VerboseArgs};
use crate::commands::explain::ExplainArgs;
use crate::inputs::{Inputs, Judging, open_oracle};
use crate::interrupt::Interrupt;
use crate::last_failed;
use crate::platform::{Platforms, read_metadata};
use crate::progress::Progress;
use crate::provenance::{options, provenance};
use crate::reports::{ReportArg, Reports, Shown};
use crate::scenes::{Scenes, slowest};
use crate::stop::{Exit, Stop, complain};
use crate::submission::{named_assignment, open_handed_in, open_path, open_traces};
use crate::watch;

#[derive(Args)]
pub(crate) struct GradeArgs {
    /// Submission to grade: a program (run as `PROGRAM -s SCENE -d 0 -o TRACE` or `PROGRAM SCENE -o TRACE`), a folder
    /// with submission.toml, or a folder of traces [default: the built-in simulator]
    #[arg(value_name = "SUBMISSION")]
    submission: Option<PathBuf>,

    /// Grade the traces in this folder (GROUP/SCENE.csv or .bin); run no program
    #[arg(long, value_name = "DIR", conflicts_with = "submission")]
    traces: Option<PathBuf>,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    only: OnlyArgs,

    /// Grade only the scenes that did not pass the last time
    #[arg(long, conflicts_with = "only")]
    last_failed: bool,

    /// End the run after this many scenes that did not pass (text only)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    fail_fast: Option<u32>,

    /// Show the slowest scenes with their times on standard error
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    durations: Option<u32>,

    /// Grade again whenever the program, or a file of the submission's folder, changes
    #[arg(long, requires = "submission", conflicts_with_all = ["threads", "output"])]
    watch: bool,

    /// Write a report (repeatable): text, json or junit, with =FILE to a file, else to standard output; html=PATH;
    /// gradescope=FILE; prairielearn=FILE; classroom50=FILE; or github, in a step of GitHub Actions
    #[arg(long, value_name = "KIND[=FILE]", value_parser = ReportArg::parse, conflicts_with_all = ["format", "output"])]
    report: Vec<ReportArg>,

    #[command(flatten)]
    only_report: ReportArgs<Format>,

    /// Write the report as pages too, with the motion of every scene: to a folder, or all in one file if the name ends
    /// in .html; same as --report html=PATH
    #[arg(long, value_name = "PATH")]
    html: Option<PathBuf>,

    /// Gradescope's submission_metadata.json: when the submission came in, its deadline, earlier points
    #[arg(long, value_name = "FILE", requires = "report")]
    metadata: Option<PathBuf>,

    #[command(flatten)]
    judge: JudgeArgs,

    #[command(flatten)]
    verbose: VerboseArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl GradeArgs {
    /// The reports to write; those of `--format`, `--output` and `--html` in their long form.
    fn reports(&self) -> Vec<ReportArg> {
        let mut reports = self.report.clone();
        if reports.is_empty() {
            let ReportArgs { format, output } = &self.only_report;
            reports.push(ReportArg::Plain(*format, output.clone()));
        }
        reports.extend(self.html.clone().map(ReportArg::Html));
        reports
    }

    /// Whether a platform hands the submission over: a defect of it is then a verdict, not wrong usage.
    fn is_handed_in(&self) -> bool {
        let is_folder = self.submission.as_ref().is_some_and(|submission| submission.is_dir());
        self.report.iter().any(|report| match report {
            ReportArg::Gradescope(_) | ReportArg::Prairielearn(_) => true,
            ReportArg::Github | ReportArg::Classroom50(_) => is_folder,
            ReportArg::Plain(..) | ReportArg::Html(_) => false,
        })
    }

    /// Grades the submission; with `--watch`, again after each change.
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let interrupt = Interrupt::listen()?;
        let Some(submission) = self.submission.as_deref().filter(|_| self.watch) else {
            return self.grade_once(&interrupt);
        };
        loop {
            let files = watch::files(submission);
            let graded = self.grade_once(&interrupt);
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

    fn grade_once(&self, interrupt: &Interrupt) -> Result<Exit, Stop> {
        let platforms = Platforms::begin(&self.reports())?;
        let graded = self.grade_and_report(interrupt, &platforms);
        if let Err(stop) = &graded {
            platforms.write_not_graded(stop, || self.kept_score());
        }
        graded
    }

    /// The points that a submission keeps that was not graded; `None` if an input for them cannot be read.
    fn kept_score(&self) -> Option<Score> {
        let metadata = read_metadata(self.metadata.as_deref()?).ok()?;
        let inputs = self.suite.read_for(&self.judge.judging()).ok()?;
        Some(Score::not_graded(inputs.rubric.platform(), &metadata))
    }

    fn grade_and_report(&self, interrupt: &Interrupt, platforms: &Platforms) -> Result<Exit, Stop> {
        let metadata = self.metadata.as_deref().map(read_metadata).transpose()?;
        // On a platform, nobody looks at what the submission chose.
        let chooses = self.submission.as_deref().filter(|_| !self.is_handed_in());
        let of_submission = chooses.and_then(named_assignment);
        let judging = Judging { of_submission: of_submission.as_deref(), ..self.judge.judging() };
        let mut inputs = self.suite.read_for(&judging)?;
        if platforms.refuses(inputs.rubric.platform(), metadata.as_ref())? {
            complain("note", "over the limit of submissions; not graded");
            return Ok(Exit::Failed);
        }
        let path = self.submission.as_deref().or(self.traces.as_deref());
        let record = last_failed::file(path, &inputs.expected);
        let only = self.choose(&inputs, record.as_deref());
        let is_whole = only.is_empty();
        if !is_whole {
            let total = inputs.suite.cases.len();
            inputs.suite.keep_only(&only).map_err(Stop::bad_input)?;
            complain("note", format!("{} of {total} scenes are graded", inputs.suite.cases.len()));
        }
        let oracle = open_oracle(&inputs.expected)?;
        let reports = Reports::open(self.reports(), self.verbose.amount(), self.arguments())?;
        if self.fail_fast.is_some() && !(reports.can_be_partial() && platforms.is_empty()) {
            return Err(Stop::bad_input(
                "--fail-fast ends a run before it is complete\n  help: it works with text reports",
            ));
        }
        let progress = Progress::new(!self.judge.no_progress, interrupt.clone());
        progress.notice(Event::Task(Task::Opening));
        let provenance =
            provenance(&inputs, &oracle, options(&self.judge, &self.run, is_whole), path)?;
        let opened = self.open(&inputs);
        interrupt.check("the submission was still being built; no scene was graded")?;
        let (submission, protection) = opened?;
        // With --only, run nothing but the chosen scenes.
        let secret = Secret::random().map_err(Stop::fault)?;
        let checks = Checks {
            jacobians: !self.judge.no_jacobians,
            probe: !self.judge.no_jacobians && is_whole,
            altered: is_whole.then_some(secret),
            hidden: is_whole,
            is_alone: self.is_handed_in(),
            recordings: reports.need_recordings(),
        };
        let scenes = Scenes::new(&progress, self.fail_fast.map(|count| count as usize));
        let mut grader = inputs.grader(&oracle, checks, &scenes);
        grader.functions = grader.functions.filter(|_| is_whole);
        let mut grading = grader.grade(&submission, protection);
        grading.provenance = Some(provenance);
        let (has_ended, times, failed) = (scenes.has_ended(), scenes.times(), scenes.failed());
        drop(progress);
        if is_whole && !grading.is_own && grading.interrupted.is_none() {
            grading.fitting = inputs.fitting(&grading);
        }
        grading.since = record.as_deref().and_then(|record| last_failed::store(record, &grading));
        if let Some(interrupted) = &mut grading.interrupted {
            interrupted.fail_fast = has_ended && !interrupt.is_requested();
        }
        let shown = Shown {
            grading: &grading,
            times: &times,
            suite: &inputs.suite,
            rubric: &inputs.rubric,
        };
        if let Some(interrupted) = grading.interrupted {
            reports.write_partial(shown)?;
            if !interrupted.fail_fast {
                return Err(Stop(Exit::Interrupted, interrupted.to_string()));
            }
            complain("note", format!("ended by --fail-fast: {interrupted}"));
            let arguments = self.arguments();
            for scene in failed {
                let explain = arguments.as_ref().map(|arguments| {
                    format!("\n  help: `grade explain {scene} {arguments}` explains it")
                });
                complain("note", format!("{scene} did not pass{}", explain.unwrap_or_default()));
            }
            return Ok(Exit::Failed);
        }
        reports.write(shown)?;
        platforms.write(shown, metadata.as_ref(), self.verbose.details())?;
        for (time, scene) in slowest(&times, self.durations.unwrap_or(0) as usize) {
            complain("note", format!("{:8.3} s  {scene}", time.as_secs_f64()));
        }
        Ok(match grading.outcome() {
            // Without the hidden scenes, this is the best result possible.
            GradingOutcome::Passed | GradingOutcome::PassedShipped => Exit::Passed,
            GradingOutcome::Failed => Exit::Failed,
            GradingOutcome::GraderFault => Exit::GraderFault,
        })
    }

    /// The submission and the options by which other commands find and run it; `None` for the built-in simulator.
    fn arguments(&self) -> Option<String> {
        let path = self.submission.as_ref().or(self.traces.as_ref())?;
        let mut words = vec![quoted(path)];
        let given = Self::augment_args(clap::Command::new("grade"));
        let given = given.try_get_matches_from(std::env::args_os()).ok()?;
        // The options that `explain` takes too decide what is graded, and how.
        let shared = ExplainArgs::augment_args(clap::Command::new("explain"));
        for option in shared.get_arguments() {
            let (id, Some(long)) = (option.get_id().as_str(), option.get_long()) else { continue };
            let is_given = given.value_source(id) == Some(ValueSource::CommandLine);
            if !is_given || ["no_progress", "threads"].contains(&id) {
                continue;
            }
            if option.get_action().takes_values() {
                let values = given.get_raw(id).into_iter().flatten();
                words.extend(values.map(|value| format!("--{long} {}", quoted(value.as_ref()))));
            } else {
                words.push(format!("--{long}"));
            }
        }
        Some(words.join(" "))
    }

    /// The submission, and, if it runs programs, the protections in force.
    fn open(&self, inputs: &Inputs) -> Result<(Submission, Option<Vec<Protection>>), Stop> {
        if let Some(folder) = &self.traces {
            if !folder.is_dir() {
                return Err(Stop::about(folder)("folder not found"));
            }
            return open_traces(folder, inputs);
        }
        let Some(path) = &self.submission else {
            return Ok((Submission::BuiltIn(LinearSolver::Auto), None));
        };
        if self.is_handed_in() {
            return open_handed_in(path, &self.run, inputs);
        }
        let pages = |report| if let ReportArg::Html(folder) = report { Some(folder) } else { None };
        let pages: Vec<PathBuf> = self.reports().into_iter().filter_map(pages).collect();
        open_path(path, &self.run, inputs, &pages)
    }

    /// The patterns of the scenes to grade; none for all scenes.
    fn choose(&self, inputs: &Inputs, record: Option<&Path>) -> Vec<String> {
        if !self.last_failed {
            return self.only.only.clone();
        }
        let known = record.map(last_failed::load).unwrap_or_default();
        let names = inputs.suite.cases.iter().map(|case| case.id.clone());
        let chosen: Vec<String> = names.filter(|name| known.contains(name)).collect();
        if chosen.is_empty() {
            complain("note", "no failed scene is known from before; all scenes are graded");
        }
        chosen
    }
}

/// A path as a word of a shell.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "-_./+,:@=%".contains(c);
    if text.chars().all(is_plain) { text } else { shell_word(&text) }
}
