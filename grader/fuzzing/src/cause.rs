//! The search for causes over drawn scenes: what it proves of a failure.

use std::panic::{AssertUnwindSafe, catch_unwind};

use diagnosis::findings::{Diagnosis, Findings, FirstWrong, JudgedScene, Outcome, Thresholds};
use grader::grading::outcome;
use grader::verdict::Verdict;
use scene::Scene;
use scene::trace::State;

use crate::judge::{Run, Wrong};

/// A scene with its outcome.
#[derive(Debug, Clone, Copy)]
pub enum Evidence<'a> {
    /// A failure.
    Wrong(&'a Scene, &'a Wrong),
    /// A run that is right.
    Right(&'a Scene, &'a Run),
}

/// Results for several scenes together.
#[derive(Debug, Default)]
pub struct Found {
    /// The findings, as any report has them.
    pub findings: Findings,
    /// For each scene, the diagnosis of a failure.
    pub diagnoses: Vec<Option<Diagnosis>>,
}

/// Looks for causes in scenes together, within the processor time that grading has. A panic of the search loses what it found,
/// and no failure.
pub fn find(scenes: &[Evidence<'_>]) -> Found {
    find_within(scenes, &Thresholds::default())
}

fn find_within(scenes: &[Evidence<'_>], limits: &Thresholds) -> Found {
    let names: Vec<String> = (0..scenes.len()).map(|number| number.to_string()).collect();
    let judged: Vec<JudgedScene<'_>> =
        scenes.iter().zip(&names).map(|(scene, name)| judged(*scene, name)).collect();
    let find = || Findings::of(&judged, limits);
    let Ok((findings, found)) = catch_unwind(AssertUnwindSafe(find)) else {
        return Found::default();
    };
    Found { findings, diagnoses: found.into_iter().map(|found| found.diagnosis).collect() }
}

fn judged<'a>(scene: Evidence<'a>, name: &'a str) -> JudgedScene<'a> {
    let right = |scene: &'a Scene, states: &'a [State]| JudgedScene {
        name,
        scene,
        is_required: true,
        outcome: Outcome::Passed,
        was_run: true,
        first_wrong: None,
        largest: [0.0; 2],
        has_positions_alone: false,
        has_other_root: false,
        envelope: Vec::new(),
        states,
    };
    match scene {
        Evidence::Right(scene, run) => right(scene, &run.states),
        Evidence::Wrong(scene, wrong) => {
            let Wrong { failure, comparison, states, envelope, .. } = wrong;
            let bounds = (0..states.len() as u64).map(|step| envelope.at(step));
            let first = comparison.first_wrong.as_ref();
            JudgedScene {
                outcome: outcome(&Verdict::Fail(failure.clone())),
                first_wrong: first.map(|first| FirstWrong {
                    step: first.place.step,
                    particle: first.place.particle,
                    context: &first.context,
                }),
                largest: [comparison.position.largest, comparison.velocity.largest],
                has_positions_alone: comparison.has_positions_alone,
                envelope: bounds.map(|bounds| [bounds.position, bounds.velocity]).collect(),
                ..right(scene, states)
            }
        }
    }
}

/// Whether a failure alone shows one of these causes, in words.
pub fn shows(scene: &Scene, wrong: &Wrong, words: &[String]) -> bool {
    let found = find(&[Evidence::Wrong(scene, wrong)]);
    let mut proven = found.findings.list.iter().filter(|finding| finding.is_proven());
    proven.any(|finding| finding.words.iter().any(|word| words.contains(word)))
}

#[cfg(test)]
mod tests {
    use grader::submission::StateSource;

    use super::*;
    use crate::draw::read;
    use crate::judge::{Judge, Judgement};
    use crate::motion::{Held, simulate};

    #[test]
    fn a_search_ends_at_its_ceiling() {
        let scene = |stiffness: f64| {
            let text = format!(
                r#"<scene>
                <duration time="1"/>
                <integrator type="symplectic-euler" dt="0.1"/>
                <particle m="2" px="0" py="0" vx="1" vy="0" fixed="0"/>
                <particle m="3" px="2" py="1" vx="0" vy="1" fixed="0"/>
                <edge i="0" j="1"/>
                <springforce edge="0" k="{stiffness}" l0="1.5"/>
                </scene>"#
            );
            read(&text).unwrap()
        };
        let (scene, mistaken) = (scene(5.0), simulate(&scene(10.0)).unwrap());
        let start = || Ok(Box::new(Held::of(mistaken)) as Box<dyn StateSource>);
        let judged = Judge::default().judge_states(&scene, &simulate(&scene).unwrap(), start);
        let Judgement::Wrong(wrong) = judged else { panic!("{judged:?}") };
        let limits = Thresholds::default();
        let proven = |ceiling: u64| {
            let limits = Thresholds { ceiling, ..limits };
            let found = find_within(&[Evidence::Wrong(&scene, &wrong)], &limits);
            found.findings.list.iter().any(|finding| finding.is_proven())
        };
        assert!(proven(limits.ceiling));
        assert!(!proven(0));
    }
}
