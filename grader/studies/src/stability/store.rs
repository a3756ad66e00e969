//! Store of trials in a folder, so that an interrupted run can continue.
//!
//! One file per trial, written atomically. Its name contains the case, method, time step and a key: a hash of the
//! executable, which contains the scenes, and of the request. Files with other keys belong to other trials and are left
//! unchanged.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::outcome::{Measured, Outcome, Trial};
use super::trial::{self, Task};
use crate::store::{self, bits};

/// A folder of trials.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// The hash of the program.
    program: Vec<u8>,
}

impl Store {
    /// Opens the folder, created if missing.
    ///
    /// # Errors
    /// If it cannot be created, or the program cannot read its own executable.
    pub fn open(folder: &Path) -> std::io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        let program = std::fs::read(std::env::current_exe()?)?;
        Ok(Self { folder: folder.to_path_buf(), program: Sha256::digest(program).to_vec() })
    }

    /// Loads a trial, or runs and stores it. If it cannot be stored, it runs again next time.
    pub(super) fn recall_or(&self, task: Task) -> Option<Trial> {
        let Task { case, integrator, time_step, steps, robust } = task;
        let mut hash = Sha256::new();
        hash.update(&self.program);
        hash.update(format!("{} {} {time_step:e} {steps} {robust}", case.name, integrator.name));
        let hash = hash.finalize();
        let key: String = hash.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        let name = format!("{}.{}.{time_step:e}.{key}.json", case.name, integrator.name);
        let path = self.folder.join(name);
        if let Some(Record { outcome, measured, seconds }) = store::load(&path) {
            let (case, method) = (case.name, integrator.name);
            return Some(Trial {
                case,
                method,
                time_step,
                steps,
                robust,
                outcome,
                measured,
                seconds,
            });
        }
        let trial = trial::run(task)?;
        let Trial { outcome, measured, seconds, .. } = trial.clone();
        // If it fails, the trial runs again next time.
        drop(store::save(&path, &Record { outcome, measured, seconds }));
        Some(trial)
    }
}

/// The stored part of a trial; its name holds the rest.
#[derive(Serialize, Deserialize)]
struct Record {
    outcome: Outcome,
    measured: Measured,
    #[serde(with = "bits")]
    seconds: f64,
}
