//! Lists the submissions of a folder.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sandbox::files::is_executable;
use serde::{Deserialize, Serialize};

use crate::boundary::printed::steers;
use crate::submission::received::{Form, is_left_behind};
use crate::suite::hash_bytes;

/// Longest name, in bytes, that is used unchanged as a report's name.
const LONGEST: usize = 100;

/// Number of characters of a name that are kept in front of its hash.
const PREFIX: usize = 40;

/// Names that some systems reserve, with any extension: <https://learn.microsoft.com/windows/win32/fileio/naming-a-file>.
const RESERVED: [&str; 6] = ["con", "prn", "aux", "nul", "com", "lpt"];

/// Number of hexadecimal digits of the hash: enough to make collisions infeasible.
const HASH: usize = 32;

/// A file or folder that is graded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClassEntry {
    /// Its name in the folder.
    pub name: String,
    /// Its path.
    pub path: PathBuf,
    /// The name of its report, without extension. Unique among all entries on any file system.
    pub report: String,
}

/// An entry of the folder that is not a submission.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassedOver {
    /// Its name.
    pub name: String,
    /// Why it is skipped.
    pub reason: String,
}

/// The submissions of a folder, sorted by name, and the entries that are skipped. With a pack, any file is a submission.
/// Files that systems leave behind are neither.
///
/// # Errors
/// If the folder cannot be read.
pub fn list(folder: &Path, has_pack: bool) -> io::Result<(Vec<ClassEntry>, Vec<PassedOver>)> {
    let mut found: Vec<(OsString, PathBuf)> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if !is_left_behind(entry.file_name().as_encoded_bytes()) {
            found.push((entry.file_name(), entry.path()));
        }
    }
    found.sort();
    let (mut entries, mut others) = (Vec::new(), Vec::new());
    for (file_name, path) in found {
        let name = file_name.to_str().filter(|name| !name.chars().any(steers));
        match (name, refusal(&path, has_pack)) {
            (Some(name), None) if !name.starts_with('.') => {
                entries.push(ClassEntry { name: name.to_owned(), path, report: String::new() });
            }
            (Some(name), refusal) => {
                let reason = refusal.filter(|_| !name.starts_with('.'));
                let reason = reason.unwrap_or("its name begins with a dot").to_owned();
                others.push(PassedOver { name: name.to_owned(), reason });
            }
            (None, _) => others.push(PassedOver {
                // Shown as an escaped literal.
                name: format!("{file_name:?}"),
                reason: "its name contains control characters or is not UTF-8".to_owned(),
            }),
        }
    }
    let mut spellings: BTreeMap<String, usize> = BTreeMap::new();
    for entry in &entries {
        *spellings.entry(entry.name.to_ascii_lowercase()).or_default() += 1;
    }
    for entry in &mut entries {
        let is_alone = spellings.get(&entry.name.to_ascii_lowercase()) == Some(&1);
        entry.report = report_name(&entry.name, is_alone);
    }
    Ok((entries, others))
}

/// A report's name. A name that every file system stores unchanged is kept, unless a system reserves it, or it differs
/// from another one by case only. Any other name is reduced to such characters and gets `~` and a hash; kept names contain no `~`.
fn report_name(name: &str, is_alone: bool) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || " _-.,".contains(c);
    let is_kept = is_alone
        && name.len() <= LONGEST
        && name.chars().all(is_plain)
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && !name.ends_with([' ', '.'])
        && !is_reserved(name);
    if is_kept {
        return name.to_owned();
    }
    let plain = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let prefix: String = plain.take(PREFIX).collect();
    format!("{prefix}~{}", &hash_bytes(name.as_bytes())[..HASH])
}

/// Whether it is `con`, `aux.txt`, `com1`, ….
fn is_reserved(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).trim_end().to_ascii_lowercase();
    RESERVED.contains(&stem.trim_end_matches(|c: char| c.is_ascii_digit()))
}

/// Why an entry cannot be graded. With a pack, any file can be a hand-in.
fn refusal(path: &Path, has_pack: bool) -> Option<&'static str> {
    // It does not follow links.
    let Ok(metadata) = fs::symlink_metadata(path) else { return Some("it cannot be read") };
    let kind = metadata.file_type();
    match () {
        // A link could lead to the oracle or to another submission.
        () if kind.is_symlink() => Some("it is a link"),
        () if kind.is_dir() => None,
        () if !kind.is_file() => Some("it is neither a file nor a folder"),
        () if has_pack || is_executable(path, &metadata) => None,
        () => match Form::of(path) {
            Ok(Form::Archive | Form::Foreign(_)) => None,
            Ok(Form::Program) => Some("it is not executable"),
            _ => Some("it is neither a program nor an archive"),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_submissions_share_a_report() {
        let folder = tempfile::tempdir().unwrap();
        let long = "x".repeat(201);
        let hashed = report_name("é", true);
        let mut names = vec![
            "ada",
            "bob",
            "Bob",
            "BOB.txt",
            "a",
            "a.txt",
            "a.",
            "a ",
            "e\u{301}",
            "é",
            "É",
            "-rf",
            "=ada",
            "Lovelace, Ada_12",
            "a b",
            "a_b",
            "con",
            "Aux.txt",
            "com1",
            "concert",
            &hashed,
            &long,
            &long[1..],
        ];
        let of_long = hash_bytes(long.as_bytes());
        names.push(&of_long);
        for name in &names {
            fs::create_dir(folder.path().join(name)).unwrap();
        }
        fs::create_dir(folder.path().join(".ada")).unwrap();
        let (entries, others) = list(folder.path(), false).unwrap();
        assert_eq!(
            others,
            [PassedOver {
                name: ".ada".to_owned(),
                reason: "its name begins with a dot".to_owned()
            }]
        );
        assert_eq!(entries.len(), names.len());
        let reports: BTreeSet<String> =
            entries.iter().map(|entry| entry.report.to_lowercase()).collect();
        assert_eq!(reports.len(), names.len(), "{reports:?}");
        for ClassEntry { name, report, .. } in &entries {
            let stays = [
                "ada",
                "a",
                "a.txt",
                "BOB.txt",
                "Lovelace, Ada_12",
                "a b",
                "a_b",
                "concert",
                &of_long,
            ];
            assert_eq!(report == name, stays.contains(&name.as_str()), "{name:?}: {report:?}");
            assert!(report.is_ascii() && report.len() <= LONGEST, "{report:?}");
        }
        assert!(reports.iter().any(|report| report.starts_with("bob~")));
    }
}
