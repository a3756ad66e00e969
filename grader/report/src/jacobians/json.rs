//! Jacobian checks as JSON, with the data to reproduce the state of each finding.

use serde::Serialize;

use grader::white_box::{
    BlockFinding, CheckState, Difference, Entry, Estimate, Exhibit, JacobianCheck, NewtonCheck,
    PropertyFinding, Taylor,
};

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct JsonJacobian {
    /// The force's tag.
    force: &'static str,
    /// 2 or 3.
    dimension: usize,
    /// Whether every verdict is correct.
    pass: bool,
    /// States checked.
    states: usize,
    /// One entry per kind of block.
    blocks: Vec<JsonBlock>,
    /// Further properties of the force.
    properties: Vec<JsonProperty>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonBlock {
    /// "dF/dx direct", "dF/dx cross", "dF/dv direct" or "dF/dv cross".
    block: &'static str,
    /// "correct", "correct-zero", "wrong" or "inconclusive".
    verdict: &'static str,
    /// Why it is inconclusive: "disagreement", "kink", "degenerate", "cancellation" or "no-evidence".
    reason: Option<&'static str>,
    /// States at which the block was not zero (zero, for "correct-zero") and could be judged.
    evidence: usize,
    /// States at which an entry could not be judged.
    undecided: usize,
    /// Parameters that the block must depend on, but does at no state.
    unseen: Vec<&'static str>,
    /// The state that shows the verdict.
    exhibit: Option<JsonExhibit>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonExhibit {
    state: JsonState,
    /// The particle that the force acts on.
    row: usize,
    /// The particle whose position or velocity varies.
    column: usize,
    /// Error of the worst entry, relative to the block's largest entry.
    error: Option<f64>,
    /// Uncertainty of the error.
    uncertainty: Option<f64>,
    /// The worst entry: its axes, 0 for x, of the force and of the position or velocity.
    worst: (usize, usize),
    /// The block, row by row.
    entries: Vec<JsonEntry>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonEntry {
    /// The force's analytic value.
    analytic: Option<f64>,
    /// Bound of the rounding error of a correct formula.
    rounding: Option<f64>,
    /// By finite differences of the force; null at a kink, and if no step is exact.
    difference: Option<JsonEstimate>,
    /// Whether the force has a kink there.
    kink: bool,
    /// By dual numbers; null if the force is not the reference law.
    dual: Option<JsonEstimate>,
    /// Taylor's test: "consistent", "linear", "wrong" or "undecided".
    taylor: &'static str,
    /// The window of its slope.
    window: Option<JsonWindow>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonEstimate {
    value: Option<f64>,
    uncertainty: Option<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonWindow {
    slope: f64,
    /// The smallest and the largest step.
    steps: (f64, f64),
    /// How many steps.
    count: usize,
}

/// A state, exact to the last bit.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonState {
    name: String,
    /// Seconds.
    time: f64,
    masses: Vec<f64>,
    /// Particle by particle.
    positions: Vec<f64>,
    /// Particle by particle.
    velocities: Vec<f64>,
    forces: Vec<JsonForce>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonForce {
    force: &'static str,
    /// The particles that it acts on, in order; none if it acts on every particle.
    particles: Vec<usize>,
    /// The same if they are two; null otherwise.
    pair: Option<[usize; 2]>,
    parameters: Vec<JsonParameter>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonParameter {
    name: &'static str,
    value: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonProperty {
    /// "force", "symmetry", "translation", "rotation", "stencil", "gradient", "hessian" or "projection".
    property: &'static str,
    /// "correct", "wrong", "inconclusive" or "not-applicable".
    verdict: &'static str,
    /// Why it is inconclusive.
    reason: Option<&'static str>,
    /// States at which the property could be judged.
    evidence: usize,
    /// The largest violation, relative.
    error: Option<JsonEstimate>,
    /// The state with that violation.
    state: Option<JsonState>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct JsonNewton {
    integrator: &'static str,
    scene: &'static str,
    /// "correct", "wrong" or "inconclusive".
    verdict: &'static str,
    /// Linear systems solved.
    systems: usize,
    /// Systems that could be judged.
    evidence: usize,
    /// The largest difference between two entries, relative to the largest entry.
    error: Option<JsonEstimate>,
}

impl JsonJacobian {
    pub(crate) fn of(check: &JacobianCheck) -> Self {
        let dimension = check.dimension.count();
        Self {
            force: check.tag,
            dimension,
            pass: check.is_pass(),
            states: check.states,
            blocks: check.blocks.iter().map(|each| JsonBlock::of(each, dimension)).collect(),
            properties: check.properties.iter().map(JsonProperty::of).collect(),
        }
    }
}

impl JsonBlock {
    fn of(finding: &BlockFinding, dimension: usize) -> Self {
        Self {
            block: finding.kind.name(),
            verdict: finding.verdict.name(),
            reason: finding.verdict.reason().map(|reason| reason.name()),
            evidence: finding.evidence,
            undecided: finding.undecided,
            unseen: finding.unseen.clone(),
            exhibit: finding.exhibit.as_ref().map(|each| JsonExhibit::of(each, dimension)),
        }
    }
}

impl JsonExhibit {
    fn of(exhibit: &Exhibit, dimension: usize) -> Self {
        let Estimate { value, uncertainty } = exhibit.relative_error();
        Self {
            state: JsonState::of(&exhibit.state),
            row: exhibit.row,
            column: exhibit.column,
            error: finite(value),
            uncertainty: finite(uncertainty),
            worst: (exhibit.worst / dimension, exhibit.worst % dimension),
            entries: exhibit.entries.iter().map(JsonEntry::of).collect(),
        }
    }
}

impl JsonEntry {
    fn of(entry: &Entry) -> Self {
        let difference = match entry.difference {
            Difference::Smooth(estimate) => Some(JsonEstimate::of(estimate)),
            Difference::Kink | Difference::Unavailable => None,
        };
        let window = entry.taylor.window().map(|window| JsonWindow {
            slope: window.slope,
            steps: window.steps,
            count: window.count,
        });
        Self {
            analytic: finite(entry.analytic),
            rounding: finite(entry.rounding),
            difference,
            kink: entry.difference == Difference::Kink,
            dual: entry.second.map(JsonEstimate::of),
            taylor: match entry.taylor {
                Taylor::Consistent(_) => "consistent",
                Taylor::Linear => "linear",
                Taylor::Wrong(_) => "wrong",
                Taylor::Undecided => "undecided",
            },
            window,
        }
    }
}

impl JsonEstimate {
    fn of(estimate: Estimate) -> Self {
        Self { value: finite(estimate.value), uncertainty: finite(estimate.uncertainty) }
    }
}

impl JsonState {
    fn of(state: &CheckState) -> Self {
        let forces = state.scene.forces.iter().map(|force| JsonForce {
            force: force.schema.tag,
            particles: force.particles.to_vec(),
            pair: force.pair(),
            parameters: force
                .schema
                .parameters
                .iter()
                .zip(&force.parameters)
                .map(|(parameter, value)| JsonParameter { name: parameter.name, value: *value })
                .collect(),
        });
        Self {
            name: state.name.clone(),
            time: state.time,
            masses: state.masses(),
            positions: state.positions(),
            velocities: state.velocities(),
            forces: forces.collect(),
        }
    }
}

impl JsonProperty {
    fn of(finding: &PropertyFinding) -> Self {
        Self {
            property: finding.property.name(),
            verdict: finding.verdict.name(),
            reason: finding.verdict.reason().map(|reason| reason.name()),
            evidence: finding.evidence,
            error: finding.error.map(JsonEstimate::of),
            state: finding.state.as_ref().map(|state| JsonState::of(state)),
        }
    }
}

impl JsonNewton {
    pub(crate) fn of(check: &NewtonCheck) -> Self {
        Self {
            integrator: check.integrator,
            scene: check.scene,
            verdict: check.verdict.name(),
            systems: check.systems,
            evidence: check.evidence,
            error: check.error.map(JsonEstimate::of),
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
