//! Amplification, numerical damping and period error of an oscillation in one step.
//!
//! Compares the leading eigenvalue `λ` of the measured matrix with the oscillator's exact `e^{h ω (−ζ + i√(1−ζ²))}`:
//!
//! ```text
//! numerical damping ratio   −ln|λ| / |ln λ| − ζ       what the method adds; negative where it drives
//! period error              ω h √(1−ζ²) / arg λ − 1    positive where it is slow
//! ```

use simulator::integrator::REGISTRY;

use super::leading;
use super::measured::Linear;
use ::reference::method::Method;

/// One method at one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplification {
    /// The method.
    pub method: &'static str,
    /// `h ω`.
    pub a: f64,
    /// Damping ratio of the oscillator.
    pub zeta: f64,
    /// `|λ|` as measured.
    pub measured: f64,
    /// `|λ|` of the method's matrix.
    pub theory: f64,
    /// Bound of the rounding errors of the two: `4 ε^(1/m)` times the largest entry of the method's matrix, at least 1.
    /// That of an eigenvalue that occurs `m` times is the m-th root of its matrix's; `m` is at most the number of rows.
    pub rounding: f64,
    /// `|λ|` of the exact solution.
    pub exact: f64,
    /// Numerical damping ratio; `None` if the motion does not oscillate.
    pub damping: Option<f64>,
    /// Relative error of the period; likewise.
    pub period: Option<f64>,
}

/// All methods at the steps and damping ratios of the table.
pub fn amplifications() -> Vec<Amplification> {
    let mut all = Vec::new();
    for kind in REGISTRY {
        for zeta in [0.0, 0.1, 1.0] {
            let scene = Linear::oscillator(zeta);
            if !scene.is_taken_by(&kind.schema) {
                continue;
            }
            for a in [0.01, 0.1, 0.5, 1.0, 1.9, 10.0] {
                let Some(matrix) = scene.matrix(&kind.schema, a) else { continue };
                let value = leading(&matrix);
                let theory = Method::of(kind.schema.equation).oscillator(a, zeta);
                let multiplicity = theory.nrows() as f64;
                let turn = (1.0 - zeta * zeta).max(0.0).sqrt();
                let oscillates = turn > 0.0 && value.im > 0.0;
                let logarithm = value.ln();
                all.push(Amplification {
                    method: kind.schema.name,
                    a,
                    zeta,
                    measured: value.norm(),
                    theory: leading(&theory).norm(),
                    rounding: 4.0 * f64::EPSILON.powf(1.0 / multiplicity) * theory.amax().max(1.0),
                    exact: (-a * zeta).exp(),
                    damping: oscillates.then(|| -logarithm.re / logarithm.norm() - zeta),
                    period: oscillates.then(|| a * turn / value.arg() - 1.0),
                });
            }
        }
    }
    all
}
