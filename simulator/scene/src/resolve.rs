//! Validation shared by all scene formats.

use super::ForceElement;
use super::error::{Problem, SceneError};
use super::schema::{IntegratorOptions, IntegratorSchema, OptionError};

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
    Ok(())
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
