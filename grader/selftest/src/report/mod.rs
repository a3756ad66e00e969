//! What the self-test comes to: the matrix of mistakes and variants, and three rates.

pub mod json;
pub mod markdown;
pub mod text;

use crate::{Expectation, Graded, Outcome, Rate, Row, SelfTest};

/// The three rates, each with its name and its target.
pub(super) fn rates(selftest: &SelfTest) -> [(&'static str, Rate, f64); 3] {
    [
        ("mistakes caught", selftest.caught(), 1.0),
        ("blamed on the right feature", selftest.blamed_rightly(), crate::RIGHTLY_BLAMED),
        ("correct variants passed", selftest.passed(), 1.0),
    ]
}

/// What is expected of a row, in words.
pub(super) fn expected(row: &Row) -> String {
    match row.expectation {
        Expectation::Correct => "passes".to_owned(),
        Expectation::Mistake(grader::blame::Symptom::Wrong, feature) => feature.to_string(),
        Expectation::Mistake(symptom, feature) => format!("{symptom}: {feature}"),
    }
}

/// What became of a row, in a word.
pub(super) fn verdict(row: &Row) -> &'static str {
    match (&row.result, row.expectation, row.is_told()) {
        (Outcome::Skipped(_), ..) => "skipped",
        (_, Expectation::Mistake(..), Some(true)) => "caught",
        (_, Expectation::Mistake(..), _) => "ESCAPED",
        (_, Expectation::Correct, Some(true)) => "passed",
        (_, Expectation::Correct, _) => "FAILED",
    }
}

/// What was blamed: the causes that are named.
pub(super) fn blamed(graded: &Graded) -> String {
    match graded.named.len() {
        0 => "nothing".to_owned(),
        few => graded.suspects[..few].join(if graded.together { " and " } else { " or " }),
    }
}
