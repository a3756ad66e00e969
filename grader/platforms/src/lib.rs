//! Formats of course platforms.
//!
//! ```text
//! Grading ──> results of a platform                      one writer per platform; none decides anything
//! Suite, oracle, rubric, grade itself ──> package        what a course uploads so that the platform runs `grade`
//! ```
//!
//! A package calls `grade`, which writes the results. Points of late and repeated submissions follow from the rubric and
//! from times that the platform tells ([`gradescope::score`]).

use grader::grading::FeatureResult;
use grader::suite::Section;
use report::text;

pub mod archive;
pub mod bundle;
pub mod github;
pub mod gradebook;
pub mod gradescope;
pub mod package;
pub mod pipeline;
pub mod prairielearn;

/// The text as one word of a command in a shell.
pub fn shell_word(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// A feature as students read it: with its section, unless that is the required one.
fn title(result: &FeatureResult) -> String {
    match result.feature.section {
        Section::Required => result.feature.to_string(),
        section => format!("{}: {}", text::title(section), result.feature),
    }
}

/// How many scenes of a feature passed, and how many need what is not implemented, which no writer explains one by one.
fn passed(result: &FeatureResult) -> String {
    let (passed, all) = (result.n_passed(), result.scenes.len());
    let lacks = result.scenes.iter().filter(|scene| scene.comparison.verdict.is_lack()).count();
    let lacks = if lacks > 0 { format!(", {lacks} not implemented") } else { String::new() };
    format!("{passed} of {all} scenes passed{lacks}")
}
