//! Budget of time of a hand-in: as long as all its runs together may take.
//!
//! The time of a run is what elapses from its start to its end. Runs at the same time count each, so that the sum depends
//! little on the number of threads. It still depends on the machine and on what else it does.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::verdict::{LastOutput, RunEnd, RunFailure};

/// A budget of time. Clones share what is spent.
#[derive(Debug, Clone)]
pub struct Budget {
    seconds: f64,
    /// In microseconds.
    spent: Arc<AtomicU64>,
}

impl Budget {
    /// A budget of so many seconds, of which some are spent.
    pub fn new(seconds: f64, spent: f64) -> Self {
        Self { seconds, spent: Arc::new(AtomicU64::new((spent * 1e6) as u64)) }
    }

    /// Time spent, in seconds.
    pub fn spent(&self) -> f64 {
        self.spent.load(Ordering::Relaxed) as f64 / 1e6
    }

    /// The failure of a further run, if nothing is left for it.
    pub(super) fn used_up(&self) -> Option<RunFailure> {
        let end = RunEnd::Budget(self.seconds);
        (self.spent() >= self.seconds).then_some(RunFailure { end, output: LastOutput::default() })
    }

    /// Spends the time of a run.
    pub(super) fn spend(&self, time: Duration) {
        let microseconds = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        self.spent.fetch_add(microseconds, Ordering::Relaxed);
    }
}
