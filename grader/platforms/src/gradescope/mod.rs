//! Gradescope: an image is built from a zip, and runs a program that leaves `results/results.json`.
//!
//! ```text
//! export.rs     suite, oracle, rubric, grade ──> zip: setup.sh, run_autograder, …
//! metadata.rs   submission_metadata.json ──> when it came in, its deadline, earlier points
//! score.rs      Grading, rubric, metadata ──> the points that count
//! results.rs    Grading, points ──> results.json
//! ```
//!
//! Formats: Gradescope's autograder documentation, pages "Specifications" and "Submission Metadata", of 2026.

pub mod export;
pub mod metadata;
pub mod results;
pub mod score;
