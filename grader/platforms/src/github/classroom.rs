//! Points for GitHub Classroom: JSON in base64, one test per feature with points.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use grader::grading::{FeatureResult, Grading};
use grader::suite::Section;
use report::SceneTimes;
use serde::Serialize;

/// Version of the format.
const VERSION: u32 = 1;

#[derive(Serialize)]
struct Document {
    version: u32,
    status: &'static str,
    max_score: f64,
    tests: Vec<Test>,
}

#[derive(Serialize)]
struct Test {
    name: String,
    status: &'static str,
    score: f64,
    message: String,
    test_code: &'static str,
    filename: &'static str,
    line_no: u32,
    /// In milliseconds, with its unit.
    execution_time: String,
}

/// The points, as the step's output `result`.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub fn render(grading: &Grading, times: &SceneTimes) -> serde_json::Result<String> {
    let features = grading.features.iter().filter(|it| it.feature.section != Section::Unscored);
    let tests: Vec<Test> = features.map(|result| test(result, grading, times)).collect();
    let max_score = grading.totals(Section::Required).credit.points;
    let deciding = grading.features.iter().filter(|result| grading.decides(result));
    let status = match () {
        () if grading.features.iter().any(FeatureResult::has_faults) => "error",
        () if deciding.into_iter().all(FeatureResult::is_pass) => "pass",
        () => "fail",
    };
    encode(&Document { version: VERSION, status, max_score, tests })
}

/// The points of a submission that was not graded.
///
/// # Errors
/// Never in practice.
pub fn not_graded() -> serde_json::Result<String> {
    encode(&Document { version: VERSION, status: "error", max_score: 0.0, tests: Vec::new() })
}

fn encode(document: &Document) -> serde_json::Result<String> {
    Ok(STANDARD.encode(serde_json::to_vec(document)?))
}

fn test(result: &FeatureResult, grading: &Grading, times: &SceneTimes) -> Test {
    let seconds = result.scenes.iter().filter_map(|scene| times.get(&scene.id));
    let milliseconds = seconds.map(std::time::Duration::as_millis).sum::<u128>();
    let (passed, all) = (result.n_passed(), result.scenes.len());
    let (hidden, all_hidden) = (result.hidden.n_passed(), result.hidden.n_scenes());
    Test {
        name: match result.feature.section {
            Section::Required => result.feature.to_string(),
            section => format!("{}: {}", report::text::title(section), result.feature),
        },
        status: match (result.has_faults(), result.is_pass()) {
            (true, _) => "error",
            (false, true) => "pass",
            (false, false) => "fail",
        },
        score: result.credit().shown(grading.faults).unwrap_or(0.0),
        message: match all_hidden {
            0 => format!("{passed} of {all} scenes passed"),
            _ => {
                format!("{passed} of {all} scenes and {hidden} of {all_hidden} hidden ones passed")
            }
        },
        test_code: "",
        filename: "",
        line_no: 0,
        execution_time: format!("{milliseconds}ms"),
    }
}
