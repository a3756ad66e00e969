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
    assert!(svg.contains("Energy and momentum of a &lt; b.xml"), "{svg}");
    assert!(svg.contains(">symplectic-euler<") && svg.contains(">implicit-euler<"));
    // ω² h² = 0.04: explicit Euler's energy grows by that factor in each of the 180 steps.
    assert!(svg.contains(">explicit-euler, leaves the diagram<"), "{svg}");
    let curves = curves(folder, "plot.svg");
    assert_eq!(curves.len(), 3 * 3 + 3 * 2);
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
