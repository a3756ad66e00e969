//! Fallbacks (`--robust`): they change failed steps and nothing else.

use crate::support::failing::{ONTO, flung};
use crate::support::shared::{bits, parse, shipped_scenes};
use scene::schema::{Convergence, IntegratorOptions};
use scene::trace::State;
use scene::{ParseOptions, Scene};
use simulator::integrator::{self, Interrupt};
use simulator::simulation::{FailureKind, Simulation, SimulationError, SimulationOptions};
use simulator::statistics::Statistics;
use simulator::vocabulary;

const ROBUST: SimulationOptions = SimulationOptions {
    solver: simulator::solver::linear::LinearSolver::Auto,
    robust: true,
    watch_energy: false,
};

type Run = (Vec<[Vec<u64>; 2]>, Statistics, Option<SimulationError>);

/// The bits of every state, what it cost, and how it failed, if it did.
fn run(scene: &Scene, config: SimulationOptions) -> Run {
    let mut simulation = Simulation::with_options(scene, config);
    let mut states = Vec::new();
    loop {
        let state = simulation.state();
        states.push([bits(state.positions), bits(state.velocities)]);
        match simulation.advance() {
            Ok(true) => {}
            Ok(false) => return (states, simulation.statistics().clone(), None),
            Err(error) => return (states, simulation.statistics().clone(), Some(error)),
        }
    }
}

#[test]
fn fallbacks_do_not_change_successful_runs() {
    let mut count = 0;
    for path in shipped_scenes() {
        let scene = scene::load(&path, &vocabulary(), &ParseOptions::default()).unwrap().scene;
        let plain = run(&scene, SimulationOptions::default());
        let robust = run(&scene, ROBUST);
        assert!(plain.2.is_none(), "{:?}", plain.2);
        assert!(plain == robust, "{}", path.display());
        count += 1;
    }
    assert!(count > 100, "{count} scenes");
}

#[test]
fn a_line_search_solves_the_equations_that_plain_newton_does_not() {
    let scene = parse(&flung("0"));
    let (plain, _, failure) = run(&scene, SimulationOptions::default());
    let failure = failure.expect("plain Newton does not converge");
    assert!(matches!(failure.kind, FailureKind::NotConverged { .. }), "{failure}");
    let (states, statistics, failure) = run(&scene, ROBUST);
    assert_eq!((failure, statistics.fallback.substepped), (None, 0));
    assert!(statistics.fallback.line_searched > 0);
    // States before the failure are unchanged.
    assert_eq!(states[..plain.len()], plain);
    // v' − v = h F(x'): to the change of force of an update below 1e-9, by springs of 5e8 N/m.
    let step = failure_step(&plain);
    let [from, to] = [step, step + 1].map(|step| {
        states[step].clone().map(|bits| bits.into_iter().map(f64::from_bits).collect::<Vec<_>>())
    });
    let forces = forces(&scene, &to[0]);
    for dof in 2..forces.len() {
        let residual = to[1][dof] - from[1][dof] - forces[dof];
        assert!(residual.abs() < 1e-9 * 1e10, "degree of freedom {dof}: {residual:e}");
        // It could be false: the forces are far larger.
        assert!(forces[dof].abs() > 1e-2, "{forces:?}");
    }
}

/// The number of the state from which the first failed step starts.
fn failure_step(states: &[[Vec<u64>; 2]]) -> usize {
    states.len() - 1
}

/// The springs' forces, by the formula.
fn forces(scene: &Scene, x: &[f64]) -> Vec<f64> {
    let mut forces = vec![0.0; x.len()];
    for spring in &scene.forces {
        let [i, j] = spring.pair().unwrap();
        let d = [x[2 * i] - x[2 * j], x[2 * i + 1] - x[2 * j + 1]];
        let length = d[0].hypot(d[1]);
        for axis in 0..2 {
            let force = -spring.parameters[0] * (length - spring.parameters[1]) * d[axis] / length;
            forces[2 * i + axis] += force;
            forces[2 * j + axis] -= force;
        }
    }
    forces
}

#[test]
fn fallbacks_rescue_forces_without_energy() {
    let scene = parse(&flung("3"));
    assert!(run(&scene, SimulationOptions::default()).2.is_some());
    let (_, statistics, failure) = run(&scene, ROBUST);
    assert_eq!(failure, None);
    assert!(statistics.fallback.steps() > 0);
}

#[test]
fn substeps_equal_the_method_at_the_smaller_step() {
    let scene = parse(ONTO);
    let (_, _, failure) = run(&scene, SimulationOptions::default());
    assert!(matches!(failure.unwrap().kind, FailureKind::Degenerate { .. }));
    let (states, statistics, failure) = run(&scene, ROBUST);
    assert_eq!(failure, None);
    let counts = statistics.fallback;
    assert_eq!((counts.substepped, counts.substeps, counts.max_substeps), (1, 2, 2));
    let halved = Scene { time_step: 0.25, ..scene };
    assert_eq!(states[1], run(&halved, SimulationOptions::default()).0[2]);
}

#[test]
fn two_step_method_resumes_from_whole_steps() {
    let mut scene = parse(&flung("3"));
    (scene.integrator, scene.duration) = (vocabulary().integrator("bdf2").unwrap(), 40.0);
    let mut robust = Simulation::with_options(&scene, ROBUST);
    let mut plain = Simulation::new(&scene);
    let mut halved = scene.clone();
    halved.integrator = vocabulary().integrator("implicit-euler").unwrap();
    let state = |simulation: &Simulation| {
        let state = simulation.state();
        let (positions, velocities) = (state.positions.to_vec(), state.velocities.to_vec());
        State { time: None, positions, velocities }
    };
    let mut states = vec![state(&robust)];
    let (mut is_after_smaller, mut checked) = (false, [0; 2]);
    for step in 0..scene.n_steps() as usize {
        let before = robust.statistics().fallback;
        robust.advance().unwrap();
        let after = robust.statistics().fallback;
        let end = state(&robust);
        let State { positions, velocities, .. } = &states[step];
        if after.substepped > before.substepped {
            // Each smaller step is the first of a run.
            let substeps = after.substeps - before.substeps;
            halved.time_step = scene.time_step / substeps as f64;
            let mut euler = Simulation::new(&halved);
            euler.set_state(0, None, positions, velocities);
            (0..substeps).for_each(|_| assert!(euler.advance().unwrap()));
            assert_eq!(end, state(&euler), "step {step}");
            checked[0] += 1;
        } else if after == before && is_after_smaller {
            plain.set_state(step as u64, Some(&states[step - 1]), positions, velocities);
            assert!(plain.advance().unwrap());
            assert_eq!(end, state(&plain), "step {step}");
            checked[1] += 1;
        }
        is_after_smaller = after.substepped > before.substepped;
        states.push(end);
    }
    assert!(checked.iter().all(|count| *count > 0), "{checked:?}");
}

#[test]
fn unsolvable_steps_fail_as_without_fallbacks() {
    let text =
        ONTO.replace("linearized-implicit-euler", "explicit-euler").replace("0.5\" py", "0\" py");
    let scene = parse(&text);
    let (plain, robust) = (run(&scene, SimulationOptions::default()), run(&scene, ROBUST));
    assert!(robust.2.is_some() && plain.2 == robust.2, "{:?}", robust.2);
}

/// Every method that iterates stops before its next iteration once it is interrupted, without and with fallbacks.
#[test]
fn methods_that_iterate_can_be_interrupted() {
    let text = r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="0.1"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="2" px="1.3" py="0.2" vx="0" vy="0.7" fixed="0"/>
        <edge i="0" j="1"/><springforce edge="0" k="60" l0="1"/></scene>"#;
    for kind in integrator::REGISTRY {
        let mut scene = parse(text);
        scene.integrator = &kind.schema;
        scene.integrator_options = IntegratorOptions::defaults(&kind.schema);
        for robust in [false, true] {
            let mut simulation =
                Simulation::with_options(&scene, SimulationOptions { robust, ..ROBUST });
            let interrupt = Interrupt::default();
            simulation.interrupt_by(&interrupt);
            assert!(simulation.advance().unwrap());
            interrupt.raise();
            let end = simulation.advance().map_err(|error| error.kind);
            let expected = match kind.schema.convergence {
                Convergence::Direct => Ok(true),
                _ => Err(FailureKind::Interrupted),
            };
            assert_eq!(end, expected, "{}", kind.schema.name);
        }
    }
}
