//! Provenance of a grading: which grader judged which submission by which scenes, and with which options. Gradings of
//! equal provenance have equal verdicts, as far as the submission is deterministic and within its limits of time.

use std::collections::BTreeMap;

use crate::suite::hash_bytes;

/// Provenance of a grading. Hashes are SHA-256, in hexadecimal.
#[derive(Debug, Clone, PartialEq)]
pub struct Provenance {
    /// The commit that the grader was built from, followed by `-modified` if its sources differed; `None` if unknown.
    pub commit: Option<String>,
    /// Operating system and architecture that the grader was built for.
    pub platform: String,
    /// Hash of the rubric; `None` for the built-in one.
    pub rubric: Option<String>,
    /// Hash of the pack and its starter code; `None` without a pack.
    pub pack: Option<String>,
    /// Hash of the assignment; `None` if every scene was graded.
    pub assignment: Option<String>,
    /// Hash of the envelopes; `None` if there are none.
    pub envelopes: Option<String>,
    /// The shipped scenes, by name.
    pub scenes: BTreeMap<String, SceneHashes>,
    /// Hash of all hidden scenes and their traces; `None` if none were available.
    pub hidden: Option<String>,
    /// The submission; `None` for the built-in simulator.
    pub submission: Option<SubmissionOrigin>,
    /// The options.
    pub options: GradingOptions,
}

impl Provenance {
    /// One hash of all shipped scenes with their traces, and of the envelopes.
    pub fn oracle(&self) -> String {
        let mut text = format!("{:?}\n", self.envelopes);
        for (name, SceneHashes { scene, trace }) in &self.scenes {
            text += &format!("{name:?} {scene} {trace:?}\n");
        }
        hash_bytes(text.as_bytes())
    }
}

/// Hashes of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneHashes {
    /// Of the scene's files.
    pub scene: String,
    /// Of its oracle trace; `None` if it cannot be used.
    pub trace: Option<String>,
}

/// A submission on disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SubmissionOrigin {
    /// Its path, as given.
    pub path: String,
    /// Hash of its files; `None` if they cannot be read.
    pub files: Option<String>,
}

/// Options that verdicts depend on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GradingOptions {
    /// Whether every scene of the assignment was graded, and not a selection.
    pub whole: bool,
    /// Whether Jacobians were measured.
    pub jacobians: bool,
    /// The criteria, if not the rubric's.
    pub criteria: Option<String>,
    /// Limits of runs, if not the rubric's.
    pub limits: Vec<(String, f64)>,
    /// Further paths that programs could read.
    pub readable: Vec<String>,
    /// Whether programs ran without the sandbox.
    pub unprotected: bool,
}
