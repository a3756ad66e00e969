//! Grading as JUnit XML for continuous integration: one suite per feature, one case per scene.
//!
//! A scene that could not be judged is an error, a failed one is a failure; the type is the verdict's name. A failed
//! scene that does not decide the outcome, such as one of extra credit, is skipped: JUnit knows no other mild end. A suite
//! with a failure has a property `finding` for each finding in its scenes; every suite of a feature has its points. The
//! hidden scenes of a feature are one case, skipped if they were not run. The last suite has no cases, and the provenance
//! as its properties.

use std::io;

use super::{SceneTimes, jacobians, text};
use crate::testsuites::{Document, ProblemKind, TestCase, TestSuite};
use grader::grading::points;
use grader::grading::provenance::Provenance;
use grader::grading::{Grading, Hidden, HiddenTally, SceneResult};
use grader::verdict::{Verdict, number};
use sandbox::Protection;

/// Name of the case of hidden scenes.
const HIDDEN: &str = "hidden scenes";

/// The report as JUnit XML.
///
/// # Errors
/// If the document cannot be written.
pub fn render(grading: &Grading, times: &SceneTimes) -> io::Result<String> {
    let mut suites = Vec::new();
    for result in &grading.features {
        let section = result.feature.section.name();
        let credit = result.credit();
        let failed =
            if grading.decides(result) { ProblemKind::Failure } else { ProblemKind::Skipped };
        let mut suite = TestSuite {
            name: format!("{section} / {}", result.feature),
            properties: vec![
                ("points", points::shown(credit.points)),
                ("points_earned", points::earned(&credit, grading.faults)),
                ("points_not_judged", points::unjudged(&credit)),
            ],
            cases: result.scenes.iter().map(|each| scene(each, failed, times)).collect(),
        };
        if result.hidden.n_scenes() > 0 {
            suite.cases.push(hidden(&result.hidden, failed));
        }
        if result.n_passed() + result.n_faults() < result.scenes.len() {
            let is_here = |name: &String| result.scenes.iter().any(|scene| scene.id == *name);
            let here = grading.findings.list.iter().filter(|f| f.scenes.iter().any(is_here));
            suite.properties.extend(here.map(|finding| ("finding", finding.to_string())));
        }
        suites.push(suite);
    }
    if let Hidden::NotRun { scenes, reason } = grading.hidden {
        let not_run = text::not_run(scenes, reason);
        let skipped = TestCase::not_passed(HIDDEN, ProblemKind::Skipped, None, not_run);
        suites.push(TestSuite {
            name: HIDDEN.to_owned(),
            cases: vec![skipped],
            ..TestSuite::default()
        });
    }
    if !grading.jacobians.is_empty() {
        suites.extend(grading.jacobians.forces.iter().map(jacobians::junit::suite));
        suites.push(jacobians::junit::newton(&grading.jacobians.newton));
    }
    if let Some(probing) = &grading.probing {
        suites.extend(super::probe::junit::suites(probing));
    }
    if let Some(provenance) = &grading.provenance {
        suites.push(provenance_suite(provenance, grading.protection.as_deref()));
    }
    Document { name: format!("Spring Oracle: {}", grading.submission.line()), suites }.render()
}

/// A suite without cases, whose properties say what the report was made by and from.
fn provenance_suite(provenance: &Provenance, protection: Option<&[Protection]>) -> TestSuite {
    let hash = |hash: &Option<String>| hash.clone().unwrap_or_default();
    let protection = protection.unwrap_or_default().iter().map(|protection| protection.name());
    let properties = vec![
        ("grader_version", env!("CARGO_PKG_VERSION").to_owned()),
        ("commit", hash(&provenance.commit)),
        ("platform", provenance.platform.clone()),
        ("rubric_sha256", hash(&provenance.rubric)),
        ("pack_sha256", hash(&provenance.pack)),
        ("assignment_sha256", hash(&provenance.assignment)),
        ("oracle_sha256", provenance.oracle()),
        ("hidden_sha256", hash(&provenance.hidden)),
        ("protection", protection.collect::<Vec<_>>().join(" ")),
    ];
    TestSuite { name: "provenance".to_owned(), properties, ..TestSuite::default() }
}

/// All hidden scenes of a feature: an error where one could not be judged, else `failed` where one failed.
fn hidden(tally: &HiddenTally, failed: ProblemKind) -> TestCase {
    let (passed, all) = (tally.n_passed(), tally.n_scenes());
    let kind = match tally.n_faults() {
        _ if passed == all => return TestCase::passed(HIDDEN),
        0 => failed,
        _ => ProblemKind::Error,
    };
    let message = format!("{passed} of {all} passed; {}", text::verdicts(tally));
    TestCase::not_passed(HIDDEN, kind, Some(HIDDEN), message)
}

fn scene(scene: &SceneResult, failed: ProblemKind, times: &SceneTimes) -> TestCase {
    let case = match &scene.comparison.verdict {
        Verdict::Pass => TestCase::passed(&scene.id),
        verdict @ Verdict::Fail(_) => problem(scene, failed, verdict),
        verdict @ Verdict::GraderFault(_) => problem(scene, ProblemKind::Error, verdict),
    };
    case.taking(times.get(&scene.id).copied())
}

/// A scene that did not pass: its verdict, the first wrong number, its file and the cause, each on a line.
fn problem(scene: &SceneResult, kind: ProblemKind, verdict: &Verdict) -> TestCase {
    let mut message = verdict.to_string();
    if let Some(first) = &scene.comparison.first_wrong {
        let [expected, got] = [first.expected, first.got].map(number);
        message += &format!("\nfirst at {}, expected {expected}, got {got}", first.place);
        message += &format!(", tolerance {:.1e}", first.tolerance);
    }
    message += &format!("\nscene: {}", scene.path);
    for cause in scene.diagnosis.iter().flat_map(|diagnosis| &diagnosis.causes) {
        message += &format!("\ncause: {cause}");
    }
    TestCase::not_passed(&scene.id, kind, Some(verdict.name()), message)
}
