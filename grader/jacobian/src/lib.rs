//! Checks of Jacobians of any function, by independent estimates.
//!
//! ```text
//! ridders    derivatives of any function by extrapolated differences
//! taylor     does a linearization leave a remainder of second order?
//! verdict    the judgement of one entry by its estimates
//! noise      the noise of a function, from tables of differences
//! function   a function with its Jacobian: dense, sparse or as products
//! state      every entry at one state
//! likeness   what a wrong Jacobian looks like
//! branches   states on every branch of a function
//! probes     states on branches that are met by no search along lines
//! structure  symmetry, and invariance under translation and rotation
//! check      many states, one report
//! ```

pub mod branches;
pub mod check;
pub mod function;
pub mod likeness;
pub mod noise;
pub mod probes;
pub mod ridders;
pub mod state;
pub mod structure;
pub mod taylor;
pub mod verdict;

pub use branches::Domain;
pub use check::{Report, Settings, check};
pub use function::{Derivative, Function, Triplet};
