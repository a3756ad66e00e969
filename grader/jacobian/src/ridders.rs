//! Derivatives by extrapolated central differences, each with an uncertainty.
//!
//! Central differences at steps `h, h/2, h/4, …` have an error even in `h`; Neville's scheme extrapolates
//! them to `h = 0`:
//!
//! ```text
//! T(i,0) = (F(x+hᵢ) − F(x−hᵢ)) / 2hᵢ       T(i,j) = T(i,j−1) + (T(i,j−1) − T(i−1,j−1)) / ((hᵢ₋ⱼ/hᵢ)² − 1)
//! ```
//!
//! The entry of the table with the smallest uncertainty is used: twice the larger change to its two neighbours, for
//! truncation, plus the rounding error of `F` (whose bound the caller gives) divided by the step and propagated through
//! the scheme. Steps are powers of two, and only those with exact `x + h` and `x − h` are used. The step is then exact,
//! however far the coordinate is from the origin.
//!
//! If the slopes on the two sides do not approach each other as the step shrinks, `F` has a kink at `x`. Central
//! differences would converge to the mean of the two slopes there. Cost: 16 evaluations for each coordinate.
//! Source: Ridders, *Accurate computation of F'(x) and F'(x)F''(x)*, Advances in Engineering Software 4
//! (1982).

use std::mem;

/// Maximum number of steps.
pub const LEVELS: usize = 8;

/// A measured value with an error bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// The bound.
    pub uncertainty: f64,
}

/// A quantity at one step, with an error that is even in the step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sample {
    /// The step.
    pub step: f64,
    /// The quantity.
    pub value: f64,
    /// Bound of the rounding in `value`.
    pub noise: f64,
}

/// The derivative by differences of one entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Difference {
    /// The derivative.
    Smooth(Estimate),
    /// The slopes on the two sides differ.
    Kink,
    /// Too few steps are exact, or the function is undefined there.
    Unavailable,
}

/// Extrapolates up to eight samples of falling steps to step 0; `None` for fewer than two, or if some are not finite.
///
/// # Panics
/// With more samples.
pub fn extrapolate(samples: &[Sample]) -> Option<Estimate> {
    if samples.len() < 2 || samples.iter().any(|sample| !sample.value.is_finite()) {
        return None;
    }
    let mut best: Option<Estimate> = None;
    // The last row of the scheme: values and bounds on their rounding errors.
    let mut row = [(0.0, 0.0); LEVELS];
    for (i, sample) in samples.iter().enumerate() {
        let mut next = (sample.value, sample.noise);
        for (above, wider) in row[..i].iter_mut().zip(samples[..i].iter().rev()) {
            let ratio = wider.step / sample.step;
            let weight = 1.0 / (ratio * ratio - 1.0);
            let (left, left_noise) = next;
            let (above, above_noise) = mem::replace(above, next);
            let value = left + (left - above) * weight;
            let noise = left_noise * (1.0 + weight) + above_noise * weight;
            let change = (value - left).abs().max((value - above).abs());
            let uncertainty = 2.0 * change + noise;
            if best.is_none_or(|best| uncertainty < best.uncertainty) {
                best = Some(Estimate { value, uncertainty });
            }
            next = (value, noise);
        }
        row[i] = next;
    }
    best
}

/// A function of some coordinates: fills a vector, and returns whether it is defined there.
pub type Function<'a> = &'a mut dyn FnMut(&[f64], &mut [f64]) -> bool;

/// The coordinate on both sides of a step, if the step can be taken: [`exact_steps`] or [`rounded_steps`].
pub type Sides = fn(f64, f64) -> Option<(f64, f64)>;

/// Steps of differences: each is half the one before.
#[derive(Debug, Clone, Copy)]
pub struct Ladder {
    /// The first step, well below the distance to the nearest non-smooth point; a power of two for [`exact_steps`].
    pub first: f64,
    /// Number of steps, at most [`LEVELS`].
    pub levels: usize,
    /// How a step is taken.
    pub sides: Sides,
}

impl Ladder {
    /// All exact steps from `first` on.
    pub fn exact(first: f64) -> Self {
        Self { first, levels: LEVELS, sides: exact_steps }
    }

    /// All rounded steps from `first` on.
    pub fn rounded(first: f64) -> Self {
        Self { first, levels: LEVELS, sides: rounded_steps }
    }
}

/// The derivatives of every component of `function` by coordinate `column` of `x`.
///
/// `function` fills a vector of `noise.len()` components. `noise` bounds the rounding error of each component.
pub fn differentiate(
    function: Function<'_>,
    x: &[f64],
    column: usize,
    ladder: Ladder,
    noise: &[f64],
) -> Vec<Difference> {
    let size = noise.len();
    let mut moved = x.to_vec();
    let (mut above, mut here, mut below) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
    // Of each row, the samples of the steps taken, and the jumps of the slope.
    let mut samples = vec![[Sample::default(); LEVELS]; size];
    let mut jumps = vec![[0.0; LEVELS]; size];
    let mut taken = 0;
    if !function(&moved, &mut here) {
        return vec![Difference::Unavailable; size];
    }
    let mut step = ladder.first;
    for _ in 0..ladder.levels {
        if let Some((up, down)) = (ladder.sides)(x[column], step) {
            let width = up - down;
            moved[column] = up;
            let defined_above = function(&moved, &mut above);
            moved[column] = down;
            if defined_above && function(&moved, &mut below) {
                for row in 0..size {
                    let value = (above[row] - below[row]) / width;
                    let step = 0.5 * width;
                    samples[row][taken] = Sample { step, value, noise: noise[row] / step };
                    jumps[row][taken] = (above[row] - 2.0 * here[row] + below[row]) / step;
                }
                taken += 1;
            }
        }
        step *= 0.5;
    }
    let rows = samples.iter().zip(&jumps).zip(noise);
    rows.map(|((samples, jumps), noise)| match extrapolate(&samples[..taken]) {
        _ if is_kink(&samples[..taken], &jumps[..taken], *noise) => Difference::Kink,
        Some(estimate) => Difference::Smooth(estimate),
        None => Difference::Unavailable,
    })
    .collect()
}

/// `x + step` and `x − step` if both are exact.
pub fn exact_steps(x: f64, step: f64) -> Option<(f64, f64)> {
    let (up, down) = (x + step, x - step);
    // If the sum loses digits of x, the step back does not return to x.
    (up - step == x && up - x == step && down + step == x && x - down == step).then_some((up, down))
}

/// `x + step` and `x − step`, rounded: for coordinates without spare digits. Their distances to `x` may then differ by a
/// rounding error of the coordinate, which `noise` must include.
pub fn rounded_steps(x: f64, step: f64) -> Option<(f64, f64)> {
    Some((x + step, x - step))
}

/// Whether the slopes on the two sides differ. Their jump over a step `h` is `κ + ah + bh³ + O(h⁵)`, with `κ = 0` for
/// a smooth `F`. After elimination of the second and third term, the jump of a kink stays above rounding; that of a
/// smooth function falls.
fn is_kink(samples: &[Sample], jumps: &[f64], noise: f64) -> bool {
    let [.., farthest, far, near, nearest] = jumps else { return false };
    let without_second = |wide: f64, narrow: f64| 2.0 * narrow - wide;
    let without_third = |wide: f64, narrow: f64| (8.0 * narrow - wide) / 7.0;
    let [wide, middle, narrow] = [
        without_second(*farthest, *far),
        without_second(*far, *near),
        without_second(*near, *nearest),
    ];
    let (early, late) = (without_third(wide, middle), without_third(middle, narrow));
    let smallest = samples.last().map_or(0.0, |sample| sample.step);
    late.abs() > 64.0 * noise / smallest && late.abs() > 0.5 * early.abs()
}

/// The largest power of two that is at most `scale`, which must be positive.
pub fn power_of_two(scale: f64) -> f64 {
    2.0_f64.powi(scale.log2().floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn derivative(function: impl Fn(f64) -> f64, x: f64, first: f64, noise: f64) -> Difference {
        let evaluate = |x: &[f64], values: &mut [f64]| {
            values[0] = function(x[0]);
            values[0].is_finite()
        };
        differentiate(&mut { evaluate }, &[x], 0, Ladder::exact(first), &[noise])[0]
    }

    #[test]
    fn the_error_is_within_the_uncertainty_and_the_uncertainty_is_small() {
        type Case = (&'static str, fn(f64) -> f64, fn(f64) -> f64);
        let cases: [Case; 5] = [
            ("sine", f64::sin, f64::cos),
            ("exponential", f64::exp, f64::exp),
            ("inverse square", |x| 1.0 / (x * x), |x| -2.0 / (x * x * x)),
            ("root", f64::sqrt, |x| 0.5 / x.sqrt()),
            ("cube", |x| x * x * x, |x| 3.0 * x * x),
        ];
        for (name, function, exact) in cases {
            for x in [0.5, 0.75, 1.25, 2.375, 3.0625] {
                let noise = 4.0 * f64::EPSILON * function(x).abs().max(1.0);
                let first = power_of_two(x / 4.0);
                let Difference::Smooth(estimate) = derivative(function, x, first, noise) else {
                    panic!("{name} at {x}");
                };
                let error = (estimate.value - exact(x)).abs();
                let size = exact(x).abs().max(1.0);
                assert!(error <= estimate.uncertainty, "{name} at {x}: {error:e} {estimate:?}");
                assert!(estimate.uncertainty < 1e-11 * size, "{name} at {x}: {estimate:?}");
            }
        }
    }

    #[test]
    fn a_linear_function_is_exact_and_a_constant_has_no_slope() {
        let noise = f64::EPSILON;
        let Difference::Smooth(line) = derivative(|x| 3.0 * x, 1.5, 1.0, noise) else { panic!() };
        assert_eq!(line.value, 3.0);
        assert!(line.uncertainty < 4.0 * f64::EPSILON);
        let Difference::Smooth(flat) = derivative(|_| 7.0, 1.5, 1.0, noise) else { panic!() };
        assert_eq!(flat.value, 0.0);
    }

    #[test]
    fn kink_is_distinguished_from_curvature() {
        let noise = 4.0 * f64::EPSILON;
        assert_eq!(derivative(|x| (x - 1.0).max(0.0), 1.0, 0.25, noise), Difference::Kink);
        assert_eq!(derivative(|x| (x - 1.0).abs() + x * x, 1.0, 0.25, noise), Difference::Kink);
        // With a kink near the point but within the first steps, the smaller steps still work.
        let Difference::Smooth(beside) = derivative(|x| (x - 1.125).max(0.0), 1.0, 0.25, noise)
        else {
            panic!()
        };
        assert!(beside.value.abs() <= beside.uncertainty && beside.uncertainty < 1e-12);
        assert!(matches!(derivative(|x| x.powi(8), 1.0, 0.25, noise), Difference::Smooth(_)));
    }

    #[test]
    fn inexact_difference_steps_are_rejected() {
        // At 1e8 + 1/8 the steps are multiples of 2⁻²⁶.
        assert!(exact_steps(1e8 + 0.125, 2.0_f64.powi(-26)).is_some());
        assert!(exact_steps(1e8 + 0.125, 2.0_f64.powi(-27)).is_none());
        // A full mantissa loses its last digit when 1 is added.
        assert!(exact_steps(0.1, 1.0).is_none());
        assert_eq!(derivative(|x| x, 1e17, 1.0, 1.0), Difference::Unavailable);
        assert_eq!(derivative(|_| f64::NAN, 1.0, 1.0, 1.0), Difference::Unavailable);
    }
}
