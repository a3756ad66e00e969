//! Traces of a program's earlier runs, so that an unchanged program does not run again on an unchanged scene.
//!
//! ```text
//! FOLDER/KEY.HASH           a trace, as the program wrote it
//! FOLDER/KEY.HASH.failure   how a run failed: the failure's name and message
//! KEY                       SHA-256 of the arguments, of the scene's files, and of how many runs of the same went before
//! HASH                      SHA-256 of the file
//! ```
//!
//! A folder holds the runs of one program, run in one way. A file is used only if its bytes have the hash in its name, so
//! that nothing depends on how it came to be there. Runs that fail are kept only for a second phase, which repeats no run
//! of the first one.

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::boundary::own_file;
use crate::boundary::printed::Untrusted;
use crate::suite::{hash_bytes, hash_file};
use crate::verdict::Failure;

/// Number of digits of a hash.
const DIGITS: usize = 64;

/// Ending of the name of a kept failure.
const FAILURE: &str = ".failure";

/// The failures that a run can end with.
const FAILURES: [fn(Untrusted) -> Failure; 7] = [
    |detail| Failure::Crashed { detail },
    |detail| Failure::TimedOut { detail },
    |detail| Failure::NotRun { detail },
    |detail| Failure::OutOfMemory { detail },
    |detail| Failure::TooMuchOutput { detail },
    |detail| Failure::TooManyProcesses { detail },
    |detail| Failure::NoOutput { detail },
];

/// The runs kept of a program.
#[derive(Debug)]
pub struct KeptRuns {
    folder: PathBuf,
    scope: Scope,
    /// By key.
    ends: Mutex<HashMap<String, Kept>>,
    /// Whether something could not be written.
    has_lost: AtomicBool,
}

/// Which runs are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scope {
    /// Those that left a trace; the others are repeated.
    Traces,
    /// All: the first phase.
    All,
    /// No more than there are: the second phase.
    Closed,
}

#[derive(Debug)]
struct Kept {
    /// The file's name after its key.
    rest: String,
    is_used: bool,
}

/// How a kept run ended.
#[derive(Debug)]
pub(super) enum KeptEnd {
    /// With a trace, which is this file.
    Trace(PathBuf),
    /// With a failure.
    Failed(Failure),
}

impl KeptRuns {
    /// The runs in `folder`, which is created if missing. None of those in it is used if they are to be run `anew`.
    ///
    /// # Errors
    /// If the folder cannot be created or read.
    pub fn open(folder: PathBuf, anew: bool) -> io::Result<Self> {
        Self::read(folder, Scope::Traces, anew)
    }

    /// All runs of a first phase, in an empty folder.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn first_phase(folder: PathBuf) -> io::Result<Self> {
        Self::read(folder, Scope::All, false)
    }

    /// The runs of a first phase, for the second one.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn second_phase(folder: PathBuf) -> io::Result<Self> {
        Self::read(folder, Scope::Closed, false)
    }

    fn read(folder: PathBuf, scope: Scope, anew: bool) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        let mut ends = HashMap::new();
        for entry in fs::read_dir(&folder)?.filter(|_| !anew) {
            let name = entry?.file_name();
            if let Some((key, rest)) = name.to_str().and_then(|name| name.split_once('.'))
                && (key.len(), hash_of(rest).len()) == (DIGITS, DIGITS)
            {
                let kept = Kept { rest: rest.to_owned(), is_used: false };
                ends.insert(key.to_owned(), kept);
            }
        }
        let (ends, has_lost) = (Mutex::new(ends), AtomicBool::new(false));
        Ok(Self { folder, scope, ends, has_lost })
    }

    /// Whether a run that is not kept must not be made.
    pub(super) fn is_closed(&self) -> bool {
        self.scope == Scope::Closed
    }

    /// Whether some runs could not be kept.
    pub fn has_lost(&self) -> bool {
        self.has_lost.load(Ordering::Relaxed)
    }

    /// How a run ended, if it is kept.
    pub(super) fn find(&self, key: &str) -> Option<KeptEnd> {
        let rest = self.ends().get(key)?.rest.clone();
        let path = self.path(key, &rest);
        if hash_file(&path).ok()? != hash_of(&rest) {
            return None;
        }
        let end = match rest.ends_with(FAILURE) {
            true => KeptEnd::Failed(failure(&own_file::read(&path).ok()?)?),
            false => KeptEnd::Trace(path),
        };
        self.ends().get_mut(key)?.is_used = true;
        Some(end)
    }

    /// Keeps the trace of a run. If it cannot be written, it is not kept, and the program will run again.
    pub(super) fn keep(&self, key: &str, trace: &Path) {
        let write = || self.write(key, hash_file(trace)?, |file| fs::copy(trace, file).map(drop));
        self.has_lost.fetch_or(write().is_err(), Ordering::Relaxed);
    }

    /// Keeps the failure of a run, if failures are kept.
    pub(super) fn keep_failure(&self, key: &str, failure: &Failure) {
        if self.scope == Scope::Traces {
            return;
        }
        let text = serde_json::json!([failure.name(), failure.to_string()]).to_string();
        let rest = hash_bytes(text.as_bytes()) + FAILURE;
        let written = self.write(key, rest, |file| fs::write(file, &text));
        self.has_lost.fetch_or(written.is_err(), Ordering::Relaxed);
    }

    fn write(
        &self,
        key: &str,
        rest: String,
        fill: impl FnOnce(&Path) -> io::Result<()>,
    ) -> io::Result<()> {
        let unfinished = tempfile::NamedTempFile::new_in(&self.folder)?;
        fill(unfinished.path())?;
        unfinished.persist(self.path(key, &rest))?;
        self.ends().insert(key.to_owned(), Kept { rest, is_used: true });
        Ok(())
    }

    /// Removes what was neither found nor kept since the folder was opened: runs on scenes that have changed.
    pub fn remove_unused(&self) {
        let ends = self.ends();
        let used = ends.iter().filter(|(_, kept)| kept.is_used);
        let used: Vec<PathBuf> = used.map(|(key, kept)| self.path(key, &kept.rest)).collect();
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            if !used.contains(&entry.path()) {
                // It takes up space, no more.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    fn path(&self, key: &str, rest: &str) -> PathBuf {
        self.folder.join(format!("{key}.{rest}"))
    }

    fn ends(&self) -> MutexGuard<'_, HashMap<String, Kept>> {
        self.ends.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The hash in a file's name, of which this follows the key.
fn hash_of(rest: &str) -> &str {
    rest.strip_suffix(FAILURE).unwrap_or(rest)
}

/// The failure of a kept run.
fn failure(text: &[u8]) -> Option<Failure> {
    let (name, detail): (String, Untrusted) = serde_json::from_slice(text).ok()?;
    FAILURES.iter().map(|make| make(detail.clone())).find(|failure| failure.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_traces_are_found_by_content() {
        let folder = tempfile::tempdir().unwrap();
        let (runs, trace) = (folder.path().join("runs"), folder.path().join("trace"));
        fs::write(&trace, "t,x\n0,1\n").unwrap();
        let [key, other] = ["a", "b"].map(|digit| digit.repeat(DIGITS));
        let kept = KeptRuns::open(runs.clone(), false).unwrap();
        assert!(kept.find(&key).is_none());
        kept.keep(&key, &trace);
        kept.keep(&other, &trace);
        let found = |kept: &KeptRuns| match kept.find(&key).unwrap() {
            KeptEnd::Trace(path) => path,
            KeptEnd::Failed(failure) => panic!("{failure}"),
        };
        assert_eq!(fs::read(found(&kept)).unwrap(), fs::read(&trace).unwrap());

        // Another grading of the same program finds it, and drops what it does not need.
        let again = KeptRuns::open(runs.clone(), false).unwrap();
        let path = found(&again);
        fs::write(runs.join("half-written"), "").unwrap();
        again.remove_unused();
        let left: Vec<_> =
            fs::read_dir(&runs).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(left, std::slice::from_ref(&path));

        // A damaged one is not used, and replaced.
        fs::write(&path, "t,x\n0,2\n").unwrap();
        let damaged = KeptRuns::open(runs.clone(), false).unwrap();
        assert!(damaged.find(&key).is_none());
        damaged.keep(&key, &trace);
        assert!(damaged.find(&key).is_some());
        assert!(KeptRuns::open(runs, true).unwrap().find(&key).is_none());
    }

    #[test]
    fn second_phase_reads_every_outcome_of_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = || folder.path().join("runs");
        let first = KeptRuns::first_phase(path()).unwrap();
        for make in FAILURES {
            let failure = make("why\nnot".into());
            let key = hash_bytes(failure.name().as_bytes());
            first.keep_failure(&key, &failure);
            let second = KeptRuns::second_phase(path()).unwrap();
            assert!(second.is_closed() && !first.has_lost());
            let Some(KeptEnd::Failed(found)) = second.find(&key) else {
                panic!("{}", failure.name())
            };
            assert_eq!(found, failure);
        }
        // Gradings that are taken up later repeat what failed.
        let later = folder.path().join("later");
        let kept = KeptRuns::open(later.clone(), false).unwrap();
        kept.keep_failure(&"a".repeat(DIGITS), &FAILURES[0](Untrusted::default()));
        assert_eq!(fs::read_dir(later).unwrap().count(), 0);
    }
}
