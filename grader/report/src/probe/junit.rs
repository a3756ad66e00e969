//! Black-box probe as JUnit XML: one suite per part and dimension, one case per finding.
//!
//! A wrong finding is a failure. A finding that is not offered or inconclusive is skipped, with the reason.

use std::io;

use crate::testsuites::{Document, ProblemKind, TestCase, TestSuite};
use grader::probe::{Finding, PartReport, Probing, Verdict};

/// The report as JUnit XML.
///
/// # Errors
/// If the document cannot be written.
pub fn render(probing: &Probing) -> io::Result<String> {
    let name = format!("Spring Oracle: forces and Jacobians of {}", probing.name.line());
    Document { name, suites: suites(probing).collect() }.render()
}

/// One suite per part and dimension.
pub(crate) fn suites(probing: &Probing) -> impl Iterator<Item = TestSuite> {
    probing.parts.iter().map(|part| {
        let name = format!("{} / {} in {}D", part.force, part.part, part.dimension.count());
        let cases = part.findings().map(|(name, finding)| case(part, name, finding)).collect();
        TestSuite { name, cases, ..TestSuite::default() }
    })
}

fn case(part: &PartReport, name: &str, finding: &Finding) -> TestCase {
    let kind = match finding.verdict {
        Verdict::Correct => return TestCase::passed(name),
        Verdict::Wrong => ProblemKind::Failure,
        Verdict::Inconclusive | Verdict::NotOffered => ProblemKind::Skipped,
    };
    let mut words = vec![finding.verdict.name().to_owned()];
    words.extend((!finding.reason.is_empty()).then(|| finding.reason.clone()));
    words.extend(finding.error.map(|error| format!("relative error {error:.1e}")));
    if finding.verdict == Verdict::Wrong {
        words.extend(part.diagnosis.iter().cloned());
    }
    TestCase::not_passed(name, kind, Some(finding.verdict.name()), words.join("; "))
}
