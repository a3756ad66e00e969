//! What is kept of a submission that was graded, so that it need not be graded again.
//!
//! `resume/NAME.json` is written last of all that is written of a submission. What it says holds as long as what the
//! reports came of is the same, and the reports are the ones that were written.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Row;
use crate::suite::{hash_file, read_text};

/// The largest record that is read, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// A record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// The fingerprint of what the reports came of.
    pub fingerprint: String,
    /// The row.
    pub row: Row,
    /// The reports' files, with the SHA-256 of each.
    pub reports: BTreeMap<String, String>,
}

impl Record {
    /// Reads the record at `path`, if it is of this fingerprint, the reports in `folder` are those it was written
    /// with, and nothing was left unjudged.
    pub fn read(path: &Path, fingerprint: &str, folder: &Path) -> Option<Self> {
        // Neither a link nor a pipe was written by `grade`.
        let is_file = |path: &Path| fs::symlink_metadata(path).is_ok_and(|found| found.is_file());
        if !is_file(path) {
            return None;
        }
        let record: Self = serde_json::from_str(&read_text(path, MAX_MEBIBYTES).ok()?).ok()?;
        let is_there = |(file, hash): (&String, &String)| {
            let path = folder.join(file);
            is_file(&path) && hash_file(&path).is_ok_and(|found| found == *hash)
        };
        let holds = record.fingerprint == fingerprint
            && !record.row.is_fault()
            && record.reports.iter().all(is_there);
        holds.then_some(record)
    }

    /// As text, with a newline at its end.
    ///
    /// # Errors
    /// Never in practice.
    pub fn render(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
