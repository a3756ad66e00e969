//! One sparse system `A x = b` of `D × D` blocks, solved and checked.
//!
//! The pattern is analysed once (approximate minimum degree, elimination tree, supernodes), when the
//! first system is solved; each solve factorises anew:
//!
//! - a symmetric matrix by Cholesky; one that is not positive definite, by LBLᵀ with pivoting inside the
//!   supernodes; what still falls short of rounding, by LU;
//! - any other by LU with partial pivoting.
//!
//! Blocks are stored by columns, both triangles, so that the residual is one pass over contiguous
//! memory. Storage is in proportion to the couplings, and that of the factors to their fill. Everything
//! runs on one thread, so that the bits do not depend on how many there are.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::lu::{NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side, Spec};
use nalgebra::SMatrix;

use super::LinearError;
use super::checked::{Checked, Product};
use crate::statistics::LinearStatistics;

/// A matrix with room to solve by it.
pub struct SparseSystem<const D: usize> {
    matrix: BlockColumns<D>,
    checked: Checked,
    symmetric: bool,
    symmetric_room: Option<SymmetricRoom>,
    lu_room: Option<LuRoom>,
}

/// The matrix, column by column.
struct BlockColumns<const D: usize> {
    pattern: SymbolicSparseColMat<u32>,
    values: Vec<f64>,
    /// Start of each block column in `rows`.
    starts: Vec<usize>,
    /// Block rows of each block column, ascending.
    rows: Vec<u32>,
    /// The most entries that a row has; as many as a column, for the pattern is symmetric.
    row_length: usize,
}

/// What the factorisations of a symmetric matrix need, made once.
struct SymmetricRoom {
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    memory: MemBuffer,
    /// Of LBLᵀ alone: made when a matrix first turns out not to be positive definite.
    indefinite: Option<IndefiniteRoom>,
}

struct IndefiniteRoom {
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    memory: MemBuffer,
}

/// What an LU factorisation needs, made once.
struct LuRoom {
    symbolic: SymbolicLu<u32>,
    factor: NumericLu<u32, f64>,
    memory: MemBuffer,
}

impl<const D: usize> SparseSystem<D> {
    /// A zero matrix of `n_blocks` blocks a side, whose blocks `couplings` and their transposes and the
    /// diagonal may be filled; `symmetric` if it always is.
    pub fn new(n_blocks: usize, couplings: &[[usize; 2]], symmetric: bool) -> Self {
        Self {
            matrix: BlockColumns::new(n_blocks, couplings),
            checked: Checked::new(n_blocks * D),
            symmetric,
            symmetric_room: None,
            lu_room: None,
        }
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.checked.right.len()
    }

    /// Whether the matrix is symmetric by construction.
    pub fn is_symmetric(&self) -> bool {
        self.symmetric
    }

    /// The right-hand side, to be filled before each solve.
    pub fn right_mut(&mut self) -> &mut [f64] {
        &mut self.checked.right
    }

    /// The last solution.
    pub fn solution(&self) -> &[f64] {
        &self.checked.solution
    }

    /// Sets the matrix to zero.
    pub fn clear(&mut self) {
        self.matrix.values.fill(0.0);
    }

    /// Adds `value` to the diagonal of block `(block, block)`.
    pub fn add_diagonal(&mut self, block: usize, value: f64) {
        self.matrix.add(block, block, &(SMatrix::identity() * value));
    }

    /// Adds to block `(row, column)`.
    ///
    /// # Panics
    /// Where the couplings do not hold that block.
    pub fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        self.matrix.add(row, column, block);
    }

    /// Solves the system; the solution is then in [`solution`](Self::solution).
    ///
    /// # Errors
    /// Where the matrix is singular to working precision, holds what is not finite, or has more fill
    /// than there is memory.
    pub fn solve(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.checked.refuse_what_is_not_finite(&self.matrix.values)?;
        if self.symmetric && self.solve_symmetric(statistics)? {
            return self.checked.conclude(&self.matrix, statistics);
        }
        self.solve_lu(statistics)?;
        self.checked.conclude(&self.matrix, statistics)
    }

    /// Whether a symmetric factorisation brought the solution to rounding.
    fn solve_symmetric(&mut self, statistics: &mut LinearStatistics) -> Result<bool, LinearError> {
        let Self { matrix, checked, symmetric_room, .. } = self;
        if symmetric_room.is_none() {
            statistics.symbolic_analyses += 1;
            *symmetric_room = Some(SymmetricRoom::new(matrix)?);
        }
        let Some(room) = symmetric_room else { return Ok(false) };
        statistics.factorisations += 1;
        if let Ok(factor) = room.symbolic.factorize_numeric_llt(
            &mut room.factor,
            matrix.view(),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut room.memory),
            Spec::default(),
        ) {
            let solved = checked.attempt(matrix, statistics, |b| {
                let stack = MemStack::new(&mut room.memory);
                factor.solve_in_place_with_conj(Conj::No, column(b), Par::Seq, stack);
                true
            });
            return Ok(solved == Some(true));
        }

        statistics.indefinite += 1;
        statistics.factorisations += 1;
        if room.indefinite.is_none() {
            room.indefinite = Some(IndefiniteRoom::new(&room.symbolic)?);
        }
        let Some(indefinite) = &mut room.indefinite else { return Ok(false) };
        let factor = room.symbolic.factorize_numeric_intranode_lblt(
            &mut room.factor,
            &mut indefinite.subdiagonal,
            &mut indefinite.forward,
            &mut indefinite.inverse,
            matrix.view(),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut indefinite.memory),
            Spec::default(),
        );
        let solved = checked.attempt(matrix, statistics, |b| {
            let stack = MemStack::new(&mut indefinite.memory);
            factor.solve_in_place_with_conj(Conj::No, column(b), Par::Seq, stack);
            true
        });
        Ok(solved == Some(true))
    }

    fn solve_lu(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        let Self { matrix, checked, lu_room, .. } = self;
        let size = checked.right.len();
        if lu_room.is_none() {
            statistics.symbolic_analyses += 1;
            *lu_room = Some(LuRoom::new(matrix)?);
        }
        let Some(LuRoom { symbolic, factor, memory }) = lu_room else { return Ok(()) };
        statistics.factorisations += 1;
        let factorised = symbolic.factorize_numeric_lu(
            factor,
            matrix.view(),
            Par::Seq,
            MemStack::new(memory),
            Spec::default(),
        );
        let factor = factorised.map_err(|error| match error {
            faer::sparse::linalg::LuError::SymbolicSingular { index } => {
                LinearError::Singular { pivot: index, size }
            }
            faer::sparse::linalg::LuError::Generic(_) => LinearError::OutOfMemory { size },
        })?;
        checked.attempt(matrix, statistics, |b| {
            let stack = MemStack::new(memory);
            factor.solve_in_place_with_conj(Conj::No, column(b), Par::Seq, stack);
            true
        });
        // A zero pivot divides; nothing comes after LU.
        if checked.solution.iter().all(|value| value.is_finite()) {
            Ok(())
        } else {
            Err(LinearError::SingularToPrecision { size })
        }
    }
}

fn column(values: &mut [f64]) -> MatMut<'_, f64> {
    let rows = values.len();
    MatMut::from_column_major_slice_mut(values, rows, 1)
}

/// Room for all of `requirements`, one at a time.
fn room(size: usize, requirements: &[StackReq]) -> Result<MemBuffer, LinearError> {
    MemBuffer::try_new(StackReq::any_of(requirements))
        .map_err(|_| LinearError::OutOfMemory { size })
}

/// So many zeros for a matrix of `size` rows: the fill may be more than there is memory.
fn zeros<T: Clone + Default>(size: usize, count: usize) -> Result<Vec<T>, LinearError> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| LinearError::OutOfMemory { size })?;
    values.resize(count, T::default());
    Ok(values)
}

impl SymmetricRoom {
    fn new<const D: usize>(matrix: &BlockColumns<D>) -> Result<Self, LinearError> {
        let size = matrix.size();
        let pattern = matrix.pattern.as_ref();
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Amd,
            faer::sparse::linalg::cholesky::CholeskySymbolicParams::default(),
        );
        let symbolic = symbolic.map_err(|_| LinearError::OutOfMemory { size })?;
        let requirements = [
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ];
        let memory = room(size, &requirements)?;
        let factor = zeros(size, symbolic.len_val())?;
        Ok(Self { symbolic, factor, memory, indefinite: None })
    }
}

impl IndefiniteRoom {
    fn new(symbolic: &SymbolicCholesky<u32>) -> Result<Self, LinearError> {
        let size = symbolic.nrows();
        let requirements = [
            symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ];
        let memory = room(size, &requirements)?;
        Ok(Self {
            subdiagonal: zeros(size, size)?,
            forward: zeros(size, size)?,
            inverse: zeros(size, size)?,
            memory,
        })
    }
}

impl LuRoom {
    fn new<const D: usize>(matrix: &BlockColumns<D>) -> Result<Self, LinearError> {
        let size = matrix.size();
        let symbolic = factorize_symbolic_lu(
            matrix.pattern.as_ref(),
            faer::sparse::linalg::lu::LuSymbolicParams::default(),
        );
        let symbolic = symbolic.map_err(|_| LinearError::OutOfMemory { size })?;
        let requirements = [
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ];
        let memory = room(size, &requirements)?;
        Ok(Self { symbolic, factor: NumericLu::new(), memory })
    }
}

impl<const D: usize> BlockColumns<D> {
    fn new(n_blocks: usize, couplings: &[[usize; 2]]) -> Self {
        let mut columns: Vec<Vec<u32>> = (0..n_blocks).map(|block| vec![block as u32]).collect();
        for &[a, b] in couplings {
            columns[a].push(b as u32);
            columns[b].push(a as u32);
        }
        let mut starts = Vec::with_capacity(n_blocks + 1);
        let mut rows = Vec::new();
        let (mut scalar_starts, mut scalar_rows) = (vec![0_u32], Vec::new());
        for mut column in columns {
            column.sort_unstable();
            column.dedup();
            starts.push(rows.len());
            for _ in 0..D {
                let of_block = |row: u32| (0..D as u32).map(move |axis| row * D as u32 + axis);
                scalar_rows.extend(column.iter().copied().flat_map(of_block));
                scalar_starts.push(scalar_rows.len() as u32);
            }
            rows.extend(column);
        }
        starts.push(rows.len());
        let size = n_blocks * D;
        let values = vec![0.0; scalar_rows.len()];
        let pattern =
            SymbolicSparseColMat::new_checked(size, size, scalar_starts, None, scalar_rows);
        let lengths = starts.windows(2).map(|pair| pair[1] - pair[0]);
        let row_length = lengths.max().unwrap_or(0) * D;
        Self { pattern, values, starts, rows, row_length }
    }

    fn size(&self) -> usize {
        self.pattern.nrows()
    }

    fn view(&self) -> SparseColMatRef<'_, u32, f64> {
        SparseColMatRef::new(self.pattern.as_ref(), &self.values)
    }

    fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        let (start, end) = (self.starts[column], self.starts[column + 1]);
        let place = self.rows[start..end].binary_search(&(row as u32));
        let place = place.expect("the couplings hold every block that is filled");
        // A block column is D scalar columns, each of all its rows.
        let height = (end - start) * D;
        let first = start * D * D + place * D;
        for axis in 0..D {
            let entries = &mut self.values[first + axis * height..][..D];
            for (entry, value) in entries.iter_mut().zip(block.column(axis).iter()) {
                *entry += value;
            }
        }
    }
}

impl<const D: usize> Product for BlockColumns<D> {
    fn row_length(&self) -> usize {
        self.row_length
    }

    fn add_products(&self, x: &[f64], product: &mut [f64], scale: &mut [f64]) {
        let mut values = self.values.iter();
        for (block_column, x) in x.chunks_exact(D).enumerate() {
            let rows = &self.rows[self.starts[block_column]..self.starts[block_column + 1]];
            for x in x {
                for row in rows {
                    let start = *row as usize * D;
                    let targets = product[start..][..D].iter_mut().zip(&mut scale[start..][..D]);
                    for ((product, scale), entry) in targets.zip(&mut values) {
                        let term = entry * x;
                        *product += term;
                        *scale += term.abs();
                    }
                }
            }
        }
    }

    fn add_row_sums(&self, sums: &mut [f64]) {
        for (row, entry) in self.pattern.row_idx().iter().zip(&self.values) {
            sums[*row as usize] += entry.abs();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::dense::{DenseSystem, Method};
    use super::*;

    const SIDE: usize = 7;
    const N_BLOCKS: usize = SIDE * SIDE;

    /// The couplings of a square net with one diagonal.
    fn net() -> Vec<[usize; 2]> {
        let at = |row: usize, column: usize| row * SIDE + column;
        let mut couplings = Vec::new();
        for row in 0..SIDE {
            for column in 0..SIDE {
                let neighbours = [(row + 1, column), (row, column + 1), (row + 1, column + 1)];
                let inside =
                    neighbours.iter().filter(|(row, column)| *row < SIDE && *column < SIDE);
                couplings.extend(inside.map(|(i, j)| [at(row, column), at(*i, *j)]));
            }
        }
        couplings
    }

    /// The same random system, sparse and dense: couplings of either sign, `weight` on the diagonal.
    fn systems(symmetric: bool, weight: f64) -> (SparseSystem<2>, DenseSystem) {
        let mut random = fastrand::Rng::with_seed(3);
        let couplings = net();
        let mut sparse = SparseSystem::new(N_BLOCKS, &couplings, symmetric);
        let mut dense = DenseSystem::new(2 * N_BLOCKS, Method::Lu);
        let mut add = |row: usize, column: usize, block: SMatrix<f64, 2, 2>| {
            sparse.add(row, column, &block);
            let mut view = dense.matrix.fixed_view_mut::<2, 2>(2 * row, 2 * column);
            view += block;
        };
        for [a, b] in couplings {
            let block = SMatrix::from_fn(|_, _| random.f64() - 0.5);
            let other = if symmetric { block } else { SMatrix::from_fn(|_, _| random.f64() - 0.5) };
            add(a, b, block);
            add(b, a, other.transpose());
        }
        for block in 0..N_BLOCKS {
            add(block, block, SMatrix::identity() * weight);
        }
        for (row, (a, b)) in sparse.right_mut().iter_mut().zip(dense.right_mut()).enumerate() {
            (*a, *b) = (row as f64 - 20.0, row as f64 - 20.0);
        }
        (sparse, dense)
    }

    /// Solves both; their largest difference, and what the sparse solver did.
    fn compare(symmetric: bool, weight: f64) -> (f64, LinearStatistics) {
        let (mut sparse, mut dense) = systems(symmetric, weight);
        let mut statistics = LinearStatistics::default();
        sparse.solve(&mut statistics).unwrap();
        dense.solve(&mut LinearStatistics::default()).unwrap();
        let differences =
            sparse.solution().iter().zip(dense.solution()).map(|(a, b)| (a - b).abs());
        (differences.fold(0.0, f64::max), statistics)
    }

    #[test]
    fn a_positive_definite_system_takes_one_cholesky() {
        let (difference, statistics) = compare(true, 5.0);
        assert!(difference < 1e-13, "{difference}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
    }

    #[test]
    fn an_indefinite_system_is_told_and_solved() {
        let (difference, statistics) = compare(true, 0.5);
        assert!(difference < 1e-11, "{difference}");
        assert_eq!(statistics.indefinite, 1);
        assert!(statistics.worst_residual < 1e-14, "{}", statistics.worst_residual);
    }

    #[test]
    fn an_unsymmetric_system_is_not_taken_for_a_symmetric_one() {
        let (difference, statistics) = compare(false, 3.0);
        assert!(difference < 1e-12, "{difference}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
    }

    #[test]
    fn the_pattern_is_analysed_once_for_many_systems() {
        let (mut system, _) = systems(true, 5.0);
        let mut statistics = LinearStatistics::default();
        for _ in 0..3 {
            system.solve(&mut statistics).unwrap();
        }
        assert_eq!((statistics.symbolic_analyses, statistics.factorisations), (1, 3));
    }

    #[test]
    fn a_singular_system_is_an_error_and_not_an_answer() {
        let mut system = SparseSystem::<2>::new(N_BLOCKS, &net(), true);
        for block in 1..N_BLOCKS {
            system.add_diagonal(block, 2.0);
        }
        system.right_mut().fill(1.0);
        let result = system.solve(&mut LinearStatistics::default());
        assert!(
            matches!(
                result,
                Err(LinearError::Singular { .. } | LinearError::SingularToPrecision { .. })
            ),
            "{result:?}"
        );
    }
}
