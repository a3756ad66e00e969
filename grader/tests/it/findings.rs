//! Findings on traces that a changed model makes, graded as milestone 3: the change itself is named.

use diagnosis::change::candidates;
use diagnosis::change::{Change, Model, Term};
use diagnosis::findings::{Finding, FindingKind};
use grader::grading;
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::StateSource;
use grader::suite::NoTrace;
use grader::suite::assignment::Assignment;
use grader::verdict::{Failure, Verdict};
use scene::Scene;
use scene::trace::State;
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

/// The states of a scene with changes.
fn states(scene: &Scene, changes: &[Change]) -> Vec<State> {
    let model = Model::new(scene, changes);
    let mut all = vec![model.start()];
    for step in 0..scene.n_steps() {
        let earlier = all.len().checked_sub(2).map(|before| all[before].clone());
        let Some(stepped) = model.step(step, earlier.as_ref(), &all[all.len() - 1]) else { break };
        all.push(stepped.state);
    }
    all
}

/// The findings on traces with changes, which `written` writes.
fn findings(changes: &[Change], written: fn(Vec<State>) -> Vec<State>) -> Vec<Finding> {
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
                let missing = NoTrace::Missing { stem: (&case.id).into(), other_case: None };
                return Err(Verdict::Fail(Failure::NoTrace(missing)));
            }
            let states = written(states(&case.scene, changes));
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
        all.extend(candidates::of_integrator(scene));
        let terms = scene.forces.iter().flat_map(|element| Term::of(element.schema));
        all.extend(terms.flat_map(|term| candidates::of_term(term).to_vec()));
        all.into_iter().find(|change| change.words == words)
    };
    suite().cases.iter().find_map(|case| of(&case.scene)).expect("a candidate")
}

#[test]
fn changes_are_identified_from_traces() {
    assert_eq!(findings(&[], |states| states), []);
    for words in [
        "explicit-euler: fixed particles stand still, although they have a velocity",
        "linearized-implicit-euler: the velocities of fixed particles are set to zero",
        "masses are read as integers",
        "springforce reads k as an integer",
        "springforce uses b = 1 where it is not given",
        "the last force of a scene is left out where there are several",
        "implicit-euler: Newton's method stops at an update of 1",
        "implicit-euler: Newton's method stops where the sum of the update is negative",
        "explicit-euler: fixed particles stand still, and their velocities are set to zero",
        "springforce has no effect where b is 0",
        "springforce between a fixed and another particle is left out",
        "springforce overwrites the forces on its first particle of the elements before it",
        "each springforce acts on the next edge, whatever its edge attribute",
        "simplegravity does not act on the last particle",
        "symplectic-euler: positions move first, with the old velocity; forces are evaluated there",
        "linearized-implicit-euler: the forces are divided by the mass, and the matrix has M",
    ] {
        let found = findings(&[candidate(words)], |states| states);
        let [Finding { kind: FindingKind::Cause, words: named, .. }] = found.as_slice() else {
            panic!("{words}: {found:#?}");
        };
        assert!(named.iter().any(|named| named == words), "{words}: {named:?}");
    }
}

#[test]
fn states_written_a_step_late_are_an_output_fault() {
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
        let found = findings(&[], written);
        found.first().map(Finding::sentence).unwrap_or_default()
    };
    assert_eq!(sentence(late), "the output: each state is written one step late");
    let velocities = sentence(with_old_velocities);
    assert_eq!(velocities, "the output: the velocities are those of the step before");
}

#[test]
fn scenes_with_two_mistakes_count_as_evidence_for_both() {
    let words = ["dragdamping is multiplied by the mass", "simplegravity has the wrong sign"];
    let found = findings(&words.map(candidate), |states| states);
    let suite = suite();
    for (words, tag) in words.into_iter().zip(["dragdamping", "simplegravity"]) {
        let finding = found.iter().find(|finding| finding.words == [words]).expect(words);
        let has_it = |name: &&String| {
            let case = suite.cases.iter().find(|case| case.id == **name).expect("a scene");
            case.scene.forces.iter().any(|element| element.schema.tag == tag)
        };
        assert!(finding.scenes.iter().all(|name| has_it(&name)), "{finding}");
        assert_eq!(finding.unexplained, 0, "{finding}");
    }
    let both = found[0].scenes.iter().filter(|name| found[1].scenes.contains(name));
    assert!(both.count() > 2, "{found:#?}");
}

#[test]
fn single_precision_input_is_distinguished_from_rounded_output() {
    let read_so = |states: Vec<State>| {
        let mut read = states.clone();
        let State { positions, velocities, .. } = &mut read[0];
        for value in positions.iter_mut().chain(velocities) {
            *value = f64::from(*value as f32);
        }
        read
    };
    let found = findings(&[], read_so);
    let sentence = found.first().map(Finding::sentence).unwrap_or_default();
    assert_eq!(sentence, "reading the scene: the numbers of particles are rounded");
}
