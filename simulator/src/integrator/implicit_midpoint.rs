//! Implicit midpoint, second order: Newton's method on the velocities of the step's middle.
//!
//! ```text
//! M (v' − v) = h F(q½, v½, t + h/2)        q' = q + h v½        q½ = (q + q')/2,  v½ = (v + v')/2
//! ```
//!
//! The middle is the end of a step of implicit Euler of half the length, and the end is twice as far from the start:
//!
//! ```text
//! M (v½ − v) = h/2 F(q + h/2 v½, v½)        q' = q + h v½        v' = 2 v½ − v
//! ```
//!
//! So Newton's method, its tolerance and its line search are those of [`implicit_euler`](super::implicit_euler). The
//! method is symplectic, keeps the angular momentum of central forces, and keeps every quadratic energy: an undamped
//! linear oscillation neither grows nor decays at any step. It does not damp fast motions that a step cannot resolve.
//!
//! Source: Hairer, Lubich and Wanner, *Geometric Numerical Integration*, sections I.1.2, IV.2.1 and VI.4.1.

use super::implicit_euler::NEWTON;
use super::substep::{Substep, build};
use super::{IntegratorKind, Step, drift};
use crate::system::System;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "implicit-midpoint",
        aliases: &[],
        summary: "m (v' - v) = h F at the middle of both states, q' = q + h (v + v')/2, by Newton's method to 1e-9",
        formula: "`M (v' − v) = h F((q + q')/2, (v + v')/2, t + h/2)`, `q' = q + h (v + v')/2`, by Newton's method for `(v + v')/2` from `v` until the update's l2 norm is below 1e-9",
        equation: StepEquation::ImplicitMidpoint,
        family: Family::Implicit,
        matrix: Matrix::Jacobians,
        convergence: Convergence::Update(NEWTON.tolerance),
        order: Order::always(2),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2, ImplicitMidpoint>,
    build_3d: build::<3, ImplicitMidpoint>,
};

struct ImplicitMidpoint {
    /// Positions and velocities at the start of the step.
    start: [Vec<f64>; 2],
}

impl Substep for ImplicitMidpoint {
    fn new(n_coordinates: usize) -> Self {
        Self { start: [vec![0.0; n_coordinates], vec![0.0; n_coordinates]] }
    }

    /// Goes to the middle by `implicit`, and from there to the end.
    fn step<const D: usize, R>(
        &mut self,
        _system: &System<D>,
        step: Step<'_>,
        implicit: impl FnOnce(Step<'_>) -> R,
    ) -> R {
        let Step { size, time, positions, velocities, statistics, .. } = step;
        let [q, v] = &mut self.start;
        q.copy_from_slice(positions);
        v.copy_from_slice(velocities);
        let to_middle = Step {
            size: 0.5 * size,
            time,
            positions: &mut *positions,
            velocities: &mut *velocities,
            earlier: None,
            statistics,
        };
        let result = implicit(to_middle);
        positions.copy_from_slice(q);
        drift(positions, velocities, size);
        for (velocity, start) in velocities.iter_mut().zip(v) {
            *velocity = 2.0 * *velocity - *start;
        }
        result
    }
}
