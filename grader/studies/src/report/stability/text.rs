//! Text report of stability: tables of trials, boundaries and amplification, and the changes.

use std::io::{self, Write};

use crate::stability::cases;
use crate::stability::expected::Expected;
use crate::stability::theory::amplification::Amplification;
use crate::stability::theory::boundary::{Boundary, RANGE};
use crate::stability::trial::BOUND;
use crate::stability::{Change, Outcome, StabilityReport, Trial};
use report::table::{self, BAD, BOLD, Cell, DIM, GOOD, ODD, header};

/// Writes the report.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, report: &StabilityReport) -> io::Result<()> {
    writeln!(
        out,
        "{BOLD}Hard cases{BOLD:#}: outcome by method and time step. Energy: its change over the run,\n\
         relative to the case's available energy; a rise by more than {BOUND} is a blow-up.\nEquation: the largest \
         residual of the method's own equation, relative to the\nbound from rounding and its tolerance."
    )?;
    for case in cases::all() {
        let trials: Vec<&Trial> =
            report.trials.iter().filter(|trial| trial.case == case.name).collect();
        if !trials.is_empty() {
            let steps = trials[0].steps;
            writeln!(out, "\n{BOLD}{}{BOLD:#}: {}\n  {steps} steps", case.name, case.about)?;
            write_trials(out, &trials)?;
        }
    }
    if !report.boundaries.is_empty() {
        let [low, high] = RANGE;
        writeln!(
            out,
            "\n{BOLD}Stability boundaries{BOLD:#}: the largest stable h ω, searched from {low:e} to {high:e};\nlong runs on \
             both sides confirm it"
        )?;
        write_boundaries(out, &report.boundaries)?;
    }
    if !report.amplifications.is_empty() {
        writeln!(
            out,
            "\n{BOLD}Amplification{BOLD:#} of an oscillation in a step, the damping ratio that the\nmethod adds, and \
             the error of its period"
        )?;
        write_amplifications(out, &report.amplifications)?;
    }
    write_summary(out, report)
}

fn write_trials(out: &mut dyn Write, trials: &[&Trial]) -> io::Result<()> {
    let names =
        ["method", "dt", "outcome", "energy", "momentum", "equation", "Newton", "linear", ""];
    let mut rows = vec![header(&names, 3..8)];
    rows[0][1] = Cell::right("dt").styled(DIM);
    for trial in trials {
        let measured = &trial.measured;
        let small = |value: f64| match value {
            0.0 => "0".to_owned(),
            value => format!("{value:.1e}"),
        };
        let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), small);
        let count = |value: u64| if value == 0 { "-".to_owned() } else { value.to_string() };
        let mut remark = String::new();
        let rescue = measured.rescue;
        if rescue.line_searched > 0 {
            remark += &format!("{} by line search ", rescue.line_searched);
        }
        if rescue.substepped > 0 {
            remark += &format!("{} in {} smaller steps", rescue.substepped, rescue.substeps);
        }
        if let Outcome::Wrong { check, excess } = &trial.outcome {
            remark = format!("{check}: {excess:.1e} times what is allowed");
        }
        let method = if trial.robust {
            format!("{} --robust", trial.method)
        } else {
            trial.method.to_owned()
        };
        rows.push(vec![
            Cell::left(method),
            Cell::right(decimal(trial.time_step)),
            outcome(&trial.outcome),
            Cell::right(small(measured.energy)),
            Cell::right(optional(measured.momentum)),
            Cell::right(optional(measured.equation)),
            Cell::right(count(measured.newton_iterations)),
            Cell::right(if measured.worst_residual == 0.0 {
                "-".to_owned()
            } else {
                small(measured.worst_residual)
            }),
            Cell::left(remark.trim_end().to_owned()),
        ]);
    }
    table::write(out, &rows)
}

/// A number, with an exponent only if needed.
fn decimal(value: f64) -> String {
    if (1e-4..1e4).contains(&value) { value.to_string() } else { format!("{value:e}") }
}

fn outcome(outcome: &Outcome) -> Cell {
    let word = match outcome.step() {
        Some(step) => format!("{} in step {step}", outcome.word()),
        None => outcome.word().to_owned(),
    };
    Cell::left(word).styled(match outcome {
        Outcome::Survived => GOOD,
        Outcome::Wrong { .. } => BAD,
        Outcome::BlowUp { .. } | Outcome::Failed { .. } => ODD,
    })
}

fn write_boundaries(out: &mut dyn Write, boundaries: &[Boundary]) -> io::Result<()> {
    let mut rows =
        vec![header(&["scene", "method", "theory", "measured", "off by", "steps", ""], 2..6)];
    let limit = |value: f64| match value {
        0.0 => "none is stable".to_owned(),
        value if value.is_infinite() => format!("all up to {:e}", RANGE[1]),
        value => format!("{value:.6}"),
    };
    for boundary in boundaries {
        let (steps, verdict) = match boundary.confirmed {
            Some((steps, true)) => (steps.to_string(), "decays below, grows above"),
            Some((steps, false)) => (steps.to_string(), "NOT confirmed"),
            None if boundary.exists() => {
                ("-".to_owned(), "grows too slowly above to be seen in a run")
            }
            None => ("-".to_owned(), ""),
        };
        let error = match boundary.error() {
            0.0 => "0".to_owned(),
            error => format!("{error:.0e}"),
        };
        let style = if boundary.agrees() { GOOD } else { BAD };
        rows.push(vec![
            Cell::left(boundary.scene.as_str()),
            Cell::left(boundary.method),
            Cell::right(limit(boundary.theory)),
            Cell::right(limit(boundary.measured)),
            Cell::right(error).styled(style),
            Cell::right(steps),
            Cell::left(verdict),
        ]);
    }
    table::write(out, &rows)
}

fn write_amplifications(out: &mut dyn Write, all: &[Amplification]) -> io::Result<()> {
    let names =
        ["method", "ζ", "h ω", "measured", "theory", "oscillator", "adds to ζ", "period off by"];
    let mut rows = vec![header(&names, 1..8)];
    for each in all {
        let optional = |value: Option<f64>, text: fn(f64) -> String| {
            value.map_or_else(|| "-".to_owned(), text)
        };
        rows.push(vec![
            Cell::left(each.method),
            Cell::right(each.zeta.to_string()),
            Cell::right(each.a.to_string()),
            Cell::right(size(each.measured)),
            Cell::right(size(each.theory)),
            Cell::right(size(each.exact)),
            Cell::right(optional(each.damping, |value| signed(value, 6))),
            Cell::right(optional(each.period, |value| signed(100.0 * value, 3) + " %")),
        ]);
    }
    table::write(out, &rows)
}

/// Nine decimals, of which rounding leaves fewer in a large value.
fn size(value: f64) -> String {
    if value < 10.0 { format!("{value:.9}") } else { format!("{value:.3}") }
}

/// A number with its sign, unless it rounds to zero.
fn signed(value: f64, digits: usize) -> String {
    let text = format!("{value:+.digits$}");
    let is_zero = text.chars().all(|letter| "+-0.".contains(letter));
    if is_zero { format!("{:.digits$}", 0.0) } else { text }
}

fn write_summary(out: &mut dyn Write, report: &StabilityReport) -> io::Result<()> {
    writeln!(out)?;
    for Change { key, expected, got } in &report.changes {
        let words = |outcome: &Option<Expected>| match outcome {
            Some(outcome) => outcome.to_string(),
            None => "nothing".to_owned(),
        };
        let robust = if key.robust { ", --robust" } else { "" };
        writeln!(
            out,
            "{BAD}changed{BAD:#}  {}, {}, dt = {}, {} steps{robust}: expected {}, got {}",
            key.case,
            key.method,
            key.time_step,
            key.steps,
            words(expected),
            words(got),
        )?;
    }
    let count = |word: fn(&Outcome) -> bool| {
        report.trials.iter().filter(|trial| !trial.robust && word(&trial.outcome)).count()
    };
    let plain = report.trials.iter().filter(|trial| !trial.robust).count();
    let survived = count(|outcome| matches!(outcome, Outcome::Survived));
    let blown = count(|outcome| matches!(outcome, Outcome::BlowUp { .. }));
    let failed = count(|outcome| matches!(outcome, Outcome::Failed { .. }));
    let wrong = report.trials.iter().filter(|trial| trial.outcome.is_wrong()).count();
    writeln!(
        out,
        "{plain} trials: {survived} survived, {blown} blew up, {failed} failed with a message, {wrong} silently wrong"
    )?;
    let again: Vec<&Trial> = report.trials.iter().filter(|trial| trial.robust).collect();
    if !again.is_empty() {
        let saved = again.iter().filter(|trial| trial.outcome == Outcome::Survived).count();
        writeln!(out, "--robust: {saved} of {} failed trials survive", again.len())?;
    }
    if !report.boundaries.is_empty() {
        let agree = report.boundaries.iter().filter(|boundary| boundary.agrees()).count();
        let worst = report.boundaries.iter().map(Boundary::error).fold(0.0, f64::max);
        let all = report.boundaries.len();
        writeln!(
            out,
            "{agree} of {all} boundaries agree with theory; the largest error is {worst:.0e}"
        )?;
    }
    match report.is_pass() {
        true => writeln!(out, "{GOOD}All is as expected.{GOOD:#}"),
        false if !report.changes.is_empty() => writeln!(
            out,
            "{BAD}{} outcomes differ from the expected ones.{BAD:#} To accept them: grade stability --accept",
            report.changes.len()
        ),
        false => writeln!(out, "{BAD}Some results are wrong.{BAD:#}"),
    }
}
