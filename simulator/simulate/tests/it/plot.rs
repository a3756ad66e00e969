//! Diagrams of `simulate --plot`.

use std::fs;
use std::path::Path;

use crate::support::{simulate, stderr};
use tempfile::TempDir;

/// An oscillator with ω = 4 / s, which leaves rest at 1.3 times its length.
const SCENE: &str = r#"<scene>
  <duration time="9"/>
  <integrator type="symplectic-euler" dt="0.05"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="1" px="1.3" py="0" vx="0" vy="0" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="16" l0="1"/>
</scene>
"#;

fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("a < b.xml"), SCENE).unwrap();
    folder
}

/// The points of every curve.
fn curves(folder: &Path, name: &str) -> Vec<Vec<[f64; 2]>> {
    let svg = fs::read_to_string(folder.join(name)).unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let point = |text: &str| {
        let (x, y) = text.split_once(',').unwrap();
        [number(x), number(y)]
    };
    let parts = svg.split(" points=\"").skip(1).map(|part| part.split('"').next().unwrap());
    parts.map(|points| points.split(' ').map(point).collect()).collect()
}

#[test]
fn a_diagram_has_the_energies_and_momenta_of_each_integrator() {
    let folder = folder();
    let folder = folder.path();
    let integrators = ["symplectic-euler", "implicit-euler", "explicit-euler"];
    let arguments: Vec<&str> = ["a < b.xml", "--plot", "plot.svg"]
        .into_iter()
        .chain(integrators.iter().flat_map(|name| ["--integrator", name]))
        .collect();
    let run = simulate(folder, &arguments);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    // Nothing but the scene and the diagram.
    assert_eq!(fs::read_dir(folder).unwrap().count(), 2);
    let svg = fs::read_to_string(folder.join("plot.svg")).unwrap();
    assert!(svg.contains("Paths, energy and momentum of a &lt; b.xml"), "{svg}");
    assert!(svg.contains(">symplectic-euler<") && svg.contains(">implicit-euler<"));
    // ω² h² = 0.04: explicit Euler's energy grows by that factor in each of the 180 steps.
    assert!(svg.contains(">explicit-euler, leaves the diagram<"), "{svg}");
    let curves = curves(folder, "plot.svg");
    // And the path of the particle that moves.
    assert_eq!(curves.len(), 3 * 3 + 3 * 2 + 3);
    let height = |curve: &[[f64; 2]]| {
        let values = || curve.iter().map(|point| point[1]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    // Symplectic Euler keeps the total energy and exchanges its parts; implicit Euler loses it.
    let [total, kinetic] = [height(&curves[0]), height(&curves[1])];
    assert!(total < 0.2 * kinetic, "{total} {kinetic}");
    let damped = &curves[3];
    assert!(damped.last().unwrap()[1] > damped[0][1] + 0.5 * height(&curves[1]));
    assert!(curves[..9].iter().all(|curve| curve.len() == 181));
}

/// A light body on a circular orbit of radius 1 and period 2π about a heavy one, and a body that stands still.
const ORBIT: &str = r#"<scene>
  <duration time="25"/>
  <integrator type="symplectic-euler" dt="0.02"/>
  <particle m="1000" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="1" px="1" py="0" vx="0" vy="1" fixed="0"/>
  <particle m="1" px="0" py="0.5" vx="0" vy="0" fixed="0"/>
  <gravitationalforce i="0" j="1" G="0.001"/>
</scene>
"#;

#[test]
fn orbits_spiral_outwards_close_or_spiral_inwards() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("orbit.xml"), ORBIT).unwrap();
    let integrators = "explicit-euler,symplectic-euler,implicit-euler,rk4";
    let arguments =
        ["orbit.xml", "--duration", "6", "--plot", "orbit.svg", "--integrator", integrators];
    let run = simulate(folder, &arguments);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    let svg = fs::read_to_string(folder.join("orbit.svg")).unwrap();
    assert!(svg.contains("Paths of 2 of 3 particles, x and y in metres<"), "{svg}");
    let drawn: Vec<_> = curves(folder, "orbit.svg").split_off(4 * (3 + 2));
    assert_eq!(drawn.len(), 4 * 2);
    let frame = |name: &str| {
        let part = svg.split(&format!("<clipPath id=\"{name}\"><rect x=\"")).nth(1).unwrap();
        let number = |text: &str| text.parse::<f64>().unwrap();
        let numbers: Vec<f64> = part.split('"').step_by(2).take(3).map(number).collect();
        [numbers[0], numbers[1], numbers[2]]
    };
    // The fourth frame is below the first one; all have one size.
    let frames: Vec<[f64; 3]> = (0..4).map(|number| frame(&format!("paths{number}"))).collect();
    assert!(frames[0][0] < frames[1][0] && frames[1][0] < frames[2][0]);
    assert!(frames[3][0] == frames[0][0] && frames[3][1] > frames[0][1] + frames[0][2]);
    // The particle that stands still is at (0, 0.5) in all: the scale is the distance of the other's start from it.
    let radii: Vec<Vec<f64>> = (0..4)
        .map(|number| {
            let [moving, still] = [&drawn[2 * number], &drawn[2 * number + 1]];
            assert_eq!(still.len(), 1);
            let [start, rest] = [moving[0], still[0]];
            let scale = start[0] - rest[0];
            assert!((start[1] - rest[1] - 0.5 * scale).abs() < 0.02, "x and y have one scale");
            let center = [rest[0], start[1]];
            moving.iter().map(|[x, y]| (x - center[0]).hypot(y - center[1]) / scale).collect()
        })
        .collect();
    let last = |number: usize| *radii[number].last().unwrap();
    // Explicit Euler's radius grows by about h a radian, implicit Euler's shrinks as fast.
    assert!(last(0) > 1.1 && last(2) < 0.9, "{} {}", last(0), last(2));
    for number in [1, 3] {
        assert!(radii[number].iter().all(|radius| (radius - 1.0).abs() < 0.03), "{number}");
    }
    assert!(!svg.contains("leaves the frame"));
}

#[test]
fn far_paths_leave_the_frame_and_many_are_thinned() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("orbit.xml"), ORBIT.replace("dt=\"0.02\"", "dt=\"0.5\"")).unwrap();
    let arguments =
        ["orbit.xml", "--duration", "500", "--plot", "far.svg", "--integrator", "explicit-euler"];
    let run = simulate(folder, &[&arguments[..], &["--integrator", "symplectic-euler"]].concat());
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    let svg = fs::read_to_string(folder.join("far.svg")).unwrap();
    assert!(
        svg.contains(">explicit-euler, leaves the frame<") && svg.contains(">symplectic-euler<")
    );
    let particle = r#"<particle m="1" px="0" py="0" vx="1" vy="0" fixed="0"/>"#.repeat(60);
    let many = ORBIT.replace("</scene>", &format!("{particle}</scene>"));
    fs::write(folder.join("many.xml"), many).unwrap();
    let run = simulate(folder, &["many.xml", "--duration", "1", "--plot", "many.svg"]);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    let svg = fs::read_to_string(folder.join("many.svg")).unwrap();
    assert!(svg.contains("Paths of 24 of 63 particles"));
    assert_eq!(curves(folder, "many.svg").len(), 3 + 2 + 24);
}

#[test]
fn several_integrators_need_a_diagram() {
    let folder = folder();
    let arguments =
        ["a < b.xml", "--integrator", "implicit-euler", "--integrator", "explicit-euler"];
    let run = simulate(folder.path(), &arguments);
    assert_eq!(run.status.code(), Some(2));
    assert!(stderr(&run).contains("several integrators need --plot"), "{}", stderr(&run));
}

#[test]
fn a_diagram_replaces_no_input_and_no_other_output() {
    let folder = folder();
    for other in ["a < b.xml", "same.csv"] {
        let arguments = ["a < b.xml", "-o", "same.csv", "--plot", other];
        let run = simulate(folder.path(), &arguments);
        assert_eq!(run.status.code(), Some(2), "{other}");
        assert!(stderr(&run).contains("cannot be one file"), "{}", stderr(&run));
    }
}
