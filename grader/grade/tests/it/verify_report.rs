//! Provenance of reports, and `grade verify-report`.

use std::fs;

use serde_json::Value;
use test_support::assert_fits;

use crate::class::{Project, RIGHT};
use crate::folder::Run;

/// Grades `class/ada` into `report.json`.
fn project() -> Project {
    let project = Project::with_hidden();
    project.program("class/ada", RIGHT);
    let run =
        project.grade(&[&["class/ada", "--report", "json=report.json"], &OPTIONS[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    project
}

/// The options that [`project`] grades with.
const OPTIONS: [&str; 8] = [
    "--hidden",
    "hidden",
    "--limit",
    "cpu=5",
    "--no-jacobians",
    "--criteria",
    "course",
    "--no-progress",
];

/// Verifies this report with the options that it was made with.
fn verify(project: &Project, report: &str, submission: &str) -> Run {
    project.grade(&[&["verify-report", report, submission], &OPTIONS[..]].concat())
}

#[test]
fn report_names_its_inputs() {
    let project = project();
    let report: Value = serde_json::from_str(&project.read("report.json")).unwrap();
    assert_fits("report.schema.json", &report);
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
fn report_verification_names_changed_inputs() {
    let project = project();
    let run = verify(&project, "report.json", "class/ada");
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.starts_with("Graded again: class/ada\n  files: "), "{}", run.stdout);
    for text in [
        ", as in the report\n  protection: files ",
        "\n  scenes: 3 of 3\nclass/ada: the same verdicts and points come out, from the same inputs\n",
    ] {
        assert!(run.stdout.contains(text), "{text}: {}", run.stdout);
    }

    // Other inputs, the same results.
    project.write("assets/rubric.toml", "[default]\npoints = 1\n");
    project.program("class/ada", &format!("{RIGHT}# more\n"));
    let run = verify(&project, "report.json", "class/ada");
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    for line in ["  rubric: none, now ", "  submission: ", "come out, from changed inputs\n"] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }

    // Other results.
    let wrong = RIGHT.replace("END {", "END { if (x == 150) x += 1;");
    project.program("elsewhere/ada", &wrong);
    let run = verify(&project, "report.json", "elsewhere/ada");
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
    let run = verify(&project, "report.json", "class/ada");
    assert_eq!(run.code, 1, "{}", run.stderr);
    for line in
        ["  scene Free/far: ", "  oracle of Free/far: ", "  Free/far: pass, now grader-fault\n"]
    {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
}

#[test]
fn no_count_of_a_report_can_be_edited() {
    let project = project();
    let report: Value = serde_json::from_str(&project.read("report.json")).unwrap();
    let edits: [(&str, &str, Value); 4] = [
        ("/required/points_not_judged", "required: ", 1.into()),
        ("/repetition/scenes", "repetition: ", 7.into()),
        ("/copied", "copied: ", serde_json::json!({"passed": 3})),
        ("/hidden", "hidden: ", serde_json::json!("none")),
    ];
    for (pointer, shown, value) in edits {
        let mut edited = report.clone();
        let place = edited.pointer_mut(pointer).unwrap();
        assert_ne!(*place, value, "{pointer}");
        *place = value;
        project.write("edited.json", &edited.to_string());
        let run = verify(&project, "edited.json", "class/ada");
        assert!(run.code == 1 && run.stdout.contains(shown), "{pointer}: {}", run.stdout);
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
        let run = project.grade(&["verify-report", file, "ada"]);
        assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
    }
}

#[test]
fn report_contents_cannot_run_code_or_control_a_terminal() {
    let project = project();
    project.write("private.txt", "a secret of the teacher");
    let [private, leaked] = ["private.txt", "leaked"].map(|name| project.path(name));
    let [private, leaked] = [private, leaked].map(|path| path.display().to_string());
    let spying =
        format!("grep -q secret {private} 2>/dev/null && {{ touch {leaked}; exit 7; }}\nawk");
    project.program("class/eve", &RIGHT.replacen("awk", &spying, 1));
    let escape = "\u{1b}[2J\u{1b}]0;x\u{7}\u{202e}\n";
    let mut report: Value = serde_json::from_str(&project.read("report.json")).unwrap();
    report["submission"] = format!("bob{escape}").into();
    report["grader_version"] = escape.into();
    report["outcome"] = "passed".into();
    let provenance = &mut report["provenance"];
    provenance["submission"]["path"] = "class/ada".into();
    provenance["scenes"][format!("Free/{escape}")] =
        serde_json::json!({"scene": escape, "trace": null});
    let options = &mut provenance["options"];
    options["unprotected"] = true.into();
    options["readable"] = serde_json::json!([private, escape]);
    options["limits"] = serde_json::json!([["wall", 1e9]]);
    options["criteria"] = "calibrated".into();
    project.write("eve.json", &report.to_string());
    let run = verify(&project, "eve.json", "class/eve");
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(!project.path("leaked").exists());
    for text in [
        "Graded again: class/eve\n",
        ", not those of the report\n",
        "  --unprotected: yes, now no\n",
        &format!("  --readable: {private} \u{fffd}[2J\u{fffd}]0;x"),
        "  --limit: wall=1000000000, now cpu=5\n",
        "  --criteria: calibrated, now course\n",
        "class/eve: the same verdicts and points come out, from changed inputs\n",
    ] {
        assert!(run.stdout.contains(text), "{text}: {}", run.stdout);
    }
    let steers = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
    assert!(!(run.stdout + &run.stderr).contains(steers));
    // The program would use the rights of the report.
    let rights = ["verify-report", "eve.json", "class/eve", "--readable", &private];
    let run = project.grade(&[&rights[..], &OPTIONS].concat());
    assert!(run.code == 1 && run.stdout.contains("now crashed"), "{}{}", run.stdout, run.stderr);
    // A report does not say what is graded.
    let run = project.grade(&["verify-report", "eve.json"]);
    assert!(run.code == 2 && run.stderr.contains("<SUBMISSION>"), "{}", run.stderr);
}

#[test]
fn a_report_is_bounded_and_cannot_contradict_itself() {
    let project = project();
    let report: Value = serde_json::from_str(&project.read("report.json")).unwrap();
    let mut twice = report.clone();
    let first = twice["features"][0]["scenes"][0].clone();
    twice["features"][0]["scenes"].as_array_mut().unwrap().push(first);
    project.write("twice.json", &twice.to_string());
    let mut more = report;
    more["provenance"]["options"]["\u{1b}[2Jrun"] = "sh".into();
    project.write("more.json", &more.to_string());
    project.write("deep.json", &"[".repeat(1 << 20));
    fs::File::create(project.path("large.json")).unwrap().set_len((16 << 20) + 1).unwrap();
    std::os::unix::fs::symlink("report.json", project.path("link.json")).unwrap();
    for (file, message) in [
        ("twice.json", "twice.json:1: two results of Free/"),
        ("more.json", "unknown field `\u{fffd}[2Jrun`"),
        ("deep.json", "deep.json:1: not a JSON report"),
        ("large.json", "large.json: is larger than 16 MiB"),
        ("link.json", "link.json: is a link, not a regular file"),
    ] {
        let run = verify(&project, file, "class/ada");
        assert!(run.code == 2 && run.stderr.contains(message), "{file}: {}", run.stderr);
    }
}

#[test]
fn points_that_only_the_report_says_are_named() {
    let project = project();
    let mut report: Value = serde_json::from_str(&project.read("report.json")).unwrap();
    let line = |run: &Run| run.stdout.contains("  adjustments: 50 points, which only");
    assert!(!line(&verify(&project, "report.json", "class/ada")));
    report["adjustments"] = serde_json::json!([{"points": 50, "reason": "granted"}]);
    project.write("granted.json", &report.to_string());
    let run = verify(&project, "granted.json", "class/ada");
    assert!(line(&run), "{}{}", run.stdout, run.stderr);
}

#[test]
fn the_report_of_a_class_is_verified_too() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    let run = project.class(&["--format", "json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let report = ["verify-report", "out/reports/ada.json", "class/ada", "--no-jacobians"];
    let run = project.grade(&report);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
}
