//! A program that turns a scene into a trace, run as another process.
//!
//! It is called in one of two ways, and which one it understands is found out by trying:
//!
//! ```text
//! FOSSSim's   PROGRAM -s scene.xml -d 0 -o trace.bin     trace: the course's binary
//! ours        PROGRAM scene.xml -o trace.csv             trace: CSV
//! ```
//!
//! Each run has a scratch folder of its own, which is its working directory and is removed with the states
//! that were read from it. No shell is involved. Whatever a program does, what comes of it is states or a named
//! failure; only what the grader or its machine cannot do is a fault.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use simulator::scene::Dimension;
use simulator::trace::{self, Shape, State, TraceFormat, TraceReader};

use super::folder::Copy;
use super::hand_in::HandIn;
use super::{StateSource, failure_of};
use crate::printed;
use crate::suite::{Case, hash_file};
use crate::verdict::{Failure, Fault, Verdict};
use sandbox::scratch::{Scratch, scratch_folder};
use sandbox::{End, Exceeded, Job, Keep, Limits, NotKept, Outcome, Sandbox, SandboxError};

/// A scene that asks nothing but a step from a program: one particle on its way.
const GREETING: &str = r#"<scene>
  <duration time="0.5"/>
  <integrator type="explicit-euler" dt="0.5"/>
  <particle m="1" px="0.25" py="-1.5" vx="2" vy="0.5" fixed="0" radius="0.1"/>
</scene>
"#;

/// The state that the scene above starts from.
const GREETED: ([f64; 2], [f64; 2]) = ([0.25, -1.5], [2.0, 0.5]);

/// Spellings of a method that offers the step which the scene above asks for.
const GREETING_METHODS: [&str; 4] =
    ["explicit-euler", "symplectic-euler", "forward-backward-euler", "linearized-implicit-euler"];

/// In arguments: the scene's file.
const SCENE: &str = "{scene}";

/// In arguments: the trace's file.
const TRACE: &str = "{trace}";

/// How programs are run.
#[derive(Debug, Clone)]
pub struct Runner {
    /// Under which protection.
    pub sandbox: Sandbox,
    /// The most that a run may use.
    pub limits: Limits,
    /// Files and folders that programs may read, beside the system's and their own.
    pub readable: Vec<PathBuf>,
}

/// A program with the way in which it is called.
#[derive(Debug, Clone)]
pub struct Program {
    pub(super) name: String,
    pub(super) path: PathBuf,
    /// In which `{scene}` and `{trace}` stand for files.
    pub(super) arguments: Vec<String>,
    pub(super) format: TraceFormat,
    pub(super) runner: Runner,
    /// The folder that it was built in; it lives as long as the program.
    pub(super) copy: Option<Copy>,
}

/// A way to call a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dialect {
    Fosssim,
    Plain,
}

impl Dialect {
    const ALL: [Self; 2] = [Self::Fosssim, Self::Plain];

    fn arguments(self) -> Vec<String> {
        let arguments: &[&str] = match self {
            Self::Fosssim => &["-s", SCENE, "-d", "0", "-o", TRACE],
            Self::Plain => &[SCENE, "-o", TRACE],
        };
        arguments.iter().map(|argument| (*argument).to_owned()).collect()
    }

    fn format(self) -> TraceFormat {
        match self {
            Self::Fosssim => TraceFormat::Fosssim,
            Self::Plain => TraceFormat::Csv,
        }
    }
}

/// A scene for a program.
#[derive(Debug, Clone, Copy)]
pub enum SceneSource<'a> {
    /// In XML.
    Xml(&'a str),
    /// A scene of the suite.
    Case(&'a Case),
}

impl SceneSource<'_> {
    /// What the program's copy is called. A scene's own name would tell it what is graded.
    fn name(self) -> &'static str {
        let is_json = |case: &Case| {
            case.files.first().is_some_and(|file| file.name.extension() == Some("json".as_ref()))
        };
        match self {
            Self::Case(case) if is_json(case) => "scene.json",
            _ => "scene.xml",
        }
    }
}

/// What a file comes to.
#[derive(Debug)]
pub enum Identified {
    /// A program that is called in a known way.
    Program(Program),
    /// One that writes no trace of the simplest scene, whichever way it is called.
    Unusable {
        /// What reports call it: its path, as given.
        name: String,
        /// What came of it.
        failure: Failure,
    },
}

impl Program {
    /// Finds out how the program at `path` is called. Costs one run, up to eight where it lacks methods.
    ///
    /// # Errors
    /// Where it could not be run, through no fault of its own.
    pub fn identify(path: &Path, runner: Runner) -> Result<Identified, SandboxError> {
        let name = path.display().to_string();
        // Each run has another working directory.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let (arguments, format) = (Vec::new(), TraceFormat::Csv);
        let mut program = Self { name, path, arguments, format, runner, copy: None };
        // A user of its own may not read what is not everybody's.
        if program.runner.sandbox.has_own_user() {
            let copy = scratch_folder().map_err(SandboxError::no_scratch)?;
            let path = copy.path().join("program");
            match HandIn::open(&program.path).and_then(|file| file.copy_to(&path)) {
                Err(error) if error.is_fault() => {
                    return Err(SandboxError::no_scratch(io::Error::other(error)));
                }
                Err(error) => {
                    let failure = Failure::BadHandIn { detail: error.to_string() };
                    return Ok(Identified::Unusable { name: program.name, failure });
                }
                Ok(()) => (program.path, program.copy) = (path, Some(Arc::new(copy))),
            }
        }
        program.runner.readable.push(program.path.clone());
        let mut failures = [None, None];
        for method in GREETING_METHODS {
            let scene = GREETING.replace(GREETING_METHODS[0], method);
            for (dialect, failure) in Dialect::ALL.into_iter().zip(&mut failures) {
                program.arguments = dialect.arguments();
                program.format = dialect.format();
                match program.greet(&scene) {
                    Ok(()) => return Ok(Identified::Program(program)),
                    Err(RunError::NotRun(error)) => return Err(error),
                    Err(RunError::Failed(found)) => {
                        failure.get_or_insert(found);
                    }
                }
            }
            // Whoever knows the method no better gives up; who spins or floods would do so at the next.
            let is_other = |failure: &Option<Failure>| {
                failure.as_ref().is_some_and(|failure| !may_lack_a_method(failure))
            };
            if failures.iter().all(is_other) {
                break;
            }
        }
        let none = || Failure::NoOutput { detail: "wrote no trace".to_owned() };
        let [fosssim, plain] = failures.map(|failure| failure.unwrap_or_else(none));
        let failure = of_both(&program.name, fosssim, plain);
        Ok(Identified::Unusable { name: program.name, failure })
    }

    /// The same program, called with these arguments behind its own.
    pub fn with_arguments<'a>(&self, more: impl IntoIterator<Item = &'a str>) -> Self {
        let mut other = self.clone();
        other.arguments.extend(more.into_iter().map(str::to_owned));
        other
    }

    /// The same program, of which traces in this format are expected.
    pub fn with_format(self, format: TraceFormat) -> Self {
        Self { format, ..self }
    }

    /// The same program under other limits; a limit that there is not is passed over.
    pub fn with_limits(mut self, limits: &[(&str, f64)]) -> Self {
        for (name, value) in limits {
            let _ = self.runner.limits.set(name, *value);
        }
        self
    }

    /// What reports call it: its path, as given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Runs the program on a scene; the states of the trace that it leaves.
    ///
    /// # Errors
    /// A failure where it does not end well, or there is no trace of this shape; a fault where it could not be
    /// run.
    pub fn run(&self, scene: SceneSource<'_>, shape: Shape) -> Result<Run, Verdict> {
        self.try_run(scene, shape).map_err(|error| match error {
            RunError::Failed(failure) => Verdict::Fail(failure),
            RunError::NotRun(error) => {
                Verdict::GraderFault(Fault::NotRun { detail: error.to_string() })
            }
        })
    }

    /// The hash of the bytes of the trace that it leaves of a scene, each time anew.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn trace_hash(&self, case: &Case) -> Result<String, Verdict> {
        let run = self.run(SceneSource::Case(case), Shape::of(&case.scene))?;
        hash_file(&run.path).map_err(|error| {
            Verdict::Fail(Failure::NoOutput {
                detail: format!("the trace cannot be read: {error}"),
            })
        })
    }

    fn greet(&self, scene: &str) -> Result<(), RunError> {
        let shape = Shape { dimension: Dimension::Two, n_particles: 1 };
        let mut run = self.try_run(SceneSource::Xml(scene), shape)?;
        let mut state = State::zeros(shape);
        let (positions, velocities) = GREETED;
        let right = run.read(&mut state)?
            && state.positions == positions
            && state.velocities == velocities
            && run.read(&mut state)?;
        if !right {
            return Err(RunError::Failed(Failure::Malformed {
                detail: "the trace does not start from the scene's state, or holds no step"
                    .to_owned(),
            }));
        }
        Ok(())
    }

    fn try_run(&self, scene: SceneSource<'_>, shape: Shape) -> Result<Run, RunError> {
        let workspace = Workspace::new(scene).map_err(SandboxError::no_scratch)?;
        let trace = match self.format {
            TraceFormat::Csv => "trace.csv",
            TraceFormat::Fosssim => "trace.bin",
        };
        let argument =
            |argument: &String| argument.replace(SCENE, scene.name()).replace(TRACE, trace).into();
        let path = workspace.trace();
        let job = Job {
            program: self.path.clone(),
            arguments: self.arguments.iter().map(argument).collect(),
            folder: workspace.folder(),
            keep: Keep::File(trace.to_owned(), path.clone()),
            readable: self.runner.readable.clone(),
            limits: self.runner.limits,
        };
        let outcome = self.runner.sandbox.run(&job)?;
        if outcome.end != End::Exited(0) {
            return Err(RunError::Failed(failure_of_run(&outcome, &job)));
        }
        if let Err(reason) = &outcome.kept {
            return Err(RunError::Failed(no_trace(trace, reason, &outcome)));
        }
        let reader = trace::open(&path, self.format, shape).map_err(failure_of)?;
        Ok(Run { reader, path, _workspace: workspace, _copy: self.copy.clone() })
    }
}

/// Whether another method may make a difference to a program that failed so.
fn may_lack_a_method(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Crashed { .. } | Failure::NoOutput { .. } | Failure::Malformed { .. }
    )
}

/// The failure of a program that fails whichever way it is called.
fn of_both(name: &str, fosssim: Failure, plain: Failure) -> Failure {
    let both = format!(
        "writes no trace of a single free particle\n  called as `{name} -s scene.xml -d 0 -o trace.bin`: \
         {fosssim}\n  called as `{name} scene.xml -o trace.csv`: {plain}"
    );
    // Whoever does not understand a call gives up, or writes nothing; what else happens says more.
    let gives_up =
        |failure: &Failure| matches!(failure, Failure::Crashed { .. } | Failure::NoOutput { .. });
    let mut failure = if gives_up(&fosssim) && !gives_up(&plain) { plain } else { fosssim };
    if let Failure::NoOutput { detail }
    | Failure::Crashed { detail }
    | Failure::Malformed { detail }
    | Failure::TimedOut { detail }
    | Failure::OutOfMemory { detail }
    | Failure::TooMuchOutput { detail }
    | Failure::TooManyProcesses { detail } = &mut failure
    {
        *detail = both;
    }
    failure
}

/// The failure of a program that ended well and left no trace that can be read.
fn no_trace(name: &str, reason: &NotKept, outcome: &Outcome) -> Failure {
    let said = complaint(outcome);
    match reason {
        NotKept::Missing => Failure::NoOutput {
            detail: format!("ended with exit status 0, but wrote no trace{said}"),
        },
        NotKept::TooLarge(_) => Failure::TooMuchOutput { detail: format!("{name} {reason}{said}") },
        _ => Failure::NoOutput {
            detail: format!("ended with exit status 0, but {name} {reason}{said}"),
        },
    }
}

/// `SIGSEGV`, or the number where it has no name.
fn signal_name(number: i32) -> String {
    #[cfg(unix)]
    if let Some(signal) = rustix::process::Signal::from_named_raw(number) {
        let name = format!("{signal:?}");
        // Some versions of rustix put it in quotes.
        return format!("SIG{}", name.trim_matches('"').trim_start_matches("Signal::"));
    }
    format!("signal {number}")
}

/// The folder of one run.
pub(super) struct Workspace(Scratch);

impl Workspace {
    /// With nothing in it.
    pub(super) fn empty() -> io::Result<Self> {
        Ok(Self(scratch_folder()?))
    }

    /// With the scene where the program works.
    fn new(scene: SceneSource<'_>) -> io::Result<Self> {
        let workspace = Self::empty()?;
        let scratch = workspace.folder();
        fs::create_dir(&scratch)?;
        match scene {
            SceneSource::Xml(text) => fs::write(scratch.join(scene.name()), text)?,
            SceneSource::Case(case) => {
                for (number, file) in case.files.iter().enumerate() {
                    let name = if number == 0 { Path::new(scene.name()) } else { &file.name };
                    fs::create_dir_all(scratch.join(name).parent().unwrap_or(&scratch))?;
                    fs::copy(&file.path, scratch.join(name))?;
                }
            }
        }
        Ok(workspace)
    }

    /// What the program finds in its working directory.
    fn folder(&self) -> PathBuf {
        self.0.path().join("scratch")
    }

    /// Where its trace is kept.
    fn trace(&self) -> PathBuf {
        self.0.path().join("trace")
    }
}

/// The failure that the end of a run is, where it is one.
pub(super) fn failure_of_run(outcome: &Outcome, job: &Job) -> Failure {
    let said = complaint(outcome);
    let limits = &job.limits;
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let exceeded = match &outcome.end {
        End::Exceeded(exceeded) => exceeded,
        End::Exited(code) => {
            return Failure::Crashed { detail: format!("ended with exit status {code}{said}") };
        }
        End::Signalled(number) => {
            let signal = signal_name(*number);
            return Failure::Crashed { detail: format!("killed by {signal}{said}") };
        }
        End::NotStarted(error) => {
            let program = job.program.display();
            return Failure::Crashed {
                detail: format!(
                    "cannot be started: {program}: {error}\n  help: it must be a program that may be executed, \
                     in a folder of the system's, of the submission or of --readable"
                ),
            };
        }
    };
    let too_much = |what: &str, limit: u64| Failure::TooMuchOutput {
        detail: format!("wrote more than {} MiB {what}{said}", mebibytes(limit)),
    };
    match exceeded {
        Exceeded::Cpu => Failure::TimedOut {
            detail: format!("used more than {} s of processor time{said}", limits.cpu),
        },
        Exceeded::Wall => {
            Failure::TimedOut { detail: format!("still ran after {} s{said}", limits.wall) }
        }
        Exceeded::Memory => Failure::OutOfMemory {
            detail: format!("needs more than {} MiB of memory{said}", mebibytes(limits.memory)),
        },
        Exceeded::Processes => Failure::TooManyProcesses {
            detail: format!("ran more than {} processes and threads{said}", limits.processes),
        },
        Exceeded::Trace => too_much("into its folder", limits.trace),
        Exceeded::Stdout => too_much("to standard output", limits.stdout),
        Exceeded::Stderr => too_much("to standard error", limits.stderr),
        Exceeded::Files => Failure::TooMuchOutput {
            detail: format!("made more than {} files{said}", limits.files),
        },
    }
}

/// What the program complained of, to be put behind a message.
fn complaint(outcome: &Outcome) -> String {
    let said = [&outcome.stdout, &outcome.stderr].map(printed::tail);
    // A program's standard output is its own business where it says on the other why it gave up.
    let said = said.into_iter().rev().find(|said| !said.is_empty());
    said.map_or_else(String::new, |said| format!("; it printed:\n{said}"))
}

/// Why a run yields no states.
enum RunError {
    NotRun(SandboxError),
    Failed(Failure),
}

impl From<Failure> for RunError {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl From<SandboxError> for RunError {
    fn from(error: SandboxError) -> Self {
        Self::NotRun(error)
    }
}

/// The states of one run; its scratch folder lives as long as they do.
pub struct Run {
    reader: Box<dyn TraceReader>,
    path: PathBuf,
    _workspace: Workspace,
    _copy: Option<Copy>,
}

impl StateSource for Run {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        StateSource::read(&mut self.reader, state)
    }
}
