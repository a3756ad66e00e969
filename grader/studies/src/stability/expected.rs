//! Expected outcomes, stored in the repository, and comparison with them.
//!
//! One row per trial: `case,method,dt,steps,robust,outcome,step,newton_iterations`. Runs are deterministic, so the step
//! of a failure and the iterations are compared exactly. The rows are in `docs/stability-expected.csv`.
//! `grade stability --accept` replaces the rows of the trials that ran and keeps the others; it does not overwrite an
//! unreadable file.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use super::cases::{self, Case};
use super::outcome::{Outcome, Trial};

/// The columns.
const HEADER: [&str; 8] =
    ["case", "method", "dt", "steps", "robust", "outcome", "step", "newton_iterations"];

/// Identifies the trial of a row.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key {
    /// The case.
    pub case: String,
    /// The method.
    pub method: String,
    /// The time step as text.
    pub time_step: String,
    /// The requested number of steps.
    pub steps: u64,
    /// Whether fallbacks for failed steps were on.
    pub robust: bool,
}

/// Stored form of an outcome.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expected {
    /// Its name.
    pub outcome: String,
    /// The step at which it ended early.
    pub step: Option<u64>,
    /// Newton iterations until its end.
    pub newton_iterations: u64,
}

impl std::fmt::Display for Expected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.outcome)?;
        if let Some(step) = self.step {
            write!(f, " in step {step}")?;
        }
        if self.newton_iterations > 0 {
            write!(f, " after {} Newton iterations", self.newton_iterations)?;
        }
        Ok(())
    }
}

/// All expected outcomes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Expectations(BTreeMap<Key, Expected>);

/// A trial whose outcome differs from the stored one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// The trial.
    pub key: Key,
    /// The stored outcome; `None` for a new trial.
    pub expected: Option<Expected>,
    /// The new outcome; `None` for a trial that no longer exists.
    pub got: Option<Expected>,
}

/// The file of expected outcomes cannot be used.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum ExpectedError {
    #[error("{path}: {source}")]
    Read { path: String, source: io::Error },
    #[error(
        "{path}:{line}: {detail}\n  help: correct the line, or restore the file from version control"
    )]
    Malformed { path: String, line: u64, detail: String },
}

impl Trial {
    /// The key of the trial.
    pub fn key(&self) -> Key {
        Key {
            case: self.case.to_owned(),
            method: self.method.to_owned(),
            time_step: format!("{:e}", self.time_step),
            steps: self.steps,
            robust: self.robust,
        }
    }

    /// The stored form of its outcome.
    pub fn stored(&self) -> Expected {
        Expected {
            outcome: self.outcome.word().to_owned(),
            step: self.outcome.step(),
            newton_iterations: self.measured.newton_iterations,
        }
    }
}

impl Key {
    /// Whether a quick or a full run contains a trial with this key.
    fn is_known(&self) -> bool {
        let is_case = |case: &Case| {
            let mut time_steps = case.time_steps.iter().map(|time_step| format!("{time_step:e}"));
            case.name == self.case
                && case.steps.contains(&self.steps)
                && time_steps.any(|time_step| time_step == self.time_step)
        };
        let is_method =
            simulator::integrator::REGISTRY.iter().any(|kind| kind.schema.name == self.method);
        is_method && cases::all().any(is_case)
    }
}

impl Expectations {
    /// Reads the file; a missing file means no expectations.
    ///
    /// # Errors
    /// If it cannot be read or has the wrong format, with file and line.
    pub fn load(path: &Path) -> Result<Self, ExpectedError> {
        let name = path.display().to_string();
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => return Err(ExpectedError::Read { path: name, source }),
        };
        let malformed = |line: u64, detail: &str| ExpectedError::Malformed {
            path: name.clone(),
            line,
            detail: detail.to_owned(),
        };
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let is_header = reader.headers().is_ok_and(|header| header.iter().eq(HEADER));
        if !is_header {
            return Err(malformed(1, &format!("the header must be {}", HEADER.join(","))));
        }
        let mut all = BTreeMap::new();
        for record in reader.records() {
            let record = record.map_err(|error| {
                let line = error.position().map_or(0, csv::Position::line);
                malformed(line, "a row has eight fields")
            })?;
            let line = record.position().map_or(0, csv::Position::line);
            let number = |field: usize| -> Result<u64, ExpectedError> {
                let wrong = |_| malformed(line, &format!("{} is no count", HEADER[field]));
                record[field].parse().map_err(wrong)
            };
            let robust = match &record[4] {
                "yes" => true,
                "no" => false,
                _ => return Err(malformed(line, "robust is yes or no")),
            };
            let key = Key {
                case: record[0].to_owned(),
                method: record[1].to_owned(),
                time_step: record[2].to_owned(),
                steps: number(3)?,
                robust,
            };
            let expected = Expected {
                outcome: record[5].to_owned(),
                step: if record[6].is_empty() { None } else { Some(number(6)?) },
                newton_iterations: number(7)?,
            };
            if all.insert(key, expected).is_some() {
                return Err(malformed(line, "this trial has a row already"));
            }
        }
        Ok(Self(all))
    }

    /// The content of the file.
    ///
    /// # Errors
    /// Never in practice: it writes to memory.
    pub fn render(&self) -> io::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(HEADER)?;
        for (key, expected) in &self.0 {
            writer.write_record([
                key.case.clone(),
                key.method.clone(),
                key.time_step.clone(),
                key.steps.to_string(),
                if key.robust { "yes" } else { "no" }.to_owned(),
                expected.outcome.clone(),
                expected.step.map_or_else(String::new, |step| step.to_string()),
                expected.newton_iterations.to_string(),
            ])?;
        }
        writer.into_inner().map_err(|error| error.into_error())
    }

    /// Differences from these trials, including rows of trials that no longer exist.
    pub fn compare(&self, trials: &[Trial]) -> Vec<Change> {
        let mut changes = Vec::new();
        for trial in trials {
            let (key, got) = (trial.key(), trial.stored());
            let expected = self.0.get(&key);
            if expected != Some(&got) {
                let expected = expected.cloned();
                changes.push(Change { key, expected, got: Some(got) });
            }
        }
        let gone = self.0.iter().filter(|(key, _)| !key.is_known());
        changes.extend(gone.map(|(key, expected)| Change {
            key: key.clone(),
            expected: Some(expected.clone()),
            got: None,
        }));
        changes
    }

    /// Stores the outcomes of these trials as expected, except wrong ones, and removes rows of trials that no longer
    /// exist.
    pub fn accept(&mut self, trials: &[Trial]) {
        self.0.retain(|key, _| key.is_known());
        for trial in trials {
            if !matches!(trial.outcome, Outcome::Wrong { .. }) {
                self.0.insert(trial.key(), trial.stored());
            }
        }
    }
}
