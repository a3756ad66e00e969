//! A program that turns a scene into a trace, run as a child process.
//!
//! It is called in one of two ways, and which one it understands is found out by trying:
//!
//! ```text
//! FOSSSim's   PROGRAM -s scene.xml -d 0 -o out.bin       trace: the course's binary
//! ours        PROGRAM scene.xml -o out.csv               trace: CSV
//! ```
//!
//! Each run has a scratch folder of its own, which is its working directory and is removed with the states
//! that were read from it. No shell is involved. A run that takes longer than the limit is ended, with the
//! processes it started (on Unix). Whatever a program does, what comes of it is states or a named failure.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use simulator::trace::{self, Shape, State, TraceFormat, TraceReader};
use tempfile::TempDir;

use super::{StateSource, failure_of};
use crate::verdict::Failure;

/// How long a run may take unless told otherwise.
pub const TIME_LIMIT: Duration = Duration::from_secs(30);

/// The most of a program's complaints that a failure repeats, in bytes.
const COMPLAINT: usize = 300;

/// The first pause between two looks at a running program; each pause is half as long again as the last.
const FIRST_PAUSE: Duration = Duration::from_micros(200);

/// The longest pause between two looks at a running program.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);

/// How often to try again to start a program that is being written.
const BUSY: u32 = 20;

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

/// A program with the way in which it is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    name: String,
    path: PathBuf,
    dialect: Dialect,
    time_limit: Duration,
}

/// A way to call a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// `PROGRAM -s scene.xml -d 0 -o out.bin`.
    Fosssim,
    /// `PROGRAM scene.xml -o out.csv`.
    Plain,
}

/// A program that is of no use.
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// There is nothing to start.
    #[error("{name}: there is no such program")]
    Missing {
        /// Its path, as given.
        name: String,
    },
    /// The system does not start it.
    #[error("{name}: cannot be started: {source}\n  help: it must be a file that may be executed")]
    NotStarted {
        /// Its path, as given.
        name: String,
        /// Why.
        source: io::Error,
    },
    /// It turns the simplest scene into no trace.
    #[error(
        "{name}: writes no trace of a single free particle\n  called as `{name} -s scene.xml -d 0 -o out.bin`: {fosssim}\n  called as `{name} scene.xml -o out.csv`: {plain}"
    )]
    Silent {
        /// Its path, as given.
        name: String,
        /// What came of FOSSSim's way to call it.
        fosssim: Box<Failure>,
        /// What came of our way to call it.
        plain: Box<Failure>,
    },
}

impl Program {
    /// Finds out how the program at `path` is called. Costs one run, up to eight where it lacks methods.
    ///
    /// # Errors
    /// Where there is no such program, it cannot be started, or it writes no trace of a free particle.
    pub fn identify(path: &Path, time_limit: Duration) -> Result<Self, ProgramError> {
        let name = path.display().to_string();
        // Each run has another working directory.
        let path = fs::canonicalize(path).ok().filter(|path| path.is_file());
        let path = path.ok_or_else(|| ProgramError::Missing { name: name.clone() })?;
        let mut program = Self { name, path, dialect: Dialect::Fosssim, time_limit };
        let mut failures = [None, None];
        for method in GREETING_METHODS {
            let scene = GREETING.replace(GREETING_METHODS[0], method);
            for (dialect, failure) in
                [Dialect::Fosssim, Dialect::Plain].into_iter().zip(&mut failures)
            {
                program.dialect = dialect;
                match program.greet(&scene) {
                    Ok(()) => return Ok(program),
                    Err(RunError::NotStarted(source)) => {
                        return Err(ProgramError::NotStarted { name: program.name, source });
                    }
                    Err(RunError::Failed(found)) => {
                        failure.get_or_insert(found);
                    }
                }
            }
        }
        let [fosssim, plain] = failures.map(|failure| {
            let none = || Failure::NoOutput { detail: "there is no trace".to_owned() };
            Box::new(failure.unwrap_or_else(none))
        });
        Err(ProgramError::Silent { name: program.name, fosssim, plain })
    }

    /// What reports call it: its path, as given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How it is called.
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Runs the program on a scene file of this text; the states of the trace that it leaves.
    ///
    /// # Errors
    /// Where it does not end well, or there is no trace of this shape.
    pub fn run(&self, scene: &str, shape: Shape) -> Result<Run, Failure> {
        self.try_run(scene, shape).map_err(|error| match error {
            RunError::Failed(failure) => failure,
            RunError::NotStarted(source) => crashed(format!("cannot be started: {source}")),
        })
    }

    fn greet(&self, scene: &str) -> Result<(), RunError> {
        let shape = Shape { dimension: simulator::scene::Dimension::Two, n_particles: 1 };
        let mut run = self.try_run(scene, shape)?;
        let mut state = State::zeros(shape);
        let (positions, velocities) = GREETED;
        let right = run.read(&mut state)?
            && state.positions == positions
            && state.velocities == velocities
            && run.read(&mut state)?;
        let strange = || Failure::Malformed {
            detail: "the trace does not start from the scene's state, or holds no step".to_owned(),
        };
        if right { Ok(()) } else { Err(RunError::Failed(strange())) }
    }

    fn try_run(&self, scene: &str, shape: Shape) -> Result<Run, RunError> {
        let folder = tempfile::Builder::new().prefix("spring-oracle-").tempdir();
        let folder = folder.map_err(|error| no_scratch(&error))?;
        let input = folder.path().join("scene.xml");
        let complaints = folder.path().join("stderr.txt");
        fs::write(&input, scene).map_err(|error| no_scratch(&error))?;
        let (arguments, output, format): (&[&str], _, _) = match self.dialect {
            Dialect::Fosssim => (
                &["-s", "scene.xml", "-d", "0", "-o", "out.bin"],
                folder.path().join("out.bin"),
                TraceFormat::Fosssim,
            ),
            Dialect::Plain => {
                (&["scene.xml", "-o", "out.csv"], folder.path().join("out.csv"), TraceFormat::Csv)
            }
        };
        let stderr = File::create(&complaints).map_err(|error| no_scratch(&error))?;
        let mut child =
            spawn(&self.path, arguments, folder.path(), stderr).map_err(RunError::NotStarted)?;
        match wait(&mut child, self.time_limit) {
            Ok(Some(status)) if status.success() => {}
            Ok(Some(status)) => {
                let said = complaint(&complaints);
                return Err(RunError::Failed(crashed(format!("ended with {status}{said}"))));
            }
            Ok(None) => {
                let limit = self.time_limit.as_secs_f64();
                return Err(RunError::Failed(crashed(format!("still ran after {limit} s"))));
            }
            Err(error) => return Err(RunError::Failed(crashed(error.to_string()))),
        }
        if !output.is_file() {
            let said = complaint(&complaints);
            let detail = format!("ended well, and wrote no trace{said}");
            return Err(RunError::Failed(Failure::NoOutput { detail }));
        }
        let reader = trace::open(&output, format, shape).map_err(failure_of)?;
        Ok(Run { reader, _folder: folder })
    }
}

/// Starts a program: the one place where another's code is let loose.
fn spawn(program: &Path, arguments: &[&str], folder: &Path, stderr: File) -> io::Result<Child> {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr);
    // A group of its own, so that what it starts can be ended with it.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    for _ in 0..BUSY {
        match command.spawn() {
            // It was written a moment ago, and another thread's child, not yet itself, still holds it open.
            Err(error) if error.kind() == io::ErrorKind::ExecutableFileBusy => {
                std::thread::sleep(LONGEST_PAUSE);
            }
            started => return started,
        }
    }
    command.spawn()
}

/// How the child ended; `None` where it had to be ended at the limit.
fn wait(child: &mut Child, limit: Duration) -> io::Result<Option<ExitStatus>> {
    let started = Instant::now();
    let mut pause = FIRST_PAUSE;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if started.elapsed() >= limit {
            end(child)?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(pause);
        pause = (pause * 3 / 2).min(LONGEST_PAUSE);
    }
}

/// Ends the child, and what it started.
#[cfg(unix)]
fn end(child: &mut Child) -> io::Result<()> {
    use rustix::process::{Pid, Signal, kill_process_group};
    // Until it is waited for, its number belongs to no other process.
    match i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        Some(group) => Ok(kill_process_group(group, Signal::KILL)?),
        None => child.kill(),
    }
}

/// Ends the child.
#[cfg(not(unix))]
fn end(child: &mut Child) -> io::Result<()> {
    child.kill()
}

/// The end of what the program complained of, to be put behind a message.
fn complaint(path: &Path) -> String {
    let bytes = fs::read(path).unwrap_or_default();
    let tail = &bytes[bytes.len().saturating_sub(COMPLAINT)..];
    let text = String::from_utf8_lossy(tail);
    let words: Vec<&str> = text.split_whitespace().collect();
    if words.is_empty() { String::new() } else { format!(": {}", words.join(" ")) }
}

/// Why a run yields no states.
enum RunError {
    NotStarted(io::Error),
    Failed(Failure),
}

impl From<Failure> for RunError {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

fn crashed(detail: String) -> Failure {
    Failure::Crashed { detail }
}

fn no_scratch(error: &io::Error) -> Failure {
    crashed(format!("there is no folder to run it in: {error}"))
}

/// The states of one run; its scratch folder lives as long as they do.
pub struct Run {
    reader: Box<dyn TraceReader>,
    _folder: TempDir,
}

impl StateSource for Run {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        StateSource::read(&mut self.reader, state)
    }
}
