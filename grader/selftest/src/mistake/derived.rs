//! Mistakes in the forces and methods for which none is written by hand: derived from the registries.

use diagnosis::findings::Part;
use reference::method::{Method, Substep};
use scene::Dimension;
use scene::schema::{Family, ForceSchema, IntegratorSchema};
use simulator::{force, integrator};

use super::super::student::{Deviation, OWN_FORCES, Row, Student, steps_by_itself};
use super::{Area, Mistake, Scope, Subject};

/// The forces that the student takes from the reference. It knows the plane alone.
fn forces() -> impl Iterator<Item = &'static ForceSchema> {
    let schemas = force::REGISTRY.iter().map(|kind| &kind.schema);
    schemas.filter(|schema| {
        let is_own = OWN_FORCES.contains(&schema.tag);
        !is_own && schema.exists_in(Dimension::Two) && !schema.depends_on().time
    })
}

pub(super) fn in_forces() -> Vec<Mistake> {
    let of = |schema: &'static ForceSchema| {
        let scope = Scope::Force(Part::of(schema)[0]);
        let subject = Subject { area: Area::Force, name: schema.title, scope };
        let factor = |description, factor| spoilt(&subject, schema, description, [factor; 2]);
        [factor("missing", 0.0), factor("wrong sign", -1.0), factor("twice as large", 2.0)]
    };
    forces().flat_map(of).collect()
}

pub(super) fn in_jacobians() -> Vec<Mistake> {
    let of = |schema: &'static ForceSchema| {
        let scope = Scope::Jacobian(Part::of(schema)[0]);
        let subject = Subject { area: Area::Jacobian, name: schema.title, scope };
        let factor = |description, factor| spoilt(&subject, schema, description, [1.0, factor]);
        [
            factor("Jacobian missing", 0.0),
            factor("Jacobian with the wrong sign", -1.0),
            factor("Jacobian half as large", 0.5),
        ]
    };
    forces().filter(|schema| schema.depends_on().has_jacobian()).flat_map(of).collect()
}

fn spoilt(
    subject: &Subject,
    schema: &'static ForceSchema,
    description: &'static str,
    factors: [f64; 2],
) -> Mistake {
    let tag = schema.tag;
    subject.mistake(description, move |s: &mut Student| s.others.spoilt = Some((tag, factors)))
}

pub(super) fn in_integrators() -> Vec<Mistake> {
    let of = |schema: &'static IntegratorSchema| {
        let scope = Scope::Integrator(schema.name);
        let subject = Subject { area: Area::Integrator, name: schema.name, scope };
        match Method::of(schema.equation) {
            Method::Explicit(_) => in_substeps(&subject),
            Method::Stages(_) => in_stages(&subject),
            Method::Backward { .. } => in_parts(&subject),
            Method::Differences { .. } => in_differences(&subject),
            Method::Controlled(_) | Method::Rounds => Vec::new(),
        }
    };
    let schemas = integrator::REGISTRY.iter().map(|kind| &kind.schema);
    let derived = schemas.filter(|schema| {
        schema.family != Family::Minimization && !steps_by_itself(schema.equation)
    });
    derived.flat_map(of).collect()
}

fn in_substeps(subject: &Subject) -> Vec<Mistake> {
    let of = |description, make| deviating(subject, description, Deviation::Substeps(make));
    vec![
        of("its last substep missing", |substeps| substeps[..substeps.len() - 1].to_vec()),
        of("substeps of the whole step's length", |substeps| substeps.iter().map(whole).collect()),
        of("a step of explicit Euler", |_| vec![Substep::Both(1.0)]),
    ]
}

fn in_stages(subject: &Subject) -> Vec<Mistake> {
    let of = |description, make| deviating(subject, description, Deviation::Stages(make));
    vec![
        of("its last stage has no weight", |mut rows| {
            if let Some(end) = rows.last_mut() {
                end.iter_mut().for_each(|row| row.truncate(row.len() - 1));
            }
            rows
        }),
        of("positions move with the velocity at the start", |rows| {
            rows.into_iter().map(by_the_first).collect()
        }),
        of("a step of explicit Euler", |_| vec![Row::default(), [vec![1.0], vec![1.0]]]),
    ]
}

fn in_parts(subject: &Subject) -> Vec<Mistake> {
    let of = |description, make| deviating(subject, description, Deviation::Part(make));
    vec![
        of("a step of implicit Euler", |_| 1.0),
        of("the force of another time", |part| 0.5 * (1.0 + part)),
    ]
}

fn in_differences(subject: &Subject) -> Vec<Mistake> {
    let of = |description, make| deviating(subject, description, Deviation::Repeated(make));
    vec![
        of("each step is the first", |_| 0.0),
        of("another part of the step before", |part| 0.75 * part),
        of("the step before with the wrong sign", |part| -part),
        of("the first step as if nothing had moved before", |_| 1.0 / 3.0),
    ]
}

fn deviating(subject: &Subject, description: &'static str, deviation: Deviation) -> Mistake {
    let name = subject.name;
    subject.mistake(description, move |s: &mut Student| s.others.methods.push((name, deviation)))
}

fn by_the_first([of_velocities, of_forces]: Row) -> Row {
    [vec![of_velocities.iter().sum()], of_forces]
}

fn whole(substep: &Substep) -> Substep {
    match substep {
        Substep::Both(_) => Substep::Both(1.0),
        Substep::Kick(_) => Substep::Kick(1.0),
        Substep::Drift(_) => Substep::Drift(1.0),
    }
}
