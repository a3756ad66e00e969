//! Fingerprint of everything that a report depends on: the same fingerprint means the same report.
//!
//! ```text
//! SHA-256 ( the grader · how programs are run · rubric · scenes · traces ) + SHA-256 ( the submission's files )
//! ```

use std::io;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::boundary::seal::hexadecimal;
use crate::grading::hidden::HiddenSuite;
use crate::oracle::Oracle;
use crate::submission::hand_in::{HandIn, HandInError, WalkStep};
use crate::suite::{Case, Suite, hash_file};

/// A hash of several parts. Each part is preceded by its length, so that different lists of parts differ in the hash.
#[derive(Debug, Clone, Default)]
pub struct Fingerprint(Sha256);

impl Fingerprint {
    /// The fingerprint of this program.
    ///
    /// # Errors
    /// If its own file cannot be read.
    pub fn of_grader() -> io::Result<Self> {
        let mut own = Self::default();
        own.part(env!("CARGO_PKG_VERSION").as_bytes());
        own.part(hash_file(&std::env::current_exe()?)?.as_bytes());
        Ok(own)
    }

    /// Adds a part.
    pub fn part(&mut self, bytes: &[u8]) {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// Adds the content of a file.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn file(&mut self, path: &Path) -> io::Result<()> {
        // By its own hash: its length is not known beforehand.
        self.part(hash_file(path)?.as_bytes());
        Ok(())
    }

    /// Adds the scenes, their traces and envelopes. A missing or invalid trace counts as a part as well.
    pub fn suite(&mut self, suite: &Suite, oracle: &Oracle) {
        self.cases(&suite.cases, oracle);
    }

    /// Adds the hidden scenes and their traces.
    pub fn hidden(&mut self, hidden: &HiddenSuite) {
        self.cases(hidden.cases(), hidden.oracle());
    }

    fn cases(&mut self, cases: &[Case], oracle: &Oracle) {
        let manifest = oracle.manifest.as_ref();
        self.part(manifest.map_or("", |manifest| &manifest.envelopes_sha256).as_bytes());
        self.part(&(cases.len() as u64).to_le_bytes());
        for case in cases {
            self.part(case.feature.section.name().as_bytes());
            self.part(case.feature.group.as_bytes());
            self.part(case.id.as_bytes());
            self.part(case.scene_hash.as_bytes());
            let trace = oracle.find(case).and_then(|(path, _)| {
                oracle.check(case, &path)?;
                Ok(hash_file(&path).unwrap_or_default())
            });
            self.part(trace.unwrap_or_else(|fault| fault.to_string()).as_bytes());
        }
    }

    /// Adds a submission: a file, or every file below a folder, in the order of their names. Its own name does not
    /// count. A link counts by its target path, not by the target's content.
    ///
    /// # Errors
    /// If a file cannot be read, or the submission exceeds a limit. Only metadata is read in the latter case.
    pub fn submission(&mut self, path: &Path) -> Result<(), HandInError> {
        let mut is_itself = true;
        HandIn::open(path)?.walk(&mut |step| {
            let (kind, node): (&[u8], _) = match &step {
                WalkStep::Leave => {
                    self.part(b"end");
                    return Ok(());
                }
                WalkStep::Enter(node) => (b"folder", node),
                WalkStep::File(node) if node.is_executable() => (b"program", node),
                WalkStep::File(node) => (b"file", node),
                WalkStep::Link(node) => (b"link", node),
            };
            self.part(kind);
            self.part(if is_itself { b"" } else { node.name.as_encoded_bytes() });
            is_itself = false;
            match &step {
                WalkStep::File(node) => self.part(node.hash()?.as_bytes()),
                WalkStep::Link(node) => self.part(node.target()?.as_encoded_bytes()),
                WalkStep::Enter(_) | WalkStep::Leave => {}
            }
            Ok(())
        })
    }

    /// The hash in hexadecimal.
    pub fn finish(self) -> String {
        hexadecimal(&self.0.finalize())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn equal_folders_have_the_same_fingerprint() {
        let folder = tempfile::tempdir().unwrap();
        let of = |name: &str, file: &str| {
            let path = folder.path().join(name);
            fs::create_dir(&path).unwrap();
            fs::write(path.join(file), "text").unwrap();
            let mut fingerprint = Fingerprint::default();
            fingerprint.submission(&path).unwrap();
            fingerprint.finish()
        };
        let ada = of("ada", "a");
        assert_eq!(ada, of("bob", "a"));
        assert_ne!(ada, of("cleo", "ada"));
    }

    #[test]
    fn every_byte_and_name_of_a_submission_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let of = || {
            let mut fingerprint = Fingerprint::default();
            fingerprint.submission(path).unwrap();
            fingerprint.finish()
        };
        let mut seen = vec![of()];
        let mut changed = |what: &str| {
            let now = of();
            assert_eq!(now, of());
            assert!(!seen.contains(&now), "{what}");
            seen.push(now);
        };
        fs::write(path.join("a"), "bc").unwrap();
        changed("a file");
        fs::write(path.join("a"), "bd").unwrap();
        changed("a byte");
        fs::rename(path.join("a"), path.join("b")).unwrap();
        changed("a name");
        fs::create_dir(path.join("c")).unwrap();
        changed("a folder");
        fs::rename(path.join("b"), path.join("c/b")).unwrap();
        changed("a place");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(path.join("c/b"), fs::Permissions::from_mode(0o755)).unwrap();
            changed("a permission");
        }
    }
}
