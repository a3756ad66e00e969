//! Linear and nonlinear solvers, independent of particles and forces.
//!
//! - [`linear`]: systems of `D × D` blocks, split into independent components with a solver each.
//! - [`dense`]: a component as a dense matrix.
//! - [`sparse`]: a component as a sparse matrix.
//! - `checked`: backward error and iterative refinement, for both.
//! - [`newton`]: Newton's method on a callback.
//! - [`line_search`]: backtracking along a step.
//! - [`psd`]: projection of a block to a positive semi-definite one.

mod blocks;
pub(crate) mod checked;
pub mod dense;
pub(crate) mod factor;
#[cfg(test)]
pub(crate) mod forest;
mod front;
mod lagged;
pub mod line_search;
pub mod linear;
pub mod newton;
#[cfg(test)]
mod properties;
pub mod psd;
pub mod sparse;
pub(crate) mod symbolic;

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
