//! Linear systems `A x = b` of `D × D` blocks with a symmetric pattern, solved to rounding.
//!
//! The matrices are those of implicit time steps and of Newton's method: a mass on each diagonal block, and a block for
//! each pair of coupled nodes. They need be neither definite nor symmetric. A pattern is analysed once, and factorised
//! with the same bits for any number of threads; the backward error of each solution is checked.
//!
//! - [`linear`]: a matrix, split into independent components with a solver each.
//! - [`dense`]: a component as a dense matrix.
//! - [`system`]: a component as a sparse matrix.
//! - [`cholesky`]: the factor of a constant positive definite matrix, front by front.
//! - [`checked`]: backward error and iterative refinement.
//! - [`statistics`]: counts of the work.
//! - [`sizes`]: sizes at which another code path begins.
//!
//! # Example
//!
//! Two nodes in the plane, of unit mass, joined by a stiffness of 3 along x:
//!
//! ```
//! use sparse::linear::{BlockMatrix, Link, LinearSolver};
//! use sparse::statistics::LinearStatistics;
//!
//! let link = Link { blocks: [0, 1], symmetric: true };
//! let mut matrix = BlockMatrix::<2>::new(2, &[link], LinearSolver::Auto);
//! (0..2).for_each(|node| matrix.add_diagonal(node, 1.0));
//! let stiffness = nalgebra::Matrix2::new(3.0, 0.0, 0.0, 0.0);
//! let pair = matrix.pair_slot([0, 1]).expect("they are linked");
//! matrix.add_pair(pair, &stiffness);
//!
//! let mut values = [7.0, 5.0, 0.0, 5.0];
//! matrix.solve(&mut values, &mut LinearStatistics::default())?;
//! assert_eq!(values, [4.0, 5.0, 3.0, 5.0]);
//! # Ok::<(), sparse::LinearError>(())
//! ```

mod blocks;
pub mod checked;
pub mod cholesky;
pub mod dense;
mod factor;
#[cfg(test)]
mod forest;
mod front;
mod lagged;
pub mod linear;
mod pivot;
#[cfg(test)]
mod properties;
pub mod sizes;
pub mod statistics;
mod symbolic;
pub mod system;

/// A linear system that could not be solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// The matrix is singular.
    #[error("the {size} × {size} matrix is singular: pivot {pivot} is zero")]
    Singular {
        /// The first pivot, from 0, that is zero under complete pivoting.
        pivot: usize,
        /// Rows of the matrix.
        size: usize,
    },
    /// The matrix is singular to working precision.
    #[error("the {size} × {size} matrix is singular to working precision")]
    SingularToPrecision {
        /// Rows of the matrix.
        size: usize,
    },
    /// The corrections of a stiff system did not become small.
    #[error(
        "the {size} × {size} system is too stiff: iterative refinement stalls at a relative correction of {correction:.1e}"
    )]
    RefinementStalled {
        /// Rows of the matrix.
        size: usize,
        /// The last correction, relative to the solution in the l2 norm.
        correction: f64,
    },
    /// The matrix or the right-hand side holds an infinity or a NaN.
    #[error("the {size} × {size} system contains an infinity or a NaN")]
    NotFinite {
        /// Rows of the matrix.
        size: usize,
    },
    /// Refinement and complete pivoting left a residual far above rounding.
    #[error("the solution of the {size} × {size} system has a relative residual of {residual:.1e}")]
    InaccurateSolution {
        /// Rows of the matrix.
        size: usize,
        /// `‖b − Ax‖ / (‖A‖·‖x‖ + ‖b‖)` in the maximum norm.
        residual: f64,
    },
    /// The factors of the matrix do not fit into memory.
    #[error("there is not enough memory for the factors of the {size} × {size} matrix")]
    OutOfMemory {
        /// Rows of the matrix.
        size: usize,
    },
}
