//! Provenance in JSON reports, and the comparison of two reports: which inputs changed, and which results differ.

use std::collections::{BTreeMap, BTreeSet};

use grader::grading::provenance::{GradingOptions, Provenance, SceneHashes, SubmissionOrigin};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SCHEMA_VERSION;

/// What the report was made from, and with which options. Hashes are SHA-256.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JsonProvenance {
    /// The commit that the grader was built from, followed by "-modified" if its sources differed; null if unknown.
    commit: Option<String>,
    /// Operating system and architecture that the grader was built for.
    platform: String,
    /// Hash of the rubric's file; null for the built-in rubric.
    rubric: Option<String>,
    /// Hash of the assignment's file; null if every scene was graded.
    assignment: Option<String>,
    /// Hash of envelopes.toml; null where there is no such file.
    envelopes: Option<String>,
    /// Hashes of the shipped scenes, by name.
    scenes: BTreeMap<String, JsonSceneHashes>,
    /// Hash of all hidden scenes and their traces; null if none were available.
    hidden: Option<String>,
    /// The submission; null for the built-in simulator.
    submission: Option<JsonSubmissionOrigin>,
    /// Options that verdicts depend on.
    options: JsonOptions,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
struct JsonSceneHashes {
    /// Hash of the scene file, followed by its mesh if it names one.
    scene: String,
    /// Hash of its oracle trace; null if it cannot be used.
    trace: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
struct JsonSubmissionOrigin {
    /// Its path, as given.
    path: String,
    /// Hash of its files; null if they could not be read.
    files: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
struct JsonOptions {
    /// Whether every scene of the assignment was graded, and not a selection.
    whole: bool,
    /// Whether Jacobians were measured.
    jacobians: bool,
    /// "course" or "calibrated"; null if the rubric decided.
    criteria: Option<String>,
    /// Limits of runs that the command line set.
    limits: Vec<(String, f64)>,
    /// Further paths that programs could read.
    readable: Vec<String>,
    /// Whether programs ran without the sandbox.
    unprotected: bool,
}

impl JsonProvenance {
    pub(super) fn of(provenance: &Provenance) -> Self {
        let scene = |(name, hashes): (&String, &SceneHashes)| {
            let SceneHashes { scene, trace } = hashes.clone();
            (name.clone(), JsonSceneHashes { scene, trace })
        };
        let submission = provenance.submission.clone();
        let submission =
            submission.map(|SubmissionOrigin { path, files }| JsonSubmissionOrigin { path, files });
        let GradingOptions { whole, jacobians, criteria, limits, readable, unprotected } =
            provenance.options.clone();
        Self {
            commit: provenance.commit.clone(),
            platform: provenance.platform.clone(),
            rubric: provenance.rubric.clone(),
            assignment: provenance.assignment.clone(),
            envelopes: provenance.envelopes.clone(),
            scenes: provenance.scenes.iter().map(scene).collect(),
            hidden: provenance.hidden.clone(),
            submission,
            options: JsonOptions { whole, jacobians, criteria, limits, readable, unprotected },
        }
    }
}

/// A JSON report that was read: its provenance, verdicts and points.
#[derive(Debug, Deserialize)]
pub struct StoredReport {
    grader_version: String,
    /// Name of the submission.
    pub submission: String,
    /// Name of the assignment; `None` if every scene was graded.
    pub assignment: Option<String>,
    outcome: String,
    protection: Option<Vec<String>>,
    required: StoredTotals,
    extra_credit: StoredTotals,
    creative: Option<StoredCreative>,
    features: Vec<StoredFeature>,
    provenance: Option<JsonProvenance>,
}

#[derive(Debug, Deserialize)]
struct StoredTotals {
    points: f64,
    points_earned: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct StoredCreative {
    marks: Vec<[f64; 3]>,
    points: f64,
    points_earned: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct StoredFeature {
    group: String,
    integrator: String,
    points: f64,
    points_earned: Option<f64>,
    scenes: Vec<StoredScene>,
    hidden: Option<BTreeMap<String, usize>>,
}

#[derive(Debug, Deserialize)]
struct StoredScene {
    name: String,
    verdict: String,
}

/// A file that is no report whose grading could be repeated.
#[derive(Debug, thiserror::Error)]
pub enum StoredError {
    /// It is not a report as JSON.
    #[error(
        "{line}: not a JSON report of grade: {message}\n  help: write one with --report json=FILE"
    )]
    Invalid {
        /// Line, from 1.
        line: usize,
        /// Why.
        message: String,
    },
    /// It has the schema of another version.
    #[error("1: a report with schema version {found}; this grade reads version {SCHEMA_VERSION}")]
    OtherVersion {
        /// Its version.
        found: u32,
    },
    /// It does not say what it was made from.
    #[error("1: the report has no provenance; an earlier version of grade wrote it")]
    NoProvenance,
}

/// The start of a hash, as texts show it.
pub(crate) fn short_hash(hash: &str) -> String {
    hash.chars().take(12).collect()
}

impl StoredReport {
    /// Reads a report.
    ///
    /// # Errors
    /// If it is no report of this version with provenance.
    pub fn parse(text: &str) -> Result<Self, StoredError> {
        #[derive(Deserialize)]
        struct Version {
            schema_version: u32,
        }
        let invalid = |error: serde_json::Error| StoredError::Invalid {
            line: error.line(),
            message: error.to_string(),
        };
        let Version { schema_version: found } = serde_json::from_str(text).map_err(invalid)?;
        if found != SCHEMA_VERSION {
            return Err(StoredError::OtherVersion { found });
        }
        let report: Self = serde_json::from_str(text).map_err(invalid)?;
        report.provenance.is_some().then_some(report).ok_or(StoredError::NoProvenance)
    }

    /// The options of its grading.
    pub fn options(&self) -> GradingOptions {
        let Some(JsonProvenance { options, .. }) = self.provenance.clone() else {
            return GradingOptions::default();
        };
        let JsonOptions { whole, jacobians, criteria, limits, readable, unprotected } = options;
        GradingOptions { whole, jacobians, criteria, limits, readable, unprotected }
    }

    /// The path of its submission; `None` for the built-in simulator.
    pub fn path(&self) -> Option<&str> {
        let submission = self.provenance.as_ref()?.submission.as_ref();
        submission.map(|submission| submission.path.as_str())
    }

    /// The marks of its creative scene; `None` if the scenes of the class were not marked.
    pub fn marks(&self) -> Option<&[[f64; 3]]> {
        self.creative.as_ref().map(|creative| creative.marks.as_slice())
    }

    /// The names of its scenes.
    pub fn scenes(&self) -> impl Iterator<Item = &str> {
        self.provenance.iter().flat_map(|provenance| provenance.scenes.keys().map(String::as_str))
    }

    /// The inputs that are others in `new`, a line each.
    pub fn changed_inputs(&self, new: &Self) -> Vec<String> {
        let (Some(old_inputs), Some(new_inputs)) = (&self.provenance, &new.provenance) else {
            return Vec::new();
        };
        let mut changes = Vec::new();
        let mut add = |what: &str, old: Option<String>, new: Option<String>| {
            let shown = |text: Option<String>| text.unwrap_or_else(|| "none".to_owned());
            if old != new {
                changes.push(format!("{what}: {}, now {}", shown(old), shown(new)));
            }
        };
        let grader = |report: &Self, inputs: &JsonProvenance| {
            let commit = inputs.commit.as_deref().map(|commit| format!(", commit {commit}"));
            let (version, platform) = (&report.grader_version, &inputs.platform);
            Some(format!("{version}{}, {platform}", commit.unwrap_or_default()))
        };
        add("grader", grader(self, old_inputs), grader(new, new_inputs));
        let protection = |report: &Self| report.protection.as_ref().map(|names| names.join(" "));
        add("protection", protection(self), protection(new));
        let short = |hash: &Option<String>| hash.as_deref().map(short_hash);
        for (what, of) in [
            ("rubric", (|inputs| &inputs.rubric) as fn(&JsonProvenance) -> &Option<String>),
            ("assignment", |inputs| &inputs.assignment),
            ("envelopes of the oracle", |inputs| &inputs.envelopes),
            ("hidden scenes", |inputs| &inputs.hidden),
        ] {
            add(what, short(of(old_inputs)), short(of(new_inputs)));
        }
        let files = |inputs: &JsonProvenance| {
            inputs.submission.as_ref().and_then(|submission| short(&submission.files))
        };
        add("submission", files(old_inputs), files(new_inputs));
        let names = old_inputs.scenes.keys().chain(new_inputs.scenes.keys());
        for name in names.collect::<BTreeSet<_>>() {
            let hashes = [old_inputs, new_inputs].map(|inputs| inputs.scenes.get(name));
            let scene = hashes.map(|hashes| short(&hashes.map(|hashes| hashes.scene.clone())));
            let trace = hashes.map(|hashes| short(&hashes.and_then(|hashes| hashes.trace.clone())));
            let ([old_scene, new_scene], [old_trace, new_trace]) = (scene, trace);
            add(&format!("scene {name}"), old_scene, new_scene);
            add(&format!("oracle of {name}"), old_trace, new_trace);
        }
        changes
    }

    /// The results that are others in `new`, a line each: verdicts, then points.
    pub fn different_results(&self, new: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        let mut add = |what: String, old: String, new: String| {
            if old != new {
                differences.push(format!("{what}: {old}, now {new}"));
            }
        };
        for (old, new, absent) in
            [(self.verdicts(), new.verdicts(), "not graded"), (self.points(), new.points(), "none")]
        {
            for name in old.keys().chain(new.keys()).collect::<BTreeSet<_>>() {
                let shown = |all: &BTreeMap<String, String>| {
                    all.get(name).map_or(absent, String::as_str).to_owned()
                };
                add(name.clone(), shown(&old), shown(&new));
            }
        }
        add("outcome".to_owned(), self.outcome.clone(), new.outcome.clone());
        differences
    }

    /// Verdicts by scene, and those of hidden scenes by feature.
    fn verdicts(&self) -> BTreeMap<String, String> {
        let mut verdicts = BTreeMap::new();
        for feature in &self.features {
            let scenes = feature.scenes.iter();
            verdicts.extend(scenes.map(|scene| (scene.name.clone(), scene.verdict.clone())));
            if let Some(hidden) = feature.hidden.as_ref().filter(|hidden| !hidden.is_empty()) {
                let counts: Vec<String> =
                    hidden.iter().map(|(verdict, count)| format!("{count} {verdict}")).collect();
                verdicts.insert(format!("hidden scenes of {}", feature.name()), counts.join(", "));
            }
        }
        verdicts
    }

    /// Points by feature and in sum.
    fn points(&self) -> BTreeMap<String, String> {
        let shown = |earned: Option<f64>, points: f64| match earned {
            Some(earned) => format!("{earned} of {points}"),
            None => format!("– of {points}"),
        };
        let features = self.features.iter();
        let features = features.map(|feature| {
            (format!("points of {}", feature.name()), shown(feature.points_earned, feature.points))
        });
        let sums =
            [("required points", &self.required), ("extra-credit points", &self.extra_credit)];
        let sums = sums.map(|(name, sum)| (name.to_owned(), shown(sum.points_earned, sum.points)));
        let creative = self.creative.iter().map(|creative| {
            (
                "points of the creative scene".to_owned(),
                shown(creative.points_earned, creative.points),
            )
        });
        features.chain(sums).chain(creative).collect()
    }
}

impl StoredFeature {
    fn name(&self) -> String {
        format!("{} / {}", self.group, self.integrator)
    }
}
