//! The command line.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, FromArgMatches, Id, Parser, Subcommand, ValueEnum};
use grader::rubric::CriteriaName;
use grader::submission::init::Language;
use grader::time::Time;
use grader::white_box;
use platforms::gradebook::GradebookKind;
use sandbox::Limits;
use simulator::force;

/// Grade a mass-spring simulator, feature by feature, against oracle traces.
///
/// Without arguments, grade the built-in simulator on every scene of assets/ and extracreditassets/ against the
/// traces in expected/, and check the Jacobians of every force.
#[derive(Parser)]
#[command(name = "grade", version, args_conflicts_with_subcommands = true)]
#[command(
    after_help = "Exit codes: 0 all required features passed, 1 one failed, 2 bad usage or input, 3 grader fault or a full \
                  standard output, 130 interrupted (Ctrl-C)."
)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Option<Command>,

    #[command(flatten)]
    pub(super) grade: GradeArgs,
}

#[derive(Subcommand)]
pub(super) enum Command {
    /// Grade every submission in a folder, here or on a cluster: one report each, and a summary table
    #[command(
        args_conflicts_with_subcommands = true,
        subcommand_negates_reqs = true,
        after_help = "Exit codes: 0 all graded, whatever their verdicts; 2 bad usage or input; 3 something could \
                      not be judged or written; 130 some are not graded (Ctrl-C, or a result is missing); continue \
                      with --resume."
    )]
    Class(ClassCommand),
    /// List the assignments with their features and points, or show one
    Assignments {
        /// Name of the assignment to show
        #[arg(value_name = "NAME")]
        name: Option<String>,

        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Explain one scene that failed: the findings, the first step that is wrong by itself, and its equation with the numbers put in
    #[command(
        after_help = "Exit codes: 0 the scene passed, 1 it failed, 2 bad usage or input, 3 it could not be judged, 130 \
                      interrupted (Ctrl-C)."
    )]
    Explain(ExplainArgs),
    /// Grade the submission of a JSON report again: which inputs changed, and do the same verdicts and points come out?
    #[command(
        after_help = "Exit codes: 0 the same comes out, 1 something differs, 2 bad usage or input, 3 grader fault, 130 \
                      interrupted (Ctrl-C)."
    )]
    VerifyReport(VerifyReportArgs),
    /// Check creative scenes: name, format, features, run, overlaps, film
    Creative(CreativeArgs),
    /// Show all creative scenes of a folder as one page, with a sheet for marks
    Gallery(GalleryArgs),
    /// Check the Jacobians of each force, block by block: correct, wrong or inconclusive
    Jacobians(JacobianArgs),
    /// Measure error against computing time for every integrator, over a ladder of time steps
    Accuracy(AccuracyArgs),
    /// Write a working skeleton of a submission, with the protocol explained in comments
    Init {
        /// Language of the skeleton
        #[arg(value_name = "LANG", value_parser = PossibleValuesParser::new(Language::ALL.map(Language::name)))]
        language: String,

        /// Folder for the skeleton, created if missing
        #[arg(value_name = "DIR", default_value = "my-simulator")]
        folder: PathBuf,

        /// The assignment that it is for; `grade assignments` lists them [default: every scene]
        #[arg(long, value_name = "NAME")]
        assignment: Option<String>,

        /// Folder with assets/, where the assignments are [default: the current folder or the nearest parent with
        /// assets/]
        #[arg(long, value_name = "DIR")]
        root: Option<PathBuf>,
    },
    /// Run hard cases and compare with the expected outcomes; compare stability boundaries with theory
    Stability(StabilityArgs),
    /// Show the buffers that each scene needs, and the extra cost of the general code path
    Needs {
        /// Measure only these scenes (repeatable): a name, a group, an integrator, a pattern with * and ?, or a part of
        /// names
        #[arg(long, value_name = "PATTERN")]
        only: Vec<String>,

        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Test the grader: planted mistakes must be caught and named, correct variants must pass
    Selftest(SelfTestArgs),
    /// Write what a course uploads to a platform, so that the platform grades with grade
    #[command(subcommand)]
    Export(ExportCommand),
    /// Regenerate or verify the oracle traces; draw hidden scenes
    #[command(subcommand)]
    Oracle(OracleCommand),
}

#[derive(Args)]
pub(super) struct GradeArgs {
    /// Submission to grade: a program (run as `PROGRAM -s SCENE -d 0 -o TRACE` or `PROGRAM SCENE -o TRACE`), a folder
    /// with submission.toml, or a folder of traces [default: the built-in simulator]
    #[arg(value_name = "SUBMISSION")]
    pub(super) submission: Option<PathBuf>,

    /// Grade the traces in this folder (GROUP/SCENE.csv or .bin); run no program
    #[arg(long, value_name = "DIR", conflicts_with = "submission")]
    pub(super) traces: Option<PathBuf>,

    #[command(flatten)]
    pub(super) run: RunArgs,

    /// Grade only these scenes (repeatable): a name (Spring/two-springs), a group (Spring), an integrator, a pattern
    /// with * and ?, the start of a name (Spring/two), or, without a /, a part of names (two)
    #[arg(long, value_name = "PATTERN")]
    pub(super) only: Vec<String>,

    /// Grade only the scenes that did not pass the last time
    #[arg(long, conflicts_with = "only")]
    pub(super) last_failed: bool,

    /// End the run after this many scenes that did not pass (text only)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) fail_fast: Option<u32>,

    /// Show the slowest scenes with their times on standard error
    #[arg(long, value_name = "N")]
    pub(super) durations: Option<usize>,

    /// Grade again whenever the program, or a file of the submission's folder, changes
    #[arg(long, requires = "submission", conflicts_with_all = ["threads", "output"])]
    pub(super) watch: bool,

    /// Write a report (repeatable): text, json or junit, with =FILE to a file, else to standard output; html=DIR;
    /// gradescope=FILE; prairielearn=FILE; or github, in a step of GitHub Actions
    #[arg(long, value_name = "KIND[=FILE]", value_parser = parse_report, conflicts_with_all = ["format", "output"])]
    pub(super) report: Vec<ReportArg>,

    /// Format of the only report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(super) format: Format,

    /// Write the only report to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Write the report as pages to this folder too, with the motion of every scene; same as --report html=DIR
    #[arg(long, value_name = "DIR")]
    pub(super) html: Option<PathBuf>,

    /// Gradescope's submission_metadata.json: when the submission came in, its deadline, earlier points
    #[arg(long, value_name = "FILE", requires = "report")]
    pub(super) metadata: Option<PathBuf>,

    #[command(flatten)]
    pub(super) judge: JudgeArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

#[derive(Args)]
pub(super) struct ExplainArgs {
    /// The scene: GROUP/SCENE, as reports name it, or the path of its file
    #[arg(value_name = "SCENE")]
    pub(super) scene: String,

    /// Submission: a program, a folder with submission.toml, or a folder of traces. All its scenes are graded, as a
    /// mistake is proven by many
    #[arg(value_name = "SUBMISSION")]
    pub(super) submission: PathBuf,

    #[command(flatten)]
    pub(super) run: RunArgs,

    #[command(flatten)]
    pub(super) judge: JudgeArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

#[derive(Args)]
pub(super) struct VerifyReportArgs {
    /// The report, as JSON
    #[arg(value_name = "FILE")]
    pub(super) report: PathBuf,

    /// The submission to grade again: a program, a folder with submission.toml, or a folder of traces
    #[arg(value_name = "SUBMISSION")]
    pub(super) submission: PathBuf,

    /// Grade again for this assignment [default: that of the report]
    #[arg(long, value_name = "NAME")]
    pub(super) assignment: Option<String>,

    /// Folder of hidden scenes [default: the rubric's folder]
    #[arg(long, value_name = "DIR")]
    pub(super) hidden: Option<PathBuf>,

    /// Tolerances for scenes for which the rubric sets none [default: the rubric's criteria, else calibrated]
    #[arg(long, value_enum, value_name = "NAME")]
    pub(super) criteria: Option<CriteriaArg>,

    /// Skip the checks of Jacobians
    #[arg(long)]
    pub(super) no_jacobians: bool,

    /// Hide the progress line
    #[arg(long)]
    pub(super) no_progress: bool,

    #[command(flatten)]
    pub(super) run: RunArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

/// A report that `--report` asks for.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct ReportArg {
    pub(super) kind: ReportKind,
    /// The file, or the folder of pages; `None` for the standard output.
    pub(super) file: Option<PathBuf>,
}

/// Kinds of reports of a grading.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ReportKind {
    /// A format that stands alone.
    Plain(Format),
    /// Pages, in a folder.
    Html,
    /// Results for Gradescope.
    Gradescope,
    /// Results for PrairieLearn.
    Prairielearn,
    /// Summary, annotations and points, where the environment of GitHub Actions says.
    Github,
}

pub(super) fn parse_report(text: &str) -> Result<ReportArg, String> {
    let (name, file) = match text.split_once('=') {
        Some((name, file)) => (name, Some(PathBuf::from(file))),
        None => (text, None),
    };
    let kind = match name {
        "html" => ReportKind::Html,
        "gradescope" => ReportKind::Gradescope,
        "prairielearn" => ReportKind::Prairielearn,
        "github" => ReportKind::Github,
        _ => ReportKind::Plain(Format::from_str(name, false).map_err(|_| {
            format!(
                "unknown report {name:?}; the reports are text, json, junit, html and gradescope"
            )
        })?),
    };
    match (kind, &file) {
        (_, Some(file)) if file.as_os_str().is_empty() => Err("no file after =".to_owned()),
        (ReportKind::Html, None) => Err("pages need a folder: html=DIR".to_owned()),
        (ReportKind::Gradescope | ReportKind::Prairielearn, None) => {
            Err(format!("the results need a file: {name}=results.json"))
        }
        (ReportKind::Github, Some(_)) => {
            Err("the files are those that GitHub Actions names: leave out the file".to_owned())
        }
        _ => Ok(ReportArg { kind, file }),
    }
}

impl GradeArgs {
    /// The reports to write; those of `--format`, `--output` and `--html` in their long form.
    pub(super) fn reports(&self) -> Vec<ReportArg> {
        let mut reports = self.report.clone();
        if reports.is_empty() {
            let kind = ReportKind::Plain(self.format);
            reports.push(ReportArg { kind, file: self.output.clone() });
        }
        let html = self.html.iter().cloned();
        reports.extend(html.map(|html| ReportArg { kind: ReportKind::Html, file: Some(html) }));
        reports
    }

    /// Whether a platform hands the submission over: a defect of it is then a verdict, not wrong usage.
    pub(super) fn is_handed_in(&self) -> bool {
        let is_folder = self.submission.as_ref().is_some_and(|submission| submission.is_dir());
        self.report.iter().any(|report| match report.kind {
            ReportKind::Gradescope | ReportKind::Prairielearn => true,
            ReportKind::Github => is_folder,
            ReportKind::Plain(_) | ReportKind::Html => false,
        })
    }
}

/// How a submission is graded, alone or in a class.
#[derive(Args)]
pub(super) struct JudgeArgs {
    /// Grade only what this assignment asks for; `grade assignments` lists them [default: the rubric's assignment,
    /// else that of submission.toml, else all]
    #[arg(long, value_name = "NAME")]
    pub(super) assignment: Option<String>,

    /// Folder of hidden scenes: assets/ or extracreditassets/, and expected/. Hidden scenes count for points; reports
    /// show only their verdicts [default: the rubric's folder]
    #[arg(long, value_name = "DIR")]
    pub(super) hidden: Option<PathBuf>,

    /// Tolerances for scenes for which the rubric sets none [default: the rubric's criteria, else calibrated]
    #[arg(long, value_enum, value_name = "NAME")]
    pub(super) criteria: Option<CriteriaArg>,

    /// Skip the checks of Jacobians
    #[arg(long)]
    pub(super) no_jacobians: bool,

    /// Number of failed scenes to explain in detail (text only)
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub(super) details: usize,

    /// Hide the progress line (shown only if standard error is a terminal and CI is not set)
    #[arg(long)]
    pub(super) no_progress: bool,
}

/// What is graded, and how, as far as the command line says so.
#[derive(Default)]
pub(super) struct Judging<'a> {
    /// The folder of the hidden scenes.
    pub(super) hidden: Option<&'a Path>,
    /// The criteria for scenes for which the rubric sets no tolerance.
    pub(super) criteria: Option<CriteriaArg>,
    /// The name of the assignment.
    pub(super) assignment: Option<&'a str>,
    /// The name of the assignment in submission.toml, which counts if nothing else names one.
    pub(super) of_submission: Option<&'a str>,
}

impl JudgeArgs {
    /// What is graded, and how.
    pub(super) fn judging(&self) -> Judging<'_> {
        Judging {
            hidden: self.hidden.as_deref(),
            criteria: self.criteria,
            assignment: self.assignment.as_deref(),
            of_submission: None,
        }
    }
}

/// A whole class, or a part of a plan. Options of the one are not those of the other, which derives cannot express.
pub(super) enum ClassCommand {
    Whole(Box<ClassArgs>),
    Similar(SimilarArgs),
    Part(ClassPart),
}

impl FromArgMatches for ClassCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        match matches.subcommand() {
            Some(_) => ClassPart::from_arg_matches(matches).map(Self::Part),
            None if matches.get_flag("similar") => {
                refuse_beside_similar(matches)?;
                SimilarArgs::from_arg_matches(matches).map(Self::Similar)
            }
            None => ClassArgs::from_arg_matches(matches).map(|args| Self::Whole(Box::new(args))),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Refuses options that a comparison of hand-ins has no use for.
fn refuse_beside_similar(matches: &ArgMatches) -> Result<(), clap::Error> {
    let used = ["folder", "output", "similar", "starter", "root"];
    // Groups have the names of types.
    let is_given = |id: &str| {
        id.starts_with(char::is_lowercase)
            && matches.value_source(id) == Some(ValueSource::CommandLine)
    };
    match matches.ids().map(Id::as_str).find(|id| !used.contains(id) && is_given(id)) {
        None => Ok(()),
        Some(id) => Err(clap::Error::raw(
            clap::error::ErrorKind::ArgumentConflict,
            format!(
                "--{} cannot be used with --similar, which grades nothing\n",
                id.replace('_', "-")
            ),
        )),
    }
}

impl Args for ClassCommand {
    fn augment_args(command: clap::Command) -> clap::Command {
        let command = ClassPart::augment_subcommands(ClassArgs::augment_args(command));
        command.subcommand_required(false).arg_required_else_help(false)
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

/// A part of a plan. Parts can run anywhere, in any order, at the same time and more than once.
#[derive(Subcommand)]
pub(super) enum ClassPart {
    /// Grade the submissions of a shard that have no result yet
    RunShard {
        /// The plan: plan.json in the folder of the results
        #[arg(value_name = "PLAN")]
        plan: PathBuf,

        /// Number of the shard, from 0
        #[arg(value_name = "K")]
        shard: usize,

        /// Run the hidden scenes, after the shards have run without this option
        #[arg(long)]
        hidden_scenes: bool,

        /// Number of threads [default: as planned, else one per core]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
        threads: Option<u16>,
    },
    /// Write the summary of a plan from the results that there are
    Merge {
        /// The plan: plan.json in the folder of the results
        #[arg(value_name = "PLAN")]
        plan: PathBuf,

        /// As for the whole class; without a roster, those of the plan
        #[command(flatten)]
        gradebook: GradebookArgs,
    },
}

/// A gradebook that `--gradebook` asks for.
#[derive(Clone)]
pub(super) struct GradebookArg {
    pub(super) kind: GradebookKind,
    pub(super) file: PathBuf,
}

fn parse_gradebook(text: &str) -> Result<GradebookArg, String> {
    let (name, file) = text.split_once('=').unwrap_or((text, ""));
    let kind = GradebookKind::ALL.into_iter().find(|kind| kind.name() == name);
    let kind = kind.ok_or_else(|| {
        let names = GradebookKind::ALL.map(GradebookKind::name).join(" and ");
        format!("unknown gradebook {name:?}; the gradebooks are {names}")
    })?;
    match file {
        "" => Err(format!("a gradebook needs a file: {name}=FILE.csv")),
        file => Ok(GradebookArg { kind, file: file.into() }),
    }
}

/// Options for gradebooks.
#[derive(Args)]
pub(super) struct GradebookArgs {
    /// Write the points as a gradebook to import (repeatable): canvas=FILE or moodle=FILE
    #[arg(long, value_name = "KIND=FILE", value_parser = parse_gradebook, requires = "roster")]
    pub(super) gradebook: Vec<GradebookArg>,

    /// The students (CSV), by columns: name, id, login, email, section; folder and submitted of their submissions; due.
    /// Exports of Canvas and Moodle work unchanged
    #[arg(long, value_name = "FILE")]
    pub(super) roster: Option<PathBuf>,

    /// The deadline, for students without one in the roster, as in 2026-02-01T23:59:00-08:00
    #[arg(long, value_name = "TIME", requires = "roster")]
    pub(super) due: Option<Time>,

    /// Without a time in the roster, a submission came in when its newest file was last changed; students can set these
    /// times back
    #[arg(long, requires = "roster")]
    pub(super) folder_times: bool,

    /// Name of the gradebook's column of points [default: the name of the assignment]
    #[arg(long, value_name = "NAME", requires = "gradebook")]
    pub(super) column: Option<String>,
}

impl GradebookArgs {
    /// The same options with absolute paths.
    pub(super) fn absolute(&self) -> std::io::Result<Self> {
        let gradebook = self.gradebook.iter().map(|GradebookArg { kind, file }| {
            Ok(GradebookArg { kind: *kind, file: std::path::absolute(file)? })
        });
        Ok(Self {
            gradebook: gradebook.collect::<std::io::Result<_>>()?,
            roster: self.roster.as_deref().map(std::path::absolute).transpose()?,
            due: self.due,
            folder_times: self.folder_times,
            column: self.column.clone(),
        })
    }
}

/// Where a plan runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum On {
    /// On this machine
    Local,
    /// As an array of jobs of the Slurm cluster that this machine belongs to
    Slurm,
    /// Nowhere: only write the plan
    Nothing,
}

/// Options of a plan.
#[derive(Args)]
pub(super) struct PlanArgs {
    /// Where to grade
    #[arg(long, value_enum, value_name = "WHERE", default_value_t = On::Local)]
    pub(super) on: On,

    /// Number of shards, each a job of a cluster [default: 1 on this machine; else as many as take a minute each by
    /// earlier results, at most 5000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) shards: Option<u32>,

    /// Number of jobs of each array that run at the same time; Slurm limits arrays to 1000 jobs [default: no limit]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) at_once: Option<u32>,

    /// Option of sbatch for each job, as in --sbatch=--partition=short (repeatable)
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub(super) sbatch: Vec<String>,

    /// Show the progress of the jobs that an earlier command started, and the summary at their end
    #[arg(long, conflicts_with_all = ["resume", "cancel"])]
    pub(super) attach: bool,

    /// End the jobs that an earlier command started; their results stay
    #[arg(long, conflicts_with = "resume")]
    pub(super) cancel: bool,
}

/// Options of the comparison of sources: those of a class that it uses.
#[derive(Args)]
pub(super) struct SimilarArgs {
    pub(super) folder: PathBuf,
    pub(super) output: Option<PathBuf>,
    pub(super) starter: Vec<PathBuf>,
    pub(super) root: Option<PathBuf>,
}

#[derive(Args)]
pub(super) struct ClassArgs {
    /// Folder of submissions: programs, folders with submission.toml; folders of traces if the rubric allows them
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,

    /// Folder for the reports (reports/NAME.txt, …), summary.txt and summary.csv, created if missing
    #[arg(short, long, value_name = "DIR", required = false, required_unless_present = "similar")]
    pub(super) output: PathBuf,

    /// Do not grade: list pairs of hand-ins that share code, for people to judge; names, comments, layout and the order
    /// of functions do not count. With --output, also as similar.txt and similar.csv
    #[arg(long)]
    pub(super) similar: bool,

    /// Folder of starter code, which does not count as shared (repeatable); nor does what grade init writes
    #[arg(long, value_name = "DIR", requires = "similar")]
    pub(super) starter: Vec<PathBuf>,

    /// Formats of the reports
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Format::Text, Format::Json])]
    pub(super) format: Vec<Format>,

    /// Write pages to this folder too: one for the class, and those of each submission
    #[arg(long, value_name = "DIR")]
    pub(super) html: Option<PathBuf>,

    /// Reuse reports of an earlier run from the output folder if submission, suite and grader are unchanged
    #[arg(long)]
    pub(super) resume: bool,

    /// The marks of creative scenes, as extra credit: the marks.csv of `grade gallery`, filled in (repeatable: one for each
    /// judge)
    #[arg(long, value_name = "FILE")]
    pub(super) marks: Vec<PathBuf>,

    /// Which scene of the marks is whose, if the gallery hides names: the file of its --hide-names
    #[arg(long, value_name = "FILE", requires = "marks")]
    pub(super) key: Option<PathBuf>,

    /// Keep the trace of every run in the output folder too (runs/); with --resume, programs then run only on scenes
    /// that are new or changed
    #[arg(long)]
    pub(super) keep_runs: bool,

    #[command(flatten)]
    pub(super) gradebook: GradebookArgs,

    #[command(flatten)]
    pub(super) plan: PlanArgs,

    #[command(flatten)]
    pub(super) run: RunArgs,

    #[command(flatten)]
    pub(super) judge: JudgeArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

#[derive(Args)]
pub(super) struct CreativeArgs {
    /// Scene file, called NAME_ASSIGNMENT.xml
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,

    /// Write a contact sheet to this file: twelve pictures of the motion (PNG)
    #[arg(long, value_name = "FILE")]
    pub(super) sheet: Option<PathBuf>,

    #[command(flatten)]
    pub(super) rules: CreativeRules,
}

#[derive(Args)]
pub(super) struct GalleryArgs {
    /// Folder of scenes, searched with its subfolders; if some are in folders called Creative, only those are shown
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,

    /// Folder for the page and for marks.csv, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,

    /// Hide the names: scenes are numbered, and this file says which is whose (CSV)
    #[arg(long, value_name = "FILE")]
    pub(super) hide_names: Option<PathBuf>,

    #[command(flatten)]
    pub(super) rules: CreativeRules,
}

/// What creative scenes are checked against.
#[derive(Args)]
pub(super) struct CreativeRules {
    /// The assignment of every scene [default: that of its name]
    #[arg(long, value_name = "NAME")]
    pub(super) assignment: Option<String>,

    /// Time limit of a run of a scene; its check takes two runs, and 10 s beside them
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) seconds: u32,

    /// Check scenes without the sandbox, with all your rights
    #[arg(long)]
    pub(super) unprotected: bool,

    /// Set a limit of the check of each scene, as in --limit memory=4G (repeatable); the limits are those of `grade`
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_limit)]
    pub(super) limit: Vec<(String, f64)>,

    /// Folder with assets/, where the assignments are [default: the current folder or the nearest parent with assets/]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,
}

/// Options for running programs.
#[derive(Args)]
pub(super) struct RunArgs {
    /// Run programs without the sandbox, with all your rights: they can read the oracle and change your files
    #[arg(long)]
    pub(super) unprotected: bool,

    /// Set a limit of each run, as in --limit wall=10 (repeatable). Limits: cpu and wall (seconds), memory, trace,
    /// stdout and stderr (bytes, or with suffix K, M or G), processes, files; budget (seconds of all runs together)
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_limit)]
    pub(super) limit: Vec<(String, f64)>,

    /// Let programs read this file or folder too (repeatable)
    #[arg(long, value_name = "PATH")]
    pub(super) readable: Vec<PathBuf>,
}

pub(super) fn parse_limit(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let (digits, factor) = match value.char_indices().next_back() {
        Some((place, 'K' | 'k')) => (&value[..place], 1024.0),
        Some((place, 'M' | 'm')) => (&value[..place], 1024.0 * 1024.0),
        Some((place, 'G' | 'g')) => (&value[..place], 1024.0 * 1024.0 * 1024.0),
        _ => (value, 1.0),
    };
    let number: f64 = digits.parse().map_err(|_| format!("{value:?} is no number"))?;
    let number = number * factor;
    Limits::default().set(name, number)?;
    Ok((name.to_owned(), number))
}

#[derive(Args)]
pub(super) struct SuiteArgs {
    /// Folder with assets/, extracreditassets/ and expected/ [default: the current folder or the nearest parent with
    /// assets/]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,

    /// Folder of the required scenes; extra-credit scenes then need --extra-credit
    #[arg(long, value_name = "DIR")]
    pub(super) assets: Option<PathBuf>,

    /// Folder of the extra-credit scenes
    #[arg(long, value_name = "DIR")]
    pub(super) extra_credit: Option<PathBuf>,

    /// Folder of the oracle traces [default: expected/ beside the required scenes]
    #[arg(long, value_name = "DIR")]
    pub(super) expected: Option<PathBuf>,

    /// Rubric with tolerances and points [default: rubric.toml in the folder of the required scenes, else the
    /// built-in rubric]
    #[arg(long, value_name = "FILE")]
    pub(super) rubric: Option<PathBuf>,

    /// Reject unknown elements and attributes of scenes instead of warning
    #[arg(long)]
    pub(super) strict: bool,

    /// Number of threads, and of programs at a time [default: one per core, and half as many more
    /// programs]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,
}

#[derive(Args)]
pub(super) struct JacobianArgs {
    /// Program, or folder with submission.toml, whose forces and Jacobians to measure [default: check the built-in
    /// simulator]
    #[arg(value_name = "SUBMISSION", conflicts_with_all = ["states", "seed", "plot"])]
    pub(super) submission: Option<PathBuf>,

    #[command(flatten)]
    pub(super) run: RunArgs,

    /// Number of random states per force and dimension, in addition to the hard ones
    #[arg(long, value_name = "N", default_value_t = white_box::Config::default().states, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) states: u32,

    /// Seed of the random states
    #[arg(long, value_name = "N", default_value_t = white_box::Config::default().seed)]
    pub(super) seed: u64,

    /// Check only this force
    #[arg(long, value_name = "TAG", value_parser = force::REGISTRY.iter().map(|kind| kind.schema.tag).collect::<Vec<_>>())]
    pub(super) force: Option<String>,

    /// Forces that the program must offer, separated by commas [default: those of its assignment, if any]
    #[arg(long, value_name = "TAG", value_delimiter = ',', requires = "submission", value_parser = force::REGISTRY.iter().map(|kind| kind.schema.tag).collect::<Vec<_>>())]
    pub(super) require: Vec<String>,

    /// Measure only the forces and dimensions of this assignment [default: that of submission.toml, else all]
    #[arg(long, value_name = "NAME", requires = "submission")]
    pub(super) assignment: Option<String>,

    /// Folder with assets/, where the assignments are [default: the current folder or the nearest parent with assets/]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(super) format: Format,

    /// Write the report to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Write the report as a page to this folder too, with the blocks as heat maps
    #[arg(long, value_name = "DIR")]
    pub(super) html: Option<PathBuf>,

    /// Show the blocks and the state for every verdict, not only for those that are not correct (text only)
    #[arg(long)]
    pub(super) details: bool,

    /// Write one plot per force (SVG) to this folder: errors of finite differences and of Taylor's test by step size
    #[arg(long, value_name = "DIR")]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Args)]
pub(super) struct AccuracyArgs {
    /// Program, or folder with submission.toml, to measure beside the built-in simulator
    #[arg(value_name = "SUBMISSION")]
    pub(super) submission: Option<PathBuf>,

    #[command(flatten)]
    pub(super) run: RunArgs,

    /// Measure only this scene (repeatable): a scene of `--list`, a scene of the suite by its name, or a file
    #[arg(long, value_name = "SCENE")]
    pub(super) scene: Vec<String>,

    /// List the scenes that are measured by default
    #[arg(long)]
    pub(super) list: bool,

    /// Use fewer time steps and repeats: half a minute for all scenes
    #[arg(long)]
    pub(super) quick: bool,

    /// Number of time steps in the ladder, each half of the one before
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=30))]
    pub(super) rungs: Option<u32>,

    /// Keep all results in this folder: measured points, so that an interrupted run can continue; the report as text,
    /// CSV and JSON; and one diagram per scene as SVG
    #[arg(long, value_name = "DIR")]
    pub(super) results: Option<PathBuf>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = AccuracyFormat::Text)]
    pub(super) format: AccuracyFormat,

    /// Write the report to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Write the report as a page to this folder too, with one diagram per scene
    #[arg(long, value_name = "DIR")]
    pub(super) html: Option<PathBuf>,

    /// Show every point of every curve (text only)
    #[arg(long)]
    pub(super) details: bool,

    /// Folder with assets/ and extracreditassets/, for scenes of the suite [default: the current folder or the nearest
    /// parent with assets/]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,
}

/// Formats of the report of `grade accuracy`.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum AccuracyFormat {
    /// For people
    Text,
    /// For spreadsheets: one row per point
    Csv,
    /// For programs; schema in docs/accuracy.schema.json
    Json,
}

#[derive(Args)]
pub(super) struct StabilityArgs {
    /// Use fewer steps and damping ratios: some seconds in all
    #[arg(long)]
    pub(super) quick: bool,

    /// Run failed cases again with fallbacks for failed steps: line search and smaller steps
    #[arg(long)]
    pub(super) robust: bool,

    /// Run only these cases, without the comparison with theory (repeatable): a name, a pattern with * and ?, or a
    /// part of names
    #[arg(long, value_name = "PATTERN")]
    pub(super) only: Vec<String>,

    /// Accept the outcomes of this run as the expected ones
    #[arg(long)]
    pub(super) accept: bool,

    /// File of the expected outcomes [default: docs/stability-expected.csv in the folder with assets/]
    #[arg(long, value_name = "FILE")]
    pub(super) expected: Option<PathBuf>,

    /// Keep finished trials in this folder, and continue an interrupted run from there
    #[arg(long, value_name = "DIR")]
    pub(super) resume: Option<PathBuf>,

    /// Write one map per method (SVG) to this folder: where it is stable, and how much it damps
    #[arg(long, value_name = "DIR")]
    pub(super) plot: Option<PathBuf>,

    /// Write the report as a page to this folder too, with the maps
    #[arg(long, value_name = "DIR")]
    pub(super) html: Option<PathBuf>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = TableFormat::Text)]
    pub(super) format: TableFormat,

    /// Write the report to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
}

/// Formats of tables.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum TableFormat {
    /// For people
    Text,
    /// For programs
    Json,
    /// For spreadsheets: one row per trial
    Csv,
}

#[derive(Subcommand)]
pub(super) enum OracleCommand {
    /// Regenerate all oracle traces with the built-in simulator; replace expected/ completely or not at all
    Regenerate {
        /// Also replace traces that changed beyond their tolerance, and remove traces without a scene: of these scenes,
        /// by the patterns of --only, or of all; the others stay
        #[arg(long, value_name = "SCENE", num_args = 0..)]
        accept: Option<Vec<String>>,

        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Walk through the changes that have to be accepted, scene by scene, on a terminal: accept, reject, skip, undo
    #[command(
        after_help = "Decisions are kept beside expected/ until they are written: run it again to continue. Exit codes: 0 \
                      nothing is left to accept, 1 something is, 2 bad usage or input."
    )]
    Review {
        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Check that expected/ matches its scenes and its manifest
    Verify {
        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Draw a hidden scene for each public one: the same features with other numbers, as well-posed, and catching the same
    /// mistakes
    #[command(
        after_help = "Whoever knows the seed can draw the same scenes: keep it as secret as the folder. Exit codes: 0 all \
                      scenes have a sibling, 2 bad usage or input, or a scene has none; nothing is written then."
    )]
    GenerateHidden(HiddenArgs),
}

#[derive(Args)]
pub(super) struct HiddenArgs {
    /// Only these scenes: a name, a group, an integrator, a pattern with * and ?, or a part of names [default: all]
    #[arg(value_name = "SCENE")]
    pub(super) scenes: Vec<String>,

    /// Only the scenes to which this assignment gives points; `grade assignments` lists them
    #[arg(long, value_name = "NAME")]
    pub(super) assignment: Option<String>,

    /// Seed of the numbers: the same seed draws the same bytes
    #[arg(long, value_name = "NUMBER")]
    pub(super) seed: u64,

    /// Write to this folder, which must not exist
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

#[derive(Subcommand)]
pub(super) enum ExportCommand {
    /// Write the zip of a Gradescope autograder, with grade, the scenes, the oracle and the rubric
    Gradescope(GradescopeArgs),
    /// Write a PrairieLearn course folder with one question, and the Dockerfile of its grader
    Prairielearn(PrairielearnArgs),
    /// Write a workflow of GitHub Actions for a template repository, with points for GitHub Classroom
    Github(GithubArgs),
}

/// What a platform's package is made from.
#[derive(Args)]
pub(super) struct ContentArgs {
    /// The assignment that is graded; `grade assignments` lists them [default: the rubric's assignment, else every scene]
    #[arg(long, value_name = "NAME")]
    pub(super) assignment: Option<String>,

    /// Folder of hidden scenes [default: the rubric's folder]
    #[arg(long, value_name = "DIR")]
    pub(super) hidden: Option<PathBuf>,

    /// Debian package that submissions need (repeatable)
    #[arg(long, value_name = "NAME", default_values = ["build-essential", "cmake", "python3"])]
    pub(super) package: Vec<String>,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

#[derive(Args)]
pub(super) struct PrairielearnArgs {
    /// Write into this course folder; its other files stay
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,

    /// The name of the image in a registry, such as course/spring-oracle
    #[arg(long, value_name = "NAME")]
    pub(super) image: String,

    /// File that students hand in (repeatable)
    #[arg(long, value_name = "NAME", default_values = ["submission.toml", "simulate.cpp"], value_parser = parse_file_name)]
    pub(super) file: Vec<String>,

    /// A grade for x86-64 Linux with glibc 2.35 or older, or static [default: this program]
    #[arg(long, value_name = "FILE")]
    pub(super) program: Option<PathBuf>,

    /// Seconds after which grade ends, so that it can still write results
    #[arg(long, value_name = "N", default_value_t = 540, value_parser = clap::value_parser!(u32).range(1..=540))]
    pub(super) seconds: u32,

    #[command(flatten)]
    pub(super) content: ContentArgs,
}

fn parse_file_name(text: &str) -> Result<String, String> {
    let expected = || "expected letters, digits, - _ and .".to_owned();
    is_file_name(text).then(|| text.to_owned()).ok_or_else(expected)
}

fn is_file_name(text: &str) -> bool {
    let is_allowed = |it: char| it.is_ascii_alphanumeric() || "-_.".contains(it);
    !text.is_empty() && text.chars().all(is_allowed)
}

#[derive(Args)]
pub(super) struct GithubArgs {
    /// Write the workflow into this repository: a folder with the files that students start from
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,

    /// The repository on GitHub that holds Spring Oracle, with the scenes and the oracle
    #[arg(long, value_name = "OWNER/NAME", value_parser = parse_repository)]
    pub(super) repository: String,

    /// Its branch, tag or commit
    #[arg(long, value_name = "NAME", default_value = "main")]
    pub(super) reference: String,

    /// The assignment that is graded; `grade assignments` lists them [default: the rubric's assignment, else every scene]
    #[arg(long, value_name = "NAME")]
    pub(super) assignment: Option<String>,

    /// Refused: students can edit the workflow, and read what it reads
    #[arg(long, value_name = "DIR", hide = true)]
    pub(super) hidden: Option<PathBuf>,

    /// Minutes after which the job ends
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=360))]
    pub(super) minutes: u32,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

fn parse_repository(text: &str) -> Result<String, String> {
    match text.split_once('/') {
        Some((owner, name)) if is_file_name(owner) && is_file_name(name) => Ok(text.to_owned()),
        _ => Err("expected OWNER/NAME".to_owned()),
    }
}

#[derive(Args)]
pub(super) struct GradescopeArgs {
    /// Write the zip to this file
    #[arg(short, long, value_name = "FILE", default_value = "autograder.zip")]
    pub(super) output: PathBuf,

    /// A grade for x86-64 Linux with glibc 2.35 or older, or static [default: this program if it is one, else its source]
    #[arg(long, value_name = "FILE")]
    pub(super) program: Option<PathBuf>,

    /// Seconds after which grade ends, so that it can still write results; set Gradescope's own limit higher
    #[arg(long, value_name = "N", default_value_t = 540, value_parser = clap::value_parser!(u32).range(1..=2400))]
    pub(super) seconds: u32,

    #[command(flatten)]
    pub(super) content: ContentArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CriteriaArg {
    /// The rubric's default tolerances; without a rubric the course's: 1e-10 per residual, 1e-6 for their sum
    Course,
    /// The measured differences between correct programs, stored with the oracle's traces
    Calibrated,
}

impl CriteriaArg {
    /// Its name in the rubric.
    pub(super) fn name(self) -> CriteriaName {
        match self {
            Self::Course => CriteriaName::Course,
            Self::Calibrated => CriteriaName::Calibrated,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(super) enum Format {
    /// For people
    Text,
    /// For programs; schema in docs/report.schema.json
    Json,
    /// For continuous integration
    Junit,
}

/// Arguments of `grade selftest`.
#[derive(Args)]
pub(super) struct SelfTestArgs {
    /// Format of the report
    #[arg(long, value_enum, default_value_t = SelfTestFormat::Text)]
    pub(super) format: SelfTestFormat,

    /// Write docs/selftest.md; same as --format markdown
    #[arg(long, conflicts_with = "format")]
    pub(super) markdown: bool,

    /// Write the report to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Skip the programs in other languages, which need compilers
    #[arg(long)]
    pub(super) in_process: bool,

    /// Only mistakes with this subject, such as a force's name in words
    #[arg(long, value_name = "NAME")]
    pub(super) subject: Option<String>,

    /// Instead, draw and grade this many programs: unfinished, with none to three mistakes, in several forms
    #[arg(long, value_name = "COUNT", conflicts_with_all = ["in_process", "subject", "format", "markdown"])]
    pub(super) drawn: Option<u64>,

    /// Seed of the drawn programs
    #[arg(long, value_name = "NUMBER", default_value_t = 1, requires = "drawn")]
    pub(super) seed: u64,

    /// Number of the first drawn program
    #[arg(long, value_name = "NUMBER", default_value_t = 0, requires = "drawn")]
    pub(super) first: u64,

    /// List the drawn programs whose mistakes are not all proven
    #[arg(long, requires = "drawn")]
    pub(super) details: bool,

    #[command(flatten)]
    pub(super) run: RunArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum SelfTestFormat {
    /// For people
    Text,
    /// For programs; schema in docs/selftest.schema.json
    Json,
    /// For docs/selftest.md
    Markdown,
}
