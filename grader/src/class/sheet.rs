//! Tables that people fill in, as CSV: rosters and sheets of marks.

use std::path::{Path, PathBuf};

use csv::{ErrorKind, ReaderBuilder, StringRecord, Trim};

use crate::boundary::door::{Door, DoorError};
use crate::boundary::printed::RawUse;

/// A sheet that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// It cannot be read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: DoorError,
    },
    /// A line is wrong.
    #[error("{}:{line}: {message}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The fault and its remedy.
        message: String,
    },
}

/// A sheet: cells without space around them, separated by commas, semicolons or tabs.
pub(super) struct Sheet {
    path: PathBuf,
    /// The cells of the first line.
    pub(super) header: StringRecord,
    /// The other lines, as many cells each.
    pub(super) records: Vec<StringRecord>,
}

impl Sheet {
    /// Reads a sheet.
    pub(super) fn load(path: &Path) -> Result<Self, SheetError> {
        let text = Door::Sheet
            .text(path)
            .map_err(|source| SheetError::Unreadable { path: path.to_path_buf(), source })?;
        Self::parse(text.raw(RawUse::Parsing), path)
    }

    /// Parses a sheet. `path` is the file's name in messages.
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, SheetError> {
        // Two characters at the end of a line would shift the numbers of lines.
        let text = text.trim_start_matches('\u{feff}').replace("\r\n", "\n");
        let first = text.lines().next().unwrap_or_default();
        let count = |separator: &u8| first.bytes().filter(|byte| byte == separator).count();
        let separator = [b'\t', b';', b','].into_iter().max_by_key(count).unwrap_or(b',');
        let mut reader =
            ReaderBuilder::new().delimiter(separator).trim(Trim::All).from_reader(text.as_bytes());
        let malformed = |error: csv::Error| malformed(path, &error);
        let header = reader.headers().map_err(malformed)?.clone();
        let records = reader.records().collect::<Result<_, _>>().map_err(malformed)?;
        Ok(Self { path: path.to_path_buf(), header, records })
    }

    /// An error in this line.
    pub(super) fn wrong(&self, line: u64, message: impl Into<String>) -> SheetError {
        wrong(&self.path, line, message)
    }
}

/// The line of a record, from 1.
pub(super) fn line(record: &StringRecord) -> u64 {
    record.position().map_or(1, csv::Position::line)
}

/// An error in a line of a file.
pub(super) fn wrong(path: &Path, line: u64, message: impl Into<String>) -> SheetError {
    SheetError::Line { path: path.to_path_buf(), line, message: message.into() }
}

fn malformed(path: &Path, error: &csv::Error) -> SheetError {
    let line = error.position().map_or(1, csv::Position::line);
    let message = match error.kind() {
        ErrorKind::UnequalLengths { expected_len, len, .. } => format!(
            "{len} cells, but the first line has {expected_len}\n  help: put a cell with a separator in it into \
             \"quotes\""
        ),
        _ => error.to_string(),
    };
    wrong(path, line, message)
}
