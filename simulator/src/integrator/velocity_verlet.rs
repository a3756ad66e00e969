//! Velocity Verlet, second order, one force evaluation a step where forces depend on positions alone, two otherwise.
//!
//! ```text
//! a = M⁻¹ F(q, v, t)        q' = q + h v + h²/2 a
//! a' = M⁻¹ F(q', v + h a, t + h)        v' = v + h/2 (a + a')
//! ```
//!
//! The velocity at the end is not known when `a'` is evaluated. `v + h a` stands for it, which is off by O(h²): the
//! method keeps its order where forces depend on velocities, and is explicit. Damping shortens the longest stable step.
//!
//! Where forces depend on positions alone, `a'` is the `a` of the next step, and is kept. It is used only if the next
//! step starts at the positions that it was evaluated at, so that a step depends on nothing but its start.
//!
//! Source: Swope, Andersen, Berens and Wilson (1982); Hairer, Lubich and Wanner, *Geometric Numerical Integration*,
//! section I.1.4.

use sparse::linear::LinearSolver;

use super::{Integrator, IntegratorKind, Step, StepError, drift, kick};
use crate::system::System;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};
use scene::{ForceElement, Scene};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "velocity-verlet",
        aliases: &[],
        summary: "a = F(q, v)/m, q' = q + h v + h²/2 a, v' = v + h/2 (a + F(q', v + h a)/m)",
        formula: "`a = M⁻¹ F(q, v, t)`, `q' = q + h v + h²/2 a`, `a' = M⁻¹ F(q', v + h a, t + h)`, `v' = v + h/2 (a + a')`",
        equation: StepEquation::VelocityVerlet,
        family: Family::Symplectic,
        matrix: Matrix::None,
        convergence: Convergence::Direct,
        order: Order::always(2),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(
    scene: &Scene,
    system: &System<D>,
    _: LinearSolver,
) -> Box<dyn Integrator<D>> {
    let mut depends_on = scene.forces.iter().map(ForceElement::depends_on);
    let zeros = vec![0.0; system.n_particles() * D];
    Box::new(VelocityVerlet {
        keeps: depends_on.all(|depends_on| !depends_on.velocity && !depends_on.time),
        at: Vec::new(),
        force: zeros.clone(),
        half: zeros.clone(),
        ahead: zeros,
    })
}

struct VelocityVerlet {
    /// Whether the force at the end of a step is that at the start of the next one.
    keeps: bool,
    /// The positions that `force` belongs to; empty where it is not kept.
    at: Vec<f64>,
    force: Vec<f64>,
    /// `v + h/2 a`.
    half: Vec<f64>,
    /// `v + h a`.
    ahead: Vec<f64>,
}

impl<const D: usize> Integrator<D> for VelocityVerlet {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size: h, time, positions, velocities, statistics, .. } = step;
        let Self { keeps, at, force, half, ahead } = self;
        if *at != *positions {
            system.force(positions, velocities, time, force)?;
            statistics.force_evaluations += 1;
        }
        half.copy_from_slice(velocities);
        kick(system, force, 0.5 * h, half);
        ahead.copy_from_slice(velocities);
        kick(system, force, h, ahead);
        drift(positions, half, h);
        velocities.copy_from_slice(half);
        system.force(positions, ahead, time + h, force)?;
        statistics.force_evaluations += 1;
        kick(system, force, 0.5 * h, velocities);
        if *keeps {
            at.clear();
            at.extend_from_slice(positions);
        }
        Ok(())
    }
}
