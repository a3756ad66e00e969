//! Restrictions around a program ("walls"): those that a system grants, and their set-up in a thread.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::thread::disable_transparent_huge_pages;
use serde::{Deserialize, Serialize};

use super::calls::{self, Policy};
use super::cgroup::Groups;
use super::identity::User;
use super::{Job, Keep, identity, landlock};

/// Folders of a system's programs and libraries, and the files that these need to start.
pub(super) const SYSTEM: &[&str] = &[
    "/usr",
    "/bin",
    "/sbin",
    "/lib",
    "/lib32",
    "/lib64",
    "/libx32",
    "/nix/store",
    "/gnu/store",
    "/sys/devices/system/cpu",
];

/// Prefixes of the entries of `/etc` that run-time systems read. None contains accounts, hosts or keys.
const SETTINGS: &[&str] =
    &["R", "alternatives", "fonts", "java", "jvm", "ld.so.", "localtime", "octave"];

/// Folders to write; the first is the working directory of a run.
const WRITABLE: [&str; 3] = [WORK, "/tmp", "/dev/shm"];

/// The working directory.
pub(super) const WORK: &str = "/tmp/work";

/// Devices of programs, and whether they may write them. None keeps anything; but a shared mapping of `/dev/zero` that can be
/// written is memory that no process shows. Only Landlock refuses to write it.
const DEVICES: &[(&str, bool)] = &[
    ("/dev/null", true),
    ("/dev/zero", false),
    ("/dev/full", true),
    ("/dev/random", true),
    ("/dev/urandom", true),
];

/// The devices of programs under these restrictions.
pub(super) fn devices(walls: &Walls) -> impl Iterator<Item = &'static Path> {
    let is_there = |(_, is_writable): &&(_, bool)| *is_writable || walls.landlock;
    DEVICES.iter().filter(is_there).map(|(path, _)| Path::new(*path))
}

/// The namespaces of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Namespaces {
    /// With a user namespace, which an ordinary user needs.
    User,
    /// Created with root's privileges, without a user namespace.
    Privileged,
    /// None: the program sees the machine, and Landlock restricts access.
    None,
}

impl Namespaces {
    /// Whether the run has namespaces.
    pub(super) fn exist(self) -> bool {
        self != Self::None
    }
}

/// The restrictions that a system grants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Walls {
    pub(super) namespaces: Namespaces,
    /// Whether a run has its own user.
    pub(super) own_user: bool,
    /// Whether Landlock must be in force.
    pub(super) landlock: bool,
    /// Where the runs' control groups are made; `None` if the supervisor counts their memory.
    pub(super) groups: Option<Groups>,
    /// Readable paths of the system.
    pub(super) system: Vec<PathBuf>,
}

impl Walls {
    /// The part of a path that a run cannot open, because others may not read it. In a separate root, a run meets no folder
    /// above the path.
    pub(super) fn closed_part<'a>(&self, path: &'a Path) -> Option<&'a Path> {
        let is_closed = |part: &&Path| {
            let Ok(metadata) = part.metadata() else { return true };
            let search = if metadata.is_dir() { 0o001 } else { 0 };
            let read = if *part == path { 0o004 } else { 0 };
            !metadata.mode() & (search | read) != 0
        };
        let parts = if self.namespaces.exist() { 1 } else { usize::MAX };
        path.ancestors().take(parts).find(is_closed).filter(|_| self.own_user)
    }
}

/// The paths of this system that every program may read.
pub(super) fn system() -> Vec<PathBuf> {
    let is_setting = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().as_encoded_bytes();
        SETTINGS.iter().any(|setting| name.starts_with(setting.as_bytes()))
    };
    let entries = std::fs::read_dir("/etc").into_iter().flatten().flatten();
    let mut settings: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(is_setting).collect();
    settings.sort();
    let folders = SYSTEM.iter().map(PathBuf::from).filter(|path| path.exists());
    folders.chain(settings).collect()
}

/// The writable folders of a program; the first is its working directory.
pub(super) fn writable(job: &Job, namespaces: Namespaces) -> Vec<PathBuf> {
    match (namespaces, &job.keep) {
        (Namespaces::None, _) => vec![job.folder.clone()],
        (_, Keep::File(..) | Keep::Each(..)) => WRITABLE.map(PathBuf::from).to_vec(),
        (_, Keep::Tree(_)) => {
            let mut folders = vec![job.folder.clone()];
            folders.extend(WRITABLE.map(PathBuf::from));
            folders
        }
    }
}

/// Restricts the calling thread and its children permanently.
///
/// # Errors
/// A message, if a required restriction cannot be set up.
pub(super) fn restrict(walls: &Walls, job: &Job, user: Option<User>) -> Result<(), String> {
    identity::become_unprivileged(user.map(|user| user.owner))
        .map_err(|error| format!("the user: {error}"))?;
    let isolated = walls.namespaces.exist();
    let system = walls.system.iter().chain(&job.readable).map(PathBuf::as_path);
    let read_only = DEVICES.iter().filter(|(_, writable)| !writable).map(|(path, _)| path.as_ref());
    let written = DEVICES.iter().filter(|(_, writable)| *writable).map(|(path, _)| path.as_ref());
    let reach = landlock::Reach {
        // With a separate root, no other files are visible.
        readable: if isolated { vec![Path::new("/")] } else { system.chain(read_only).collect() },
        devices: written.collect(),
        writable: writable(job, walls.namespaces),
    };
    if walls.groups.is_none() {
        // The kernel keeps a huge page as long as a part of it is mapped, and no process shows the rest.
        disable_transparent_huge_pages(true).map_err(|error| format!("huge pages: {error}"))?;
    }
    let in_force = landlock::restrict(&reach).map_err(|error| format!("Landlock: {error}"))?;
    if walls.landlock && !in_force.files {
        return Err("Landlock: not in force".to_owned());
    }
    let policy = Policy {
        isolated,
        signals_stay: isolated || user.is_some_and(|user| user.is_exclusive) || in_force.signals,
        own_user: user.is_some(),
        is_counted: walls.groups.is_some(),
        builds: matches!(job.keep, Keep::Tree(_)),
    };
    calls::restrict(policy).map_err(|error| format!("seccomp: {error}"))
}
