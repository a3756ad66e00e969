//! Linearized implicit Euler, first order: one linear solve a step.
//!
//! ```text
//! (M − h² ∂F/∂x − h ∂F/∂v) δ = h F        v' = v + δ        q' = q + h v'
//! ```
//!
//! with force and Jacobians at `(q + h v, v)`. Source: hand-out of milestone 3, section 6, equation (2).

use sparse::linear::LinearSolver;

use super::backward::{Linearisation, Point};
use super::{Integrator, IntegratorKind, Observer, Step, StepError, drift};
use crate::system::System;
use scene::Scene;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "linearized-implicit-euler",
        aliases: &["linearized-implicit"],
        summary: "one Newton step of implicit Euler, from v' = v",
        formula: "`(M − h² ∂F/∂x − h ∂F/∂v) (v' − v) = h F` at `(q + h v, v, t + h)`, `q' = q + h v'`",
        equation: StepEquation::LinearizedImplicitEuler,
        family: Family::Implicit,
        matrix: Matrix::Jacobians,
        convergence: Convergence::Direct,
        order: Order::always(1),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(
    _: &Scene,
    system: &System<D>,
    solver: LinearSolver,
) -> Box<dyn Integrator<D>> {
    let delta = vec![0.0; system.n_particles() * D];
    Box::new(LinearizedImplicitEuler { linearisation: Linearisation::new(system, solver), delta })
}

struct LinearizedImplicitEuler<const D: usize> {
    linearisation: Linearisation<D>,
    delta: Vec<f64>,
}

impl<const D: usize> Integrator<D> for LinearizedImplicitEuler<D> {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size: h, time, positions, velocities, statistics, .. } = step;
        let point = Point { h, time: time + h, positions, velocities, iterate: velocities };
        self.linearisation.solve(system, point, &mut self.delta, statistics)?;
        for (velocity, change) in velocities.iter_mut().zip(&self.delta) {
            *velocity += change;
        }
        drift(positions, velocities, h);
        Ok(())
    }

    fn observe(&mut self, observer: Observer) {
        self.linearisation.observe(observer);
    }
}
