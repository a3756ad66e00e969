//! Self-test rows of the second simulator and its mistakes, graded in this process.

use std::collections::HashMap;

use rayon::prelude::*;

use super::mistake::{self, Mistake};
use super::student::{self, Student};
use super::{Expectation, Graded, Outcome, Row};
use diagnosis::findings::Symptom;
use grader::compare::{Comparison, Criteria};
use grader::grading;
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::suite::{Case, Suite};
use scene::Scene;
use scene::schema::Family;
use scene::trace::State;

/// Rows of the correct student and of every mistake, or of those with this subject: on the scenes of the plane and on
/// those of space, by themselves.
pub fn rows(suite: &Suite, oracle: &Oracle, rubric: &Rubric, subject: Option<&str>) -> Vec<Row> {
    let of = |knows: fn(&Scene) -> bool, description: &'static str, mistakes: Vec<Mistake>| {
        let cases = suite.cases.iter().filter(|case| knows(&case.scene)).cloned().collect();
        let part = Suite { cases, sections: suite.sections.clone(), warnings: Vec::new() };
        let mut mistakes = mistake::possible(&part, mistakes);
        mistakes.retain(|mistake| subject.is_none_or(|subject| mistake.subject == subject));
        rows_of(&part, oracle, rubric, description, &mistakes)
    };
    let mut rows = of(is_known, "as it is", mistake::all());
    rows.extend(of(student::knows_in_space, "as it is, in space", mistake::in_space()));
    rows
}

fn rows_of(
    suite: &Suite,
    oracle: &Oracle,
    rubric: &Rubric,
    description: &'static str,
    mistakes: &[Mistake],
) -> Vec<Row> {
    let faultless = Student::faultless();
    let judge = |student: &Student, case: &Case, criteria: Criteria| {
        grading::judge(case, oracle, criteria, || Ok(Box::new(student.simulate(&case.scene))))
    };
    let correct = grading::collect(suite, String::new(), oracle, rubric, |case, criteria| {
        judge(&faultless, case, criteria)
    });
    let known: HashMap<&str, (Comparison, Vec<State>)> = suite
        .cases
        .par_iter()
        .map(|case| {
            let criteria = rubric.criteria(case, oracle.calibrated(case));
            (case.id.as_str(), judge(&faultless, case, criteria))
        })
        .collect();
    let mut rows = vec![Row {
        subject: "the second simulator".to_owned(),
        description: description.to_owned(),
        language: LANGUAGE.to_owned(),
        expectation: Expectation::Correct,
        result: Outcome::Graded(Graded::of(&correct)),
    }];
    let row = |mistake: &Mistake| {
        let student = mistake.student();
        let grading = grading::collect(suite, String::new(), oracle, rubric, |case, criteria| {
            // On other scenes, the code with the mistake does not run.
            match known.get(case.id.as_str()) {
                Some(known) if !mistake.can_matter_on(&case.scene) => known.clone(),
                _ => judge(&student, case, criteria),
            }
        });
        Row {
            subject: mistake.subject.to_owned(),
            description: mistake.description.to_owned(),
            language: LANGUAGE.to_owned(),
            expectation: Expectation::Mistake(Symptom::Wrong, mistake.feature()),
            result: Outcome::Graded(Graded::of(&grading)),
        }
    };
    rows.extend(mistakes.par_iter().map(row).collect::<Vec<Row>>());
    rows
}

/// The second simulator is written in Rust, and built with the grader.
const LANGUAGE: &str = "Rust";

/// Keeps the scenes of a suite that the student supports in the plane, except those under methods that minimise: no steps of these are
/// redone to find a cause.
pub fn known(suite: &mut Suite) {
    suite.cases.retain(|case| is_known(&case.scene));
}

fn is_known(scene: &Scene) -> bool {
    student::knows(scene) && scene.integrator.family != Family::Minimization
}
