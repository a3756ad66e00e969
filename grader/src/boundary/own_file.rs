//! Files of the teacher and of this project, read whole. Files of students come through [`door`](crate::boundary::door) alone.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// The bytes of a file.
///
/// # Errors
/// If it cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    fs::read(path)
}

/// The first bytes of a file, at most so many.
///
/// # Errors
/// If it cannot be read.
pub fn head(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(most).read_to_end(&mut head)?;
    Ok(head)
}

/// The text of a file.
///
/// # Errors
/// If it cannot be read, or is not UTF-8.
pub fn text(path: &Path) -> io::Result<String> {
    fs::read_to_string(path)
}

/// The text of a file of at most `limit` MiB. Stops reading a larger file at the limit.
///
/// # Errors
/// If it cannot be read, is larger, or is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    let limit_in_bytes = limit << 20;
    File::open(path)?.take(limit_in_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit_in_bytes {
        let message = format!("it is larger than {limit} MiB");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
