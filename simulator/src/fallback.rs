//! Optional fallbacks for steps that fail (`simulate --robust`).
//!
//! ```text
//! step of h fails  ->  the same equations, with a line search       (if the method has one)
//!                  ->  2, 4, … 2¹⁰ steps of h/2, h/4, … h/2¹⁰
//!                  ->  the original error
//! ```
//!
//! The line search solves the method's own equations. Substeps do not: they are the same method at a smaller time
//! step. A two-step method has no earlier state at their distance, and takes each as the first step of a run. A step through
//! a nearly singular matrix ([`NEARLY_SINGULAR`](crate::statistics::NEARLY_SINGULAR)) counts as failed, and stays as it is if
//! all fallbacks fail. Any other step that succeeds is never changed, so a run without failures has the same bits with and
//! without fallbacks. Other inaccuracy and unbounded growth are not failures. A second integrator, built at the first
//! failure, makes the attempts; the factors of the first one stay untouched. Cost: a copy of the state per step.
//!
//! A step that error control could not end is not tried again: the method has shortened it already.

/// The most times a step is halved.
pub const MAX_HALVINGS: u32 = 10;

/// Counts of the fallbacks taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FallbackStatistics {
    /// Steps whose equations a line search solved.
    pub line_searched: u64,
    /// Steps that were replaced by substeps.
    pub substepped: u64,
    /// Substeps taken.
    pub substeps: u64,
    /// The largest number of substeps in one step.
    pub max_substeps: u64,
}

impl FallbackStatistics {
    /// Steps that failed and were recovered.
    pub fn steps(&self) -> u64 {
        self.line_searched + self.substepped
    }
}
