//! `grade oracle`: regenerates, reviews or verifies the stored traces, and draws hidden scenes.

mod cause;
pub(super) mod hidden;
pub(super) mod review;

use std::collections::BTreeSet;
use std::path::Path;

use grader::oracle::{
    self, Acceptance, Leftover, Origin, Regeneration, Staged, TraceChange, TraceDifference,
};
use grader::suite::selection::{Candidate, choose};
use grader::verdict::Verdict;

use crate::args::SuiteArgs;
use crate::inputs::{Inputs, open_oracle};
use crate::output::print;
use crate::provenance;
use crate::stop::{Exit, Stop, complain};

/// Regenerates the traces. `accept` holds patterns of the accepted changes; if it is empty, all are accepted.
pub(super) fn regenerate(accept: Option<&[String]>, args: &SuiteArgs) -> Result<Exit, Stop> {
    let (staged, inputs) = stage(args, accept.is_some_and(<[String]>::is_empty))?;
    let names: BTreeSet<String> = match accept {
        None | Some([]) => BTreeSet::new(),
        Some(patterns) => {
            let names = staged.changes.iter().map(|(name, _)| name.as_str());
            let candidates = names.map(|name| Candidate { name, group: None, integrator: None });
            let candidates: Vec<Candidate<'_>> = candidates.collect();
            let chosen = choose(patterns, &candidates).map_err(Stop::bad_input)?;
            let chosen = candidates.iter().zip(chosen).filter(|(_, is_chosen)| *is_chosen);
            chosen.map(|(candidate, _)| candidate.name.to_owned()).collect()
        }
    };
    let accept = match accept {
        None => Acceptance::Nothing,
        Some([]) => Acceptance::All,
        Some(_) => Acceptance::Some(&names),
    };
    replace(staged, accept, &inputs.expected)
}

/// Makes the new traces.
fn stage(args: &SuiteArgs, accepts_all: bool) -> Result<(Staged, Inputs), Stop> {
    // An element that is not understood would be missing from the trace.
    let inputs = args.read_strictly()?;
    let accept = if accepts_all { Acceptance::All } else { Acceptance::Nothing };
    let staged = Staged::make(&inputs.suite, &inputs.expected, &inputs.rubric, accept);
    Ok((staged.map_err(Stop::bad_input)?, inputs))
}

/// Replaces the folder by the new traces that are accepted, and prints what changed.
fn replace(staged: Staged, accept: Acceptance<'_>, expected: &Path) -> Result<Exit, Stop> {
    let regeneration = staged.replace(accept, &origin()).map_err(Stop::bad_input)?;
    print(describe(&regeneration, expected).as_bytes())?;
    if let Some(Leftover { path, detail }) = &regeneration.leftover {
        let path = path.display();
        let message =
            format!("{path}: cannot remove the old traces: {detail}; remove them by hand");
        complain("warning", message);
    }
    Ok(if regeneration.refused() { Exit::Failed } else { Exit::Passed })
}

/// This grader, as the origin of traces.
fn origin() -> Origin {
    let commit = provenance::COMMIT.map(str::to_owned);
    Origin { commit, platform: Some(provenance::platform()) }
}

fn describe(regeneration: &Regeneration, folder: &Path) -> String {
    let mut text = String::new();
    let mut unchanged = 0;
    for (name, change) in &regeneration.changes {
        if *change == TraceChange::Unchanged {
            unchanged += 1;
            continue;
        }
        let mark = if change.needs_accepting() { "!" } else { " " };
        text += &format!("{mark} {name}: {}\n", describe_change(change));
    }
    let (folder, kept) = (folder.display(), regeneration.kept.len());
    text += &format!("{unchanged} of {} traces are unchanged\n", regeneration.changes.len());
    text += &match (regeneration.replaced, kept) {
        (true, 0) if unchanged == regeneration.changes.len() => {
            format!("{folder} was replaced: its manifest was missing or out of date\n")
        }
        (true, 0) => format!("{folder} was replaced\n"),
        (true, _) => format!(
            "{folder} was replaced; old traces stay where changes marked ! were not accepted: {kept}\n"
        ),
        (false, 0) => format!("{folder} is unchanged\n"),
        (false, _) => format!(
            "{folder} was NOT replaced: review the changes marked ! with `grade oracle review`, or accept them with \
             `grade oracle regenerate --accept`\n"
        ),
    };
    text
}

/// A change in words.
fn describe_change(change: &TraceChange) -> String {
    match change {
        TraceChange::Unchanged => "unchanged".to_owned(),
        TraceChange::New => "new".to_owned(),
        TraceChange::Removed => "removed: its scene is gone".to_owned(),
        TraceChange::SceneEdited => "scene edited; trace unchanged".to_owned(),
        TraceChange::Changed { scene_edited, n_old, difference } => {
            let edited = if *scene_edited { "scene edited; " } else { "" };
            let several = if *n_old > 1 { "one trace replaces two; " } else { "" };
            format!("{edited}{several}{}", describe_difference(difference))
        }
    }
}

fn describe_difference(difference: &TraceDifference) -> String {
    let comparison = match difference {
        TraceDifference::Numbers(difference) => &difference.comparison,
        TraceDifference::Length { old, new } => {
            return format!("changed: the old trace has {old} states, the new one {new}");
        }
        TraceDifference::Shape => {
            return "changed: the old trace has a different number of particles or dimensions"
                .to_owned();
        }
        TraceDifference::Unusable { detail } => {
            return format!("changed: the old trace cannot be used: {detail}");
        }
    };
    let (extent, place) = match (&comparison.verdict, &comparison.first_wrong) {
        (Verdict::Pass, _) => ("within tolerance", String::new()),
        (_, Some(first)) => ("beyond tolerance", format!(", first at {}", first.place)),
        (verdict, None) => ("beyond tolerance", format!(", {verdict}")),
    };
    let (position, velocity) = (comparison.position.largest, comparison.velocity.largest);
    format!("changed {extent}, position by {position:.1e}, velocity by {velocity:.1e}{place}")
}

pub(super) fn verify(args: &SuiteArgs) -> Result<Exit, Stop> {
    let Inputs { suite, expected, .. } = args.read()?;
    let oracle = open_oracle(&expected)?;
    let findings = oracle::verify(&suite, &oracle);
    let mut text = String::new();
    for finding in &findings {
        text += &format!("{finding}\n");
    }
    let (folder, count) = (expected.display(), suite.cases.len());
    text += &match findings.len() {
        0 => format!("{folder} matches its {count} scenes and its manifest\n"),
        1 => format!("{folder}: 1 mismatch\n"),
        n => format!("{folder}: {n} mismatches\n"),
    };
    print(text.as_bytes())?;
    Ok(if findings.is_empty() { Exit::Passed } else { Exit::Failed })
}
