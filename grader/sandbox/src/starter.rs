//! The starters: processes that `grade` starts once, each of which runs one job at a time. A starter forks the supervisor
//! of each run, in less time than another start of `grade` takes. It has one thread, and knows nothing of a run but its
//! job. Once `grade` has ended, and with it the run, it removes the scratch folders.
//!
//! A job is a line on the starter's standard input, a socket. The supervisor writes its answer there, and the starter the
//! end of that line, after the supervisor has ended. No descriptor is passed through a socket: a program of the same user
//! could use up the number that the kernel allows.

use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

use fork::Fork;
use rustix::process::{Pid, getpid};

use super::process::{end_with, wait_for};
use super::{STARTER, cgroup, scratch};

/// As many starters as there were jobs at a time.
#[derive(Debug)]
pub(super) struct Starters {
    launcher: PathBuf,
    idle: Mutex<Vec<Starter>>,
}

impl Starters {
    /// Removes the scratch folders of killed graders. Call it after control groups are set up, because starters inherit
    /// the grader's group.
    pub(super) fn new(launcher: PathBuf) -> Self {
        scratch::sweep();
        Self { launcher, idle: Mutex::default() }
    }

    /// The answer of a new supervisor to a request, both of one line.
    pub(super) fn ask(&self, request: &str) -> io::Result<String> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = idle().pop();
        let mut starter = taken.map_or_else(|| Starter::start(&self.launcher), Ok)?;
        let answer = starter.ask(request)?;
        idle().push(starter);
        Ok(answer)
    }
}

impl Drop for Starters {
    fn drop(&mut self) {
        self.idle.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
        cgroup::leave();
    }
}

/// A starter, as `grade` sees it.
#[derive(Debug)]
struct Starter {
    process: Child,
    socket: BufReader<UnixStream>,
}

impl Starter {
    fn start(launcher: &PathBuf) -> io::Result<Self> {
        let (socket, theirs) = UnixStream::pair()?;
        let mut command = Command::new(launcher);
        let temporary = std::env::var_os("TMPDIR").map(|folder| ("TMPDIR", folder));
        command.arg(STARTER).env_clear().envs(temporary).stdin(OwnedFd::from(theirs));
        // Signals of the terminal do not reach it.
        command.stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        Ok(Self { process: command.spawn()?, socket: BufReader::new(socket) })
    }

    fn ask(&mut self, request: &str) -> io::Result<String> {
        self.socket.get_mut().write_all(format!("{request}\n").as_bytes())?;
        let mut answer = String::new();
        self.socket.read_line(&mut answer)?;
        match answer.ends_with('\n') {
            true => Ok(answer),
            false => Err(io::Error::other("the starter of its supervisor ended")),
        }
    }
}

impl Drop for Starter {
    fn drop(&mut self) {
        // This process removes its own folders.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Runs as a starter. `supervisor` is given the starter and a request, in a process of its own.
pub(super) fn serve(supervisor: impl Fn(Pid, &str) -> io::Result<()>) -> io::Result<()> {
    let starter = getpid();
    let mut request = String::new();
    while io::stdin().read_line(&mut request)? > 0 {
        match fork::fork()? {
            Fork::Child => end_with(|| supervisor(starter, &request)),
            Fork::Parent(forked) => {
                Pid::from_raw(forked).map(wait_for).transpose()?;
            }
        }
        request.clear();
        // Fails if `grade` has ended: then there are no more requests either.
        let _ = rustix::io::write(rustix::stdio::stdin(), b"\n");
    }
    scratch::sweep();
    cgroup::leave();
    Ok(())
}
