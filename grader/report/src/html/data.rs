//! A recording as data for the scripts of a page.
//!
//! Arrays of 16-bit numbers are base64 of little-endian bytes. Series have four digits; exact states have all.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use frames::StrainPalette;
use grader::compare::recording::{Recording, Residual};
use grader::grading::SceneResult;
use grader::suite::Case;
use scene::state::Energies;
use serde::Serialize;

/// Data of a scene's page.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct SceneData<'a> {
    dimension: usize,
    time_step: f64,
    n_states: u64,
    /// Radius of each particle, or one for all.
    radii: Vec<f64>,
    fixed: Vec<usize>,
    edges: Vec<[usize; 2]>,
    /// Pairs of particles with a force between them, but no edge.
    pairs: Vec<[usize; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    strain: Option<StrainPalette>,
    first_wrong: Option<FirstWrong>,
    /// The first state that is not compared.
    horizon: Option<u64>,
    frames: &'a [u64],
    low: &'a [f64],
    unit: f64,
    positions: String,
    /// Empty where the submission agrees with the oracle to the eye.
    differences: String,
    /// The forces at the states of the frames; empty where none acts.
    forces: String,
    /// Frames of the submission.
    n_got: usize,
    residuals: [Series; 2],
    energies: EnergySeries,
    exact: Exact<'a>,
}

#[derive(Serialize)]
struct FirstWrong {
    step: u64,
    particle: usize,
}

/// Residuals of a quantity, by state.
#[derive(Default, Serialize)]
struct Series {
    steps: Vec<u64>,
    values: Vec<Option<f64>>,
    tolerances: Vec<Option<f64>>,
    envelopes: Vec<Option<f64>>,
}

/// Energies and momentum, by state.
#[derive(Default, Serialize)]
struct EnergySeries {
    steps: Vec<u64>,
    expected: EnergyColumns,
    got: EnergyColumns,
}

#[derive(Default, Serialize)]
struct EnergyColumns {
    kinetic: Vec<Option<f64>>,
    potential: Vec<Option<f64>>,
    total: Vec<Option<f64>>,
    /// One column an axis.
    momentum: Vec<Vec<Option<f64>>>,
}

#[derive(Serialize)]
struct Exact<'a> {
    particles: &'a [usize],
    steps: Vec<u64>,
    /// One row a state: position, then velocity, of each particle.
    expected: Vec<&'a [f64]>,
    got: Vec<&'a [f64]>,
}

/// The data of a scene's page as JSON.
pub(super) fn render(
    case: &Case,
    result: &SceneResult,
    recording: &Recording,
) -> serde_json::Result<String> {
    let scene = &case.scene;
    let mut radii: Vec<f64> =
        scene.particles.iter().map(|particle| short(particle.radius).unwrap_or(0.0)).collect();
    if radii.windows(2).all(|pair| pair[0] == pair[1]) {
        radii.truncate(1);
    }
    let fixed = scene.particles.iter().enumerate().filter(|(_, particle)| particle.fixed);
    let unseen = scene.forces.iter().filter(|element| element.edge.is_none());
    let first_wrong = result.comparison.first_wrong.as_ref();
    let is_same = result.comparison.verdict.is_pass();
    let coordinates = (recording.n_particles * recording.dimension).max(1);
    serde_json::to_string(&SceneData {
        dimension: recording.dimension,
        time_step: scene.time_step,
        n_states: recording.n_states,
        radii,
        fixed: fixed.map(|(number, _)| number).collect(),
        edges: scene.edges.iter().map(|edge| edge.particles).collect(),
        pairs: unseen
            .flat_map(|element| element.particles.windows(2))
            .map(|pair| [pair[0], pair[1]])
            .collect(),
        strain: StrainPalette::of(scene),
        first_wrong: first_wrong
            .map(|first| FirstWrong { step: first.place.step, particle: first.place.particle }),
        horizon: horizon(result),
        frames: &recording.frames,
        low: &recording.low,
        unit: recording.unit,
        positions: base64(&recording.positions),
        differences: if is_same { String::new() } else { base64(&recording.differences) },
        forces: if recording.forces.iter().all(|half| half << 1 == 0) {
            String::new()
        } else {
            base64(&recording.forces)
        },
        n_got: recording.differences.len() / coordinates,
        residuals: [
            Series::of(recording.residuals.iter().map(|each| each.position)),
            Series::of(recording.residuals.iter().map(|each| each.velocity)),
        ],
        energies: EnergySeries::of(recording),
        exact: Exact {
            particles: &recording.exact_particles,
            steps: recording.exact.iter().map(|state| state.step).collect(),
            expected: recording.exact.iter().map(|state| &*state.expected).collect(),
            got: recording.exact.iter().map(|state| &*state.got).collect(),
        },
    })
}

fn horizon(result: &SceneResult) -> Option<u64> {
    match &result.criteria {
        grader::compare::Criteria::Calibrated(calibrated) => {
            calibrated.envelope.horizon.map(|horizon| horizon.step)
        }
        grader::compare::Criteria::Fixed(_) => None,
    }
}

impl Series {
    fn of(residuals: impl Iterator<Item = Residual>) -> Self {
        let mut series = Self::default();
        for Residual { step, value, bound } in residuals {
            series.steps.push(step);
            series.values.push(short(value));
            series.tolerances.push(bound.and_then(|bound| short(bound.tolerance)));
            // An envelope of 0 is none.
            let envelope = bound.map(|bound| bound.envelope).filter(|envelope| *envelope > 0.0);
            series.envelopes.push(envelope.and_then(short));
        }
        series
    }
}

impl EnergySeries {
    fn of(recording: &Recording) -> Self {
        let pairs = &recording.energies;
        Self {
            steps: pairs.iter().map(|pair| pair.step).collect(),
            expected: EnergyColumns::of(
                recording.dimension,
                pairs.iter().map(|pair| Some(&pair.expected)),
            ),
            got: EnergyColumns::of(recording.dimension, pairs.iter().map(|pair| pair.got.as_ref())),
        }
    }
}

impl EnergyColumns {
    fn of<'a>(dimension: usize, energies: impl Iterator<Item = Option<&'a Energies>>) -> Self {
        let mut columns = Self { momentum: vec![Vec::new(); dimension], ..Self::default() };
        for energies in energies {
            let of =
                |value: fn(&Energies) -> f64| energies.and_then(|energies| short(value(energies)));
            columns.kinetic.push(of(|energies| energies.kinetic));
            columns.potential.push(of(|energies| energies.potential));
            columns.total.push(of(|energies| energies.kinetic + energies.potential));
            for (axis, column) in columns.momentum.iter_mut().enumerate() {
                column.push(energies.and_then(|energies| short(energies.momentum[axis])));
            }
        }
        columns
    }
}

/// The number rounded to five digits; `None` if it is not finite.
pub(super) fn short(value: f64) -> Option<f64> {
    format!("{value:.4e}").parse().ok().filter(|value: &f64| value.is_finite())
}

/// Base64 of the little-endian bytes of these numbers.
pub(super) fn base64(values: &[u16]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_have_five_digits() {
        assert_eq!(short(0.123_456_789), Some(0.123_46));
        assert_eq!(short(f64::INFINITY), None);
        assert_eq!(short(-0.0), Some(-0.0));
    }
}
