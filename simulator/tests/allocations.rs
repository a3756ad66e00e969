//! Steps allocate nothing after the first few. A separate process: threads of other tests keep garbage of the thread pool
//! alive, for which it then allocates.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use scene::Scene;
use scene::schema::IntegratorOptions;
use simulator::force::REGISTRY as FORCES;
use simulator::generate::{
    Beam, Bodies, Chain, Cloth, Disc, Generator, Material, Net, Ring, Rope, Sheet, SpringLaw,
    Springs, Timeline,
};
use simulator::integrator::REGISTRY;
use simulator::simulation::Simulation;
use simulator::vocabulary;

/// Enough that every workspace is allocated, those for indefinite and for stiff systems included.
const FIRST_STEPS: u64 = 12;

const STEPS: u64 = 8;

/// Scenes of every kind and size of system: separate and joined parts, symmetric or not, two and three
/// dimensions, more elements than one thread is given.
fn scenes() -> Vec<(&'static str, Scene)> {
    let timeline = || Timeline {
        integrator: vocabulary().integrator("implicit-euler").unwrap(),
        options: Vec::new(),
        time_step: Some(1e-3),
        duration: 0.0,
        steps: Some(FIRST_STEPS + STEPS),
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
        (
            "large sheet",
            Sheet {
                nx: 96,
                ny: 48,
                width: 12.0,
                height: 6.0,
                timeline: timeline(),
                ..Sheet::default()
            }
            .scene(),
        ),
        ("disc", Disc { timeline: timeline(), ..Disc::default() }.scene()),
        ("rope", Rope { timeline: timeline(), ..Rope::default() }.scene()),
        ("bodies", Bodies { timeline: timeline(), ..Bodies::default() }.scene()),
    ];
    let triangles = FORCES.iter().map(|kind| &kind.schema).filter(|schema| schema.is_triangle());
    let sheets = triangles.map(|force| {
        let material = Material { force, ..Sheet::default().material };
        (force.tag, Sheet { material, timeline: timeline(), ..Sheet::default() }.scene())
    });
    scenes.into_iter().chain(sheets).map(|(name, scene)| (name, scene.unwrap())).collect()
}

/// Allocations made by `task` on any thread of the pool: each thread counts its own, and the threads that do not run
/// the task help with its parallel loops until it ends.
fn allocations(pool: &rayon::ThreadPool, task: impl FnOnce() + Send) -> u64 {
    let task = Mutex::new(Some(task));
    let done = AtomicBool::new(false);
    let counts = pool.broadcast(|thread| {
        let count = allocation_counter::measure(|| {
            if thread.index() == 0 {
                let task = task.lock().unwrap().take().expect("one thread has index 0");
                task();
                done.store(true, Ordering::Release);
            }
            while !done.load(Ordering::Acquire) {
                rayon::yield_now();
            }
        });
        count.count_total
    });
    counts.into_iter().sum()
}

#[test]
fn steps_allocate_nothing() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let mut offenders = Vec::new();
    for (name, scene) in scenes() {
        for kind in REGISTRY {
            let schema = &kind.schema;
            if scene.forces.iter().any(|force| (schema.refuses)(force).is_some()) {
                continue;
            }
            let integrator_options = IntegratorOptions::defaults(schema);
            let scene = Scene { integrator: schema, integrator_options, ..scene.clone() };
            let mut simulation = pool.install(|| Simulation::new(&scene));
            let mut advance = |steps: u64| {
                for _ in 0..steps {
                    assert!(simulation.advance().unwrap(), "{name} by {}", schema.name);
                }
            };
            pool.install(|| advance(FIRST_STEPS));
            let count = allocations(&pool, || advance(STEPS));
            if count > 0 {
                offenders.push(format!("{name} by {}: {count} in {STEPS} steps", schema.name));
            }
        }
    }
    assert!(offenders.is_empty(), "{offenders:#?}");
}

#[test]
fn the_allocations_of_every_thread_are_counted() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let allocate = || drop(std::hint::black_box(vec![0_u8; 100]));
    // Each half waits for the other to have begun, so that two threads take them.
    let barrier = std::sync::Barrier::new(2);
    let half = || {
        barrier.wait();
        allocate();
    };
    let both = || {
        rayon::join(half, half);
    };
    pool.install(both);
    assert_eq!(allocations(&pool, both), 2);
}
