//! Frames and films of `simulate`.

use std::fs;
use std::path::Path;

use crate::support::{simulate, stderr};
use picture::canvas::Canvas;
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
fn film_loops_and_replaces_a_file_only_when_complete() {
    let folder = folder();
    run(folder.path(), &["scene.xml", "--film", "film.gif", "--fps", "20", "--size", "80x40"]);
    let gif = fs::read(folder.path().join("film.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a") && gif.windows(11).any(|bytes| bytes == b"NETSCAPE2.0"));
    run(folder.path(), &["scene.xml", "--film", "again.gif", "--fps", "20", "--size", "80x40"]);
    assert_eq!(fs::read(folder.path().join("again.gif")).unwrap(), gif);
    assert_eq!(names(folder.path()), ["again.gif", "film.gif", "scene.xml"]);
}

#[test]
fn triangles_are_filled_only_with_strain() {
    let folder = folder();
    run(folder.path(), &["generate", "sheet", "--duration", "0.1", "-o", "sheet.xml"]);
    let frame = |options: &[&str]| {
        run(folder.path(), &[&["sheet.xml", "-m", "svgs", "--fps", "10"], options].concat());
        fs::read_to_string(folder.path().join("svgs/frame00001.svg")).unwrap()
    };
    let count = |svg: &str| [svg.matches("<path").count(), svg.matches("<line").count()];
    assert_eq!(count(&frame(&[])), [0, 212]);
    let filled = frame(&["--strain", "0.01"]);
    assert_eq!(count(&filled), [128, 0]);
    assert!(filled.matches("fill=\"#440154\"").count() < 128, "all at rest");
}

#[test]
fn unfilmable_scene_is_refused_with_a_remedy() {
    let folder = folder();
    for (arguments, says) in [
        (["--film", "film.mov"], "name it .gif, .mp4, .webm or .avi"),
        (["--size", "80"], "such as 800x600"),
        (["--fps", "0"], "a number above 0"),
        (["--strain", "0"], "a number above 0, such as 0.1"),
        (["--film", "none/film.gif"], "name a file in a folder that takes new files"),
    ] {
        let run = simulate(folder.path(), &[&["scene.xml"], &arguments[..]].concat());
        assert_eq!(run.status.code(), Some(2));
        assert!(stderr(&run).contains(says), "{}", stderr(&run));
    }
    assert_eq!(names(folder.path()), ["scene.xml"]);
}

/// Two squares of different materials. Fixed particles stand still.
const MESH: &str = "mtllib net.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl cloth of silk
f 1/1 2/2 3/3 4/4
usemtl paint
f 2 5 6 3
";

const LIBRARY: &str = "# materials
newmtl paint
Kd 0 0 1
d 1
newmtl cloth of silk
Kd 1 0.5 0.5
map_Kd -s 1 1 1 -clamp on pictures\\silk.png
newmtl unused
map_Kd none.png
";

/// A folder with a mesh, its library and its picture, which is green.
fn meshed(mesh: &str, library: Option<&str>) -> TempDir {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scene = r#"{"obj": "net.obj", "k": 1, "m": 1, "b": [1, 2, 3, 4, 5, 6]}"#;
    fs::write(at("scene.json"), scene).unwrap();
    fs::write(at("net.obj"), mesh).unwrap();
    if let Some(library) = library {
        fs::write(at("net.mtl"), library).unwrap();
    }
    fs::create_dir(at("pictures")).unwrap();
    fs::write(at("pictures/silk.png"), Canvas::new(2, 2, [0, 255, 0]).png().unwrap()).unwrap();
    folder
}

/// The first frame, as SVG, and the messages.
fn first_frame(folder: &Path) -> (String, String) {
    let options = ["--frames", "frames", "--frame-format", "svg", "--fps", "1"];
    let run = simulate(folder, &[&["scene.json"], &options[..]].concat());
    assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
    let frame = fs::read_to_string(folder.join("frames/frame00000.svg")).unwrap();
    (frame, stderr(&run).to_owned())
}

/// The colours of the triangles, as red, green and blue.
fn colors(frame: &str) -> Vec<[u8; 3]> {
    let of = |line: &str| {
        let (_, color) = line.split_once("fill=\"#")?;
        let part = |at: usize| u8::from_str_radix(&color[at..at + 2], 16).ok();
        Some([part(0)?, part(2)?, part(4)?])
    };
    frame.lines().filter(|line| line.starts_with("<path")).filter_map(of).collect()
}

#[test]
fn faces_have_the_colours_and_pictures_of_their_materials() {
    let folder = meshed(MESH, Some(LIBRARY));
    let (frame, messages) = first_frame(folder.path());
    assert_eq!(messages, "");
    let colors = colors(&frame);
    assert_eq!(colors.len(), 4, "{frame}");
    // The light and the distance scale them: a green picture times (1, 0.5, 0.5), and blue.
    let greens = colors.iter().filter(|[red, green, blue]| green > red && green > blue).count();
    let blues = colors.iter().filter(|[red, green, blue]| blue > red && blue > green).count();
    assert_eq!((greens, blues), (2, 2), "{colors:?}");
    let brightest = |channel: usize| colors.iter().map(|color| color[channel]).max().unwrap();
    assert!(brightest(1) < brightest(2), "Kd multiplies the picture: {colors:?}");
    // A picture that the scene itself names covers all faces that have texture coordinates.
    fs::write(folder.path().join("red.png"), Canvas::new(1, 1, [255, 0, 0]).png().unwrap())
        .unwrap();
    let scene = fs::read_to_string(folder.path().join("scene.json")).unwrap();
    let scene = scene.replace("\"k\"", "\"png\": \"red.png\", \"k\"");
    fs::write(folder.path().join("scene.json"), scene).unwrap();
    let (frame, messages) = first_frame(folder.path());
    assert_eq!(messages, "");
    assert!(self::colors(&frame).iter().all(|[red, _, blue]| red > blue), "{frame}");
}

#[test]
fn unreadable_materials_are_noted_with_file_and_line() {
    let plain = MESH.replace("mtllib net.mtl\n", "").replace("usemtl", "#");
    let (expected, messages) = first_frame(meshed(&plain, None).path());
    assert_eq!(messages, "");
    let bad_mesh = MESH.replace("vt 0 0", "usemtl none\nf 1 2 3 4\nvt 0 0");
    let red = LIBRARY.replace("Kd 0 0 1", "Kd blue").replace("Kd 1 0.5 0.5\n", "");
    // The library, what the note says, and whether no face has a material then.
    for (mesh, library, says, is_plain) in [
        (
            MESH,
            None,
            &[
                "net.obj:1:8: the material library net.mtl: cannot be read",
                "net.obj:12:8: there is no material \"cloth of silk\"",
                "net.obj:14:8: there is no material \"paint\"",
            ][..],
            true,
        ),
        (
            MESH,
            Some("\u{1}\u{2} no library\n"),
            &["net.obj:1:8: the material library net.mtl has no material (newmtl)"],
            true,
        ),
        (
            MESH,
            Some("Kd 1 0 0\nnewmtl paint\nnewmtl cloth of silk\nmap_Kd\n"),
            &["net.mtl:1: Kd stands before the first newmtl", "net.mtl:4: map_Kd names no file"],
            true,
        ),
        (
            MESH,
            Some(&*red.replace("silk.png", "wool.png")),
            &["net.mtl:3: Kd needs three numbers", "net.mtl:6: pictures/wool.png: cannot be read"],
            true,
        ),
        (
            MESH,
            Some(&*red.replace("pictures\\silk.png", "net.obj")),
            &["net.mtl:6: net.obj: cannot be read as PNG: Invalid PNG signature."],
            true,
        ),
        (&bad_mesh, Some(LIBRARY), &["net.obj:8:8: there is no material \"none\""], false),
    ] {
        let (frame, messages) = first_frame(meshed(mesh, library).path());
        for text in says {
            assert!(messages.contains(&format!("warning: {text}")), "{text}\n{messages}");
        }
        assert!(messages.contains("note: the mesh is drawn without it"), "{messages}");
        assert_eq!(frame == expected, is_plain, "{messages}");
    }
    // A library of a million bad lines is a few notes.
    let many = format!("newmtl paint\n{}", "Kd\n".repeat(1_000_000));
    let (_, messages) = first_frame(meshed(MESH, Some(&many)).path());
    assert!(messages.contains("more notes on its materials"), "{messages}");
    assert!(messages.lines().count() < 50, "{messages}");
}
