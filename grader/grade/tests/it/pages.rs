//! Reports as pages: files, links, and what must not be in them. `ci/browser.sh` opens them in a browser.

use std::fs;
use std::ops::Deref;
use std::os::unix::fs::PermissionsExt;
use test_support::FREE_PARTICLE;

use crate::folder::{Folder, files_below};

/// Prints a text that must not become markup, and fails.
const HOSTILE: &str = "#!/bin/sh\necho \"</script><script>alert('run')</script>]]>\" >&2\nexit 3\n";

struct Project(Folder);

impl Deref for Project {
    type Target = Folder;

    fn deref(&self) -> &Folder {
        &self.0
    }
}

impl Project {
    /// A scene with its oracle.
    fn new() -> Self {
        let project = Self(Folder::new());
        project.write("assets/Free/flight.xml", FREE_PARTICLE);
        project.grade(&["oracle", "regenerate"], 0);
        project
    }

    /// Runs `grade`, and returns what it wrote to standard error.
    fn grade(&self, arguments: &[&str], code: i32) -> String {
        let run = self.0.grade(arguments);
        assert_eq!(run.code, code, "{}", run.stderr);
        run.stderr
    }

    /// Traces of which the state `step` is wrong.
    fn wrong_traces(&self, step: usize) {
        let text = self.read("expected/Free/flight.csv");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        // The last column is a velocity.
        lines[step + 1] += "5";
        self.write("traces/Free/flight.csv", &(lines.join("\n") + "\n"));
    }
}

/// The addresses in a page.
fn addresses(page: &str) -> Vec<&str> {
    let starts = ["href=\"", "src=\""];
    let of =
        |start: &'static str| page.split(start).skip(1).filter_map(|rest| rest.split('"').next());
    starts.into_iter().flat_map(of).collect()
}

#[test]
fn every_link_of_the_pages_resolves() {
    let project = Project::new();
    project.wrong_traces(3);
    project.write("assets/rubric.toml", "[class]\ntraces = true\n");
    project.write("class/ada/Free/flight.csv", &project.read("traces/Free/flight.csv"));
    project.write("class/<b>&\"'%23/Free/flight.csv", &project.read("expected/Free/flight.csv"));
    project.grade(&["traces", "--html", "pages"], 1);
    project.grade(&["class", "class", "-o", "results", "--html", "class-pages"], 0);
    project.grade(&["jacobians", "--force", "dragdamping", "--html", "jacobians"], 0);
    for folder in ["pages", "class-pages", "jacobians"] {
        let home = project.path(folder).canonicalize().unwrap();
        for page in
            files_below(&home).iter().filter(|path| path.extension().is_some_and(|e| e == "html"))
        {
            let text = fs::read_to_string(page).unwrap();
            assert!(text.contains("Content-Security-Policy"), "{}", page.display());
            for address in addresses(&text) {
                if address.starts_with('#') || address == "data:," {
                    continue;
                }
                assert!(!address.contains(':'), "{}: {address}", page.display());
                let target = page.parent().unwrap().join(address).canonicalize();
                let target = target.unwrap_or_else(|error| panic!("{address}: {error}"));
                assert!(target.starts_with(&home), "{}: {address}", page.display());
            }
        }
    }
    assert!(project.read("class-pages/index.html").contains("&lt;b&gt;&amp;&quot;&#39;%23"));
}

#[test]
fn a_scene_page_holds_the_first_wrong_step_and_its_exact_numbers() {
    let project = Project::new();
    project.wrong_traces(3);
    project.grade(&["traces", "--html", "pages"], 1);
    let page = project.read("pages/scenes/Free/flight.html");
    let (_, rest) = page.split_once("id=\"recording\">").unwrap();
    let data: serde_json::Value =
        serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    assert_eq!(data["firstWrong"], serde_json::json!({"step": 3, "particle": 0}));
    assert_eq!(data["exact"]["steps"], serde_json::json!([0, 1, 2, 3, 4, 5]));
    assert_eq!(data["exact"]["expected"][3][3], 2.0);
    assert_eq!(data["exact"]["got"][3][3], 2.05);
    assert_eq!(data["nGot"], 6);
    assert!(page.contains("explicit-euler"));
}

#[test]
fn pages_overwrite_no_user_file() {
    let project = Project::new();
    project.write("mine/index.html", "<p>my page</p>");
    let errors = project.grade(&["--html", "mine"], 2);
    assert!(errors.contains("mine: holds files other than pages of grade"), "{errors}");
    assert_eq!(project.read("mine/index.html"), "<p>my page</p>");
    // Pages of an earlier run are replaced, and scenes that no longer exist vanish.
    project.grade(&["--html", "pages", "--no-jacobians"], 0);
    project.write("pages/scenes/Free/old.html", "old");
    project.grade(&["--html", "pages", "--no-jacobians"], 0);
    assert!(!project.path("pages/scenes/Free/old.html").exists());
}

#[test]
fn text_of_a_submission_and_hidden_scenes_stay_out_of_the_source() {
    let project = Project::new();
    let hidden = FREE_PARTICLE.replace("vx=\"1\"", "vx=\"0.8765432\"");
    project.write("hidden/assets/Secret/moonlight.xml", &hidden);
    project.grade(&["oracle", "regenerate", "--root", "hidden"], 0);
    project.write("hostile", HOSTILE);
    fs::set_permissions(project.path("hostile"), fs::Permissions::from_mode(0o755)).unwrap();
    project.grade(&["hostile", "--hidden", "hidden", "--html", "pages"], 1);
    for path in files_below(&project.path("pages")) {
        let text = fs::read_to_string(&path).unwrap();
        for secret in ["moonlight", "Secret", "0.8765432"] {
            assert!(!text.contains(secret), "{}: {secret}", path.display());
        }
        assert!(!text.contains("<script>"), "{}", path.display());
    }
    let page = project.read("pages/scenes/Free/flight.html");
    assert!(page.contains("&lt;/script&gt;&lt;script&gt;alert(&#39;run&#39;)"), "{page}");
    assert!(project.read("pages/index.html").contains("0/1: 1 "), "the hidden scene is counted");
}
