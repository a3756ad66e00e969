//! A worker with a thread.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use scene::Scene;
use simulator::integrator::Interrupt;
use simulator::simulation::Simulation;

use super::{Done, Job, Stepper, Stopped};

/// The thread of a run. It ends with this value, once its step does.
pub(crate) struct Worker {
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
    pub(crate) fn start(budget: Duration) -> Self {
        let (jobs, received) = channel();
        let (sender, results) = channel();
        thread::spawn(move || {
            let mut stepper = Stepper::new(budget);
            let jobs: Receiver<(Job, Interrupt)> = received;
            for (job, interrupt) in jobs {
                let Some(done) = stepper.take(&job, &interrupt) else { return };
                if sender.send(done).is_err() {
                    return;
                }
            }
        });
        Self { jobs, results, current: None }
    }

    /// Whether the thread has a job, abandoned or not.
    pub(crate) fn is_busy(&self) -> bool {
        self.current.is_some()
    }

    /// Whether the thread has a job that is not abandoned.
    pub(crate) fn is_running(&self) -> bool {
        self.current.as_ref().is_some_and(|current| !current.interrupt.is_raised())
    }

    /// When its job began.
    pub(crate) fn busy_since(&self) -> Option<Instant> {
        self.current.as_ref().map(|current| current.since)
    }

    /// Begins a job. The thread must not be busy.
    pub(crate) fn begin(&mut self, job: Job) {
        let interrupt = Interrupt::default();
        // If the thread has ended, `wait` says so.
        let _ = self.jobs.send((job, interrupt.clone()));
        self.current = Some(Current { since: Instant::now(), interrupt });
    }

    /// Ends the job soon; its result means nothing.
    pub(crate) fn abandon(&self) {
        if let Some(current) = &self.current {
            current.interrupt.raise();
        }
    }

    /// The result of the job; `None` if it has not ended at the deadline.
    ///
    /// # Errors
    /// If the thread has ended.
    pub(crate) fn wait(&mut self, deadline: Instant) -> Result<Option<Done>, Stopped> {
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

/// Runs the scene for `time` at most, from its initial state: `see` is called with the positions of each state, and yields
/// what is found so far and whether the run goes on. Yields what was found last.
pub(crate) fn look<F: Copy + Send + 'static>(
    scene: &Arc<Scene>,
    time: Duration,
    first: F,
    mut see: impl FnMut(&Scene, &[f64]) -> (F, bool) + Send + 'static,
) -> F {
    let found = Arc::new(Mutex::new(first));
    let interrupt = Interrupt::default();
    let (ended, end) = channel();
    // A step may take longer than the look: a separate thread takes the steps, and ends after the one that is running.
    let look = {
        let (scene, found, interrupt) = (Arc::clone(scene), Arc::clone(&found), interrupt.clone());
        move || {
            let mut simulation = Simulation::new(&scene);
            simulation.interrupt_by(&interrupt);
            while !interrupt.is_raised() && matches!(simulation.advance(), Ok(true)) {
                let (seen, goes_on) = see(&scene, simulation.state().positions);
                *found.lock().unwrap_or_else(PoisonError::into_inner) = seen;
                if !goes_on {
                    break;
                }
            }
            // Nobody waits any more.
            let _ = ended.send(());
        }
    };
    thread::spawn(look);
    let _ = end.recv_timeout(time);
    interrupt.raise();
    let found = found.lock().unwrap_or_else(PoisonError::into_inner);
    *found
}
