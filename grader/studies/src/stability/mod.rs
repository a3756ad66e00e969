//! Stability study: outcomes of each method on hard cases, and stability boundaries.
//!
//! ```text
//! cases × methods × time steps ──> trial ──> outcome ──┬─> against the stored outcomes (expected)
//!                                                      └─> again, where it failed, with rescue (--robust)
//! oscillators, chains ──> one step measured ──> radius ──┬─> boundary by bisection, against Jury's criterion
//!                                                        ├─> amplification, damping, period
//!                                                        └─> map over (h ω, ζ)
//! ```
//!
//! Every expected outcome is stored: a change of behaviour is a failure. A trial that survives is checked against the
//! equation of its method with laws independent of the simulator ([`trial`]). A silent wrong answer is therefore a
//! separate outcome, which is never expected. Cost: some seconds for a quick run, half a minute for a full one; stored
//! trials ([`store`]) do not run again.

pub mod cases;
pub mod expected;
pub mod outcome;
pub mod store;
pub mod theory;
pub mod trial;

mod draft;

use rayon::prelude::*;
use simulator::integrator::REGISTRY;

pub use expected::{Change, Expectations};
pub use outcome::{Measured, Outcome, Trial};

use store::Store;
use theory::amplification::{Amplification, amplifications};
use theory::boundary::{Boundary, boundaries};
use theory::map::{Map, maps};
use trial::Task;

/// Extent of the study.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Config {
    /// Fewer steps, and fewer damping ratios.
    pub quick: bool,
    /// Run failed trials again, with fallbacks for failed steps.
    pub robust: bool,
}

/// Results of the study.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StabilityReport {
    /// All trials, in the order of cases, methods and time steps; a robust trial follows the failed one.
    pub trials: Vec<Trial>,
    /// Stability boundaries.
    pub boundaries: Vec<Boundary>,
    /// Amplification factors.
    pub amplifications: Vec<Amplification>,
    /// Maps.
    pub maps: Vec<Map>,
    /// Differences from the stored outcomes.
    pub changes: Vec<Change>,
}

impl StabilityReport {
    /// Whether the study passes: no wrong outcome, no change, and all boundaries agree with theory.
    pub fn is_pass(&self) -> bool {
        self.changes.is_empty()
            && self.trials.iter().all(|trial| !trial.outcome.is_wrong())
            && self.boundaries.iter().all(Boundary::agrees)
    }
}

/// Runs the cases whose name `selected` accepts. Calls `progress` with the number of finished trials and the total.
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
                let (integrator, time_step) = (&kind.schema, *time_step);
                tasks.push(Task { case, integrator, time_step, steps, robust: false });
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
    let trial = |task| store.map_or_else(|| trial::run(task), |store| store.recall_or(task));
    let Some(plain) = trial(task) else { return Vec::new() };
    let failed = matches!(plain.outcome, Outcome::Failed { .. });
    let mut trials = vec![plain];
    if failed && config.robust {
        trials.extend(trial(Task { robust: true, ..task }));
    }
    trials
}

/// The comparison with theory.
pub fn against_theory(config: Config) -> StabilityReport {
    StabilityReport {
        boundaries: boundaries(config.quick),
        amplifications: amplifications(),
        maps: maps(),
        ..StabilityReport::default()
    }
}
