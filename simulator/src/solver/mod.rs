//! Linear and nonlinear solves. Nothing here knows of particles or forces.
//!
//! - [`linear`]: systems made of `D × D` blocks, split into independent parts, each solved by what it
//!   needs.
//! - [`dense`]: one part as a dense matrix.
//! - [`sparse`]: one part as a sparse matrix.
//! - `checked`: what both do to a solution before it is believed.
//! - [`newton`]: Newton's method on a callback.
//! - [`damped_newton`]: the same with a line search on the residual.
//! - [`line_search`]: backtracking along a step.
//! - [`psd`]: projection of a block to a positive semi-definite one.

mod blocks;
mod checked;
pub mod damped_newton;
pub mod dense;
mod fronts;
mod general;
mod ldl;
pub mod line_search;
pub mod linear;
pub mod newton;
pub mod psd;
pub mod sparse;
mod stale;

pub(crate) use checked::underflow;

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
    /// The matrix is singular as far as its digits go.
    #[error("the {size} × {size} matrix is singular to working precision")]
    SingularToPrecision {
        /// Rows of the matrix.
        size: usize,
    },
    /// The corrections of a stiff system did not become small.
    #[error(
        "stiffness swamps the masses: refining the {size} × {size} system still changes its solution by {correction:.1e} of itself"
    )]
    Unsettled {
        /// Rows of the matrix.
        size: usize,
        /// The last correction, relative to the solution in the l2 norm.
        correction: f64,
    },
    /// The matrix or the right-hand side holds an infinity or a NaN.
    #[error("the {size} × {size} system holds a number that is not finite")]
    NotFinite {
        /// Rows of the matrix.
        size: usize,
    },
    /// Refinement and complete pivoting left a residual far above rounding.
    #[error("the solution of the {size} × {size} system has a relative residual of {residual:.1e}")]
    LostDigits {
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
