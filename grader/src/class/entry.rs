//! The submissions of a folder.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::submission::printed::steers;
use crate::suite::hash_bytes;

/// The longest name, in bytes, that a report's name is made of.
const LONGEST: usize = 200;

/// A file or folder that is graded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// What it is called in the folder.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
}

/// Something in the folder that is no submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PassedOver {
    /// What it is called.
    pub name: String,
    /// Why it is none.
    pub reason: &'static str,
}

impl Entry {
    /// The name of its report, without the extension of its format.
    pub fn report(&self) -> String {
        match self.name.len() {
            ..=LONGEST => self.name.clone(),
            _ => hash_bytes(self.name.as_bytes()),
        }
    }
}

/// The submissions of a folder, by name, and what else there is. Hidden files are not told of.
///
/// # Errors
/// Where the folder cannot be read.
pub fn list(folder: &Path) -> io::Result<(Vec<Entry>, Vec<PassedOver>)> {
    let mut found: Vec<(OsString, PathBuf)> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        found.push((entry.file_name(), entry.path()));
    }
    found.sort();
    let (mut entries, mut others) = (Vec::new(), Vec::new());
    for (file_name, path) in found {
        let name = file_name.to_str().filter(|name| !name.chars().any(steers));
        match (name, refusal(&path)?) {
            (Some(name), _) if name.starts_with('.') => {}
            (Some(name), None) => entries.push(Entry { name: name.to_owned(), path }),
            (Some(name), Some(reason)) => others.push(PassedOver { name: name.to_owned(), reason }),
            (None, _) => others.push(PassedOver {
                // As an escaped literal.
                name: format!("{file_name:?}"),
                reason: "its name cannot be shown",
            }),
        }
    }
    Ok((entries, others))
}

/// Why it cannot be graded.
fn refusal(path: &Path) -> io::Result<Option<&'static str>> {
    // It does not follow links.
    let metadata = fs::symlink_metadata(path)?;
    let kind = metadata.file_type();
    Ok(match () {
        // It may lead to the oracle, or to another's submission.
        () if kind.is_symlink() => Some("it is a link"),
        () if kind.is_dir() => None,
        () if !kind.is_file() => Some("it is neither a file nor a folder"),
        () if !is_executable(&metadata) => Some("it is no program: it may not be executed"),
        () => None,
    })
}

#[cfg(unix)]
pub(super) fn is_executable(metadata: &fs::Metadata) -> bool {
    std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o111 != 0
}

#[cfg(not(unix))]
pub(super) fn is_executable(_metadata: &fs::Metadata) -> bool {
    true
}
