//! Cheapest method for each error.
//!
//! ```text
//! log t(e): linear between neighbouring points of a curve, over log e; never beyond its ends
//! ```
//!
//! A curve reaches an error only if all finer time steps also stay below it, which excludes results that are accurate
//! by accident.

use super::{Curve, Point, RunOutcome};

/// Cost of an error with one method.
#[derive(Debug, Clone, PartialEq)]
pub struct Offer {
    /// The curve's number among those of the scene.
    pub curve: usize,
    /// Time step, in seconds.
    pub time_step: f64,
    /// Time, in seconds.
    pub time: f64,
    /// Evaluations of the force; `None` for a program, which does not report them.
    pub force_evaluations: Option<f64>,
}

/// The cheapest methods for an error.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The largest error of a position.
    pub error: f64,
    /// Offers, the cheapest first.
    pub offers: Vec<Offer>,
}

/// One level per power of ten that at least one curve reaches. `floor` is the smallest measurable error.
pub fn levels(curves: &[(usize, &Curve)], floor: f64) -> Vec<Level> {
    let errors = || {
        let points = curves.iter().flat_map(|(_, curve)| &curve.points);
        points.filter_map(|point| finished(point).map(|(error, _)| error)).filter(|e| *e > 0.0)
    };
    let lowest = errors().fold(f64::INFINITY, f64::min).max(floor);
    let highest = errors().fold(0.0, f64::max);
    if lowest >= highest {
        return Vec::new();
    }
    let decades = (lowest.log10().ceil() as i32..=highest.log10().floor() as i32).rev();
    let level = |decade: i32| {
        let error = 10_f64.powi(decade);
        let mut offers: Vec<Offer> =
            curves.iter().filter_map(|(number, curve)| offer(*number, curve, error)).collect();
        offers.sort_by(|a, b| a.time.total_cmp(&b.time));
        Level { error, offers }
    };
    decades.map(level).filter(|level| !level.offers.is_empty()).collect()
}

/// Error and time of a finished point.
fn finished(point: &Point) -> Option<(f64, f64)> {
    match point.outcome {
        RunOutcome::Finished { largest, .. } => Some((largest.position, point.cost.time?.least)),
        _ => None,
    }
}

/// Cost of `error` on a curve.
fn offer(number: usize, curve: &Curve, error: f64) -> Option<Offer> {
    let reaches = |point: &Point| finished(point).is_some_and(|(found, _)| found <= error);
    let first = curve.points.iter().rposition(|point| !reaches(point)).map_or(0, |last| last + 1);
    let point = curve.points.get(first)?;
    let (fine_error, fine_time) = finished(point)?;
    let coarser = first.checked_sub(1).map(|before| &curve.points[before]);
    // Interpolate between two points.
    let along = coarser.and_then(|before| {
        let (coarse_error, coarse_time) = finished(before)?;
        let span = (coarse_error / fine_error.max(f64::MIN_POSITIVE)).ln();
        (span > 0.0).then(|| (before, coarse_time, (coarse_error / error).ln() / span))
    });
    let (time, time_step, force_evaluations) = match along {
        None => {
            (fine_time, point.time_step, point.cost.work.map(|work| work.force_evaluations as f64))
        }
        Some((before, coarse_time, share)) => {
            let between =
                |coarse: f64, fine: f64| coarse * (fine / coarse).powf(share.clamp(0.0, 1.0));
            let evaluations = |point: &Point| {
                point.cost.work.map(|work| (work.force_evaluations as f64).max(f64::MIN_POSITIVE))
            };
            (
                between(coarse_time, fine_time),
                between(before.time_step, point.time_step),
                evaluations(before).zip(evaluations(point)).map(|(a, b)| between(a, b)),
            )
        }
    };
    Some(Offer { curve: number, time_step, time, force_evaluations })
}
