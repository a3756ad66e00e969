//! Record of a graded submission: its row of the table, and what later runs need to know.
//!
//! `resume/NAME.json` is written after all reports of the submission. It is valid as long as the fingerprint of the
//! inputs is the same and the report files are unchanged. It is signed with the key of the class: a record that was edited,
//! or belongs to another submission or class, does not count.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use sandbox::Protection;
use serde::{Deserialize, Serialize};

use super::Row;
use crate::boundary::door::{Door, DoorError};
use crate::boundary::printed::{RawUse, Untrusted};
use crate::boundary::seal::Seal;
use crate::suite::hash_file;

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
    /// The row of the record in whose place this one is; `None` for the first.
    pub before: Option<Row>,
    /// The folder of the class's pages, if the submission has pages in it.
    pub pages: Option<PathBuf>,
}

/// A file that is no record of this class: edited, or from elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Foreign;

impl Record {
    /// Reads the record of this name at `path`; `None` if there is none.
    ///
    /// # Errors
    /// If the file is not one that this class wrote.
    pub fn load(path: &Path, name: &str, seal: &Seal) -> Result<Option<Self>, Foreign> {
        match Door::Record.text(path) {
            Ok(text) => Self::parse(&text, name, seal).map(Some),
            Err(DoorError::Unreadable(error)) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(_) => Err(Foreign),
        }
    }

    /// Parses the record of this name.
    ///
    /// # Errors
    /// If it is not one that this class wrote.
    pub fn parse(text: &Untrusted, name: &str, seal: &Seal) -> Result<Self, Foreign> {
        let record = seal.unwrap(name, text.raw(RawUse::Parsing)).ok_or(Foreign)?;
        serde_json::from_str(record).map_err(|_| Foreign)
    }

    /// Whether it has this fingerprint, and the reports in `folder` are those it was written with.
    pub fn is_of(&self, fingerprint: &str, folder: &Path) -> bool {
        let is_there = |(file, hash): (&String, &String)| {
            let path = folder.join(file);
            is_file(&path) && hash_file(&path).is_ok_and(|found| found == *hash)
        };
        self.fingerprint == fingerprint && self.reports.iter().all(is_there)
    }

    /// Signed JSON text with a final newline.
    ///
    /// # Errors
    /// Never in practice.
    pub fn render(&self, name: &str, seal: &Seal) -> serde_json::Result<String> {
        Ok(seal.wrap(name, &serde_json::to_string_pretty(self)?))
    }
}

/// Whether it is a regular file: `grade` writes neither links nor pipes.
fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edited_or_foreign_record_does_not_count() {
        let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let [seal, other] = folders.each_ref().map(|folder| Seal::of(folder.path()).unwrap());
        let row = serde_json::json!({
            "name": "eve", "verdict": "failed", "required": ["0", "20"], "extra_credit": ["0", "0"],
            "creative": null, "points": "0", "earned": "0", "adjustments": [], "features": {},
            "not_judged": "0", "scenes": [0, 3], "hidden": null, "jacobians": null, "copied": null, "findings": [],
        });
        let record = Record {
            fingerprint: "key".to_owned(),
            anew: None,
            row: serde_json::from_value(row).unwrap(),
            reports: BTreeMap::new(),
            protection: None,
            seconds: 0.123_456_789_012_345_67,
            before: None,
            pages: None,
        };
        let text = record.render("eve", &seal).unwrap();
        let parse = |text: &str, name, seal| Record::parse(&text.into(), name, seal);
        assert_eq!(parse(&text, "eve", &seal).as_ref(), Ok(&record));
        let _: serde_json::Value = serde_json::from_str(&text).unwrap();
        for edited in
            [text.replace("\"0\"", "\"20\""), text.replace("hmac", "mac"), text[1..].to_owned()]
        {
            assert_eq!(parse(&edited, "eve", &seal), Err(Foreign), "{edited}");
        }
        assert_eq!(parse(&text, "bob", &seal), Err(Foreign));
        assert_eq!(parse(&text, "eve", &other), Err(Foreign));
    }
}
