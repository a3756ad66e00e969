//! Creative scenes: their checks, contact sheet and gallery.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use test_support::{root, sample, write};

use crate::folder::{Run, command, files_below, run};

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

fn grade(folder: &Path, arguments: &[&str]) -> Run {
    run(command(folder, arguments).arg("--root").arg(root()))
}

#[test]
fn a_scene_is_checked_and_shown_on_a_contact_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&folder.join("ada_t1m2.xml"), PAIR);
    write(&folder.join("ada_t1m2.gif"), "GIF89a");
    let output = grade(folder, &["creative", "ada_t1m2.xml", "--sheet", "sheet.png"]);
    let text = output.stdout;
    assert_eq!(output.code, 0, "{text}");
    assert_eq!(text.matches(" passed ").count(), 6, "{text}");
    let sheet = fs::read(folder.join("sheet.png")).unwrap();
    assert!(sheet.starts_with(b"\x89PNG"));
    // 4 by 3 pictures of 400 by 300 pixels, and 8 pixels around each.
    assert_eq!(sheet[16..24], [0, 0, 0x06, 0x68, 0, 0, 0x03, 0xa4]);

    fs::remove_file(folder.join("ada_t1m2.gif")).unwrap();
    let output = grade(folder, &["creative", "ada_t1m2.xml"]);
    let text = output.stdout;
    assert_eq!(output.code, 1, "{text}");
    assert!(text.contains("film      failed       no film called ada_t1m2 in ."), "{text}");

    let output = grade(folder, &["creative", "missing.xml"]);
    assert_eq!(output.code, 2);
}

#[test]
fn a_gallery_shows_every_scene_and_hides_names_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&folder.join("hand-ins/ada/Creative/ada_t1m2.xml"), PAIR);
    write(&folder.join("hand-ins/bob/Creative/bob_t1m2.xml"), "<scene>");
    write(&folder.join("hand-ins/bob/assets/other.xml"), PAIR);
    let output = grade(folder, &["gallery", "hand-ins", "-o", "open"]);
    assert_eq!(output.code, 0, "{}", output.stderr);
    let page = fs::read_to_string(folder.join("open/index.html")).unwrap();
    assert!(page.contains("ada/Creative/ada_t1m2.xml"));
    assert!(page.contains("By Ada &amp; &lt;b&gt;friends") && !page.contains("<b>"));
    assert_eq!(page.matches("data-motion").count(), 1);

    let arguments = ["gallery", "hand-ins", "-o", "hidden", "--hide-names", "key.csv"];
    let output = grade(folder, &arguments);
    assert_eq!(output.code, 0, "{}", output.stderr);
    let files = files_below(&folder.join("hidden"));
    assert!(files.len() > 8, "{files:?}");
    for path in files {
        let text = fs::read_to_string(&path).unwrap().to_lowercase();
        for name in ["ada_", "ada/", "ada &", "bob", "hand-ins"] {
            assert!(!text.contains(name), "{}: {name}", path.display());
        }
    }
    let key = fs::read_to_string(folder.join("key.csv")).unwrap();
    let key: BTreeMap<&str, &str> = key.lines().filter_map(|line| line.split_once(',')).collect();
    let owners: Vec<&str> = ["Scene 1", "Scene 2"].iter().map(|scene| key[scene]).collect();
    assert!(owners.contains(&"hand-ins/ada/Creative/ada_t1m2.xml"), "{owners:?}");
    let marks = fs::read_to_string(folder.join("hidden/marks.csv")).unwrap();
    let head = "scene,assignment,failed checks,ingredients,aesthetics,originality,judge,remarks";
    assert_eq!(marks.lines().next(), Some(head));
    assert!(marks.contains(",t1m2,film,,,,,"), "{marks}");
}

#[test]
fn sampled_creative_scenes_of_ours_are_well_formed_and_have_their_films() {
    assert_ours(2);
}

#[test]
#[ignore = "long: ten seconds"]
fn long_our_creative_scenes_are_well_formed_and_have_their_films() {
    assert_eq!(assert_ours(usize::MAX), 6);
}

/// Checks so many of our scenes, all but their runs and overlaps on the way, for which a second may be too short; yields their
/// number.
fn assert_ours(count: usize) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let ours = folder.path().join("ours");
    fs::create_dir(&ours).unwrap();
    let mut scenes = files_below(&root().join("creative"));
    scenes.retain(|path| path.extension() == Some("xml".as_ref()));
    for scene in sample(scenes, count) {
        for file in [scene.with_extension("gif"), scene] {
            fs::copy(&file, ours.join(file.file_name().unwrap())).unwrap();
        }
    }
    let output = grade(folder.path(), &["gallery", "ours", "-o", "gallery", "--seconds", "1"]);
    assert_eq!(output.code, 0, "{}", output.stderr);
    let marks = fs::read_to_string(folder.path().join("gallery/marks.csv")).unwrap();
    for row in marks.lines().skip(1) {
        let failed = row.split(',').nth(2).unwrap();
        let is_of_run = |check| ["run", "overlap"].contains(&check);
        assert!(failed.split_whitespace().all(is_of_run), "{row}");
    }
    let n_scenes = files_below(&ours).len() / 2;
    assert_eq!(marks.lines().count(), 1 + n_scenes, "{marks}");
    n_scenes
}

/// A text that no page may show.
const SECRET: &str = "machine example.org login ta password hunter2";

/// The page of a gallery of the folder `class`, and its sheet for marks.
fn gallery(folder: &Path, more: &[&str]) -> (String, String) {
    let arguments = ["gallery", "class", "-o", "gallery", "--seconds", "2"];
    let output = grade(folder, &[&arguments[..], more].concat());
    assert_eq!(output.code, 0, "{}", output.stderr);
    let read = |name: &str| fs::read_to_string(folder.join("gallery").join(name)).unwrap();
    (read("index.html"), read("marks.csv"))
}

/// The text of the card of a scene.
fn card<'p>(page: &'p str, name: &str) -> &'p str {
    let mut cards = page.split("<section class=\"card\"");
    cards.find(|card| card.contains(&format!(">{name}</h2>"))).expect(page)
}

#[cfg(target_os = "linux")]
#[test]
fn links_and_meshes_reveal_no_other_file() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let secret = folder.join("netrc");
    fs::write(&secret, SECRET).unwrap();
    let eve = folder.join("class/eve");
    write(&eve.join("mesh.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    symlink(&secret, eve.join("a_t1m2.xml")).unwrap();
    symlink(&secret, eve.join("link.obj")).unwrap();
    symlink(folder, eve.join("up")).unwrap();
    let absolute = secret.to_str().unwrap();
    for (name, mesh) in [
        ("b_t1m2.json", absolute),
        ("c_t1m2.json", "../../netrc"),
        ("d_t1m2.json", "link.obj"),
        ("e_t1m2.json", "up/netrc"),
        ("f_t1m2.json", "mesh.obj"),
        ("g_t1m2.json", "missing.obj"),
    ] {
        write(&eve.join(name), &format!("{{\"obj\": {mesh:?}, \"k\": 1, \"m\": 1}}"));
    }
    let (page, marks) = gallery(folder, &[]);
    assert!(!page.contains("hunter2") && !page.contains("machine"), "{page}");
    assert_eq!(marks.lines().count(), 8, "{marks}");
    let outside = "which is not below the scene";
    for (name, reason) in [
        ("a_t1m2.xml", "is a link, not a regular file"),
        ("b_t1m2.json", outside),
        ("c_t1m2.json", outside),
        ("d_t1m2.json", "the mesh link.obj: is a link"),
        ("e_t1m2.json", "the mesh up/netrc: cannot be read"),
        ("f_t1m2.json", "3 particles, 3 edges"),
        ("g_t1m2.json", "g_t1m2.json:1:9: the mesh missing.obj: cannot be read"),
    ] {
        let card = card(&page, &format!("eve/{name}"));
        assert!(card.contains(reason), "{name}: {card}");
        assert_eq!(card.contains("data-motion"), name.starts_with('f'), "{card}");
    }
    for (name, line) in [("b_t1m2.json", "b_t1m2.json:1:9: "), ("c_t1m2.json", "c_t1m2.json:1:9: ")]
    {
        assert!(card(&page, &format!("eve/{name}")).contains(line));
    }
    let output = grade(&eve, &["creative", "a_t1m2.xml"]);
    let printed = output.stderr;
    assert!(output.code == 2 && printed.contains("a_t1m2.xml: is a link"), "{printed}");
}

#[cfg(target_os = "linux")]
#[test]
fn bad_entry_does_not_block_the_gallery() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let eve = folder.join("class/eve");
    write(&folder.join("class/ada_t1m2.xml"), PAIR);
    write(&folder.join("class/=HYPERLINK(1)_t1m2.xml"), PAIR);
    write(&eve.join("locked/x.xml"), PAIR);
    symlink("/nowhere", eve.join("dangling_t1m2.xml")).unwrap();
    assert!(Command::new("mkfifo").arg(eve.join("pipe_t1m2.xml")).status().unwrap().success());
    for number in 0..8 {
        let file = fs::File::create(eve.join(format!("sparse{number}_t1m2.xml"))).unwrap();
        file.set_len(100 << 20).unwrap();
    }
    write(&eve.join("empty_t1m2.xml"), "");
    let deep: std::path::PathBuf = std::iter::repeat_n("d", 110).collect();
    write(&eve.join(deep).join("x.xml"), PAIR);
    fs::set_permissions(eve.join("locked"), fs::Permissions::from_mode(0o0)).unwrap();
    let is_locked = fs::read_dir(eve.join("locked")).is_err();
    let (page, marks) = gallery(folder, &["--hide-names", "key.csv"]);
    fs::set_permissions(eve.join("locked"), fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(page.matches("data-motion").count(), 3 - usize::from(is_locked));
    let (page, _) = gallery(folder, &[]);
    assert!(card(&page, "ada_t1m2.xml").contains("data-motion"));
    for (name, reason) in [
        ("eve/dangling_t1m2.xml", "is a link"),
        ("eve/pipe_t1m2.xml", "is a pipe"),
        ("eve/sparse7_t1m2.xml", "is larger than 16 MiB"),
        ("eve/empty_t1m2.xml", "the file is empty"),
    ] {
        assert!(card(&page, name).contains(reason), "{name}: {}", card(&page, name));
    }
    assert!(page.contains("folders are nested more than 100 deep"), "{page}");
    // Scenes, refused ones among them, and the folder that is too deep.
    assert_eq!(marks.lines().count(), 1 + 15, "{marks}");
    let sheets = [marks, fs::read_to_string(folder.join("key.csv")).unwrap()];
    let (_, open) = gallery(folder, &[]);
    assert!(open.contains("\n'=HYPERLINK(1)_t1m2.xml,"), "{open}");
    assert!(sheets.iter().all(|sheet| !sheet.contains("\n=")), "{sheets:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn scene_over_its_limits_ends_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let eve = folder.join("class/eve");
    write(&folder.join("class/ada_t1m2.xml"), PAIR);
    let corners: String = (1..=3000).map(|number| format!(" {number}")).collect();
    let vertices: String =
        (0..3000).map(|number| format!("v {number} {} 0\n", number * number)).collect();
    write(&eve.join("face.obj"), &format!("{vertices}f{corners}\n"));
    write(&eve.join("face_t1m2.json"), "{\"obj\": \"face.obj\", \"k\": 1, \"m\": 1}");
    let endless = PAIR
        .replace("\"symplectic-euler\"", "\"fast-mass-spring\" iterations=\"1000000000000000\"");
    write(&eve.join("endless_t1m2.xml"), &endless);
    let particle = "<particle m=\"1\" px=\"0\" py=\"0\" vx=\"0\" vy=\"0\" fixed=\"0\"/>";
    let heap =
        "<scene><duration time=\"0.02\"/><integrator type=\"symplectic-euler\" dt=\"0.01\"/>";
    write(&eve.join("heap_t1m2.xml"), &format!("{heap}{}</scene>", particle.repeat(60_000)));
    let (page, _) = gallery(folder, &["--limit", "memory=200M"]);
    assert!(card(&page, "ada_t1m2.xml").contains("data-motion"));
    let face = card(&page, "eve/face_t1m2.json");
    assert!(face.contains("its check was ended"), "{face}");
    let reasons = ["memory allocation of", "needs more than 200 MiB of memory"];
    assert!(reasons.iter().any(|reason| face.contains(reason)), "{face}");
    let endless = card(&page, "eve/endless_t1m2.xml");
    assert!(endless.contains("step 1 of 50 is not reached within 2 s"), "{endless}");
    let heap = card(&page, "eve/heap_t1m2.xml");
    assert!(heap.contains("particles 0 and 1 are 0 m apart"), "{heap}");
}

#[cfg(target_os = "linux")]
#[test]
fn unprotected_checks_say_so_and_unknown_limits_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&folder.join("ada_t1m2.xml"), PAIR);
    let output = grade(folder, &["creative", "ada_t1m2.xml", "--unprotected"]);
    let printed = output.stderr;
    assert!(
        printed.contains("warning: programs run unprotected, with all your rights"),
        "{printed}"
    );
    assert_eq!(output.code, 1, "no film: {printed}");
    let output = grade(folder, &["creative", "ada_t1m2.xml", "--limit", "colours=1"]);
    assert_eq!(output.code, 2);
}
