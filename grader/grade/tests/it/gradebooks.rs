//! Gradebooks of a class, read by programs that are not ours.

use needs::needs;
use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::class::{Project, RIGHT};
use crate::folder::Run;

/// Reads a CSV file and prints its rows as JSON.
const READER: &str = "import csv, json, sys\n\
                      print(json.dumps(list(csv.reader(open(sys.argv[1], newline=''), strict=True))))";

const RUBRIC: &str = "[default]\npoints = 5\n[late]\npenalty = 20\ncap = 50\ngrace = 15\n";

/// Options of all runs.
const COMMON: [&str; 10] = [
    "class",
    "-o",
    "out",
    "--unprotected",
    "--no-jacobians",
    "--no-progress",
    "--format",
    "json",
    "--roster",
    "roster.csv",
];

/// A class of 30 submissions in folders, with a roster of 32: students 31 and 32 handed in nothing, and submission 30 is
/// of no student.
fn project() -> Project {
    let project = Project::new();
    project.write("assets/rubric.toml", RUBRIC);
    let mut roster = "Email,Name,ID,Section,Submitted,Due,Folder\n".to_owned();
    for number in 1..=32 {
        let (name, submitted, due, folder) = match number {
            1 => ("=HYPERLINK(1)", "2026-02-01T23:59:00-08:00", "", ""),
            2 => ("\"Lovelace, -Ada \"\"A\"\"\"", "2026-02-02T00:14:01-08:00", "", ""),
            3 => ("Zoë", "2026-02-09T00:00:00Z", "", ""),
            4 => ("Dot", "2026-02-09T00:00:00Z", "2026-02-09T00:00:00Z", ""),
            5 => ("Eve", "", "", "team"),
            6 => ("Fay", "", "", "team"),
            _ => ("Student", "", "", ""),
        };
        let id = 1000 + number;
        roster += &format!("s{number}@x.edu,{name},{id},\"1, 2\",{submitted},{due},{folder}\n");
    }
    project.write("roster.csv", &roster);
    for number in 1..=30 {
        let name = match number {
            5 => "team".to_owned(),
            6 => "nobody".to_owned(),
            _ => format!("s{number}_t1m3"),
        };
        let manifest = "run = [\"./run\", \"{scene}\", \"-o\", \"{trace}\"]\n";
        project.write(&format!("class/{name}/submission.toml"), manifest);
        let text = match number {
            3 => RIGHT.replace("END {", "END { if (x == 150) x += 1;"),
            7 => "#!/bin/sh\nexit 3\n".to_owned(),
            _ => RIGHT.to_owned(),
        };
        project.program(&format!("class/{name}/run"), &text);
    }
    project
}

fn class(project: &Project, arguments: &[&str]) -> Run {
    project.grade(&[&["class"], arguments, &COMMON].concat())
}

/// The rows of a CSV file as Python reads them.
fn rows(project: &Project, file: &str) -> Vec<Vec<String>> {
    let python = Command::new("python3").args(["-c", READER]).arg(project.path(file)).output();
    let output = python.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |cell: &Value| cell.as_str().unwrap().to_owned();
    let row = |row: &Value| row.as_array().unwrap().iter().map(text).collect();
    rows.as_array().unwrap().iter().map(row).collect()
}

/// A class graded with gradebooks.
fn graded() -> (Project, Run) {
    let project = project();
    let kinds = ["canvas", "moodle", "brightspace"];
    let gradebooks = kinds.map(|kind| ["--gradebook".to_owned(), format!("{kind}={kind}.csv")]);
    let gradebooks: Vec<&str> = gradebooks.as_flattened().iter().map(String::as_str).collect();
    let run = class(&project, &[&gradebooks[..], &["--due", DUE, "--column", "=T1M3"]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    (project, run)
}

const DUE: &str = "2026-02-01T23:59:00-08:00";

#[needs("command -v soffice")]
#[test]
fn libreoffice_finds_no_formula() {
    let project = graded().0;
    let files = ["canvas.csv", "moodle.csv"];
    // Shows that LibreOffice would find formulas.
    project.write("formula.csv", "name,points\n=1+1,2\n");
    let soffice = Command::new("soffice")
        // Another one may be running.
        .arg(format!("-env:UserInstallation=file://{}", project.path("profile").display()))
        .args(["--headless", "--convert-to", "fods", "--outdir", "sheets", "formula.csv"])
        .args(files)
        .current_dir(project.path(""))
        .output();
    let output = soffice.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let sheet = |file: &str| project.read(&format!("sheets/{}", file.replace(".csv", ".fods")));
    assert!(sheet("formula.csv").contains("table:formula="), "{}", sheet("formula.csv"));
    for file in files {
        assert!(!sheet(file).contains("table:formula"), "{file} has a formula");
    }
    // A name stays text.
    assert!(sheet("canvas.csv").contains("<text:p>&apos;=HYPERLINK(1)</text:p>"));
}

#[needs("command -v python3")]
#[test]
fn a_class_goes_into_the_gradebooks_of_canvas_and_moodle() {
    let (project, run) = graded();
    let counts = "students without a submission: 2; submissions of no student: 1";
    assert!(run.stderr.contains(counts), "{}", run.stderr);
    assert_eq!(run.stdout, project.read("out/summary.txt"));
    for line in [
        "  roster.csv: 30 of 32 students have a submission\n",
        "  no submission: Student (line 32)\n  no submission: Student (line 33)\n",
        "  no student: nobody; its points are in no gradebook\n",
        "  late: Lovelace, -Ada \"A\": on day 1 after the deadline, 20 % taken off, 8 of 10 points remain\n",
        "  late: Zoë: on day 7 after the deadline, 50 % taken off, 3.75 of 7.5 points remain\n",
        "  time unknown: Eve: team counts as in time\n",
        "  canvas.csv: points of 30 of 32 students, in the column \"=T1M3\"\n",
    ] {
        assert!(run.stdout.contains(line), "{line}{}", run.stdout);
    }
    assert!(!run.stdout.contains("Dot"), "extended deadline: {}", run.stdout);

    let files = ["canvas.csv", "moodle.csv", "brightspace.csv"];
    let [canvas, moodle, brightspace] = files.map(|file| rows(&project, file));
    let header = ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "'=T1M3"];
    assert_eq!(canvas[0], header);
    assert_eq!(canvas[1], ["    Points Possible", "", "", "", "", "10"]);
    assert_eq!(canvas[2], ["'=HYPERLINK(1)", "", "1001", "", "1, 2", "10"]);
    assert_eq!(canvas[3][0], "Lovelace, '-Ada \"A\"");
    assert_eq!(canvas[4], ["Zoë", "", "1003", "", "1, 2", "3.75"]);
    // Students without a submission have no row: an empty cell would remove what the platform has.
    assert_eq!((canvas.len(), moodle.len(), brightspace.len()), (32, 31, 31));
    assert_eq!(moodle[0], ["Email address", "ID number", "'=T1M3"]);
    assert_eq!(moodle[7], ["s7@x.edu", "1007", "0"]);
    let points: Vec<&str> = moodle[1..].iter().map(|row| row[2].as_str()).collect();
    assert_eq!(points[..8], ["10", "8", "3.75", "10", "10", "10", "0", "10"]);
    assert_eq!(points[29..], ["10"]);
    assert_eq!(brightspace[0], ["OrgDefinedId", "'=T1M3 Points Grade", "End-of-Line Indicator"]);
    assert_eq!(brightspace[2], ["1002", "8", "#"]);
    let of_canvas: Vec<&str> = canvas[2..].iter().map(|row| row[5].as_str()).collect();
    assert_eq!(of_canvas, points);

    // A merge writes them later, by other options, from any folder.
    let file = project.path("later.csv");
    let file = format!("canvas={}", file.display());
    let roster = project.path("roster.csv");
    let merge = ["class", "merge", "out/plan.json", "--gradebook", &file, "--roster"];
    let run = project.grade(&[&merge[..], &[roster.to_str().unwrap(), "--due", DUE]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let later = project.read("later.csv");
    assert_eq!(later.replacen("Spring Oracle", "'=T1M3", 1), project.read("canvas.csv"));
}

#[test]
fn ambiguous_roster_is_refused_before_grading() {
    let project = Project::new();
    project.write("assets/rubric.toml", RUBRIC);
    project.program("class/ada_2", RIGHT);
    let canvas = ["--gradebook", "canvas=canvas.csv"];
    let moodle = ["--gradebook", "moodle=moodle.csv"];
    for (roster, arguments, message) in [
        ("name,email\nAda,a@x.edu\n", &canvas[..], "roster.csv:2: canvas cannot find Ada"),
        (
            "id\n2\n",
            &["--gradebook", "blackboard=b.csv"],
            "blackboard cannot find 2\n  help: fill in one of the columns login",
        ),
        ("name,canvas id\nAda,1\n", &moodle, "roster.csv:2: moodle cannot find Ada"),
        ("name,id\nAda,=1+2\n", &canvas, "roster.csv:2: spreadsheets read \"=1+2\" as a formula"),
        ("id,submitted\n2,2026-02-01T00:00:00Z\n", &canvas, "roster.csv:2: there is a time of"),
        ("id\n2\n", &["--folder-times"], "roster.csv:2: there is a time of submission, but no"),
        ("id\n2\n", &["--due", "monday"], "is no time with date and offset"),
        (
            "id\n2\n",
            &["--gradebook", "excel=x"],
            "the gradebooks are canvas, moodle, blackboard and brightspace",
        ),
    ] {
        project.write("roster.csv", roster);
        let run = class(&project, arguments);
        assert!(run.code == 2 && run.stderr.contains(message), "{message}: {}", run.stderr);
        assert!(!project.path("out/summary.csv").exists() && !project.path("canvas.csv").exists());
    }
}

#[test]
fn adjustments_are_kept_and_shown_with_their_reasons() {
    let project = Project::new();
    project.write("assets/rubric.toml", RUBRIC);
    project.program("class/ada_t1", RIGHT);
    project.program("class/bob", RIGHT);
    project.write(
        "roster.csv",
        "name,login,submitted\nAda,ada,2026-02-02T12:00:00Z\nBob,bob,2026-01-01T00:00:00Z\n",
    );
    project
        .write("a.csv", "student,points,reason\nAda,1.5,regrade 12\nbob,-20,handed in by =mail\n");
    let options =
        ["--gradebook", "moodle=m.csv", "--due", "2026-02-01T23:59:00Z", "--adjustments", "a.csv"];
    let grade = |more: &[&str]| {
        let run = class(&project, &[&options[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        run.stdout
    };
    // A late submission loses a fifth of what it earned, and of no adjustment. No points are negative.
    for more in [&[][..], &["--resume"]] {
        let summary = grade(more);
        assert!(summary.contains("  adjusted: ada_t1: +1.5 points: regrade 12\n"), "{summary}");
        assert!(
            summary.contains("8 of 10 points remain; with adjustments, 9.5 count\n"),
            "{summary}"
        );
        assert!(summary.contains("show the points before what lateness takes off\n"), "{summary}");
        assert_eq!(project.read("m.csv"), "Username,Spring Oracle\nada,9.5\nbob,0\n");
    }
    let table = project.read("out/summary.csv");
    assert!(table.contains(",11.5,0,") && table.contains(",1.5,,regrade 12\n"), "{table}");
    assert!(table.contains(",,20,handed in by =mail\n"), "{table}");
    let report: Value = serde_json::from_str(&project.read("out/reports/ada_t1.json")).unwrap();
    assert_eq!(report["adjustments"][0]["reason"], "regrade 12");
    // Only who is adjusted otherwise is graded again.
    let [ada, bob] = ["ada_t1", "bob"].map(|name| project.read(&format!("out/resume/{name}.json")));
    project.write("a.csv", "student,points,reason\nAda,2,regrade 12\nbob,-20,handed in by =mail\n");
    grade(&["--resume"]);
    assert_ne!(project.read("out/resume/ada_t1.json"), ada);
    assert_eq!(project.read("out/resume/bob.json"), bob);
    let text = ["class", "class", "-o", "text", "--unprotected", "--no-jacobians", "--no-progress"];
    let adjusted = ["--roster", "roster.csv", "--adjustments", "a.csv", options[2], options[3]];
    project.grade(&[&text[..], &adjusted].concat());
    let text = project.read("text/reports/ada_t1.txt");
    let sum = "12 points with adjustments, before what lateness takes off.\n";
    assert!(text.contains(sum), "{text}");
    project.write("a.csv", "student,points,reason\nEve,2,x\n");
    let run = class(&project, &options);
    assert!(
        run.code == 2 && run.stderr.contains("a.csv:2: \"Eve\" has no submission"),
        "{}",
        run.stderr
    );
}

/// Without `[late]`, nothing is taken off; a hand-in that nobody could grade has no row.
#[test]
fn what_has_no_rule_or_no_grade_is_said() {
    let project = Project::new();
    project.write("assets/rubric.toml", "[default]\npoints = 5\n");
    project.program("class/ada", RIGHT);
    project.write("class/bob/notes.txt", "no program");
    project.write("roster.csv", "login,submitted\nada,2026-02-03T00:00:00Z\nbob,\n");
    let due = ["--gradebook", "moodle=m.csv", "--due", "2026-02-01T23:59:00Z"];
    let run = class(&project, &due);
    let late = "  late: ada: on day 2 after the deadline; nothing is taken off, as the rubric has no rule for";
    assert!(run.stdout.contains(late), "{}", run.stdout);
    assert!(run.stdout.contains("  no points: bob: bob could not be graded\n"), "{}", run.stdout);
    assert_eq!(project.read("m.csv"), "Username,Spring Oracle\nada,10\n");
}

#[test]
fn a_roster_of_excel_leads_to_blackboard() {
    let project = Project::new();
    project.write("assets/rubric.toml", RUBRIC);
    project.program("class/zoe", RIGHT);
    // As "Unicode text": UTF-16 with tabs.
    let roster = "\u{feff}Last Name\tFirst Name\tUsername\r\nÅngström\tZoë\tzoe\r\nB\tBob\tbob\r\n";
    let bytes: Vec<u8> = roster.encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(project.path("roster.csv"), bytes).unwrap();
    let run = class(
        &project,
        &["--gradebook", "blackboard=b.csv", "--column", "T1M3 [Total Pts: 10] |123"],
    );
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("no submission: Bob B (line 3)"), "{}", run.stdout);
    assert_eq!(project.read("b.csv"), "Username,T1M3 [Total Pts: 10] |123\nzoe,10\n");
}

#[test]
fn newest_file_dates_a_submission() {
    let project = Project::new();
    project.write("assets/rubric.toml", RUBRIC);
    project.program("class/ada", RIGHT);
    project.write("roster.csv", "login\nada\n");
    let seconds = std::time::Duration::from_secs(1_795_359_898 + 3600);
    let file = fs::File::open(project.path("class/ada")).unwrap();
    file.set_modified(std::time::UNIX_EPOCH + seconds).unwrap();
    let options = ["--gradebook", "moodle=moodle.csv", "--due", "2026-11-22T07:04:58-08:00"];
    let run = class(&project, &[&options[..], &["--folder-times"]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let warning = "1 times are those of files, which students can set back";
    assert!(run.stderr.contains(warning) && run.stdout.contains(warning), "{}", run.stderr);
    assert_eq!(project.read("moodle.csv"), "Username,Spring Oracle\nada,8\n");
    let run = class(&project, &options);
    assert!(run.stdout.contains("time unknown: ada: ada counts as in time"), "{}", run.stdout);
    assert_eq!(project.read("moodle.csv"), "Username,Spring Oracle\nada,10\n");
}

#[test]
fn incomplete_class_has_no_gradebook() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    project.write("roster.csv", "login\nada\n");
    let run = class(&project, &["--on", "nothing"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let merge = ["class", "merge", "out/plan.json", "--gradebook", "moodle=moodle.csv"];
    let run = project.grade(&[&merge[..], &["--roster", "roster.csv"]].concat());
    assert_eq!(run.code, 130, "{}", run.stderr);
    assert!(run.stdout.contains("no gradebook is written: some submissions have no result"));
    assert!(!project.path("moodle.csv").exists());
}
