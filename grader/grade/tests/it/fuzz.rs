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

#[test]
fn an_interrupted_run_prints_what_it_has() {
    let [wrong, _] = programs("fuzz-interrupted", "no h v ahead");
    let plan = ["--seed", "1", "--failures", "100000", "--minutes", "60"];
    let fuzz = ["fuzz", &wrong, "--readable", env!("CARGO_TARGET_TMPDIR")];
    let mut command = folder::command(Path::new("."), &[&fuzz[..], &plan].concat());
    let child = command.stdout(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(4));
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
    let run = fuzz(&["--seed", "1", "--minutes", "0"]);
    assert_eq!(
        folder::words(&run.stdout).matches(" 0 scenes in 0.0 s").count(),
        12,
        "{}",
        run.stdout
    );
}

#[test]
fn bad_options_name_the_remedy() {
    for minutes in ["-1", "nan", "1e6", "two"] {
        let run = fuzz(&["--minutes", minutes]);
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains("write minutes, such as --minutes 0.5"), "{}", run.stderr);
    }
    let run = fuzz(&["--assignment", "t1m1", "--force", "vortexforce"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("`grade assignments` lists what each asks for"), "{}", run.stderr);
}
