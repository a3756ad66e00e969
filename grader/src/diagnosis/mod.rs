//! Diagnosis of a wrong trace: which steps are wrong by themselves.
//!
//! ```text
//! single step     our step from the trace's own state k − 1, against its state k
//! ```
//!
//! A right step agrees from any state, so that one early mistake can be distinguished from a hundred. The wrong steps,
//! and some right ones, are the evidence from which [`findings`](crate::findings) infers the mistake.
//!
//! Cost: four simulator steps for each state.

mod explanation;
mod restart;
mod roots;
mod steps;

pub use explanation::{Balance, Contribution, Explanation};
pub use restart::{Restarts, restart};
pub(crate) use roots::{Roots, other_root};
pub use steps::{Before, Evidence, Judge, Rounding, WrongSteps, examine, sampled};

/// The diagnosis of a trace that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// The steps that are wrong by themselves.
    pub steps: WrongSteps,
    /// The findings that explain them, in words.
    pub causes: Vec<String>,
    /// Whether an implicit step satisfies its own equation, and differs: its number, from 1.
    pub other_root: Option<u64>,
    /// Steps redone from the oracle's states; `None` without a program, or for scenes where it is impossible.
    pub restarts: Option<Restarts>,
    /// The first wrong step in numbers; `None` if no step is wrong.
    pub explanation: Option<Explanation>,
}
