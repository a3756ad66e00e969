//! Why a trace is wrong: which of its steps are, and what would explain them.
//!
//! ```text
//! single step     our step from the trace's own state k − 1, against its state k
//! momentum        r = M (v' − v) − h F          F where the method evaluates it, from the trace's own states
//!                 linearized: r − (h² K + h B)(v' − v)
//! position        p = x' − x − h v   or   x' − x − h v'
//! ```
//!
//! `r` and `p` are zero to rounding where a step is right, whatever the state is that it starts from: so an early
//! mistake is told from a hundred. What is not zero is held against candidates: a force's term with
//! another coefficient, another place to evaluate it at, another rule for positions.
//!
//! **An explanation explains all.** It is given where what it leaves of the defect is rounding, in every step looked
//! at. Candidates that do so equally well are told side by side, and none where there are too many of them: a wrong
//! explanation is worse than none.
//!
//! Cost: four steps of the simulator a state, and, for a dozen wrong steps, the law's Jacobians and some fifty
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

/// What is found of a trace that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// Which of its steps are wrong by themselves.
    pub steps: WrongSteps,
    /// What explains those; `None` where nothing does, or there are none.
    pub explanation: Option<Explanation>,
    /// Steps made anew from the oracle's states; `None` where there is no program to make them, or not of this scene.
    pub restarts: Option<Restarts>,
}

/// Looks into a trace, read once more; `None` where it cannot be read to its end.
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
