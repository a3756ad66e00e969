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

use crate::boundary::own_file::read_text;
use crate::boundary::seal::Seal;

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
    /// Time spent of the submission's budget, in seconds.
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
        if Self::read(folder, seal).is_none_or(|there| there.anew != self.anew) {
            match fs::remove_dir_all(folder) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            match fs::rename(runs.path(), folder) {
                Err(error) if !folder.is_dir() => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Content of a record's signature: the name of the `folder` it is published as, and those of the `runs` with it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unpublished_phase_leaves_no_files() {
        let results = tempfile::tempdir().unwrap();
        let seal = Seal::of(results.path()).unwrap();
        let phases = results.path().join("first-phase");
        fs::create_dir(&phases).unwrap();
        let phase = FirstPhase { anew: None, seconds: 1.0, spent: 0.5 };
        let publish = |folder: &Path| {
            let runs = Unfinished::new(&phases).unwrap();
            fs::write(runs.path().join("run"), "trace").unwrap();
            phase.publish(runs, folder, &seal)
        };
        let listed = || fs::read_dir(&phases).unwrap().count();
        assert!(publish(&results.path().join("no/such/folder")).is_err());
        assert_eq!(listed(), 0);
        let folder = phases.join("key");
        for _ in 0..2 {
            publish(&folder).unwrap();
            assert_eq!(FirstPhase::read(&folder, &seal).as_ref(), Some(&phase));
            assert_eq!(listed(), 1);
        }
        // Its record is signed with its name and those of the runs.
        fs::write(folder.join("more"), "trace").unwrap();
        assert_eq!(FirstPhase::read(&folder, &seal), None);
        fs::remove_file(folder.join("more")).unwrap();
        fs::rename(&folder, phases.join("other")).unwrap();
        assert_eq!(FirstPhase::read(&phases.join("other"), &seal), None);
    }
}
