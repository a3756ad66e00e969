//! Validation shared by all scene formats.

use super::error::{Problem, SceneError};
use super::schema::{Initial, IntegratorOptions, IntegratorSchema, OptionError};
use super::{Dimension, ForceElement, Particle};

/// The sine of an angle below which three places are on one line, or a fourth is in their plane: a few rounding errors.
const FLAT: f64 = 4.0 * f64::EPSILON;

/// Sets options of the integrator from text.
pub(super) fn set_options(
    file: &str,
    integrator: &'static IntegratorSchema,
    options: &mut IntegratorOptions,
    wanted: &[(String, String)],
) -> Result<(), SceneError> {
    for (option, text) in wanted {
        let (option, text, integrator) = (option.clone(), text.clone(), integrator.name);
        let problem = match options.set(&option, &text) {
            Ok(()) => continue,
            Err(OptionError::Unknown) => {
                let names: Vec<&str> = options.iter().map(|(option, _)| option.name).collect();
                Problem::UnknownOption { integrator, option, known: names.join(", ") }
            }
            Err(OptionError::Value { must_be }) => {
                Problem::OptionValue { integrator, option, text, must_be }
            }
        };
        return Err(SceneError::whole_file(file, problem));
    }
    let Some((option, must_be)) = options.excess() else { return Ok(()) };
    let (integrator, option) = (integrator.name, option.name.to_owned());
    let text = options.count(&option).to_string();
    Err(SceneError::whole_file(file, Problem::OptionValue { integrator, option, text, must_be }))
}

/// An error where the integrator cannot simulate the force.
pub(super) fn refuse_force(
    file: &str,
    integrator: &'static IntegratorSchema,
    force: &ForceElement,
) -> Result<(), SceneError> {
    match (integrator.refuses)(force) {
        None => Ok(()),
        Some(refusal) => {
            let problem = Problem::RefusedForce {
                integrator: integrator.name,
                tag: force.schema.tag,
                because: refusal.because,
                remedy: refusal.remedy,
            };
            Err(SceneError::new(file, force.location, problem))
        }
    }
}

/// An error where the element has no size while it is not deformed.
pub(super) fn refuse_undeformed(
    file: &str,
    force: &ForceElement,
    particles: &[Particle],
) -> Result<(), SceneError> {
    let tag = force.schema.tag;
    let is_path = force.schema.initial == Initial::PathLength;
    let place = |corner: usize| particles[force.particles[corner]].position;
    let is_line_with = |corner: usize| is_line(place(0), place(1), place(corner));
    let problem = if is_path && force.path_length(particles) == 0.0 {
        Problem::NoLength { tag }
    } else if force.schema.initial == Initial::Hinge && (is_line_with(2) || is_line_with(3)) {
        Problem::FlatHinge { tag }
    } else if is_flat(&force.undeformed()) {
        match force.schema.stencil.size() {
            4 => Problem::FlatTetrahedron { tag },
            _ => Problem::FlatTriangle { tag },
        }
    } else {
        return Ok(());
    };
    Err(SceneError::new(file, force.location, problem))
}

/// An error where the force does not exist in this dimension.
pub(super) fn refuse_dimension(
    file: &str,
    force: &ForceElement,
    dimension: Dimension,
) -> Result<(), SceneError> {
    if force.schema.exists_in(dimension) {
        return Ok(());
    }
    let problem = Problem::InSpaceOnly { tag: force.schema.tag };
    Err(SceneError::new(file, force.location, problem))
}

/// Whether these three places are on one line, or these four in one plane.
pub fn is_flat(places: &[[f64; 3]]) -> bool {
    match *places {
        [a, b, c] => is_line(a, b, c),
        [a, b, c, d] => is_plane(a, b, c, d),
        _ => false,
    }
}

fn is_line(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> bool {
    let [u, v] = [b, c].map(|end| difference(end, a));
    norm(cross(u, v)) <= FLAT * norm(u) * norm(v)
}

fn is_plane(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> bool {
    let [u, v, w] = [b, c, d].map(|end| difference(end, a));
    let normal = cross(u, v);
    let height: f64 = normal.iter().zip(w).map(|(a, b)| a * b).sum();
    is_line(a, b, c) || height.abs() <= FLAT * norm(normal) * norm(w)
}

pub(super) fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

pub(super) fn cross(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        u[next] * v[last] - u[last] * v[next]
    })
}

pub(super) fn norm(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}
