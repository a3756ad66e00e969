//! Noise of a program's numbers, and the error bounds that follow from it.
//!
//! A program may compute in double or single precision, sum in any order, use fast-math, or solve by conjugate
//! gradients to some tolerance. Its noise is therefore measured. Along a straight line of nine states at distances of
//! 2⁻¹³, the sixth differences of a smooth force are far below rounding. Measured sixth differences are noise,
//!
//! ```text
//! σ² = (6!)²/12! · mean (Δ⁶F)²       J. J. Moré, S. M. Wild, Estimating Computational Noise, 2011
//! ```
//!
//! and the noise is at least the rounding error of the velocities that yield the force, `4 ε max|v'|`. The bounds are:
//!
//! ```text
//! force against ours          FORCE σ                  and 64 ε of the largest force
//! differences of the force    |extrapolation error| + DIFFERENCE σ Σ|weights|         (differences.rs)
//! matrix of the steps         MATRIX s √(ΔᵀΔ)⁻¹_cc     s: residual of the least squares (identify.rs)
//! steps that no matrix fits   CLEAR times the change of the same steps with fewer particles
//! ```
//!
//! Two numbers agree within the bound, and differ beyond [`CLEAR`] times the bound; in between there is no verdict. For
//! normally distributed noise a correct number exceeds the bound once in 10⁹ cases or less. The factor `CLEAR` allows
//! for other noise, such as a solver's error that always has the same sign.

use scene::Dimension;

use super::scenes::{State, chain};

/// A difference beyond this many bounds is not noise.
pub(super) const CLEAR: f64 = 10.0;

/// Multiples of `σ` in the bound of a force.
pub(super) const FORCE: f64 = 16.0;

/// Multiples of `σ` in the bound of a difference.
pub(super) const DIFFERENCE: f64 = 6.0;

/// Multiples of the standard error in the bound of an entry of the steps' matrix.
pub(super) const MATRIX: f64 = 8.0;

/// Minimum noise: rounding errors relative to the largest velocity.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Relative difference between two correct formulas of a force, in terms of the largest force.
pub(super) const FORMULA: f64 = 64.0 * f64::EPSILON;

/// A relative bound above this is too wide for a verdict.
pub(super) const TOO_WIDE: f64 = 1e-3;

/// Distance between the states of a line; a power of two.
const SPACING: f64 = 1.0 / 8192.0;

/// Number of states of a line.
pub(super) const LINE: usize = 9;

/// 12! / (6!)².
const SCALE: f64 = 924.0;

/// A line of states around `state`, in a direction that changes every coordinate.
pub(super) fn line(state: &State, dimension: Dimension) -> Vec<State> {
    let size = chain(dimension) * dimension.count();
    let sign =
        |index: usize| if (index * index + index / 3).is_multiple_of(2) { 1.0 } else { -1.0 };
    let moved = |values: &[f64], shift: f64, first: usize| -> Vec<f64> {
        let coordinates = values.iter().enumerate();
        coordinates.map(|(index, value)| value + shift * sign(first + index)).collect()
    };
    let states = (0..LINE).map(|number| {
        let shift = (number as f64 - (LINE / 2) as f64) * SPACING;
        State {
            positions: moved(&state.positions, shift, 0),
            velocities: moved(&state.velocities, shift, size),
        }
    });
    states.collect()
}

/// Mean square of the noise of forces along a line of states.
pub(super) fn variance(forces: &[Vec<f64>]) -> f64 {
    const BINOMIAL: [f64; 7] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    let components = forces.first().map_or(0, Vec::len);
    let mut sum = 0.0;
    let mut count = 0.0;
    for window in forces.windows(BINOMIAL.len()) {
        for component in 0..components {
            let terms = BINOMIAL.iter().zip(window);
            let difference: f64 = terms.map(|(weight, force)| weight * force[component]).sum();
            sum += difference * difference / SCALE;
            count += 1.0;
        }
    }
    if count == 0.0 { 0.0 } else { sum / count }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_noise_is_detected() {
        let samples = |round: fn(f64) -> f64| -> Vec<Vec<f64>> {
            let smooth = |i: usize| (1.25 + i as f64 * SPACING).powi(-2);
            (0..LINE).map(|i| vec![round(smooth(i))]).collect()
        };
        let noise = variance(&samples(|x| f64::from(x as f32))).sqrt();
        assert!((3e-9..1e-7).contains(&noise), "{noise:e}");
        let noise = variance(&samples(|x| x)).sqrt();
        assert!(noise < 1e-15, "{noise:e}");
    }
}
