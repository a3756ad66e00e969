//! Text of one scene in full: its findings, its first wrong step, and the equation of that step with the numbers put in.

use std::io::{self, Write};

use diagnosis::explanation::{Balance, Explanation};
use diagnosis::findings::Finding;
use grader::grading::{Grading, SceneResult};

use crate::table::{self, BOLD, Cell, DIM};
use crate::text;
use crate::wrap::wrap;

/// Writes the explanation of a scene.
///
/// # Errors
/// If writing fails.
pub fn write(
    out: &mut dyn Write,
    grading: &Grading,
    scene: &SceneResult,
    width: usize,
) -> io::Result<()> {
    let mut text = Vec::new();
    write_lines(&mut text, grading, scene, width)?;
    out.write_all(wrap(&String::from_utf8_lossy(&text), width).as_bytes())
}

fn write_lines(
    out: &mut dyn Write,
    grading: &Grading,
    scene: &SceneResult,
    width: usize,
) -> io::Result<()> {
    if scene.comparison.verdict.is_pass() {
        return writeln!(out, "{}: passed; there is nothing to explain.", scene.id);
    }
    let list = &grading.findings.list;
    let here: Vec<_> = list.iter().filter(|finding| finding.scenes.contains(&scene.id)).collect();
    match here.as_slice() {
        [] => writeln!(out, "{BOLD}Findings{BOLD:#} in this scene: none that is certain")?,
        here => {
            writeln!(out, "{BOLD}Findings{BOLD:#} in this scene")?;
            for finding in here {
                writeln!(out, "  {finding}")?;
            }
            for note in Finding::notes(here.iter().copied()) {
                writeln!(out, "    {DIM}{note}{DIM:#}")?;
            }
        }
    }
    writeln!(out)?;
    text::write_failure(out, scene, width)?;
    let explanation = scene.diagnosis.as_ref().and_then(|d| d.explanation.as_ref());
    match explanation {
        Some(explanation) => write_step(out, explanation),
        None => writeln!(out, "\n  No wrong step could be examined."),
    }
}

fn write_step(out: &mut dyn Write, explanation: &Explanation) -> io::Result<()> {
    let Explanation { step, time, particle, before, after, right, balance } = explanation;
    writeln!(out)?;
    writeln!(
        out,
        "{BOLD}Step {step}{BOLD:#}, from t = {time}, particle {particle}, from your own state before it"
    )?;
    let axes = before[0].len();
    let mut rows = vec![components("", axes)];
    let mut add = |name: &str, state: &[Vec<f64>; 2]| {
        rows.push(numbers(&format!("x {name}"), &state[0]));
        rows.push(numbers(&format!("v {name}"), &state[1]));
    };
    add("before", before);
    add("after, yours", after);
    if let Some(right) = right {
        add("after, right", right);
    }
    table::write_unnamed(out, &rows)?;
    match balance {
        Some(balance) => write_balance(out, balance, axes),
        None => Ok(()),
    }
}

fn write_balance(out: &mut dyn Write, balance: &Balance, axes: usize) -> io::Result<()> {
    writeln!(out)?;
    writeln!(
        out,
        "{BOLD}The equation of this step{BOLD:#} with your numbers: {}",
        balance.equation
    )?;
    let mut rows = vec![components("", axes)];
    let mut add = |name: &str, right: &[f64], with: Option<&[f64]>| {
        rows.push(numbers(name, right));
        rows.extend(
            with.filter(|with| *with != right).map(|with| numbers("  with the mistake", with)),
        );
    };
    add("M (v' − v)", &balance.inertia, None);
    for one in &balance.terms {
        let is_there = |values: &[f64]| values.iter().any(|value| *value != 0.0);
        let with = one.with_mistakes.as_deref();
        if is_there(&one.right) || with.is_some_and(is_there) {
            add(&one.name, &one.right, with);
        }
    }
    add("sum, 0 up to rounding if right", &balance.rest, balance.rest_with_mistakes.as_deref());
    table::write_unnamed(out, &rows)?;
    if balance.moves_otherwise {
        table::write_unnamed(out, &[numbers("off the rule for x'", &balance.drift)])?;
    }
    Ok(())
}

fn components(name: &str, axes: usize) -> Vec<Cell> {
    let mut row = vec![Cell::left(name)];
    row.extend(["x", "y", "z"][..axes].iter().map(|axis| Cell::right(*axis).styled(DIM)));
    row
}

fn numbers(name: &str, values: &[f64]) -> Vec<Cell> {
    let mut row = vec![Cell::left(name)];
    row.extend(values.iter().map(|value| Cell::right(format!("{value:.6e}"))));
    row
}
