//! Changes with numbers in them, which the search determines from steps; and steps by rounds of local and global steps.

use diagnosis::change::candidates::{self, Numbered};
use diagnosis::change::expression::{Direction, Inputs};
use diagnosis::change::round_changes::of_rounds;
use diagnosis::change::rounds::is_of_rounds;
use diagnosis::change::{Change, Effect, Memory, Model, Place, Sample, Task, Term, edit, forms};
use nalgebra::Vector3;
use reference::method::Method;
use scene::Scene;
use scene::schema::Matrix;
use scene::trace::State;
use simulator::simulation::Simulation;
use test_support::suite;

/// Whether the first step of the scene with a change satisfies its own equation; `None` where there is no such step.
fn is_own_step(scene: &Scene, change: Change) -> Option<bool> {
    let model = Model::new(scene, &[change]);
    let before = model.start();
    let stepped =
        model.step(&mut Memory::default(), 0, None, &before).filter(|stepped| stepped.converged)?;
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let speed = largest(&stepped.state.velocities).max(largest(&before.velocities)).max(1.0);
    let reach = largest(&stepped.state.positions).max(1.0);
    let sample = Sample { step: 0, earlier: None, before, after: stepped.state };
    let residual = model.residual(&sample)?;
    // The tolerance of Newton's method is 1e-9.
    let is_kicked = largest(&residual.momentum) <= 1e-8 * residual.stiffness * speed;
    Some(is_kicked && largest(&residual.position) <= 1e-12 * (reach + speed))
}

#[test]
fn a_step_with_another_number_satisfies_the_equation_with_that_number() {
    let mut count = 0;
    for case in suite().cases.iter().filter(|case| case.scene.particles.len() < 12) {
        let scene = &case.scene;
        let (name, Some(method)) = (scene.integrator.name, Method::one_point(scene.integrator))
        else {
            continue;
        };
        let numbered = Numbered::of(method).into_iter().map(|(family, right)| {
            let numbers: Vec<f64> = right.iter().map(|number| number + 0.125).collect();
            family.with(name, method, &numbers).expect("as many numbers as it has")
        });
        for change in numbered {
            let words = change.words.clone();
            if let Some(is_own) = is_own_step(scene, change) {
                assert!(is_own, "{}: {words}", case.id);
                count += 1;
            }
        }
    }
    assert!(count > 300, "{count} steps");
}

#[test]
fn the_derivatives_of_formulas_with_numbers_are_their_differences() {
    let at = |d: Vector3<f64>| Inputs {
        parameters: &[0.7; 4],
        masses: [1.5, 2.5],
        h: 0.01,
        d,
        v: [Vector3::new(0.3, -1.1, 0.0), Vector3::new(-0.4, 0.2, 0.0)],
        l: d.norm(),
        helper: None,
        by_zero: 0.0,
    };
    let (d, step) = (Vector3::new(0.8, -1.3, 0.0), Vector3::new(1e-6, 2e-6, 0.0));
    let mut count = 0;
    for term in Term::all() {
        let Some(forms) = forms::of(term.schema(), term.part) else { continue };
        for formula in &forms.force {
            let scalars = edit::numbers_in(formula);
            for edit in edit::numbered(formula, &scalars) {
                let formula = (edit.with)(0.3);
                let along = Direction { d: step, ..Direction::default() };
                let derivative = formula.derivative(&at(d), &along).vector();
                let ends = [d + 0.5 * step, d - 0.5 * step].map(|d| formula.value(&at(d)).vector());
                let difference = ends[0] - ends[1];
                let bound = 1e-6 * (difference.norm() + 1e-8);
                let words = (edit.words)("0.3");
                assert!((derivative - difference).norm() <= bound, "{term} {words}");
                count += 1;
            }
        }
    }
    assert!(count > 20, "{count} formulas");
}

/// Where steps have no Jacobian, scenes that forces alone read otherwise have the steps of scenes that are read so as a whole, with
/// each other weight of an element as a second change.
#[test]
fn forces_alone_that_read_another_scene_step_as_in_that_scene() {
    let mut count = 0;
    for case in suite().cases.iter().filter(|case| case.scene.particles.len() < 12) {
        let scene = &case.scene;
        let readings = candidates::of_reading(scene, &[]);
        let in_part = readings.iter().filter_map(|change| {
            let words = change.words.strip_suffix(", in forces alone")?;
            Some([change, readings.iter().find(|whole| whole.words == words)?])
        });
        let model = Model::new(scene, &[]);
        let terms = (0..model.n_terms()).map(|number| model.term(number));
        let lawful = terms.filter(|term| forms::of(term.schema(), term.part).is_none());
        let slips = lawful.flat_map(candidates::of_term);
        let slips = slips.filter(|slip| matches!(slip.effect, Effect::Weight(..)));
        let slips: Vec<Option<&Change>> = slips.map(Some).chain([None]).collect();
        let is_explicit = scene.integrator.matrix != Matrix::Jacobians;
        for pair in in_part.filter(|_| is_explicit && slips.len() > 1) {
            for slip in &slips {
                let [in_part, whole] = pair.map(|reading| {
                    let changes: Vec<Change> =
                        slip.iter().copied().chain([reading]).cloned().collect();
                    made(scene, &changes, 2)
                });
                let last = whole.last().map(|state| &state.positions);
                let reach = last.into_iter().flatten().fold(1.0, |most: f64, x| most.max(x.abs()));
                let words = (&pair[0].words, slip.as_ref().map(|slip| &slip.words));
                assert_eq!(in_part.len(), whole.len(), "{}: {words:?}", case.id);
                let is_same = |pair: (&State, &State)| distance(pair.0, pair.1) <= 1e-9 * reach;
                let pairs = in_part.iter().zip(&whole);
                assert!(pairs.into_iter().all(is_same), "{}: {words:?}", case.id);
                count += 1;
            }
        }
    }
    assert!(count > 300, "{count} pairs");
}

/// States of a scene as far as a model makes them.
fn made(scene: &Scene, changes: &[Change], steps: u64) -> Vec<State> {
    let model = Model::new(scene, changes);
    let mut all = vec![model.start()];
    for step in 0..steps.min(scene.n_steps()) {
        let Some(stepped) = model.step(&mut Memory::default(), step, None, &all[all.len() - 1])
        else {
            break;
        };
        all.push(stepped.state);
    }
    all
}

fn distance(a: &State, b: &State) -> f64 {
    let pairs = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
    };
    pairs(&a.positions, &b.positions)
}

#[test]
fn second_stepper_matches_local_global_rounds() {
    let (mut pinned, mut eliminated, mut stopped) = (0, 0, 0);
    for case in suite().cases.iter().filter(|case| is_of_rounds(&case.scene)) {
        let scene = &case.scene;
        let options = &scene.integrator_options;
        if options.choice("acceleration") != "none" {
            assert!(!Model::new(scene, &[]).can_step(), "{}", case.id);
            continue;
        }
        let mut simulation = Simulation::new(scene);
        for (step, ours) in made(scene, &[], 12).iter().enumerate() {
            if step > 0 {
                simulation.advance().expect("a step");
            }
            let theirs = simulation.state();
            let theirs = State {
                time: None,
                positions: theirs.positions.to_vec(),
                velocities: theirs.velocities.to_vec(),
            };
            let far = distance(ours, &theirs);
            assert!(far <= 1e-12, "{}, step {step}: {far:e}", case.id);
        }
        let has_pins = scene.particles.iter().any(|particle| particle.fixed);
        match options.choice("pins") {
            "penalty" => pinned += u32::from(has_pins),
            _ => eliminated += u32::from(has_pins),
        }
        stopped += u32::from(options.number("tolerance") > 0.0);
    }
    assert!(pinned > 8 && eliminated > 3 && stopped > 0, "{pinned} {eliminated} {stopped}");
}

#[test]
fn visible_changes_of_a_task_differ_on_some_scene() {
    let scenes: Vec<Scene> = suite()
        .cases
        .iter()
        .map(|case| case.scene.clone())
        .filter(|scene| is_of_rounds(scene) && scene.particles.len() < 12)
        .collect();
    let is_shown = |words: &str| {
        let mut in_scenes = scenes.iter().filter_map(|scene| {
            let change = of_rounds(scene).into_iter().find(|change| change.words == words)?;
            let (right, changed) = (made(scene, &[], 6), made(scene, &[change], 6));
            let pairs = right.iter().zip(&changed);
            let far = pairs.map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
            Some(right.len() != changed.len() || far > 1e-9)
        });
        in_scenes.any(|shown| shown)
    };
    let mut all: Vec<(Task, String)> = Vec::new();
    for change in scenes.iter().flat_map(of_rounds) {
        if let Place::Task(task) = change.place
            && !all.iter().any(|(_, words)| *words == change.words)
        {
            all.push((task, change.words));
        }
    }
    for task in Task::ALL {
        assert!(all.iter().filter(|(of, _)| *of == task).count() > 5, "{task}");
    }
    let idle: Vec<&String> =
        all.iter().map(|(_, words)| words).filter(|words| !is_shown(words)).collect();
    assert_eq!(idle, [""; 0]);
}
