//! Tests that siblings of scenes are as good as their originals, judged from a written folder as hidden scenes are.

use fuzzing::sibling::Files;
use grader::compare::Comparison;
use grader::grading;
use grader::oracle::{Oracle, Origin, folder};
use grader::rubric::Rubric;
use grader::suite::assignment::Assignment;
use grader::suite::{Case, Section, Suite};
use grader::verdict::{Failure, Verdict};
use rayon::prelude::*;
use scene::ParseOptions;
use selftest::mistake::{self, Mistake};
use selftest::sibling::{Sibling, find};
use selftest::student::Student;
use test_support::{root, sample, seed, suite};

/// The scenes to which an assignment gives points.
fn scenes_of(assignment: &str) -> Vec<Case> {
    let assignment = Assignment::load(&root().join("assets/assignments"), assignment).unwrap();
    let has_points =
        |case: &Case| assignment.section(case).is_some_and(|section| section != Section::Unscored);
    suite().cases.into_iter().filter(has_points).collect()
}

/// The siblings of scenes that catch what these catch of the mistakes, written as a folder of hidden scenes and read again.
fn written(cases: &[Case], mistakes: &[Mistake]) -> (Suite, Oracle, tempfile::TempDir) {
    let seed = seed();
    let find = |case: &Case| find(case, seed, mistakes).unwrap_or_else(|none| panic!("{none}"));
    let siblings: Vec<Sibling> = cases.par_iter().map(find).collect();
    let scenes = cases.iter().zip(&siblings);
    let scenes: Vec<(Section, &Files)> =
        scenes.map(|(case, sibling)| (case.feature.section, &sibling.files)).collect();
    let parent = tempfile::tempdir().unwrap();
    let hidden = parent.path().join("hidden");
    folder::write(&hidden, &scenes, &Origin::default()).unwrap();
    let sections = folder::SECTIONS.map(|(section, name)| (section, hidden.join(name)));
    let suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
    (suite, Oracle::open(&hidden.join(folder::EXPECTED)).unwrap(), parent)
}

fn judge(case: &Case, oracle: &Oracle, student: &Student) -> Comparison {
    let criteria = Rubric::default().criteria(case, oracle.calibrated(case));
    assert_eq!(criteria.name(), "calibrated");
    grading::judge(case, oracle, criteria, || Ok(Box::new(student.simulate(&case.scene)))).0
}

fn clearly_fails(comparison: &Comparison) -> bool {
    match comparison.verdict {
        Verdict::Fail(Failure::Differs) => comparison.allowed.is_some_and(|a| a.used > 10.0),
        ref verdict => !verdict.is_pass(),
    }
}

/// Asserts that the siblings of two milestones catch `count` mistakes where their originals do.
fn assert_catch(count: usize, at_least: [usize; 2]) {
    let shipped = Oracle::open(&root().join("expected")).unwrap();
    let mistakes = sample(mistake::all(), count);
    for (assignment, at_least) in ["t1m2", "t1m3"].into_iter().zip(at_least) {
        let cases = scenes_of(assignment);
        let (siblings, oracle, _folder) = written(&cases, &mistakes);
        let ids =
            |cases: &[Case]| -> Vec<String> { cases.iter().map(|case| case.id.clone()).collect() };
        assert_eq!(ids(&siblings.cases), ids(&cases));
        let pairs: Vec<(&Case, &Case)> = cases.iter().zip(&siblings.cases).collect();
        let count = |(original, sibling): &(&Case, &Case)| {
            assert_eq!(judge(sibling, &oracle, &Student::faultless()).verdict, Verdict::Pass);
            let caught = mistakes.iter().filter(|mistake| {
                mistake.can_matter_on(&original.scene)
                    && clearly_fails(&judge(original, &shipped, &mistake.student()))
            });
            let caught = caught.inspect(|mistake| {
                let found = judge(sibling, &oracle, &mistake.student());
                assert!(clearly_fails(&found), "{}: {}", sibling.id, mistake.description);
            });
            caught.count()
        };
        let caught: usize = pairs.par_iter().map(count).sum();
        assert!(caught >= at_least, "{assignment}: {caught} verdicts");
    }
}

#[test]
fn siblings_of_milestones_2_and_3_catch_sampled_mistakes_of_their_originals() {
    assert_catch(20, [1, 1]);
}

#[test]
#[ignore = "long: half a minute"]
fn long_siblings_of_milestones_2_and_3_catch_the_mistakes_of_their_originals() {
    assert_catch(usize::MAX, [500, 1000]);
}

#[test]
fn a_sibling_depends_on_the_seed_and_on_its_own_scene_alone() {
    let mistakes = mistake::all();
    let cases = suite().cases;
    let case = |name: &str| cases.iter().find(|case| case.id == name).unwrap();
    for name in ["Spring/shearing-pair-symplectic", "FastMassSpring/Dense/two-triangles"] {
        let files = |seed| find(case(name), seed, &mistakes).unwrap().files;
        assert_eq!(files(3), files(3));
        assert_ne!(files(3), files(4));
    }
}

#[test]
fn a_scene_without_a_sibling_is_named_with_the_reason() {
    let cases = suite().cases;
    let mut broken =
        cases.iter().find(|case| case.id == "Spring/shearing-pair-symplectic").unwrap().clone();
    broken.scene.particles[1].position = broken.scene.particles[0].position;
    let none = find(&broken, 1, &[]).unwrap_err();
    let message = none.to_string();
    assert!(message.starts_with("Spring/shearing-pair-symplectic: no sibling"), "{message}");
    assert!(message.contains("particles"), "{message}");
}
