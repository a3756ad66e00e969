//! What is tried where a step has no answer, for who asks for it (`simulate --robust`).
//!
//! ```text
//! step of h fails  ->  the same equations, with a line search       (where the method has such a way)
//!                  ->  2, 4, … 2¹⁰ steps of h/2, h/4, … h/2¹⁰
//!                  ->  the failure, as it was
//! ```
//!
//! The first way gives what the method is defined to give. The second does not: it is the same method at a smaller
//! step, for the length of this one. A step that succeeds is never changed, so that a run without failures is the
//! same bits with and without. What is merely inaccurate or grows without bound is no failure, and is left alone.
//! The attempts are made by a second integrator, built when it is first needed: the first one's factors are not
//! touched. Cost: a copy of the state a step; nothing else where nothing fails.

/// The most times a step is halved.
pub const MAX_HALVINGS: u32 = 10;

/// What was done for steps that had no answer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RescueStatistics {
    /// Steps whose own equations a line search solved.
    pub line_searched: u64,
    /// Steps in whose place smaller ones were taken.
    pub substepped: u64,
    /// The smaller steps that were taken.
    pub substeps: u64,
    /// The most that were taken in the place of a single step.
    pub max_substeps: u64,
}

impl RescueStatistics {
    /// Steps that had no answer.
    pub fn steps(&self) -> u64 {
        self.line_searched + self.substepped
    }
}
