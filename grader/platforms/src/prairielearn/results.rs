//! `results.json`: one test per feature with points, and pictures of the first scenes that are wrong.
//!
//! The score is a share of the required points. Extra credit makes up for lost points, and never exceeds them: a test of it
//! has no points to lose, since PrairieLearn shows the sums of points and of maxima above all. A submission that
//! cannot be built, or that could not be judged, is not gradable: it does not count as an attempt. PrairieLearn shows
//! `output` as it is, and `format_errors` as a paragraph.

use std::io;

use grader::grading::{Credit, FeatureResult, Grading, SceneResult, points};
use grader::suite::Section;
use grader::verdict::{Failure, Verdict};
use report::text;
use serde::Serialize;

use super::pictures::{self, Image};

/// Bytes of the document, at most: PrairieLearn reads 1 MB.
const MOST: usize = 900_000;

/// Scenes with pictures, at most.
const PICTURED: usize = 4;

/// Bytes of an output, at most.
const MOST_OUTPUT: usize = 8_000;

#[derive(Default, Serialize)]
struct Document {
    gradable: bool,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    format_errors: Vec<String>,
    score: f64,
    message: String,
    output: String,
    images: Vec<Image>,
    tests: Vec<Test>,
}

#[derive(Serialize)]
struct Test {
    name: String,
    points: f64,
    max_points: f64,
    message: String,
    output: String,
}

/// The results.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn render(grading: &Grading) -> io::Result<String> {
    if let Some((kind, detail)) = unusable(grading) {
        return not_gradable(
            &format!("Your submission is not graded: {kind}. The output says why."),
            &detail,
        );
    }
    if grading.features.iter().any(FeatureResult::has_faults) {
        return not_gradable(
            "A part of your submission could not be judged, through no fault of yours. Tell your instructor.",
            "",
        );
    }
    let [required, extra] =
        [Section::Required, Section::ExtraCredit].map(|section| grading.totals(section).credit);
    let all = if required.points > 0.0 { required.points } else { extra.points };
    let earned = required.earned + extra.earned;
    let score = if all > 0.0 { (earned / all).min(1.0) } else { 0.0 };
    let mut overview = Vec::new();
    text::write_overview(&mut overview, grading)?;
    let features = grading.features.iter().filter(|it| it.feature.section != Section::Unscored);
    let scenes = grading.features.iter().flat_map(|result| &result.scenes);
    let images: io::Result<Vec<_>> = scenes.filter_map(pictures::of_scene).take(PICTURED).collect();
    let document = Document {
        gradable: true,
        score,
        message: made_up(&required, &extra),
        output: plain(overview)?,
        images: images?.concat(),
        tests: features.map(|result| test(result, grading)).collect::<io::Result<_>>()?,
        ..Document::default()
    };
    // Pictures of many particles could be large.
    let text = to_text(&document)?;
    if text.len() <= MOST {
        return Ok(text);
    }
    to_text(&Document { images: Vec::new(), ..document })
}

/// The results of a submission that does not count as an attempt: why, in a sentence, and what was printed.
///
/// # Errors
/// Never in practice.
pub fn not_gradable(reason: &str, printed: &str) -> io::Result<String> {
    let (format_errors, output) = (vec![reason.to_owned()], cut(printed));
    to_text(&Document { format_errors, output, ..Document::default() })
}

/// The effect of extra credit on the score, in words; empty if none was earned.
fn made_up(required: &Credit, extra: &Credit) -> String {
    let lost = required.points - required.earned;
    let [shown, extra, lost] = [required.points, extra.earned, lost].map(points::shown);
    match (extra.as_str(), lost.as_str()) {
        ("0", _) => String::new(),
        (_, "0") => format!(
            "The score is a share of {shown} points. {extra} points of extra credit do not raise it above 100 %."
        ),
        _ => format!(
            "The score is a share of {shown} points. {extra} points of extra credit make up for {lost} lost points, as far as they reach."
        ),
    }
}

fn to_text(document: &Document) -> io::Result<String> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// Why there is no program to grade, if so: the kind of the failure, and the failure.
fn unusable(grading: &Grading) -> Option<(String, String)> {
    let mut scenes = grading.features.iter().flat_map(|result| &result.scenes);
    scenes.find_map(|scene| match &scene.comparison.verdict {
        Verdict::Fail(failure @ (Failure::BuildFailed { .. } | Failure::BadHandIn { .. })) => {
            Some((failure.name().replace('-', " "), failure.to_string()))
        }
        _ => None,
    })
}

fn test(result: &FeatureResult, grading: &Grading) -> io::Result<Test> {
    let credit = result.credit();
    let mut output = Vec::new();
    let failed = |scene: &&SceneResult| !scene.comparison.verdict.is_pass();
    let failed = result.scenes.iter().filter(failed);
    text::write_scenes(&mut output, failed, usize::MAX)?;
    let hidden = match result.hidden.n_scenes() {
        0 => String::new(),
        all => format!("; {} of {all} hidden scenes", result.hidden.n_passed()),
    };
    let max_points = match result.feature.section {
        Section::ExtraCredit => 0.0,
        _ => credit.points,
    };
    Ok(Test {
        name: crate::title(result),
        points: credit.shown(grading.faults).unwrap_or(0.0),
        max_points,
        message: crate::passed(result) + &hidden,
        output: cut(&plain(output)?),
    })
}

/// The start of a text, of whole lines where it is cut.
fn cut(text: &str) -> String {
    if text.len() <= MOST_OUTPUT {
        return text.to_owned();
    }
    let end = text.as_bytes()[..MOST_OUTPUT].iter().rposition(|byte| *byte == b'\n');
    format!("{}\n(cut here)\n", &text[..end.unwrap_or(0)])
}

/// The text without colours.
fn plain(bytes: Vec<u8>) -> io::Result<String> {
    let text = String::from_utf8(bytes).map_err(io::Error::other)?;
    Ok(anstream::adapter::strip_str(&text).to_string())
}
