//! Runs another's program so that it can do no harm.
//!
//! Nothing here needs privileges, a set-user-ID helper or a service. `grade` starts itself anew as the
//! *supervisor* of one run, which gives up what a stranger shall not have and starts the program:
//!
//! ```text
//! grade ── supervisor ───────── keeper ──────────── program ── …
//!          namespaces, limits   first process of    landlock, seccomp,
//!          of the whole tree    its own world       limits of a process
//! ```
//!
//! - **Namespaces** (user, process, network, IPC): the program sees no other process and no network. When
//!   the keeper ends, the kernel ends everything in its world, stragglers and daemons included; and the keeper
//!   ends with the supervisor, which ends with `grade`, however that ends.
//! - **Landlock**: the program reads the system's libraries and its own folder, writes its scratch folder, and
//!   meets no other file.
//! - **seccomp**: no sockets, tracing, mounts, keys, modules, clocks; see [`restrict`](self).
//! - **Limits** of each process by the kernel, of the whole tree by the supervisor, which looks at it every few
//!   milliseconds.
//!
//! Each is used where the kernel offers it, and [`Outcome::protections`] says which were. What the kernel does
//! not isolate is made up for where that can be done: without a namespace of processes, signals to others are
//! refused by seccomp, and the supervisor hunts stragglers down.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::Duration;

use serde::{Deserialize, Serialize};

mod plain;
pub(crate) mod scratch;

#[cfg(target_os = "linux")]
mod keeper;
#[cfg(target_os = "linux")]
mod restrict;
#[cfg(target_os = "linux")]
mod supervisor;
#[cfg(target_os = "linux")]
mod usage;

pub use scratch::sweep;
#[cfg(target_os = "linux")]
pub use supervisor::serve;

/// How often to try again to start a program that is being written.
const BUSY: u32 = 20;

/// The pause before each such attempt.
const BUSY_PAUSE: Duration = Duration::from_millis(10);

/// The longest a run may be given, in seconds.
const MOST_SECONDS: f64 = 1e6;

/// The most of anything that a run may be given.
const MOST_COUNT: f64 = 1e15;

/// The most that a run may use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Processor time of all its processes, in seconds.
    pub cpu: f64,
    /// Time from start to end, in seconds.
    pub wall: f64,
    /// Memory of all its processes, in bytes.
    pub memory: u64,
    /// Processes and threads at a time.
    pub processes: u64,
    /// Bytes in its scratch folder, its trace among them.
    pub trace: u64,
    /// Bytes of its standard output.
    pub stdout: u64,
    /// Bytes of its standard error.
    pub stderr: u64,
    /// Files and folders in its scratch folder.
    pub files: u64,
}

impl Limits {
    /// The names of all, with what they limit.
    pub const NAMES: [(&str, &str); 8] = [
        ("cpu", "seconds of processor time"),
        ("wall", "seconds from start to end"),
        ("memory", "bytes of memory"),
        ("processes", "processes and threads"),
        ("trace", "bytes in the scratch folder"),
        ("stdout", "bytes of standard output"),
        ("stderr", "bytes of standard error"),
        ("files", "files in the scratch folder"),
    ];

    /// Sets the limit of this name.
    ///
    /// # Errors
    /// In words, where there is no such limit, or it cannot be so.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), String> {
        let seconds = match name {
            "cpu" => Some(&mut self.cpu),
            "wall" => Some(&mut self.wall),
            _ => None,
        };
        if let Some(seconds) = seconds {
            if !(value > 0.0 && value <= MOST_SECONDS) {
                return Err(format!("{name} is above 0 and at most {MOST_SECONDS} s, not {value}"));
            }
            *seconds = value;
            return Ok(());
        }
        let count = match name {
            "memory" => &mut self.memory,
            "processes" => &mut self.processes,
            "trace" => &mut self.trace,
            "stdout" => &mut self.stdout,
            "stderr" => &mut self.stderr,
            "files" => &mut self.files,
            _ => {
                let names = Self::NAMES.map(|(name, _)| name).join(", ");
                return Err(format!("there is no limit {name}\n  help: the limits are {names}"));
            }
        };
        if !(1.0..=MOST_COUNT).contains(&value) || value.fract() != 0.0 {
            return Err(format!("{name} is a whole number from 1 to {MOST_COUNT:e}, not {value}"));
        }
        *count = value as u64;
        Ok(())
    }

    /// For builds.
    pub fn of_builds() -> Self {
        const GIB: u64 = 1 << 30;
        Self {
            cpu: 600.0,
            wall: 600.0,
            memory: 4 * GIB,
            processes: 512,
            trace: 2 * GIB,
            files: 100_000,
            ..Self::default()
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        const MIB: u64 = 1 << 20;
        Self {
            cpu: 30.0,
            wall: 60.0,
            memory: 2048 * MIB,
            processes: 64,
            trace: 512 * MIB,
            stdout: 4 * MIB,
            stderr: 4 * MIB,
            files: 64,
        }
    }
}

/// A limit that was met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Exceeded {
    /// Processor time.
    Cpu,
    /// Time from start to end.
    Wall,
    /// Memory.
    Memory,
    /// Processes.
    Processes,
    /// Bytes in the scratch folder.
    Trace,
    /// Bytes of standard output.
    Stdout,
    /// Bytes of standard error.
    Stderr,
    /// Files in the scratch folder.
    Files,
}

/// A program to be run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Job {
    /// The program, by its absolute path.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<OsString>,
    /// Its working directory, the only folder it may write to.
    pub scratch: PathBuf,
    /// The file its standard output goes to; outside of the scratch folder.
    pub stdout: PathBuf,
    /// The file its standard error goes to; outside of the scratch folder.
    pub stderr: PathBuf,
    /// Files and folders it may read, beside the system's own.
    pub readable: Vec<PathBuf>,
    /// The most it may use.
    pub limits: Limits,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// The program ended by itself, with this exit status.
    Exited(i32),
    /// A signal of this number ended it.
    Signalled(i32),
    /// It met a limit and was ended.
    Exceeded(Exceeded),
    /// The system did not start it.
    NotStarted(String),
}

/// What a program is kept from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protection {
    /// Files other than its own and the system's.
    Files,
    /// The network.
    Network,
    /// Signals to other processes.
    Signals,
    /// Sight of other processes, and outliving its run.
    Processes,
    /// System calls that no simulator needs, tracing among them; new privileges.
    SystemCalls,
    /// Memory, processor time, processes and output without end.
    Limits,
}

impl Protection {
    /// All there are.
    pub const ALL: [Self; 6] = [
        Self::Files,
        Self::Network,
        Self::Signals,
        Self::Processes,
        Self::SystemCalls,
        Self::Limits,
    ];

    /// Its name, fit for machines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Files => "files",
            Self::Network => "network",
            Self::Signals => "signals",
            Self::Processes => "processes",
            Self::SystemCalls => "system-calls",
            Self::Limits => "limits",
        }
    }
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// The protections that were in force.
    pub protections: Vec<Protection>,
}

/// Why a program could not be run: a fault of the grader or of its machine.
#[derive(Debug, thiserror::Error)]
#[error("a program could not be run: {0}")]
pub struct SandboxError(String);

impl SandboxError {
    /// There is no folder for the run.
    pub(crate) fn no_scratch(error: io::Error) -> Self {
        Self(format!("there is no folder to run it in: {error}"))
    }
}

/// Runs programs, under protection or not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sandbox {
    /// Under all the protection that the system offers. The supervisors are this program, which hands its start
    /// over to `serve`.
    Protected(PathBuf),
    /// With the rights of whoever grades. Of the limits, those of time and output hold.
    Unprotected,
}

impl Sandbox {
    /// Runs a program to its end. Under protection no process of it is left then. The calling thread must live
    /// on meanwhile: the run ends with it.
    ///
    /// # Errors
    /// Where it could not be run, and had no part in that.
    pub fn run(&self, job: &Job) -> Result<Outcome, SandboxError> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(launcher) => supervisor::run(launcher, job),
            #[cfg(not(target_os = "linux"))]
            Self::Protected(_) => Err(SandboxError(
                "this system offers no protection; run strangers' programs with --unprotected, or \
                 elsewhere"
                    .to_owned(),
            )),
            Self::Unprotected => plain::run(job),
        }
    }
}

impl Sandbox {
    /// The protections that are in force on this system, found out by a run of nothing.
    ///
    /// # Errors
    /// Where no program could be run at all.
    pub fn protections(&self) -> Result<Vec<Protection>, SandboxError> {
        let folder = scratch::scratch_folder().map_err(SandboxError::no_scratch)?;
        let scratch = folder.path().join("scratch");
        std::fs::create_dir(&scratch).map_err(SandboxError::no_scratch)?;
        let job = Job {
            program: scratch.join("nothing"),
            arguments: Vec::new(),
            stdout: folder.path().join("stdout"),
            stderr: folder.path().join("stderr"),
            scratch,
            readable: Vec::new(),
            limits: Limits::default(),
        };
        Ok(self.run(&job)?.protections)
    }
}

/// Which of the system's folders, or of these, a protected program could read this path in.
pub fn revealed_by<'a>(path: &Path, readable: &'a [PathBuf]) -> Option<&'a Path> {
    #[cfg(target_os = "linux")]
    let system = restrict::SYSTEM;
    #[cfg(not(target_os = "linux"))]
    let system: &[&str] = &[];
    let mut folders = system.iter().map(Path::new).chain(readable.iter().map(PathBuf::as_path));
    folders.find(|folder| path.starts_with(folder))
}

/// Starts the command, and tries again as long as its program is being written: another thread's child, not yet
/// itself, may still hold open what was written a moment ago.
fn spawn(command: &mut Command) -> io::Result<Child> {
    for _ in 0..BUSY {
        match command.spawn() {
            Err(error) if error.kind() == io::ErrorKind::ExecutableFileBusy => {
                std::thread::sleep(BUSY_PAUSE);
            }
            started => return started,
        }
    }
    command.spawn()
}

/// The limit of what is written that is met, if one is.
fn too_much_output(job: &Job) -> Option<Exceeded> {
    let Limits { trace, stdout, stderr, files, .. } = job.limits;
    let size = |path: &Path| std::fs::symlink_metadata(path).map_or(0, |metadata| metadata.len());
    let (bytes, entries) = usage_of_folder(&job.scratch);
    match () {
        () if size(&job.stdout) >= stdout => Some(Exceeded::Stdout),
        () if size(&job.stderr) >= stderr => Some(Exceeded::Stderr),
        () if bytes >= trace => Some(Exceeded::Trace),
        () if entries > files => Some(Exceeded::Files),
        () => None,
    }
}

/// Bytes and entries below a folder; links are not followed.
fn usage_of_folder(folder: &Path) -> (u64, u64) {
    let (mut bytes, mut entries) = (0, 0);
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().into_iter().flatten().flatten() {
            entries += 1;
            // `DirEntry` looks at a link itself.
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_dir() {
                folders.push(entry.path());
            } else {
                bytes += metadata.len();
            }
        }
    }
    (bytes, entries)
}
