//! Laws of pair forces, with `d = x_i − x_j`, `w = v_i − v_j`, `l = |d|` and `n = d/l`.
//!
//! ```text
//! spring        f = −(k (l − l0) + b n·w) n        milestone 2, sections 3.1 and 3.4
//! gravitation   f = −G m_i m_j n / l²              milestone 2, section 3.2
//! vortex        f = kvc/l² (kbs R n − w)           milestone 3, section 11; R the quarter turn about the z axis,
//!                                                  which leaves z alone: (x, y, z) → (−y, x, z)
//! green spring  f = −2 k (l²/l0² − 1) d            lecture on optimisation time integration
//! ```

use super::{Form, Law, Number, Scale, Symmetry, Term, Vector, dot};

pub(super) static SPRING: Law = Law {
    tag: "springforce",
    internal: true,
    symmetry: Symmetry::Isotropic,
    terms: &[Term::new("k", true, false), Term::new("l0", true, false), Term::new("b", true, true)],
    form: Form::Pair { plain: spring, dual: spring, scale: spring_scale },
};

fn spring<T: Number>(p: &[f64], _: [f64; 2], d: Vector<T>, w: Vector<T>) -> Vector<T> {
    let (k, l0, b) = (p[0], p[1], p[2]);
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
    let (k, l0, b) = (p[0], p[1], p[2]);
    let per_length = |amount: f64| if amount == 0.0 { 0.0 } else { amount / l };
    Scale {
        energy: 0.5 * k * (l + l0) * (l + l0),
        force: k * (l + l0) + b * speed,
        by_position: k * (1.0 + per_length(l0)) + 4.0 * per_length(b * speed),
        by_velocity: b,
    }
}

pub(super) static GRAVITATION: Law = Law {
    tag: "gravitationalforce",
    internal: true,
    symmetry: Symmetry::Isotropic,
    terms: &[Term::new("G", true, false)],
    form: Form::Pair { plain: gravitation, dual: gravitation, scale: gravitation_scale },
};

fn gravitation<T: Number>(p: &[f64], m: [f64; 2], d: Vector<T>, _: Vector<T>) -> Vector<T> {
    let squared = dot(d, d);
    let cubed = squared * squared.sqrt();
    d.map(|component| -(component / cubed * (p[0] * m[0] * m[1])))
}

fn gravitation_scale(p: &[f64], masses: f64, l: f64, _: f64) -> Scale {
    let strength = p[0].abs() * masses;
    Scale {
        energy: strength / l,
        force: strength / (l * l),
        by_position: 4.0 * strength / (l * l * l),
        by_velocity: 0.0,
    }
}

pub(super) static VORTEX: Law = Law {
    tag: "vortexforce",
    internal: true,
    symmetry: Symmetry::AboutZ,
    terms: &[Term::new("kbs", true, false), Term::new("kvc", true, true)],
    form: Form::Pair { plain: vortex, dual: vortex, scale: vortex_scale },
};

fn vortex<T: Number>(p: &[f64], _: [f64; 2], d: Vector<T>, w: Vector<T>) -> Vector<T> {
    let (kbs, kvc) = (p[0], p[1]);
    let squared = dot(d, d);
    let l = squared.sqrt();
    let turned = [-d[1] / l, d[0] / l, d[2] / l];
    std::array::from_fn(|axis| (turned[axis] * kbs - w[axis]) / squared * kvc)
}

fn vortex_scale(p: &[f64], _: f64, l: f64, speed: f64) -> Scale {
    let (kbs, kvc) = (p[0].abs(), p[1].abs());
    Scale {
        energy: 0.0,
        force: kvc * (kbs + speed) / (l * l),
        by_position: 4.0 * kvc * (kbs + speed) / (l * l * l),
        by_velocity: kvc / (l * l),
    }
}

pub(super) static GREEN_SPRING: Law = Law {
    tag: "greenspringforce",
    internal: true,
    symmetry: Symmetry::Isotropic,
    terms: &[Term::new("k", true, false), Term::new("l0", true, false)],
    form: Form::Pair { plain: green_spring, dual: green_spring, scale: green_spring_scale },
};

fn green_spring<T: Number>(p: &[f64], _: [f64; 2], d: Vector<T>, _: Vector<T>) -> Vector<T> {
    let strain = dot(d, d) / (p[1] * p[1]) - T::from(1.0);
    d.map(|component| -(component * strain * (2.0 * p[0])))
}

fn green_spring_scale(p: &[f64], _: f64, l: f64, _: f64) -> Scale {
    let (k, l0) = (p[0], p[1]);
    let strain = l * l / (l0 * l0) + 1.0;
    Scale {
        energy: 0.5 * k * l0 * l0 * strain * strain,
        force: 2.0 * k * strain * l,
        by_position: 2.0 * k * (3.0 * strain),
        by_velocity: 0.0,
    }
}
