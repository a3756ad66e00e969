//! `grade accuracy` as a user runs it.

use crate::folder::{self, Run};
use crate::student;
use std::fs;
use std::path::Path;
use test_support::assert_fits;

fn grade(folder: &Path, arguments: &[&str]) -> Run {
    folder::grade(folder, &[&["accuracy"], arguments].concat())
}

/// The reproducible columns of a CSV report.
fn without_times(csv: &str) -> Vec<String> {
    let rows = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    rows.map(|row| row[..row.len() - 4].join(",")).collect()
}

#[test]
fn stored_measurements_are_reused_and_damaged_files_remeasured() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--quick", "--rungs", "5", "--scene", "ellipse", "--results", "kept", "--format", "csv"];
    let first = grade(folder.path(), &arguments);
    assert_eq!(first.code, 0, "{}", first.stderr);
    let again = grade(folder.path(), &arguments);
    // Times of a new measurement would differ in some digit.
    assert_eq!(first.stdout, again.stdout);
    let points = folder.path().join("kept/points/ellipse");
    let spoilt = points.join("explicit-euler.json");
    fs::write(&spoilt, "{").unwrap();
    let after = grade(folder.path(), &arguments);
    assert_eq!(without_times(&first.stdout), without_times(&after.stdout));
    assert!(fs::read_to_string(&spoilt).unwrap().contains("\"key\""));
    let mut names: Vec<String> = fs::read_dir(folder.path().join("kept"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["ellipse.svg", "points", "points.csv", "report.json", "report.txt"]);
}

#[test]
fn errors_and_counts_are_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--quick", "--rungs", "4", "--scene", "hanging-net", "--format", "csv"];
    let runs = [(); 2].map(|()| grade(folder.path(), &arguments).stdout);
    assert!(runs[0].lines().count() > 20, "{}", runs[0]);
    assert_eq!(without_times(&runs[0]), without_times(&runs[1]));
}

#[test]
fn blow_ups_are_reported_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--quick", "--rungs", "5", "--scene", "stiff-damped-spring", "--results", "kept"];
    let report = grade(folder.path(), &arguments).stdout;
    assert!(
        report.contains("explicit-euler at dt 0.125, 0.0625, 0.03125, 0.01562, 0.007812: blew up")
    );
    let svg = fs::read_to_string(folder.path().join("kept/stiff-damped-spring.svg")).unwrap();
    for words in ["0.007812", "blew up or", "explicit-euler", "(m)", "time of a run (s"] {
        assert!(svg.contains(words), "{words}");
    }
    let csv = fs::read_to_string(folder.path().join("kept/points.csv")).unwrap();
    assert!(csv.contains("blown-up") && !csv.contains("NaN") && !csv.contains("inf"));
}

#[test]
fn the_json_report_fits_its_documented_schema() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--quick", "--rungs", "5", "--scene", "stiff-damped-spring", "--format", "json"];
    let report = serde_json::from_str(&grade(folder.path(), &arguments).stdout).unwrap();
    assert_fits("accuracy.schema.json", &report);
}

#[test]
fn scenes_that_confirm_no_order_fail() {
    let folder = tempfile::tempdir().unwrap();
    let run = grade(folder.path(), &["--quick", "--rungs", "4"]);
    let report = run.stdout;
    assert_eq!(run.code, 1, "{report}");
    assert!(
        report.contains("no scene measured here confirms order 4 of runge-kutta-4"),
        "{report}"
    );
    // Chosen scenes need not confirm every method.
    let run = grade(folder.path(), &["--quick", "--rungs", "4", "--scene", "oscillator"]);
    assert_eq!(run.code, 0, "{}", run.stdout);
}

#[test]
fn unmeasurable_input_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("broken.xml"), "<scene>\n  <particle m=\"x\"/>\n</scene>")
        .unwrap();
    for (scene, words) in
        [("no-such-scene", "grade accuracy --list"), ("broken.xml", "broken.xml:2:")]
    {
        let run = grade(folder.path(), &["--quick", "--scene", scene]);
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains(words), "{}", run.stderr);
    }
    let still = r#"<scene><duration time="0"/><integrator type="explicit-euler" dt="1"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/></scene>"#;
    fs::write(folder.path().join("still.xml"), still).unwrap();
    let run = grade(folder.path(), &["--quick", "--scene", "still.xml"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("no steps"), "{}", run.stderr);
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_is_measured_from_its_traces() {
    let folder = tempfile::tempdir().unwrap();
    student::compile(folder.path(), "");
    let arguments =
        ["./student", "--quick", "--rungs", "6", "--scene", "kepler-orbit", "--format", "csv"];
    let run = grade(folder.path(), &arguments);
    let csv = run.stdout;
    assert_eq!(run.code, 0, "{csv}{}", run.stderr);
    let count = |method: &str, outcome: &str| {
        let theirs = format!(",submission,{method},");
        let outcome = format!(",{outcome},");
        csv.lines().filter(|line| line.contains(&theirs) && line.contains(&outcome)).count()
    };
    assert_eq!(count("symplectic-euler", "finished"), 6, "{csv}");
    // The program does not offer this method, which is reported once and is not an error.
    assert_eq!(count("explicit-euler", "failed"), 1, "{csv}");
}
