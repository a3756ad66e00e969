//! Accepted differences between correct programs.
//!
//! ```text
//! tolerance = F (envelope + 4 ε size)        F = 10, ε = 2⁻⁵²
//! ```

/// `F`: ratio of the tolerance to the envelope.
pub const FACTOR: f64 = 10.0;

/// Rounding error of a coordinate, relative to its size.
const FLOOR: f64 = 4.0 * f64::EPSILON;

/// An envelope and the resulting tolerance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bound {
    /// Largest difference between variants.
    pub envelope: f64,
    /// Largest accepted difference of a program.
    pub tolerance: f64,
}

impl Bound {
    /// The tolerance for a quantity of this size.
    pub fn of(envelope: f64, size: f64) -> Self {
        Self { envelope, tolerance: FACTOR * (envelope + FLOOR * size) }
    }
}
