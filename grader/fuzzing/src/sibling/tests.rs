//! Tests siblings of every shipped scene, and each fault.

use std::collections::BTreeMap;
use std::path::Path;

use grader::suite::{Section, Suite};
use scene::ParseOptions;

use super::*;

fn shipped() -> Vec<Case> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let sections = [
        (Section::Required, root.join("assets")),
        (Section::ExtraCredit, root.join("extracreditassets")),
    ];
    Suite::load(&sections, &ParseOptions::default()).unwrap().cases
}

fn case(name: &str) -> Case {
    shipped().into_iter().find(|case| case.id == name).unwrap()
}

fn drawn(case: &Case, seed: u64) -> Drawn {
    draw(case, 1.0, &mut Choices::random(seed))
        .unwrap_or_else(|fault| panic!("{}: {fault}", case.id))
}

/// The structure that a sibling shares with its original, independent of the order of its elements: each particle with the number
/// of forces on it, each force with its zeros and defaults, equal values, options.
fn structure(scene: &Scene) -> impl PartialEq + std::fmt::Debug {
    let touches = |particle: usize| {
        let forces = scene.forces.iter();
        forces.filter(|force| force.particles.contains(&particle)).count()
    };
    let particles =
        scene.particles.iter().enumerate().map(|(number, particle)| {
            (particle.fixed, particle.velocity == [0.0; 3], touches(number))
        });
    let mut particles: Vec<_> = particles.collect();
    particles.sort_unstable();
    let mut forces: Vec<_> = scene
        .forces
        .iter()
        .map(|force| (force.schema.tag, force.depends_on().position, force.is_variational()))
        .collect();
    forces.sort_unstable();
    let mut equal: BTreeMap<(&str, &str, u64), usize> = BTreeMap::new();
    for force in scene.forces.iter().filter(|force| !force.particles.is_empty()) {
        let values = force.schema.parameters.iter().zip(&force.parameters);
        for (parameter, value) in values.filter(|(parameter, _)| parameter.coordinate.is_none()) {
            *equal.entry((force.schema.tag, parameter.name, value.to_bits())).or_default() += 1;
        }
    }
    let mut equal: Vec<_> =
        equal.into_iter().map(|((tag, name, _), count)| (tag, name, count)).collect();
    equal.sort_unstable();
    let steps = scene.duration / scene.time_step;
    let whole = (steps - steps.round()).abs() < 1e-9 * steps;
    let options = format!("{:?}", scene.integrator_options);
    (particles, forces, equal, whole, options, scene.edges.len(), scene.dimension, scene.integrator)
}

/// All numbers of a scene that have a meaning.
fn numbers(scene: &Scene) -> Vec<f64> {
    let particles = scene.particles.iter();
    let states = particles.flat_map(|particle| {
        [[particle.mass, 0.0, 0.0], particle.position, particle.velocity].concat()
    });
    let forces = scene.forces.iter().flat_map(|force| {
        let values = force.schema.parameters.iter().zip(&force.parameters);
        values
            .map(|(parameter, value)| if parameter.default == Some(*value) { 0.0 } else { *value })
    });
    states.chain(forces).chain([scene.time_step]).filter(|value| *value != 0.0).collect()
}

#[test]
fn a_sibling_has_the_structure_of_its_original_and_other_numbers() {
    for case in shipped() {
        let Drawn { files, scene } = drawn(&case, 7);
        let is_json = files.0.len() == 2;
        assert_eq!(is_json, case.format() == "json");
        // The rest lengths of a mesh follow from its vertices, and its masses may: equal ones were equal by chance.
        if !is_json {
            assert_eq!(structure(&scene), structure(&case.scene), "{}", case.id);
        }
        let (mut own, old) = (numbers(&scene), numbers(&case.scene));
        // Equal values stay equal: they agree by chance together.
        own.sort_by(f64::total_cmp);
        own.dedup();
        let known = |value: &&f64| old.iter().any(|old| (*value - old).abs() < 1e-9 * old.abs());
        let kept: Vec<&f64> = own.iter().filter(known).collect();
        // JSON has no place for time steps and forces. Some numbers agree by chance, with one of another meaning.
        let allowed = own.len() / 20 + if is_json { 10 } else { 1 };
        assert!(kept.len() <= allowed, "{}: {kept:?} of {}", case.id, own.len());
    }
}

#[test]
fn a_sibling_follows_from_the_seed_and_names_neither_it_nor_the_original() {
    for case in shipped() {
        let files = drawn(&case, 7).files;
        assert_eq!(files, drawn(&case, 7).files, "{}", case.id);
        assert_ne!(files, drawn(&case, 8).files, "{}", case.id);
        for (_, text) in &files.0 {
            assert!(!text.contains(&case.id), "{}", case.id);
            let description = case.scene.description.as_deref();
            assert!(
                description.is_none_or(|description| !text.contains(description)),
                "{}",
                case.id
            );
        }
    }
}

#[test]
fn a_sibling_keeps_layout_spelling_and_purpose() {
    let text = |name| drawn(&case(name), 7).files.0[0].1.clone();
    let edges_first = text("Spring/two-springs-on-one-edge-explicit");
    assert!(edges_first.find("<edge ") < edges_first.find("<particle "), "{edges_first}");
    let purpose = "Catches a program that stores one spring an edge, and a missing rest length.";
    let words: Vec<&str> = edges_first.split_whitespace().collect();
    assert!(words.join(" ").contains(purpose), "{edges_first}");
    assert!(text("Spellings/implicit").contains("type=\"implicit\""));
}

/// The fault of a scene that was changed by hand, as a sibling of the shearing pair.
fn fault(edit: fn(&mut Scene)) -> Option<Fault> {
    let original = case("Spring/shearing-pair-symplectic").scene;
    let reference = Reference::of(&original).unwrap();
    let mut scene = original;
    edit(&mut scene);
    reference.of_sibling(&scene).err()
}

#[test]
fn ill_posed_siblings_are_rejected() {
    assert_eq!(fault(|scene| scene.particles[0].mass = 0.7), None);
    let special = |text: &str| Some(Fault::Special(text.to_owned()));
    assert_eq!(fault(|scene| scene.particles[0].mass = 1.0), special("a mass is 1"));
    assert_eq!(fault(|scene| *scene.forces[0].parameter_mut("l0") = 1.0), special("l0 is 1"));
    let along = |scene: &mut Scene| scene.particles[0].position[1] = scene.particles[1].position[1];
    assert_eq!(fault(along), special("a <springforce> lies along an axis"));
    // h √(k/m) = 2.3, beyond the limit of 2.
    let stiff = |scene: &mut Scene| *scene.forces[0].parameter_mut("k") = 23_000.0;
    assert_eq!(fault(stiff), Some(Fault::BlowsUp));
}

#[test]
fn siblings_with_collisions_or_chaos_are_rejected() {
    let original = case("Gravitational/three-bodies-symplectic").scene;
    let mut near = original.clone();
    near.particles[1].position = near.particles[0].position.map(|value| value + 0.01);
    let reference = Reference::of(&original).unwrap();
    assert_eq!(reference.of_sibling(&near).err(), Some(Fault::Close));

    let mut chaotic = case("LongRuns/double-pendulum-symplectic").scene;
    chaotic.particles.iter_mut().for_each(|particle| particle.mass *= 1.1);
    chaotic.forces[..2].iter_mut().for_each(|force| *force.parameter_mut("l0") *= 1.1);
    let mut short = chaotic.clone();
    short.duration = 200.0 * short.time_step;
    assert_eq!(Reference::of(&short).unwrap().of_sibling(&chaotic).err(), Some(Fault::Chaotic));
}
