//! Symplectic (semi-implicit, forward-backward) Euler, first order, one force evaluation a step.
//!
//! ```text
//! v' = v + h M⁻¹ F(q, v)        q' = q + h v'
//! ```
//!
//! Source: hand-out of milestone 2, section 3.5.

use sparse::linear::LinearSolver;

use super::euler::Euler;
use super::{Integrator, IntegratorKind};
use crate::system::System;
use scene::Scene;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "symplectic-euler",
        aliases: &["symplectic", "semi-implicit-euler", "semi-implicit", "forward-backward-euler"],
        summary: "v' = v + h F(q, v)/m, q' = q + h v'",
        formula: "`v' = v + h M⁻¹ F(q, v, t)`, `q' = q + h v'`",
        equation: StepEquation::SymplecticEuler,
        family: Family::Symplectic,
        matrix: Matrix::None,
        convergence: Convergence::Direct,
        order: Order::always(1),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(_: &Scene, system: &System<D>, _: LinearSolver) -> Box<dyn Integrator<D>> {
    Box::new(Euler::<true>::new(system))
}
