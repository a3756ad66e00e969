//! The facts of a failure as JSON.

use grader::boundary::printed;
use grader::verdict::{
    BuildFailure, Conserved, Drift, Failure, Lack, Place, RunFailure, Skipped, Verdict,
};
use serde::Serialize;

use super::finite;

/// The facts of a failure; each is left out where it does not apply.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default)]
pub(super) struct JsonFailure {
    /// The exit status of the program or of the build.
    #[serde(skip_serializing_if = "Option::is_none")]
    exit_status: Option<i32>,
    /// The signal that killed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    signal: Option<String>,
    /// The limit that it exceeded.
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<JsonLimit>,
    /// The last lines that it printed.
    #[serde(skip_serializing_if = "Option::is_none")]
    printed: Option<String>,
    /// The integrator, force or format that the program refuses.
    #[serde(skip_serializing_if = "Option::is_none")]
    lacks: Option<String>,
    /// The number of earlier failures for which the scene was not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    skipped_after: Option<usize>,
    /// The file of the trace and the place in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    location: Option<String>,
    /// The number that is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<JsonPlace>,
    /// States in the trace, if they are too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    states: Option<u64>,
    /// States that the trace should have, if it has more or fewer.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected_states: Option<u64>,
    /// The fault beyond the prediction horizon.
    #[serde(skip_serializing_if = "Option::is_none")]
    drift: Option<JsonDrift>,
    /// The terms that the program does not show on altered copies.
    #[serde(skip_serializing_if = "Option::is_none")]
    terms: Option<String>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonLimit {
    /// "cpu", "wall", "budget", "memory", "processes", "trace", "stdout", "stderr" or "files".
    name: &'static str,
    /// In seconds, bytes, or a count.
    value: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonPlace {
    step: u64,
    /// From 0.
    particle: usize,
    /// "x", "vy", …
    coordinate: &'static str,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonDrift {
    /// The first state that is not compared.
    horizon: u64,
    /// The state that is wrong.
    step: u64,
    /// "position" or "velocity" after a single step, "energy" or "momentum".
    quantity: &'static str,
    /// The difference from the correct step, or from the oracle; null if it is not finite.
    difference: Option<f64>,
    /// The difference between correct programs.
    envelope: f64,
    /// The tolerance.
    tolerance: f64,
}

impl JsonFailure {
    /// The facts; `None` if the verdict is no failure.
    pub(super) fn of(verdict: &Verdict) -> Option<Self> {
        if let Verdict::Fail(failure) = verdict { Some(Self::of_failure(failure)) } else { None }
    }

    fn of_failure(failure: &Failure) -> Self {
        let none = Self::default();
        match failure {
            Failure::Run(run) | Failure::BuildFailed(BuildFailure::Run(run)) => Self::of_run(run),
            Failure::NotImplemented(Lack::Refused { name, failure }) => {
                Self { lacks: name.clone(), ..Self::of_run(failure) }
            }
            Failure::NotGreeted(failures) => Self::of_failure(failures.telling()),
            Failure::Skipped(Skipped::TimeOuts { count } | Skipped::Features { count }) => {
                Self { skipped_after: Some(*count), ..none }
            }
            Failure::Skipped(Skipped::Crashes { count, last }) => {
                Self { skipped_after: Some(*count), ..Self::of_failure(last) }
            }
            Failure::Malformed { location, .. } => Self { location: shown(location), ..none },
            Failure::NotFinite { location, place, .. } => {
                Self { location: shown(location), place: Some(JsonPlace::of(place)), ..none }
            }
            Failure::TooShort { states, expected } => {
                Self { states: Some(*states), expected_states: Some(*expected), ..none }
            }
            Failure::TooLong { expected } => Self { expected_states: Some(*expected), ..none },
            Failure::Drifts { horizon, drift } => {
                let place = match drift {
                    Drift::Step { place, .. } => Some(JsonPlace::of(place)),
                    Drift::Conserved { .. } => None,
                };
                Self { place, drift: Some(JsonDrift::of(*horizon, drift)), ..none }
            }
            Failure::FailsAltered { terms } => Self { terms: Some(terms.clone()), ..none },
            Failure::BadHandIn { .. }
            | Failure::NotImplemented(Lack::LeftOut { .. })
            | Failure::NoTrace(_)
            | Failure::Unreadable { .. }
            | Failure::GaveUp { .. }
            | Failure::BuildFailed(BuildFailure::NotKept(_))
            | Failure::WrongFunction { .. }
            | Failure::Differs => none,
        }
    }

    fn of_run(RunFailure { end, output }: &RunFailure) -> Self {
        Self {
            exit_status: end.exit_status(),
            signal: end.signal(),
            limit: end.limit().map(|(name, value)| JsonLimit { name, value }),
            printed: (!output.text.is_empty()).then(|| output.text.text()),
            ..Self::default()
        }
    }
}

fn shown(location: &Option<String>) -> Option<String> {
    location.as_deref().map(printed::text)
}

impl JsonPlace {
    fn of(place: &Place) -> Self {
        Self { step: place.step, particle: place.particle, coordinate: place.coordinate() }
    }
}

impl JsonDrift {
    fn of(horizon: u64, drift: &Drift) -> Self {
        match *drift {
            Drift::Step { place, residual: difference, envelope, tolerance, .. } => {
                let (step, quantity) = (place.step, place.quantity.name());
                let difference = finite(difference);
                Self { horizon, step, quantity, difference, envelope, tolerance }
            }
            Drift::Conserved { quantity, step, difference, envelope, tolerance } => {
                let quantity = match quantity {
                    Conserved::Energy { .. } => "energy",
                    Conserved::Momentum => "momentum",
                };
                let difference = finite(difference);
                Self { horizon, step, quantity, difference, envelope, tolerance }
            }
        }
    }
}
