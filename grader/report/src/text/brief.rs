//! Brief text of a grading: totals and failed features, each finding with an example, and what to do next.

use std::io::{self, Write};

use diagnosis::findings::{Feature, Finding, FindingKind, Part};
use grader::grading::{
    FeatureResult, Grading, GradingOutcome, Hidden, SceneResult, Totals, points,
};
use grader::suite::Section;
use grader::verdict::{Failure, Verdict};

use super::{Audience, NextCommands, Remarks, count};
use crate::remarks::{self, counted};
use crate::table::{self, BAD, BOLD, Cell, DIM, GOOD, ODD, header};

/// Failed features of a section from which on they are shown by group.
const MANY: usize = 8;

/// Findings with an example.
const EXAMPLES: usize = 2;

/// Lines of a message in an example.
const LINES: usize = 6;

/// Lines of the message of a build that failed.
const BUILD_LINES: usize = 24;

/// Writes the report.
pub(super) fn write(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    write_features(out, grading)?;
    writeln!(out)?;
    super::write_summary(out, grading, Audience::Graders, Remarks::Warnings)?;
    super::write_hidden(out, grading)?;
    if let Some(verdict) = not_built(grading) {
        writeln!(out, "\n{BOLD}No scene was run: {}{BOLD:#}", verdict.name().replace('-', " "))?;
        write_message(out, verdict, BUILD_LINES, 2)
    } else if grading.interrupted.is_none() {
        write_findings(out, grading)
    } else {
        Ok(())
    }
}

/// The verdict of every scene, if there is nothing that could be run.
fn not_built(grading: &Grading) -> Option<&Verdict> {
    let mut verdicts = remarks::scenes(grading).map(|scene| &scene.comparison.verdict);
    let first = verdicts.next()?;
    let is_unbuilt =
        matches!(first, Verdict::Fail(Failure::BuildFailed(_) | Failure::BadHandIn { .. }));
    (is_unbuilt && verdicts.all(|verdict| verdict == first)).then_some(first)
}

fn write_features(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    let mut rows = vec![header(&["", "integrator", "scenes", "hidden", "points", "verdict"], 2..5)];
    let is_unbuilt = not_built(grading).is_some();
    for section in Section::ALL {
        let features = grading.features.iter().filter(|each| each.feature.section == section);
        let features: Vec<&FeatureResult> = features.collect();
        if features.is_empty() {
            continue;
        }
        let of = |section: Section, totals: Totals| {
            let points = if section == Section::Unscored {
                String::new()
            } else {
                points::of(&totals.credit, grading.faults)
            };
            [
                Cell::right(count(totals.passed, totals.scenes)),
                Cell::right(count(totals.hidden_passed, totals.hidden)),
                Cell::right(points),
            ]
        };
        let row = |name: String, what: String, features: &[&FeatureResult], verdict: Cell| {
            let mut row = vec![Cell::left(format!("  {name}")), Cell::left(what)];
            row.extend(of(section, Totals::of(features.iter().copied())));
            row.push(verdict);
            row
        };
        let all = Totals::of(features.iter().copied());
        let passed = format!("{} of {} features", all.features_passed, all.features);
        let mut title = vec![Cell::left(super::title(section)), Cell::left(passed)];
        title.extend(of(section, all));
        rows.push(title.into_iter().map(|cell| cell.styled(BOLD)).collect());
        if is_unbuilt {
            continue;
        }
        let (lacking, there): (Vec<&FeatureResult>, Vec<&FeatureResult>) =
            features.iter().partition(|result| result.is_lacking());
        let (passed, failed): (Vec<&FeatureResult>, Vec<&FeatureResult>) =
            there.into_iter().partition(|result| result.is_pass());
        for group in failed.chunk_by(|a, b| a.feature.group == b.feature.group) {
            let name = &group[0].feature.group;
            if failed.len() > MANY && group.len() > 1 {
                let what = format!("{} integrators", group.len());
                rows.push(row(name.clone(), what, group, super::verdict_cell(group[0])));
                continue;
            }
            for result in group {
                let what = result.feature.integrator.to_owned();
                rows.push(row(name.clone(), what, &[*result], super::verdict_cell(result)));
            }
        }
        for (those, name, verdict) in [
            (lacking, "not implemented", Cell::left("").styled(ODD)),
            (passed, "others", Cell::left("pass").styled(GOOD)),
        ] {
            let says_more = name == "not implemented" || those.len() < features.len();
            if !those.is_empty() && says_more {
                let what = counted(those.len(), "feature");
                rows.push(row(name.to_owned(), what, &those, verdict));
            }
        }
    }
    if grading.hidden != Hidden::Run {
        rows.iter_mut().for_each(|row| drop(row.remove(3)));
    }
    table::write(out, &rows)
}

/// Writes the findings, each with the place where it shows first.
fn write_findings(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    let list = &grading.findings.list;
    let unexplained = remarks::unexplained(grading);
    let is_named = |tag: &str| {
        let mut features = list.iter().flat_map(|finding| &finding.features);
        features.any(|feature| match feature {
            Feature::Force(part) | Feature::Jacobian(part) => Part::tag(*part) == tag,
            _ => false,
        })
    };
    let measured: Vec<_> =
        remarks::measured(grading).filter(|(part, _)| !is_named(part.force)).collect();
    let wrong_steps = remarks::wrong_steps(grading, is_named);
    if list.is_empty() && unexplained.is_empty() && measured.is_empty() && wrong_steps.is_none() {
        return super::write_tasks(out, &grading.findings);
    }
    writeln!(out, "\n{BOLD}Findings{BOLD:#}")?;
    let (lacks, wrong): (Vec<&Finding>, Vec<&Finding>) =
        list.iter().partition(|finding| finding.kind.is_lack());
    for (number, finding) in wrong.iter().enumerate() {
        super::write_finding(out, finding)?;
        if number < EXAMPLES
            && let Some(scene) = example(grading, finding)
        {
            write_example(out, scene)?;
        }
    }
    for note in Finding::notes(list.iter()) {
        writeln!(out, "  {DIM}{note}{DIM:#}")?;
    }
    for (part, words) in measured {
        let mistakes = part.diagnosis.join("; ");
        let separator = if mistakes.is_empty() { "" } else { ": " };
        writeln!(
            out,
            "  {BAD}{words}wrong{BAD:#}, measured from single steps{separator}{mistakes}"
        )?;
    }
    if let Some(words) = wrong_steps {
        writeln!(out, "  {BAD}Wrong{BAD:#}: {words}")?;
    }
    for remark in unexplained {
        let names = remarks::named(remark.scenes.iter().map(|scene| scene.id.as_str()));
        writeln!(out, "  {BAD}{}{BAD:#}: {names}", remark.words)?;
        let is_first = wrong.is_empty();
        if let Some(scene) = simplest(grading, &remark.scenes).filter(|_| is_first) {
            write_example(out, scene)?;
        }
    }
    super::write_lacks(out, &lacks)?;
    let progress = grading.findings.progress.as_ref();
    if let Some(progress) = progress.filter(|progress| !progress.implemented.is_empty()) {
        writeln!(out, "  Implemented: {}", progress.implemented.join(", "))?;
    }
    super::write_tasks(out, &grading.findings)
}

/// The scene that shows a finding most simply; `None` if its scenes are not shipped. A wrong first state shows the fault of the
/// output that is in it, and no other mistake.
fn example<'a>(grading: &'a Grading, finding: &Finding) -> Option<&'a SceneResult> {
    let is_its = |scene: &&SceneResult| finding.scenes.contains(&scene.id);
    let faults = || grading.findings.list.iter().filter(|one| one.kind == FindingKind::Output);
    let shows_it = |scene: &&SceneResult| {
        let is_first = scene.comparison.first_wrong.as_ref().is_some_and(|f| f.place.step == 0);
        let has_fault = || faults().any(|fault| fault.scenes.contains(&scene.id));
        finding.kind == FindingKind::Output || !is_first || !has_fault()
    };
    let failed = remarks::scenes(grading).filter(|scene| !scene.comparison.verdict.is_pass());
    simplest(grading, &failed.filter(is_its).filter(shows_it).collect::<Vec<_>>())
}

/// The simplest of these scenes: a required one, with numbers, few terms and particles, and wrong from an early step on.
fn simplest<'a>(grading: &Grading, scenes: &[&'a SceneResult]) -> Option<&'a SceneResult> {
    let required: Vec<&str> = required(grading).map(|scene| scene.id.as_str()).collect();
    let key = |scene: &&&SceneResult| {
        let first = scene.comparison.first_wrong.as_ref();
        let explanation = scene.diagnosis.as_ref().and_then(|d| d.explanation.as_ref());
        let balance = explanation.and_then(|explanation| explanation.balance.as_ref());
        let terms = balance.map_or(usize::MAX, |balance| balance.terms.len());
        let step = first.map_or(u64::MAX, |first| first.place.step);
        (!required.contains(&scene.id.as_str()), first.is_none(), terms, scene.n_particles, step)
    };
    scenes.iter().min_by_key(key).copied()
}

/// The scenes of the required part.
fn required(grading: &Grading) -> impl Iterator<Item = &SceneResult> {
    let is_required = |result: &&FeatureResult| result.feature.section == Section::Required;
    grading.features.iter().filter(is_required).flat_map(|result| &result.scenes)
}

fn write_example(out: &mut dyn Write, scene: &SceneResult) -> io::Result<()> {
    let verdict = &scene.comparison.verdict;
    let Some(first) = &scene.comparison.first_wrong else {
        let name = verdict.name().replace('-', " ");
        writeln!(out, "    {DIM}in {}:{DIM:#} {name}", scene.id)?;
        return write_message(out, verdict, LINES, 6);
    };
    let (step, particle) = (first.place.step, first.place.particle);
    writeln!(out, "    {DIM}in {}, step {step}, particle {particle}:{DIM:#}", scene.id)?;
    super::write_digits(out, first, 6)
}

/// Writes the first lines of what a verdict says, indented by so many blanks.
fn write_message(
    out: &mut dyn Write,
    verdict: &Verdict,
    most: usize,
    indent: usize,
) -> io::Result<()> {
    let message = verdict.to_string();
    for line in message.lines().take(most) {
        writeln!(out, "{:indent$}{line}", "")?;
    }
    let more = message.lines().count().saturating_sub(most);
    if more > 0 {
        writeln!(out, "{:indent$}{DIM}… and {more} more lines (--verbose){DIM:#}", "")?;
    }
    Ok(())
}

/// Writes the commands that go on from here: the next scene of an unfinished program, the first wrong step, the page.
pub(super) fn write_next(
    out: &mut dyn Write,
    grading: &Grading,
    next: &NextCommands,
    width: usize,
) -> io::Result<()> {
    if grading.outcome() == GradingOutcome::Passed && grading.is_flawless()
        || grading.interrupted.is_some()
    {
        return Ok(());
    }
    if not_built(grading).is_some() {
        return writeln!(
            out,
            "\n{BOLD}Next{BOLD:#}\n  Mend what the message above says, and grade again."
        );
    }
    let NextCommands { arguments, page } = next;
    let mut failed: Vec<&SceneResult> = Vec::new();
    let is_there = |finding: &&Finding| !finding.kind.is_lack();
    let findings = grading.findings.list.iter().filter(is_there);
    failed.extend(findings.filter_map(|finding| example(grading, finding)));
    let unexplained = remarks::unexplained(grading);
    failed.extend(unexplained.iter().filter_map(|one| simplest(grading, &one.scenes)));
    // A finding about required scenes first; they stand in order.
    let is_extra = |scene: &&SceneResult| !required(grading).any(|one| one.id == scene.id);
    failed.sort_by_key(is_extra);
    let is_lack = |scene: &&&SceneResult| scene.comparison.verdict.is_lack();
    let mut steps: Vec<(String, &str)> = Vec::new();
    match failed.iter().find(|scene| !is_lack(scene)) {
        Some(scene) if scene.diagnosis.is_some() => steps.push((
            format!("grade explain {} {arguments}", scene.id),
            "the first wrong step, with your numbers in its equation",
        )),
        Some(scene) => {
            steps.push((format!("grade {arguments} --only {}", scene.id), "this scene alone"));
        }
        None => {}
    }
    let progress = grading.findings.progress.as_ref();
    let what_next = progress.and_then(|progress| progress.next.as_ref());
    let about;
    if let Some((what, scene)) = what_next {
        about = format!("when your program has {what}");
        steps.push((format!("grade {arguments} --only {scene}"), &about));
    }
    if remarks::scenes(grading).any(|scene| scene.comparison.is_compared()) {
        steps.push(match page {
            Some(page) => (page.clone(), "the page: your motion over the correct one"),
            None => (
                format!("grade {arguments} --html report.html"),
                "a page: your motion over the correct one",
            ),
        });
    }
    if steps.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n{BOLD}Next{BOLD:#}")?;
    for (command, about) in steps {
        writeln!(out, "  {DIM}{about}:{DIM:#}")?;
        // As a shell reads it: an end of line inside a command is escaped.
        let mut line = "   ".to_owned();
        for word in command.split(' ') {
            if line.chars().count() + word.chars().count() + 3 > width && line.len() > 6 {
                writeln!(out, "{BOLD}{line} \\{BOLD:#}")?;
                line = "     ".to_owned();
            }
            line = format!("{line} {word}");
        }
        writeln!(out, "{BOLD}{line}{BOLD:#}")?;
    }
    Ok(())
}
