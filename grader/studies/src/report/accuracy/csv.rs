//! Errors and costs as CSV, one row per point. Only the last columns, the times, differ from run to run.

use crate::accuracy::{Point, RunOutcome, Study};

use super::outcome_name;

/// The columns. Errors are in the scene's units, times in seconds; missing values are empty.
pub const COLUMNS: [&str; 26] = [
    "scene",
    "whose",
    "method",
    "dt",
    "steps",
    "outcome",
    "position_error_largest",
    "velocity_error_largest",
    "energy_error_largest",
    "position_error_end",
    "velocity_error_end",
    "energy_error_end",
    "position_floor",
    "velocity_floor",
    "energy_floor",
    "at_floor",
    "failed_step",
    "failed_time",
    "reason",
    "force_evaluations",
    "factorisations",
    "iterations",
    "repeats",
    "time_least",
    "time_median",
    "time_largest",
];

/// The report as CSV, with a header.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn render(study: &Study) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for scene in &study.scenes {
        for curve in &scene.curves {
            for point in &curve.points {
                let whose = if curve.foreign { "submission" } else { "built-in" };
                let mut row = vec![
                    scene.target.name.clone(),
                    whose.to_owned(),
                    curve.method.label(),
                    point.time_step.to_string(),
                    point.steps.to_string(),
                    outcome_name(&point.outcome).to_owned(),
                ];
                let floor = scene.reference.floor;
                let (errors, at_floor, failure) = outcome(point, floor.position);
                row.extend(errors);
                row.extend([floor.position, floor.velocity, floor.energy].map(number));
                row.push(at_floor);
                row.extend(failure);
                row.extend(match point.cost.work {
                    Some(work) => [work.force_evaluations, work.factorisations, work.iterations]
                        .map(|count| count.to_string()),
                    None => Default::default(),
                });
                row.extend(match point.cost.time {
                    Some(time) => [
                        time.repeats.to_string(),
                        number(time.least),
                        number(time.median),
                        number(time.largest),
                    ],
                    None => Default::default(),
                });
                writer.write_record(row)?;
            }
        }
    }
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn number(value: f64) -> String {
    format!("{value:e}")
}

/// Errors, whether the position's error is within the reference's error bar, and the failure.
fn outcome(point: &Point, floor: f64) -> ([String; 6], String, [String; 3]) {
    let empty = String::new;
    match &point.outcome {
        RunOutcome::Finished { end, largest } => {
            let errors = [largest, end]
                .map(|errors| [errors.position, errors.velocity, errors.energy].map(number));
            let [[a, b, c], [d, e, f]] = errors;
            ([a, b, c, d, e, f], (largest.position <= floor).to_string(), Default::default())
        }
        RunOutcome::BlownUp { .. } => (Default::default(), empty(), Default::default()),
        RunOutcome::Failed { step, time, reason } => {
            let reason = reason.lines().next().unwrap_or_default().to_owned();
            (Default::default(), empty(), [step.to_string(), number(*time), reason])
        }
    }
}
