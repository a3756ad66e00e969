//! `grade stability`: agreement with theory, stored outcomes, and error reports.

use std::fs;
use test_support::{root, sample};

use crate::folder::{self, Run};
use simulator::vocabulary;
use studies::stability::theory::amplification::amplifications;
use studies::stability::theory::boundary::{boundaries, boundary};
use studies::stability::theory::measured::Linear;
use studies::stability::trial::{self, Task};
use studies::stability::{Expectations, Outcome, cases};

fn grade(arguments: &[&str]) -> Run {
    folder::grade(root(), &[&["stability"], arguments].concat())
}

#[test]
fn boundaries_are_within_one_percent_of_theory() {
    let all = boundaries(true);
    for boundary in &all {
        assert!(boundary.agrees(), "{boundary:?}");
    }
    // The remaining difference is the bisection's resolution, one part in 10⁶.
    let worst = all.iter().map(|boundary| boundary.error()).fold(0.0, f64::max);
    assert!(worst <= 2e-6, "{worst:e}");
    let finite = all.iter().filter(|boundary| boundary.confirmed.is_some()).count();
    assert!(finite >= 10, "{finite} boundaries");
}

#[test]
fn implicit_methods_have_no_boundary_and_fast_mass_spring_has_one_where_drag_is_explicit() {
    let find = |name: &str, zeta: f64| {
        boundary(&Linear::oscillator(zeta), vocabulary().integrator(name).unwrap()).measured
    };
    for name in ["linearized-implicit-euler", "implicit-euler", "projected-newton"] {
        assert_eq!(find(name, 3.0), f64::INFINITY, "{name}");
    }
    assert_eq!(find("fast-mass-spring", 0.5), f64::INFINITY);
    // 2 (ζ − √(ζ² − 1)) = 2 (3 − √8)
    let band = 2.0 * (3.0 - 8.0_f64.sqrt());
    assert!((find("fast-mass-spring", 3.0) / band - 1.0).abs() < 2e-6);
    assert_eq!(find("explicit-euler", 0.0), 0.0);
}

#[test]
fn step_amplification_matches_the_method_matrix() {
    let all = amplifications();
    assert!(all.len() > 60, "{}", all.len());
    for each in &all {
        assert!((each.measured - each.theory).abs() < each.rounding, "{each:?}");
    }
    // Implicit Euler slows and damps the oscillation, explicit Euler amplifies it.
    let at = |method: &str, a: f64| {
        all.iter().find(|each| each.method == method && each.a == a && each.zeta == 0.0).unwrap()
    };
    let [implicit, explicit] = ["implicit-euler", "explicit-euler"].map(|name| at(name, 0.1));
    assert!(implicit.damping.unwrap() > 0.0 && implicit.period.unwrap() > 0.0);
    assert!(explicit.damping.unwrap() < 0.0);
    // |λ|² = 1/(1 + a²) and 1 + a²
    assert!((implicit.measured.powi(2) * 1.01 - 1.0).abs() < 1e-12);
    assert!((explicit.measured.powi(2) / 1.01 - 1.0).abs() < 1e-12);
}

#[test]
fn blow_up_is_reported_with_its_step() {
    let case = cases::all().find(|case| case.name == "stiffness-1").unwrap();
    let run = |name: &str, time_step: f64| {
        let integrator = vocabulary().integrator(name).unwrap();
        trial::run(Task { case, integrator, time_step, steps: 400, robust: false }).unwrap()
    };
    // (1 + a²)ⁿ passes 11 at n = ln 11/ln(1 + a²) = 3.46 for a = 1.
    assert_eq!(run("explicit-euler", 1.0).outcome, Outcome::BlowUp { step: 4 });
    assert_eq!(run("symplectic-euler", 1.0).outcome, Outcome::Survived);
    assert!(matches!(run("symplectic-euler", 2.1).outcome, Outcome::BlowUp { .. }));
    assert_eq!(run("implicit-euler", 2.1).outcome, Outcome::Survived);
}

#[test]
fn fallbacks_rescue_failing_cases() {
    for (name, time_step) in [("cold-start", 1.0), ("onto-its-end", 0.5)] {
        let case = cases::all().find(|case| case.name == name).unwrap();
        let method =
            if name == "cold-start" { "implicit-euler" } else { "linearized-implicit-euler" };
        let run = |robust: bool| {
            let integrator = vocabulary().integrator(method).unwrap();
            trial::run(Task { case, integrator, time_step, steps: 20, robust }).unwrap()
        };
        assert!(matches!(run(false).outcome, Outcome::Failed { .. }), "{name}");
        let saved = run(true);
        assert_eq!(saved.outcome, Outcome::Survived, "{name}");
        assert!(saved.measured.rescue.steps() > 0, "{name}");
    }
}

#[test]
fn a_changed_outcome_fails_until_it_is_accepted() {
    let stored = fs::read_to_string(root().join("docs/stability-expected.csv")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("expected.csv");
    let row = "coincident,explicit-euler,1e-2,20,no,coincident,1,0";
    assert!(stored.contains(row));
    fs::write(&path, stored.replace(row, "coincident,explicit-euler,1e-2,20,no,survived,,0"))
        .unwrap();
    let path = path.to_str().unwrap();
    let output = grade(&["--quick", "--only", "coincident", "--expected", path]);
    assert_eq!(output.code, 1);
    let printed = "expected survived, got coincident in step 1";
    assert!(output.stdout.contains(printed), "{}", output.stdout);

    // Accepting restores the row and leaves all others unchanged.
    let output = grade(&["--quick", "--only", "coincident", "--expected", path, "--accept"]);
    assert_eq!(output.code, 0);
    assert_eq!(fs::read_to_string(path).unwrap(), stored);
}

#[test]
fn unknown_case_gets_suggestions() {
    let output = grade(&["--quick", "--only", "coincidnet"]);
    assert_eq!(output.code, 2);
    let message = "error: nothing matches \"coincidnet\"\n  help: did you mean coincident";
    assert!(output.stderr.starts_with(message), "{}", output.stderr);
}

#[test]
fn malformed_outcomes_file_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("expected.csv");
    let text_of =
        "case,method,dt,steps,robust,outcome,step,newton_iterations\na,b,1,x,no,survived,,0\n";
    fs::write(&path, text_of).unwrap();
    assert!(Expectations::load(&path).is_err());
    let output = grade(&["--quick", "--expected", path.to_str().unwrap()]);
    assert_eq!(output.code, 2);
    assert!(output.stderr.contains("expected.csv:2: steps is no count"));
    // Accepting neither repairs nor overwrites it.
    let output = grade(&["--quick", "--accept", "--expected", path.to_str().unwrap()]);
    assert_eq!(output.code, 2);
    assert_eq!(fs::read_to_string(&path).unwrap(), text_of);
}

#[test]
fn sampled_outcomes_match_the_stored_ones_and_runs_resume() {
    let names = sample(cases::all().map(|case| case.name), 6);
    assert_outcomes(&names.iter().flat_map(|name| ["--only", name]).collect::<Vec<_>>());
}

#[test]
#[ignore = "long: a quarter of a minute"]
fn long_all_outcomes_match_the_stored_ones_and_runs_resume() {
    assert_outcomes(&[]);
}

fn assert_outcomes(cases: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().to_str().unwrap();
    let options = ["--quick", "--robust", "--resume", kept, "--format", "csv"];
    let run = || grade(&[&options, cases].concat());
    let (first, names) = (run(), || {
        let mut names: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    });
    assert_eq!(first.code, 0, "{}", first.stdout);
    let kept_files = names();
    // All cases, including those that no scene file can express.
    assert_eq!(kept_files.len(), first.stdout.lines().count() - 1);
    // Times are loaded too: nothing was run again.
    assert_eq!(first.stdout, run().stdout);
    // A partially written trial runs again.
    let broken = folder.path().join(&kept_files[0]);
    fs::write(&broken, "{\"outcome\":").unwrap();
    let again = run();
    let untimed = |output: &Run| -> Vec<String> {
        let rows = output.stdout.lines();
        rows.map(|row| row.rsplit_once(',').unwrap().0.to_owned()).collect()
    };
    assert_eq!(untimed(&first), untimed(&again));
    assert_eq!(names(), kept_files);
    assert!(fs::read_to_string(broken).unwrap().len() > 50);
}

#[test]
fn shipped_outcomes_belong_to_cases_and_contain_no_failure() {
    let stored = fs::read_to_string(root().join("docs/stability-expected.csv")).unwrap();
    let names: Vec<&str> = cases::all().map(|case| case.name).collect();
    for row in stored.lines().skip(1) {
        let case = row.split(',').next().unwrap();
        assert!(names.contains(&case), "{row}");
        assert!(!row.contains("WRONG"), "{row}");
    }
    for name in names {
        assert!(stored.contains(&format!("\n{name},")), "{name}");
    }
}
