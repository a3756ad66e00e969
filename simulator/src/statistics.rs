//! Statistics of a run: tests assert them, and `simulate --stats` prints them.

use sparse::statistics::LinearStatistics;

use crate::fallback::FallbackStatistics;
use crate::growth::EnergyGrowth;

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
    /// Step halvings by line searches.
    pub line_search_halvings: u64,
    /// Element Hessians that were projected to be semi-definite.
    pub projections: u64,
    /// Rounds of a local and a global step.
    pub local_global_iterations: u64,
    /// The most rounds that a single step took.
    pub max_local_global_iterations: u64,
    /// Steps that reached the maximum number of rounds before the tolerance.
    pub unconverged_steps: u64,
    /// How far the rounds of a step are from the minimiser when they end.
    pub rounds_end: RoundsEnd,
    /// Steps without a Newton iteration that needed one.
    pub frozen: FrozenStatistics,
    /// Steps of error control, of which the steps of the scene are made.
    pub control: ControlStatistics,
    /// Description of the linear solver; empty for an explicit method.
    pub linear_solver: String,
    /// Counts of the linear solver's work.
    pub linear: LinearStatistics,
    /// Conditioning of the matrices of steps.
    pub conditioning: ConditioningStatistics,
    /// Fallbacks taken for steps that failed.
    pub fallback: FallbackStatistics,
    /// The first look that found the energy grown by orders of magnitude, if the run is watched.
    pub energy_growth: Option<EnergyGrowth>,
}

/// An amplification above which a matrix counts as nearly singular. If forces hold or dissipate, it is about 1. A matrix of
/// compressed springs has any, but one in a million of them comes this close to singular; such a step has lost six digits,
/// and what it says of the motion.
pub const NEARLY_SINGULAR: f64 = 1e6;

/// Conditioning of the matrices `A` of steps, as amplification: how many times larger than the change of velocity by the
/// same forces without `A`, `M⁻¹ b`, the change `A⁻¹ b` can be. These are lower bounds of `‖A⁻¹ M‖` in the maximum norm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ConditioningStatistics {
    /// Of the last system that was solved.
    pub last: f64,
    /// The largest one of a step, which is that of its last system.
    pub largest: f64,
    /// Steps above [`NEARLY_SINGULAR`].
    pub nearly_singular: u64,
    /// The first of these steps, counted from 1, and its amplification.
    pub first: Option<(u64, f64)>,
}

impl ConditioningStatistics {
    /// Whether the last matrix counts as nearly singular.
    pub(crate) fn is_nearly_singular(&self) -> bool {
        self.last > NEARLY_SINGULAR
    }

    /// Records the end of a step, counted from 1.
    pub(crate) fn end_step(&mut self, step: u64) {
        self.largest = self.largest.max(self.last);
        if self.is_nearly_singular() {
            self.nearly_singular += 1;
            self.first.get_or_insert((step, self.last));
        }
    }
}

/// How far the rounds of local and global steps are from the minimiser when they end: the worst step of a run.
///
/// With `δ` the change of a round and `|δ|_Q² = δᵀ Q δ`, a norm of the residual `−∇E = Q δ` at the round's start: near the
/// minimiser the rounds are `δ' = (I − Q⁻¹ ∇²E) δ`, whose matrix is symmetric in the product of `Q`. Where no eigenvalue of
/// it is negative, the contraction `ρ = |δ_k|_Q / |δ_{k−1}|_Q` grows with `k`, and the distance that is left, in that norm, is at
/// least `ρ/(1 − ρ) |δ_k|_Q`: slow components that are still hidden make it larger.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RoundsEnd {
    /// Largest change of a coordinate in the last round, in metres.
    pub change: f64,
    /// `|δ|_Q` of the last round over that of the first; 0 with an accelerated method, which does not know it.
    pub residual: f64,
    /// `ρ/(1 − ρ)` times the change of the last round, in metres; infinite if the last two rounds do not contract. 0 with
    /// an accelerated method or with a single round, which do not know it.
    pub distance: f64,
}

impl RoundsEnd {
    /// Adds a step.
    pub fn add(&mut self, RoundsEnd { change, residual, distance }: RoundsEnd) {
        self.change = self.change.max(change);
        self.residual = self.residual.max(residual);
        self.distance = self.distance.max(distance);
    }
}

/// Counts of steps that ended before their first Newton iteration, although their equation did not hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrozenStatistics {
    /// Their number.
    pub steps: u64,
    /// The number of the first one, from 1; 0 if there is none.
    pub first: u64,
    /// Whether the step that is being taken is one of them.
    pub last: bool,
}

impl FrozenStatistics {
    /// Records the end of a step, counted from 1.
    pub(crate) fn end_step(&mut self, step: u64) {
        if std::mem::take(&mut self.last) {
            self.first = if self.steps == 0 { step } else { self.first };
            self.steps += 1;
        }
    }
}

/// Counts of the steps of error control.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ControlStatistics {
    /// Steps whose estimated error was within the tolerance.
    pub taken: u64,
    /// The most of them in a step of the scene.
    pub max_taken: u64,
    /// Steps that were made again, shorter.
    pub rejected: u64,
}

impl ControlStatistics {
    /// Adds those of a step of the scene.
    pub fn add(&mut self, taken: u64, rejected: u64) {
        self.taken += taken;
        self.max_taken = self.max_taken.max(taken);
        self.rejected += rejected;
    }
}
