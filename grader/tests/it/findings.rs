//! Findings on traces that a changed model makes, graded as milestone 3: the change itself is named.

use grader::assignment::Assignment;
use grader::findings::{Finding, FindingKind};
use grader::grading;
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::StateSource;
use grader::verdict::{Failure, Verdict};
use reference::change::candidates;
use reference::change::{Change, Model};
use simulator::scene::Scene;
use simulator::trace::State;
use test_support::{root, suite};

/// Scenes of more particles are left out: a model solves dense systems.
const SMALL: usize = 20;

struct States(std::vec::IntoIter<State>);

impl StateSource for States {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        let next = self.0.next();
        let is_there = next.is_some();
        *state = next.unwrap_or_else(|| state.clone());
        Ok(is_there)
    }
}

/// The states of a scene with a change.
fn states(scene: &Scene, change: Option<&Change>) -> Vec<State> {
    let changes: Vec<Change> = change.cloned().into_iter().collect();
    let model = Model::new(scene, &changes);
    let mut all = vec![model.start()];
    for step in 0..scene.n_steps() {
        let earlier = all.len().checked_sub(2).map(|before| all[before].clone());
        let Some(stepped) = model.step(step, earlier.as_ref(), &all[all.len() - 1]) else { break };
        all.push(stepped.state);
    }
    all
}

/// The findings on traces with a change, which `written` writes.
fn findings(change: Option<&Change>, written: fn(Vec<State>) -> Vec<State>) -> Vec<Finding> {
    let folder = root().join("assets");
    let mut assignment =
        Assignment::load(&folder.join("assignments"), "t1m3").expect("an assignment");
    let mut suite = suite();
    assignment.narrow(&mut suite).expect("scenes");
    let mut rubric = Rubric::load(&folder.join("rubric.toml")).expect("a rubric");
    rubric.assign(assignment);
    let oracle = Oracle::open(&root().join("expected")).expect("an oracle");
    let grading = grading::collect(&suite, String::new(), &oracle, &rubric, |case, criteria| {
        grading::judge(case, &oracle, criteria, || {
            if case.scene.particles.len() > SMALL {
                let detail = "there is no trace".to_owned();
                return Err(Verdict::Fail(Failure::Missing { detail }));
            }
            let states = written(states(&case.scene, change));
            Ok(Box::new(States(states.into_iter())) as Box<dyn StateSource>)
        })
    });
    grading.findings.list
}

/// The candidate of these words, in some scene.
fn candidate(words: &str) -> Change {
    let of = |scene: &Scene| {
        let mut all = candidates::of_fixed(scene);
        all.extend(candidates::of_reading(scene, &[]));
        all.extend(candidates::of_process(scene));
        all.into_iter().find(|change| change.words == words)
    };
    suite().cases.iter().find_map(|case| of(&case.scene)).expect("a candidate")
}

#[test]
fn a_change_is_named_from_the_traces_that_it_makes() {
    assert_eq!(findings(None, |states| states), []);
    for words in [
        "explicit-euler: fixed particles stand still, although they have a velocity",
        "linearized-implicit-euler: the velocities of fixed particles are set to zero",
        "masses are read as integers",
        "springforce reads k as an integer",
        "springforce uses b = 1 where it is not given",
        "the last force of a scene is left out where there are several",
        "implicit-euler: Newton's method stops at an update of 1",
        "implicit-euler: Newton's method stops where the sum of the update is negative",
    ] {
        let found = findings(Some(&candidate(words)), |states| states);
        let [Finding { kind: FindingKind::Cause, words: named, .. }] = found.as_slice() else {
            panic!("{words}: {found:#?}");
        };
        assert!(named.iter().any(|named| named == words), "{words}: {named:?}");
    }
}

#[test]
fn states_that_are_written_late_are_a_fault_of_the_output() {
    let late = |mut states: Vec<State>| {
        states.insert(0, states[0].clone());
        states.pop();
        states
    };
    let with_old_velocities = |states: Vec<State>| {
        let mut late = states.clone();
        for (state, before) in late.iter_mut().skip(1).zip(&states) {
            state.velocities.clone_from(&before.velocities);
        }
        late
    };
    let sentence = |written: fn(Vec<State>) -> Vec<State>| {
        let found = findings(None, written);
        found.first().map(Finding::sentence).unwrap_or_default()
    };
    assert_eq!(sentence(late), "the output: each state is written one step late");
    let velocities = sentence(with_old_velocities);
    assert_eq!(velocities, "the output: the velocities are those of the step before");
}
