//! Text for people.

use std::io::{self, Write};

use grader::compare::FirstWrong;
use report::wrap::wrap;

use super::{sentence, size_of, sizes};
use crate::campaign::{Campaign, Discovery, Tally};
use crate::judge::Nothing;

/// Writes the report of a run of `name`, in lines of at most `width` characters.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, name: &str, campaign: &Campaign, width: usize) -> io::Result<()> {
    let mut text = Vec::new();
    write_lines(&mut text, name, campaign)?;
    out.write_all(wrap(&String::from_utf8_lossy(&text), width).as_bytes())
}

fn write_lines(out: &mut dyn Write, name: &str, campaign: &Campaign) -> io::Result<()> {
    let Campaign { seed, tally, discoveries, further, .. } = campaign;
    writeln!(out, "{name}: {}", summary(tally, *seed))?;
    for (number, discovery) in discoveries.iter().enumerate() {
        writeln!(out)?;
        write_discovery(out, number + 1, discovery)?;
    }
    if *further > 0 {
        writeln!(
            out,
            "\n{further} further kinds of failures were not shrunk. Correct these first."
        )?;
    }
    Ok(())
}

/// The counts of a run in a sentence.
pub fn summary(tally: &Tally, seed: u64) -> String {
    let seconds = tally.time.as_secs_f64();
    let rate = tally.scenes as f64 / seconds.max(1e-9);
    let mut parts = vec![format!("{} right", tally.right), format!("{} wrong", tally.wrong)];
    if tally.refused > 0 {
        parts.push(format!("{} refused", tally.refused));
    }
    for (reason, count) in &tally.nothing {
        let words = match reason {
            Nothing::NoAnswer => "without an answer",
            Nothing::Sensitive => "in which right programs differ much",
            Nothing::Explodes => "that explode",
            Nothing::Degenerate => "with particles in one place",
            Nothing::Slow => "in which Newton's method is slow",
            Nothing::OtherRoot => "with another root",
            Nothing::Close => "too close to tell",
        };
        parts.push(format!("{count} {words}"));
    }
    let mut served = String::new();
    if tally.served + tally.unlike + tally.right_served > 0 {
        served += &format!("; {} of them served", tally.served);
    }
    if tally.unlike > 0 {
        served += &format!(
            ", and {} right by a run of their own alone: the program keeps something from one scene to the next",
            tally.unlike
        );
    }
    if tally.right_served > 0 {
        served += &format!(
            ", and {} right only when served: the program answers otherwise with --serve than by itself",
            tally.right_served
        );
    }
    let first = match tally.first {
        Some((scenes, time)) => {
            format!("; the first failure after {scenes} scenes, {:.1} s", time.as_secs_f64())
        }
        None => String::new(),
    };
    format!(
        "{} scenes in {seconds:.1} s ({rate:.0} a second), seed {seed}: {}{served}; {} pairs of features and circumstances{first}",
        tally.scenes,
        parts.join(", "),
        tally.covered,
    )
}

fn write_discovery(out: &mut dyn Write, number: usize, discovery: &Discovery) -> io::Result<()> {
    let Discovery { proven, count, original, shrunk, .. } = discovery;
    let proof = proven.as_ref().map(|finding| format!(" ({})", finding.evidence()));
    let proof = proof.unwrap_or_default();
    writeln!(out, "{number}. {}{proof}", sentence(discovery))?;
    let size = sizes(size_of(&shrunk.scene));
    if shrunk.runs == 0 {
        writeln!(out, "   one of {count} such scenes: {size}")?;
    } else {
        writeln!(
            out,
            "   smallest scene: {size}; shrunk from {}, one of {count} such scenes, in {} runs",
            sizes(*original),
            shrunk.runs
        )?;
    }
    write_scene(out, discovery)
}

/// Writes the smallest scene for which a scene of the suite was shrunk, in lines of at most `width` characters.
///
/// # Errors
/// If writing fails.
pub fn write_smallest(out: &mut dyn Write, discovery: &Discovery, width: usize) -> io::Result<()> {
    let mut text = Vec::new();
    let size = sizes(size_of(&discovery.shrunk.scene));
    let how = if discovery.proven.is_some() { "by this cause" } else { "in the same way" };
    writeln!(
        text,
        "Smallest scene that fails {how}: {size}; shrunk from {}",
        sizes(discovery.original)
    )?;
    writeln!(text, "   {}", sentence(discovery))?;
    write_scene(&mut text, discovery)?;
    writeln!(text)?;
    out.write_all(wrap(&String::from_utf8_lossy(&text), width).as_bytes())
}

/// Writes the first wrong number of the smallest scene, its symmetries, and its file.
fn write_scene(out: &mut dyn Write, discovery: &Discovery) -> io::Result<()> {
    let Discovery { possible, shrunk, text, broken, .. } = discovery;
    match &shrunk.wrong.comparison.first_wrong {
        Some(first) => write_first(out, first)?,
        None => writeln!(out, "   {}", shrunk.wrong.failure)?,
    }
    if let Some(finding) = possible {
        let words = finding.sentence();
        writeln!(out, "   in this scene alone, your numbers are those of: {words}")?;
    }
    for symmetry in broken {
        writeln!(out, "   {}", symmetry.broken())?;
    }
    let shown = text.replace('\t', "\\t").replace("\r\n", "\\r\n").replace('\r', "\\r\n");
    if shown != *text {
        writeln!(out, "   in the file, \\t is a tab, and \\r a carriage return")?;
    }
    for line in shown.lines() {
        writeln!(out, "     {line}")?;
    }
    Ok(())
}

fn write_first(out: &mut dyn Write, first: &FirstWrong) -> io::Result<()> {
    let FirstWrong { place, expected, got, tolerance, .. } = first;
    writeln!(out, "   first wrong number: {place}")?;
    writeln!(out, "     expected  {expected}")?;
    writeln!(out, "     got       {got}")?;
    writeln!(
        out,
        "     tolerance {tolerance:.1e}, measured as the difference between right programs"
    )
}
