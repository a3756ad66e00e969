//! Folders as descriptors; modes of files.

use std::ffi::{OsStr, OsString};
use std::fs::{self, DirBuilder, File, Metadata};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{
    AtFlags, CWD, Dir, FileType, Mode, OFlags, Stat, fchmod, fstat, mkdirat, openat, readlinkat,
    statat, symlinkat,
};
use rustix::io::Errno;

use super::{Facts, Kind, Refused};

/// Flags that open a folder without following links.
const FOLDER: OFlags =
    OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::NOFOLLOW).union(OFlags::CLOEXEC);

/// Bits of a mode that let anybody execute a file.
const EXECUTABLE: Mode = Mode::XUSR.union(Mode::XGRP).union(Mode::XOTH);

/// An open folder.
#[derive(Debug)]
pub struct Folder(OwnedFd);

impl Folder {
    /// The folder at this path, to which links may lead.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn at(path: &Path) -> io::Result<Self> {
        Ok(Self(openat(CWD, path, FOLDER - OFlags::NOFOLLOW, Mode::empty())?))
    }

    /// The same folder again.
    ///
    /// # Errors
    /// If too many files are open.
    pub fn try_clone(&self) -> io::Result<Self> {
        self.0.try_clone().map(Self)
    }

    /// The folder of this name in it.
    ///
    /// # Errors
    /// If it cannot be opened, or is a link.
    pub fn folder(&self, name: &OsStr) -> io::Result<Self> {
        Ok(Self(openat(&self.0, name, FOLDER, Mode::empty())?))
    }

    /// The regular file of this name in it, for reading.
    ///
    /// # Errors
    /// If it cannot be opened, or is no regular file.
    pub fn file(&self, name: &OsStr) -> Result<File, Refused> {
        regular(&self.0, Path::new(name))
    }

    /// Facts of the entry of this name in it; those of the link itself if it is one.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn facts(&self, name: &OsStr) -> io::Result<Facts> {
        Ok(facts(&statat(&self.0, name, AtFlags::SYMLINK_NOFOLLOW)?))
    }

    /// The names in it, sorted; `most + 1` of them if there are more than `most`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn names(&self, most: usize) -> io::Result<Vec<OsString>> {
        let mut names = Vec::new();
        for entry in Dir::read_from(&self.0)? {
            let entry = entry?;
            let name = entry.file_name().to_bytes();
            if ![&b"."[..], b".."].contains(&name) {
                names.push(OsStr::from_bytes(name).to_owned());
            }
            if names.len() > most {
                break;
            }
        }
        names.sort();
        Ok(names)
    }

    /// The target of a link.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn target(&self, name: &OsStr) -> io::Result<OsString> {
        Ok(OsString::from_vec(readlinkat(&self.0, name, Vec::new())?.into_bytes()))
    }

    /// Makes a folder of mode 755 in it, whatever this process's umask.
    ///
    /// # Errors
    /// If it exists or cannot be made.
    pub fn make_folder(&self, name: &OsStr) -> io::Result<Self> {
        mkdirat(&self.0, name, Mode::from_raw_mode(0o755))?;
        let made = self.folder(name)?;
        fchmod(&made.0, Mode::from_raw_mode(0o755))?;
        Ok(made)
    }

    /// Makes a file of mode 644 in it, or 755.
    ///
    /// # Errors
    /// If it exists or cannot be made.
    pub fn make_file(&self, name: &OsStr, is_executable: bool) -> io::Result<File> {
        let mode = Mode::from_raw_mode(if is_executable { 0o755 } else { 0o644 });
        let flags =
            OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let made = openat(&self.0, name, flags, mode)?;
        fchmod(&made, mode)?;
        Ok(made.into())
    }

    /// Makes a link in it.
    ///
    /// # Errors
    /// If it exists or cannot be made.
    pub fn make_link(&self, name: &OsStr, target: &OsStr) -> io::Result<()> {
        Ok(symlinkat(target, &self.0, name)?)
    }
}

/// The regular file at this path, which must not end in a link.
///
/// # Errors
/// If it cannot be opened, or is no regular file.
pub fn open_regular(path: &Path) -> Result<File, Refused> {
    regular(CWD, path)
}

/// A pipe would block, and opening a device may have side effects.
fn regular(folder: impl AsFd, path: &Path) -> Result<File, Refused> {
    let check = |stat: Stat| match facts(&stat).kind {
        Kind::File => Ok(()),
        special => Err(Refused::Special(special)),
    };
    check(statat(&folder, path, AtFlags::SYMLINK_NOFOLLOW).map_err(io::Error::from)?)?;
    let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = openat(&folder, path, flags, Mode::empty()).map_err(io::Error::from)?;
    check(fstat(&file).map_err(io::Error::from)?)?;
    Ok(file.into())
}

fn facts(stat: &Stat) -> Facts {
    let kind = match FileType::from_raw_mode(stat.st_mode) {
        FileType::RegularFile => Kind::File,
        FileType::Symlink => Kind::Link,
        FileType::Directory => Kind::Folder,
        FileType::Fifo => Kind::Pipe,
        FileType::Socket => Kind::Socket,
        _ => Kind::Device,
    };
    Facts {
        kind,
        size: u64::try_from(stat.st_size).unwrap_or(0),
        is_executable: Mode::from_raw_mode(stat.st_mode).intersects(EXECUTABLE),
        modified: stat.st_mtime,
    }
}

/// Whether any user may execute the file at this path, which has this metadata.
pub fn is_executable(_path: &Path, metadata: &Metadata) -> bool {
    metadata.mode() & 0o111 != 0
}

/// Lets everybody execute a file.
///
/// # Errors
/// If its mode cannot be changed.
pub fn make_executable(path: &Path) -> io::Result<()> {
    fs::set_permissions(path, fs::Permissions::from_mode(0o755))
}

/// Makes a folder that nobody else may write to, or checks that it is one.
///
/// # Errors
/// If it cannot be made, or others may write to it.
pub fn own_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)?;
    let metadata = fs::symlink_metadata(path)?;
    let is_own = metadata.is_dir() && metadata.uid() == user();
    if !is_own || metadata.mode() & 0o022 != 0 {
        return Err(io::Error::other("others may write to it"));
    }
    Ok(())
}

/// The number of this user.
pub fn user() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Whether a folder on the way to this path, or the path itself, is closed to all but its owner and root.
pub fn is_closed(path: &Path) -> bool {
    let is_closed = |part: &Path| part.metadata().is_ok_and(|about| about.mode() & 0o077 == 0);
    path.ancestors().any(is_closed)
}

/// Exchanges two names in one step.
///
/// # Errors
/// If the system cannot, or refuses it.
#[cfg(target_os = "linux")]
pub fn exchange_names(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

/// Exchanges two names in one step.
///
/// # Errors
/// Always: the system cannot.
#[cfg(not(target_os = "linux"))]
pub fn exchange_names(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The folder of temporary files.
pub fn temporary() -> PathBuf {
    std::env::temp_dir()
}

/// Whether an error of reading is the machine's fault, rather than the file's.
pub fn is_of_machine(error: &io::Error) -> bool {
    let machine = [Errno::MFILE, Errno::NFILE, Errno::NOMEM, Errno::IO];
    machine.iter().any(|errno| error.raw_os_error() == Some(errno.raw_os_error()))
}
