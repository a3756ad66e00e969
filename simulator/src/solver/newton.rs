//! Newton's method: `x ← x + δ(x)` until `‖δ‖₂` is below a tolerance.
//!
//! Source: hand-out of milestone 3, sections 4.2 and 10.

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Converged when the l2 norm of the update is below this.
    pub tolerance: f64,
    /// Given up after this many iterations.
    pub max_iterations: u64,
}

/// Newton's method stopped without an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum NewtonError<E> {
    /// The updates did not become small.
    NotConverged {
        /// Iterations made.
        iterations: u64,
        /// l2 norm of the last update.
        update: f64,
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
    let mut norm = f64::INFINITY;
    for iteration in 1..=options.max_iterations {
        update(unknown, delta).map_err(NewtonError::Update)?;
        for (value, change) in unknown.iter_mut().zip(&*delta) {
            *value += change;
        }
        norm = delta.iter().map(|change| change * change).sum::<f64>().sqrt();
        if norm < options.tolerance {
            return Ok(iteration);
        }
        if !norm.is_finite() {
            return Err(NewtonError::NotConverged { iterations: iteration, update: norm });
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
}
