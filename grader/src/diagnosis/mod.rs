//! Diagnosis of a wrong trace: which steps are wrong, and which mistake explains them.
//!
//! ```text
//! single step     our step from the trace's own state k − 1, against its state k
//! momentum        r = M (v' − v) − h F          F where the method evaluates it, from the trace's own states
//!                 linearized: r − (h² K + h B)(v' − v)
//! position        p = x' − x − h v   or   x' − x − h v'
//! ```
//!
//! `r` and `p` vanish up to rounding in a right step from any state. One early mistake can so be distinguished from a
//! hundred mistakes. Remainders are compared with candidate mistakes: a term with another coefficient, another
//! evaluation point, another position rule.
//!
//! **An explanation explains everything.** It is reported only if the remainder is rounding error in every examined
//! step. Several candidates that do so equally well are reported as alternatives, and none if they are too many: a
//! wrong explanation is worse than none.
//!
//! Cost: four simulator steps for each state; for about a dozen wrong steps also the law's Jacobians and some fifty
//! candidates. Memory is that of a few states.

mod candidates;
mod explain;
mod formulas;
mod physics;
mod restart;
mod steps;

use simulator::trace::State;

pub use candidates::{Candidate, Culprit};
pub use explain::Explanation;
pub use restart::{Restarts, restart};
pub use steps::WrongSteps;

use crate::compare::Expectation;
use crate::submission::StateSource;
use crate::suite::Case;
use steps::SingleSteps;

/// The diagnosis of a trace that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// The steps that are wrong by themselves.
    pub steps: WrongSteps,
    /// The mistake that explains them; `None` if there is no explanation, or no wrong step.
    pub explanation: Option<Explanation>,
    /// Steps redone from the oracle's states; `None` without a program, or for scenes where it is impossible.
    pub restarts: Option<Restarts>,
}

/// Diagnoses a trace, read once more; `None` if it cannot be read to its end.
pub fn diagnose(case: &Case, source: &mut dyn StateSource) -> Option<Diagnosis> {
    let Expectation { shape, n_states, .. } = Expectation::of(&case.scene);
    let mut single = SingleSteps::new(&case.scene);
    let mut state = State::zeros(shape);
    for _ in 0..n_states {
        if !source.read(&mut state).ok()? {
            return None;
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if !(finite(&state.positions) && finite(&state.velocities)) {
            return None;
        }
        single.add(&state);
    }
    let (steps, samples) = single.finish();
    let explanation = explain::explain(&case.scene, &samples, &steps);
    Some(Diagnosis { steps, explanation, restarts: None })
}
