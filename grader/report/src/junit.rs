//! The report for continuous integration: JUnit XML, a suite a feature and a case a scene.
//!
//! A scene that could not be judged is an error, a failed one a failure; the type is the verdict's name. A suite
//! with a failure has the property `blame` for each cause that is named, every suite of a feature its points. The hidden scenes of a feature are one case,
//! skipped where they were not run.

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use super::{jacobians, text};
use grader::blame::{Blame, Finding, Suspect};
use grader::grading::points;
use grader::grading::{Grading, Hidden, SceneResult, Tally};
use grader::verdict::{Verdict, number};

/// What the case of hidden scenes is called.
const HIDDEN: &str = "hidden scenes";

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
        let credit = result.credit();
        for (name, points) in [
            ("points", points::shown(credit.points)),
            ("points_earned", points::earned(&credit, grading.faults)),
            ("points_not_judged", points::unjudged(&credit)),
        ] {
            suite.add_property((name, points.as_str()));
        }
        if result.hidden.n_scenes() > 0 {
            suite.add_test_case(hidden(&result.hidden));
        }
        if result.n_passed() + result.n_faults() < result.scenes.len() {
            for suspect in grading.blame.iter().flat_map(named) {
                suite.add_property(("blame", suspect.to_string().as_str()));
            }
        }
        report.add_test_suite(suite);
    }
    if let Hidden::NotRun { scenes } = grading.hidden {
        let mut suite = TestSuite::new(HIDDEN);
        let mut skipped = TestCaseStatus::skipped();
        skipped.set_message(text::not_run(scenes));
        suite.add_test_case(TestCase::new(HIDDEN, skipped));
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

/// All hidden scenes of a feature: an error where one could not be judged, a failure where one failed.
fn hidden(tally: &Tally) -> TestCase {
    let (passed, all) = (tally.n_passed(), tally.n_scenes());
    let kind = match tally.n_faults() {
        _ if passed == all => return TestCase::new(HIDDEN, TestCaseStatus::success()),
        0 => NonSuccessKind::Failure,
        _ => NonSuccessKind::Error,
    };
    let message = format!("{passed} of {all} passed; {}", text::verdicts(tally));
    not_passed(HIDDEN, kind, HIDDEN, message)
}

/// The causes that are named.
fn named(blame: &Blame) -> impl Iterator<Item = &Suspect> {
    blame.findings.iter().flat_map(Finding::named)
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
        let [expected, got] = [first.expected, first.got].map(number);
        message += &format!(": first at {}, expected {expected}, got {got}", first.place);
        message += &format!(", tolerance {:.1e}", first.tolerance);
    }
    if let Some(explanation) =
        scene.diagnosis.as_ref().and_then(|diagnosis| diagnosis.explanation.as_ref())
    {
        message += &format!("; cause: {}", explanation.words());
    }
    not_passed(&scene.id, kind, verdict.name(), message)
}

pub(super) fn not_passed(name: &str, kind: NonSuccessKind, ty: &str, message: String) -> TestCase {
    let mut status = TestCaseStatus::non_success(kind);
    status.set_type(ty).set_message(message);
    TestCase::new(name, status)
}
