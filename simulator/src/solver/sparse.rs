//! One sparse system `A x = b` of `D × D` blocks, solved and checked.
//!
//! A symmetric matrix is given to four methods, each where the one before does not reach rounding:
//!
//! 1. conjugate gradients with the factor of an earlier matrix (`stale`), where counts say that it pays;
//! 2. block LDLᵀ without exchange of blocks (`ldl`), planned once for the pattern (`fronts`);
//! 3. LBLᵀ with pivoting inside supernodes (`general`);
//! 4. LU with partial pivoting (`general`), which is also what any other matrix is given to.
//!
//! Why an LDLᵀ of our own: a library call has a fixed cost, which at 25 to 1000 particles is most of it;
//! a matrix need not be definite, where Cholesky fails and is paid for in vain; and the bits do not depend
//! on the processor.
//!
//! Storage is in proportion to the couplings, and that of the factors to their fill. Everything runs on
//! one thread, so that the bits do not depend on how many there are. Nothing is allocated once each of the
//! methods that a system takes was used.

use nalgebra::SMatrix;

use super::LinearError;
use super::blocks::BlockColumns;
use super::checked::Checked;
use super::fronts::Plan;
use super::general::{Lblt, Lu};
use super::ldl::{Factor, Outcome};
use super::stale::Stale;
use crate::statistics::LinearStatistics;

/// Refinements that may bring a solution by LDLᵀ to rounding; each is far cheaper than another method.
const LDL_REFINEMENTS: u32 = 4;

/// A matrix with room to solve by it.
pub struct SparseSystem<const D: usize> {
    matrix: BlockColumns<D>,
    checked: Checked,
    last: Last,
    ldl: Option<Box<Ldl<D>>>,
    lblt: Option<Box<Lblt>>,
    lu: Option<Box<Lu>>,
}

/// What the last matrix was solved by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Last {
    Nothing,
    Stale,
    Ldl,
    Lblt,
    Lu,
}

struct Ldl<const D: usize> {
    plan: Plan,
    factor: Factor<D>,
    stale: Stale,
}

impl<const D: usize> SparseSystem<D> {
    /// A zero matrix of `n_blocks` blocks a side, whose blocks `couplings` and their transposes and the
    /// diagonal may be filled; `symmetric` if it always is.
    pub fn new(n_blocks: usize, couplings: &[[usize; 2]], symmetric: bool) -> Self {
        Self {
            matrix: BlockColumns::new(n_blocks, couplings, symmetric),
            checked: Checked::new(n_blocks * D),
            last: Last::Nothing,
            ldl: None,
            lblt: None,
            lu: None,
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
    /// it: what is added to them is not looked at.
    ///
    /// # Panics
    /// Where the couplings do not hold that block.
    pub fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        self.matrix.add(row, column, block);
    }

    /// Where the blocks `(i, i)`, `(j, j)`, `(i, j)` and `(j, i)` are, for [`add_at`](Self::add_at); the
    /// last two are one where only one of them is kept.
    ///
    /// # Panics
    /// Where the couplings do not hold them.
    pub(super) fn pair_offsets(&self, i: usize, j: usize) -> [usize; 4] {
        let kept = |row, column| self.matrix.offset(row, column);
        let [ij, ji] = [kept(i, j), kept(j, i)];
        let diagonal = |block| self.matrix.starts[block] * D * D;
        let either = |one: Option<usize>, other: Option<usize>| one.or(other).unwrap_or_default();
        [diagonal(i), diagonal(j), either(ij, ji), either(ji, ij)]
    }

    /// Adds to the block at `offset`.
    pub(super) fn add_at(&mut self, offset: usize, block: &SMatrix<f64, D, D>) {
        self.matrix.add_at(offset, block);
    }

    /// Solves the system; the solution is then in [`solution`](Self::solution).
    ///
    /// # Errors
    /// Where the matrix is singular to working precision, holds what is not finite, or has more fill
    /// than there is memory.
    pub fn solve(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.last = Last::Nothing;
        self.checked.refuse_what_is_not_finite(&self.matrix.values)?;
        let solved = self.matrix.symmetric
            && (self.solve_stale(statistics)
                || self.solve_ldl(statistics)?
                || self.solve_lblt(statistics)?);
        if !solved {
            self.solve_lu(statistics)?;
        }
        self.checked.conclude(&self.matrix, statistics)
    }

    /// Solves for another right-hand side, with the same matrix and what the last one was solved by.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_again(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        self.checked.refuse_what_is_not_finite(&[])?;
        let Self { matrix, checked, ldl, lblt, lu, .. } = self;
        let solved = match (self.last, ldl, lblt, lu) {
            (Last::Ldl, Some(ldl), ..) => {
                let Ldl { plan, factor, .. } = &mut **ldl;
                checked.attempt(matrix, LDL_REFINEMENTS, statistics, |b| {
                    factor.solve(plan, b);
                    true
                })
            }
            (Last::Lblt, _, Some(lblt), _) => checked.attempt(matrix, 1, statistics, |b| {
                lblt.solve(b);
                true
            }),
            (Last::Lu, .., Some(lu)) => {
                checked.attempt(matrix, 1, statistics, |b| {
                    lu.solve(b);
                    true
                });
                Some(true)
            }
            _ => None,
        };
        if solved != Some(true) {
            return self.solve(statistics);
        }
        self.checked.conclude(&self.matrix, statistics)
    }

    /// Whether an earlier factor brought the solution to rounding.
    fn solve_stale(&mut self, statistics: &mut LinearStatistics) -> bool {
        let Some(ldl) = &mut self.ldl else { return false };
        let Ldl { plan, factor, stale } = &mut **ldl;
        if !stale.is_worth_trying() {
            return false;
        }
        let (solved, iterations) =
            stale.solve(&self.matrix, &mut self.checked, |b| factor.solve(plan, b));
        statistics.iterations += iterations;
        if solved {
            statistics.reused += 1;
            self.last = Last::Stale;
        }
        solved
    }

    /// Whether LDLᵀ brought the solution to rounding.
    fn solve_ldl(&mut self, statistics: &mut LinearStatistics) -> Result<bool, LinearError> {
        let Self { matrix, checked, .. } = self;
        let ldl = match &mut self.ldl {
            Some(ldl) => ldl,
            empty => {
                statistics.symbolic_analyses += 1;
                empty.insert(Box::new(Ldl::new(matrix)?))
            }
        };
        let Ldl { plan, factor, stale } = &mut **ldl;
        statistics.factorisations += 1;
        let outcome = factor.factorise(plan, &matrix.values);
        stale.renew(outcome == Outcome::Definite);
        if outcome != Outcome::Definite {
            statistics.indefinite += 1;
        }
        if outcome == Outcome::Singular {
            return Ok(false);
        }
        let solved = checked.attempt(matrix, LDL_REFINEMENTS, statistics, |b| {
            factor.solve(plan, b);
            true
        });
        self.last = Last::Ldl;
        Ok(solved == Some(true))
    }

    /// Whether LBLᵀ brought the solution to rounding.
    fn solve_lblt(&mut self, statistics: &mut LinearStatistics) -> Result<bool, LinearError> {
        let Self { matrix, checked, .. } = self;
        let lblt = match &mut self.lblt {
            Some(lblt) => lblt,
            empty => empty.insert(Box::new(Lblt::new(matrix, statistics)?)),
        };
        lblt.factorise(matrix, statistics);
        let solved = checked.attempt(matrix, 1, statistics, |b| {
            lblt.solve(b);
            true
        });
        self.last = Last::Lblt;
        Ok(solved == Some(true))
    }

    fn solve_lu(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        let Self { matrix, checked, .. } = self;
        let lu = match &mut self.lu {
            Some(lu) => lu,
            empty => empty.insert(Box::new(Lu::new(matrix, statistics)?)),
        };
        lu.factorise(matrix, statistics)?;
        checked.attempt(matrix, 1, statistics, |b| {
            lu.solve(b);
            true
        });
        self.last = Last::Lu;
        // A zero pivot divides; nothing comes after LU.
        if checked.solution.iter().all(|value| value.is_finite()) {
            Ok(())
        } else {
            Err(LinearError::SingularToPrecision { size: matrix.size() })
        }
    }
}

impl<const D: usize> Ldl<D> {
    fn new(matrix: &BlockColumns<D>) -> Result<Self, LinearError> {
        let size = matrix.size();
        let out_of_memory = LinearError::OutOfMemory { size };
        let Some(plan) = Plan::new(&matrix.starts, &matrix.rows) else { return Err(out_of_memory) };
        let Some(factor) = Factor::new(&plan) else { return Err(out_of_memory) };
        let entries = (plan.n_factor + matrix.rows.len()) as u64;
        let budget = D as u64 * plan.n_products / (RATE * 2 * entries);
        Ok(Self { plan, factor, stale: Stale::new(size, budget) })
    }
}

/// Products of entries in a factorisation that take as long as one in a solve, which waits for memory.
const RATE: u64 = 6;

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
