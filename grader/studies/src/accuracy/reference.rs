//! Reference solution of a scene: its states at sample times, with an error bar.
//!
//! ```text
//! closed form   bar of x: 16 ε (1 + ω T) max |x|           rounding of the formula and of its angle ω T
//!               bar of E: Σ (|F_i| bar_x + m_i |v_i| bar_v) + 16 ε (T + Σ |U|)
//! adaptive      bar: largest difference of the runs to two tolerances, plus the rounding above
//! ```
//!
//! The error bar is a *floor*: smaller errors cannot be measured. Samples are at the steps of the coarsest time step, which
//! every time step of the ladder reaches.

use scene::schema::Family;
use scene::{Dimension, Scene};
use simulator::system::System;

use super::Errors;
use ::reference::adaptive::{self, Motion, TOLERANCES};
use ::reference::closed::Closed;

/// Rounding error of a formula's value, in units of ε.
const ROUNDINGS: f64 = 16.0;

/// Source of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// A closed form.
    Closed,
    /// A method of order 8, run to two tolerances.
    Adaptive,
}

/// Reference solution of a scene.
pub struct Reference {
    /// Its source.
    pub source: Source,
    /// Its error bar, valid at every sample.
    pub floor: Errors,
    /// The largest position and velocity of a particle, and the largest sum of the magnitudes of energies.
    pub scale: Errors,
    /// Size of the motion: the larger of the largest displacement and the largest distance.
    pub size: f64,
    /// The end of the last sample, in seconds.
    pub duration: f64,
    /// The samples, including the start.
    samples: Vec<ReferenceSample>,
    meter: Meter,
    dimension: usize,
}

struct ReferenceSample {
    time: f64,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    energy: f64,
}

impl Reference {
    /// The reference of a scene whose time step is the coarsest of the ladder.
    ///
    /// # Errors
    /// If there is no closed form and the adaptive method does not reach the end.
    pub fn new(scene: &Scene, closed: Option<&Closed>) -> Result<Self, String> {
        let coarsest = scene.n_steps();
        if coarsest == 0 {
            return Err("the scene has no steps".to_owned());
        }
        let times: Vec<f64> = (0..=coarsest).map(|step| step as f64 * scene.time_step).collect();
        let (states, difference) = match closed {
            Some(closed) => (closed_states(scene, closed, &times), None),
            None => {
                let [fine, coarse] = TOLERANCES;
                let fine = adaptive::solve(scene, &times, fine)?;
                let coarse = adaptive::solve(scene, &times, coarse)?;
                (fine, Some(coarse))
            }
        };
        let meter = Meter::new(scene);
        let half = states[0].len() / 2;
        let sample = |(time, state): (&f64, &Vec<f64>)| {
            let (positions, velocities) = state.split_at(half);
            let (energy, size) = meter.energy(positions, velocities, *time);
            let (positions, velocities) = (positions.to_vec(), velocities.to_vec());
            (ReferenceSample { time: *time, positions, velocities, energy }, size)
        };
        let (samples, sizes): (Vec<ReferenceSample>, Vec<f64>) =
            times.iter().zip(&states).map(sample).unzip();
        let dimension = scene.dimension.count();
        let duration = times.last().copied().unwrap_or_default();
        let mut reference = Self {
            source: if closed.is_some() { Source::Closed } else { Source::Adaptive },
            floor: Errors::default(),
            scale: Errors {
                position: largest(samples.iter().map(|sample| &sample.positions), dimension),
                velocity: largest(samples.iter().map(|sample| &sample.velocities), dimension),
                energy: sizes.iter().copied().fold(0.0, f64::max),
            },
            size: extent(&samples, dimension),
            duration,
            samples,
            meter,
            dimension,
        };
        let angle = closed.map_or(0.0, |closed| closed.rate * duration);
        let rounding = ROUNDINGS * f64::EPSILON * (1.0 + angle);
        reference.floor = Errors {
            position: rounding * reference.scale.position,
            velocity: rounding * reference.scale.velocity,
            energy: 0.0,
        };
        reference.floor.energy = reference.energy_bar(scene)?;
        if let Some(coarse) = difference {
            for (number, state) in coarse.iter().enumerate() {
                let (positions, velocities) = state.split_at(half);
                let errors = reference.errors(number, positions, velocities);
                let errors = errors.ok_or("the energy of the reference is not finite")?;
                reference.floor = reference.floor.max(errors);
            }
        }
        Ok(reference)
    }

    /// Rounding error of the energy due to that of the state.
    fn energy_bar(&self, scene: &Scene) -> Result<f64, String> {
        let motion = Motion::new(scene);
        let mut bar: f64 = 0.0;
        for ReferenceSample { time, positions, velocities, .. } in &self.samples {
            let force = motion.force(positions, velocities, *time);
            let forces = force.chunks_exact(self.dimension).map(norm).sum::<f64>();
            let particles = velocities.chunks_exact(self.dimension).zip(&scene.particles);
            let momenta = particles.map(|(velocity, particle)| particle.mass * norm(velocity));
            let momenta = momenta.sum::<f64>();
            bar = bar.max(forces * self.floor.position + momenta * self.floor.velocity);
        }
        Ok(bar + ROUNDINGS * f64::EPSILON * self.scale.energy)
    }

    /// The largest differences between this and another reference of the same scene; `None` if an energy is not finite.
    pub fn difference(&self, other: &Self) -> Option<Errors> {
        let of_sample = |(number, sample): (usize, &ReferenceSample)| {
            self.errors(number, &sample.positions, &sample.velocities)
        };
        let errors = other.samples.iter().enumerate().map(of_sample);
        errors.reduce(|a, b| Some(a?.max(b?))).flatten()
    }

    /// Positions and velocities at the end, `n·D`, particle-major.
    pub fn end(&self) -> (&[f64], &[f64]) {
        self.samples.last().map_or((&[], &[]), |sample| {
            (sample.positions.as_slice(), sample.velocities.as_slice())
        })
    }

    /// Number of samples, including the start.
    pub(super) fn n_samples(&self) -> usize {
        self.samples.len()
    }

    /// The step number of a sample if each coarsest step is divided into `refinement` steps.
    pub(super) fn step(&self, sample: usize, refinement: u64) -> u64 {
        sample as u64 * refinement
    }

    /// Errors of a state at a sample; `None` if its energy is not finite.
    pub(super) fn errors(&self, sample: usize, x: &[f64], v: &[f64]) -> Option<Errors> {
        let ReferenceSample { time, positions, velocities, energy } = &self.samples[sample];
        let (own, _) = self.meter.energy(x, v, *time);
        let errors = Errors {
            position: distance(x, positions, self.dimension),
            velocity: distance(v, velocities, self.dimension),
            energy: (own - energy).abs(),
        };
        let all = [errors.position, errors.velocity, errors.energy];
        all.into_iter().all(f64::is_finite).then_some(errors)
    }

    /// Bound of the rounding error of `steps` steps of an exact method. A method whose unknowns are positions, or that
    /// solves for velocities with them, may divide by the time step, and loses `ε |x|/h` of a velocity in each step.
    pub(super) fn rounding(&self, steps: u64, family: Family) -> Errors {
        let steps = steps as f64;
        let unit = steps * f64::EPSILON;
        let per_second = match family {
            Family::Explicit | Family::Symplectic => 0.0,
            Family::Implicit | Family::Minimization => steps / self.duration,
        };
        let velocity = unit * (self.scale.velocity + self.scale.position * per_second);
        let relative = velocity / self.scale.velocity.max(f64::MIN_POSITIVE);
        Errors {
            position: unit * self.scale.position + self.duration * velocity,
            velocity,
            energy: (unit + relative.min(1.0)) * self.scale.energy,
        }
    }
}

fn closed_states(scene: &Scene, closed: &Closed, times: &[f64]) -> Vec<Vec<f64>> {
    let n = scene.positions().len();
    let state = |time: &f64| {
        let mut state = vec![0.0; 2 * n];
        let (positions, velocities) = state.split_at_mut(n);
        closed.at(*time, positions, velocities);
        state
    };
    times.iter().map(state).collect()
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|component| component * component).sum::<f64>().sqrt()
}

/// The largest distance between corresponding particles.
fn distance(a: &[f64], b: &[f64], dimension: usize) -> f64 {
    let pairs = a.chunks_exact(dimension).zip(b.chunks_exact(dimension));
    let distance = |(a, b): (&[f64], &[f64])| {
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    // Unlike `max`, propagate NaN.
    pairs.map(distance).fold(0.0, |max, distance| if distance <= max { max } else { distance })
}

fn largest<'a>(states: impl Iterator<Item = &'a Vec<f64>>, dimension: usize) -> f64 {
    states.flat_map(|state| state.chunks_exact(dimension)).map(norm).fold(0.0, f64::max)
}

fn extent(samples: &[ReferenceSample], dimension: usize) -> f64 {
    let start = &samples[0].positions;
    let moved = samples.iter().map(|sample| distance(&sample.positions, start, dimension));
    let moved = moved.fold(0.0, f64::max);
    let apart = start
        .chunks_exact(dimension)
        .map(|particle| distance(particle, &start[..dimension], dimension));
    moved.max(apart.fold(0.0, f64::max))
}

/// Evaluates energies with the simulator's own functions, as for the reported errors.
enum Meter {
    Two(System<2>),
    Three(System<3>),
}

impl Meter {
    fn new(scene: &Scene) -> Self {
        match scene.dimension {
            Dimension::Two => Self::Two(System::new(scene)),
            Dimension::Three => Self::Three(System::new(scene)),
        }
    }

    /// The energy, and the sum of the magnitudes of its parts.
    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> (f64, f64) {
        let (kinetic, (potential, size)) = match self {
            Self::Two(system) => (system.kinetic_energy(v), system.energy_and_size(x, v, time)),
            Self::Three(system) => (system.kinetic_energy(v), system.energy_and_size(x, v, time)),
        };
        (kinetic + potential, kinetic + size)
    }
}
