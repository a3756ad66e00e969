//! What became of a trial, and what was measured on the way.

use simulator::fallback::FallbackStatistics;
use simulator::simulation::FailureKind;
use simulator::solver::LinearError;

/// How a trial ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It reached its end; its energy stayed in bounds, and every check held.
    Survived,
    /// All numbers are finite, and the energy is beyond [`BOUND`](super::trial::BOUND).
    BlowUp {
        /// The step after which it is.
        step: u64,
    },
    /// A step had no answer.
    Failed {
        /// That step, from 1.
        step: u64,
        /// Why, in a word or two.
        reason: &'static str,
        /// Why, as the simulator says it.
        message: String,
    },
    /// It reached its end, and what it gave is not what the method is defined to give. Never expected.
    Wrong {
        /// The check that did not hold.
        check: &'static str,
        /// What was found, as a multiple of what is allowed.
        excess: f64,
    },
}

impl Outcome {
    /// In a word or two; what is stored.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Survived => "survived",
            Self::BlowUp { .. } => "blow-up",
            Self::Failed { reason, .. } => reason,
            Self::Wrong { .. } => "WRONG",
        }
    }

    /// The step in which it ended early.
    pub fn step(&self) -> Option<u64> {
        match self {
            Self::BlowUp { step } | Self::Failed { step, .. } => Some(*step),
            Self::Survived | Self::Wrong { .. } => None,
        }
    }

    /// Why it ended early, or what is wrong, as a sentence; empty where it survived.
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

    /// Whether a silent error was found.
    pub fn is_wrong(&self) -> bool {
        matches!(self, Self::Wrong { .. })
    }
}

/// Every reason for which a step fails, as it is stored.
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
];

/// A failure in a word or two, of [`REASONS`].
pub(super) fn reason(kind: &FailureKind) -> &'static str {
    let place = match kind {
        FailureKind::Coincident { .. } => 0,
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
    };
    REASONS[place]
}

/// A case under a method at a time step.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The case's name.
    pub case: &'static str,
    /// The method's name.
    pub method: &'static str,
    /// Time step, in seconds.
    pub time_step: f64,
    /// Steps asked for.
    pub steps: u64,
    /// Whether failed steps were tried again.
    pub robust: bool,
    /// What became of it.
    pub outcome: Outcome,
    /// What was measured.
    pub measured: Measured,
    /// How long it took, checks included, in seconds.
    pub seconds: f64,
}

/// What was measured up to the end, or up to the last state there is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measured {
    /// Steps taken.
    pub steps: u64,
    /// Change of the energy over the run, relative to what the case has at hand.
    pub energy: f64,
    /// The largest rise of the energy above its start, the same.
    pub energy_rise: f64,
    /// Largest change of momentum that the forces do not account for, relative to the most that was carried, `Σ m |v|`,
    /// or given; `None` where fixed particles or drag take up momentum.
    pub momentum: Option<f64>,
    /// The largest residual of the method's equation over the steps that were checked, as a multiple of what rounding
    /// and the method's own tolerance allow; `None` where no step was.
    pub equation: Option<f64>,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// The most in a step.
    pub max_newton_iterations: u64,
    /// Largest accepted residual of a linear system.
    pub worst_residual: f64,
    /// What was done for steps that had no answer.
    pub rescue: FallbackStatistics,
}
