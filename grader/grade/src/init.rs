//! `grade init`: writes the skeleton of a submission.

use std::path::Path;

use grader::submission::init::{self, Language, Skeleton, Start};
use grader::suite::assignment::Assignment;

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
    let (what, only) = match Skeleton::new(language, assignment).start {
        Start::Rests => (
            "reads scenes and holds every vertex at rest. Write its steps, and grade it",
            Some("slanted-spring"),
        ),
        Start::Moves => (
            "moves particles on which no force acts. Grade it, then add forces and integrators",
            Some("Inertia"),
        ),
        Start::Reads => ("reads scenes. Fill in what says \"your code here\", and grade it", None),
    };
    text += &format!("\nThe skeleton {what}:\n\n");
    if let Some(only) = only {
        text += &format!("    grade {folder} --only {only}\n");
    }
    text += &format!("    grade {folder}\n");
    print(text.as_bytes())?;
    Ok(Exit::Passed)
}
