//! Observers of the linear systems that implicit methods solve.
//!
//! With the iterate `u` of the new velocity and the residual
//!
//! ```text
//! r(u) = M (v − u) + h F(q + h u, u)
//! ```
//!
//! each iteration solves `A δ = r(u)` with `A = −∂r/∂u = M − h² ∂F/∂x − h ∂F/∂v`. An observer receives `A`
//! after assembly and before it is factorised. Without an observer nothing is copied.

use nalgebra::DMatrix;

/// A system before it is solved. Shapes: `n·D`, particle-major, unless noted.
#[derive(Debug)]
pub struct NewtonSystem<'a> {
    /// Time step, in seconds.
    pub h: f64,
    /// The end of the step, in seconds.
    pub time: f64,
    /// Positions `q` at the start of the step.
    pub positions: &'a [f64],
    /// Velocities `v` at the start of the step.
    pub velocities: &'a [f64],
    /// The iterate `u`.
    pub iterate: &'a [f64],
    /// `A`: rows and columns of the free particles alone, in their order.
    pub matrix: DMatrix<f64>,
    /// `r(u)` of the free particles, in units of momentum.
    pub residual: &'a [f64],
    /// Whether the matrix is `−∂r/∂u`: no element's contribution was projected or approximated.
    pub exact: bool,
}

/// Receives every system.
pub type Observer = Box<dyn FnMut(&NewtonSystem<'_>) + Send>;
