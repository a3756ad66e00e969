//! Files that are read: regular ones, since a named pipe would be waited for without end.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Opens a regular file, or one behind links, for reading.
///
/// # Errors
/// Where it cannot be opened, or is a folder, a pipe, a socket or a device.
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
