//! Backward error and iterative refinement of a linear solve.
//!
//! Every solution is checked by its componentwise backward error
//!
//! ```text
//! ω = max_i |b − A x|_i / (|A| |x| + |b|)_i
//! ```
//!
//! (Oettli and Prager 1964), which sees lost digits in a row of small numbers that a norm would hide
//! behind a row of large ones; one step of iterative refinement brings it to rounding (Skeel 1980). A
//! solution is at rounding where `ω ≤ 8 p ε` with `p` the entries of a row. Cost: two products with the
//! matrix a solve, four where it is refined.
//!
//! Numbers below the smallest normal one, 2⁻¹⁰²², are multiples of `η = 2⁻¹⁰⁷⁴` and have fewer digits: what comes to
//! rest passes through them. There a residual of `8 p (‖A‖ + 1) η` is rounding as well (Demmel 1984).

use crate::LinearError;
use crate::statistics::LinearStatistics;

/// Products with a matrix, as residuals need them.
pub trait Product {
    /// The most entries that a row has.
    fn row_length(&self) -> usize;

    /// Adds `A x` to `product` and `|A| |x|` to `scale`.
    fn add_products(&self, x: &[f64], product: &mut [f64], scale: &mut [f64]);

    /// Adds the magnitudes of each row to its entry of `sums`.
    fn add_row_sums(&self, sums: &mut [f64]);
}

/// Right-hand side, solution and residual.
pub struct Checked {
    /// The right-hand side `b`.
    pub right: Vec<f64>,
    /// The solution `x`.
    pub solution: Vec<f64>,
    /// `b − A x` of the solution.
    pub residual: Vec<f64>,
    /// `|A| |x| + |b|`.
    pub scale: Vec<f64>,
    /// The last correction of the solution.
    pub correction: Vec<f64>,
    /// ω of the solution.
    pub error: f64,
}

impl Checked {
    /// For systems of so many rows, all zero.
    pub fn new(size: usize) -> Self {
        let zeros = vec![0.0; size];
        Self {
            right: zeros.clone(),
            solution: zeros.clone(),
            residual: zeros.clone(),
            scale: zeros.clone(),
            correction: zeros,
            error: 0.0,
        }
    }

    /// Checks that the right-hand side and `entries` are finite.
    ///
    /// # Errors
    /// If one is not.
    pub fn check_finite(&self, entries: &[f64]) -> Result<(), LinearError> {
        let is_finite =
            |values: &[f64]| values.iter().fold(true, |all, value| all & value.is_finite());
        if is_finite(entries) && is_finite(&self.right) {
            return Ok(());
        }
        Err(LinearError::NotFinite { size: self.right.len() })
    }

    /// Solves by `apply`, which overwrites a right-hand side by its solution and returns false if it
    /// meets a zero pivot; refines where that is needed, for as long as each time brings a digit, and
    /// `max_refinements` times at most. `None` if there is a zero pivot, else whether the solution is
    /// at rounding.
    pub fn attempt(
        &mut self,
        matrix: &impl Product,
        max_refinements: u32,
        statistics: &mut LinearStatistics,
        mut apply: impl FnMut(&mut [f64]) -> bool,
    ) -> Option<bool> {
        let tolerance = tolerance(matrix);
        self.solution.copy_from_slice(&self.right);
        if !apply(&mut self.solution) {
            return None;
        }
        self.compute_residual(matrix);
        for _ in 0..max_refinements {
            if self.error <= tolerance {
                break;
            }
            statistics.refinements += 1;
            let last = self.error;
            self.correction.copy_from_slice(&self.residual);
            if apply(&mut self.correction) {
                for (value, correction) in self.solution.iter_mut().zip(&self.correction) {
                    *value += correction;
                }
            }
            self.compute_residual(matrix);
            if self.error.is_nan() || self.error > 0.1 * last {
                break;
            }
        }
        Some(self.error <= tolerance)
    }

    /// Accepts the solution if its error is one of rounding.
    ///
    /// # Errors
    /// If it is larger.
    pub fn accept(
        &mut self,
        matrix: &impl Product,
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError> {
        if self.error <= tolerance(matrix) {
            // The sums of the rows are only looked at where the residual may be the worst: at most as
            // much as relative to the largest row of |A| |x| + |b|.
            if largest(&self.residual) > statistics.worst_residual * largest(&self.scale) {
                let residual = self.normwise_residual(matrix);
                statistics.worst_residual = statistics.worst_residual.max(residual);
            }
            return Ok(());
        }
        let residual = self.normwise_residual(matrix);
        // Rounding may leave a row of zeros and tiny numbers short of its componentwise bound. A NaN is
        // never small.
        if residual <= tolerance(matrix) {
            statistics.worst_residual = statistics.worst_residual.max(residual);
            return Ok(());
        }
        // The sums of the rows are where the norm left them.
        let norm = largest(&self.correction);
        let is_number = !self.error.is_nan();
        if is_number && largest(&self.residual) <= underflow(matrix.row_length(), norm) {
            return Ok(());
        }
        Err(LinearError::InaccurateSolution { size: self.right.len(), residual })
    }

    /// Computes `b − A x` and ω (NaN if there is one in it).
    pub fn compute_residual(&mut self, matrix: &impl Product) {
        let Self { right, solution, residual, scale, .. } = self;
        residual.fill(0.0);
        for (scale, right) in scale.iter_mut().zip(&*right) {
            *scale = right.abs();
        }
        matrix.add_products(solution, residual, scale);
        self.error = 0.0;
        for ((residual, right), scale) in residual.iter_mut().zip(&*right).zip(&*scale) {
            *residual = right - *residual;
            if *residual != 0.0 {
                let error = residual.abs() / scale;
                if error > self.error || error.is_nan() {
                    self.error = error;
                }
            }
        }
    }

    fn normwise_residual(&mut self, matrix: &impl Product) -> f64 {
        let residual = largest(&self.residual);
        if residual == 0.0 {
            // A solution of NaNs has no largest residual either.
            return if self.error.is_nan() { f64::NAN } else { 0.0 };
        }
        // The correction was already added to the solution: reuse its buffer.
        self.correction.fill(0.0);
        matrix.add_row_sums(&mut self.correction);
        residual / (largest(&self.correction) * largest(&self.solution) + largest(&self.right))
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max, value| max.max(value.abs()))
}

/// The largest ω that counts as rounding error.
pub fn tolerance(matrix: &impl Product) -> f64 {
    8.0 * matrix.row_length() as f64 * f64::EPSILON
}

/// The residual that rounding to multiples of the smallest number leaves.
fn underflow(row_length: usize, norm: f64) -> f64 {
    8.0 * row_length as f64 * (norm + 1.0) * (f64::MIN_POSITIVE * f64::EPSILON)
}
