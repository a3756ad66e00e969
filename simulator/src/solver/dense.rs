//! One dense system `A x = b`, solved and checked.
//!
//! Three methods, chosen by who knows what the matrix is:
//!
//! - LU with complete pivoting (2n³/3 operations and as many comparisons), for a few rows;
//! - Cholesky (n³/3 operations), for a symmetric matrix; one that turns out not to be positive definite
//!   goes to the next;
//! - LU with partial pivoting (2n³/3 operations).
//!
//! What falls short of rounding is solved again with complete pivoting.

use nalgebra::linalg::{Cholesky, FullPivLU, LU};
use nalgebra::{Const, DMatrix, DVectorViewMut, DimMin, SMatrix, SVector};

use super::LinearError;
use super::checked::{Checked, Product};
use crate::statistics::LinearStatistics;

/// A matrix with room to solve by it.
pub struct DenseSystem {
    /// The matrix, to be filled before each solve.
    pub matrix: DMatrix<f64>,
    method: Method,
    checked: Checked,
}

/// The first method a system is given to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// LU with complete pivoting.
    CompletePivoting,
    /// Cholesky factorisation; the matrix must always be filled symmetrically.
    Cholesky,
    /// LU with partial pivoting.
    Lu,
}

impl DenseSystem {
    /// A zero matrix of `size` rows.
    pub fn new(size: usize, method: Method) -> Self {
        Self { matrix: DMatrix::zeros(size, size), method, checked: Checked::new(size) }
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.matrix.nrows()
    }

    /// The first method this system is given to.
    pub fn method(&self) -> Method {
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
    /// Where the matrix is singular to working precision, or holds what is not finite.
    pub fn solve(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.checked.refuse_what_is_not_finite(self.matrix.as_slice())?;
        let accepted = match self.method {
            // Sizes known to the compiler need no allocation.
            Method::CompletePivoting => match self.size() {
                2 => return self.solve_small::<2>(statistics),
                3 => return self.solve_small::<3>(statistics),
                4 => return self.solve_small::<4>(statistics),
                6 => return self.solve_small::<6>(statistics),
                9 => return self.solve_small::<9>(statistics),
                _ => false,
            },
            Method::Cholesky => self.solve_cholesky(statistics),
            Method::Lu => self.solve_lu(statistics),
        };
        if accepted {
            return self.checked.conclude(&self.matrix, statistics);
        }
        statistics.factorisations += 1;
        statistics.complete_pivotings += 1;
        let factor = FullPivLU::new(self.matrix.clone());
        let solved = self.checked.attempt(&self.matrix, statistics, |b| {
            factor.solve_mut(&mut DVectorViewMut::from_slice(b, b.len()))
        });
        match solved {
            Some(_) => self.checked.conclude(&self.matrix, statistics),
            None => Err(self.singular(factor.u().diagonal().as_slice())),
        }
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
        let solved = self.checked.attempt(&self.matrix, statistics, |b| {
            let mut values = SVector::<f64, N>::from_column_slice(b);
            let solved = factor.solve_mut(&mut values);
            b.copy_from_slice(values.as_slice());
            solved
        });
        match solved {
            Some(_) => self.checked.conclude(&self.matrix, statistics),
            None => Err(self.singular(factor.u().diagonal().as_slice())),
        }
    }

    fn singular(&self, pivots: &[f64]) -> LinearError {
        let size = self.size();
        let pivot = pivots.iter().position(|pivot| *pivot == 0.0).unwrap_or(size - 1);
        LinearError::Singular { pivot, size }
    }

    fn solve_cholesky(&mut self, statistics: &mut LinearStatistics) -> bool {
        statistics.factorisations += 1;
        match Cholesky::new(self.matrix.clone()) {
            Some(factor) => {
                let solved = self.checked.attempt(&self.matrix, statistics, |b| {
                    factor.solve_mut(&mut DVectorViewMut::from_slice(b, b.len()));
                    true
                });
                solved == Some(true)
            }
            None => {
                statistics.indefinite += 1;
                self.solve_lu(statistics)
            }
        }
    }

    fn solve_lu(&mut self, statistics: &mut LinearStatistics) -> bool {
        statistics.factorisations += 1;
        let factor = LU::new(self.matrix.clone());
        let solved = self.checked.attempt(&self.matrix, statistics, |b| {
            factor.solve_mut(&mut DVectorViewMut::from_slice(b, b.len()))
        });
        solved == Some(true)
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
        method: Method,
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

    /// The chain matrix with `diagonal` on its diagonal and -1 beside it, and the solution 1, 2, 3, …
    fn solve_chain(size: usize, diagonal: f64, method: Method) -> (f64, LinearStatistics) {
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
        let (error, statistics) = solve_chain(10, 3.0, Method::Cholesky);
        assert!(error < 1e-13, "{error}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
    }

    #[test]
    fn an_indefinite_matrix_is_told_and_solved() {
        let (error, statistics) = solve_chain(10, 0.5, Method::Cholesky);
        assert!(error < 1e-13, "{error}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (2, 1));
    }

    #[test]
    fn a_small_matrix_costs_one_factorisation_definite_or_not() {
        for diagonal in [3.0, 0.5] {
            let (error, statistics) = solve_chain(4, diagonal, Method::CompletePivoting);
            assert!(error < 1e-14, "{error}");
            assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
        }
    }

    #[test]
    fn an_unsymmetric_matrix_is_not_taken_for_its_transpose() {
        for method in [Method::CompletePivoting, Method::Lu] {
            let (x, _) = solve(&[&[0.0, 2.0], &[1.0, 1.0]], method, &[4.0, 3.0]);
            assert_eq!(x.unwrap(), [1.0, 2.0]);
        }
    }

    #[test]
    fn a_singular_matrix_names_its_pivot() {
        for method in [Method::CompletePivoting, Method::Cholesky, Method::Lu] {
            let (x, _) = solve(&[&[1.0, 1.0], &[1.0, 1.0]], method, &[1.0, 2.0]);
            assert_eq!(x, Err(LinearError::Singular { pivot: 1, size: 2 }));
        }
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        let (x, _) = solve(&[&[f64::NAN]], Method::Cholesky, &[1.0]);
        assert_eq!(x, Err(LinearError::NotFinite { size: 1 }));
    }

    #[test]
    fn rows_of_very_different_size_keep_their_digits() {
        // x = (1, 3): the second row is a part in 1e18 of the first.
        let rows: [&[f64]; 2] = [&[1e18, 1e9], &[1e9, 7.0]];
        for method in [Method::CompletePivoting, Method::Lu] {
            let (x, _) = solve(&rows, method, &[1e18 + 3e9, 1e9 + 21.0]);
            let x = x.unwrap();
            assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 3.0).abs() < 1e-6, "{x:?}");
        }
    }
}
