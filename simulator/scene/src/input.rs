//! Opens input files. Only regular files: opening a named pipe could block forever.

use std::fs::{self, File};
use std::io;
use std::path::Path;

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
