//! Nonlinear solvers, independent of particles and forces. Linear systems are solved by the crate [`sparse`].
//!
//! - [`newton`]: Newton's method on a callback.
//! - [`line_search`]: backtracking along a step.
//! - [`psd`]: projection of a block to a positive semi-definite one.

pub mod line_search;
pub mod newton;
pub mod psd;

pub use sparse::{LinearError, linear};
