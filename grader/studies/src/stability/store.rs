//! Store of trials in a folder, so that an interrupted run can continue.
//!
//! One file per trial, written atomically. Its name contains the case, method, time step and a key: a hash of the
//! executable, which contains the scenes, and of the request. Files with other keys belong to other trials and are left
//! unchanged.

use std::path::{Path, PathBuf};

use scene::output::OutputFile;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use simulator::fallback::FallbackStatistics;

use super::outcome::{Measured, Outcome, REASONS, Trial};
use super::trial::{self, Task};

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
        let kept = std::fs::read(&path).ok();
        let kept = kept.and_then(|bytes| serde_json::from_slice::<Kept>(&bytes).ok());
        if let Some(trial) =
            kept.and_then(|kept| kept.trial(case.name, integrator.name, (time_step, steps, robust)))
        {
            return Some(trial);
        }
        let trial = trial::run(task)?;
        if let Ok(bytes) = serde_json::to_vec(&Kept::of(&trial)) {
            let written = OutputFile::create(&path).and_then(|mut file| {
                std::io::Write::write_all(&mut file, &bytes)?;
                file.commit()
            });
            // If it fails, the trial runs again next time.
            drop(written);
        }
        Some(trial)
    }
}

/// Stored form of a trial. Numbers are stored as bits, so that all values round-trip, including infinities.
#[derive(Serialize, Deserialize)]
struct Kept {
    outcome: String,
    step: Option<u64>,
    message: String,
    excess: u64,
    numbers: [u64; 5],
    momentum: Option<u64>,
    equation: Option<u64>,
    counts: [u64; 7],
}

impl Kept {
    fn of(trial: &Trial) -> Self {
        let (message, excess) = match &trial.outcome {
            Outcome::Failed { message, .. } => (message.clone(), 0.0),
            Outcome::Wrong { check, excess } => ((*check).to_owned(), *excess),
            Outcome::Survived | Outcome::BlowUp { .. } => (String::new(), 0.0),
        };
        let measured = &trial.measured;
        let rescue = measured.rescue;
        Self {
            outcome: trial.outcome.word().to_owned(),
            step: trial.outcome.step(),
            message,
            excess: excess.to_bits(),
            numbers: [
                measured.energy,
                measured.energy_rise,
                measured.worst_residual,
                trial.seconds,
                trial.time_step,
            ]
            .map(f64::to_bits),
            momentum: measured.momentum.map(f64::to_bits),
            equation: measured.equation.map(f64::to_bits),
            counts: [
                measured.steps,
                measured.newton_iterations,
                measured.max_newton_iterations,
                rescue.line_searched,
                rescue.substepped,
                rescue.substeps,
                rescue.max_substeps,
            ],
        }
    }

    /// The trial; `None` if invalid. A wrong outcome is not reused.
    fn trial(
        self,
        case: &'static str,
        method: &'static str,
        (time_step, steps, robust): (f64, u64, bool),
    ) -> Option<Trial> {
        let outcome = match (self.outcome.as_str(), self.step) {
            ("survived", None) => Outcome::Survived,
            ("blow-up", Some(step)) => Outcome::BlowUp { step },
            (word, Some(step)) => {
                let reason = REASONS.iter().find(|reason| **reason == word)?;
                Outcome::Failed { step, reason, message: self.message }
            }
            _ => return None,
        };
        let [energy, energy_rise, worst_residual, seconds, _] = self.numbers.map(f64::from_bits);
        let [
            taken,
            newton_iterations,
            max_newton_iterations,
            line_searched,
            substepped,
            substeps,
            max_substeps,
        ] = self.counts;
        Some(Trial {
            case,
            method,
            time_step,
            steps,
            robust,
            outcome,
            measured: Measured {
                steps: taken,
                energy,
                energy_rise,
                momentum: self.momentum.map(f64::from_bits),
                equation: self.equation.map(f64::from_bits),
                newton_iterations,
                max_newton_iterations,
                worst_residual,
                rescue: FallbackStatistics { line_searched, substepped, substeps, max_substeps },
            },
            seconds,
        })
    }
}
