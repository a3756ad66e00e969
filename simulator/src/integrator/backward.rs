//! The linearisation that both implicit methods solve.
//!
//! With an iterate `u` of the new velocity, and force and Jacobians at `(q + h u, u)`,
//!
//! ```text
//! (M − h² ∂F/∂x − h ∂F/∂v) δ = M (v − u) + h F          u ← u + δ
//! ```
//!
//! Equation (1) of the hand-out of milestone 3; its equation (2) is the case `u = v`. Fixed degrees of
//! freedom are left out of the system rather than solved for, which gives them `δ = 0` as clearing
//! their rows and columns would (section 9).

use super::StepError;
use crate::force::{Block, Coupling, JacobianSink};
use crate::solver::linear::{BlockMatrix, Link};
use crate::statistics::Statistics;
use crate::system::System;

/// The most degrees of freedom that may be coupled to each other: their dense matrix has 512 MiB.
pub const MAX_DENSE_SIZE: usize = 8192;

/// Room for the linearisation of one system.
pub(super) struct Linearisation<const D: usize> {
    /// `q + h u`.
    trial: Vec<f64>,
    force: Vec<f64>,
    /// Number of each particle among the free ones.
    free: Vec<Option<usize>>,
    matrix: BlockMatrix<D>,
    /// Right-hand side and solution, of the free particles only.
    reduced: Vec<f64>,
    /// l2 norm of the last right-hand side.
    pub(super) residual: f64,
}

/// Where a linearisation is made: the state the step starts from, and the iterate.
#[derive(Clone, Copy)]
pub(super) struct Point<'a> {
    pub(super) h: f64,
    pub(super) positions: &'a [f64],
    pub(super) velocities: &'a [f64],
    /// `u`.
    pub(super) iterate: &'a [f64],
}

impl<const D: usize> Linearisation<D> {
    pub(super) fn new(system: &System<D>) -> Result<Self, StepError> {
        let mut free = vec![None; system.n_particles()];
        let mut n_free = 0;
        for (number, fixed) in free.iter_mut().zip(system.fixed()) {
            if !fixed {
                *number = Some(n_free);
                n_free += 1;
            }
        }
        let mut links = Vec::new();
        system.couplings(&mut |coupling| {
            if let Coupling::Pair { particles: [i, j], symmetric } = coupling {
                let blocks = match (free[i], free[j]) {
                    (Some(i), Some(j)) => [i, j],
                    (Some(block), None) | (None, Some(block)) => [block, block],
                    (None, None) => return,
                };
                links.push(Link { blocks, symmetric });
            }
        });
        let size = BlockMatrix::<D>::largest_dense(n_free, &links);
        if size > MAX_DENSE_SIZE {
            return Err(StepError::TooLarge { size });
        }
        Ok(Self {
            trial: vec![0.0; system.n_particles() * D],
            force: vec![0.0; system.n_particles() * D],
            matrix: BlockMatrix::new(n_free, &links),
            reduced: vec![0.0; n_free * D],
            free,
            residual: 0.0,
        })
    }

    /// Solves the linearisation at `point` for `delta`.
    pub(super) fn solve(
        &mut self,
        system: &System<D>,
        Point { h, positions, velocities, iterate }: Point<'_>,
        delta: &mut [f64],
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        if statistics.linear_solver.is_empty() {
            statistics.linear_solver = self.matrix.describe();
        }
        self.trial.copy_from_slice(positions);
        super::drift(&mut self.trial, iterate, h);

        system.force(&self.trial, iterate, &mut self.force)?;
        statistics.force_evaluations += 1;

        self.matrix.clear();
        for (particle, mass) in system.masses().iter().enumerate() {
            let Some(number) = self.free[particle] else { continue };
            self.matrix.add_diagonal(number, *mass);
            for axis in 0..D {
                let dof = particle * D + axis;
                self.reduced[number * D + axis] =
                    mass * (velocities[dof] - iterate[dof]) + h * self.force[dof];
            }
        }
        let mut sink = Assembly { h, free: &self.free, matrix: &mut self.matrix };
        system.jacobians(&self.trial, iterate, &mut sink)?;
        statistics.assemblies += 1;

        self.residual = self.reduced.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        self.matrix.solve(&mut self.reduced, &mut statistics.linear)?;
        for (particle, number) in self.free.iter().enumerate() {
            let delta = &mut delta[particle * D..][..D];
            match number {
                Some(number) => delta.copy_from_slice(&self.reduced[number * D..][..D]),
                None => delta.fill(0.0),
            }
        }
        Ok(())
    }
}

/// Subtracts `h² ∂F/∂x + h ∂F/∂v` from the matrix, rows and columns of fixed particles left out.
struct Assembly<'a, const D: usize> {
    h: f64,
    free: &'a [Option<usize>],
    matrix: &'a mut BlockMatrix<D>,
}

impl<const D: usize> JacobianSink<D> for Assembly<'_, D> {
    fn add(&mut self, row: usize, column: usize, jacobian_x: &Block<D>, jacobian_v: &Block<D>) {
        if let (Some(row), Some(column)) = (self.free[row], self.free[column]) {
            let block = jacobian_x * -(self.h * self.h) - jacobian_v * self.h;
            self.matrix.add(row, column, &block);
        }
    }
}
