//! Copies by open folders.
//!
//! Names are looked up relative to an open folder and links are not followed, so that no name leads outside. Folders
//! are traversed with an explicit stack, to a bounded depth.

use std::ffi::CStr;
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::fs::{AtFlags, CWD, Dir, FileType, Gid, Mode, OFlags, Stat, Uid};
use rustix::io::Errno;

use super::{Bounds, MAX_DEPTH};
use crate::{Exceeded, Limits, NotKept};

const READ: OFlags =
    OFlags::RDONLY.union(OFlags::NOFOLLOW).union(OFlags::NONBLOCK).union(OFlags::CLOEXEC);

const CREATE: OFlags =
    OFlags::WRONLY.union(OFlags::CREATE).union(OFlags::EXCL).union(OFlags::CLOEXEC);

/// An open folder.
pub(crate) type Opened = OwnedFd;

/// User and group of a copy.
pub(crate) type Owner = (Uid, Gid);

impl NotKept {
    fn io(error: impl Into<io::Error>) -> Self {
        Self::Other(format!("cannot be copied: {}", error.into()))
    }
}

/// Opens a folder.
pub(crate) fn open_folder(path: &Path) -> io::Result<OwnedFd> {
    Ok(rustix::fs::openat(CWD, path, READ | OFlags::DIRECTORY, Mode::empty())?)
}

/// Copies the regular file `name` of a folder, which must have no second name, to `to`.
pub(crate) fn copy_file(folder: &Opened, name: &str, to: &Path, most: u64) -> Result<(), NotKept> {
    let stat = match rustix::fs::statat(folder, name, AtFlags::SYMLINK_NOFOLLOW) {
        Err(Errno::NOENT) => return Err(NotKept::Missing),
        stat => stat.map_err(NotKept::io)?,
    };
    check_file(&stat, most)?;
    let from = rustix::fs::openat(folder, name, READ, Mode::empty()).map_err(NotKept::io)?;
    check_file(&rustix::fs::fstat(&from).map_err(NotKept::io)?, most)?;
    let to = rustix::fs::open(to, CREATE, Mode::from_raw_mode(0o600)).map_err(NotKept::io)?;
    copy_bytes(from, to, most)
}

fn check_file(stat: &Stat, most: u64) -> Result<(), NotKept> {
    match FileType::from_raw_mode(stat.st_mode) {
        FileType::RegularFile => {}
        FileType::Symlink => return Err(NotKept::Link),
        FileType::Directory => return Err(NotKept::Folder),
        _ => return Err(NotKept::Special),
    }
    match () {
        () if stat.st_nlink != 1 => Err(NotKept::SecondName),
        () if stat.st_size.cast_unsigned() > most => Err(NotKept::TooLarge(most)),
        () => Ok(()),
    }
}

fn copy_bytes(from: OwnedFd, to: OwnedFd, most: u64) -> Result<(), NotKept> {
    let mut from = io::Read::take(File::from(from), most);
    io::copy(&mut from, &mut File::from(to)).map_err(NotKept::io)?;
    Ok(())
}

/// The same as [`copy_for`], to this user.
pub(crate) fn copy(from: &Opened, to: &Opened, bounds: Bounds) -> Result<(), NotKept> {
    copy_for(from.as_fd(), to, bounds, None)
}

/// Copies the content of a folder into an empty one: regular files (each name separately), folders and links. Skips
/// other kinds of files. Files get the mode 644, or 755 if executable or an ELF file: where programs cannot change modes,
/// a linker's result is not executable.
pub(crate) fn copy_for(
    from: BorrowedFd<'_>,
    to: &OwnedFd,
    bounds: Bounds,
    owner: Option<Owner>,
) -> Result<(), NotKept> {
    let level = |from: BorrowedFd<'_>, to: BorrowedFd<'_>| -> io::Result<_> {
        Ok((Dir::read_from(from)?, from.try_clone_to_owned()?, to.try_clone_to_owned()?))
    };
    let mut left = bounds;
    let mut levels = vec![level(from, to.as_fd()).map_err(NotKept::io)?];
    while let Some((entries, from, to)) = levels.last_mut() {
        let Some(entry) = entries.next() else {
            levels.pop();
            continue;
        };
        let entry = entry.map_err(NotKept::io)?;
        let name = entry.file_name();
        if name == c"." || name == c".." {
            continue;
        }
        left.entries = left.entries.checked_sub(1).ok_or_else(|| {
            NotKept::Other(format!("holds more than {} files and folders", bounds.entries))
        })?;
        let copied = copy_entry(from.as_fd(), to.as_fd(), name, &mut left, owner);
        let below = copied.map_err(|error| match error {
            NotKept::TooLarge(_) => NotKept::TooLarge(bounds.bytes),
            NotKept::Other(reason) => NotKept::Other(format!("{name:?} {reason}")),
            other => other,
        })?;
        if let Some((from, to)) = below {
            if levels.len() > MAX_DEPTH {
                return Err(NotKept::TooDeep(MAX_DEPTH));
            }
            levels.push(level(from.as_fd(), to.as_fd()).map_err(NotKept::io)?);
        }
    }
    Ok(())
}

/// Whether a file begins as programs and libraries do.
fn is_elf(file: BorrowedFd<'_>) -> bool {
    let mut magic = [0; 4];
    rustix::io::pread(file, &mut magic, 0).is_ok_and(|read| read == 4) && magic == *b"\x7fELF"
}

/// Copies one entry. For a folder, creates only the folder itself and returns the source and the copy.
fn copy_entry(
    from: BorrowedFd<'_>,
    to: BorrowedFd<'_>,
    name: &CStr,
    left: &mut Bounds,
    owner: Option<Owner>,
) -> Result<Option<(OwnedFd, OwnedFd)>, NotKept> {
    let stat = rustix::fs::statat(from, name, AtFlags::SYMLINK_NOFOLLOW).map_err(NotKept::io)?;
    let open = |flags| match rustix::fs::openat(from, name, READ | flags, Mode::empty()) {
        Err(Errno::ACCESS) => {
            // Its owner may have made it unreadable.
            rustix::fs::chmodat(from, name, Mode::RWXU, AtFlags::empty())?;
            rustix::fs::openat(from, name, READ | flags, Mode::empty())
        }
        opened => opened,
    };
    let mut below = None;
    match FileType::from_raw_mode(stat.st_mode) {
        FileType::RegularFile => {
            let size = stat.st_size.cast_unsigned();
            left.bytes = left.bytes.checked_sub(size).ok_or(NotKept::TooLarge(0))?;
            let source = open(OFlags::empty()).map_err(NotKept::io)?;
            let is_program = stat.st_mode & 0o111 != 0 || is_elf(source.as_fd());
            let mode = Mode::from_raw_mode(if is_program { 0o755 } else { 0o644 });
            let copy = rustix::fs::openat(to, name, CREATE, mode).map_err(NotKept::io)?;
            rustix::fs::fchmod(&copy, mode).map_err(NotKept::io)?;
            copy_bytes(source, copy, size)?;
        }
        FileType::Directory => {
            let source = open(OFlags::DIRECTORY).map_err(NotKept::io)?;
            rustix::fs::mkdirat(to, name, Mode::from_raw_mode(0o755)).map_err(NotKept::io)?;
            let copy = rustix::fs::openat(to, name, READ | OFlags::DIRECTORY, Mode::empty());
            below = Some((source, copy.map_err(NotKept::io)?));
        }
        FileType::Symlink => {
            let target = rustix::fs::readlinkat(from, name, Vec::new()).map_err(NotKept::io)?;
            rustix::fs::symlinkat(target, to, name).map_err(NotKept::io)?;
        }
        _ => return Ok(None),
    }
    if let Some((user, group)) = owner {
        rustix::fs::chownat(to, name, Some(user), Some(group), AtFlags::SYMLINK_NOFOLLOW)
            .map_err(NotKept::io)?;
    }
    Ok(below)
}

/// The limit that the content of a folder exceeds, if any.
pub(crate) fn exceeded_size(folder: &Path, limits: Limits) -> Option<Exceeded> {
    let (bytes, entries) = usage(folder);
    match () {
        () if bytes >= limits.trace => Some(Exceeded::Trace),
        () if entries > limits.files => Some(Exceeded::Files),
        () => None,
    }
}

/// Bytes and entries in a folder, to the depth of copies. A file counts with its length or its allocated blocks,
/// whichever is larger.
fn usage(folder: &Path) -> (u64, u64) {
    const BLOCK: u64 = 512;
    let (mut bytes, mut entries) = (0, 0);
    walk(folder, |_, _, stat| {
        entries += 1;
        if FileType::from_raw_mode(stat.st_mode) != FileType::Directory {
            bytes += stat.st_size.cast_unsigned().max(stat.st_blocks.cast_unsigned() * BLOCK);
        }
    });
    (bytes, entries)
}

/// Changes the owner of a folder and its content.
pub(crate) fn change_owner(folder: &Path, (user, group): Owner) -> io::Result<()> {
    let mut given = Ok(());
    walk(folder, |folder, name, _| {
        let chown =
            rustix::fs::chownat(folder, name, Some(user), Some(group), AtFlags::SYMLINK_NOFOLLOW);
        given = given.and(chown);
    });
    given?;
    Ok(rustix::fs::chown(folder, Some(user), Some(group))?)
}

/// Visits the content of a folder, to the depth of copies: the parent folder, name and metadata of each entry. Skips
/// unreadable entries.
fn walk(folder: &Path, mut visit: impl FnMut(BorrowedFd<'_>, &CStr, &Stat)) {
    let level = |folder: OwnedFd| Dir::read_from(&folder).ok().map(|entries| (entries, folder));
    let mut levels: Vec<_> = open_folder(folder).ok().and_then(level).into_iter().collect();
    while let Some((entries, folder)) = levels.last_mut() {
        let Some(Ok(entry)) = entries.next() else {
            levels.pop();
            continue;
        };
        let name = entry.file_name();
        if name == c"." || name == c".." {
            continue;
        }
        let Ok(stat) = rustix::fs::statat(&*folder, name, AtFlags::SYMLINK_NOFOLLOW) else {
            continue;
        };
        visit(folder.as_fd(), name, &stat);
        if FileType::from_raw_mode(stat.st_mode) == FileType::Directory && levels.len() <= MAX_DEPTH
        {
            let (_, folder) = &levels[levels.len() - 1];
            let flags = READ | OFlags::DIRECTORY;
            let below = rustix::fs::openat(folder, name, flags, Mode::empty()).ok();
            levels.extend(below.and_then(level));
        }
    }
}
