//! The two-step backward differentiation formula at a constant step, second order: Newton's method on the velocities of
//! the step's end.
//!
//! ```text
//! q' = q̂ + 2/3 h v'        M (v' − v̂) = 2/3 h F(q', v', t + h)        q̂ = q + (q − q₋)/3,  v̂ = v + (v − v₋)/3
//! ```
//!
//! with `q₋, v₋` one step before `q, v`. The step is one of implicit Euler of 2/3 of the length, from `(q̂, v̂)` to the same
//! end. So Newton's method, its tolerance and its line search are those of [`implicit_euler`](super::implicit_euler).
//!
//! A step without an earlier state is one of implicit Euler: the first of a run, and each substep of a fallback. Its error
//! is of the size of `h²`. Later steps keep that error and do not multiply it, so the method stays of second order.
//!
//! The method is A-stable. It damps motions that are faster than the step, as implicit Euler does, and slower motions far
//! less.
//!
//! Source: Hairer and Wanner, *Solving Ordinary Differential Equations II*, sections V.1 and V.2.

use super::implicit_euler::NEWTON;
use super::substep::{Substep, build};
use super::{IntegratorKind, Step};
use crate::system::System;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "bdf2",
        aliases: &["backward-differentiation-2"],
        summary: "q' = q^ + 2/3 h v', m (v' - v^) = 2/3 h F(q', v'), ^: 4/3 of the state - 1/3 of the one before, by Newton's method to 1e-9",
        formula: "`q' = q̂ + 2/3 h v'`, `M (v' − v̂) = 2/3 h F(q', v', t + h)`, with `q̂ = 4/3 q − 1/3 q₋` and `v̂ = 4/3 v − 1/3 v₋` of this state and the one a step before it, by Newton's method from `v̂` until the update's l2 norm is below 1e-9; the first step is one of implicit Euler",
        equation: StepEquation::BackwardDifferentiation2,
        family: Family::Implicit,
        matrix: Matrix::Jacobians,
        convergence: Convergence::Update(NEWTON.tolerance),
        order: Order::always(2),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2, Bdf2>,
    build_3d: build::<3, Bdf2>,
};

struct Bdf2 {
    /// Positions at the start of the step.
    start: Vec<f64>,
}

impl Substep for Bdf2 {
    fn new(n_coordinates: usize) -> Self {
        Self { start: vec![0.0; n_coordinates] }
    }

    /// Combines the start with the earlier state, and goes on by `implicit`.
    fn step<const D: usize, R>(
        &mut self,
        system: &System<D>,
        step: Step<'_>,
        implicit: impl FnOnce(Step<'_>) -> R,
    ) -> R {
        let Some(earlier) = step.earlier else {
            return implicit(step);
        };
        let Step { size, time, positions, velocities, statistics, .. } = step;
        self.start.copy_from_slice(positions);
        let fixed = || system.fixed().iter().flat_map(|fixed| [*fixed; D]).enumerate();
        for (dof, is_fixed) in fixed() {
            if is_fixed {
                // Two thirds of the step lead to where its velocity takes it.
                positions[dof] += size / 3.0 * velocities[dof];
            } else {
                positions[dof] += (positions[dof] - earlier.positions[dof]) / 3.0;
                velocities[dof] += (velocities[dof] - earlier.velocities[dof]) / 3.0;
            }
        }
        let to_end = Step {
            size: 2.0 / 3.0 * size,
            time: time + size / 3.0,
            positions: &mut *positions,
            velocities: &mut *velocities,
            earlier: None,
            statistics,
        };
        let result = implicit(to_end);
        for (dof, _) in fixed().filter(|(_, is_fixed)| *is_fixed) {
            positions[dof] = self.start[dof] + size * velocities[dof];
        }
        result
    }
}
