//! Trials as CSV, one row per trial. Only the last column, the time, differs from run to run.

use std::io;

use crate::stability::{StabilityReport, Trial};

/// The columns.
const HEADER: [&str; 20] = [
    "case",
    "method",
    "dt",
    "steps",
    "robust",
    "outcome",
    "failed_step",
    "message",
    "steps_taken",
    "energy_change",
    "energy_rise",
    "momentum_drift",
    "equation_residual",
    "newton_iterations",
    "max_newton_iterations",
    "worst_linear_residual",
    "line_searched",
    "substepped",
    "substeps",
    "seconds",
];

/// The table of trials.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn render(report: &StabilityReport) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(HEADER)?;
    for trial in &report.trials {
        writer.write_record(row(trial))?;
    }
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

fn row(trial: &Trial) -> [String; 20] {
    let measured = &trial.measured;
    let optional =
        |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:e}"));
    [
        trial.case.to_owned(),
        trial.method.to_owned(),
        format!("{:e}", trial.time_step),
        trial.steps.to_string(),
        if trial.robust { "yes" } else { "no" }.to_owned(),
        trial.outcome.word().to_owned(),
        trial.outcome.step().map_or_else(String::new, |step| step.to_string()),
        trial.outcome.message(),
        measured.steps.to_string(),
        format!("{:e}", measured.energy),
        format!("{:e}", measured.energy_rise),
        optional(measured.momentum),
        optional(measured.equation),
        measured.newton_iterations.to_string(),
        measured.max_newton_iterations.to_string(),
        format!("{:e}", measured.worst_residual),
        measured.rescue.line_searched.to_string(),
        measured.rescue.substepped.to_string(),
        measured.rescue.substeps.to_string(),
        format!("{:.6}", trial.seconds),
    ]
}
