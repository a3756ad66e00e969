//! A worker without a thread: a job has ended when it has begun.

use std::sync::Arc;
use std::time::{Duration, Instant};

use scene::Scene;
use simulator::integrator::Interrupt;
use simulator::simulation::Simulation;

use super::{Done, Job, Stepper, Stopped};

/// A run's simulation, and the result of the last job.
pub(crate) struct Worker {
    stepper: Stepper,
    done: Option<(Instant, Done)>,
    is_abandoned: bool,
}

impl Worker {
    /// `budget` is the computing time of a job.
    pub(crate) fn start(budget: Duration) -> Self {
        Self { stepper: Stepper::new(budget), done: None, is_abandoned: false }
    }

    /// Whether there is a job whose result nobody took, abandoned or not.
    pub(crate) fn is_busy(&self) -> bool {
        self.done.is_some()
    }

    /// The same of a job that is not abandoned.
    pub(crate) fn is_running(&self) -> bool {
        self.is_busy() && !self.is_abandoned
    }

    /// When its job began.
    pub(crate) fn busy_since(&self) -> Option<Instant> {
        self.done.as_ref().map(|(since, _)| *since)
    }

    /// Does a job.
    pub(crate) fn begin(&mut self, job: Job) {
        let since = Instant::now();
        self.is_abandoned = false;
        self.done = self.stepper.take(&job, &Interrupt::default()).map(|done| (since, done));
    }

    /// The result of the job means nothing.
    pub(crate) fn abandon(&mut self) {
        self.is_abandoned = true;
    }

    /// The result of the job.
    ///
    /// # Errors
    /// None here.
    pub(crate) fn wait(&mut self, _: Instant) -> Result<Option<Done>, Stopped> {
        Ok(self.done.take().map(|(_, done)| done))
    }
}

/// Runs the scene for `time`, and the iteration that exceeds it, from its initial state: `see` is called with the positions of each
/// state, and yields what is found so far and whether the run goes on. Yields what was found last.
pub(crate) fn look<F>(
    scene: &Arc<Scene>,
    time: Duration,
    first: F,
    mut see: impl FnMut(&Scene, &[f64]) -> (F, bool),
) -> F {
    let interrupt = Interrupt::at(Instant::now() + time);
    let mut simulation = Simulation::new(scene);
    simulation.interrupt_by(&interrupt);
    let mut found = first;
    while !interrupt.is_raised() && matches!(simulation.advance(), Ok(true)) {
        let (seen, goes_on) = see(scene, simulation.state().positions);
        found = seen;
        if !goes_on {
            break;
        }
    }
    found
}
