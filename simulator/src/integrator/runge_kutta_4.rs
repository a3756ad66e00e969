//! The classical Runge–Kutta method, fourth order, four force evaluations a step.
//!
//! ```text
//! a₁ = M⁻¹ F(q, v, t)                          v₁ = v
//! a₂ = M⁻¹ F(q + h/2 v₁, v₂, t + h/2)          v₂ = v + h/2 a₁
//! a₃ = M⁻¹ F(q + h/2 v₂, v₃, t + h/2)          v₃ = v + h/2 a₂
//! a₄ = M⁻¹ F(q + h v₃, v₄, t + h)              v₄ = v + h a₃
//! q' = q + h/6 (v₁ + 2 v₂ + 2 v₃ + v₄)         v' = v + h/6 (a₁ + 2 a₂ + 2 a₃ + a₄)
//! ```
//!
//! The velocities' mean is evaluated as `v + h/6 (a₁ + a₂ + a₃)`, which is exactly `v` for a fixed particle.
//!
//! Not symplectic: an undamped oscillation loses `(h ω)⁶/72` of its energy in a step. Source: Hairer, Nørsett and
//! Wanner, *Solving Ordinary Differential Equations I*, section II.1.

use sparse::linear::LinearSolver;

use super::{Integrator, IntegratorKind, Step, StepError, drift, kick};
use crate::system::System;
use scene::Scene;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "runge-kutta-4",
        aliases: &["rk4"],
        summary: "the classical Runge-Kutta method: four forces, with weights 1/6, 1/3, 1/3, 1/6",
        formula: "`a₁ = M⁻¹ F(q, v, t)`, `a₂ = M⁻¹ F(q + h/2 v, v₂, t + h/2)`, `a₃ = M⁻¹ F(q + h/2 v₂, v₃, t + h/2)`, `a₄ = M⁻¹ F(q + h v₃, v₄, t + h)` with `v₂ = v + h/2 a₁`, `v₃ = v + h/2 a₂`, `v₄ = v + h a₃`; `q' = q + h/6 (v + 2 v₂ + 2 v₃ + v₄)`, `v' = v + h/6 (a₁ + 2 a₂ + 2 a₃ + a₄)`",
        equation: StepEquation::RungeKutta4,
        family: Family::Explicit,
        matrix: Matrix::None,
        convergence: Convergence::Direct,
        order: Order::always(4),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

/// Of each stage: how far into the step it is, and the weights of its acceleration in the mean velocity and in the new
/// one. A stage starts from the step's start, with the slope of the stage before it.
const STAGES: [(f64, [f64; 2]); 4] = [
    (0.0, [1.0 / 6.0, 1.0 / 6.0]),
    (0.5, [1.0 / 6.0, 1.0 / 3.0]),
    (0.5, [1.0 / 6.0, 1.0 / 3.0]),
    (1.0, [0.0, 1.0 / 6.0]),
];

fn build<const D: usize>(_: &Scene, system: &System<D>, _: LinearSolver) -> Box<dyn Integrator<D>> {
    let zeros = || vec![0.0; system.n_particles() * D];
    Box::new(RungeKutta4 {
        start: zeros(),
        stage: [zeros(), zeros()],
        mean: zeros(),
        force: zeros(),
    })
}

struct RungeKutta4 {
    /// Velocities at the start of the step.
    start: Vec<f64>,
    /// Positions and velocities of the stage.
    stage: [Vec<f64>; 2],
    /// Mean velocities of the step.
    mean: Vec<f64>,
    force: Vec<f64>,
}

impl<const D: usize> Integrator<D> for RungeKutta4 {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size: h, time, positions, velocities, statistics, .. } = step;
        let Self { start, stage: [x, u], mean, force } = self;
        for copy in [&mut *start, &mut *u, &mut *mean] {
            copy.copy_from_slice(velocities);
        }
        force.fill(0.0);
        for (part, [of_mean, of_new]) in STAGES {
            // The slope of the stage before this one is `(u, force)`.
            x.copy_from_slice(positions);
            drift(x, u, part * h);
            u.copy_from_slice(start);
            kick(system, force, part * h, u);
            system.force(x, u, time + part * h, force)?;
            statistics.force_evaluations += 1;
            kick(system, force, of_mean * h, mean);
            kick(system, force, of_new * h, velocities);
        }
        drift(positions, mean, h);
        Ok(())
    }
}
