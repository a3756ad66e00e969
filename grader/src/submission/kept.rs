//! Traces of a program's earlier runs, so that an unchanged program does not run again on an unchanged scene.
//!
//! ```text
//! FOLDER/KEY.SIGNATURE           a trace, as the program wrote it
//! FOLDER/KEY.SIGNATURE.failure   how a run failed, as JSON
//! KEY                            SHA-256 of the arguments, of the scene's files, and of how many runs of the same went before
//! SIGNATURE                      that of the class, of the folder's name, the key, the ending and SHA-256 of the file
//! ```
//!
//! A folder holds the runs of one program, run in one way. A file is used only if the class has signed it under its name:
//! one that was edited, or is of another scene, program or class, does not count. Runs that fail are kept only for a second
//! phase, which repeats no run of the first one.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::boundary::door::open_regular;
use crate::boundary::own_file;
use crate::boundary::seal::Seal;
use crate::suite::{hash_bytes, hash_file};
use crate::verdict::RunFailure;

/// Number of digits of a key and of a signature.
const DIGITS: usize = 64;

/// Ending of the name of a kept failure.
const FAILURE: &str = ".failure";

/// The runs kept of a program.
#[derive(Debug)]
pub struct KeptRuns {
    folder: PathBuf,
    scope: Scope,
    seal: Seal,
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
    /// With a trace.
    Trace,
    /// With a failure.
    Failed(RunFailure),
}

impl KeptRuns {
    /// The runs in `folder`, which is created if missing. None of those in it is used if they are to be run `anew`. `seal` is
    /// that of the class.
    ///
    /// # Errors
    /// If the folder cannot be created or read.
    pub fn open(folder: PathBuf, seal: &Seal, anew: bool) -> io::Result<Self> {
        Self::read(folder, seal, Scope::Traces, anew)
    }

    /// All runs of a first phase, in an empty folder.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn first_phase(folder: PathBuf, seal: &Seal) -> io::Result<Self> {
        Self::read(folder, seal, Scope::All, false)
    }

    /// The runs of a first phase, for the second one.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn second_phase(folder: PathBuf, seal: &Seal) -> io::Result<Self> {
        Self::read(folder, seal, Scope::Closed, false)
    }

    fn read(folder: PathBuf, seal: &Seal, scope: Scope, anew: bool) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        let mut ends = HashMap::new();
        for entry in fs::read_dir(&folder)?.filter(|_| !anew) {
            let name = entry?.file_name();
            if let Some((key, rest)) = name.to_str().and_then(|name| name.split_once('.'))
                && (key.len(), rest.trim_end_matches(FAILURE).len()) == (DIGITS, DIGITS)
            {
                let kept = Kept { rest: rest.to_owned(), is_used: false };
                ends.insert(key.to_owned(), kept);
            }
        }
        let (ends, has_lost) = (Mutex::new(ends), AtomicBool::new(false));
        Ok(Self { folder, scope, seal: seal.clone(), ends, has_lost })
    }

    /// Whether a run that is not kept must not be made.
    pub(super) fn is_closed(&self) -> bool {
        self.scope == Scope::Closed
    }

    /// Whether some runs could not be kept.
    pub fn has_lost(&self) -> bool {
        self.has_lost.load(Ordering::Relaxed)
    }

    /// How a run ended, if it is kept; its trace is put to `trace`.
    pub(super) fn find(&self, key: &str, trace: &Path) -> Option<KeptEnd> {
        let rest = self.ends().get(key)?.rest.clone();
        let mut kept = open_regular(&self.path(key, &rest)).ok()?;
        // Verifies the copy, which nobody else can change.
        let copy = trace.with_extension("unverified");
        io::copy(&mut kept, &mut File::create(&copy).ok()?).ok()?;
        let ending = if rest.ends_with(FAILURE) { FAILURE } else { "" };
        if self.signed(key, &hash_file(&copy).ok()?, ending) != rest {
            return None;
        }
        let end = if ending.is_empty() {
            fs::rename(&copy, trace).ok()?;
            KeptEnd::Trace
        } else {
            KeptEnd::Failed(serde_json::from_slice(&own_file::read(&copy).ok()?).ok()?)
        };
        self.ends().get_mut(key)?.is_used = true;
        Some(end)
    }

    /// Keeps the trace of a run. If it cannot be written, it is not kept, and the program will run again.
    pub(super) fn keep(&self, key: &str, trace: &Path) {
        let write = || {
            let rest = self.signed(key, &hash_file(trace)?, "");
            self.write(key, rest, |file| fs::copy(trace, file).map(drop))
        };
        self.has_lost.fetch_or(write().is_err(), Ordering::Relaxed);
    }

    /// Keeps the failure of a run, if failures are kept.
    pub(super) fn keep_failure(&self, key: &str, failure: &RunFailure) {
        if self.scope == Scope::Traces {
            return;
        }
        let text = serde_json::json!(failure).to_string();
        let rest = self.signed(key, &hash_bytes(text.as_bytes()), FAILURE);
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

    /// The name, after its key, of a file with this hash and ending.
    fn signed(&self, key: &str, hash: &str, ending: &str) -> String {
        // A first phase is moved when it is complete; its record names the folder and the files.
        let folder = match self.scope {
            Scope::Traces => self.folder.file_name().unwrap_or_default().to_string_lossy(),
            Scope::All | Scope::Closed => "".into(),
        };
        // No report has a line end in its name.
        self.seal.sign(&format!("run\n{folder} {key}{ending}"), hash) + ending
    }

    fn path(&self, key: &str, rest: &str) -> PathBuf {
        self.folder.join(format!("{key}.{rest}"))
    }

    fn ends(&self) -> MutexGuard<'_, HashMap<String, Kept>> {
        self.ends.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rustix::fs::CWD;
    use sandbox::{Limits, NotKept, Sandbox};

    use super::*;
    use crate::submission::program::{Program, Runner};
    use crate::verdict::{LastOutput, RunEnd};

    #[test]
    fn kept_traces_need_the_signature_of_their_name() {
        let folder = tempfile::tempdir().unwrap();
        let seal = Seal::of(folder.path()).unwrap();
        let [runs, trace, copy] = ["runs", "trace", "copy"].map(|name| folder.path().join(name));
        fs::write(&trace, "t,x\n0,1\n").unwrap();
        let [key, other] = ["a", "b"].map(|digit| digit.repeat(DIGITS));
        let open = || KeptRuns::open(runs.clone(), &seal, false).unwrap();
        let is_kept = |kept: &KeptRuns| matches!(kept.find(&key, &copy), Some(KeptEnd::Trace));
        let kept = open();
        assert!(!is_kept(&kept));
        kept.keep(&key, &trace);
        kept.keep(&other, &trace);
        assert!(is_kept(&kept));
        assert_eq!(fs::read(&copy).unwrap(), fs::read(&trace).unwrap());

        // Another grading of the same program finds it, and drops what it does not need.
        let again = open();
        assert!(is_kept(&again));
        fs::write(runs.join("half-written"), "").unwrap();
        let signature_of = |key: &str| open().ends()[key].rest.clone();
        let (signature, of_other) = (signature_of(&key), signature_of(&other));
        again.remove_unused();
        let path = runs.join(format!("{key}.{signature}"));
        let left: Vec<_> =
            fs::read_dir(&runs).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(left, std::slice::from_ref(&path));

        // None of another class, program or scene is used, nor one that was edited or is a pipe.
        let elsewhere = tempfile::tempdir().unwrap();
        let foreign = Seal::of(elsewhere.path()).unwrap();
        assert!(!is_kept(&KeptRuns::open(runs.clone(), &foreign, false).unwrap()));
        fs::rename(&runs, folder.path().join("moved")).unwrap();
        assert!(!is_kept(&KeptRuns::open(folder.path().join("moved"), &seal, false).unwrap()));
        fs::rename(folder.path().join("moved"), &runs).unwrap();
        let moved = runs.join(format!("{key}.{of_other}"));
        fs::rename(&path, &moved).unwrap();
        assert!(!is_kept(&open()));
        fs::rename(&moved, &path).unwrap();
        assert!(is_kept(&open()) && !is_kept(&KeptRuns::open(runs.clone(), &seal, true).unwrap()));
        fs::write(&path, "t,x\n0,2\n").unwrap();
        let edited = open();
        assert!(!is_kept(&edited));
        edited.keep(&key, &trace);
        assert!(is_kept(&edited));
        let hashed = runs.join(format!("{key}.{}", hash_bytes(b"t,x\n0,2\n")));
        fs::rename(&path, &hashed).unwrap();
        fs::write(&hashed, "t,x\n0,2\n").unwrap();
        assert!(!is_kept(&open()));
        fs::remove_file(&hashed).unwrap();
        rustix::fs::mkfifoat(CWD, &path, rustix::fs::Mode::RWXU).unwrap();
        assert!(!is_kept(&open()));
    }

    #[test]
    fn second_phase_reads_every_outcome_of_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let seal = Seal::of(folder.path()).unwrap();
        let (path, copy) = (folder.path().join("runs"), folder.path().join("copy"));
        let first = KeptRuns::first_phase(path.clone(), &seal).unwrap();
        let output = LastOutput { text: "why\nnot".into(), misses_file: true };
        let reason = NotKept::TooLarge(7);
        let ends = [
            RunEnd::Exited(1),
            RunEnd::NotStarted { program: "a".into(), error: "b".into() },
            RunEnd::Processor(0.1),
            RunEnd::NoTrace { file: "trace.csv".to_owned(), reason },
        ];
        for end in ends {
            let failure = RunFailure { end, output: output.clone() };
            let key = hash_bytes(failure.to_string().as_bytes());
            first.keep_failure(&key, &failure);
            let second = KeptRuns::second_phase(path.clone(), &seal).unwrap();
            assert!(second.is_closed() && !first.has_lost());
            let Some(KeptEnd::Failed(found)) = second.find(&key, &copy) else {
                panic!("{failure}")
            };
            assert_eq!(found, failure);
        }
        // Gradings that are taken up later repeat what failed.
        let later = folder.path().join("later");
        let kept = KeptRuns::open(later.clone(), &seal, false).unwrap();
        let failure = RunFailure { end: RunEnd::Exited(1), output };
        kept.keep_failure(&"a".repeat(DIGITS), &failure);
        assert_eq!(fs::read_dir(later).unwrap().count(), 0);
    }

    /// Its output is shown, and a hidden scene may have run before it.
    #[test]
    fn second_phase_refuses_unrecorded_runs() {
        let folder = tempfile::tempdir().unwrap();
        let seal = Seal::of(folder.path()).unwrap();
        let kept = KeptRuns::second_phase(folder.path().join("runs"), &seal).unwrap();
        let mut runner = Runner::new(Sandbox::Unprotected, Limits::default(), Vec::new());
        runner.kept.push(Arc::new(kept));
        let error = Program::identify(Path::new("/bin/true"), runner).unwrap_err().to_string();
        assert!(error.contains("the record of the first phase lacks a run"), "{error}");
    }
}
