//! How far to trust a number that a program wrote.
//!
//! Nothing is known of how a program computes: double or single precision, one order of summation or
//! another, fast-math, conjugate gradients to some tolerance. So its noise is measured. Along a straight
//! line of nine states 2⁻¹³ apart, a smooth force has sixth differences far below rounding; what they show is
//! noise,
//!
//! ```text
//! σ² = (6!)²/12! · mean (Δ⁶F)²       J. J. Moré, S. M. Wild, Estimating Computational Noise, 2011
//! ```
//!
//! and it is never taken to be less than the rounding of the velocities from which the force is read,
//! `4 ε max|v'|`. From there each bound follows:
//!
//! ```text
//! force against ours          FORCE σ                  and 64 ε of the largest force
//! differences of the force    |extrapolation error| + DIFFERENCE σ Σ|weights|         (differences.rs)
//! matrix of the steps         MATRIX s √(ΔᵀΔ)⁻¹_cc     s: residual of the least squares (identify.rs)
//! steps that no matrix fits   CLEAR times what the same steps differ by beside fewer particles
//! ```
//!
//! A number within its bound of another agrees with it. It is called different only beyond [`CLEAR`] times
//! the bound: between the two is no verdict. For normally distributed noise a bound is missed once in 10⁹
//! or less, and the clear factor is for noise that is not: a solver's error that goes the same way each time.

use simulator::scene::Dimension;

use super::scenes::{State, chain};

/// Beyond this many times its bound, a difference is no noise.
pub(super) const CLEAR: f64 = 10.0;

/// Multiples of `σ` in the bound of a force.
pub(super) const FORCE: f64 = 16.0;

/// Multiples of `σ` in the bound of a difference.
pub(super) const DIFFERENCE: f64 = 6.0;

/// Multiples of the standard error in the bound of an entry of the steps' matrix.
pub(super) const MATRIX: f64 = 8.0;

/// Units of rounding of the largest velocity that are the least noise there is.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Units of rounding by which two right ways to write a force may differ, of the largest force.
pub(super) const FORMULA: f64 = 64.0 * f64::EPSILON;

/// A bound above this, relative to what it bounds, tells nothing.
pub(super) const TOO_WIDE: f64 = 1e-3;

/// Distance of the states of a line; a power of two.
const SPACING: f64 = 1.0 / 8192.0;

/// States of a line.
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
    fn the_noise_of_single_precision_is_seen_in_a_smooth_function() {
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
