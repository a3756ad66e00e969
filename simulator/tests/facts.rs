//! The registries state facts: each force does in space what its facts say, and each force and integrator has a scene.

use std::path::Path;

use scene::schema::{
    Conserves, Dependence, ForceSchema, Initial, Masses, PartSchema, Potential, Stencil,
};
use scene::{Dimension, ForceElement, ParseOptions, Particle, Scene, find_scene_files, json, load};
use simulator::force::{
    ElementJacobians, Force, JacobianSink, Numbered, REGISTRY as FORCES, State,
};
use simulator::integrator::REGISTRY as INTEGRATORS;
use simulator::vocabulary;

/// Number of particles: as many as the largest stencil has.
const N: usize = 4;
const MASSES: [f64; N] = [1.5, 0.75, 2.0, 1.25];
const POSITIONS: [f64; 3 * N] =
    [0.25, -0.5, 0.375, 1.75, 0.625, -0.25, 2.5, -0.875, 0.5, 0.875, 1.5, 1.125];
const VELOCITIES: [f64; 3 * N] =
    [0.5, 1.25, -0.875, -0.75, 0.375, 0.625, 0.25, -1.5, -0.375, 1.0, 0.625, 0.75];

/// The particles with one element of the force, which has this part and those that it needs.
fn scene(schema: &'static ForceSchema, part: usize) -> Scene {
    let mut scene = Scene::new("facts", Dimension::Three, &INTEGRATORS[0].schema);
    scene.particles = (0..N)
        .map(|number| Particle {
            mass: MASSES[number],
            position: POSITIONS.as_chunks().0[number],
            velocity: VELOCITIES.as_chunks().0[number],
            fixed: false,
            radius: 0.1,
            tag: None,
        })
        .collect();
    let given: Vec<(&str, f64)> =
        schema.parameters.iter().map(|each| (each.name, each.samples[0])).collect();
    let size = if schema.stencil.is_field() { 0 } else { schema.stencil.size() };
    let particles: Vec<usize> = (0..size).collect();
    let mut element = ForceElement::new(schema, &particles, None, schema.values(&given));
    for (number, other) in schema.parts.iter().enumerate() {
        if number > part || (number < part && schema.parts[part].stands_alone) {
            element.remove_part(other);
        }
    }
    scene.forces.push(element);
    scene
}

fn state<'a>(positions: &'a [f64], velocities: &'a [f64]) -> State<'a> {
    State { masses: &MASSES, positions, velocities, time: 0.0 }
}

fn force_at(force: &dyn Force<3>, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
    let mut sum = vec![0.0; x.len()];
    force.add_force(State { time, ..state(x, v) }, 0..N, &mut sum).unwrap();
    sum
}

fn moved(values: &[f64], place: usize, by: f64) -> Vec<f64> {
    let mut moved = values.to_vec();
    moved[place] += by;
    moved
}

/// Measured dependence of the force of a scene.
fn seen(force: &dyn Force<3>) -> Dependence {
    let here = force_at(force, &POSITIONS, &VELOCITIES, 0.0);
    let changes = |x: &[f64], v: &[f64], time| force_at(force, x, v, time) != here;
    Dependence {
        position: (0..3 * N).any(|i| changes(&moved(&POSITIONS, i, 0.125), &VELOCITIES, 0.0)),
        velocity: (0..3 * N).any(|i| changes(&POSITIONS, &moved(&VELOCITIES, i, 0.125), 0.0)),
        time: changes(&POSITIONS, &VELOCITIES, 0.5),
    }
}

/// Whether the force is less the derivative of what `of` says of the state.
fn derives(force: &dyn Force<3>, of: impl Fn(&[f64], &[f64]) -> f64, by_velocity: bool) -> bool {
    let h = 2.0_f64.powi(-12);
    let (x, v) = (&POSITIONS, &VELOCITIES);
    let here = force_at(force, x, v, 0.0);
    let along = |place: usize, by: f64| {
        if by_velocity { of(x, &moved(v, place, by)) } else { of(&moved(x, place, by), v) }
    };
    let slope = |place: usize| (along(place, h) - along(place, -h)) / (2.0 * h);
    here.iter().enumerate().all(|(place, force)| (force + slope(place)).abs() < 1e-5)
}

#[test]
fn force_parts_depend_on_and_derive_from_declared_facts() {
    for kind in FORCES {
        let schema = &kind.schema;
        let mut before = Dependence::NOTHING;
        for (number, part) in schema.parts.iter().enumerate() {
            let PartSchema { name, depends_on, derives_from, stands_alone, .. } = part;
            let about = format!("{} {name}", schema.tag);
            let scene = scene(schema, number);
            let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
            let force = (kind.build_3d)(&scene, &elements);
            let force = force.as_ref();
            // A part that needs those before it is seen together with them.
            let stated = if *stands_alone { *depends_on } else { before.or(*depends_on) };
            assert_eq!(seen(force), stated, "{about}");
            before = stated;

            let energy = |x: &[f64], v: &[f64]| force.energy(state(x, v)).unwrap_or(f64::NAN);
            let dissipation = |x: &[f64], v: &[f64]| force.dissipation(state(x, v));
            let found = if derives(force, energy, false) {
                Potential::Energy
            } else if derives(force, dissipation, true) {
                Potential::Dissipation
            } else {
                Potential::Neither
            };
            assert_eq!(found, *derives_from, "{about}");
            assert!(part.scaled_by.iter().all(|name| schema.has_parameter(name)), "{about}");
            assert!(part.shaped_by.iter().all(|name| schema.has_parameter(name)), "{about}");
        }
        for parameter in schema.parameters {
            let is_named = schema.parts.iter().any(|part| part.names(parameter.name));
            assert!(is_named, "{}: no part names {}", schema.tag, parameter.name);
            let is_other = !schema.stencil.attributes().contains(&parameter.name);
            assert!(
                is_other,
                "{}: {} names a particle and a parameter",
                schema.tag, parameter.name
            );
        }
    }
}

/// The force of a scene's elements on these masses.
fn on_masses(scene: &Scene, masses: [f64; N]) -> [f64; 3 * N] {
    let mut scene = scene.clone();
    for (particle, mass) in scene.particles.iter_mut().zip(masses) {
        particle.mass = mass;
    }
    let schema = scene.forces[0].schema;
    let kind = FORCES.iter().find(|kind| kind.schema == *schema).unwrap();
    let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
    let mut sum = [0.0; 3 * N];
    let state = State { masses: &masses, ..state(&POSITIONS, &VELOCITIES) };
    (kind.build_3d)(&scene, &elements).add_force(state, 0..N, &mut sum).unwrap();
    sum
}

#[test]
fn mass_dependence_matches_the_schema() {
    for kind in FORCES {
        let scene = scene(&kind.schema, kind.schema.parts.len() - 1);
        let here = on_masses(&scene, MASSES);
        let mut masses = MASSES;
        masses[0] *= 2.0;
        let heavier = on_masses(&scene, masses);
        let grows = |factors: [f64; N]| {
            let expected = |place: usize| factors[place / 3] * here[place];
            (0..3 * N).all(|place| (heavier[place] - expected(place)).abs() < 1e-12)
        };
        let found = if grows([1.0; N]) {
            Some(Masses::None)
        } else if grows([2.0, 1.0, 1.0, 1.0]) {
            Some(Masses::Own)
        } else if grows([2.0, 2.0, 1.0, 1.0]) {
            Some(Masses::Product)
        } else {
            None
        };
        assert_eq!(found, Some(kind.schema.masses), "{}", kind.schema.tag);
    }
}

#[test]
fn dependence_on_initial_positions_matches_the_schema() {
    for kind in FORCES {
        let mut scene = scene(&kind.schema, kind.schema.parts.len() - 1);
        let here = on_masses(&scene, MASSES);
        let sizes = |scene: &Scene| {
            let element = &scene.forces[0];
            let is_hinge = element.particles.len() == 4;
            let weight = if is_hinge { element.hinge_weight(&scene.particles) } else { 1.0 };
            [1.0 / element.path_length(&scene.particles), weight]
        };
        let before = sizes(&scene);
        for particle in &mut scene.particles {
            particle.position[0] *= 2.0;
        }
        let (elsewhere, after) = (on_masses(&scene, MASSES), sizes(&scene));
        let grows = |by: f64| {
            let mut both = elsewhere.iter().zip(here);
            both.all(|(elsewhere, here)| (elsewhere - by * here).abs() <= 1e-12 * here.abs())
        };
        let found = if grows(1.0) {
            Initial::None
        } else if grows(after[0] / before[0]) {
            Initial::PathLength
        } else if grows(after[1] / before[1]) {
            Initial::Hinge
        } else {
            Initial::BoxDiagonal
        };
        assert_eq!(found, kind.schema.initial, "{}", kind.schema.tag);
    }
}

#[test]
fn a_force_without_its_parts_is_zero() {
    for kind in FORCES {
        let mut scene = scene(&kind.schema, kind.schema.parts.len() - 1);
        assert_ne!(on_masses(&scene, MASSES), [0.0; 3 * N], "{}", kind.schema.tag);
        for part in kind.schema.parts {
            scene.forces[0].remove_part(part);
        }
        let left = on_masses(&scene, MASSES);
        assert!(left.iter().all(|component| *component == 0.0), "{}: {left:?}", kind.schema.tag);
    }
}

#[test]
fn forces_conserve_their_declared_momenta() {
    for kind in FORCES {
        let schema = &kind.schema;
        let scene = scene(schema, schema.parts.len() - 1);
        let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
        let force = (kind.build_3d)(&scene, &elements);
        let on = force_at(force.as_ref(), &POSITIONS, &VELOCITIES, 0.0);
        let (x, f) = (POSITIONS.as_chunks::<3>().0, on.as_chunks::<3>().0);
        let torque = [0, 1, 2].map(|axis| {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            x.iter().zip(f).map(|(x, f)| x[next] * f[last] - x[last] * f[next]).sum::<f64>()
        });
        let sum = [0, 1, 2].map(|axis| f.iter().map(|f| f[axis]).sum::<f64>());
        let found = if sum.iter().any(|sum| sum.abs() > 1e-12) {
            Conserves::Nothing
        } else if torque.iter().any(|torque| torque.abs() > 1e-12) {
            Conserves::Momentum
        } else {
            Conserves::AngularMomentum
        };
        assert_eq!(found, schema.conserves, "{}", schema.tag);
    }
}

/// The local step projects on springs whose force is proportional to their extension, with a constant rest length.
#[test]
fn fast_mass_spring_refuses_the_forces_on_edges_that_are_not_hookean() {
    let mut methods = INTEGRATORS.iter().map(|kind| &kind.schema);
    let method = methods.find(|schema| schema.name == "fast-mass-spring").unwrap();
    let mut found = Vec::new();
    for kind in FORCES {
        let scene = scene(&kind.schema, 0);
        let is_refused = (method.refuses)(&scene.forces[0]).is_some();
        if kind.schema.stencil != Stencil::Edge {
            assert!(!is_refused, "{}", kind.schema.tag);
            continue;
        }
        let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
        let force = (kind.build_3d)(&scene, &elements);
        let pull = |length: f64, time: f64| {
            let mut positions = POSITIONS;
            positions[..6].copy_from_slice(&[0.0, 0.0, 0.0, length, 0.0, 0.0]);
            force_at(force.as_ref(), &positions, &[0.0; 3 * N], time)[0]
        };
        let [one, two, three] = [1.0, 2.0, 3.0].map(|length| pull(length, 0.0));
        let is_hookean = (one - 2.0 * two + three).abs() < 1e-9 && pull(2.0, 0.5) == two;
        assert_eq!(is_refused, !is_hookean, "{}", kind.schema.tag);
        found.push(is_hookean);
    }
    assert!(found.contains(&true) && found.contains(&false), "{found:?}");
}

#[test]
fn every_force_and_every_integrator_has_a_scene() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    let files = ["assets", "extracreditassets"].map(|name| find_scene_files(&root.join(name)));
    let scenes: Vec<Scene> = files
        .into_iter()
        .flat_map(Result::unwrap)
        .map(|file| {
            let options = if json::is_json(&file) { &ParseOptions::default() } else { &options };
            let parsed = load(&file, &vocabulary(), options);
            parsed.unwrap_or_else(|error| panic!("{error}")).scene
        })
        .collect();
    for kind in FORCES {
        let tag = kind.schema.tag;
        let is_there = |scene: &Scene| scene.forces.iter().any(|force| force.schema.tag == tag);
        assert!(
            scenes.iter().any(is_there),
            "no scene has <{tag}>: add one to extracreditassets/, and run `grade oracle regenerate`"
        );
    }
    for kind in INTEGRATORS {
        let name = kind.schema.name;
        assert!(
            scenes.iter().any(|scene| scene.integrator.name == name),
            "no scene has {name}: add one to extracreditassets/, and run `grade oracle regenerate`"
        );
    }
    assert!(scenes.iter().any(|scene| scene.dimension == Dimension::Three));
}

/// The bits of all Jacobians that a force hands over, in their order.
fn jacobian_bits(force: &dyn Force<3>, state: State<'_>) -> Vec<u64> {
    struct Bits(Vec<u64>);
    impl JacobianSink<3> for Bits {
        fn add(&mut self, element: ElementJacobians<'_, 3>) {
            let blocks = element.by_position.iter().chain(element.by_velocity);
            self.0.extend(blocks.flat_map(|block| block.iter()).map(|entry| entry.to_bits()));
        }
    }
    let mut bits = Bits(Vec::new());
    force.add_jacobians(state, &mut bits).unwrap();
    bits.0
}

#[test]
fn constant_jacobians_match_their_declaration() {
    let mut found = Vec::new();
    for kind in FORCES {
        let mut scenes = vec![scene(&kind.schema, kind.schema.parts.len() - 1)];
        if kind.schema.tag == "springforce" {
            let mut linear = scene(&kind.schema, 0);
            *linear.forces[0].parameter_mut("l0") = 0.0;
            scenes.push(linear);
        }
        for scene in scenes {
            let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
            let force = (kind.build_3d)(&scene, &elements);
            let here = jacobian_bits(force.as_ref(), state(&POSITIONS, &VELOCITIES));
            let (x, v) = (moved(&POSITIONS, 2, 0.375), moved(&VELOCITIES, 1, -0.625));
            let there = jacobian_bits(force.as_ref(), State { time: 0.5, ..state(&x, &v) });
            assert_eq!(here == there, force.has_constant_jacobians(), "{}", kind.schema.tag);
            found.push((force.has_constant_jacobians(), !here.is_empty()));
        }
    }
    // Some are constant and not zero, and some are not constant.
    assert!(found.contains(&(true, true)) && found.contains(&(false, true)), "{found:?}");
}
