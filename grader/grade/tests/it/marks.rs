//! Marks of creative scenes: extra credit in tables, reports and gradebooks.

use serde_json::Value;

use crate::class::{Project, RIGHT};

const HEAD: &str =
    "scene,assignment,failed checks,ingredients,aesthetics,originality,judge,remarks\n";

/// A class of three, of 20 required points each, with the marks of one judge: all of ada's, one of bob's, none of cleo's.
fn project() -> Project {
    let project = Project::new();
    project.write("assets/rubric.toml", "[default]\npoints = 10\n");
    for name in ["ada", "bob", "cleo"] {
        // Equal submissions are graded once, and their marks are their own.
        project.program(&format!("class/{name}"), RIGHT);
    }
    let rows = "ada,t1m2,,8,10,6,Judge,\nbob,t1m2,,9,,,,\ncleo,t1m2,film,,,,,\n";
    project.write("marks.csv", &format!("{HEAD}{rows}"));
    project.write("roster.csv", "login\nada\nbob\ncleo\n");
    project
}

const MARKS: [&str; 4] = ["--marks", "marks.csv", "--no-progress", "--resume"];

#[test]
fn marks_are_capped_extra_credit_everywhere() {
    let project = project();
    let gradebook = ["--roster", "roster.csv", "--gradebook", "canvas=canvas.csv"];
    let run = project.class(&[&MARKS[..], &gradebook, &["--html", "pages"]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    for line in [
        "  submission  required  extra  creative  points  scenes  Jacobians  verdict\n",
        "  ada            20/20    0/0     2.4/3    22.4     3/3          -  passed\n",
        "  bob            20/20    0/0   no mark      20     3/3          -  passed\n",
        "  cleo           20/20    0/0   no mark      20     3/3          -  passed\n",
        "  marks.csv:3: incomplete, and does not count: no mark for aesthetics, originality\n",
        "  no mark: bob\n  no mark: cleo\n",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
    let csv = project.read("out/summary.csv");
    let row = |name: &str| csv.lines().find(|line| line.starts_with(name)).unwrap();
    assert!(row("name").ends_with(",jacobians,creative,creative_of"), "{csv}");
    for (name, points, creative) in [("ada,", "22.4", "2.4"), ("bob,", "20", "")] {
        let start = format!("{name}passed,20,20,0,0,{points},0,");
        assert!(row(name).starts_with(&start), "{csv}");
        assert!(row(name).ends_with(&format!(",{creative},3")), "{csv}");
    }
    let canvas = project.read("canvas.csv");
    assert!(canvas.contains("ada,,22.4\n") && canvas.contains("bob,,20\n"), "{canvas}");
    assert!(canvas.contains("Points Possible,,,,,20\n"), "extra credit is not possible: {canvas}");

    let text = project.read("out/reports/ada.txt");
    let score = "Score 20 of 20 points, and 2.4 of 3 for the creative scene: 22.4 together\n  Creative scene: \
                 ingredients 8, aesthetics 10, originality 6, of 10\n";
    assert!(text.contains(score), "{text}");
    assert!(
        project
            .read("out/reports/bob.txt")
            .contains("Score 20 of 20 points\n  Creative scene: no mark\n")
    );
    assert!(project.read("pages/index.html").contains("2.4/3"));
    assert!(
        project
            .read("pages/submissions/ada/index.html")
            .contains("for the creative scene: 22.4 together")
    );
    let report: Value = serde_json::from_str(&project.read("out/reports/ada.json")).unwrap();
    let marks = serde_json::json!([[8.0, 10.0, 6.0]]);
    assert_eq!(
        (&report["creative"]["marks"], &report["creative"]["points_earned"]),
        (&marks, &2.4.into())
    );
    assert_eq!(report["required"]["points_earned"], 20.0);

    // Another judge, and a lower cap.
    project.write("second.csv", &format!("{HEAD}ada,,,4,6,8,,\ncleo,,,0,0,0,,\n"));
    project.write("assets/rubric.toml", "[default]\npoints = 10\n[creative]\ncap = 10\n");
    let run = project.class(&[&MARKS[..], &["--marks", "second.csv"]].concat());
    for line in [
        "  ada            20/20    0/0     1.4/2    21.4     3/3          -  passed\n",
        "  cleo           20/20    0/0       0/2      20     3/3          -  passed\n",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
}

#[test]
fn a_report_with_marks_is_verified() {
    let project = project();
    assert_eq!(project.class(&MARKS).code, 0);
    let file = "out/reports/ada.json";
    let verify = ["verify-report", file, "class/ada", "--no-jacobians", "--no-progress"];
    let run = project.grade(&verify);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let report = project.read(file);
    project.write(file, &report.replace("\"points_earned\": 2.4", "\"points_earned\": 3.0"));
    let run = project.grade(&verify);
    let line = "points of the creative scene: 3 of 3, now 2.4";
    assert!(run.code == 1 && run.stdout.contains(line), "{}{}", run.stdout, run.stderr);
    // Marks are within the rubric's.
    let mut forged: Value = serde_json::from_str(&report).unwrap();
    forged["creative"]["marks"][0][0] = 1e6.into();
    project.write(file, &forged.to_string());
    let run = project.grade(&verify);
    let message = "a mark of the creative scene is out of range";
    assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
}

#[test]
fn invalid_marks_are_refused_before_grading() {
    let project = project();
    for (rows, message) in [
        ("ada,,,8,11,6,,\n", "marks.csv:2: ada: aesthetics: marks are from 0 to 10, not 11"),
        ("eve,,,8,1,6,,\n", "marks.csv:2: \"eve\" is in no submission of class"),
        ("\"e\u{1b}[2J\",,,8,1,6,,\n", "marks.csv:2: \"e\u{fffd}[2J\" is in no submission"),
    ] {
        project.write("marks.csv", &format!("{HEAD}{rows}"));
        let run = project.class(&MARKS);
        assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
        assert!(!project.path("out/summary.csv").exists());
    }
}

/// A filled-in sheet of a gallery is a valid sheet of marks, for any names of submissions.
#[test]
fn gallery_sheet_round_trips() {
    let project = Project::new();
    let scene = project.read("assets/Free/near.xml");
    for name in ["=1+1", "ada"] {
        let manifest = "run = [\"./run\", \"{scene}\", \"-o\", \"{trace}\"]\n";
        project.write(&format!("class/{name}/submission.toml"), manifest);
        project.program(&format!("class/{name}/run"), RIGHT);
        project.write(
            &format!("class/{name}/Creative/x_t1m1.xml"),
            &scene.replace("1.5", &format!("{}", name.len())),
        );
    }
    for hidden in [false, true] {
        let hide: &[&str] = if hidden { &["--hide-names", "key.csv"] } else { &[] };
        let gallery = ["gallery", "class", "-o", "gallery", "--root", "."];
        let run = project.grade(&[&gallery[..], hide].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        let sheet = project.read("gallery/marks.csv");
        assert!(hidden || sheet.contains("\n'=1+1/Creative/x_t1m1.xml,"), "{sheet}");
        project.write("marks.csv", &sheet.replace(",,,,,", ",1,2,3,,"));
        let key: &[&str] = if hidden { &["--key", "key.csv"] } else { &[] };
        let run = project.class(&[&MARKS[..], key].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert_eq!(run.stdout.matches("0.06/0.3").count(), 2, "{}", run.stdout);
    }
}
