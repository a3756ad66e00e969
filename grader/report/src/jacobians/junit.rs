//! Jacobian checks as JUnit XML: one suite per force and dimension, one case per verdict. An inconclusive verdict is an
//! error.

use super::{axis, measured, words};
use crate::testsuites::{ProblemKind, TestCase, TestSuite};
use grader::white_box::{BlockFinding, JacobianCheck, NewtonCheck, PropertyFinding, Verdict};

/// The suite of a force in one dimension.
pub(crate) fn suite(check: &JacobianCheck) -> TestSuite {
    let name = format!("jacobians / {} {}D", check.tag, check.dimension.count());
    let blocks = check.blocks.iter().map(|finding| block(check, finding));
    let asked = check.properties.iter().filter(|each| each.verdict != Verdict::NotApplicable);
    let cases = blocks.chain(asked.map(property)).collect();
    TestSuite { name, cases, ..TestSuite::default() }
}

/// The suite of the Newton systems.
pub(crate) fn newton(checks: &[NewtonCheck]) -> TestSuite {
    let cases = checks.iter().map(|check| {
        let error = check.error.map_or_else(String::new, |error| format!(" {}", measured(error)));
        let message = format!("{}: {error}", words(check.verdict));
        case(&format!("{} {}", check.integrator, check.scene), check.verdict, message)
    });
    TestSuite {
        name: "jacobians / Newton systems".to_owned(),
        cases: cases.collect(),
        ..TestSuite::default()
    }
}

fn block(check: &JacobianCheck, finding: &BlockFinding) -> TestCase {
    let mut message = words(finding.verdict);
    if let Some(exhibit) = &finding.exhibit {
        let dimension = check.dimension.count();
        message += &format!(
            ": force on particle {} along {} by particle {} along {}, relative error {}, at \"{}\"",
            exhibit.row,
            axis(exhibit.worst / dimension),
            exhibit.column,
            axis(exhibit.worst % dimension),
            measured(exhibit.relative_error()),
            exhibit.state.name,
        );
    }
    case(finding.kind.name(), finding.verdict, message)
}

fn property(finding: &PropertyFinding) -> TestCase {
    let mut message = format!("{}: {}", words(finding.verdict), finding.property.meaning());
    if let (Some(error), Some(state)) = (finding.error, &finding.state) {
        message += &format!(", off by {} at \"{}\"", measured(error), state.name);
    }
    case(finding.property.name(), finding.verdict, message)
}

fn case(name: &str, verdict: Verdict, message: String) -> TestCase {
    let kind = match verdict {
        Verdict::Correct | Verdict::CorrectZero | Verdict::NotApplicable => {
            return TestCase::passed(name);
        }
        Verdict::Wrong => ProblemKind::Failure,
        Verdict::Inconclusive(_) => ProblemKind::Error,
    };
    TestCase::not_passed(name, kind, Some(verdict.name()), message)
}
