//! `grade jacobians PROGRAM`: exit codes and content of each format.

use std::path::Path;
use test_support::assert_fits;

use grader::probe::{BuiltIn, probe};
use scene::ParseOptions;
use serde_json::Value;

use crate::folder::{self, Run};
use crate::student;

fn grade(arguments: &[&str]) -> Run {
    // The probed submissions are scripts that start a program in the same folder.
    let probing = ["jacobians", "--readable", env!("CARGO_TARGET_TMPDIR")];
    folder::grade(Path::new("."), &[&probing, arguments].concat())
}

#[test]
fn the_report_of_the_built_in_simulator() {
    let mut bytes = Vec::new();
    let config = report::probe::text::ProbeTextOptions { details: false };
    report::probe::text::write(&mut bytes, &probe(&BuiltIn, |_, _| true), config).unwrap();
    insta::assert_snapshot!(anstream::adapter::strip_str(std::str::from_utf8(&bytes).unwrap()));
}

#[test]
fn every_format_reports_a_mistake_and_json_its_scenes() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("probe");
    let programs =
        ["block (j, i) transposed", ""].map(|mistake| student::compile(&folder, mistake));
    let [wrong, right] = programs.map(|path| path.to_str().expect("a path in UTF-8").to_owned());

    let run = grade(&[&right, "--force", "springforce"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("All that is offered is correct. 12 correct, 0 wrong"));

    let run = grade(&[&wrong, "--force", "springforce"]);
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("dF/dx cross: wrong"), "{}", run.stdout);

    let run = grade(&[&wrong, "--force", "springforce", "--format", "junit"]);
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("tests=\"12\" failures=\"1\""));

    let run = grade(&[&wrong, "--force", "springforce", "--format", "json"]);
    assert_eq!(run.code, 1);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_fits("probe.schema.json", &report);
    let damping = report["parts"].as_array().unwrap().iter().find(|part| part["part"] == "damping");
    let replay = &damping.unwrap()["replay"];
    for name in ["explicit_scene", "implicit_scene"] {
        let text = replay[name].as_str().unwrap();
        let options = ParseOptions::default();
        let parsed = scene::parse_bytes(
            text.as_bytes(),
            Path::new("replay.xml"),
            &simulator::vocabulary(),
            &options,
        );
        assert_eq!(parsed.unwrap().scene.particles.len(), 3 * 14);
    }
}

#[test]
fn unprobeable_program_is_a_usage_error() {
    for (arguments, message) in [
        (&["no/such/program"][..], "no/such/program: file or folder not found"),
        (&["program", "--states", "5"], "--states"),
        (&["program", "--limit", "wall=0"], "wall must be above 0"),
        (&["program", "--limit", "walls=1"], "unknown limit walls"),
    ] {
        let run = grade(arguments);
        assert_eq!(run.code, 2, "{arguments:?}");
        assert!(run.stderr.contains(message), "{}", run.stderr);
    }
}
