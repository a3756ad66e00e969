//! Fit of the order of convergence: the slope of the error over the time step, both as logarithms.
//!
//! ```text
//! e(h) = C h^p (1 + c h + …)        log e = log C + p log h + c h: least squares for log C, p and c
//! ```
//!
//! The term `c h` absorbs the next order of the error, so that `p` is the order and not a mean over the window. The
//! window is determined automatically. It starts at the finest time step whose error is above the floor, and extends
//! to coarser steps while the fit leaves at most [`REGULAR`] of any error and `c h` is a correction ([`CORRECTION`]).
//! If the finest [`FEWEST`] points are not regular, the finest points are dropped one by one, but only those of which
//! rounding may be more than [`REGULAR`]: a slope at steps that are too long, where the error is as large as the motion,
//! is not the order.

use nalgebra::{DMatrix, DVector};

use super::Quantity;

/// Largest relative residual of the fit.
pub const REGULAR: f64 = 0.01;

/// Largest `c h` that counts as a correction.
pub const CORRECTION: f64 = 0.5;

/// Tolerance between a fitted slope and theory.
pub const TOLERANCE: f64 = 0.05;

/// Minimum number of points in a window.
pub const FEWEST: usize = 5;

/// Minimum ratio of an error to the floor for the error to be used.
const CLEAR: f64 = 20.0;

/// Theoretical prediction for an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expected {
    /// Proportional to this power of the time step.
    Order(f64),
    /// Zero except for rounding.
    Exact,
}

/// An exception from the usual order of methods.
#[derive(Debug)]
pub struct Exception {
    /// The methods; empty for all.
    pub integrators: &'static [&'static str],
    /// The quantity.
    pub quantity: Quantity,
    /// The prediction.
    pub expected: Expected,
    /// The reason.
    pub reason: &'static str,
}

/// Result of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fit {
    /// A slope with the window of the fit.
    Slope {
        /// The power of the time step.
        slope: f64,
        /// The coarsest and the finest time step of the window.
        window: (f64, f64),
        /// Points in the window.
        points: usize,
    },
    /// Every error is within rounding.
    Exact,
    /// No window: too few points above the floor, or no regular slope among them.
    None,
}

/// An error with its time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorSample {
    /// Time step.
    pub time_step: f64,
    /// Error.
    pub error: f64,
    /// The reference's error bar: smaller errors cannot be distinguished from zero.
    pub floor: f64,
    /// Bound of the rounding error of an exact method.
    pub rounding: f64,
}

/// Fits a slope to errors from coarse to fine.
pub fn fit(samples: &[ErrorSample]) -> Fit {
    let is_exact = |sample: &ErrorSample| sample.error <= sample.floor + sample.rounding;
    if !samples.is_empty() && samples.iter().all(is_exact) {
        return Fit::Exact;
    }
    let clear = |sample: &&ErrorSample| sample.error > CLEAR * sample.floor && !is_exact(sample);
    // Errors after the first point near the floor have too few correct digits.
    let used = samples.iter().skip_while(|sample| !clear(sample)).take_while(clear);
    let used: Vec<&ErrorSample> = used.collect();
    let points: Vec<(f64, f64)> =
        used.iter().map(|sample| (sample.time_step, sample.error)).collect();
    let is_clean = |sample: &&&ErrorSample| REGULAR * sample.error > sample.floor + sample.rounding;
    let clean = used.iter().take_while(is_clean).count();
    for end in (FEWEST.max(clean)..=points.len()).rev() {
        let windows = (0..=end - FEWEST).map(|start| &points[start..end]);
        let mut regular = windows.filter_map(|window| Some((window, regular_slope(window)?)));
        let Some((window, slope)) = regular.next() else { continue };
        let step = |point: Option<&(f64, f64)>| point.map_or(0.0, |point| point.0);
        return Fit::Slope {
            slope,
            window: (step(window.first()), step(window.last())),
            points: window.len(),
        };
    }
    Fit::None
}

/// The slope of points (time step, error); `None` if not regular.
fn regular_slope(points: &[(f64, f64)]) -> Option<f64> {
    let coarsest = points.first()?.0;
    // Scale by the coarsest step, so that the three columns have similar size.
    let row = |&(h, _): &(f64, f64)| [1.0, (h / coarsest).ln(), h / coarsest];
    let rows = points.iter().map(row);
    let matrix = DMatrix::from_row_iterator(points.len(), 3, rows.flatten());
    let logarithms = DVector::from_iterator(points.len(), points.iter().map(|point| point.1.ln()));
    let fitted = matrix.clone().svd(true, true).solve(&logarithms, f64::EPSILON).ok()?;
    let left = &matrix * &fitted - logarithms;
    (left.amax() <= REGULAR && fitted[2].abs() <= CORRECTION).then_some(fitted[1])
}

/// Whether a fit agrees with theory; `None` if nothing was fitted.
pub fn agrees(fit: Fit, expected: Expected) -> Option<bool> {
    match (fit, expected) {
        (Fit::None, _) => None,
        (Fit::Slope { slope, .. }, Expected::Order(order)) => {
            Some((slope - order).abs() <= TOLERANCE)
        }
        (Fit::Slope { .. }, Expected::Exact) => Some(false),
        // A better result than predicted is accepted.
        (Fit::Exact, _) => Some(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(error: impl Fn(f64) -> f64, floor: f64) -> Vec<ErrorSample> {
        let step = |rung: i32| 0.5_f64.powi(rung);
        let sample = |h: f64| ErrorSample { time_step: h, error: error(h), floor, rounding: 0.0 };
        (0..12).map(|rung| sample(step(rung))).collect()
    }

    #[test]
    fn a_power_has_its_exponent_everywhere() {
        for power in [0.5, 1.0, 2.0] {
            let Fit::Slope { slope, window, points } = fit(&samples(|h| 3.0 * h.powf(power), 0.0))
            else {
                panic!("no slope");
            };
            assert!((slope - power).abs() < 1e-12, "{slope}");
            assert_eq!(points, 12);
            assert!((window.0 - 1.0).abs() < 1e-12, "{window:?}");
        }
    }

    #[test]
    fn order_fit_excludes_steps_above_the_asymptotic_range() {
        let Fit::Slope { slope, window, .. } = fit(&samples(|h| h * (1.0 + 8.0 * h), 0.0)) else {
            panic!("no slope");
        };
        assert!((slope - 1.0).abs() < 0.01, "{slope}");
        assert!(window.0 < 0.3, "{window:?}");
    }

    #[test]
    fn order_fit_excludes_errors_near_the_floor() {
        // From h = 1e-3 on, the error is that of the reference.
        let stuck = |h: f64| h.powi(3).max(1e-9);
        let Fit::Slope { slope, window, .. } = fit(&samples(stuck, 1e-9)) else {
            panic!("no slope");
        };
        assert!((slope - 3.0).abs() < 1e-9, "{slope}");
        assert!(window.1 > 1e-3, "{window:?}");
    }

    #[test]
    fn an_error_as_large_as_the_motion_has_no_order() {
        // The finest errors fall by unequal amounts: the asymptotic range is not reached.
        let error = |h: f64| 1.0_f64.min((h * 100.0).sqrt() * (2.0 + (7.0 * h.ln()).sin()));
        assert_eq!(fit(&samples(error, 1e-14)), Fit::None);
    }

    #[test]
    fn constant_error_has_slope_zero() {
        let Fit::Slope { slope, .. } = fit(&samples(|h| 0.1 + h * h, 0.0)) else {
            panic!("no slope");
        };
        assert!(slope.abs() < 0.01, "{slope}");
        let fit = fit(&samples(|h| 0.1 + h * h, 0.0));
        assert_eq!(agrees(fit, Expected::Order(1.0)), Some(false));
    }
}
