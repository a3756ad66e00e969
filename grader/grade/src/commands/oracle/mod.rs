//! `grade oracle`: regenerates, reviews or verifies the stored traces, and draws hidden scenes.

mod cause;
mod hidden;
mod review;

use std::collections::BTreeSet;
use std::path::Path;

use clap::Subcommand;
use grader::oracle::{
    self, Acceptance, Leftover, Origin, Regeneration, Staged, TraceChange, TraceDifference,
};
use grader::suite::selection::{Candidate, choose};
use grader::verdict::Verdict;

use crate::args::SuiteArgs;
use crate::inputs::{Inputs, open_oracle};
use crate::installed::refuse_change;
use crate::output::print;
use crate::provenance;
use crate::stop::{Exit, Stop, complain};
use hidden::HiddenArgs;

#[derive(Subcommand)]
pub(crate) enum OracleCommand {
    /// Regenerate all oracle traces with the built-in simulator; replace expected/ completely or not at all
    #[command(after_help = "\
Examples:
  grade oracle regenerate
  grade oracle regenerate --accept Spring/two-springs")]
    Regenerate {
        /// Also replace traces that changed beyond their tolerance, and remove traces without a scene: of these scenes,
        /// by the patterns of --only, or of all; the others stay
        #[arg(long, value_name = "SCENE", num_args = 0..)]
        accept: Option<Vec<String>>,

        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Walk through the changes that have to be accepted, scene by scene, on a terminal: accept, reject, skip, undo
    #[command(after_help = "\
Examples:
  grade oracle review

Decisions are kept beside expected/ until they are written: run it again to continue. Exit codes: 0 nothing is left to \
accept, 1 something is, 2 bad usage or input.")]
    Review {
        #[command(flatten)]
        suite: SuiteArgs,
    },
    /// Check that expected/ matches its scenes and its manifest
    #[command(after_help = "\
Examples:
  grade oracle verify")]
    Verify {
        #[command(flatten)]
        suite: SuiteArgs,
    },
    GenerateHidden(HiddenArgs),
}

impl OracleCommand {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        match self {
            Self::Regenerate { accept, suite } => regenerate(accept.as_deref(), suite),
            Self::Review { suite } => review::run(suite),
            Self::Verify { suite } => verify(suite),
            Self::GenerateHidden(args) => args.run(),
        }
    }
}

/// Regenerates the traces. `accept` holds patterns of the accepted changes; if it is empty, all are accepted.
fn regenerate(accept: Option<&[String]>, args: &SuiteArgs) -> Result<Exit, Stop> {
    let (staged, inputs) = stage(args, accept.is_some_and(<[String]>::is_empty))?;
    let names: BTreeSet<String> = match accept {
        None | Some([]) => BTreeSet::new(),
        Some(patterns) => {
            let names = staged.changes.iter().map(|(name, _)| name.as_str());
            let candidates = names.map(|name| Candidate { name, group: None, integrator: None });
            let candidates: Vec<Candidate<'_>> = candidates.collect();
            if candidates.is_empty() {
                return Err(Stop::bad_input("no trace changes: there is nothing to accept"));
            }
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
    refuse_change(&inputs.expected)?;
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
    Ok(Exit::of(!regeneration.refused()))
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

fn verify(args: &SuiteArgs) -> Result<Exit, Stop> {
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
    Ok(Exit::of(findings.is_empty()))
}
