//! The order of convergence, fitted: the slope of the error over the time step, both as logarithms.
//!
//! ```text
//! e(h) = C h^p (1 + c h + …)        log e = log C + p log h + c h: least squares for log C, p and c
//! ```
//!
//! The term `c h` takes up what a time step that is not quite small adds, so that `p` is the order and not its
//! mean over the window. The window is found, not chosen: from the finest time step whose error is above the
//! floor, as far to coarser ones as the fit leaves no more than [`REGULAR`] of any error and `c h` is a correction
//! ([`CORRECTION`]). Where even the finest [`FEWEST`] points are not regular, the finest are left out one by one.

use nalgebra::{DMatrix, DVector};

use super::Quantity;

/// How much of an error the fit may leave.
pub const REGULAR: f64 = 0.01;

/// The largest `c h` that is a correction.
pub const CORRECTION: f64 = 0.5;

/// How far a fitted slope may be from theory.
pub const TOLERANCE: f64 = 0.05;

/// The fewest points that make a window.
pub const FEWEST: usize = 5;

/// How many times the floor an error must be for its digits to count.
const CLEAR: f64 = 20.0;

/// What theory says of an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expected {
    /// It falls with this power of the time step.
    Order(f64),
    /// There is none but rounding.
    Exact,
}

/// Where methods have another order than usual.
#[derive(Debug)]
pub struct Exception {
    /// Which methods; empty: all of them.
    pub integrators: &'static [&'static str],
    /// Which error.
    pub quantity: Quantity,
    /// What theory says here.
    pub expected: Expected,
    /// Why.
    pub reason: &'static str,
}

/// What was fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fit {
    /// A slope, and the window that it was fitted in.
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
    /// There is no window: too few points above the floor, or no regular slope among them.
    None,
}

/// An error with the time step that led to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time step.
    pub time_step: f64,
    /// Error.
    pub error: f64,
    /// What cannot be told from zero: the reference's error bar.
    pub floor: f64,
    /// What an exact method may have of rounding.
    pub rounding: f64,
}

/// Fits a slope to errors from coarse to fine.
pub fn fit(samples: &[Sample]) -> Fit {
    let is_exact = |sample: &Sample| sample.error <= sample.floor + sample.rounding;
    if !samples.is_empty() && samples.iter().all(is_exact) {
        return Fit::Exact;
    }
    let clear = |sample: &&Sample| sample.error > CLEAR * sample.floor && !is_exact(sample);
    // Beyond the first point that is not clear, digits are missing.
    let points: Vec<(f64, f64)> = samples
        .iter()
        .skip_while(|sample| !clear(sample))
        .take_while(clear)
        .map(|sample| (sample.time_step, sample.error))
        .collect();
    for end in (FEWEST..=points.len()).rev() {
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

/// The slope of points of time step and error, where they are regular.
fn regular_slope(points: &[(f64, f64)]) -> Option<f64> {
    let coarsest = points.first()?.0;
    // In units of the coarsest step, the three columns are of one size.
    let row = |&(h, _): &(f64, f64)| [1.0, (h / coarsest).ln(), h / coarsest];
    let rows = points.iter().map(row);
    let matrix = DMatrix::from_row_iterator(points.len(), 3, rows.flatten());
    let logarithms = DVector::from_iterator(points.len(), points.iter().map(|point| point.1.ln()));
    let fitted = matrix.clone().svd(true, true).solve(&logarithms, f64::EPSILON).ok()?;
    let left = &matrix * &fitted - logarithms;
    (left.amax() <= REGULAR && fitted[2].abs() <= CORRECTION).then_some(fitted[1])
}

/// Whether a fit is what theory says; `None` where nothing was fitted.
pub fn agrees(fit: Fit, expected: Expected) -> Option<bool> {
    match (fit, expected) {
        (Fit::None, _) => None,
        (Fit::Slope { slope, .. }, Expected::Order(order)) => {
            Some((slope - order).abs() <= TOLERANCE)
        }
        (Fit::Slope { .. }, Expected::Exact) => Some(false),
        // What is better than its order is not held against it.
        (Fit::Exact, _) => Some(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(error: impl Fn(f64) -> f64, floor: f64) -> Vec<Sample> {
        let step = |rung: i32| 0.5_f64.powi(rung);
        let sample = |h: f64| Sample { time_step: h, error: error(h), floor, rounding: 0.0 };
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
    fn what_is_coarser_than_the_asymptotic_range_is_left_out() {
        let Fit::Slope { slope, window, .. } = fit(&samples(|h| h * (1.0 + 8.0 * h), 0.0)) else {
            panic!("no slope");
        };
        assert!((slope - 1.0).abs() < 0.01, "{slope}");
        assert!(window.0 < 0.3, "{window:?}");
    }

    #[test]
    fn what_nears_the_floor_is_left_out() {
        // From h = 1e-3 on, the error is that of the reference.
        let stuck = |h: f64| h.powi(3).max(1e-9);
        let Fit::Slope { slope, window, .. } = fit(&samples(stuck, 1e-9)) else {
            panic!("no slope");
        };
        assert!((slope - 3.0).abs() < 1e-9, "{slope}");
        assert!(window.1 > 1e-3, "{window:?}");
    }

    #[test]
    fn an_error_that_stays_has_the_slope_zero() {
        let Fit::Slope { slope, .. } = fit(&samples(|h| 0.1 + h * h, 0.0)) else {
            panic!("no slope");
        };
        assert!(slope.abs() < 0.01, "{slope}");
        let fit = fit(&samples(|h| 0.1 + h * h, 0.0));
        assert_eq!(agrees(fit, Expected::Order(1.0)), Some(false));
    }
}
