//! Root file system of a run: everything that a program can see of the machine.
//!
//! ```text
//! /                            tmpfs, read-only
//! ├── usr bin lib …            the system's, read-only
//! ├── etc                      settings of run-time systems, read-only; one user, one group
//! ├── dev                      null zero full random urandom, descriptors
//! │   └── shm                  in the tmpfs below
//! ├── proc                     processes of this PID namespace, read-only
//! ├── <paths of the job>       readable files of the job, read-only, under their own paths
//! └── tmp                      tmpfs, limited in bytes and inodes, the only place to write
//!     └── work                 the working directory; of a build, under the path of its folder as well
//! ```
//!
//! Mounts are nosuid and, except for devices, nodev. On a read-only mount, the kernel refuses every change of a mode,
//! an owner, a time or an attribute with `EROFS`, and does not update access times.

use std::ffi::CString;
use std::fs;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::ffi::OsStringExt;
use std::path::{Component, Path, PathBuf};

use rustix::mount::{
    MountFlags, MountPropagationFlags, UnmountFlags, mount, mount_bind, mount_bind_recursive,
    mount_change, mount_remount, unmount,
};
use rustix::process::{chdir, pivot_root};

use super::tree::{self, Bounds, Owner};
use super::walls::{WORK, Walls, devices, writable};
use super::{Job, Keep};

/// The size of the tmpfs of the root, which holds folders and mount points alone.
const ROOT: &str = "size=1M,mode=755";

const SAFE: MountFlags = MountFlags::NOSUID.union(MountFlags::NODEV);

/// A root under construction.
struct Root {
    /// Its mount point.
    at: PathBuf,
}

/// Replaces the root of this process's mount namespace. The process must be alone in its mount namespace and the
/// first of its PID namespace.
///
/// # Errors
/// A message that names the failed step.
pub(super) fn enter(walls: &Walls, job: &Job, owner: Option<Owner>) -> Result<(), String> {
    let input = tree::open_folder(&job.folder).map_err(step(&job.folder))?;
    let launcher = std::env::current_exe().map_err(step("this program"))?;
    let private = MountPropagationFlags::REC | MountPropagationFlags::PRIVATE;
    mount_change("/", private).map_err(step("/"))?;
    // Keep folders open that the mount will hide.
    let root = Root { at: job.folder.clone() };
    tmpfs(&root.at, ROOT).map_err(step("the root"))?;
    for path in &walls.system {
        root.reveal(path)?;
    }
    root.make_devices(walls)?;
    root.make_accounts(owner).map_err(step("/etc"))?;
    let proc = root.folder(Path::new("/proc"))?;
    let flags = SAFE | MountFlags::NOEXEC | MountFlags::RDONLY;
    // Without the machine's files, such as counts of all processes since its start. Kernels before 5.8 have no such option.
    mount("proc", &proc, "proc", flags, Some(c"subset=pid"))
        .or_else(|_| mount("proc", &proc, "proc", flags, None))
        .map_err(step("/proc"))?;

    let tmp = root.folder(Path::new("/tmp"))?;
    // No limits until its initial content is known.
    tmpfs(&tmp, "mode=1777").map_err(step("/tmp"))?;
    let work = root.folder(Path::new(WORK))?;
    let opened = tree::open_folder(&work).map_err(step(WORK))?;
    let bounds = Bounds { bytes: u64::MAX, entries: u64::MAX };
    tree::copy_for(input.as_fd(), &opened, bounds, owner).map_err(|error| error.to_string())?;
    let shared = root.folder(Path::new("/tmp/.shm"))?;
    for folder in [&work, &shared] {
        if let Some((user, group)) = owner {
            rustix::fs::chown(folder, Some(user), Some(group)).map_err(step(folder))?;
        }
    }
    let memory = root.folder(Path::new("/dev/shm"))?;
    mount_bind(&shared, &memory).map_err(step("/dev/shm"))?;
    if let Keep::Tree(_) = job.keep {
        mount_bind(&work, root.folder(&job.folder)?).map_err(step(&job.folder))?;
    }
    for path in &job.readable {
        if path.parent().is_none() || Path::new("/tmp").starts_with(path) {
            return Err(format!("{}: cannot be made readable as a whole", path.display()));
        }
        if !walls.system.iter().any(|folder| path.starts_with(folder)) {
            root.reveal(path)?;
        }
    }
    root.hide(&launcher, job)?;
    root.protect(&writable(job, walls.namespaces), walls)?;
    root.limit(&tmp, job)?;

    chdir(&root.at).map_err(step("the root"))?;
    pivot_root(".", ".").map_err(step("the root"))?;
    unmount(".", UnmountFlags::DETACH).map_err(step("the machine's root"))?;
    chdir("/").map_err(step("the root"))?;
    let flags = SAFE | MountFlags::RDONLY | MountFlags::BIND;
    mount_remount("/", flags, "").map_err(step("the root"))
}

impl Root {
    /// An absolute path, moved into the new root.
    fn path(&self, path: &Path) -> PathBuf {
        let names = path.components().filter(|part| matches!(part, Component::Normal(_)));
        names.fold(self.at.clone(), |at, name| at.join(name))
    }

    /// A folder in the new root, created if missing.
    fn folder(&self, path: &Path) -> Result<PathBuf, String> {
        let at = self.path(path);
        fs::create_dir_all(&at).map_err(step(path))?;
        Ok(at)
    }

    /// Makes a file, a folder or a link of the machine visible under its own path.
    fn reveal(&self, path: &Path) -> Result<(), String> {
        let at = self.path(path);
        let kind = fs::symlink_metadata(path).map_err(step(path))?.file_type();
        self.folder(path.parent().unwrap_or(path))?;
        if kind.is_symlink() {
            let target = fs::read_link(path).map_err(step(path))?;
            return std::os::unix::fs::symlink(target, at).map_err(step(path));
        }
        if kind.is_dir() {
            self.folder(path)?;
        } else if !at.exists() {
            fs::File::create(&at).map_err(step(path))?;
        }
        mount_bind_recursive(path, at).map_err(step(path))
    }

    /// Hides this program, unless it is the job: it may carry what submissions are judged by.
    fn hide(&self, launcher: &Path, job: &Job) -> Result<(), String> {
        let at = self.path(launcher);
        let is_named = job.readable.iter().any(|path| path == launcher);
        if is_named || !at.exists() {
            return Ok(());
        }
        // Without devices, it cannot be opened.
        mount_bind("/dev/null", at).map_err(step(launcher))
    }

    fn make_devices(&self, walls: &Walls) -> Result<(), String> {
        let dev = self.folder(Path::new("/dev"))?;
        for device in devices(walls) {
            self.reveal(device)?;
        }
        let links = [("fd", "fd"), ("stdin", "fd/0"), ("stdout", "fd/1"), ("stderr", "fd/2")];
        for (name, target) in links {
            std::os::unix::fs::symlink(format!("/proc/self/{target}"), dev.join(name))
                .map_err(step("/dev"))?;
        }
        Ok(())
    }

    /// Writes a user and a group with names, which run-time systems look up.
    fn make_accounts(&self, owner: Option<Owner>) -> io::Result<()> {
        let (user, group) = owner.map_or_else(
            || (rustix::process::getuid().as_raw(), rustix::process::getgid().as_raw()),
            |(user, group)| (user.as_raw(), group.as_raw()),
        );
        let etc = self.path(Path::new("/etc"));
        fs::create_dir_all(&etc)?;
        let account = format!("submission:x:{user}:{group}::{WORK}:/bin/sh\n");
        fs::write(etc.join("passwd"), account)?;
        fs::write(etc.join("group"), format!("submission:x:{group}:\n"))
    }

    /// Makes every mount below the new root read-only, except these, `/proc` (already read-only), and devices (without
    /// content).
    fn protect(&self, writable: &[PathBuf], walls: &Walls) -> Result<(), String> {
        let writable: Vec<PathBuf> = writable.iter().map(|path| self.path(path)).collect();
        let devices: Vec<PathBuf> = devices(walls).map(|device| self.path(device)).collect();
        let mounts = fs::read("/proc/self/mountinfo").map_err(step("the list of mounts"))?;
        for line in mounts.split(|byte| *byte == b'\n') {
            let mut fields = line.split(|byte| *byte == b' ');
            // proc_pid_mountinfo(5): the mount point is field 5, its options are field 6.
            let (Some(point), Some(options)) = (fields.nth(4), fields.next()) else { continue };
            let point = unescaped(point);
            if !point.starts_with(&self.at) || point == self.at || writable.contains(&point) {
                continue;
            }
            let mut flags = MountFlags::BIND | MountFlags::RDONLY | MountFlags::NOSUID;
            if !devices.contains(&point) {
                flags |= MountFlags::NODEV;
            }
            // The kernel does not let an ordinary user clear any of these.
            for (name, flag) in LOCKED {
                if options.split(|byte| *byte == b',').any(|option| option == name.as_bytes()) {
                    flags |= *flag;
                }
            }
            mount_remount(&point, flags, "").map_err(step(&point))?;
        }
        Ok(())
    }

    /// Limits the tmpfs to its present content plus the bytes and files that the job may write.
    fn limit(&self, tmp: &Path, job: &Job) -> Result<(), String> {
        let used = rustix::fs::statvfs(tmp).map_err(step("/tmp"))?;
        let bytes = (used.f_blocks - used.f_bfree) * used.f_frsize + job.limits.trace;
        let inodes = used.f_files - used.f_ffree + job.limits.files;
        mount_remount(tmp, SAFE, format!("size={bytes},nr_inodes={inodes},mode=1777"))
            .map_err(step("/tmp"))
    }
}

/// Mount options that a bind mount must keep.
const LOCKED: &[(&str, MountFlags)] = &[
    ("nodev", MountFlags::NODEV),
    ("noexec", MountFlags::NOEXEC),
    ("noatime", MountFlags::NOATIME),
    ("nodiratime", MountFlags::NODIRATIME),
    ("relatime", MountFlags::RELATIME),
];

/// A path as `/proc/self/mountinfo` writes it, with `\040` for a space.
fn unescaped(field: &[u8]) -> PathBuf {
    let mut path = Vec::with_capacity(field.len());
    let mut rest = field;
    while let [first, tail @ ..] = rest {
        let code = (*first == b'\\').then(|| tail.get(..3)).flatten();
        let code = code.and_then(|code| u8::from_str_radix(str::from_utf8(code).ok()?, 8).ok());
        path.push(code.unwrap_or(*first));
        rest = if code.is_some() { &tail[3..] } else { tail };
    }
    std::ffi::OsString::from_vec(path).into()
}

fn tmpfs(at: &Path, options: &str) -> io::Result<()> {
    let options = CString::new(options)?;
    Ok(mount("tmpfs", at, "tmpfs", SAFE, options.as_c_str())?)
}

/// Adds the path to the error of a step.
fn step<E: std::fmt::Display>(path: impl AsRef<Path>) -> impl FnOnce(E) -> String {
    let path = path.as_ref().display().to_string();
    move |error| format!("the sandbox's root: {path}: {error}")
}
