//! Runs an untrusted program in a sandbox.
//!
//! ```text
//! grade ── supervisor ────────────────── keeper ────────────────────────── program ── …
//!          namespaces, control group     mounts, root of its own           own user, no capabilities,
//!          watches the run's limits      first process of the namespace    Landlock, seccomp, rlimits
//! ```
//!
//! `grade` starts itself as the *supervisor* of one run; that starts itself as the *keeper*, the first process of
//! the program's PID namespace. When the keeper ends, the kernel ends every process of the run and drops its file
//! systems. The keeper ends with the supervisor, and the supervisor with `grade`.
//!
//! - **World** (`world.rs`): a root of its own on tmpfs. It holds the system's programs and libraries and what the
//!   job may read, all mounted read-only, and one writable tmpfs of limited size. Nothing else of the machine exists
//!   there. What the job keeps is copied out by the supervisor when no process of the run is left.
//! - **System calls** (`calls.rs`): a list of those that programs and compilers use; the kernel answers `ENOSYS` to all
//!   others.
//! - **Limits**: of a process by rlimits, of the whole run by the supervisor, by the size of its tmpfs, and by a
//!   control group where one is delegated (`cgroup.rs`).
//! - **Landlock** (`landlock.rs`): the second wall, and the first one where the system refuses namespaces.
//! - **Own user** (`identity.rs`): run by root, a program has an unprivileged user ID that nothing else has.
//!
//! [`Sandbox::open`] finds the strongest of these that the system grants, and then tests each protection from the
//! inside (`check.rs`). A run in which one of them cannot be set up does not happen.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
#[cfg(target_os = "linux")]
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};

mod limits;
#[cfg(unix)]
mod plain;
pub mod scratch;
#[cfg(unix)]
mod tree;

#[cfg(target_os = "linux")]
mod calls;
#[cfg(target_os = "linux")]
mod cgroup;
#[cfg(target_os = "linux")]
mod check;
#[cfg(target_os = "linux")]
mod identity;
#[cfg(target_os = "linux")]
mod keeper;
#[cfg(target_os = "linux")]
mod landlock;
#[cfg(target_os = "linux")]
mod process;
#[cfg(target_os = "linux")]
mod supervisor;
#[cfg(target_os = "linux")]
mod usage;
#[cfg(target_os = "linux")]
mod walls;
#[cfg(target_os = "linux")]
mod world;

pub use limits::{Exceeded, Limits};
#[cfg(target_os = "linux")]
use supervisor::Sweeper;
#[cfg(target_os = "linux")]
use walls::Walls;

/// How often to try again to start a program that is being written.
const BUSY: u32 = 20;

/// The pause before each such attempt.
const BUSY_PAUSE: Duration = Duration::from_millis(10);

/// The last bytes of an output that are kept.
const TAIL: usize = 4096;

/// The first word of the command line of the process that removes a killed grader's scratch folders.
pub const SWEEPER: &str = "--sandbox-sweeper";

/// A program to be run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Job {
    /// The program: an absolute path, or a name that is looked for where the system keeps programs.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<OsString>,
    /// An absolute path: the folder whose content it finds in its working directory.
    pub folder: PathBuf,
    /// What remains of what it writes there.
    pub keep: Keep,
    /// Canonical paths of files and folders it may read, beside the system's own.
    pub readable: Vec<PathBuf>,
    /// The most it may use.
    pub limits: Limits,
}

/// What remains of a run that ends with exit status 0. Everything else in its working directory is dropped.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// One regular file of this name, copied to this path.
    File(String, PathBuf),
    /// A build: the working directory has the path of the job's folder, and its regular files, folders and links are
    /// copied to this path. Files have the mode 644, or 755 where they may be executed.
    Tree(PathBuf),
}

/// Why there is nothing to keep.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
pub enum NotKept {
    /// It does not exist.
    #[error("does not exist")]
    Missing,
    /// A symbolic link.
    #[error("is a link, not a file")]
    Link,
    /// A folder.
    #[error("is a folder, not a file")]
    Folder,
    /// A pipe, a socket or a device.
    #[error("is not a regular file")]
    Special,
    /// A file with several names.
    #[error("has a second name elsewhere")]
    SecondName,
    /// More bytes than the run may write.
    #[error("holds more than {} MiB", *.0 as f64 / f64::from(1 << 20))]
    TooLarge(u64),
    /// More entries than the run may make, or folders nested too deep, or the system's reason.
    #[error("{0}")]
    Other(String),
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

/// The end of what a program printed.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Printed {
    /// Its last bytes.
    pub text: String,
    /// Whether something stood before them.
    pub cut: bool,
}

impl Printed {
    /// Of the last bytes of so many.
    fn of(tail: &[u8], total: u64) -> Self {
        Self { text: String::from_utf8_lossy(tail).into_owned(), cut: total > tail.len() as u64 }
    }
}

/// An output: how much there was, and its end.
#[derive(Debug, Default)]
struct Output {
    total: u64,
    tail: Vec<u8>,
}

impl Output {
    fn push(&mut self, bytes: &[u8]) {
        self.total += bytes.len() as u64;
        self.tail.extend(bytes);
        let excess = self.tail.len().saturating_sub(TAIL);
        self.tail.drain(..excess);
    }

    fn printed(&self) -> Printed {
        Printed::of(&self.tail, self.total)
    }
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// Whether what the job keeps was there. Nothing is kept of a run that does not end with exit status 0.
    pub kept: Result<(), NotKept>,
    /// Its standard output.
    pub stdout: Printed,
    /// Its standard error.
    pub stderr: Printed,
}

/// Why a program could not be run: a fault of the grader or of its machine.
#[derive(Debug, Clone, thiserror::Error)]
#[error("a program could not be run: {0}")]
pub struct SandboxError(String);

impl SandboxError {
    /// There is no folder for the run.
    pub fn no_scratch(error: io::Error) -> Self {
        Self(format!("there is no folder to run it in: {error}"))
    }
}

/// Runs programs, under protection or not.
#[derive(Debug, Clone)]
pub enum Sandbox {
    /// Under the protection that the system grants.
    #[cfg(target_os = "linux")]
    Protected(Arc<Protected>),
    /// With all rights of the caller. Of the limits, those of time and output hold.
    Unprotected,
}

/// The protection that a system grants.
#[cfg(target_os = "linux")]
#[derive(Debug)]
pub struct Protected {
    /// The program that serves as supervisor and keeper.
    launcher: PathBuf,
    walls: Walls,
    protections: Vec<Protection>,
    /// Why the stronger walls are not used.
    refused: Option<String>,
    _sweeper: Sweeper,
}

impl Sandbox {
    /// The strongest protection that this system grants, each part of it tested. `launcher` is a program that begins
    /// with [`serve`].
    ///
    /// # Errors
    /// Where no program can be run under protection.
    #[cfg(target_os = "linux")]
    pub fn open(launcher: &Path) -> Result<Self, SandboxError> {
        check::strongest(launcher).map(|protected| Self::Protected(Arc::new(protected)))
    }

    /// The strongest protection that this system grants: none.
    ///
    /// # Errors
    /// Always.
    #[cfg(not(target_os = "linux"))]
    pub fn open(_launcher: &Path) -> Result<Self, SandboxError> {
        Err(SandboxError("this system offers no protection".to_owned()))
    }

    /// Runs a program to its end. Under protection no process of it is left then. The calling thread must live
    /// on meanwhile: the run ends with it.
    ///
    /// # Errors
    /// Where it could not be run, and had no part in that.
    pub fn run(&self, job: &Job) -> Result<Outcome, SandboxError> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => {
                supervisor::run(&protected.launcher, &protected.walls, job)
            }
            #[cfg(unix)]
            Self::Unprotected => plain::run(job),
            #[cfg(not(unix))]
            Self::Unprotected => {
                let _ = job;
                Err(SandboxError(
                    "programs are run on Linux and other systems of Unix's kind".to_owned(),
                ))
            }
        }
    }

    /// The protections that are in force, as tested.
    pub fn protections(&self) -> &[Protection] {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => &protected.protections,
            Self::Unprotected => &[],
        }
    }

    /// Why not all protections are in force, in the system's words.
    pub fn refused(&self) -> Option<&str> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => protected.refused.as_deref(),
            Self::Unprotected => None,
        }
    }

    /// Whether programs run as a user of their own, who may read only what everybody may.
    pub fn has_own_user(&self) -> bool {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => protected.walls.own_user,
            Self::Unprotected => false,
        }
    }
}

/// Which of the system's folders, or of these, a protected program could read this path in.
pub fn revealed_by<'a>(path: &Path, readable: &'a [PathBuf]) -> Option<&'a Path> {
    #[cfg(target_os = "linux")]
    let system = walls::SYSTEM;
    #[cfg(not(target_os = "linux"))]
    let system: &[&str] = &[];
    let mut folders = system.iter().map(Path::new).chain(readable.iter().map(PathBuf::as_path));
    folders.find(|folder| path.starts_with(folder))
}

/// Starts the command, and tries again as long as its program is being written: another thread's child, not yet
/// itself, may still hold open what was written a moment ago.
#[cfg(unix)]
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

/// Copies what the job keeps out of its working directory.
#[cfg(unix)]
fn keep(working: std::os::fd::BorrowedFd<'_>, job: &Job) -> Result<(), NotKept> {
    match &job.keep {
        Keep::File(name, to) => tree::copy_file(working, name, to, job.limits.trace),
        Keep::Tree(to) => {
            let bounds = tree::Bounds { bytes: job.limits.trace, entries: job.limits.files };
            let create = || -> io::Result<_> {
                std::fs::create_dir(to)?;
                tree::open_folder(to)
            };
            let to = create().map_err(|error| NotKept::Other(error.to_string()))?;
            tree::copy(working, &to, bounds, None)
        }
    }
}

/// Does the work of a supervisor, a keeper or a check where this process was started as one; otherwise `None`. To be
/// called first of all, before any thread or file.
#[cfg(target_os = "linux")]
pub fn serve() -> Option<std::process::ExitCode> {
    let role = std::env::args_os().nth(1)?;
    let answered = match role.to_str()? {
        supervisor::SUPERVISOR => supervisor::serve(),
        supervisor::KEEPER => keeper::serve(),
        SWEEPER => supervisor::serve_sweeper(),
        check::CHECK => check::serve(),
        _ => return None,
    };
    Some(if answered.is_ok() {
        std::process::ExitCode::SUCCESS
    } else {
        std::process::ExitCode::from(3)
    })
}
