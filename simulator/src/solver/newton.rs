//! Newton's method: `x ← x + δ(x)` until `‖δ‖₂` is below a tolerance.
//!
//! Source: hand-out of milestone 3, sections 4.2 and 10.

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Converged when the l2 norm of the update is below this.
    pub tolerance: f64,
    /// Fails after this many iterations.
    pub max_iterations: u64,
}

/// Iterations without a smaller update that end the iteration, where the updates are at rounding.
const MAX_STAGNANT: u32 = 3;

/// An update is at rounding where it is this small a part of the unknown.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Newton's method failed.
#[derive(Debug, Clone, PartialEq)]
pub enum NewtonError<E> {
    /// The updates did not become small.
    NotConverged {
        /// Iterations made.
        iterations: u64,
        /// l2 norm of the last update.
        update: f64,
    },
    /// The updates are as small as rounding lets them be, and still above the tolerance.
    BelowRounding {
        /// Iterations made.
        iterations: u64,
        /// l2 norm of the last update.
        update: f64,
        /// l2 norm of the unknown.
        size: f64,
    },
    /// The update could not be computed.
    Update(E),
}

/// Iterates on `unknown`. `update` is given the iterate and overwrites its second argument by `δ`.
/// Returns the number of iterations.
///
/// # Errors
/// Where the iteration does not converge (an update that is not finite ends it at once), or where
/// `update` fails.
pub fn newton<E>(
    unknown: &mut [f64],
    delta: &mut [f64],
    options: NewtonOptions,
    mut update: impl FnMut(&[f64], &mut [f64]) -> Result<(), E>,
) -> Result<u64, NewtonError<E>> {
    let l2 = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let (mut norm, mut smallest, mut stagnant) = (f64::INFINITY, f64::INFINITY, 0);
    for iteration in 1..=options.max_iterations {
        update(unknown, delta).map_err(NewtonError::Update)?;
        for (value, change) in unknown.iter_mut().zip(&*delta) {
            *value += change;
        }
        norm = l2(delta);
        if norm < options.tolerance {
            return Ok(iteration);
        }
        if !norm.is_finite() {
            return Err(NewtonError::NotConverged { iterations: iteration, update: norm });
        }
        stagnant = if norm < smallest { 0 } else { stagnant + 1 };
        smallest = smallest.min(norm);
        let size = l2(unknown);
        if stagnant >= MAX_STAGNANT && smallest <= ROUNDING * size {
            return Err(NewtonError::BelowRounding { iterations: iteration, update: norm, size });
        }
    }
    Err(NewtonError::NotConverged { iterations: options.max_iterations, update: norm })
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: NewtonOptions = NewtonOptions { tolerance: 1e-9, max_iterations: 20 };

    #[test]
    fn converges_quadratically_to_a_root() {
        let mut x = [1.0];
        let root_of_two = |x: &[f64], delta: &mut [f64]| {
            delta[0] = (2.0 - x[0] * x[0]) / (2.0 * x[0]);
            Ok::<(), ()>(())
        };
        assert_eq!(newton(&mut x, &mut [0.0], OPTIONS, root_of_two), Ok(5));
        assert!((x[0] - 2.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn says_that_it_did_not_converge() {
        let walk = |_: &[f64], delta: &mut [f64]| {
            delta[0] = 0.5;
            Ok::<(), ()>(())
        };
        let result = newton(&mut [0.0], &mut [0.0], OPTIONS, walk);
        assert_eq!(result, Err(NewtonError::NotConverged { iterations: 20, update: 0.5 }));
    }

    #[test]
    fn ends_at_once_where_the_update_is_not_finite() {
        let fall = |_: &[f64], delta: &mut [f64]| {
            delta[0] = f64::INFINITY;
            Ok::<(), ()>(())
        };
        let result = newton(&mut [0.0], &mut [0.0], OPTIONS, fall);
        assert!(matches!(result, Err(NewtonError::NotConverged { iterations: 1, .. })));
    }

    #[test]
    fn says_that_rounding_is_in_the_way() {
        // A root near 1e8 cannot be approached by steps of less than 1e-8.
        let mut sign = 1.0;
        let tremble = |_: &[f64], delta: &mut [f64]| {
            sign = -sign;
            delta[0] = sign * 1.5e-8;
            Ok::<(), ()>(())
        };
        let result = newton(&mut [1e8], &mut [0.0], OPTIONS, tremble);
        assert!(
            matches!(result, Err(NewtonError::BelowRounding { iterations: 4, .. })),
            "{result:?}"
        );
    }
}
