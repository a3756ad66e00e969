//! L-BFGS on the energy of a step, with `Q` as the initial Hessian.
//!
//! ```text
//! p = H (−∇E)        H: the inverse BFGS matrix of the last changes of u and ∇E, from Q⁻¹
//! u' = u + t p       t = 1, 1/2, 1/4 … until E falls as far as the slope of E along p promises
//! ```
//!
//! Without a history this is the plain round; with it, a round costs the same substitution, and besides an energy
//! and four passes over the unknowns for each pair of changes kept. Where four halvings do not do, and where
//! `p` is no descent, the history is forgotten and the plain round taken, which never increases `E`. Where what
//! `E` could fall by is below its rounding, its slope at the new point decides (Hager and Zhang 2005).
//! Source: Liu, Bouaziz and Kavan, "Quasi-Newton Methods for Real-Time Simulation of Hyperelastic Materials",
//! 2017, sections 4 and 5.

use super::objective::{Energy, StepObjective, largest};
use crate::integrator::StepError;
use crate::statistics::Statistics;

/// Pairs of changes that are kept.
const HISTORY: usize = 5;

/// How much of the promised decrease is enough (Armijo).
const DECREASE: f64 = 1e-4;

/// Halvings of a step before the plain round is taken.
const HALVINGS: u32 = 4;

/// History and workspace of the method.
pub(super) struct Lbfgs<const P: usize> {
    /// Changes of `u`, and of `∇E`, with the reciprocal of their product; a ring.
    pairs: Vec<HistoryPair<P>>,
    n_pairs: usize,
    newest: usize,
    coefficients: [f64; HISTORY],
    start: Vec<[f64; P]>,
    residual: Vec<[f64; P]>,
    direction: Vec<[f64; P]>,
    /// The largest change of a component of `u` in the last round.
    pub(super) largest_change: f64,
    /// The part of its direction that the last round took.
    pub(super) step_length: f64,
}

struct HistoryPair<const P: usize> {
    by_position: Vec<[f64; P]>,
    by_gradient: Vec<[f64; P]>,
    scale: f64,
}

impl<const P: usize> Lbfgs<P> {
    /// A workspace for so many unknowns.
    pub(super) fn new(n_unknowns: usize) -> Self {
        let zeros = vec![[0.0; P]; n_unknowns];
        let pair =
            || HistoryPair { by_position: zeros.clone(), by_gradient: zeros.clone(), scale: 0.0 };
        Self {
            pairs: (0..HISTORY).map(|_| pair()).collect(),
            n_pairs: 0,
            newest: 0,
            coefficients: [0.0; HISTORY],
            start: zeros.clone(),
            residual: zeros.clone(),
            direction: zeros,
            largest_change: 0.0,
            step_length: 1.0,
        }
    }

    /// Forgets the history.
    pub(super) fn forget(&mut self) {
        self.n_pairs = 0;
    }

    /// One round from an iterate of this energy, at which `objective` has its `−∇E`; the same of the next.
    ///
    /// # Errors
    /// If a spring has no direction.
    pub(super) fn round(
        &mut self,
        objective: &mut StepObjective<P>,
        energy: Energy,
        statistics: &mut Statistics,
    ) -> Result<Energy, StepError> {
        self.start.copy_from_slice(&objective.u);
        self.residual.copy_from_slice(objective.residual());
        self.find_direction(objective);
        statistics.linear.solves += 1;
        statistics.linear.factor.add(objective.work_of_solve());
        let slope = dot(&self.residual, &self.direction);
        self.largest_change = largest(&self.direction);
        let mut length = 1.0;
        let halvings = if slope > 0.0 { 0..HALVINGS } else { 0..0 };
        for _ in halvings {
            for ((u, start), p) in objective.u.iter_mut().zip(&self.start).zip(&self.direction) {
                *u = std::array::from_fn(|axis| start[axis] + length * p[axis]);
            }
            let next = objective.evaluate::<true>()?;
            let rounding = 4.0 * f64::EPSILON * energy.magnitude;
            let falls = next.value <= energy.value - DECREASE * length * slope;
            let flat = next.value <= energy.value + rounding
                && length * slope <= rounding / DECREASE
                && dot(objective.residual(), &self.direction) >= -(1.0 - 2.0 * DECREASE) * slope;
            if falls || flat {
                self.largest_change *= length;
                self.step_length = length;
                self.remember(objective);
                return Ok(next);
            }
            length *= 0.5;
        }
        self.forget();
        self.step_length = 1.0;
        objective.u.copy_from_slice(&self.start);
        objective.solve(|_, right| right.copy_from_slice(&self.residual));
        statistics.linear.solves += 1;
        statistics.linear.factor.add(objective.work_of_solve());
        objective.apply_change();
        self.largest_change = largest(objective.change());
        Ok(objective.evaluate::<true>()?)
    }

    /// `p = H (−∇E)` by the two loops of Nocedal (1980).
    fn find_direction(&mut self, objective: &mut StepObjective<P>) {
        let Self { pairs, n_pairs, newest, coefficients, .. } = self;
        let age = |age: usize| (*newest + HISTORY - age) % HISTORY;
        objective.solve(|residual, right| {
            right.copy_from_slice(residual);
            for number in (0..*n_pairs).map(age) {
                let HistoryPair { by_position, by_gradient, scale } = &pairs[number];
                coefficients[number] = scale * dot(by_position, right);
                add_multiple(right, -coefficients[number], by_gradient);
            }
        });
        self.direction.copy_from_slice(objective.change());
        for number in (0..*n_pairs).rev().map(age) {
            let HistoryPair { by_position, by_gradient, scale } = &pairs[number];
            let coefficient = scale * dot(by_gradient, &self.direction);
            add_multiple(&mut self.direction, coefficients[number] - coefficient, by_position);
        }
    }

    /// Keeps the change that was made, where `E` curves upwards along it.
    fn remember(&mut self, objective: &StepObjective<P>) {
        let number = (self.newest + 1) % HISTORY;
        let HistoryPair { by_position, by_gradient, scale } = &mut self.pairs[number];
        let ends = objective.u.iter().zip(&self.start);
        for (change, (new, old)) in by_position.iter_mut().zip(ends) {
            *change = std::array::from_fn(|axis| new[axis] - old[axis]);
        }
        let ends = objective.residual().iter().zip(&self.residual);
        for (change, (new, old)) in by_gradient.iter_mut().zip(ends) {
            *change = std::array::from_fn(|axis| old[axis] - new[axis]);
        }
        let curvature = dot(by_position, by_gradient);
        *scale = 1.0 / curvature;
        if curvature > 0.0 && scale.is_finite() {
            self.newest = number;
            self.n_pairs = (self.n_pairs + 1).min(HISTORY);
        }
    }
}

fn dot<const P: usize>(a: &[[f64; P]], b: &[[f64; P]]) -> f64 {
    // Components apart, particles in order: the same bits in the plane and in space.
    let mut sums = [0.0; P];
    for (a, b) in a.iter().zip(b) {
        for axis in 0..P {
            sums[axis] += a[axis] * b[axis];
        }
    }
    sums.iter().sum()
}

fn add_multiple<const P: usize>(values: &mut [[f64; P]], factor: f64, amounts: &[[f64; P]]) {
    for (value, amount) in values.iter_mut().zip(amounts) {
        for axis in 0..P {
            value[axis] += factor * amount[axis];
        }
    }
}
