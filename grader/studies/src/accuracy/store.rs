//! Store of measured curves in a folder, so that an interrupted study can continue.
//!
//! ```text
//! FOLDER/points/<scene>/<method>.json        written whole, once all its time steps are measured
//! ```
//!
//! A file is valid only with the same key: the hash of the scene, the method, the ladder, the grader's executable and
//! the submission. Numbers round-trip to the same bits.

use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::Point;
use crate::store;

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
        let record: CurveRecord = store::load(&self.path(scene, method))?;
        (record.key == key).then_some(record.points)
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
        let record = CurveRecord { key: key.to_owned(), points: points.to_vec() };
        store::save(&self.path(scene, method), &record)
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
    points: Vec<Point>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{Cost, Errors, RunOutcome, Timing, Work};

    #[test]
    fn stored_results_round_trip_exactly_under_their_key() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path(), "this build");
        let errors = Errors { position: 0.1 + 0.2, velocity: 5e-324, energy: f64::INFINITY };
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
