//! Folders as paths.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use super::{Facts, Kind, Refused};

/// Extensions of programs that Windows runs.
const PROGRAMS: [&str; 4] = ["exe", "com", "bat", "cmd"];

/// An open folder.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// The folder at this path, to which links may lead.
    ///
    /// # Errors
    /// If the path is not a folder.
    pub fn at(path: &Path) -> io::Result<Self> {
        match fs::metadata(path)?.is_dir() {
            true => Ok(Self(path.to_path_buf())),
            false => Err(io::ErrorKind::NotADirectory.into()),
        }
    }

    /// The same folder again.
    ///
    /// # Errors
    /// Never.
    pub fn try_clone(&self) -> io::Result<Self> {
        Ok(Self(self.0.clone()))
    }

    /// The folder of this name in it.
    ///
    /// # Errors
    /// If the entry is not a folder; a link is not one.
    pub fn folder(&self, name: &OsStr) -> io::Result<Self> {
        match self.facts(name)?.kind {
            Kind::Folder => Ok(Self(self.0.join(name))),
            _ => Err(io::ErrorKind::NotADirectory.into()),
        }
    }

    /// The regular file of this name in it, for reading.
    ///
    /// # Errors
    /// If it cannot be opened, or is no regular file.
    pub fn file(&self, name: &OsStr) -> Result<File, Refused> {
        open_regular(&self.0.join(name))
    }

    /// Facts of the entry of this name in it; those of the link itself if it is one.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn facts(&self, name: &OsStr) -> io::Result<Facts> {
        facts(&self.0.join(name))
    }

    /// The names in it, sorted; `most + 1` of them if there are more than `most`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn names(&self, most: usize) -> io::Result<Vec<OsString>> {
        let entries = fs::read_dir(&self.0)?.take(most.saturating_add(1));
        let mut names =
            entries.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>()?;
        names.sort();
        Ok(names)
    }

    /// The target of a link.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn target(&self, name: &OsStr) -> io::Result<OsString> {
        Ok(fs::read_link(self.0.join(name))?.into_os_string())
    }

    /// Makes a folder in it.
    ///
    /// # Errors
    /// If it exists or cannot be made.
    pub fn make_folder(&self, name: &OsStr) -> io::Result<Self> {
        let made = self.0.join(name);
        fs::create_dir(&made)?;
        Ok(Self(made))
    }

    /// Makes a file in it.
    ///
    /// # Errors
    /// If it exists or cannot be made.
    pub fn make_file(&self, name: &OsStr, _is_executable: bool) -> io::Result<File> {
        File::create_new(self.0.join(name))
    }

    /// Makes a link in it.
    ///
    /// # Errors
    /// Always: not everybody may make links.
    pub fn make_link(&self, _name: &OsStr, _target: &OsStr) -> io::Result<()> {
        Err(io::Error::other("links are not copied on this system"))
    }
}

/// The regular file at this path, which must not end in a link.
///
/// # Errors
/// If it cannot be opened, or is no regular file.
pub fn open_regular(path: &Path) -> Result<File, Refused> {
    match facts(path)?.kind {
        Kind::File => Ok(File::open(path)?),
        special => Err(Refused::Special(special)),
    }
}

fn facts(path: &Path) -> io::Result<Facts> {
    let metadata = fs::symlink_metadata(path)?;
    let kind = match metadata.file_type() {
        kind if kind.is_symlink() => Kind::Link,
        kind if kind.is_dir() => Kind::Folder,
        kind if kind.is_file() => Kind::File,
        _ => Kind::Device,
    };
    let modified = metadata.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    Ok(Facts {
        kind,
        size: metadata.len(),
        is_executable: is_executable(path, &metadata),
        modified: modified.map_or(0, |since| since.as_secs().cast_signed()),
    })
}

/// Whether the file at this path, which has this metadata, is a program by its name.
pub fn is_executable(path: &Path, metadata: &Metadata) -> bool {
    let extension = path.extension().unwrap_or_default();
    metadata.is_file() && PROGRAMS.iter().any(|known| extension.eq_ignore_ascii_case(known))
}

/// Lets everybody execute a file: its name does that.
///
/// # Errors
/// Never.
pub fn make_executable(_path: &Path) -> io::Result<()> {
    Ok(())
}

/// Makes a folder, or checks that there is one; that of a user is closed to others.
///
/// # Errors
/// If it cannot be made.
pub fn own_folder(path: &Path) -> io::Result<()> {
    fs::create_dir_all(path)
}

/// The number of this user: the folder for temporary files is each user's own.
pub fn user() -> u32 {
    0
}

/// Whether this path is closed to other users, which is not known.
pub fn is_closed(_path: &Path) -> bool {
    false
}

/// Exchanges two names in one step.
///
/// # Errors
/// Always: the system cannot.
pub fn exchange_names(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The folder of temporary files; a page of a browser has one of this name.
pub fn temporary() -> PathBuf {
    if cfg!(target_family = "wasm") { PathBuf::from("/tmp") } else { std::env::temp_dir() }
}

/// Whether an error of reading is the machine's fault, rather than the file's.
pub fn is_of_machine(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::OutOfMemory
}
