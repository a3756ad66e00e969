//! Drawn scenes find planted mistakes, and no mistake in the correct student.

use std::time::Duration;

use fuzzing::campaign::{Campaign, Plan, run};
use fuzzing::draw::Scope;
use fuzzing::judge::{Judge, Subject};
use fuzzing::report::text;
use fuzzing::shrink::Effort;
use grader::submission::StateSource;
use grader::verdict::{Failure, Lack, Verdict};
use scene::{Dimension, Scene};
use selftest::mistake::{self, Mistake};
use selftest::student::{self, Student};
use test_support::{sample, seed};

/// A student who refuses scenes that it does not know.
struct Refusing(Student);

impl Subject for Refusing {
    fn start(&self, scene: &Scene, _text: &str) -> Result<Box<dyn StateSource>, Verdict> {
        if !student::knows(scene) {
            let words = "a force or a method".to_owned();
            return Err(Verdict::Fail(Failure::NotImplemented(Lack::LeftOut { words })));
        }
        Ok(Box::new(self.0.simulate(scene)))
    }
}

/// Runs a student on scenes of a dimension, up to its first failure.
fn campaign(student: Student, dimension: Dimension, seed: u64, scenes: u64) -> Campaign {
    let scope = Scope { dimensions: vec![dimension], ..Scope::all() };
    let effort = Effort { runs: 0, time: Duration::ZERO };
    let plan = Plan { scope, seed, time: Duration::MAX, scenes, failures: 1, effort };
    run(&Refusing(student), &Judge::default(), &plan, &|| false, &|_| {})
}

/// Scenes of a student that two cores judge in ten seconds.
const MOST: u64 = 6000;

/// The scenes and the time until a mistake is found.
fn found(mistake: &Mistake, seed: u64) -> Option<(u64, Duration)> {
    // In three dimensions the student knows fast mass-spring alone.
    let is_of_rounds = mistake.subject.starts_with("fast mass-spring");
    let dimension = if is_of_rounds { Dimension::Three } else { Dimension::Two };
    campaign(mistake.student(), dimension, seed, MOST).tally.first
}

#[test]
fn the_correct_student_is_right_on_drawn_scenes() {
    let campaign = campaign(Student::faultless(), Dimension::Two, seed(), 1500);
    let mut report = Vec::new();
    text::write(&mut report, "the correct student", &campaign, 100).unwrap();
    assert_eq!(campaign.tally.wrong, 0, "{}", String::from_utf8_lossy(&report));
    assert!(campaign.tally.right > 600);
}

#[test]
fn drawn_scenes_find_sampled_mistakes() {
    let seed = seed();
    let sampled = sample(mistake::all(), 3);
    let is_missed = |mistake: &Mistake| found(mistake, seed).is_none();
    let missed: Vec<Mistake> = sampled.into_iter().filter(is_missed).collect();
    let names = missed.iter().map(|mistake| (&mistake.subject, &mistake.description));
    // A few of all show in rare scenes only: the long test counts them.
    assert!(missed.len() <= 1, "{:?}", names.collect::<Vec<_>>());
}

#[test]
#[ignore = "long: some seconds for each mistake"]
#[expect(clippy::print_stdout, reason = "the figures of the documents")]
fn long_drawn_scenes_find_the_mistakes() {
    let seed = seed();
    let all = mistake::all();
    let (mut scenes, mut times) = (Vec::new(), Vec::new());
    for mistake in &all {
        match found(mistake, seed) {
            Some((count, time)) => {
                scenes.push(count);
                times.push(time);
            }
            None => println!("not found: {}, {}", mistake.subject, mistake.description),
        }
    }
    scenes.sort_unstable();
    times.sort();
    let (middle, last) = (times.len() / 2, times.len() - 1);
    println!(
        "{} of {} found; median {} scenes, {:?}; most {} scenes, {:?}",
        times.len(),
        all.len(),
        scenes[middle],
        times[middle],
        scenes[last],
        times[last]
    );
    assert!(100 * times.len() >= 99 * all.len());
}
