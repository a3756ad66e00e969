//! Linear and nonlinear solves. Nothing here knows of particles or forces.
//!
//! - [`linear`]: systems made of `D × D` blocks, split into independent parts, each solved by what it
//!   needs. A sparse solver for large parts belongs there, as another kind of part.
//! - [`dense`]: one part as a dense matrix, with a checked residual.
//! - [`newton`]: Newton's method on a callback.

pub mod dense;
pub mod linear;
pub mod newton;

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
}
