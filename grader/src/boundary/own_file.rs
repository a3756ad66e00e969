//! Files of the teacher and of this project, read whole. Files of students come through [`door`](crate::boundary::door) alone.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

/// A file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum OwnFileError {
    /// The file or folder cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is not valid.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The fault.
        message: String,
    },
}

/// A TOML document, and the path that messages name.
#[derive(Clone, Copy)]
pub(crate) struct Toml<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
}

impl Toml<'_> {
    /// Its content.
    pub(crate) fn parse<T: DeserializeOwned>(self) -> Result<T, OwnFileError> {
        toml::from_str(self.text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            self.invalid(start, error.message().to_owned())
        })
    }

    /// A fault at a byte of the text.
    pub(crate) fn invalid(self, start: usize, message: String) -> OwnFileError {
        let (line, column) = line_and_column(self.text, start);
        OwnFileError::Invalid { path: self.path.to_path_buf(), line, column, message }
    }
}

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

/// Line and column of a byte of a text, both from 1; columns count characters.
pub(crate) fn line_and_column(text: &str, start: usize) -> (usize, usize) {
    let before = text.get(..start).unwrap_or(text);
    let column = before.chars().rev().take_while(|character| *character != '\n').count() + 1;
    (before.matches('\n').count() + 1, column)
}
