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
fn a_copy_of_the_oracle_earns_nothing_in_a_class() {
    let project = Project::with_hidden();
    copied_traces(&project, "class/eve");
    let run = project.class(&["--hidden", "hidden"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(project.row("eve"), "eve,bad-hand-in,0,3,0,0,0,0,0,3,0,2,,,,");
    let told = project.read("out/reports/eve.txt");
    assert!(told.contains("there is no submission.toml in this folder"), "{told}");
    // Where they are allowed, the hidden scenes that they lack are wrong.
    project.write("assets/rubric.toml", "[class]\ntraces = true\n");
    project.class(&["--hidden", "hidden"]);
    assert!(project.row("eve").starts_with("eve,failed,"), "{}", project.row("eve"));
    assert!(project.row("eve").ends_with(",3,3,0,2,,,,"), "{}", project.row("eve"));
    let told = project.read("out/reports/eve.json");
    assert!(told.contains("\"missing\": 1"), "{told}");
}

#[test]
fn a_name_takes_no_place_of_the_class() {
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
        assert_eq!(run.code, 0, "{}", run.stderr);
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
fn an_upload_called_as_another_student_stops_no_class() {
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
    assert_eq!(project.read("moodle.csv"), "ID number,Spring Oracle\n1001,\n1002,2\n1003,\n");
}

#[test]
fn nothing_is_written_through_a_link_of_a_submission() {
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
fn a_gallery_shows_no_scene_behind_a_link() {
    let project = Project::with_hidden();
    project.write("class/ada/Creative/ada_all.xml", &project.read("assets/Free/near.xml"));
    let folder = project.path("class/eve/Creative");
    fs::create_dir_all(&folder).unwrap();
    symlink(project.path("hidden/assets/Free/moonlight.xml"), folder.join("eve_all.xml")).unwrap();
    let run = project.grade(&["gallery", "class", "-o", "gallery", "--root", "."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let page = project.read("gallery/index.html");
    assert!(page.contains("ada_all.xml") && !page.contains("eve_all.xml"), "{page}");
}

#[test]
fn a_workflow_that_students_can_edit_reads_no_hidden_scene() {
    let project = Project::with_hidden();
    let export = |arguments: &[&str]| {
        let common = ["export", "github", "--repository", "course/oracle", "-o", "template"];
        project.grade(&[&common[..], arguments].concat())
    };
    let message =
        "students can edit the workflow, and read what it reads: hidden scenes stay out of it";
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
    let workflow = project.read("template/.github/workflows/classroom.yml");
    assert!(
        workflow.contains("must hold no hidden scenes") && !workflow.contains("--hidden hidden"),
        "{workflow}"
    );
}
