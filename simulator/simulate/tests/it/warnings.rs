//! Warnings of runs with doubtful, frozen or replaced steps.

use std::fs;

use crate::failing::{ONTO, compressed, flung};
use crate::shared::parse;
use crate::support::{simulate, stderr};
use simulator::simulation::Simulation;
use tempfile::TempDir;

#[test]
fn doubtful_steps_are_warned_once_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let text = compressed("linearized-implicit-euler", -10.0);
    fs::write(folder.path().join("flat.xml"), &text).unwrap();
    let plain = simulate(folder.path(), &["flat.xml", "-o", "flat.csv", "--stats"]);
    assert_eq!(plain.status.code(), Some(0), "{}", stderr(&plain));
    let printed = stderr(&plain);
    let singular =
        "warning: flat.xml: step 1 (from t = 0 s): the matrix of the step is nearly singular";
    assert_eq!(printed.matches(singular).count(), 1, "{printed}");
    let grown = "warning: flat.xml: step 1 (to t = 0.1 s): the energy has grown to ";
    assert_eq!(printed.matches(grown).count(), 1, "{printed}");
    let stats = String::from_utf8_lossy(&plain.stdout);
    assert!(stats.contains("nearly singular steps  1"), "{stats}");
    let trace = fs::read_to_string(folder.path().join("flat.csv")).unwrap();
    let scene = parse(&text);
    let mut simulation = Simulation::new(&scene);
    assert!(simulation.advance().unwrap());
    let y = simulation.state().positions[3];
    assert!(trace.contains(&format!("{y:?}")) || trace.contains(&format!("{y}")), "{trace}");

    let robust = simulate(folder.path(), &["flat.xml", "--robust"]);
    assert!(!stderr(&robust).contains("warning") && stderr(&robust).contains("substeps"));
}

#[test]
fn fallbacks_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("flung.xml"), flung("0")).unwrap();
    fs::write(folder.path().join("onto.xml"), ONTO).unwrap();
    let plain = simulate(folder.path(), &["flung.xml", "-o", "flung.csv"]);
    assert_eq!(plain.status.code(), Some(2));
    assert!(!folder.path().join("flung.csv").exists());

    let robust = simulate(folder.path(), &["flung.xml", "-o", "flung.csv", "--robust", "--stats"]);
    assert_eq!(robust.status.code(), Some(0), "{}", stderr(&robust));
    assert!(
        stderr(&robust).contains("a line search solved their equations"),
        "{}",
        stderr(&robust)
    );
    assert!(String::from_utf8_lossy(&robust.stdout).contains("steps by line search"));
    assert!(folder.path().join("flung.csv").exists());

    let onto = simulate(folder.path(), &["onto.xml", "--robust"]);
    let printed = "1 were replaced by 2 substeps, so the trace differs from plain \
                linearized-implicit-euler at dt = 0.5";
    assert!(stderr(&onto).contains(printed), "{}", stderr(&onto));
}

#[test]
fn frozen_steps_are_counted_and_warned_once() {
    let folder = TempDir::new().unwrap();
    let text = r#"<scene><duration time="1"/><integrator type="projected-newton" dt="0.001"/>
        <particle m="1" px="0" py="0" vx="0" vy="0.025" fixed="0"/><simplegravity fx="0" fy="-9.81"/></scene>"#;
    fs::write(folder.path().join("scene.xml"), text).unwrap();
    let run = simulate(folder.path(), &["scene.xml", "--stats", "--option", "min_iterations=0"]);
    // The particle flies upwards; once its next velocity is below the tolerance of 0.01, it stops for good.
    let expected = "warning: scene.xml: projected-newton left the particles where they were in 999 steps, first in step 2: the first Newton iteration was within the tolerance\n  help: set min_iterations to 1, or a smaller tolerance\n";
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), expected));
    let printed = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(printed.contains("frozen steps           999, first 2\n"), "{printed}");
    let run = simulate(folder.path(), &["scene.xml", "--stats"]);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    assert!(!String::from_utf8_lossy(&run.stdout).contains("frozen"));
}
