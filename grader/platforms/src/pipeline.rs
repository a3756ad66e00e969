//! Pipelines of a code host: a file of the template repository that builds `grade` and grades each push with it.
//!
//! ```text
//! GitHub    .github/workflows/grade.yml    summary and annotations by `--report github`
//! GitLab    .gitlab-ci.yml                 JUnit, which GitLab shows with the pipeline
//! ```
//!
//! Students of a host can edit the file, and read what its token reads.
//!
//! Formats: GitHub's "Workflow syntax for GitHub Actions" and GitLab's "CI/CD YAML syntax reference", of 2026.

/// A code host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Host {
    /// Path of the file.
    pub path: &'static str,
    template: &'static str,
}

/// GitHub.
pub const GITHUB: Host =
    Host { path: ".github/workflows/grade.yml", template: include_str!("github/workflow.yml") };

/// GitLab.
pub const GITLAB: Host =
    Host { path: ".gitlab-ci.yml", template: include_str!("gitlab/gitlab-ci.yml") };

/// Settings of the pipeline.
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

impl Host {
    /// The file, for a repository with the files of a submission at its root.
    pub fn pipeline(self, settings: &Settings) -> String {
        let Settings { repository, reference, assignment, minutes } = settings;
        // Text of YAML in double quotes is that of JSON.
        let quoted = |text: &str| serde_json::Value::from(text).to_string();
        self.template
            .replace("REPOSITORY", &quoted(repository))
            .replace("REFERENCE", &quoted(reference))
            .replace("ASSIGNMENT_NAME", &quoted(assignment))
            .replace("MINUTES", &minutes.to_string())
    }
}
