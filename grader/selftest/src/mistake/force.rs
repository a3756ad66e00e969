//! Mistakes in forces.

use diagnosis::findings::Part;
use scene::Scene;

use super::super::student::{
    self, BodyForce, PairForce, Student, Vec2, constant_force, drag, quarter_turn, simple_gravity,
};
use super::{Area, Mistake, Scope, Subject};

pub(super) fn mistakes() -> Vec<Mistake> {
    let groups = [
        in_simple_gravity(),
        in_constant_force(),
        in_elastic_force(),
        in_green_force(),
        in_damping(),
        in_gravitation(),
        in_drag(),
        in_vortex(),
    ];
    groups.into_iter().flatten().collect()
}

fn subject(name: &'static str, part: Part) -> Subject {
    Subject { area: Area::Force, name, scope: Scope::Force(part) }
}

/// Keeps only the last element with this tag.
fn keep_last(scene: &mut Scene, tag: &str) {
    let last = scene.forces.iter().rposition(|element| element.schema.tag == tag);
    let mut number = 0..;
    scene.forces.retain(|element| {
        let number = number.next();
        element.schema.tag != tag || number == last
    });
}

/// Keeps only the last spring on every edge.
fn keep_last_on_each_edge(scene: &mut Scene) {
    let edges: Vec<Option<usize>> = scene.forces.iter().map(|element| element.edge).collect();
    let mut number = 0;
    scene.forces.retain(|element| {
        number += 1;
        element.edge.is_none() || !edges[number..].contains(&element.edge)
    });
}

/// Mistakes possible in any force on single particles.
fn in_any(subject: &Subject, of: fn(&mut Student) -> &mut BodyForce) -> Vec<Mistake> {
    vec![subject.mistake("missing", move |s| *of(s) = |_, _| Vec2::zeros())]
}

/// Mistakes possible in any pair force.
fn in_any_pair(subject: &Subject, of: fn(&mut Student) -> &mut PairForce) -> Vec<Mistake> {
    vec![
        subject.mistake("missing", move |s| of(s).share = |_| [Vec2::zeros(); 2]),
        subject.mistake("wrong sign", move |s| of(s).share = |f| [-f, f]),
        subject.mistake("reaction on j missing", move |s| of(s).share = |f| [f, Vec2::zeros()]),
        subject.mistake("acts on j only", move |s| of(s).share = |f| [Vec2::zeros(), -f]),
        subject.mistake("reaction on j with the sign of the action", move |s| {
            of(s).share = |f| [f, f];
        }),
    ]
}

fn in_simple_gravity() -> Vec<Mistake> {
    let of = subject("simple gravity", Part::All("simplegravity"));
    let mut mistakes = in_any(&of, |s| &mut s.simple_gravity);
    mistakes.extend([
        of.mistake("wrong sign", |s| s.simple_gravity = |body, p| -simple_gravity(body, p)),
        of.mistake("not scaled by mass", |s| s.simple_gravity = |_, p| Vec2::new(p["fx"], p["fy"])),
        of.mistake("x and y swapped", |s| {
            s.simple_gravity = |body, p| body.m * Vec2::new(p["fy"], p["fx"]);
        }),
        of.mistake("only along y", |s| {
            s.simple_gravity = |body, p| body.m * Vec2::new(0.0, p["fy"])
        }),
        of.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "simplegravity");
        }),
    ]);
    mistakes
}

fn in_constant_force() -> Vec<Mistake> {
    let of = subject("constant force", Part::All("constantforce"));
    let mut mistakes = in_any(&of, |s| &mut s.constant_force);
    mistakes.extend([
        of.mistake("wrong sign", |s| s.constant_force = |body, p| -constant_force(body, p)),
        of.mistake("scaled by mass", |s| {
            s.constant_force = |body, p| body.m * constant_force(body, p);
        }),
        of.mistake("x and y swapped", |s| s.constant_force = |_, p| Vec2::new(p["fy"], p["fx"])),
        of.mistake("only the first particle feels it", |s| {
            s.constant_force = |body, p| first_only(body, constant_force(body, p));
        }),
        of.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "constantforce");
        }),
    ]);
    mistakes
}

fn first_only(body: &student::Body, force: Vec2) -> Vec2 {
    if body.number == 0 { force } else { Vec2::zeros() }
}

fn in_elastic_force() -> Vec<Mistake> {
    let of = subject("spring, elastic force", Part::One("springforce", "elastic"));
    let mut mistakes = in_any_pair(&of, |s| &mut s.elastic);
    mistakes.extend([
        of.mistake("no rest length", |s| s.elastic.on_i = |pair, p| -p["k"] * pair.d()),
        of.mistake("rest length added instead of subtracted", |s| {
            s.elastic.on_i = |pair, p| -p["k"] * (pair.l() + p["l0"]) * pair.n();
        }),
        of.mistake("stiffness missing", |s| {
            s.elastic.on_i = |pair, p| -(pair.l() - p["l0"]) * pair.n();
        }),
        of.mistake("stiffness doubled (energy without its 1/2)", |s| {
            s.elastic.on_i = |pair, p| -2.0 * p["k"] * (pair.l() - p["l0"]) * pair.n();
        }),
        of.mistake("stiffness halved (1/2 kept in the gradient)", |s| {
            s.elastic.on_i = |pair, p| -0.5 * p["k"] * (pair.l() - p["l0"]) * pair.n();
        }),
        of.mistake("direction not normalised", |s| {
            s.elastic.on_i = |pair, p| -p["k"] * (pair.l() - p["l0"]) * pair.d();
        }),
        of.mistake("only pulls, never pushes", |s| {
            s.elastic.on_i = |pair, p| -p["k"] * (pair.l() - p["l0"]).max(0.0) * pair.n();
        }),
        of.mistake("only one spring on each edge", |s| s.read = keep_last_on_each_edge),
    ]);
    mistakes
}

fn in_green_force() -> Vec<Mistake> {
    let of = subject("spring of squared length", Part::All("greenspringforce"));
    let mut mistakes = in_any_pair(&of, |s| &mut s.green);
    mistakes.extend([
        of.mistake("factor 2 missing", |s| {
            s.green.on_i = |pair, p| -p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.d();
        }),
        of.mistake("factor 4 instead of 2", |s| {
            s.green.on_i =
                |pair, p| -4.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.d();
        }),
        of.mistake("lengths not squared", |s| {
            s.green.on_i = |pair, p| -2.0 * p["k"] * (pair.l() / p["l0"] - 1.0) * pair.d();
        }),
        of.mistake("not divided by l0²", |s| {
            s.green.on_i =
                |pair, p| -2.0 * p["k"] * (pair.l().powi(2) - p["l0"].powi(2)) * pair.d();
        }),
        of.mistake("along the direction instead of the difference", |s| {
            s.green.on_i =
                |pair, p| -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.n();
        }),
        of.mistake("a Hookean spring", |s| {
            s.green.on_i = |pair, p| -p["k"] * (pair.l() - p["l0"]) * pair.n();
        }),
        of.mistake("pulls only", |s| {
            s.green.on_i =
                |pair, p| -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0).max(0.0) * pair.d();
        }),
    ]);
    mistakes
}

fn in_damping() -> Vec<Mistake> {
    let of = subject("spring, damping", Part::One("springforce", "damping"));
    let mut mistakes = in_any_pair(&of, |s| &mut s.damping);
    mistakes.extend([
        of.mistake("not projected on the spring's axis", |s| {
            s.damping.on_i = |pair, p| -p["b"] * pair.w();
        })
        .missed_by_the_course(),
        of.mistake("uses the velocity of i only", |s| {
            s.damping.on_i = |pair, p| -p["b"] * pair.n().dot(&pair.v[0]) * pair.n();
        }),
        of.mistake("adds the velocities of i and j", |s| {
            s.damping.on_i = |pair, p| -p["b"] * pair.n().dot(&(pair.v[0] + pair.v[1])) * pair.n();
        }),
        of.mistake("coefficient missing", |s| {
            s.damping.on_i = |pair, _| -pair.n().dot(&pair.w()) * pair.n();
        }),
        of.mistake("scaled by the spring's stiffness", |s| {
            s.damping.on_i = |pair, p| -p["k"] * p["b"] * pair.n().dot(&pair.w()) * pair.n();
        }),
        of.mistake("direction not normalised", |s| {
            s.damping.on_i = |pair, p| -p["b"] * pair.d().dot(&pair.w()) * pair.d();
        }),
        of.mistake("speed instead of velocity along the axis", |s| {
            s.damping.on_i = |pair, p| -p["b"] * pair.n().dot(&pair.w()).abs() * pair.n();
        }),
    ]);
    mistakes
}

fn in_gravitation() -> Vec<Mistake> {
    let of = subject("gravitation", Part::All("gravitationalforce"));
    let mut mistakes = in_any_pair(&of, |s| &mut s.gravitation);
    mistakes.extend([
        of.mistake("G missing", |s| {
            s.gravitation.on_i = |pair, _| -pair.m[0] * pair.m[1] / pair.l().powi(2) * pair.n();
        }),
        of.mistake("first mass missing", |s| {
            s.gravitation.on_i = |pair, p| -p["G"] * pair.m[1] / pair.l().powi(2) * pair.n();
        }),
        of.mistake("second mass missing", |s| {
            s.gravitation.on_i = |pair, p| -p["G"] * pair.m[0] / pair.l().powi(2) * pair.n();
        }),
        of.mistake("1/l instead of 1/l²", |s| {
            s.gravitation.on_i = |pair, p| -p["G"] * pair.m[0] * pair.m[1] / pair.l() * pair.n();
        }),
        of.mistake("1/l³ instead of 1/l²", |s| {
            s.gravitation.on_i =
                |pair, p| -p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(3) * pair.n();
        }),
        of.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "gravitationalforce");
        }),
    ]);
    mistakes
}

fn in_drag() -> Vec<Mistake> {
    let of = subject("linear drag", Part::All("dragdamping"));
    let mut mistakes = in_any(&of, |s| &mut s.drag);
    mistakes.extend([
        of.mistake("wrong sign", |s| s.drag = |body, p| -drag(body, p)),
        of.mistake("scaled by mass", |s| s.drag = |body, p| body.m * drag(body, p))
            .missed_by_the_course(),
        of.mistake("only along x", |s| s.drag = |body, p| Vec2::new(-p["b"] * body.v.x, 0.0)),
        of.mistake("only the first particle feels it", |s| {
            s.drag = |body, p| first_only(body, drag(body, p));
        }),
        of.mistake("quadratic in the velocity", |s| {
            s.drag = |body, p| -p["b"] * body.v.norm() * body.v;
        }),
        of.mistake("coefficient missing", |s| s.drag = |body, _| -body.v),
        of.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "dragdamping");
        }),
    ]);
    mistakes
}

fn in_vortex() -> Vec<Mistake> {
    let of = subject("vortex", Part::All("vortexforce"));
    let mut mistakes = in_any_pair(&of, |s| &mut s.vortex);
    mistakes.extend([
        of.mistake("no rotation of n", |s| {
            s.vortex.on_i =
                |pair, p| p["kvc"] / pair.l().powi(2) * (p["kbs"] * pair.n() - pair.w());
        }),
        of.mistake("rotation the other way round", |s| {
            s.vortex.on_i = |pair, p| {
                p["kvc"] / pair.l().powi(2) * (-p["kbs"] * quarter_turn() * pair.n() - pair.w())
            };
        }),
        of.mistake("kbs missing", |s| {
            s.vortex.on_i =
                |pair, p| p["kvc"] / pair.l().powi(2) * (quarter_turn() * pair.n() - pair.w());
        }),
        of.mistake("kvc missing", |s| {
            s.vortex.on_i =
                |pair, p| (p["kbs"] * quarter_turn() * pair.n() - pair.w()) / pair.l().powi(2);
        }),
        of.mistake("kvc on the viscous part only", |s| {
            s.vortex.on_i = |pair, p| {
                (p["kbs"] * quarter_turn() * pair.n() - p["kvc"] * pair.w()) / pair.l().powi(2)
            };
        }),
        of.mistake("rotating part missing", |s| {
            s.vortex.on_i = |pair, p| -p["kvc"] / pair.l().powi(2) * pair.w();
        }),
        of.mistake("viscous part missing", |s| {
            s.vortex.on_i =
                |pair, p| p["kvc"] / pair.l().powi(2) * p["kbs"] * quarter_turn() * pair.n();
        }),
        of.mistake("viscous part with the wrong sign", |s| {
            s.vortex.on_i = |pair, p| {
                p["kvc"] / pair.l().powi(2) * (p["kbs"] * quarter_turn() * pair.n() + pair.w())
            };
        }),
        of.mistake("viscous part uses the velocity of i only", |s| {
            s.vortex.on_i = |pair, p| {
                p["kvc"] / pair.l().powi(2) * (p["kbs"] * quarter_turn() * pair.n() - pair.v[0])
            };
        }),
        of.mistake("1/r instead of 1/r²", |s| {
            s.vortex.on_i =
                |pair, p| p["kvc"] / pair.l() * (p["kbs"] * quarter_turn() * pair.n() - pair.w());
        }),
        of.mistake("1/r³ instead of 1/r²", |s| {
            s.vortex.on_i = |pair, p| {
                p["kvc"] / pair.l().powi(3) * (p["kbs"] * quarter_turn() * pair.n() - pair.w())
            };
        }),
    ]);
    mistakes
}
