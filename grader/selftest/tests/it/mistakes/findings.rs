//! Findings on mistakes in the methods that minimise, graded as the assignments that ask for them.
//!
//! No step of projected Newton is redone to find a cause, so that most mistakes in it leave no finding. No finding is false.

use diagnosis::change::Task;
use diagnosis::findings::{Feature, Finding, FindingKind};
use grader::grading::{self, Grading};
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::StateSource;
use grader::suite::assignment::Assignment;
use grader::suite::{Case, Section, Suite};
use grader::verdict::Failure;
use rayon::prelude::*;
use scene::trace::State;
use selftest::mistake::{self, Mistake};
use selftest::student::Student;
use test_support::{root, sample};

use super::whole_suite;

pub(super) struct Inputs {
    pub(super) suite: Suite,
    oracle: Oracle,
    pub(super) rubric: Rubric,
}

impl Inputs {
    pub(super) fn of(name: &str) -> Self {
        let folder = root().join("assets");
        let mut assignment =
            Assignment::load(&folder.join("assignments"), name).expect("an assignment");
        let mut suite = whole_suite();
        assignment.narrow(&mut suite).expect("scenes");
        let mut rubric = Rubric::load(&folder.join("rubric.toml")).expect("a rubric");
        rubric.assign(assignment);
        let oracle = Oracle::open(&root().join("expected")).expect("an oracle");
        Self { suite, oracle, rubric }
    }

    fn grade(&self, student: &Student) -> Grading {
        self.grade_as(student, |states| states)
    }

    /// Grades what `written` makes of a student's states.
    pub(super) fn grade_as(
        &self,
        student: &Student,
        written: fn(Box<dyn StateSource>) -> Box<dyn StateSource>,
    ) -> Grading {
        let Self { suite, oracle, rubric } = self;
        grading::collect(suite, String::new(), oracle, rubric, |case, criteria| {
            let start = || Ok(written(Box::new(student.simulate(&case.scene))));
            grading::judge(case, oracle, criteria, start)
        })
    }
}

/// Asserts that no finding is false on `count` of the mistakes that can have an effect on a required scene.
fn assert_no_false_finding(name: &str, count: usize) {
    let inputs = Inputs::of(name);
    assert_eq!(inputs.grade(&Student::faultless()).findings.list, []);
    let required = |case: &&Case| case.feature.section == Section::Required;
    let required: Vec<&Case> = inputs.suite.cases.iter().filter(required).collect();
    let is_possible =
        |mistake: &Mistake| required.iter().any(|case| mistake.can_show_on(&case.scene));
    let mistakes = sample(mistake::all().into_iter().filter(is_possible), count);
    let found = |mistake: &Mistake| {
        let list = inputs.grade(&mistake.student()).findings.list;
        let is_false = |finding: &&Finding| {
            finding.kind != FindingKind::Common && !is_of(finding, mistake.feature())
        };
        let found: Vec<String> = list.iter().filter(is_false).map(ToString::to_string).collect();
        (!found.is_empty())
            .then(|| format!("{}, {}: {found:?}", mistake.subject, mistake.description))
    };
    let found: Vec<String> = mistakes.par_iter().filter_map(found).collect();
    assert!(found.is_empty(), "{name}: {found:#?}");
}

/// Whether a finding names where a mistake was planted. Fixed particles are the pins of fast mass-spring.
pub(super) fn is_of(finding: &Finding, planted: Feature) -> bool {
    finding.features.iter().any(|feature| match (feature, planted) {
        (Feature::Task(Task::Selection), Feature::Fixed(_)) => true,
        // Where one force alone uses them.
        (Feature::Force(_) | Feature::Jacobian(_), Feature::Helpers) => true,
        (feature, planted) => *feature == planted,
    })
}

/// Of mistakes, by their descriptions, the one finding on each. The number in a guard is between those that the scenes tell apart.
const IN_THESE_WORDS: [(&str, &str); 7] = [
    (
        "no force within 0.02 of the rest length",
        "springforce's elastic force is left out where its length is less than 0.02 off l0",
    ),
    (
        "no attraction beyond 1.5",
        "gravitationalforce is left out where its particles are more than 1.5 apart",
    ),
    (
        "none on slow particles",
        "dragdamping is left out where the speed of a particle is smaller than 0.25",
    ),
    (
        "only on particles with an even number",
        "simplegravity is left out for particles with an odd number (counted from 0)",
    ),
    (
        "by the squares of the lengths",
        "springforce's elastic force has l² − l0² in the place of l − l0",
    ),
    ("by the relative speed", "springforce's damping has |w| in the place of n·w"),
    ("free, with a mass of 1e6", "fixed particles are free, with a mass of 1e6"),
];

/// Grades so many of these mistakes as t1m3.
fn assert_named_in_these_words(count: usize) {
    let inputs = Inputs::of("t1m3");
    let all: Vec<Mistake> = mistake::all().into_iter().chain(mistake::foreign()).collect();
    for (description, sentence) in sample(IN_THESE_WORDS, count) {
        let planted = all.iter().find(|mistake| mistake.description == description);
        let list = inputs.grade(&planted.expect("a mistake").student()).findings.list;
        let sentences: Vec<String> = list.iter().map(Finding::sentence).collect();
        assert_eq!(sentences, [sentence], "{description}");
    }
}

#[test]
fn sampled_guards_and_other_formulas_are_named_in_these_words() {
    assert_named_in_these_words(1);
}

#[test]
#[ignore = "long: half a minute"]
fn long_guards_and_other_formulas_are_named_in_these_words() {
    assert_named_in_these_words(usize::MAX);
}

/// The first states of another source.
struct First {
    states: Box<dyn StateSource>,
    left: f64,
}

impl StateSource for First {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        self.left -= 1.0;
        Ok(self.left >= 0.0 && self.states.read(state)?)
    }

    fn has_velocities(&self) -> bool {
        self.states.has_velocities()
    }
}

#[test]
fn a_wrong_number_of_states_is_told_with_how_steps_are_counted() {
    let Inputs { suite, oracle, rubric } = Inputs::of("t1m3");
    for (number, words) in [
        "",
        ", as where duration/dt is rounded down",
        ", as where duration/dt is rounded to the nearest integer",
    ]
    .into_iter()
    .enumerate()
    {
        let counted = |ratio: f64| [ratio.ceil() - 1.0, ratio.floor(), ratio.round()][number];
        let grading =
            grading::collect(&suite, String::new(), &oracle, &rubric, |case, criteria| {
                let left = 1.0 + counted(case.scene.duration / case.scene.time_step);
                let states = Box::new(Student::faultless().simulate(&case.scene));
                grading::judge(case, &oracle, criteria, || Ok(Box::new(First { states, left })))
            });
        let list = grading.findings.list;
        let sentences: Vec<String> = list.iter().map(Finding::sentence).collect();
        assert_eq!(sentences, [format!("the number of states: one too few{words}")]);
    }
}

const ASSIGNMENTS: [&str; 2] = ["elastodynamics", "fast-mass-spring"];

#[test]
fn sampled_mistakes_in_minimising_methods_have_no_false_finding() {
    for name in ASSIGNMENTS {
        assert_no_false_finding(name, 2);
    }
}

#[test]
#[ignore = "long: half a minute"]
fn long_all_mistakes_in_minimising_methods_have_no_false_finding() {
    for name in ASSIGNMENTS {
        assert_no_false_finding(name, usize::MAX);
    }
}
