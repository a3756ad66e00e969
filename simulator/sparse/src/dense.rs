//! Dense linear system `A x = b`, with a check of every solution.
//!
//! The caller chooses the first method:
//!
//! - LU with complete pivoting (2n³/3 operations and as many comparisons), for a few rows;
//! - Cholesky (n³/3 operations), for a symmetric matrix; one that turns out not to be positive definite
//!   goes to the next;
//! - LU with partial pivoting (2n³/3 operations).
//!
//! A solution that does not reach rounding error is computed again with complete pivoting. Nothing is allocated by a solve:
//! small factors live on the stack, others in a workspace.

use nalgebra::linalg::FullPivLU;
use nalgebra::{Const, DMatrix, DimMin, SMatrix, SVector};

use crate::LinearError;
use crate::checked::{Checked, Product};
use crate::statistics::LinearStatistics;

/// A matrix with the workspace for solving.
pub struct DenseSystem {
    /// The matrix, to be filled before each solve.
    pub matrix: DMatrix<f64>,
    method: DenseMethod,
    checked: Checked,
    factor: DenseFactor,
    /// The method of the factor; `None` if it is not of the current matrix.
    last: Option<DenseMethod>,
    /// Of the last factor of a few rows, which is not kept.
    small_pivot: f64,
}

/// The first method a system is given to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DenseMethod {
    /// LU with complete pivoting.
    CompletePivoting,
    /// Cholesky factorisation; the matrix must always be filled symmetrically.
    Cholesky,
    /// LU with partial pivoting.
    Lu,
}

impl DenseSystem {
    /// A zero matrix of `size` rows.
    pub fn new(size: usize, method: DenseMethod) -> Self {
        Self {
            matrix: DMatrix::zeros(size, size),
            method,
            checked: Checked::new(size),
            factor: DenseFactor::default(),
            last: None,
            small_pivot: f64::INFINITY,
        }
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.matrix.nrows()
    }

    /// The first method this system is given to.
    pub fn method(&self) -> DenseMethod {
        self.method
    }

    /// The right-hand side, to be filled before each solve.
    pub fn right_mut(&mut self) -> &mut [f64] {
        &mut self.checked.right
    }

    /// The last solution.
    pub fn solution(&self) -> &[f64] {
        &self.checked.solution
    }

    /// Solves the system; the solution is then in [`solution`](Self::solution).
    ///
    /// # Errors
    /// If the matrix is singular to working precision, or contains an infinity or a NaN.
    pub fn solve(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.last = None;
        self.checked.check_finite(self.matrix.as_slice())?;
        let methods: &[DenseMethod] = match self.method {
            // Sizes known to the compiler need no workspace.
            DenseMethod::CompletePivoting => match self.size() {
                2 => return self.solve_small::<2>(statistics),
                3 => return self.solve_small::<3>(statistics),
                4 => return self.solve_small::<4>(statistics),
                6 => return self.solve_small::<6>(statistics),
                9 => return self.solve_small::<9>(statistics),
                _ => &[],
            },
            DenseMethod::Cholesky => &[DenseMethod::Cholesky, DenseMethod::Lu],
            DenseMethod::Lu => &[DenseMethod::Lu],
        };
        for &method in methods {
            statistics.factorisations += 1;
            if self.factor.factorise(&self.matrix, method).is_ok() {
                self.last = Some(method);
                if self.attempt(method, statistics) {
                    return self.checked.accept(&self.matrix, statistics);
                }
                break;
            }
            if method == DenseMethod::Cholesky {
                statistics.indefinite += 1;
            }
        }
        statistics.factorisations += 1;
        statistics.complete_pivotings += 1;
        let complete = DenseMethod::CompletePivoting;
        self.factor
            .factorise(&self.matrix, complete)
            .map_err(|pivot| LinearError::Singular { pivot, size: self.size() })?;
        self.last = Some(complete);
        self.attempt(complete, statistics);
        self.checked.accept(&self.matrix, statistics)
    }

    /// Solves for another right-hand side, with the factor of the last solve. A few rows are factorised
    /// again, which costs no more than keeping their factor.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_again(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        let Some(method) = self.last else { return self.solve(statistics) };
        self.checked.check_finite(&[])?;
        if self.attempt(method, statistics) || method == DenseMethod::CompletePivoting {
            return self.checked.accept(&self.matrix, statistics);
        }
        self.solve(statistics)
    }

    /// Magnitude of the smallest pivot of the last matrix, which was solved.
    pub(crate) fn smallest_pivot(&self) -> f64 {
        let size = self.size();
        let pivots = self.factor.entries.iter().step_by(size + 1).map(|pivot| pivot.abs());
        match self.last {
            None => self.small_pivot,
            Some(DenseMethod::Cholesky) => pivots.fold(f64::INFINITY, f64::min).powi(2),
            Some(_) => pivots.fold(f64::INFINITY, f64::min),
        }
    }

    /// Whether the factor brings the solution to rounding.
    fn attempt(&mut self, method: DenseMethod, statistics: &mut LinearStatistics) -> bool {
        let Self { matrix, checked, factor, .. } = self;
        let solved = checked.attempt(&*matrix, 1, statistics, |b| {
            factor.solve(method, b);
            true
        });
        solved == Some(true)
    }

    fn solve_small<const N: usize>(
        &mut self,
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError>
    where
        Const<N>: DimMin<Const<N>, Output = Const<N>>,
    {
        statistics.factorisations += 1;
        let factor =
            FullPivLU::new(SMatrix::<f64, N, N>::from_column_slice(self.matrix.as_slice()));
        let solved = self.checked.attempt(&self.matrix, 1, statistics, |b| {
            let mut values = SVector::<f64, N>::from_column_slice(b);
            let solved = factor.solve_mut(&mut values);
            b.copy_from_slice(values.as_slice());
            solved
        });
        let pivots = factor.u().diagonal();
        if solved.is_some() {
            self.small_pivot = pivots.amin();
            return self.checked.accept(&self.matrix, statistics);
        }
        let pivot = pivots.iter().position(|pivot| *pivot == 0.0).unwrap_or(N - 1);
        Err(LinearError::Singular { pivot, size: N })
    }
}

/// A factor, column by column, with the exchanges before each column.
#[derive(Default)]
struct DenseFactor {
    entries: Vec<f64>,
    rows: Vec<usize>,
    columns: Vec<usize>,
}

impl DenseFactor {
    /// Factorises `matrix`. The error is the pivot at which that ends: a zero, or for Cholesky one that is not
    /// positive. By columns to the right of the pivot, so that the inner loops are along columns.
    fn factorise(&mut self, matrix: &DMatrix<f64>, method: DenseMethod) -> Result<(), usize> {
        let size = matrix.nrows();
        let Self { entries, rows, columns } = self;
        // Allocates the first time.
        entries.resize(size * size, 0.0);
        rows.resize(size, 0);
        columns.resize(size, 0);
        entries.copy_from_slice(matrix.as_slice());
        for k in 0..size {
            (rows[k], columns[k]) = (k, k);
            if method == DenseMethod::Cholesky {
                let pivot = entries[k * size + k];
                if pivot.is_nan() || pivot <= 0.0 {
                    return Err(k);
                }
                let root = pivot.sqrt();
                entries[k * size + k] = root;
                entries[k * size + k + 1..(k + 1) * size]
                    .iter_mut()
                    .for_each(|entry| *entry /= root);
            } else {
                let last = if method == DenseMethod::CompletePivoting { size } else { k + 1 };
                let mut best = 0.0;
                for column in k..last {
                    for row in k..size {
                        let entry = entries[column * size + row].abs();
                        if entry > best {
                            (best, rows[k], columns[k]) = (entry, row, column);
                        }
                    }
                }
                if best == 0.0 {
                    return Err(k);
                }
                if columns[k] != k {
                    let (left, right) = entries.split_at_mut(columns[k] * size);
                    left[k * size..][..size].swap_with_slice(&mut right[..size]);
                }
                if rows[k] != k {
                    entries.chunks_exact_mut(size).for_each(|column| column.swap(k, rows[k]));
                }
                let pivot = entries[k * size + k];
                entries[k * size + k + 1..(k + 1) * size]
                    .iter_mut()
                    .for_each(|entry| *entry /= pivot);
            }
            let (left, right) = entries.split_at_mut((k + 1) * size);
            let own = &left[k * size..];
            for (number, column) in right.chunks_exact_mut(size).enumerate() {
                let (start, factor) = match method {
                    DenseMethod::Cholesky => (k + 1 + number, own[k + 1 + number]),
                    _ => (k + 1, column[k]),
                };
                for (entry, of_pivot) in column[start..].iter_mut().zip(&own[start..]) {
                    *entry -= of_pivot * factor;
                }
            }
        }
        Ok(())
    }

    /// Overwrites a right-hand side by the solution.
    fn solve(&self, method: DenseMethod, b: &mut [f64]) {
        let size = b.len();
        let Self { entries, rows, columns } = self;
        for (k, row) in rows.iter().enumerate() {
            b.swap(k, *row);
        }
        for (k, column) in entries.chunks_exact(size).enumerate() {
            if method == DenseMethod::Cholesky {
                b[k] /= column[k];
            }
            let (done, below) = b.split_at_mut(k + 1);
            for (value, entry) in below.iter_mut().zip(&column[k + 1..]) {
                *value -= entry * done[k];
            }
        }
        for (k, column) in entries.chunks_exact(size).enumerate().rev() {
            let (above, done) = b.split_at_mut(k + 1);
            if method == DenseMethod::Cholesky {
                let known = column[k + 1..].iter().zip(&*done).map(|(entry, x)| entry * x);
                above[k] = (above[k] - known.sum::<f64>()) / column[k];
            } else {
                above[k] /= column[k];
                let x = above[k];
                for (value, entry) in above[..k].iter_mut().zip(column) {
                    *value -= entry * x;
                }
            }
        }
        for (k, column) in columns.iter().enumerate().rev() {
            b.swap(k, *column);
        }
    }
}

impl Product for DMatrix<f64> {
    fn row_length(&self) -> usize {
        self.ncols()
    }

    fn add_products(&self, x: &[f64], product: &mut [f64], scale: &mut [f64]) {
        for (column, x) in self.column_iter().zip(x) {
            for ((product, scale), entry) in product.iter_mut().zip(&mut *scale).zip(column.iter())
            {
                let term = entry * x;
                *product += term;
                *scale += term.abs();
            }
        }
    }

    fn add_row_sums(&self, sums: &mut [f64]) {
        for column in self.column_iter() {
            for (sum, entry) in sums.iter_mut().zip(column.iter()) {
                *sum += entry.abs();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(
        rows: &[&[f64]],
        method: DenseMethod,
        b: &[f64],
    ) -> (Result<Vec<f64>, LinearError>, LinearStatistics) {
        let mut system = DenseSystem::new(rows.len(), method);
        for (row, values) in rows.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                system.matrix[(row, column)] = *value;
            }
        }
        system.right_mut().copy_from_slice(b);
        let mut statistics = LinearStatistics::default();
        let result = system.solve(&mut statistics).map(|()| system.solution().to_vec());
        (result, statistics)
    }

    /// The chain matrix with `diagonal` on its diagonal and -1 off it, and the solution 1, 2, 3, …
    fn solve_chain(size: usize, diagonal: f64, method: DenseMethod) -> (f64, LinearStatistics) {
        let entry = |row: usize, column: usize| match row.abs_diff(column) {
            0 => diagonal,
            1 => -1.0,
            _ => 0.0,
        };
        let rows: Vec<Vec<f64>> =
            (0..size).map(|row| (0..size).map(|column| entry(row, column)).collect()).collect();
        let b: Vec<f64> = rows
            .iter()
            .map(|row| row.iter().zip(1_u8..).map(|(entry, x)| entry * f64::from(x)).sum())
            .collect();
        let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        let (x, statistics) = solve(&rows, method, &b);
        let errors =
            x.unwrap().into_iter().zip(1_u8..).map(|(x, exact)| (x - f64::from(exact)).abs());
        (errors.fold(0.0, f64::max), statistics)
    }

    #[test]
    fn a_positive_definite_matrix_costs_one_cholesky() {
        let (error, statistics) = solve_chain(10, 3.0, DenseMethod::Cholesky);
        assert!(error < 1e-13, "{error}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
    }

    #[test]
    fn indefinite_matrix_is_reported_and_solved() {
        let (error, statistics) = solve_chain(10, 0.5, DenseMethod::Cholesky);
        assert!(error < 1e-13, "{error}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (2, 1));
    }

    #[test]
    fn a_small_matrix_costs_one_factorisation_definite_or_not() {
        for diagonal in [3.0, 0.5] {
            let (error, statistics) = solve_chain(4, diagonal, DenseMethod::CompletePivoting);
            assert!(error < 1e-14, "{error}");
            assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
        }
    }

    #[test]
    fn unsymmetric_matrix_is_not_transposed() {
        for method in [DenseMethod::CompletePivoting, DenseMethod::Lu] {
            let (x, _) = solve(&[&[0.0, 2.0], &[1.0, 1.0]], method, &[4.0, 3.0]);
            assert_eq!(x.unwrap(), [1.0, 2.0]);
        }
    }

    #[test]
    fn a_singular_matrix_names_its_pivot() {
        for method in [DenseMethod::CompletePivoting, DenseMethod::Cholesky, DenseMethod::Lu] {
            let (x, _) = solve(&[&[1.0, 1.0], &[1.0, 1.0]], method, &[1.0, 2.0]);
            assert_eq!(x, Err(LinearError::Singular { pivot: 1, size: 2 }));
        }
    }

    #[test]
    fn non_finite_matrix_is_refused() {
        let (x, _) = solve(&[&[f64::NAN]], DenseMethod::Cholesky, &[1.0]);
        assert_eq!(x, Err(LinearError::NotFinite { size: 1 }));
    }

    #[test]
    fn rows_of_very_different_size_keep_their_digits() {
        // x = (1, 3): the second row is a part in 1e18 of the first.
        let rows: [&[f64]; 2] = [&[1e18, 1e9], &[1e9, 7.0]];
        for method in [DenseMethod::CompletePivoting, DenseMethod::Lu] {
            let (x, _) = solve(&rows, method, &[1e18 + 3e9, 1e9 + 21.0]);
            let x = x.unwrap();
            assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 3.0).abs() < 1e-6, "{x:?}");
        }
    }
}
