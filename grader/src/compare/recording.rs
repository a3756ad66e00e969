//! Recording of a comparison for display: the motion, reduced for the eye, and the states around the first wrong one,
//! exact.
//!
//! ```text
//! compare ── Pair ──> Recorder ──> Recording
//!                     frames       every `stride`-th state, and every state near the first wrong one
//!                     series       in each bucket of states: the worst residual, and the energies of the first state
//!                     exact        the states around the first wrong one, bit for bit
//! ```
//!
//! Positions of the oracle are stored in 16 bits over the size of the motion. A submission is stored as its difference
//! from the oracle, each component with 8 significant bits: a difference of 1e-12 m keeps its direction.
//!
//! Memory is bounded for traces of any length: [`MAX_NUMBERS`] in frames, [`BUCKETS`] points in a series, and
//! [`EXACT_PARTICLES`] particles in an exact state. Shapes are particle-major.

use std::collections::VecDeque;

use scene::state::Energies;
use scene::trace::{Shape, State};
use scene::{Dimension, Scene};
use simulator::solver::linear::LinearSolver;
use simulator::system::System;

use super::calibration::Bound;
use crate::compare::Pair;
use diagnosis::stepping::Stepper;

/// Maximum number of frames.
const MAX_FRAMES: u64 = 1_000;

/// Number of coordinates in all frames together that a recording of many particles does not exceed by much.
pub const MAX_NUMBERS: u64 = 1_000_000;

/// Maximum number of points of a series.
pub const BUCKETS: u64 = 1_000;

/// Exact states on each side of the first wrong one.
pub const EXACT_STATES: usize = 3;

/// Maximum number of particles in an exact state: those that are furthest off.
pub const EXACT_PARTICLES: usize = 64;

/// A recorded comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Coordinates of a particle.
    pub dimension: usize,
    /// Particles.
    pub n_particles: usize,
    /// States of the scene, the initial one included.
    pub n_states: u64,
    /// Step number of each frame, rising.
    pub frames: Vec<u64>,
    /// The smallest coordinate of the oracle along each axis.
    pub low: Vec<f64>,
    /// Size of a unit of [`Self::positions`], in metres.
    pub unit: f64,
    /// The oracle's positions, frame by frame, in units from [`Self::low`].
    pub positions: Vec<u16>,
    /// The submission's positions minus the oracle's, in metres, of its first frames: the upper half of an f32.
    pub differences: Vec<u16>,
    /// The forces at the states of the frames, by their right laws, in newtons: the upper half of an f32. Of the
    /// submission's states, and of the oracle's where it has none; a force that is not defined is zero.
    pub forces: Vec<u16>,
    /// Residuals, by bucket of states.
    pub residuals: Vec<Residuals>,
    /// Energies and momentum, of the first state of each bucket.
    pub energies: Vec<EnergyPair>,
    /// The particles of the exact states, the worst first.
    pub exact_particles: Vec<usize>,
    /// The exact states around the first wrong one; empty where there is none.
    pub exact: Vec<ExactState>,
}

/// The worst residuals among consecutive states.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residuals {
    /// Of positions.
    pub position: Residual,
    /// Of velocities.
    pub velocity: Residual,
}

/// The largest residual of a state, over its particles.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residual {
    /// Step number of the state.
    pub step: u64,
    /// The residual.
    pub value: f64,
    /// Envelope and tolerance; `None` beyond the horizon.
    pub bound: Option<Bound>,
}

impl Residual {
    /// The residual as a share of its tolerance; itself where there is no tolerance.
    fn share(&self) -> f64 {
        match self.bound {
            Some(bound) if self.value > 0.0 => self.value / bound.tolerance,
            _ => self.value,
        }
    }
}

/// Energies and momentum of a state.
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyPair {
    /// Step number of the state.
    pub step: u64,
    /// The oracle's.
    pub expected: Energies,
    /// The submission's; `None` after the end of its trace.
    pub got: Option<Energies>,
}

/// The numbers of some particles in one state.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactState {
    /// Step number of the state.
    pub step: u64,
    /// The oracle's: position, then velocity, of each particle.
    pub expected: Vec<f64>,
    /// The submission's.
    pub got: Vec<f64>,
}

/// Records the pairs of a comparison.
pub struct Recorder {
    physics: Stepper,
    forces: Forces,
    stride: u64,
    /// The last pairs before the current one.
    recent: VecDeque<(u64, State, State)>,
    /// The oracle's positions in all frames.
    positions: Vec<f32>,
    n_pairs: u64,
    /// The bucket of the last residuals.
    bucket_of_last: u64,
    recording: Recording,
}

impl Recorder {
    /// A recorder of a trace of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let shape = Shape::of(scene);
        let n_states = scene.n_steps() + 1;
        let coordinates = shape.n_coordinates().max(1) as u64;
        // Motion needs some frames, however many particles there are.
        let frames = (MAX_NUMBERS / coordinates).clamp(60, MAX_FRAMES);
        let recording = Recording {
            dimension: shape.dimension.count(),
            n_particles: shape.n_particles,
            n_states,
            frames: Vec::new(),
            low: Vec::new(),
            unit: 0.0,
            positions: Vec::new(),
            differences: Vec::new(),
            forces: Vec::new(),
            residuals: Vec::new(),
            energies: Vec::new(),
            exact_particles: Vec::new(),
            exact: Vec::new(),
        };
        Self {
            physics: Stepper::new(scene, LinearSolver::Auto),
            forces: Forces::new(scene),
            stride: n_states.div_ceil(frames),
            recent: VecDeque::new(),
            positions: Vec::new(),
            n_pairs: 0,
            bucket_of_last: 0,
            recording,
        }
    }

    /// Records two states that were compared.
    pub fn add(&mut self, pair: Pair<'_>) {
        let Pair { step, expected, got, is_wrong, .. } = pair;
        let is_first = is_wrong && self.recording.exact.is_empty();
        if is_first {
            self.recording.exact_particles = self.worst(pair);
            for (step, expected, got) in std::mem::take(&mut self.recent) {
                self.frame(step, &expected, Some(&got));
                self.exact(step, &expected, &got);
            }
        }
        let near =
            !self.recording.exact.is_empty() && self.recording.exact.len() <= 2 * EXACT_STATES;
        if is_first || near {
            self.exact(step, expected, got);
        }
        if is_first || near || self.is_frame(step) {
            self.frame(step, expected, Some(got));
        }
        self.n_pairs += 1;
        self.residuals(pair);
        self.energies(step, expected, Some(got));
        if self.recording.exact.is_empty() {
            // The buffers of the oldest pair are used again.
            let full = self.recent.len() == EXACT_STATES;
            let oldest = full.then(|| self.recent.pop_front()).flatten();
            let (_, mut before, mut trace) =
                oldest.unwrap_or_else(|| (0, expected.clone(), got.clone()));
            before.clone_from(expected);
            trace.clone_from(got);
            self.recent.push_back((step, before, trace));
        }
    }

    /// Records a state of the oracle after the end of the submission's trace.
    pub fn add_expected(&mut self, step: u64, expected: &State) {
        if self.is_frame(step) {
            self.frame(step, expected, None);
        }
        self.energies(step, expected, None);
    }

    /// Number of pairs recorded.
    pub fn n_pairs(&self) -> u64 {
        self.n_pairs
    }

    /// The recording.
    pub fn finish(mut self) -> Recording {
        let dimension = self.recording.dimension;
        let mut low = vec![f32::INFINITY; dimension];
        let mut high = vec![f32::NEG_INFINITY; dimension];
        for (place, value) in self.positions.iter().enumerate() {
            let axis = place % dimension;
            (low[axis], high[axis]) = (low[axis].min(*value), high[axis].max(*value));
        }
        let extent = low.iter().zip(&high).map(|(low, high)| high - low).fold(0.0, f32::max);
        let unit = f64::from(extent) / f64::from(u16::MAX);
        let quantised = |(place, value): (usize, &f32)| {
            let above = f64::from(*value) - f64::from(low[place % dimension]);
            // A scene without extent has all particles in one place.
            if unit > 0.0 { (above / unit).round() as u16 } else { 0 }
        };
        self.recording.positions = self.positions.iter().enumerate().map(quantised).collect();
        self.recording.low = low.into_iter().map(f64::from).collect();
        self.recording.unit = unit;
        self.recording
    }

    fn is_frame(&self, step: u64) -> bool {
        step.is_multiple_of(self.stride) || step + 1 == self.recording.n_states
    }

    fn frame(&mut self, step: u64, expected: &State, got: Option<&State>) {
        if self.recording.frames.last().is_some_and(|last| *last >= step) {
            return;
        }
        self.recording.frames.push(step);
        self.positions.extend(expected.positions.iter().map(|value| *value as f32));
        let forces = self.forces.at(step, got.unwrap_or(expected));
        self.recording.forces.extend(forces.into_iter().map(upper_half));
        let Some(got) = got else { return };
        let pairs = got.positions.iter().zip(&expected.positions);
        let differences = pairs.map(|(got, expected)| upper_half(got - expected));
        self.recording.differences.extend(differences);
    }

    fn energies(&mut self, step: u64, expected: &State, got: Option<&State>) {
        if !step.is_multiple_of(self.bucket()) {
            return;
        }
        let of = |state: &State| self.physics.energies(step, &state.positions, &state.velocities);
        let pair = EnergyPair { step, expected: of(expected), got: got.map(of) };
        self.recording.energies.push(pair);
    }

    /// States in a bucket.
    fn bucket(&self) -> u64 {
        self.recording.n_states.div_ceil(BUCKETS)
    }

    fn residuals(&mut self, pair: Pair<'_>) {
        let Pair { step, expected, got, bounds, .. } = pair;
        let largest = |a: &[f64], b: &[f64]| self.distances(a, b).fold(0.0, f64::max);
        let values = [
            largest(&expected.positions, &got.positions),
            largest(&expected.velocities, &got.velocities),
        ];
        let of = |quantity: usize| Residual {
            step,
            value: values[quantity],
            bound: bounds.map(|bounds| bounds[quantity]),
        };
        let found = Residuals { position: of(0), velocity: of(1) };
        let bucket = step / self.bucket();
        let known = &mut self.recording.residuals;
        match known.last_mut().filter(|_| self.bucket_of_last == bucket) {
            None => known.push(found),
            Some(last) => {
                for (last, found) in
                    [(&mut last.position, found.position), (&mut last.velocity, found.velocity)]
                {
                    if found.share() > last.share() {
                        *last = found;
                    }
                }
            }
        }
        self.bucket_of_last = bucket;
    }

    /// Distance of each particle from the oracle's.
    fn distances<'a>(&self, a: &'a [f64], b: &'a [f64]) -> impl Iterator<Item = f64> + use<'a> {
        let dimension = self.recording.dimension;
        let pairs = a.chunks_exact(dimension).zip(b.chunks_exact(dimension));
        pairs.map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt())
    }

    /// The particles that are furthest off, relative to their tolerances, the worst first.
    fn worst(&self, pair: Pair<'_>) -> Vec<usize> {
        let Pair { expected, got, bounds, .. } = pair;
        let [by_position, by_velocity] =
            bounds.map_or([1.0; 2], |b| b.map(|bound| bound.tolerance));
        let positions = self.distances(&expected.positions, &got.positions);
        let velocities = self.distances(&expected.velocities, &got.velocities);
        let share = |(x, v): (f64, f64)| f64::max(x / by_position, v / by_velocity);
        let shares: Vec<f64> = positions.zip(velocities).map(share).collect();
        let mut order: Vec<usize> = (0..shares.len()).collect();
        order.sort_by(|a, b| shares[*b].total_cmp(&shares[*a]));
        order.truncate(EXACT_PARTICLES);
        order
    }

    fn exact(&mut self, step: u64, expected: &State, got: &State) {
        let dimension = self.recording.dimension;
        let numbers = |state: &State| {
            let of = |particle: &usize| {
                let range = particle * dimension..(particle + 1) * dimension;
                [&state.positions[range.clone()], &state.velocities[range]].concat()
            };
            self.recording.exact_particles.iter().flat_map(of).collect()
        };
        let state = ExactState { step, expected: numbers(expected), got: numbers(got) };
        self.recording.exact.push(state);
    }
}

/// The upper half of a number as an f32, which has 8 significant bits.
fn upper_half(value: f64) -> u16 {
    let value = value.clamp(f64::from(f32::MIN), f64::from(f32::MAX));
    ((value as f32).to_bits() >> 16) as u16
}

/// The forces of a scene.
enum Forces {
    Two(System<2>, f64),
    Three(System<3>, f64),
}

impl Forces {
    fn new(scene: &Scene) -> Self {
        match scene.dimension {
            Dimension::Two => Self::Two(System::new(scene), scene.time_step),
            Dimension::Three => Self::Three(System::new(scene), scene.time_step),
        }
    }

    /// The sum of all forces on each particle; zero where it is not defined or not finite.
    fn at(&self, step: u64, state: &State) -> Vec<f64> {
        let State { positions, velocities, .. } = state;
        let mut force = vec![0.0; positions.len()];
        let defined = match self {
            Self::Two(system, h) => {
                system.force(positions, velocities, step as f64 * h, &mut force)
            }
            Self::Three(system, h) => {
                system.force(positions, velocities, step as f64 * h, &mut force)
            }
        };
        if defined.is_err() || !force.iter().all(|value| value.is_finite()) {
            force.fill(0.0);
        }
        force
    }
}

#[cfg(test)]
mod tests {
    use scene::{ParseOptions, xml};
    use simulator::simulation::Simulation;
    use simulator::vocabulary;

    use super::*;

    /// Records a trace of a falling particle that is off by `error` from step `from` on.
    fn recorded(n_steps: u32, from: u64, error: f64) -> Recording {
        let text = format!(
            r#"<scene><duration time="{n_steps}"/><integrator type="explicit-euler" dt="1"/>
            <simplegravity fx="0" fy="-0.5"/>
            <particle m="1" px="0" py="0" vx="1" vy="0" fixed="0"/></scene>"#
        );
        let parsed = xml::parse(&text, "scene.xml", &vocabulary(), &ParseOptions::default());
        let scene = parsed.unwrap().scene;
        let mut simulation = Simulation::new(&scene);
        let mut recorder = Recorder::new(&scene);
        loop {
            let view = simulation.state();
            let step = view.step;
            let expected = State {
                time: None,
                positions: view.positions.to_vec(),
                velocities: view.velocities.to_vec(),
            };
            let mut got = expected.clone();
            let is_wrong = step >= from;
            if is_wrong {
                got.positions[1] += error;
            }
            let bounds = Some([Bound { envelope: 0.0, tolerance: 1e-10 }; 2]);
            recorder.add(Pair { step, expected: &expected, got: &got, bounds, is_wrong });
            if !simulation.advance().unwrap() {
                return recorder.finish();
            }
        }
    }

    /// The difference that these bits stand for.
    fn difference(bits: u16) -> f32 {
        f32::from_bits(u32::from(bits) << 16)
    }

    #[test]
    fn the_states_around_the_first_wrong_one_are_exact() {
        let recording = recorded(20, 7, 1e-9);
        let steps: Vec<u64> = recording.exact.iter().map(|state| state.step).collect();
        assert_eq!(steps, [4, 5, 6, 7, 8, 9, 10]);
        let wrong = &recording.exact[3];
        assert_eq!(wrong.got[1], wrong.expected[1] + 1e-9);
        assert_eq!(recording.exact[2].got, recording.exact[2].expected);
        assert_eq!(recording.forces.len(), recording.positions.len());
        assert_eq!(
            [difference(recording.forces[14]), difference(recording.forces[15])],
            [0.0, -0.5]
        );
        // The differences keep their size, though it is far below the resolution of the positions.
        let found = difference(recording.differences[7 * 2 + 1]);
        assert!((f64::from(found) / 1e-9 - 1.0).abs() < 0.01, "{found}");
        assert_eq!(recording.residuals[7].position.value, wrong.got[1] - wrong.expected[1]);
    }

    #[test]
    fn long_traces_are_thinned_except_around_the_first_wrong_state() {
        let recording = recorded(25_000, 12_345, 1.0);
        assert!(recording.frames.len() < 1_010, "{}", recording.frames.len());
        assert!(recording.residuals.len() <= 1_000 && recording.energies.len() <= 1_000);
        assert!((12_342..=12_348).all(|step| recording.frames.contains(&step)));
        assert_eq!(recording.frames.last(), Some(&25_000));
        assert!(recording.frames.is_sorted_by(|a, b| a < b));
        assert_eq!(recording.differences.len(), recording.positions.len());
        // A bucket shows its worst state.
        let worst = recording.residuals.iter().map(|each| each.position.value);
        assert_eq!(worst.fold(0.0, f64::max), 1.0);
    }

    #[test]
    fn positions_are_quantised_over_the_motion() {
        let recording = recorded(20, 99, 0.0);
        let last = &recording.positions[2 * 20..];
        let x = recording.low[0] + recording.unit * f64::from(last[0]);
        assert!((x - 20.0).abs() <= recording.unit, "{x}");
        assert!(recording.exact.is_empty());
    }
}
