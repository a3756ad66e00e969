//! The tolerances of a comparison in progress.

use std::sync::Arc;

use scene::trace::State;

use super::calibration::{Bound, Envelope};
use super::{Allowed, Criteria, Tolerances};
use crate::verdict::Quantity;

/// Criteria at the current state.
pub(super) enum Limits {
    /// The same at every state.
    Fixed(Tolerances),
    /// Those of an envelope.
    Calibrated {
        envelope: Arc<Envelope>,
        allowed: Allowed,
        /// The largest coordinate and the largest velocity component of the oracle's states so far.
        sizes: [f64; 2],
    },
}

/// A residual out of tolerance, or a sum of residuals.
pub(super) struct Excess {
    pub(super) residual: f64,
    pub(super) tolerance: f64,
    /// Whether it is the sum.
    pub(super) accumulated: bool,
}

impl Limits {
    pub(super) fn of(criteria: Criteria) -> Self {
        match criteria {
            Criteria::Fixed(tolerances) => Self::Fixed(tolerances),
            Criteria::Calibrated(calibrated) => Self::Calibrated {
                envelope: calibrated.envelope,
                allowed: Allowed::default(),
                sizes: [0.0; 2],
            },
        }
    }

    /// Moves on to a state of the oracle.
    pub(super) fn advance(&mut self, step: u64, expected: &State) {
        let Self::Calibrated { envelope, allowed, sizes } = self else { return };
        for (size, values) in sizes.iter_mut().zip([&expected.positions, &expected.velocities]) {
            *size = values.iter().fold(*size, |size, value| size.max(value.abs()));
        }
        let bounds = envelope.at(step);
        allowed.position = Bound::of(bounds.position, sizes[0]);
        allowed.velocity = Bound::of(bounds.velocity, sizes[1]);
    }

    /// Bounds of positions and velocities; the envelope of fixed tolerances is 0.
    pub(super) fn bounds(&self) -> [Bound; 2] {
        match self {
            Self::Fixed(Tolerances { largest, .. }) => {
                [Bound { envelope: 0.0, tolerance: *largest }; 2]
            }
            Self::Calibrated { allowed, .. } => [allowed.position, allowed.velocity],
        }
    }

    /// Checks the residual of a particle, and the sum of the residuals up to it.
    pub(super) fn check(&mut self, quantity: Quantity, residual: f64, sum: f64) -> Option<Excess> {
        match self {
            Self::Fixed(Tolerances { largest, accumulated }) => {
                if residual >= *largest {
                    Some(Excess { residual, tolerance: *largest, accumulated: false })
                } else if sum >= *accumulated {
                    Some(Excess { residual: sum, tolerance: *accumulated, accumulated: true })
                } else {
                    None
                }
            }
            Self::Calibrated { allowed, .. } => {
                let Bound { tolerance, .. } = match quantity {
                    Quantity::Position => allowed.position,
                    Quantity::Velocity => allowed.velocity,
                };
                if residual > 0.0 {
                    allowed.used = allowed.used.max(residual / tolerance);
                }
                (residual > tolerance).then_some(Excess { residual, tolerance, accumulated: false })
            }
        }
    }

    /// Calibrated tolerances at the last state; `None` where they are fixed.
    pub(super) fn allowed(&self) -> Option<Allowed> {
        match self {
            Self::Fixed(_) => None,
            Self::Calibrated { allowed, .. } => Some(*allowed),
        }
    }
}
