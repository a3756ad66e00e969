//! Opens input files, and resolves paths. Only regular files are opened: opening a named pipe could block forever.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Opens a regular file for reading, following links.
///
/// # Errors
/// If it cannot be opened, or is a folder, a pipe, a socket or a device.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    if kind.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !kind.is_file() {
        return Err(io::Error::other("it is a pipe, a socket or a device, and not a regular file"));
    }
    File::open(path)
}

/// The absolute path of an existing file or folder, without links.
///
/// # Errors
/// If there is none, or it cannot be reached.
pub fn real_path(path: &Path) -> io::Result<PathBuf> {
    // A page of a browser has files in memory, without links.
    if cfg!(target_family = "wasm") {
        fs::metadata(path)?;
        return std::path::absolute(path);
    }
    let real = fs::canonicalize(path)?;
    if cfg!(windows) {
        // The form `\\?\C:\…`, which many programs do not take.
        let short = real.to_str().and_then(|text| text.strip_prefix(r"\\?\"));
        if let Some(short) = short.filter(|short| short.as_bytes().get(1) == Some(&b':')) {
            return Ok(PathBuf::from(short));
        }
    }
    Ok(real)
}
