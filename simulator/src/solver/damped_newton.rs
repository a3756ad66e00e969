//! Newton's method with a line search on the residual, for problems where the plain method diverges.
//!
//! ```text
//! φ(x) = ½ ‖r(x)‖²_W        A δ = r(x),  A = −∂r/∂x        φ'(x) δ = −2 φ(x)
//! α ← 1        while φ(x + α δ) > (1 − 2 c α) φ(x):  α ← α/2            c = 1e-4
//! x ← x + α δ
//! ```
//!
//! Every step makes the residual smaller, so that the iteration cannot run in circles or away. It ends as the
//! plain method does, when a whole step (α = 1) is below the tolerance, at a solution of the same equations. It
//! may stop at a minimum of `φ` that is not a solution, which is an error. Cost: an evaluation of `r` a halving beside those of
//! [`newton`](super::newton). Source: Dennis and Schnabel, Numerical Methods for Unconstrained Optimization and
//! Nonlinear Equations, section 6.3.

use super::newton::{NewtonError, NewtonOptions};

/// The part of the decrease that the linearisation promises, which a step must bring: `c`.
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Fails after this many halvings.
const MAX_HALVINGS: u32 = 40;

/// Equations `r(x) = 0`.
pub trait Equations {
    /// What can go wrong.
    type Error;

    /// Overwrites `delta` by Newton's step at `x`.
    ///
    /// # Errors
    /// If it cannot be computed.
    fn update(&mut self, x: &[f64], delta: &mut [f64]) -> Result<(), Self::Error>;

    /// `φ(x)`; infinite where the equations are not defined.
    fn merit(&mut self, x: &[f64]) -> f64;
}

/// Iterates on `unknown`, with `delta` and `trial` of its length as room. Returns the iterations and the halvings.
///
/// # Errors
/// Where no step makes the residual smaller, where there are too many, or where an update cannot be computed.
pub fn damped_newton<E: Equations>(
    unknown: &mut [f64],
    delta: &mut [f64],
    trial: &mut [f64],
    options: NewtonOptions,
    equations: &mut E,
) -> Result<(u64, u64), NewtonError<E::Error>> {
    let (mut halvings, mut norm) = (0, f64::INFINITY);
    for iteration in 1..=options.max_iterations {
        equations.update(unknown, delta).map_err(NewtonError::Update)?;
        norm = delta.iter().map(|value| value * value).sum::<f64>().sqrt();
        let not_converged = NewtonError::NotConverged { iterations: iteration, update: norm };
        if !norm.is_finite() {
            return Err(not_converged);
        }
        if norm < options.tolerance {
            for (value, change) in unknown.iter_mut().zip(&*delta) {
                *value += change;
            }
            return Ok((iteration, halvings));
        }
        let start = equations.merit(unknown);
        let mut alpha = 1.0;
        let mut tries = 0;
        loop {
            for ((trial, value), change) in trial.iter_mut().zip(&*unknown).zip(&*delta) {
                *trial = value + alpha * change;
            }
            // A NaN is never smaller.
            if equations.merit(trial) <= (1.0 - 2.0 * SUFFICIENT_DECREASE * alpha) * start {
                break;
            }
            if tries == MAX_HALVINGS {
                return Err(not_converged);
            }
            tries += 1;
            halvings += 1;
            alpha *= 0.5;
        }
        unknown.copy_from_slice(trial);
    }
    Err(NewtonError::NotConverged { iterations: options.max_iterations, update: norm })
}

#[cfg(test)]
mod tests {
    use super::super::newton::newton;
    use super::*;

    const OPTIONS: NewtonOptions = NewtonOptions { tolerance: 1e-9, max_iterations: 50 };

    /// `−atan(x) = 0`, from whose starts beyond 1.39 plain Newton runs away.
    struct Arctangent;

    impl Equations for Arctangent {
        type Error = ();

        fn update(&mut self, x: &[f64], delta: &mut [f64]) -> Result<(), ()> {
            delta[0] = -x[0].atan() * (1.0 + x[0] * x[0]);
            Ok(())
        }

        fn merit(&mut self, x: &[f64]) -> f64 {
            0.5 * x[0].atan().powi(2)
        }
    }

    #[test]
    fn gets_there_where_the_plain_method_overshoots() {
        let plain = newton(&mut [3.0], &mut [0.0], OPTIONS, |x, delta| Arctangent.update(x, delta));
        assert!(plain.is_err(), "{plain:?}");
        let mut x = [3.0];
        let (_, halvings) =
            damped_newton(&mut x, &mut [0.0], &mut [0.0], OPTIONS, &mut Arctangent).unwrap();
        assert!(x[0].abs() < 1e-15 && halvings > 0, "{x:?} after {halvings} halvings");
    }

    /// `1 + x² = 0`, which has no solution.
    struct NoRoot;

    impl Equations for NoRoot {
        type Error = ();

        fn update(&mut self, x: &[f64], delta: &mut [f64]) -> Result<(), ()> {
            delta[0] = -(1.0 + x[0] * x[0]) / (2.0 * x[0]);
            Ok(())
        }

        fn merit(&mut self, x: &[f64]) -> f64 {
            0.5 * (1.0 + x[0] * x[0]).powi(2)
        }
    }

    #[test]
    fn says_where_there_is_no_solution() {
        let result = damped_newton(&mut [1.5], &mut [0.0], &mut [0.0], OPTIONS, &mut NoRoot);
        assert!(matches!(result, Err(NewtonError::NotConverged { .. })), "{result:?}");
    }
}
