//! Output of reports to files and to the terminal.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use grader::printed::steers;
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
    let (path, folder) = (std::path::absolute(path)?, fs::canonicalize(folder)?);
    let is_inside = |part: &Path| {
        // The part itself may be a link: only the folder that it is in is resolved.
        let parent = part.parent().filter(|_| part.file_name().is_some());
        let parent = parent.and_then(|parent| fs::canonicalize(parent).ok());
        parent.is_some_and(|parent| parent.starts_with(&folder))
    };
    let is_there = fs::canonicalize(&path).is_ok_and(|path| path.starts_with(&folder));
    Ok(is_there || path.ancestors().any(is_inside))
}

/// Writes to standard output, with colours if it is a terminal. A closed pipe is not an error.
///
/// # Errors
/// If writing fails, for example because the disk is full.
pub(super) fn print(bytes: &[u8]) -> Result<(), Stop> {
    let mut out = terminal(anstream::stdout());
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Stop::fault(format!("standard output: {error}; the report is incomplete")))
        }
        _ => Ok(()),
    }
}

/// The styles of reports: end, bold, dimmed, red, green, yellow.
const STYLES: [&str; 6] =
    ["\u{1b}[0m", "\u{1b}[1m", "\u{1b}[2m", "\u{1b}[31m", "\u{1b}[32m", "\u{1b}[33m"];

/// A stream that may be a terminal. Everything that this program prints passes through it, and it steers no terminal.
pub(super) struct Terminal<W: Write> {
    stream: W,
    /// Written, but not yet shown: a sequence may come in parts.
    held: Vec<u8>,
}

/// Output to this stream.
pub(super) fn terminal<W: Write>(stream: W) -> Terminal<W> {
    Terminal { stream, held: Vec::new() }
}

impl<W: Write> Write for Terminal<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.held.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let shown = inert(&String::from_utf8_lossy(&std::mem::take(&mut self.held)));
        self.stream.write_all(shown.as_bytes())?;
        self.stream.flush()
    }
}

impl<W: Write> Drop for Terminal<W> {
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// The text without characters that steer a terminal, except ends of lines and the styles of reports. Text of students
/// is inert before; this is the second layer.
pub(super) fn inert(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(character) = rest.chars().next() {
        let style = STYLES.into_iter().find(|style| rest.starts_with(style));
        let (part, after) = rest.split_at(style.map_or(character.len_utf8(), str::len));
        if style.is_some() || character == '\n' || !steers(character) {
            shown += part;
        }
        rest = after;
    }
    shown
}

#[cfg(test)]
mod tests {
    use report::table::{BAD, BOLD, DIM, GOOD, ODD};

    use super::*;

    #[test]
    fn a_terminal_gets_styles_and_no_other_control() {
        for style in [BAD, BOLD, DIM, GOOD, ODD] {
            let styled = format!("{style}a{style:#}\n");
            assert_eq!(inert(&styled), styled);
        }
        let eve = "\u{1b}[2J\u{1b}]0;x\u{7}\u{1b}[8mb\r\u{9b}31m\u{202e}c\u{1b}";
        assert_eq!(inert(eve), "[2J]0;x[8mb31mc");
        let mut stream = Vec::new();
        let mut out = terminal(&mut stream);
        for part in ["\u{1b}", "[1ma\u{1b}", "[2", "J"] {
            out.write_all(part.as_bytes()).unwrap();
        }
        drop(out);
        assert_eq!(stream, "\u{1b}[1ma[2J".as_bytes());
    }
}
