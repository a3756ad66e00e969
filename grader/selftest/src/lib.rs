//! Self-test of the grader: planted mistakes to catch and to name, and correct programs to pass.
//!
//! ```text
//! in_process.rs   student.rs spoilt by mistake/    ──┐
//!                                                    ├─> Row: verdicts, findings, worst residual ─> Rates
//! programs.rs     programs/ built in several ways  ──┘
//! ```
//!
//! The code that grades submissions grades every row. Rows of the first kind run in this process; those of the second
//! are programs in other languages, built and run in the sandbox. [`drawn`] draws thousands of the first kind by a seed:
//! unfinished, with several mistakes, as partial folders of traces. The feature to blame is stated with each mistake,
//! from its nature and independent of results.

pub mod mistake;
pub mod student;

pub mod drawn;
pub mod in_process;
pub mod programs;
pub mod report;
pub mod sibling;

mod library;

use diagnosis::findings::{Feature, Finding, FindingKind, Symptom};
use grader::compare::{Comparison, Criteria, Tolerances};
use grader::grading::Grading;

/// Required fraction of mistakes blamed on the right feature.
pub const RIGHTLY_BLAMED: f64 = 0.95;

/// Expected result of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expectation {
    /// A mistake, with the symptom and the feature to blame.
    Mistake(Symptom, Feature),
    /// A correct variant.
    Correct,
}

/// A submission with its expected and actual result.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Place of the mistake, or varied property of the variant.
    pub subject: String,
    /// Short description of the mistake or variant.
    pub description: String,
    /// The language, with compiler flags if any.
    pub language: String,
    /// The expected result.
    pub expectation: Expectation,
    /// The actual result.
    pub result: Outcome,
}

/// Result of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Graded.
    Graded(Graded),
    /// Could not be built or run, with the reason.
    Skipped(String),
}

/// Summary of a grading.
#[derive(Debug, Clone, PartialEq)]
pub struct Graded {
    /// Scenes that were judged.
    pub scenes: usize,
    /// Scenes that failed.
    pub failed: usize,
    /// The findings, in the order of the report.
    pub named: Vec<Named>,
    /// The largest ratio of a residual to its tolerance; `None` if nothing was compared.
    pub worst: Option<f64>,
    /// The first scene that failed, with its verdict.
    pub example: Option<String>,
}

/// A finding of the report.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Its kind.
    pub kind: FindingKind,
    /// Its features; several are alternatives.
    pub features: Vec<Feature>,
    /// It as a sentence.
    pub text: String,
}

impl Named {
    fn of(finding: &Finding) -> Self {
        Self { kind: finding.kind, features: finding.features.clone(), text: finding.sentence() }
    }

    /// Whether it names this feature for failures with this symptom.
    pub fn is(&self, symptom: Symptom, feature: Feature) -> bool {
        let is_ended = match self.kind {
            FindingKind::Ends(Symptom::Error) => symptom == Symptom::Crash,
            FindingKind::Ends(found) => found == symptom,
            // A program that says what it lacks ends with an error.
            kind if kind.is_lack() => matches!(symptom, Symptom::Wrong | Symptom::Crash),
            _ => symptom == Symptom::Wrong,
        };
        is_ended && self.features.contains(&feature)
    }
}

impl Graded {
    /// Summarises a grading.
    pub fn of(grading: &Grading) -> Self {
        let scenes = || grading.features.iter().flat_map(|feature| &feature.scenes);
        let failed = || scenes().filter(|scene| !scene.comparison.verdict.is_pass());
        Self {
            scenes: scenes().count(),
            failed: failed().count(),
            named: grading.findings.list.iter().map(Named::of).collect(),
            worst: scenes()
                .filter(|scene| scene.comparison.is_compared())
                .map(|scene| excess(&scene.comparison, &scene.criteria))
                .reduce(f64::max),
            example: failed()
                .next()
                .map(|scene| format!("{}: {}", scene.id, scene.comparison.verdict)),
        }
    }
}

/// The largest ratio of a residual to its tolerance.
fn excess(comparison: &Comparison, criteria: &Criteria) -> f64 {
    let Criteria::Fixed(Tolerances { largest, accumulated }) = criteria else {
        return comparison.allowed.map_or(0.0, |allowed| allowed.used);
    };
    let residuals = [comparison.position, comparison.velocity];
    let ratios = residuals.map(|of| (of.largest / largest).max(of.accumulated / accumulated));
    ratios[0].max(ratios[1])
}

impl Row {
    /// Whether the result is as expected (a mistake fails, a correct variant passes); `None` if it was not run.
    pub fn is_told(&self) -> Option<bool> {
        let Outcome::Graded(graded) = &self.result else { return None };
        Some(match self.expectation {
            Expectation::Mistake(..) => graded.failed > 0,
            Expectation::Correct => graded.failed == 0 && graded.scenes > 0,
        })
    }

    /// Whether the right feature is named first; `None` if there is nothing to blame, or it was not run.
    pub fn is_blamed_rightly(&self) -> Option<bool> {
        let Expectation::Mistake(symptom, feature) = self.expectation else { return None };
        let Outcome::Graded(graded) = &self.result else { return None };
        Some(graded.named.first().is_some_and(|named| named.is(symptom, feature)))
    }

    /// Whether some finding is false: it names only what is not wrong.
    pub fn is_false(&self) -> Option<bool> {
        let Outcome::Graded(graded) = &self.result else { return None };
        Some(match self.expectation {
            Expectation::Correct => !graded.named.is_empty(),
            Expectation::Mistake(symptom, feature) => {
                graded.named.iter().any(|named| !named.is(symptom, feature))
            }
        })
    }
}

/// Results of the self-test.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfTest {
    /// The rows, mistakes and correct variants.
    pub rows: Vec<Row>,
}

/// A success rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Rows with the expected result.
    pub right: usize,
    /// Rows that were run.
    pub all: usize,
}

impl Rate {
    /// The rate from 0 to 1; 0 if nothing was run.
    pub fn value(self) -> f64 {
        if self.all == 0 { 0.0 } else { self.right as f64 / self.all as f64 }
    }

    fn of(answers: impl Iterator<Item = Option<bool>>) -> Self {
        let (mut right, mut all) = (0, 0);
        for answer in answers.flatten() {
            right += usize::from(answer);
            all += 1;
        }
        Self { right, all }
    }
}

impl SelfTest {
    /// The rows that are mistakes.
    pub fn mistakes(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| matches!(row.expectation, Expectation::Mistake(..)))
    }

    /// The rows that are correct variants.
    pub fn variants(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.expectation == Expectation::Correct)
    }

    /// Mistakes that were caught.
    pub fn caught(&self) -> Rate {
        Rate::of(self.mistakes().map(Row::is_told))
    }

    /// Mistakes of which the right feature was named first.
    pub fn blamed_rightly(&self) -> Rate {
        Rate::of(self.mistakes().map(Row::is_blamed_rightly))
    }

    /// Rows with a false finding, of all that were run.
    pub fn false_findings(&self) -> Rate {
        Rate::of(self.rows.iter().map(Row::is_false))
    }

    /// Correct variants that passed every scene.
    pub fn passed(&self) -> Rate {
        Rate::of(self.variants().map(Row::is_told))
    }

    /// Rows that could not be run.
    pub fn skipped(&self) -> usize {
        self.rows.iter().filter(|row| matches!(row.result, Outcome::Skipped(_))).count()
    }

    /// Whether all three targets are met: every mistake caught, [`RIGHTLY_BLAMED`] of them blamed on the right
    /// feature, every correct variant passed.
    pub fn is_met(&self) -> bool {
        let all = |rate: Rate| rate.all > 0 && rate.right == rate.all;
        all(self.caught()) && all(self.passed()) && self.blamed_rightly().value() >= RIGHTLY_BLAMED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAMPING: (Symptom, Feature) =
        (Symptom::Wrong, Feature::Force(diagnosis::findings::Part::One("springforce", "damping")));
    const OUTPUT: (Symptom, Feature) = (Symptom::Wrong, Feature::Output);

    fn row(expectation: Expectation, failed: usize, named: &[(Symptom, Feature)]) -> Row {
        let graded = Graded {
            scenes: 10,
            failed,
            named: named.iter().map(Named::planted).collect(),
            worst: Some(0.0),
            example: None,
        };
        let text = String::new;
        let result = Outcome::Graded(graded);
        Row { subject: text(), description: text(), language: text(), expectation, result }
    }

    impl Named {
        fn planted(&(symptom, feature): &(Symptom, Feature)) -> Self {
            let kind = match symptom {
                Symptom::Wrong => FindingKind::Cause,
                symptom => FindingKind::Ends(symptom),
            };
            Self { kind, features: vec![feature], text: String::new() }
        }
    }

    fn mistake(failed: usize, named: &[(Symptom, Feature)]) -> Row {
        row(Expectation::Mistake(DAMPING.0, DAMPING.1), failed, named)
    }

    fn correct(failed: usize) -> Row {
        row(Expectation::Correct, failed, &[])
    }

    /// Twenty mistakes caught and blamed, one correct variant passed, and these rows.
    fn with(rows: impl IntoIterator<Item = Row>) -> SelfTest {
        let good = (0..20).map(|_| mistake(3, &[DAMPING])).chain([correct(0)]);
        SelfTest { rows: good.chain(rows).collect() }
    }

    #[test]
    fn targets_are_met_if_all_rows_are_right() {
        assert!(with([]).is_met());
        // One of twenty-one may be blamed on the wrong feature; of two named features, the first counts.
        assert!(with([mistake(1, &[OUTPUT, DAMPING])]).is_met());
    }

    #[test]
    fn failed_correct_variant_fails_selftest() {
        let selftest = with([correct(1)]);
        assert!(!selftest.is_met());
        assert_eq!(selftest.passed(), Rate { right: 1, all: 2 });
    }

    #[test]
    fn uncaught_mistake_fails_selftest() {
        let selftest = with([mistake(0, &[])]);
        assert!(!selftest.is_met());
        assert_eq!(selftest.caught(), Rate { right: 20, all: 21 });
    }

    #[test]
    fn frequent_wrong_blame_fails_selftest() {
        assert!(!with([mistake(1, &[OUTPUT]), mistake(1, &[])]).is_met());
        let crash = (Symptom::Crash, DAMPING.1);
        let selftest = with([mistake(1, &[crash]), mistake(1, &[OUTPUT])]);
        assert_eq!(selftest.blamed_rightly(), Rate { right: 20, all: 22 });
        assert!(!selftest.is_met());
    }

    #[test]
    fn skipped_rows_are_not_counted() {
        let result = Outcome::Skipped("there is no c++".to_owned());
        let skipped = Row { result, ..mistake(0, &[]) };
        let selftest = with([skipped.clone()]);
        assert!(selftest.is_met());
        assert_eq!((selftest.skipped(), selftest.caught().all), (1, 20));
        assert!(!SelfTest { rows: vec![skipped] }.is_met());
        assert!(!SelfTest { rows: Vec::new() }.is_met());
    }
}
