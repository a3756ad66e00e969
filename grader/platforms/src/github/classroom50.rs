//! Points for Classroom 50: the part of `result.json` that a grading decides; `autograder.py` adds whose they are.
//!
//! Scores are whole numbers from 0 to their maximum, in hundredths of a point. The maximum includes extra credit: a score
//! above it is refused.
//!
//! Format: `classroom50/result/v1`, as the page "Advanced Autograding" of Classroom 50's wiki describes it, August 2026.

use grader::grading::{FeatureResult, Grading};
use grader::suite::Section;
use serde::Serialize;

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Points {
    score: u64,
    max_score: u64,
    tests: Vec<Test>,
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Test {
    test_name: String,
    passed: bool,
    score: u64,
    max_score: u64,
    message: String,
}

/// The points, one test per feature that has some.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub fn render(grading: &Grading) -> serde_json::Result<String> {
    let features = grading.features.iter().filter(|it| it.feature.section != Section::Unscored);
    let tests: Vec<Test> = features.map(|result| test(result, grading)).collect();
    let sum = |of: fn(&Test) -> u64| tests.iter().map(of).sum();
    let (score, max_score) = (sum(|test| test.score), sum(|test| test.max_score));
    Ok(serde_json::to_string_pretty(&Points { score, max_score, tests })? + "\n")
}

fn test(result: &FeatureResult, grading: &Grading) -> Test {
    let credit = result.credit();
    let hundredths = |points: f64| (100.0 * points).round() as u64;
    let max_score = hundredths(credit.points);
    Test {
        test_name: crate::title(result),
        passed: result.is_pass(),
        score: hundredths(credit.shown(grading.faults).unwrap_or(0.0)).min(max_score),
        max_score,
        message: crate::passed(result),
    }
}
