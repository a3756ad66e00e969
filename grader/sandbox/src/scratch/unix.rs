//! Scratch folders, and removal of those of killed graders.
//!
//! Each scratch folder contains a file that its grader keeps locked while it lives. If the lock is free, the folder is
//! abandoned; this works across PID namespaces. A folder may be removed between its creation and its locking: its
//! grader detects this and creates another. The lock is removed last, so that a sweeper killed during the removal
//! leaves a folder that the next one can remove.

use std::ffi::{CStr, CString};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rustix::fs::{
    AtFlags, CWD, Dir, FileType, FlockOperation, Mode, OFlags, chmodat, fchmod, flock, fstat,
    mkdir, open, openat, renameat, statat, unlinkat,
};
use rustix::io::{Errno, Result};

use super::{PREFIX, RANDOM};

/// Name of the lock file.
const LOCK: &str = "lock";

/// Attempts to create a folder if it is removed before it is locked, and to remove a folder that is still written to.
const ATTEMPTS: u32 = 100;

/// Pause before each further attempt to remove a folder.
const PAUSE: Duration = Duration::from_millis(10);

/// Minimum age of a non-empty folder without a lock before it is removed.
const GRACE: Duration = Duration::from_secs(3600);

const FOLDER: OFlags =
    OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::NOFOLLOW).union(OFlags::CLOEXEC);

/// A folder that is removed on drop. The name `lock` in it is reserved.
#[derive(Debug)]
pub struct Scratch {
    path: PathBuf,
    _lock: OwnedFd,
}

impl Scratch {
    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // If removal fails, `sweep` removes it later.
        let _ = remove(&self.path);
    }
}

/// Creates a folder that only this user may read, in the system's folder for temporary files.
pub fn scratch_folder() -> io::Result<Scratch> {
    scratch_folder_in(&crate::files::temporary())
}

/// The system's folder of files in memory.
#[cfg(target_os = "linux")]
const MEMORY: &str = "/dev/shm";

/// The number of scratch folders for which there must be room in memory.
#[cfg(target_os = "linux")]
const ROOM: u64 = 4;

/// Creates one for so many bytes in memory, if there is room and `TMPDIR` names no other place, and else as usual.
#[cfg(target_os = "linux")]
pub(crate) fn scratch_folder_in_memory(bytes: u64) -> io::Result<Scratch> {
    let is_offered = std::env::var_os("TMPDIR").is_none()
        && rustix::fs::statfs(MEMORY).is_ok_and(|found| {
            let room = found.f_bavail.saturating_mul(found.f_bsize.unsigned_abs());
            found.f_type == libc::TMPFS_MAGIC && room >= ROOM.saturating_mul(bytes)
        });
    let made = is_offered.then(|| scratch_folder_in(Path::new(MEMORY)).ok());
    made.flatten().map_or_else(scratch_folder, Ok)
}

fn scratch_folder_in(parent: &Path) -> io::Result<Scratch> {
    let mut made = scratch_folder_once(parent);
    for _ in 0..ATTEMPTS {
        match made {
            Err(Errno::EXIST | Errno::NOENT | Errno::WOULDBLOCK) => {}
            made => return Ok(made?),
        }
        made = scratch_folder_once(parent);
    }
    Ok(made?)
}

fn scratch_folder_once(parent: &Path) -> Result<Scratch> {
    let random: String = (0..RANDOM).map(|_| fastrand::alphanumeric()).collect();
    let path = parent.join(format!("{PREFIX}{random}"));
    mkdir(&path, Mode::RWXU)?;
    let flags = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL | OFlags::CLOEXEC;
    let lock = open(path.join(LOCK), flags, Mode::RUSR | Mode::WUSR)?;
    flock(&lock, FlockOperation::NonBlockingLockExclusive)?;
    // A sweeper deletes the lock file before it releases the lock.
    if fstat(&lock)?.st_nlink == 0 {
        return Err(Errno::NOENT);
    }
    Ok(Scratch { path, _lock: lock })
}

/// Removes the scratch folders of graders that were killed.
pub(crate) fn sweep() {
    sweep_in(&crate::files::temporary());
    #[cfg(target_os = "linux")]
    sweep_in(Path::new(MEMORY));
}

fn sweep_in(parent: &Path) {
    let Ok(parent) = open(parent, FOLDER - OFlags::NOFOLLOW, Mode::empty()) else { return };
    for name in names(&parent).unwrap_or_default() {
        if name.to_bytes().starts_with(PREFIX.as_bytes()) {
            // The folder may be in use, belong to another user, or be removed by another grader.
            let _ = sweep_one(&parent, &name);
        }
    }
}

fn sweep_one(parent: &OwnedFd, name: &CStr) -> Result<()> {
    let folder = openat(parent, name, FOLDER, Mode::empty())?;
    let stat = fstat(&folder)?;
    if stat.st_uid != rustix::process::geteuid().as_raw() {
        return Ok(());
    }
    let age = u64::try_from(stat.st_mtime)
        .ok()
        .and_then(|seconds| SystemTime::UNIX_EPOCH.checked_add(Duration::from_secs(seconds)))
        .and_then(|changed| SystemTime::now().duration_since(changed).ok());
    let is_young = age.is_none_or(|age| age < GRACE);
    let flags = OFlags::RDWR | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    // Hold the lock until the folder is gone.
    let _lock = match openat(&folder, LOCK, flags, Mode::empty()) {
        Ok(lock) => {
            flock(&lock, FlockOperation::NonBlockingLockExclusive)?;
            Some(lock)
        }
        Err(_) if is_young => return unlinkat(parent, name, AtFlags::REMOVEDIR),
        Err(_) => None,
    };
    remove_scratch(parent, name)
}

fn remove(path: &Path) -> Result<()> {
    let (Some(parent), Some(name)) = (path.parent(), path.file_name()) else {
        return Err(Errno::INVAL);
    };
    let parent = openat(CWD, parent, FOLDER - OFlags::NOFOLLOW, Mode::empty())?;
    let name = CString::new(name.as_bytes()).map_err(|_| Errno::INVAL)?;
    remove_scratch(&parent, &name)
}

/// Removes a scratch folder, its lock last. Processes of a killed grader may write there until they end.
fn remove_scratch(parent: &OwnedFd, name: &CStr) -> Result<()> {
    let folder = open_folder(parent, name)?;
    let remove_once = || {
        for child in names(&folder)?.iter().filter(|child| child.to_bytes() != LOCK.as_bytes()) {
            remove_tree(&folder, child)?;
        }
        let _ = unlinkat(&folder, LOCK, AtFlags::empty());
        unlinkat(parent, name, AtFlags::REMOVEDIR)
    };
    for _ in 0..ATTEMPTS {
        match remove_once() {
            Err(Errno::NOTEMPTY | Errno::EXIST | Errno::NOENT) => std::thread::sleep(PAUSE),
            removed => return removed,
        }
    }
    remove_once()
}

/// Removes a file, or a folder with its content, whatever the modes. Does not follow links.
///
/// Empties an inner folder by moving its subfolders to the top: paths stay short, and at most three folders are open
/// at a time at any depth. Each folder moves once.
fn remove_tree(parent: &OwnedFd, name: &CStr) -> Result<()> {
    if !is_folder(parent, name)? {
        return unlinkat(parent, name, AtFlags::empty());
    }
    let top = open_folder(parent, name)?;
    let mut number = 0_u64;
    loop {
        let children = names(&top)?;
        if children.is_empty() {
            return unlinkat(parent, name, AtFlags::REMOVEDIR);
        }
        for child in children {
            if is_folder(&top, &child)? {
                empty_into(&top, &open_folder(&top, &child)?, &mut number)?;
                unlinkat(&top, &child, AtFlags::REMOVEDIR)?;
            } else {
                unlinkat(&top, &child, AtFlags::empty())?;
            }
        }
    }
}

/// Removes the content of `folder`, except subfolders, which move to `top` under the next free numbers.
fn empty_into(top: &OwnedFd, folder: &OwnedFd, number: &mut u64) -> Result<()> {
    for child in names(folder)? {
        if !is_folder(folder, &child)? {
            unlinkat(folder, &child, AtFlags::empty())?;
            continue;
        }
        // Only a writable folder can be moved.
        open_folder(folder, &child)?;
        loop {
            *number += 1;
            match renameat(folder, &child, top, number.to_string()) {
                Err(Errno::EXIST | Errno::NOTEMPTY | Errno::NOTDIR) => {}
                moved => break moved?,
            }
        }
    }
    Ok(())
}

/// Opens a folder and gives its owner all rights. No other process uses it, so it is safe to change the mode by name.
fn open_folder(parent: &OwnedFd, name: &CStr) -> Result<OwnedFd> {
    let folder = match openat(parent, name, FOLDER, Mode::empty()) {
        Err(Errno::ACCESS) => {
            chmodat(parent, name, Mode::RWXU, AtFlags::empty())?;
            openat(parent, name, FOLDER, Mode::empty())?
        }
        opened => opened?,
    };
    fchmod(&folder, Mode::RWXU)?;
    Ok(folder)
}

fn is_folder(parent: &OwnedFd, name: &CStr) -> Result<bool> {
    let stat = statat(parent, name, AtFlags::SYMLINK_NOFOLLOW)?;
    Ok(FileType::from_raw_mode(stat.st_mode) == FileType::Directory)
}

fn names(folder: &OwnedFd) -> Result<Vec<CString>> {
    let mut names = Vec::new();
    for entry in Dir::read_from(folder)? {
        let name = entry?.file_name().to_owned();
        if ![c".", c".."].contains(&name.as_c_str()) {
            names.push(name);
        }
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    use rustix::fs::mkdirat;

    use super::*;

    fn backdate(path: &Path) {
        let hours = SystemTime::now() - 2 * GRACE;
        fs::File::open(path).unwrap().set_modified(hours).unwrap();
    }

    #[test]
    fn only_abandoned_scratch_folders_are_removed() {
        let place = tempfile::tempdir().unwrap();
        let held = scratch_folder_in(place.path()).unwrap();
        assert_eq!(fs::metadata(held.path()).unwrap().mode() & 0o777, 0o700);
        // Its grader was killed: the lock is free.
        let abandoned = held.path().with_extension("killed");
        fs::create_dir_all(abandoned.join("scratch/deep")).unwrap();
        fs::write(abandoned.join(LOCK), "").unwrap();
        let of_name = |name: &str| {
            let path = place.path().join(format!("{PREFIX}{name}"));
            fs::create_dir(&path).unwrap();
            path
        };
        let (young, empty, old) = (of_name("1"), of_name("2"), of_name("3"));
        for folder in [&young, &old] {
            fs::write(folder.join("file"), "").unwrap();
        }
        let outside = place.path().join("outside");
        fs::create_dir(&outside).unwrap();
        let link = place.path().join(format!("{PREFIX}link"));
        symlink(&outside, &link).unwrap();
        backdate(&old);
        backdate(held.path());
        sweep_in(place.path());
        for path in [held.path(), &young, &outside, &link] {
            assert!(path.exists(), "{}", path.display());
        }
        for path in [&abandoned, &empty, &old] {
            assert!(!path.exists(), "{}", path.display());
        }
        let path = held.path().to_path_buf();
        drop(held);
        assert!(!path.exists());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn abandoned_folders_in_memory_are_removed() {
        let held = scratch_folder_in_memory(1).unwrap();
        let abandoned = held.path().with_extension("killed");
        fs::create_dir_all(abandoned.join("run")).unwrap();
        fs::write(abandoned.join(LOCK), "").unwrap();
        sweep();
        assert!(held.path().exists() && !abandoned.exists());
    }

    #[test]
    fn scratch_folders_survive_concurrent_sweeps() {
        let place = tempfile::tempdir().unwrap();
        std::thread::scope(|scope| {
            let makers: Vec<_> = (0..2)
                .map(|_| {
                    scope.spawn(|| {
                        for _ in 0..100 {
                            let folder = scratch_folder_in(place.path()).unwrap();
                            fs::write(folder.path().join("file"), "").unwrap();
                        }
                    })
                })
                .collect();
            while makers.iter().any(|maker| !maker.is_finished()) {
                sweep_in(place.path());
            }
        });
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn deep_trees_of_any_mode_are_removed() {
        let scratch = scratch_folder().unwrap();
        let victim = tempfile::tempdir().unwrap();
        fs::write(victim.path().join("kept"), "").unwrap();
        // Names that the removal also uses.
        for name in ["1", "2"] {
            fs::write(scratch.path().join(name), "").unwrap();
        }
        fs::create_dir_all(scratch.path().join("3/4/5")).unwrap();
        symlink(victim.path(), scratch.path().join("3/4/link")).unwrap();
        symlink(victim.path(), scratch.path().join("link")).unwrap();
        let mut folder = openat(CWD, scratch.path(), FOLDER, Mode::empty()).unwrap();
        // Longer than a path may be, and more folders than a process may have open.
        for _ in 0..3_000 {
            mkdirat(&folder, "d", Mode::RWXU).unwrap();
            let inner = openat(&folder, "d", FOLDER, Mode::empty()).unwrap();
            fchmod(&folder, Mode::empty()).unwrap();
            folder = inner;
        }
        drop(folder);
        fs::set_permissions(scratch.path(), fs::Permissions::from_mode(0o700)).unwrap();
        let path = scratch.path().to_path_buf();
        drop(scratch);
        assert!(!path.exists());
        assert!(victim.path().join("kept").exists());
    }
}
