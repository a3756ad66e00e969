//! The starters: processes that `grade` starts once, each of which runs one job at a time. A starter forks the supervisor
//! of each run, in less time than another start of `grade` takes. It has one thread, and knows nothing of a run but its
//! job. Once `grade` has ended, and with it the run, it removes the scratch folders.
//!
//! A starter enters an empty network namespace, and for an ordinary user the user namespace that this needs. To make one
//! for each run took a tenth of the time of a grading. The runs of a starter share it, one after the other: no program can
//! make a socket that would leave a trace there (`calls.rs`).
//!
//! A job is a line on the starter's standard input, a socket. The supervisor writes its answer there, and the starter the
//! end of that line, after the supervisor has ended. No descriptor is passed through a socket: a program of the same user
//! could use up the number that the kernel allows. If the supervisor was killed, its processes become the starter's, which
//! ends them.

use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Mutex, PoisonError};

use fork::Fork;
use nix::sched::{CloneFlags, unshare};
use rustix::process::{Pid, getegid, geteuid, getpid, set_child_subreaper};
use serde::{Deserialize, Serialize};

use super::cgroup::{Groups, Parent};
use super::process::{end_with, kill_descendants, wait_for};
use super::walls::{Namespaces, Walls};
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
    pub(super) fn ask(&self, walls: &Walls, request: &str) -> io::Result<String> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let place = Place { namespaces: walls.namespaces, groups: walls.groups.clone() };
        // One in another place is from the test of stronger protections, and ends.
        let taken = idle().pop().filter(|starter| starter.place == place);
        let start = || Starter::start(&self.launcher, place);
        let mut starter = taken.map_or_else(start, Ok)?;
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

/// State shared by the runs of a starter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Place {
    namespaces: Namespaces,
    groups: Option<Groups>,
}

/// A starter, as `grade` sees it.
#[derive(Debug)]
struct Starter {
    place: Place,
    process: Child,
    socket: BufReader<UnixStream>,
}

impl Starter {
    fn start(launcher: &Path, place: Place) -> io::Result<Self> {
        let (socket, theirs) = UnixStream::pair()?;
        let mut command = match &place.groups {
            Some(groups) => groups.command(launcher),
            None => cgroup::without_group(launcher),
        };
        let temporary = std::env::var_os("TMPDIR").map(|folder| ("TMPDIR", folder));
        command.arg(STARTER).envs(temporary).stdin(OwnedFd::from(theirs));
        // Signals of the terminal do not reach it.
        command.stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let mut socket = BufReader::new(socket);
        let process = command.spawn()?;
        // Programs can read the arguments of their keeper, a copy of this process; the place names folders.
        socket.get_mut().write_all(format!("{}\n", serde_json::to_string(&place)?).as_bytes())?;
        Ok(Self { place, process, socket })
    }

    fn ask(&mut self, request: &str) -> io::Result<String> {
        self.socket.get_mut().write_all(format!("{request}\n").as_bytes())?;
        let mut answer = String::new();
        self.socket.read_line(&mut answer)?;
        if answer.ends_with('\n') {
            Ok(answer)
        } else {
            Err(io::Error::other("the starter of its supervisor ended"))
        }
    }
}

impl Drop for Starter {
    fn drop(&mut self) {
        // This process removes its own folders.
        let _ = self.process.kill();
        let _ = self.process.wait();
        if let Some(Groups::Below(parent)) = &self.place.groups {
            parent.remove(self.process.id());
        }
    }
}

/// The parent of a starter's control group, if it uses one; or why the starter did not enter its place.
pub(super) type Entered = Result<Option<Parent>, String>;

/// Runs as a starter, whose place is the first line. `supervisor` is given the starter, whether it entered its place, and
/// a request, in a separate process.
pub(super) fn serve(supervisor: impl Fn(Pid, &Entered, &str) -> io::Result<()>) -> io::Result<()> {
    // Processes of a supervisor that was killed are re-parented to this process.
    set_child_subreaper(Pid::from_raw(1))?;
    let mut request = String::new();
    io::stdin().read_line(&mut request)?;
    let Place { namespaces, groups } = serde_json::from_str(&request)?;
    let parent = groups.map(Groups::enter).transpose();
    let entered = parent.and_then(|parent| enter(namespaces).map(|()| parent));
    let starter = getpid();
    request.clear();
    while io::stdin().read_line(&mut request)? > 0 {
        match fork::fork()? {
            Fork::Child => end_with(|| supervisor(starter, &entered, &request)),
            Fork::Parent(forked) => {
                Pid::from_raw(forked).map(wait_for).transpose()?;
                kill_descendants(None);
            }
        }
        request.clear();
        // Fails if `grade` has ended: then there are no more requests either.
        let _ = rustix::io::write(rustix::stdio::stdin(), b"\n");
    }
    scratch::sweep();
    if let Ok(Some(parent)) = &entered {
        parent.remove(std::process::id());
    }
    cgroup::leave();
    Ok(())
}

/// Enters the namespaces that the runs of this starter share.
fn enter(namespaces: Namespaces) -> Result<(), String> {
    let enter = || match namespaces {
        Namespaces::None => Ok(()),
        Namespaces::Privileged => Ok(unshare(CloneFlags::CLONE_NEWNET)?),
        Namespaces::User => {
            let (user, group) = (geteuid().as_raw(), getegid().as_raw());
            unshare(CloneFlags::CLONE_NEWUSER | CloneFlags::CLONE_NEWNET)?;
            fs::write("/proc/self/setgroups", "deny")?;
            fs::write("/proc/self/uid_map", format!("{user} {user} 1"))?;
            fs::write("/proc/self/gid_map", format!("{group} {group} 1"))
        }
    };
    enter().map_err(|error: io::Error| format!("namespaces: {error}"))
}
