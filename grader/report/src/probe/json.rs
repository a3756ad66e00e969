//! Black-box probe as JSON, with scenes that reproduce each mistake.
//!
//! The schema is `docs/probe.schema.json`. Non-finite numbers are `null`.

use serde::Serialize;

use grader::probe::{self, Entry, Finding, PartReport, Probing, Replay, Space};

/// Version of the schema.
pub const SCHEMA_VERSION: u32 = 1;

/// The report as JSON, with a newline at its end.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub fn render(probing: &Probing) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&JsonProbing::of(probing))? + "\n")
}

/// Forces and Jacobians of one submission, measured from single steps.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(title = "Spring Oracle probe"))]
pub(crate) struct JsonProbing {
    /// Version of this schema.
    schema_version: u32,
    /// Version of the grader.
    grader_version: &'static str,
    /// Name of the submission.
    submission: String,
    /// The gravest verdict: "correct", "not-offered", "inconclusive" or "wrong".
    verdict: &'static str,
    /// The methods that the submission offers in two and in three dimensions.
    spaces: Vec<JsonSpace>,
    /// Required forces that could not be measured.
    missing: Vec<String>,
    /// One entry per part of a force and dimension.
    parts: Vec<JsonPart>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonSpace {
    /// 2 or 3.
    dimension: usize,
    /// The method used to measure forces, as the submission spells it; null if there is none.
    explicit: Option<&'static str>,
    /// Linearized implicit Euler, as the submission spells it; null if there is none.
    implicit: Option<&'static str>,
    /// Why a method is not offered.
    reason: Option<String>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonPart {
    /// The force's tag.
    force: &'static str,
    /// The part of the force.
    part: &'static str,
    /// Description of the part.
    meaning: &'static str,
    /// 2 or 3.
    dimension: usize,
    /// The gravest verdict of its findings.
    verdict: &'static str,
    /// The force against the reference; the step against its equation; each block of the Jacobian against finite
    /// differences of the submission's own force.
    findings: Vec<JsonFinding>,
    /// Likely mistakes.
    diagnosis: Vec<String>,
    /// Data to reproduce the mistake; null if all findings are correct or not offered.
    replay: Option<JsonReplay>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonFinding {
    /// "force", "step", "dF/dx direct", "dF/dx cross", "dF/dv direct" or "dF/dv cross".
    name: &'static str,
    /// "correct", "not-offered", "inconclusive" or "wrong".
    verdict: &'static str,
    /// Reason of the verdict; may be empty.
    reason: String,
    /// Largest difference, relative to the largest entry; for the step, the residual of its equations.
    error: Option<f64>,
    /// Largest bound of noise, relative to the largest entry.
    bound: Option<f64>,
    /// The entry with the largest error relative to its bound.
    worst: Option<JsonEntry>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonEntry {
    /// Number of the state; the entry of a force may be at a state near it.
    state: usize,
    /// Particle and axis of the force.
    row: (usize, usize),
    /// Particle and axis of the position or velocity; null for a force.
    column: Option<(usize, usize)>,
    /// The value that the submission's steps use; for a force, its value.
    measured: Option<f64>,
    /// By finite differences of the submission's own force; for a force, the reference value.
    expected: Option<f64>,
    ours: Option<f64>,
    /// Largest difference of measured and expected that noise explains.
    bound: Option<f64>,
    /// The block of the entry, row by row: measured, then expected.
    block: Option<[Vec<f64>; 2]>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonReplay {
    /// Number of the state.
    state: usize,
    /// Positions, particle by particle.
    positions: Vec<f64>,
    /// Velocities, particle by particle.
    velocities: Vec<f64>,
    /// A scene (XML) whose explicit step gives the force there, once for each combination of masses.
    explicit_scene: String,
    /// A scene whose implicit step evaluates force and Jacobian there; empty if no step was taken.
    implicit_scene: String,
}

impl JsonProbing {
    pub(crate) fn of(probing: &Probing) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            grader_version: env!("CARGO_PKG_VERSION"),
            submission: probing.name.line(),
            verdict: probing.verdict().name(),
            spaces: probing.spaces.iter().map(JsonSpace::of).collect(),
            missing: probing.missing().into_iter().map(str::to_owned).collect(),
            parts: probing.parts.iter().map(JsonPart::of).collect(),
        }
    }
}

impl JsonSpace {
    fn of(space: &Space) -> Self {
        let failure = space.explicit.as_ref().err().or(space.implicit.as_ref().err());
        Self {
            dimension: space.dimension.count(),
            explicit: space.explicit.as_ref().ok().copied(),
            implicit: space.implicit.as_ref().ok().copied(),
            reason: failure.map(ToString::to_string),
        }
    }
}

impl JsonPart {
    fn of(part: &PartReport) -> Self {
        let replay = part.replay.as_ref().map(|replay| JsonReplay::of(part, replay));
        Self {
            force: part.force,
            part: part.part,
            meaning: part.meaning,
            dimension: part.dimension.count(),
            verdict: part.verdict().name(),
            findings: part
                .findings()
                .map(|(name, finding)| JsonFinding::of(name, finding))
                .collect(),
            diagnosis: part.diagnosis.clone(),
            replay,
        }
    }
}

impl JsonFinding {
    fn of(name: &'static str, finding: &Finding) -> Self {
        Self {
            name,
            verdict: finding.verdict.name(),
            reason: finding.reason.clone(),
            error: finding.error.and_then(finite),
            bound: finding.bound.and_then(finite),
            worst: finding.worst.as_ref().map(JsonEntry::of),
        }
    }
}

impl JsonEntry {
    fn of(entry: &Entry) -> Self {
        Self {
            state: entry.state,
            row: entry.row,
            column: entry.column,
            measured: finite(entry.measured),
            expected: finite(entry.expected),
            ours: finite(entry.ours),
            bound: finite(entry.bound),
            block: entry.block.as_ref().map(|[used, own, _]| [used.clone(), own.clone()]),
        }
    }
}

impl JsonReplay {
    fn of(part: &PartReport, replay: &Replay) -> Self {
        let (positions, velocities) =
            probe::state(part.dimension, replay.state).unwrap_or_default();
        Self {
            state: replay.state,
            positions,
            velocities,
            explicit_scene: replay.explicit.clone(),
            implicit_scene: replay.implicit.clone(),
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[test]
fn documented_schema_is_current() {
    let schema = serde_json::to_string_pretty(&schemars::schema_for!(JsonProbing)).unwrap() + "\n";
    let command = "cargo test --release -p report schema";
    test_support::assert_document("probe.schema.json", &schema, command);
}
