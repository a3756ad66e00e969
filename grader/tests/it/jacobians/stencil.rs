//! The check of a force between three particles that is defined in tests: the simulator's, against a law stated here.

use grader::white_box::{
    Config, JacobianCheck, Maker, Property, Subject, Verdict, check_against, simulated_of_kinds,
};
use num_dual::DualNum;
use reference::law::{
    At, Jacobians, Law, Number, Scale, StencilLaw, Symmetry, Vector, difference, dot, forces_of,
    norm,
};
use scene::{Dimension, Scene};
use simulator::force::{Coupling, Degenerate};

use super::bending::BENDING;

static LAW: Law = law((forces, forces));

/// A law whose particles feel twice the force.
static DOUBLED: Law = law((doubled, doubled));

const fn law(forms: (StencilLaw<f64>, StencilLaw<num_dual::Dual64>)) -> Law {
    let names = &["stiffness", "c0"];
    Law::of_stencil("testbendingforce", names, Symmetry::Isotropic, 3, forms, scale)
}

/// `U = k/2 (c − c0)²` with `c = a·b/(|a| |b|)`.
fn forces<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    forces_of(at, |x| {
        let [a, b] = [difference(&x[0], &x[1]), difference(&x[2], &x[1])];
        let bent = dot(a, b) / (dot(a, a) * dot(b, b)).sqrt() - p[1];
        bent * bent * (0.5 * p[0])
    })
}

fn doubled<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    forces(&[2.0 * p[0], p[1]], at)
}

fn scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let arm = |end: usize| norm(&difference(&at[end].position, &at[1].position));
    let per_length = 1.0 / arm(0).min(arm(2));
    let bent = 1.0 + p[1].abs();
    Scale {
        energy: p[0] * bent * bent,
        force: 4.0 * p[0] * bent * per_length,
        by_position: 16.0 * p[0] * bent * per_length * per_length,
        by_velocity: 0.0,
    }
}

fn check(law: &'static Law, dimension: Dimension, make: &Maker<'_>) -> JacobianCheck {
    check_against(&BENDING, law, dimension, Config::default(), make)
}

fn simulated(scene: &Scene) -> Box<dyn Subject> {
    simulated_of_kinds(scene, &[&BENDING])
}

const DIMENSIONS: [Dimension; 2] = [Dimension::Two, Dimension::Three];

#[test]
fn three_particle_jacobians_are_correct_by_every_opinion() {
    for dimension in DIMENSIONS {
        let check = check(&LAW, dimension, &simulated);
        let properties: Vec<_> =
            check.properties.iter().map(|finding| (finding.property, finding.verdict)).collect();
        assert!(
            properties.iter().all(|(_, verdict)| *verdict == Verdict::Correct),
            "{dimension:?}: {properties:?}"
        );
        for finding in &check.blocks {
            assert!(
                matches!(finding.verdict, Verdict::Correct | Verdict::CorrectZero),
                "{dimension:?}: {:?} {:?}",
                finding.kind,
                finding.verdict
            );
        }
    }
}

#[test]
fn force_that_differs_from_its_three_particle_law_is_wrong() {
    for dimension in DIMENSIONS {
        let check = check(&DOUBLED, dimension, &simulated);
        let force = check.properties.iter().find(|finding| finding.property == Property::Force);
        assert_eq!(force.unwrap().verdict, Verdict::Wrong);
    }
}

/// The blocks between the two arms left out, and so added to those of the particle between them.
struct Separate(Box<dyn Subject>, Scene);

impl Subject for Separate {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.0.force(x, v, time, force)
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        let mut jacobians = self.0.jacobians(x, v, time)?;
        let d = self.1.dimension.count();
        for element in &self.1.forces {
            let [i, j, k] = [0, 1, 2].map(|place| element.particles[place] * d);
            for (row, column) in [(i, k), (k, i)] {
                let by_position = &mut jacobians.by_position;
                let block = by_position.view((row, column), (d, d)).clone_owned();
                for (at, sign) in
                    [((row, column), -1.0), ((row, j), 1.0), ((j, column), 1.0), ((j, j), -1.0)]
                {
                    let mut view = by_position.view_mut(at, (d, d));
                    view += &block * sign;
                }
            }
        }
        Ok(jacobians)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        self.0.energy(x, v, time)
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.0.couplings()
    }
}

#[test]
fn jacobian_without_the_blocks_between_the_arms_is_wrong() {
    for dimension in DIMENSIONS {
        let make = |scene: &Scene| -> Box<dyn Subject> {
            Box::new(Separate(simulated(scene), scene.clone()))
        };
        let check = check(&LAW, dimension, &make);
        let of = |property| {
            let found = check.properties.iter().find(|finding| finding.property == property);
            found.unwrap().verdict
        };
        // It is symmetric and does not change with a translation, but is not the Hessian.
        assert_eq!(of(Property::Symmetry), Verdict::Correct);
        assert_eq!(of(Property::Translation), Verdict::Correct);
        assert_eq!(of(Property::Hessian), Verdict::Wrong);
        assert!(check.blocks.iter().any(|finding| finding.verdict == Verdict::Wrong));
    }
}
