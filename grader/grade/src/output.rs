//! Output of reports to files and to standard output.

use std::io::{self, Write};
use std::path::Path;

use simulator::output::OutputFile;

use crate::stop::Stop;

/// Writes a report to a file, or to the standard output.
pub(super) fn put(bytes: &[u8], output: Option<&Path>) -> Result<(), Stop> {
    match output {
        None => print(bytes),
        Some(path) => write_file(path, bytes)
            .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display()))),
    }
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

/// Writes to standard output, with colours if it is a terminal. A closed pipe is not an error.
///
/// # Errors
/// If writing fails, for example because the disk is full.
pub(super) fn print(bytes: &[u8]) -> Result<(), Stop> {
    let mut out = anstream::stdout();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Stop::fault(format!("standard output: {error}; the report is incomplete")))
        }
        _ => Ok(()),
    }
}
