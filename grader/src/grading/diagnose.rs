//! The diagnosis of judged scenes: states their outcomes to [`diagnosis`], and takes over what it finds.

use std::panic::{AssertUnwindSafe, catch_unwind};

use diagnosis::findings::{self, Findings, JudgedScene, Outcome};

use super::judge::Judged;
use super::refusal::says_why;
use crate::compare::Criteria;
use crate::verdict::{Failure, Verdict};

/// Looks for what is wrong in all scenes together. An error or a panic here loses the findings, but no verdict.
pub(super) fn look_into(judged: &mut [Judged<'_>]) -> Findings {
    if judged.iter().all(|judged| judged.result.comparison.verdict.is_pass()) {
        let tasks = findings::tasks_of_passed(judged.iter().map(|judged| &judged.case.scene));
        return Findings { tasks, ..Findings::default() };
    }
    let find = || {
        let scenes: Vec<JudgedScene<'_>> = judged.iter().map(scene_of).collect();
        Findings::of(&scenes)
    };
    let Ok((findings, found)) = catch_unwind(AssertUnwindSafe(find)) else {
        return Findings::default();
    };
    for (Judged { result, .. }, found) in judged.iter_mut().zip(found) {
        result.diagnosis = found.diagnosis;
        if let Some(words) = found.lacks {
            result.comparison.verdict =
                Verdict::Fail(Failure::NotImplemented { detail: words.into(), lacks: None });
        }
    }
    findings
}

fn scene_of<'a>(judged: &'a Judged<'_>) -> JudgedScene<'a> {
    let Judged { case, result, states } = judged;
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
        outcome: match comparison.other_time_step {
            Some(step) => Outcome::OtherTimes(step),
            None => outcome(&comparison.verdict),
        },
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

fn outcome(verdict: &Verdict) -> Outcome {
    let failure = match verdict {
        Verdict::Pass => return Outcome::Passed,
        Verdict::GraderFault(_) => return Outcome::NotJudged,
        Verdict::Fail(failure) => failure,
    };
    match failure {
        // Altered scenes are run after the diagnosis.
        Failure::NotRun { .. } | Failure::FailsAltered { .. } => Outcome::NotJudged,
        Failure::BuildFailed { .. } | Failure::BadHandIn { .. } => Outcome::NotBuilt,
        Failure::NotImplemented { lacks, .. } => Outcome::Refused(lacks.clone()),
        Failure::Missing { .. } => Outcome::Missing,
        failure @ Failure::Crashed { .. } if says_why(failure) => Outcome::Refused(None),
        Failure::Crashed { .. } | Failure::TooManyProcesses { .. } => Outcome::Crashed,
        Failure::TimedOut { .. } => Outcome::TimedOut,
        Failure::OutOfMemory { .. } => Outcome::OutOfMemory,
        Failure::NoOutput { .. } => Outcome::NoTrace,
        Failure::TooMuchOutput { .. } => Outcome::TooMuchOutput,
        Failure::Malformed { .. } => Outcome::Malformed,
        Failure::NotFinite { place, .. } => Outcome::NotFinite(place.step),
        Failure::TooShort { states, expected } => {
            Outcome::TooShort { states: *states, expected: *expected }
        }
        Failure::TooLong { .. } => Outcome::TooLong,
        Failure::Differs | Failure::Drifts { .. } => Outcome::Differs,
    }
}
