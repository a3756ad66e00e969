//! The keeper: starts the program, waits for it, and is the first process of its world, with which all that
//! the program has started ends.

use std::env;
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use nix::sys::resource::{UsageWho, getrusage};
use rustix::process::{Pid, Resource, Rlimit, WaitOptions, setrlimit};
use serde::{Deserialize, Serialize};

use super::{End, Exceeded, Job, Protection, restrict, spawn};

/// Open files that a process may have.
const OPEN_FILES: u64 = 1024;

/// By how much strangers' programs stand back.
const NICENESS: i32 = 5;

/// The share of the memory limit from which on a failing program is taken to have run into it.
const NEARLY: f64 = 0.75;

/// What the keeper is asked to do.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Order {
    pub(super) job: Job,
    /// Whether it is in namespaces of its own.
    pub(super) isolated: bool,
}

/// What the keeper tells first: the protections in force, or why there is no run.
pub(super) type Started = Result<Vec<Protection>, String>;

/// What the keeper tells when the program has ended.
pub(super) type Ended = Result<End, String>;

/// Runs the program to its end.
pub(super) fn keep(
    Order { job, isolated }: &Order,
    started: impl FnOnce(&Started) -> io::Result<()>,
    ended: impl FnOnce(&Ended) -> io::Result<()>,
) -> io::Result<()> {
    let child = match std::thread::scope(|scope| {
        // The restrictions are the thread's and its children's, not the keeper's.
        scope.spawn(|| restrict_and_start(job, *isolated)).join()
    }) {
        Ok(Ok((protections, child))) => {
            started(&Ok(protections))?;
            child
        }
        Ok(Err(error)) => return started(&Err(error)),
        Err(_) => return started(&Err("the keeper broke off".to_owned())),
    };
    let end = match child {
        Err(error) => Ok(End::NotStarted(error.to_string())),
        Ok(child) => wait_for(&child, job).map_err(|error| error.to_string()),
    };
    ended(&end)
}

fn restrict_and_start(
    job: &Job,
    isolated: bool,
) -> Result<(Vec<Protection>, io::Result<Child>), String> {
    let create = |path| File::create(path).map_err(|error| format!("its output: {error}"));
    let (stdout, stderr) = (create(&job.stdout)?, create(&job.stderr)?);
    let protections = restrict::thread(job, isolated)?;
    limit_processes(job, isolated).map_err(|error| format!("limits: {error}"))?;
    // Whoever watches must not have to wait for whom it watches. It holds for this thread and its children.
    rustix::process::nice(NICENESS).map_err(|error| format!("priority: {error}"))?;
    Ok((protections, start(job, stdout, stderr)))
}

fn start(job: &Job, stdout: File, stderr: File) -> io::Result<Child> {
    let mut command = Command::new(&job.program);
    command
        .args(&job.arguments)
        .current_dir(&job.scratch)
        .env_clear()
        .env("PATH", search_path(job))
        .env("LANG", "C.UTF-8")
        .env("HOME", &job.scratch)
        .env("TMPDIR", &job.scratch)
        .stdin(Stdio::null())
        .stdout(stdout)
        .stderr(stderr)
        .process_group(0);
    spawn(&mut command)
}

/// The programs in `bin` of whatever may be read, then the system's.
fn search_path(job: &Job) -> OsString {
    let own = job.readable.iter().map(|folder| folder.join("bin")).filter(|bin| bin.is_dir());
    let system = ["/usr/local/bin", "/usr/bin", "/bin"].map(PathBuf::from);
    // Where one of the names holds a colon, the system's have to do.
    env::join_paths(own.chain(system.clone()))
        .or_else(|_| env::join_paths(system))
        .unwrap_or_default()
}

/// Limits of each process, this one included.
fn limit_processes(job: &Job, isolated: bool) -> rustix::io::Result<()> {
    let limits = &job.limits;
    let at_most = |most: u64| Rlimit { current: Some(most), maximum: Some(most) };
    let seconds = limits.cpu.ceil() as u64;
    let output = limits.trace.max(limits.stdout).max(limits.stderr);
    setrlimit(Resource::Cpu, Rlimit { current: Some(seconds), maximum: Some(seconds + 1) })?;
    setrlimit(Resource::Data, at_most(limits.memory))?;
    setrlimit(Resource::Fsize, at_most(output))?;
    setrlimit(Resource::Nofile, at_most(OPEN_FILES))?;
    setrlimit(Resource::Core, at_most(0))?;
    if isolated {
        // Elsewhere, all processes of the user would count. Here, the keeper and its thread do.
        setrlimit(Resource::Nproc, at_most(limits.processes + 2))?;
    }
    Ok(())
}

/// Waits for the program, and for whatever of its is handed to the keeper meanwhile.
fn wait_for(child: &Child, job: &Job) -> io::Result<End> {
    let program = Pid::from_child(child);
    let status = loop {
        match rustix::process::wait(WaitOptions::empty()) {
            Ok(Some((ended, status))) if ended == program => break status,
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    };
    let status = std::process::ExitStatus::from_raw(status.as_raw());
    let end = match (status.code(), status.signal()) {
        (Some(code), _) => End::Exited(code),
        (None, Some(libc::SIGXCPU)) => End::Exceeded(Exceeded::Cpu),
        (None, Some(libc::SIGXFSZ)) => End::Exceeded(Exceeded::Trace),
        (None, signal) => End::Signalled(signal.unwrap_or(0)),
    };
    // Who is refused memory seldom ends well.
    let failed = matches!(end, End::Exited(1..) | End::Signalled(_));
    let kibibytes = getrusage(UsageWho::RUSAGE_CHILDREN)?.max_rss();
    let full = kibibytes as f64 * 1024.0 >= NEARLY * job.limits.memory as f64;
    Ok(if failed && full { End::Exceeded(Exceeded::Memory) } else { end })
}
