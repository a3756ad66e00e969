//! Laws of pair forces, with `d = x_i − x_j`, `w = v_i − v_j`, `l = |d|` and `n = d/l`.
//!
//! ```text
//! spring        f = −(k (l − l0) + b n·w) n        milestone 2, sections 3.1 and 3.4
//! gravitation   f = −G m_i m_j n / l²              milestone 2, section 3.2
//! vortex        f = kvc/l² (kbs R n − w)           milestone 3, section 11; R the quarter turn about the z axis,
//!                                                  which leaves z alone: (x, y, z) → (−y, x, z)
//! green spring  f = −2 k (l²/l0² − 1) d            lecture on optimisation time integration
//! scripted      a spring of rest length            milestone 2, section 3.1, which leaves the script open
//!               l0 + (l1 − l0) min(t/t1, 1)
//! elastic       a spring of stiffness alpha/l0     Theme 4, milestone 1
//! ```

use scene::Parameters;

use super::{Form, Law, Number, Scale, Symmetry, Vector, dot, named};

/// The laws of this file.
pub(super) static LAWS: &[&Law] =
    &[&SPRING, &GRAVITATION, &VORTEX, &GREEN_SPRING, &SCRIPTED_SPRING, &ELASTIC];

static SPRING: Law = Law {
    tag: "springforce",
    parameters: &["k", "l0", "b"],
    symmetry: Symmetry::Isotropic,
    form: Form::pair(spring, spring, spring_scale),
};

fn spring<T: Number>(p: &[f64], _: [f64; 2], d: Vector<T>, w: Vector<T>) -> Vector<T> {
    let [k, l0, b] = named(p);
    if l0 == 0.0 && b == 0.0 {
        // Needs no direction, even at length zero.
        return d.map(|component| component * -k);
    }
    let l = dot(d, d).sqrt();
    let n = d.map(|component| component / l);
    let tension = (l - l0) * k + dot(n, w) * b;
    n.map(|component| -(tension * component))
}

fn spring_scale(p: &[f64], _: f64, l: f64, speed: f64) -> Scale {
    let [k, l0, b] = named(p);
    let per_length = |amount: f64| if amount == 0.0 { 0.0 } else { amount / l };
    Scale {
        energy: 0.5 * k * (l + l0) * (l + l0),
        force: k * (l + l0) + b * speed,
        by_position: k * (1.0 + per_length(l0)) + 4.0 * per_length(b * speed),
        by_velocity: b,
    }
}

static GRAVITATION: Law = Law {
    tag: "gravitationalforce",
    parameters: &["G"],
    symmetry: Symmetry::Isotropic,
    form: Form::pair(gravitation, gravitation, gravitation_scale),
};

fn gravitation<T: Number>(p: &[f64], m: [f64; 2], d: Vector<T>, _: Vector<T>) -> Vector<T> {
    let [g] = named(p);
    let squared = dot(d, d);
    let cubed = squared * squared.sqrt();
    d.map(|component| -(component / cubed * (g * m[0] * m[1])))
}

fn gravitation_scale(p: &[f64], masses: f64, l: f64, _: f64) -> Scale {
    let [g] = named(p);
    let strength = g.abs() * masses;
    Scale {
        energy: strength / l,
        force: strength / (l * l),
        by_position: 4.0 * strength / (l * l * l),
        by_velocity: 0.0,
    }
}

static VORTEX: Law = Law {
    tag: "vortexforce",
    parameters: &["kbs", "kvc"],
    symmetry: Symmetry::AboutZ,
    form: Form::pair(vortex, vortex, vortex_scale),
};

fn vortex<T: Number>(p: &[f64], _: [f64; 2], d: Vector<T>, w: Vector<T>) -> Vector<T> {
    let [kbs, kvc] = named(p);
    let squared = dot(d, d);
    let l = squared.sqrt();
    let turned = [-d[1] / l, d[0] / l, d[2] / l];
    std::array::from_fn(|axis| (turned[axis] * kbs - w[axis]) / squared * kvc)
}

fn vortex_scale(p: &[f64], _: f64, l: f64, speed: f64) -> Scale {
    let [kbs, kvc] = named(p).map(f64::abs);
    Scale {
        energy: 0.0,
        force: kvc * (kbs + speed) / (l * l),
        by_position: 4.0 * kvc * (kbs + speed) / (l * l * l),
        by_velocity: kvc / (l * l),
    }
}

static GREEN_SPRING: Law = Law {
    tag: "greenspringforce",
    parameters: &["k", "l0"],
    symmetry: Symmetry::Isotropic,
    form: Form::pair(green_spring, green_spring, green_spring_scale),
};

fn green_spring<T: Number>(p: &[f64], _: [f64; 2], d: Vector<T>, _: Vector<T>) -> Vector<T> {
    let [k, l0] = named(p);
    let strain = dot(d, d) / (l0 * l0) - T::from(1.0);
    d.map(|component| -(component * strain * (2.0 * k)))
}

fn green_spring_scale(p: &[f64], _: f64, l: f64, _: f64) -> Scale {
    let [k, l0] = named(p);
    let strain = l * l / (l0 * l0) + 1.0;
    Scale {
        energy: 0.5 * k * l0 * l0 * strain * strain,
        force: 2.0 * k * strain * l,
        by_position: 2.0 * k * (3.0 * strain),
        by_velocity: 0.0,
    }
}

static SCRIPTED_SPRING: Law = Law {
    tag: "scriptedspringforce",
    parameters: &["k", "l0", "l1", "t1"],
    symmetry: Symmetry::Isotropic,
    form: Form::Pair { plain: spring, dual: spring, scale: spring_scale, at: scripted_spring },
};

/// The parameters of a spring without damping.
fn scripted_spring(p: &[f64], time: f64) -> Parameters {
    let [k, l0, l1, t1] = named(p);
    let share = (time / t1).min(1.0);
    [k, (1.0 - share) * l0 + share * l1, 0.0].as_slice().into()
}

static ELASTIC: Law = Law {
    tag: "elasticbodyspringforce",
    parameters: &["alpha", "l0"],
    symmetry: Symmetry::Isotropic,
    form: Form::Pair { plain: spring, dual: spring, scale: spring_scale, at: elastic_spring },
};

/// The parameters of a spring without damping.
fn elastic_spring(p: &[f64], _: f64) -> Parameters {
    let [alpha, l0] = named(p);
    [alpha / l0, l0, 0.0].as_slice().into()
}
