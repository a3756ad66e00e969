//! Writes the results as a Markdown document.

use std::fmt::Write;

use grader::white_box::{BlockKind, JacobianCheck, Property, Verdict};

use super::{Judged, broken, mistakes, originals, variants};

const INTRODUCTION: &str = "\
# What the Jacobian check finds

`grade jacobians` calls each block of each force's Jacobians correct, wrong or inconclusive. This page shows
that the verdicts are reliable. The first table lists the forces as they are, the second one mistakes that were
planted in their Jacobians, the third one correct Jacobians that were computed by other formulas. A mistake must be
called wrong in the blocks that it affects, in two and in three dimensions, and in no other block. A correct
variant must never be called wrong.

Errors are relative to the block's largest entry, and were measured by differences of the force.
[internals.md](internals.md) explains how a verdict is reached.

The page is written by `UPDATE_DOCS=1 cargo test --release -p grader jacobians`; without the variable, the
test fails if the page is out of date.
";

/// The document.
pub(crate) fn markdown() -> String {
    let mut text = INTRODUCTION.to_owned();
    text.push_str(
        "\n## Forces as they are\n\nIn brackets: the uncertainty of the differences, at the worst state. Where a body is in one place, its damping is smaller than their
noise.\n\n",
    );
    let names = BlockKind::ALL.map(BlockKind::name).join(" | ");
    let _ = writeln!(
        text,
        "| force | | {names} | properties |\n| --- | --- | --- | --- | --- | --- | ---: |"
    );
    for check in originals() {
        let blocks: Vec<String> = check
            .blocks
            .iter()
            .map(|finding| match (&finding.exhibit, finding.verdict) {
                (Some(exhibit), Verdict::Correct) => {
                    format!("correct ({:.0e})", exhibit.relative_error().uncertainty)
                }
                (_, Verdict::CorrectZero) => "zero".to_owned(),
                (_, verdict) => verdict.name().to_owned(),
            })
            .collect();
        let asked =
            || check.properties.iter().filter(|each| each.verdict != Verdict::NotApplicable);
        let hold = asked().filter(|finding| finding.verdict.is_correct()).count();
        let (tag, dimension, asked) = (check.tag, check.dimension.count(), asked().count());
        let _ =
            writeln!(text, "| `{tag}` | {dimension}D | {} | {hold}/{asked} |", blocks.join(" | "));
    }

    let judged = mistakes();
    let _ = writeln!(text, "\n## Mistakes\n\n{} mistakes, each called wrong.", judged.len());
    let mut force = "";
    for Judged { subject, checks } in judged {
        if subject.force != force {
            force = subject.force;
            let _ = writeln!(
                text,
                "\n### `{force}`\n\n| mistake | wrong | error | seen best at |\n| --- | --- | ---: | --- |"
            );
        }
        let wrong = checks.iter().flat_map(wrong_blocks).collect::<Vec<_>>();
        let mut names: Vec<&str> = Vec::new();
        for (name, ..) in &wrong {
            if !names.contains(name) {
                names.push(name);
            }
        }
        let (_, error, state) = wrong.first().cloned().unwrap_or_default();
        let only = if subject.in_space { " (3D)" } else { "" };
        let (description, names) = (subject.description, names.join(", "));
        let _ = writeln!(text, "| {description}{only} | {names} | {error} | {state} |");
    }

    text.push_str("\n## Mistakes that no block shows\n\n| force | mistake | property |\n| --- | --- | --- |\n");
    for Judged { subject, checks } in broken() {
        let is_wrong = |property: &Property| {
            checks.iter().all(|check| {
                let mut findings = check.properties.iter();
                findings.any(|each| each.property == *property && each.verdict == Verdict::Wrong)
            })
        };
        let wrong: Vec<&str> =
            Property::ALL.iter().filter(|each| is_wrong(each)).map(|each| each.name()).collect();
        let _ = writeln!(
            text,
            "| `{}` | {} | {} |",
            subject.force,
            subject.description,
            wrong.join(", ")
        );
    }

    let judged = variants();
    let _ = writeln!(
        text,
        "\n## Correct variants\n\n{} variants, none of them called wrong.\n\n| force | variant | verdict |\n| --- | --- | --- |",
        judged.len()
    );
    for Judged { subject, checks } in judged {
        let wrong = checks.iter().any(JacobianCheck::is_wrong);
        let verdict = match (wrong, checks.iter().all(JacobianCheck::is_pass)) {
            (true, _) => "WRONG",
            (_, true) => "correct",
            _ => "inconclusive",
        };
        let _ = writeln!(text, "| `{}` | {} | {verdict} |", subject.force, subject.description);
    }
    text
}

/// Name, error and state of each wrong block.
fn wrong_blocks(check: &JacobianCheck) -> Vec<(&'static str, String, String)> {
    let wrong = check.blocks.iter().filter(|finding| finding.verdict == Verdict::Wrong);
    wrong
        .filter_map(|finding| {
            let exhibit = finding.exhibit.as_ref()?;
            let error = exhibit.relative_error().value;
            let error =
                if error.is_nan() { "not finite".to_owned() } else { format!("{error:.0e}") };
            let error = if error == "inf" { "not finite".to_owned() } else { error };
            Some((finding.kind.name(), error, exhibit.state.name.clone()))
        })
        .collect()
}
