//! Record of a graded submission: its row of the table, and what later runs need to know.
//!
//! `resume/NAME.json` is written after all reports of the submission. It is valid as long as the fingerprint of the
//! inputs is the same and the report files are unchanged.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use sandbox::Protection;
use serde::{Deserialize, Serialize};

use super::Row;
use crate::suite::{hash_file, read_text};

/// Maximum size of a record, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// A record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// The fingerprint of the reports' inputs.
    pub fingerprint: String,
    /// The plan that graded anew, whatever results there were; `None` if it kept them.
    pub anew: Option<String>,
    /// The table row.
    pub row: Row,
    /// SHA-256 of each report file.
    pub reports: BTreeMap<String, String>,
    /// The protections under which its program ran; `None` if nothing ran.
    pub protection: Option<Vec<Protection>>,
    /// Time that grading took, in seconds.
    pub seconds: f64,
}

impl Record {
    /// Reads the record at `path`. Returns `None` unless it has this fingerprint, and the reports in `folder` are those
    /// it was written with.
    pub fn read(path: &Path, fingerprint: &str, folder: &Path) -> Option<Self> {
        let record = Self::load(path)?;
        let is_there = |(file, hash): (&String, &String)| {
            let path = folder.join(file);
            is_file(&path) && hash_file(&path).is_ok_and(|found| found == *hash)
        };
        (record.fingerprint == fingerprint && record.reports.iter().all(is_there)).then_some(record)
    }

    /// Reads the record at `path`, whatever it was made from.
    pub fn load(path: &Path) -> Option<Self> {
        let text = is_file(path).then(|| read_text(path, MAX_MEBIBYTES).ok()).flatten()?;
        serde_json::from_str(&text).ok()
    }

    /// JSON text with a final newline.
    ///
    /// # Errors
    /// Never in practice.
    pub fn render(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// Whether it is a regular file: `grade` writes neither links nor pipes.
fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_file())
}
