//! Traces of a program's earlier runs, so that an unchanged program does not run again on an unchanged scene.
//!
//! ```text
//! FOLDER/KEY.HASH     a trace, as the program wrote it
//! KEY                 SHA-256 of the arguments, of the scene's files, and of how many runs of the same went before
//! HASH                SHA-256 of the trace
//! ```
//!
//! A folder holds the runs of one program, run in one way. A trace is used only if its bytes have the hash in its name, so
//! that nothing depends on how a file came to be there. Runs that fail are not kept.

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::suite::hash_file;

/// Number of digits of a hash.
const DIGITS: usize = 64;

/// The traces kept of a program.
#[derive(Debug)]
pub struct KeptRuns {
    folder: PathBuf,
    /// By key.
    traces: Mutex<HashMap<String, Kept>>,
}

#[derive(Debug)]
struct Kept {
    hash: String,
    is_used: bool,
}

impl KeptRuns {
    /// The runs in `folder`, which is created if missing. None of those in it is used if they are to be run `anew`.
    ///
    /// # Errors
    /// If the folder cannot be created or read.
    pub fn open(folder: PathBuf, anew: bool) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        let mut traces = HashMap::new();
        for entry in fs::read_dir(&folder)?.filter(|_| !anew) {
            let name = entry?.file_name();
            if let Some((key, hash)) = name.to_str().and_then(|name| name.split_once('.'))
                && (key.len(), hash.len()) == (DIGITS, DIGITS)
            {
                let kept = Kept { hash: hash.to_owned(), is_used: false };
                traces.insert(key.to_owned(), kept);
            }
        }
        Ok(Self { folder, traces: Mutex::new(traces) })
    }

    /// The trace of a run, if it is kept.
    pub(super) fn find(&self, key: &str) -> Option<PathBuf> {
        let hash = self.traces().get(key)?.hash.clone();
        let path = self.path(key, &hash);
        if hash_file(&path).ok()? != hash {
            return None;
        }
        self.traces().get_mut(key)?.is_used = true;
        Some(path)
    }

    /// Keeps the trace of a run. If it cannot be written, it is not kept, and the program will run again.
    pub(super) fn keep(&self, key: &str, trace: &Path) {
        let write = || -> io::Result<String> {
            let hash = hash_file(trace)?;
            let unfinished = tempfile::NamedTempFile::new_in(&self.folder)?;
            fs::copy(trace, unfinished.path())?;
            unfinished.persist(self.path(key, &hash))?;
            Ok(hash)
        };
        if let Ok(hash) = write() {
            self.traces().insert(key.to_owned(), Kept { hash, is_used: true });
        }
    }

    /// Removes what was neither found nor kept since the folder was opened: runs on scenes that have changed.
    pub fn remove_unused(&self) {
        let traces = self.traces();
        let used = traces.iter().filter(|(_, kept)| kept.is_used);
        let used: Vec<PathBuf> = used.map(|(key, kept)| self.path(key, &kept.hash)).collect();
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            if !used.contains(&entry.path()) {
                // It takes up space, no more.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    fn path(&self, key: &str, hash: &str) -> PathBuf {
        self.folder.join(format!("{key}.{hash}"))
    }

    fn traces(&self) -> MutexGuard<'_, HashMap<String, Kept>> {
        self.traces.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_is_used_by_its_content_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (runs, trace) = (folder.path().join("runs"), folder.path().join("trace"));
        fs::write(&trace, "t,x\n0,1\n").unwrap();
        let [key, other] = ["a", "b"].map(|digit| digit.repeat(DIGITS));
        let kept = KeptRuns::open(runs.clone(), false).unwrap();
        assert!(kept.find(&key).is_none());
        kept.keep(&key, &trace);
        kept.keep(&other, &trace);
        assert_eq!(fs::read(kept.find(&key).unwrap()).unwrap(), fs::read(&trace).unwrap());

        // Another grading of the same program finds it, and drops what it does not need.
        let again = KeptRuns::open(runs.clone(), false).unwrap();
        let path = again.find(&key).unwrap();
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
}
