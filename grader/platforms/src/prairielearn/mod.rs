//! PrairieLearn: an external grader in a container, which leaves `/grade/results/results.json`.
//!
//! ```text
//! export.rs      suite, grade ──> a course folder: question, tests, image
//! results.rs     Grading ──> results.json, below 1 MB
//! pictures.rs    Recording ──> residuals, and the particles at the first wrong step, as PNG
//! ```
//!
//! Formats: PrairieLearn's documentation, page "Externally graded questions", of 2026.

pub mod export;
pub mod results;

mod pictures;
