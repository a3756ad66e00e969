//! Outcome and measurements of a trial.

use serde::{Deserialize, Serialize};
use simulator::fallback::FallbackStatistics;
use simulator::simulation::FailureKind;
use simulator::solver::LinearError;

use crate::store::bits;

/// Outcome of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
        /// The reason.
        reason: Reason,
        /// The simulator's message.
        message: String,
    },
    /// Reached its end, but the result violates the definition of the method. Never expected, and not stored.
    #[serde(skip)]
    Wrong {
        /// The failed check.
        check: String,
        /// The error, as a multiple of its bound.
        excess: f64,
    },
}

impl Outcome {
    /// Short name.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Survived => "survived",
            Self::BlowUp { .. } => "blow-up",
            Self::Failed { reason, .. } => reason.word(),
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

/// The reason of a failed step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the words say what the variants are")]
pub enum Reason {
    Coincident,
    NotConverged,
    BelowRounding,
    NoDescent,
    Singular,
    LostDigits,
    Unsettled,
    OutOfMemory,
    NotFinite,
    ErrorControl,
}

impl Reason {
    pub(super) fn of(kind: &FailureKind) -> Self {
        match kind {
            FailureKind::Degenerate { .. } => Self::Coincident,
            FailureKind::NotConverged { .. } => Self::NotConverged,
            FailureKind::BelowRounding { .. } | FailureKind::BelowPositions { .. } => {
                Self::BelowRounding
            }
            FailureKind::NoDescent { .. } => Self::NoDescent,
            FailureKind::Linear(
                LinearError::Singular { .. } | LinearError::SingularToPrecision { .. },
            ) => Self::Singular,
            FailureKind::Linear(LinearError::InaccurateSolution { .. }) => Self::LostDigits,
            FailureKind::Linear(LinearError::RefinementStalled { .. }) => Self::Unsettled,
            FailureKind::Linear(LinearError::OutOfMemory { .. }) => Self::OutOfMemory,
            FailureKind::Linear(LinearError::NotFinite { .. })
            | FailureKind::EnergyNotFinite
            | FailureKind::NotFinite { .. } => Self::NotFinite,
            FailureKind::ErrorControl { .. } => Self::ErrorControl,
            FailureKind::Interrupted => unreachable!("trials are not interrupted"),
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Coincident => "coincident",
            Self::NotConverged => "not converged",
            Self::BelowRounding => "below rounding",
            Self::NoDescent => "no descent",
            Self::Singular => "singular",
            Self::LostDigits => "lost digits",
            Self::Unsettled => "unsettled",
            Self::OutOfMemory => "out of memory",
            Self::NotFinite => "not finite",
            Self::ErrorControl => "error control",
        }
    }
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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Steps taken.
    pub steps: u64,
    /// Change of the energy over the run, relative to the case's available energy.
    #[serde(with = "bits")]
    pub energy: f64,
    /// The largest rise of the energy above its start, likewise.
    #[serde(with = "bits")]
    pub energy_rise: f64,
    /// Largest change of momentum not explained by the forces, relative to the largest momentum carried (`Σ m |v|`) or
    /// added; `None` if fixed particles or drag absorb momentum.
    #[serde(with = "bits::optional")]
    pub momentum: Option<f64>,
    /// The largest residual of the method's equation over the checked steps, as a multiple of the bound from rounding
    /// and the method's tolerance; `None` if no step was checked.
    #[serde(with = "bits::optional")]
    pub equation: Option<f64>,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Largest number of Newton iterations in a step.
    pub max_newton_iterations: u64,
    /// Largest accepted residual of a linear system.
    #[serde(with = "bits")]
    pub worst_residual: f64,
    /// Fallbacks used for failed steps.
    #[serde(with = "Fallbacks")]
    pub rescue: FallbackStatistics,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "FallbackStatistics")]
struct Fallbacks {
    line_searched: u64,
    substepped: u64,
    substeps: u64,
    max_substeps: u64,
}
