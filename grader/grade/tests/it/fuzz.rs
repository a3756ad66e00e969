//! `grade fuzz PROGRAM`: a mistake is found, shrunk and repeated by its seed; options; the schema.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use test_support::assert_fits;

use crate::folder::{self, Run};
use crate::student;

fn fuzz(arguments: &[&str]) -> Run {
    // The submissions are scripts that start a program in the same folder.
    let fuzz = ["fuzz", "--readable", env!("CARGO_TARGET_TMPDIR")];
    folder::grade(Path::new("."), &[&fuzz, arguments].concat())
}

fn programs(name: &str, mistake: &str) -> [String; 2] {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    [mistake, ""].map(|mistake| student::compile(&folder, mistake).to_str().unwrap().to_owned())
}

#[test]
fn a_mistake_is_found_shrunk_and_kept_and_a_right_program_passes() {
    let [wrong, right] = programs("fuzz", "2 for 3 in gravitation");
    let drawn = ["--seed", "1", "--assignment", "t1m3", "--scenes"];

    let run = fuzz(&[&[&*right], &drawn[..], &["64"]].concat());
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(folder::words(&run.stdout).contains(" 0 wrong"), "{}", run.stdout);

    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz/kept");
    let options = ["--keep", kept.to_str().unwrap(), "--format", "json"];
    let found = || fuzz(&[&[&*wrong], &drawn[..], &["256"], &options].concat());
    let run = found();
    assert_eq!(run.code, 1, "{}", run.stderr);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_fits("fuzzing.schema.json", &report);
    let discovery = &report["runs"][0]["discoveries"][0];
    assert_eq!(discovery["particles"], 2, "{discovery}");
    assert_eq!([&discovery["forces"], &discovery["steps"]], [1, 1], "{discovery}");
    // The kept scene is that of the report.
    let scene = fs::read_to_string(kept.join("1.xml")).unwrap();
    assert!(scene.ends_with(discovery["scene"].as_str().unwrap()), "{scene}");
    // The seed repeats all.
    assert_eq!(found().stdout, run.stdout);
}

/// The call of a right program in its folder `$1`, by a script with the names of a scene and a trace.
const CALL: &str = r#""$1/student" -s "$scene" -d 0 -o "$trace""#;

/// A submission that is run by one script, with `$scene` and `$trace`, and serves by another one; `$1` is its folder.
fn serving(name: &str, run: &str, serve: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    student::compile(&folder, "");
    let command = |script: &str| format!(r#""sh", "{{folder}}/{script}.sh", "{{folder}}""#);
    let manifest = format!(
        "run = [{}, \"{{scene}}\", \"{{trace}}\"]\nserve = [{}]\nformat = \"fosssim\"\n",
        command("run"),
        command("serve"),
    );
    fs::write(folder.join("submission.toml"), manifest).unwrap();
    fs::write(folder.join("run.sh"), format!("scene=$2\ntrace=$3\n{run}\n")).unwrap();
    fs::write(folder.join("serve.sh"), serve).unwrap();
    folder.to_str().unwrap().to_owned()
}

/// A script that does this for each scene that it serves.
fn each(body: &str) -> String {
    format!("while read -r scene trace; do {body}; done")
}

/// The report of so many scenes, and how `grade fuzz` ends.
fn served(submission: &str, scenes: &str) -> (Value, i32) {
    let options = ["--assignment", "t1m3", "--seed", "1", "--scenes", scenes, "--format", "json"];
    let run = fuzz(&[&[submission, "--limit", "wall=1"], &options[..]].concat());
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_fits("fuzzing.schema.json", &report);
    (report["runs"][0].clone(), run.code)
}

/// The counts are those of plain starts, whatever a served run does.
#[test]
fn failures_of_served_runs_are_confirmed_by_plain_starts() {
    let scripts = [
        ("right", each(CALL)),
        ("wrong", each(&format!("MISTAKE='no h v ahead' {CALL}"))),
        // It ends at every third scene, with a trace that is cut.
        ("crash", each(&format!("n=$((n + 1)); [ $n = 3 ] && echo 1 > $trace && exit 1; {CALL}"))),
        ("silent", "exit 0".to_owned()),
        ("hang", each("sleep 60")),
    ];
    let mut counts = Vec::new();
    for (name, script) in scripts {
        let (report, code) = served(&serving(&format!("fuzz-served-{name}"), CALL, &script), "96");
        assert_eq!(code, 0, "{name}: {report}");
        let of = |key: &str| report[key].as_u64().unwrap();
        assert_eq!(of("right_served"), 0, "{name}");
        counts.push([of("right"), of("wrong"), of("refused"), of("undecided")]);
        let (served, alone) = (of("served"), of("right_alone"));
        match name {
            "right" => assert_eq!([served, alone], [of("right"), 0], "{name}"),
            "wrong" => assert!(alone > 10, "{name}: {served}, {alone}"),
            "crash" => assert!(served > 15, "{name}: {served}, {alone}"),
            _ => assert_eq!([served, alone], [0, 0], "{name}"),
        }
    }
    assert!(counts.iter().all(|found| *found == counts[0]), "{counts:?}");
}

/// On a busy machine, a right program may take long without taking processor time.
#[test]
fn a_program_that_waits_is_not_called_wrong() {
    let submission = serving("fuzz-waiting", &format!("sleep 1.5; {CALL}"), "exit 0");
    let plan = ["--assignment", "t1m3", "--seed", "1", "--scenes", "2", "--format", "json"];
    let run = fuzz(&[&[&*submission, "--limit", "cpu=1"], &plan[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stdout);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(report["runs"][0]["right"].as_u64() > Some(0), "{report}");
}

/// A program that is right when it serves, and fails by itself, is wrong.
#[test]
fn what_a_program_serves_is_confirmed_by_a_sample_of_plain_starts() {
    let failing = format!("{CALL} && exit 3");
    let submission = serving("fuzz-served-otherwise", &failing, &each(CALL));
    let (report, code) = served(&submission, "512");
    assert_eq!(code, 1, "{report}");
    assert!(report["right_served"].as_u64() > Some(0), "{report}");
    // From then on, each scene is run by itself: the sample holds fewer.
    assert!(report["wrong"].as_u64() > Some(20), "{report}");
}

/// A status other than 0 is a failure by itself, and is not hidden by the traces of a served run.
#[test]
fn the_last_scene_of_a_served_run_that_fails_is_run_by_itself() {
    // It fails under one integrator once it has written the trace.
    let failing = format!("{CALL}; grep -q symplectic-euler \"$scene\" && exit 3");
    let run = format!("{failing}; exit 0");
    let outcomes =
        [("exit", each(&failing)), ("exit-alone", "exit 0".to_owned())].map(|(name, serve)| {
            let (report, code) =
                served(&serving(&format!("fuzz-served-{name}"), &run, &serve), "96");
            assert_eq!(code, 1, "{name}: {report}");
            let of = |key: &str| report[key].as_u64().unwrap();
            assert_eq!(of("right_served"), 0, "{name}: {report}");
            (["right", "wrong", "refused", "undecided"].map(of), of("served"))
        });
    assert!(outcomes[0].1 > 0 && outcomes[1].1 == 0, "{outcomes:?}");
    assert_eq!(outcomes[0].0, outcomes[1].0);
}

/// All failures of one proven cause are one entry, whatever their terms; other causes have theirs.
#[test]
fn a_proven_cause_has_one_entry() {
    let masses =
        r#"sed -zE "s/\sm\s*=\s*[\"'][^\"']*[\"']/ m='1'/g" "$scene" > light.xml; scene=light.xml"#;
    let mistaken = format!("{masses}; MISTAKE='drag without its Jacobian' {CALL}");
    let (report, code) = served(&serving("fuzz-masses", &mistaken, &each(&mistaken)), "384");
    assert_eq!(code, 1, "{report}");
    let discoveries = report["discoveries"].as_array().unwrap().iter();
    let proven = discoveries.filter(|discovery| discovery["proven"] == true);
    let causes: Vec<&str> = proven.map(|discovery| discovery["words"].as_str().unwrap()).collect();
    assert_eq!(causes, ["every mass is taken as 1", "dF/dv of dragdamping is missing"]);
}

#[test]
fn an_interrupted_run_prints_what_it_has() {
    let started = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz-started");
    let _ = fs::remove_file(&started);
    let wrong = format!("touch '{}'; MISTAKE='no h v ahead' {CALL}", started.display());
    let submission = serving("fuzz-interrupted", &wrong, &each(&wrong));
    let plan = ["--unprotected", "--seed", "1", "--failures", "100000", "--minutes", "60"];
    let mut command =
        folder::command(Path::new("."), &[&["fuzz", &*submission], &plan[..]].concat());
    let child = command.stdout(Stdio::piped()).spawn().unwrap();
    while !started.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(folder::words(&text).contains(" scenes in "), "{text}");
}

#[test]
fn paths_of_the_built_in_simulator_agree_and_share_the_time() {
    let run = fuzz(&["--seed", "1", "--scenes", "32"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert_eq!(folder::words(&run.stdout).matches(" 0 wrong").count(), 12, "{}", run.stdout);
    let run = fuzz(&["--seed", "1", "--minutes", "1e-9"]);
    assert_eq!(
        folder::words(&run.stdout).matches(" 0 scenes in 0.0 s").count(),
        12,
        "{}",
        run.stdout
    );
}

#[test]
fn bad_options_name_the_remedy() {
    for minutes in ["-1", "0", "nan", "1e6", "two"] {
        let run = fuzz(&["--minutes", minutes]);
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains("write minutes, such as --minutes 0.5"), "{}", run.stderr);
    }
    let run = fuzz(&["--assignment", "t1m1", "--force", "vortexforce"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("`grade assignments` lists what each asks for"), "{}", run.stderr);
}
