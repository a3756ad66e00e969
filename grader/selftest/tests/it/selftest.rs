//! Drawn programs, and the self-test's documents. `ci/selftest.sh` runs the planted mistakes and the correct variants.

use test_support::{root, sample, seed, suite};

use diagnosis::findings::Thresholds;
use grader::boundary::seal::Secret;
use grader::grading::altered;
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::StateSource;
use grader::suite::{Case, Suite};
use grader::verdict::Verdict;
use selftest::drawn::{self, Inputs, Plan};
use selftest::report;
use selftest::{in_process, mistake};

/// The scenes that the second simulator supports, with their oracle and rubric.
fn inputs() -> (Suite, Oracle, Rubric) {
    let mut suite = suite();
    in_process::known(&mut suite);
    let oracle = Oracle::open(&root().join("expected")).expect("there is an oracle");
    let rubric_path = root().join("assets/rubric.toml");
    let rubric = Rubric::load(&rubric_path).expect("there is a rubric");
    (suite, oracle, rubric)
}

/// Findings on drawn programs: some are unfinished, some have several mistakes.
#[test]
fn drawn_programs_are_judged_correctly() {
    let (suite, oracle, rubric) = inputs();
    let inputs = Inputs { suite: &suite, oracle: &oracle, rubric: &rubric };
    let plan = Plan { first: 0, count: 6, seed: seed() };
    let results = drawn::run(inputs, plan, &Thresholds::default());
    let rates = report::drawn::rates(&results);
    let of = |name: &str| rates.iter().find(|rate| rate.name.starts_with(name)).expect("a rate");
    let details = report::drawn::details(&results);
    assert!(of("mistakes caught").is_met(), "{details}");
    // Of 200 programs, one may have a false finding, and of 30, one may not be named first: `ci/selftest.sh` draws enough
    // programs to see that.
    assert!(of("programs with a false").rate.right <= 1, "{details}");
    let named = of("one mistake: named").rate;
    assert!(named.right + 1 >= named.all, "{details}");
}

/// A simulator with mistakes loses no scene that it passes.
fn assert_no_copies(count: usize) {
    let (suite, oracle, rubric) = inputs();
    let mistakes = mistake::possible(&suite, mistake::all());
    let mut wrongly = Vec::new();
    for (number, first) in sample(mistakes.iter().enumerate(), count) {
        for second in [first, &mistakes[(number + 121) % mistakes.len()]] {
            let student = first.and(second);
            let grading = in_process::of_two(&suite, &oracle, &rubric, [first, second]);
            let run = |case: &Case| -> Result<Box<dyn StateSource>, Verdict> {
                Ok(Box::new(student.simulate(&case.scene)))
            };
            let passed = grading.passed_cases(&suite, rubric.other_root());
            let copied = altered::look_for_copies(&suite, &passed, Secret(seed()), &run);
            if let Some(copied) = copied.filter(|copied| !copied.withdrawn.is_empty()) {
                let words = (first.description, second.description);
                wrongly.push(format!("{} {words:?}: {copied:?}", first.subject));
            }
        }
    }
    assert!(wrongly.is_empty(), "{}", wrongly.join("\n"));
}

#[test]
fn sampled_mistakes_are_not_taken_for_copies() {
    assert_no_copies(2);
}

#[test]
#[ignore = "long: a minute"]
fn long_mistakes_are_not_taken_for_copies() {
    assert_no_copies(usize::MAX);
}
