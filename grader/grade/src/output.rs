//! Output of reports to files and to standard output.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use scene::output::OutputFile;

use crate::stop::Stop;
use crate::terminal::{inert, terminal};

/// Writes a report to a file, or to the standard output.
pub(super) fn put(bytes: &[u8], output: Option<&Path>) -> Result<(), Stop> {
    match output {
        None => print(bytes),
        Some(path) => write_file(path, bytes).map_err(Stop::about(path)),
    }
}

/// Content that `write` writes.
pub(super) fn written(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Result<Vec<u8>, Stop> {
    let mut bytes = Vec::new();
    write(&mut bytes).map_err(Stop::fault)?;
    Ok(bytes)
}

pub(super) fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OutputFile::create(path)?;
    file.write_all(&plain(bytes))?;
    file.commit()
}

/// As [`write_file`], but replaces a link at `path` and leaves its target unchanged.
pub(super) fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_bytes(path, &plain(bytes))
}

/// Bytes without colour codes: files get no colours.
pub(super) fn plain(bytes: &[u8]) -> Vec<u8> {
    anstream::adapter::strip_bytes(bytes).into_vec()
}

/// Writes bytes unchanged, without removing colour codes as from text. Replaces a link at `path`.
pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OutputFile::replace(path)?;
    file.write_all(bytes)?;
    file.commit()
}

/// Creates the folder `below` another one, which the user named. Returns its path.
///
/// # Errors
/// If it cannot be created, or a part of the path below the named folder is a link.
pub(super) fn create_folder(named: &Path, below: impl AsRef<Path>) -> io::Result<PathBuf> {
    fs::create_dir_all(named)?;
    let mut folder = named.to_path_buf();
    for part in below.as_ref().components() {
        folder.push(part);
        match fs::create_dir(&folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
        let kind = fs::symlink_metadata(&folder)?.file_type();
        if kind.is_symlink() {
            let message = "is a symbolic link, or in one; nothing is written through links\n  help: remove it, or name \
                           another folder";
            return Err(io::Error::other(message));
        }
        if !kind.is_dir() {
            return Err(io::ErrorKind::NotADirectory.into());
        }
    }
    Ok(folder)
}

/// Whether a path, which need not exist, is in a folder, or leads through one of its links.
///
/// # Errors
/// If there is no such folder.
pub(super) fn leads_into(path: &Path, folder: &Path) -> io::Result<bool> {
    let (path, folder) = (std::path::absolute(path)?, scene::input::real_path(folder)?);
    let is_inside = |part: &Path| {
        // The part itself may be a link: only the folder that it is in is resolved.
        let parent = part.parent().filter(|_| part.file_name().is_some());
        let parent = parent.and_then(|parent| scene::input::real_path(parent).ok());
        parent.is_some_and(|parent| parent.starts_with(&folder))
    };
    let is_there = scene::input::real_path(&path).is_ok_and(|path| path.starts_with(&folder));
    Ok(is_there || path.ancestors().any(is_inside))
}

/// Writes to standard output, with colours if it is a terminal. A closed pipe is not an error.
///
/// # Errors
/// If writing fails, for example because the disk is full.
pub(super) fn print(bytes: &[u8]) -> Result<(), Stop> {
    write_out(terminal(anstream::stdout()), bytes)
}

/// Writes commands of ours to GitHub Actions to standard output.
///
/// # Errors
/// As [`print()`].
pub(super) fn print_commands(commands: &str) -> Result<(), Stop> {
    write_out(io::stdout(), inert(commands).as_bytes())
}

fn write_out(mut out: impl Write, bytes: &[u8]) -> Result<(), Stop> {
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Stop::fault(format!("standard output: {error}; the report is incomplete")))
        }
        _ => Ok(()),
    }
}
