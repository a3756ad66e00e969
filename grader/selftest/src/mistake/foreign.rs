//! Mistakes that were outside the vocabulary of the grader's search when the list was written.

use diagnosis::findings::Part;

use super::super::student::{
    Explicit, Mat2, Student, Vec2, drag, four_blocks, quarter_turn, simple_gravity,
};
use super::force::place as force;
use super::jacobian::place as jacobian;
use super::{Area, Mistake, Scope, Subject};

fn integrator(name: &'static str) -> Subject {
    Subject { area: Area::Integrator, name, scope: Scope::Integrator(name) }
}

const ELASTIC: Part = Part::One("springforce", "elastic");
const DAMPING: Part = Part::One("springforce", "damping");
const GRAVITATION: Part = Part::All("gravitationalforce");
const VORTEX: Part = Part::All("vortexforce");

pub(super) fn mistakes() -> Vec<Mistake> {
    let mut all = in_forces();
    all.extend(in_jacobians());
    all.extend(in_integrators());
    all
}

fn in_forces() -> Vec<Mistake> {
    let spring = force("spring, elastic force", ELASTIC, |s| &mut s.elastic);
    let damping = force("spring, damping", DAMPING, |s| &mut s.damping);
    let gravitation = force("gravitation", GRAVITATION, |s| &mut s.gravitation);
    let vortex = force("vortex", VORTEX, |s| &mut s.vortex);
    let drag_force = force("linear drag", Part::All("dragdamping"), |s| &mut s.drag);
    let gravity = force("simple gravity", Part::All("simplegravity"), |s| &mut s.simple_gravity);
    vec![
        spring.law("stiffens with the strain", |pair, p| {
            let strain = (pair.l() - p["l0"]) / p["l0"].max(0.1);
            -p["k"] * (pair.l() - p["l0"]) * (1.0 + strain * strain) * pair.n()
        }),
        spring.law("limited to a force of 1", |pair, p| {
            -(p["k"] * (pair.l() - p["l0"])).clamp(-1.0, 1.0) * pair.n()
        }),
        spring.law("no force within 0.02 of the rest length", |pair, p| {
            let stretch = pair.l() - p["l0"];
            if stretch.abs() < 0.02 { Vec2::zeros() } else { -p["k"] * stretch * pair.n() }
        }),
        spring.law("the direction by the sum of components", |pair, p| {
            let d = pair.d();
            -p["k"] * (pair.l() - p["l0"]) * d / (d.x.abs() + d.y.abs())
        }),
        spring.law("the length by its larger component", |pair, p| {
            let d = pair.d();
            -p["k"] * (d.x.abs().max(d.y.abs()) - p["l0"]) * pair.n()
        }),
        spring.law("by the squares of the lengths", |pair, p| {
            -p["k"] * (pair.l() * pair.l() - p["l0"] * p["l0"]) * pair.n()
        }),
        damping.law("by the relative speed", |pair, p| -p["b"] * pair.w().norm() * pair.n()),
        damping.law("critical: by the root of k", |pair, p| {
            -p["b"] * p["k"].sqrt() * pair.n().dot(&pair.w()) * pair.n()
        }),
        damping.law("quadratic in the closing speed", |pair, p| {
            let closing = pair.n().dot(&pair.w());
            -p["b"] * closing * closing.abs() * pair.n()
        }),
        damping.law("along x alone decides", |pair, p| -p["b"] * pair.w().x * pair.n()),
        gravitation.law("by the mean of the masses", |pair, p| {
            let mean = 0.5 * (pair.m[0] + pair.m[1]);
            -p["G"] * mean * mean / pair.l().powi(2) * pair.n()
        }),
        gravitation.law("softened by 0.05", |pair, p| {
            -p["G"] * pair.m[0] * pair.m[1] / (pair.l().powi(2) + 0.0025) * pair.n()
        }),
        gravitation.law("no attraction beyond 1.5", |pair, p| {
            let strength = p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(2);
            if pair.l() > 1.5 { Vec2::zeros() } else { -strength * pair.n() }
        }),
        vortex.law("turned by 80 degrees", |pair, p| {
            let (sin, cos) = 80.0_f64.to_radians().sin_cos();
            let turn = Mat2::new(cos, -sin, sin, cos);
            p["kvc"] / pair.l().powi(2) * (p["kbs"] * turn * pair.n() - pair.w())
        }),
        vortex.law("a solid core within 0.7", |pair, p| {
            let l = pair.l().max(0.7);
            p["kvc"] / l.powi(2) * (p["kbs"] * quarter_turn() * pair.n() - pair.w())
        }),
        drag_force.law("weaker for the particles after the first", |body, p| {
            if body.number == 0 { drag(body, p) } else { 0.9 * drag(body, p) }
        }),
        drag_force.law("saturates", |body, p| drag(body, p) / (1.0 + body.v.norm())),
        drag_force.law("none on slow particles", |body, p| {
            if body.v.norm() < 0.25 { Vec2::zeros() } else { drag(body, p) }
        }),
        gravity.law("only on particles with an even number", |body, p| {
            if body.number % 2 == 0 { simple_gravity(body, p) } else { Vec2::zeros() }
        }),
    ]
}

fn in_jacobians() -> Vec<Mistake> {
    let elastic = jacobian("spring, elastic force, ∂F/∂x", ELASTIC, |s| &mut s.elastic_dx);
    let damping_dx = jacobian("spring, damping, ∂F/∂x", DAMPING, |s| &mut s.damping_dx);
    let damping_dv = jacobian("spring, damping, ∂F/∂v", DAMPING, |s| &mut s.damping_dv);
    let gravitation = jacobian("gravitation, ∂F/∂x", GRAVITATION, |s| &mut s.gravitation_dx);
    vec![
        elastic.block("projected to a stretched spring", |pair, p| {
            let strain = ((pair.l() - p["l0"]) / pair.l()).max(0.0);
            -p["k"] * (pair.nn() + strain * pair.across())
        }),
        elastic.block("by differences of 1e-3", |pair, p| {
            let of = |d: Vec2| -p["k"] * (d.norm() - p["l0"]) * d / d.norm();
            let column = |e: Vec2| (of(pair.d() + 1e-3 * e) - of(pair.d())) / 1e-3;
            Mat2::from_columns(&[column(Vec2::x()), column(Vec2::y())])
        }),
        elastic.spread("the block of j doubled", |k| [[k, -k], [-k, 2.0 * k]]),
        damping_dx.spread("its rows swapped", |k| {
            four_blocks(Mat2::new(k[(1, 0)], k[(1, 1)], k[(0, 0)], k[(0, 1)]))
        }),
        damping_dv.block("rounded to two digits", |pair, p| {
            -p["b"] * pair.nn().map(|x| (x * 100.0).round() / 100.0)
        }),
        gravitation.block("with the sum of the masses", |pair, p| {
            let strength = p["G"] * (pair.m[0] + pair.m[1]) / pair.l().powi(3);
            -strength * (Mat2::identity() - 3.0 * pair.nn())
        }),
    ]
}

fn in_integrators() -> Vec<Mistake> {
    let limited = |v: Vec2, f: Vec2, m: f64, h: f64| {
        let new = v + h / m * f;
        new / (1.0_f64).max(new.norm() / 0.8)
    };
    let either = |name: &'static str, of: fn(&mut Student) -> &mut Explicit| {
        let subject = integrator(name);
        vec![
            subject.mistake("velocities limited to 0.8", move |s| of(s).velocity = limited),
            subject.mistake("a damping of 1e-3 in every step", move |s| {
                of(s).velocity = |v, f, m, h| 0.999 * (v + h / m * f);
            }),
            subject.mistake("acceleration of half a step more in the position", move |s| {
                of(s).position = |q, old, new, h| q + h * (1.5 * new - 0.5 * old);
            }),
        ]
    };
    let mut all = either("explicit-euler", |s| &mut s.explicit);
    all.extend(either("symplectic-euler", |s| &mut s.symplectic));
    all.extend([
        integrator("linearized-implicit-euler").mistake("1e-3 added to the diagonal", |s| {
            s.linearized.matrix =
                |m, dx, dv, h| m - (h * h * dx + h * dv) + if m != 0.0 { 1e-3 } else { 0.0 };
        }),
        integrator("linearized-implicit-euler").mistake("the matrix of a trapezium", |s| {
            s.linearized.matrix = |m, dx, dv, h| m - (0.25 * h * h * dx + 0.5 * h * dv);
        }),
        integrator("implicit-euler").mistake("forces at the middle of the step", |s| {
            s.implicit.force_at = |q, u, h| q + 0.7 * h * u;
        }),
    ]);
    all
}
