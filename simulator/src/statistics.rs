//! What a run cost, as data: tests assert it, `simulate --stats` prints it.

use crate::rescue::RescueStatistics;

/// Counts over a whole run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// Steps taken.
    pub steps: u64,
    /// Evaluations of the sum of all forces.
    pub force_evaluations: u64,
    /// Assemblies of a system matrix from the Jacobians.
    pub assemblies: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// The most Newton iterations a single step took.
    pub max_newton_iterations: u64,
    /// Evaluations of an incremental potential, by a line search.
    pub energy_evaluations: u64,
    /// Times a line search halved Newton's step.
    pub line_search_halvings: u64,
    /// Element Hessians that were projected to be semi-definite.
    pub projections: u64,
    /// Rounds of a local and a global step.
    pub local_global_iterations: u64,
    /// The most rounds that a single step took.
    pub max_local_global_iterations: u64,
    /// Steps whose rounds ended without reaching the tolerance that was asked for.
    pub unconverged_steps: u64,
    /// The linear solver that the scene was given, in words; empty for an explicit method.
    pub linear_solver: String,
    /// What the linear solver did.
    pub linear: LinearStatistics,
    /// What was done for steps that had no answer.
    pub rescue: RescueStatistics,
}

/// What a linear solver did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinearStatistics {
    /// Systems solved.
    pub solves: u64,
    /// Sparsity patterns analysed.
    pub symbolic_analyses: u64,
    /// Matrices factorised; one system may hold several independent ones, or none.
    pub factorisations: u64,
    /// Solutions that were refined once more because their residual was too large.
    pub refinements: u64,
    /// Symmetric matrices that turned out not to be positive definite.
    pub indefinite: u64,
    /// Systems that were solved with the factor of an earlier matrix.
    pub reused: u64,
    /// Iterations of conjugate gradients with the factor of an earlier matrix, those in vain included.
    pub iterations: u64,
    /// Matrices that needed complete pivoting.
    pub complete_pivotings: u64,
    /// Largest accepted residual of a system, relative to `‖A‖·‖x‖ + ‖b‖` in the maximum norm.
    pub worst_residual: f64,
}
