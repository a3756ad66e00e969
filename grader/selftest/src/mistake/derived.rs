//! Mistakes in the forces and methods for which none is written by hand: derived from the registries.

use grader::findings::Part;
use reference::method::{Method, Substep};
use simulator::scene::schema::{Family, ForceSchema, IntegratorSchema};
use simulator::{force, integrator};

use super::super::student::{OWN_FORCES, Student, steps_by_itself};
use super::{Area, Mistake, Scope, Subject};

/// The forces that the student takes from the reference.
fn forces() -> impl Iterator<Item = &'static ForceSchema> {
    let schemas = force::REGISTRY.iter().map(|kind| &kind.schema);
    schemas.filter(|schema| !OWN_FORCES.contains(&schema.tag) && !schema.depends_on().time)
}

pub(super) fn in_forces() -> Vec<Mistake> {
    let of = |schema: &'static ForceSchema| {
        let scope = Scope::Force(Part::of(schema)[0]);
        let subject = Subject { area: Area::Force, name: schema.title, scope };
        [
            subject.mistake("missing", |s: &mut Student| s.others.factors = |_| [0.0; 2]),
            subject.mistake("wrong sign", |s: &mut Student| s.others.factors = |_| [-1.0; 2]),
            subject.mistake("twice as large", |s: &mut Student| s.others.factors = |_| [2.0; 2]),
        ]
    };
    forces().flat_map(of).collect()
}

pub(super) fn in_jacobians() -> Vec<Mistake> {
    let of = |schema: &'static ForceSchema| {
        let scope = Scope::Jacobian(Part::of(schema)[0]);
        let subject = Subject { area: Area::Jacobian, name: schema.title, scope };
        [
            subject.mistake("missing", |s: &mut Student| s.others.factors = |_| [1.0, 0.0]),
            subject.mistake("wrong sign", |s: &mut Student| s.others.factors = |_| [1.0, -1.0]),
            subject.mistake("half as large", |s: &mut Student| s.others.factors = |_| [1.0, 0.5]),
        ]
    };
    forces().filter(|schema| schema.depends_on().has_jacobian()).flat_map(of).collect()
}

pub(super) fn in_integrators() -> Vec<Mistake> {
    let of = |schema: &'static IntegratorSchema| {
        let scope = Scope::Integrator(schema.name);
        let subject = Subject { area: Area::Integrator, name: schema.name, scope };
        [
            subject.mistake("its last substep missing", |s: &mut Student| {
                s.others.substeps = |substeps| substeps[..substeps.len() - 1].to_vec();
            }),
            subject.mistake("substeps of the whole step's length", |s: &mut Student| {
                s.others.substeps = |substeps| substeps.iter().map(whole).collect();
            }),
            subject.mistake("a step of explicit Euler", |s: &mut Student| {
                s.others.substeps = |_| vec![Substep::Both(1.0)];
            }),
        ]
    };
    let schemas = integrator::REGISTRY.iter().map(|kind| &kind.schema);
    let derived = schemas.filter(|schema| {
        let is_known = schema.family != Family::Minimization
            && matches!(Method::of(schema.equation), Method::Explicit(_));
        is_known && !steps_by_itself(schema.equation)
    });
    derived.flat_map(of).collect()
}

fn whole(substep: &Substep) -> Substep {
    match substep {
        Substep::Both(_) => Substep::Both(1.0),
        Substep::Kick(_) => Substep::Kick(1.0),
        Substep::Drift(_) => Substep::Drift(1.0),
    }
}
