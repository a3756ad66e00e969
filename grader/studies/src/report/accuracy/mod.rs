//! Reports of errors and costs, one file per format.

pub mod csv;
pub mod html;
pub mod json;
pub mod plot;
pub mod text;

use crate::accuracy::reference::Source;
use crate::accuracy::{Curve, RunOutcome, SceneStudy};

/// Number of the look of curve `number`. A submission's curve has the look of the built-in simulator's same method, with
/// open markers.
fn style(number: usize, scene: &SceneStudy) -> usize {
    let curve = &scene.curves[number];
    let is_alike = |other: &Curve| !other.foreign && other.method == curve.method;
    scene.curves.iter().position(is_alike).unwrap_or(number)
}

/// A number with few digits.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    match value.abs() {
        0.001..10_000.0 => {
            let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
            let text = format!("{value:.digits$}");
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
        _ => format!("{value:.1e}"),
    }
}

/// A time with a suitable unit.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        ..1e-6 => (seconds * 1e9, "ns"),
        ..1e-3 => (seconds * 1e6, "µs"),
        ..1.0 => (seconds * 1e3, "ms"),
        _ => (seconds, "s"),
    };
    let digits = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.digits$} {unit}")
}

/// The machine-readable name of an outcome.
fn outcome_name(outcome: &RunOutcome) -> &'static str {
    match outcome {
        RunOutcome::Finished { .. } => "finished",
        RunOutcome::BlownUp { .. } => "blown-up",
        RunOutcome::Failed { .. } => "failed",
    }
}

/// The machine-readable name of a reference.
fn source_name(source: Source) -> &'static str {
    match source {
        Source::Closed => "closed-form",
        Source::Adaptive => "adaptive",
    }
}
