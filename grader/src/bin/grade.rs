//! `grade`: grades a simulator against the oracle's traces.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use grader::grading::{self, Grading, Outcome};
use grader::init::{self, Language};
use grader::jacobian::{self, JacobianReport};
use grader::oracle::{self, Change, Difference, Leftover, Oracle, Regeneration};
use grader::probe;
use grader::report;
use grader::rubric::Rubric;
use grader::sandbox::{self, Limits, Protection, Sandbox};
use grader::submission::Submission;
use grader::submission::folder::{self, Built, FolderError};
use grader::submission::program::{Identified, Program, Runner};
use grader::suite::{Case, Section, Suite};
use grader::verdict::Verdict;
use simulator::force;
use simulator::output::OutputFile;
use simulator::scene::ParseOptions;
use simulator::solver::linear::LinearSolver;

/// Grade a mass-spring simulator, feature by feature, against oracle traces.
///
/// Without arguments: the built-in simulator on every scene of assets/ and extracreditassets/, against
/// expected/, and the Jacobians of every force.
#[derive(Parser)]
#[command(name = "grade", version, args_conflicts_with_subcommands = true)]
#[command(
    after_help = "Exit codes: 0 all passed, 1 something failed, 2 bad usage or input, 3 grader fault."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    grade: GradeArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Judge each force's Jacobians, block by block: correct, wrong or inconclusive; ours, or a program's
    Jacobians(JacobianArgs),
    /// Write a working skeleton of a submission, which documents the protocol
    Init {
        /// Its language
        #[arg(value_name = "LANG", value_parser = PossibleValuesParser::new(Language::ALL.map(Language::name)))]
        language: String,

        /// Folder to write it to; it is made where it is missing
        #[arg(value_name = "DIR", default_value = "my-simulator")]
        folder: PathBuf,
    },
    /// Make the oracle traces anew, or see whether they still match
    #[command(subcommand)]
    Oracle(OracleCommand),
}

#[derive(Args)]
struct GradeArgs {
    /// What is graded instead of the built-in simulator: a program (run as `PROGRAM -s SCENE -d 0 -o TRACE` or
    /// `PROGRAM SCENE -o TRACE`), a folder with submission.toml, or a folder of traces
    #[arg(value_name = "SUBMISSION")]
    submission: Option<PathBuf>,

    /// Grade the traces of this folder (GROUP/SCENE.csv or .bin) instead of running anything
    #[arg(long, value_name = "DIR", conflicts_with = "submission")]
    traces: Option<PathBuf>,

    #[command(flatten)]
    run: RunArgs,

    /// Grade only scenes whose name contains this text, or whose integrator is called so
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// The most scenes whose failure is told in detail (text only)
    #[arg(long, value_name = "N", default_value_t = 20)]
    details: usize,

    #[command(flatten)]
    suite: SuiteArgs,
}

/// How programs are run.
#[derive(Args)]
struct RunArgs {
    /// Run programs with all the rights that you have: they may read the oracle, and change your files
    #[arg(long)]
    unprotected: bool,

    /// Set a limit of each run, as --limit wall=10; sizes may end in K, M or G. Limits: cpu and wall (seconds),
    /// memory, trace, stdout and stderr (bytes), processes, files
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_limit)]
    limit: Vec<(String, f64)>,

    /// Let programs read this file or folder as well
    #[arg(long, value_name = "PATH")]
    readable: Vec<PathBuf>,
}

fn parse_limit(text: &str) -> Result<(String, f64), String> {
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

impl RunArgs {
    /// How programs are run, and the protections that are then in force.
    fn runner(&self, rubric: &Rubric) -> Result<(Runner, Vec<Protection>), Stop> {
        let mut limits = rubric.limits();
        for (name, value) in &self.limit {
            limits.set(name, *value).map_err(Stop::bad_input)?;
        }
        let absolute = |path: &PathBuf| {
            let found = std::fs::canonicalize(path);
            found.map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))
        };
        let readable = self.readable.iter().map(absolute).collect::<Result<_, _>>()?;
        sandbox::sweep();
        let sandbox = if self.unprotected {
            complain("warning", "programs are run with all your rights");
            Sandbox::Unprotected
        } else {
            Sandbox::Protected(std::env::current_exe().map_err(Stop::fault)?)
        };
        let protections = sandbox.protections().map_err(|error| {
            Stop::fault(format!("{error}\n  help: --unprotected runs programs without protection"))
        })?;
        Ok((Runner { sandbox, limits, readable }, protections))
    }
}

#[derive(Args)]
struct SuiteArgs {
    /// Folder that holds assets/, extracreditassets/ and expected/ [default: here or above]
    #[arg(long, value_name = "DIR")]
    root: Option<PathBuf>,

    /// Required scenes; then there is no extra credit but by --extra-credit
    #[arg(long, value_name = "DIR")]
    assets: Option<PathBuf>,

    /// Extra-credit scenes
    #[arg(long, value_name = "DIR")]
    extra_credit: Option<PathBuf>,

    /// Oracle traces [default: expected/ beside the required scenes]
    #[arg(long, value_name = "DIR")]
    expected: Option<PathBuf>,

    /// Tolerances and points [default: rubric.toml among the required scenes, else the course's criteria]
    #[arg(long, value_name = "FILE")]
    rubric: Option<PathBuf>,

    /// Unknown elements and attributes of scenes are errors, not warnings
    #[arg(long)]
    strict: bool,

    /// Threads to use [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

#[derive(Args)]
struct JacobianArgs {
    /// Measure forces and Jacobians of this program, or of that of this folder with submission.toml, instead of
    /// checking the built-in simulator
    #[arg(value_name = "SUBMISSION", conflicts_with_all = ["states", "seed", "plot"])]
    submission: Option<PathBuf>,

    #[command(flatten)]
    run: RunArgs,

    /// Random states a force and dimension, beside the hard ones
    #[arg(long, value_name = "N", default_value_t = jacobian::Config::default().states, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    states: u32,

    /// Seed of the random states
    #[arg(long, value_name = "N", default_value_t = jacobian::Config::default().seed)]
    seed: u64,

    /// Check only this force
    #[arg(long, value_name = "TAG", value_parser = force::REGISTRY.iter().map(|kind| kind.schema.tag).collect::<Vec<_>>())]
    force: Option<String>,

    /// Format of the report
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Show the blocks and the state behind every verdict, and not only where one is not correct (text only)
    #[arg(long)]
    details: bool,

    /// Write a plot a force (SVG) to this folder: errors of differences and of Taylor's test by step size
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
}

#[derive(Subcommand)]
enum OracleCommand {
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

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people
    Text,
    /// For programs; schema in docs/report.schema.json
    Json,
    /// For continuous integration
    Junit,
}

/// How a run of `grade` ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Exit {
    /// All passed.
    Passed = 0,
    /// Something failed.
    Failed = 1,
    /// Bad usage or input.
    BadInput = 2,
    /// The grader itself is at fault.
    GraderFault = 3,
}

/// A message for the user, and the exit code that goes with it.
struct Stop(Exit, String);

impl Stop {
    fn bad_input(error: impl std::fmt::Display) -> Self {
        Self(Exit::BadInput, error.to_string())
    }

    fn fault(error: impl std::fmt::Display) -> Self {
        Self(Exit::GraderFault, error.to_string())
    }
}

fn main() -> ExitCode {
    #[cfg(target_os = "linux")]
    if let Some(code) = sandbox::serve() {
        return code;
    }
    let cli = Cli::parse();
    std::panic::set_hook(Box::new(|panic| {
        complain(
            "internal error",
            format!("{panic}\n  help: this is a defect of grade; please report it"),
        );
    }));
    let exit = match std::panic::catch_unwind(|| run(&cli)) {
        Ok(Ok(exit)) => exit,
        Ok(Err(Stop(exit, message))) => {
            complain("error", message);
            exit
        }
        Err(_) => Exit::GraderFault,
    };
    ExitCode::from(exit as u8)
}

fn run(cli: &Cli) -> Result<Exit, Stop> {
    match &cli.command {
        None => grade(&cli.grade),
        Some(Command::Jacobians(args)) => check_jacobians(args),
        Some(Command::Init { language, folder }) => init(language, folder),
        Some(Command::Oracle(OracleCommand::Regenerate { accept, suite })) => {
            regenerate(*accept, suite)
        }
        Some(Command::Oracle(OracleCommand::Verify { suite })) => verify(suite),
    }
}

fn grade(args: &GradeArgs) -> Result<Exit, Stop> {
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

/// What is graded, and the protection under which it is run, where it is a program.
fn open_submission(
    args: &GradeArgs,
    rubric: &Rubric,
    expected: &Path,
) -> Result<(Submission, Option<Vec<Protection>>), Stop> {
    if let Some(folder) = &args.traces {
        return match folder.is_dir() {
            true => Ok((Submission::Traces(folder.clone()), None)),
            false => Err(Stop::bad_input(format!("{}: there is no such folder", folder.display()))),
        };
    }
    let Some(path) = &args.submission else {
        return Ok((Submission::BuiltIn(LinearSolver::Auto), None));
    };
    if path.is_dir() && !folder::is_submission(path) {
        return Ok((Submission::Traces(path.clone()), None));
    }
    let (submission, protections) = open_program(path, &args.run, rubric, Some(expected))?;
    Ok((submission, Some(protections)))
}

/// The program of a file or of a folder with a manifest, and the protection under which it is run. It must not
/// be able to read `secret`.
fn open_program(
    path: &Path,
    run: &RunArgs,
    rubric: &Rubric,
    secret: Option<&Path>,
) -> Result<(Submission, Vec<Protection>), Stop> {
    if !path.exists() {
        let path = path.display();
        return Err(Stop::bad_input(format!("{path}: there is no such file or folder")));
    }
    if path.is_dir() && !folder::is_submission(path) {
        let path = path.display();
        return Err(Stop::bad_input(format!("{path}: there is no submission.toml in it")));
    }
    let (runner, protections) = run.runner(rubric)?;
    let mut readable = runner.readable.clone();
    readable.extend(std::fs::canonicalize(path));
    let secret = secret.and_then(|secret| std::fs::canonicalize(secret).ok());
    if let (false, Some(secret)) = (run.unprotected, secret)
        && let Some(folder) = sandbox::revealed_by(&secret, &readable)
    {
        return Err(Stop::bad_input(format!(
            "{}: the submission may read {}, and so the oracle\n  help: keep them apart, or name the \
             oracle's folder with --expected",
            secret.display(),
            folder.display(),
        )));
    }
    let submission = if path.is_dir() {
        match folder::open(path, runner, rubric.build_limits()) {
            Ok(Built::Program(program)) => Submission::Program(program),
            Ok(Built::Failed { name, failure }) => Submission::Unusable { name, failure },
            Err(FolderError::NotRun(error)) => return Err(Stop::fault(error)),
            Err(error) => return Err(Stop::bad_input(error)),
        }
    } else {
        match Program::identify(path, runner) {
            Ok(Identified::Program(program)) => Submission::Program(program),
            Ok(Identified::Unusable { name, failure }) => Submission::Unusable { name, failure },
            Err(error) => return Err(Stop::fault(error)),
        }
    };
    Ok((submission, protections))
}

/// The oracle of a folder, which must be there.
fn open_oracle(folder: &Path) -> Result<Oracle, Stop> {
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(Stop::bad_input(format!(
            "{folder}: there is no such folder; make it with `grade oracle regenerate`"
        )));
    }
    Oracle::open(folder).map_err(Stop::bad_input)
}

/// Writes a skeleton, and says what to do with it.
fn init(language: &str, folder: &Path) -> Result<Exit, Stop> {
    let language = Language::ALL.into_iter().find(|each| each.name() == language);
    let language = language.ok_or_else(|| Stop::bad_input("there is no such language"))?;
    let files = init::write(language, folder)
        .map_err(|error| Stop::bad_input(format!("{}: {error}", folder.display())))?;
    let mut text = String::new();
    for file in files {
        text += &format!("wrote {}\n", file.display());
    }
    let mut folder = folder.display().to_string();
    if let Some(arguments) = language.arguments() {
        folder += &format!(" {arguments}");
    }
    text += &format!(
        "\nIt moves particles on which no force acts. See what that passes, and go on from there:\n\n    \
         grade {folder} --only Inertia\n    grade {folder}\n"
    );
    print(text.as_bytes());
    Ok(Exit::Passed)
}

/// Writes the report where it is wanted.
fn deliver(args: &GradeArgs, grading: &Grading) -> Result<(), Stop> {
    let bytes = render(grading, args.format, |out| {
        report::text::write(out, grading, report::text::Config { details: args.details })
    })?;
    put(&bytes, args.output.as_deref())
}

/// The report in the format wanted; `text` writes it for people.
fn render(
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

/// Writes a report to a file, or to the standard output.
fn put(bytes: &[u8], output: Option<&Path>) -> Result<(), Stop> {
    match output {
        None => {
            print(bytes);
            Ok(())
        }
        Some(path) => write_file(path, bytes)
            .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display()))),
    }
}

fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OutputFile::create(path)?;
    // A file is no terminal: it gets no colours.
    anstream::StripStream::new(&mut file as &mut dyn Write).write_all(bytes)?;
    file.commit()
}

fn check_jacobians(args: &JacobianArgs) -> Result<Exit, Stop> {
    if let Some(submission) = &args.submission {
        return probe_program(submission, args);
    }
    let config = jacobian::Config { states: args.states, seed: args.seed };
    let jacobians = match &args.force {
        Some(tag) => JacobianReport {
            forces: jacobian::check_forces(config, |force| force == tag),
            ..JacobianReport::default()
        },
        None => jacobian::check_all(config),
    };
    let grading = Grading {
        submission: Submission::BuiltIn(LinearSolver::Auto).name(),
        features: Vec::new(),
        jacobians,
        protection: None,
        repetition: None,
        probing: None,
    };
    let bytes = render(&grading, args.format, |out| {
        let config = report::jacobians::text::Config { details: args.details };
        report::jacobians::text::write(out, &grading.jacobians, config)
    })?;
    put(&bytes, args.output.as_deref())?;
    if let Some(folder) = &args.plot {
        plot(folder, &grading.jacobians)?;
    }
    Ok(if grading.jacobians.is_pass() { Exit::Passed } else { Exit::Failed })
}

/// Writes a plot a force.
fn plot(folder: &Path, jacobians: &JacobianReport) -> Result<(), Stop> {
    let unwritable =
        |path: &Path, error: io::Error| Stop::bad_input(format!("{}: {error}", path.display()));
    std::fs::create_dir_all(folder).map_err(|error| unwritable(folder, error))?;
    for check in &jacobians.forces {
        let Some(curves) = jacobian::curves(check) else { continue };
        let svg = report::jacobians::plot::render(&curves).map_err(Stop::fault)?;
        let name = format!("{}-{}d.svg", check.tag, check.dimension.count());
        let path = folder.join(name);
        write_file(&path, svg.as_bytes()).map_err(|error| unwritable(&path, error))?;
    }
    Ok(())
}

/// The black-box check: nothing is known of the program but its traces.
fn probe_program(path: &Path, args: &JacobianArgs) -> Result<Exit, Stop> {
    // There need not be a suite, nor a rubric of it.
    let rubric = Rubric::default();
    let program = match open_program(path, &args.run, &rubric, None)? {
        (Submission::Program(program), _) => program,
        (Submission::Unusable { name, failure }, _) => {
            return Err(Stop::bad_input(format!("{name}: {failure}")));
        }
        _ => return Err(Stop::bad_input(format!("{}: this is no program", path.display()))),
    };
    let selected = |tag: &str| args.force.as_ref().is_none_or(|force| force == tag);
    let probing = probe::probe(&program, selected);
    let bytes = match args.format {
        Format::Text => {
            let config = report::probe::text::Config { details: args.details };
            let mut bytes = Vec::new();
            report::probe::text::write(&mut bytes, &probing, config).map_err(Stop::fault)?;
            bytes
        }
        Format::Json => report::probe::json::render(&probing).map_err(Stop::fault)?.into_bytes(),
        Format::Junit => report::probe::junit::render(&probing).map_err(Stop::fault)?.into_bytes(),
    };
    put(&bytes, args.output.as_deref())?;
    Ok(match probing.verdict() {
        probe::Verdict::Wrong => Exit::Failed,
        probe::Verdict::Correct | probe::Verdict::NotOffered | probe::Verdict::Inconclusive => {
            Exit::Passed
        }
    })
}

fn regenerate(accept: bool, args: &SuiteArgs) -> Result<Exit, Stop> {
    let Inputs { suite, expected, rubric } = args.read()?;
    let regeneration =
        oracle::regenerate(&suite, &expected, &rubric, accept).map_err(Stop::bad_input)?;
    print(describe(&regeneration, &expected).as_bytes());
    if let Some(Leftover { path, detail }) = &regeneration.leftover {
        let path = path.display();
        let message = format!("{path}: the old traces are still there; remove them: {detail}");
        complain("warning", message);
    }
    Ok(if regeneration.refused() { Exit::Failed } else { Exit::Passed })
}

fn describe(regeneration: &Regeneration, folder: &Path) -> String {
    let mut text = String::new();
    let mut unchanged = 0;
    for (name, change) in &regeneration.changes {
        let words = match change {
            Change::Unchanged => {
                unchanged += 1;
                continue;
            }
            Change::New => "new".to_owned(),
            Change::Removed => "removed: its scene is gone".to_owned(),
            Change::SceneEdited => "scene edited; its trace is the same".to_owned(),
            Change::Changed { scene_edited, n_old, difference } => {
                let edited = if *scene_edited { "scene edited; " } else { "" };
                let several = if *n_old > 1 { "one trace in the place of two; " } else { "" };
                format!("{edited}{several}{}", describe_difference(difference))
            }
        };
        let mark = if change.needs_accepting() { "!" } else { " " };
        text += &format!("{mark} {name}: {words}\n");
    }
    let folder = folder.display();
    text += &format!("{unchanged} of {} traces are unchanged\n", regeneration.changes.len());
    text += &match (regeneration.replaced, regeneration.refused()) {
        (true, _) if unchanged == regeneration.changes.len() => {
            format!("{folder} was replaced: its manifest was missing or out of date\n")
        }
        (true, _) => format!("{folder} was replaced\n"),
        (false, true) => format!(
            "{folder} was NOT replaced: review what is marked ! and run again with --accept\n"
        ),
        (false, false) => format!("{folder} is as it was\n"),
    };
    text
}

fn describe_difference(difference: &Difference) -> String {
    let comparison = match difference {
        Difference::Numbers(comparison) => comparison,
        Difference::Length { old, new } => {
            return format!("changed: the old trace has {old} states, the new one {new}");
        }
        Difference::Shape => {
            return "changed: the old trace has another shape (particles or dimensions)".to_owned();
        }
        Difference::Unusable { detail } => {
            return format!("changed: the old trace cannot be used: {detail}");
        }
    };
    let (extent, place) = match (&comparison.verdict, &comparison.first_wrong) {
        (Verdict::Pass, _) => ("within tolerance", String::new()),
        (_, Some(first)) => ("beyond tolerance", format!(", first at {}", first.place)),
        (verdict, None) => ("beyond tolerance", format!(", {verdict}")),
    };
    let (position, velocity) = (comparison.position.largest, comparison.velocity.largest);
    format!("changed {extent}, position by {position:.1e}, velocity by {velocity:.1e}{place}")
}

fn verify(args: &SuiteArgs) -> Result<Exit, Stop> {
    let Inputs { suite, expected, .. } = args.read()?;
    let oracle = open_oracle(&expected)?;
    let findings = oracle::verify(&suite, &oracle);
    let mut text = String::new();
    for finding in &findings {
        text += &format!("{finding}\n");
    }
    let (folder, count) = (expected.display(), suite.cases.len());
    text += &match findings.len() {
        0 => format!("{folder} matches its {count} scenes and its manifest\n"),
        1 => format!("{folder}: 1 thing does not match\n"),
        n => format!("{folder}: {n} things do not match\n"),
    };
    print(text.as_bytes());
    Ok(if findings.is_empty() { Exit::Passed } else { Exit::Failed })
}

/// What a run works on.
struct Inputs {
    suite: Suite,
    expected: PathBuf,
    rubric: Rubric,
}

impl SuiteArgs {
    fn read(&self) -> Result<Inputs, Stop> {
        if let Some(threads) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
            pool.build_global().map_err(Stop::fault)?;
        }
        let Folders { assets, extra_credit, expected } = self.folders()?;
        let mut sections = vec![(Section::Required, assets.clone())];
        sections.extend(extra_credit.map(|folder| (Section::ExtraCredit, folder)));
        let options = ParseOptions { strict: self.strict, ..ParseOptions::default() };
        let suite = Suite::load(&sections, &options).map_err(Stop::bad_input)?;
        for warning in &suite.warnings {
            complain("warning", warning);
        }
        let beside = assets.join("rubric.toml");
        let rubric_path = self.rubric.clone().or_else(|| beside.is_file().then_some(beside));
        let rubric = match &rubric_path {
            Some(path) => {
                let rubric = Rubric::load(path).map_err(Stop::bad_input)?;
                rubric.check(&suite, path).map_err(Stop::bad_input)?;
                rubric
            }
            None => Rubric::default(),
        };
        Ok(Inputs { suite, expected, rubric })
    }

    fn folders(&self) -> Result<Folders, Stop> {
        for folder in [&self.root, &self.assets, &self.extra_credit].into_iter().flatten() {
            if !folder.is_dir() {
                return Err(Stop::bad_input(format!(
                    "{}: there is no such folder",
                    folder.display()
                )));
            }
        }
        let (assets, extra_credit) = match &self.assets {
            Some(assets) => (assets.clone(), self.extra_credit.clone()),
            None => {
                let root = match &self.root {
                    Some(root) => root.clone(),
                    None => find_root()?,
                };
                let extra_credit = self.extra_credit.clone();
                (root.join("assets"), Some(extra_credit.unwrap_or(root.join("extracreditassets"))))
            }
        };
        let expected = self.expected.clone().unwrap_or_else(|| assets.with_file_name("expected"));
        Ok(Folders { assets, extra_credit, expected })
    }
}

struct Folders {
    assets: PathBuf,
    extra_credit: Option<PathBuf>,
    expected: PathBuf,
}

/// The nearest folder, here or above, that holds assets/; as a short relative path where it is here.
fn find_root() -> Result<PathBuf, Stop> {
    if Path::new("assets").is_dir() {
        return Ok(PathBuf::new());
    }
    let here = std::env::current_dir().map_err(Stop::bad_input)?;
    let root = here.ancestors().find(|folder| folder.join("assets").is_dir());
    root.map(Path::to_path_buf).ok_or_else(|| {
        let message = "there is no assets/ folder here or above\n  help: run grade where the scenes are, or name a folder with --root or --assets";
        Stop::bad_input(message)
    })
}

/// Writes to the standard output, with colours where it shows them. A closed pipe is no failure.
fn print(bytes: &[u8]) {
    let mut out = anstream::stdout();
    let _ = out.write_all(bytes).and_then(|()| out.flush());
}

fn complain(kind: &str, message: impl std::fmt::Display) {
    let _ = writeln!(anstream::stderr(), "{kind}: {message}");
}
