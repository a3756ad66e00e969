//! Provenance of reports, and `grade verify-report`.

use std::fs;

use serde_json::Value;
use test_support::{root, schema};

use crate::class::{Project, RIGHT};

/// Grades `class/ada` into `report.json`.
fn project() -> Project {
    let project = Project::with_hidden();
    project.program("class/ada", RIGHT);
    let run = project.grade(&[
        "class/ada",
        "--hidden",
        "hidden",
        "--limit",
        "cpu=5",
        "--no-jacobians",
        "--criteria",
        "course",
        "--report",
        "json=report.json",
        "--no-progress",
    ]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    project
}

const VERIFY: [&str; 5] = ["verify-report", "report.json", "--hidden", "hidden", "--no-progress"];

#[test]
fn a_report_names_what_it_was_made_from() {
    let project = project();
    let report: Value = serde_json::from_str(&project.read("report.json")).unwrap();
    let schema = fs::read_to_string(root().join("docs/report.schema.json")).unwrap();
    schema::validate(&serde_json::from_str(&schema).unwrap(), &report).unwrap();
    let provenance = &report["provenance"];
    assert_eq!(provenance["submission"]["path"], "class/ada");
    assert_eq!(provenance["options"]["criteria"], "course");
    assert_eq!(provenance["options"]["limits"], serde_json::json!([["cpu", 5.0]]));
    assert_eq!(provenance["rubric"], Value::Null);
    let manifest: toml::Table = project.read("expected/manifest.toml").parse().unwrap();
    let traces = manifest["trace"].as_array().unwrap();
    assert_eq!(traces.len(), provenance["scenes"].as_object().unwrap().len());
    for trace in traces {
        let text = |name: &str| trace[name].as_str().unwrap();
        let hashes = &provenance["scenes"][text("scene")];
        assert_eq!(hashes["scene"], text("scene_sha256"));
        assert_eq!(hashes["trace"], text("trace_sha256"));
        assert_eq!(trace.get("platform"), Some(&provenance["platform"].as_str().unwrap().into()));
    }
    // Hidden scenes are one hash.
    assert_eq!(provenance["hidden"].as_str().unwrap().len(), 64);
}

#[test]
fn a_report_is_verified_and_names_what_changed() {
    let project = project();
    let run = project.grade(&VERIFY);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(
        run.stdout,
        "class/ada: the same verdicts and points come out, from the same inputs\n"
    );

    // Other inputs, the same results.
    project.write("assets/rubric.toml", "[default]\npoints = 1\n");
    project.program("class/ada", &format!("{RIGHT}# more\n"));
    let run = project.grade(&VERIFY);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    for line in ["  rubric: none, now ", "  submission: ", "come out, from changed inputs\n"] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }

    // Other results.
    let wrong = RIGHT.replace("END {", "END { if (x == 150) x += 1;");
    project.program("elsewhere/ada", &wrong);
    let run = project.grade(&[&VERIFY[..], &["elsewhere/ada"]].concat());
    assert_eq!(run.code, 1, "{}", run.stderr);
    for line in [
        "  Free/far: pass, now differs\n",
        "  points of Free / explicit-euler: 1 of 1, now 0.6666666666666666 of 1\n",
        "  outcome: passed, now failed\n",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }

    // A scene and its trace.
    let scene = project.read("assets/Free/far.xml").replace("150", "151");
    project.write("assets/Free/far.xml", &scene);
    let run = project.grade(&VERIFY);
    assert_eq!(run.code, 1, "{}", run.stderr);
    for line in
        ["  scene Free/far: ", "  oracle of Free/far: ", "  Free/far: pass, now grader-fault\n"]
    {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
}

#[test]
fn a_file_that_is_no_report_is_bad_input() {
    let project = Project::new();
    project.write("report.json", "{\"schema_version\": 1}");
    project.write("notes.txt", "no report");
    for (file, message) in [
        ("report.json", "report.json:1: a report with schema version 1"),
        ("notes.txt", "notes.txt:1: not a JSON report"),
        ("nowhere.json", "nowhere.json: "),
    ] {
        let run = project.grade(&["verify-report", file]);
        assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
    }
    project.program("ada", RIGHT);
    project.grade(&["ada", "--no-jacobians", "--report", "json=gone.json", "--no-progress"]);
    fs::remove_file(project.path("ada")).unwrap();
    let run = project.grade(&["verify-report", "gone.json"]);
    let message = "ada: the submission of the report is not there";
    assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
}

#[test]
fn the_report_of_a_class_is_verified_too() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    let run = project.class(&["--format", "json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let run = project.grade(&["verify-report", "out/reports/ada.json"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
}
