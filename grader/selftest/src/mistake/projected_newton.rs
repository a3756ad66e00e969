//! Mistakes in projected Newton: operations on the terms of the energy, its gradient and its Hessian; and its rules.

use diagnosis::findings::{Feature, Part};
use scene::Scene;
use scene::schema::Family;

use super::super::student::{ProjectedNewton, Student, Vec2, largest, largest_row};
use super::{
    Area, Mistake, NEGATE, OMIT, OMIT_H, OMIT_QUANTITY, Operation, Place, Scope, Subject,
    TAKE_ROOT_OF_H,
};

const NAME: &str = "projected-newton";

/// Where a term may be wrong: in energy, gradient and Hessian alike, or in one of them.
const PLACES: [(&str, &[usize]); 4] = [
    ("projected Newton, energy and derivatives", &[0, 1, 2]),
    ("projected Newton, energy", &[0]),
    ("projected Newton, gradient", &[1]),
    ("projected Newton, Hessian", &[2]),
];

const ON_INERTIA: &[Operation] =
    &[("inertia missing", OMIT), ("inertia without the mass", OMIT_QUANTITY)];

const ON_ELASTICITY: &[Operation] = &[
    ("elasticity missing", OMIT),
    ("elasticity with the wrong sign", NEGATE),
    ("elasticity times h instead of h²", TAKE_ROOT_OF_H),
    ("elasticity not times h²", OMIT_H),
];

pub(super) fn mistakes() -> Vec<Mistake> {
    let of = |name| {
        let subject = Subject { area: Area::Integrator, name, scope: Scope::Integrator(NAME) };
        Place { subject, of: |s: &mut Student| &mut s.projected_newton }
    };
    let mut mistakes = in_rules(&of("projected Newton"));
    mistakes.extend(in_springs());
    for (name, places) in PLACES {
        let of = of(name);
        for (term, operations) in [ON_INERTIA, ON_ELASTICITY].into_iter().enumerate() {
            mistakes.extend(operations.iter().map(|(description, operation)| {
                of.mistake(description, move |method| {
                    for place in places {
                        operation(&mut method.terms[*place][term]);
                    }
                })
            }));
        }
    }
    mistakes
}

fn in_rules(of: &Place<ProjectedNewton>) -> Vec<Mistake> {
    vec![
        of.mistake("½ of inertia missing in the energy", |method| method.terms[0][0].scale = 2.0),
        of.mistake("x̃ without h v", |method| method.ahead = |q, _, _| q),
        of.mistake("x̃ without h", |method| method.ahead = |q, v, _| q + v),
        of.mistake("x̃ backwards", |method| method.ahead = |q, v, h| q - h * v),
        of.mistake("starts from x̃", |method| method.first = |q, v, h| q + h * v),
        of.mistake("Hessian not projected", |method| method.project = |blocks| blocks),
        of.mistake("no line search", |method| method.searches = false),
        of.mistake("a single iteration", |method| method.iterations = 1),
        of.mistake("two iterations", |method| method.iterations = 2),
        of.mistake("tolerance on ‖p‖∞, not on ‖p‖∞/h", |method| {
            method.measure = |p, _, _| largest_row(p)
        }),
        of.mistake("tolerance on ‖p‖₂/h", |method| method.measure = |p, h, _| p.norm() / h),
        of.mistake("tolerance on the largest entry without its sign", |method| {
            method.measure = |p, h, _| p.max() / h
        }),
        of.mistake("tolerance on the largest entry", |method| {
            method.measure = |p, h, _| largest(p) / h
        }),
        of.mistake("tolerance on the first entry", |method| {
            method.measure = |p, h, _| p[0].abs() / h
        }),
        of.mistake("the last step is taken as well", |method| method.takes_last = true),
        of.mistake("velocity not renewed", |method| method.velocity = |_, _, v, _| v),
        of.mistake("velocity without 1/h", |method| method.velocity = |q, x, _, _| x - q),
        of.mistake("velocity with the wrong sign", |method| {
            method.velocity = |q, x, _, h| (q - x) / h
        }),
        of.mistake("velocity from x̃", |method| {
            method.velocity = |q: Vec2, x, v, h| (x - (q + h * v)) / h
        }),
    ]
}

/// Mistakes in the energy of squared springs: made in its derivatives as well, and in the energy alone, where the line search
/// alone is wrong.
fn in_springs() -> Vec<Mistake> {
    let of = |name, feature| Subject {
        area: Area::Integrator,
        name,
        scope: Scope::Within(NAME, has_springs, feature),
    };
    let law = of("projected Newton, law of springs", Feature::Force(Part::All(SQUARED)));
    let energy = of("projected Newton, energy of springs", Feature::Integrator(NAME));
    vec![
        law.mistake("½ missing", |s| {
            s.read = |scene| replace_springs(scene, |[k, l0]| [2.0 * k, l0]);
        }),
        law.mistake("l0² missing", |s| {
            s.read = |scene| replace_springs(scene, |[k, l0]| [k / (l0 * l0), l0]);
        }),
        law.mistake("rest lengths not squared", |s| {
            s.read = |scene| replace_springs(scene, |[k, l0]| [k, l0.sqrt()]);
        }),
        energy.mistake("½ missing", |s: &mut Student| {
            s.green_energy =
                |pair, p| p["k"] * p["l0"].powi(2) * ((pair.l() / p["l0"]).powi(2) - 1.0).powi(2);
        }),
        energy.mistake("l0² missing", |s| {
            s.green_energy = |pair, p| 0.5 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0).powi(2);
        }),
        energy.mistake("strain not squared", |s| {
            s.green_energy =
                |pair, p| 0.5 * p["k"] * p["l0"].powi(2) * ((pair.l() / p["l0"]).powi(2) - 1.0);
        }),
        energy.mistake("that of a Hookean spring", |s| {
            s.green_energy = |pair, p| 0.5 * p["k"] * (pair.l() - p["l0"]).powi(2);
        }),
    ]
}

fn has_springs(scene: &Scene) -> bool {
    scene.forces.iter().any(|force| force.schema.tag == SQUARED)
}

const SQUARED: &str = "greenspringforce";

/// Replaces stiffness and rest length of the squared springs that are minimised.
fn replace_springs(scene: &mut Scene, by: fn([f64; 2]) -> [f64; 2]) {
    if scene.integrator.family != Family::Minimization {
        return;
    }
    for element in scene.forces.iter_mut().filter(|force| force.schema.tag == SQUARED) {
        let values = by(["k", "l0"].map(|name| element.parameter(name)));
        for (name, value) in ["k", "l0"].into_iter().zip(values) {
            *element.parameter_mut(name) = value;
        }
    }
}
