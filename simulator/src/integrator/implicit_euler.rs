//! Implicit (backward) Euler, first order: Newton's method on the velocities of the step's end.
//!
//! ```text
//! M (v' − v) = h F(q + h v', v')        q' = q + h v'
//! ```
//!
//! Newton starts from `v` and stops when the l2 norm of the update is below 1e-9. Source: hand-out of
//! milestone 3, sections 5 and 10, equation (1).

use super::backward::{Linearisation, Point};
use super::{Integrator, IntegratorKind, Observer, Step, StepError, drift};
use crate::scene::Scene;
use crate::scene::schema::{IntegratorSchema, refuses_nothing};
use crate::solver::linear::LinearSolver;
use crate::solver::newton::{NewtonError, NewtonOptions, newton};
use crate::system::System;

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "implicit-euler",
        aliases: &["implicit"],
        summary: "m (v' - v) = h F(q', v'), q' = q + h v', by Newton's method to 1e-9",
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

/// A hundred quadratically converging iterations would be far more than a solvable step takes.
const NEWTON: NewtonOptions = NewtonOptions { tolerance: 1e-9, max_iterations: 100 };

fn build<const D: usize>(
    _: &Scene,
    system: &System<D>,
    solver: LinearSolver,
) -> Box<dyn Integrator<D>> {
    let zeros = vec![0.0; system.n_particles() * D];
    let linearisation = Linearisation::new(system, solver);
    Box::new(ImplicitEuler { linearisation, iterate: zeros.clone(), delta: zeros })
}

struct ImplicitEuler<const D: usize> {
    linearisation: Linearisation<D>,
    iterate: Vec<f64>,
    delta: Vec<f64>,
}

impl<const D: usize> Integrator<D> for ImplicitEuler<D> {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size: h, time, positions, velocities, statistics } = step;
        self.iterate.copy_from_slice(velocities);
        let linearisation = &mut self.linearisation;
        let result = newton(&mut self.iterate, &mut self.delta, NEWTON, |iterate, delta| {
            let point = Point { h, time: time + h, positions, velocities, iterate };
            linearisation.solve(system, point, delta, statistics)
        });
        let iterations = result.map_err(|error| match error {
            NewtonError::Update(error) => error,
            NewtonError::BelowRounding { iterations, update, size } => {
                StepError::BelowRounding { iterations, update, speed: size }
            }
            NewtonError::NotConverged { iterations, update } => {
                StepError::NotConverged { iterations, update, residual: linearisation.residual }
            }
        })?;
        statistics.newton_iterations += iterations;
        statistics.max_newton_iterations = statistics.max_newton_iterations.max(iterations);
        velocities.copy_from_slice(&self.iterate);
        drift(positions, velocities, h);
        Ok(())
    }

    fn observe(&mut self, observer: Observer) {
        self.linearisation.observe(observer);
    }
}
