//! Arguments that several commands take. Those of one command are in its module below [`crate::commands`].

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use grader::rubric::CriteriaName;
use report::text::Amount;
use sandbox::Limits;
use simulator::force;

/// The folder of the scenes.
#[derive(Args)]
pub(super) struct RootArgs {
    /// Folder with assets/ (scenes, assignments), extracreditassets/ and expected/ [default: the current folder or the
    /// nearest parent with assets/, else those that come with the program]
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,
}

/// A course pack.
#[derive(Args)]
pub(super) struct PackArgs {
    /// Course pack: a folder or zip with pack.toml, or the name of a pack in assets/packs/. It says what is taken from a
    /// hand-in, how it is built and called, and what is graded
    #[arg(long, value_name = "DIR")]
    pub(super) pack: Option<PathBuf>,

    /// Folder of the starter code: with --pack, in the place of the one that the pack names; with --similar, what does not
    /// count as shared (repeatable), nor does what grade init writes
    #[arg(long, value_name = "DIR")]
    pub(super) starter: Vec<PathBuf>,
}

/// The suite: scenes, oracle, rubric.
#[derive(Args)]
pub(super) struct SuiteArgs {
    #[command(flatten)]
    pub(super) root: RootArgs,

    #[command(flatten)]
    pub(super) pack: PackArgs,

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

/// Some scenes of the suite.
#[derive(Args)]
pub(super) struct OnlyArgs {
    /// Only these scenes (repeatable): a name (Spring/two-springs), a group (Spring), an integrator, a pattern with *
    /// and ?, the start of a name (Spring/two), or, without a /, a part of names (two)
    #[arg(long, value_name = "PATTERN")]
    pub(super) only: Vec<String>,
}

/// How programs run.
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

/// How a submission is graded.
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

    /// Hide the progress line (shown only if standard error is a terminal and CI is not set)
    #[arg(long)]
    pub(super) no_progress: bool,
}

/// How much text reports show.
#[derive(Args)]
pub(super) struct DetailsArgs {
    /// Number of failed scenes to explain in detail (text only)
    #[arg(long, value_name = "N", default_value_t = DETAILS)]
    pub(super) details: usize,
}

/// Failed scenes that are explained in detail, by default.
const DETAILS: usize = 20;

/// How much the text report of one submission shows.
#[derive(Args)]
pub(super) struct VerboseArgs {
    /// Show every feature and scene, and failed scenes in detail (text only)
    #[arg(short, long)]
    verbose: bool,

    /// The same with this number of failed scenes in detail [default: 20]
    #[arg(long, value_name = "N")]
    details: Option<usize>,
}

impl VerboseArgs {
    /// How much a report shows.
    pub(super) fn amount(&self) -> Amount {
        if self.verbose || self.details.is_some() {
            Amount::Full { details: self.details() }
        } else {
            Amount::Brief
        }
    }

    /// Number of failed scenes in detail, where a report shows them.
    pub(super) fn details(&self) -> usize {
        self.details.unwrap_or(DETAILS)
    }
}

/// The format and the place of a report.
#[derive(Args)]
pub(super) struct ReportArgs<F: ValueEnum + Default + Send + Sync + 'static> {
    /// Format of the report
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: F,

    /// Write the report to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
}

/// Formats of reports of gradings and of checks of Jacobians.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(super) enum Format {
    /// For people
    #[default]
    Text,
    /// For programs; schema in docs/report.schema.json
    Json,
    /// For continuous integration
    Junit,
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

/// Parses a limit such as `memory=4G`.
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

/// Splits `KIND=FILE`, and finds the kind by its name. `noun` names the kinds in messages.
pub(super) fn parse_kind<K: Copy>(
    text: &str,
    noun: &str,
    kinds: &[(&str, K)],
) -> Result<(K, Option<PathBuf>), String> {
    let (name, file) = match text.split_once('=') {
        Some((_, "")) => return Err("no file after =".to_owned()),
        Some((name, file)) => (name, Some(PathBuf::from(file))),
        None => (text, None),
    };
    let Some((_, kind)) = kinds.iter().find(|(known, _)| *known == name) else {
        let names: Vec<&str> = kinds.iter().map(|(name, _)| *name).collect();
        return Err(format!("unknown {noun} {name:?}; the {noun}s are {}", listed(&names)));
    };
    Ok((*kind, file))
}

/// Words in a sentence: `a, b and c`.
fn listed(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [word] => (*word).to_owned(),
        [words @ .., last] => format!("{} and {last}", words.join(", ")),
    }
}

/// Parses one of `all` by its name.
pub(super) fn parse_named<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(name))
        .try_map(move |word| all.into_iter().find(|each| name(*each) == word).ok_or("unknown name"))
}

/// Parses the tag of a force.
pub(super) fn parse_force() -> PossibleValuesParser {
    PossibleValuesParser::new(force::REGISTRY.iter().map(|kind| kind.schema.tag))
}
