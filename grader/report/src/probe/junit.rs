//! What probing found, as JUnit XML: a suite a part and space, a case a finding.
//!
//! Wrong is a failure. What is not offered or could not be told is skipped, and says why.

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use grader::probe::{Finding, PartReport, Probing, Verdict};

/// The report as JUnit XML.
///
/// # Errors
/// Where a name cannot be written as XML.
pub fn render(probing: &Probing) -> Result<String, quick_junit::SerializeError> {
    let mut report =
        Report::new(format!("Spring Oracle: forces and Jacobians of {}", probing.name));
    report.add_test_suites(suites(probing));
    report.to_string()
}

/// A suite a part and space.
pub(crate) fn suites(probing: &Probing) -> impl Iterator<Item = TestSuite> {
    probing.parts.iter().map(|part| {
        let name = format!("{} / {} in {}D", part.force, part.part, part.dimension.count());
        let mut suite = TestSuite::new(name);
        suite.add_test_cases(part.findings().map(|(name, finding)| case(part, name, finding)));
        suite
    })
}

fn case(part: &PartReport, name: &str, finding: &Finding) -> TestCase {
    let mut status = match finding.verdict {
        Verdict::Correct => TestCaseStatus::success(),
        Verdict::Wrong => TestCaseStatus::non_success(NonSuccessKind::Failure),
        Verdict::Inconclusive | Verdict::NotOffered => TestCaseStatus::skipped(),
    };
    if finding.verdict != Verdict::Correct {
        let mut words = vec![finding.verdict.name().to_owned()];
        words.extend((!finding.reason.is_empty()).then(|| finding.reason.clone()));
        words.extend(finding.error.map(|error| format!("relative error {error:.1e}")));
        if finding.verdict == Verdict::Wrong {
            words.extend(part.diagnosis.iter().cloned());
        }
        status.set_type(finding.verdict.name());
        status.set_message(words.join("; "));
    }
    TestCase::new(name, status)
}
