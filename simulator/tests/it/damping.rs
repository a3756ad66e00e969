//! Rayleigh's damping of elastic bodies against theory: `D = α M + β K` at rest, ratios of a bar's modes, energy that never
//! grows. That it has no momentum and no torque is a test of all internal forces, in `elastic.rs`.

use std::f64::consts::PI;

use scene::schema::{Dependence, ForceSchema};
use scene::{Dimension, ForceElement, ParseOptions, Particle, Scene, xml};
use simulator::force::{ElementJacobians, JacobianSink, REGISTRY as FORCES};
use simulator::integrator::REGISTRY as INTEGRATORS;
use simulator::simulation::Simulation;
use simulator::system::System;
use simulator::vocabulary;

use crate::elastic::{MATERIALS, sheet};

fn damped() -> impl Iterator<Item = &'static ForceSchema> {
    FORCES.iter().map(|kind| &kind.schema).filter(|schema| schema.has_parameter("beta"))
}

/// Four particles in space with one element of the force, of these parameters and otherwise undeformed.
fn element(schema: &'static ForceSchema, given: &[(&str, f64)], positions: [[f64; 3]; 4]) -> Scene {
    let mut scene = Scene::new("damping", Dimension::Three, &INTEGRATORS[0].schema);
    let particle = |position| Particle {
        mass: 1.0,
        position,
        velocity: [0.0; 3],
        fixed: false,
        radius: 0.1,
        tag: None,
    };
    scene.particles = positions.map(particle).into();
    let particles: Vec<usize> = (0..schema.stencil.size()).collect();
    let mut values = schema.values(given);
    for (value, parameter) in values.iter_mut().zip(schema.parameters) {
        if let Some(of) = parameter.coordinate {
            *value = positions[of.particle][of.axis];
        }
    }
    scene.forces.push(ForceElement::new(schema, &particles, None, values));
    scene
}

/// The entries of `∂F/∂x` and `∂F/∂v` of one element, block by block.
#[derive(Default)]
struct Entries([Vec<f64>; 2]);

impl JacobianSink<3> for Entries {
    fn add(&mut self, element: ElementJacobians<'_, 3>) {
        for (entries, blocks) in self.0.iter_mut().zip([element.by_position, element.by_velocity]) {
            entries.extend(blocks.iter().flat_map(|block| block.iter()));
        }
    }
}

#[test]
fn the_damping_matrix_at_rest_is_beta_times_the_stiffness_matrix() {
    const BETA: f64 = 0.375;
    let mut found = 0;
    for schema in damped() {
        // Hinges are at rest in a plane.
        let height = if schema.is_element() { 1.1 } else { 0.0 };
        let corners = [[0.1, -0.4, 0.0], [1.2, 0.2, 0.0], [0.3, 1.1, 0.0], [0.6, -0.9, height]];
        let scene = element(
            schema,
            &[("youngsmodulus", 5.0), ("poissonratio", 0.3), ("stiffness", 0.7), ("beta", BETA)]
                .into_iter()
                .filter(|(name, _)| schema.has_parameter(name))
                .collect::<Vec<_>>(),
            corners,
        );
        let system = System::<3>::new(&scene);
        let (x, v) = (corners.as_flattened(), [0.0; 12]);
        let mut entries = Entries::default();
        system.jacobians(x, &v, 0.0, &mut entries).unwrap();
        let Entries([stiffness, damping]) = entries;
        let largest = stiffness.iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
        assert!(largest > 0.1, "{}", schema.tag);
        for (stiffness, damping) in stiffness.iter().zip(&damping) {
            assert!((damping - BETA * stiffness).abs() < 1e-12 * largest, "{}", schema.tag);
        }
        found += 1;
    }
    assert_eq!(found, 7);
}

/// `F·v` of the damping alone, at a state.
fn power(schema: &'static ForceSchema, x: &[f64], v: &[f64]) -> f64 {
    let rest = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.1, 0.2, 1.1]];
    let given: Vec<(&str, f64)> = schema
        .parameters
        .iter()
        .filter(|of| of.coordinate.is_none())
        .map(|of| (of.name, of.samples[0]))
        .collect();
    let on = |scene: &Scene| {
        let mut force = vec![0.0; 12];
        System::<3>::new(scene).force(x, v, 0.0, &mut force).unwrap();
        force
    };
    let with = element(schema, &given, rest);
    let mut without = with.clone();
    *without.forces[0].parameter_mut("beta") = 0.0;
    let both = on(&with).into_iter().zip(on(&without));
    both.zip(v).map(|((with, without), v)| (with - without) * v).sum()
}

#[test]
fn damping_takes_energy_at_every_state() {
    let mut random = fastrand::Rng::with_seed(39);
    for schema in damped() {
        assert_eq!(schema.part("damping").depends_on, Dependence::STATE);
        for _ in 0..1000 {
            let mut draw = || -> [f64; 12] { std::array::from_fn(|_| 2.0 * random.f64() - 1.0) };
            let (x, v) = (draw(), draw());
            assert!(power(schema, &x, &v) < 0.0, "{} at {x:?}, {v:?}", schema.tag);
        }
    }
}

fn read(text: &str) -> Scene {
    xml::parse(text, "damping.xml", &vocabulary(), &ParseOptions::default()).unwrap().scene
}

/// The materials that have damping.
fn materials() -> impl Iterator<Item = &'static str> {
    MATERIALS.iter().map(|(tag, _)| *tag).filter(|tag| *tag != "elasticbodycstforce")
}

const CELLS: usize = 12;
const SIZE: [f64; 2] = [2.0, 0.25];
const MODULUS: f64 = 30.0;

/// A bar of triangles that is held at its left, every one with this damping.
fn bar(tag: &str, nu: f64, method: &str, dt: f64, duration: f64, [alpha, beta]: [f64; 2]) -> Scene {
    let elements = sheet(tag, SIZE, [CELLS, 1], MODULUS, nu)
        .replace("youngsmodulus", &format!(r#"beta="{beta:?}" youngsmodulus"#));
    read(&format!(
        r#"<scene><duration time="{duration:?}"/><integrator type="{method}" dt="{dt:?}"/>{elements}<massdamping alpha="{alpha:?}"/></scene>"#
    ))
}

/// A row of cells without Poisson's ratio is a chain of masses: its mode `k` is `sin((2k − 1) π x/2L)`, with
/// `ω = 2 √(c/m) sin((2k − 1) π/4n)` of the stiffness `c` and the mass `m` of a cell. The tip follows the damped oscillator.
#[test]
fn the_modes_of_a_bar_are_damped_by_the_ratio_of_theory() {
    const SPEED: f64 = 1e-7;
    let [alpha, beta] = [0.4, 0.02];
    let stiffness = MODULUS * SIZE[1] / (SIZE[0] / CELLS as f64);
    for tag in materials() {
        for mode in 1..=3 {
            let wave = f64::from(2 * mode - 1) * PI / (2 * CELLS) as f64;
            let omega = 2.0 * (stiffness * CELLS as f64).sqrt() * (0.5 * wave).sin();
            let ratio = 0.5 * (alpha / omega + beta * omega);
            let damped = omega * (1.0 - ratio * ratio).sqrt();
            let period = 2.0 * PI / damped;
            let mut scene =
                bar(tag, 0.0, "runge-kutta-4", period / 400.0, 2.2 * period, [alpha, beta]);
            for (number, particle) in scene.particles.iter_mut().enumerate() {
                let column = number % (CELLS + 1);
                particle.velocity[0] = SPEED * (wave * column as f64).sin();
            }
            let amplitude = SPEED * (wave * CELLS as f64).sin() / damped;
            let mut simulation = Simulation::new(&scene);
            while simulation.advance().unwrap() {
                let state = simulation.state();
                let (time, tip) = (state.time, state.positions[2 * CELLS] - SIZE[0]);
                let expected = amplitude * (-ratio * omega * time).exp() * (damped * time).sin();
                assert!((tip - expected).abs() < 1e-5 * amplitude.abs(), "{tag} {mode} at {time}");
            }
        }
    }
}

#[test]
fn energy_never_grows_under_damping_by_implicit_euler() {
    for tag in materials() {
        let mut scene = bar(tag, 0.3, "implicit-euler", 0.01, 2.0, [0.3, 0.05]);
        for particle in scene.particles.iter_mut().filter(|particle| !particle.fixed) {
            let [x, y, _] = particle.position;
            particle.velocity = [-0.2 * x + 0.5 * y, 0.8 * x, 0.0];
        }
        let system = System::<2>::new(&scene);
        let masses: Vec<f64> = scene.particles.iter().map(|particle| particle.mass).collect();
        let energy = |simulation: &Simulation| {
            let state = simulation.state();
            let squared = state.velocities.chunks_exact(2).map(|v| v[0] * v[0] + v[1] * v[1]);
            let kinetic: f64 = masses.iter().zip(squared).map(|(m, v)| 0.5 * m * v).sum();
            kinetic + system.potential_energy(state.positions, state.velocities, state.time)
        };
        let mut simulation = Simulation::new(&scene);
        let start = energy(&simulation);
        let mut before = start;
        while simulation.advance().unwrap() {
            let now = energy(&simulation);
            assert!(now <= before, "{tag}: {before} to {now}");
            before = now;
        }
        assert!(before < 0.9 * start, "{tag}: {start} to {before}");
    }
}
