//! Formats of course platforms.
//!
//! ```text
//! Grading ──> results of a platform                      one writer per platform; none decides anything
//! Suite, oracle, rubric, grade itself ──> package        what a course uploads so that the platform runs `grade`
//! ```
//!
//! A package calls `grade`, which writes the results. Points of late and repeated submissions follow from the rubric and
//! from times that the platform tells ([`gradescope::score`]).

pub mod archive;
pub mod github;
pub mod gradescope;
pub mod package;
pub mod prairielearn;
