//! Checks of Jacobians of any function, by independent estimates.
//!
//! ```text
//! ridders    derivatives of any function by extrapolated differences
//! taylor     does a linearization leave a remainder of second order?
//! ```

pub mod ridders;
pub mod taylor;
