//! Text report of a black-box probe: a table of verdicts, then each mistake with its numbers.
//!
//! Always writes colours; the output stream strips them if needed.

use std::io::{self, Write};

use anstyle::{AnsiColor, Style};

use crate::digits::full;
use crate::table::{self, Cell};
use grader::probe::{self, Entry, Finding, PartReport, Probing, Space, Verdict};

const BOLD: Style = Style::new().bold();
const DIM: Style = Style::new().dimmed();
const GOOD: Style = AnsiColor::Green.on_default();
const BAD: Style = AnsiColor::Red.on_default().bold();
const ODD: Style = AnsiColor::Yellow.on_default().bold();

/// Options of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeTextOptions {
    /// Also show correct parts in detail.
    pub details: bool,
}

/// Writes the report.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, probing: &Probing, config: ProbeTextOptions) -> io::Result<()> {
    write_brief(out, probing)?;
    for part in &probing.parts {
        let well = matches!(part.verdict(), Verdict::Correct | Verdict::NotOffered);
        let told = if well { config.details } else { true };
        if told {
            write_part(out, part, config)?;
        }
    }
    write_summary(out, probing)
}

/// Writes the table alone.
///
/// # Errors
/// If writing fails.
pub fn write_brief(out: &mut dyn Write, probing: &Probing) -> io::Result<()> {
    writeln!(
        out,
        "{BOLD}Forces and Jacobians{BOLD:#} that the steps of {} use",
        probing.name.line()
    )?;
    for space in &probing.spaces {
        write_space(out, space)?;
    }
    write_table(out, probing)
}

fn write_space(out: &mut dyn Write, space: &Space) -> io::Result<()> {
    let name = dimension(space.dimension.count());
    match (&space.explicit, &space.implicit) {
        (Ok(explicit), Ok(implicit)) => {
            writeln!(out, "  {name}: forces by {explicit}, Jacobians by {implicit}")
        }
        (Ok(explicit), Err(failure)) => writeln!(
            out,
            "  {name}: forces by {explicit}; linearized implicit Euler is not offered: {failure}"
        ),
        (Err(failure), _) => writeln!(out, "  {name}: not offered: {failure}"),
    }
}

fn dimension(count: usize) -> &'static str {
    if count == 2 { "2D" } else { "3D" }
}

fn write_table(out: &mut dyn Write, probing: &Probing) -> io::Result<()> {
    let names = ["force", "part", "", "force", "step"];
    let blocks = ["dF/dx", "cross", "dF/dv", "cross"];
    let header = names.iter().chain(&blocks).map(|name| Cell::left(*name).styled(DIM));
    let mut rows = vec![header.collect::<Vec<Cell>>()];
    for part in &probing.parts {
        let mut row = vec![
            Cell::left(part.force),
            Cell::left(part.part),
            Cell::left(dimension(part.dimension.count())),
        ];
        row.extend(part.findings().map(|(_, finding)| cell(finding)));
        rows.push(row);
    }
    table::write(out, &rows)
}

fn cell(finding: &Finding) -> Cell {
    match finding.verdict {
        Verdict::Correct => Cell::left("correct").styled(GOOD),
        Verdict::NotOffered => Cell::left("-").styled(DIM),
        Verdict::Inconclusive => Cell::left("inconcl.").styled(ODD),
        Verdict::Wrong => Cell::left("WRONG").styled(BAD),
    }
}

fn write_part(out: &mut dyn Write, part: &PartReport, config: ProbeTextOptions) -> io::Result<()> {
    writeln!(out)?;
    let space = dimension(part.dimension.count());
    writeln!(out, "{BOLD}{}, {}{BOLD:#} ({}, {space})", part.force, part.part, part.meaning)?;
    for line in &part.diagnosis {
        writeln!(out, "  {BAD}likely mistake:{BAD:#} {line}")?;
    }
    for (name, finding) in part.findings() {
        let told = match finding.verdict {
            Verdict::Wrong | Verdict::Inconclusive => true,
            Verdict::Correct | Verdict::NotOffered => config.details,
        };
        if told {
            write_finding(out, part, name, finding)?;
        }
    }
    if let (Verdict::Wrong | Verdict::Inconclusive, Some(replay)) = (part.verdict(), &part.replay) {
        write_state(out, part, replay.state)?;
    }
    Ok(())
}

fn write_finding(
    out: &mut dyn Write,
    part: &PartReport,
    name: &str,
    finding: &Finding,
) -> io::Result<()> {
    let style = match finding.verdict {
        Verdict::Correct => GOOD,
        Verdict::NotOffered => DIM,
        Verdict::Inconclusive => ODD,
        Verdict::Wrong => BAD,
    };
    write!(out, "  {style}{}{style:#}: {}", name, finding.verdict.name())?;
    if !finding.reason.is_empty() {
        write!(out, ": {}", finding.reason)?;
    }
    match (finding.error, finding.bound) {
        (Some(error), Some(bound)) => writeln!(
            out,
            "; off by {error:.1e} of the largest entry, of which noise explains up to {bound:.1e}"
        )?,
        (Some(error), None) => {
            writeln!(out, "; residual of its equations: {error:.1e} of the largest term")?;
        }
        _ => writeln!(out)?,
    }
    match (&finding.worst, finding.verdict) {
        (Some(entry), Verdict::Wrong | Verdict::Inconclusive) => write_entry(out, part, entry),
        _ => Ok(()),
    }
}

fn write_entry(out: &mut dyn Write, part: &PartReport, entry: &Entry) -> io::Result<()> {
    let axis = |axis: usize| ["x", "y", "z"][axis.min(2)];
    let (particle, along) = entry.row;
    let Entry { state, measured, expected, ours, bound, .. } = entry;
    match entry.column {
        None => {
            writeln!(
                out,
                "    near state {state}, the force on particle {particle} along {}:",
                axis(along)
            )?;
            writeln!(out, "      program {}", full(*measured))?;
            writeln!(out, "      ours    {:<24}  bound of noise {bound:.1e}", full(*expected))
        }
        Some((other, by)) => {
            writeln!(
                out,
                "    state {state}, the force on particle {particle} along {} by particle {other} along {}:",
                axis(along),
                axis(by)
            )?;
            writeln!(out, "      its steps use          {}", full(*measured))?;
            writeln!(
                out,
                "      differences of its own {:<24}  bound of noise {bound:.1e}",
                full(*expected)
            )?;
            writeln!(out, "      ours                   {}", full(*ours))?;
            write_blocks(out, part, entry)
        }
    }
}

/// Writes the block of the worst entry, as the steps use it and as differences of the force give it, side by side.
fn write_blocks(out: &mut dyn Write, part: &PartReport, entry: &Entry) -> io::Result<()> {
    let count = part.dimension.count();
    let Some(block) = &entry.block else { return Ok(()) };
    let rows = block[0].chunks_exact(count).zip(block[1].chunks_exact(count));
    for (number, (measured, expected)) in rows.enumerate() {
        let line = |values: &[f64]| {
            let texts: Vec<String> = values.iter().map(|value| format!("{value:>13.6e}")).collect();
            texts.join(" ")
        };
        let [open, close] = if number == 0 { ["its steps", "its force"] } else { ["", ""] };
        writeln!(out, "      {open:<9} {}    {close:<9} {}", line(measured), line(expected))?;
    }
    Ok(())
}

fn write_state(out: &mut dyn Write, part: &PartReport, number: usize) -> io::Result<()> {
    let Some((positions, velocities)) = probe::state(part.dimension, number) else {
        return Ok(());
    };
    let count = part.dimension.count();
    let vectors = |values: &[f64]| -> String {
        let particles = values.chunks_exact(count);
        let texts: Vec<String> = particles
            .map(|vector| {
                let numbers: Vec<String> = vector.iter().map(f64::to_string).collect();
                format!("({})", numbers.join(", "))
            })
            .collect();
        texts.join(" ")
    };
    writeln!(out, "  state {number}: positions  {}", vectors(&positions))?;
    let indent = " ".repeat(8 + number.to_string().len());
    writeln!(out, "  {indent} velocities {}", vectors(&velocities))?;
    writeln!(out, "  {DIM}--format json holds the scenes that show it{DIM:#}")
}

fn write_summary(out: &mut dyn Write, probing: &Probing) -> io::Result<()> {
    writeln!(out)?;
    let count = |wanted: Verdict| {
        let findings = probing.parts.iter().flat_map(PartReport::findings);
        findings.filter(|(_, finding)| finding.verdict == wanted).count()
    };
    let (correct, wrong) = (count(Verdict::Correct), count(Verdict::Wrong));
    let (unsure, missing) = (count(Verdict::Inconclusive), count(Verdict::NotOffered));
    let lacking = probing.missing().join(", ");
    let (style, text) = match probing.verdict() {
        Verdict::Wrong => (BAD, "Something is wrong.".to_owned()),
        _ if probing.counts().1 == 0 => (BAD, "Nothing could be measured.".to_owned()),
        _ if !lacking.is_empty() => (BAD, format!("Required, but not offered: {lacking}.")),
        Verdict::Inconclusive => {
            (ODD, "No mistake found; some results are inconclusive.".to_owned())
        }
        Verdict::Correct | Verdict::NotOffered => {
            (GOOD, "All that is offered is correct.".to_owned())
        }
    };
    writeln!(
        out,
        "  {style}{text}{style:#} {correct} correct, {wrong} wrong, {unsure} inconclusive, {missing} not offered"
    )
}
