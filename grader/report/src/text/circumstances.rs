//! How a submission was judged and run.

use std::io::{self, Write};

use grader::compare::{Criteria, Tolerances};
use grader::grading::altered::Copied;
use grader::grading::provenance::Provenance;
use grader::grading::{Grading, Repetition, SceneResult};
use sandbox::Protection;

use super::Audience;
use crate::provenance::short_hash;
use crate::remarks;
use crate::table::{DIM, ODD};

/// Writes how it was judged and run, and remarks on its programs.
pub(crate) fn write_circumstances(
    out: &mut dyn Write,
    grading: &Grading,
    audience: Audience,
) -> io::Result<()> {
    write_criteria(out, grading)?;
    if let Some(taken) = &grading.taken {
        writeln!(out, "  {DIM}Taken from the hand-in: {}.{DIM:#}", taken.line())?;
    }
    if let (Some(protection), Audience::Graders) = (&grading.protection, audience) {
        write_protection(out, protection)?;
    }
    if let Some(repetition) = &grading.repetition {
        write_repetition(out, repetition)?;
    }
    if let Some(copied) = &grading.copied {
        write_copied(out, copied)?;
    }
    match &grading.provenance {
        Some(provenance) => write_provenance(out, provenance),
        None => Ok(()),
    }
}

/// Writes what a reader has to know of the circumstances.
pub(super) fn write_warnings(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    write_other_roots(out, grading)?;
    if let Some(taken) = &grading.taken {
        writeln!(out, "  {DIM}Taken from the hand-in: {}.{DIM:#}", taken.line())?;
    }
    if let Some(protection) = &grading.protection {
        write_unprotected(out, protection)?;
    }
    match &grading.copied {
        Some(copied) => write_copied(out, copied),
        None => Ok(()),
    }
}

/// Writes the grader and the start of the hashes of its inputs, which are in full in JSON and JUnit reports.
pub(crate) fn write_provenance(out: &mut dyn Write, provenance: &Provenance) -> io::Result<()> {
    let commit = provenance.commit.as_deref().map(|commit| {
        let modified = if commit.ends_with("-modified") { ", modified" } else { "" };
        format!("commit {}{modified}, ", short_hash(commit))
    });
    let rubric = provenance.rubric.as_deref().map_or("built in".to_owned(), short_hash);
    let also = |what: &str, hash: &Option<String>| {
        hash.as_deref().map_or_else(String::new, |hash| format!(", {what} {}", short_hash(hash)))
    };
    writeln!(
        out,
        "  {DIM}Graded by grade {} ({}{}); rubric {rubric}{}, scenes and oracle {}{}.{DIM:#}",
        env!("CARGO_PKG_VERSION"),
        commit.unwrap_or_default(),
        provenance.platform,
        also("pack", &provenance.pack),
        short_hash(&provenance.oracle()),
        also("hidden scenes", &provenance.hidden)
    )
}

/// Writes the protections that were in force, and those that were missing.
///
/// # Errors
/// If writing fails.
pub fn write_protection(out: &mut dyn Write, in_force: &[Protection]) -> io::Result<()> {
    if !in_force.is_empty() {
        let names: Vec<&str> = in_force.iter().map(|protection| protection.name()).collect();
        writeln!(out, "  {DIM}Run under protection: {}.{DIM:#}", names.join(", "))?;
    }
    write_unprotected(out, in_force)
}

/// Warns of the protections that were not in force.
pub(crate) fn write_unprotected(out: &mut dyn Write, in_force: &[Protection]) -> io::Result<()> {
    match missing(in_force).join(", ") {
        _ if in_force.is_empty() => writeln!(out, "  {ODD}Run without protection.{ODD:#}"),
        missing if missing.is_empty() => Ok(()),
        missing => writeln!(out, "  {ODD}Run without these protections: {missing}.{ODD:#}"),
    }?;
    if in_force.contains(&Protection::ClosedFolders) {
        writeln!(out, "  {ODD}Files were protected by {WEAKER} alone.{ODD:#}")?;
    }
    Ok(())
}

/// The protection of files where the kernel offers none.
pub const WEAKER: &str = "a user ID of its own and closed folders";

/// The names of the protections that were not in force.
pub(crate) fn missing(in_force: &[Protection]) -> Vec<&'static str> {
    let missing = Protection::ALL.into_iter().filter(|each| !in_force.contains(each));
    missing.map(Protection::name).collect()
}

/// Writes whether re-run scenes gave identical output.
fn write_repetition(out: &mut dyn Write, repetition: &Repetition) -> io::Result<()> {
    let Repetition { scenes, differing } = repetition;
    match differing.as_slice() {
        [] if *scenes == 0 => Ok(()),
        [] => {
            writeln!(out, "  {DIM}Deterministic: {scenes} scenes re-run, identical output.{DIM:#}")
        }
        _ => writeln!(
            out,
            "  {ODD}Not deterministic: {} of {scenes} re-run scenes gave different output: {}.{ODD:#}",
            differing.len(),
            differing.join(", ")
        ),
    }
}

/// Maximum number of altered copies that a text names.
const COPIES_SHOWN: usize = 6;

/// Warns of passed scenes that altered copies do not confirm.
fn write_copied(out: &mut dyn Write, copied: &Copied) -> io::Result<()> {
    writeln!(out, "  {ODD}{copied}.{ODD:#}")?;
    if copied.wrong.is_empty() {
        return Ok(());
    }
    let wrong = copied.wrong.iter().map(|(scene, verdict)| format!("{scene} ({verdict})"));
    let shown: Vec<String> = wrong.take(COPIES_SHOWN).collect();
    let more = match copied.wrong.len() - shown.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    writeln!(out, "  {DIM}Failed on altered copies of: {}{more}.{DIM:#}", shown.join(", "))
}

/// Writes the criteria by which the scenes were judged.
fn write_criteria(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    let scenes = || grading.features.iter().flat_map(|result| &result.scenes);
    let total = scenes().count();
    let calibrated = scenes().filter(|scene| matches!(scene.criteria, Criteria::Calibrated(_)));
    let is_same_root = |scene: &&SceneResult| scene.comparison.other_root.is_none();
    let used = calibrated.clone().filter(is_same_root).filter_map(|scene| scene.comparison.allowed);
    let used = used.map(|allowed| allowed.used).reduce(f64::max);
    let of = |count: usize| match count {
        count if count == total => "Judged".to_owned(),
        count => format!("{count} scenes judged"),
    };
    let count = calibrated.count();
    if count > 0 {
        let used = match used {
            Some(used) if used < 0.01 => "; every error is below 1 % of its tolerance".to_owned(),
            Some(used) if used <= 1.0 => {
                format!("; the largest error is {:.0} % of its tolerance", 100.0 * used)
            }
            _ => String::new(),
        };
        writeln!(out, "  {DIM}{} by calibrated tolerances{used}.{DIM:#}", of(count))?;
    }
    let mut fixed: Vec<(Tolerances, usize)> = Vec::new();
    for scene in scenes() {
        let Criteria::Fixed(tolerances) = scene.criteria else { continue };
        match fixed.iter_mut().find(|(known, _)| *known == tolerances) {
            Some((_, count)) => *count += 1,
            None => fixed.push((tolerances, 1)),
        }
    }
    for (tolerances @ Tolerances { largest, accumulated }, count) in fixed {
        let whose = if tolerances == Tolerances::COURSE {
            "the course's criteria"
        } else {
            "fixed tolerances"
        };
        writeln!(
            out,
            "  {DIM}{} by {whose}: each residual below {largest:e}, their sum below {accumulated:e}.{DIM:#}",
            of(count)
        )?;
    }
    write_other_roots(out, grading)
}

/// Writes the scenes that passed with another solution of the same equations.
fn write_other_roots(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    let others = remarks::scenes(grading).filter(|scene| scene.comparison.other_root.is_some());
    let names: Vec<&str> = others.map(|scene| scene.id.as_str()).collect();
    if names.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "  Passed with another solution of the same equations, as the rubric allows: {}.",
        names.join(", ")
    )
}
