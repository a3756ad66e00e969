//! Text report of Jacobian checks: a table of blocks, a table of properties, and the two blocks of each error side by
//! side.

use std::io::{self, Write};

use anstyle::Style;

use super::{axis, measured, words};
use crate::table::{self, BAD, BOLD, Cell, DIM, GOOD, ODD, header};
use grader::white_box::{
    BlockFinding, CheckState, Difference, Entry, Exhibit, JacobianCheck, JacobianReport,
    NewtonCheck, Taylor, Verdict,
};
use scene::schema::Stencil;

/// Options of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JacobianTextOptions {
    /// Show both blocks side by side for every verdict, not only for those that are not correct.
    pub details: bool,
}

/// Writes the report.
///
/// # Errors
/// If writing fails.
pub fn write(
    out: &mut dyn Write,
    report: &JacobianReport,
    config: JacobianTextOptions,
) -> io::Result<()> {
    let JacobianReport { forces: checks, newton } = report;
    writeln!(
        out,
        "{BOLD}Blocks{BOLD:#} of each force's Jacobians: the largest error by differences and by\n\
         dual numbers, relative to the block's largest entry; the slope of Taylor's test;\n\
         states with evidence"
    )?;
    write_blocks(out, checks)?;
    writeln!(out, "\n{BOLD}Properties{BOLD:#}: the largest violation, relative")?;
    write_properties(out, checks)?;
    if !newton.is_empty() {
        writeln!(
            out,
            "\n{BOLD}Newton systems{BOLD:#}: each iteration's matrix against differences of its residual"
        )?;
        write_newton(out, newton)?;
    }
    for check in checks {
        for finding in &check.blocks {
            let odd = !finding.verdict.is_correct();
            if let (true, Some(exhibit)) = (odd || config.details, &finding.exhibit) {
                writeln!(out)?;
                write_exhibit(out, check, finding, exhibit)?;
            }
        }
        for finding in check.properties.iter().filter(|finding| finding.verdict == Verdict::Wrong) {
            if let (Some(error), Some(state)) = (finding.error, &finding.state) {
                writeln!(out)?;
                let (name, meaning) = (finding.property.name(), finding.property.meaning());
                title(out, check, &format!("{name} ({meaning})"), finding.verdict)?;
                writeln!(out, "  off by {} at the state \"{}\"", measured(error), state.name)?;
                write_state(out, state)?;
            }
        }
    }
    writeln!(out)?;
    write_summary(out, report)
}

/// Writes one line per force and dimension, as part of a larger report.
///
/// # Errors
/// If writing fails.
pub(crate) fn write_brief(out: &mut dyn Write, checks: &[JacobianCheck]) -> io::Result<()> {
    writeln!(
        out,
        "{BOLD}Jacobians{BOLD:#} against differences of the force: largest relative error of direct and\n\
         cross blocks; rules such as symmetry that hold. `grade jacobians` shows more."
    )?;
    let names = ["force", "", "dF/dx", "cross", "dF/dv", "cross", "rules", "verdict"];
    let mut rows = vec![header(&names, 2..7)];
    for check in checks {
        let mut row = vec![Cell::left(check.tag), dimension(check)];
        row.extend(check.blocks.iter().map(|finding| match (&finding.exhibit, finding.verdict) {
            (_, Verdict::CorrectZero) => Cell::right("zero"),
            (Some(exhibit), _) => Cell::right(error(exhibit)),
            (None, _) => Cell::right("-"),
        }));
        let asked =
            || check.properties.iter().filter(|each| each.verdict != Verdict::NotApplicable);
        let hold = asked().filter(|finding| finding.verdict.is_correct()).count();
        row.push(Cell::right(format!("{hold}/{}", asked().count())));
        row.push(match (check.is_pass(), check.is_wrong()) {
            (true, _) => Cell::left("correct").styled(GOOD),
            (_, true) => Cell::left("WRONG").styled(BAD),
            _ => Cell::left("inconclusive").styled(ODD),
        });
        rows.push(row);
    }
    table::write(out, &rows)
}

fn error(exhibit: &Exhibit) -> String {
    let error = exhibit.relative_error().value;
    if error == 0.0 { "0".to_owned() } else { format!("{error:.1e}") }
}

fn dimension(check: &JacobianCheck) -> Cell {
    Cell::left(format!("{}D", check.dimension.count()))
}

fn verdict_cell(verdict: Verdict) -> Cell {
    Cell::left(words(verdict)).styled(style(verdict))
}

fn style(verdict: Verdict) -> Style {
    match verdict {
        Verdict::Correct | Verdict::CorrectZero => GOOD,
        Verdict::Wrong => BAD,
        Verdict::Inconclusive(_) => ODD,
        Verdict::NotApplicable => DIM,
    }
}

fn write_blocks(out: &mut dyn Write, checks: &[JacobianCheck]) -> io::Result<()> {
    let names = ["force", "", "block", "differences", "dual", "slope", "evidence", "verdict"];
    let mut rows = vec![header(&names, 3..7)];
    for check in checks {
        for finding in &check.blocks {
            let mut row =
                vec![Cell::left(check.tag), dimension(check), Cell::left(finding.kind.name())];
            let shown =
                finding.exhibit.as_ref().filter(|_| finding.verdict != Verdict::CorrectZero);
            row.extend(match shown {
                Some(exhibit) => [
                    Cell::right(measured(exhibit.relative_error())),
                    Cell::right(dual_error(exhibit)),
                    Cell::right(slope(&exhibit.worst_entry().taylor)),
                ],
                None => ["-"; 3].map(Cell::right),
            });
            row.push(Cell::right(format!("{}/{}", finding.evidence, check.states)));
            row.push(verdict_cell(finding.verdict));
            rows.push(row);
        }
    }
    table::write(out, &rows)
}

fn dual_error(exhibit: &Exhibit) -> String {
    let Entry { analytic, second, .. } = exhibit.worst_entry();
    match second {
        Some(dual) => {
            let size = if exhibit.size > 0.0 { exhibit.size } else { 1.0 };
            let error = (analytic - dual.value).abs() / size;
            if error == 0.0 { "0".to_owned() } else { format!("{error:.1e}") }
        }
        None => "-".to_owned(),
    }
}

fn slope(taylor: &Taylor) -> String {
    match taylor {
        Taylor::Consistent(window) | Taylor::Wrong(window) => format!("{:.2}", window.slope),
        Taylor::Linear => "linear".to_owned(),
        Taylor::Undecided => "-".to_owned(),
    }
}

fn write_properties(out: &mut dyn Write, checks: &[JacobianCheck]) -> io::Result<()> {
    let mut rows =
        vec![header(&["force", "", "property", "violation", "evidence", "verdict"], 3..5)];
    for check in checks {
        for finding in &check.properties {
            if finding.verdict == Verdict::NotApplicable {
                continue;
            }
            rows.push(vec![
                Cell::left(check.tag),
                dimension(check),
                Cell::left(finding.property.name()),
                Cell::right(finding.error.map_or_else(|| "-".to_owned(), measured)),
                Cell::right(format!("{}/{}", finding.evidence, check.states)),
                verdict_cell(finding.verdict),
            ]);
        }
    }
    table::write(out, &rows)
}

fn write_newton(out: &mut dyn Write, newton: &[NewtonCheck]) -> io::Result<()> {
    let names = ["scene", "integrator", "systems", "largest error", "verdict"];
    let mut rows = vec![header(&names, 2..4)];
    for check in newton {
        rows.push(vec![
            Cell::left(check.scene),
            Cell::left(check.integrator),
            Cell::right(format!("{}/{}", check.evidence, check.systems)),
            Cell::right(check.error.map_or_else(|| "-".to_owned(), measured)),
            verdict_cell(check.verdict),
        ]);
    }
    table::write(out, &rows)
}

fn title(
    out: &mut dyn Write,
    check: &JacobianCheck,
    what: &str,
    verdict: Verdict,
) -> io::Result<()> {
    let style = style(verdict);
    let (tag, dimension) = (check.tag, check.dimension.count());
    writeln!(out, "{style}{}{style:#}  {BOLD}{tag} {dimension}D, {what}{BOLD:#}", words(verdict))
}

fn write_exhibit(
    out: &mut dyn Write,
    check: &JacobianCheck,
    finding: &BlockFinding,
    exhibit: &Exhibit,
) -> io::Result<()> {
    title(out, check, finding.kind.name(), finding.verdict)?;
    if !finding.unseen.is_empty() {
        writeln!(out, "  no effect seen of: {}", finding.unseen.join(", "))?;
    }
    let dimension = check.dimension.count();
    let Exhibit { row, column, worst, .. } = *exhibit;
    writeln!(
        out,
        "  force on particle {row} by particle {column}, at the state \"{}\"; largest error in row {}, column {}: {}",
        exhibit.state.name,
        axis(worst / dimension),
        axis(worst % dimension),
        measured(exhibit.relative_error()),
    )?;
    let mut rows = Vec::new();
    for (title, value) in columns() {
        for line in 0..dimension {
            let mut cells =
                vec![Cell::left(if line == 0 { title } else { "" }), Cell::left(axis(line))];
            for place in line * dimension..(line + 1) * dimension {
                let cell = Cell::right(value(&exhibit.entries[place]));
                let is_wrong = finding.verdict == Verdict::Wrong && place == worst;
                cells.push(if is_wrong { cell.styled(BAD) } else { cell });
            }
            rows.push(cells);
        }
    }
    table::write_unnamed(out, &rows)?;
    write_taylor(out, &exhibit.worst_entry().taylor)?;
    write_state(out, &exhibit.state)
}

type Column = (&'static str, fn(&Entry) -> String);

fn columns() -> [Column; 3] {
    [
        ("analytic", |entry| format!("{:.15e}", entry.analytic)),
        ("differences", |entry| match entry.difference {
            Difference::Smooth(estimate) => {
                format!("{:.15e} ± {:.0e}", estimate.value, estimate.uncertainty)
            }
            Difference::Kink => "kink".to_owned(),
            Difference::Unavailable => "-".to_owned(),
        }),
        ("dual numbers", |entry| match entry.second {
            Some(estimate) => format!("{:.15e}", estimate.value),
            None => "-".to_owned(),
        }),
    ]
}

fn write_taylor(out: &mut dyn Write, taylor: &Taylor) -> io::Result<()> {
    match taylor {
        Taylor::Consistent(window) | Taylor::Wrong(window) => {
            let (low, high) = window.steps;
            let (slope, count) = (window.slope, window.count);
            let means = match taylor {
                Taylor::Wrong(_) => "a wrong entry gives 1",
                _ => "a correct entry gives 2 or more",
            };
            writeln!(
                out,
                "  Taylor: slope {slope:.3} over {count} steps from {high:.1e} to {low:.1e} ({means})"
            )
        }
        Taylor::Linear => writeln!(out, "  Taylor: the remainder is rounding error at every step"),
        Taylor::Undecided => writeln!(out, "  Taylor: no range of steps shows a slope"),
    }
}

fn write_state(out: &mut dyn Write, state: &CheckState) -> io::Result<()> {
    let numbers = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(f64::to_string).collect();
        texts.join(" ")
    };
    writeln!(out, "  {DIM}m{DIM:#} {}", numbers(&state.masses()))?;
    writeln!(out, "  {DIM}x{DIM:#} {}", numbers(&state.positions()))?;
    writeln!(out, "  {DIM}v{DIM:#} {}", numbers(&state.velocities()))?;
    for force in &state.scene.forces {
        let mut text = format!("<{}", force.schema.tag);
        let attributes = match force.schema.stencil {
            Stencil::Edge => &["i", "j"],
            stencil => stencil.attributes(),
        };
        for (attribute, particle) in attributes.iter().zip(&force.particles) {
            text += &format!(" {attribute}={particle}");
        }
        for (parameter, value) in force.schema.parameters.iter().zip(&force.parameters) {
            text += &format!(" {}={value}", parameter.name);
        }
        writeln!(out, "  {text}> at t = {}", state.time)?;
    }
    Ok(())
}

fn write_summary(out: &mut dyn Write, report: &JacobianReport) -> io::Result<()> {
    let (correct, asked) = report.counts();
    let wrong = report.verdicts().filter(|verdict| *verdict == Verdict::Wrong).count();
    let open = asked - correct - wrong;
    let style = match (wrong, open) {
        (0, 0) => GOOD,
        (0, _) => ODD,
        _ => BAD,
    };
    writeln!(
        out,
        "{style}{correct} of {asked} verdicts are correct, {wrong} wrong, {open} inconclusive{style:#}"
    )
}
