//! Measurement of a method at one time step: errors and cost.
//!
//! The first run measures errors and warms up; the timed runs measure nothing else. Time covers all steps, including
//! the preparations of the first, but not reading the scene and allocation. The least of several times is the cost; the
//! median and the largest show its reliability.

use std::time::Instant;

use scene::Scene;
use scene::trace::{Shape, State};
use simulator::simulation::Simulation;
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;

use super::reference::Reference;
use super::{AccuracyConfig, Cost, Errors, Point, RunOutcome, Timing, Work};
use grader::submission::{StateSource, builtin};

/// A run counts as blown up if its error exceeds this many times the size of the motion.
pub const BLOWN_UP: f64 = 10.0;

/// Relative tolerance between a trace's first state and the scene's, for traces written with few digits.
const SAME: f64 = 1e-6;

/// Errors of the states of `source`, which simulates `scene` with each coarsest step divided into `refinement` steps.
pub fn follow(
    source: &mut dyn StateSource,
    scene: &Scene,
    reference: &Reference,
    refinement: u64,
) -> RunOutcome {
    let mut state = State::zeros(Shape::of(scene));
    let mut largest = Errors::default();
    let mut end = Errors::default();
    let mut step = 0;
    let failed = |step: u64, reason: String| RunOutcome::Failed {
        step,
        time: step.saturating_sub(1) as f64 * scene.time_step,
        reason,
    };
    for sample in 0..reference.n_samples() {
        let until = reference.step(sample, refinement);
        loop {
            match source.read(&mut state) {
                Ok(true) => {}
                Ok(false) => return failed(step, format!("there are only {step} states")),
                Err(failure) => return failed(step, failure.to_string()),
            }
            let all = state.positions.iter().chain(&state.velocities);
            if !all.copied().all(f64::is_finite) {
                return failed(step, "the state is no longer finite".to_owned());
            }
            step += 1;
            if step > until {
                break;
            }
        }
        let Some(errors) = reference.errors(sample, &state.positions, &state.velocities) else {
            return failed(step, "the energy is no longer finite".to_owned());
        };
        let scale = reference.scale;
        let apart = errors.position > SAME * scale.position
            || errors.velocity > SAME * scale.velocity.max(scale.position);
        if sample == 0 && apart {
            return failed(0, "the first state is not the scene's".to_owned());
        }
        largest = largest.max(errors);
        end = errors;
    }
    if reference.size > 0.0 && largest.position > BLOWN_UP * reference.size {
        return RunOutcome::BlownUp { largest };
    }
    RunOutcome::Finished { end, largest }
}

/// Measures the built-in simulator on `scene`.
pub(super) fn built_in(
    scene: &Scene,
    reference: &Reference,
    refinement: u64,
    config: AccuracyConfig,
) -> Point {
    let started = Instant::now();
    let mut states = builtin::start(scene, LinearSolver::Auto);
    let outcome = follow(&mut *states, scene, reference, refinement);
    let mut spent = started.elapsed().as_secs_f64();
    let (mut times, mut work) = (Vec::new(), None);
    while times.len() < config.repeats.max(1) as usize
        && (times.is_empty() || spent < config.budget)
    {
        let mut simulation = Simulation::new(scene);
        let started = Instant::now();
        // The first run has already recorded the outcome.
        while matches!(simulation.advance(), Ok(true)) {}
        let time = started.elapsed().as_secs_f64();
        spent += time;
        times.push(time);
        work = Some(Work::of(simulation.statistics()));
    }
    let cost = Cost { time: Timing::of(times), work };
    Point { time_step: scene.time_step, steps: scene.n_steps(), outcome, cost }
}

impl Timing {
    /// The statistics of times, in seconds; `None` if there are none.
    pub(super) fn of(mut times: Vec<f64>) -> Option<Self> {
        times.sort_by(f64::total_cmp);
        let (least, largest) = (*times.first()?, *times.last()?);
        let repeats = times.len() as u32;
        Some(Self { least, median: times[times.len() / 2], largest, repeats })
    }
}

impl Work {
    fn of(statistics: &Statistics) -> Self {
        Self {
            force_evaluations: statistics.force_evaluations,
            factorisations: statistics.linear.factorisations,
            iterations: statistics.newton_iterations + statistics.local_global_iterations,
        }
    }
}
