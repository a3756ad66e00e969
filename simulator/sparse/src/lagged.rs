//! Lagged preconditioner: conjugate gradients with the factor of an earlier matrix.
//!
//! ```text
//! z = M⁻¹ r    p = z + (rᵀz / r'ᵀz') p    α = rᵀz / pᵀA p    x ← x + α p    r ← r − α A p
//! ```
//!
//! (Hestenes and Stiefel 1952) with `M` the matrix that was last factorised, which must have been
//! positive definite. If the two are close, a few iterations reach the same backward error as a
//! factorisation. Cost: a solve with the factor and a product with the matrix per iteration.
//!
//! Counts of operations decide whether it is tried, never a clock, so that runs are deterministic:
//!
//! - at most as many iterations as cost less than a factorisation; fewer where the rate so far says
//!   that these will not do;
//! - after a solution that cost more than the average since the last factorisation, that one included, the
//!   next matrix is factorised, since the average would rise from there on;
//! - after a failure it pauses, twice as long after each further one.

use crate::checked::{Checked, Product};
use crate::sizes::WORTHWHILE;

/// Longest pause, in solutions.
const LONGEST_PAUSE: u64 = 64;

/// The state of the iteration, and the counts that the decisions are based on.
pub(crate) struct LaggedPreconditioner {
    direction: Vec<f64>,
    product: Vec<f64>,
    scale: Vec<f64>,
    /// Cost of a factorisation, in iterations.
    budget: u64,
    /// Whether there is a factor, and of a positive definite matrix.
    usable: bool,
    /// Iterations, and what a factorisation costs in them, since the last one; and solutions.
    spent: u64,
    solved: u64,
    /// Whether the last solution cost more than the average.
    degraded: bool,
    /// Solutions until the next attempt, and the length of the pause after the next failure.
    pause: u64,
    next_pause: u64,
}

impl LaggedPreconditioner {
    /// For a matrix of `size` rows whose factorisation costs as much as `budget` iterations.
    pub(crate) fn new(size: usize, budget: u64) -> Self {
        let zeros = vec![0.0; if budget >= WORTHWHILE { size } else { 0 }];
        Self {
            direction: zeros.clone(),
            product: zeros.clone(),
            scale: zeros,
            budget,
            usable: false,
            spent: 0,
            solved: 0,
            degraded: false,
            pause: 0,
            next_pause: 1,
        }
    }

    /// Cost of a factorisation, in iterations.
    #[cfg(test)]
    pub(crate) fn budget(&self) -> u64 {
        self.budget
    }

    /// Whether to try the old factor for the next solution.
    pub(crate) fn is_worthwhile(&self) -> bool {
        self.budget >= WORTHWHILE && self.usable && !self.degraded && self.pause == 0
    }

    /// Makes the next solution factorise its matrix.
    pub(crate) fn forget(&mut self) {
        self.usable = false;
    }

    /// Resets the counts after a factorisation.
    pub(crate) fn reset(&mut self, definite: bool) {
        self.usable = definite;
        self.spent = self.budget;
        self.solved = 1;
        self.degraded = false;
        self.pause = self.pause.saturating_sub(1);
    }

    /// Solves for the right-hand side in `checked`, with `apply` the solve with the old factor. Whether
    /// the solution is at rounding, and the iterations it took.
    pub(crate) fn solve(
        &mut self,
        matrix: &impl Product,
        checked: &mut Checked,
        mut apply: impl FnMut(&mut [f64]),
    ) -> (bool, u64) {
        let (solved, iterations) = self.iterate(matrix, checked, &mut apply);
        if solved {
            self.spent += iterations;
            self.solved += 1;
            self.degraded = iterations * self.solved > self.spent;
            self.next_pause = 1;
        } else {
            self.pause = self.next_pause;
            self.next_pause = (2 * self.next_pause).min(LONGEST_PAUSE);
        }
        (solved, iterations)
    }

    fn iterate(
        &mut self,
        matrix: &impl Product,
        checked: &mut Checked,
        apply: &mut impl FnMut(&mut [f64]),
    ) -> (bool, u64) {
        let tolerance = crate::checked::tolerance(matrix);
        checked.solution.copy_from_slice(&checked.right);
        apply(&mut checked.solution);
        checked.compute_residual(matrix);
        let first = checked.error;
        let mut iterations = 1;
        let mut last = None;
        loop {
            if checked.error <= tolerance {
                return (true, iterations);
            }
            let Checked { solution, residual, scale, correction, .. } = checked;
            // The error falls by about the same factor each time.
            let done = (checked.error / first).ln() / (tolerance / first).ln();
            let hopeless = iterations > 1 && (iterations - 1) as f64 > done * self.budget as f64;
            if iterations >= self.budget || hopeless || !checked.error.is_finite() {
                return (false, iterations);
            }
            correction.copy_from_slice(residual);
            apply(correction);
            let rho = dot(residual, correction);
            match last {
                Some(last) => {
                    let beta = rho / last;
                    for (direction, z) in self.direction.iter_mut().zip(&*correction) {
                        *direction = z + beta * *direction;
                    }
                }
                None => self.direction.copy_from_slice(correction),
            }
            self.product.fill(0.0);
            self.scale.fill(0.0);
            matrix.add_products(&self.direction, &mut self.product, &mut self.scale);
            let curvature = dot(&self.direction, &self.product);
            // Not positive definite any more; or a NaN.
            if !(curvature > 0.0 && rho > 0.0) {
                return (false, iterations);
            }
            let alpha = rho / curvature;
            let mut error: f64 = 0.0;
            for i in 0..solution.len() {
                solution[i] += alpha * self.direction[i];
                residual[i] -= alpha * self.product[i];
                if residual[i] != 0.0 {
                    error = error.max(residual[i].abs() / scale[i]);
                }
            }
            iterations += 1;
            last = Some(rho);
            checked.error = error;
            if error <= tolerance {
                // The updated residual has drifted from the true one.
                checked.compute_residual(matrix);
                last = None;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
