//! Self-test as JSON.
//!
//! The schema is `docs/selftest.schema.json`. Non-finite numbers are `null`.

use serde::Serialize;

use super::{expected, rates, verdict};
use crate::{Expectation, Graded, Outcome, Row, SelfTest};

/// Version of the schema.
pub const SCHEMA_VERSION: u32 = 2;

/// The report as JSON, with a newline at its end.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub fn render(selftest: &SelfTest) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&JsonSelfTest::of(selftest))? + "\n")
}

/// Planted mistakes and correct variants, with the grader's results.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(title = "Spring Oracle self-test"))]
struct JsonSelfTest {
    /// Version of this schema.
    schema_version: u32,
    /// Version of the grader.
    grader_version: &'static str,
    /// Whether all targets are met.
    met: bool,
    /// Mistakes caught, mistakes blamed on the right feature, correct variants passed.
    rates: Vec<JsonRate>,
    /// Rows that could not be run; not counted in any rate.
    skipped: usize,
    /// Mistakes and correct variants.
    rows: Vec<JsonRow>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonRate {
    name: &'static str,
    /// Rows with the expected result.
    right: usize,
    /// Rows that were run.
    all: usize,
    /// The required fraction.
    target: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonRow {
    /// "mistake" or "correct".
    kind: &'static str,
    /// Place of the mistake, or varied property of the variant.
    subject: String,
    description: String,
    /// The language, with the compiler's flags.
    language: String,
    /// The feature to blame for a mistake; "passes" for a correct variant.
    expected: String,
    /// "caught", "ESCAPED", "passed", "FAILED" or "skipped".
    verdict: &'static str,
    /// Whether the right feature is named first; null for correct variants and skipped rows.
    blamed_rightly: Option<bool>,
    /// Why it was skipped; null if it was not.
    skipped: Option<String>,
    /// The result of grading; null if skipped.
    graded: Option<JsonGraded>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonGraded {
    /// Scenes that were judged.
    scenes: usize,
    /// Scenes that failed.
    failed: usize,
    /// The findings, in the order of the report.
    findings: Vec<String>,
    /// The largest ratio of a residual to its tolerance; null if nothing was compared.
    worst: Option<f64>,
    /// The first scene that failed, with its verdict.
    example: Option<String>,
}

impl JsonSelfTest {
    fn of(selftest: &SelfTest) -> Self {
        let rate = |(name, rate, target): (&'static str, crate::Rate, f64)| JsonRate {
            name,
            right: rate.right,
            all: rate.all,
            target,
        };
        Self {
            schema_version: SCHEMA_VERSION,
            grader_version: env!("CARGO_PKG_VERSION"),
            met: selftest.is_met(),
            rates: rates(selftest).map(rate).into(),
            skipped: selftest.skipped(),
            rows: selftest.rows.iter().map(JsonRow::of).collect(),
        }
    }
}

impl JsonRow {
    fn of(row: &Row) -> Self {
        let (skipped, graded) = match &row.result {
            Outcome::Skipped(reason) => (Some(reason.clone()), None),
            Outcome::Graded(graded) => (None, Some(JsonGraded::of(graded))),
        };
        Self {
            kind: if row.expectation == Expectation::Correct { "correct" } else { "mistake" },
            subject: row.subject.clone(),
            description: row.description.clone(),
            language: row.language.clone(),
            expected: expected(row),
            verdict: verdict(row),
            blamed_rightly: row.is_blamed_rightly(),
            skipped,
            graded,
        }
    }
}

impl JsonGraded {
    fn of(graded: &Graded) -> Self {
        Self {
            scenes: graded.scenes,
            failed: graded.failed,
            findings: graded.named.iter().map(|named| named.text.clone()).collect(),
            worst: graded.worst.filter(|worst| worst.is_finite()),
            example: graded.example.clone(),
        }
    }
}

#[test]
fn documented_schema_is_current() {
    let schema = serde_json::to_string_pretty(&schemars::schema_for!(JsonSelfTest)).unwrap() + "\n";
    let command = "cargo test --release -p selftest schema";
    test_support::assert_document("selftest.schema.json", &schema, command);
}
