//! Reports of the self-test: the matrix of mistakes and variants, and three rates.

pub mod drawn;
pub mod json;
pub mod markdown;
pub mod text;

use crate::{Expectation, Graded, Outcome, Rate, Row, SelfTest};

/// The three rates with their names and targets.
pub(super) fn rates(selftest: &SelfTest) -> [(&'static str, Rate, f64); 3] {
    [
        ("mistakes caught", selftest.caught(), 1.0),
        ("blamed on the right feature", selftest.blamed_rightly(), crate::RIGHTLY_BLAMED),
        ("correct variants passed", selftest.passed(), 1.0),
    ]
}

/// The expectation of a row as text.
pub(super) fn expected(row: &Row) -> String {
    match row.expectation {
        Expectation::Correct => "passes".to_owned(),
        Expectation::Mistake(diagnosis::findings::Symptom::Wrong, feature) => feature.to_string(),
        Expectation::Mistake(symptom, feature) => format!("{symptom}: {feature}"),
    }
}

/// The verdict of a row as text.
pub(super) fn verdict(row: &Row) -> &'static str {
    match (&row.result, row.expectation, row.is_told()) {
        (Outcome::Skipped(_), ..) => "skipped",
        (_, Expectation::Mistake(..), Some(true)) => "caught",
        (_, Expectation::Mistake(..), _) => "ESCAPED",
        (_, Expectation::Correct, Some(true)) => "passed",
        (_, Expectation::Correct, _) => "FAILED",
    }
}

/// The findings.
pub(super) fn blamed(graded: &Graded) -> String {
    match graded.named.as_slice() {
        [] => "nothing".to_owned(),
        all => all.iter().map(|named| named.text.as_str()).collect::<Vec<_>>().join("; "),
    }
}
