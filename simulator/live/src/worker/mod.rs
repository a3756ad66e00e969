//! Takes the steps of a run: on a separate thread, or, where there are no threads, at once.
//!
//! The worker has one job at a time: it builds the simulation where the scene has changed, sets the state where it is not
//! that of the last step, and takes steps until they are taken, or the next one would exceed the budget of computing time; at
//! least one. A job that is abandoned ends at the next iteration of its method ([`Interrupt`]); a new job starts when it has
//! ended, so that abandoned steps do not pile up.

#[cfg_attr(target_family = "wasm", path = "inline.rs")]
mod thread;

use std::time::{Duration, Instant};

use scene::Scene;
use scene::state::StateView;
use simulator::integrator::Interrupt;
use simulator::simulation::{Simulation, SimulationError};
pub(crate) use thread::{Worker, look};

/// A state. `time` is `step` times the time step.
#[derive(Clone)]
pub(crate) struct State {
    pub(crate) step: u64,
    pub(crate) time: f64,
    pub(crate) positions: Vec<f64>,
    pub(crate) velocities: Vec<f64>,
}

/// The steps of a frame.
pub(crate) struct Job {
    /// The scene, if it has changed. The first job has one.
    pub(crate) scene: Option<Scene>,
    /// The state to start from, if it is not that of the last step.
    pub(crate) start: Option<State>,
    /// How many steps are due.
    pub(crate) steps: u64,
}

/// Result of a job.
pub(crate) struct Done {
    /// Steps that were asked for, and that were taken.
    pub(crate) asked: u64,
    pub(crate) steps: u64,
    /// Time that the steps took.
    pub(crate) computing: Duration,
    /// The last state that is finite, if a step was taken.
    pub(crate) end: Option<State>,
    /// Its kinetic and potential energy.
    pub(crate) energies: [f64; 2],
    /// Whether the run has blown up; no further step was taken.
    pub(crate) blown_up: bool,
    pub(crate) failure: Option<SimulationError>,
}

/// The worker has ended by an internal error.
pub(crate) struct Stopped;

/// A run has blown up where its kinetic energy is this many times the energy at its start, or a joule: a factor that no
/// drag of the pointer and no hour of free fall reaches, and that an unstable method passes within some steps.
const BLOWN_UP: f64 = 1e12;

/// The simulation of a run.
struct Stepper {
    /// Computing time of a job.
    budget: Duration,
    /// `None` before the first job.
    simulation: Option<Simulation>,
    /// Mass of the lightest particle.
    mass: f64,
    /// Sum of the squares of all velocities from which on the run has blown up.
    most: f64,
}

impl Stepper {
    fn new(budget: Duration) -> Self {
        Self { budget, simulation: None, mass: 1.0, most: f64::INFINITY }
    }

    /// Takes the steps of a job; `None` if there is no scene yet.
    fn take(&mut self, job: &Job, interrupt: &Interrupt) -> Option<Done> {
        if let Some(scene) = &job.scene {
            self.simulation = Some(Simulation::new(scene));
            self.mass = scene.particles.iter().map(|each| each.mass).fold(f64::INFINITY, f64::min);
        }
        let simulation = self.simulation.as_mut()?;
        simulation.interrupt_by(interrupt);
        if let Some(State { step, positions, velocities, .. }) = &job.start {
            simulation.set_state(*step, None, positions, velocities);
        }
        if job.start.is_some() || job.scene.is_some() {
            let start = simulation.energies_of(simulation.state());
            let start = (start.kinetic.abs() + start.potential.abs()).max(1.0);
            self.most = 2.0 * BLOWN_UP * start / self.mass;
        }
        Some(take_steps(simulation, job, interrupt, (self.budget, self.most)))
    }
}

fn take_steps(
    simulation: &mut Simulation,
    job: &Job,
    interrupt: &Interrupt,
    (budget, most): (Duration, f64),
) -> Done {
    let started = Instant::now();
    let of = |simulation: &Simulation| {
        let state = simulation.state();
        let (positions, velocities) = (state.positions.to_vec(), state.velocities.to_vec());
        State { step: state.step, time: state.time, positions, velocities }
    };
    let mut last = of(simulation);
    let (mut steps, mut failure, mut blown_up) = (0, None, false);
    while steps < job.steps && !blown_up && !interrupt.is_raised() {
        let spent = started.elapsed().as_secs_f64();
        if steps > 0 && spent + spent / steps as f64 > budget.as_secs_f64() {
            break;
        }
        if let Err(error) = simulation.advance() {
            failure = Some(error);
            break;
        }
        let state = simulation.state();
        (last.step, last.time) = (state.step, state.time);
        last.positions.copy_from_slice(state.positions);
        last.velocities.copy_from_slice(state.velocities);
        steps += 1;
        blown_up = last.velocities.iter().map(|velocity| velocity * velocity).sum::<f64>() > most;
    }
    let computing = started.elapsed();
    let view = StateView {
        step: last.step,
        time: last.time,
        positions: &last.positions,
        velocities: &last.velocities,
    };
    let energies = simulation.energies_of(view);
    Done {
        asked: job.steps,
        steps,
        computing,
        energies: [energies.kinetic, energies.potential],
        end: (steps > 0).then_some(last),
        blown_up,
        failure,
    }
}
