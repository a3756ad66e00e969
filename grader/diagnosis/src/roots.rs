//! Other solutions of implicit steps.
//!
//! ```text
//! M (v' − v) = h F(x', v', t + h)      may have several solutions; Newton's method ends at one near its first guess
//! ```

use reference::equation::{self, Equation};
use scene::Scene;
use scene::schema::Convergence;
use scene::trace::State;

/// The equation of a scene's steps, if they are solved by Newton's method.
pub(crate) struct Roots {
    equation: Equation,
    time_step: f64,
}

impl Roots {
    /// Of a scene; `None` if its steps have one solution.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let is_newton = matches!(scene.integrator.convergence, Convergence::Update(_));
        is_newton.then(|| Self { equation: Equation::new(scene), time_step: scene.time_step })
    }

    /// Whether step number `step`, from 0, solves its equation, to the tolerance of the method. `earlier` is the state one
    /// step before `before`, if there is one.
    pub(crate) fn solves(
        &self,
        step: u64,
        earlier: Option<&State>,
        before: &State,
        after: &State,
    ) -> bool {
        let of = |state: &State| equation::State {
            x: state.positions.clone(),
            v: state.velocities.clone(),
        };
        let time = step as f64 * self.time_step;
        let earlier = earlier.map(of);
        self.equation.excess(earlier.as_ref(), &of(before), &of(after), time).0 <= 1.0
    }
}

/// Whether every step of a trace solves its equation.
pub fn solve_all(scene: &Scene, states: &[State]) -> bool {
    let Some(roots) = Roots::of(scene) else { return false };
    states.windows(2).enumerate().all(|(step, pair)| {
        let earlier = step.checked_sub(1).map(|earlier| &states[earlier]);
        roots.solves(step as u64, earlier, &pair[0], &pair[1])
    })
}
