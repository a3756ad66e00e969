//! The work of a search, counted and not timed: the same on every machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Estimated nanoseconds of one processor, fitted to the processor time of searches: half of their times are within a fifth
/// of what is counted.
pub(super) mod cost {
    /// A model of a scene, and a step with it.
    pub(crate) const MODEL: usize = 6_000;
    /// The force of a term on an element, or of a field on a particle.
    pub(crate) const FORCE: usize = 400;
    /// Its Jacobian.
    pub(crate) const JACOBIAN: usize = 200;
    /// Its Jacobian, as the derivatives of its force.
    pub(crate) const DERIVATIVES: usize = 1_200;
    /// A coordinate of a term's contribution to a residual.
    pub(crate) const COORDINATE: usize = 400;
    /// An entry of a matrix that is assembled and factored.
    pub(crate) const ENTRY: usize = 10;
}

/// A count that the models of a scene share, and its limit.
#[derive(Debug, Clone)]
pub struct Work {
    nanoseconds: Arc<AtomicU64>,
    limit: Arc<AtomicU64>,
}

impl Default for Work {
    fn default() -> Self {
        Self { nanoseconds: Arc::default(), limit: Arc::new(AtomicU64::new(u64::MAX)) }
    }
}

impl Work {
    pub(super) fn add(&self, nanoseconds: usize) {
        self.nanoseconds.fetch_add(nanoseconds as u64, Ordering::Relaxed);
    }

    /// Nanoseconds counted so far.
    pub fn nanoseconds(&self) -> u64 {
        self.nanoseconds.load(Ordering::Relaxed)
    }

    /// Sets the limit to so much more than is counted.
    pub fn allow(&self, milliseconds: u64) {
        let more = milliseconds.saturating_mul(1_000_000);
        self.limit.store(self.nanoseconds().saturating_add(more), Ordering::Relaxed);
    }

    /// Whether more is counted than is allowed.
    pub fn is_over(&self) -> bool {
        self.nanoseconds() > self.limit.load(Ordering::Relaxed)
    }
}
