//! Diagnosis of students with a known mistake.
//!
//! An explanation is *right* if one of the places that it names is the mistake's, *sharp* if it names only that place,
//! and *wrong* if it names only other places.

use grader::diagnosis::{Culprit, Diagnosis, diagnose};
use grader::suite::Case;
use rayon::prelude::*;

use super::own_suite;
use selftest::mistake::{self, Area, Mistake};
use selftest::student::Student;

/// Number of scenes per mistake.
const SCENES: usize = 6;

/// Counts of explanations of a mistake over its scenes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Said {
    right: usize,
    sharp: usize,
    wrong: usize,
}

/// Whether this is the place of the mistake.
fn is_place(culprit: Culprit, mistake: &Mistake) -> bool {
    let tag = || super::probing::tag(mistake.subject);
    match (mistake.area, culprit) {
        (Area::Force, Culprit::Force(named)) => named == tag(),
        (Area::Jacobian, Culprit::Jacobian(named)) => named == tag(),
        (Area::Integrator, Culprit::Integrator) | (Area::Fixed, Culprit::Fixed) => true,
        _ => false,
    }
}

fn said_of(mistake: &Mistake, cases: &[Case]) -> (Said, Vec<String>) {
    let student = mistake.student();
    let mut said = Said::default();
    let mut wrong = Vec::new();
    let scenes = cases.iter().filter(|case| mistake.can_matter_on(&case.scene));
    let looked_into = scenes.filter_map(|case| {
        let found: Diagnosis = diagnose(case, &mut student.simulate(&case.scene))?;
        (found.steps.wrong > 0).then_some((case, found))
    });
    for (case, Diagnosis { explanation, .. }) in looked_into.take(SCENES) {
        let Some(explanation) = explanation else { continue };
        let mut places = explanation.candidates.iter();
        if places.any(|candidate| is_place(candidate.culprit, mistake)) {
            said.right += 1;
            said.sharp += usize::from(explanation.candidates.len() == 1);
        } else {
            said.wrong += 1;
            let (of, what) = (mistake.subject, mistake.description);
            wrong.push(format!("{of}, {what}; on {}: {}", case.id, explanation.words()));
        }
    }
    (said, wrong)
}

#[test]
fn what_is_said_of_a_mistake_is_not_wrong_and_mostly_something() {
    let cases = own_suite().cases;
    let mistakes = mistake::all();
    let said: Vec<(Said, Vec<String>)> =
        mistakes.par_iter().map(|mistake| said_of(mistake, &cases)).collect();
    let mut lines = Vec::new();
    for area in Area::ALL {
        let of = || mistakes.iter().zip(&said).filter(|(mistake, _)| mistake.area == area);
        let count = |test: fn(&Said) -> bool| of().filter(|(_, (said, _))| test(said)).count();
        let (all, explained) = (of().count(), count(|said| said.right > 0 && said.wrong == 0));
        let (sharp, wrong) = (count(|said| said.sharp > 0), count(|said| said.wrong > 0));
        lines.push(format!(
            "{}: {explained} of {all}, {sharp} sharply; wrongly {wrong}",
            area.title()
        ));
    }
    let wrong: Vec<&str> =
        said.iter().flat_map(|(_, wrong)| wrong.iter().map(String::as_str)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    insta::assert_snapshot!("explanations", lines.join("\n"));
}

#[test]
fn nothing_is_said_of_the_faultless() {
    let cases = own_suite().cases;
    let complaints: Vec<String> = cases
        .par_iter()
        .filter_map(|case| {
            let found = diagnose(case, &mut Student::faultless().simulate(&case.scene))?;
            (found.steps.wrong > 0).then(|| format!("{}: {}", case.id, found.steps.words()))
        })
        .collect();
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}
