//! Large scenes of one component and of several: no panic, and the same bits for any number of threads.

#[path = "../../sparse/src/forest.rs"]
mod forest;

use needs::needs;
use scene::{self, Dimension, ForceElement, ParseOptions, Particle, Scene};
use simulator::generate::{
    Beam, Block, Bodies, Chain, Cloth, Disc, Generator, Net, REGISTRY, Ring, Rope, Sheet, Timeline,
};
use simulator::sizes::PARALLEL;
use simulator::vocabulary;

use self::forest::Forest;
use crate::sizes::with;
use crate::support::shared::assignment_scenes;
use crate::threads::run;

/// The methods that solve linear systems, and one that does not.
const METHODS: [(&str, &[(&str, &str)]); 5] = [
    ("symplectic-euler", &[]),
    ("linearized-implicit-euler", &[]),
    ("projected-newton", &[]),
    ("fast-mass-spring", &[("pins", "penalty"), ("iterations", "5")]),
    ("fast-mass-spring", &[("pins", "elimination"), ("iterations", "5")]),
];

/// Runs a scene by so many threads, and asserts that it has the same states as by one.
fn check(scene: &Scene, threads: &[usize], what: &str) {
    let expected = run(scene, 1);
    assert!(expected.1.is_none() && !expected.0.is_empty(), "{what}: {:?}", expected.1);
    for &n_threads in threads {
        assert!(run(scene, n_threads) == expected, "{what}: {n_threads} threads");
    }
}

/// The particles of a forest somewhere, joined by springs near their rest lengths, under gravity.
fn scene(forest: &Forest, seed: u64) -> Scene {
    let mut random = fastrand::Rng::with_seed(seed);
    let vocabulary = vocabulary();
    let dimension = if seed.is_multiple_of(2) { Dimension::Two } else { Dimension::Three };
    let mut scene =
        Scene::new(&forest.name, dimension, vocabulary.integrator("symplectic-euler").unwrap());
    (scene.time_step, scene.duration) = (1e-3, 2e-3);
    for fixed in &forest.pinned {
        let mut position = [(); 3].map(|()| 10.0 * random.f64());
        position[dimension.count()..].fill(0.0);
        let mass = 0.5 + random.f64();
        let (velocity, radius) = ([0.0; 3], 0.1);
        let particle = Particle { mass, position, velocity, fixed: *fixed, radius, tag: None };
        scene.particles.push(particle);
    }
    let spring = vocabulary.force("springforce").unwrap();
    // Damped springs make a matrix without symmetry.
    let damping = if random.bool() { 1.0 } else { 0.0 };
    for pair in &forest.pairs {
        let [a, b] = pair.map(|particle| scene.particles[particle].position);
        let length = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let rest_length = length * (0.95 + 0.1 * random.f64());
        let parameters = spring.values(&[("k", 100.0), ("l0", rest_length), ("b", damping)]);
        scene.forces.push(ForceElement::new(spring, pair, None, parameters));
    }
    let gravity = vocabulary.force("simplegravity").unwrap();
    let parameters = gravity.values(&[("fy", -9.81)]);
    scene.forces.push(ForceElement::new(gravity, &[], None, parameters));
    scene
}

fn check_forest(forest: &Forest, seed: u64) {
    let mut scene = scene(forest, seed);
    for (integrator, options) in METHODS {
        if integrator == "projected-newton" {
            // It knows no damping.
            let springs = scene.forces.iter_mut().filter(|force| force.pair().is_some());
            springs.for_each(|spring| *spring.parameter_mut("b") = 0.0);
        }
        let what = format!("{}, {integrator} {options:?}", forest.name);
        check(&with(&scene, integrator, options), &[2, 3, 5], &what);
    }
}

#[test]
fn forests_have_the_same_states_by_any_number_of_threads() {
    check_forest(&Forest::nets(2, 40), 1);
    check_forest(&Forest::nets(3, 50), 2);
    for seed in 0..6 {
        check_forest(&Forest::new(seed, 5_000), seed);
    }
}

#[test]
#[ignore = "long: minutes"]
fn long_many_forests_have_the_same_states_by_any_number_of_threads() {
    for seed in 100..300 {
        check_forest(&Forest::new(seed, 1_500 << (seed % 4)), seed);
    }
}

/// Every kind of generated scene, with at least as many force elements as threads begin at; a net whose middle row is
/// fixed falls into two without it.
fn generated() -> Vec<(String, Scene)> {
    let timeline = |integrator: &str| Timeline {
        integrator: vocabulary().integrator(integrator).unwrap(),
        options: Vec::new(),
        time_step: Some(1e-3),
        duration: 0.0,
        steps: Some(2),
    };
    let usual = timeline("symplectic-euler");
    let named = |name: &str| -> Vec<Box<dyn Generator>> {
        let timeline = usual.clone();
        match name {
            "net" => vec![
                Box::new(Net { segments: 64, timeline: timeline.clone(), ..Net::default() }),
                Box::new(Net { segments: 50, pinned: true, timeline, ..Net::default() }),
            ],
            "chain" => vec![Box::new(Chain { links: 8_000, timeline, ..Chain::default() })],
            "cloth" => vec![Box::new(Cloth { nx: 50, ny: 40, timeline, ..Cloth::default() })],
            "ring" => vec![
                Box::new(Ring { particles: 8_000, timeline: timeline.clone(), ..Ring::default() }),
                Box::new(Ring { particles: 4_500, spokes: true, timeline, ..Ring::default() }),
            ],
            "beam" => vec![Box::new(Beam { nx: 20, ny: 8, nz: 8, timeline, ..Beam::default() })],
            "sheet" => {
                let sheet = Sheet { nx: 100, ny: 45, width: 10.0, height: 4.5, ..Sheet::default() };
                vec![Box::new(Sheet { timeline, ..sheet })]
            }
            "block" => {
                vec![Box::new(Block { nx: 24, ny: 8, nz: 7, timeline, ..Block::default() })]
            }
            "disc" => vec![Box::new(Disc { rings: 38, timeline, ..Disc::default() })],
            "rope" => {
                let rope = Rope { bars: 4_200, length: 210.0, ..Rope::default() };
                vec![Box::new(Rope { timeline, ..rope })]
            }
            "bodies" => vec![Box::new(Bodies { bodies: 130, timeline, ..Bodies::default() })],
            _ => panic!("no large scene of `{name}`: add one here"),
        }
    };
    let mut scenes = Vec::new();
    for kind in REGISTRY {
        for generator in named(kind.name) {
            scenes.push((kind.name.to_owned(), generator.scene().unwrap()));
        }
    }
    let net =
        Net { segments: 99, timeline: timeline("linearized-implicit-euler"), ..Net::default() };
    let mut divided = net.scene().unwrap();
    divided.particles[50 * 100..51 * 100].iter_mut().for_each(|particle| particle.fixed = true);
    scenes.push(("net with its middle row fixed".to_owned(), divided));
    scenes
}

#[test]
fn every_generated_kind_has_the_same_states_by_any_number_of_threads() {
    for (name, scene) in generated() {
        assert!(scene.forces.len() >= PARALLEL, "{name}: {} elements", scene.forces.len());
        for (integrator, options) in METHODS {
            // Gravitation has no springs, and no least energy.
            if name == "bodies" && ["projected-newton", "fast-mass-spring"].contains(&integrator) {
                continue;
            }
            let what = format!("{name}, {integrator} {options:?}");
            check(&with(&scene, integrator, options), &[2, 3], &what);
        }
    }
}

#[needs("test -d ${SPRING_ORACLE_JACOBSON:-../shared/jacobson}")]
#[test]
fn the_scenes_of_the_assignment_have_the_same_states_by_any_number_of_threads() {
    for path in assignment_scenes() {
        let scene = scene::load(&path, &vocabulary(), &ParseOptions::default()).unwrap().scene;
        let scene = Scene { duration: 3.0 * scene.time_step, ..scene };
        for pins in ["penalty", "elimination"] {
            let what = format!("{}, {pins}", path.display());
            check(&with(&scene, "fast-mass-spring", &[("pins", pins)]), &[2, 3], &what);
        }
        check(&scene, &[2, 3, 5], &path.display().to_string());
    }
}
