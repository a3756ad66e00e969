//! Plan of a class: its submissions, keyed by content, divided into shards.
//!
//! ```text
//! entries ─> key of each ─> equal keys together ─> longest first, to the least loaded shard ─> plan.json
//! ```
//!
//! A key is a hash of the grader, the scenes, their traces, the rubric, the options and the files of the submission.
//! A result is valid if it has the key of the plan. Running a shard again, or twice at the same time, therefore
//! changes nothing, and submissions with equal keys are graded once.
//!
//! Greedy scheduling of the longest first takes at most 4/3 − 1/(3n) times as long as the best division into n shards
//! (Graham 1969). Cost: O(m log n) for m submissions.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::entry::{ClassEntry, PassedOver};
use super::layout::Arranged;
use crate::boundary::own_file::read_text;
use crate::boundary::seal::{LINES_BEFORE, Seal};

/// The name that plans are signed with. No report has a line end in its name.
const NAME: &str = "plan\n";

/// Version of the plan's format.
const VERSION: u32 = 1;

/// Time of grading a submission if no time is known, in seconds: that of a typical program on two cores.
const TYPICAL_SECONDS: f64 = 3.0;

/// Maximum size of a plan, in MiB: two million submissions.
const MAX_MEBIBYTES: u64 = 1 << 10;

/// A plan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    version: u32,
    /// The folder in which `arguments` are to be read, from that of the plan: both can be moved together.
    pub folder: PathBuf,
    /// The arguments of `grade` that describe the class.
    pub arguments: Vec<String>,
    /// Hash of everything that the reports depend on, except the submissions.
    pub inputs: String,
    /// The submissions, by name.
    pub submissions: Vec<Planned>,
    /// Identifies this plan if only its own results count; `None` if every result with a key of the plan counts.
    pub anew: Option<String>,
    /// Entries of the class that are no submissions.
    pub passed_over: Vec<PassedOver>,
    /// How the class was arranged, if it was: its submissions are then in the folder of the results.
    pub arranged: Option<Arranged>,
    /// The submissions of each shard that had no result when the plan was made: their places in `submissions`.
    pub shards: Vec<Vec<usize>>,
}

/// A submission of a plan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Planned {
    /// The name of its file or folder.
    pub name: String,
    /// The name of its report, without extension.
    pub report: String,
    /// Hash of everything that its report depends on, except its name. Submissions with the same key are graded once.
    pub key: String,
}

impl Planned {
    /// A submission with this key.
    pub fn new(entry: ClassEntry, key: String) -> Self {
        Self { name: entry.name, report: entry.report, key }
    }
}

/// A file that is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// It cannot be read.
    #[error("{}: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It is not a plan of this version.
    #[error("{}:{line}: {message}\n  help: plan again with `grade class DIR -o RESULTS --resume`", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The fault.
        message: String,
    },
    /// It has fewer shards.
    #[error("there is no shard {shard}; the plan has {shards}, from 0")]
    NoShard {
        /// The shard that was asked for.
        shard: usize,
        /// The number of shards.
        shards: usize,
    },
}

impl Plan {
    /// A plan without shards: nothing is left to grade.
    pub fn new(
        (folder, arguments): (PathBuf, Vec<String>),
        inputs: String,
        submissions: Vec<Planned>,
        passed_over: Vec<PassedOver>,
    ) -> Self {
        let (version, anew, shards, arranged) = (VERSION, None, Vec::new(), None);
        Self {
            version,
            folder,
            arguments,
            inputs,
            submissions,
            anew,
            passed_over,
            arranged,
            shards,
        }
    }

    /// Reads a plan, which the class in its folder has signed: its arguments say what programs may do.
    ///
    /// # Errors
    /// If it cannot be read, is no plan of this version, or was edited.
    pub fn read(path: &Path) -> Result<Self, PlanError> {
        let text = read_text(path, MAX_MEBIBYTES)
            .map_err(|error| PlanError::Unreadable { path: path.to_path_buf(), error })?;
        let invalid =
            |line, message| PlanError::Invalid { path: path.to_path_buf(), line, message };
        let unsigned =
            || invalid(1, "not a plan of the class in this folder, or edited".to_owned());
        let seal =
            Seal::existing(path.parent().unwrap_or(Path::new(""))).map_err(|_| unsigned())?;
        let record = seal.unwrap(NAME, &text).ok_or_else(unsigned)?;
        let plan: Self = serde_json::from_str(record).map_err(|error| {
            invalid(LINES_BEFORE + error.line(), format!("not a plan of this grade: {error}"))
        })?;
        if plan.version != VERSION {
            return Err(invalid(1, format!("version {} instead of {VERSION}", plan.version)));
        }
        let count = plan.submissions.len();
        if let Some(place) = plan.shards.iter().flatten().find(|place| **place >= count) {
            return Err(invalid(1, format!("a shard names submission {place} of {count}")));
        }
        Ok(plan)
    }

    /// Signed JSON text with a final newline.
    ///
    /// # Errors
    /// Never in practice.
    pub fn render(&self, seal: &Seal) -> serde_json::Result<String> {
        Ok(seal.wrap(NAME, &serde_json::to_string_pretty(self)?))
    }

    /// The submissions of a shard, equal ones together, in the order of the plan.
    ///
    /// # Errors
    /// If there is no such shard.
    pub fn shard(&self, shard: usize) -> Result<Vec<Vec<usize>>, PlanError> {
        let shards = self.shards.len();
        let places = self.shards.get(shard).ok_or(PlanError::NoShard { shard, shards })?;
        Ok(self.equal(places))
    }

    /// Groups of submissions with the same key, by their first.
    fn equal(&self, places: &[usize]) -> Vec<Vec<usize>> {
        let mut groups: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for place in places {
            groups.entry(&self.submissions[*place].key).or_default().push(*place);
        }
        let mut groups: Vec<Vec<usize>> = groups.into_values().collect();
        groups.sort_unstable();
        groups
    }

    /// Groups of equal submissions with the time that each is expected to take, in microseconds: whole numbers have a
    /// total order, and exact sums. `seconds` are known times, by place; any other group counts as their mean.
    fn costs(&self, places: &[usize], seconds: &BTreeMap<usize, f64>) -> Vec<(u64, Vec<usize>)> {
        let known = seconds.values().copied().filter(|time| time.is_finite() && *time > 0.0);
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), time| (sum + time, count + 1.0));
        let mean = if count > 0.0 { sum / count } else { TYPICAL_SECONDS };
        let cost = |group: Vec<usize>| {
            let known = group.iter().filter_map(|place| seconds.get(place)).copied();
            let time = known.fold(f64::NAN, f64::max);
            ((if time > 0.0 { time } else { mean } * 1e6) as u64, group)
        };
        self.equal(places).into_iter().map(cost).collect()
    }

    /// The time that grading the submissions at `places` is expected to take, in seconds.
    pub fn estimate(&self, places: &[usize], seconds: &BTreeMap<usize, f64>) -> f64 {
        let costs = self.costs(places, seconds).into_iter();
        costs.map(|(microseconds, _)| microseconds as f64 / 1e6).sum()
    }

    /// Divides the submissions at `places` into at most `shards` shards of about the same time. `seconds` are known
    /// times, by place; any other submission counts as their mean.
    pub fn divide(&mut self, places: &[usize], seconds: &BTreeMap<usize, f64>, shards: usize) {
        let mut groups = self.costs(places, seconds);
        groups.sort_by(|a, b| (Reverse(a.0), &a.1).cmp(&(Reverse(b.0), &b.1)));
        let mut parts = vec![Vec::new(); shards.clamp(1, groups.len().max(1))];
        let mut loads: BinaryHeap<Reverse<(u64, usize)>> =
            (0..parts.len()).map(|part| Reverse((0, part))).collect();
        for (time, group) in groups {
            let Some(Reverse((load, part))) = loads.pop() else { break };
            parts[part].extend(group);
            loads.push(Reverse((load + time, part)));
        }
        for part in &mut parts {
            part.sort_unstable();
        }
        parts.retain(|part| !part.is_empty());
        self.shards = parts;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(keys: &[&str]) -> Plan {
        let submission = |key: &&str| Planned {
            name: String::new(),
            report: String::new(),
            key: (*key).to_owned(),
        };
        let submissions = keys.iter().map(submission).collect();
        Plan::new((PathBuf::new(), Vec::new()), String::new(), submissions, Vec::new())
    }

    #[test]
    fn longest_submissions_go_first_to_the_least_loaded_shard() {
        let mut plan = plan(&["a", "b", "c", "d", "e", "f"]);
        let seconds = BTreeMap::from([(0, 2.0), (1, 7.0), (2, 4.0), (3, 3.0)]);
        // Submissions 4 and 5 count as the mean, 4. In order: 1 | 2, 4 | 5 after 1 | 3, which makes 11 each | 0.
        plan.divide(&[0, 1, 2, 3, 4, 5], &seconds, 2);
        assert_eq!(plan.shards, [vec![0, 1, 5], vec![2, 3, 4]]);
        assert_eq!(plan.estimate(&[1, 5], &seconds), 11.0);
        plan.divide(&[], &seconds, 2);
        assert!(plan.shards.is_empty());
    }

    #[test]
    fn equal_submissions_are_one_group_of_one_shard() {
        let mut plan = plan(&["a", "b", "a", "c", "b", "a"]);
        let places: Vec<usize> = (0..6).collect();
        for shards in 1..9 {
            plan.divide(&places, &BTreeMap::new(), shards);
            assert_eq!(plan.shards.len(), shards.min(3));
            let groups = (0..plan.shards.len()).flat_map(|shard| plan.shard(shard).unwrap());
            let mut groups: Vec<_> = groups.collect();
            groups.sort_unstable();
            assert_eq!(groups, [vec![0, 2, 5], vec![1, 4], vec![3]]);
        }
        let error = plan.shard(3).unwrap_err().to_string();
        assert_eq!(error, "there is no shard 3; the plan has 3, from 0");
    }

    #[test]
    fn a_file_that_is_no_plan_is_refused_by_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plan.json");
        let seal = Seal::of(folder.path()).unwrap();
        let text = plan(&["a"]).render(&seal).unwrap();
        let signed = |from: &str, to: &str| {
            seal.wrap(NAME, &seal.unwrap(NAME, &text).unwrap().replace(from, to))
        };
        let edited = text.replace("\"arguments\": []", "\"arguments\": [\"--unprotected\"]");
        assert_ne!(edited, text);
        for (text, message) in [
            (&text[..text.len() / 2], ":1: not a plan of the class in this folder, or edited"),
            (&edited, ":1: not a plan of the class in this folder, or edited"),
            (&signed("\"shards\": []", "\"shards\": 1"), ": not a plan of this grade"),
            (&signed("\"version\": 1", "\"version\": 2"), ":1: version 2 instead of 1"),
            (&signed("\"shards\": []", "\"shards\": [[1]]"), "names submission 1 of 1"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = Plan::read(&path).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
        std::fs::write(&path, &text).unwrap();
        assert_eq!(Plan::read(&path).unwrap(), plan(&["a"]));
    }
}
