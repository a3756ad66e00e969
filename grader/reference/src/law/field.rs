//! Laws of forces on single particles.
//!
//! ```text
//! simple gravity  F = m (fx, fy, fz)                                             milestone 3, section 8.2
//! constant force  F = (fx, fy, fz)                                               the course's scene schema
//! linear drag     F = −b v                                                       milestone 2, section 3.3
//! mass damping    F = −α m v                                                     Rayleigh, Theory of Sound, section 102
//! wind            F = s (3 + 3/2 (1 + cos 5φ), 1 + cos(φ + 3/10), sin φ)         the assignment's program
//! ```
//!
//! with `φ = x/D + t`, and `D` the diagonal of the box around all particles at the start.

use super::{At, Form, Law, Number, Scale, Symmetry, Vector, named};

/// The laws of this file.
pub(super) static LAWS: &[&Law] = &[&SIMPLE_GRAVITY, &CONSTANT, &DRAG, &MASS_DAMPING, &WIND];

static SIMPLE_GRAVITY: Law = Law {
    tag: "simplegravity",
    parameters: &["fx", "fy", "fz"],
    symmetry: Symmetry::None,
    form: Form::Field {
        plain: simple_gravity,
        dual: simple_gravity,
        scale: |p, at| uniform_scale(p, at.mass, at),
    },
};

fn simple_gravity<T: Number>(p: &[f64], at: &At<'_, T>) -> Vector<T> {
    std::array::from_fn(|axis| T::from(at.mass * p[axis]))
}

static CONSTANT: Law = Law {
    tag: "constantforce",
    parameters: &["fx", "fy", "fz"],
    symmetry: Symmetry::None,
    form: Form::Field { plain: constant, dual: constant, scale: |p, at| uniform_scale(p, 1.0, at) },
};

fn constant<T: Number>(p: &[f64], _: &At<'_, T>) -> Vector<T> {
    std::array::from_fn(|axis| T::from(p[axis]))
}

fn uniform_scale(p: &[f64], weight: f64, at: &At<'_, f64>) -> Scale {
    let force = weight * p.iter().map(|component| component.abs()).sum::<f64>();
    Scale { energy: force * super::norm(&at.position), force, ..Scale::default() }
}

static DRAG: Law = Law {
    tag: "dragdamping",
    parameters: &["b"],
    symmetry: Symmetry::Isotropic,
    form: Form::Field { plain: drag, dual: drag, scale: drag_scale },
};

fn drag<T: Number>(p: &[f64], at: &At<'_, T>) -> Vector<T> {
    let [b] = named(p);
    at.velocity.map(|component| component * -b)
}

fn drag_scale(p: &[f64], at: &At<'_, f64>) -> Scale {
    let [b] = named(p);
    Scale { force: b * super::norm(&at.velocity), by_velocity: b, ..Scale::default() }
}

static MASS_DAMPING: Law = Law {
    tag: "massdamping",
    parameters: &["alpha"],
    symmetry: Symmetry::Isotropic,
    form: Form::Field {
        plain: mass_damping,
        dual: mass_damping,
        scale: |p, at| drag_scale(&[p[0] * at.mass], at),
    },
};

fn mass_damping<T: Number>(p: &[f64], at: &At<'_, T>) -> Vector<T> {
    drag(&[p[0] * at.mass], at)
}

static WIND: Law = Law {
    tag: "windforce",
    parameters: &["strength"],
    symmetry: Symmetry::None,
    form: Form::Field { plain: wind, dual: wind, scale: wind_scale },
};

fn wind<T: Number>(p: &[f64], at: &At<'_, T>) -> Vector<T> {
    let phi = phase(at);
    let force = [((phi * 5.0).cos() + 1.0) * 1.5 + 3.0, (phi + 0.3).cos() + 1.0, phi.sin()];
    let [strength] = named(p);
    force.map(|component| component * strength)
}

fn phase<T: Number>(at: &At<'_, T>) -> T {
    let diagonal = diagonal(at.starts);
    let place = if diagonal > 0.0 { at.position[0] / diagonal } else { T::from(0.0) };
    place + at.time
}

/// The diagonal of the box around all particles at the start.
pub(super) fn diagonal(starts: &[[f64; 3]]) -> f64 {
    let extent = |axis: usize| {
        let along = || starts.iter().map(|start| start[axis]);
        along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
    };
    (extent(0).powi(2) + extent(1).powi(2) + extent(2).powi(2)).sqrt()
}

fn wind_scale(p: &[f64], at: &At<'_, f64>) -> Scale {
    // The phase is rounded too, and the more the larger it is.
    let [strength] = named(p);
    let rounded = 8.0 + 8.0 * phase(at).abs();
    let diagonal = diagonal(at.starts);
    let by_position = if diagonal > 0.0 { 5.0 * rounded / diagonal } else { 0.0 };
    Scale {
        force: strength.abs() * rounded,
        by_position: strength.abs() * by_position,
        ..Scale::default()
    }
}
