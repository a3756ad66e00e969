//! Sparse linear system `A x = b` of `D × D` blocks, with a check of every solution.
//!
//! There are up to three methods; each is used if the one before does not reach rounding error:
//!
//! 1. of a symmetric matrix: conjugate gradients with the factor of an earlier matrix (`lagged`), where counts say that
//!    it pays;
//! 2. block LDLᵀ, or LU if the matrix is not symmetric, without exchange of blocks (`factor`), analysed once per
//!    pattern (`symbolic`);
//! 3. dense LU with pivoting ([`dense`](crate::dense)), up to [`MAX_DENSE_ROWS`] rows.
//!
//! The second suffices for the matrices of time steps: a mass on the diagonal and, for each spring, a block that is added
//! to two diagonal blocks and subtracted between them. Why it is our own: a library call has a fixed cost that
//! matters at 25 to 1000 particles; a matrix need not be definite, where Cholesky would fail; and the bits do not
//! depend on the processor.
//!
//! Storage is in proportion to the couplings, and that of the factors to their fill. The factorisation of a large matrix
//! uses several threads, with the same bits for any number of them; everything else runs on one. Nothing is allocated
//! once each of the methods that a system takes was used.

use nalgebra::SMatrix;

use crate::LinearError;
use crate::blocks::BlockColumns;
use crate::checked::Checked;
use crate::dense::{DenseMethod, DenseSystem};
use crate::factor::{self, Factor};
use crate::lagged::LaggedPreconditioner;
use crate::pivot::Inertia;
use crate::sizes::MAX_DENSE_ROWS;
use crate::statistics::LinearStatistics;
use crate::symbolic::SymbolicFactor;

/// Refinements that may bring a solution to rounding; each is far cheaper than another method.
const MAX_REFINEMENTS: u32 = 4;

/// A matrix with the workspace for solving.
pub struct SparseSystem<const D: usize> {
    matrix: BlockColumns<D>,
    checked: Checked,
    last: Last,
    direct: Option<Box<Direct>>,
    dense: Option<Box<DenseSystem>>,
}

/// The method that solved the last matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Last {
    Nothing,
    Lagged,
    Direct,
    Dense,
}

struct Direct {
    symbolic: SymbolicFactor,
    factor: Box<dyn Factor>,
    lagged: LaggedPreconditioner,
}

impl<const D: usize> SparseSystem<D> {
    /// A zero matrix of `n_blocks` blocks a side, whose blocks `couplings` and their transposes and the
    /// diagonal may be filled; `symmetric` if it always is.
    pub fn new(n_blocks: usize, couplings: &[[usize; 2]], symmetric: bool) -> Self {
        Self {
            matrix: BlockColumns::new(n_blocks, couplings, symmetric),
            checked: Checked::new(n_blocks * D),
            last: Last::Nothing,
            direct: None,
            dense: None,
        }
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.checked.right.len()
    }

    /// Whether the matrix is symmetric by construction.
    pub fn is_symmetric(&self) -> bool {
        self.matrix.symmetric
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
        self.matrix.add_diagonal(block, value);
    }

    /// Adds to block `(row, column)`. Of a symmetric matrix, the blocks above the diagonal are those below
    /// it: what is added to them is ignored.
    ///
    /// # Panics
    /// If the couplings do not hold that block.
    pub fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        self.matrix.add(row, column, block);
    }

    /// Calls `to` with row, column and value of each entry, both triangles of a symmetric matrix.
    pub(crate) fn read(&self, to: &mut dyn FnMut(usize, usize, f64)) {
        self.matrix.read(to);
    }

    /// Where block `(row, column)` is, for [`add_at`](Self::add_at); `None` above the diagonal of a symmetric matrix.
    ///
    /// # Panics
    /// If the couplings do not hold it.
    pub(crate) fn offset(&self, row: usize, column: usize) -> Option<usize> {
        self.matrix.offset(row, column)
    }

    /// Adds to the block at `offset`.
    #[inline]
    pub(crate) fn add_at(&mut self, offset: usize, block: &SMatrix<f64, D, D>) {
        self.matrix.add_at(offset, block);
    }

    /// Solves the system; the solution is then in [`solution`](Self::solution).
    ///
    /// # Errors
    /// If the matrix is singular to working precision, contains an infinity or a NaN, or has more fill
    /// than there is memory.
    pub fn solve(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.last = Last::Nothing;
        self.checked.check_finite(&self.matrix.values)?;
        if self.solve_lagged(statistics) || self.solve_directly(statistics)? {
            return self.checked.accept(&self.matrix, statistics);
        }
        self.solve_dense(statistics)
    }

    /// Makes the next solve factorise its matrix, for a matrix that will be solved again many times.
    pub(crate) fn forget_factor(&mut self) {
        if let Some(direct) = &mut self.direct {
            direct.lagged.forget();
        }
    }

    /// Solves for another right-hand side, with the factor of the last solve.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_again(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.checked.check_finite(&[])?;
        let Self { matrix, checked, direct, dense, .. } = self;
        match (self.last, direct, dense) {
            (Last::Direct, Some(direct), _) => {
                let Direct { symbolic, factor, .. } = &mut **direct;
                let solved = checked.attempt(matrix, MAX_REFINEMENTS, statistics, |b| {
                    factor.solve(symbolic, b);
                    true
                });
                statistics.factor.add(factor.take_work());
                if solved == Some(true) {
                    return checked.accept(matrix, statistics);
                }
                self.solve(statistics)
            }
            (Last::Dense, _, Some(dense)) => {
                dense.right_mut().copy_from_slice(&checked.right);
                dense.solve_again(statistics)?;
                checked.solution.copy_from_slice(dense.solution());
                Ok(())
            }
            _ => self.solve(statistics),
        }
    }

    /// Magnitude of the smallest pivot of the last matrix; infinite if it was not factorised.
    pub(crate) fn smallest_pivot(&self) -> f64 {
        match (self.last, &self.direct, &self.dense) {
            (Last::Direct, Some(direct), _) => direct.factor.smallest_pivot(),
            (Last::Dense, _, Some(dense)) => dense.smallest_pivot(),
            _ => f64::INFINITY,
        }
    }

    /// Whether an earlier factor brought the solution to rounding.
    fn solve_lagged(&mut self, statistics: &mut LinearStatistics) -> bool {
        let Some(direct) = &mut self.direct else { return false };
        let Direct { symbolic, factor, lagged } = &mut **direct;
        if !self.matrix.symmetric || !lagged.is_worthwhile() {
            return false;
        }
        let (solved, iterations) =
            lagged.solve(&self.matrix, &mut self.checked, |b| factor.solve(symbolic, b));
        statistics.iterations += iterations;
        statistics.factor.add(factor.take_work());
        if solved {
            statistics.reused += 1;
            self.last = Last::Lagged;
        }
        solved
    }

    /// Whether the sparse factor brought the solution to rounding.
    fn solve_directly(&mut self, statistics: &mut LinearStatistics) -> Result<bool, LinearError> {
        let Self { matrix, checked, .. } = self;
        let direct = match &mut self.direct {
            Some(direct) => direct,
            empty => {
                statistics.symbolic_analyses += 1;
                empty.insert(Box::new(Direct::new(matrix)?))
            }
        };
        let Direct { symbolic, factor, lagged } = &mut **direct;
        statistics.factorisations += 1;
        let inertia = factor.factorise(symbolic, &matrix.values);
        lagged.reset(inertia == Inertia::Definite);
        if matrix.symmetric && inertia != Inertia::Definite {
            statistics.indefinite += 1;
        }
        if inertia == Inertia::Singular {
            return Ok(false);
        }
        let solved = checked.attempt(matrix, MAX_REFINEMENTS, statistics, |b| {
            factor.solve(symbolic, b);
            true
        });
        statistics.factor.add(factor.take_work());
        self.last = Last::Direct;
        // A matrix too large for the dense solver is judged by this solution.
        Ok(solved == Some(true) || matrix.size() > MAX_DENSE_ROWS)
    }

    fn solve_dense(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        let size = self.size();
        if size > MAX_DENSE_ROWS {
            return Err(LinearError::SingularToPrecision { size });
        }
        let Self { matrix, checked, .. } = self;
        let new = || Box::new(DenseSystem::new(size, DenseMethod::Lu));
        let dense = self.dense.get_or_insert_with(new);
        dense.matrix.fill(0.0);
        matrix.read(&mut |row, column, entry| dense.matrix[(row, column)] = entry);
        dense.right_mut().copy_from_slice(&checked.right);
        dense.solve(statistics)?;
        checked.solution.copy_from_slice(dense.solution());
        self.last = Last::Dense;
        Ok(())
    }
}

impl Direct {
    fn new<const D: usize>(matrix: &BlockColumns<D>) -> Result<Self, LinearError> {
        let size = matrix.size();
        let symbolic = SymbolicFactor::new(&matrix.starts, &matrix.rows);
        let factor = factor::new::<D>(&symbolic, matrix.symmetric);
        let factor = factor.ok_or(LinearError::OutOfMemory { size })?;
        let entries = (symbolic.n_factor + matrix.rows.len()) as u64;
        let budget = D as u64 * symbolic.n_products / (RATE * 2 * entries);
        Ok(Self { symbolic, factor, lagged: LaggedPreconditioner::new(size, budget) })
    }
}

/// Products of entries in a factorisation that take as long as one in a solve, which waits for memory.
const RATE: u64 = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sizes::WORTHWHILE;

    /// The couplings of a square net of `side` blocks a side, with one diagonal.
    fn net(side: usize) -> Vec<[usize; 2]> {
        let at = |row: usize, column: usize| row * side + column;
        let mut couplings = Vec::new();
        for row in 0..side {
            for column in 0..side {
                let neighbours = [(row + 1, column), (row, column + 1), (row + 1, column + 1)];
                let inside =
                    neighbours.iter().filter(|(row, column)| *row < side && *column < side);
                couplings.extend(inside.map(|(i, j)| [at(row, column), at(*i, *j)]));
            }
        }
        couplings
    }

    /// The same system, sparse and dense.
    struct Both<const D: usize> {
        sparse: SparseSystem<D>,
        dense: DenseSystem,
    }

    impl<const D: usize> Both<D> {
        fn new(n_blocks: usize, couplings: &[[usize; 2]], symmetric: bool) -> Self {
            let mut both = Self {
                sparse: SparseSystem::new(n_blocks, couplings, symmetric),
                dense: DenseSystem::new(D * n_blocks, DenseMethod::Lu),
            };
            for row in 0..D * n_blocks {
                both.sparse.right_mut()[row] = row as f64 - 20.0;
                both.dense.right_mut()[row] = row as f64 - 20.0;
            }
            both
        }

        /// Couplings of either sign, and `weight` on the diagonal.
        fn random(side: usize, symmetric: bool, weight: f64, seed: u64) -> Self {
            let mut random = fastrand::Rng::with_seed(seed);
            let couplings = net(side);
            let mut both = Self::new(side * side, &couplings, symmetric);
            for [a, b] in couplings {
                let block = SMatrix::from_fn(|_, _| random.f64() - 0.5);
                let other =
                    if symmetric { block } else { SMatrix::from_fn(|_, _| random.f64() - 0.5) };
                both.add(a, b, block);
                both.add(b, a, other.transpose());
            }
            for block in 0..side * side {
                both.add(block, block, SMatrix::identity() * weight);
            }
            both
        }

        fn add(&mut self, row: usize, column: usize, block: SMatrix<f64, D, D>) {
            self.sparse.add(row, column, &block);
            let mut view = self.dense.matrix.fixed_view_mut::<D, D>(D * row, D * column);
            view += block;
        }

        /// Solves both; their largest difference, relative to the largest entry, and what the sparse one
        /// did.
        fn compare(&mut self) -> (f64, LinearStatistics) {
            let mut statistics = LinearStatistics::default();
            self.sparse.solve(&mut statistics).unwrap();
            self.dense.solve(&mut LinearStatistics::default()).unwrap();
            (difference(self.sparse.solution(), self.dense.solution()), statistics)
        }
    }

    fn difference(a: &[f64], b: &[f64]) -> f64 {
        let largest = b.iter().fold(0.0, |max: f64, value| max.max(value.abs()));
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
    }

    fn agrees_with_dense<const D: usize>() {
        for side in 1..12 {
            for (symmetric, weight) in [(true, 6.0), (true, 0.5), (false, 3.0)] {
                let (difference, statistics) =
                    Both::<D>::random(side, symmetric, weight, side as u64).compare();
                let what = format!("{D}D, side {side}, weight {weight}: {difference:e}");
                assert!(difference < 1e-11, "{what}");
                assert!(statistics.worst_residual < 1e-14, "{what}");
                assert_eq!(statistics.complete_pivotings, 0, "{what}");
                let indefinite = symmetric && weight < 1.0 && side > 1;
                assert_eq!(statistics.indefinite, u64::from(indefinite), "{what}");
            }
        }
    }

    #[test]
    fn agrees_with_the_dense_solver_definite_indefinite_and_unsymmetric() {
        agrees_with_dense::<2>();
        agrees_with_dense::<3>();
    }

    #[test]
    fn a_symmetric_system_takes_one_factorisation_definite_or_not() {
        for weight in [5.0, 0.5] {
            let (_, statistics) = Both::<2>::random(7, true, weight, 3).compare();
            assert_eq!((statistics.factorisations, statistics.symbolic_analyses), (1, 1));
            assert_eq!(statistics.indefinite, u64::from(weight < 1.0));
        }
    }

    #[test]
    fn zero_diagonals_within_blocks_are_solved() {
        // Every diagonal block is (0 1; 1 0), and no scalar can be eliminated first.
        let couplings = net(4);
        let mut both = Both::<2>::new(16, &couplings, true);
        let turn = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 1.0, 0.0);
        for block in 0..16 {
            both.add(block, block, turn);
        }
        for [a, b] in couplings {
            both.add(a, b, SMatrix::identity() * 0.1);
            both.add(b, a, SMatrix::identity() * 0.1);
        }
        let (difference, statistics) = both.compare();
        assert!(difference < 1e-13, "{difference}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (1, 1));
    }

    #[test]
    fn tiny_diagonal_blocks_are_reported_and_pivoted() {
        let couplings = net(5);
        for tiny in [0.0, 1e-13] {
            let mut both = Both::<2>::new(25, &couplings, true);
            let mut random = fastrand::Rng::with_seed(5);
            for &[a, b] in &couplings {
                let block = SMatrix::from_fn(|_, _| random.f64() - 0.5);
                both.add(a, b, block);
                both.add(b, a, block.transpose());
            }
            for block in 0..25 {
                both.add(block, block, SMatrix::identity() * tiny);
            }
            let (found, statistics) = both.compare();
            assert!(found < 1e-9, "{found}");
            assert!(statistics.factorisations > 1, "{statistics:?}");
            assert!(statistics.worst_residual < 1e-14, "{statistics:?}");

            // Another right-hand side goes to the method that did it, and to no other.
            let before = statistics.factorisations;
            let mut statistics = statistics;
            both.sparse.right_mut().fill(1.0);
            both.dense.right_mut().fill(1.0);
            both.sparse.solve_again(&mut statistics).unwrap();
            both.dense.solve(&mut LinearStatistics::default()).unwrap();
            let found = difference(both.sparse.solution(), both.dense.solution());
            assert!(found < 1e-9, "{found}");
            assert_eq!(statistics.factorisations, before);
        }
    }

    #[test]
    fn further_right_hand_sides_reuse_the_factorisation() {
        for (symmetric, weight) in [(true, 5.0), (true, 0.5), (false, 3.0)] {
            let mut both = Both::<3>::random(6, symmetric, weight, 9);
            let (_, mut statistics) = both.compare();
            both.sparse.right_mut().fill(1.0);
            both.dense.right_mut().fill(1.0);
            let dense = &mut LinearStatistics::default();
            both.sparse.solve_again(&mut statistics).unwrap();
            both.dense.solve_again(dense).unwrap();
            assert!(difference(both.sparse.solution(), both.dense.solution()) < 1e-11);
            assert_eq!((statistics.factorisations, dense.factorisations), (1, 0));
        }
    }

    #[test]
    fn unsymmetric_system_is_not_solved_as_symmetric() {
        let (difference, statistics) = Both::<2>::random(7, false, 3.0, 3).compare();
        assert!(difference < 1e-12, "{difference}");
        assert_eq!((statistics.factorisations, statistics.indefinite), (1, 0));
    }

    #[test]
    fn an_unsymmetric_factor_serves_large_systems_with_far_off_diagonals() {
        // Two nets with dense fronts of more than a panel, joined by a row of couplings.
        let mut couplings = net(20);
        couplings.extend((0..40).map(|block| [block, 399 - block]));
        couplings.extend((0..30).flat_map(|a| (0..a).map(move |b| [200 + a, 200 + b])));
        for seed in 0..4 {
            let mut random = fastrand::Rng::with_seed(seed);
            let mut both = Both::<3>::new(400, &couplings, false);
            for [a, b] in &couplings {
                both.add(*a, *b, SMatrix::from_fn(|_, _| random.f64() - 0.5));
                both.add(*b, *a, SMatrix::from_fn(|_, _| random.f64() - 0.5));
            }
            for block in 0..400 {
                let turn = SMatrix::from_fn(|_, _| 6.0 * (random.f64() - 0.5));
                both.add(block, block, turn + SMatrix::identity() * 12.0);
            }
            let (difference, statistics) = both.compare();
            assert!(difference < 1e-11, "{difference}");
            assert_eq!(statistics.factorisations, 1);
        }
    }

    #[test]
    fn the_pattern_is_analysed_once_for_many_systems() {
        let mut system = Both::<2>::random(7, true, 5.0, 3).sparse;
        let mut statistics = LinearStatistics::default();
        for _ in 0..3 {
            system.solve(&mut statistics).unwrap();
        }
        assert_eq!((statistics.symbolic_analyses, statistics.factorisations), (1, 3));
    }

    /// Fills a net's system with different diagonal entries, which `change` moves.
    fn fill(system: &mut SparseSystem<2>, side: usize, weight: f64, change: f64) {
        system.clear();
        let mut random = fastrand::Rng::with_seed(4);
        for [a, b] in net(side) {
            let mut block = SMatrix::<f64, 2, 2>::identity() * (1.0 + change * random.f64());
            block[(0, 0)] += 2.0;
            system.add(a, a, &block);
            system.add(b, b, &block);
            system.add(a, b, &-block);
            system.add(b, a, &-block);
        }
        (0..side * side).for_each(|block| system.add_diagonal(block, weight));
        let rows = system.right_mut().iter_mut().enumerate();
        rows.for_each(|(row, value)| *value = (row % 7) as f64 - 2.0);
    }

    #[test]
    fn lagged_factor_reaches_the_same_solution() {
        const SIDE: usize = 64;
        let mut system = SparseSystem::<2>::new(SIDE * SIDE, &net(SIDE), true);
        let mut statistics = LinearStatistics::default();
        for step in 0..8 {
            let change = 1e-4 * f64::from(step);
            fill(&mut system, SIDE, 0.1, change);
            system.solve(&mut statistics).unwrap();
            let mut fresh = SparseSystem::<2>::new(SIDE * SIDE, &net(SIDE), true);
            fill(&mut fresh, SIDE, 0.1, change);
            fresh.solve(&mut LinearStatistics::default()).unwrap();
            let difference = difference(system.solution(), fresh.solution());
            assert!(difference < 1e-10, "step {step}: {difference:e}");
        }
        assert_eq!(statistics.reused + statistics.factorisations, 8, "{statistics:?}");
        assert!(statistics.reused >= 4, "{statistics:?}");
        assert!(statistics.worst_residual < 1e-14, "{statistics:?}");
    }

    #[test]
    fn lagged_factor_is_tried_above_a_cost() {
        let budget = |side| {
            let system = SparseSystem::<2>::new(side * side, &net(side), true);
            Direct::new(&system.matrix).unwrap().lagged.budget()
        };
        let first = (40..100).find(|side| budget(*side) >= WORTHWHILE).unwrap();
        for side in [first - 1, first, first + 1] {
            // The order of elimination changes with the size, and the cost with it: a larger net may cost less.
            let is_tried = budget(side) >= WORTHWHILE;
            let new = || SparseSystem::<2>::new(side * side, &net(side), true);
            let (mut system, mut statistics) = (new(), LinearStatistics::default());
            for step in 0..8 {
                let change = 1e-9 * f64::from(step);
                fill(&mut system, side, 0.1, change);
                system.solve(&mut statistics).unwrap();
                let mut fresh = new();
                fill(&mut fresh, side, 0.1, change);
                fresh.solve(&mut LinearStatistics::default()).unwrap();
                let difference = difference(system.solution(), fresh.solution());
                assert!(difference < 1e-11, "side {side}, step {step}: {difference:e}");
            }
            assert_eq!(statistics.iterations > 0, is_tried, "side {side}: {statistics:?}");
        }
    }

    #[test]
    fn dense_fallback_ends_at_a_size() {
        // A chain without diagonal blocks has no first pivot. Of an even number of blocks, it is regular.
        let solve = |n_blocks: usize| {
            let couplings: Vec<[usize; 2]> = (1..n_blocks).map(|i| [i - 1, i]).collect();
            let mut system = SparseSystem::<2>::new(n_blocks, &couplings, true);
            for [a, b] in couplings {
                let turn = SMatrix::<f64, 2, 2>::new(0.0, 1.0 + a as f64 % 3.0, -2.0, 0.5);
                system.add(a, b, &turn);
                system.add(b, a, &turn.transpose());
            }
            system.right_mut().fill(1.0);
            system.solve(&mut LinearStatistics::default())
        };
        let at = MAX_DENSE_ROWS / 2;
        assert_eq!(solve(at), Ok(()));
        let size = MAX_DENSE_ROWS + 4;
        assert_eq!(solve(at + 2), Err(LinearError::SingularToPrecision { size }));
    }

    #[test]
    fn useless_lagged_factor_is_abandoned() {
        const SIDE: usize = 64;
        let mut system = SparseSystem::<2>::new(SIDE * SIDE, &net(SIDE), true);
        let mut statistics = LinearStatistics::default();
        for step in 0..40 {
            let weight = if step % 2 == 0 { 0.1 } else { 100.0 };
            fill(&mut system, SIDE, weight, 3.0 * f64::from(step));
            system.solve(&mut statistics).unwrap();
        }
        // Tried after 1, 2, 4, 8 and 16 factorisations, and given up after two iterations or three.
        assert_eq!((statistics.reused, statistics.factorisations), (0, 40));
        assert!((5..=20).contains(&statistics.iterations), "{statistics:?}");
    }

    #[test]
    fn the_factor_of_an_indefinite_matrix_is_no_preconditioner() {
        const SIDE: usize = 64;
        let mut system = SparseSystem::<2>::new(SIDE * SIDE, &net(SIDE), true);
        let mut statistics = LinearStatistics::default();
        for _ in 0..3 {
            fill(&mut system, SIDE, -0.3, 0.0);
            system.solve(&mut statistics).unwrap();
        }
        assert_eq!((statistics.indefinite, statistics.iterations), (3, 0));
    }

    #[test]
    fn singular_system_is_an_error() {
        let mut system = SparseSystem::<2>::new(49, &net(7), true);
        for block in 1..49 {
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
