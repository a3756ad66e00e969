//! The command line.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use grader::init::Language;
use grader::jacobian;
use grader::rubric::CriteriaName;
use sandbox::Limits;
use simulator::force;

/// Grade a mass-spring simulator, feature by feature, against oracle traces.
///
/// Without arguments: the built-in simulator on every scene of assets/ and extracreditassets/, against
/// expected/, and the Jacobians of every force.
#[derive(Parser)]
#[command(name = "grade", version, args_conflicts_with_subcommands = true)]
#[command(
    after_help = "Exit codes: 0 all passed, 1 something failed, 2 bad usage or input, 3 grader fault or a full \
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
    /// Grade every submission of a folder, each alone: a report of each, and a table of all
    #[command(
        after_help = "Exit codes: 0 all graded, whatever their verdicts; 2 bad usage or input; 3 something could \
                      not be judged or written; 130 interrupted (Ctrl-C): --resume goes on."
    )]
    Class(ClassArgs),
    /// Judge each force's Jacobians, block by block: correct, wrong or inconclusive; ours, or a program's
    Jacobians(JacobianArgs),
    /// What accuracy a second of computing buys: errors and costs of every integrator over a ladder of time steps
    Accuracy(AccuracyArgs),
    /// Write a working skeleton of a submission, which documents the protocol
    Init {
        /// Its language
        #[arg(value_name = "LANG", value_parser = PossibleValuesParser::new(Language::ALL.map(Language::name)))]
        language: String,

        /// Folder to write it to; it is made where it is missing
        #[arg(value_name = "DIR", default_value = "my-simulator")]
        folder: PathBuf,
    },
    /// Run the suite of hard cases, and find each method's stability boundary: against what is expected and theory
    Stability(StabilityArgs),
    /// Show what each scene is given to be stepped, and what the general path would cost it
    Needs {
        /// Only these scenes: a name, a group, an integrator, a pattern with * and ?, or a part of names; may be
        /// given several times
        #[arg(long, value_name = "PATTERN")]
        only: Vec<String>,

        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Run planted mistakes and correct variants: is every mistake caught and blamed, every variant passed?
    Selftest(SelfTestArgs),
    /// Make the oracle traces anew, or see whether they still match
    #[command(subcommand)]
    Oracle(OracleCommand),
}

#[derive(Args)]
pub(super) struct GradeArgs {
    /// What is graded instead of the built-in simulator: a program (run as `PROGRAM -s SCENE -d 0 -o TRACE` or
    /// `PROGRAM SCENE -o TRACE`), a folder with submission.toml, or a folder of traces
    #[arg(value_name = "SUBMISSION")]
    pub(super) submission: Option<PathBuf>,

    /// Grade the traces of this folder (GROUP/SCENE.csv or .bin) instead of running anything
    #[arg(long, value_name = "DIR", conflicts_with = "submission")]
    pub(super) traces: Option<PathBuf>,

    #[command(flatten)]
    pub(super) run: RunArgs,

    /// Grade only these scenes; may be given several times. A scene's name (Spring/two-springs), a group (Spring), an
    /// integrator, a pattern with * and ?, the start of a name (Spring/two), or, without a /, a part of names (two)
    #[arg(long, value_name = "PATTERN")]
    pub(super) only: Vec<String>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(super) format: Format,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    #[command(flatten)]
    pub(super) judge: JudgeArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

/// How a submission is graded, alone or in a class.
#[derive(Args)]
pub(super) struct JudgeArgs {
    /// Hidden scenes, which count and of which nothing else is told: a folder that holds assets/ or
    /// extracreditassets/, and expected/ [default: as the rubric says]
    #[arg(long, value_name = "DIR")]
    pub(super) hidden: Option<PathBuf>,

    /// What scenes are judged by where the rubric sets no tolerance of theirs [default: the rubric's, else
    /// calibrated]
    #[arg(long, value_enum, value_name = "NAME")]
    pub(super) criteria: Option<CriteriaArg>,

    /// Check no Jacobians, neither ours nor a program's
    #[arg(long)]
    pub(super) no_jacobians: bool,

    /// The most scenes whose failure is told in detail (text only)
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub(super) details: usize,

    /// Show no progress line; where the standard error is no terminal, and under CI, there is none anyway
    #[arg(long)]
    pub(super) no_progress: bool,
}

#[derive(Args)]
pub(super) struct ClassArgs {
    /// The submissions: programs, folders with submission.toml, folders of traces
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,

    /// Folder for the reports (reports/NAME.txt, …), summary.txt and summary.csv; it is made where it is missing
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,

    /// Formats of the reports
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Format::Text, Format::Json])]
    pub(super) format: Vec<Format>,

    /// Keep what an earlier run left in the output folder, where submission, suite and grader are the same
    #[arg(long)]
    pub(super) resume: bool,

    #[command(flatten)]
    pub(super) run: RunArgs,

    #[command(flatten)]
    pub(super) judge: JudgeArgs,

    #[command(flatten)]
    pub(super) suite: SuiteArgs,
}

/// How programs are run.
#[derive(Args)]
pub(super) struct RunArgs {
    /// Run programs with all the rights that you have: they may read the oracle, and change your files
    #[arg(long)]
    pub(super) unprotected: bool,

    /// Set a limit of each run, as --limit wall=10; sizes may end in K, M or G. Limits: cpu and wall (seconds),
    /// memory, trace, stdout and stderr (bytes), processes, files
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_limit)]
    pub(super) limit: Vec<(String, f64)>,

    /// Let programs read this file or folder as well
    #[arg(long, value_name = "PATH")]
    pub(super) readable: Vec<PathBuf>,
}

pub(super) fn parse_limit(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("a limit is set as NAME=VALUE")?;
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
    /// Folder that holds assets/, extracreditassets/ and expected/ [default: here or above]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,

    /// Required scenes; then there is no extra credit but by --extra-credit
    #[arg(long, value_name = "DIR")]
    pub(super) assets: Option<PathBuf>,

    /// Extra-credit scenes
    #[arg(long, value_name = "DIR")]
    pub(super) extra_credit: Option<PathBuf>,

    /// Oracle traces [default: expected/ beside the required scenes]
    #[arg(long, value_name = "DIR")]
    pub(super) expected: Option<PathBuf>,

    /// Tolerances and points [default: rubric.toml among the required scenes, else the course's criteria]
    #[arg(long, value_name = "FILE")]
    pub(super) rubric: Option<PathBuf>,

    /// Unknown elements and attributes of scenes are errors, not warnings
    #[arg(long)]
    pub(super) strict: bool,

    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,
}

#[derive(Args)]
pub(super) struct JacobianArgs {
    /// Measure forces and Jacobians of this program, or of that of this folder with submission.toml, instead of
    /// checking the built-in simulator
    #[arg(value_name = "SUBMISSION", conflicts_with_all = ["states", "seed", "plot"])]
    pub(super) submission: Option<PathBuf>,

    #[command(flatten)]
    pub(super) run: RunArgs,

    /// Random states a force and dimension, beside the hard ones
    #[arg(long, value_name = "N", default_value_t = jacobian::Config::default().states, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) states: u32,

    /// Seed of the random states
    #[arg(long, value_name = "N", default_value_t = jacobian::Config::default().seed)]
    pub(super) seed: u64,

    /// Check only this force
    #[arg(long, value_name = "TAG", value_parser = force::REGISTRY.iter().map(|kind| kind.schema.tag).collect::<Vec<_>>())]
    pub(super) force: Option<String>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(super) format: Format,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Show the blocks and the state behind every verdict, and not only where one is not correct (text only)
    #[arg(long)]
    pub(super) details: bool,

    /// Write a plot a force (SVG) to this folder: errors of differences and of Taylor's test by step size
    #[arg(long, value_name = "DIR")]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Args)]
pub(super) struct AccuracyArgs {
    /// Measure this program, or that of this folder with submission.toml, beside the built-in simulator
    #[arg(value_name = "SUBMISSION")]
    pub(super) submission: Option<PathBuf>,

    #[command(flatten)]
    pub(super) run: RunArgs,

    /// Measure only this scene, which may be given several times: one of the scenes of `--list`, a scene of the
    /// suite by its name, or a file
    #[arg(long, value_name = "SCENE")]
    pub(super) scene: Vec<String>,

    /// List the scenes that are measured by default
    #[arg(long)]
    pub(super) list: bool,

    /// Fewer time steps and repeats: half a minute for all scenes
    #[arg(long)]
    pub(super) quick: bool,

    /// Time steps of the ladder, each half of the one before
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=30))]
    pub(super) rungs: Option<u32>,

    /// Keep everything in this folder: points, so that a run that was interrupted goes on, and the report as text,
    /// CSV and JSON, and a diagram a scene as SVG and PNG
    #[arg(long, value_name = "DIR")]
    pub(super) results: Option<PathBuf>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = AccuracyFormat::Text)]
    pub(super) format: AccuracyFormat,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Show every point of every curve (text only)
    #[arg(long)]
    pub(super) details: bool,

    /// Folder that holds assets/ and extracreditassets/, for scenes of the suite [default: here or above]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,
}

/// Formats of what `grade accuracy` reports.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum AccuracyFormat {
    /// For people
    Text,
    /// A row a point
    Csv,
    /// For programs; schema in docs/accuracy.schema.json
    Json,
}

#[derive(Args)]
pub(super) struct StabilityArgs {
    /// Fewer steps and damping ratios: some seconds in all
    #[arg(long)]
    pub(super) quick: bool,

    /// Run what fails again, its failed steps solved with a line search or taken in smaller ones
    #[arg(long)]
    pub(super) robust: bool,

    /// Run only these cases, and nothing of the theory: a case's name, a pattern with * and ?, or a part of names; may
    /// be given several times
    #[arg(long, value_name = "PATTERN")]
    pub(super) only: Vec<String>,

    /// Take what comes for what is expected from now on
    #[arg(long)]
    pub(super) accept: bool,

    /// The outcomes that are expected [default: docs/stability-expected.csv, here or above]
    #[arg(long, value_name = "FILE")]
    pub(super) expected: Option<PathBuf>,

    /// Keep finished trials in this folder: a run that was interrupted goes on where it was
    #[arg(long, value_name = "DIR")]
    pub(super) resume: Option<PathBuf>,

    /// Write a map a method (SVG and PNG) to this folder: where it is stable, and how much it damps
    #[arg(long, value_name = "DIR")]
    pub(super) plot: Option<PathBuf>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = TableFormat::Text)]
    pub(super) format: TableFormat,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
}

/// A report of tables.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum TableFormat {
    /// For people
    Text,
    /// For programs
    Json,
    /// For spreadsheets: a row a trial
    Csv,
}

#[derive(Subcommand)]
pub(super) enum OracleCommand {
    /// Make every oracle trace anew with the built-in simulator; replace expected/ whole or not at all
    Regenerate {
        /// Replace also traces that changed beyond their tolerance, and remove those without a scene
        #[arg(long)]
        accept: bool,

        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Say whether expected/ still matches its scenes and its manifest
    Verify {
        #[command(flatten)]
        suite: SuiteArgs,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CriteriaArg {
    /// The rubric's default tolerances: by default the course's, 1e-10 each and 1e-6 in sum
    Course,
    /// What correct programs differ by, as measured when the oracle's trace was made
    Calibrated,
}

impl CriteriaArg {
    /// As the rubric knows it.
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

    /// The document docs/selftest.md: the same as --format markdown
    #[arg(long, conflicts_with = "format")]
    pub(super) markdown: bool,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Leave out the programs in other languages: then no compiler is needed
    #[arg(long)]
    pub(super) in_process: bool,

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
