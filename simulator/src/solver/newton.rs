//! Newton's method: `x ← x + δ(x)` until `‖δ‖₂` is below a tolerance.
//!
//! Equations may shorten a step, for example by [`backtrack_residual`](super::line_search::backtrack_residual).
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

/// Equations `r(x) = 0`. A closure that computes Newton's step is one, with whole steps.
pub trait Equations {
    /// Errors of an update.
    type Error;

    /// Overwrites `delta` by Newton's step at `x`.
    ///
    /// # Errors
    /// If it cannot be computed.
    fn update(&mut self, x: &[f64], delta: &mut [f64]) -> Result<(), Self::Error>;

    /// Moves `x` along `delta`; false if no part of the step is acceptable.
    fn advance(&mut self, x: &mut [f64], delta: &[f64]) -> bool {
        add(x, delta);
        true
    }
}

impl<F, E> Equations for F
where
    F: FnMut(&[f64], &mut [f64]) -> Result<(), E>,
{
    type Error = E;

    fn update(&mut self, x: &[f64], delta: &mut [f64]) -> Result<(), E> {
        self(x, delta)
    }
}

/// Iterates on `unknown`, with `delta` of its length as workspace. Returns the number of iterations.
///
/// # Errors
/// If the iteration does not converge (an update that is not finite ends it at once), or if an update fails.
pub fn newton<E: Equations>(
    unknown: &mut [f64],
    delta: &mut [f64],
    options: NewtonOptions,
    equations: &mut E,
) -> Result<u64, NewtonError<E::Error>> {
    let l2 = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let (mut norm, mut smallest, mut stagnant) = (f64::INFINITY, f64::INFINITY, 0);
    for iterations in 1..=options.max_iterations {
        equations.update(unknown, delta).map_err(NewtonError::Update)?;
        norm = l2(delta);
        if norm < options.tolerance {
            add(unknown, delta);
            return Ok(iterations);
        }
        if !norm.is_finite() || !equations.advance(unknown, delta) {
            return Err(NewtonError::NotConverged { iterations, update: norm });
        }
        stagnant = if norm < smallest { 0 } else { stagnant + 1 };
        smallest = smallest.min(norm);
        let size = l2(unknown);
        if stagnant >= MAX_STAGNANT && smallest <= ROUNDING * size {
            return Err(NewtonError::BelowRounding { iterations, update: norm, size });
        }
    }
    Err(NewtonError::NotConverged { iterations: options.max_iterations, update: norm })
}

fn add(x: &mut [f64], delta: &[f64]) {
    for (value, change) in x.iter_mut().zip(delta) {
        *value += change;
    }
}

#[cfg(test)]
mod tests {
    use super::super::line_search::backtrack_residual;
    use super::*;

    const OPTIONS: NewtonOptions = NewtonOptions { tolerance: 1e-9, max_iterations: 20 };

    #[test]
    fn converges_quadratically_to_a_root() {
        let mut x = [1.0];
        let mut root_of_two = |x: &[f64], delta: &mut [f64]| {
            delta[0] = (2.0 - x[0] * x[0]) / (2.0 * x[0]);
            Ok::<(), ()>(())
        };
        assert_eq!(newton(&mut x, &mut [0.0], OPTIONS, &mut root_of_two), Ok(5));
        assert!((x[0] - 2.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn newton_reports_lack_of_convergence() {
        let mut walk = |_: &[f64], delta: &mut [f64]| {
            delta[0] = 0.5;
            Ok::<(), ()>(())
        };
        let result = newton(&mut [0.0], &mut [0.0], OPTIONS, &mut walk);
        assert_eq!(result, Err(NewtonError::NotConverged { iterations: 20, update: 0.5 }));
    }

    #[test]
    fn newton_stops_at_a_non_finite_update() {
        let mut fall = |_: &[f64], delta: &mut [f64]| {
            delta[0] = f64::INFINITY;
            Ok::<(), ()>(())
        };
        let result = newton(&mut [0.0], &mut [0.0], OPTIONS, &mut fall);
        assert!(matches!(result, Err(NewtonError::NotConverged { iterations: 1, .. })));
    }

    #[test]
    fn newton_reports_stagnation_by_rounding() {
        // A root near 1e8 cannot be approached by steps of less than 1e-8.
        let mut sign = 1.0;
        let mut tremble = |_: &[f64], delta: &mut [f64]| {
            sign = -sign;
            delta[0] = sign * 1.5e-8;
            Ok::<(), ()>(())
        };
        let result = newton(&mut [1e8], &mut [0.0], OPTIONS, &mut tremble);
        assert!(
            matches!(result, Err(NewtonError::BelowRounding { iterations: 4, .. })),
            "{result:?}"
        );
    }

    /// Equations with their merit `½ r²`, solved with a line search.
    struct Damped<U, M> {
        update: U,
        merit: M,
        halvings: u64,
    }

    impl<U: Fn(f64) -> f64, M: Fn(f64) -> f64> Equations for Damped<U, M> {
        type Error = ();

        fn update(&mut self, x: &[f64], delta: &mut [f64]) -> Result<(), ()> {
            delta[0] = (self.update)(x[0]);
            Ok(())
        }

        fn advance(&mut self, x: &mut [f64], delta: &[f64]) -> bool {
            let halvings = backtrack_residual(x, delta, &mut [0.0], |x| (self.merit)(x[0]));
            self.halvings += halvings.unwrap_or(0);
            halvings.is_some()
        }
    }

    #[test]
    fn a_line_search_converges_where_whole_steps_diverge() {
        // −atan(x) = 0: from beyond 1.39, whole steps diverge.
        let update = |x: f64| -x.atan() * (1.0 + x * x);
        let whole = newton(&mut [3.0], &mut [0.0], OPTIONS, &mut |x: &[f64], delta: &mut [f64]| {
            delta[0] = update(x[0]);
            Ok::<(), ()>(())
        });
        assert!(whole.is_err(), "{whole:?}");
        let merit = |x: f64| 0.5 * x.atan().powi(2);
        let (mut x, mut damped) = ([3.0], Damped { update, merit, halvings: 0 });
        newton(&mut x, &mut [0.0], OPTIONS, &mut damped).unwrap();
        assert!(x[0].abs() < 1e-15 && damped.halvings > 0, "{x:?}, {} halvings", damped.halvings);
    }

    #[test]
    fn equations_without_a_solution_are_an_error() {
        // 1 + x² = 0.
        let update = |x: f64| -(1.0 + x * x) / (2.0 * x);
        let merit = |x: f64| 0.5 * (1.0 + x * x).powi(2);
        let mut damped = Damped { update, merit, halvings: 0 };
        let result = newton(&mut [1.5], &mut [0.0], OPTIONS, &mut damped);
        assert!(matches!(result, Err(NewtonError::NotConverged { .. })), "{result:?}");
    }
}
