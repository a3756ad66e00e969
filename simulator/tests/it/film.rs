//! Frames and films of `simulate`.

use std::fs;
use std::path::Path;

use crate::support::{simulate, stderr};
use tempfile::TempDir;

const SCENE: &str = r#"<scene>
  <duration time="1"/>
  <integrator type="symplectic-euler" dt="0.05"/>
  <viewport cx="0.5" cy="0" size="1"/>
  <backgroundcolor r="0" g="0" b="0"/>
  <particle m="1" px="0" py="0" vx="1" vy="0" fixed="0" radius="0.25"/>
  <particlecolor i="0" r="1" g="0.5" b="0"/>
  <particlepath i="0" duration="0.5" r="0" g="1" b="0"/>
</scene>
"#;

fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), SCENE).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str]) {
    let run = simulate(folder, arguments);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""), "{arguments:?}");
}

/// The names of the files in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn frames_have_the_names_of_the_course_and_the_same_bytes_every_time() {
    let folder = folder();
    let size = ["--fps", "10", "--size", "80x40"];
    run(folder.path(), &[&["scene.xml", "--frames", "a"], &size[..]].concat());
    run(
        folder.path(),
        &[&["-s", "scene.xml", "-d", "0", "-g", "1", "-m", "svgs"], &size[..]].concat(),
    );
    let pngs = names(&folder.path().join("a"));
    assert_eq!(pngs.len(), 11);
    assert_eq!((&*pngs[0], &*pngs[10]), ("frame00000.png", "frame00010.png"));
    assert_eq!(names(&folder.path().join("pngs")), pngs);
    for name in &pngs {
        let bytes = |below: &str| fs::read(folder.path().join(below).join(name)).unwrap();
        assert_eq!(bytes("a"), bytes("pngs"), "{name}");
    }
    // 20 pixels a metre; the particle is 1 m right of the origin at the end.
    let last = fs::read_to_string(folder.path().join("svgs/frame00010.svg")).unwrap();
    assert!(
        last.contains(r##"<circle cx="50.00" cy="20.00" r="5.00" fill="#ff8000"/>"##),
        "{last}"
    );
    assert!(last.contains(r##"fill="#000000""##) && last.contains("<line"), "{last}");
}

#[test]
fn a_film_repeats_and_replaces_nothing_before_it_is_whole() {
    let folder = folder();
    run(folder.path(), &["scene.xml", "--film", "film.gif", "--fps", "20", "--size", "80x40"]);
    let gif = fs::read(folder.path().join("film.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a") && gif.windows(11).any(|bytes| bytes == b"NETSCAPE2.0"));
    run(folder.path(), &["scene.xml", "--film", "again.gif", "--fps", "20", "--size", "80x40"]);
    assert_eq!(fs::read(folder.path().join("again.gif")).unwrap(), gif);
    assert_eq!(names(folder.path()), ["again.gif", "film.gif", "scene.xml"]);
}

#[test]
fn what_cannot_be_filmed_is_refused_with_a_remedy() {
    let folder = folder();
    for (arguments, says) in [
        (["--film", "film.mov"], "name it .gif, .mp4, .webm or .avi"),
        (["--size", "80"], "such as 800x600"),
        (["--fps", "0"], "a number above 0"),
        (["--film", "none/film.gif"], "name a file in a folder that takes new files"),
    ] {
        let run = simulate(folder.path(), &[&["scene.xml"], &arguments[..]].concat());
        assert_eq!(run.status.code(), Some(2));
        assert!(stderr(&run).contains(says), "{}", stderr(&run));
    }
    assert_eq!(names(folder.path()), ["scene.xml"]);
}
