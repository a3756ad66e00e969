//! Backtracking line searches, on an objective and on a residual.
//!
//! [`backtrack`] halves a step until the objective does not increase:
//!
//! ```text
//! α ← 1        while E(x + α p) > E(x):  α ← α/2
//! ```
//!
//! The lecture's algorithm 2. Near a minimum, the decrease of `E` is smaller than its rounding error,
//! and the comparison means nothing (the lecture's loop would then never end). There the slope decides,
//! which keeps its digits: a step is taken if `|E'(x + α p)·p| ≤ |E'(x)·p|` (Hager and Zhang 2005).

/// Fails after this many halvings.
const MAX_HALVINGS: u32 = 50;

/// Differences of the objective below this part of its terms may be rounding.
const ROUNDING: f64 = 1e-11;

/// The objective along the direction.
pub trait Objective {
    /// Errors of an evaluation.
    type Error;

    /// `E(x + α p)`, and the size of the terms it is the sum of.
    fn value(&mut self, alpha: f64) -> (f64, f64);

    /// `E'(x + α p)·p`.
    ///
    /// # Errors
    /// If the slope cannot be computed.
    fn slope(&mut self, alpha: f64) -> Result<f64, Self::Error>;
}

/// Searches from `E(x)`, which is `start`; returns `α` and the number of halvings, or `None` if no step
/// makes the objective smaller: the direction does not descend.
///
/// # Errors
/// If the objective's slope cannot be computed.
pub fn backtrack<O: Objective>(
    objective: &mut O,
    start: f64,
) -> Result<Option<(f64, u32)>, O::Error> {
    let mut alpha = 1.0;
    let mut first_slope = None;
    for halvings in 0..=MAX_HALVINGS {
        let (value, size) = objective.value(alpha);
        if value <= start {
            return Ok(Some((alpha, halvings)));
        }
        if value - start <= ROUNDING * size {
            let first = match first_slope {
                Some(slope) => slope,
                None => *first_slope.insert(objective.slope(0.0)?),
            };
            if first < 0.0 && objective.slope(alpha)?.abs() <= first.abs() {
                return Ok(Some((alpha, halvings)));
            }
        }
        alpha *= 0.5;
    }
    Ok(None)
}

/// The part of the decrease that the linearisation promises, which a step must bring: `c`.
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Fails after this many halvings of a step on a residual.
const MAX_RESIDUAL_HALVINGS: u32 = 40;

/// Moves `x` along Newton's step `delta` as far as the merit of the residual decreases enough:
///
/// ```text
/// φ(x) = ½ ‖r(x)‖²_W        A δ = r(x),  A = −∂r/∂x        φ'(x) δ = −2 φ(x)
/// α ← 1        while φ(x + α δ) > (1 − 2 c α) φ(x):  α ← α/2            c = 1e-4
/// x ← x + α δ
/// ```
///
/// Every step decreases the residual, so that Newton's method cannot cycle or diverge. It may stop at a minimum of `φ`
/// that is not a solution. `trial` is a workspace; `φ` is infinite where `r` is not defined. Returns the number of
/// halvings, or `None` if no step decreases `φ`. Source: Dennis and Schnabel, Numerical Methods for Unconstrained
/// Optimization and Nonlinear Equations, section 6.3.
pub fn backtrack_residual(
    x: &mut [f64],
    delta: &[f64],
    trial: &mut [f64],
    mut merit: impl FnMut(&[f64]) -> f64,
) -> Option<u64> {
    let start = merit(x);
    let mut alpha = 1.0;
    for halvings in 0..=MAX_RESIDUAL_HALVINGS {
        for ((trial, value), change) in trial.iter_mut().zip(&*x).zip(delta) {
            *trial = value + alpha * change;
        }
        // A NaN is never smaller.
        if merit(trial) <= (1.0 - 2.0 * SUFFICIENT_DECREASE * alpha) * start {
            x.copy_from_slice(trial);
            return Some(u64::from(halvings));
        }
        alpha *= 0.5;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(x + α p − 1)² + offset` of one unknown.
    struct Parabola {
        x: f64,
        p: f64,
        offset: f64,
        slopes: u32,
    }

    impl Objective for Parabola {
        type Error = ();

        fn value(&mut self, alpha: f64) -> (f64, f64) {
            let value = (self.x + alpha * self.p - 1.0).powi(2) + self.offset;
            (value, value.abs())
        }

        fn slope(&mut self, alpha: f64) -> Result<f64, ()> {
            self.slopes += 1;
            Ok(2.0 * (self.x + alpha * self.p - 1.0) * self.p)
        }
    }

    fn search(mut objective: Parabola) -> (Option<(f64, u32)>, u32) {
        let (start, _) = objective.value(0.0);
        (backtrack(&mut objective, start).unwrap(), objective.slopes)
    }

    #[test]
    fn a_step_that_descends_is_taken_whole() {
        let objective = Parabola { x: 0.0, p: 1.0, offset: 0.0, slopes: 0 };
        assert_eq!(search(objective), (Some((1.0, 0)), 0));
    }

    #[test]
    fn a_step_that_overshoots_is_halved_until_it_does_not() {
        // From 0, steps of 9, 4.5 and 2.25 land further from 1 than 0 is.
        let objective = Parabola { x: 0.0, p: 9.0, offset: 0.0, slopes: 0 };
        assert_eq!(search(objective), (Some((0.125, 3)), 0));
    }

    #[test]
    fn slope_decides_if_values_differ_by_rounding() {
        // 1e16 swallows the parabola, and the step overshoots the minimum by a little.
        let offset = 1e16;
        let mut objective = Parabola { x: 0.0, p: 1.5, offset, slopes: 0 };
        let (start, _) = objective.value(0.0);
        // The start, as rounding might leave it: just below every other value.
        let found = backtrack(&mut objective, start - 2.0).unwrap();
        assert_eq!((found, objective.slopes), (Some((1.0, 0)), 2));
    }

    #[test]
    fn ascent_direction_is_reported() {
        let objective = Parabola { x: 0.0, p: -1.0, offset: 0.0, slopes: 0 };
        assert_eq!(search(objective).0, None);
    }
}
