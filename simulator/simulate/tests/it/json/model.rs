//! Models of JSON scenes.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use scene::{
    self, Dimension, ForceElement, Location, ParseOptions, Scene, Surface, find_scene_files, write,
};
use simulator::vocabulary;
use tempfile::TempDir;

use super::{INTEGRATOR, JSON, OBJ, folder_of, load, masses, pins};
use crate::support::{simulate, stderr};

/// The scene, about which there is nothing to remark.
fn scene_of(json: &str, obj: &str) -> Scene {
    let folder = folder_of(json, obj);
    let parsed = load(&folder.path().join("scene.json"), true);
    parsed.unwrap_or_else(|error| panic!("{error}\n{json}\n{obj}")).scene
}

/// A scene without a mass or pins, as the mesh gives it.
fn scene_of_mesh(obj: &str) -> Scene {
    scene_of(r#"{"obj": "mesh.obj", "k": 1}"#, obj)
}

fn pairs(scene: &Scene) -> Vec<[usize; 2]> {
    scene.edges.iter().map(|edge| edge.particles).collect()
}

/// Tag, pair and parameters of a force.
type Element<'a> = (&'a str, Option<[usize; 2]>, &'a [f64]);

fn forces(scene: &Scene) -> Vec<Element<'_>> {
    fn element(force: &ForceElement) -> Element<'_> {
        (force.schema.tag, force.pair(), &force.parameters)
    }
    scene.forces.iter().map(element).collect()
}

#[test]
fn every_key_is_read() {
    let scene = scene_of(JSON, OBJ);
    assert_eq!((scene.dimension, scene.n_steps()), (Dimension::Three, 30));
    assert_eq!((scene.duration, scene.time_step), (1.0, 1.0 / 30.0));
    let positions: Vec<[f64; 3]> = scene.particles.iter().map(|p| p.position).collect();
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(positions, [&square[..], &[[0.0, 2.0, 0.0]]].concat());
    assert!(scene.particles.iter().all(|p| p.velocity == [0.0; 3] && p.mass == 2.0));
    assert_eq!(pins(&scene), [0, 2]);
    let diagonal = 2.0_f64.sqrt();
    let expected: [Element<'_>; 9] = [
        ("constantforce", None, &[0.0, -9.8, 0.0]),
        ("windforce", None, &[1.0]),
        ("springforce", Some([0, 1]), &[100.0, 1.0, 0.0]),
        ("springforce", Some([0, 2]), &[100.0, diagonal, 0.0]),
        ("springforce", Some([0, 3]), &[100.0, 1.0, 0.0]),
        ("springforce", Some([1, 2]), &[100.0, 1.0, 0.0]),
        ("springforce", Some([1, 3]), &[100.0, diagonal, 0.0]),
        ("springforce", Some([2, 3]), &[100.0, 1.0, 0.0]),
        ("springforce", Some([3, 4]), &[100.0, 1.0, 0.0]),
    ];
    assert_eq!(forces(&scene), expected);
    let of_springs: Vec<Option<[usize; 2]>> = scene
        .forces
        .iter()
        .filter_map(|force| force.edge.map(|e| Some(scene.edges[e].particles)))
        .collect();
    assert_eq!(of_springs, forces(&scene)[2..].iter().map(|force| force.1).collect::<Vec<_>>());
    assert_eq!(scene.forces[2].location, Location { line: 3, column: 8 });
    assert_eq!(scene.forces[1].location, Location { line: 7, column: 11 });
}

#[test]
fn wind_pins_and_texture_are_optional() {
    for wind in ["", r#", "wind": false"#] {
        let json = format!(r#"{{"obj": "mesh.obj", "k": 0, "m": 1{wind}}}"#);
        let scene = scene_of(&json, OBJ);
        assert!(scene.forces.iter().all(|force| force.schema.tag != "windforce"), "{json}");
    }
    for (pinned, expected) in
        [("[]", vec![]), ("2", vec![1]), ("[ 5 ]", vec![4]), ("[2,\n1e0, 3.0]", vec![0, 1, 2])]
    {
        let json = format!(r#"{{"obj": "mesh.obj", "k": 1, "m": 1, "b": {pinned}}}"#);
        assert_eq!(pins(&scene_of(&json, OBJ)), expected, "{pinned}");
    }
}

#[test]
fn a_pair_has_one_spring_however_many_faces_share_it() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\n";
    let with = |joins: &str| {
        pairs(&scene_of_mesh(&format!("{vertices}f 1 2 4\nf 1 4 3\nf 2 5 4\n{joins}")))
    };
    let triangles = [[0, 1], [0, 3], [1, 3], [0, 2], [3, 2], [1, 4], [4, 3]];
    assert_eq!(with(""), triangles);
    // The line runs along the border but for its last step.
    assert_eq!(with("l 1 2 5 4 3 5"), [&triangles[..], &[[2, 4]]].concat());
    // A pentagon brings all ten pairs, of which seven are there.
    assert_eq!(with("f 1 2 5 4 3"), [&triangles[..], &[[0, 4], [1, 2], [4, 2]]].concat());
}

#[test]
fn a_mesh_may_be_written_in_every_way_of_the_format() {
    let expected = scene_of_mesh("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
    for (name, obj) in [
        ("texture", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 4/1"),
        (
            "texture and normal",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 2//1 3/1/1 4/",
        ),
        ("backwards", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3/-1 -2 -1\nvt 0 0"),
        ("faces first", "f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0"),
        ("weights and colours", "v 0 0 0 1\nv 1 0 0 .1 .2 .3\nv 1 1 0 1 1 1 1\nv 0 1 0\nf 1 2 3 4"),
        ("continued", "v 0 0\\\n 0\nv 1 0 0\nv 1 \\ \n  1 \\\n0\nv 0 1 0\nf 1 2 \\\r\n3 4"),
        (
            "odd spaces",
            "\r\n\tv\t0  0 0 \r\n v 1e0 +0 -0.0\r\nv 1 1 0#c\\\nv .0 1. 0\n#f 1 2\n\nf 1 2 3 4",
        ),
        (
            "groups",
            "mtllib a.mtl\no x\ng a b\nv 0 0 0\nv 1 0 0\nv 1 1 0\ns off\nv 0 1 0\nusemtl #\nf 1 2 3 4",
        ),
        ("byte order mark", "\u{feff}v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4"),
    ] {
        let scene = scene_of_mesh(obj);
        assert_eq!(pairs(&scene), pairs(&expected), "{name}");
        assert_eq!(scene.particles, expected.particles, "{name}");
    }
}

#[test]
fn masses_are_areas_where_none_is_given() {
    let two_triangles = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nf 2 3 1\nf 4 1 3";
    let meshes: [(&str, &str, &[f64]); 4] = [
        // Half of a right triangle is at its right angle, a quarter at each of the others.
        ("two right triangles", two_triangles, &[1.5, 1.5, 1.5, 1.5]),
        ("obtuse", "v 0 0 0\nv 4 0 0\nv 5 0 3\nf 1 2 3", &[1.5, 3.0, 1.5]),
        (
            "one beside a face of two",
            "v 0 0 0\nv 2 0 0\nv 2 3 0\nf 1 3\nf 1 2 3",
            &[0.75, 1.5, 0.75],
        ),
        // A fan of three right triangles of area 1/2 around the first corner: 1 5 2, 1 2 3 and 1 3 4.
        (
            "a pentagon",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 0\nf 1 5 2 3 4",
            &[0.5, 0.375, 0.25, 0.25, 0.125],
        ),
    ];
    for (name, obj, expected) in meshes {
        let masses = masses(&scene_of_mesh(obj));
        assert_eq!(masses.len(), expected.len());
        for (mass, expected) in masses.iter().zip(expected) {
            assert!((mass - expected).abs() < 1e-14, "{name}: {masses:?}");
        }
    }
}

#[test]
fn zero_length_spring_needs_no_direction() {
    let folder =
        folder_of(r#"{"obj": "mesh.obj", "k": 5, "m": 1, "b": 1}"#, "v 1 0 0\nv 1 0 0\nf 1 2\n");
    let run = simulate(folder.path(), &["scene.json", "--integrator", INTEGRATOR, "-o", "t.csv"]);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    let trace = fs::read_to_string(folder.path().join("t.csv")).unwrap();
    assert!(trace.lines().count() == 32 && !trace.contains("NaN"), "{trace}");
}

#[test]
fn arguments_override_the_scene() {
    let folder = folder_of(JSON, OBJ);
    let run = simulate(
        folder.path(),
        &[
            "scene.json",
            "--integrator",
            "implicit",
            "--dt",
            "0.25",
            "--duration",
            "2",
            "-o",
            "t.csv",
        ],
    );
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    let trace = fs::read_to_string(folder.path().join("t.csv")).unwrap();
    assert_eq!(trace.lines().count(), 10);
    assert!(trace.lines().last().unwrap().starts_with("8,2.0,0.0,0.0,0.0,0.0,0.0,0.0,"), "{trace}");
}

#[test]
fn default_method_is_the_assignments() {
    let folder = folder_of(JSON, OBJ);
    let vocabulary = vocabulary();
    let path = folder.path().join("scene.json");
    let read = scene::load(&path, &vocabulary, &ParseOptions::default());
    if vocabulary.integrator("fast-mass-spring").is_some() {
        let scene = read.unwrap().scene;
        assert_eq!(scene.integrator.name, "fast-mass-spring");
        assert_eq!(scene.integrator_options.choice("pins"), "penalty");
    } else {
        let message = read.unwrap_err().to_string();
        assert!(message.contains(r#"unknown integrator type "fast-mass-spring""#), "{message}");
    }
}

#[test]
fn the_extension_may_be_in_upper_case_and_the_mesh_in_another_folder() {
    let folder = TempDir::new().unwrap();
    fs::create_dir_all(folder.path().join("scenes/meshes")).unwrap();
    let scene = folder.path().join("scenes/NET.Json");
    fs::write(&scene, JSON.replace("mesh.obj", r"meshes\/m\u0065sh.obj")).unwrap();
    fs::write(folder.path().join("scenes/meshes/mesh.obj"), OBJ).unwrap();
    let parsed = load(&scene, true).unwrap();
    let mesh = parsed.mesh.unwrap();
    assert_eq!(mesh.path, folder.path().join("scenes/meshes/mesh.obj"));
    assert_eq!(mesh.bytes, OBJ.as_bytes());
    assert_eq!(find_scene_files(folder.path()).unwrap(), [scene]);
}

#[test]
fn a_scene_written_as_xml_is_the_same_scene() {
    let area = JSON.replace("\"m\": 2,", "").replace("true", "false");
    for (json, obj) in [(JSON, OBJ), (&area, &OBJ.replace("l 4 5", "f 4 5 3"))] {
        let mut scene = scene_of(json, obj);
        let mut xml = Vec::new();
        write::write(&scene, &mut xml).unwrap();
        let options = ParseOptions { strict: true, ..ParseOptions::default() };
        let parsed = scene::parse_bytes(&xml, Path::new("x.xml"), &vocabulary(), &options).unwrap();
        let mut read = parsed.scene;
        // Places and the name are the file's own; XML has no surfaces.
        scene.rendering.surface = Surface::default();
        read.name.clone_from(&scene.name);
        for force in read.forces.iter_mut().chain(&mut scene.forces) {
            force.location = Location::default();
        }
        assert_eq!(format!("{read:?}"), format!("{scene:?}"));
    }
}

#[test]
fn other_json_files_are_ignored_and_broken_scenes_are_not() {
    let folder = TempDir::new().unwrap();
    let files = [
        ("a.json", JSON, true),
        ("cut.json", &JSON[..20], true),
        ("empty.json", "", true),
        ("no-mesh.json", r#"{"k": 1}"#, true),
        ("list.json", "[1, 2]", false),
        ("report.json", r#"{"schema_version": 1, "scenes": []}"#, false),
        ("mesh.obj", OBJ, false),
        ("any.xml", "", true),
    ];
    for (name, text, _) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    fs::create_dir(folder.path().join("folder.json")).unwrap();
    let found: BTreeSet<PathBuf> = find_scene_files(folder.path()).unwrap().into_iter().collect();
    let expected = files.iter().filter(|(.., is_scene)| *is_scene);
    assert_eq!(found, expected.map(|(name, ..)| folder.path().join(name)).collect());
}
