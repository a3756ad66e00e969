//! Results and packages for course platforms, with the `grade` binary. `ci/platforms.sh` emulates the platforms.

use std::fs;

use serde_json::{Value, json};

use crate::class::{Project, RIGHT, interrupted};
use crate::folder::Run;

/// A project whose folder `mine` is a submission that passes all scenes but those that contain `wrong`.
fn project(wrong: &str, rubric: &str) -> Project {
    let project = Project::with_hidden();
    project.write("assets/rubric.toml", rubric);
    project.write(
        "mine/submission.toml",
        "name = \"mine\"\nrun = [\"sh\", \"{folder}/run.sh\", \"{scene}\", \"-o\", \"{trace}\"]\n",
    );
    project.write(
        "mine/run.sh",
        &RIGHT.replace("awk", &format!("grep -q '{wrong}' \"$1\" && exit 7\nawk")),
    );
    project
}

/// Grades `mine` for Gradescope; the run and the results.
fn gradescope(project: &Project, arguments: &[&str]) -> (Run, Value) {
    let fixed = ["mine", "--no-jacobians", "--report", "gradescope=results.json"];
    let run = project.grade(&[&fixed, arguments].concat());
    let results = serde_json::from_str(&project.read("results.json")).unwrap();
    (run, results)
}

/// Metadata of a submission that came in at this time, with a deadline at noon of the second of March, 2026.
fn metadata(project: &Project, created_at: &str, previous: &Value) {
    let text = json!({
        "id": 1, "created_at": created_at, "assignment": {"due_date": "2026-03-02T12:00:00.000000-08:00"},
        "users": [], "previous_submissions": previous,
    });
    project.write("metadata.json", &text.to_string());
}

fn test<'a>(results: &'a Value, name: &str) -> &'a Value {
    let tests = results["tests"].as_array().unwrap();
    tests
        .iter()
        .find(|test| test["name"] == name)
        .unwrap_or_else(|| panic!("no {name}: {results:#}"))
}

#[test]
fn gradescope_shows_a_test_per_feature_and_hidden_scenes_apart() {
    let rubric = "[platform]\nhidden = \"after-published\"\nleaderboard = true\n";
    let project = project("150", rubric);
    let (run, results) = gradescope(&project, &["--hidden", "hidden", "--report", "text"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    // Free/explicit: 1 of 2 shipped scenes and 1 of 1 hidden; one point in all.
    let is_near = |value: &Value, expected: f64| (value.as_f64().unwrap() - expected).abs() < 1e-12;
    assert!(is_near(&results["score"], 2.0 / 3.0 + 1.0 + 1.0), "{results:#}");
    let shipped = test(&results, "Free / explicit-euler");
    assert!(is_near(&shipped["score"], 1.0 / 3.0) && is_near(&shipped["max_score"], 2.0 / 3.0));
    assert_eq!((&shipped["status"], &shipped["visibility"]), (&"failed".into(), &"visible".into()));
    let output = shipped["output"].as_str().unwrap();
    assert!(
        output.starts_with("1 of 2 scenes passed.\n") && output.contains("Free/far"),
        "{output}"
    );
    let hidden = test(&results, "Free / explicit-euler (hidden scenes)");
    assert!(is_near(&hidden["score"], 1.0 / 3.0), "{hidden}");
    assert_eq!(
        (&hidden["status"], &hidden["visibility"]),
        (&"passed".into(), &"after_published".into())
    );
    assert_eq!(test(&results, "hidden / explicit-euler (hidden scenes)")["score"], 1.0);
    for secret in ["moonlight", "sunlight", "Starlight", "0.8765", "0.7654"] {
        assert!(!results.to_string().contains(secret), "{secret}");
    }
    // Speed is compared among programs that pass everything.
    assert_eq!(results["leaderboard"].as_array().unwrap().len(), 1);
    let (run, results) = gradescope(&project, &["--only", "near"]);
    assert_eq!((run.code, &results["score"]), (0, &json!(1.0)), "{}", run.stderr);
}

#[test]
fn all_or_nothing_is_decided_with_the_hidden_scenes() {
    let project = project("0.87654321", "[default]\npartial = false\n");
    let (_, results) = gradescope(&project, &["--hidden", "hidden"]);
    let shipped = test(&results, "Free / explicit-euler");
    assert_eq!((&shipped["status"], &shipped["max_score"]), (&"passed".into(), &json!(0.0)));
    let hidden = test(&results, "Free / explicit-euler (hidden scenes)");
    assert_eq!((&hidden["score"], &hidden["max_score"]), (&json!(0.0), &json!(1.0)));
    assert_eq!(results["score"], 2.0);
}

#[test]
fn late_and_repeated_submissions_count_as_the_rubric_says() {
    let rules = "[late]\npenalty = 25\ncap = 60\ngrace = 10\n";
    let best = format!("{rules}[platform]\nkeep = \"best\"\n");
    let before =
        json!([{"submission_time": "2026-03-01T00:00:00-08:00", "score": 1.75, "results": {}}]);
    for (rubric, created_at, previous, score, remark) in [
        (rules, "2026-03-02T12:09:59.5-08:00", &before, 2.0, ""),
        (rules, "2026-03-02T20:11:00Z", &before, 1.5, "on day 1 after the deadline: 25 %"),
        (
            rules,
            "2026-03-04T12:00:00.000001-08:00",
            &before,
            0.8,
            "on day 3 after the deadline: 60 %",
        ),
        (&best, "2026-03-02T20:11:00Z", &before, 1.75, "An earlier submission has 1.75 points"),
        (&best, "2026-03-02T19:00:00Z", &before, 2.0, ""),
        ("", "2026-04-02T19:00:00Z", &before, 2.0, "0 % of the points"),
    ] {
        let project = project("nothing", rubric);
        metadata(&project, created_at, previous);
        let (run, results) = gradescope(&project, &["--metadata", "metadata.json"]);
        assert_eq!((run.code, &results["score"]), (0, &json!(score)), "{created_at}: {results:#}");
        let output = results["output"].as_str().unwrap();
        assert!(output.contains(remark), "{output}");
        assert_eq!(
            remark.is_empty(),
            !output.contains("Late") && !output.contains("earlier"),
            "{output}"
        );
    }
}

#[test]
fn grader_fault_is_a_readable_result_with_a_reason() {
    let project = project("nothing", "");
    project.write("metadata.json", "{\"created_at\": \"yesterday\"}");
    project.write("broken.toml", "points = ");
    for (arguments, reason) in [
        (&["--metadata", "metadata.json"][..], "\"yesterday\" is no time with date and offset"),
        (&["--metadata", "nowhere.json"], "nowhere.json"),
        (&["--rubric", "broken.toml"], "broken.toml:1:10"),
        (&["--expected", "nowhere"], "folder not found"),
        (&["--assignment", "t9"], "there is no assignment \"t9\""),
    ] {
        let _ = fs::remove_file(project.path("results.json"));
        let (run, results) = gradescope(&project, arguments);
        assert_eq!((run.code, &results["score"]), (2, &json!(0.0)), "{}", run.stderr);
        let output = results["output"].as_str().unwrap();
        assert!(output.contains("which is not yours") && !output.contains(reason), "{output}");
        let shown = test(&results, "Reason, for the instructor");
        assert_eq!(shown["visibility"], "hidden");
        assert!(shown["output"].as_str().unwrap().contains(reason), "{shown}");
    }
}

#[test]
fn timed_out_submission_keeps_earlier_points() {
    for (rule, score) in [("keep = \"best\"", 1.75), ("keep = \"last\"", 0.0)] {
        let project = project("nothing", &format!("[platform]\n{rule}\n"));
        metadata(&project, "2026-03-02T19:00:00Z", &json!([{"score": 1.75}]));
        let mark = project.path("started");
        let endless =
            format!("build = [\"sh\", \"-c\", \"touch '{}'; sleep 600\"]\n", mark.display());
        project.write("mine/submission.toml", &(endless + &project.read("mine/submission.toml")));
        let report = ["mine", "--unprotected", "--report", "gradescope=results.json"];
        let run =
            interrupted(&project, &[&report[..], &["--metadata", "metadata.json"]].concat(), &mark);
        assert_eq!(run.code, 130, "{}", run.stderr);
        let results: Value = serde_json::from_str(&project.read("results.json")).unwrap();
        assert_eq!(results["score"], score, "{results:#}");
        let output = results["output"].as_str().unwrap();
        let reason = "took too long (the submission was still being built; no scene was graded)";
        assert!(output.contains(reason), "{output}");
        assert_eq!(
            output.contains("An earlier submission has 1.75 points"),
            score > 0.0,
            "{output}"
        );
    }
}

#[test]
fn defective_hand_in_gets_a_verdict() {
    let project = project("nothing", "");
    fs::remove_file(project.path("mine/submission.toml")).unwrap();
    let (run, results) = gradescope(&project, &[]);
    assert_eq!((run.code, &results["score"]), (1, &json!(0.0)), "{}", run.stderr);
    let output = results["output"].as_str().unwrap();
    assert!(output.contains("there is no submission.toml"), "{output}");
    // Once, and not again with each feature.
    assert!(!results["tests"].to_string().contains("submission.toml"), "{results:#}");
    // Traces alone show no program.
    let trace = project.read("expected/Free/near.csv");
    project.write("mine/Free/near.csv", &trace);
    assert_eq!(gradescope(&project, &[]).1["score"], 0.0);
    project.write("mine/submission.toml", "run = 1\n");
    let (run, results) = gradescope(&project, &[]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(results["output"].as_str().unwrap().contains("submission.toml:1"), "{results:#}");
}

#[test]
fn unusable_package_is_refused() {
    let project = project("nothing", "");
    let export = |arguments: &[&str]| {
        project.grade(&[&["export", "gradescope", "-o", "package.zip"], arguments].concat())
    };
    let run = export(&["--program", "mine/run.sh"]);
    assert!(run.code == 2 && run.stderr.contains("no ELF program for x86-64"), "{}", run.stderr);
    let run = export(&["--assignment", "t9"]);
    assert!(run.code == 2 && run.stderr.contains("no assignment \"t9\""), "{}", run.stderr);
    fs::remove_file(project.path("expected/Free/near.csv")).unwrap();
    let run = export(&["--program", "/bin/true"]);
    assert!(run.code == 2 && run.stderr.contains("there is no oracle trace"), "{}", run.stderr);
    assert!(!project.path("package.zip").exists());
    let run = project.grade(&["--report", "text", "--report", "github"]);
    assert!(run.code == 2 && run.stderr.contains("no step of GitHub Actions"), "{}", run.stderr);
}

/// Nobody looks at what a submission chose, so that it could choose what it passes.
#[test]
fn submission_chooses_no_assignment_on_a_platform() {
    let project = project("150", "");
    for (name, group) in [("all", ""), ("easy", "integrators = [\"explicit-euler\"]\n")] {
        let feature = "[[feature]]\nsection = \"required\"\ngroups = [\"Free\"]\n";
        let text = format!(
            "title = \"{name}\"\ndocument = \"none\"\nformats = [\"xml\"]\n{group}{feature}"
        );
        project.write(&format!("assets/assignments/{name}.toml"), &text);
    }
    let total = |assignment: &str| {
        let own = project.read("mine/submission.toml");
        project.write("mine/submission.toml", &format!("{assignment}{own}"));
        let (_, results) = gradescope(&project, &[]);
        let run = project.grade(&["mine", "--no-jacobians", "--report", "json=local.json"]);
        assert!(run.code <= 1, "{}", run.stderr);
        project.write("mine/submission.toml", &own);
        let local: Value = serde_json::from_str(&project.read("local.json")).unwrap();
        (results["tests"].clone(), local["assignment"].clone())
    };
    let (tests, local) = total("");
    let (tests_of_easy, local_of_easy) = total("assignment = \"easy\"\n");
    assert_eq!(local_of_easy, json!("easy"), "it chooses where nobody is deceived");
    assert_ne!(local, local_of_easy);
    assert_eq!(tests, tests_of_easy);
}

#[test]
fn package_names_no_folder_of_this_machine() {
    let project = project("nothing", "");
    let hidden = project.path("hidden").canonicalize().unwrap().display().to_string();
    project.write("assets/rubric.toml", &format!("[hidden]\nfolder = \"{hidden}\"\n"));
    let run = project.grade(&[
        "export",
        "prairielearn",
        "-o",
        "course",
        "--image",
        "course/oracle",
        "--program",
        "/bin/true",
    ]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let found = |text: &str| {
        let mut command = std::process::Command::new("grep");
        let output = command.args(["-rlF", text, "course"]).current_dir(project.path(""));
        String::from_utf8(output.output().unwrap().stdout).unwrap()
    };
    assert!(found("../hidden").contains("rubric.toml"));
    let root = project.path("").canonicalize().unwrap().display().to_string();
    assert_eq!(found(&root), "");
}
