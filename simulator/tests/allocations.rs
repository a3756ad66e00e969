//! A step allocates nothing once the first steps have made their room.

use simulator::generate::{
    Beam, Bodies, Chain, Cloth, Generator, Net, Ring, SpringLaw, Springs, Timeline,
};
use simulator::integrator::REGISTRY;
use simulator::scene::Scene;
use simulator::scene::schema::IntegratorOptions;
use simulator::simulation::Simulation;
use simulator::vocabulary;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

/// Enough that every room is made, the one for indefinite and for stiff systems included.
const FIRST_STEPS: u64 = 12;

const STEPS: u64 = 8;

/// Scenes of every kind and size of system: separate and joined parts, symmetric or not, two and three
/// dimensions, more elements than one thread is given.
fn scenes() -> Vec<(&'static str, Scene)> {
    let timeline = || Timeline {
        integrator: vocabulary().integrator("implicit-euler").unwrap(),
        options: Vec::new(),
        time_step: Some(1e-3),
        length: simulator::generate::Length::Steps(FIRST_STEPS + STEPS),
    };
    let springs = |damping| Springs { stiffness: 100.0, damping, law: SpringLaw::Hooke };
    let chain = |links, damping| {
        Chain { links, springs: springs(damping), timeline: timeline(), ..Chain::default() }.scene()
    };
    let net = |segments, law| {
        let springs = Springs { law, ..springs(0.0) };
        Net { segments, springs, timeline: timeline(), ..Net::default() }.scene()
    };
    let scenes = [
        ("pair", chain(1, 0.5)),
        ("short chain", chain(3, 0.0)),
        ("chain of damped springs", chain(10, 0.5)),
        ("chain of undamped springs", chain(10, 0.0)),
        ("long chain of undamped springs", chain(100, 0.0)),
        ("long chain of damped springs", chain(100, 0.5)),
        ("net", net(8, SpringLaw::Hooke)),
        ("net of green springs", net(8, SpringLaw::Green)),
        ("large net", net(80, SpringLaw::Hooke)),
        ("ring", Ring { springs: springs(0.0), timeline: timeline(), ..Ring::default() }.scene()),
        (
            "cloth",
            Cloth { springs: springs(0.0), timeline: timeline(), ..Cloth::default() }.scene(),
        ),
        ("beam", Beam { springs: springs(0.0), timeline: timeline(), ..Beam::default() }.scene()),
        ("bodies", Bodies { timeline: timeline(), ..Bodies::default() }.scene()),
    ];
    scenes.into_iter().map(|(name, scene)| (name, scene.unwrap())).collect()
}

#[test]
fn steps_allocate_nothing() {
    let profiler = dhat::Profiler::builder().testing().build();
    let mut offenders = Vec::new();
    for (name, scene) in scenes() {
        for kind in REGISTRY {
            let schema = &kind.schema;
            if scene.forces.iter().any(|force| (schema.refuses)(force).is_some()) {
                continue;
            }
            let integrator_options = IntegratorOptions::defaults(schema);
            let scene = Scene { integrator: schema, integrator_options, ..scene.clone() };
            let mut simulation = Simulation::new(&scene);
            for _ in 0..FIRST_STEPS {
                assert!(simulation.advance().unwrap(), "{name} by {}", schema.name);
            }
            let before = dhat::HeapStats::get().total_blocks;
            for _ in 0..STEPS {
                simulation.advance().unwrap();
            }
            let count = dhat::HeapStats::get().total_blocks - before;
            if count > 0 {
                offenders.push(format!("{name} by {}: {count} in {STEPS} steps", schema.name));
            }
        }
    }
    assert!(offenders.is_empty(), "{offenders:#?}");
    // It does count.
    let before = dhat::HeapStats::get().total_blocks;
    drop(std::hint::black_box(vec![0_u8; 100]));
    assert_eq!(dhat::HeapStats::get().total_blocks, before + 1);
    drop(profiler);
}
