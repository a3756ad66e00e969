//! `grade oracle generate-hidden`, run in temporary folders.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use tempfile::TempDir;
use test_support::{root, write};

use crate::folder::{Run, grade};

const SPRING: &str = r#"<!-- A pair. Catches a missing rest length. -->
<scene>
  <duration time="0.5"/>
  <integrator type="symplectic-euler" dt="0.05"/>
  <particle m="1.5" px="0" py="0.1" vx="0.2" vy="0" fixed="0"/>
  <particle m="0.5" px="1.1" py="0.4" vx="0" vy="-0.3" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="20" l0="0.8" b="0.4"/>
</scene>
"#;

fn generate(folder: &Path, arguments: &[&str]) -> Run {
    grade(folder, &[&["oracle", "generate-hidden"], arguments].concat())
}

/// A folder with a required scene and one for extra credit.
fn project() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("assets/Spring/pair.xml"), SPRING);
    let implicit = SPRING.replace("symplectic", "implicit");
    write(&folder.path().join("extracreditassets/Spring/other.xml"), &implicit);
    let made = grade(folder.path(), &["oracle", "regenerate"]);
    assert!(made.code == 0, "{}", made.stderr);
    folder
}

#[test]
fn hidden_scenes_are_drawn_by_seed_and_graded_at_once() {
    let project = project();
    let folder = project.path();
    let made = generate(folder, &["--seed", "5", "-o", "hidden", "--mistakes", "mistakes.csv"]);
    assert!(made.code == 0, "{}", made.stderr);
    let shown = made.stdout;
    assert!(shown.contains("\nSpring/pair ") && shown.contains("\nSpring/other "), "{shown}");
    assert!(shown.contains("hidden: 2 hidden scenes"), "{shown}");

    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let scene = "assets/Spring/pair.xml";
    let own = read(&format!("hidden/{scene}"));
    assert!(own.starts_with("<!-- 2 particles; "), "{own}");
    assert!(own.contains("Catches a missing rest length."), "{own}");
    for (seed, is_same) in [("5", true), ("6", false)] {
        assert!(generate(folder, &["--seed", seed, "-o", seed]).code == 0);
        let files = [scene, "expected/Spring/other.csv", "expected/manifest.toml"];
        for name in files {
            let [ours, theirs] = [format!("hidden/{name}"), format!("{seed}/{name}")];
            assert_eq!(read(&ours) == read(&theirs), is_same, "{name}, seed {seed}");
        }
    }
    // The counts are those of the table, and each mistake is caught or named.
    let table = read("mistakes.csv");
    let rows = table.lines().filter(|line| line.starts_with("Spring/pair,"));
    let count = rows.count();
    assert!(count > 10 && shown.contains(&format!(" {count} of {count}\n")), "{count}: {shown}");
    let caught: BTreeSet<&str> =
        table.lines().skip(1).filter_map(|line| line.split_once(',')).map(|(_, it)| it).collect();
    let escaped = shown.lines().filter(|line| line.starts_with("  ")).count();
    let (caught, all) = (caught.len(), caught.len() + escaped);
    assert!(shown.contains(&format!("clearly catch {caught} of the {all} planted")), "{shown}");

    // A scene alone is drawn as it is among others.
    assert!(generate(folder, &["Spring/pair", "--seed", "5", "-o", "one"]).code == 0);
    assert_eq!(read(&format!("one/{scene}")), own);
    assert!(!folder.join("one/extracreditassets").exists());

    let graded = grade(folder, &["--hidden", "hidden", "--no-jacobians"]);
    assert!(graded.code == 0 && graded.stdout.contains("All passed."));
    let verified = grade(folder, &["oracle", "verify", "--root", "hidden"]);
    assert!(verified.code == 0, "{}", verified.stdout);
}

#[test]
fn hidden_scenes_are_written_atomically_and_never_overwrite() {
    let project = project();
    let folder = project.path();
    fs::create_dir(folder.join("hidden")).unwrap();
    let refused = generate(folder, &["--seed", "5", "-o", "hidden"]);
    assert_eq!(refused.code, 2);
    assert!(refused.stderr.contains("hidden: exists already"), "{}", refused.stderr);
    assert_eq!(fs::read_dir(folder.join("hidden")).unwrap().count(), 0);

    // The spring has no direction: the first step fails.
    let collapsed = SPRING.replace("px=\"1.1\" py=\"0.4\"", "px=\"0\" py=\"0.1\"");
    write(&folder.join("assets/Spring/collapsed.xml"), &collapsed);
    let failed = generate(folder, &["--seed", "5", "-o", "new"]);
    assert_eq!(failed.code, 2);
    let message = failed.stderr;
    assert!(message.contains("Spring/collapsed: no sibling"), "{message}");
    assert!(message.contains("nothing was written"), "{message}");
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let names: Vec<String> = entries.map(|name| name.into_string().unwrap()).collect();
    assert!(!names.iter().any(|name| name.contains("new")), "{names:?}");
}

#[test]
fn hidden_scenes_of_an_assignment_are_those_with_points() {
    let folder = tempfile::tempdir().unwrap();
    let root = root().to_str().unwrap();
    let arguments = ["--assignment", "t1m2", "--root", root];
    let made =
        generate(folder.path(), &[&arguments[..], &["--seed", "5", "-o", "hidden"]].concat());
    assert!(made.code == 0, "{}", made.stderr);
    let graded = grade(
        folder.path(),
        &[&arguments[..], &["--hidden", "hidden", "--no-jacobians", "--verbose"]].concat(),
    );
    let shown = graded.stdout;
    let counts: Vec<&str> = shown
        .lines()
        .filter(|line| line.starts_with("  Required ") || line.starts_with("    hidden "))
        .filter_map(|line| line.split_whitespace().nth(1))
        .collect();
    let [shipped, hidden] = counts[..] else { panic!("{shown}") };
    assert_eq!(hidden, shipped, "{shown}");
    assert!(graded.code == 0, "{shown}");
}
