//! Store of measured curves in a folder, so that an interrupted study can continue.
//!
//! ```text
//! FOLDER/points/<scene>/<method>.json        written whole, once all its time steps are measured
//! ```
//!
//! A file is valid only with the same key: the hash of the scene, the method, the ladder, the grader's executable and
//! the submission. Numbers round-trip to the same bits.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use scene::output::OutputFile;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Cost, Errors, Point, RunOutcome, Timing, Work};

/// A folder of measured curves.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
    /// Common part of all keys.
    common: String,
}

impl Store {
    /// The store in a folder. `common` identifies everything that results depend on besides the scene, the method and
    /// the ladder.
    pub fn new(folder: &Path, common: &str) -> Self {
        Self { folder: folder.join("points"), common: common.to_owned() }
    }

    /// The key of a curve: a hash of these parts and the common part.
    pub(super) fn key(&self, parts: &[&str]) -> String {
        let mut hash = Sha256::new();
        for part in parts.iter().chain([&self.common.as_str()]) {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        }
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The points of a curve, if stored with this key.
    pub(super) fn load(&self, scene: &str, method: &str, key: &str) -> Option<Vec<Point>> {
        let text = fs::read_to_string(self.path(scene, method)).ok()?;
        let record: CurveRecord = serde_json::from_str(&text).ok()?;
        (record.key == key).then(|| record.points.into_iter().map(RecordedPoint::point).collect())
    }

    /// Stores the points of a curve.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn save(
        &self,
        scene: &str,
        method: &str,
        key: &str,
        points: &[Point],
    ) -> io::Result<()> {
        let path = self.path(scene, method);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let points = points.iter().map(RecordedPoint::of).collect();
        let record = CurveRecord { key: key.to_owned(), points };
        let mut file = OutputFile::create(&path)?;
        file.write_all(serde_json::to_string(&record)?.as_bytes())?;
        file.commit()
    }

    fn path(&self, scene: &str, method: &str) -> PathBuf {
        self.folder.join(file_name(scene)).join(format!("{}.json", file_name(method)))
    }
}

/// A name without characters that are special in file systems.
pub fn file_name(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name: String = name.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    name.trim_start_matches('.').to_owned()
}

#[derive(Serialize, Deserialize)]
struct CurveRecord {
    key: String,
    points: Vec<RecordedPoint>,
}

/// A point as text: numbers as the shortest decimals that read back to the same bits.
#[derive(Serialize, Deserialize)]
struct RecordedPoint {
    time_step: String,
    steps: u64,
    /// "finished", "blown-up" or "failed".
    outcome: String,
    /// The errors at the end and the largest errors, only the largest, or the time of the failure.
    numbers: Vec<String>,
    failed_step: u64,
    reason: String,
    time: Option<[String; 3]>,
    repeats: u32,
    work: Option<[u64; 3]>,
}

impl RecordedPoint {
    fn of(point: &Point) -> Self {
        let errors = |errors: &Errors| {
            [errors.position, errors.velocity, errors.energy].map(|value| value.to_string())
        };
        let (outcome, numbers, failed_step, reason) = match &point.outcome {
            RunOutcome::Finished { end, largest } => {
                ("finished", [errors(end), errors(largest)].concat(), 0, String::new())
            }
            RunOutcome::BlownUp { largest } => {
                ("blown-up", errors(largest).to_vec(), 0, String::new())
            }
            RunOutcome::Failed { step, time, reason } => {
                ("failed", vec![time.to_string()], *step, reason.clone())
            }
        };
        let time = point.cost.time;
        Self {
            time_step: point.time_step.to_string(),
            steps: point.steps,
            outcome: outcome.to_owned(),
            numbers,
            failed_step,
            reason,
            time: time
                .map(|time| [time.least, time.median, time.largest].map(|value| value.to_string())),
            repeats: time.map_or(0, |time| time.repeats),
            work: point
                .cost
                .work
                .map(|work| [work.force_evaluations, work.factorisations, work.iterations]),
        }
    }

    fn point(self) -> Point {
        let number = |text: Option<&String>| {
            text.and_then(|text| text.parse().ok()).unwrap_or(f64::INFINITY)
        };
        let errors = |start: usize| Errors {
            position: number(self.numbers.get(start)),
            velocity: number(self.numbers.get(start + 1)),
            energy: number(self.numbers.get(start + 2)),
        };
        let outcome = match self.outcome.as_str() {
            "finished" => RunOutcome::Finished { end: errors(0), largest: errors(3) },
            "blown-up" => RunOutcome::BlownUp { largest: errors(0) },
            _ => RunOutcome::Failed {
                step: self.failed_step,
                time: number(self.numbers.first()),
                reason: self.reason.clone(),
            },
        };
        let time = self.time.as_ref().map(|[least, median, largest]| Timing {
            least: number(Some(least)),
            median: number(Some(median)),
            largest: number(Some(largest)),
            repeats: self.repeats,
        });
        let work = self.work.map(|[force_evaluations, factorisations, iterations]| Work {
            force_evaluations,
            factorisations,
            iterations,
        });
        Point {
            time_step: number(Some(&self.time_step)),
            steps: self.steps,
            outcome,
            cost: Cost { time, work },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_results_round_trip_exactly_under_their_key() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "this build");
        let errors = Errors { position: 0.1 + 0.2, velocity: 5e-324, energy: 1.0 / 3.0 };
        let time = Timing { least: 1.0 / 7.0, median: 0.3, largest: 2.0 / 3.0, repeats: 5 };
        let work = Work { force_evaluations: 3, factorisations: 2, iterations: 1 };
        let cost = Cost { time: Some(time), work: Some(work) };
        let outcomes = [
            RunOutcome::Finished { end: errors, largest: errors },
            RunOutcome::BlownUp { largest: errors },
            RunOutcome::Failed { step: 3, time: 0.1, reason: "a reason".to_owned() },
        ];
        let points: Vec<Point> = outcomes
            .map(|outcome| Point { time_step: 0.1 / 3.0, steps: 9, outcome, cost })
            .to_vec();
        let key = store.key(&["scene", "method"]);
        store.save("a/scene", "a method=1", &key, &points).unwrap();
        assert_eq!(store.load("a/scene", "a method=1", &key), Some(points));
        let other = Store::new(folder.path(), "another build").key(&["scene", "method"]);
        assert_eq!(store.load("a/scene", "a method=1", &other), None);
    }
}
