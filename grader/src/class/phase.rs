//! First phase of a submission: its shipped scenes, without the hidden ones.
//!
//! In a class with hidden scenes, those of all submissions run after the shipped scenes of all, so that no program can
//! tell a hidden scene to one whose output is shown later. The first phase keeps how each run ended. The second one
//! grades again from these ends, runs the hidden scenes, and writes the result.
//!
//! ```text
//! first-phase/KEY/KEY.HASH, …    the runs        submission/kept.rs
//! first-phase/KEY/phase.json     this record     KEY: that of the submission in the plan
//! ```
//!
//! The folder gets its name when it is complete.

use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use tempfile::TempDir;

use super::seal::Seal;
use crate::boundary::own_file::read_text;

/// The record's file name.
const NAME: &str = "phase.json";

/// Maximum size of a record, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// The folder of a first phase that is not complete. It is removed unless it is published.
#[derive(Debug)]
pub struct Unfinished(TempDir);

impl Unfinished {
    /// An empty one below this folder.
    ///
    /// # Errors
    /// If it cannot be created.
    pub fn new(folder: &Path) -> io::Result<Self> {
        Ok(Self(tempfile::Builder::new().prefix(".").tempdir_in(folder)?))
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// The record of a first phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FirstPhase {
    /// The plan that graded anew, whatever results there were; `None` if it kept them.
    pub anew: Option<String>,
    /// Time that it took, in seconds.
    pub seconds: f64,
    /// What the submission spent of its budget, in seconds.
    pub spent: f64,
}

impl FirstPhase {
    /// Reads the record in the folder of a first phase; `None` if there is none of this class.
    ///
    /// The record is signed with the names of the runs, which hold hashes of what is in them.
    pub fn read(folder: &Path, seal: &Seal) -> Option<Self> {
        let text = read_text(&folder.join(NAME), MAX_MEBIBYTES).ok()?;
        serde_json::from_str(seal.unwrap(&signed_name(folder, folder).ok()?, &text)?).ok()
    }

    /// Puts the record into the folder of the runs, and the folder in its place. If another process was faster, its folder
    /// stays.
    ///
    /// # Errors
    /// If that cannot be done.
    pub fn publish(&self, runs: Unfinished, folder: &Path, seal: &Seal) -> io::Result<()> {
        let record = serde_json::to_string_pretty(self)?;
        let record = seal.wrap(&signed_name(runs.path(), folder)?, &record);
        fs::write(runs.path().join(NAME), record)?;
        let runs = runs.0.keep();
        if Self::read(folder, seal).is_none_or(|there| there.anew != self.anew) {
            match fs::remove_dir_all(folder) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            match fs::rename(&runs, folder) {
                Err(_) if folder.is_dir() => {}
                renamed => return renamed,
            }
        }
        fs::remove_dir_all(runs)
    }
}

/// What a record is signed with: the name of the `folder` it is published as, and those of the `runs` beside it.
fn signed_name(runs: &Path, folder: &Path) -> io::Result<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(runs)? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.retain(|name| name != NAME);
    names.sort_unstable();
    let folder = folder.file_name().unwrap_or_default().to_string_lossy();
    // No report has a line end in its name.
    Ok(format!("phase\n{folder} {}", names.join(" ")))
}
