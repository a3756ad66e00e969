//! Records of iterations (`--iterations`), and diagrams of convergence (`--convergence`).

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn simulate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_simulate")).args(arguments).output().unwrap()
}

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../extracreditassets").join(name)
}

/// Rows of the record of a run of 0.02 s: step, iteration, and the other columns; NaN where they are empty.
fn iterations(scene: &Path, options: &[&str]) -> Vec<[f64; 6]> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("iterations.csv");
    let (scene, path) = (scene.to_str().unwrap(), file.to_str().unwrap());
    let mut arguments = vec![scene, "--duration", "0.02", "--iterations", path];
    arguments.extend(options);
    let output = simulate(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("step,iteration,residual,energy,step_length,halvings"));
    let row = |line: &str| {
        let values: Vec<f64> =
            line.split(',').map(|value| value.parse().unwrap_or(f64::NAN)).collect();
        values.try_into().unwrap()
    };
    lines.map(row).collect()
}

/// The last iterate of the first step.
fn end_of_first_step(rows: &[[f64; 6]]) -> [f64; 6] {
    *rows.iter().rfind(|row| row[0] == 1.0).unwrap()
}

#[test]
fn minimising_methods_agree_on_the_minimum() {
    let scene = scene("ProjectedNewton/hookean-square.xml");
    let tolerance = ["--option", "tolerance=1e-8"];
    let methods: [&[&str]; 5] = [
        &["--integrator", "implicit-euler"],
        &["--option", "direction=newton"],
        &["--option", "direction=gauss-newton"],
        &["--option", "direction=gradient"],
        &["--integrator", "fast-mass-spring", "--option", "iterations=200"],
    ];
    let mut ends = Vec::new();
    for method in methods {
        let is_minimiser = !method.contains(&"--integrator");
        let options = [method, if is_minimiser { &tolerance } else { &[] }].concat();
        let rows = iterations(&scene, &options);
        let first: Vec<_> = rows.iter().filter(|row| row[0] == 1.0).collect();
        assert!(first[0][4].is_nan(), "{method:?}: the first iterate has no step length");
        for (number, pair) in first.windows(2).enumerate() {
            assert_eq!(pair[1][1], number as f64 + 1.0, "{method:?}");
            let rounding = 1e-12 * pair[0][3].abs();
            assert!(pair[1][3] <= pair[0][3] + rounding, "{method:?}: energy grows at {number}");
            assert_eq!(pair[1][4], 0.5_f64.powi(pair[1][5] as i32), "{method:?}");
        }
        let end = end_of_first_step(&rows);
        assert!(end[2] < 1e-6 * first[0][2], "{method:?}: residual {} of {}", end[2], first[0][2]);
        ends.push(end[3]);
    }
    for energy in &ends {
        assert!((energy - ends[1]).abs() <= 1e-11 * ends[1].abs(), "{ends:?}");
    }
}

#[test]
fn recording_does_not_change_the_trace() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene("ProjectedNewton/crumpled-kite.xml");
    let trace = |name: &str, more: &[&str]| {
        let path = folder.path().join(name);
        let arguments = [scene.to_str().unwrap(), "-o", path.to_str().unwrap()];
        assert!(simulate(&[&arguments, more].concat()).status.success());
        std::fs::read(path).unwrap()
    };
    let record = folder.path().join("record.csv");
    assert!(
        trace("a.csv", &[]) == trace("b.csv", &["--iterations", record.to_str().unwrap()]),
        "the trace has changed"
    );
}

#[test]
fn a_method_without_iterations_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("iterations.csv");
    let scene = scene("ProjectedNewton/crumpled-kite.xml");
    let output = simulate(&[
        scene.to_str().unwrap(),
        "--integrator",
        "explicit-euler",
        "--iterations",
        file.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("explicit-euler has no iterations to record"), "{message}");
    assert!(!file.exists());
}

#[test]
fn the_diagram_of_convergence_shows_each_method_that_applies() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("convergence.svg");
    let diagram = |scene: &Path, more: &[&str]| {
        let _ = std::fs::remove_file(&file);
        let arguments = [scene.to_str().unwrap(), "--convergence", file.to_str().unwrap()];
        let output = simulate(&[&arguments, more].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let curves = |svg: &str| svg.matches("<polyline").count();

    let (code, notes) = diagram(&scene("ProjectedNewton/hookean-square.xml"), &[]);
    assert_eq!((code, notes.as_str()), (Some(0), ""));
    let svg = std::fs::read_to_string(&file).unwrap();
    // Five methods in two panels, and a line search with the level of its start.
    assert_eq!(curves(&svg), 12);

    // Springs of squared length have no local step; Newton's steps are halved.
    let (code, notes) = diagram(&scene("ProjectedNewton/crumpled-square.xml"), &[]);
    assert_eq!(code, Some(0));
    assert!(notes.starts_with("note: local-global: "), "{notes}");
    let svg = std::fs::read_to_string(&file).unwrap();
    assert_eq!(curves(&svg), 10);
    assert!(svg.matches("<circle").count() > 1, "no halving is shown");

    let beyond = ["--convergence-step", "1000000"];
    let (code, message) = diagram(&scene("ProjectedNewton/hookean-square.xml"), &beyond);
    assert_eq!(code, Some(2));
    assert!(message.contains("there is no step 1000000"), "{message}");
    assert!(!file.exists());
}

#[test]
fn unrecordable_run_is_refused_before_writing() {
    let folder = tempfile::tempdir().unwrap();
    let [plot, record] = ["plot.svg", "record.csv"].map(|name| folder.path().join(name));
    let scene = scene("ProjectedNewton/hookean-square.xml");
    let [scene, plot_path, record_path] =
        [&scene, &plot, &record].map(|path| path.to_str().unwrap());
    let explicit = ["--integrator", "explicit-euler", "--iterations", record_path];
    let beyond = ["--convergence", record_path, "--convergence-step", "1000000"];
    for more in [explicit, beyond] {
        let output = simulate(&[&[scene, "--plot", plot_path][..], &more].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(!plot.exists() && !record.exists(), "{more:?}");
    }
}
