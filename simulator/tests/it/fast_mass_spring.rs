//! The local-global method against the assignment in plain dense algebra, against implicit Euler, and against
//! what its options promise.

use crate::support::largest_difference;
use crate::support::local_global::Assignment;
use scene::{Overrides, ParseOptions, Scene, xml};
use simulator::simulation::{FailureKind, Simulation};
use simulator::statistics::Statistics;
use simulator::vocabulary;

const ACCELERATED: [&str; 1] = ["lbfgs"];

fn scene(elements: &str, dt: f64, steps: u32, options: &[(&str, &str)]) -> Scene {
    let text = format!(
        r#"<scene><duration time="{}"/><integrator type="fast-mass-spring" dt="{dt}"/>{elements}</scene>"#,
        (f64::from(steps) - 0.5) * dt
    );
    let options = options.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
    let overrides = Overrides { options: options.collect(), ..Overrides::default() };
    let options = ParseOptions { strict: true, overrides, ..ParseOptions::default() };
    xml::parse(&text, "test.xml", &vocabulary(), &options).unwrap_or_else(|e| panic!("{e}")).scene
}

/// A particle that is at rest.
fn particle(x: [f64; 3], dimensions: usize, fixed: bool) -> String {
    let z = if dimensions == 3 { format!(r#"pz="{}""#, x[2]) } else { String::new() };
    let (m, fixed) = (0.5 + (x[0] * 3.0 + x[1]).sin().abs(), u8::from(fixed));
    format!(r#"<particle m="{m}" px="{}" py="{}" {z} vx="0" vy="0" fixed="{fixed}"/>"#, x[0], x[1])
}

fn spring(edge: usize, [i, j]: [usize; 2], stiffness: f64, rest_length: f64) -> String {
    format!(
        r#"<edge i="{i}" j="{j}"/><springforce edge="{edge}" k="{stiffness}" l0="{rest_length}"/>"#
    )
}

const GRAVITY: &str = r#"<simplegravity fx="0.5" fy="-9.8"/><constantforce fx="0.2" fy="0.1"/>"#;

fn single_spring(dimensions: usize) -> String {
    let ends = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.4]];
    let particles = particle(ends[0], dimensions, true) + &particle(ends[1], dimensions, false);
    particles + &spring(0, [0, 1], 500.0, 0.9) + GRAVITY
}

fn chain(dimensions: usize) -> String {
    let at = |i: usize| [i as f64, 0.1 * (i as f64).cos(), 0.2 * (i as f64).sin()];
    let particles = (0..10).map(|i| particle(at(i), dimensions, i == 0 || i == 9));
    let springs = (0..9).map(|i| spring(i, [i + 1, i], 400.0 + 30.0 * i as f64, 0.95));
    particles.chain(springs).collect::<String>() + GRAVITY
}

/// A net of 7 by 7 particles, with diagonals; large enough for `auto` to choose a sparse factor.
fn net(dimensions: usize, pinned: bool) -> String {
    let at = |i: usize, j: usize| [i as f64, j as f64, 0.3 * (i as f64 * 1.3 + j as f64).sin()];
    let mut text = String::new();
    for (i, j) in (0..7).flat_map(|i| (0..7).map(move |j| (i, j))) {
        text += &particle(at(i, j), dimensions, pinned && j == 6 && i % 3 == 0);
    }
    let mut n = 0;
    for (i, j) in (0..7).flat_map(|i| (0..7).map(move |j| (i, j))) {
        for (di, dj) in [(1, 0), (0, 1), (1, 1)] {
            if i + di < 7 && j + dj < 7 {
                let rest_length = 0.9 * ((di + dj) as f64).sqrt();
                text += &spring(n, [7 * i + j, 7 * (i + di) + j + dj], 300.0, rest_length);
                n += 1;
            }
        }
    }
    text + GRAVITY
}

fn problems() -> impl Iterator<Item = (&'static str, String)> {
    [2, 3].into_iter().flat_map(|dimensions| {
        [
            ("single spring", single_spring(dimensions)),
            ("chain", chain(dimensions)),
            ("net", net(dimensions, true)),
        ]
    })
}

/// Positions after every step, the start included; and what they cost.
fn run(scene: &Scene) -> (Vec<Vec<f64>>, Statistics) {
    let mut simulation = Simulation::new(scene);
    let mut states = vec![simulation.state().positions.to_vec()];
    while simulation.advance().unwrap() {
        states.push(simulation.state().positions.to_vec());
    }
    (states, simulation.statistics().clone())
}

fn end(scene: &Scene) -> Vec<f64> {
    run(scene).0.pop().unwrap()
}

fn failure(scene: &Scene) -> FailureKind {
    let mut simulation = Simulation::new(scene);
    loop {
        match simulation.advance() {
            Ok(true) => {}
            Ok(false) => panic!("it went to its end"),
            Err(error) => return error.kind,
        }
    }
}

#[test]
fn fast_mass_spring_matches_the_assignment_dense_and_sparse() {
    for (name, elements) in problems() {
        for matrix in ["dense", "sparse"] {
            let options = [("pins", "penalty"), ("matrix", matrix)];
            let scene = scene(&elements, 1.0 / 30.0, 30, &options);
            let mut assignment = Assignment::new(&scene, 50, 1e10);
            let (states, statistics) = run(&scene);
            assert!(statistics.linear_solver.contains(matrix), "{}", statistics.linear_solver);
            assert!(largest_difference(&states[0], &states[30]) > 0.1, "{name} does not move");
            for (step, state) in states.iter().enumerate() {
                let difference = largest_difference(state, &assignment.flat());
                assert!(difference < 1e-9, "{name}, {matrix}, step {step}: {difference:e}");
                assignment.step();
            }
        }
    }
}

#[test]
fn few_rounds_match_the_assignment() {
    for (name, elements) in problems() {
        for rounds in [1, 2, 3] {
            let iterations = rounds.to_string();
            let options = [("pins", "penalty"), ("iterations", iterations.as_str())];
            let scene = scene(&elements, 1.0 / 30.0, 30, &options);
            let mut assignment = Assignment::new(&scene, rounds, 1e10);
            (0..30).for_each(|_| assignment.step());
            let difference = largest_difference(&end(&scene), &assignment.flat());
            assert!(difference < 1e-9, "{name}, {rounds} rounds: {difference:e}");
        }
    }
}

#[test]
fn the_storage_of_the_matrix_changes_nothing_but_rounding() {
    for (name, elements) in problems() {
        let by = |matrix| run(&scene(&elements, 1.0 / 30.0, 30, &[("matrix", matrix)]));
        let [dense, sparse, auto] = ["dense", "sparse", "auto"].map(by);
        let difference = largest_difference(&dense.0.concat(), &sparse.0.concat());
        assert!(difference < 1e-12, "{name}: {difference:e}");
        let chosen = if name == "net" { &sparse } else { &dense };
        assert_eq!(&auto, chosen, "{name}");
        assert_eq!(dense.1.linear.symbolic_analyses, 0);
        assert_eq!((sparse.1.linear.symbolic_analyses, sparse.1.linear.factorisations), (1, 1));
    }
}

#[test]
fn pins_by_penalty_give_way_in_proportion_to_one_over_their_weight() {
    // One that moves, too: its target is where it would be by now.
    let moving = chain(3).replacen(r#"vx="0""#, r#"vx="0.75""#, 1);
    for (name, elements) in problems().chain([("moving pin", moving)]) {
        let eliminated = end(&scene(&elements, 1.0 / 30.0, 30, &[("iterations", "4")]));
        let [soft, hard, default] = ["1e6", "1e8", "1e10"].map(|weight| {
            let options = [("iterations", "4"), ("pins", "penalty"), ("pin_weight", weight)];
            largest_difference(&end(&scene(&elements, 1.0 / 30.0, 30, &options)), &eliminated)
        });
        assert!((80.0..125.0).contains(&(soft / hard)), "{name}: {soft:e}, {hard:e}");
        assert!(default < 1e-6, "{name}: {default:e}");
    }
}

#[test]
fn a_spring_between_pins_moves_them_where_a_penalty_holds_them() {
    let elements = r#"
        <particle m="2" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="2" px="1.5" py="0" vx="0" vy="0" fixed="1"/>
        <edge i="0" j="1"/>
        <springforce edge="0" k="50" l0="1"/>"#;
    let options = [("pins", "penalty"), ("pin_weight", "10000")];
    let moved = end(&scene(elements, 0.1, 1, &options));
    // (w + m/h² + 2 k) u = k (l − l0)
    let u = 25.0 / (10000.0 + 200.0 + 100.0);
    assert!((moved[0] - u).abs() < 1e-15 && (moved[2] - (1.5 - u)).abs() < 1e-15, "{moved:?}");
    let held = end(&scene(elements, 0.1, 1, &[]));
    assert_eq!([held[0], held[2]], [0.0, 1.5]);
}

#[test]
fn pins_keep_their_scene_velocity() {
    let elements = chain(2).replacen(r#"vx="0""#, r#"vx="0.75""#, 1);
    for pins in ["elimination", "penalty"] {
        let mut simulation = Simulation::new(&scene(&elements, 0.01, 100, &[("pins", pins)]));
        while simulation.advance().unwrap() {}
        assert_eq!(simulation.state().velocities[..2], [0.75, 0.0]);
        let [x, y] = [simulation.state().positions[0], simulation.state().positions[1]];
        assert!((x - 0.75).abs() < 1e-6 && (y - 0.1).abs() < 1e-6, "{pins}: {x} {y}");
    }
}

#[test]
fn many_rounds_converge_to_implicit_euler() {
    for (name, elements) in problems() {
        let options = [("iterations", "20000"), ("tolerance", "1e-12")];
        let converged = scene(&elements, 0.01, 10, &options);
        let mut newton = converged.clone();
        newton.integrator = vocabulary().integrator("implicit-euler").unwrap();
        newton.integrator_options = scene::schema::IntegratorOptions::defaults(newton.integrator);
        let difference = largest_difference(&end(&converged), &end(&newton));
        assert!(difference < 1e-9, "{name}: {difference:e}");
    }
}

#[test]
fn acceleration_leads_to_the_same_minimiser() {
    for (name, elements) in problems() {
        for acceleration in ACCELERATED {
            let ends = [("none", "4000"), (acceleration, "300")].map(|(acceleration, rounds)| {
                let options = [("acceleration", acceleration), ("iterations", rounds)];
                end(&scene(&elements, 0.02, 10, &options))
            });
            let scale = ends[0].iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
            let difference = largest_difference(&ends[0], &ends[1]) / scale;
            assert!(difference < 1e-10, "{acceleration}, {name}: {difference:e}");
        }
    }
}

#[test]
fn acceleration_needs_fewer_rounds() {
    let elements = chain(2);
    let [plain, accelerated] = ["none", "lbfgs"].map(|acceleration| {
        let options =
            [("acceleration", acceleration), ("iterations", "5000"), ("tolerance", "1e-8")];
        let (_, statistics) = run(&scene(&elements, 1.0 / 30.0, 10, &options));
        assert_eq!(statistics.unconverged_steps, 0, "{acceleration}");
        statistics.local_global_iterations
    });
    assert!(3 * accelerated < 2 * plain, "{accelerated} and {plain}");
}

#[test]
fn no_round_increases_the_energy() {
    for (name, elements) in problems() {
        for acceleration in ["none"].into_iter().chain(ACCELERATED) {
            let one = |rounds: usize| {
                let iterations = rounds.to_string();
                let options = [
                    ("pins", "penalty"),
                    ("acceleration", acceleration),
                    ("iterations", iterations.as_str()),
                ];
                scene(&elements, 0.1, 1, &options)
            };
            let assignment = Assignment::new(&one(1), 1, 1e10);
            let mut last = assignment.energy(&assignment.flat());
            let first = last;
            for rounds in 1..40 {
                let energy = assignment.energy(&end(&one(rounds)));
                let rounding = 1e-13 * (first.abs() + energy.abs()).max(1.0);
                assert!(energy <= last + rounding, "{name}, {acceleration}, round {rounds}");
                last = energy;
            }
            assert!(last < first - 1e-3, "{name}, {acceleration}: {first} to {last}");
        }
    }
}

#[test]
fn number_of_rounds_is_as_requested() {
    let (_, statistics) = run(&scene(&chain(2), 0.01, 5, &[("iterations", "7")]));
    let rounds = (statistics.local_global_iterations, statistics.max_local_global_iterations);
    assert_eq!((rounds, statistics.unconverged_steps), ((35, 7), 0));
    assert_eq!((statistics.linear.solves, statistics.linear.factorisations), (35, 1));
    assert_eq!((statistics.assemblies, statistics.force_evaluations), (1, 5));
    assert!(statistics.linear.worst_residual < 1e-14);
}

#[test]
fn tolerance_ends_rounds_early_or_is_reported_missed() {
    let with = |iterations, tolerance| {
        let options = [("iterations", iterations), ("tolerance", tolerance)];
        run(&scene(&chain(2), 0.01, 5, &options)).1
    };
    let reached = with("1000", "1e-3");
    assert_eq!(reached.unconverged_steps, 0);
    assert!((2..300).contains(&reached.max_local_global_iterations), "{reached:?}");
    let tighter = with("1000", "1e-5");
    assert!(tighter.local_global_iterations > reached.local_global_iterations, "{tighter:?}");
    let missed = with("2", "1e-9");
    assert_eq!((missed.unconverged_steps, missed.local_global_iterations), (5, 10));
}

/// The distance of each coordinate from the minimiser after some rounds of one step, and what the statistics say of it.
#[test]
fn statistics_report_distance_from_the_minimiser() {
    let elements = net(3, true).replace("k=\"300\"", "k=\"30000\"");
    let after = |rounds: usize| {
        let iterations = rounds.to_string();
        let (states, statistics) =
            run(&scene(&elements, 1.0 / 30.0, 1, &[("iterations", iterations.as_str())]));
        (states.into_iter().next_back().unwrap(), statistics.rounds_end)
    };
    let (minimiser, converged) = after(6_000);
    assert!(converged.distance < 1e-9 && converged.residual < 1e-8, "{converged:?}");
    let mut before = after(9);
    for (rounds, at_most) in [(10, 10.0), (50, 4.0), (1_000, 1.05)] {
        if rounds > 10 {
            before = after(rounds - 1);
        }
        let (state, end) = after(rounds);
        let changed = largest_difference(&state, &before.0);
        assert!((end.change / changed - 1.0).abs() < 1e-6, "{rounds}: {end:?} {changed:e}");
        // It is an estimate from below, of a distance many times the change of the last round.
        let true_distance = largest_difference(&state, &minimiser);
        let ratio = true_distance / end.distance;
        assert!((0.95..at_most).contains(&ratio), "{rounds}: {true_distance:e} {end:?}");
        assert!(end.distance > 3.0 * end.change, "{rounds}: {end:?}");
        assert!(end.residual < before.1.residual, "{rounds}: {end:?}");
    }
}

#[test]
fn statistics_report_the_worst_step_after_two_rounds() {
    // Springs of rest length zero: the first round is the minimiser.
    let linear = chain(2).replace("l0=\"0.95\"", "l0=\"0\"");
    let exact = run(&scene(&linear, 0.01, 3, &[("iterations", "3")])).1.rounds_end;
    assert!(exact.distance < 1e-14 && exact.residual < 1e-12, "{exact:?}");
    let one = run(&scene(&chain(2), 0.01, 3, &[("iterations", "1")])).1.rounds_end;
    assert!(one.change > 1e-4 && (one.residual, one.distance) == (1.0, 0.0), "{one:?}");
    let of = |steps| run(&scene(&chain(2), 0.01, steps, &[("iterations", "5")])).1.rounds_end;
    let (short, long) = (of(1), of(20));
    assert!(long.change >= short.change && long.distance > short.distance, "{short:?} {long:?}");
    let options = [("acceleration", "lbfgs"), ("iterations", "5")];
    let accelerated = run(&scene(&chain(2), 0.01, 3, &options)).1.rounds_end;
    assert!(accelerated.change > 0.0, "{accelerated:?}");
    assert_eq!((accelerated.residual, accelerated.distance), (0.0, 0.0));
}

#[test]
fn momentum_is_conserved_without_pins() {
    let elements = net(3, false).replace(GRAVITY, "").replacen(r#"vx="0""#, r#"vx="3""#, 1);
    for acceleration in ["none"].into_iter().chain(ACCELERATED) {
        let options = [("acceleration", acceleration), ("iterations", "10")];
        let mut simulation = Simulation::new(&scene(&elements, 0.02, 100, &options));
        let initial = simulation.energies().unwrap().momentum;
        assert!(initial[0] > 1.0);
        while simulation.advance().unwrap() {}
        let momentum = simulation.energies().unwrap().momentum;
        let error = largest_difference(&initial, &momentum);
        assert!(error < 1e-11, "{acceleration}: {error:e}");
    }
}

#[test]
fn a_spring_without_a_direction_is_named() {
    let two = particle([0.0; 3], 2, false) + &particle([0.0; 3], 2, false);
    let first = particle([1.0, 0.0, 0.0], 2, false);
    let tied = spring(0, [0, 2], 10.0, 0.0) + &spring(1, [1, 2], 10.0, 0.5);
    match failure(&scene(&(first + &two + &tied), 0.1, 1, &[])) {
        FailureKind::Degenerate { tag: "springforce", particles, .. }
            if particles[..] == [1, 2] => {}
        other => panic!("{other}"),
    }
    // The first spring has no damping: what is left of the forces is numbered anew, and must not show.
    let damped = tied.replace(r#"edge="1" k="10" l0="0.5""#, r#"edge="1" k="0" l0="0.5" b="2""#);
    let first = particle([1.0, 0.0, 0.0], 2, false);
    match failure(&scene(&(first + &two + &damped), 0.1, 1, &[])) {
        FailureKind::Degenerate { tag: "springforce", particles, .. }
            if particles[..] == [1, 2] => {}
        other => panic!("{other}"),
    }
    // Without a rest length it pulls at nothing.
    let states = run(&scene(&(two + &spring(0, [0, 1], 10.0, 0.0)), 0.1, 3, &[])).0;
    assert_eq!(states[3], [0.0; 4]);
}

#[test]
fn springs_between_fixed_particles_have_no_effect() {
    let extra = chain(2) + &spring(9, [0, 9], 1e9, 1.0);
    let [plain, extra] = [chain(2), extra].map(|elements| {
        let (states, statistics) = run(&scene(&elements, 0.01, 20, &[]));
        (states, statistics.linear_solver)
    });
    assert_eq!(plain, extra);
}

#[test]
fn scenes_without_springs_or_without_unknowns_are_solved_too() {
    for matrix in ["dense", "sparse"] {
        for acceleration in ["none"].into_iter().chain(ACCELERATED) {
            let options = [("matrix", matrix), ("acceleration", acceleration)];
            // x = h² g n (n + 1)/2
            let falling: String = (0..60).map(|_| particle([0.0; 3], 2, false)).collect();
            let falling = falling + r#"<simplegravity fx="0" fy="-8"/>"#;
            let states = run(&scene(&falling, 0.25, 4, &options)).0;
            let expected = [0.0, -5.0].repeat(60);
            assert!(largest_difference(&states[4], &expected) < 1e-14, "{matrix}: {:?}", states[4]);
            let fixed = chain(2).replace(r#"fixed="0""#, r#"fixed="1""#);
            let states = run(&scene(&fixed, 0.25, 4, &options)).0;
            assert_eq!(states[0], states[4], "{matrix}");
        }
    }
}

#[test]
fn matrix_without_significant_digits_is_an_error() {
    for matrix in ["dense", "sparse"] {
        let elements = net(2, false).replace(r#"k="300""#, r#"k="1e30""#).replace(GRAVITY, "");
        match failure(&scene(&elements, 0.01, 1, &[("matrix", matrix)])) {
            FailureKind::Linear(_) => {}
            other => panic!("{other}"),
        }
    }
}
