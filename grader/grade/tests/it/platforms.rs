//! Results and packages for course platforms, with the `grade` binary. `ci/platforms.sh` emulates the platforms.

use std::fs;

use needs::needs;
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
fn extension_of_a_student_moves_the_deadline() {
    let project = project("nothing", "[late]\npenalty = 25\n");
    let users = |due: &str| {
        let text = json!({
            "created_at": "2026-03-03T11:00:00-08:00",
            "assignment": {"due_date": "2026-03-02T12:00:00-08:00"},
            "users": [{"id": 1, "assignment": {"due_date": due}}, {"id": 2}],
        });
        project.write("metadata.json", &text.to_string());
        gradescope(&project, &["--metadata", "metadata.json"]).1["score"].clone()
    };
    assert_eq!(users("2026-03-03T12:00:00-08:00"), json!(2.0));
    assert_eq!(users("2026-03-02T12:00:00-08:00"), json!(1.5));
}

#[test]
fn submission_over_the_limit_keeps_earlier_points_and_runs_nothing() {
    let project = project("nothing", "[platform]\nlimit = { submissions = 2, hours = 24 }\n");
    let at = |day: u32, score: f64, refused: bool| {
        let results = json!({"extra_data": {"refused": refused}});
        json!({"submission_time": format!("2026-03-0{day}T20:00:00Z"), "score": score, "results": results})
    };
    let graded = |previous: Value| {
        metadata(&project, "2026-03-02T19:00:00Z", &previous);
        gradescope(&project, &["--metadata", "metadata.json"])
    };
    let (run, results) = graded(json!([at(1, 0.5, false), at(1, 1.75, false)]));
    assert_eq!((run.code, &results["score"]), (1, &json!(1.75)), "{}", run.stderr);
    let output = results["output"].as_str().unwrap();
    assert!(
        output.contains("2 submissions in 24 hours are graded")
            && output.contains("1 h 0 min after"),
        "{output}"
    );
    assert_eq!((&results["tests"], &results["extra_data"]["refused"]), (&json!([]), &json!(true)));
    // Submissions that were refused do not count.
    let (run, results) = graded(json!([at(1, 0.5, false), at(1, 0.5, true)]));
    assert_eq!((run.code, &results["score"]), (0, &json!(2.0)), "{}", run.stderr);
}

/// Students cannot change how their programs are run.
#[test]
fn protections_are_shown_to_instructors_only() {
    let project = project("nothing", "");
    let (_, results) = gradescope(&project, &["--unprotected"]);
    assert!(!results["output"].as_str().unwrap().contains("protection"), "{results:#}");
    let shown = test(&results, "Protection, for the instructor");
    assert_eq!(shown["visibility"], "hidden");
    assert!(shown["output"].as_str().unwrap().contains("Run without protection"), "{shown}");
}

/// Grades `mine` for PrairieLearn.
fn prairielearn(project: &Project) -> Value {
    project.grade(&["mine", "--no-jacobians", "--report", "prairielearn=results.json"]);
    serde_json::from_str(&project.read("results.json")).unwrap()
}

#[test]
fn prairielearn_shows_output_of_compilers_as_such() {
    let project = project("nothing", "");
    let manifest = project.read("mine/submission.toml");
    project.write(
        "mine/submission.toml",
        &format!("build = [\"sh\", \"-c\", \"echo 'a.cpp:1: error: x' >&2; exit 1\"]\n{manifest}"),
    );
    let results = prairielearn(&project);
    assert_eq!(results["gradable"], false);
    assert!(results["output"].as_str().unwrap().contains("a.cpp:1: error: x"), "{results:#}");
    let errors = json!(["Your submission is not graded: build failed. The output says why."]);
    assert_eq!(results["format_errors"], errors);
}

/// PrairieLearn sums the points of all tests, and the maxima.
#[test]
fn extra_credit_has_no_maximum_in_prairielearn() {
    let project = project("150", "[[feature]]\nsection = \"extra-credit\"\npoints = 3\n");
    let text = project.read("assets/Free/near.xml");
    project.write("extracreditassets/More/near.xml", &text);
    let run = project.grade(&["oracle", "regenerate", "--accept"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let results = prairielearn(&project);
    let sum = |of: &str| {
        let tests = results["tests"].as_array().unwrap().iter();
        tests.map(|test| test[of].as_f64().unwrap()).sum::<f64>()
    };
    assert_eq!(
        (sum("points"), sum("max_points"), &results["score"]),
        (4.5, 2.0, &json!(1.0)),
        "{results:#}"
    );
    let message = results["message"].as_str().unwrap();
    assert!(message.contains("3 points of extra credit make up for 0.5 lost points"), "{message}");
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
    for image in ["", "Course/oracle", "course/oracle:", " "] {
        let run = project.grade(&["export", "prairielearn", "-o", "course", "--image", image]);
        assert!(
            run.code == 2 && run.stderr.contains("expected the name of an image"),
            "{image:?}: {}",
            run.stderr
        );
    }
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
fn patterns_of_files_are_optional_in_prairielearn() {
    let project = project("nothing", "");
    let export = ["export", "prairielearn", "-o", "course", "--program", "/bin/true"];
    let files = ["--image", "localhost:5000/course/oracle:2", "--file", "a.cpp", "--file", "*.h"];
    let run = project.grade(&[&export[..], &files].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stderr.contains("must be public") && run.stderr.contains("Sync"), "{}", run.stderr);
    let page = project.read("course/questions/spring-oracle-all/question.html");
    assert!(page.contains("file-names=\"a.cpp\" optional-file-patterns=\"*.h\""), "{page}");
    let script = project.read("course/questions/spring-oracle-all/tests/run.sh");
    assert!(script.contains("--no-progress"), "{script}");
    let run = project.grade(&[&export[..], &["--image", "a", "--file", "src/a.cpp"]].concat());
    assert!(run.code == 2 && run.stderr.contains("uploads no folders"), "{}", run.stderr);
}

/// A project whose assignment is `free`.
fn with_assignment() -> Project {
    let project = project("150", "assignment = \"free\"\n");
    let feature = "[[feature]]\nsection = \"required\"\ngroups = [\"Free\"]\n";
    let text = format!("title = \"Free\"\ndocument = \"none\"\nformats = [\"xml\"]\n{feature}");
    project.write("assets/assignments/free.toml", &text);
    project
}

/// Exports a bundle, with this program in the place of one that runs on the platform.
fn bundle(project: &Project, platform: &str, folder: &str) {
    let export = ["export", platform, "-o", "course", "--program", "/bin/true"];
    let run = project.grade(&export);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let grade = project.path(&format!("course/{folder}/grade"));
    fs::copy(env!("CARGO_BIN_EXE_grade"), grade).unwrap();
}

/// A program that is run in a folder; its exit code and what it printed.
fn python(
    project: &Project,
    folder: &str,
    script: &str,
    variables: &[(&str, &str)],
) -> (Option<i32>, String) {
    let mut command = std::process::Command::new("python3");
    let command = command
        .arg(project.path(script))
        .current_dir(project.path(folder))
        .envs(variables.iter().copied());
    let output = command.output().unwrap();
    (
        output.status.code(),
        String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned(),
    )
}

#[needs("command -v python3")]
#[test]
fn classroom_50_gets_whole_points_and_whose_they_are() {
    let project = with_assignment();
    bundle(&project, "classroom50", "autograders/free");
    let summary = project.path("summary.md").display().to_string();
    let variables = [
        ("CLASSROOM", "cs"),
        ("ASSIGNMENT", "free"),
        ("ASSIGNMENT_TYPE", "group"),
        ("OWNER", "ada"),
        ("SUBMISSION_TAG", "submit/1"),
        ("COMMIT_URL", "c"),
        ("RELEASE_URL", "r"),
        ("REVIEW_URL", ""),
        ("GITHUB_STEP_SUMMARY", &*summary),
    ];
    let script = "course/autograders/free/autograder.py";
    // Nothing is written through a student's link.
    project.write("another", "stays");
    std::os::unix::fs::symlink("../another", project.path("mine/result.json")).unwrap();
    let (code, said) = python(&project, "mine", script, &variables);
    assert_eq!(code, Some(0), "{said}");
    let result: Value = serde_json::from_str(&project.read("mine/result.json")).unwrap();
    // Free/explicit has one of two scenes, Free/symplectic its only one.
    assert_eq!((&result["score"], &result["max-score"]), (&json!(150), &json!(200)), "{result:#}");
    let parts =
        result["tests"].as_array().unwrap().iter().map(|test| test["score"].as_u64().unwrap());
    assert_eq!(parts.sum::<u64>(), 150);
    assert_eq!(project.read("another"), "stays");
    assert_eq!(result["tests"][0]["passed"], false);
    for (name, value) in [
        ("schema", "classroom50/result/v1"),
        ("owner", "ada"),
        ("assignment_type", "group"),
        ("review", "c"),
    ] {
        assert_eq!(result[name], value);
    }
    assert!(project.read("summary.md").contains("## Spring Oracle"));
    // A grader fault is an error of the platform, not a result, nor the one that was there.
    fs::remove_dir_all(project.path("course/autograders/free/suite/expected")).unwrap();
    assert_eq!(python(&project, "mine", script, &variables).0, Some(1));
    assert!(!project.path("mine/result.json").exists());
    // Students could read hidden scenes.
    let run = project.grade(&[
        "export",
        "classroom50",
        "-o",
        "x",
        "--program",
        "/bin/true",
        "--hidden",
        "hidden",
    ]);
    assert!(
        run.code == 2 && run.stderr.contains("can read it: hidden scenes stay out"),
        "{}",
        run.stderr
    );
}

#[needs("command -v python3 && command -v timeout")]
#[test]
fn codio_gets_a_percentage_and_feedback() {
    let project = with_assignment();
    let program = project.read("mine/run.sh");
    project.write("course/submission.toml", &project.read("mine/submission.toml"));
    project.write("course/run.sh", &program);
    bundle(&project, "codio", ".guides/secure/spring-oracle");
    // The library of Codio.
    project.write(
        "codio/lib/grade.py",
        "import json, pathlib\nFORMAT_V2_TXT = 'txt'\ndef send_grade_v2(grade, feedback, format):\n    \
         pathlib.Path('sent.json').write_text(json.dumps([grade, feedback, format]))\n    return True\n",
    );
    let library = project.path("codio").display().to_string();
    let script = "course/.guides/secure/spring-oracle/grade.py";
    let run = || python(&project, "codio", script, &[("PYTHONPATH", &library)]);
    let (code, said) = run();
    assert_eq!(code, Some(0), "{said}");
    let sent: Value = serde_json::from_str(&project.read("codio/sent.json")).unwrap();
    assert_eq!((&sent[0], &sent[2]), (&json!(75), &json!("txt")), "{said}");
    let feedback = sent[1].as_str().unwrap();
    assert!(
        feedback.contains("[0.5/1] Free / explicit-euler: 1 of 2 scenes passed")
            && feedback.contains("Free/far"),
        "{feedback}"
    );
    // A grader fault is no grade: Codio writes to the instructor.
    fs::remove_file(project.path("codio/sent.json")).unwrap();
    fs::remove_dir_all(project.path("course/.guides/secure/spring-oracle/suite/expected")).unwrap();
    assert_eq!(run().0, Some(1));
    assert!(!project.path("codio/sent.json").exists());
}

#[test]
fn pipelines_quote_what_they_are_given() {
    let project = with_assignment();
    for (host, path) in [("github", ".github/workflows/grade.yml"), ("gitlab", ".gitlab-ci.yml")] {
        let export = |more: &[&str]| {
            let fixed = ["export", host, "-o", "template", "--repository", "course/spring-oracle"];
            project.grade(&[&fixed, more].concat())
        };
        let run = export(&["--reference", "v1/x", "--minutes", "7"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(run.stderr.contains("students can read it by the token"), "{}", run.stderr);
        let text = project.read(&format!("template/{path}"));
        for part in ["\"course/spring-oracle\"", "\"v1/x\"", "\"free\"", "--report text"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains("MINUTES") && text.contains(" 7"), "{text}");
        let run = export(&["--reference", "x; rm -rf /"]);
        assert!(
            run.code == 2 && run.stderr.contains("expected the name of a branch"),
            "{}",
            run.stderr
        );
        let run = export(&["--hidden", "hidden"]);
        assert!(
            run.code == 2 && run.stderr.contains("students can edit the pipeline"),
            "{}",
            run.stderr
        );
    }
}

/// A platform shows ten annotations: none is spent on extra credit that nobody tried.
#[test]
fn untried_extra_credit_has_no_annotation() {
    let project = project("150", "");
    let scene = project.read("assets/Free/near.xml");
    let gravity = scene.replace("<particle", "<simplegravity fx=\"0.5\" fy=\"-9\"/><particle");
    project.write("extracreditassets/Untried/fall.xml", &gravity);
    project.write("extracreditassets/Wrong/far.xml", &scene.replace("1.5", "150"));
    let run = project.grade(&["oracle", "regenerate", "--accept"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let own = project.read("mine/run.sh");
    let lack =
        "grep -q simplegravity \"$1\" && { echo 'unknown force: simplegravity' >&2; exit 3; }\nawk";
    project.write("mine/run.sh", &own.replace("\nawk", &format!("\n{lack}")));
    let mut command = crate::folder::command(
        &project.path(""),
        &["mine", "--no-jacobians", "--report", "github"],
    );
    let run = crate::folder::run(command.env("GITHUB_STEP_SUMMARY", project.path("summary.md")));
    let annotations: Vec<&str> = run
        .stdout
        .lines()
        .filter(|line| line.starts_with("::warning") || line.starts_with("::error"))
        .collect();
    assert_eq!(annotations.len(), 2, "{}{}", run.stdout, run.stderr);
    assert!(
        annotations[0].starts_with("::error title=Free / explicit-euler::1 of 2 scenes passed"),
        "{annotations:?}"
    );
    assert!(annotations[1].contains("Wrong / explicit-euler"), "{annotations:?}");
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
