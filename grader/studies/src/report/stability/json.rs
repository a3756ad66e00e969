//! Stability as JSON. Non-finite numbers are `null`: no limit, or no stable step.

use serde::Serialize;

use crate::stability::theory::amplification::Amplification;
use crate::stability::theory::boundary::Boundary;
use crate::stability::{Change, StabilityReport, Trial};

/// The report.
#[derive(Serialize)]
struct Report {
    passed: bool,
    trials: Vec<TrialRecord>,
    boundaries: Vec<BoundaryRecord>,
    amplifications: Vec<AmplificationRecord>,
    changes: Vec<ChangeRecord>,
}

#[derive(Serialize)]
struct TrialRecord {
    case: &'static str,
    method: &'static str,
    dt: f64,
    steps: u64,
    robust: bool,
    outcome: &'static str,
    failed_step: Option<u64>,
    message: String,
    steps_taken: u64,
    energy_change: f64,
    energy_rise: f64,
    momentum_drift: Option<f64>,
    equation_residual: Option<f64>,
    newton_iterations: u64,
    max_newton_iterations: u64,
    worst_linear_residual: f64,
    line_searched: u64,
    substepped: u64,
    substeps: u64,
    seconds: f64,
}

#[derive(Serialize)]
struct BoundaryRecord {
    method: &'static str,
    scene: String,
    theory: f64,
    measured: f64,
    unconditional: bool,
    confirming_steps: Option<u64>,
    agrees: bool,
}

#[derive(Serialize)]
struct AmplificationRecord {
    method: &'static str,
    h_omega: f64,
    damping_ratio: f64,
    measured: f64,
    theory: f64,
    exact: f64,
    numerical_damping_ratio: Option<f64>,
    period_error: Option<f64>,
}

#[derive(Serialize)]
struct ChangeRecord {
    case: String,
    method: String,
    dt: String,
    steps: u64,
    robust: bool,
    expected: Option<String>,
    got: Option<String>,
}

/// The report as a JSON document, with a newline at its end.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn render(report: &StabilityReport) -> Result<String, serde_json::Error> {
    let record = Report {
        passed: report.is_pass(),
        trials: report.trials.iter().map(trial).collect(),
        boundaries: report.boundaries.iter().map(boundary).collect(),
        amplifications: report.amplifications.iter().map(amplification).collect(),
        changes: report.changes.iter().map(change).collect(),
    };
    serde_json::to_string_pretty(&record).map(|text| text + "\n")
}

fn trial(trial: &Trial) -> TrialRecord {
    let measured = &trial.measured;
    TrialRecord {
        case: trial.case,
        method: trial.method,
        dt: trial.time_step,
        steps: trial.steps,
        robust: trial.robust,
        outcome: trial.outcome.word(),
        failed_step: trial.outcome.step(),
        message: trial.outcome.message(),
        steps_taken: measured.steps,
        energy_change: measured.energy,
        energy_rise: measured.energy_rise,
        momentum_drift: measured.momentum,
        equation_residual: measured.equation,
        newton_iterations: measured.newton_iterations,
        max_newton_iterations: measured.max_newton_iterations,
        worst_linear_residual: measured.worst_residual,
        line_searched: measured.rescue.line_searched,
        substepped: measured.rescue.substepped,
        substeps: measured.rescue.substeps,
        seconds: trial.seconds,
    }
}

fn boundary(boundary: &Boundary) -> BoundaryRecord {
    BoundaryRecord {
        method: boundary.method,
        scene: boundary.scene.clone(),
        theory: boundary.theory,
        measured: boundary.measured,
        unconditional: boundary.measured.is_infinite(),
        confirming_steps: boundary.confirmed.map(|(steps, _)| steps),
        agrees: boundary.agrees(),
    }
}

fn amplification(amplification: &Amplification) -> AmplificationRecord {
    AmplificationRecord {
        method: amplification.method,
        h_omega: amplification.a,
        damping_ratio: amplification.zeta,
        measured: amplification.measured,
        theory: amplification.theory,
        exact: amplification.exact,
        numerical_damping_ratio: amplification.damping,
        period_error: amplification.period,
    }
}

fn change(change: &Change) -> ChangeRecord {
    let words = |expected: &Option<crate::stability::expected::Expected>| {
        expected.as_ref().map(ToString::to_string)
    };
    ChangeRecord {
        case: change.key.case.clone(),
        method: change.key.method.clone(),
        dt: change.key.time_step.clone(),
        steps: change.key.steps,
        robust: change.key.robust,
        expected: words(&change.expected),
        got: words(&change.got),
    }
}
