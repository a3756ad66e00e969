//! Outcome and measurements of a trial.

use simulator::fallback::FallbackStatistics;
use simulator::simulation::FailureKind;
use simulator::solver::LinearError;

/// Outcome of a trial.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Reached its end, with bounded energy and all checks passed.
    Survived,
    /// All numbers are finite, but the energy exceeds [`BOUND`](super::trial::BOUND).
    BlowUp {
        /// The step after which it does.
        step: u64,
    },
    /// A step failed.
    Failed {
        /// The step, from 1.
        step: u64,
        /// The reason, in a word or two.
        reason: &'static str,
        /// The simulator's message.
        message: String,
    },
    /// Reached its end, but the result violates the definition of the method. Never expected.
    Wrong {
        /// The failed check.
        check: &'static str,
        /// The error, as a multiple of its bound.
        excess: f64,
    },
}

impl Outcome {
    /// Short name, as stored.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Survived => "survived",
            Self::BlowUp { .. } => "blow-up",
            Self::Failed { reason, .. } => reason,
            Self::Wrong { .. } => "WRONG",
        }
    }

    /// The step at which it ended early.
    pub fn step(&self) -> Option<u64> {
        match self {
            Self::BlowUp { step } | Self::Failed { step, .. } => Some(*step),
            Self::Survived | Self::Wrong { .. } => None,
        }
    }

    /// A sentence with the reason of a failure; empty if it survived.
    pub fn message(&self) -> String {
        match self {
            Self::Survived => String::new(),
            Self::BlowUp { step } => format!("the energy is out of bounds after step {step}"),
            Self::Failed { message, .. } => message.clone(),
            Self::Wrong { check, excess } => {
                format!("{check}: {excess:.1e} times what is allowed")
            }
        }
    }

    /// Whether the result is silently wrong.
    pub fn is_wrong(&self) -> bool {
        matches!(self, Self::Wrong { .. })
    }
}

/// All reasons for failed steps, as stored.
pub const REASONS: &[&str] = &[
    "coincident",
    "not converged",
    "below rounding",
    "no descent",
    "singular",
    "lost digits",
    "unsettled",
    "out of memory",
    "not finite",
    "error control",
];

/// The reason of a failure, one of [`REASONS`].
pub(super) fn reason(kind: &FailureKind) -> &'static str {
    let place = match kind {
        FailureKind::Degenerate { .. } => 0,
        FailureKind::NotConverged { .. } => 1,
        FailureKind::BelowRounding { .. } => 2,
        FailureKind::NoDescent { .. } => 3,
        FailureKind::Linear(
            LinearError::Singular { .. } | LinearError::SingularToPrecision { .. },
        ) => 4,
        FailureKind::Linear(LinearError::InaccurateSolution { .. }) => 5,
        FailureKind::Linear(LinearError::RefinementStalled { .. }) => 6,
        FailureKind::Linear(LinearError::OutOfMemory { .. }) => 7,
        FailureKind::Linear(LinearError::NotFinite { .. })
        | FailureKind::EnergyNotFinite
        | FailureKind::NotFinite { .. } => 8,
        FailureKind::ErrorControl { .. } => 9,
        FailureKind::Interrupted => unreachable!("trials are not interrupted"),
    };
    REASONS[place]
}

/// A case run with a method and a time step.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The case's name.
    pub case: &'static str,
    /// The method's name.
    pub method: &'static str,
    /// Time step, in seconds.
    pub time_step: f64,
    /// Requested number of steps.
    pub steps: u64,
    /// Whether fallbacks for failed steps were on.
    pub robust: bool,
    /// Its outcome.
    pub outcome: Outcome,
    /// Its measurements.
    pub measured: Measured,
    /// Time of the trial including checks, in seconds.
    pub seconds: f64,
}

/// Measurements up to the last state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measured {
    /// Steps taken.
    pub steps: u64,
    /// Change of the energy over the run, relative to the case's available energy.
    pub energy: f64,
    /// The largest rise of the energy above its start, likewise.
    pub energy_rise: f64,
    /// Largest change of momentum not explained by the forces, relative to the largest momentum carried (`Σ m |v|`) or
    /// added; `None` if fixed particles or drag absorb momentum.
    pub momentum: Option<f64>,
    /// The largest residual of the method's equation over the checked steps, as a multiple of the bound from rounding
    /// and the method's tolerance; `None` if no step was checked.
    pub equation: Option<f64>,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Largest number of Newton iterations in a step.
    pub max_newton_iterations: u64,
    /// Largest accepted residual of a linear system.
    pub worst_residual: f64,
    /// Fallbacks used for failed steps.
    pub rescue: FallbackStatistics,
}
