//! Restrictions around a program ("walls"): those that a system grants, and their set-up in a thread.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::calls::{self, Policy};
use super::tree::Owner;
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

/// Devices that programs read and write, and that keep nothing.
pub(super) const DEVICES: &[&str] =
    &["/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"];

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
    /// The parent of the runs' control groups.
    pub(super) control_group: Option<PathBuf>,
    /// Readable paths of the system.
    pub(super) system: Vec<PathBuf>,
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
        (_, Keep::File(..)) => WRITABLE.map(PathBuf::from).to_vec(),
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
pub(super) fn restrict(walls: &Walls, job: &Job, owner: Option<Owner>) -> Result<(), String> {
    identity::become_unprivileged(owner).map_err(|error| format!("the user: {error}"))?;
    let isolated = walls.namespaces.exist();
    let system = walls.system.iter().chain(&job.readable).map(PathBuf::as_path);
    let reach = landlock::Reach {
        // With a separate root, no other files are visible.
        readable: if isolated { vec![Path::new("/")] } else { system.collect() },
        devices: DEVICES,
        writable: writable(job, walls.namespaces),
    };
    let in_force = landlock::restrict(&reach).map_err(|error| format!("Landlock: {error}"))?;
    if walls.landlock && !in_force.files {
        return Err("Landlock: not in force".to_owned());
    }
    let policy = Policy {
        isolated,
        signals_stay: isolated || owner.is_some() || in_force.signals,
        own_user: owner.is_some(),
        builds: matches!(job.keep, Keep::Tree(_)),
    };
    calls::restrict(policy).map_err(|error| format!("seccomp: {error}"))
}
