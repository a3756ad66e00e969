//! Runs an untrusted program in a sandbox.
//!
//! ```text
//! grade ── starter ── supervisor ───────────────── keeper ───────────────────────── program ── …
//!          no network namespaces, control group    mounts, separate root            own user, no capabilities,
//!                     watches the run's limits     first process of the namespace   Landlock, seccomp, rlimits
//! ```
//!
//! `grade` starts itself as a *starter*, once for each job that it runs at a time. For each run, a starter forks a
//! *supervisor*, which forks the *keeper*, the first process of the program's PID namespace. When the keeper ends, the
//! kernel kills every process of the run and discards its file systems. The keeper ends with the supervisor, and the
//! supervisor with its connection to `grade`.
//!
//! - **World** (`world.rs`): a separate root on tmpfs. It contains the system's programs and libraries and the
//!   readable files of the job, all mounted read-only, and one writable tmpfs of limited size. Nothing else of the
//!   machine is visible. The supervisor copies out the files to keep after all processes of the run have ended.
//! - **System calls** (`calls.rs`): programs may make only the calls that programs and compilers use; all others
//!   return `ENOSYS`.
//! - **Limits**: of a process by rlimits, of the whole run by the supervisor, by the size of its tmpfs, and by a
//!   control group where one can be had (`cgroup.rs`).
//! - **Landlock** (`landlock.rs`): a second layer, and the first if the system refuses namespaces.
//! - **Own user** (`identity.rs`): if root starts it, a program runs under a separate, unprivileged user ID.
//!
//! [`Sandbox::open`] finds the strongest combination that the system grants, and tests each protection from the
//! inside (`check.rs`). If a protection cannot be set up, the program does not run.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::process::{Child, Command};
#[cfg(target_os = "linux")]
use std::sync::Arc;
#[cfg(unix)]
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub mod files;
mod group;
mod limits;
mod plain;
pub mod scratch;
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
mod starter;
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
use starter::Starters;
#[cfg(target_os = "linux")]
use walls::Walls;

/// Number of retries to start a program.
#[cfg(unix)]
const BUSY: u32 = 20;

/// Pause before each retry.
#[cfg(unix)]
const BUSY_PAUSE: Duration = Duration::from_millis(10);

/// Bytes that a run may write whose scratch folder is in memory.
pub const IN_MEMORY: u64 = 8 << 20;

/// Number of bytes kept from each end of an output.
pub const KEPT: usize = 4096;

/// First argument of a process that starts runs, and removes a killed grader's scratch folders.
pub const STARTER: &str = "--sandbox-starter";

/// A program to run, with its files and limits.
#[derive(Debug, Clone)]
#[cfg_attr(target_os = "linux", derive(Serialize, Deserialize))]
pub struct Job {
    /// The program: an absolute path, or a name to look up in the system's folders of programs.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<OsString>,
    /// Absolute path of the folder whose content appears in its working directory.
    pub folder: PathBuf,
    /// The file in its working directory that is its standard input; without it, that is empty.
    pub input: Option<String>,
    /// The files to keep from its working directory.
    pub keep: Keep,
    /// Canonical paths of files and folders it may read, in addition to the system's.
    pub readable: Vec<PathBuf>,
    /// Its resource limits.
    pub limits: Limits,
}

/// The files to keep from a run. All others in its working directory are discarded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// One regular file with this name, copied to this path, if the exit status is 0.
    File(String, PathBuf),
    /// The regular files that there are with these names, however the run ends, copied to this folder.
    Each(Vec<String>, PathBuf),
    /// A build, if the exit status is 0: the working directory has the path of the job's folder, and its regular files, folders and links are
    /// copied to this path. Files have the mode 644, or 755 where they may be executed.
    Tree(PathBuf),
}

impl Keep {
    /// Whether anything is kept of a run that ends so.
    fn is_due(&self, end: &End) -> bool {
        *end == End::Exited(0) || matches!(self, Self::Each(..))
    }
}

/// Why no file was kept.
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
    /// The file holds more bytes than the run may write.
    #[error("holds more than {} MiB", *.0 as f64 / f64::from(1 << 20))]
    TooLarge(u64),
    /// Folders are nested deeper than this.
    #[error(
        "holds folders nested deeper than {0}\n  help: hand in fewer folders inside each other"
    )]
    TooDeep(usize),
    /// More entries than the run may make, or an error of the system.
    #[error("{0}")]
    Other(String),
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// The program ended by itself, with this exit status.
    Exited(i32),
    /// Killed by the signal of this number.
    Signalled(i32),
    /// Ended because it exceeded a limit.
    Exceeded(Exceeded),
    /// The system did not start it.
    NotStarted(String),
}

/// A protection of the machine from a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protection {
    /// Files other than its own and the system's.
    Files,
    /// The network.
    Network,
    /// Signals to other processes.
    Signals,
    /// Seeing other processes, and outliving its run.
    Processes,
    /// System calls that no simulator needs, such as tracing; gaining privileges.
    SystemCalls,
    /// Unlimited processor time, processes and output, and memory that processes show as their own.
    Limits,
    /// Memory that no process shows as its own: the kernel counts all memory of the run.
    Memory,
    /// Files in folders that only their owner may open: weaker than [`Protection::Files`], and in force only in its place. A
    /// program with a separate user ID sees every other file that everybody may read.
    ClosedFolders,
}

impl Protection {
    /// All protections of which none takes the place of another.
    pub const ALL: [Self; 7] = [
        Self::Files,
        Self::Network,
        Self::Signals,
        Self::Processes,
        Self::SystemCalls,
        Self::Limits,
        Self::Memory,
    ];

    /// Its machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Files => "files",
            Self::Network => "network",
            Self::Signals => "signals",
            Self::Processes => "processes",
            Self::SystemCalls => "system-calls",
            Self::Limits => "limits",
            Self::Memory => "memory",
            Self::ClosedFolders => "closed-folders",
        }
    }

    /// Whether a protection holds, or a stronger one in its place.
    pub fn holds_under(self, in_force: &[Self]) -> bool {
        in_force.contains(&self) || self == Self::ClosedFolders && in_force.contains(&Self::Files)
    }
}

/// Both ends of a program's output. They are untrusted, and cannot be printed as they are.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Printed {
    /// The first bytes; empty if nothing was cut off.
    head: String,
    /// The last bytes.
    text: String,
    /// Line breaks in the whole output.
    breaks: u64,
}

impl Printed {
    /// The first bytes of an output, if it was too long to be kept; else nothing.
    pub fn raw_head(&self) -> &str {
        &self.head
    }

    /// The last bytes, or all, as they were printed, with any terminal control in them.
    pub fn raw(&self) -> &str {
        &self.text
    }

    /// Whether output before [`Self::raw`] was cut off.
    pub fn is_cut(&self) -> bool {
        !self.head.is_empty()
    }

    /// Number of line breaks in the whole output.
    pub fn breaks(&self) -> u64 {
        self.breaks
    }
}

impl From<&[u8]> for Printed {
    fn from(bytes: &[u8]) -> Self {
        let mut output = Output::default();
        output.push(bytes);
        output.printed()
    }
}

/// An output: its length, and its first and last bytes.
#[derive(Debug, Default)]
struct Output {
    total: u64,
    breaks: u64,
    head: Vec<u8>,
    tail: Vec<u8>,
}

impl Output {
    fn push(&mut self, bytes: &[u8]) {
        self.total += bytes.len() as u64;
        self.breaks += bytes.iter().filter(|byte| **byte == b'\n').count() as u64;
        let missing = KEPT.saturating_sub(self.head.len());
        self.head.extend(&bytes[..missing.min(bytes.len())]);
        self.tail.extend(bytes);
        let excess = self.tail.len().saturating_sub(KEPT);
        self.tail.drain(..excess);
    }

    fn printed(&self) -> Printed {
        let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
        let is_cut = self.total > self.tail.len() as u64;
        let head = if is_cut { text(&self.head) } else { String::new() };
        Printed { head, text: text(&self.tail), breaks: self.breaks }
    }
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// Whether the files to keep were there.
    pub kept: Result<(), NotKept>,
    /// Its standard output.
    pub stdout: Printed,
    /// Its standard error.
    pub stderr: Printed,
}

/// Why a program could not be run: a fault of the grader or its machine.
#[derive(Debug, Clone, thiserror::Error)]
#[error("cannot run the program: {0}")]
pub struct SandboxError(String);

impl SandboxError {
    /// It was not run, for this reason.
    pub fn not_run(reason: impl std::fmt::Display) -> Self {
        Self(reason.to_string())
    }

    /// The folder for the run could not be created.
    pub fn no_scratch(error: io::Error) -> Self {
        Self(format!("cannot create its scratch folder: {error}"))
    }
}

/// Runs programs, protected or unprotected.
#[derive(Debug, Clone)]
pub enum Sandbox {
    /// Protected as far as the system allows.
    #[cfg(target_os = "linux")]
    Protected(Arc<Protected>),
    /// With all rights of the caller. Only the limits on time and output are enforced.
    Unprotected,
}

/// The protection that a system grants.
#[cfg(target_os = "linux")]
#[derive(Debug)]
pub struct Protected {
    starters: Starters,
    walls: Walls,
    protections: Vec<Protection>,
    /// Why stronger protections are not used.
    refused: Option<String>,
}

impl Sandbox {
    /// Whether this system has any.
    pub const IS_OFFERED: bool = cfg!(target_os = "linux");

    /// The strongest protection that this system grants, with each part tested. `launcher` must be a program that
    /// begins with [`serve`].
    ///
    /// # Errors
    /// If no program can be run under protection.
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

    /// Runs a program to its end. If protected, none of its processes is left afterwards.
    ///
    /// # Errors
    /// If the sandbox could not run it.
    pub fn run(&self, job: &Job) -> Result<Outcome, SandboxError> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => {
                supervisor::run(&protected.starters, &protected.walls, job)
            }
            Self::Unprotected => plain::run(job),
        }
    }

    /// A scratch folder for a run with these limits.
    ///
    /// It is in memory for a run that has a separate root and may write little: to make and remove its few files on a disk
    /// takes a third of the time of a short run, and all of it where other programs write.
    ///
    /// # Errors
    /// If it cannot be created.
    #[cfg_attr(not(target_os = "linux"), expect(unused_variables, reason = "no run has a root"))]
    pub fn scratch(&self, limits: &Limits) -> io::Result<scratch::Scratch> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected)
                if protected.walls.namespaces.exist() && limits.trace <= IN_MEMORY =>
            {
                scratch::scratch_folder_in_memory(limits.trace)
            }
            _ => scratch::scratch_folder(),
        }
    }

    /// The protections in force, as tested.
    pub fn protections(&self) -> &[Protection] {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => &protected.protections,
            Self::Unprotected => &[],
        }
    }

    /// Why some protections are missing, as reported by the system.
    pub fn refused(&self) -> Option<&str> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => protected.refused.as_deref(),
            Self::Unprotected => None,
        }
    }

    /// Whether programs run as their own user, who can read only world-readable files.
    pub fn has_own_user(&self) -> bool {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => protected.walls.own_user,
            Self::Unprotected => false,
        }
    }

    /// The part of a canonical path that programs cannot open, because they run as their own user and others may not read it.
    #[cfg_attr(not(target_os = "linux"), expect(unused_variables))]
    pub fn closed_part<'a>(&self, path: &'a Path) -> Option<&'a Path> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Protected(protected) => protected.walls.closed_part(path),
            Self::Unprotected => None,
        }
    }
}

/// The folder, among the system's and these, through which a protected program could read this path.
pub fn revealed_by<'a>(path: &Path, readable: &'a [PathBuf]) -> Option<&'a Path> {
    #[cfg(target_os = "linux")]
    let system = walls::SYSTEM;
    #[cfg(not(target_os = "linux"))]
    let system: &[&str] = &[];
    let mut folders = system.iter().map(Path::new).chain(readable.iter().map(PathBuf::as_path));
    folders.find(|folder| path.starts_with(folder))
}

/// Starts the command, with retries while its program is open for writing, or while its user has too many processes: between
/// fork and exec, a child of another thread may still hold the file open, and killed processes of another run may still be
/// ending.
#[cfg(unix)]
fn spawn(command: &mut Command) -> io::Result<Child> {
    for _ in 0..BUSY {
        match command.spawn() {
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::ExecutableFileBusy | io::ErrorKind::WouldBlock
                ) =>
            {
                std::thread::sleep(BUSY_PAUSE);
            }
            started => return started,
        }
    }
    command.spawn()
}

/// Copies the files to keep out of the working directory.
fn keep(working: &tree::Opened, job: &Job) -> Result<(), NotKept> {
    match &job.keep {
        Keep::File(name, to) => tree::copy_file(working, name, to, job.limits.trace),
        Keep::Each(names, to) => {
            for name in names {
                // One that is missing, or no regular file, is not kept.
                let _ = tree::copy_file(working, name, &to.join(name), job.limits.trace);
            }
            Ok(())
        }
        Keep::Tree(to) => {
            let bounds = tree::Bounds { bytes: job.limits.trace, entries: job.limits.files };
            let create = || -> io::Result<_> {
                std::fs::create_dir(to)?;
                tree::open_folder(to)
            };
            let to = create().map_err(|error| NotKept::Other(error.to_string()))?;
            tree::copy(working, &to, bounds)
        }
    }
}

/// The name of a signal, such as `SIGSEGV`, or its number if it has none.
pub fn signal_name(number: i32) -> String {
    group::signal_name(number).unwrap_or_else(|| format!("signal {number}"))
}

/// Runs as a starter or a check if this process was started as one; otherwise returns `None`. Call it
/// first, before any thread starts or any file is opened.
#[cfg(target_os = "linux")]
pub fn serve() -> Option<std::process::ExitCode> {
    let role = std::env::args_os().nth(1)?;
    let answered = match role.to_str()? {
        STARTER => starter::serve(supervisor::serve),
        check::CHECK => check::serve(),
        cgroup::SCOPE => cgroup::serve_scope(),
        _ => return None,
    };
    Some(if answered.is_ok() {
        std::process::ExitCode::SUCCESS
    } else {
        std::process::ExitCode::from(3)
    })
}
