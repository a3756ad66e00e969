//! Changes with numbers in them, which the search determines from steps.

use nalgebra::Vector3;
use reference::change::candidates::Numbered;
use reference::change::expression::{Direction, Inputs};
use reference::change::{Change, Model, Sample, Term, edit, forms};
use reference::method::Method;
use simulator::scene::Scene;
use simulator::scene::schema::MAX_PARAMETERS;
use test_support::suite;

/// Whether the first step of the scene with a change satisfies its own equation; `None` where there is no such step.
fn is_own_step(scene: &Scene, change: Change) -> Option<bool> {
    let model = Model::new(scene, &[change]);
    let before = model.start();
    let stepped = model.step(0, None, &before).filter(|stepped| stepped.converged)?;
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
        parameters: [0.7; MAX_PARAMETERS],
        masses: [1.5, 2.5],
        h: 0.01,
        d,
        v: [Vector3::new(0.3, -1.1, 0.0), Vector3::new(-0.4, 0.2, 0.0)],
        l: d.norm(),
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
