//! Records of the iterates of methods that solve implicit Euler's equations.
//!
//! With an iterate `u` of the new velocity, the residual of the equations and the incremental potential are
//!
//! ```text
//! r(u) = M (v − u) + h F(q + h u, u)
//! E(u) = ½ ‖u − v‖²_M + U(q + h u) + h R(u)        r = −∂E/∂u where all forces derive from U and R
//! ```
//!
//! Both are computed in the same way for every method, so that their iterates compare, and only where the recorder asks.
//! Statistics do not count these evaluations. Without a recorder nothing is computed.

use super::backward::Point;
use super::drift;
use crate::system::System;

/// An iterate of a step.
pub struct Iterate<'a> {
    /// Its number in the step, from 0.
    pub iteration: u64,
    /// The iterate `u`, `n·D`, particle-major.
    pub velocities: &'a [f64],
    /// The part `α` of the method's step that led here; `None` of the first iterate.
    pub step_length: Option<f64>,
    /// Halvings by which a line search found `α`.
    pub halvings: u64,
    equations: &'a dyn Equations,
}

impl Iterate<'_> {
    /// `‖r(u)‖₂` over the free particles, in units of momentum; `None` where a force is not defined.
    pub fn residual(&self) -> Option<f64> {
        self.equations.residual(self.velocities)
    }

    /// `E` at any velocities, in units of energy; `None` if some force derives from neither an energy nor a dissipation
    /// function.
    pub fn energy_at(&self, velocities: &[f64]) -> Option<f64> {
        self.equations.energy(velocities)
    }
}

/// Receives every iterate.
pub type IterationRecorder = Box<dyn FnMut(&Iterate<'_>) + Send>;

/// Implicit Euler's equations of one step.
trait Equations {
    fn residual(&self, u: &[f64]) -> Option<f64>;
    fn energy(&self, u: &[f64]) -> Option<f64>;
}

struct StepEquations<'a, const D: usize> {
    system: &'a System<D>,
    point: Point<'a>,
}

impl<const D: usize> StepEquations<'_, D> {
    /// `q + h u`.
    fn positions(&self, u: &[f64]) -> Vec<f64> {
        let mut positions = self.point.positions.to_vec();
        drift(&mut positions, u, self.point.h);
        positions
    }
}

impl<const D: usize> Equations for StepEquations<'_, D> {
    fn residual(&self, u: &[f64]) -> Option<f64> {
        let Self { system, point: Point { h, time, velocities, .. } } = self;
        let mut force = vec![0.0; u.len()];
        system.force(&self.positions(u), u, *time, &mut force).ok()?;
        let mut squared = 0.0;
        for particle in system.free().iter().cloned().flatten() {
            for dof in particle * D..particle * D + D {
                let residual =
                    system.masses()[particle] * (velocities[dof] - u[dof]) + h * force[dof];
                squared += residual * residual;
            }
        }
        Some(squared.sqrt())
    }

    fn energy(&self, u: &[f64]) -> Option<f64> {
        let energy = || incremental_potential(self.system, self.point, u, &self.positions(u)).0;
        self.system.is_variational().then(energy)
    }
}

/// A recorder, or none.
#[derive(Default)]
pub(super) struct Recording(Option<IterationRecorder>);

impl Recording {
    pub(super) fn to(recorder: IterationRecorder) -> Self {
        Self(Some(recorder))
    }

    pub(super) fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Records the iterate of `point`.
    pub(super) fn record<const D: usize>(
        &mut self,
        system: &System<D>,
        point: Point<'_>,
        iteration: u64,
        (step_length, halvings): (Option<f64>, u64),
    ) {
        if let Some(recorder) = &mut self.0 {
            let equations = &StepEquations { system, point };
            recorder(&Iterate {
                iteration,
                velocities: point.iterate,
                step_length,
                halvings,
                equations,
            });
        }
    }
}

/// `E(u)` at the velocities `u` and positions `x = q + h u`, and the size of the terms that it is the sum of.
pub(super) fn incremental_potential<const D: usize>(
    system: &System<D>,
    Point { h, time, velocities: start, .. }: Point<'_>,
    u: &[f64],
    x: &[f64],
) -> (f64, f64) {
    let mut inertia = 0.0;
    let particles = u.chunks_exact(D).zip(start.chunks_exact(D));
    for ((velocity, start), mass) in particles.zip(system.masses()) {
        let change = velocity.iter().zip(start).map(|(v, start)| (v - start) * (v - start));
        inertia += 0.5 * mass * change.sum::<f64>();
    }
    let (potential, size) = system.energy_and_size(x, u, time);
    let dissipation = h * system.dissipation(x, u, time);
    (inertia + potential + dissipation, inertia + size + dissipation)
}
