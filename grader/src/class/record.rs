//! Record of a graded submission, which lets a later run skip it.
//!
//! `resume/NAME.json` is written after all reports of the submission. It is valid as long as the fingerprint of the
//! inputs is the same and the report files are unchanged.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Row;
use crate::suite::{hash_file, read_text};

/// Maximum size of a record, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// A record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// The fingerprint of the reports' inputs.
    pub fingerprint: String,
    /// The table row.
    pub row: Row,
    /// SHA-256 of each report file.
    pub reports: BTreeMap<String, String>,
}

impl Record {
    /// Reads the record at `path`. Returns `None` unless it has this fingerprint, the reports in `folder` are those it
    /// was written with, and everything was judged.
    pub fn read(path: &Path, fingerprint: &str, folder: &Path) -> Option<Self> {
        // `grade` writes neither links nor pipes.
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

    /// JSON text with a final newline.
    ///
    /// # Errors
    /// Never in practice.
    pub fn render(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
