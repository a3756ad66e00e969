//! `grade init`: writes the skeleton of a submission.

use std::path::Path;

use grader::assignment::Assignment;
use grader::init::{self, Language};

use crate::output::print;
use crate::stop::{Exit, Stop};

/// Writes a skeleton and prints the next steps.
pub(super) fn init(
    language: &str,
    folder: &Path,
    assignment: Option<&Assignment>,
) -> Result<Exit, Stop> {
    let language = Language::ALL.into_iter().find(|each| each.name() == language);
    let language = language.ok_or_else(|| Stop::bad_input("unknown language"))?;
    let files = init::write(language, assignment, folder)
        .map_err(|error| Stop::bad_input(format!("{}: {error}", folder.display())))?;
    let mut text = String::new();
    for file in files {
        text += &format!("wrote {}\n", file.display());
    }
    let mut folder = folder.display().to_string();
    if let Some(arguments) = language.arguments() {
        folder += &format!(" {arguments}");
    }
    text += &match init::reads_json(assignment) {
        true => format!(
            "\nThe skeleton reads scenes and holds every vertex at rest. Write its steps, and grade it:\n\n    \
             grade {folder} --only slanted-spring\n    grade {folder}\n"
        ),
        false => format!(
            "\nThe skeleton moves particles on which no force acts. Grade it, then add forces and integrators:\n\n    \
             grade {folder} --only Inertia\n    grade {folder}\n"
        ),
    };
    print(text.as_bytes())?;
    Ok(Exit::Passed)
}
