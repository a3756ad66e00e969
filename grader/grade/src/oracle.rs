//! `grade oracle`: regenerates or verifies the stored traces.

use std::path::Path;

use grader::oracle::{self, Leftover, Regeneration, TraceChange, TraceDifference};
use grader::verdict::Verdict;

use crate::args::SuiteArgs;
use crate::inputs::{Inputs, open_oracle};
use crate::output::print;
use crate::stop::{Exit, Stop, complain};

pub(super) fn regenerate(accept: bool, args: &SuiteArgs) -> Result<Exit, Stop> {
    // An element that is not understood would be missing from the trace.
    let Inputs { suite, expected, rubric, .. } = args.read_strictly()?;
    let regeneration =
        oracle::regenerate(&suite, &expected, &rubric, accept).map_err(Stop::bad_input)?;
    print(describe(&regeneration, &expected).as_bytes())?;
    if let Some(Leftover { path, detail }) = &regeneration.leftover {
        let path = path.display();
        let message =
            format!("{path}: cannot remove the old traces: {detail}; remove them by hand");
        complain("warning", message);
    }
    Ok(if regeneration.refused() { Exit::Failed } else { Exit::Passed })
}

pub(super) fn describe(regeneration: &Regeneration, folder: &Path) -> String {
    let mut text = String::new();
    let mut unchanged = 0;
    for (name, change) in &regeneration.changes {
        let words = match change {
            TraceChange::Unchanged => {
                unchanged += 1;
                continue;
            }
            TraceChange::New => "new".to_owned(),
            TraceChange::Removed => "removed: its scene is gone".to_owned(),
            TraceChange::SceneEdited => "scene edited; trace unchanged".to_owned(),
            TraceChange::Changed { scene_edited, n_old, difference } => {
                let edited = if *scene_edited { "scene edited; " } else { "" };
                let several = if *n_old > 1 { "one trace replaces two; " } else { "" };
                format!("{edited}{several}{}", describe_difference(difference))
            }
        };
        let mark = if change.needs_accepting() { "!" } else { " " };
        text += &format!("{mark} {name}: {words}\n");
    }
    let folder = folder.display();
    text += &format!("{unchanged} of {} traces are unchanged\n", regeneration.changes.len());
    text += &match (regeneration.replaced, regeneration.refused()) {
        (true, _) if unchanged == regeneration.changes.len() => {
            format!("{folder} was replaced: its manifest was missing or out of date\n")
        }
        (true, _) => format!("{folder} was replaced\n"),
        (false, true) => format!(
            "{folder} was NOT replaced: review the changes marked ! and run again with --accept\n"
        ),
        (false, false) => format!("{folder} is unchanged\n"),
    };
    text
}

pub(super) fn describe_difference(difference: &TraceDifference) -> String {
    let comparison = match difference {
        TraceDifference::Numbers(comparison) => comparison,
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
