//! Values of particles and forces: typical ones, and special ones that hide or show mistakes.

use scene::schema::{Coordinate, Domain, ParameterSchema};
use scene::{ForceElement, Particle, Scene};

use crate::choices::Choices;

/// Steps into which a range of values is divided.
const STEPS: usize = 1000;

/// A number with so many digits.
pub(super) fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// A number within these bounds, evenly distributed, or its logarithm if both are positive.
fn within((low, high): (f64, f64), choices: &mut Choices) -> f64 {
    let share = (choices.below(STEPS) as f64 + 0.5) / STEPS as f64;
    let value = if low > 0.0 { low * (high / low).powf(share) } else { low + share * (high - low) };
    significant(value, 3)
}

/// A mass: of a decade or four, or of twelve in an uneven scene; that of another particle, or 1.
pub(super) fn mass(before: &[Particle], is_uneven: bool, choices: &mut Choices) -> f64 {
    if is_uneven {
        return within((1e-6, 1e6), choices);
    }
    match choices.below(8) {
        0 => 1.0,
        1 if !before.is_empty() => before[choices.below(before.len())].mass,
        2 => within((0.01, 100.0), choices),
        _ => within((0.3, 5.0), choices),
    }
}

/// A coordinate of a scene of this size: a number with few digits, 0, a whole number, or that of another particle. Without a
/// size, a whole number.
pub(super) fn coordinate(size: Option<f64>, others: &[f64], choices: &mut Choices) -> f64 {
    let Some(size) = size else { return choices.below(5) as f64 - 2.0 };
    match choices.below(10) {
        0 => 0.0,
        1 => size * (choices.below(5) as f64 - 2.0),
        2 if !others.is_empty() => others[choices.below(others.len())],
        3 => significant(1e3 * size * (choices.unit() - 0.5), 6),
        _ => significant(size * (choices.below(2 * STEPS) as f64 / STEPS as f64 - 1.0), 3),
    }
}

/// A place near another particle, for a scene of this size.
pub(super) fn beside(
    others: &[Particle],
    size: f64,
    axes: usize,
    choices: &mut Choices,
) -> [f64; 3] {
    let distance = size * choices.one_of(&[0.01, 1e-3, 1e-4]);
    let mut position = others[choices.below(others.len())].position;
    for value in &mut position[..axes] {
        *value += significant(distance * (choices.unit() - 0.5), 3);
    }
    position
}

/// Chooses the parameters of an element.
pub(super) fn parameters(element: &mut ForceElement, scene: &Scene, choices: &mut Choices) {
    let length = element.path_length(&scene.particles);
    let is_typical = !choices.chance(4);
    for (number, schema) in element.schema.parameters.iter().enumerate() {
        element.parameters[number] = match schema.coordinate {
            Some(Coordinate { particle, axis }) => {
                let initial = scene.particles[element.particles[particle]].position[axis];
                let is_there = axis < scene.dimension.count();
                if is_there && choices.chance(4) {
                    within(schema.typical, choices)
                } else {
                    initial
                }
            }
            None if schema.three_dimensional && scene.dimension.count() < 3 => {
                schema.default.unwrap_or(0.0)
            }
            None => parameter(schema, length, is_typical, choices),
        };
    }
}

/// A parameter of an element whose particles are this far from each other.
fn parameter(
    schema: &ParameterSchema,
    length: f64,
    is_typical: bool,
    choices: &mut Choices,
) -> f64 {
    let typical = |choices: &mut Choices| within(schema.typical, choices);
    let value = match choices.below(if is_typical { 4 } else { 12 }) {
        3 => schema.default.unwrap_or_else(|| typical(choices)),
        4 | 10 => 0.0,
        5 => 1.0,
        6 if schema.is_length => length,
        7 if schema.is_length => significant(length * choices.one_of(&[0.5, 0.9, 1.1, 2.0]), 3),
        8 => {
            significant(typical(choices) * choices.one_of(&[1e-4, 0.01, 0.1, 10.0, 100.0, 1e4]), 3)
        }
        9 if schema.domain == Domain::Finite => -typical(choices),
        _ => typical(choices),
    };
    if schema.domain.contains(value) { value } else { typical(choices) }
}
