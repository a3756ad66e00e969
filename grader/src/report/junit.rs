//! The report for continuous integration: JUnit XML, a suite a feature and a case a scene.
//!
//! A scene that could not be judged is an error, a failed one a failure; the type is the verdict's name.

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use super::jacobians;
use crate::grading::{Grading, SceneResult};
use crate::verdict::Verdict;

/// The report as JUnit XML.
///
/// # Errors
/// Where a name cannot be written as XML.
pub fn render(grading: &Grading) -> Result<String, quick_junit::SerializeError> {
    let mut report = Report::new(format!("Spring Oracle: {}", grading.submission));
    for result in &grading.features {
        let section = result.feature.section.name();
        let mut suite = TestSuite::new(format!("{section} / {}", result.feature));
        suite.add_test_cases(result.scenes.iter().map(scene));
        report.add_test_suite(suite);
    }
    if !grading.jacobians.is_empty() {
        let suites = grading.jacobians.forces.iter().map(jacobians::junit::suite);
        report.add_test_suites(suites);
        report.add_test_suite(jacobians::junit::newton(&grading.jacobians.newton));
    }
    if let Some(probing) = &grading.probing {
        report.add_test_suites(super::probe::junit::suites(probing));
    }
    report.to_string()
}

fn scene(scene: &SceneResult) -> TestCase {
    let verdict = &scene.comparison.verdict;
    let kind = match verdict {
        Verdict::Pass => return TestCase::new(scene.id.clone(), TestCaseStatus::success()),
        Verdict::Fail(_) => NonSuccessKind::Failure,
        Verdict::GraderFault(_) => NonSuccessKind::Error,
    };
    let mut message = verdict.to_string();
    if let Some(first) = &scene.comparison.first_wrong {
        message +=
            &format!(": first at {}, expected {}, got {}", first.place, first.expected, first.got);
    }
    not_passed(&scene.id, kind, verdict.name(), message)
}

pub(super) fn not_passed(name: &str, kind: NonSuccessKind, ty: &str, message: String) -> TestCase {
    let mut status = TestCaseStatus::non_success(kind);
    status.set_type(ty).set_message(message);
    TestCase::new(name, status)
}
