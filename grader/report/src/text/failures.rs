//! Failed scenes in detail.

use std::io::{self, Write};

use anstyle::Style;
use diagnosis::findings::Diagnosis;
use grader::compare::FirstWrong;
use grader::grading::SceneResult;
use grader::verdict::number;

use super::{residual, style};
use crate::digits::{self, DiffLine, LineKind};
use crate::table::{BAD, BOLD, DIM, GOOD};

/// Explains the scenes that did not pass, at most `details` of them.
///
/// # Errors
/// If writing fails.
pub fn write_scenes<'a>(
    out: &mut dyn Write,
    scenes: impl Iterator<Item = &'a SceneResult>,
    details: usize,
) -> io::Result<()> {
    write_failed(out, scenes, details, usize::MAX)
}

pub(super) fn write_failed<'a>(
    out: &mut dyn Write,
    scenes: impl Iterator<Item = &'a SceneResult>,
    details: usize,
    width: usize,
) -> io::Result<()> {
    let not_passed = scenes.filter(|scene| !scene.comparison.verdict.is_pass());
    let failed: Vec<&SceneResult> =
        not_passed.filter(|scene| !scene.comparison.verdict.is_lack()).collect();
    // Merge scenes with the same message, such as those of a failed build.
    let mut groups: Vec<(&SceneResult, usize)> = Vec::new();
    for scene in &failed {
        let same = |(known, _): &&mut (&SceneResult, usize)| {
            let [known, scene] = [&known.comparison, &scene.comparison];
            known.verdict == scene.verdict && known.states == 0 && scene.states == 0
        };
        match groups.iter_mut().find(same) {
            Some((_, count)) => *count += 1,
            None => groups.push((scene, 1)),
        }
    }
    for (scene, count) in groups.iter().take(details) {
        write_failure(out, scene, width)?;
        if *count > 1 {
            writeln!(out, "  {DIM}and the same for {} more scenes{DIM:#}", count - 1)?;
        }
        writeln!(out)?;
    }
    let untold: usize = groups.iter().skip(details).map(|(_, count)| count).sum();
    if untold > 0 {
        writeln!(
            out,
            "{untold} more scenes did not pass; show all with --details {}.\n",
            groups.len()
        )?;
    }
    Ok(())
}

pub(crate) fn write_failure(
    out: &mut dyn Write,
    scene: &SceneResult,
    width: usize,
) -> io::Result<()> {
    let verdict = &scene.comparison.verdict;
    let style = style(verdict);
    let name = verdict.name().replace('-', " ");
    let message = verdict.to_string().replace('\n', "\n  ");
    writeln!(out, "{style}{name}{style:#}  {BOLD}{}{BOLD:#}  ({})", scene.id, scene.path)?;
    writeln!(out, "  {message}")?;
    if let Some(first) = &scene.comparison.first_wrong {
        write_first_wrong(out, first, width)?;
    }
    match &scene.diagnosis {
        Some(diagnosis) => write_diagnosis(out, diagnosis),
        None => Ok(()),
    }
}

fn write_diagnosis(out: &mut dyn Write, diagnosis: &Diagnosis) -> io::Result<()> {
    let Diagnosis { steps, causes, other_root, restarts, .. } = diagnosis;
    writeln!(out, "  Redoing each step from your own trace: {}", steps.words())?;
    if let Some(restarts) = restarts {
        writeln!(out, "  Running your program from the oracle's states: {}", restarts.words())?;
    }
    if let Some(step) = other_root {
        writeln!(out, "  Step {step} solves the same equation; another solution")?;
    }
    for cause in causes {
        writeln!(out, "  {BOLD}Cause (reproduces your trace): {cause}{BOLD:#}")?;
    }
    Ok(())
}

fn write_first_wrong(out: &mut dyn Write, first: &FirstWrong, width: usize) -> io::Result<()> {
    let FirstWrong { place, time, residual: size, tolerance, envelope, .. } = first;
    let origin = envelope.map_or_else(String::new, |envelope| {
        format!("; correct programs differ by up to {}", residual(envelope))
    });
    let what = if first.accumulated { "sum of residuals" } else { "residual" };
    let quantity = place.quantity.name();
    let coordinate = place.coordinate();
    writeln!(
        out,
        "  first wrong: step {}, t = {} s, particle {}, {coordinate} ({quantity} {what} {size:.1e}, \
         tolerance {tolerance:.0e}{origin})",
        place.step,
        number(*time),
        place.particle
    )?;
    write_digits(out, first, 4)?;
    let numbers = first.context.first().map_or(0, |row| row.expected.len());
    let names = if numbers == 6 { "x y z vx vy vz" } else { "x y vx vy" };
    let diff = |of| (digits::context(first, of), names);
    let is_wide = |(lines, _): &(Vec<DiffLine>, _)| {
        lines
            .iter()
            .any(|line| line.pieces.iter().map(|(text, _)| text.len()).sum::<usize>() + 4 > width)
    };
    let (positions, velocities) = names.split_at(names.find(" v").unwrap_or(names.len()));
    let whole = diff(0..numbers);
    let diffs = if is_wide(&whole) {
        let half = numbers / 2;
        let velocities = (digits::context(first, half..numbers), velocities.trim());
        vec![(digits::context(first, 0..half), positions), velocities]
    } else {
        vec![whole]
    };
    for (lines, columns) in diffs {
        writeln!(
            out,
            "  particle {} around that step: step, {columns} ({GOOD}-{GOOD:#} expected, {BAD}+{BAD:#} got)",
            place.particle
        )?;
        for line in lines {
            write_diff_line(out, line)?;
        }
    }
    Ok(())
}

/// Writes the number that is wrong first, with the digits marked that differ, indented by so many blanks.
pub(super) fn write_digits(
    out: &mut dyn Write,
    first: &FirstWrong,
    indent: usize,
) -> io::Result<()> {
    let coordinate = first.place.coordinate();
    let (expected, got) = (digits::full(first.expected), digits::full(first.got));
    let common = digits::common_prefix(&expected, &got);
    let marked = |text: &str, style: Style| {
        format!("{}{style}{}{style:#}", &text[..common], &text[common..])
    };
    writeln!(out, "{:indent$}expected  {coordinate:<2} = {}", "", marked(&expected, GOOD))?;
    writeln!(out, "{:indent$}got       {coordinate:<2} = {}", "", marked(&got, BAD))?;
    let differing = expected.chars().count().max(got.chars().count()) - common;
    writeln!(out, "{}{BAD}{}{BAD:#}", " ".repeat(indent + 15 + common), "^".repeat(differing))
}

fn write_diff_line(out: &mut dyn Write, line: DiffLine) -> io::Result<()> {
    let DiffLine { kind, pieces } = line;
    let (sign, style) = match kind {
        LineKind::Same => (' ', DIM),
        LineKind::Expected => ('-', GOOD),
        LineKind::Got => ('+', BAD),
    };
    write!(out, "  {style}{sign}{style:#} ")?;
    for (text, differs) in pieces {
        let style = if differs || kind == LineKind::Same { style } else { Style::new() };
        write!(out, "{style}{text}{style:#}")?;
    }
    writeln!(out)
}
