//! Interrupts steps that take long.
//!
//! A method that iterates looks at the flag once an iteration: before it assembles a linear system, between a local and a
//! global step, or before a step of error control. The numbers of a step that ends are not affected.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::StepError;

/// A flag that ends a running step, or a time at which it ends; its clones are the same flag.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    flag: Arc<AtomicBool>,
    end: Option<Instant>,
}

impl Interrupt {
    /// One that is raised from `end` on.
    pub fn at(end: Instant) -> Self {
        Self { end: Some(end), ..Self::default() }
    }

    /// Ends the running step, and all later ones, with [`StepError::Interrupted`].
    pub fn raise(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }

    /// Whether it was raised.
    pub fn is_raised(&self) -> bool {
        self.flag.load(Ordering::Relaxed) || self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// An error if it was raised.
    pub(super) fn check(&self) -> Result<(), StepError> {
        if self.is_raised() { Err(StepError::Interrupted) } else { Ok(()) }
    }
}
