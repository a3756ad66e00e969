//! An untrusted program that turns a scene into a trace.
//!
//! There are two calling conventions. The grader tries both to find out which one the program has:
//!
//! ```text
//! FOSSSim's   PROGRAM -s scene.xml -d 0 -o trace.bin     trace: the course's binary
//! ours        PROGRAM scene.xml -o trace.csv             trace: CSV
//! ```
//!
//! A program that offers it takes many scenes in one run (`serving.rs`). Each run has its own scratch folder as working directory,
//! which is removed once the states have been read. No shell is involved. The result is always a stream of states or a named
//! failure. Only a failure of the grader or its machine is a fault.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Instant;

use scene::Dimension;
use scene::trace::{self, Shape, State, TraceFormat, TraceReader};

use super::StateSource;
use super::budget::Budget;
use super::hand_in::HandIn;
use super::kept::{KeptEnd, KeptRuns};
use crate::boundary::door::Door;
use crate::boundary::printed::{self, Untrusted};
use crate::suite::{Case, SolverName, hash_bytes, hash_file};
use crate::verdict::{
    Failure, Fault, FormFault, LastOutput, NotGreeted, RunEnd, RunFailure, Verdict,
};
use sandbox::scratch::{Scratch, scratch_folder, without_paths};
use sandbox::{
    End, Exceeded, Job, Keep, Limits, Outcome, Printed, Protection, Sandbox, SandboxError,
};

/// A minimal scene for probing the calling convention: one free particle, one step.
const GREETING: &str = r#"<scene>
  <duration time="0.5"/>
  <integrator type="explicit-euler" dt="0.5"/>
  <particle m="1" px="0.25" py="-1.5" vx="2" vy="0.5" fixed="0" radius="0.1"/>
</scene>
"#;

/// The shape of its states.
pub(super) const GREETED: Shape = Shape { dimension: Dimension::Two, n_particles: 1 };

/// The velocity in that scene.
const GREETED_VELOCITY: [f64; 2] = [2.0, 0.5];

/// Integrators that all take the same step in that scene; a program needs to know only one of them.
const GREETING_METHODS: [&str; 4] =
    ["explicit-euler", "symplectic-euler", "forward-backward-euler", "linearized-implicit-euler"];

/// The minimal scene by each of these integrators.
pub(super) fn greetings() -> impl Iterator<Item = String> {
    GREETING_METHODS.iter().map(|method| GREETING.replace(GREETING_METHODS[0], method))
}

/// Whether the first state of a run is that of the minimal scene.
///
/// # Errors
/// The failure, if not.
pub(super) fn greeted(mut run: ProgramRun) -> Result<(), Failure> {
    let mut state = State::zeros(GREETED);
    if !run.read(&mut state)? {
        return Err(Failure::malformed(FormFault::Empty));
    }
    // The particle keeps its velocity. Other mistakes are judged in the scenes.
    let found = [state.positions, state.velocities].concat();
    if !GREETED_VELOCITY.iter().any(|value| found.contains(value) || found.contains(&-value)) {
        return Err(Failure::malformed(FormFault::NoVelocity(GREETED_VELOCITY)));
    }
    Ok(())
}

/// Placeholder in arguments for the scene's file.
const SCENE: &str = "{scene}";

/// Placeholder in arguments for the trace's file.
const TRACE: &str = "{trace}";

/// Placeholder in commands for the linear solver that the scene asks for.
const SOLVER: &str = "{solver}";

/// Placeholder in commands for the submission's folder.
const FOLDER: &str = "{folder}";

/// The folder of a program in its scratch folder.
pub(crate) const HOME: &str = "folder";

/// The file of the calls of functions or of served scenes, and that of what functions give.
pub(super) const CALLS: &str = "calls.txt";
const ANSWERS: &str = "answers.txt";

/// Settings for running programs.
#[derive(Debug, Clone)]
pub struct Runner {
    /// The protection.
    pub sandbox: Sandbox,
    /// The limits of a run.
    pub limits: Limits,
    /// Files and folders that programs may read, in addition to those of the system and their own.
    pub readable: Vec<PathBuf>,
    /// Where the program's runs are kept and looked for.
    pub kept: Vec<Arc<KeptRuns>>,
    /// The time of all its runs, if limited.
    pub budget: Option<Budget>,
}

impl Runner {
    /// One that keeps nothing, and limits single runs only.
    pub fn new(sandbox: Sandbox, limits: Limits, readable: Vec<PathBuf>) -> Self {
        Self { sandbox, limits, readable, kept: Vec::new(), budget: None }
    }

    /// Whether the runs whose output is shown were made in a first phase.
    pub(super) fn is_second_phase(&self) -> bool {
        self.kept.iter().any(|kept| kept.is_closed())
    }
}

/// A program with its calling convention.
#[derive(Debug, Clone)]
pub struct Program {
    pub(super) name: Untrusted,
    pub(super) path: PathBuf,
    /// In which `{scene}` and `{trace}` stand for files.
    pub(super) arguments: Vec<String>,
    pub(super) serving: Option<Arc<Serving>>,
    pub(super) format: TraceFormat,
    pub(super) runner: Runner,
    /// The folder that it was built in; it lives as long as the program.
    pub(super) copy: Option<Arc<Scratch>>,
    /// The files that a pack took from the hand-in, in words.
    pub(crate) taken: Option<Untrusted>,
}

/// How a program takes many scenes in one run (`serving.rs`).
#[derive(Debug)]
pub(super) struct Serving {
    pub(super) program: PathBuf,
    pub(super) arguments: Vec<String>,
    /// Runs that exceeded a limit.
    pub(super) exceeded: AtomicU32,
}

impl Serving {
    pub(super) fn new(CommandLine { program, arguments }: CommandLine) -> Self {
        Self { program, arguments, exceeded: AtomicU32::default() }
    }
}

/// A calling convention.
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

/// A scene as input of a program.
#[derive(Debug, Clone, Copy)]
pub enum SceneSource<'a> {
    /// XML text.
    Xml(&'a str),
    /// A scene of the suite.
    Case(&'a Case),
}

impl SceneSource<'_> {
    /// The file name of the program's copy. The scene's own name would reveal what is graded.
    fn name(self) -> &'static str {
        let is_json = |case: &Case| {
            case.files.first().is_some_and(|file| file.name.extension() == Some("json".as_ref()))
        };
        match self {
            Self::Case(case) if is_json(case) => "scene.json",
            _ => "scene.xml",
        }
    }

    /// The linear solver that the scene asks for: `sparse` unless its assignment says otherwise.
    fn solver(self) -> &'static str {
        match self {
            Self::Case(case) => case.solver.name(),
            Self::Xml(_) => SolverName::default().name(),
        }
    }
}

/// Result of probing a program's calling convention.
#[derive(Debug)]
pub enum Identified {
    /// A program with a known calling convention.
    Program(Program),
    /// A program that writes no trace of the minimal scene under either convention.
    Unusable {
        /// Its name in reports: its path, as given.
        name: Untrusted,
        /// Its failure.
        failure: Failure,
    },
}

impl Program {
    /// Finds out the calling convention of the program at `path`. Cost: one run, up to eight if it lacks integrators.
    ///
    /// # Errors
    /// If the grader or its machine could not run it.
    pub fn identify(path: &Path, runner: Runner) -> Result<Identified, SandboxError> {
        let name = path.display().to_string().into();
        // An absolute path, because each run has another working directory.
        let path = scene::input::real_path(path).unwrap_or_else(|_| path.to_path_buf());
        let (arguments, format) = (Vec::new(), TraceFormat::Csv);
        let (copy, serving, taken) = (None, None, None);
        let mut program = Self { name, path, arguments, serving, format, runner, copy, taken };
        // The sandbox's own user may lack permission to read the original.
        if program.runner.sandbox.has_own_user() {
            let copy = scratch_folder().map_err(SandboxError::no_scratch)?;
            let path = copy.path().join("program");
            match HandIn::open(&program.path).and_then(|file| file.copy_to(&path)) {
                Err(error) if error.is_fault() => {
                    return Err(SandboxError::no_scratch(io::Error::other(error)));
                }
                Err(error) => {
                    let failure = Failure::BadHandIn { reason: error.to_string().into() };
                    return Ok(Identified::Unusable { name: program.name, failure });
                }
                Ok(()) => (program.path, program.copy) = (path, Some(Arc::new(copy))),
            }
        }
        program.runner.readable.push(program.path.clone());
        let mut failures: [Option<Failure>; 2] = [None, None];
        for scene in greetings() {
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
            // A crash may mean an unknown integrator. A time-out or an exceeded limit would recur.
            if failures.iter().flatten().all(|failure| !failure.may_lack_a_method()) {
                break;
            }
        }
        let [fosssim, plain] =
            failures.map(|found| found.unwrap_or(Failure::malformed(FormFault::Empty)));
        let program_name = program.name.line();
        let failure =
            Failure::NotGreeted(Box::new(NotGreeted { program: program_name, fosssim, plain }));
        Ok(Identified::Unusable { name: program.name, failure })
    }

    /// The same program with further arguments.
    pub fn with_arguments<'a>(&self, more: impl IntoIterator<Item = &'a str>) -> Self {
        let mut other = self.clone();
        other.arguments.extend(more.into_iter().map(str::to_owned));
        other
    }

    /// The same program with traces in this format.
    pub fn with_format(self, format: TraceFormat) -> Self {
        Self { format, ..self }
    }

    /// The same program with other limits. Unknown limits are ignored.
    pub fn with_limits(mut self, limits: &[(&str, f64)]) -> Self {
        for (name, value) in limits {
            let _ = self.runner.limits.set(name, *value);
        }
        self
    }

    /// The same program with a budget of time, if it has none yet.
    pub(super) fn with_budget(&self) -> Self {
        match self.runner.budget {
            Some(_) => self.clone(),
            None => self.with_own_budget(),
        }
    }

    /// The same program with a second budget of the same size, for measurements other than the scenes.
    pub(crate) fn with_own_budget(&self) -> Self {
        let mut other = self.clone();
        other.runner.budget = Some(Budget::new(self.runner.limits.budget(), 0.0));
        other
    }

    /// The same program, whose runs are not those of its first phase.
    pub(super) fn beyond_first_phase(&self) -> Self {
        let mut other = self.clone();
        other.runner.kept.retain(|kept| !kept.is_closed());
        other
    }

    /// The same program with twice its limits.
    pub fn with_twice_the_limits(mut self) -> Self {
        let Limits { cpu, wall, memory, processes, trace, stdout, stderr, files, budget: _ } =
            &mut self.runner.limits;
        for seconds in [cpu, wall] {
            *seconds *= 2.0;
        }
        for count in [memory, processes, trace, stdout, stderr, files] {
            *count = count.saturating_mul(2);
        }
        self
    }

    /// Whether its call is one of the two that need no `submission.toml`.
    pub(super) fn is_called_as_usual(&self) -> bool {
        Dialect::ALL.iter().any(|dialect| dialect.arguments() == self.arguments)
    }

    /// The program's name in reports: its path, as given.
    pub fn name(&self) -> &Untrusted {
        &self.name
    }

    /// Runs the program on a scene and opens the trace.
    ///
    /// # Errors
    /// A failure if it does not exit with status 0, or leaves no trace of this shape; a fault if it could not be run.
    pub fn run(&self, scene: SceneSource<'_>, shape: Shape) -> Result<ProgramRun, Verdict> {
        self.run_once(scene, shape, 0)
    }

    /// The same; `before` counts earlier runs on this scene, whose traces do not stand for this one's.
    fn run_once(
        &self,
        scene: SceneSource<'_>,
        shape: Shape,
        before: u32,
    ) -> Result<ProgramRun, Verdict> {
        self.try_run(scene, shape, before).map_err(|error| match error {
            RunError::Failed(failure) => Verdict::Fail(failure),
            RunError::NotRun(error) => {
                Verdict::GraderFault(Fault::NotRun { detail: error.to_string() })
            }
        })
    }

    /// Runs the program on a scene, after so many other runs, and hashes the bytes of the trace.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn trace_hash(&self, case: &Case, before: u32) -> Result<String, Verdict> {
        let run = self.run_once(SceneSource::Case(case), Shape::of(&case.scene), before)?;
        hash_file(&run.workspace.trace()).map_err(|error| {
            Verdict::Fail(Failure::Unreadable { reason: error.to_string().into() })
        })
    }

    /// Runs a driver of the folder that the program was built in on a file of calls, and returns what it writes. In the command,
    /// `{calls}`, `{answers}` and `{folder}` stand for these.
    ///
    /// # Errors
    /// A failure if it does not exit with status 0, or leaves no answers; a fault if it could not be run.
    pub(crate) fn answers(&self, command: &[String], calls: &str) -> Result<Untrusted, Verdict> {
        let fault = |detail: String| Verdict::GraderFault(Fault::NotRun { detail });
        let home = self.copy.as_ref().map(|copy| copy.path().join(HOME)).unwrap_or_default();
        let CommandLine { program, arguments } = CommandLine::of(command, &home);
        let workspace = Workspace::empty(&self.runner).map_err(|error| fault(error.to_string()))?;
        let folder = workspace.folder();
        fs::create_dir(&folder)
            .and_then(|()| fs::write(folder.join(CALLS), calls))
            .map_err(|error| fault(error.to_string()))?;
        let argument = |argument: String| {
            argument.replace("{calls}", CALLS).replace("{answers}", ANSWERS).into()
        };
        let job = Job {
            program,
            arguments: arguments.into_iter().map(argument).collect(),
            folder,
            input: None,
            keep: Keep::File(ANSWERS.to_owned(), workspace.trace()),
            readable: self.runner.readable.clone(),
            limits: self.runner.limits,
        };
        let sandbox = &self.runner.sandbox;
        let outcome = sandbox.run(&job).map_err(|error| fault(error.to_string()))?;
        if outcome.end != End::Exited(0) {
            return Err(Verdict::Fail(failure_of_run(&outcome, &job, sandbox).into()));
        }
        if let Err(reason) = outcome.kept.clone() {
            let end = RunEnd::NoTrace { file: ANSWERS.to_owned(), reason };
            return Err(Verdict::Fail(
                RunFailure { end, output: last_output(&outcome, sandbox) }.into(),
            ));
        }
        Door::Answers.text(&workspace.trace()).map_err(|error| {
            let reason = format!("{ANSWERS} {error}").into();
            Verdict::Fail(Failure::Unreadable { reason })
        })
    }

    /// The program's file, whose name may depend on the solver.
    fn path_for(&self, solver: &str) -> PathBuf {
        match self.path.to_str() {
            Some(path) if path.contains(SOLVER) => path.replace(SOLVER, solver).into(),
            _ => self.path.clone(),
        }
    }

    fn greet(&self, scene: &str) -> Result<(), RunError> {
        Ok(greeted(self.try_run(SceneSource::Xml(scene), GREETED, 0)?)?)
    }

    /// Inputs of a run other than the program: the arguments without the names of scratch folders, and the scene.
    fn key(&self, scene: SceneSource<'_>, before: u32) -> String {
        let arguments = self.arguments.iter().map(|argument| without_paths(argument));
        let mut parts: Vec<String> = arguments.collect();
        let solver = scene.solver().to_owned();
        parts.extend([solver, before.to_string(), format!("{:?}", self.format)]);
        match scene {
            SceneSource::Xml(text) => parts.push(text.to_owned()),
            SceneSource::Case(case) => parts.push(case.scene_hash.clone()),
        }
        // No list of parts has the JSON of another.
        hash_bytes(serde_json::json!(parts).to_string().as_bytes())
    }

    fn open_trace(
        &self,
        path: &Path,
        scene: SceneSource<'_>,
        shape: Shape,
    ) -> Result<Box<dyn TraceReader>, RunError> {
        let reader = match scene {
            SceneSource::Case(case) => trace::open_of_scene(path, self.format, &case.scene),
            SceneSource::Xml(_) => trace::open(path, self.format, shape),
        };
        Ok(reader.map_err(Failure::of_trace)?)
    }

    fn try_run(
        &self,
        scene: SceneSource<'_>,
        shape: Shape,
        before: u32,
    ) -> Result<ProgramRun, RunError> {
        let workspace = self.end(scene, before)?.map_err(Failure::Run)?;
        let reader = self.open_trace(&workspace.trace(), scene, shape)?;
        Ok(ProgramRun { reader, workspace: Arc::new(workspace), _copy: self.copy.clone() })
    }

    /// How a run ends: as it did before where that is kept. The workspace holds its trace.
    fn end(
        &self,
        scene: SceneSource<'_>,
        before: u32,
    ) -> Result<Result<Workspace, RunFailure>, SandboxError> {
        if self.runner.kept.is_empty() {
            return self.end_now(scene);
        }
        let key = self.key(scene, before);
        // A trace is read from here: messages name it as that of any run.
        let workspace = Workspace::empty(&self.runner).map_err(SandboxError::no_scratch)?;
        let find = |kept: &Arc<KeptRuns>| (Arc::clone(kept), kept.find(&key, &workspace.trace()));
        let (found, missing): (Vec<_>, Vec<_>) =
            self.runner.kept.iter().map(find).partition(|(_, end)| end.is_some());
        if missing.iter().any(|(kept, _)| kept.is_closed()) {
            let message =
                "the record of the first phase lacks a run\n  help: continue with --resume";
            return Err(SandboxError::not_run(message));
        }
        let end = match found.into_iter().find_map(|(_, end)| end) {
            Some(KeptEnd::Failed(failure)) => Err(failure),
            Some(KeptEnd::Trace) => Ok(workspace),
            None => self.end_now(scene)?,
        };
        for (kept, _) in missing {
            match &end {
                Ok(workspace) => kept.keep(&key, &workspace.trace()),
                Err(failure) => kept.keep_failure(&key, failure),
            }
        }
        Ok(end)
    }

    /// Runs the program.
    fn end_now(
        &self,
        scene: SceneSource<'_>,
    ) -> Result<Result<Workspace, RunFailure>, SandboxError> {
        if let Some(failure) = self.runner.budget.as_ref().and_then(Budget::used_up) {
            return Ok(Err(failure));
        }
        let workspace = Workspace::new(&self.runner, scene).map_err(SandboxError::no_scratch)?;
        let trace = format!("trace.{}", extension(self.format));
        let argument = |argument: &String| {
            let named = argument.replace(SCENE, scene.name()).replace(TRACE, &trace);
            named.replace(SOLVER, scene.solver()).into()
        };
        let job = Job {
            program: self.path_for(scene.solver()),
            arguments: self.arguments.iter().map(argument).collect(),
            folder: workspace.folder(),
            input: None,
            keep: Keep::File(trace.clone(), workspace.trace()),
            readable: self.runner.readable.clone(),
            limits: self.runner.limits,
        };
        let start = Instant::now();
        let outcome = self.runner.sandbox.run(&job)?;
        if let Some(budget) = &self.runner.budget {
            budget.spend(start.elapsed());
        }
        if outcome.end != End::Exited(0) {
            return Ok(Err(failure_of_run(&outcome, &job, &self.runner.sandbox)));
        }
        let Err(reason) = outcome.kept.clone() else { return Ok(Ok(workspace)) };
        let end = RunEnd::NoTrace { file: trace, reason };
        Ok(Err(RunFailure { end, output: last_output(&outcome, &self.runner.sandbox) }))
    }
}

/// The extension of a trace's file.
pub(super) fn extension(format: TraceFormat) -> &'static str {
    match format {
        TraceFormat::Csv => "csv",
        TraceFormat::Fosssim => "bin",
    }
}

/// A command with the folder's path filled in.
pub(super) struct CommandLine {
    pub(super) program: PathBuf,
    pub(super) arguments: Vec<String>,
}

impl CommandLine {
    pub(super) fn of(words: &[String], home: &Path) -> Self {
        let folder = home.to_string_lossy();
        let mut words = words.iter().map(|word| word.replace(FOLDER, &folder));
        let program = words.next().unwrap_or_default();
        // The system searches for a name without `/`; an absolute path stays absolute.
        let program =
            if program.contains('/') { home.join(&program) } else { PathBuf::from(&program) };
        Self { program, arguments: words.collect() }
    }

    /// With the submission's own files where arguments name them as from its folder, which is not the working directory of runs.
    pub(super) fn in_folder(self, home: &Path) -> Self {
        let own = |word: String| match Path::new(&word).is_relative() && home.join(&word).is_file()
        {
            true => home.join(word).to_string_lossy().into_owned(),
            false => word,
        };
        Self { arguments: self.arguments.into_iter().map(own).collect(), ..self }
    }
}

/// The scratch folder of one run.
pub(super) struct Workspace(Scratch);

impl Workspace {
    /// An empty one.
    pub(super) fn empty(runner: &Runner) -> io::Result<Self> {
        Ok(Self(runner.sandbox.scratch(&runner.limits)?))
    }

    /// One with the scene in the program's working directory.
    fn new(runner: &Runner, scene: SceneSource<'_>) -> io::Result<Self> {
        let workspace = Self::empty(runner)?;
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

    /// The program's working directory.
    pub(super) fn folder(&self) -> PathBuf {
        self.0.path().join("scratch")
    }

    /// The path where its trace is kept, or the folder of several.
    pub(super) fn trace(&self) -> PathBuf {
        self.0.path().join("trace")
    }
}

/// The failure of a run that did not end with exit status 0, or exceeded a limit.
pub(crate) fn failure_of_run(outcome: &Outcome, job: &Job, sandbox: &Sandbox) -> RunFailure {
    let limits = &job.limits;
    let end = match &outcome.end {
        End::Exited(code) => RunEnd::Exited(*code),
        End::Signalled(number) => RunEnd::Killed(*number),
        End::NotStarted(error) => {
            let program = job.program.as_path().into();
            let end = RunEnd::NotStarted { program, error: error.as_str().into() };
            return RunFailure { end, output: LastOutput::default() };
        }
        End::Exceeded(exceeded) => match exceeded {
            Exceeded::Cpu => RunEnd::Processor(limits.cpu),
            Exceeded::Wall => RunEnd::Wall(limits.wall),
            Exceeded::Memory => RunEnd::Memory(limits.memory),
            Exceeded::Processes => RunEnd::Processes(limits.processes),
            Exceeded::Trace => RunEnd::Folder(limits.trace),
            Exceeded::Stdout => RunEnd::Stdout(limits.stdout),
            Exceeded::Stderr => RunEnd::Stderr(limits.stderr),
            Exceeded::Files => RunEnd::Files(limits.files),
        },
    };
    let output = match job.keep {
        Keep::Tree(_) => output(outcome, sandbox, printed::ends),
        _ => last_output(outcome, sandbox),
    };
    RunFailure { end, output }
}

/// The program's own error output.
fn last_output(outcome: &Outcome, sandbox: &Sandbox) -> LastOutput {
    output(outcome, sandbox, printed::tail)
}

/// The part of its output that `shown` shows.
fn output(outcome: &Outcome, sandbox: &Sandbox, shown: fn(&Printed) -> String) -> LastOutput {
    let said = [&outcome.stdout, &outcome.stderr].map(shown);
    // Standard output counts only if standard error is empty.
    let text = said.into_iter().rev().find(|said| !said.is_empty()).unwrap_or_default();
    let is_hidden = sandbox.protections().contains(&Protection::Files);
    let misses_file = is_hidden && MISSING.iter().any(|words| text.contains(words));
    LastOutput { text: text.into(), misses_file }
}

/// How interpreters and loaders say that a module, a library or a file is missing.
const MISSING: [&str; 5] = [
    "No module named",
    "Cannot find module",
    "error while loading shared libraries",
    "can't open file",
    "No such file or directory",
];

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

/// The states of one run. Its scratch folder lives as long.
pub struct ProgramRun {
    pub(super) reader: Box<dyn TraceReader>,
    pub(super) workspace: Arc<Workspace>,
    pub(super) _copy: Option<Arc<Scratch>>,
}

impl StateSource for ProgramRun {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        StateSource::read(&mut self.reader, state)
    }

    fn has_velocities(&self) -> bool {
        self.reader.has_velocities()
    }
}
