//! Provenance in JSON reports, and the comparison of two reports: which inputs changed, and which results differ.
//!
//! A stored report is a student's file. It says what was graded, and nothing about how it is graded again: options that
//! give rights to programs, or decide verdicts, are compared and never taken over.

use std::collections::{BTreeMap, BTreeSet};

use grader::boundary::printed::{RawUse, Untrusted};
use grader::grading::provenance::{GradingOptions, Provenance, SceneHashes, SubmissionOrigin};
use serde::{Deserialize, Serialize};

use super::SCHEMA_VERSION;

/// Inputs and options of the report. Hashes are SHA-256.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct JsonProvenance {
    /// The commit that the grader was built from, followed by "-modified" if its sources differed; null if unknown.
    commit: Option<String>,
    /// Operating system and architecture that the grader was built for.
    platform: String,
    /// Hash of the rubric's file; null for the built-in rubric.
    rubric: Option<String>,
    /// Hash of the course pack and its starter code; null without a pack.
    pack: Option<String>,
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

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonSceneHashes {
    /// Hash of the scene file, followed by its mesh if it names one.
    scene: String,
    /// Hash of its oracle trace; null if it cannot be used.
    trace: Option<String>,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonSubmissionOrigin {
    /// Its path, as given.
    path: String,
    /// Hash of its files; null if they could not be read.
    files: Option<String>,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
            pack: provenance.pack.clone(),
            assignment: provenance.assignment.clone(),
            envelopes: provenance.envelopes.clone(),
            scenes: provenance.scenes.iter().map(scene).collect(),
            hidden: provenance.hidden.clone(),
            submission,
            options: JsonOptions { whole, jacobians, criteria, limits, readable, unprotected },
        }
    }
}

/// A JSON report that was read: its provenance, verdicts and points. All text in it is untrusted.
#[derive(Debug, Deserialize)]
pub struct StoredReport {
    grader_version: Untrusted,
    /// Name of the submission.
    pub submission: Untrusted,
    /// Name of the assignment; `None` if every scene was graded.
    pub assignment: Option<Untrusted>,
    outcome: Untrusted,
    protection: Option<Vec<Untrusted>>,
    required: StoredTotals,
    extra_credit: StoredTotals,
    creative: Option<StoredCreative>,
    #[serde(default)]
    adjustments: Vec<StoredAdjustment>,
    features: Vec<StoredFeature>,
    provenance: Option<StoredProvenance>,
    /// Everything in it, by its keys.
    #[serde(skip)]
    whole: serde_json::Map<String, serde_json::Value>,
}

/// Keys of a report's results that verdicts and points do not show.
const OTHER_RESULTS: [&str; 7] =
    ["required", "extra_credit", "unscored", "creative", "hidden", "copied", "repetition"];

/// Keys of a report that are no results.
const NO_RESULTS: [&str; 7] = [
    "adjustments",
    "schema_version",
    "grader_version",
    "submission",
    "protection",
    "protection_missing",
    "provenance",
];

/// Content of [`JsonProvenance`].
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredProvenance {
    commit: Option<Untrusted>,
    platform: Untrusted,
    rubric: Option<Untrusted>,
    pack: Option<Untrusted>,
    assignment: Option<Untrusted>,
    envelopes: Option<Untrusted>,
    scenes: BTreeMap<Untrusted, StoredHashes>,
    hidden: Option<Untrusted>,
    submission: Option<StoredOrigin>,
    options: StoredOptions,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredHashes {
    scene: Untrusted,
    trace: Option<Untrusted>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredOrigin {
    #[expect(dead_code, reason = "a report does not say which files are graded again")]
    path: Untrusted,
    files: Option<Untrusted>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredOptions {
    whole: bool,
    jacobians: bool,
    criteria: Option<Untrusted>,
    limits: Vec<(Untrusted, f64)>,
    readable: Vec<Untrusted>,
    unprotected: bool,
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
struct StoredAdjustment {
    points: f64,
}

#[derive(Debug, Deserialize)]
struct StoredFeature {
    group: Untrusted,
    integrator: Untrusted,
    points: f64,
    points_earned: Option<f64>,
    scenes: Vec<StoredScene>,
    hidden: Option<BTreeMap<Untrusted, usize>>,
}

#[derive(Debug, Deserialize)]
struct StoredScene {
    name: Untrusted,
    verdict: Untrusted,
}

/// A file that is no report whose grading could be repeated.
#[derive(Debug, thiserror::Error)]
pub enum StoredError {
    /// It is not a report as JSON.
    #[error(
        "{line}: not a JSON report of grade: {}\n  help: write one with --report json=FILE",
        message.line()
    )]
    Invalid {
        /// Line, from 1.
        line: usize,
        /// Why; it may quote the file.
        message: Untrusted,
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
    /// It gives two results for the same scene or points.
    #[error("1: two results of {}; grade writes one", name.line())]
    Repeated {
        /// The hashed input.
        name: Untrusted,
    },
}

/// Results by name.
type Results = BTreeMap<Untrusted, Untrusted>;

/// Names on one line; `None` without any.
fn list(names: &[Untrusted]) -> Option<String> {
    let names: Vec<String> = names.iter().map(Untrusted::line).collect();
    (!names.is_empty()).then(|| names.join(" "))
}

impl StoredOptions {
    /// The options that give programs rights or decide verdicts: they are compared, and never taken over.
    fn shown(&self) -> [(&'static str, Option<String>); 5] {
        let yes = |is: bool| Some(if is { "yes" } else { "no" }.to_owned());
        let limit =
            |(name, value): &(Untrusted, f64)| Untrusted::from(format!("{}={value}", name.line()));
        [
            ("--unprotected", yes(self.unprotected)),
            ("--readable", list(&self.readable)),
            ("--limit", list(&self.limits.iter().map(limit).collect::<Vec<_>>())),
            ("--criteria", self.criteria.as_ref().map(Untrusted::line)),
            ("--no-jacobians", yes(!self.jacobians)),
        ]
    }
}

/// The start of a hash of a stored report.
fn short(hash: Option<&Untrusted>) -> Option<String> {
    hash.map(|hash| short_hash(&hash.line()))
}

/// The start of a hash, as texts show it.
pub(crate) fn short_hash(hash: &str) -> String {
    hash.chars().take(12).collect()
}

impl StoredReport {
    /// Reads a report.
    ///
    /// # Errors
    /// If it is no report of this version with provenance, or contradicts itself.
    pub fn parse(text: &Untrusted) -> Result<Self, StoredError> {
        #[derive(Deserialize)]
        struct Version {
            schema_version: u32,
        }
        let text = text.raw(RawUse::Parsing);
        let invalid = |error: serde_json::Error| StoredError::Invalid {
            line: error.line(),
            message: error.to_string().into(),
        };
        let Version { schema_version: found } = serde_json::from_str(text).map_err(invalid)?;
        if found != SCHEMA_VERSION {
            return Err(StoredError::OtherVersion { found });
        }
        let mut report: Self = serde_json::from_str(text).map_err(invalid)?;
        report.whole = serde_json::from_str(text).map_err(invalid)?;
        let mut names = BTreeSet::new();
        let results = report.verdicts().chain(report.points()).map(|(name, _)| name);
        if let Some(name) = results.into_iter().find(|name| !names.insert(name.clone())) {
            return Err(StoredError::Repeated { name });
        }
        report.provenance.is_some().then_some(report).ok_or(StoredError::NoProvenance)
    }

    /// Whether every scene of the assignment was graded, and not a selection.
    pub fn is_whole(&self) -> bool {
        self.provenance.as_ref().is_none_or(|provenance| provenance.options.whole)
    }

    /// The start of the hash of the submission's files; `None` if the report has none.
    pub fn files(&self) -> Option<String> {
        short(self.provenance.as_ref()?.submission.as_ref()?.files.as_ref())
    }

    /// The marks of its creative scene; `None` if the scenes of the class were not marked.
    pub fn marks(&self) -> Option<&[[f64; 3]]> {
        self.creative.as_ref().map(|creative| creative.marks.as_slice())
    }

    /// The sum of its adjustments; `None` if it has none.
    pub fn adjusted(&self) -> Option<f64> {
        self.adjustments.iter().map(|adjustment| adjustment.points).reduce(|a, b| a + b)
    }

    /// Whether it is about a scene of this name.
    pub fn has_scene(&self, name: &str) -> bool {
        let scenes = self.provenance.as_ref().map(|provenance| &provenance.scenes);
        scenes.is_some_and(|scenes| scenes.contains_key(&name.into()))
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
        let grader = |report: &Self, inputs: &StoredProvenance| {
            let commit = inputs.commit.as_ref().map(|commit| format!(", commit {}", commit.line()));
            let (version, platform) = (report.grader_version.line(), inputs.platform.line());
            Some(format!("{version}{}, {platform}", commit.unwrap_or_default()))
        };
        add("grader", grader(self, old_inputs), grader(new, new_inputs));
        let protection = |report: &Self| report.protection.as_deref().and_then(list);
        add("protection", protection(self), protection(new));
        let [then, now] = [old_inputs, new_inputs].map(|inputs| inputs.options.shown());
        for ((what, then), (_, now)) in then.into_iter().zip(now) {
            add(what, then, now);
        }
        for (what, of) in [
            ("rubric", (|inputs| &inputs.rubric) as fn(&StoredProvenance) -> &Option<Untrusted>),
            ("pack", |inputs| &inputs.pack),
            ("assignment", |inputs| &inputs.assignment),
            ("envelopes of the oracle", |inputs| &inputs.envelopes),
            ("hidden scenes", |inputs| &inputs.hidden),
        ] {
            add(what, short(of(old_inputs).as_ref()), short(of(new_inputs).as_ref()));
        }
        add("submission", self.files(), new.files());
        let names = old_inputs.scenes.keys().chain(new_inputs.scenes.keys());
        for name in names.collect::<BTreeSet<_>>() {
            let hashes = [old_inputs, new_inputs].map(|inputs| inputs.scenes.get(name));
            let [old_scene, new_scene] = hashes.map(|hashes| short(hashes.map(|of| &of.scene)));
            let [old_trace, new_trace] =
                hashes.map(|hashes| short(hashes.and_then(|of| of.trace.as_ref())));
            let name = name.line();
            add(&format!("scene {name}"), old_scene, new_scene);
            add(&format!("oracle of {name}"), old_trace, new_trace);
        }
        changes
    }

    /// The results that are others in `new`, a line each: verdicts, then points.
    pub fn different_results(&self, new: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        let mut add = |what: &Untrusted, old: &Untrusted, new: &Untrusted| {
            if old != new {
                differences.push(format!("{}: {}, now {}", what.line(), old.line(), new.line()));
            }
        };
        let pairs: [fn(&Self) -> Results; 2] =
            [|report| report.verdicts().collect(), |report| report.points().collect()];
        for (of, absent) in pairs.into_iter().zip(["not graded", "none"]) {
            let (old, new, absent) = (of(self), of(new), absent.into());
            for name in old.keys().chain(new.keys()).collect::<BTreeSet<_>>() {
                let [old, new] = [&old, &new].map(|all| all.get(name).unwrap_or(&absent));
                add(name, old, new);
            }
        }
        add(&"outcome".into(), &self.outcome, &new.outcome);
        if differences.is_empty() {
            let others = OTHER_RESULTS.into_iter().filter(|key| self.has_other(key, new));
            differences.extend(others.map(|key| format!("{key}: not the same counts or names")));
        }
        differences
    }

    /// The other parts that are not the same in `new`. They hold numbers that may depend on the machine.
    pub fn different_parts<'a>(&self, new: &'a Self) -> Vec<&'a str> {
        let is_part = |key: &&String| {
            !OTHER_RESULTS.contains(&key.as_str()) && !NO_RESULTS.contains(&key.as_str())
        };
        let parts = new.whole.keys().filter(is_part).filter(|key| self.has_other(key, new));
        parts.map(String::as_str).collect()
    }

    fn has_other(&self, key: &str, new: &Self) -> bool {
        self.whole.get(key) != new.whole.get(key)
    }

    /// Verdicts by scene, and those of hidden scenes by feature.
    fn verdicts(&self) -> impl Iterator<Item = (Untrusted, Untrusted)> {
        self.features.iter().flat_map(|feature| {
            let scenes = feature.scenes.iter();
            let shipped = scenes.map(|scene| (scene.name.clone(), scene.verdict.clone()));
            let hidden =
                feature.hidden.as_ref().filter(|hidden| !hidden.is_empty()).map(|hidden| {
                    let raw = |verdict: &Untrusted| verdict.raw(RawUse::Part).to_owned();
                    let counts: Vec<String> = hidden
                        .iter()
                        .map(|(verdict, count)| format!("{count} {}", raw(verdict)))
                        .collect();
                    let name = format!("hidden scenes of {}", feature.name());
                    (name.into(), counts.join(", ").into())
                });
            shipped.chain(hidden)
        })
    }

    /// Points by feature and in sum.
    fn points(&self) -> impl Iterator<Item = (Untrusted, Untrusted)> {
        let shown = |name: String, earned: Option<f64>, points: f64| {
            let earned = earned.map_or("–".to_owned(), |earned| earned.to_string());
            (name.into(), format!("{earned} of {points}").into())
        };
        let features = self.features.iter().map(move |feature| {
            let name = format!("points of {}", feature.name());
            shown(name, feature.points_earned, feature.points)
        });
        let sums =
            [("required points", &self.required), ("extra-credit points", &self.extra_credit)];
        let sums = sums.map(|(name, sum)| shown(name.to_owned(), sum.points_earned, sum.points));
        let creative = self.creative.iter().map(move |creative| {
            let name = "points of the creative scene".to_owned();
            shown(name, creative.points_earned, creative.points)
        });
        features.chain(sums).chain(creative)
    }
}

impl StoredFeature {
    /// Its name, as it stands in the file.
    fn name(&self) -> String {
        let [group, integrator] =
            [&self.group, &self.integrator].map(|text| text.raw(RawUse::Part));
        format!("{group} / {integrator}")
    }
}
