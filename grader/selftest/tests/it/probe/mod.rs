//! Tests of the black-box probe on foreign programs.
//!
//! Three simulators in other languages (`src/programs/`) are built with and without mistakes. The probe must call each
//! mistake wrong at its place and nowhere else, and no correct build wrong, for any compiler flags, precision,
//! order of summation or solver. The results are the table `docs/probe.md`, which
//! `UPDATE_DOCS=1 cargo test --release -p selftest probe -- --include-ignored` rewrites.

mod mistakes;
mod programs;

use needs::needs;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use test_support::{assert_document, root, sample};

use grader::probe::{PartReport, Probing, Verdict, probe};
use grader::submission::program::{Identified, Program, Runner};
use grader::verdict::Failure;
use sandbox::{Limits, Sandbox};

use mistakes::{C, CPP, MISTAKES, Mistake, PYTHON};
use programs::{Build, Variant, scripts};

const INTRODUCTION: &str = "\
# Mistakes that single steps show

`grade jacobians PROGRAM` knows nothing of a program but its traces. Each row of the first table is a mistake
that was planted in one of three small simulators (`grader/selftest/src/programs`: C++, C and Python, each with its own
way to write forces and to solve), and what was called wrong: the force, the step, or a block of the Jacobian, of
which part of the force, in the plane or in space. Nothing else was. The error is the largest of those, relative
to the largest entry of its block. The last column is what the report says that the mistake looks like.

The list below it holds correct builds, none of which was called wrong. Where the noise of a build is too large
to tell, the report says inconclusive.

The mistakes in Jacobians of [mistakes.md](mistakes.md) in the plane are all called wrong as well, in their force alone, but for
those of damping in proportion to mass, of which the value alone is judged
(`grader/selftest/tests/it/mistakes/probing.rs`).

This file is written by `UPDATE_DOCS=1 cargo test --release -p selftest probe -- --include-ignored`; without the
variable, the tests fail where it is not up to date.
";

/// A correct build: its name in the table, its build, its settings, and whether all its findings must be correct.
type Correct = (&'static str, Build, &'static [(&'static str, &'static str)], bool);

const CORRECT: [Correct; 19] = [
    ("C++ -O2", CPP, &[], true),
    ("C++ -O0", Build::Cpp(&["-O0"]), &[], true),
    ("C++ -O3 -march=native -ffp-contract=fast", FMA, &[], true),
    ("C++ -Ofast -march=native", FAST, &[], true),
    ("C++ long double", Build::Cpp(&["-O2", "-DREAL=long double"]), &[], true),
    ("C++ single precision", SINGLE, &[], false),
    ("C++ forces summed backwards", CPP, &[("ORDER", "reversed")], true),
    ("C++ LU without pivots", CPP, &[("SOLVER", "nopivot")], true),
    ("C++ conjugate gradients to 1e-12", CPP, &[("SOLVER", "krylov")], false),
    ("C++ conjugate gradients to 1e-8", CPP, &[("SOLVER", "krylov"), ("TOLERANCE", "1e-8")], false),
    ("C++ conjugate gradients to 1e-5", CPP, &[("SOLVER", "krylov"), ("TOLERANCE", "1e-5")], false),
    ("C++ conjugate gradients to 1e-3", CPP, &[("SOLVER", "krylov"), ("TOLERANCE", "1e-3")], false),
    ("C++ Gauss-Seidel to 1e-12", CPP, &[("SOLVER", "gauss-seidel")], false),
    ("C++ Gauss-Seidel to 1e-5", CPP, &[("SOLVER", "gauss-seidel"), ("TOLERANCE", "1e-5")], false),
    ("C++ Gauss-Seidel to 1e-3", CPP, &[("SOLVER", "gauss-seidel"), ("TOLERANCE", "1e-3")], false),
    (
        "C++ single precision, conjugate gradients to 1e-6",
        SINGLE,
        &[("SOLVER", "krylov"), ("TOLERANCE", "1e-6")],
        false,
    ),
    ("C unreduced, symplectic instead of explicit", C, &[], true),
    ("C -Ofast", Build::C(&["-Ofast"]), &[], true),
    ("Python, CSV, in three dimensions as well", PYTHON, &[], true),
];

const FMA: Build = Build::Cpp(&["-O3", "-march=native", "-ffp-contract=fast"]);
const FAST: Build = Build::Cpp(&["-Ofast", "-march=native"]);
const SINGLE: Build = Build::Cpp(&["-O2", "-DREAL=float"]);

fn runner(wall: f64) -> Runner {
    let limits = Limits { wall, ..Limits::default() };
    Runner::new(Sandbox::Unprotected, limits, Vec::new())
}

fn identify(path: &Path) -> Program {
    match Program::identify(path, runner(60.0)).unwrap() {
        Identified::Program(program) => program,
        Identified::Unusable { name, failure } => panic!("{name:?}: {failure}"),
    }
}

/// The failure of an unusable program.
fn refused(path: &Path, wall: f64) -> Failure {
    match Program::identify(path, runner(wall)).unwrap() {
        Identified::Program(program) => panic!("{} is of use", program.name().line()),
        Identified::Unusable { failure, .. } => failure,
    }
}

/// All wrong findings: `part: finding, finding; part: …`, each once.
fn wrong(probing: &Probing) -> String {
    let mut parts: Vec<(&str, Vec<&str>)> = Vec::new();
    for part in &probing.parts {
        for (name, finding) in part.findings() {
            if finding.verdict != Verdict::Wrong {
                continue;
            }
            match parts.iter_mut().find(|(known, _)| *known == part.part) {
                Some((_, names)) if names.contains(&name) => {}
                Some((_, names)) => names.push(name),
                None => parts.push((part.part, vec![name])),
            }
        }
    }
    let parts: Vec<String> =
        parts.iter().map(|(part, names)| format!("{part}: {}", names.join(", "))).collect();
    parts.join("; ")
}

fn largest_error(probing: &Probing) -> Option<f64> {
    let findings = probing.parts.iter().flat_map(PartReport::findings);
    let wrong = findings.filter(|(_, finding)| finding.verdict == Verdict::Wrong);
    wrong.filter_map(|(_, finding)| finding.error).reduce(f64::max)
}

fn row(mistake: &Mistake, probing: &Probing) -> String {
    let found = wrong(probing);
    let found = if found.is_empty() { "nothing: it changes no step" } else { &found };
    let error = largest_error(probing).map_or(String::new(), |error| format!("{error:.0e}"));
    let mut diagnosis: Vec<&str> = Vec::new();
    for line in probing.parts.iter().flat_map(|part| &part.diagnosis) {
        if !diagnosis.contains(&line.as_str()) {
            diagnosis.push(line);
        }
    }
    let language = mistake.build.language();
    format!("| {language} | {} | {found} | {error} | {} |", mistake.name, diagnosis.join("; "))
}

/// A few programs; the tables of the document contain its rows.
#[needs("command -v c++ && command -v python3")]
#[test]
fn sampled_probed_mistakes_are_located_and_correct_programs_pass() {
    let document = std::fs::read_to_string(root().join("docs/probe.md")).unwrap();
    for line in judge(&sample(MISTAKES, 2), &sample(&CORRECT, 1)).lines() {
        assert!(document.contains(line), "docs/probe.md has no line {line:?}");
    }
}

#[test]
#[ignore = "long: a minute"]
fn long_all_probed_mistakes_are_located_and_correct_programs_pass() {
    let text = judge(&MISTAKES.iter().collect::<Vec<_>>(), &CORRECT.iter().collect::<Vec<_>>());
    assert_document(
        "probe.md",
        &text,
        "cargo test --release -p selftest probe -- --include-ignored",
    );
}

/// Probes programs, and asserts what is called wrong. Returns the document.
fn judge(mistakes: &[&Mistake], correct: &[&Correct]) -> String {
    let planted = mistakes.iter().map(|mistake| Variant {
        build: mistake.build,
        environment: vec![("MISTAKE", mistake.name)],
    });
    let right = correct.iter().map(|(_, build, environment, _)| Variant {
        build: *build,
        environment: environment.to_vec(),
    });
    let variants: Vec<Variant> = planted.chain(right).collect();
    let programs = scripts(&format!("mistakes-{}", mistakes.len()), &variants);
    let (planted, right) = programs.split_at(mistakes.len());
    let mut text = INTRODUCTION.to_owned();
    let mut missed = Vec::new();

    let caught = MISTAKES.iter().filter(|mistake| !mistake.wrong.is_empty()).count();
    assert!(caught >= 30, "{caught}");
    let _ = writeln!(text, "\n## Mistakes\n\n{caught} that change a step.\n");
    text += "| program | mistake | called wrong | error | likely mistake |\n| --- | --- | --- | ---: | --- |\n";
    for (mistake, path) in mistakes.iter().zip(planted) {
        let probing = probe(&identify(path), |force, _| force == mistake.force);
        let found = wrong(&probing);
        if found != mistake.wrong {
            missed.push(format!(
                "{}: {found:?} is called wrong, not {:?}",
                mistake.name, mistake.wrong
            ));
        }
        let _ = writeln!(text, "{}", row(mistake, &probing));
    }

    let _ = writeln!(text, "\n## Correct builds\n\nNone is called wrong.\n");
    for ((name, _, _, throughout), path) in correct.iter().zip(right) {
        let probing = probe(&identify(path), |_, _| true);
        let count = |verdict: Verdict| {
            let findings = probing.parts.iter().flat_map(PartReport::findings);
            findings.filter(|(_, finding)| finding.verdict == verdict).count()
        };
        let unsure = count(Verdict::Inconclusive);
        // Every program has at least one correct force.
        if count(Verdict::Wrong) > 0 || count(Verdict::Correct) < 6 || (*throughout && unsure > 0) {
            missed.push(format!("{name}: {:?}, {unsure} inconclusive", wrong(&probing)));
        }
        let may = if *throughout { "all that it offers is correct" } else { "may be inconclusive" };
        let _ = writeln!(text, "- {name}: {may}");
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
    text
}

#[needs("command -v python3")]
#[test]
fn missing_forces_are_not_offered_rather_than_wrong() {
    let mut variants = [C, PYTHON].map(|build| Variant { build, environment: Vec::new() });
    variants[0].environment.push(("NAMES", "one"));
    let programs = scripts("offers", &variants);
    let verdicts = |probing: &Probing| -> BTreeMap<&'static str, Verdict> {
        let parts = probing.parts.iter();
        parts.map(|part| (part.force, part.force_finding.verdict)).collect()
    };
    let in_c = identify(&programs[0]);
    let probing = probe(&in_c, |force, _| ["vortexforce", "dragdamping"].contains(&force));
    assert_eq!(probing.spaces[0].explicit, Ok("forward-backward-euler"));
    assert!(probing.spaces[1].explicit.is_err(), "it has no third dimension");
    assert_eq!(verdicts(&probing)["vortexforce"], Verdict::NotOffered);
    assert_eq!(verdicts(&probing)["dragdamping"], Verdict::Correct);
    let reason = &probing.parts.last().expect("a part").force_finding.reason;
    assert!(reason.contains("unknown element"), "{reason}");

    let probing = probe(&identify(&programs[1]), |force, _| force == "constantforce");
    assert!(probing.spaces.iter().all(|space| space.implicit.is_ok()));
    assert_eq!(verdicts(&probing)["constantforce"], Verdict::NotOffered);
    let reason = &probing.parts[0].force_finding.reason;
    assert!(reason.contains("no effect"), "{reason}");
}

/// A shell script as a program.
fn script(name: &str, body: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scripts");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}

#[test]
fn unusable_programs_are_refused_by_kind() {
    let text = script("text", "");
    std::fs::write(&text, "not a program").unwrap();
    let failure = refused(&text, 60.0);
    assert_eq!(failure.name(), "crashed");
    assert!(failure.to_string().contains("cannot be started"), "{failure}");

    let silent = refused(&script("silent", "echo 'what scene?' >&2; exit 3"), 60.0);
    assert_eq!(silent.name(), "crashed");
    assert!(silent.to_string().contains("exit status 3; it printed:\nwhat scene?"), "{silent}");

    let idle = refused(&script("idle", "exit 0"), 60.0);
    assert_eq!(idle.name(), "no-output");
    assert!(idle.to_string().contains("ended with exit status 0, but wrote no trace"), "{idle}");

    let body = "echo nonsense > trace.csv; echo nonsense > trace.bin";
    let garbage = refused(&script("garbage", body), 60.0);
    assert_eq!(garbage.name(), "malformed");
    assert!(garbage.to_string().contains("of the record's 32 bytes"), "{garbage}");
}

#[test]
fn hanging_program_is_killed_with_its_children() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let alive = folder.join("alive");
    let body = format!("(sleep 1; touch '{}') & sleep 600", alive.display());
    let _ = std::fs::remove_file(&alive);
    let endless = script("endless", &body);
    let refused = refused(&endless, 0.1);
    assert_eq!(refused.name(), "timed-out");
    assert!(refused.to_string().contains("still ran after 0.1 s"), "{refused}");
    std::thread::sleep(std::time::Duration::from_secs(2));
    assert!(!alive.exists(), "a process that it started lived on");
}
