//! Control groups of runs (`cgroups(7)`).
//!
//! A group counts all memory of its processes, ended ones included: also what no process shows as its own, such as pages of
//! shared objects that nobody maps any more, tables of the kernel, and files of a tmpfs. Without a group, the supervisor
//! adds up what processes show.
//!
//! - **Version 2, delegated**: an ordinary user owns the group, or the service manager has marked it. `grade` moves itself
//!   into a child group, because the kernel enables controllers in a group only if its parent contains no process.
//!   `systemd-run --user --scope -p Delegate=yes grade …` creates a delegated group.
//! - **Version 2, superuser**: below the nearest group above that gives memory controllers to its children.
//! - **Version 1**: below the groups of `grade`, for the superuser. Each controller has a separate hierarchy.
//! - **Scopes**: for an ordinary user without a delegated group, the service manager starts each starter in a delegated one.
//!
//! Each starter has one group, because the runs of a starter follow one another.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};
use serde::{Deserialize, Serialize};

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

/// Time limit for the test of a scope.
const SCOPE_TIMEOUT: Duration = Duration::from_secs(10);

/// Pause between two checks whether processes have ended.
const PAUSE: Duration = Duration::from_millis(1);

/// First argument of a process that tests whether its scope is delegated.
pub(super) const SCOPE: &str = "--sandbox-scope";

/// Environment variables by which the service manager of a user is found.
const MANAGER: [&str; 3] = ["PATH", "XDG_RUNTIME_DIR", "DBUS_SESSION_BUS_ADDRESS"];

/// Where the groups of runs are made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Groups {
    /// Below this group.
    Below(Parent),
    /// Below a scope of the service manager, one for each starter.
    Scopes,
}

/// A group with the memory controller, below which groups are made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Parent {
    folder: PathBuf,
    version: Version,
}

/// The version of the memory controller's hierarchy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
enum Version {
    /// Version 1, where another group counts processor time, if one can be had.
    One { time: Option<PathBuf> },
    /// Version 2, where one group counts all.
    Two,
}

impl Version {
    /// The folder of the group that counts processor time only.
    fn time(&self) -> Option<&Path> {
        match self {
            Self::One { time } => time.as_deref(),
            Self::Two => None,
        }
    }
}

impl Groups {
    /// Where this system allows groups.
    ///
    /// # Errors
    /// A message that says why it allows none.
    pub(super) fn find(launcher: &Path) -> Result<Self, String> {
        let is_root = rustix::process::geteuid().is_root();
        let above = || if is_root { above_with_memory() } else { None };
        let found =
            delegated().or_else(above).map(|folder| Parent { folder, version: Version::Two });
        let found = found.or_else(|| {
            let usable = |controller| {
                let (folder, _) = current("cgroup", controller)?;
                is_usable(&folder).then_some(folder)
            };
            let version = Version::One { time: usable("cpuacct") };
            Some(Parent { folder: usable("memory")?, version })
        });
        if let Some(parent) = found {
            parent.folders().for_each(sweep);
            return Ok(Self::Below(parent));
        }
        let tested = || {
            let mut command = Self::Scopes.command(launcher);
            command.arg(SCOPE).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
            succeeds_within(SCOPE_TIMEOUT, &mut command)
        };
        // Without this variable, there is no service manager of a user.
        if !is_root && std::env::var_os(MANAGER[1]).is_some() && tested() {
            Ok(Self::Scopes)
        } else {
            Err("no control group with the memory controller is delegated".to_owned())
        }
    }

    /// The command that starts the launcher where it can make groups.
    pub(super) fn command(&self, launcher: &Path) -> Command {
        match self {
            Self::Below(_) => without_group(launcher),
            Self::Scopes => {
                let mut command = Command::new("systemd-run");
                command.args(["--user", "--scope", "--quiet", "--collect", "-pDelegate=yes", "--"]);
                command.arg(launcher).env_clear();
                command
                    .envs(MANAGER.iter().filter_map(|name| Some((name, std::env::var_os(name)?))));
                command
            }
        }
    }

    /// The group below which this starter makes its own.
    ///
    /// # Errors
    /// A message, if its scope is not delegated.
    pub(super) fn enter(self) -> Result<Parent, String> {
        match self {
            Self::Below(parent) => Ok(parent),
            Self::Scopes => {
                let folder = delegated().ok_or("control group: the scope is not delegated")?;
                Ok(Parent { folder, version: Version::Two })
            }
        }
    }
}

impl Parent {
    /// The folders below which groups are made.
    fn folders(&self) -> impl Iterator<Item = &Path> {
        [&*self.folder].into_iter().chain(self.version.time())
    }

    /// Removes the group of a starter that has ended.
    pub(super) fn remove(&self, starter: u32) {
        for folder in self.folders() {
            // A starter that ran no program has no group.
            let _ = fs::remove_dir(group_of(folder, starter));
        }
    }
}

/// Whether groups can be made below this one.
fn is_usable(folder: &Path) -> bool {
    let tried = group_of(folder, std::process::id());
    fs::create_dir(&tried).and_then(|()| fs::remove_dir(&tried)).is_ok()
}

/// The folder of the group of a starter below another group.
fn group_of(folder: &Path, starter: u32) -> PathBuf {
    folder.join(format!("{RUN_PREFIX}{starter}"))
}

/// Whether a command succeeds in this time; it is killed otherwise.
fn succeeds_within(time: Duration, command: &mut Command) -> bool {
    let Ok(mut child) = command.spawn() else { return false };
    let started = Instant::now();
    while started.elapsed() < time {
        match child.try_wait() {
            Ok(Some(status)) => return status.success(),
            Ok(None) => std::thread::sleep(PAUSE),
            Err(_) => break,
        }
    }
    // It may have ended by itself.
    let _ = child.kill();
    let _ = child.wait();
    false
}

/// The command that starts the launcher in the group of `grade`. It does not name the launcher's folder, which programs
/// could read among the arguments of their keeper.
pub(super) fn without_group(launcher: &Path) -> Command {
    let mut command = Command::new(launcher);
    command.arg0(env!("CARGO_PKG_NAME")).env_clear();
    command
}

/// The group delegated to this process, if any, with its controllers enabled for its children.
fn delegated() -> Option<PathBuf> {
    let (group, _) = current("cgroup2", "")?;
    // Left by an earlier `grade` that was killed.
    let group = match group.file_name() {
        Some(name) if name == GRADER_GROUP => group.parent()?.to_path_buf(),
        _ => group,
    };
    if !is_delegated(&group) || !lists_memory(&group, "cgroup.controllers") {
        return None;
    }
    let own = group.join(GRADER_GROUP);
    let moved = || -> io::Result<()> {
        // Another grader may make it at the same time.
        fs::create_dir_all(&own)?;
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
    Some(group)
}

/// The nearest group, this process's or one above it, that gives its children memory controllers. None if the superuser would
/// thereby leave a limit of memory.
fn above_with_memory() -> Option<PathBuf> {
    let (group, mount) = current("cgroup2", "")?;
    for group in group.ancestors().take_while(|group| group.starts_with(&mount)) {
        if lists_memory(group, "cgroup.subtree_control") {
            return is_usable(group).then(|| group.to_path_buf());
        }
        let limit = fs::read_to_string(group.join("memory.max"));
        if limit.is_ok_and(|limit| limit.trim() != "max") {
            return None;
        }
    }
    None
}

/// Tests whether the scope of this process is delegated.
pub(super) fn serve_scope() -> io::Result<()> {
    delegated().ok_or(io::ErrorKind::Unsupported)?;
    leave();
    Ok(())
}

/// Restores the group that [`delegated`] returned, if this process is its last user.
pub(super) fn leave() {
    let Some((own, _)) = current("cgroup2", "")
        .filter(|(group, _)| group.file_name().is_some_and(|name| name == GRADER_GROUP))
    else {
        return;
    };
    let Some(group) = own.parent() else { return };
    let processes = fs::read_to_string(own.join("cgroup.procs")).unwrap_or_default();
    if processes.lines().count() > 1 {
        // The limits of another grader's runs would go with the controllers.
        let _ = enter(group);
        return;
    }
    for controller in CONTROLLERS {
        // Fails for a controller that was not enabled.
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

/// The folder of this process's group, and the mount point of its hierarchy: one of this type and, for version 1, with this
/// controller.
fn current(kind: &str, controller: &str) -> Option<(PathBuf, PathBuf)> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let mounts = fs::read_to_string("/proc/self/mountinfo").ok()?;
    group_folder(&groups, &mounts, kind, controller)
}

fn group_folder(
    groups: &str,
    mounts: &str,
    kind: &str,
    controller: &str,
) -> Option<(PathBuf, PathBuf)> {
    let path = groups.lines().find_map(|line| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        controllers.split(',').any(|each| each == controller).then_some(path)
    })?;
    // proc_pid_mountinfo(5): the root is field 4, the mount point field 5; type, source and options follow the lone hyphen.
    mounts.lines().find_map(|line| {
        let (before, after) = line.split_once(" - ")?;
        let (of, options) = after.split_once(' ')?;
        let mut fields = before.split(' ').skip(3);
        let (root, mount) = (fields.next()?, PathBuf::from(fields.next()?));
        let options = options.rsplit(' ').next()?;
        let is_it = of == kind
            && (controller.is_empty() || options.split(',').any(|each| each == controller));
        let below = Path::new(path).strip_prefix(root).ok()?;
        is_it.then(|| (mount.join(below), mount))
    })
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

fn lists_memory(group: &Path, file: &str) -> bool {
    let listed = fs::read_to_string(group.join(file)).unwrap_or_default();
    listed.split_ascii_whitespace().any(|controller| controller == CONTROLLERS[0])
}

/// Removes the groups of starters that were killed.
fn sweep(group: &Path) {
    for entry in group.read_dir().into_iter().flatten().flatten() {
        let name = entry.file_name();
        let starter = name.to_str().and_then(|name| name.strip_prefix(RUN_PREFIX));
        if starter.is_some_and(|starter| !Path::new("/proc").join(starter).exists()) {
            // The group of a starter in another PID namespace stays if it is in use, and is made again if not.
            let _ = fs::remove_dir(entry.path());
        }
    }
}

/// The group of one run.
#[derive(Debug)]
pub(super) struct ControlGroup {
    folder: PathBuf,
    version: Version,
    /// The counters before the run.
    before: Counters,
}

/// Counters of a group since it was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Counters {
    /// Processes killed for want of memory.
    killed: u64,
    /// Microseconds of processor time, if they are counted.
    microseconds: u64,
}

impl ControlGroup {
    /// Makes the group of a starter, with the limits of a run, and moves the run's first process into it.
    ///
    /// # Errors
    /// A message, if the kernel refuses.
    pub(super) fn begin(
        parent: &Parent,
        starter: Pid,
        limits: &Limits,
        first: Pid,
    ) -> Result<Self, String> {
        let of = |folder: &Path| group_of(folder, starter.as_raw_nonzero().get().cast_unsigned());
        let folder = of(&parent.folder);
        let fail = |error: io::Error| format!("control group {}: {error}", folder.display());
        let version = match &parent.version {
            Version::One { time } => Version::One { time: time.as_deref().map(of) },
            Version::Two => Version::Two,
        };
        let mut group = Self { folder: folder.clone(), version, before: Counters::default() };
        let began =
            group.prepare(limits, first).or_else(|error| match Errno::from_io_error(&error) {
                // Another grader swept it.
                Some(Errno::NOENT | Errno::NODEV) => group.prepare(limits, first),
                _ => Err(error),
            });
        group.before = began.map_err(fail)?;
        Ok(group)
    }

    fn prepare(&self, limits: &Limits, first: Pid) -> io::Result<Counters> {
        for folder in [&*self.folder].into_iter().chain(self.version.time()) {
            match fs::create_dir(folder) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                _ => {}
            }
        }
        // Memory includes the files in its tmpfs; processes include the keeper and its threads.
        let memory = limits.memory + limits.trace;
        match self.version {
            Version::One { .. } => {
                let swap = self.folder.join("memory.memsw.limit_in_bytes");
                if !self.is_limited("memory.limit_in_bytes", memory) {
                    // The limit with swap must not be the lower one. It is missing where swap is not counted.
                    let _ = write(&swap, "-1");
                    write(&self.folder.join("memory.limit_in_bytes"), &memory.to_string())?;
                    let _ = write(&swap, &memory.to_string());
                }
            }
            Version::Two => {
                // Without it, nothing limits the run.
                if !self.is_limited("memory.max", memory) {
                    write(&self.folder.join("memory.max"), &memory.to_string())?;
                }
                self.limit("memory.swap.max", 0)?;
                self.limit("pids.max", limits.processes + KEEPER_THREADS)?;
            }
        }
        let before = self.counters();
        for folder in [&*self.folder].into_iter().chain(self.version.time()) {
            write(&folder.join("cgroup.procs"), &first.as_raw_nonzero().to_string())?;
        }
        Ok(before)
    }

    fn limit(&self, file: &str, value: u64) -> io::Result<()> {
        if self.is_limited(file, value) {
            return Ok(());
        }
        match write(&self.folder.join(file), &value.to_string()) {
            // This system lacks the controller, or the accounting of swap.
            Err(error) if error.kind() == io::ErrorKind::NotFound && self.folder.exists() => Ok(()),
            written => written,
        }
    }

    /// Whether a limit has this value. The kernel rounds bytes down to pages.
    fn is_limited(&self, file: &str, value: u64) -> bool {
        let page = rustix::param::page_size() as u64;
        let known = fs::read_to_string(self.folder.join(file)).unwrap_or_default();
        known.trim().parse().is_ok_and(|known: u64| known == value || known == value / page * page)
    }

    /// The limit that its processes exceeded, if any.
    pub(super) fn exceeded(&self, limits: &Limits) -> Option<Exceeded> {
        let now = self.counters();
        let microseconds = now.microseconds.saturating_sub(self.before.microseconds);
        match () {
            () if now.killed > self.before.killed => Some(Exceeded::Memory),
            () if microseconds as f64 * 1e-6 > limits.cpu => Some(Exceeded::Cpu),
            () => None,
        }
    }

    fn counters(&self) -> Counters {
        let number = |folder: &Path, file: &str, name: &str| {
            let text = fs::read_to_string(folder.join(file)).unwrap_or_default();
            let line = text.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|number| number.parse::<u64>().ok()).unwrap_or(0)
        };
        let nanoseconds = |folder| number(folder, "cpuacct.usage", "");
        match &self.version {
            Version::One { time } => Counters {
                killed: number(&self.folder, "memory.oom_control", "oom_kill "),
                microseconds: time.as_deref().map_or(0, nanoseconds) / 1000,
            },
            Version::Two => Counters {
                killed: number(&self.folder, "memory.events", "oom_kill "),
                microseconds: number(&self.folder, "cpu.stat", "usage_usec "),
            },
        }
    }
}

/// Kills its processes, and waits until none is left.
impl Drop for ControlGroup {
    fn drop(&mut self) {
        let started = Instant::now();
        while started.elapsed() < KILL_TIMEOUT {
            let left = fs::read_to_string(self.folder.join("cgroup.procs")).unwrap_or_default();
            if left.is_empty() {
                return;
            }
            // Version 1, and kernels before 5.14, have no such file.
            if write(&self.folder.join("cgroup.kill"), "1").is_err() {
                for process in left.lines().filter_map(|line| Pid::from_raw(line.parse().ok()?)) {
                    // It may have ended by itself.
                    let _ = kill_process(process, Signal::KILL);
                }
            }
            std::thread::sleep(PAUSE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exceeded_limits_are_read_from_the_control_group() {
        let folder = tempfile::tempdir().unwrap();
        let limits = Limits { cpu: 2.0, ..Limits::default() };
        let write = |file: &str, text: &str| fs::write(folder.path().join(file), text).unwrap();
        let group = |version| {
            let folder = folder.path().to_path_buf();
            let mut group = ControlGroup { folder, version, before: Counters::default() };
            group.before = group.counters();
            group
        };
        let exceeded = |group: &ControlGroup, events: &str, stat: &str| {
            write("memory.events", events);
            write("cpu.stat", stat);
            group.exceeded(&limits)
        };
        let first = group(Version::Two);
        assert_eq!(first.exceeded(&limits), None);
        let within = "usage_usec 2000000\nuser_usec 9000000\n";
        assert_eq!(exceeded(&first, "low 0\nmax 8\noom 1\noom_kill 0\n", within), None);
        assert_eq!(exceeded(&first, "oom 1\noom_kill 1\n", within), Some(Exceeded::Memory));
        let second = group(Version::Two);
        assert_eq!(exceeded(&second, "oom_kill 1\n", "usage_usec 4000000\n"), None);
        assert_eq!(exceeded(&second, "oom_kill 1\n", "usage_usec 4000001\n"), Some(Exceeded::Cpu));
        let time = Some(folder.path().to_path_buf());
        let third = group(Version::One { time: time.clone() });
        write("memory.oom_control", "oom_kill_disable 0\nunder_oom 0\noom_kill 1\n");
        assert_eq!(third.exceeded(&limits), Some(Exceeded::Memory));
        write("cpuacct.usage", "7000000000\n");
        let fourth = group(Version::One { time });
        write("cpuacct.usage", "9000000999\n");
        assert_eq!(fourth.exceeded(&limits), None);
        write("cpuacct.usage", "9000001000\n");
        assert_eq!(fourth.exceeded(&limits), Some(Exceeded::Cpu));
    }

    #[test]
    fn a_command_that_hangs_has_failed() {
        let is_done = |program: &str, time| {
            let mut command = Command::new("sh");
            succeeds_within(time, command.args(["-c", program]))
        };
        assert!(is_done("exit 0", SCOPE_TIMEOUT) && !is_done("exit 1", SCOPE_TIMEOUT));
        assert!(!is_done("exec sleep 600", 20 * PAUSE));
    }

    #[test]
    fn a_group_is_found_in_either_version() {
        let groups = "5:cpu,cpuacct:/a\n4:memory:/docker/1/own\n0::/user.slice/session\n";
        let mounts = "30 23 0:26 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw,nsdelegate\n\
                      31 23 0:27 /docker/1 /sys/fs/cgroup/memory ro - cgroup cgroup rw,memory\n";
        let found = |kind, controller| group_folder(groups, mounts, kind, controller);
        let of = |folder: &str, mount: &str| Some((PathBuf::from(folder), PathBuf::from(mount)));
        let first = of("/sys/fs/cgroup/memory/own", "/sys/fs/cgroup/memory");
        assert_eq!(found("cgroup", "memory"), first);
        let unified = "/sys/fs/cgroup/unified";
        assert_eq!(found("cgroup2", ""), of(&format!("{unified}/user.slice/session"), unified));
        assert_eq!(found("cgroup", "cpu"), None);
    }
}
