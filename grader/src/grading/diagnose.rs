//! The diagnosis of judged scenes: states their outcomes to [`diagnosis`], and takes over what it finds.

use std::panic::{AssertUnwindSafe, catch_unwind};

use diagnosis::findings::{self, Findings, JudgedScene, Outcome, Thresholds};
use sandbox::NotKept;
use scene::trace::TraceFault;

use super::judge::Judged;
use super::refusal::{message, says_why, uncaught};
use crate::compare::{Criteria, is_close};
use crate::suite::{NoTrace, Section};
use crate::verdict::{Failure, FormFault, Lack, RunEnd, RunFailure, Skipped, Verdict};

/// Looks for what is wrong in all scenes together. An error or a panic here loses the findings, but no verdict.
pub(super) fn look_into(judged: &mut [Judged<'_>], limits: &Thresholds) -> Findings {
    if judged.iter().all(|one| one.is_misread || one.result.comparison.verdict.is_pass()) {
        let tasks = findings::tasks_of_passed(judged.iter().map(|judged| &judged.case.scene));
        return Findings { tasks, ..Findings::default() };
    }
    let find = || {
        let scenes: Vec<JudgedScene<'_>> = judged.iter().map(scene_of).collect();
        Findings::of(&scenes, limits)
    };
    let Ok((findings, found)) = catch_unwind(AssertUnwindSafe(find)) else {
        return Findings::default();
    };
    for (Judged { result, .. }, found) in judged.iter_mut().zip(found) {
        result.diagnosis = found.diagnosis;
        if let Some(words) = found.lacks {
            let lack = Lack::LeftOut { words };
            result.comparison.verdict = Verdict::Fail(Failure::NotImplemented(lack));
        }
    }
    findings
}

fn scene_of<'a>(judged: &'a Judged<'_>) -> JudgedScene<'a> {
    let Judged { case, result, states, is_misread } = judged;
    let comparison = &result.comparison;
    let envelope = match &result.criteria {
        Criteria::Calibrated(calibrated) => (0..states.len() as u64)
            .map(|step| calibrated.envelope.at(step))
            .map(|bounds| [bounds.position, bounds.velocity])
            .collect(),
        Criteria::Fixed(_) => Vec::new(),
    };
    JudgedScene {
        name: &case.id,
        scene: &case.scene,
        is_required: case.feature.section == Section::Required,
        outcome: if *is_misread { Outcome::NotJudged } else { outcome(&comparison.verdict) },
        was_run: !matches!(comparison.verdict, Verdict::Fail(Failure::Skipped(_))),
        first_wrong: comparison.first_wrong.as_ref().map(|first| findings::FirstWrong {
            step: first.place.step,
            particle: first.place.particle,
            context: &first.context,
        }),
        largest: [comparison.position.largest, comparison.velocity.largest],
        has_positions_alone: comparison.has_positions_alone,
        has_other_root: comparison.other_root.is_some(),
        envelope,
        states,
    }
}

/// How a run with this verdict ended, for the search for causes.
pub fn outcome(verdict: &Verdict) -> Outcome {
    match verdict {
        Verdict::Pass => Outcome::Passed,
        Verdict::GraderFault(_) => Outcome::NotJudged,
        Verdict::Fail(failure) => outcome_of_failure(failure),
    }
}

fn outcome_of_failure(failure: &Failure) -> Outcome {
    match failure {
        // Altered scenes and functions are run after the diagnosis.
        Failure::FailsAltered { .. } | Failure::WrongFunction { .. } => Outcome::NotJudged,
        Failure::BuildFailed(_) | Failure::BadHandIn { .. } => Outcome::NotBuilt,
        Failure::NotImplemented(Lack::Refused { name, .. }) => Outcome::Refused(name.clone()),
        Failure::NotImplemented(Lack::LeftOut { .. }) => Outcome::Refused(None),
        Failure::NoTrace(NoTrace::Missing { .. }) => Outcome::Missing,
        Failure::NoTrace(NoTrace::Several { .. }) | Failure::Unreadable { .. } => Outcome::NoTrace,
        Failure::Run(run) if says_why(run) => Outcome::Refused(None),
        Failure::Run(run) => message(run).map_or_else(|| outcome_of_run(run), Outcome::Stopped),
        Failure::Skipped(Skipped::Crashes { last, .. }) => outcome_of_failure(last),
        Failure::GaveUp { .. } => Outcome::Crashed(None),
        Failure::Skipped(Skipped::TimeOuts { .. } | Skipped::Features { .. }) => Outcome::TimedOut,
        Failure::NotGreeted(failures) => outcome_of_failure(failures.telling()),
        Failure::Malformed { fault: FormFault::Time { state, found, expected }, .. }
            if counts_by_other_step(*state as f64, *found, *expected) =>
        {
            Outcome::OtherTimes(*found / *state as f64)
        }
        Failure::Malformed { .. } if failure.starts_at_one() => Outcome::StartsAtOne,
        Failure::Malformed {
            fault:
                FormFault::Content(
                    TraceFault::RowLength { expected, found }
                    | TraceFault::HeaderLength { expected, found, .. },
                ),
            ..
        } => Outcome::Fields { expected: *expected, found: *found },
        Failure::Malformed { fault, .. } => Outcome::Malformed(fault.to_string()),
        Failure::NotFinite { place, .. } => Outcome::NotFinite(place.step),
        Failure::TooShort { states, expected } => {
            Outcome::TooShort { states: *states, expected: *expected }
        }
        Failure::TooLong { .. } => Outcome::TooLong,
        Failure::Differs | Failure::Drifts { .. } => Outcome::Differs,
    }
}

/// Whether the first wrong time of a trace is so many of another time step, by which the state before it is close to right.
fn counts_by_other_step(state: f64, found: f64, expected: f64) -> bool {
    let before = (found - expected).abs() * (state - 1.0) / state;
    state > 0.0 && found > 0.0 && is_close(before, expected)
}

fn outcome_of_run(run: &RunFailure) -> Outcome {
    match &run.end {
        RunEnd::Budget(_) => Outcome::NotJudged,
        RunEnd::Exited(_)
        | RunEnd::Killed(_)
        | RunEnd::NotStarted { .. }
        | RunEnd::Processes(_) => Outcome::Crashed(uncaught(run)),
        RunEnd::Processor(_) | RunEnd::Wall(_) => Outcome::TimedOut,
        RunEnd::Memory(_) => Outcome::OutOfMemory,
        RunEnd::NoTrace { reason: NotKept::TooLarge(_), .. }
        | RunEnd::Folder(_)
        | RunEnd::Stdout(_)
        | RunEnd::Stderr(_)
        | RunEnd::Files(_) => Outcome::TooMuchOutput,
        RunEnd::NoTrace { .. } => Outcome::NoTrace,
    }
}
