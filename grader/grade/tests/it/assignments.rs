//! Correct programs of exactly one assignment earn all its points; a mistake costs points only where it shows.
//!
//! The programs are students of the self-test, reduced by a script to what the assignment asks for.

use needs::needs;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use serde_json::Value;
use test_support::{root, sample, write};

use crate::folder::{self, Run, command, run};

/// Compiles a source to a program.
fn compile(source: &Path, program: &Path) {
    let mut compiler = Command::new("c++");
    compiler.args(["-O2", "-o"]).arg(program).arg(source);
    let output = compiler.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A submission that reads these integrators and refuses these forces. Like the course's starter code, it passes over
/// constant forces.
fn student(folder: &Path, integrators: &[&str], refused: &[&str], mistake: &str) {
    static COMPILED: LazyLock<()> = LazyLock::new(|| {
        let source = root().join("grader/selftest/src/programs/student.cpp");
        compile(&source, &Path::new(env!("CARGO_TARGET_TMPDIR")).join("student"))
    });
    LazyLock::force(&COMPILED);
    fs::create_dir_all(folder).unwrap();
    fs::copy(Path::new(env!("CARGO_TARGET_TMPDIR")).join("student"), folder.join("student"))
        .unwrap();
    let script = format!(
        "#!/bin/sh\n\
         awk '/<integrator .*type=.({})[^a-z-]/ {{ known = 1 }}\n\
         /<({})/ {{ refused = 1 }}\n\
         !/<constantforce/ {{ print }}\n\
         END {{ exit !known || refused }}' \"$1\" > reduced.xml || {{ echo 'not known' >&2; exit 1; }}\n\
         exec \"$3\" -s reduced.xml -d 0 -o \"$2\" -e 'MISTAKE={mistake}'\n",
        integrators.join("|"),
        refused.join("|"),
    );
    script_at(&folder.join("reduced"), &script);
    let run = r#"["./reduced", "{scene}", "{trace}", "{folder}/student"]"#;
    write(&folder.join("submission.toml"), &format!("run = {run}\nformat = \"fosssim\"\n"));
}

fn script_at(path: &Path, text: &str) {
    write(path, text);
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

fn grade(submission: &Path, arguments: &[&str]) -> (Option<i32>, Value) {
    let graded = graded(submission, &[arguments, &["--format", "json"]].concat());
    let report = serde_json::from_str(&graded.stdout);
    (Some(graded.code), report.unwrap_or_else(|_| panic!("{}", graded.stderr)))
}

/// Grades a submission with the shipped scenes.
fn graded(submission: &Path, arguments: &[&str]) -> Run {
    run(command(root(), arguments).arg(submission))
}

/// Points earned and points of a section.
fn points(report: &Value, section: &str) -> (f64, f64) {
    let totals = &report[section];
    (totals["points_earned"].as_f64().unwrap(), totals["points"].as_f64().unwrap())
}

/// The groups of a section with a feature that does not have all its points.
fn lost(report: &Value, section: &str) -> BTreeSet<String> {
    let features = report["features"].as_array().unwrap().iter();
    let lost = features.filter(|feature| {
        feature["section"] == section && feature["points_earned"] != feature["points"]
    });
    lost.map(|feature| feature["group"].as_str().unwrap().to_owned()).collect()
}

const METHODS: [&str; 4] =
    ["explicit-euler", "symplectic-euler", "linearized-implicit-euler", "implicit-euler"];
const WRONG_JACOBIAN: &str = "damping: dF/dx has the wrong sign";
const PAIRS: [&str; 3] = ["springforce", "gravitationalforce", "dragdamping"];

#[needs("command -v c++")]
#[test]
fn a_correct_program_of_a_sampled_milestone_earns_all_its_points() {
    assert_all_points(1);
}

#[needs("command -v c++")]
#[test]
#[ignore = "long: ten seconds"]
fn long_a_correct_program_of_each_milestone_earns_all_its_points() {
    assert_all_points(usize::MAX);
}

/// Grades a correct program of so many milestones.
fn assert_all_points(count: usize) {
    let folder = tempfile::tempdir().unwrap();
    let first: Vec<&str> = PAIRS.into_iter().chain(["vortexforce"]).collect();
    let milestones = [
        ("t1m1", &METHODS[..1], &first[..], false),
        ("t1m2", &METHODS[..2], &["vortexforce"], false),
        ("t1m3", &METHODS[..3], &["vortexforce"], false),
        // The vortex comes with the starter code.
        ("t1m3", &METHODS[..], &["nothing"], true),
    ];
    for (name, integrators, refused, extra) in sample(milestones, count) {
        let submission = folder.path().join(format!("{name}-{}", integrators.len()));
        student(&submission, integrators, refused, "");
        let (code, report) = grade(&submission, &["--assignment", name]);
        assert_eq!(code, Some(0), "{name}");
        assert_eq!(report["assignment"], name);
        let (earned, all) = points(&report, "required");
        assert_eq!(earned, all, "{name}");
        let (earned, all) = points(&report, "extra_credit");
        assert_eq!(earned == all, extra || all == 0.0, "{name}: {earned} of {all}");

        // A mistake does not hide what a program offers.
        student(&submission, integrators, refused, WRONG_JACOBIAN);
        let (code, report) = grade(&submission, &["--no-jacobians"]);
        assert_eq!((code, &report["fitting_assignment"]), (Some(1), &Value::from(name)));
    }
}

#[needs("command -v c++")]
#[test]
fn a_wrong_jacobian_costs_points_only_where_it_shows() {
    let folder = tempfile::tempdir().unwrap();
    let submission = folder.path().join("submission");
    student(&submission, &METHODS, &["nothing"], WRONG_JACOBIAN);
    // The case of a name is ignored.
    let (code, report) = grade(&submission, &["--assignment", "T1M3", "--no-jacobians"]);
    assert_eq!(code, Some(1));
    let damped: BTreeSet<String> =
        ["Combined", "FixedParticles", "SpringDamping"].map(str::to_owned).into();
    assert_eq!(lost(&report, "required"), damped);
    assert!(lost(&report, "extra-credit").is_subset(&damped));
    let findings = report["findings"].as_array().unwrap();
    let printed: Vec<&str> = findings.iter().map(|f| f["message"].as_str().unwrap()).collect();
    assert_eq!(printed, ["dF/dx of springforce's damping has the wrong sign"]);
    assert_eq!(findings[0]["kind"], "cause");

    let output = explain("shearing-triangle-linearized", &submission);
    let printed = &output.stdout;
    assert_eq!(output.code, 1, "{printed}");
    // The remainder of the first step, and what the mistake makes of it.
    let rest = printed.split_once("sum, 0 up to rounding").expect("an equation").1;
    let numbers = rest.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
    let sizes: Vec<f64> = numbers.take(4).map(f64::abs).collect();
    assert!(sizes[0].min(sizes[1]) > 1e-3 && sizes[2].max(sizes[3]) < 1e-14, "{printed}");
    let output = explain("Spring", &submission);
    assert_eq!(output.code, 2);
    assert!(output.stderr.contains("name one, such as Spring/"));
}

fn explain(scene: &str, submission: &Path) -> Run {
    graded(submission, &["explain", scene, "--assignment", "t1m3"])
}

/// Writes a skeleton in Python.
fn init(assignment: &str, submission: &Path) {
    let made = graded(submission, &["init", "python", "--assignment", assignment]);
    assert_eq!(made.code, 0, "{}", made.stderr);
}

/// Missing features of a skeleton are not failures. Its report fits a screen, and names the first task.
#[needs("test -x /usr/bin/python3")]
#[test]
fn unfilled_skeleton_gets_its_first_task() {
    let folder = tempfile::tempdir().unwrap();
    let submission = folder.path().join("skeleton");
    init("t1m2", &submission);
    let Run { code, stdout: printed, .. } = graded(&submission, &[]);
    assert_eq!(code, 1, "{printed}");
    assert!(printed.lines().count() <= 40, "{printed}");
    assert!(printed.contains("\nFindings\n  Not implemented: "), "{printed}");
    assert!(printed.contains("Implemented: free motion"), "{printed}");
    let next = "\nNext\n  when your program has free motion under symplectic-euler:\n    grade ";
    assert!(printed.contains(next), "{printed}");
}

#[needs("command -v c++")]
#[test]
fn two_programs_of_the_fast_mass_spring_assignment_write_positions_alone() {
    let folder = tempfile::tempdir().unwrap();
    let source = root().join("grader/grade/tests/it/programs/fast_mass_springs.cpp");
    let program = folder.path().join("springs");
    compile(&source, &program);
    for (refuses, extra) in [("1", 0.0), ("0", 4.0)] {
        let submission = folder.path().join(refuses);
        fs::create_dir(&submission).unwrap();
        fs::copy(&program, submission.join("springs")).unwrap();
        // The dense program is not called for large scenes.
        for (name, largest) in [("springs_dense", "20"), ("springs_sparse", "1000")] {
            let call = format!("\"$(dirname \"$0\")/springs\" \"$1\" \"$2\" {largest} {refuses}");
            script_at(&submission.join(name), &format!("#!/bin/sh\nexec {call}\n"));
        }
        let manifest = "run = [\"./springs_{solver}\", \"{scene}\", \"{trace}\"]\n\
                        assignment = \"fast-mass-spring\"\n";
        write(&submission.join("submission.toml"), manifest);
        let (code, report) = grade(&submission, &[]);
        assert_eq!(code, Some(0));
        assert_eq!(points(&report, "required"), (10.0, 10.0));
        assert_eq!(points(&report, "extra_credit"), (extra, 4.0));
    }
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn lecture_code_passes_its_assignment() {
    let interpreter = "/usr/bin/python3";
    let folder = tempfile::tempdir().unwrap();
    let source = root().join("grader/grade/tests/it/programs/elastodynamics.py");
    fs::copy(source, folder.path().join("elastodynamics.py")).unwrap();
    let manifest = format!(
        "run = [\"{interpreter}\", \"{{folder}}/elastodynamics.py\", \"{{scene}}\", \"{{trace}}\"]\n\
         assignment = \"elastodynamics\"\n"
    );
    write(&folder.path().join("submission.toml"), &manifest);
    let (code, report) = grade(folder.path(), &["--no-jacobians"]);
    assert_eq!((code, points(&report, "required")), (Some(0), (5.0, 5.0)));
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn a_class_refuses_a_submission_of_another_assignment() {
    let folder = tempfile::tempdir().unwrap();
    let class = folder.path().join("class");
    for (name, assignment) in [("ada", "t1m2"), ("bob", "t1m1")] {
        init(assignment, &class.join(name));
    }
    let out = folder.path().join("out").display().to_string();
    let options = ["class", "--assignment", "t1m1", "--no-jacobians", "-o", &out];
    let graded = graded(&class, &options);
    assert_eq!(graded.code, 3, "{}", graded.stderr);
    let csv = fs::read_to_string(folder.path().join("out/summary.csv")).unwrap();
    let verdicts: Vec<&str> =
        csv.lines().skip(1).filter_map(|line| line.split(',').nth(1)).collect();
    assert_eq!(verdicts, ["bad-hand-in", "not-implemented"], "{csv}");
    let report = fs::read_to_string(folder.path().join("out/reports/ada.txt")).unwrap();
    assert!(report.contains("submission.toml names the assignment \"t1m2\""), "{report}");
}

/// Copies the oracle's traces of these groups to a folder.
fn traces(folder: &Path, groups: &[&str]) {
    for group in groups {
        let target = folder.join(group);
        fs::create_dir_all(&target).unwrap();
        for entry in fs::read_dir(root().join("expected").join(group)).unwrap() {
            let path = entry.unwrap().path();
            fs::copy(&path, target.join(path.file_name().unwrap())).unwrap();
        }
    }
}

#[test]
fn failed_scenes_can_be_regraded_and_runs_cut_short() {
    let folder = tempfile::tempdir().unwrap();
    let submission = folder.path().join("traces");
    traces(&submission, &["Inertia", "SimpleGravity"]);
    let grade = |arguments: &[&str]| {
        let mut command = command(root(), &["--assignment", "t1m1"]);
        command.arg(&submission).args(arguments).env("XDG_CACHE_HOME", folder.path());
        let Run { code, stdout, stderr } = run(&mut command);
        (code, stdout, stderr)
    };
    let (code, text, notes) = grade(&["--last-failed", "--durations", "2"]);
    assert_eq!(code, 1, "{text}");
    assert!(notes.contains("no failed scene is known"), "{notes}");
    assert_eq!(notes.matches(" s  ").count(), 2, "{notes}");
    let (code, text, notes) = grade(&["--last-failed"]);
    assert!(notes.contains("2 of 6 scenes are graded"), "{notes}");
    assert!(code == 1 && text.contains(" 0/2 "), "{text}");
    let (code, text, notes) = grade(&["--fail-fast", "1"]);
    assert!(code == 1 && text.contains("no score"), "{text}");
    assert!(text.contains("Ended by --fail-fast: "), "{text}");
    assert!(notes.contains("ended by --fail-fast"), "{notes}");
    assert!(notes.contains("did not pass\n  help: `grade explain FixedParticles/"), "{notes}");
    // Commands go on with all that decides what is graded, and with nothing else.
    let options = ["--limit", "wall=9", "--criteria", "course", "--threads", "1"];
    let (_, text, _) = grade(&[&options[..], &["--verbose"]].concat());
    let next = folder::words(&text.replace("\\\n", ""));
    let kept = "traces --limit wall=9 --assignment t1m1 --criteria course --";
    assert!(next.contains(kept), "{next}");
    traces(&submission, &["FixedParticles"]);
    assert_eq!(grade(&["--last-failed"]).0, 0);
    let (_, _, notes) = grade(&["--last-failed"]);
    assert!(notes.contains("no failed scene is known"), "{notes}");
}

#[test]
fn non_submission_gets_one_message() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("empty/notes.txt"), "nothing");
    for (submission, reason) in [
        (root().join("README.md"), "--pack grades sources"),
        (root().join("assets/SpringDamping/shearing-triangle-linearized.xml"), "`simulate /"),
        (root().join("expected/SpringDamping/shearing-triangle-linearized.csv"), "name the folder"),
        (folder.path().join("empty"), "no submission.toml in this folder, and no trace"),
    ] {
        let Run { code, stdout, stderr: message } = graded(&submission, &[]);
        assert_eq!((code, stdout.as_str()), (2, ""));
        assert!(message.contains(reason) && message.lines().count() == 2, "{message}");
    }
}

#[needs("command -v c++")]
#[test]
fn unmeasurable_required_jacobians_fail() {
    let folder = tempfile::tempdir().unwrap();
    let measure = |name: &str, arguments: &[&str]| {
        let run = graded(&folder.path().join(name), &[&["jacobians"], arguments].concat());
        (run.code, run.stdout)
    };
    let submission = folder.path().join("explicit");
    student(&submission, &METHODS[..1], &["dragdamping", "vortexforce"], "");
    let (code, text) = measure("explicit", &["--force", "springforce"]);
    assert!(code == 0, "{text}");
    let (code, text) = measure("explicit", &["--require", "springforce,dragdamping"]);
    assert!(code == 1 && text.contains("not offered: springforce, dragdamping."), "{text}");
    let (code, text) = measure("explicit", &["--force", "dragdamping"]);
    assert!(code == 1 && text.contains("Nothing could be measured."), "{text}");
    student(&folder.path().join("whole"), &METHODS, &["vortexforce"], "");
    let (code, text) = measure("whole", &["--assignment", "t1m3"]);
    assert!(code == 0, "{text}");
}

#[test]
fn an_unknown_assignment_is_an_error_that_names_the_others() {
    let Run { code, stderr: message, .. } = folder::grade(root(), &["--assignment", "t1m4"]);
    assert_eq!(code, 2);
    let known = "all, elastodynamics, fast-mass-spring, higher-order, t1m1, t1m2, t1m3, t4m1";
    assert!(message.contains("no assignment \"t1m4\"") && message.contains(known), "{message}");
}
