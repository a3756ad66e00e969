//! Convergence of the local-global method, plain and accelerated: error against rounds and against time. See README.md in this folder.

use std::time::{Duration, Instant};

use scene::schema::{IntegratorOptions, OptionKind};
use scene::{Dimension, Scene};
use simulator::force::ForceKind;
use simulator::generate::{Chain, Cloth, Generator, Net, SpringLaw, Springs};
use simulator::integrator::{self, BuildIntegrator, IntegratorKind, Step};
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use simulator::system::{BuildForce, System};

/// Rounds at which the first table looks.
const ROUNDS: [u64; 8] = [1, 2, 5, 10, 20, 50, 100, 200];

/// Errors whose times the second table gives.
const ERRORS: [f64; 5] = [1e-1, 1e-2, 1e-4, 1e-6, 1e-8];

/// Rounds that no method is given more of.
const MOST: u64 = 1 << 11;

/// Rounds that find the minimiser, by the accelerated method.
const CONVERGED: u64 = 1500;

/// Steps before the one that is looked at.
const BEFORE: usize = 8;

fn main() {
    let net = |segments| Net { segments, ..Net::default() };
    let chain = |stiffness| {
        let springs = Springs { stiffness, damping: 0.0, law: SpringLaw::Hooke };
        Chain { links: 100, springs, ..Chain::default() }
    };
    let cloth = Cloth { nx: 20, ny: 20, ..Cloth::default() };
    study("stretched square, n = 16", &net(16), 0.004);
    study("stretched square, n = 64", &net(64), 0.004);
    study("hanging cloth, 20 × 20", &cloth, 0.01);
    study("chain of 100 links, k = 1e5", &chain(1e5), 0.01);
    study("chain of 100 links, k = 1e6", &chain(1e6), 0.01);
}

fn method() -> &'static IntegratorKind {
    let mut kinds = integrator::REGISTRY.iter();
    kinds.find(|kind| kind.schema.name == "fast-mass-spring").expect("it is registered")
}

/// Every way to accelerate, the plain method first.
fn accelerations() -> &'static [&'static str] {
    let mut options = method().schema.options.iter();
    let option = options.find(|option| option.name == "acceleration");
    match option.map(|option| option.kind) {
        Some(OptionKind::Choice { words }) => words,
        _ => &[],
    }
}

fn study(title: &str, generator: &dyn Generator, time_step: f64) {
    let mut scene = generator.scene().expect("the scene is valid");
    scene.time_step = time_step;
    match scene.dimension {
        Dimension::Two => tables::<2>(title, &scene),
        Dimension::Three => tables::<3>(title, &scene),
    }
}

/// Positions and velocities.
type State = [Vec<f64>; 2];

/// A step of so many rounds from `state`, and the shortest time it took in several tries.
fn step<const D: usize>(
    scene: &Scene,
    state: &State,
    acceleration: &str,
    rounds: u64,
    tries: usize,
) -> (State, Duration)
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    let mut scene = scene.clone();
    let mut options = IntegratorOptions::defaults(&method().schema);
    options.set("acceleration", acceleration).expect("it is one of the schema");
    options.set("iterations", &rounds.to_string()).expect("it is a count");
    (scene.integrator, scene.integrator_options) = (&method().schema, options);
    let system = System::<D>::new(&scene);
    let mut integrator = method().build(&scene, &system, LinearSolver::Auto);
    let mut best = Duration::MAX;
    // The first try makes room, and factorises.
    for try_number in 0..=tries {
        let [mut positions, mut velocities] = state.clone();
        let statistics = &mut Statistics::default();
        let started = Instant::now();
        let step = Step {
            size: scene.time_step,
            time: 0.0,
            positions: &mut positions,
            velocities: &mut velocities,
            earlier: None,
            statistics,
        };
        integrator.step(&system, step).expect("the step has an answer");
        if try_number > 0 {
            best = best.min(started.elapsed());
        }
        if try_number == tries {
            return ([positions, velocities], best);
        }
    }
    unreachable!("the last try returns")
}

#[expect(clippy::print_stdout, reason = "the tables are what this is for")]
fn tables<const D: usize>(title: &str, scene: &Scene)
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    let mut state = [scene.positions(), scene.velocities()];
    for _ in 0..BEFORE {
        state = step(scene, &state, "lbfgs", 60, 0).0;
    }
    let minimiser = step(scene, &state, "lbfgs", CONVERGED, 0).0;
    let difference = |a: &State, b: &State| {
        let differences = a[0].iter().zip(&b[0]).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f64::max)
    };
    let moved = difference(&state, &minimiser);
    let error = |acceleration, rounds| {
        difference(&step(scene, &state, acceleration, rounds, 0).0, &minimiser) / moved
    };

    println!(
        "\n{title}: largest error of a coordinate, relative to the largest motion of the step"
    );
    print!("{:<12}", "rounds");
    ROUNDS.iter().for_each(|rounds| print!("{rounds:>9}"));
    for acceleration in accelerations() {
        print!("\n{acceleration:<12}");
        ROUNDS.iter().for_each(|rounds| print!("{:>9.1e}", error(acceleration, *rounds)));
    }
    println!("\n\n{title}: milliseconds (and rounds) until that error is below");
    print!("{:<12}", "error");
    ERRORS.iter().for_each(|error| print!("{error:>16.0e}"));
    for acceleration in accelerations() {
        print!("\n{acceleration:<12}");
        let mut rounds = 1;
        for wanted in ERRORS {
            while rounds <= MOST && error(acceleration, rounds) > wanted {
                rounds = (rounds + 1).max(rounds * 5 / 4);
            }
            if rounds > MOST {
                print!("{:>16}", "-");
                continue;
            }
            let (_, time) = step(scene, &state, acceleration, rounds, 5);
            print!("{:>10.3} ({rounds:>3})", time.as_secs_f64() * 1e3);
        }
    }
    println!();
}
