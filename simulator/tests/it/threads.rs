//! A large scene has the same states, bit for bit, and the same error for any number of threads.

use scene::schema::IntegratorOptions;
use scene::{ForceElement, ParseOptions, Scene, xml};
use simulator::force;
use simulator::generate::{Generator, Net, Timeline};
use simulator::integrator::REGISTRY;
use simulator::simulation::Simulation;
use simulator::sizes::PARALLEL;
use simulator::vocabulary;

/// A pinned net large enough for several threads, with an element of every kind of force of the plane, and with particles that are
/// fixed on both sides of the borders between threads.
fn scene() -> Scene {
    let timeline = Timeline {
        integrator: vocabulary().integrator("symplectic-euler").unwrap(),
        options: Vec::new(),
        time_step: Some(1e-5),
        duration: 0.0,
        steps: Some(3),
    };
    let net = Net { segments: 80, pinned: true, timeline, ..Net::default() };
    let mut scene = net.scene().unwrap();
    for kind in force::REGISTRY.iter().filter(|kind| kind.schema.exists_in(scene.dimension)) {
        let example = kind.schema.example;
        let text = format!(
            r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="1"/>
            <particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="1" py="0" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="1" py="1" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="0" py="1" vx="0" vy="0" fixed="0"/>
            <edge i="0" j="1"/>{example}</scene>"#
        );
        let parsed = xml::parse(&text, "example", &vocabulary(), &ParseOptions::default());
        scene.forces.extend(parsed.unwrap().scene.forces);
    }
    assert!(scene.forces.len() > PARALLEL);
    let n_particles = scene.particles.len();
    for part in [2, 3, 5] {
        let border = n_particles / part;
        for particle in &mut scene.particles[border - 4..border + 3] {
            particle.fixed = true;
        }
    }
    scene
}

/// The states of all steps, and the error that ends them.
pub(crate) fn run(scene: &Scene, n_threads: usize) -> (Vec<u64>, Option<String>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
    pool.install(|| {
        let mut simulation = Simulation::new(scene);
        let mut bits = Vec::new();
        loop {
            match simulation.advance() {
                Ok(true) => {
                    let state = simulation.state();
                    let numbers = state.positions.iter().chain(state.velocities);
                    bits.extend(numbers.map(|number| number.to_bits()));
                }
                Ok(false) => return (bits, None),
                Err(error) => return (bits, Some(error.to_string())),
            }
        }
    })
}

#[test]
fn states_do_not_depend_on_the_number_of_threads() {
    let scene = scene();
    for name in
        ["explicit-euler", "symplectic-euler", "velocity-verlet", "linearized-implicit-euler"]
    {
        let schema = &REGISTRY.iter().find(|kind| kind.schema.name == name).unwrap().schema;
        let integrator_options = IntegratorOptions::defaults(schema);
        let scene = Scene { integrator: schema, integrator_options, ..scene.clone() };
        let (expected, error) = run(&scene, 1);
        assert!(error.is_none() && !expected.is_empty(), "{name}: {error:?}");
        for n_threads in [2, 3, 5] {
            let (states, error) = run(&scene, n_threads);
            assert!(states == expected && error.is_none(), "{name}: {n_threads} threads");
        }
    }
}

#[test]
fn the_error_does_not_depend_on_the_number_of_threads() {
    let mut scene = scene();
    let of = |tag| scene.forces.iter().rfind(|force| force.schema.tag == tag).unwrap().clone();
    // Among the last particles, a spring has no direction; among the first, a force of a later kind has none.
    let spring = scene.forces.iter().filter_map(ForceElement::pair).max().unwrap();
    let gravitational = ForceElement { particles: [10, 500].into(), ..of("gravitationalforce") };
    for [at, moved] in [spring, [10, 500]] {
        scene.particles[moved].position = scene.particles[at].position;
    }
    scene.forces.push(gravitational);
    let (_, expected) = run(&scene, 1);
    assert!(expected.as_ref().unwrap().contains("springforce"), "{expected:?}");
    for n_threads in [2, 3, 5] {
        assert_eq!(run(&scene, n_threads).1, expected, "{n_threads} threads");
    }
}
