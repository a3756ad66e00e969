//! The workflow of a course's template repository.

/// Path of the workflow. Classroom starts the workflow of this name.
pub const PATH: &str = ".github/workflows/classroom.yml";

/// What the workflow does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The repository with the grader, the scenes and the oracle, as `OWNER/NAME`.
    pub repository: String,
    /// Its branch, tag or commit.
    pub reference: String,
    /// The assignment.
    pub assignment: String,
    /// Minutes after which the job ends.
    pub minutes: u32,
}

/// The workflow, for a repository with the files of a submission at its root.
pub fn workflow(settings: &Settings) -> String {
    let Settings { repository, reference, assignment, minutes } = settings;
    // Text of YAML in double quotes is that of JSON.
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    include_str!("classroom.yml")
        .replace("REPOSITORY", &quoted(repository))
        .replace("REFERENCE", &quoted(reference))
        .replace("ASSIGNMENT_NAME", &quoted(assignment))
        .replace("MINUTES", &minutes.to_string())
}
