//! GitHub Actions, and Classroom 50 in it.
//!
//! ```text
//! Grading ──> summary.rs        Markdown, below the run of a workflow
//!         ──> annotations.rs    marks at files of the submission, as commands on standard output
//!         ──> classroom50.rs    points of Classroom 50
//! ```
//!
//! Actions reads commands (`::error ::…`) in everything that a step prints, so a program could give them. Between
//! [`commands_off`] and [`commands_on`] it reads none.
//!
//! Formats: GitHub's "Workflow commands for GitHub Actions", of 2026.

pub mod annotations;
pub mod classroom50;
pub mod summary;

/// A line after which commands are ignored, until [`commands_on`] with the same token, which no program can guess.
pub fn commands_off(token: &str) -> String {
    format!("::stop-commands::{token}\n")
}

/// A line after which commands are obeyed again.
pub fn commands_on(token: &str) -> String {
    format!("::{token}::\n")
}
