//! Warnings of runs that end, but whose trace is doubtful: nearly singular matrices, and energy that grows by orders of
//! magnitude. And matrices that are kept because they do not change.

use std::path::PathBuf;

use needs::needs;

use crate::support::failing::compressed;
use crate::support::shared::{bits, parse, root, shipped_scenes};
use scene::{ParseOptions, Scene, find_scene_files};
use simulator::simulation::{Simulation, SimulationOptions};
use simulator::statistics::{NEARLY_SINGULAR, Statistics};
use simulator::vocabulary;

const WATCHED: SimulationOptions = SimulationOptions {
    solver: simulator::solver::linear::LinearSolver::Auto,
    robust: false,
    watch_energy: true,
};

const ROBUST: SimulationOptions = SimulationOptions { robust: true, ..WATCHED };

fn run(scene: &Scene, options: SimulationOptions) -> (Vec<[Vec<u64>; 2]>, Statistics) {
    let mut simulation = Simulation::with_options(scene, options);
    let mut states = Vec::new();
    loop {
        let state = simulation.state();
        states.push([bits(state.positions), bits(state.velocities)]);
        if !simulation.advance().unwrap() {
            return (states, simulation.statistics().clone());
        }
    }
}

/// The spring of [`compressed`] for four free particles, which are coupled: a sparse system.
fn compressed_chain() -> String {
    let mut text = String::from(
        r#"<scene><duration time="0.1"/><integrator type="linearized-implicit-euler" dt="0.1"/>"#,
    );
    for particle in 0..9 {
        let fixed = u8::from(particle % 2 == 0);
        text +=
            &format!(r#"<particle m="1" px="{particle}" py="0" vx="0" vy="0" fixed="{fixed}"/>"#);
    }
    // Each of the two springs to fixed neighbours cancels half of the mass; those between free particles rest.
    let mut springs = Vec::new();
    for free in [1, 3, 5, 7] {
        springs.extend([(free - 1, free, 50), (free, free + 1, 50)]);
    }
    springs.extend([(1, 3, 30), (3, 5, 30), (5, 7, 30)]);
    for (edge, (i, j, k)) in springs.into_iter().enumerate() {
        text += &format!(r#"<edge i="{i}" j="{j}"/><springforce edge="{edge}" k="{k}" l0="2"/>"#);
    }
    text + r#"<simplegravity fx="0" fy="-1"/></scene>"#
}

#[test]
fn a_step_through_a_nearly_singular_matrix_is_counted() {
    for (text, n_steps) in
        [(compressed("linearized-implicit-euler", -10.0), 2), (compressed_chain(), 1)]
    {
        let (states, statistics) = run(&parse(&text), WATCHED);
        let y = f64::from_bits(states[1][0][3]);
        assert!(y.abs() > 1e10, "the step shoots to {y:e}");
        let conditioning = statistics.conditioning;
        let (step, amplification) = conditioning.first.unwrap();
        assert!(step == 1 && amplification > 1e10, "{conditioning:?}");
        assert!((1..=n_steps).contains(&conditioning.nearly_singular), "{conditioning:?}");
        assert!(conditioning.largest >= amplification);
    }
}

#[test]
fn nearly_singular_matrix_is_detected_off_the_force_direction() {
    // Nothing pulls across the spring, and the solution is small.
    let (states, statistics) = run(&parse(&compressed("linearized-implicit-euler", 0.0)), WATCHED);
    assert_eq!(f64::from_bits(states[1][0][3]), 0.0);
    assert!(statistics.conditioning.first.is_some_and(|(_, seen)| seen > 1e10), "{statistics:?}");
    assert_eq!(statistics.energy_growth, None);
}

#[test]
fn fallbacks_replace_a_step_through_a_nearly_singular_matrix() {
    let scene = parse(&compressed("linearized-implicit-euler", -10.0));
    let (states, statistics) = run(&scene, ROBUST);
    assert_eq!(statistics.fallback.substepped, 1);
    assert_eq!(statistics.conditioning.nearly_singular, 0);
    assert!(statistics.conditioning.largest < NEARLY_SINGULAR);
    assert_eq!(statistics.energy_growth, None);
    let halved = Scene { time_step: 0.05, ..scene };
    assert_eq!(states[1], run(&halved, SimulationOptions::default()).0[2]);
}

/// Scenes in which a run explodes within its few steps: closed and driven ones, by springs, damping and drag.
const EXPLODING: [(&str, &str, f64, u64, &str); 6] = [
    ("explicit-euler", "spring", 0.5, 10, r#"<springforce edge="0" k="90" l0="1"/>"#),
    ("symplectic-euler", "spring", 0.5, 10, r#"<springforce edge="0" k="90" l0="1"/>"#),
    ("runge-kutta-4", "spring", 0.8, 10, r#"<springforce edge="0" k="90" l0="1"/>"#),
    ("explicit-euler", "drag", 1.0, 10, r#"<dragdamping b="12"/>"#),
    ("explicit-euler", "damping", 0.1, 24, r#"<springforce edge="0" k="1" l0="1" b="90"/>"#),
    (
        "symplectic-euler",
        "wind",
        0.5,
        24,
        r#"<springforce edge="0" k="90" l0="1"/><windforce strength="0.1"/>"#,
    ),
];

/// Two particles, the first of them fixed.
fn pair(integrator: &str, h: f64, n_steps: u64, forces: &str) -> Scene {
    parse(&format!(
        r#"<scene><duration time="{}"/><integrator type="{integrator}" dt="{h}"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="1" px="1.2" py="0.1" vx="0.1" vy="0.1" fixed="0"/>
        <edge i="0" j="1"/>{forces}</scene>"#,
        h * n_steps as f64
    ))
}

#[test]
fn exploding_run_is_detected() {
    for (integrator, name, h, n_steps, forces) in EXPLODING {
        let scene = pair(integrator, h, n_steps, forces);
        let (states, statistics) = run(&scene, WATCHED);
        assert_eq!(states, run(&scene, SimulationOptions::default()).0, "{name}");
        let growth = statistics.energy_growth;
        let growth = growth.unwrap_or_else(|| panic!("{integrator}, {name}: no growth seen"));
        assert!(growth.energy > 100.0 * growth.before && growth.step <= n_steps, "{growth:?}");
        // A step that is small enough is not.
        let calm = pair(integrator, h / 100.0, 500, forces);
        assert_eq!(run(&calm, WATCHED).1.energy_growth, None, "{integrator}, {name}");
    }
}

#[test]
fn converted_or_driven_energy_is_not_reported_as_growth() {
    let fall = r#"<particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>"#;
    let apart = r#"<particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>
        <particle m="1" px="1" py="0" vx="0" vy="0" fixed="0"/><edge i="0" j="1"/>"#;
    let scenes = [
        // Both energies are zero at first, and their sum is small compared with each of them.
        (fall, r#"<simplegravity fx="0" fy="-9.81"/>"#, 0.01),
        // Springs that rest but for rounding, whose energy is not zero but nearly so.
        (
            apart,
            r#"<simplegravity fx="0" fy="-9.81"/><springforce edge="0" k="100" l0="1.0000000001"/>"#,
            0.01,
        ),
        (fall, r#"<windforce strength="2"/>"#, 0.01),
        // A spring that starts at its rest length, which then grows: from no energy at all.
        (apart, r#"<scriptedspringforce edge="0" k="50" l0="1" l1="2" t1="2"/>"#, 0.01),
        (apart, r#"<vortexforce i="0" j="1" kbs="2" kvc="1.5"/>"#, 0.005),
        // An oscillator comes to rest in each period.
        (apart, r#"<springforce edge="0" k="100" l0="1.3"/>"#, 0.003),
        (
            apart,
            r#"<gravitationalforce i="0" j="1" G="1"/><springforce edge="0" k="0.2" l0="1"/>"#,
            1e-3,
        ),
        // A fixed particle that moves pulls the other along.
        (
            r#"<particle m="1" px="0" py="0" vx="30" vy="0" fixed="1"/>
               <particle m="1e-3" px="1" py="0" vx="0" vy="0" fixed="0"/><edge i="0" j="1"/>"#,
            r#"<springforce edge="0" k="1" l0="1"/>"#,
            1e-3,
        ),
    ];
    for (particles, forces, h) in scenes {
        for integrator in
            ["explicit-euler", "symplectic-euler", "implicit-euler", "velocity-verlet"]
        {
            let scene = parse(&format!(
                r#"<scene><duration time="{}"/><integrator type="{integrator}" dt="{h}"/>{particles}{forces}</scene>"#,
                600.0 * h
            ));
            let (_, statistics) = run(&scene, WATCHED);
            assert_eq!(statistics.energy_growth, None, "{integrator}: {forces}");
        }
    }
}

#[test]
fn scenes_of_the_suite_have_no_warnings() {
    assert_without_warnings(shipped_scenes());
}

#[needs("test -d ../shared/fosssim/scenes")]
#[test]
fn scenes_of_the_course_have_no_warnings() {
    assert_without_warnings(find_scene_files(&root().join("../shared/fosssim/scenes")).unwrap());
}

fn assert_without_warnings(paths: Vec<PathBuf>) {
    let mut largest: f64 = 0.0;
    for path in paths {
        let scene = scene::load(&path, &vocabulary(), &ParseOptions::default()).unwrap().scene;
        let mut simulation = Simulation::with_options(&scene, WATCHED);
        while simulation.advance().unwrap() {}
        let statistics = simulation.statistics();
        assert_eq!(statistics.energy_growth, None, "{}", path.display());
        let conditioning = statistics.conditioning;
        assert_eq!(conditioning.nearly_singular, 0, "{}: {conditioning:?}", path.display());
        largest = largest.max(conditioning.largest);
    }
    assert!(largest > 0.1 && largest < 1e-2 * NEARLY_SINGULAR, "{largest:e}");
}

/// Particles in a row, with forces whose Jacobians do not change; with a spring that has a rest length, they do.
fn row(integrator: &str, rest_length: f64) -> Scene {
    let mut text = format!(
        r#"<scene><duration time="0.4"/><integrator type="{integrator}" dt="0.05"/>
        <dragdamping b="0.4"/><simplegravity fx="0" fy="-9.81"/>"#
    );
    for particle in 0..7 {
        let fixed = u8::from(particle == 0);
        text += &format!(
            r#"<particle m="1.5" px="{particle}" py="0.2" vx="0" vy="0.{particle}" fixed="{fixed}"/>"#
        );
    }
    for edge in 0..6 {
        let (l0, j) = (if edge == 0 { rest_length } else { 0.0 }, edge + 1);
        text +=
            &format!(r#"<edge i="{edge}" j="{j}"/><springforce edge="{edge}" k="40" l0="{l0}"/>"#);
    }
    parse(&(text + "</scene>"))
}

#[test]
fn a_matrix_of_constant_jacobians_is_assembled_and_factorised_once_for_each_step_size() {
    // The first step of BDF2 is implicit Euler's, whose matrix is another one.
    for (integrator, matrices) in [
        ("linearized-implicit-euler", 1),
        ("implicit-euler", 1),
        ("projected-newton", 1),
        ("implicit-midpoint", 1),
        ("bdf2", 2),
    ] {
        let scene = row(integrator, 0.0);
        let (states, statistics) = run(&scene, SimulationOptions::default());
        let linear = statistics.linear;
        let counts = (statistics.assemblies, linear.factorisations, linear.symbolic_analyses);
        assert_eq!(counts, (matrices, matrices, 1), "{integrator}");
        assert!(linear.solves >= statistics.steps, "{integrator}");
        // A new matrix for each step gives the same bits.
        let mut whole = Simulation::new(&scene);
        let mut earlier = None;
        for step in 0..statistics.steps {
            let mut fresh = Simulation::new(&scene);
            let state = whole.state();
            fresh.set_state(step, earlier.as_ref(), state.positions, state.velocities);
            fresh.advance().unwrap();
            whole.advance().unwrap();
            earlier = whole.earlier().cloned();
            let end = [bits(fresh.state().positions), bits(fresh.state().velocities)];
            assert_eq!(end, states[step as usize + 1], "{integrator}, step {step}");
        }
        // One spring with a rest length, and the matrix changes from step to step.
        let (_, statistics) = run(&row(integrator, 0.5), SimulationOptions::default());
        assert!(statistics.assemblies >= statistics.steps, "{integrator}");
    }
}

#[test]
fn drag_alone_is_assembled_once() {
    let scene = parse(
        r#"<scene><duration time="1"/><integrator type="linearized-implicit-euler" dt="0.1"/>
        <particle m="1" px="0" py="0" vx="1" vy="2" fixed="0"/>
        <dragdamping b="0.7"/><simplegravity fx="0" fy="-9.81"/></scene>"#,
    );
    let (_, statistics) = run(&scene, SimulationOptions::default());
    let counts =
        (statistics.assemblies, statistics.linear.factorisations, statistics.linear.solves);
    assert_eq!(counts, (1, 0, 10));
}
