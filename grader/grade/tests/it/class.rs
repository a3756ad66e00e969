//! Hidden scenes, credit and classes of submissions, with the `grade` binary.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::ops::Deref;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use test_support::{assert_fits, seed, without_times};

use crate::folder::{self, Folder, Run, command};
use serde_json::Value;

const SCENE: &str = r#"<scene>
  <!-- COMMENT -->
  <description text="DESCRIPTION"/>
  <duration time="0.2"/>
  <integrator type="explicit-euler" dt="0.1"/>
  <particle m="1.25" px="NUMBER" py="0" vx="1" vy="2" fixed="0"/>
</scene>
"#;

/// Accepts the built-in calling convention; answers the grader's first scene, and prints any other scene.
const LEAKING: &str = r#"#!/bin/sh
[ "$1" = -s ] && exit 9
if grep -q 'px="0.25"' "$1"; then
  printf 'step,time,x0,y0,vx0,vy0\n0,0,0.25,-1.5,2,0.5\n1,0.5,1.25,-1.25,2,0.5\n' > "$3"
else
  cat "$1" >&2; cat "$1"; ls -la / /tmp /tmp/* . >> "$3" 2>&1; cat "$1" >> "$3"; exit "$(grep -c SHOWN "$1")"
fi
"#;

/// Passes every scene of one particle on which no force acts.
pub(super) const RIGHT: &str = r#"#!/bin/sh
[ "$1" = -s ] && exit 9
awk -F'"' '
  /duration/ { end = $2 } /integrator/ { dt = $4 }
  /<particle/ { x = $4; y = $6; vx = $8; vy = $10 }
  END {
    n = int(end / dt + 0.5)
    print "step,time,x0,y0,vx0,vy0"
    for (i = 0; i <= n; ++i) {
      printf "%d,%.17g,%.17g,%.17g,%s,%s\n", i, i * dt, x, y, vx, vy
      x += dt * vx; y += dt * vy
    }
  }' "$1" > "$3"
"#;

fn scene(number: &str) -> String {
    SCENE.replace("NUMBER", number)
}

/// A folder with two shipped scenes of one feature and one of another, and their oracle.
pub(super) struct Project(Folder);

impl Deref for Project {
    type Target = Folder;

    fn deref(&self) -> &Folder {
        &self.0
    }
}

impl Project {
    pub(super) fn new() -> Self {
        let project = Self(Folder::new());
        project.write("assets/Free/near.xml", &scene("1.5").replace("COMMENT", "SHOWN"));
        project.write("assets/Free/far.xml", &scene("150").replace("COMMENT", "SHOWN"));
        let symplectic = scene("3").replace("explicit", "symplectic").replace("COMMENT", "SHOWN");
        project.write("assets/Free/other.xml", &symplectic);
        project.regenerate(".");
        project
    }

    /// One hidden scene of a known feature, and one of a separate group.
    pub(super) fn with_hidden() -> Self {
        let project = Self::new();
        project.write("hidden/assets/Free/moonlight.xml", &scene("0.87654321"));
        project.write("hidden/assets/Starlight/sunlight.xml", &scene("0.76543219"));
        project.regenerate("hidden");
        project
    }

    fn regenerate(&self, root: &str) {
        let run = self.grade(&["oracle", "regenerate", "--accept", "--root", root]);
        assert_eq!(run.code, 0, "{}", run.stderr);
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let run = self.grade(&[arguments, &["--format", "json", "--no-jacobians"]].concat());
        let report = serde_json::from_str(&run.stdout).unwrap();
        assert_fits("report.schema.json", &report);
        report
    }

    /// `grade class class -o out` with these further arguments.
    pub(crate) fn class(&self, arguments: &[&str]) -> Run {
        self.grade(&[&["class", "class", "-o", "out", "--no-jacobians"], arguments].concat())
    }

    /// The line of the summary.
    pub(crate) fn row(&self, name: &str) -> String {
        let csv = self.read("out/summary.csv");
        let start = format!("{name},");
        csv.lines().find(|line| line.starts_with(&start)).unwrap().to_owned()
    }
}

#[test]
fn reports_show_only_counts_of_hidden_scenes() {
    let project = Project::with_hidden();
    project.program("leaking", LEAKING);
    let secrets = [
        "moonlight",
        "sunlight",
        "Starlight",
        "0.8765432",
        "0.7654321",
        "COMMENT",
        "hidden/assets",
    ];
    for format in ["text", "json", "junit"] {
        let run =
            project.grade(&["leaking", "--hidden", "hidden", "--no-jacobians", "--format", format]);
        assert_eq!(run.code, 1, "{}", run.stderr);
        let shown = run.stdout + &run.stderr;
        for secret in secrets {
            assert!(!shown.contains(secret), "{format} tells {secret}: {shown}");
        }
        // Its output on shipped scenes is shown, so the check above can fail.
        assert!(shown.contains("SHOWN"), "{shown}");
    }
    let report = project.json(&["leaking", "--hidden", "hidden"]);
    assert_eq!(report["hidden"], serde_json::json!({"run": true, "scenes": 2, "reason": null}));
    let features: Vec<(&Value, &Value)> = report["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(|feature| (&feature["group"], &feature["hidden"]))
        .collect();
    let malformed = serde_json::json!({"malformed": 1});
    let none = serde_json::json!({});
    assert_eq!(
        features,
        [(&"Free".into(), &malformed), (&"Free".into(), &none), (&"hidden".into(), &malformed)]
    );
}

#[test]
fn a_hidden_scene_that_cannot_be_used_is_not_named() {
    let project = Project::with_hidden();
    project.write("hidden/assets/Free/moonlight.xml", "<scene>");
    let run = project.grade(&["--hidden", "hidden"]);
    assert_eq!((run.code, run.stdout.as_str()), (2, ""));
    assert!(run.stderr.contains("grade oracle verify --root hidden"), "{}", run.stderr);
    assert!(!run.stderr.contains("moonlight"), "{}", run.stderr);
    // A trace of another scene is a fault of the grader's files: its points are neither earned nor lost.
    project.write("hidden/assets/Free/moonlight.xml", &scene("0.5"));
    let report = project.json(&["--hidden", "hidden"]);
    assert_eq!(report["outcome"], "grader-fault");
    assert_eq!(report["required"]["hidden_not_judged"], 1);
    let points = |name: &str| report["required"][name].as_f64().unwrap();
    assert!(points("points_not_judged") > 0.0);
    assert_eq!(points("points_earned") + points("points_not_judged"), points("points"));
    let run = project.grade(&["--hidden", "nowhere"]);
    assert!(run.code == 2 && run.stderr.contains("there are no hidden scenes"), "{}", run.stderr);
}

#[test]
fn all_passed_is_not_claimed_without_hidden_scenes() {
    let project = Project::with_hidden();
    fs::rename(project.path("hidden"), project.path("elsewhere")).unwrap();
    project.write("assets/rubric.toml", "[hidden]\nfolder = \"../hidden\"\nscenes = 2\n");
    let run = project.grade(&["--no-jacobians"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let end = "  All shipped scenes passed. 2 hidden scenes were not run.\n";
    assert!(run.stdout.ends_with(end), "{}", run.stdout);
    assert!(!run.stdout.contains("All passed"));
    let report = project.json(&[]);
    assert_eq!(report["outcome"], "passed-shipped");
    assert_eq!(
        report["hidden"],
        serde_json::json!({"run": false, "scenes": 2, "reason": "unavailable"})
    );
    let junit = project.grade(&["--format", "junit", "--no-jacobians"]).stdout;
    assert!(junit.contains("<skipped message=\"2 hidden scenes were not run.\""), "{junit}");

    // Nor with --only, nor if there is nothing to run.
    fs::rename(project.path("elsewhere"), project.path("hidden")).unwrap();
    assert_eq!(project.json(&[])["outcome"], "passed");
    assert_eq!(project.json(&["--only", "near"])["outcome"], "passed-shipped");
    // Traces of hidden scenes that a folder lacks are missing.
    assert_eq!(project.json(&["--traces", "expected"])["outcome"], "failed");

    project.write("assets/rubric.toml", "[hidden]\nfolder = \"../hidden\"\nscenes = 3\n");
    let run = project.grade(&[]);
    let message = "found 2 hidden scenes, but the rubric states 3";
    assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
}

#[test]
fn credit_follows_weights_hidden_scenes_and_all_or_nothing() {
    let project = Project::with_hidden();
    // Correct on all scenes except the one that starts far away.
    let wrong = RIGHT.replace("END {", "END { if (x == 150) x += 1;");
    project.program("wrong", &wrong);
    let earned = |rubric: &str, arguments: &[&str]| {
        project.write("assets/rubric.toml", rubric);
        let report = project.json(&[&["wrong"], arguments].concat());
        let sums = &report["groups"][0];
        assert_eq!(sums["group"], "Free");
        sums["points_earned"].as_f64().unwrap()
    };
    let hidden = ["--hidden", "hidden"];
    assert_eq!(earned("[default]\npoints = 6\n", &[]), 6.0 / 2.0 + 6.0);
    assert_eq!(earned("[default]\npoints = 6\n", &hidden), 6.0 * 2.0 / 3.0 + 6.0);
    let weight = "[default]\npoints = 6\n[[scene]]\nname = \"Free/far\"\nweight = 3\n";
    assert_eq!(earned(weight, &[]), 6.0 / 4.0 + 6.0);
    assert_eq!(earned("[default]\npoints = 6\npartial = false\n", &[]), 6.0);
    let some = "[[feature]]\nintegrator = \"explicit-euler\"\npartial = false\n";
    assert_eq!(earned(some, &[]), 1.0);
    // A rule may set the weight of a hidden scene.
    let weight = "[default]\npoints = 6\n[[scene]]\nname = \"Free/moonlight\"\nweight = 2\n";
    assert_eq!(earned(weight, &hidden), 6.0 * 3.0 / 4.0 + 6.0);
    project.write("assets/rubric.toml", "[default]\npartial = false\n");
    let shown = project.grade(&["wrong", "--no-jacobians"]).stdout;
    assert!(shown.contains("0/1  FAIL (all or nothing)\n"), "{shown}");

    for (rubric, message) in [
        ("[[scene]]\nname = \"Free/far\"\nweight = 0\n", "rubric.toml:3:10: a weight is above 0"),
        ("[hidden]\nscenes = 0\n", "rubric.toml:2:10:"),
        ("[default]\npartial = 1\n", "rubric.toml:2:11:"),
    ] {
        project.write("assets/rubric.toml", rubric);
        let run = project.grade(&[]);
        assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
    }
}

#[test]
fn class_grades_equal_grades_of_single_runs() {
    let project = Project::with_hidden();
    project.write("assets/rubric.toml", "[class]\ntraces = true\n");
    project.program("class/ada", RIGHT);
    let traces = ["near", "far", "other"];
    for name in traces {
        let trace = project.read(&format!("expected/Free/{name}.csv"));
        project.write(&format!("class/cleo/Free/{name}.csv"), &trace);
    }
    let options = ["--format", "text,json,junit", "--limit", "cpu=0.5"];
    let run = project.class(&options);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(run.stdout, project.read("out/summary.txt"));
    let names = ["ada.txt", "ada.json", "ada.xml", "cleo.txt", "cleo.json", "cleo.xml"];
    let reports = || names.map(|name| without_times(&project.read(&format!("out/reports/{name}"))));
    let (alone, row) = (reports(), project.row("ada"));
    assert_eq!(row, "ada,passed,2,2,0,0,2,0,3,3,,,,,,");

    project.program("class/bob", "#!/bin/sh\nkill -9 -1; rm -rf ..; exit 1\n");
    project.program("class/dot", "#!/bin/sh\nwhile :; do :; done\n");
    project.write("class/eve/submission.toml", "name = \"ada\"\nrun = 1\n");
    let cheat = "run = [\"sh\", \"x\", \"{scene}\", \"{trace}\"]\nname = \"a\\u001b[2Jb\"\n";
    project.write("class/fay/submission.toml", cheat);
    project.write("class/notes.txt", "no submission");
    std::os::unix::fs::symlink(project.path("expected"), project.path("class/gus")).unwrap();
    fs::create_dir_all(project.path("class/hal/Free")).unwrap();
    for name in traces {
        let oracle = project.path(&format!("expected/Free/{name}.csv"));
        let link = project.path(&format!("class/hal/Free/{name}.csv"));
        std::os::unix::fs::symlink(oracle, link).unwrap();
    }
    assert_eq!(project.json(&["class/fay"])["submission"], "a\u{fffd}[2Jb");
    for threads in ["1", "2"] {
        let run = project.class(&[&options[..], &["--threads", threads]].concat());
        assert_eq!(run.code, 3, "{}", run.stderr);
        assert!(reports() == alone, "a neighbour changed a report");
        assert_eq!(project.row("ada"), row);
        for (name, verdict) in [
            ("bob", "crashed"),
            ("cleo", "passed"),
            ("dot", "timed-out"),
            ("eve", "bad-hand-in"),
            ("fay", "crashed"),
            ("hal", "no-output"),
        ] {
            let row = project.row(name);
            assert!(row.starts_with(&format!("{name},{verdict},")), "{row}");
        }
        assert!(run.stdout.contains("skipped: gus: it is a link"), "{}", run.stdout);
        assert!(run.stdout.contains("skipped: notes.txt: it is neither a program nor an archive"));
        let shown = folder::words(&project.read("out/reports/hal.txt"));
        assert!(shown.contains("is a link that leads out of the submission"), "{shown}");
        assert!(!project.read("out/reports/fay.txt").contains('\u{1b}'));
        assert!(project.read("out/reports/eve.txt").contains("Summary for eve"));
    }
}

#[test]
fn only_changed_submissions_are_graded_again() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    project.program("class/bob", RIGHT);
    assert_eq!(project.class(&["--format", "json"]).code, 0);
    let report = project.read("out/reports/ada.json");
    // A record holds the time that grading took, so that no two are the same.
    let records = RefCell::new(BTreeMap::new());
    let record = |name: &str| project.read(&format!("out/resume/{name}.json"));
    let mark = |name| drop(records.borrow_mut().insert(name, record(name)));
    let marked = |name| records.borrow().get(name) == Some(&record(name));
    let resume = || project.class(&["--format", "json", "--resume"]);
    mark("ada");
    mark("bob");
    resume();
    assert!(marked("ada") && marked("bob"));
    // A changed submission, report, suite or option: graded again.
    project.program("class/bob", &(RIGHT.to_owned() + "\n"));
    resume();
    assert!(marked("ada") && !marked("bob"));
    project.write("out/reports/ada.json", "{}");
    resume();
    assert!(!marked("ada"));
    assert_eq!(project.read("out/reports/ada.json"), report);
    mark("ada");
    project.class(&["--format", "json", "--resume", "--limit", "cpu=9"]);
    assert!(!marked("ada"));
    mark("ada");
    project.write("assets/rubric.toml", "[default]\npoints = 3\n");
    resume();
    assert!(!marked("ada"));
    mark("ada");
    project.class(&["--format", "json"]);
    assert!(!marked("ada"), "graded anew where resuming was not asked for");
    // A scene without a trace is not judged, and decides for no submission.
    let trace = project.read("expected/Free/near.csv");
    fs::remove_file(project.path("expected/Free/near.csv")).unwrap();
    assert_eq!(resume().code, 3);
    assert!(
        project.row("ada").starts_with("ada,passed,4.5,6,0,0,4.5,1.5,"),
        "{}",
        project.row("ada")
    );
    mark("ada");
    project.write("expected/Free/near.csv", &trace);
    assert_eq!(resume().code, 0);
    assert!(!marked("ada"));
    assert!(project.row("ada").starts_with("ada,passed,6,6,"));
}

#[test]
fn pages_on_or_off_grade_nothing_again() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    let class = |options: &[&str]| {
        let run = project.class(&[&["--format", "json"], options].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        (project.read("out/resume/ada.json"), run.stderr)
    };
    let link = || project.read("pages/index.html").contains("submissions/ada/index.html");
    // With pages first: they stay, also through a run without.
    let (record, _) = class(&["--html", "pages"]);
    assert!(link());
    assert_eq!(class(&["--resume"]).0, record);
    assert_eq!(class(&["--resume", "--html", "pages"]).0, record);
    assert!(link());
    // Without pages first: the class has its page, and what has none is not linked.
    fs::remove_dir_all(project.path("pages")).unwrap();
    let (record, _) = class(&[]);
    let (same, said) = class(&["--resume", "--html", "pages"]);
    assert_eq!(same, record);
    assert!(!link() && project.read("pages/index.html").contains("ada"));
    assert!(said.contains("1 submissions were graded without --html, and have no pages"), "{said}");
}

/// After a change of the rubric or of scenes, a second grading lists the changed points with their reasons.
#[test]
fn changed_grades_are_listed_with_the_features_that_changed() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    project.program("class/bob", &RIGHT.replace("END {", "END { if (x == 150) x += 1;"));
    project.program("class/eve", "#!/bin/sh\nexit 3\n");
    let changes = |options: &[&str]| {
        let run = project.class(&[&["--format", "json"], options].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        let lines = run.stdout.lines().filter(|line| line.contains("changed: "));
        lines.map(|line| line.trim().to_owned()).collect::<Vec<_>>()
    };
    assert!(
        changes(&[]).is_empty() && changes(&["--resume"]).is_empty() && changes(&[]).is_empty()
    );
    let feature = "[[feature]]\ngroup = \"Free\"\nintegrator = \"explicit-euler\"\n";
    project.write("assets/rubric.toml", &format!("{feature}points = 3\npartial = false\n"));
    let name = "required / Free / explicit-euler";
    // Lost points come first; unchanged students are not listed.
    let expected = [
        format!("changed: bob: 1 instead of 1.5 points ({name} 0/3 instead of 0.5/1)"),
        format!("changed: ada: 4 instead of 2 points ({name} 3/3 instead of 1/1)"),
    ];
    assert_eq!(changes(&["--resume"]), expected);
    assert!(changes(&["--resume"]).is_empty());
}

/// The first scene of each feature is run again.
#[test]
fn programs_that_write_other_traces_in_each_run_are_said_to() {
    let project = Project::new();
    let said = |program: &str, more: &[&str]| {
        project.program("program", program);
        let report = project.json(&[&["./program"], more].concat());
        let found = report["findings"].as_array().unwrap();
        let said = |finding: &Value| finding["message"].as_str().unwrap().contains("deterministic");
        found.iter().any(said)
    };
    let noisy = RIGHT.replace("awk ", "awk -v noise=0.$(date +%N) ");
    assert!(said(&noisy.replace("x += dt * vx", "x += dt * vx + noise"), &[]));
    assert!(!said(RIGHT, &[]));

    // A scene that does not end in time is not run again.
    let log = project.path("log");
    let endless =
        format!("grep -q 150 \"$1\" && echo >> {} && while :; do :; done\n", log.display());
    let (start, rest) = RIGHT.split_once("awk").unwrap();
    let limit = ["--unprotected", "--limit", "wall=2"];
    assert!(!said(&format!("{start}{endless}awk{rest}"), &limit));
    assert_eq!(project.read("log").lines().count(), 1);
}

#[test]
fn kept_runs_are_reused() {
    let project = Project::new();
    let log = project.path("log");
    let logging = format!("#!/bin/sh\necho \"$1\" >> {}\n{RIGHT}", log.display());
    project.program("class/ada", &logging);
    // With one thread, so that no two runs write to the log at a time.
    let class = |output: &str, more: &[&str]| {
        let _ = fs::remove_file(&log);
        let fixed =
            ["class", "class", "-o", output, "--no-jacobians", "--unprotected", "--threads", "1"];
        let run = project.grade(&[&fixed, more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        fs::read_to_string(&log).unwrap_or_default().lines().count()
    };
    let keep = ["--keep-runs", "--resume"];
    let all = class("out", &keep);
    assert_eq!(class("out", &keep), 0);
    assert_eq!(class("out", &["--keep-runs"]), all, "anew where resuming was not asked for");

    // One scene changes: it is run, after the attempt that finds the calling convention.
    project.write("assets/Free/near.xml", &scene("1.75"));
    project.regenerate(".");
    assert_eq!(class("out", &keep), 2);
    assert!(class("anew", &["--resume"]) >= all);
    for file in ["reports/ada.txt", "reports/ada.json", "summary.txt", "summary.csv"] {
        assert_eq!(project.read(&format!("out/{file}")), project.read(&format!("anew/{file}")));
    }
    assert!(!project.path("anew/runs").exists());
    // Its old run is gone, and those of a changed program are not used.
    let runs = || -> Vec<usize> {
        let programs = fs::read_dir(project.path("out/runs")).unwrap();
        programs.map(|entry| fs::read_dir(entry.unwrap().path()).unwrap().count()).collect()
    };
    let before = runs();
    project.write("assets/Free/near.xml", &scene("1.5"));
    project.regenerate(".");
    assert_eq!(class("out", &keep), 2);
    assert_eq!(runs(), before);
    project.program("class/ada", &(logging.clone() + "\n"));
    assert_eq!(class("out", &keep), all);
}

#[test]
fn killed_class_can_be_resumed() {
    let project = Project::new();
    for name in ["ada", "bob", "cleo", "dot"] {
        project.program(&format!("class/{name}"), RIGHT);
    }
    let arguments = ["--format", "text,json", "--resume"];
    project.class(&arguments);
    let files = || {
        let names = ["ada", "bob", "cleo", "dot"].into_iter();
        let mut names: Vec<String> = names
            .flat_map(|name| ["txt", "json"].map(|format| format!("reports/{name}.{format}")))
            .collect();
        names.extend(["summary.txt", "summary.csv"].map(str::to_owned));
        names.into_iter().map(|name| project.read(&format!("out/{name}"))).collect::<Vec<_>>()
    };
    let whole = files();
    let mut random = fastrand::Rng::with_seed(seed());
    for _ in 0..4 {
        let moment = random.u64(0..500);
        fs::remove_dir_all(project.path("out")).unwrap();
        let mut grader =
            command(&project.path(""), &["class", "class", "-o", "out", "--no-jacobians"])
                .args(arguments)
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(moment));
        grader.kill().unwrap();
        grader.wait().unwrap();
        for name in ["ada", "bob", "cleo", "dot"] {
            let report = fs::read_to_string(project.path(&format!("out/reports/{name}.json")));
            let is_whole = report.map_or(true, |text| serde_json::from_str::<Value>(&text).is_ok());
            assert!(is_whole, "killed after {moment} ms: half a report");
        }
        assert_eq!(project.class(&arguments).code, 0);
        assert!(files() == whole, "killed after {moment} ms");
    }
}

#[test]
fn a_class_that_cannot_be_graded_is_refused() {
    let project = Project::with_hidden();
    project.program("class/=ada", RIGHT);
    for (arguments, message) in [
        (&["class", "nowhere", "-o", "out"][..], "nowhere: "),
        (&["class", "expected", "-o", "expected/out"], "is inside the folder of submissions"),
        (&["class", "class", "-o", "class/out"], "is inside the folder of submissions"),
        (&["class", ".", "-o", "../out-of-it"], "is inside the folder of submissions"),
        (
            &["class", "class", "-o", "out", "--readable", "hidden", "--hidden", "hidden"],
            "may read",
        ),
        (&["class", "class", "-o", "out", "--readable", "class"], "may read"),
        (&["class", "class", "-o", "assets/Free/near.xml"], "near.xml"),
        (&["class", "class"], "--output"),
    ] {
        let run = project.grade(arguments);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(message), "{arguments:?}: {}", run.stderr);
    }
    fs::create_dir(project.path("empty")).unwrap();
    let run = project.grade(&["class", "empty", "-o", "out"]);
    assert!(run.code == 2 && run.stderr.contains("no submissions found"), "{}", run.stderr);
    // Spreadsheets do not read names as formulas.
    assert_eq!(project.class(&[]).code, 0);
    assert!(project.row("'=ada").starts_with("'=ada,passed,"));
}

/// A chain of folders too deep for any path.
fn nest(folder: &Path, levels: usize) {
    use rustix::fs::{CWD, Mode, OFlags, mkdirat, openat};
    let open = OFlags::RDONLY | OFlags::DIRECTORY;
    let mut folder = openat(CWD, folder, open, Mode::empty()).unwrap();
    for _ in 0..levels {
        mkdirat(&folder, "d", Mode::RWXU).unwrap();
        folder = openat(&folder, "d", open, Mode::empty()).unwrap();
    }
}

#[test]
fn malformed_hand_in_fails_alone() {
    let project = Project::new();
    let manifest = "build = [\"true\"]\nrun = [\"./x\", \"{scene}\", \"{trace}\"]\n";
    let sparse = |name: &str| {
        let file = fs::File::create(project.path(name)).unwrap();
        file.set_len(16 << 30).unwrap();
        file.set_permissions(fs::Permissions::from_mode(0o755)).unwrap();
    };
    for name in ["deep", "full", "special"] {
        project.write(&format!("class/{name}/submission.toml"), manifest);
    }
    nest(&project.path("class/deep"), 3_000);
    sparse("class/full/data.bin");
    sparse("class/huge");
    for name in ["pipe", "linked", "traces"] {
        fs::create_dir_all(project.path(&format!("class/{name}"))).unwrap();
    }
    let pipe = |name: &str| {
        let mode = rustix::fs::Mode::RWXU;
        rustix::fs::mkfifoat(rustix::fs::CWD, project.path(name), mode).unwrap();
    };
    pipe("class/pipe/submission.toml");
    pipe("class/special/pipe");
    std::os::unix::fs::symlink("/etc/hostname", project.path("class/linked/submission.toml"))
        .unwrap();
    sparse("class/traces/near.csv");
    project.write("class/long/submission.toml", &format!("#{}", "#".repeat(1 << 20)));
    project.program("class/zoe", RIGHT);
    project.program("class/.ada", RIGHT);

    let run = project.class(&[]);
    let removed = Command::new("rm").arg("-rf").arg(project.path("class/deep")).status();
    assert!(removed.unwrap().success());
    assert_eq!(run.code, 3, "{}{}", run.stdout, run.stderr);
    for (name, message) in [
        ("deep", "folders are nested more than 100 deep"),
        ("full", "the files are larger than 1024 MiB together, counted up to data.bin"),
        ("huge", "the files are larger than 1024 MiB together, counted up to the hand-in"),
        ("linked", "submission.toml: is a link"),
        ("long", "submission.toml: is larger than 1 MiB"),
        ("pipe", "submission.toml: is a pipe"),
        ("special", "pipe: is a pipe"),
        ("traces", "counted up to near.csv"),
    ] {
        let row = project.row(name);
        assert!(row.starts_with(&format!("{name},bad-hand-in,0,2,")), "{row}");
        let shown = project.read(&format!("out/reports/{name}.txt"));
        assert!(shown.contains(message), "{shown}");
    }
    assert!(project.row("zoe").starts_with("zoe,passed,"));
    let shown = "skipped: .ada: its name begins with a dot";
    assert!(run.stdout.contains(shown), "{}", run.stdout);

    // By itself it is the verdict as well.
    let run = project.grade(&["class/full", "--no-jacobians"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(run.stdout.contains("No scene was run: bad hand in\n"), "{}", run.stdout);
}

#[test]
fn no_report_is_written_through_a_link() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    project.write("precious", "mine");
    for folder in ["out/reports", "out/resume", "elsewhere", "other"] {
        fs::create_dir_all(project.path(folder)).unwrap();
    }
    let links =
        ["reports/ada.txt", "reports/ada.json", "resume/ada.json", "summary.csv", "summary.txt"];
    let link = |from: &str, to: &str| {
        std::os::unix::fs::symlink(project.path(from), project.path(to)).unwrap();
    };
    for name in links {
        link("precious", &format!("out/{name}"));
    }
    let run = project.class(&[]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(project.read("precious"), "mine");
    for name in links {
        let path = project.path(&format!("out/{name}"));
        assert!(fs::symlink_metadata(&path).unwrap().is_file(), "{name}");
        assert!(fs::metadata(&path).unwrap().len() > 10, "{name}");
    }

    link("elsewhere", "other/reports");
    let run = project.grade(&["class", "class", "-o", "other", "--no-jacobians"]);
    assert!(
        run.code == 2 && run.stderr.contains("other/reports: is a symbolic link, or in one"),
        "{}",
        run.stderr
    );
    assert_eq!(fs::read_dir(project.path("elsewhere")).unwrap().count(), 0);
}

#[test]
fn unjudged_points_are_shown_apart_or_withhold_the_score() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    project.program("class/bob", "#!/bin/sh\nexit 1\n");
    fs::remove_file(project.path("expected/Free/near.csv")).unwrap();
    assert_eq!(project.class(&[]).code, 3);
    assert!(project.row("ada").starts_with("ada,passed,1.5,2,0,0,1.5,0.5,"));
    assert!(project.row("bob").starts_with("bob,failed,0,2,0,0,0,0.5,"), "{}", project.row("bob"));
    let summary = project.read("out/summary.txt");
    assert!(summary.contains("not judged for any submission: Free/near: there is no"), "{summary}");
    assert!(summary.contains("points  not judged"), "{summary}");
    let report = project.read("out/reports/ada.txt");
    assert!(report.contains("Score 1.5 of 2 points, 0.5 not judged\n"), "{report}");

    project.write("assets/rubric.toml", "[faults]\npoints = \"withheld\"\n");
    project.class(&[]);
    assert!(project.row("ada").starts_with("ada,passed,–,2,0,0,–,0.5,"), "{}", project.row("ada"));
    let report = project.json(&["class/ada"]);
    assert_eq!(report["required"]["points_earned"], Value::Null);
    assert_eq!(report["required"]["points_not_judged"], 0.5);

    // If nothing was judged, nothing was earned.
    project.write(
        "assets/rubric.toml",
        "[[feature]]\nintegrator = \"explicit-euler\"\npartial = false\n",
    );
    for name in ["far", "other"] {
        fs::remove_file(project.path(&format!("expected/Free/{name}.csv"))).unwrap();
    }
    project.class(&[]);
    for name in ["ada", "bob"] {
        assert!(project.row(name).starts_with(&format!("{name},grader-fault,–,2,0,0,–,2,")));
    }
    let report = project.read("out/reports/bob.txt");
    assert!(report.contains("Score – of 2 points, 2 not judged\n"), "{report}");
    assert!(report.contains("–/1           1  FAULT"), "{report}");
}

#[test]
fn hostile_output_leaves_reports_well_formed() {
    use quick_xml::events::Event;
    let project = Project::new();
    let hostile = "#!/bin/sh\nprintf 'a\\357\\277\\276b\\357\\277\\277c\\001\\010\\033[31m\\177\\302\\233]]>' >&2\n\
                   printf '<!-- & &#0; \"\\377\\355\\240\\200\\342\\200\\256\\000 '\"$PWD\" >&2; exit 1\n";
    project.program("hostile", hostile);
    project.write(
        "mine/submission.toml",
        "name = \"m\\uffff\\u0001]]>\"\nrun = [\"./x\\uffff\", \"{scene}\", \"{trace}\"]\n",
    );
    for submission in ["hostile", "mine"] {
        let junit = project.grade(&[submission, "--no-jacobians", "--format", "junit"]);
        assert_eq!(junit.code, 1, "{}", junit.stderr);
        let mut reader = quick_xml::Reader::from_str(&junit.stdout);
        let mut text = String::new();
        loop {
            match reader.read_event().unwrap() {
                Event::Eof => break,
                Event::Start(tag) | Event::Empty(tag) => {
                    for attribute in tag.attributes() {
                        let version = quick_xml::XmlVersion::Implicit1_0;
                        let value = attribute.unwrap();
                        text += &value.normalized_value(version).unwrap();
                    }
                }
                _ => {}
            }
        }
        let is_character = |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
        for character in junit.stdout.chars().chain(text.chars()) {
            assert!(is_character(character), "{character:?} in {}", junit.stdout);
        }
        assert!(junit.stdout.contains("]]&gt;") || submission == "mine", "{}", junit.stdout);
        assert!(!junit.stdout.contains("spring-oracle-"), "{}", junit.stdout);
    }
}

#[test]
fn missing_protections_cause_a_warning() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    let run = project.class(&["--unprotected"]);
    assert!(run.stdout.contains("  Run without protection.\n"), "{}", run.stdout);
    let report = project.json(&["class/ada", "--unprotected"]);
    assert_eq!(report["protection_missing"].as_array().unwrap().len(), 7);
}

#[test]
fn killed_program_is_reported_with_its_signal() {
    let project = Project::new();
    project.program("program", &RIGHT.replace("awk", "grep -q 150 \"$1\" && kill -SEGV $$\nawk"));
    let run = project.grade(&["program", "--no-jacobians", "--only", "far"]);
    assert!(run.stdout.contains("killed by SIGSEGV\n"), "{}", run.stdout);
}

/// Passes what [`RIGHT`] passes, but never ends on scenes with this number.
fn endless(number: &str, mark: &Path) -> String {
    let wait = format!("grep -q {number} \"$1\" && {{ touch '{}'; sleep 600; }}", mark.display());
    RIGHT.replace("awk", &format!("{wait}\nawk"))
}

/// Starts `grade`, sends SIGINT twice, as `timeout` does, as soon as this file exists, and waits for its end. Scratch
/// folders are in `tmp`.
pub(super) fn interrupted(project: &Project, arguments: &[&str], once: &Path) -> Run {
    use rustix::process::{Pid, Signal, kill_process};
    use std::process::Stdio;
    fs::create_dir_all(project.path("tmp")).unwrap();
    let mut command = command(&project.path(""), arguments);
    command.env("TMPDIR", project.path("tmp"));
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !once.exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    for _ in 0..2 {
        kill_process(Pid::from_child(&child), Signal::INT).unwrap();
        // Signals that are not received yet count once.
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let output = child.wait_with_output().unwrap();
    let left: Vec<_> = fs::read_dir(project.path("tmp")).unwrap().flatten().collect();
    assert!(left.is_empty(), "{left:?}");
    let text = |bytes| String::from_utf8(bytes).unwrap();
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    Run { code: output.status.code().unwrap_or(-1), stdout, stderr }
}

#[test]
fn interrupted_run_removes_its_folders_and_reports_progress() {
    let project = Project::new();
    let mark = project.path("started");
    project.program("program", &endless("150", &mark));
    let limit = ["--limit", "wall=600", "--threads", "1"];
    let common = ["./program", "--unprotected", "--no-jacobians", "--only", "far"];
    for format in ["text", "json"] {
        let _ = fs::remove_file(&mark);
        let arguments = [&common[..], &limit, &["--format", format]].concat();
        let run = interrupted(&project, &arguments, &mark);
        assert_eq!(run.code, 130, "{}", run.stderr);
        assert!(run.stderr.ends_with("interrupted: 0 of 1 scenes graded\n"), "{}", run.stderr);
        let report =
            if format == "text" { "Interrupted: 0 of 1 scenes graded; no score.\n" } else { "" };
        assert!(run.stdout.ends_with(report) && !run.stdout.contains("crash"), "{}", run.stdout);
    }
}

#[test]
fn interrupted_class_keeps_its_rows_and_can_be_resumed() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    project.program("class/bob", &endless("150", Path::new("mark")));
    let arguments = ["class", "class", "-o", "out", "--no-jacobians", "--limit", "wall=600"];
    let run = interrupted(&project, &arguments, &project.path("out/resume/ada.json"));
    assert_eq!(run.code, 130, "{}", run.stderr);
    assert!(run.stderr.contains("interrupted: 1 of 2 submissions graded\n"), "{}", run.stderr);
    let partial = "Partial: interrupted, 1 of 2 submissions graded.";
    assert!(run.stdout.contains(partial) && project.read("out/summary.txt").contains(partial));
    assert!(project.row("ada").starts_with("ada,passed,"));
    assert_eq!(project.row("bob"), format!("bob,interrupted{}", ",".repeat(14)));
    assert!(!project.path("out/resume/bob.json").exists());

    project.program("class/bob", RIGHT);
    let run = project.class(&["--limit", "wall=600", "--resume"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(project.row("bob").starts_with("bob,passed,"));
}
