//! Mistakes that were outside the vocabulary of the grader's search when the list was written.

use diagnosis::findings::Part;

use super::super::student::{
    Explicit, Jacobian, Mat2, PairForce, Student, Vec2, drag, four_blocks, quarter_turn,
    simple_gravity,
};
use super::{Area, Mistake, Scope, Subject};

fn force(name: &'static str, part: Part) -> Subject {
    Subject { area: Area::Force, name, scope: Scope::Force(part) }
}

fn jacobian(name: &'static str, part: Part) -> Subject {
    Subject { area: Area::Jacobian, name, scope: Scope::Jacobian(part) }
}

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
    let spring = force("spring, elastic force", ELASTIC);
    let damping = force("spring, damping", DAMPING);
    let gravitation = force("gravitation", GRAVITATION);
    let vortex = force("vortex", VORTEX);
    let drag_force = force("linear drag", Part::All("dragdamping"));
    let gravity = force("simple gravity", Part::All("simplegravity"));
    let stiffer: fn(&mut Student) -> &mut PairForce = |s| &mut s.elastic;
    vec![
        spring.mistake("stiffens with the strain", move |s| {
            stiffer(s).on_i = |pair, p| {
                let strain = (pair.l() - p["l0"]) / p["l0"].max(0.1);
                -p["k"] * (pair.l() - p["l0"]) * (1.0 + strain * strain) * pair.n()
            };
        }),
        spring.mistake("limited to a force of 1", move |s| {
            stiffer(s).on_i =
                |pair, p| -(p["k"] * (pair.l() - p["l0"])).clamp(-1.0, 1.0) * pair.n();
        }),
        spring.mistake("the direction by the sum of components", move |s| {
            stiffer(s).on_i = |pair, p| {
                let d = pair.d();
                -p["k"] * (pair.l() - p["l0"]) * d / (d.x.abs() + d.y.abs())
            };
        }),
        spring.mistake("the length by its larger component", move |s| {
            stiffer(s).on_i = |pair, p| {
                let d = pair.d();
                -p["k"] * (d.x.abs().max(d.y.abs()) - p["l0"]) * pair.n()
            };
        }),
        damping.mistake("critical: by the root of k", |s| {
            s.damping.on_i = |pair, p| -p["b"] * p["k"].sqrt() * pair.n().dot(&pair.w()) * pair.n();
        }),
        damping.mistake("quadratic in the closing speed", |s| {
            s.damping.on_i = |pair, p| {
                let closing = pair.n().dot(&pair.w());
                -p["b"] * closing * closing.abs() * pair.n()
            };
        }),
        damping.mistake("along x alone decides", |s| {
            s.damping.on_i = |pair, p| -p["b"] * pair.w().x * pair.n();
        }),
        gravitation.mistake("by the mean of the masses", |s| {
            s.gravitation.on_i = |pair, p| {
                let mean = 0.5 * (pair.m[0] + pair.m[1]);
                -p["G"] * mean * mean / pair.l().powi(2) * pair.n()
            };
        }),
        gravitation.mistake("softened by 0.05", |s| {
            s.gravitation.on_i =
                |pair, p| -p["G"] * pair.m[0] * pair.m[1] / (pair.l().powi(2) + 0.0025) * pair.n();
        }),
        vortex.mistake("turned by 80 degrees", |s| {
            s.vortex.on_i = |pair, p| {
                let (sin, cos) = 80.0_f64.to_radians().sin_cos();
                let turn = Mat2::new(cos, -sin, sin, cos);
                p["kvc"] / pair.l().powi(2) * (p["kbs"] * turn * pair.n() - pair.w())
            };
        }),
        vortex.mistake("a solid core within 0.7", |s| {
            s.vortex.on_i = |pair, p| {
                let l = pair.l().max(0.7);
                p["kvc"] / l.powi(2) * (p["kbs"] * quarter_turn() * pair.n() - pair.w())
            };
        }),
        drag_force.mistake("weaker for the particles after the first", |s| {
            s.drag = |body, p| if body.number == 0 { drag(body, p) } else { 0.9 * drag(body, p) };
        }),
        drag_force.mistake("saturates", |s| {
            s.drag = |body, p| drag(body, p) / (1.0 + body.v.norm());
        }),
        gravity.mistake("only on particles with an even number", |s| {
            s.simple_gravity = |body, p| match body.number % 2 {
                0 => simple_gravity(body, p),
                _ => Vec2::zeros(),
            };
        }),
    ]
}

fn in_jacobians() -> Vec<Mistake> {
    let elastic = jacobian("spring, elastic force, ∂F/∂x", ELASTIC);
    let damping_dx = jacobian("spring, damping, ∂F/∂x", DAMPING);
    let damping_dv = jacobian("spring, damping, ∂F/∂v", DAMPING);
    let gravitation = jacobian("gravitation, ∂F/∂x", GRAVITATION);
    let place: fn(&mut Student) -> &mut Jacobian = |s| &mut s.elastic_dx;
    vec![
        elastic.mistake("projected to a stretched spring", move |s| {
            place(s).block = |pair, p| {
                let strain = ((pair.l() - p["l0"]) / pair.l()).max(0.0);
                -p["k"] * (pair.nn() + strain * pair.across())
            };
        }),
        elastic.mistake("by differences of 1e-3", move |s| {
            place(s).block = |pair, p| {
                let of = |d: Vec2| -p["k"] * (d.norm() - p["l0"]) * d / d.norm();
                let column = |e: Vec2| (of(pair.d() + 1e-3 * e) - of(pair.d())) / 1e-3;
                Mat2::from_columns(&[column(Vec2::x()), column(Vec2::y())])
            };
        }),
        elastic.mistake("the block of j doubled", move |s| {
            place(s).spread = |k| [[k, -k], [-k, 2.0 * k]];
        }),
        damping_dx.mistake("its rows swapped", |s| {
            s.damping_dx.spread = |k| {
                let swapped = Mat2::new(k[(1, 0)], k[(1, 1)], k[(0, 0)], k[(0, 1)]);
                four_blocks(swapped)
            };
        }),
        damping_dv.mistake("rounded to two digits", |s| {
            s.damping_dv.block = |pair, p| -p["b"] * pair.nn().map(|x| (x * 100.0).round() / 100.0);
        }),
        gravitation.mistake("with the sum of the masses", |s| {
            s.gravitation_dx.block = |pair, p| {
                let strength = p["G"] * (pair.m[0] + pair.m[1]) / pair.l().powi(3);
                -strength * (Mat2::identity() - 3.0 * pair.nn())
            };
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
