//! Layouts of class folders: how platforms lay out the hand-ins that a teacher downloads.
//!
//! ```text
//! folder ─> layout, recognised or named ─> hand-ins and whose they are ─> copied, a folder each ─> entry.rs
//!             canvas.rs, gradescope.rs, moodle.rs, github.rs                     arrange.rs
//! ```
//!
//! | layout | entries of the folder |
//! | --- | --- |
//! | flat | one a hand-in: a folder, a program or an archive |
//! | canvas | files `lastfirst_LATE_USER_FILE_name.ext`, several a student; `LATE` only if it is |
//! | gradescope | folders `submission_N`, and `submission_metadata.yml`, which says whose they are |
//! | moodle | `First Last_N_assignsubmission_file_`: folders, or files with their name at the end |
//! | github | clones `ASSIGNMENT-LOGIN`, each with `.git` |
//!
//! The content of a folder has the layout that more of its entries fit than not. Links and the like do not count. If all lies in
//! one folder in it, that folder is meant. Students choose the names of their files, and not what stands before them.

mod arrange;
mod canvas;
mod github;
mod gradescope;
mod moodle;

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use self::arrange::{Arranged, HandInFacts, Person, assign, table};
pub use self::gradescope::parse as parse_export;
use super::entry::PassedOver;
use crate::boundary::door::DoorError;
use crate::boundary::printed;
use crate::submission::hand_in::HandInError;
use crate::submission::received::is_left_behind;

/// A layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// One entry a hand-in.
    Flat,
    /// Canvas's download of all submissions.
    Canvas,
    /// Gradescope's export of submissions.
    Gradescope,
    /// Moodle's download of all submissions.
    Moodle,
    /// Clones of GitHub repositories.
    Github,
}

/// A class folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LayoutError {
    /// A file or folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file of a platform does not come through its door.
    #[error("{}: {error}", path.display())]
    Closed {
        /// The file.
        path: PathBuf,
        /// Why.
        error: DoorError,
    },
    /// The file of a platform says nothing that can be understood.
    #[error("{}:{line}: {message}\n  help: download it again, or grade with --layout flat", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Description of the mistake.
        message: String,
    },
    /// Nothing in it has the layout that was named.
    #[error(
        "{}: nothing in it has the layout {}\n  help: leave out --layout, or name another one: flat, canvas, gradescope, moodle \
         or github",
        path.display(),
        layout.name()
    )]
    Nothing {
        /// The folder.
        path: PathBuf,
        /// The layout.
        layout: Layout,
    },
    /// The machine cannot copy a hand-in.
    #[error("{}: {source}", path.display())]
    NotCopied {
        /// The hand-in.
        path: PathBuf,
        /// Why.
        source: HandInError,
    },
}

/// The entries of a class folder, by name, without junk.
struct ClassFolder {
    path: PathBuf,
    entries: Vec<FolderEntry>,
    /// Links, pipes and such.
    refused: Vec<PassedOver>,
}

/// A file or folder.
struct FolderEntry {
    file_name: OsString,
    /// The same as text.
    name: String,
    is_folder: bool,
}

/// A file or folder that belongs to a hand-in.
struct Part {
    from: OsString,
    /// Its name in the folder of the hand-in; empty if it is the hand-in.
    to: String,
}

/// A hand-in and its files.
struct HandInParts {
    facts: HandInFacts,
    parts: Vec<Part>,
}

/// A folder in a layout.
struct Reading {
    hand_ins: Vec<HandInParts>,
    /// Entries that do not fit.
    rest: Vec<PassedOver>,
}

impl Layout {
    /// All layouts. Those that ask for more come first.
    pub const ALL: [Self; 5] =
        [Self::Gradescope, Self::Moodle, Self::Canvas, Self::Github, Self::Flat];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Canvas => "canvas",
            Self::Gradescope => "gradescope",
            Self::Moodle => "moodle",
            Self::Github => "github",
        }
    }

    /// Its description in messages.
    pub fn title(self) -> &'static str {
        match self {
            Self::Flat => "one entry a student",
            Self::Canvas => "Canvas's download",
            Self::Gradescope => "Gradescope's export",
            Self::Moodle => "Moodle's download",
            Self::Github => "clones from GitHub",
        }
    }

    /// Reads a folder in this layout, which a person named, or which is to be recognised.
    fn read(self, folder: &ClassFolder, is_named: bool) -> Result<Reading, LayoutError> {
        let mut reading = match self {
            Self::Flat => Reading { hand_ins: folder.each(), rest: Vec::new() },
            Self::Canvas => canvas::read(folder),
            Self::Gradescope => gradescope::read(folder, is_named)?,
            Self::Moodle => moodle::read(folder),
            Self::Github => github::read(folder, is_named),
        };
        reading.rest.extend(folder.refused.iter().cloned());
        Ok(reading)
    }
}

impl ClassFolder {
    fn open(path: &Path) -> Result<Self, LayoutError> {
        let failed = |source| LayoutError::Io { path: path.to_path_buf(), source };
        let (mut entries, mut refused) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(path).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let (file_name, kind) = (entry.file_name(), entry.file_type().map_err(failed)?);
            let name = printed::text(&file_name.to_string_lossy());
            match () {
                () if is_left_behind(file_name.as_encoded_bytes()) => {}
                () if kind.is_dir() || kind.is_file() => {
                    entries.push(FolderEntry { file_name, name, is_folder: kind.is_dir() });
                }
                () => {
                    let reason = "it is a link, or neither a file nor a folder".to_owned();
                    refused.push(PassedOver { name, reason });
                }
            }
        }
        entries.sort_by(|a, b| a.file_name.cmp(&b.file_name));
        refused.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self { path: path.to_path_buf(), entries, refused })
    }

    /// Every entry as a separate hand-in.
    fn each(&self) -> Vec<HandInParts> {
        self.entries.iter().map(|entry| HandInParts::new(&entry.name, entry.whole())).collect()
    }

    /// Reads the folder in the layout that most entries fit.
    fn recognise(&self) -> Result<(Layout, Reading), LayoutError> {
        for layout in Layout::ALL {
            let reading = layout.read(self, false)?;
            let fitting: usize = reading.hand_ins.iter().map(|found| found.parts.len()).sum();
            let is_entry = |name: &str| self.entries.iter().any(|entry| entry.name == name);
            let others = reading.rest.iter().filter(|other| is_entry(&other.name)).count();
            if layout == Layout::Flat || fitting > others {
                return Ok((layout, reading));
            }
        }
        Ok((Layout::Flat, Layout::Flat.read(self, false)?))
    }
}

impl FolderEntry {
    /// The entry as the hand-in.
    fn whole(&self) -> Vec<Part> {
        vec![Part { from: self.file_name.clone(), to: String::new() }]
    }

    fn passed_over(&self, reason: &str) -> PassedOver {
        PassedOver { name: self.name.clone(), reason: reason.to_owned() }
    }
}

impl HandInParts {
    /// A hand-in in a folder of this name, if it is free.
    fn new(name: &str, parts: Vec<Part>) -> Self {
        Self { facts: HandInFacts { folder: name.to_owned(), ..HandInFacts::default() }, parts }
    }
}

/// Reads a class folder in its layout, or in the one that is named. Returns the folder that holds the entries, which may be in
/// the one that is named.
fn read(
    path: &Path,
    named: Option<Layout>,
    is_unpacked: bool,
) -> Result<(ClassFolder, Layout, Reading), LayoutError> {
    let outer = ClassFolder::open(path)?;
    let inner = match &outer.entries[..] {
        [only] if only.is_folder => Some(ClassFolder::open(&path.join(&only.file_name))?),
        _ => None,
    };
    if let Some(layout) = named {
        for folder in [Some(outer), inner].into_iter().flatten() {
            let reading = layout.read(&folder, true)?;
            if !reading.hand_ins.is_empty() {
                return Ok((folder, layout, reading));
            }
        }
        return Err(LayoutError::Nothing { path: path.to_path_buf(), layout });
    }
    let (layout, reading) = outer.recognise()?;
    if let Some(inner) = inner.filter(|_| layout == Layout::Flat) {
        let (layout, reading) = inner.recognise()?;
        // An archive of the class often holds its folder.
        let is_class = inner.entries.len() > 1 && inner.entries.iter().all(|entry| entry.is_folder);
        if layout != Layout::Flat || is_unpacked && is_class {
            return Ok((inner, layout, reading));
        }
    }
    Ok((outer, layout, reading))
}
