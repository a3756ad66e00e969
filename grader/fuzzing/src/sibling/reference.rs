//! The motion of a scene, to hold its sibling against.
//!
//! ```text
//! special      a mass, a parameter, the time step or a rest direction that hides mistakes
//! close        the nearest particles are at least half as far from each other, relative to the scene's size
//! fails        every step succeeds
//! blows up     the largest kinetic energies at h and h/2 agree within a factor of ten, as those of the original
//! chaotic      the tolerance at the end is at most 1e-11, or ten times the original's; a horizon, if the original has one
//! ```
//!
//! An unstable step shows twice: as a kinetic energy that follows the time step, and as rounding errors that grow.

use grader::compare::calibration::{Bound, Envelope, calibrate};
use grader::compare::{Calibrated, Comparison, Criteria, Expectation, compare};
use grader::creative;
use grader::submission::StateSource;
use scene::Scene;
use scene::trace::State;

use super::Fault;
use crate::motion::{Replay, simulate};

/// Minimum ratio of the sibling's smallest distance between particles to the original's, both relative to the size.
const CLOSE: f64 = 0.5;

/// Tolerance at the end that any sibling may have, of a coordinate of 1: four of five scenes of the suite stay below it.
const TIGHT: f64 = 1e-11;

/// Maximum ratio of the tolerances at the end of a sibling and of its original.
const WIDER: f64 = 10.0;

/// A scene with its states and its tolerances.
#[derive(Debug)]
pub struct Reference {
    scene: Scene,
    states: Vec<State>,
    envelope: Envelope,
    /// Whether the motion follows the time step; `None` if a step of half the length fails.
    blows_up: Option<bool>,
}

impl Reference {
    /// Simulates a scene, and measures its tolerances.
    ///
    /// # Errors
    /// If a step fails.
    pub fn of(scene: &Scene) -> Result<Self, Fault> {
        let states = simulate(scene).map_err(Fault::Fails)?;
        let blows_up = creative::blows_up(scene).ok();
        Ok(Self { scene: scene.clone(), states, envelope: calibrate(scene), blows_up })
    }

    /// Simulates a sibling, unless it is less well-posed than this scene.
    ///
    /// # Errors
    /// Why it is no sibling.
    pub fn of_sibling(&self, scene: &Scene) -> Result<Self, Fault> {
        check_values(scene)?;
        if distance(scene) < CLOSE * distance(&self.scene) {
            return Err(Fault::Close);
        }
        // Steps and numbers differ from try to try.
        let states = simulate(scene).map_err(|_| Fault::Fails("a step fails".to_owned()))?;
        let blows_up = creative::blows_up(scene).ok();
        if blows_up != Some(false) && blows_up != self.blows_up {
            return Err(Fault::BlowsUp);
        }
        let sibling = Self { scene: scene.clone(), states, envelope: calibrate(scene), blows_up };
        let is_wide = sibling.width() > TIGHT.max(WIDER * self.width());
        let has_other_horizon =
            sibling.envelope.horizon.is_some() != self.envelope.horizon.is_some();
        if is_wide || has_other_horizon || sibling.envelope.variants < self.envelope.variants {
            return Err(Fault::Chaotic);
        }
        Ok(sibling)
    }

    /// The tolerance at the end, of a coordinate of 1.
    fn width(&self) -> f64 {
        let last = self.envelope.at(self.scene.n_steps());
        Bound::of(last.position.max(last.velocity), 1.0).tolerance
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Compares other states with these, by calibrated tolerances.
    pub fn compare(&self, actual: &mut dyn StateSource) -> Comparison {
        let criteria = Criteria::Calibrated(Calibrated::new(self.envelope.clone(), &self.scene));
        let mut states = Replay::of(&self.states);
        compare(&mut states, actual, Expectation::of(&self.scene), criteria)
    }
}

/// Whether values hide mistakes: 1 in the place of another number, and springs along an axis.
fn check_values(scene: &Scene) -> Result<(), Fault> {
    let is_one = |what: &str| Fault::Special(format!("{what} is 1"));
    if scene.time_step == 1.0 {
        return Err(is_one("the time step"));
    }
    if scene.particles.iter().any(|particle| particle.mass == 1.0) {
        return Err(is_one("a mass"));
    }
    for force in &scene.forces {
        let values = force.schema.parameters.iter().zip(&force.parameters);
        let mut values = values.filter(|(parameter, value)| {
            parameter.coordinate.is_none() && parameter.default != Some(**value)
        });
        if let Some((parameter, _)) = values.find(|(_, value)| **value == 1.0) {
            return Err(is_one(parameter.name));
        }
        for pair in force.particles.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|end| scene.particles[end].position);
            let axes = scene.dimension.count();
            if (0..axes).filter(|axis| a[*axis] != b[*axis]).count() < 2 {
                return Err(Fault::Special(format!("a <{}> lies along an axis", force.schema.tag)));
            }
        }
    }
    Ok(())
}

/// The smallest distance between two particles, relative to the size of the scene.
fn distance(scene: &Scene) -> f64 {
    let squared =
        |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let places: Vec<[f64; 3]> = scene.particles.iter().map(|particle| particle.position).collect();
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for (number, place) in places.iter().enumerate() {
        for other in &places[..number] {
            let squared = squared(place, other);
            (smallest, largest) = (smallest.min(squared), largest.max(squared));
        }
    }
    if largest > 0.0 { (smallest / largest).sqrt() } else { 0.0 }
}
