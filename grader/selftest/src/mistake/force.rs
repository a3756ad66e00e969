//! Mistakes in forces.

use diagnosis::findings::Part;
use scene::Scene;

use super::super::student::{
    self, BodyForce, PairForce, PairFormula, Student, Vec2, constant_force, drag, quarter_turn,
    simple_gravity,
};
use super::{Area, Mistake, Place, Scope, Subject};

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
        in_helpers(),
    ];
    groups.into_iter().flatten().collect()
}

pub(super) fn place<T>(name: &'static str, part: Part, of: fn(&mut Student) -> &mut T) -> Place<T> {
    Place { subject: Subject { area: Area::Force, name, scope: Scope::Force(part) }, of }
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

/// Joins each spring's first particle to the one whose number is that of the edge.
fn take_edge_for_second(scene: &mut Scene) {
    let count = scene.particles.len();
    for element in scene.forces.iter_mut().filter(|element| element.schema.tag == "springforce") {
        if let Some(edge) = element.edge.filter(|edge| *edge < count) {
            element.particles[1] = edge;
        }
    }
}

fn in_helpers() -> Vec<Mistake> {
    let of = Subject { area: Area::Force, name: "functions on vectors", scope: Scope::Pairs };
    vec![
        of.mistake("length without its root", |s| s.length = |d| d.norm_squared()),
        of.mistake("length as the sum of the components", |s| s.length = |d| d.abs().sum()),
    ]
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

impl Place<BodyForce> {
    pub(super) fn law(&self, description: &'static str, law: BodyForce) -> Mistake {
        self.mistake(description, move |force| *force = law)
    }

    /// Mistakes possible in any force on single particles, and these.
    fn with(&self, mistakes: impl IntoIterator<Item = Mistake>) -> Vec<Mistake> {
        [self.law("missing", |_, _| Vec2::zeros())].into_iter().chain(mistakes).collect()
    }
}

impl Place<PairForce> {
    pub(super) fn law(&self, description: &'static str, on_i: PairFormula<Vec2>) -> Mistake {
        self.mistake(description, move |force| force.on_i = on_i)
    }

    fn share(&self, description: &'static str, share: fn(Vec2) -> [Vec2; 2]) -> Mistake {
        self.mistake(description, move |force| force.share = share)
    }

    /// Mistakes possible in any pair force, and these.
    pub(super) fn with(&self, mistakes: impl IntoIterator<Item = Mistake>) -> Vec<Mistake> {
        let usual = [
            self.share("missing", |_| [Vec2::zeros(); 2]),
            self.share("wrong sign", |f| [-f, f]),
            self.share("reaction on j missing", |f| [f, Vec2::zeros()]),
            self.share("acts on j only", |f| [Vec2::zeros(), -f]),
            self.share("reaction on j with the sign of the action", |f| [f, f]),
            self.share("y component of the reaction on j missing", |f| [f, Vec2::new(-f.x, 0.0)]),
        ];
        usual.into_iter().chain(mistakes).collect()
    }
}

fn in_simple_gravity() -> Vec<Mistake> {
    let of = place("simple gravity", Part::All("simplegravity"), |s| &mut s.simple_gravity);
    of.with([
        of.law("wrong sign", |body, p| -simple_gravity(body, p)),
        of.law("not scaled by mass", |_, p| Vec2::new(p["fx"], p["fy"])),
        of.law("x and y swapped", |body, p| body.m * Vec2::new(p["fy"], p["fx"])),
        of.law("only along y", |body, p| body.m * Vec2::new(0.0, p["fy"])),
        of.subject.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "simplegravity");
        }),
    ])
}

fn in_constant_force() -> Vec<Mistake> {
    let of = place("constant force", Part::All("constantforce"), |s| &mut s.constant_force);
    of.with([
        of.law("wrong sign", |body, p| -constant_force(body, p)),
        of.law("scaled by mass", |body, p| body.m * constant_force(body, p)),
        of.law("x and y swapped", |_, p| Vec2::new(p["fy"], p["fx"])),
        of.law("only the first particle feels it", |body, p| {
            first_only(body, constant_force(body, p))
        }),
        of.subject.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "constantforce");
        }),
    ])
}

fn first_only(body: &student::Body, force: Vec2) -> Vec2 {
    if body.number == 0 { force } else { Vec2::zeros() }
}

fn in_elastic_force() -> Vec<Mistake> {
    let of =
        place("spring, elastic force", Part::One("springforce", "elastic"), |s| &mut s.elastic);
    of.with([
        of.law("no rest length", |pair, p| -p["k"] * pair.d()),
        of.law("rest length added instead of subtracted", |pair, p| {
            -p["k"] * (pair.l() + p["l0"]) * pair.n()
        }),
        of.law("stiffness missing", |pair, p| -(pair.l() - p["l0"]) * pair.n()),
        of.law("stiffness doubled (energy without its 1/2)", |pair, p| {
            -2.0 * p["k"] * (pair.l() - p["l0"]) * pair.n()
        }),
        of.law("stiffness halved (1/2 kept in the gradient)", |pair, p| {
            -0.5 * p["k"] * (pair.l() - p["l0"]) * pair.n()
        }),
        of.law("direction not normalised", |pair, p| -p["k"] * (pair.l() - p["l0"]) * pair.d()),
        of.law("only pulls, never pushes", |pair, p| {
            -p["k"] * (pair.l() - p["l0"]).max(0.0) * pair.n()
        }),
        of.subject.mistake("number of the edge as that of its second particle", |s| {
            s.read = take_edge_for_second;
        }),
        of.subject.mistake("only one spring on each edge", |s| s.read = keep_last_on_each_edge),
    ])
}

fn in_green_force() -> Vec<Mistake> {
    let of = place("spring of squared length", Part::All("greenspringforce"), |s| &mut s.green);
    of.with([
        of.law("factor 2 missing", |pair, p| {
            -p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.d()
        }),
        of.law("factor 4 instead of 2", |pair, p| {
            -4.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.d()
        }),
        of.law("lengths not squared", |pair, p| {
            -2.0 * p["k"] * (pair.l() / p["l0"] - 1.0) * pair.d()
        }),
        of.law("not divided by l0²", |pair, p| {
            -2.0 * p["k"] * (pair.l().powi(2) - p["l0"].powi(2)) * pair.d()
        }),
        of.law("along the direction instead of the difference", |pair, p| {
            -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.n()
        }),
        of.law("a Hookean spring", |pair, p| -p["k"] * (pair.l() - p["l0"]) * pair.n()),
        of.law("pulls only", |pair, p| {
            -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0).max(0.0) * pair.d()
        }),
    ])
}

fn in_damping() -> Vec<Mistake> {
    let of = place("spring, damping", Part::One("springforce", "damping"), |s| &mut s.damping);
    of.with([
        of.law("not projected on the spring's axis", |pair, p| -p["b"] * pair.w())
            .missed_by_the_course(),
        of.law("uses the velocity of i only", |pair, p| {
            -p["b"] * pair.n().dot(&pair.v[0]) * pair.n()
        }),
        of.law("adds the velocities of i and j", |pair, p| {
            -p["b"] * pair.n().dot(&(pair.v[0] + pair.v[1])) * pair.n()
        }),
        of.law("coefficient missing", |pair, _| -pair.n().dot(&pair.w()) * pair.n()),
        of.law("scaled by the spring's stiffness", |pair, p| {
            -p["k"] * p["b"] * pair.n().dot(&pair.w()) * pair.n()
        }),
        of.law("direction not normalised", |pair, p| -p["b"] * pair.d().dot(&pair.w()) * pair.d()),
        of.law("speed instead of velocity along the axis", |pair, p| {
            -p["b"] * pair.n().dot(&pair.w()).abs() * pair.n()
        }),
    ])
}

fn in_gravitation() -> Vec<Mistake> {
    let of = place("gravitation", Part::All("gravitationalforce"), |s| &mut s.gravitation);
    of.with([
        of.law("G missing", |pair, _| -pair.m[0] * pair.m[1] / pair.l().powi(2) * pair.n()),
        of.law("first mass missing", |pair, p| -p["G"] * pair.m[1] / pair.l().powi(2) * pair.n()),
        of.law("second mass missing", |pair, p| -p["G"] * pair.m[0] / pair.l().powi(2) * pair.n()),
        of.law("1/l instead of 1/l²", |pair, p| {
            -p["G"] * pair.m[0] * pair.m[1] / pair.l() * pair.n()
        }),
        of.law("1/l³ instead of 1/l²", |pair, p| {
            -p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(3) * pair.n()
        }),
        of.subject.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "gravitationalforce");
        }),
        of.mistake("x component assigned, not added", |force| {
            force.add = |sum, force| Vec2::new(force.x, sum.y + force.y);
        }),
    ])
}

fn in_drag() -> Vec<Mistake> {
    let of = place("linear drag", Part::All("dragdamping"), |s| &mut s.drag);
    of.with([
        of.law("wrong sign", |body, p| -drag(body, p)),
        of.law("scaled by mass", |body, p| body.m * drag(body, p)).missed_by_the_course(),
        of.law("only along x", |body, p| Vec2::new(-p["b"] * body.v.x, 0.0)),
        of.law("only the first particle feels it", |body, p| first_only(body, drag(body, p))),
        of.law("quadratic in the velocity", |body, p| -p["b"] * body.v.norm() * body.v),
        of.law("coefficient missing", |body, _| -body.v),
        of.subject.mistake("only the last of several elements counts", |s| {
            s.read = |scene| keep_last(scene, "dragdamping");
        }),
    ])
}

fn in_vortex() -> Vec<Mistake> {
    let of = place("vortex", Part::All("vortexforce"), |s| &mut s.vortex);
    of.with([
        of.law("no rotation of n", |pair, p| {
            p["kvc"] / pair.l().powi(2) * (p["kbs"] * pair.n() - pair.w())
        }),
        of.law("rotation the other way round", |pair, p| {
            p["kvc"] / pair.l().powi(2) * (-p["kbs"] * quarter_turn() * pair.n() - pair.w())
        }),
        of.law("kbs missing", |pair, p| {
            p["kvc"] / pair.l().powi(2) * (quarter_turn() * pair.n() - pair.w())
        }),
        of.law("kvc missing", |pair, p| {
            (p["kbs"] * quarter_turn() * pair.n() - pair.w()) / pair.l().powi(2)
        }),
        of.law("kvc on the viscous part only", |pair, p| {
            (p["kbs"] * quarter_turn() * pair.n() - p["kvc"] * pair.w()) / pair.l().powi(2)
        }),
        of.law("rotating part missing", |pair, p| -p["kvc"] / pair.l().powi(2) * pair.w()),
        of.law("viscous part missing", |pair, p| {
            p["kvc"] / pair.l().powi(2) * p["kbs"] * quarter_turn() * pair.n()
        }),
        of.law("viscous part with the wrong sign", |pair, p| {
            p["kvc"] / pair.l().powi(2) * (p["kbs"] * quarter_turn() * pair.n() + pair.w())
        }),
        of.law("viscous part uses the velocity of i only", |pair, p| {
            p["kvc"] / pair.l().powi(2) * (p["kbs"] * quarter_turn() * pair.n() - pair.v[0])
        }),
        of.law("1/r instead of 1/r²", |pair, p| {
            p["kvc"] / pair.l() * (p["kbs"] * quarter_turn() * pair.n() - pair.w())
        }),
        of.law("1/r³ instead of 1/r²", |pair, p| {
            p["kvc"] / pair.l().powi(3) * (p["kbs"] * quarter_turn() * pair.n() - pair.w())
        }),
    ])
}
