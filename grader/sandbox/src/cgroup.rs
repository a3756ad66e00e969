//! Control group of a run, below a group delegated to the grader (`cgroups(7)`, version 2).
//!
//! A group counts the memory and processor time of all its processes, including ended ones, and the memory of their
//! tmpfs. Without a group, the supervisor sums the usage of the processes.
//!
//! A group is delegated if an ordinary user owns it, or if the service manager has marked it. `grade` moves itself into
//! a child group, because the kernel enables controllers in a group only if its parent contains no process.
//! `systemd-run --user --scope -p Delegate=yes grade …` creates a delegated group.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::limits::KEEPER_THREADS;
use super::{Exceeded, Limits};

/// The controllers used. A group without the memory controller is not used.
const CONTROLLERS: [&str; 3] = ["memory", "pids", "cpu"];

/// Name of the group for `grade` itself.
const GRADER_GROUP: &str = "spring-oracle";

/// Prefix of the names of runs' groups.
const RUN_PREFIX: &str = "spring-oracle-run-";

/// Attributes by which service managers mark a group as delegated.
const MARKS: [&str; 2] = ["user.delegate", "trusted.delegate"];

/// Time limit for the kernel to kill a group's processes.
const KILL_TIMEOUT: Duration = Duration::from_secs(5);

/// The group delegated to this process, if any, with its controllers enabled for its children.
pub(super) fn delegated() -> Option<PathBuf> {
    let group = current()?;
    // Left by an earlier `grade` that was killed.
    let group = match group.file_name() {
        Some(name) if name == GRADER_GROUP => group.parent()?.to_path_buf(),
        _ => group,
    };
    if !is_delegated(&group) || !offers_memory(&group) {
        return None;
    }
    let own = group.join(GRADER_GROUP);
    let moved = || -> io::Result<()> {
        if !own.is_dir() {
            fs::create_dir(&own)?;
        }
        enter(&own)?;
        let offered = fs::read_to_string(group.join("cgroup.controllers"))?;
        for controller in offered.split_ascii_whitespace() {
            if CONTROLLERS.contains(&controller) {
                write(&group.join("cgroup.subtree_control"), &format!("+{controller}"))?;
            }
        }
        Ok(())
    };
    if moved().is_err() {
        // Other processes in the group prevent its children from having controllers.
        leave();
        return None;
    }
    sweep(&group);
    Some(group)
}

/// Restores the group that [`delegated`] returned, if this process is its last user.
pub(super) fn leave() {
    let Some(own) =
        current().filter(|group| group.file_name().is_some_and(|name| name == GRADER_GROUP))
    else {
        return;
    };
    let Some(group) = own.parent() else { return };
    for controller in CONTROLLERS {
        // Fails for a controller that was not enabled, and for one that another grader uses.
        let _ = write(&group.join("cgroup.subtree_control"), &format!("-{controller}"));
    }
    let _ = enter(group);
    let _ = fs::remove_dir(&own);
}

/// Moves this process to a group.
fn enter(group: &Path) -> io::Result<()> {
    write(&group.join("cgroup.procs"), &std::process::id().to_string())
}

/// Writes to an existing file: the kernel's files cannot be created.
fn write(file: &Path, text: &str) -> io::Result<()> {
    io::Write::write_all(&mut fs::OpenOptions::new().write(true).open(file)?, text.as_bytes())
}

/// The folder of this process's group.
fn current() -> Option<PathBuf> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let mounts = fs::read_to_string("/proc/self/mountinfo").ok()?;
    // proc_pid_mountinfo(5): the mount point is field 5, and the type follows the lone hyphen.
    let mount = mounts.lines().find_map(|line| {
        let (before, after) = line.split_once(" - ")?;
        after.starts_with("cgroup2 ").then(|| before.split(' ').nth(4))?
    })?;
    Some(Path::new(mount).join(path.trim_start_matches('/')))
}

fn is_delegated(group: &Path) -> bool {
    let user = rustix::process::geteuid().as_raw();
    let is_marked = |mark: &str| {
        let mut value = [0; 1];
        rustix::fs::getxattr(group, mark, &mut value).is_ok() && value == *b"1"
    };
    match user {
        0 => MARKS.iter().any(|mark| is_marked(mark)),
        _ => fs::metadata(group).is_ok_and(|metadata| metadata.uid() == user),
    }
}

fn offers_memory(group: &Path) -> bool {
    let offered = fs::read_to_string(group.join("cgroup.controllers")).unwrap_or_default();
    offered.split_ascii_whitespace().any(|controller| controller == CONTROLLERS[0])
}

/// Removes the groups of runs whose supervisors were killed: those that are empty.
fn sweep(group: &Path) {
    for entry in group.read_dir().into_iter().flatten().flatten() {
        if entry.file_name().as_encoded_bytes().starts_with(RUN_PREFIX.as_bytes()) {
            // A group in use is not empty, and stays.
            let _ = fs::remove_dir(entry.path());
        }
    }
}

/// The group of one run.
#[derive(Debug)]
pub(super) struct ControlGroup(PathBuf);

impl ControlGroup {
    /// Creates a group below `parent`, with the limits of a run.
    ///
    /// # Errors
    /// A message, if it cannot be created.
    pub(super) fn create(parent: &Path, limits: &Limits) -> Result<Self, String> {
        let path = parent.join(format!("{RUN_PREFIX}{}", std::process::id()));
        let fail = |error: io::Error| format!("control group {}: {error}", path.display());
        fs::create_dir(&path).map_err(fail)?;
        let group = Self(path.clone());
        // Memory includes the files in its tmpfs; processes include the keeper and its threads.
        let memory = limits.memory + limits.trace;
        let limit = |file: &str, value: u64| match write(&path.join(file), &value.to_string()) {
            // This system lacks the controller, or the accounting of swap.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            written => written.map_err(fail),
        };
        limit("memory.max", memory)?;
        limit("memory.swap.max", 0)?;
        limit("pids.max", limits.processes + KEEPER_THREADS)?;
        Ok(group)
    }

    /// Moves a process into the group.
    ///
    /// # Errors
    /// A message, if the kernel refuses.
    pub(super) fn add(&self, process: u32) -> Result<(), String> {
        write(&self.0.join("cgroup.procs"), &process.to_string())
            .map_err(|error| format!("control group {}: {error}", self.0.display()))
    }

    /// The limit that its processes exceeded, if any.
    pub(super) fn exceeded(&self, limits: &Limits) -> Option<Exceeded> {
        let killed = self.number("memory.events", "oom_kill ");
        let microseconds = self.number("cpu.stat", "usage_usec ");
        match () {
            () if killed > 0 => Some(Exceeded::Memory),
            () if microseconds as f64 * 1e-6 > limits.cpu => Some(Exceeded::Cpu),
            () => None,
        }
    }

    fn number(&self, file: &str, name: &str) -> u64 {
        let text = fs::read_to_string(self.0.join(file)).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        line.and_then(|number| number.parse().ok()).unwrap_or(0)
    }
}

/// Kills all its processes and removes it.
impl Drop for ControlGroup {
    fn drop(&mut self) {
        let _ = write(&self.0.join("cgroup.kill"), "1");
        let started = Instant::now();
        while fs::remove_dir(&self.0).is_err() && started.elapsed() < KILL_TIMEOUT {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_exceeded_is_read_from_the_group() {
        let folder = tempfile::tempdir().unwrap();
        let group = std::mem::ManuallyDrop::new(ControlGroup(folder.path().to_path_buf()));
        let limits = Limits { cpu: 2.0, ..Limits::default() };
        let exceeded = |events: &str, stat: &str| {
            fs::write(folder.path().join("memory.events"), events).unwrap();
            fs::write(folder.path().join("cpu.stat"), stat).unwrap();
            group.exceeded(&limits)
        };
        assert_eq!(group.exceeded(&limits), None);
        let within = "usage_usec 2000000\nuser_usec 9000000\n";
        assert_eq!(exceeded("low 0\nmax 8\noom 1\noom_kill 0\n", within), None);
        assert_eq!(exceeded("oom 1\noom_kill 1\n", within), Some(Exceeded::Memory));
        assert_eq!(exceeded("oom_kill 0\n", "usage_usec 2000001\n"), Some(Exceeded::Cpu));
    }
}
