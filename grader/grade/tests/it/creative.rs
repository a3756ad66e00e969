//! Creative scenes: their checks, contact sheet and gallery.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use test_support::{root, write};

/// A swinging pair: for t1m2.
const PAIR: &str = r#"<scene>
  <description text="By Ada &amp; &lt;b&gt;friends"/>
  <duration time="1"/>
  <integrator type="symplectic-euler" dt="0.02"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="0.5" px="1.1" py="0.2" vx="0" vy="0.4" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="20" l0="1"/>
  <particlecolor i="1" r="1" g="0" b="0"/>
  <particlepath i="1" duration="0.3" r="1" g="0" b="0"/>
</scene>
"#;

fn grade(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grade"));
    command.args(arguments).arg("--root").arg(root()).current_dir(folder).output().unwrap()
}

#[test]
fn a_scene_is_checked_and_shown_on_a_contact_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&folder.join("ada_t1m2.xml"), PAIR);
    write(&folder.join("ada_t1m2.gif"), "GIF89a");
    let output = grade(folder, &["creative", "ada_t1m2.xml", "--sheet", "sheet.png"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert_eq!(text.matches(" passed ").count(), 6, "{text}");
    let sheet = fs::read(folder.join("sheet.png")).unwrap();
    assert!(sheet.starts_with(b"\x89PNG"));
    // 4 by 3 pictures of 400 by 300 pixels, and 8 pixels around each.
    assert_eq!(sheet[16..24], [0, 0, 0x06, 0x68, 0, 0, 0x03, 0xa4]);

    fs::remove_file(folder.join("ada_t1m2.gif")).unwrap();
    let output = grade(folder, &["creative", "ada_t1m2.xml"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("film      failed       no film called ada_t1m2 in ."), "{text}");

    let output = grade(folder, &["creative", "missing.xml"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_gallery_shows_every_scene_and_hides_names_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&folder.join("hand-ins/ada/Creative/ada_t1m2.xml"), PAIR);
    write(&folder.join("hand-ins/bob/Creative/bob_t1m2.xml"), "<scene>");
    write(&folder.join("hand-ins/bob/assets/other.xml"), PAIR);
    let output = grade(folder, &["gallery", "hand-ins", "-o", "open"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let page = fs::read_to_string(folder.join("open/index.html")).unwrap();
    assert!(page.contains("ada/Creative/ada_t1m2.xml"));
    assert!(page.contains("By Ada &amp; &lt;b&gt;friends") && !page.contains("<b>"));
    assert_eq!(page.matches("data-motion").count(), 1);

    let arguments = ["gallery", "hand-ins", "-o", "hidden", "--hide-names", "key.csv"];
    let output = grade(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let mut files = vec![folder.join("hidden")];
    let mut n_files = 0;
    while let Some(path) = files.pop() {
        if path.is_dir() {
            files.extend(fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        let text = fs::read_to_string(&path).unwrap().to_lowercase();
        for name in ["ada_", "ada/", "ada &", "bob", "hand-ins"] {
            assert!(!text.contains(name), "{}: {name}", path.display());
        }
        n_files += 1;
    }
    assert!(n_files > 8, "{n_files}");
    let key = fs::read_to_string(folder.join("key.csv")).unwrap();
    let key: BTreeMap<&str, &str> = key.lines().filter_map(|line| line.split_once(',')).collect();
    let owners: Vec<&str> = ["Scene 1", "Scene 2"].iter().map(|scene| key[scene]).collect();
    assert!(owners.contains(&"hand-ins/ada/Creative/ada_t1m2.xml"), "{owners:?}");
    let marks = fs::read_to_string(folder.join("hidden/marks.csv")).unwrap();
    let head = "scene,assignment,failed checks,ingredients,aesthetics,originality,judge,remarks";
    assert_eq!(marks.lines().next(), Some(head));
    assert!(marks.contains(",t1m2,film,,,,,"), "{marks}");
}

/// All but their runs, which take minutes without optimisation.
#[test]
fn our_creative_scenes_are_well_formed_and_have_their_films() {
    let mut n_scenes = 0;
    for path in simulator::scene::find_scene_files(&root().join("creative")).unwrap() {
        let limit = std::time::Duration::ZERO;
        let folder = root().join("assets/assignments");
        let assignments = grader::assignment::Assignment::list(&folder).unwrap();
        let rules = grader::creative::Rules { assignments: &assignments, assignment: None, limit };
        for check in grader::creative::check(&path, rules).unwrap().checks {
            let is_pass = check.outcome == grader::creative::Outcome::Passed;
            assert!(is_pass || check.name == "run", "{}: {check:?}", path.display());
        }
        n_scenes += 1;
    }
    assert_eq!(n_scenes, 6);
}
