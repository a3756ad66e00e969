//! Takes the steps of a run on a separate thread.
//!
//! The thread has one job at a time: it builds the simulation where the scene has changed, sets the state where it is not
//! that of the last step, and takes steps until they are taken, or the next one would exceed the budget of computing time; at
//! least one. A job that is abandoned ends at the next iteration of its method ([`Interrupt`]); a new job starts when it has
//! ended, so that abandoned steps do not pile up.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use scene::Scene;
use scene::state::StateView;
use simulator::integrator::Interrupt;
use simulator::simulation::{Simulation, SimulationError};

/// A state. `time` is `step` times the time step.
#[derive(Clone)]
pub(super) struct State {
    pub(super) step: u64,
    pub(super) time: f64,
    pub(super) positions: Vec<f64>,
    pub(super) velocities: Vec<f64>,
}

/// The steps of a frame.
pub(super) struct Job {
    /// The scene, if it has changed. The first job has one.
    pub(super) scene: Option<Scene>,
    /// The state to start from, if it is not that of the last step.
    pub(super) start: Option<State>,
    /// How many steps are due.
    pub(super) steps: u64,
}

/// Result of a job.
pub(super) struct Done {
    /// Steps that were asked for, and that were taken.
    pub(super) asked: u64,
    pub(super) steps: u64,
    /// Time that the steps took.
    pub(super) computing: Duration,
    /// The last state that is finite, if a step was taken.
    pub(super) end: Option<State>,
    /// Its kinetic and potential energy.
    pub(super) energies: [f64; 2],
    /// Whether the run has blown up; no further step was taken.
    pub(super) blown_up: bool,
    pub(super) failure: Option<SimulationError>,
}

/// The thread has ended by an internal error.
pub(super) struct Stopped;

/// The thread of a run. It ends with this value, once its step does.
pub(super) struct Worker {
    jobs: Sender<(Job, Interrupt)>,
    results: Receiver<Done>,
    /// The job that the thread has.
    current: Option<Current>,
}

/// A job that has not ended.
struct Current {
    since: Instant,
    interrupt: Interrupt,
}

impl Worker {
    /// Starts the thread. `budget` is the computing time of a job.
    pub(super) fn start(budget: Duration) -> Self {
        let (jobs, received) = channel();
        let (sender, results) = channel();
        thread::spawn(move || work(budget, &received, &sender));
        Self { jobs, results, current: None }
    }

    /// Whether the thread has a job, abandoned or not.
    pub(super) fn is_busy(&self) -> bool {
        self.current.is_some()
    }

    /// Whether the thread has a job that is not abandoned.
    pub(super) fn is_running(&self) -> bool {
        self.current.as_ref().is_some_and(|current| !current.interrupt.is_raised())
    }

    /// When its job began.
    pub(super) fn busy_since(&self) -> Option<Instant> {
        self.current.as_ref().map(|current| current.since)
    }

    /// Begins a job. The thread must not be busy.
    pub(super) fn begin(&mut self, job: Job) {
        let interrupt = Interrupt::default();
        // If the thread has ended, `wait` says so.
        let _ = self.jobs.send((job, interrupt.clone()));
        self.current = Some(Current { since: Instant::now(), interrupt });
    }

    /// Ends the job soon; its result means nothing.
    pub(super) fn abandon(&self) {
        if let Some(current) = &self.current {
            current.interrupt.raise();
        }
    }

    /// The result of the job; `None` if it has not ended at the deadline.
    ///
    /// # Errors
    /// If the thread has ended.
    pub(super) fn wait(&mut self, deadline: Instant) -> Result<Option<Done>, Stopped> {
        let left = deadline.saturating_duration_since(Instant::now());
        match self.results.recv_timeout(left) {
            Ok(done) => {
                self.current = None;
                Ok(Some(done))
            }
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(Stopped),
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.abandon();
    }
}

/// A run has blown up where its kinetic energy is this many times the energy at its start, or a joule: a factor that no
/// drag of the pointer and no hour of free fall reaches, and that an unstable method passes within some steps.
const BLOWN_UP: f64 = 1e12;

/// The thread.
fn work(budget: Duration, jobs: &Receiver<(Job, Interrupt)>, results: &Sender<Done>) {
    let mut simulation = None;
    // Of the lightest particle, and sum of the squares of all velocities, from which on the run has blown up.
    let (mut mass, mut most) = (1.0, f64::INFINITY);
    for (job, interrupt) in jobs {
        if let Some(scene) = &job.scene {
            simulation = Some(Simulation::new(scene));
            mass = scene.particles.iter().map(|each| each.mass).fold(f64::INFINITY, f64::min);
        }
        let Some(simulation) = &mut simulation else { return };
        simulation.interrupt_by(&interrupt);
        if let Some(State { step, positions, velocities, .. }) = &job.start {
            simulation.set_state(*step, None, positions, velocities);
        }
        if job.start.is_some() || job.scene.is_some() {
            let start = simulation.energies_of(simulation.state());
            let start = (start.kinetic.abs() + start.potential.abs()).max(1.0);
            most = 2.0 * BLOWN_UP * start / mass;
        }
        if results.send(take_steps(simulation, &job, &interrupt, (budget, most))).is_err() {
            return;
        }
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
