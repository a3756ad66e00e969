//! Plans of a class: shards and merges that run in any order, twice, or not to their end.

use needs::needs;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use fastrand::Rng;
use serde_json::Value;
use test_support::seed;

use crate::class::{Project, RIGHT};

/// Submissions: seven programs, two of them wrong, and three equal folders.
const NAMES: [&str; 10] =
    ["ada", "bob", "cleo", "dot", "eve", "fay", "gus", "same-a", "same-b", "same-c"];

/// Options of all runs of these tests. Without the sandbox they take a third of the time.
const COMMON: [&str; 7] =
    ["--unprotected", "--no-jacobians", "--threads", "1", "--format", "text,json", "--no-progress"];

fn project() -> Project {
    let project = Project::new();
    for name in &NAMES[..7] {
        let text = match *name {
            "cleo" => RIGHT.replace("dt * vx", "vx"),
            "eve" => "#!/bin/sh\nexit 3\n".to_owned(),
            _ => format!("{RIGHT}# {name}\n"),
        };
        project.program(&format!("class/{name}"), &text);
    }
    for name in &NAMES[7..] {
        project.write(
            &format!("class/{name}/submission.toml"),
            "run = [\"./run\", \"{scene}\", \"-o\", \"{trace}\"]\n",
        );
        project.program(&format!("class/{name}/run"), RIGHT);
    }
    project
}

/// The files of the results that do not depend on where and when they were made.
fn results(project: &Project, folder: &str) -> Vec<(String, String)> {
    let reports = NAMES
        .iter()
        .flat_map(|name| ["txt", "json"].map(|extension| format!("reports/{name}.{extension}")));
    let files = ["summary.txt", "summary.csv"].map(str::to_owned).into_iter().chain(reports);
    files.map(|name| (project.read(&format!("{folder}/{name}")), name)).collect()
}

/// The command `grade class` with these arguments.
fn grade(project: &Project, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grade"));
    command.current_dir(project.path("")).arg("class").args(arguments);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn start(project: &Project, arguments: &[&str]) -> Child {
    grade(project, arguments).spawn().unwrap()
}

/// Plans `class` in `out` with further options, and returns the number of shards.
fn plan(project: &Project, options: &[&str]) -> usize {
    let arguments =
        [&["class", "class", "-o", "out", "--on", "nothing"], options, &COMMON].concat();
    let run = project.grade(&arguments);
    assert_eq!(run.code, 0, "{}", run.stderr);
    shards(project)
}

fn shards(project: &Project) -> usize {
    let plan: Value = serde_json::from_str(&project.read("out/plan.json")).unwrap();
    plan["record"]["shards"].as_array().unwrap().len()
}

/// The results of one machine, in `whole`, and the project.
fn with_whole() -> (Project, Vec<(String, String)>) {
    let project = project();
    let run = project.grade(&[&["class", "class", "-o", "whole"], &COMMON[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let whole = results(&project, "whole");
    (project, whole)
}

#[test]
fn result_bytes_do_not_depend_on_shard_order_or_repetition() {
    let (project, whole) = with_whole();
    for (options, twice) in [(&["--shards", "4"][..], false), (&["--shards", "9"], true)] {
        let _ = fs::remove_dir_all(project.path("out"));
        let count = plan(&project, options);
        // Equal submissions are in the same shard.
        assert_eq!(count, options[1].parse::<usize>().unwrap().min(8));
        let shard =
            |number: usize| start(&project, &["run-shard", "out/plan.json", &number.to_string()]);
        let mut running: Vec<Child> = Vec::new();
        for number in (0..count).rev() {
            running.extend((0..if twice { 2 } else { 1 }).map(|_| shard(number)));
        }
        for child in running {
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        let run = project.grade(&["class", "merge", "out/plan.json"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(results(&project, "out") == whole);
        assert_eq!(run.stdout, project.read("out/summary.txt"));
    }
    let run = project.grade(&["class", "run-shard", "out/plan.json", "99"]);
    assert!(run.code == 2 && run.stderr.contains("there is no shard 99"), "{}", run.stderr);
}

#[test]
fn plan_runs_under_another_scheduler() {
    let (project, whole) = with_whole();
    let count = plan(&project, &["--shards", "5"]);
    let grade = env!("CARGO_BIN_EXE_grade");
    let command = format!(
        "seq 0 {} | xargs -n 1 -P 3 '{grade}' class run-shard out/plan.json && '{grade}' class merge out/plan.json",
        count - 1
    );
    let mut shell = Command::new("sh");
    let output = shell.args(["-c", &command]).current_dir(project.path("")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(results(&project, "out") == whole);
}

/// Kills planners, shards and merges at random moments, until 5 were killed, or as many as `KILLS` says; each time, the
/// rest of the work gives the same bytes.
#[test]
fn resume_completes_killed_runs() {
    let wanted = std::env::var("KILLS").map_or(5, |text| text.parse().unwrap());
    let (project, whole) = with_whole();
    let mut random = Rng::with_seed(seed());
    let resume = ["class", "-o", "out", "--resume", "--shards", "3"];
    let whole_run = [&resume[..], &COMMON].concat();
    let planning = [&resume[..], &["--on", "nothing"], &COMMON].concat();
    let merge = ["merge", "out/plan.json"];
    let shard =
        |number: usize| ["run-shard", "out/plan.json", &number.to_string()].map(str::to_owned);
    // How long each takes here says when it may be killed.
    let lasting = |arguments: &[&str]| {
        let start_of_run = Instant::now();
        start(&project, arguments).wait().unwrap();
        start_of_run.elapsed()
    };
    let run_lasts = lasting(&whole_run);
    let merge_lasts = lasting(&merge);
    fs::remove_dir_all(project.path("out")).unwrap();
    let planning_lasts = lasting(&planning);
    let shard_lasts = lasting(&shard(0).each_ref().map(String::as_str));
    let mut killed = 0;
    let mut kill_within = |mut child: Child, longest: Duration| {
        thread::sleep(longest.mul_f64(random.f64()));
        killed += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        killed
    };
    let mut round = 0;
    loop {
        round += 1;
        assert!(round <= wanted, "the programs end before they are killed");
        let _ = fs::remove_dir_all(project.path("out"));
        // The planner of a run on this machine also runs the shards and the merge.
        kill_within(start(&project, &whole_run), run_lasts);
        kill_within(start(&project, &planning), planning_lasts);
        let count = plan(&project, &["--resume", "--shards", "3"]);
        for number in 0..count {
            let shard = shard(number);
            let shard = shard.each_ref().map(String::as_str);
            let (first, second) = (start(&project, &shard), start(&project, &shard));
            kill_within(first, shard_lasts);
            kill_within(second, shard_lasts);
        }
        let all = kill_within(start(&project, &merge), merge_lasts);
        for (_, name) in &whole {
            let text = fs::read_to_string(project.path("out").join(name)).unwrap_or_default();
            let is_whole = !name.ends_with(".json") || serde_json::from_str::<Value>(&text).is_ok();
            assert!(text.is_empty() || is_whole, "half of {name}");
        }
        // Merging names every gap.
        let run = project.grade(&["class", "merge", "out/plan.json"]);
        let gaps = project.read("out/summary.csv").matches(",interrupted,").count();
        let message = format!("{} of 10 submissions graded\n", 10 - gaps);
        assert_eq!(run.code, if gaps > 0 { 130 } else { 0 }, "{}", run.stderr);
        assert!(gaps == 0 || run.stderr.contains(&message), "{}", run.stderr);
        let run = project.grade(&[&["class"], &whole_run[..]].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(results(&project, "out") == whole, "round {round}");
        if all >= wanted {
            return;
        }
    }
}

#[test]
fn resume_replaces_damaged_results() {
    let (project, whole) = with_whole();
    plan(&project, &["--shards", "1"]);
    assert_eq!(project.grade(&["class", "run-shard", "out/plan.json", "0"]).code, 0);
    for (name, text) in [
        ("resume/ada.json", "{\"fingerprint\": "),
        ("resume/bob.json", ""),
        ("reports/dot.json", "{}"),
        ("reports/fay.txt", ""),
    ] {
        fs::write(project.path("out").join(name), text).unwrap();
    }
    fs::remove_file(project.path("out/resume/same-b.json")).unwrap();
    // Points that eve gave herself, and the record of another submission.
    let edit = |name: &str, text: String| fs::write(project.path(name), text).unwrap();
    let record = project.read("out/resume/eve.json");
    let forged = record.replace("\"points\": \"0\"", "\"points\": \"3\"");
    assert_ne!(record, forged);
    edit("out/resume/eve.json", forged);
    edit("out/resume/same-c.json", project.read("out/resume/same-a.json"));
    let run = project.grade(&["class", "merge", "out/plan.json"]);
    assert_eq!(run.code, 130, "{}", run.stderr);
    let csv = project.read("out/summary.csv");
    let gaps = |verdict: &str| -> Vec<&str> {
        let verdict = format!(",{verdict},");
        let lines = csv.lines().filter_map(|line| line.split_once(verdict.as_str()));
        lines.map(|(name, _)| name).collect()
    };
    assert_eq!(gaps("interrupted"), ["dot", "fay", "same-b"]);
    assert_eq!(gaps("altered"), ["ada", "bob", "eve", "same-c"]);
    let line = "  not graded: eve: its record was edited, or is not of this class\n";
    assert!(run.stdout.contains(line), "{}", run.stdout);
    let run = project.grade(&[&["class", "class", "-o", "out", "--resume"], &COMMON[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let note = "note: eve: its record was edited, or is not of this class; graded again";
    assert!(run.stderr.contains(note), "{}", run.stderr);
    assert!(results(&project, "out") == whole);
}

#[test]
fn changes_since_the_plan_are_named() {
    let (project, whole) = with_whole();
    plan(&project, &["--shards", "2"]);
    project.program("class/bob", &format!("{RIGHT}# changed\n"));
    let codes = ["0", "1"].map(|shard| {
        let run = project.grade(&["class", "run-shard", "out/plan.json", shard]);
        (run.code, run.stderr.contains("bob: changed after it was planned; not graded"))
    });
    assert!(codes.contains(&(3, true)) && codes.contains(&(0, false)), "{codes:?}");
    let run = project.grade(&["class", "merge", "out/plan.json"]);
    assert_eq!(run.code, 130, "{}", run.stderr);
    assert!(project.row("bob").starts_with("bob,changed,"), "{}", project.row("bob"));
    assert!(run.stdout.contains("not graded: bob: changed after it was planned"), "{}", run.stdout);

    // A changed scene, or other options, make every part of the plan stop.
    let near = project.read("assets/Free/near.xml");
    project.write("assets/Free/near.xml", &near.replace("1.5", "1.625"));
    for part in
        [&["class", "run-shard", "out/plan.json", "0"][..], &["class", "merge", "out/plan.json"]]
    {
        let run = project.grade(part);
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains("changed after the plan was made"), "{}", run.stderr);
    }
    project.write("assets/Free/near.xml", &near);
    project.program("class/bob", &format!("{RIGHT}# bob\n"));
    let run = project.grade(&[&["class", "class", "-o", "out", "--resume"], &COMMON[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(results(&project, "out") == whole);
}

#[test]
fn a_submission_or_scene_that_changes_while_it_is_graded_has_no_result() {
    let project = Project::new();
    let waiting = RIGHT.replace("awk", "touch started; sleep 0.3\nawk");
    let waiting = waiting.replace("started", &project.path("started").display().to_string());
    for (name, changed) in [
        ("class/ada", waiting.replace("awk", " awk")),
        ("assets/Free/far.xml", { project.read("assets/Free/far.xml").replace("150", "151") }),
    ] {
        let old = project.read("assets/Free/far.xml");
        let _ = fs::remove_file(project.path("started"));
        project.program("class/ada", &waiting);
        let options = ["class", "-o", "out"];
        let child = start(&project, &[&options[..], &COMMON].concat());
        while !project.path("started").exists() {
            thread::sleep(Duration::from_millis(5));
        }
        project.write(name, &changed);
        let output = child.wait_with_output().unwrap();
        let shown = String::from_utf8_lossy(&output.stderr);
        assert!(shown.contains("changed"), "{name}: {shown}");
        assert_ne!(output.status.code(), Some(0), "{shown}");
        assert!(!project.path("out/resume/ada.json").exists());
        project.write("assets/Free/far.xml", &old);
    }
}

#[test]
fn equal_submissions_are_graded_once() {
    let project = Project::new();
    let log = project.path("log").display().to_string();
    let text = RIGHT.replace("awk", &format!("echo run >> {log}\nawk"));
    let submission = |name: &str| {
        let toml = "run = [\"sh\", \"{folder}/run\", \"{scene}\", \"-o\", \"{trace}\"]\n";
        project.write(&format!("class/{name}/submission.toml"), toml);
        project.program(&format!("class/{name}/run"), &text);
    };
    let runs = || {
        let run = project.class(&["--unprotected"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        let runs = project.read("log").lines().count();
        fs::remove_file(project.path("log")).unwrap();
        runs
    };
    submission("ada");
    let once = runs();
    submission("bob");
    submission("cleo");
    assert_eq!(runs(), once);
    for name in ["ada", "bob", "cleo"] {
        let report = project.read(&format!("out/reports/{name}.txt"));
        assert!(report.contains(&format!("Summary for {name}")), "{report}");
    }
    let rows = ["ada", "bob", "cleo"].map(|name| project.row(name).replacen(name, "", 1));
    assert!(rows[0] == rows[1] && rows[1] == rows[2], "{rows:?}");
    let summary = project.read("out/summary.txt");
    assert!(summary.contains("  equal hand-ins: ada, bob, cleo\n"), "{summary}");
}

#[test]
fn plan_runs_where_it_was_moved() {
    let (project, whole) = with_whole();
    let count = plan(&project, &["--shards", "3"]);
    // Below another folder, as another machine may mount it.
    for name in ["assets", "expected", "class", "out"] {
        let moved = project.path("elsewhere").join(name);
        fs::create_dir_all(moved.parent().unwrap()).unwrap();
        fs::rename(project.path(name), moved).unwrap();
    }
    for shard in 0..count {
        let run =
            project.grade(&["class", "run-shard", "elsewhere/out/plan.json", &shard.to_string()]);
        assert_eq!(run.code, 0, "{}", run.stderr);
    }
    let run = project.grade(&["class", "merge", "elsewhere/out/plan.json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(results(&project, "elsewhere/out") == whole);
}

/// A full disk: a file system of 64 KiB holds the results of a few submissions only.
#[needs("test $(id -u) = 0")]
#[test]
fn resume_completes_after_a_full_disk() {
    let (project, whole) = with_whole();
    let disk = project.path("out");
    fs::create_dir(&disk).unwrap();
    let mounted = Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=64k", "none"])
        .arg(&disk)
        .stderr(Stdio::null())
        .status();
    assert!(mounted.unwrap().success());
    let unmount = Unmount(&disk);
    let count = plan(&project, &["--shards", "3"]);
    let mut full = 0;
    let mut printed = String::new();
    for number in 0..count {
        let run = project.grade(&["class", "run-shard", "out/plan.json", &number.to_string()]);
        full += usize::from(run.code == 2 && run.stderr.contains("No space left"));
        printed += &format!("{}: {}\n", run.code, run.stderr);
    }
    assert!(full > 0, "the disk is too large for this test: {printed}");
    let remount = |size: &str| {
        let option = format!("remount,size={size}");
        let status = Command::new("mount").args(["-o", &option]).arg(&disk).status();
        assert!(status.unwrap().success());
    };
    remount("16M");
    let run = project.grade(&["class", "merge", "out/plan.json"]);
    assert_eq!(run.code, 130, "{}", run.stderr);
    assert!(project.read("out/summary.csv").contains(",interrupted,"));
    let run = project.grade(&[&["class", "class", "-o", "out", "--resume"], &COMMON[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(results(&project, "out") == whole);
    drop(unmount);
}

/// Unmounts a folder on drop.
struct Unmount<'a>(&'a Path);

impl Drop for Unmount<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}
