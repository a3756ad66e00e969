//! Symplectic (semi-implicit, forward-backward) Euler, first order, one force evaluation a step.
//!
//! ```text
//! v' = v + h M⁻¹ F(q, v)        q' = q + h v'
//! ```
//!
//! Source: hand-out of milestone 2, section 3.5.

use super::{Integrator, IntegratorKind, Step, StepError, kick_and_drift};
use crate::scene::Scene;
use crate::scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};
use crate::solver::linear::LinearSolver;
use crate::system::System;

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "symplectic-euler",
        aliases: &["symplectic", "forward-backward-euler"],
        summary: "v' = v + h F(q, v)/m, q' = q + h v'",
        formula: "`v' = v + h M⁻¹ F(q, v)`, `q' = q + h v'`",
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
    Box::new(SymplecticEuler { force: vec![0.0; system.n_particles() * D] })
}

struct SymplecticEuler {
    force: Vec<f64>,
}

impl<const D: usize> Integrator<D> for SymplecticEuler {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        system.force(step.positions, step.velocities, step.time, &mut self.force)?;
        step.statistics.force_evaluations += 1;
        kick_and_drift::<D, true>(system, &self.force, step);
        Ok(())
    }
}
