//! Physics against closed forms, finite differences and conservation laws, never against earlier output.

use crate::support::shared::{bits, parse};
use crate::support::{largest, largest_difference};
use scene::schema::{
    Conserves, Dependence, ForceSchema, IntegratorOptions, IntegratorSchema, Potential, Stencil,
};
use scene::trace::State;
use scene::trace::TraceWriter;
use scene::trace::fosssim::FosssimWriter;
use scene::{ForceElement, Scene};
use simulator::force::{Coupling, ElementJacobians, ForceKind, JacobianSink, REGISTRY as FORCES};
use simulator::integrator::{BuildIntegrator, REGISTRY as INTEGRATORS, Step};
use simulator::simulation::{FailureKind, Simulation};
use simulator::solver::linear::LinearSolver;
use simulator::statistics::{ControlStatistics, Statistics};
use simulator::system::{BuildForce, System};
use simulator::vocabulary;

/// A scene of these elements, by this integrator; without what the integrator refuses, and iterated to
/// the end where it iterates.
fn scene(integrator: &str, dt: f64, duration: f64, elements: &str) -> Scene {
    let scene = parse(&format!(
        r#"<scene><duration time="{duration}"/><integrator type="implicit-euler" dt="{dt}"/>
        {elements}</scene>"#
    ));
    fitted(scene, integrator)
}

/// The scene under another integrator: springs without their damping, and then forces, are left out where
/// it refuses them.
fn fitted(mut scene: Scene, integrator: &str) -> Scene {
    let schema = vocabulary().integrator(integrator).unwrap();
    for force in &mut scene.forces {
        if force.schema.tag == "springforce" && (schema.refuses)(force).is_some() {
            force.parameters[2] = 0.0;
        }
    }
    scene.forces.retain(|force| (schema.refuses)(force).is_none());
    scene.integrator = schema;
    scene.integrator_options = IntegratorOptions::defaults(schema);
    match integrator {
        "projected-newton" => scene.integrator_options.set("tolerance", "1e-11").unwrap(),
        // Steps that are not divided.
        "dormand-prince" => scene.integrator_options.set("tolerance", "1e9").unwrap(),
        _ => {}
    }
    scene
}

/// All states of the scene: positions and velocities.
fn states(scene: &Scene) -> Vec<[Vec<f64>; 2]> {
    let mut simulation = Simulation::new(scene);
    let mut states = Vec::new();
    loop {
        let state = simulation.state();
        states.push([state.positions.to_vec(), state.velocities.to_vec()]);
        if !simulation.advance().unwrap() {
            return states;
        }
    }
}

fn statistics(scene: &Scene) -> Statistics {
    let mut simulation = Simulation::new(scene);
    while simulation.advance().unwrap() {}
    simulation.statistics().clone()
}

fn names() -> impl Iterator<Item = &'static str> {
    INTEGRATORS.iter().map(|kind| kind.schema.name)
}

fn uniform(random: &mut fastrand::Rng, (low, high): (f64, f64)) -> f64 {
    low + (high - low) * random.f64()
}

/// Four particles near the corners of a square, moving; every pair of them joined by an edge.
fn random_particles(random: &mut fastrand::Rng, dimensions: usize) -> String {
    let mut text = String::new();
    for corner in [(0.0, 0.0), (2.0, 0.0), (0.0, 2.0), (2.0, 2.0)] {
        let mut near = |place| uniform(random, (place - 0.5, place + 0.5));
        let (px, py, vx, vy) = (near(corner.0), near(corner.1), near(0.0), near(0.0));
        let (pz, vz) = (near(0.0), near(0.0));
        let mass = uniform(random, (0.5, 3.0));
        text +=
            &format!(r#"<particle m="{mass}" px="{px}" py="{py}" vx="{vx}" vy="{vy}" fixed="0""#);
        text += &if dimensions == 3 { format!(r#" pz="{pz}" vz="{vz}"/>"#) } else { "/>".into() };
    }
    for (i, j) in PAIRS {
        text += &format!(r#"<edge i="{i}" j="{j}"/>"#);
    }
    text
}

/// All pairs of four particles; some the wrong way round.
const PAIRS: [(usize, usize); 6] = [(0, 1), (2, 0), (0, 3), (1, 2), (3, 1), (2, 3)];

/// Elements of the force with random parameters; one for each pair where it acts on pairs.
fn random_elements(random: &mut fastrand::Rng, force: &ForceSchema, dimensions: usize) -> String {
    let mut text = String::new();
    for (edge, (i, j)) in PAIRS.into_iter().enumerate() {
        if force.stencil.is_field() && edge > 1 {
            break;
        }
        text += &format!("<{}", force.tag);
        // The particles of a larger stencil follow, in the order in which they come.
        let others = (0..4).filter(|other| ![i, j].contains(other));
        let particles: Vec<usize> = [i, j].into_iter().chain(others).collect();
        for (number, attribute) in force.stencil.attributes().iter().enumerate() {
            let value = if force.stencil == Stencil::Edge { edge } else { particles[number] };
            text += &format!(r#" {attribute}="{value}""#);
        }
        for parameter in force.parameters {
            if dimensions == 3 || !parameter.three_dimensional {
                let value = uniform(random, parameter.typical);
                text += &format!(r#" {}="{value}""#, parameter.name);
            }
        }
        text += "/>";
    }
    text
}

/// The forces that exist in so many dimensions.
fn there(dimensions: usize) -> impl Iterator<Item = &'static ForceKind> {
    let exist = move |kind: &&ForceKind| kind.schema.least_dimension.count() <= dimensions;
    FORCES.iter().copied().filter(exist)
}

/// Elements of every force that `keep` keeps.
fn random_forces(
    random: &mut fastrand::Rng,
    dimensions: usize,
    keep: impl Fn(&ForceSchema) -> bool,
) -> String {
    let schemas = there(dimensions).map(|kind| &kind.schema).filter(|schema| keep(schema));
    schemas.map(|schema| random_elements(random, schema, dimensions)).collect()
}

/// Positions and velocities at the start of the scene.
fn start(scene: &Scene) -> [Vec<f64>; 2] {
    let simulation = Simulation::new(scene);
    let state = simulation.state();
    [state.positions.to_vec(), state.velocities.to_vec()]
}

fn force_at<const D: usize>(system: &System<D>, x: &[f64], v: &[f64]) -> Vec<f64> {
    let mut force = vec![0.0; x.len()];
    system.force(x, v, 0.0, &mut force).unwrap();
    force
}

/// The derivatives of a vector by each number of `at`, column by column: central differences.
fn differences(at: &[f64], f: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    // Cube root of the rounding error: where both errors of the difference are about 1e-10.
    const H: f64 = 1e-5;
    let shifted = |place: usize, by: f64| {
        let mut at = at.to_vec();
        at[place] += by;
        f(&at)
    };
    let column = |place| {
        let (above, below) = (shifted(place, H), shifted(place, -H));
        above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * H)).collect()
    };
    (0..at.len()).map(column).collect()
}

/// Both Jacobians as full matrices, column by column.
struct Full {
    by_position: Vec<Vec<f64>>,
    by_velocity: Vec<Vec<f64>>,
}

impl Full {
    fn of<const D: usize>(system: &System<D>, x: &[f64], v: &[f64]) -> Self {
        let zeros = vec![vec![0.0; x.len()]; x.len()];
        let mut full = Self { by_position: zeros.clone(), by_velocity: zeros };
        system.jacobians(x, v, 0.0, &mut full).unwrap();
        full
    }
}

impl<const D: usize> JacobianSink<D> for Full {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        let Self { by_position, by_velocity } = self;
        for (matrix, blocks) in
            [(by_position, element.by_position), (by_velocity, element.by_velocity)]
        {
            element.spread(blocks, |row, column, block| {
                for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                    matrix[column * D + j][row * D + i] += block[(i, j)];
                }
            });
        }
    }
}

/// For every registered force, the scene of four random particles on which it acts alone.
fn for_each_force(dimensions: usize, mut check: impl FnMut(&ForceSchema, &Scene)) {
    let mut random = fastrand::Rng::with_seed(2026);
    for kind in there(dimensions) {
        for _ in 0..5 {
            let elements = random_particles(&mut random, dimensions)
                + &random_elements(&mut random, &kind.schema, dimensions);
            let scene = scene("explicit-euler", 1.0, 1.0, &elements);
            assert_eq!(scene.dimension.count(), dimensions);
            check(&kind.schema, &scene);
        }
    }
}

fn jacobians_are_derivatives<const D: usize>()
where
    ForceKind: BuildForce<D>,
{
    for_each_force(D, |schema, scene| {
        let (system, [x, v]) = (System::<D>::new(scene), start(scene));
        assert!(largest(force_at(&system, &x, &v)) > 1e-3, "{} does nothing", schema.tag);
        let full = Full::of(&system, &x, &v);
        let by_position = differences(&x, |x| force_at(&system, x, &v)).concat();
        let by_velocity = differences(&v, |v| force_at(&system, &x, v)).concat();
        let found = [full.by_position.concat(), full.by_velocity.concat()];
        for (found, expected) in found.iter().zip([by_position, by_velocity]) {
            let scale = largest(expected.iter().copied()).max(1.0);
            let error = largest_difference(found, &expected) / scale;
            assert!(error < 1e-7, "{} in {D} dimensions: {error:e}", schema.tag);
        }
    });
}

#[test]
fn jacobians_are_derivatives_of_the_force() {
    jacobians_are_derivatives::<2>();
    jacobians_are_derivatives::<3>();
}

fn force_is_minus_gradient<const D: usize>()
where
    ForceKind: BuildForce<D>,
{
    for_each_force(D, |schema, scene| {
        let (system, [x, v]) = (System::<D>::new(scene), start(scene));
        // At rest, so that the damping of a spring has no part in the force.
        let rest = vec![0.0; v.len()];
        if !has_energy(schema) {
            return;
        }
        let energy = |x: &[f64]| vec![system.potential_energy(x, &rest, 0.0)];
        let expected: Vec<f64> =
            differences(&x, energy).concat().iter().map(|slope| -slope).collect();
        let found = force_at(&system, &x, &rest);
        let scale = largest(expected.iter().copied());
        assert!(scale > 1e-3, "{} has no gradient", schema.tag);
        let error = largest_difference(&found, &expected) / scale;
        assert!(error < 1e-7, "{} in {D} dimensions: {error:e}", schema.tag);
    });
}

#[test]
fn the_force_at_rest_is_minus_the_gradient_of_the_energy() {
    force_is_minus_gradient::<2>();
    force_is_minus_gradient::<3>();
}

#[test]
fn energies_and_jacobians_match_the_schema() {
    // Without this, two Jacobians of zeros would agree with each other above.
    for_each_force(2, |schema, scene| {
        let (system, [x, v]) = (System::<2>::new(scene), start(scene));
        let full = Full::of(&system, &x, &v);
        let is_there = |matrix: Vec<Vec<f64>>| largest(matrix.concat()) > 1e-3;
        let energy = system.potential_energy(&x, &v, 0.0) != 0.0;
        let found = [energy, is_there(full.by_position), is_there(full.by_velocity)];
        let depends = |on: fn(&Dependence) -> bool| schema.parts.iter().any(|p| on(&p.depends_on));
        let declared = [has_energy(schema), depends(|on| on.position), depends(|on| on.velocity)];
        assert_eq!(found, declared, "{}", schema.tag);
    });
}

fn has_energy(schema: &ForceSchema) -> bool {
    schema.parts.iter().any(|part| part.derives_from == Potential::Energy)
}

fn couplings_cover_the_jacobians<const D: usize>()
where
    ForceKind: BuildForce<D>,
{
    for_each_force(D, |schema, scene| {
        let (system, [x, v]) = (System::<D>::new(scene), start(scene));
        let n = system.n_particles();
        let (mut coupled, mut on_diagonal, mut all_symmetric) =
            (vec![false; n * n], vec![false; n], true);
        system.couplings(&mut |coupling| match coupling {
            Coupling::Diagonal(particle) => on_diagonal[particle] = true,
            Coupling::Stencil { particles, symmetric } => {
                for a in &particles {
                    particles.iter().for_each(|b| coupled[a * n + b] = true);
                }
                all_symmetric &= symmetric;
            }
        });
        let full = Full::of(&system, &x, &v);
        for matrix in [full.by_position, full.by_velocity] {
            for (row, column) in (0..n * D).flat_map(|i| (0..n * D).map(move |j| (i, j))) {
                let (a, b) = (row / D, column / D);
                let allowed = coupled[a * n + b] || row == column && on_diagonal[a];
                let entry = matrix[column][row];
                assert!(allowed || entry == 0.0, "{}: ({row}, {column})", schema.tag);
                let mirrored = matrix[row][column];
                let near = (entry - mirrored).abs() <= 1e-12 * entry.abs();
                assert!(!all_symmetric || near, "{}: {entry} and {mirrored}", schema.tag);
            }
        }
    });
}

#[test]
fn couplings_cover_nonzero_jacobian_blocks_and_symmetry() {
    couplings_cover_the_jacobians::<2>();
    couplings_cover_the_jacobians::<3>();
}

/// Two particles five apart: m = 2 at the origin with v = (1, 0), m = 4 at (3, 4) with v = (0, 2).
const FIVE_APART: &str = r#"<particle m="2" px="0" py="0" vx="1" vy="0" fixed="0"/>
    <particle m="4" px="3" py="4" vx="0" vy="2" fixed="0"/><edge i="0" j="1"/>"#;

#[test]
fn forces_equal_hand_computed_values() {
    // n = (0.6, 0.8) from the first to the second; they part at n·(v₁ − v₀) = -0.6 + 1.6 = 1 a second.
    let cases = [
        // k (r − l0) + b = 6·2 + 0.5 along n
        (r#"<springforce edge="0" k="6" l0="3" b="0.5"/>"#, [7.5, 10.0, -7.5, -10.0]),
        // 6·(5 − 7) = -12: it pushes
        (r#"<springforce edge="0" k="6" l0="7"/>"#, [-7.2, -9.6, 7.2, 9.6]),
        (r#"<springforce edge="0" k="6" l0="0"/>"#, [18.0, 24.0, -18.0, -24.0]),
        // G m₀ m₁/r² = 10·8/25
        (r#"<gravitationalforce i="0" j="1" G="10"/>"#, [1.92, 2.56, -1.92, -2.56]),
        (r#"<simplegravity fx="0.5" fy="-10"/>"#, [1.0, -20.0, 2.0, -40.0]),
        (r#"<constantforce fx="0.5" fy="-10"/>"#, [0.5, -10.0, 0.5, -10.0]),
        (r#"<dragdamping b="0.5"/>"#, [-0.5, 0.0, 0.0, -1.0]),
        // F₁ = 50/25 (10 (-0.8, 0.6) − (-1, 2)), the same whichever is named first
        (r#"<vortexforce i="0" j="1" kbs="10" kvc="50"/>"#, [14.0, -8.0, -14.0, 8.0]),
        (r#"<vortexforce i="1" j="0" kbs="10" kvc="50"/>"#, [14.0, -8.0, -14.0, 8.0]),
        (r#"<dragdamping b="0.5"/><dragdamping b="1"/>"#, [-1.5, 0.0, 0.0, -3.0]),
        (r#"<constantforce fx="1" fy="2"/><dragdamping b="1"/>"#, [0.0, 2.0, 1.0, 0.0]),
    ];
    for (element, expected) in cases {
        let scene = scene("explicit-euler", 1.0, 1.0, &format!("{FIVE_APART}{element}"));
        let [x, v] = start(&scene);
        let found = force_at(&System::<2>::new(&scene), &x, &v);
        assert!(largest_difference(&found, &expected) < 1e-13, "{element}: {found:?}");
    }
}

#[test]
fn vortex_in_3d_rotates_about_z() {
    // r = 7: 49/7² (7 R n − (v₁ − v₀)), with 7 R n = (-3, 2, 6) where 7 n = (2, 3, 6).
    let scene = scene(
        "explicit-euler",
        1.0,
        1.0,
        r#"<particle m="2" px="0" py="0" pz="0" vx="0" vy="0" vz="0" fixed="0"/>
           <particle m="4" px="2" py="3" pz="6" vx="1" vy="-1" vz="2" fixed="0"/>
           <vortexforce i="0" j="1" kbs="7" kvc="49"/>"#,
    );
    let [x, v] = start(&scene);
    let found = force_at(&System::<3>::new(&scene), &x, &v);
    assert!(largest_difference(&found, &[4.0, -3.0, -4.0, -4.0, 3.0, 4.0]) < 1e-13, "{found:?}");
}

/// Forces between particles: what one feels, the other feels reversed.
fn internal(schema: &ForceSchema) -> bool {
    schema.conserves >= Conserves::Momentum
}

/// `Σ m v`, and `Σ m |v|` to compare it with.
fn momentum(scene: &Scene, v: &[f64]) -> (Vec<f64>, f64) {
    let d = scene.dimension.count();
    let (mut sum, mut scale) = (vec![0.0; d], 0.0);
    for (particle, v) in scene.particles.iter().zip(v.chunks(d)) {
        sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += particle.mass * v);
        scale += particle.mass * largest(v.iter().copied());
    }
    (sum, scale)
}

#[test]
fn forces_between_particles_conserve_momentum_under_every_integrator() {
    for (name, dimensions) in names().flat_map(|name| [(name, 2), (name, 3)]) {
        let mut random = fastrand::Rng::with_seed(11);
        let elements = random_particles(&mut random, dimensions)
            + &random_forces(&mut random, dimensions, internal);
        let scene = scene(name, 0.002, 0.1, &elements);
        let states = states(&scene);
        let (initial, _) = momentum(&scene, &states[0][1]);
        assert!(
            largest(initial.clone()) > 0.1
                && largest_difference(&states[0][1], &states[9][1]) > 0.1
        );
        for (step, [_, v]) in states.iter().enumerate() {
            let (now, scale) = momentum(&scene, v);
            let error = largest_difference(&now, &initial) / scale;
            assert!(error < 1e-12, "{name} in {dimensions} dimensions, step {step}: {error:e}");
        }
    }
}

/// Under forces that have no torque.
#[test]
fn only_symplectic_methods_conserve_angular_momentum() {
    let conserving = ["symplectic-euler", "velocity-verlet", "implicit-midpoint"];
    let others = ["explicit-euler", "linearized-implicit-euler", "implicit-euler"];
    let central = |schema: &ForceSchema| schema.conserves >= Conserves::AngularMomentum;
    let runs = [2, 3]
        .map(|dimensions| conserving.iter().chain(&others).map(move |name| (*name, dimensions)));
    for (name, dimensions) in runs.into_iter().flatten() {
        let mut random = fastrand::Rng::with_seed(12);
        let elements = random_particles(&mut random, dimensions)
            + &random_forces(&mut random, dimensions, central);
        let scene = scene(name, 0.005, 0.5, &elements);
        let angular = |[x, v]: &[Vec<f64>; 2]| -> (Vec<f64>, f64) {
            let planes = if dimensions == 2 { vec![(0, 1)] } else { vec![(0, 1), (1, 2), (2, 0)] };
            let terms = |(a, b): (usize, usize)| {
                let of_particle = move |(i, particle): (usize, &scene::Particle)| {
                    let (x, v) = (&x[i * dimensions..], &v[i * dimensions..]);
                    [particle.mass * x[a] * v[b], -particle.mass * x[b] * v[a]]
                };
                scene.particles.iter().enumerate().flat_map(of_particle).collect::<Vec<_>>()
            };
            let scale = planes.iter().flat_map(|plane| terms(*plane)).map(f64::abs).sum();
            (planes.into_iter().map(|plane| terms(plane).iter().sum()).collect(), scale)
        };
        let states = states(&scene);
        let (initial, _) = angular(&states[0]);
        assert!(largest(initial.clone()) > 0.1);
        let errors = states.iter().map(|state| {
            let (now, scale) = angular(state);
            largest_difference(&now, &initial) / scale
        });
        let error = largest(errors.collect::<Vec<_>>());
        let expected = if conserving.contains(&name) { 0.0..1e-13 } else { 1e-5..f64::INFINITY };
        assert!(expected.contains(&error), "{name} in {dimensions} dimensions: {error:e}");
    }
}

/// `m x'' = −k x − b x'` in the plane, on a spring without rest length to a fixed particle at 0, and drag.
const OSCILLATOR: &str = r#"<particle m="2" px="0" py="0" vx="0" vy="0" fixed="1"/>
    <particle m="2" px="1" py="-0.5" vx="0.25" vy="2" fixed="0"/>
    <edge i="0" j="1"/><springforce edge="0" k="6" l0="0"/><dragdamping b="1.5"/>"#;

/// Its exact solution at `t`: one coordinate that starts at `x` with velocity `v`.
fn oscillation(x: f64, v: f64, t: f64) -> [f64; 2] {
    let (k, b, m) = (6.0_f64, 1.5, 2.0);
    let decay = b / (2.0 * m);
    let frequency = (k / m - decay * decay).sqrt();
    let (sin, cos) = (frequency * t).sin_cos();
    let sine = (v + decay * x) / frequency;
    let envelope = (-decay * t).exp();
    let position = envelope * (x * cos + sine * sin);
    [position, envelope * frequency * (sine * cos - x * sin) - decay * position]
}

#[test]
fn newtons_method_solves_a_linear_problem_in_one_iteration() {
    // And takes a second one to see that it has.
    let statistics = statistics(&scene("implicit-euler", 0.125, 5.0, OSCILLATOR));
    assert_eq!((statistics.newton_iterations, statistics.max_newton_iterations), (80, 2));
}

#[test]
fn implicit_methods_differ_on_a_nonlinear_problem() {
    let elements = format!(r#"{FIVE_APART}<gravitationalforce i="0" j="1" G="20"/>"#);
    let [linearized, implicit] = ["linearized-implicit-euler", "implicit-euler"]
        .map(|name| states(&scene(name, 0.125, 0.125, &elements)).concat().concat());
    assert!(largest_difference(&linearized, &implicit) > 1e-6);
}

#[test]
fn steps_of_the_oscillator_follow_their_closed_recurrences() {
    let (h, b, m) = (0.125, 1.5, 2.0);
    // On the spring, and by drag alone.
    for (name, k) in names().flat_map(|name| [(name, 6.0), (name, 0.0)]) {
        let step = |[earlier_x, earlier_v]: [f64; 2], [x, v]: [f64; 2], is_first: bool| match name {
            "explicit-euler" => [x + h * v, v + h / m * (-k * x - b * v)],
            "symplectic-euler" => {
                let v = v + h / m * (-k * x - b * v);
                [x + h * v, v]
            }
            // m (v' − v) = h (−k (x + h v') − b v'), for all.
            "linearized-implicit-euler" | "implicit-euler" | "projected-newton" => {
                let v = (m * v - h * k * x) / (m + h * b + h * h * k);
                [x + h * v, v]
            }
            // The spring at the end of the step, drag at its start.
            "fast-mass-spring" => {
                let v = ((m - h * b) * v - h * k * x) / (m + h * h * k);
                [x + h * v, v]
            }
            // Drag by the velocity of a step of explicit Euler.
            "velocity-verlet" => {
                let a = |x: f64, v: f64| (-k * x - b * v) / m;
                let (start, moved) = (a(x, v), x + h * v + h * h / 2.0 * a(x, v));
                [moved, v + h / 2.0 * (start + a(moved, v + h * start))]
            }
            // The Taylor polynomial of the motion of degree 4, or 5 with a sixth term of 1/600.
            "runge-kutta-4" | "dormand-prince" => {
                let (mut sum, mut term) = ([x, v], [x, v]);
                let divisors = [1.0, 2.0, 3.0, 4.0, 5.0, 5.0];
                for divisor in &divisors[..if name == "runge-kutta-4" { 4 } else { 6 }] {
                    let [x, v] = term;
                    term = [v, (-k * x - b * v) / m].map(|rate| h / divisor * rate);
                    sum = [sum[0] + term[0], sum[1] + term[1]];
                }
                sum
            }
            // 2 m (v½ − v) = h (−k (x + h/2 v½) − b v½).
            "implicit-midpoint" => {
                let middle = (2.0 * m * v - h * k * x) / (2.0 * m + h * b + h * h * k / 2.0);
                [x + h * middle, 2.0 * middle - v]
            }
            // 3 m (v' − 4/3 v + 1/3 v₋) = 2 h (−k x' − b v'), and x' likewise; the first step is implicit Euler's.
            "bdf2" if is_first => {
                let v = (m * v - h * k * x) / (m + h * b + h * h * k);
                [x + h * v, v]
            }
            "bdf2" => {
                let [x, v] = [4.0 * x - earlier_x, 4.0 * v - earlier_v];
                let end =
                    (3.0 * m * v - 2.0 * h * k * x) / (9.0 * m + 6.0 * h * b + 4.0 * h * h * k);
                [(x + 2.0 * h * end) / 3.0, end]
            }
            _ => panic!("{name} has no recurrence here: add it"),
        };
        let mut expected = [[1.0, 0.25], [-0.5, 2.0]];
        let mut earlier = expected;
        let elements = OSCILLATOR.replace(r#"k="6""#, &format!(r#"k="{k}""#));
        for (i, [x, v]) in states(&scene(name, h, 5.0, &elements)).into_iter().enumerate() {
            let found = [[x[2], v[2]], [x[3], v[3]]];
            let error = largest_difference(found.as_flattened(), expected.as_flattened());
            assert!(error < 1e-13, "{name}, k = {k}, step {i}: {error:e}");
            let next = [0, 1].map(|axis| step(earlier[axis], expected[axis], i == 0));
            earlier = std::mem::replace(&mut expected, next);
        }
    }
}

#[test]
fn free_fall_is_exact() {
    // After n steps v = n h g, and x = h² g n (n ± 1)/2: minus where the step starts with the old velocity. Methods of
    // higher order are exact: x = h² g n²/2. The first step of BDF2 is off by e₁ = h² g/2, and eₙ = (4 eₙ₋₁ − eₙ₋₂)/3 later:
    // eₙ = 3/4 (1 − 3⁻ⁿ) h² g.
    let elements = r#"<particle m="3" px="0" py="0" vx="0" vy="0" fixed="0"/><simplegravity fx="0.5" fy="-10"/>"#;
    for kind in INTEGRATORS {
        let IntegratorSchema { name, order, .. } = kind.schema;
        let (steps, h) = (64.0, 0.125);
        let states = states(&scene(name, h, steps * h, elements));
        let side = match name {
            "bdf2" => 1.5 / steps,
            _ if order.without_velocity > 1 => 0.0,
            "explicit-euler" => -1.0,
            _ => 1.0,
        };
        let distance = h * h * steps * (steps + side) / 2.0;
        let [x, v] = states.last().unwrap();
        // Implicit methods divide m h g by m.
        assert!(
            largest_difference(v, &[0.5 * steps * h, -10.0 * steps * h]) < 1e-12,
            "{name}: {v:?}"
        );
        assert!(
            largest_difference(x, &[0.5 * distance, -10.0 * distance]) < 1e-11,
            "{name}: {x:?}"
        );
    }
}

#[test]
fn circular_orbit_energy_follows_its_integrator() {
    // A particle of mass 1 around a fixed one of mass 4 at distance 1, G = 1: v = 2, E = −2, once in π.
    // An explicit step adds about h²/2 (a² + v²·4) = 16 h² to the energy, an implicit one takes it.
    let elements = r#"<particle m="4" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="1" px="1" py="0" vx="0" vy="2" fixed="0"/><gravitationalforce i="0" j="1" G="1"/>"#;
    for name in names() {
        let mut simulation = Simulation::new(&scene(name, 0.005, 3.0, elements));
        let energy = |simulation: &Simulation| {
            let energies = simulation.energies().unwrap();
            energies.kinetic + energies.potential
        };
        assert_eq!(energy(&simulation), -2.0);
        while simulation.advance().unwrap() {}
        let end = energy(&simulation);
        match name {
            "explicit-euler" => assert!(end > -1.9, "{name}: {end}"),
            // Gravitation is explicit to the local-global method: its step is symplectic Euler's.
            "symplectic-euler" | "fast-mass-spring" | "velocity-verlet" => {
                assert!((end + 2.0).abs() < 1e-3, "{name}: {end}");
            }
            // Their errors are far smaller than that of the first order.
            "runge-kutta-4" | "implicit-midpoint" | "dormand-prince" => {
                assert!((end + 2.0).abs() < 1e-7, "{name}: {end}");
            }
            // It damps, but by a higher power of the step.
            "bdf2" => assert!((-2.001..-2.0001).contains(&end), "{name}: {end}"),
            _ => assert!(end < -2.1, "{name}: {end}"),
        }
    }
}

/// Six random triangles of these on four particles contradict each other: steps of 0.01 are too long for projected Newton's
/// linear systems. `elastic.rs` runs consistent ones.
const CONTRADICTORY: [&str; 3] = ["stvktriangle", "corotatedtriangle", "neohookeantriangle"];

/// Random particles under all forces at once, the second of them fixed and moving, but for those that depend on time: these
/// are evaluated at none.
fn everything(name: &str, dt: f64, dimensions: usize, seed: u64) -> Scene {
    let mut random = fastrand::Rng::with_seed(seed);
    let elements = random_particles(&mut random, dimensions)
        + &random_forces(&mut random, dimensions, |schema| {
            !schema.depends_on().time && !CONTRADICTORY.contains(&schema.tag)
        });
    let mut scene = scene(name, dt, 20.0 * dt, &elements);
    scene.particles[1].fixed = true;
    scene
}

#[test]
fn a_step_of_implicit_euler_solves_its_equation() {
    for seed in 0..5 {
        let scene = everything("implicit-euler", 0.01, 2, seed);
        let (h, system) = (scene.time_step, System::<2>::new(&scene));
        for window in states(&scene).windows(2) {
            let [[x, v], [x1, v1]] = window else { panic!() };
            // m (v' − v) = h F(x', v')
            let force = force_at(&system, x1, v1);
            let mut change = Vec::new();
            for (i, (new, old)) in v1.iter().zip(v).enumerate() {
                assert_eq!(x1[i], x[i] + h * new);
                change.push(scene.particles[i / 2].mass * (new - old));
            }
            let impulse: Vec<f64> = force.iter().map(|force| h * force).collect();
            let error = largest_difference(&change, &impulse) / largest(impulse);
            assert!(error < 1e-9, "seed {seed}: {error:e}");
        }
    }
}

#[test]
fn a_step_of_linearized_implicit_euler_solves_equation_2_at_the_moved_positions() {
    for seed in 0..5 {
        let scene = everything("linearized-implicit-euler", 0.01, 2, seed);
        let (h, system) = (scene.time_step, System::<2>::new(&scene));
        for window in states(&scene).windows(2) {
            let [[x, v], [_, v1]] = window else { panic!() };
            // (M − h² ∂F/∂x − h ∂F/∂v) δ = h F at (x + h v, v), the derivatives by differences.
            let moved: Vec<f64> = x.iter().zip(v).map(|(x, v)| x + h * v).collect();
            let by_position = differences(&moved, |x| force_at(&system, x, v));
            let by_velocity = differences(v, |v| force_at(&system, &moved, v));
            let delta: Vec<f64> = v1.iter().zip(v).map(|(new, old)| new - old).collect();
            let mut left: Vec<f64> = delta
                .iter()
                .enumerate()
                .map(|(i, delta)| scene.particles[i / 2].mass * delta)
                .collect();
            for (j, delta) in delta.iter().enumerate() {
                for (i, left) in left.iter_mut().enumerate() {
                    *left -= h * (h * by_position[j][i] + by_velocity[j][i]) * delta;
                }
            }
            let right: Vec<f64> =
                force_at(&system, &moved, v).iter().map(|force| h * force).collect();
            let error = largest_difference(&left, &right) / largest(right);
            assert!(error < 1e-7, "seed {seed}: {error:e}");
        }
    }
}

#[test]
fn fixed_particle_ignores_forces_and_keeps_its_velocity() {
    for (name, dimensions) in names().flat_map(|name| [(name, 2), (name, 3)]) {
        let scene = everything(name, 0.01, dimensions, 4);
        let states = states(&scene);
        let fixed = dimensions..2 * dimensions;
        let mut expected = states[0][0][fixed.clone()].to_vec();
        let velocity = states[0][1][fixed.clone()].to_vec();
        assert!(largest(velocity.clone()) > 0.01);
        for [x, v] in &states {
            assert_eq!(bits(&v[fixed.clone()]), bits(&velocity), "{name}");
            assert_eq!(bits(&x[fixed.clone()]), bits(&expected), "{name}");
            expected.iter_mut().zip(&velocity).for_each(|(x, v)| *x += 0.01 * v);
        }
        // The others do feel it: without it, they would move otherwise.
        let mut released = scene.clone();
        released.particles[1].fixed = false;
        assert!(
            largest_difference(&self::states(&released)[20][0][..1], &states[20][0][..1]) > 1e-6
        );
    }
}

/// The scene with z = 0 everywhere, in three dimensions.
fn embedded(scene: &Scene) -> Scene {
    Scene { dimension: scene::Dimension::Three, ..scene.clone() }
}

/// The largest difference between the scene in the plane and in space; 0 only if all bits are the same.
fn difference_in_space(flat: &Scene) -> f64 {
    let mut flat = flat.clone();
    // In space, its angle has no sign.
    flat.forces.retain(|force| force.schema.tag != "elasticbodybendingforce");
    let mut worst = 0.0;
    for (flat_state, state) in states(&flat).iter().zip(states(&embedded(&flat))) {
        for (flat_values, values) in flat_state.iter().zip(state) {
            assert!(values.chunks(3).all(|vector| vector[2] == 0.0), "it left the plane");
            let in_plane: Vec<f64> = values.chunks(3).flat_map(|v| [v[0], v[1]]).collect();
            if bits(&in_plane) != bits(flat_values) {
                worst =
                    largest([worst, largest_difference(&in_plane, flat_values), f64::MIN_POSITIVE]);
            }
        }
    }
    worst
}

#[test]
fn planar_motion_in_3d_equals_2d_bit_for_bit() {
    for (name, seed) in names().flat_map(|name| (0..10).map(move |seed| (name, seed))) {
        let mut random = fastrand::Rng::with_seed(seed);
        let springs = random_particles(&mut random, 2)
            + &random_forces(&mut random, 2, |schema| schema.tag == "springforce");
        let springs = scene(name, 0.01, 0.2, &springs);
        let mut pair = everything(name, 0.005, 2, seed);
        pair.particles[2].fixed = true;
        let mut all = everything(name, 0.005, 2, seed);
        all.particles[1].fixed = false;
        for (what, scene) in [("springs", springs), ("pair", pair), ("all", all)] {
            let is_projected = name == "projected-newton";
            let is_large = |force: &ForceElement| force.schema.stencil.size() > 2;
            let difference = difference_in_space(&scene);
            if is_projected && scene.forces.iter().any(is_large) {
                // Projected Hessians of three particles are larger matrices in space: their eigenvalues are rounded otherwise.
                assert!(difference <= 1e-15, "{what} by {name}, seed {seed}: {difference:e}");
                let mut pairs = scene.clone();
                pairs.forces.retain(|force| !is_large(force));
                assert_eq!(difference_in_space(&pairs), 0.0, "pairs of {what}, seed {seed}");
            } else {
                assert_eq!(difference, 0.0, "{what} by {name}, seed {seed}");
            }
        }
    }
}

#[test]
fn positive_angles_bend_in_3d_as_in_2d() {
    let particles = [(0.0, 0.0), (0.9, 0.1), (1.3, 0.8), (0.9, 1.4)].map(|(x, y)| {
        format!(r#"<particle m="0.7" px="{x}" py="{y}" vx="{y}" vy="-0.3" fixed="0"/>"#)
    });
    let hinges = [(0, 1, 2, 0.8, 0.9), (1, 2, 3, 0.6, 0.7)].map(|(i, j, k, alpha, theta0)| {
        format!(
            r#"<elasticbodybendingforce i1="{i}" i2="{j}" i3="{k}" alpha="{alpha}" theta0="{theta0}"/>"#
        )
    });
    for name in names() {
        let flat = scene(name, 0.01, 0.3, &(particles.concat() + &hinges.concat()));
        let in_space = states(&embedded(&flat));
        for (flat_state, state) in states(&flat).iter().zip(in_space) {
            for (flat_values, values) in flat_state.iter().zip(state) {
                let in_plane: Vec<f64> = values.chunks(3).flat_map(|v| [v[0], v[1]]).collect();
                let difference = largest_difference(&in_plane, flat_values);
                assert!(difference < 1e-11, "{name}: {difference:e}");
            }
        }
    }
}

#[test]
fn coupled_motion_in_3d_equals_2d_up_to_rounding() {
    // Their 6 rows are solved by complete pivoting in the plane, their 9 rows in space are not.
    for (name, seed) in names().flat_map(|name| (0..10).map(move |seed| (name, seed))) {
        let difference = difference_in_space(&everything(name, 0.005, 2, seed));
        assert!(difference < 1e-9, "{name}, seed {seed}: {difference:e}");
    }
}

#[test]
fn explicit_methods_evaluate_once_a_step_and_never_solve() {
    for name in ["explicit-euler", "symplectic-euler"] {
        let expected = Statistics { steps: 20, force_evaluations: 20, ..Statistics::default() };
        assert_eq!(statistics(&everything(name, 0.01, 2, 1)), expected, "{name}");
    }
}

#[test]
fn one_force_evaluation_per_stage() {
    let evaluations = |name, elements: &str| {
        let statistics = statistics(&scene(name, 0.01, 0.2, elements));
        assert_eq!((statistics.steps, statistics.assemblies), (20, 0), "{name}");
        statistics.force_evaluations
    };
    assert_eq!(evaluations("runge-kutta-4", OSCILLATOR), 80);
    assert_eq!(evaluations("velocity-verlet", OSCILLATOR), 40);
    // Without drag, the force at the end of a step is that at the start of the next one.
    let undamped = OSCILLATOR.replace(r#"<dragdamping b="1.5"/>"#, "");
    assert_eq!(evaluations("velocity-verlet", &undamped), 21);
}

#[test]
fn error_control_divides_steps_by_tolerance() {
    let run = |tolerance: &str, dt: f64| {
        let mut scene = scene("dormand-prince", dt, 3.0, OSCILLATOR);
        scene.integrator_options.set("tolerance", tolerance).unwrap();
        let [x, v] = states(&scene).pop().unwrap();
        let [[x0, v0], [x1, v1]] = [oscillation(1.0, 0.25, 3.0), oscillation(-0.5, 2.0, 3.0)];
        let error = largest_difference(&[x[2], x[3], v[2], v[3]], &[x0, x1, v0, v1]);
        (error, statistics(&scene))
    };
    for (tolerance, bound) in [("1e-4", 1e-3), ("1e-7", 1e-6), ("1e-10", 1e-9)] {
        let (error, statistics) = run(tolerance, 1.5);
        let control = statistics.control;
        assert!(error < bound && error > 1e-3 * bound, "{tolerance}: {error:e}");
        assert!(control.max_taken <= control.taken && control.rejected >= 2, "{control:?}");
        assert_eq!(statistics.steps, 2);
        let trials = control.taken + control.rejected;
        assert_eq!(statistics.force_evaluations, 6 * trials + 2);
    }
    let [rough, fine] = ["1e-4", "1e-10"].map(|tolerance| run(tolerance, 1.5).1.control.taken);
    assert!(fine > 8 * rough, "{rough} and {fine} steps");
    // Every step meets this one.
    let (_, statistics) = run("1e9", 0.25);
    let expected = ControlStatistics { taken: 12, max_taken: 1, rejected: 0 };
    assert_eq!(statistics.control, expected);
}

#[test]
fn endless_error_control_is_an_error() {
    let stiff = OSCILLATOR.replace(r#"k="6""#, r#"k="1e18""#);
    let mut simulation = Simulation::new(&parse(&format!(
        r#"<scene><duration time="1"/><integrator type="dormand-prince" dt="1"/>{stiff}</scene>"#
    )));
    let error = simulation.advance().unwrap_err();
    assert!(matches!(error.kind, FailureKind::ErrorControl { trials: 10_000, .. }), "{error}");
}

#[test]
fn a_scene_without_coupling_is_solved_by_division() {
    let mut random = fastrand::Rng::with_seed(1);
    // Wind couples the coordinates of each particle.
    let is_uncoupled = |schema: &ForceSchema| !internal(schema) && schema.tag != "windforce";
    let forces = random_forces(&mut random, 2, is_uncoupled);
    let elements = random_particles(&mut random, 2) + &forces;
    for name in ["linearized-implicit-euler", "implicit-euler"] {
        let statistics = statistics(&scene(name, 0.01, 0.1, &elements));
        assert_eq!(statistics.linear_solver, "diagonal of 8", "{name}");
        assert_eq!(statistics.linear.factorisations, 0, "{name}");
        assert!(statistics.linear.solves >= 10, "{name}");
    }
}

#[test]
fn separate_springs_are_separate_small_systems() {
    let mut elements = String::new();
    for spring in 0..14 {
        let y = f64::from(spring);
        elements += &format!(
            r#"<particle m="1" px="0" py="{y}" vx="0" vy="0.5" fixed="0"/>
            <particle m="2" px="1" py="{y}" vx="1" vy="0" fixed="0"/>
            <edge i="{}" j="{}"/><springforce edge="{spring}" k="5" l0="0.5" b="0.25"/>"#,
            2 * spring,
            2 * spring + 1
        );
    }
    let statistics = statistics(&scene("linearized-implicit", 0.01, 0.1, &elements));
    assert_eq!(statistics.linear_solver, "14 of dense complete-pivoting LU 4 × 4");
    assert_eq!((statistics.linear.solves, statistics.linear.factorisations), (10, 140));
}

#[test]
fn spring_to_a_fixed_particle_couples_only_its_free_end() {
    let elements = r#"<particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="1" px="1" py="0" vx="0" vy="1" fixed="0"/>
        <particle m="1" px="-1" py="0" vx="0" vy="1" fixed="0"/>
        <edge i="0" j="1"/><edge i="0" j="2"/>
        <springforce edge="0" k="5" l0="0.5"/><springforce edge="1" k="5" l0="0.5"/>"#;
    let statistics = statistics(&scene("implicit", 0.01, 0.1, elements));
    assert_eq!(statistics.linear_solver, "2 of dense complete-pivoting LU 2 × 2");
}

#[test]
fn momentum_is_conserved_under_dominant_stiffness() {
    for (stiffness, damping) in [("1e6", "0"), ("1e9", "0"), ("1e12", "0"), ("1e12", "1e8")] {
        let mut elements = String::new();
        for (i, place) in [
            r#"px="0" py="0.1""#,
            r#"px="1" py="0""#,
            r#"px="1.9" py="0.5""#,
            r#"px="2.5" py="1.2""#,
        ]
        .iter()
        .enumerate()
        {
            elements += &format!(r#"<particle m="1" {place} vx="0.75" vy="{i}" fixed="0"/>"#);
        }
        for i in 0..3 {
            elements += &format!(
                r#"<edge i="{i}" j="{}"/><springforce edge="{i}" k="{stiffness}" l0="1" b="{damping}"/>"#,
                i + 1
            );
        }
        let end = states(&scene("linearized-implicit-euler", 0.01, 0.02, &elements)).pop().unwrap();
        let momentum: f64 = end[1].iter().step_by(2).sum();
        // The forces are rounded: h k times a stretch of about 0.1, to four parts in 2⁵².
        let rounding = 4.0 * f64::EPSILON * 0.01 * stiffness.parse::<f64>().unwrap() * 0.1;
        let error = (momentum - 3.0).abs();
        assert!(error < rounding + 1e-13, "stiffness {stiffness}: {momentum}");
    }
}

#[test]
fn stiffness_beyond_precision_is_an_error() {
    let elements = r#"<particle m="1" px="0" py="0.1" vx="1" vy="0" fixed="0"/>
        <particle m="1" px="1" py="0.2" vx="0" vy="1" fixed="0"/>
        <particle m="1" px="1.8" py="0.9" vx="0" vy="0" fixed="0"/>
        <edge i="0" j="1"/><springforce edge="0" k="1e24" l0="0.5"/>
        <edge i="1" j="2"/><springforce edge="1" k="1e24" l0="0.5"/>"#;
    let mut simulation = Simulation::new(&scene("linearized-implicit-euler", 0.01, 0.02, elements));
    let error = loop {
        match simulation.advance() {
            Ok(true) => {}
            Ok(false) => panic!("it went to its end with momentum {:?}", simulation.energies()),
            Err(error) => break error,
        }
    };
    assert!(matches!(error.kind, FailureKind::Linear(_)), "{error}");
}

/// A chain of `n` links that hangs between two fixed ends, with springs of this damping.
fn chain(n: usize, damping: f64, integrator: &str, steps: u32) -> Scene {
    let mut elements = String::from(r#"<simplegravity fx="0.4" fy="-2"/>"#);
    for i in 0..=n {
        let (sag, fixed) = ((i * (n - i)) as f64 * 0.2 / n as f64, u8::from(i == 0 || i == n));
        elements += &format!(
            r#"<particle m="0.{}" px="{i}" py="-{sag}" vx="0.3" vy="0" fixed="{fixed}"/>"#,
            i % 3 + 1,
        );
    }
    for i in 0..n {
        elements += &format!(
            r#"<edge i="{i}" j="{}"/><springforce edge="{i}" k="90" l0="0.9" b="{damping}"/>"#,
            i + 1,
        );
    }
    scene(integrator, 0.02, 0.02 * f64::from(steps), &elements)
}

#[test]
fn a_large_part_is_solved_sparsely_and_its_pattern_analysed_once() {
    for (damping, solver) in [(0.0, "sparse LDLᵀ 78 × 78"), (0.7, "sparse LU 78 × 78")] {
        let statistics = statistics(&chain(40, damping, "linearized-implicit-euler", 30));
        assert_eq!(statistics.linear_solver, solver);
        let linear = statistics.linear;
        assert_eq!((linear.symbolic_analyses, linear.factorisations), (1, 30));
        assert!(linear.worst_residual < 1e-14, "{}", linear.worst_residual);
    }
}

#[test]
fn refining_a_stiff_step_factorises_its_matrix_once() {
    let mut elements = String::new();
    for i in 0..6 {
        let (y, fixed) = (0.1 * f64::from(i % 2), u8::from(i == 0));
        elements +=
            &format!(r#"<particle m="1" px="{i}" py="{y}" vx="0" vy="{y}" fixed="{fixed}"/>"#);
    }
    for i in 0..5 {
        let j = i + 1;
        elements += &format!(
            r#"<edge i="{i}" j="{j}"/><springforce edge="{i}" k="1e9" l0="1.005" b="0"/>"#
        );
    }
    let statistics = statistics(&scene("linearized-implicit-euler", 0.01, 0.1, &elements));
    assert_eq!(statistics.linear_solver, "sparse LDLᵀ 10 × 10");
    let linear = statistics.linear;
    assert!(linear.solves > statistics.assemblies, "{linear:?}");
    assert_eq!(linear.factorisations, statistics.assemblies);
}

#[test]
fn steps_depend_only_on_states() {
    // A method that kept something of earlier steps would differ on its second way through.
    for kind in INTEGRATORS {
        let name = kind.schema.name;
        let scene = everything(name, 0.01, 2, 5);
        let system = System::<2>::new(&scene);
        let [x, v] = start(&scene);
        let mut used = kind.build(&scene, &system, LinearSolver::Auto);
        let mut first = None;
        for _ in 0..3 {
            let (mut positions, mut velocities) = (x.clone(), v.clone());
            let statistics = &mut Statistics::default();
            let mut before = None;
            for _ in 0..4 {
                let start = kept(&[positions.clone(), velocities.clone()]);
                let (positions, velocities) = (&mut positions, &mut velocities);
                let earlier = before.as_ref();
                used.step(
                    &system,
                    Step { size: 0.01, time: 0.0, positions, velocities, earlier, statistics },
                )
                .unwrap();
                before = Some(start);
            }
            let found = (bits(&positions), bits(&velocities));
            assert_eq!(first.get_or_insert_with(|| found.clone()), &found, "{name}");
        }
    }
}

/// A state as the earlier one of a step.
fn kept([positions, velocities]: &[Vec<f64>; 2]) -> State {
    State { time: None, positions: positions.clone(), velocities: velocities.clone() }
}

#[test]
fn single_steps_reproduce_the_run() {
    for kind in INTEGRATORS {
        let name = kind.schema.name;
        let scene = everything(name, 0.01, 2, 4);
        let states = states(&scene);
        let mut simulation = Simulation::new(&scene);
        // Backwards, so that nothing of the step before is there.
        for step in (0..states.len() - 1).rev() {
            let [x, v] = &states[step];
            let earlier = step.checked_sub(1).map(|earlier| &states[earlier]);
            let mut end = |earlier: Option<&[Vec<f64>; 2]>| {
                simulation.set_state(step as u64, earlier.map(kept).as_ref(), x, v);
                simulation.advance().unwrap();
                let state = simulation.state();
                [bits(state.positions), bits(state.velocities)]
            };
            let expected = states[step + 1].clone().map(|values| bits(&values));
            assert_eq!(end(earlier), expected, "{name}, step {step}");
            // Without the earlier state, a two-step method takes the first step of a run.
            let needs_earlier = kind.schema.equation.is_two_step() && step > 0;
            assert_eq!(end(None) != expected, needs_earlier, "{name}, step {step}");
        }
    }
}

#[test]
fn two_runs_write_the_same_bytes() {
    let mut random = fastrand::Rng::with_seed(8);
    for dimensions in [2, 3] {
        let elements = random_particles(&mut random, dimensions)
            + &random_forces(&mut random, dimensions, |schema| schema.tag != "windforce");
        for name in names() {
            let scene = scene(name, 0.002, 0.1, &elements);
            let [first, second] = [(), ()].map(|()| {
                let mut writer = FosssimWriter::new(Vec::new());
                let mut simulation = Simulation::new(&scene);
                loop {
                    writer.write(simulation.state()).unwrap();
                    if !simulation.advance().unwrap() {
                        return writer.into_inner();
                    }
                }
            });
            assert_eq!(first.len(), 51 * 2 * 4 * dimensions * 8);
            assert!(first == second, "{name} in {dimensions} dimensions");
        }
    }
}

/// The first number of an end that is not finite, where particle `far` flies off.
fn not_finite(integrator: &str, far: usize) -> Option<FailureKind> {
    let mut elements = r#"<simplegravity fx="0" fy="-1"/>"#.to_owned();
    for particle in 0..21 {
        let speed = if particle == far { 1e308 } else { 1.0 };
        let fixed = u8::from(particle % 7 == 3);
        elements += &format!(
            r#"<particle m="1" px="{particle}" py="0" vx="0" vy="{speed}" fixed="{fixed}"/>"#
        );
    }
    let scene = scene(integrator, 10.0, 10.0, &elements);
    Simulation::new(&scene).advance().err().map(|error| error.kind)
}

#[test]
fn non_finite_numbers_are_detected() {
    for integrator in ["explicit-euler", "symplectic-euler"] {
        for far in 0..21 {
            let expected =
                FailureKind::NotFinite { what: "position", particle: far, coordinate: "y" };
            assert_eq!(not_finite(integrator, far), Some(expected));
        }
        assert_eq!(not_finite(integrator, 21), None);
    }
}
