//! Sizes at which another code path begins: their table in `docs/internals.md`, and those that a scene reaches.
//! `UPDATE_DOCS=1 cargo test --release -p simulator --test it sizes` rewrites the table.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use scene::schema::IntegratorOptions;
use scene::{ForceElement, Particle, Scene};
use simulator::generate::{Chain, Generator};
use simulator::integrator::REGISTRY;
use simulator::simulation::Simulation;
use simulator::sizes::{GROUP, MAX_DENSE_GLOBAL_ROWS, PARALLEL, SIZES, WIDEST};
use simulator::vocabulary;
use sparse::sizes::Same;

use crate::support::local_global::Assignment;
use crate::support::{assert_table, largest_difference};
use crate::threads::run;

#[test]
fn table_of_sizes_matches_the_code() {
    let mut table =
        "\n| constant | value | counts | why | both sides |\n| --- | ---: | --- | --- | --- |\n"
            .to_owned();
    for size in SIZES.iter().chain(sparse::sizes::SIZES) {
        let same = match size.same {
            Same::Bits => "same bits",
            Same::Rounding => "within rounding",
        };
        let value = grouped(size.value);
        writeln!(
            table,
            "| `{}` | {value} | {} | {} | {same} |",
            size.name, size.meaning, size.reason
        )
        .unwrap();
    }
    assert_table(
        "internals.md",
        "## Sizes at which another code path begins\n",
        &table,
        "cargo test --release -p simulator --test it sizes",
    );
}

/// Thousands apart.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[test]
fn every_size_has_a_test() {
    let mut sources = String::new();
    let mut folders = ["src", "tests", "sparse/src"]
        .map(|folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder))
        .to_vec();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                sources += &fs::read_to_string(path).unwrap();
            }
        }
    }
    for size in SIZES.iter().chain(sparse::sizes::SIZES) {
        let test = format!("#[test]\n    fn {}()", size.test);
        let found = sources.contains(&test) || sources.contains(&test.replace("    ", ""));
        assert!(found, "{} names the test {}, which is not there", size.name, size.test);
    }
}

/// A scene of another integrator, with some of its options.
pub(crate) fn with(scene: &Scene, integrator: &str, options: &[(&str, &str)]) -> Scene {
    let schema = &REGISTRY.iter().find(|kind| kind.schema.name == integrator).unwrap().schema;
    let mut integrator_options = IntegratorOptions::defaults(schema);
    for (name, value) in options {
        assert!(integrator_options.set(name, value).is_ok(), "{name}");
    }
    Scene { integrator: schema, integrator_options, ..scene.clone() }
}

/// A chain of `links` that swings for two steps.
fn chain(links: u64) -> Scene {
    let mut scene = Chain { links, ..Chain::default() }.scene().unwrap();
    scene.time_step = 1e-3;
    scene.duration = 2e-3;
    scene
}

#[test]
fn threads_begin_at_a_number_of_force_elements() {
    // Forces of zero do not change a bit.
    let mut scene = chain(PARALLEL as u64 - 100);
    let schema = vocabulary().force("constantforce").unwrap();
    let mut expected = None;
    for count in [PARALLEL - 1, PARALLEL, PARALLEL + 1] {
        let zero = ForceElement::new(schema, &[], None, schema.values(&[]));
        scene.forces.resize(count, zero);
        for integrator in ["symplectic-euler", "linearized-implicit-euler"] {
            let scene = with(&scene, integrator, &[]);
            for n_threads in [1, 3] {
                let (states, error) = run(&scene, n_threads);
                assert!(error.is_none() && !states.is_empty(), "{error:?}");
                if integrator == "symplectic-euler" {
                    let expected = expected.get_or_insert_with(|| states.clone());
                    assert!(states == *expected, "{count} elements, {n_threads} threads");
                }
            }
            assert!(run(&scene, 1) == run(&scene, 3), "{integrator}, {count} elements");
        }
    }
}

#[test]
fn the_global_matrix_is_dense_up_to_a_size() {
    for rows in [MAX_DENSE_GLOBAL_ROWS - 1, MAX_DENSE_GLOBAL_ROWS, MAX_DENSE_GLOBAL_ROWS + 1] {
        let scene = chain(rows as u64);
        let [found, dense, sparse] = ["auto", "dense", "sparse"].map(|matrix| {
            let options = [("pins", "elimination"), ("matrix", matrix)];
            let scene = with(&scene, "fast-mass-spring", &options);
            let mut simulation = Simulation::new(&scene);
            while simulation.advance().unwrap() {}
            (simulation.state().positions.to_vec(), simulation.statistics().linear_solver.clone())
        });
        let kind = if rows <= MAX_DENSE_GLOBAL_ROWS { "dense" } else { "sparse" };
        let words = format!("constant {kind} Cholesky {rows} × {rows}");
        assert!(found.1.starts_with(&words), "{}", found.1);
        for other in [dense, sparse] {
            assert!(largest_difference(&found.0, &other.0) < 1e-12, "{rows}: {}", other.1);
        }
    }
}

#[test]
fn all_group_and_panel_sizes_match_the_assignment() {
    // As many springs as particles that are unknowns, and a dense factor of as many columns.
    assert_eq!(GROUP, WIDEST);
    for links in (1..=2 * GROUP as u64 + 1).chain([3 * GROUP as u64]) {
        let options = [("pins", "penalty"), ("iterations", "5")];
        let mut scene = with(&chain(links), "fast-mass-spring", &options);
        // Off a straight line, springs are stretched.
        for (place, Particle { position, .. }) in scene.particles.iter_mut().enumerate() {
            position[1] += 0.02 * (place as f64).sin();
        }
        let springs = scene.forces.iter_mut().filter(|force| force.pair().is_some());
        springs.for_each(|spring| *spring.parameter_mut("b") = 0.0);
        for matrix in ["dense", "sparse"] {
            assert!(scene.integrator_options.set("matrix", matrix).is_ok());
            let mut assignment = Assignment::new(&scene, 5, 1e10);
            let mut simulation = Simulation::new(&scene);
            while simulation.advance().unwrap() {
                assignment.step();
                let found = simulation.state().positions;
                let difference = largest_difference(found, &assignment.flat());
                assert!(difference < 1e-9, "{links} links, {matrix}: {difference:e}");
            }
        }
    }
}
