//! Facts of the registries by which scenes are transformed: units of mass, and vectors.

use scene::schema::{Masses, OptionValue, ParameterSchema};
use scene::{ForceElement, Scene};

/// Whether [`multiply`] knows how: a part that several parameters scale is a product of them.
pub(crate) fn scale(scene: &Scene) -> bool {
    scene.forces.iter().all(|force| {
        let mut parts = force.schema.parts.iter();
        parts.all(|part| part.scaled_by.len() == 1) && force.is_variational()
    })
}

/// Multiplies all masses, and the forces in proportion: the motion stays.
pub(crate) fn multiply(scene: &mut Scene, factor: f64) {
    scene.particles.iter_mut().for_each(|particle| particle.mass *= factor);
    for element in &mut scene.forces {
        let factor = match element.schema.masses {
            Masses::None => factor,
            Masses::Own => 1.0,
            Masses::Product => 1.0 / factor,
        };
        // Of the parameters that scale a part, its first does so alone.
        let parts = element.schema.parts.iter();
        let mut scaled: Vec<&str> = parts.flat_map(|part| part.scaled_by).copied().collect();
        scaled.sort_unstable();
        scaled.dedup();
        for name in scaled {
            *element.parameter_mut(name) *= factor;
        }
    }
    let penalty = scene.integrator_options.iter().find_map(|(option, value)| match value {
        OptionValue::Number(value) if option.name == PENALTY => Some(value),
        _ => None,
    });
    if let Some(penalty) = penalty {
        // A multiple of a number in the option's domain is in it.
        let _ = scene.integrator_options.set(PENALTY, &(factor * penalty).to_string());
    }
}

/// The option of an integrator that is a stiffness: the penalty on a fixed particle is a force.
const PENALTY: &str = "pin_weight";

/// The components of the vector among the parameters of an element.
pub(crate) fn vector_of(element: &mut ForceElement) -> Option<&mut [f64]> {
    let is_depth =
        |parameter: &ParameterSchema| parameter.three_dimensional && parameter.coordinate.is_none();
    let last = element.schema.parameters.iter().position(is_depth)?;
    element.parameters.get_mut(last.checked_sub(2)?..=last)
}
