//! What hard scenes do to each method, and where each method is stable.
//!
//! ```text
//! cases × methods × time steps ──> trial ──> outcome ──┬─> against the stored outcomes (expected)
//!                                                      └─> again, where it failed, with rescue (--robust)
//! oscillators, chains ──> one step measured ──> radius ──┬─> boundary by bisection, against Jury's criterion
//!                                                        ├─> amplification, damping, period
//!                                                        └─> map over (h ω, ζ)
//! ```
//!
//! Every outcome is known in advance and stored: a change of behaviour is a failure. A survivor is checked against
//! the equation of its method by laws that are not the simulator's ([`trial`]), so that a silent wrong answer is an
//! outcome of its own, which is never expected. Cost: a quick run some seconds, a full one half a minute; a trial
//! that is stored ([`store`]) is not run again.

pub mod cases;
pub mod expected;
pub mod outcome;
pub mod store;
pub mod theory;
pub mod trial;

mod draft;

use rayon::prelude::*;
use simulator::integrator::REGISTRY;
use simulator::scene::schema::IntegratorSchema;

pub use expected::{Change, Expectations};
pub use outcome::{Measured, Outcome, Trial};

use cases::Case;
use store::Store;
use theory::amplification::{Amplification, amplifications};
use theory::boundary::{Boundary, boundaries};
use theory::map::{Map, maps};

/// What is run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Config {
    /// Fewer steps, and fewer damping ratios.
    pub quick: bool,
    /// What fails is run again, its failed steps tried in other ways.
    pub robust: bool,
}

/// All that was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StabilityReport {
    /// Every trial, in the order of the cases, methods and time steps; a robust one after the one that failed.
    pub trials: Vec<Trial>,
    /// Stability boundaries.
    pub boundaries: Vec<Boundary>,
    /// Amplification factors.
    pub amplifications: Vec<Amplification>,
    /// Maps.
    pub maps: Vec<Map>,
    /// What went otherwise than stored.
    pub changes: Vec<Change>,
}

impl StabilityReport {
    /// Whether all is as it should be: nothing wrong, no change, and boundaries where theory has them.
    pub fn is_pass(&self) -> bool {
        self.changes.is_empty()
            && self.trials.iter().all(|trial| !trial.outcome.is_wrong())
            && self.boundaries.iter().all(Boundary::agrees)
    }
}

/// One trial that is to be run.
#[derive(Clone, Copy)]
struct Task {
    case: &'static Case,
    integrator: &'static IntegratorSchema,
    time_step: f64,
    steps: u64,
}

/// Runs the cases whose name `selected` takes. `progress` is told how many of how many trials are done.
pub fn run(
    config: Config,
    store: Option<&Store>,
    selected: impl Fn(&str) -> bool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Vec<Trial> {
    let mut tasks = Vec::new();
    for case in cases::all().filter(|case| selected(case.name)) {
        for kind in REGISTRY {
            for time_step in case.time_steps {
                let steps = case.steps[usize::from(!config.quick)];
                tasks.push(Task { case, integrator: &kind.schema, time_step: *time_step, steps });
            }
        }
    }
    let done = std::sync::atomic::AtomicUsize::new(0);
    let trials = tasks.par_iter().with_max_len(1).flat_map_iter(|task| {
        let trials = run_task(*task, config, store);
        progress(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, tasks.len());
        trials
    });
    trials.collect()
}

fn run_task(task: Task, config: Config, store: Option<&Store>) -> Vec<Trial> {
    let Task { case, integrator, time_step, steps } = task;
    let trial = |robust: bool| match store {
        Some(store) => store.recall_or(case, integrator, time_step, steps, robust),
        None => trial::run(case, integrator, time_step, steps, robust),
    };
    let Some(plain) = trial(false) else { return Vec::new() };
    let failed = matches!(plain.outcome, Outcome::Failed { .. });
    let mut trials = vec![plain];
    if failed && config.robust {
        trials.extend(trial(true));
    }
    trials
}

/// The part of the report that stands against theory.
pub fn against_theory(config: Config) -> StabilityReport {
    StabilityReport {
        boundaries: boundaries(config.quick),
        amplifications: amplifications(),
        maps: maps(),
        ..StabilityReport::default()
    }
}
