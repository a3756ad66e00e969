//! Judges measured forces and steps.
//!
//! The force is compared with ours entry by entry, the step with the model that explains it best. `noise.rs` derives
//! the bounds.

use super::differences::{Differences, Sample};
use super::identify::Steps;
use super::noise::{self, CLEAR};
use super::scenes::State;
use super::verdict::{Block, Entry, Finding, PartReport, Verdict};
use crate::verdict::Failure;

/// A force at every state.
pub(super) struct Forces {
    /// By state, with masses of 1.
    pub(super) differences: Vec<Differences>,
    /// Every state with every combination of masses.
    pub(super) by_mass: Vec<Sample>,
}

pub(super) fn compare_forces(
    full: &Forces,
    without: Option<&Forces>,
    states: &[State],
    count: usize,
) -> Finding {
    let all = |forces: &Forces| -> Vec<(usize, Sample, f64)> {
        let at_states = forces.differences.iter().enumerate().flat_map(|(state, differences)| {
            let samples = differences.samples.iter();
            samples.map(move |sample| (state, sample.clone(), differences.noise))
        });
        let noise = forces.differences.iter().map(|d| d.noise).fold(0.0, f64::max);
        let per_state = (forces.by_mass.len() / states.len()).max(1);
        let by_mass = forces.by_mass.iter().enumerate();
        let by_mass = by_mass.map(|(index, sample)| (index / per_state, sample.clone(), noise));
        at_states.chain(by_mass).collect()
    };
    let with = all(full);
    let rest = without.map(all);
    let mut scale: f64 = 0.0;
    let mut part: f64 = 0.0;
    let mut has_effect = false;
    let mut entries = Vec::new();
    for (index, (state, sample, noise)) in with.iter().enumerate() {
        let rest = rest.as_ref().map(|rest| &rest[index]);
        let noise = noise + rest.map_or(0.0, |(_, _, noise)| *noise);
        let heaviest = sample.group.masses.iter().copied().fold(1.0, f64::max);
        for (row, (force, ours)) in sample.force.iter().zip(&sample.ours).enumerate() {
            let [other, other_ours] =
                rest.map_or([0.0, 0.0], |(_, rest, _)| [rest.force[row], rest.ours[row]]);
            has_effect |= *force != other;
            scale = scale.max(ours.abs()).max(other_ours.abs());
            part = part.max((ours - other_ours).abs());
            entries.push(Entry {
                state: *state,
                row: (row / count, row % count),
                column: None,
                measured: force - other,
                expected: ours - other_ours,
                ours: ours - other_ours,
                bound: noise::FORCE * noise * heaviest,
                block: None,
            });
        }
    }
    if !has_effect {
        let reason = "no effect: the program ignores the element or the parameter";
        return Finding::only(Verdict::NotOffered, reason);
    }
    let entries = entries
        .into_iter()
        .map(|entry| Entry { bound: entry.bound + noise::FORMULA * scale, ..entry });
    Finding::of(entries, part)
}

pub(super) fn judge_model(steps: &Steps) -> Finding {
    let residual = steps.residual_of_right;
    let mut finding = if steps.is_loose() {
        let reason =
            "its solver stops early: the same state gets another step beside fewer particles";
        Finding::only(Verdict::Inconclusive, reason)
    } else if !steps.is_explained() {
        let reason = "no matrix explains the steps: the mass term, the right-hand side, the solver, or how the \
                      Jacobian depends on masses and particles is wrong";
        Finding::only(Verdict::Wrong, reason)
    } else if steps.is_right() {
        Finding::only(Verdict::Correct, "")
    } else {
        Finding::only(Verdict::Wrong, steps.model.difference)
    };
    finding.error = residual.is_finite().then_some(residual);
    finding
}

/// Verdicts on the step and the blocks of a force whose dependence on the masses is not ours.
pub(super) fn judge_by_mass(excess: f64, residual: f64) -> (Finding, Finding) {
    let mut step = Finding::only(Verdict::Correct, "");
    step.error = residual.is_finite().then_some(residual);
    if excess <= 1.0 {
        let reason = "agrees with the program's own force at each mass";
        return (step, Finding::only(Verdict::Correct, reason));
    }
    if excess <= CLEAR {
        let reason =
            "its force depends on the masses, and its steps agree with that only approximately";
        return (step, Finding::only(Verdict::Inconclusive, reason));
    }
    let reason = "the steps do not agree with the program's own force at each mass";
    let blocks = Finding::only(Verdict::Inconclusive, "no matrix explains the steps");
    (Finding::only(Verdict::Wrong, reason), blocks)
}

pub(super) fn not_judged(report: &mut PartReport, finding: &Finding) {
    report.blocks = Block::ALL.map(|_| finding.clone());
}

pub(super) fn no_implicit() -> Failure {
    Failure::GaveUp { reason: "linearized implicit Euler is not offered".into() }
}

/// The finding of a run that failed: not offered, unless the run returned non-finite numbers.
pub(super) fn failed(failure: &Failure) -> Finding {
    let verdict = match failure {
        Failure::NotFinite { .. } => Verdict::Wrong,
        _ => Verdict::NotOffered,
    };
    Finding::only(verdict, failure.to_string())
}
