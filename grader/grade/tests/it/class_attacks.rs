//! Attacks of submissions on the class that they are graded in.

use std::fs;
use std::os::unix::fs::symlink;

use crate::class::{Project, RIGHT};

/// A copy of the oracle's traces as a submission.
fn copied_traces(project: &Project, name: &str) {
    for scene in ["near", "far", "other"] {
        let trace = project.read(&format!("expected/Free/{scene}.csv"));
        project.write(&format!("{name}/Free/{scene}.csv"), &trace);
    }
}

#[test]
fn oracle_copy_earns_no_credit_in_a_class() {
    let project = Project::with_hidden();
    copied_traces(&project, "class/eve");
    let run = project.class(&["--hidden", "hidden"]);
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert_eq!(project.row("eve"), "eve,bad-hand-in,0,3,0,0,0,0,0,3,0,2,,,,");
    let shown = project.read("out/reports/eve.txt");
    assert!(shown.contains("traces alone show no program that made them"), "{shown}");
    // If the rubric allows folders of traces, missing hidden scenes fail.
    project.write("assets/rubric.toml", "[class]\ntraces = true\n");
    project.class(&["--hidden", "hidden"]);
    assert!(project.row("eve").starts_with("eve,failed,"), "{}", project.row("eve"));
    assert!(project.row("eve").ends_with(",3,3,0,2,,,,"), "{}", project.row("eve"));
    let shown = project.read("out/reports/eve.json");
    assert!(shown.contains("\"missing\": 1"), "{shown}");
}

#[test]
fn submission_names_do_not_collide_with_class_files() {
    let project = Project::new();
    let long = "x".repeat(250);
    let names = [
        "index.html",
        "scenes",
        "assets",
        "submissions",
        "ADA",
        "ada",
        "e\u{301}",
        "é",
        "con",
        "..a",
        "a..",
        &long,
    ];
    for name in names {
        let manifest = "run = [\"./run\", \"{scene}\", \"-o\", \"{trace}\"]\n";
        project.write(&format!("class/{name}/submission.toml"), manifest);
        project.program(&format!("class/{name}/run"), RIGHT);
    }
    for _ in 0..2 {
        let run = project.class(&["--html", "pages"]);
        assert_eq!(run.code, 3, "{}", run.stderr);
        let front = project.read("pages/index.html");
        let links: Vec<&str> = front
            .split("<th scope=\"row\"><a href=\"")
            .skip(1)
            .filter_map(|rest| rest.split('"').next())
            .collect();
        // A name that begins with a dot is skipped.
        assert_eq!(links.len(), names.len() - 1);
        assert!(run.stdout.contains("skipped: ..a"), "{}", run.stdout);
        let mut targets: Vec<_> = links
            .iter()
            .map(|link| project.path(&format!("pages/{link}")).canonicalize().unwrap())
            .collect();
        targets.sort();
        targets.dedup();
        assert_eq!(targets.len(), links.len());
        for page in targets {
            assert!(
                page.with_file_name("scenes").join("Free/near.html").is_file(),
                "{}",
                page.display()
            );
        }
    }
}

#[test]
fn upload_named_after_another_student_does_not_stop_the_class() {
    let project = Project::new();
    project.write("roster.csv", "name,id\nAda,1001\nBob,1002\nEve,1003\n");
    for name in ["ada_1001_x", "bob_1002_x", "1001", "1003_1002"] {
        project.program(&format!("class/{name}"), RIGHT);
    }
    let run = project.class(&["--roster", "roster.csv", "--gradebook", "moodle=moodle.csv"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    for line in [
        "  roster.csv: 1 of 3 students have a submission\n",
        "two submissions: Ada (line 2): 1001, ada_1001_x; none of them counts until the column folder names one\n",
        "whose is it: 1003_1002 fits Bob (line 3), Eve (line 4); it counts for nobody until",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
    assert!(!run.stdout.contains("no submission: Ada"), "{}", run.stdout);
    assert_eq!(project.read("moodle.csv"), "ID number,Spring Oracle\n1002,2\n");
}

#[test]
fn submission_links_are_not_written_through() {
    let project = Project::new();
    project.program("class/ada", RIGHT);
    for name in ["mine", "pages/submissions", "out/reports"] {
        fs::create_dir_all(project.path(name)).unwrap();
    }
    let link = |to: &str| symlink(project.path("mine"), project.path(to)).unwrap();
    fs::create_dir(project.path("class/eve")).unwrap();
    link("class/eve/results");
    link("class/results");
    let is_empty = || fs::read_dir(project.path("mine")).unwrap().next().is_none();
    for output in
        ["class/eve/results", "class/results", "class/eve/results/deep", "class/results/../out"]
    {
        for more in [&["--html", "elsewhere"][..], &["--similar"]] {
            let run = project.grade(&[&["class", "class", "-o", output], more].concat());
            assert!(
                run.code == 2 && run.stderr.contains("is inside the folder of submissions"),
                "{}",
                run.stderr
            );
        }
        let run = project.grade(&["class", "class", "-o", "out", "--html", output]);
        assert!(
            run.code == 2 && run.stderr.contains("is inside the folder of submissions"),
            "{}",
            run.stderr
        );
        assert!(is_empty(), "{output}");
    }
    // Links where folders of ours would be.
    project.program("class/eve/run", RIGHT);
    project.write("pages/index.html", "<meta name=\"generator\" content=\"Spring Oracle\">");
    for (folder, options) in [
        ("pages/submissions/ada", &["--html", "pages"][..]),
        ("out/runs", &["--keep-runs"]),
        ("out/resume", &[]),
    ] {
        let _ = fs::remove_dir_all(project.path(folder));
        link(folder);
        let run = project.class(options);
        assert!(
            run.code == 2 && run.stderr.contains("is a symbolic link"),
            "{folder}: {}",
            run.stderr
        );
        assert!(is_empty(), "{folder}");
        fs::remove_file(project.path(folder)).unwrap();
    }
}

#[test]
fn gallery_ignores_scenes_behind_links() {
    let project = Project::with_hidden();
    project.write("class/ada/Creative/ada_all.xml", &project.read("assets/Free/near.xml"));
    let folder = project.path("class/eve/Creative");
    fs::create_dir_all(&folder).unwrap();
    symlink(project.path("hidden/assets/Free/moonlight.xml"), folder.join("eve_all.xml")).unwrap();
    let run = project.grade(&["gallery", "class", "-o", "gallery", "--root", "."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let page = project.read("gallery/index.html");
    assert!(
        page.contains("ada_all.xml") && page.contains("is a link, not a regular file"),
        "{page}"
    );
    assert!(!page.contains("0.87654321"), "{page}");
}

#[test]
fn github_workflow_refuses_hidden_scenes() {
    let project = Project::with_hidden();
    let export = |arguments: &[&str]| {
        let common = ["export", "github", "--repository", "course/oracle", "-o", "template"];
        project.grade(&[&common[..], arguments].concat())
    };
    let message =
        "students can edit the pipeline, and read what it reads: hidden scenes stay out of it";
    let run = export(&["--hidden", "hidden"]);
    assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
    // Those of the rubric, in the repository that the workflow checks out.
    project.write("assets/rubric.toml", "[hidden]\nfolder = \"../hidden\"\n");
    let run = export(&[]);
    assert!(run.code == 2 && run.stderr.contains(message), "{}", run.stderr);
    assert!(!project.path("template").exists());
    fs::rename(project.path("hidden"), project.path("secret")).unwrap();
    let run = export(&[]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let workflow = project.read("template/.github/workflows/grade.yml");
    assert!(
        workflow.contains("must hold no hidden scenes") && !workflow.contains("--hidden hidden"),
        "{workflow}"
    );
}

/// Adds a correct program that logs the scenes on which it runs.
fn logging(project: &Project, name: &str, more: &str) {
    let log = project.path("log").display().to_string();
    let text =
        format!("grep -o 'px=\"[0-9.]*' \"$1\" | sed 's/^/{name} /' >> {log}\n{more}\nawk -F");
    project.program(&format!("class/{name}"), &RIGHT.replace("awk -F", &text));
}

/// The scenes that ran since the last call: a program's name, and whether it is a hidden scene.
fn ran(project: &Project) -> Vec<(String, bool)> {
    let log = fs::read_to_string(project.path("log")).unwrap_or_default();
    let _ = fs::remove_file(project.path("log"));
    let is_hidden = |line: &str| line.contains("0.87654321") || line.contains("0.76543219");
    log.lines().map(|line| (line[..3].to_owned(), is_hidden(line))).collect()
}

/// Without the sandbox, so that programs can write to a log.
const HIDDEN: [&str; 6] =
    ["--hidden", "hidden", "--unprotected", "--no-jacobians", "--threads", "1"];

/// The rubric's word that hidden scenes run without the sandbox.
const UNPROTECTED: &str = "[protection]\nhidden-without-namespaces = true\n";

fn with_hidden_unprotected() -> Project {
    let project = Project::with_hidden();
    project.write("assets/rubric.toml", UNPROTECTED);
    project
}

#[test]
fn hidden_scenes_without_namespaces_need_the_rubrics_word() {
    let project = Project::with_hidden();
    logging(&project, "ada", "");
    let n_hidden = || {
        let run = project.grade(&[&["class", "class", "-o", "out"], &HIDDEN[..]].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        let ran = ran(&project);
        assert!(ran.len() > 3, "{ran:?}");
        ran.iter().filter(|(_, is_hidden)| *is_hidden).count()
    };
    assert_eq!(n_hidden(), 0);
    let reason = "2 hidden scenes were not run: this system refuses programs their own namespaces";
    let shown = project.read("out/reports/ada.txt");
    // Lines are wrapped.
    let words: Vec<&str> = shown.split_whitespace().collect();
    assert!(words.join(" ").contains(reason), "{shown}");
    project.write("assets/rubric.toml", UNPROTECTED);
    assert_eq!(n_hidden(), 2);
}

#[test]
fn hidden_scenes_run_after_all_shipped_scenes() {
    let project = with_hidden_unprotected();
    for name in ["ada", "bob", "eve"] {
        logging(&project, name, "");
    }
    let class = |options: &[&str]| {
        let run = project.grade(&[&["class", "class", "-o"], options].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        ran(&project)
    };
    let both = class(&[&["out"], &HIDDEN[..]].concat());
    let first = both.iter().position(|(_, is_hidden)| *is_hidden).unwrap();
    assert!(both[first..].iter().all(|(_, is_hidden)| *is_hidden), "{both:?}");
    assert_eq!(both.len() - first, 3 * 2, "{both:?}");
    for name in ["ada", "bob", "eve"] {
        assert_eq!(project.row(name), format!("{name},passed,3,3,0,0,3,0,3,3,2,2,,,,"));
    }
    assert!(!project.path("out/first-phase").exists());
    // Kept runs are those of both phases.
    let keep = [&["kept", "--keep-runs"], &HIDDEN[..]].concat();
    assert_eq!(class(&keep), both);
    fs::remove_dir_all(project.path("kept/resume")).unwrap();
    assert!(class(&[&keep[..], &["--resume"]].concat()).is_empty());
}

#[test]
fn shards_run_their_hidden_scenes_after_all_shards() {
    let project = with_hidden_unprotected();
    for name in ["ada", "bob", "eve"] {
        logging(&project, name, "");
    }
    let run = project.grade(&[&["class", "class", "-o", "whole"], &HIDDEN[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let all = ran(&project).len();
    let plan = ["class", "class", "-o", "out", "--on", "nothing", "--shards", "3"];
    let run = project.grade(&[&plan[..], &HIDDEN].concat());
    assert!(run.stdout.contains("run-shard out/plan.json K --hidden-scenes"), "{}", run.stdout);
    let shard = |number: &str, options: &[&str]| {
        project.grade(&[&["class", "run-shard", "out/plan.json", number], options].concat())
    };
    let hidden = ["--hidden-scenes"];
    for number in ["2", "0"] {
        assert_eq!(shard(number, &[]).code, 0);
        let run = shard(number, &hidden);
        assert!(
            run.code == 3 && run.stderr.contains("hidden scenes run after those of all"),
            "{}",
            run.stderr
        );
    }
    assert!(ran(&project).iter().all(|(_, is_hidden)| !is_hidden));
    // Nothing is finished yet. The rest is run, and nothing twice.
    assert_eq!(project.grade(&["class", "merge", "out/plan.json"]).code, 130);
    assert_eq!(shard("1", &[]).code, 0);
    assert_eq!(shard("1", &hidden).code, 0);
    let before = ran(&project).len();
    let resumed = ["class", "class", "-o", "out", "--resume"];
    let run = project.grade(&[&resumed[..], &HIDDEN].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let rest = ran(&project);
    assert_eq!((rest.len(), rest.iter().all(|(_, is_hidden)| *is_hidden)), (4, true), "{rest:?}");
    assert_eq!(3 * before, all, "no run is repeated");
    for file in ["summary.csv", "reports/ada.json", "reports/bob.txt", "reports/eve.json"] {
        assert_eq!(
            project.read(&format!("out/{file}")),
            project.read(&format!("whole/{file}")),
            "{file}"
        );
    }
}

#[test]
fn output_after_hidden_scenes_is_not_shown() {
    let project = with_hidden_unprotected();
    // One program leaves what it saw, and says so; the build of another shows it.
    let seen = project.path("seen").display().to_string();
    let telling = format!(
        "grep 0.8765 \"$1\" > /dev/null && {{ cp \"$1\" {seen}; cat \"$1\" >&2; exit 1; }}"
    );
    logging(&project, "ada", &telling);
    project.program("class/eve/run", RIGHT);
    let build = format!("if [ -e {seen} ]; then cat {seen}; exit 1; fi; cp run built");
    let manifest = format!(
        "build = [\"sh\", \"-c\", \"{build}\"]\nrun = [\"./built\", \"{{scene}}\", \"-o\", \"{{trace}}\"]\n"
    );
    project.write("class/eve/submission.toml", &manifest);
    // A message names a trace of the first phase as it names any other.
    let malformed = "grep -q 'px=\"150\"' \"$1\" && echo bad >> \"$3\"; true\n";
    project.program("class/mal", &format!("{RIGHT}{malformed}"));
    let options = ["--html", "pages", "--format", "text,json,junit"];
    let run = project.grade(&[&["class", "class", "-o", "out"], &HIDDEN[..], &options].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(project.path("seen").exists());
    assert!(project.row("ada").ends_with(",3,3,1,2,,,,"), "{}", project.row("ada"));
    assert!(project.row("eve").ends_with(",3,3,0,2,,,,"), "{}", project.row("eve"));
    let shown = project.read("out/reports/mal.txt");
    assert!(shown.contains("  trace:5: ") && !shown.contains("first-phase"), "{shown}");
    let files = std::process::Command::new("grep")
        .args(["-rlE", "0\\.8765|moonlight|Starlight|COMMENT", "out", "pages"])
        .current_dir(project.path(""))
        .output()
        .unwrap();
    assert_eq!(String::from_utf8(files.stdout).unwrap(), "");
    assert!(!run.stdout.contains("0.8765") && !run.stderr.contains("0.8765"), "{}", run.stderr);
}

#[test]
fn a_hand_in_has_a_budget_of_time() {
    let project = Project::with_hidden();
    project.write("assets/rubric.toml", &format!("[limits]\nbudget = 1\n{UNPROTECTED}"));
    logging(&project, "ada", "sleep 0.6");
    let run = project.grade(&[&["class", "class", "-o", "out"], &HIDDEN[..]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let scenes: Vec<bool> = ran(&project).into_iter().map(|(_, is_hidden)| is_hidden).collect();
    assert!(!scenes.contains(&true), "{scenes:?}");
    let row = project.row("ada");
    assert!(row.starts_with("ada,failed,") || row.starts_with("ada,not-run,"), "{row}");
    assert!(row.ends_with(",0,2,,,,"), "{row}");
    let shown = project.read("out/reports/ada.txt");
    assert!(shown.contains("not run: the hand-in used its budget of 1 s"), "{shown}");
    let shown = project.read("out/reports/ada.json");
    assert!(
        shown.contains("\"verdict\": \"not-run\"") && shown.contains("\"not-run\": 1"),
        "{shown}"
    );
}

/// Runs every job at once, and prints its number.
const SBATCH: &str = r#"#!/bin/sh
printf '%s\n' "$*" >> jobs
array= wrap=
while [ $# -gt 0 ]; do
  case "$1" in --array=*) array=${1#--array=} ;; --wrap) shift; wrap=$1 ;; esac
  shift
done
if [ -n "$array" ]; then
  for task in $(seq 0 "${array#0-}"); do SLURM_ARRAY_TASK_ID=$task sh -c "$wrap" >&2; done
else
  sh -c "$wrap" >&2
fi
wc -l < jobs
"#;

#[test]
fn slurm_runs_hidden_scenes_in_a_second_job_array() {
    let project = with_hidden_unprotected();
    for name in ["ada", "bob", "eve"] {
        logging(&project, name, "");
    }
    project.program("bin/sbatch", SBATCH);
    project.program("bin/scontrol", "#!/bin/sh\necho MaxArraySize = 2\n");
    project.program("bin/squeue", "#!/bin/sh\necho '{\"jobs\": []}'\n");
    let path = format!("{}:{}", project.path("bin").display(), std::env::var("PATH").unwrap());
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_grade"))
        .args(["class", "class", "-o", "out", "--on", "slurm", "--shards", "3"])
        .args(HIDDEN)
        .current_dir(project.path(""))
        .env("PATH", path)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let jobs = project.read("jobs");
    let jobs: Vec<&str> = jobs.lines().collect();
    assert_eq!(jobs.len(), 5, "{jobs:?}");
    for (job, hidden, dependency) in [
        (jobs[0], false, None),
        (jobs[1], false, None),
        (jobs[2], true, Some("--dependency=afterany:1:2 ")),
        (jobs[3], true, Some("--dependency=afterany:1:2 ")),
        (jobs[4], false, Some("--dependency=afterany:3:4 ")),
    ] {
        assert_eq!(job.contains("--hidden-scenes"), hidden, "{job}");
        assert_eq!(job.contains("--dependency"), dependency.is_some(), "{job}");
        assert!(job.contains(dependency.unwrap_or_default()), "{job}");
    }
    let ran = ran(&project);
    let first = ran.iter().position(|(_, is_hidden)| *is_hidden).unwrap();
    assert!(ran[first..].iter().all(|(_, is_hidden)| *is_hidden), "{ran:?}");
    assert_eq!(ran.len() - first, 6, "{ran:?}");
    assert!(project.row("eve").ends_with(",3,3,2,2,,,,"), "{}", project.row("eve"));
}
