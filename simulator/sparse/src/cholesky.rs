//! The Cholesky factor of a constant matrix, for substitutions of one's own.
//!
//! ```text
//! P A Pᵀ = L Lᵀ        A symmetric positive definite, entries of one number
//! ```

use crate::LinearError;
use crate::factor::{BlockFactor, Factor};
use crate::pivot::Inertia;
use crate::symbolic::{Front, SymbolicFactor};

/// The factor `L`.
pub struct Cholesky {
    symbolic: SymbolicFactor,
    factor: BlockFactor<1>,
}

/// Columns of `L` with the same rows below them.
pub struct Columns<'a> {
    front: &'a Front,
    of: &'a Cholesky,
}

impl Cholesky {
    /// Factorises a matrix of at least one row: its lower triangle, column by column, with the entries `values[i]` in the
    /// rows `rows[i]` for `i` in `starts[column]..starts[column + 1]`.
    ///
    /// # Errors
    /// If it is not positive definite, or there is not enough memory for its factor.
    pub fn new(starts: &[usize], rows: &[u32], values: &[f64]) -> Result<Self, LinearError> {
        let size = starts.len() - 1;
        let symbolic = SymbolicFactor::new(starts, rows);
        let factor = BlockFactor::new(&symbolic, true, usize::MAX);
        let factor = factor.ok_or(LinearError::OutOfMemory { size })?;
        let mut cholesky = Self { symbolic, factor };
        match cholesky.factor.factorise(&cholesky.symbolic, values) {
            Inertia::Definite => Ok(cholesky),
            _ => Err(LinearError::SingularToPrecision { size }),
        }
    }

    /// Numbers that its columns store, zeros in the fronts included.
    pub fn n_values(&self) -> usize {
        self.symbolic.n_factor
    }

    /// The order of elimination: which row of the matrix each row of `L` is.
    pub fn order(&self) -> &[u32] {
        &self.symbolic.order
    }

    /// Its columns in the order of elimination.
    pub fn columns(&self) -> impl Iterator<Item = Columns<'_>> {
        self.symbolic.fronts.iter().map(|front| Columns { front, of: self })
    }
}

impl Columns<'_> {
    /// The first column; its diagonal entry is in the row of the same number.
    pub fn first(&self) -> usize {
        self.front.first
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        self.front.n_pivots
    }

    /// The rows below the diagonal blocks, ascending.
    pub fn below(&self) -> &[u32] {
        &self.of.symbolic.rows[self.front.rows[0]..self.front.rows[1]]
    }

    /// The entry in a row and a column, both counted from the first of these columns: rows after the diagonal block are
    /// those of [`below`](Self::below).
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        self.of.factor.cholesky_entry(self.front, row, column)
    }
}
