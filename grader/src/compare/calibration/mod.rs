//! Calibrated tolerances: the differences between correct programs, measured for each scene when the oracle is made.
//!
//! ```text
//! envelope(k)   the largest distance, over the particles and states 0 … k, between the oracle's trace and those
//!               of equally correct variants; separate for positions and velocities
//! tolerance(k)  F (envelope(k) + 4 ε size(k))        F = 10, ε = 2⁻⁵², size: the largest coordinate so far
//! ```
//!
//! **The factor.** A program differs from the oracle in up to six kinds of things at once ([`Class`]). Each has the
//! effect of one variant, and independent effects add up to √6 times as much. Each kind was sampled two to eight times;
//! the largest sample is within a factor of four of the worst case that is likely among many programs. F = 4 √6,
//! rounded. A test leaves out the kinds order, formula and stopping in turn, and checks that each stays within the
//! tolerance that the others give.
//!
//! **The floor.** It allows a program to write 15 digits, the number that every f64 has. Half a unit of the fifteenth
//! digit is 5e-15 of a coordinate, and √3 times that for three coordinates; `F · 4 ε` is 8.9e-15.
//!
//! **The horizon.** In chaotic motion the envelope grows until it is meaningless. The horizon is the first state whose
//! tolerance is a thousandth of the extent of the motion. States are compared before it. From there on, energy and
//! momentum are compared, each with three times the largest difference between the variants. That difference no longer
//! grows, because the variants' trajectories are no longer correlated, and a correct program is one more of them. Of a
//! scene with a horizon, each step is also redone from the trace's own states ([`SingleSteps`]).
//!
//! Cost: two dozen runs of the scene, in lockstep. Memory: the states of all runs, and some dozens of checkpoints.

mod envelope;
mod single;
mod variant;

use scene::Scene;
use simulator::solver::linear::LinearSolver;

pub use diagnosis::bound::{Bound, FACTOR};
pub use envelope::{Bounds, Envelope, Horizon, StoredEnvelope};
pub use single::{SingleStep, SingleSteps, WrongStep};
pub use variant::Class;

use diagnosis::stepping::{Invariants, Stepper};
use envelope::Builder;
use variant::{Variant, variants};

/// Ratio of the tolerance to the variants' difference in energy and momentum, beyond the horizon.
pub const FACTOR_BEYOND: f64 = 3.0;

/// The tolerance that defines the horizon, relative to the extent of the motion.
const PREDICTABLE: f64 = 1e-3;

/// Measures the envelope of a scene.
pub fn calibrate(scene: &Scene) -> Envelope {
    calibrate_with(scene, variants(scene)).envelope
}

/// The same with the variants of some kinds only.
pub fn calibrate_by(scene: &Scene, wanted: impl Fn(Class) -> bool) -> Calibration {
    let mut chosen = variants(scene);
    chosen.retain(|variant| wanted(variant.class));
    calibrate_with(scene, chosen)
}

/// The envelope of a scene, and whether it can be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The envelope, of the variants that take each step.
    pub envelope: Envelope,
    /// Whether every step of every variant succeeds.
    pub is_sound: bool,
}

fn calibrate_with(scene: &Scene, mut variants: Vec<Variant>) -> Calibration {
    let count = variants.len();
    let extent = Extent::of(scene);
    let physics = Stepper::new(scene, LinearSolver::Auto);
    let mut oracle = Variant::plain(scene);
    let mut builder = Builder::new(variants.len());
    for step in 0..=scene.n_steps() {
        if step > 0 {
            if !oracle.advance() {
                variants.clear();
                break;
            }
            // A variant whose step fails is not a correct program.
            variants.retain_mut(Variant::advance);
        }
        let bounds = largest(&oracle, &variants, scene.dimension.count());
        if builder.is_predictable() && extent.is_outrun(bounds) {
            builder.end_at(step);
        }
        if builder.is_predictable() {
            builder.add(step, bounds);
        } else {
            let invariants = |variant: &Variant| {
                let (positions, velocities) = variant.state();
                physics.invariants(step, &positions, &velocities)
            };
            let expected = invariants(&oracle);
            for variant in &variants {
                builder.add_beyond(difference(expected, invariants(variant)));
            }
        }
    }
    Calibration { envelope: builder.finish(), is_sound: variants.len() == count }
}

/// Difference in energy and in momentum.
pub(crate) fn difference(a: Invariants, b: Invariants) -> (f64, f64) {
    let momentum = a.momentum.iter().zip(b.momentum).map(|(a, b)| (a - b) * (a - b));
    ((a.energy - b.energy).abs(), momentum.sum::<f64>().sqrt())
}

/// The largest distances between the oracle's state and those of the variants.
fn largest(oracle: &Variant, variants: &[Variant], dimension: usize) -> Bounds {
    let n_places = oracle.state().0.len();
    let mut bounds = Bounds::default();
    for variant in variants {
        for particle in 0..n_places / dimension {
            let (mut position, mut velocity) = (0.0_f64, 0.0_f64);
            for axis in 0..dimension {
                let place = particle * dimension + axis;
                let ((x, v), (other_x, other_v)) = (oracle.at(place), variant.at(place));
                position += (x - other_x) * (x - other_x);
                velocity += (v - other_v) * (v - other_v);
            }
            bounds.position = bounds.position.max(position.sqrt());
            bounds.velocity = bounds.velocity.max(velocity.sqrt());
        }
    }
    bounds
}

/// Extent of the motion: largest displacement and speed.
struct Extent {
    length: f64,
    speed: f64,
}

impl Extent {
    fn of(scene: &Scene) -> Self {
        let dimension = scene.dimension.count();
        let mut run = Variant::plain(scene);
        let (mut low, mut high, mut speed) = ([f64::MAX; 3], [f64::MIN; 3], 0.0_f64);
        let mut steps = 0;
        loop {
            let (positions, velocities) = run.state();
            for (place, (position, velocity)) in positions.iter().zip(&velocities).enumerate() {
                let axis = place % dimension;
                low[axis] = low[axis].min(*position);
                high[axis] = high[axis].max(*position);
                speed = speed.max(velocity.abs());
            }
            if steps == scene.n_steps() || !run.advance() {
                break;
            }
            steps += 1;
        }
        let sides = (0..dimension).map(|axis| high[axis] - low[axis]);
        let length = sides.map(|side| side * side).sum::<f64>().sqrt();
        // A motion that hardly moves is slow, but just as predictable.
        Self { length, speed: speed.max(length / scene.duration.max(scene.time_step)) }
    }

    fn is_outrun(&self, Bounds { position, velocity }: Bounds) -> bool {
        let beyond = |bound: f64, scale: f64| scale > 0.0 && FACTOR * bound > PREDICTABLE * scale;
        beyond(position, self.length) || beyond(velocity, self.speed)
    }
}
