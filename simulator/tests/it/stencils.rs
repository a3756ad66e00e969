//! A force between three particles, defined here, in every part of the simulator that knows of elements.

use std::sync::mpsc;

use nalgebra::DMatrix;
use scene::schema::{IntegratorOptions, Stencil, Vocabulary};
use scene::write::write;
use scene::{Dimension, ForceElement, Location, ParseOptions, Particle, Scene, xml};
use simulator::force::stencil::{Local, LocalJacobians, StencilForce, StencilLaw};
use simulator::force::{
    Block, Coupling, Degenerate, ElementJacobians, ForceKind, JacobianSink, Numbered, State, Vector,
};
use simulator::integrator::{BuildIntegrator, IntegratorKind, REGISTRY as INTEGRATORS, Step};
use simulator::simulation::FailureKind;
use simulator::sizes::PARALLEL;
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use simulator::system::{BuildForce, System};
use simulator::{force, vocabulary};

use crate::support::bending::BENDING;
use crate::support::largest_difference;

/// Particles in general position, each joined with the two before it by a bending spring.
fn chain(n_particles: usize, dimension: Dimension) -> Scene {
    let mut random = fastrand::Rng::with_seed(33);
    let mut scene = Scene::new("bending", dimension, &INTEGRATORS[0].schema);
    scene.particles = (0..n_particles)
        .map(|number| {
            let mut vector = |x: f64| {
                let z = if dimension == Dimension::Three { random.f64() } else { 0.0 };
                [x + 0.6 * random.f64(), random.f64(), z]
            };
            let (position, velocity) = (vector(number as f64), vector(0.0));
            let mass = 1.0 + random.f64();
            Particle { mass, position, velocity, fixed: false, radius: 0.1, tag: None }
        })
        .collect();
    for first in 0..n_particles - 2 {
        let values = [("stiffness", 0.5 + random.f64()), ("c0", random.f64() - 0.5)];
        let parameters = BENDING.schema.values(&values);
        let particles = [first + 2, first, first + 1];
        scene.forces.push(ForceElement::new(&BENDING.schema, &particles, None, parameters));
    }
    scene
}

fn system<const D: usize>(scene: &Scene) -> System<D>
where
    ForceKind: BuildForce<D>,
{
    let kinds: Vec<&ForceKind> = [&BENDING].into_iter().chain(force::REGISTRY.to_vec()).collect();
    System::of_kinds(scene, &kinds)
}

fn force_at<const D: usize>(system: &System<D>, x: &[f64], v: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; x.len()];
    system.force(x, v, 0.0, &mut sum).unwrap();
    sum
}

struct Dense(DMatrix<f64>);

impl<const D: usize> JacobianSink<D> for Dense {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        element.spread(element.by_position, |row, column, block| {
            let mut view = self.0.fixed_view_mut::<D, D>(row * D, column * D);
            view += block;
        });
    }
}

fn jacobian<const D: usize>(system: &System<D>, x: &[f64], v: &[f64]) -> DMatrix<f64> {
    let mut dense = Dense(DMatrix::zeros(x.len(), x.len()));
    system.jacobians(x, v, 0.0, &mut dense).unwrap();
    dense.0
}

/// The derivatives of a vector, column by column, by central differences.
fn differences(at: &[f64], of: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let h = 1e-6;
    let column = |place: usize| {
        let moved = |by: f64| {
            let mut moved = at.to_vec();
            moved[place] += by;
            of(&moved)
        };
        moved(h).iter().zip(moved(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
    };
    (0..at.len()).map(column).collect()
}

fn assembly<const D: usize>(dimension: Dimension)
where
    ForceKind: BuildForce<D>,
{
    let scene = chain(6, dimension);
    let (system, x, v) = (system::<D>(&scene), scene.positions(), scene.velocities());
    let here = force_at(&system, &x, &v);
    assert!(here.iter().any(|component| component.abs() > 0.1));

    let slopes = differences(&x, |x| vec![system.potential_energy(x, &v, 0.0)]).concat();
    let expected: Vec<f64> = slopes.iter().map(|slope| -slope).collect();
    assert!(largest_difference(&here, &expected) < 1e-8);

    let found = jacobian(&system, &x, &v);
    let expected = differences(&x, |x| force_at(&system, x, &v)).concat();
    assert!(largest_difference(found.as_slice(), &expected) < 1e-7);
    assert!((&found - found.transpose()).amax() < 1e-14 * found.amax());

    for axis in 0..D {
        let of_axis = |values: &[f64]| values.iter().skip(axis).step_by(D).copied().sum::<f64>();
        assert!(of_axis(&here).abs() < 1e-13);
        let rows = found.row_iter().map(|row| row.iter().copied().collect::<Vec<_>>());
        assert!(rows.into_iter().all(|row| of_axis(&row).abs() < 1e-12));
    }
    let torque = |p: usize| x[p * D] * here[p * D + 1] - x[p * D + 1] * here[p * D];
    assert!((0..6).map(torque).sum::<f64>().abs() < 1e-12);
}

#[test]
fn three_particle_forces_and_jacobians_derive_from_their_energy() {
    assembly::<2>(Dimension::Two);
    assembly::<3>(Dimension::Three);
}

#[test]
fn couplings_list_every_active_stencil() {
    let mut scene = chain(5, Dimension::Two);
    scene.particles[..3].iter_mut().for_each(|particle| particle.fixed = true);
    let mut found = Vec::new();
    system::<2>(&scene).couplings(&mut |coupling| found.push(coupling));
    let coupling = |particles: [usize; 3]| Coupling::Stencil {
        particles: particles.as_slice().into(),
        symmetric: true,
    };
    // As their Jacobians are handed over: the origin comes last.
    assert_eq!(found, [coupling([3, 2, 1]), coupling([4, 3, 2])]);
}

#[test]
fn threads_give_the_same_bits() {
    let scene = chain(PARALLEL + 10, Dimension::Three);
    let (x, v) = (scene.positions(), scene.velocities());
    let run = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| force_at(&system::<3>(&scene), &x, &v))
    };
    let expected = run(1);
    assert!([2, 3, 7].into_iter().all(|n_threads| run(n_threads) == expected));
}

#[test]
fn an_element_without_a_value_names_its_particles() {
    let mut scene = chain(6, Dimension::Two);
    scene.particles[4].position = scene.particles[3].position;
    let (system, x) = (system::<2>(&scene), scene.positions());
    let mut sum = vec![0.0; x.len()];
    let error = system.force(&x, &x, 0.0, &mut sum).unwrap_err();
    assert_eq!(error, Degenerate { element: 3, particles: [5, 3, 4].as_slice().into() });
    let tag = BENDING.schema.tag;
    let failure =
        FailureKind::Degenerate { tag, particles: error.particles, location: Location::default() };
    let message = "<testbendingforce> is not defined where its particles (5, 3, 4) are";
    assert_eq!(failure.to_string(), message);
}

/// A step of this integrator from the scene's start: its end, and its linear systems.
fn step<const D: usize>(
    scene: &Scene,
    name: &str,
    options: &[(&str, &str)],
    solver: LinearSolver,
) -> (Vec<f64>, Statistics, Vec<DMatrix<f64>>)
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    let kind = INTEGRATORS.iter().find(|kind| kind.schema.name == name).unwrap();
    let mut integrator_options = IntegratorOptions::defaults(&kind.schema);
    options.iter().for_each(|(name, value)| integrator_options.set(name, value).unwrap());
    let scene = Scene { integrator: &kind.schema, integrator_options, ..scene.clone() };
    let system = system::<D>(&scene);
    let mut method = kind.build(&scene, &system, solver);
    let (sender, receiver) = mpsc::channel();
    method.observe(Box::new(move |system| sender.send(system.matrix.clone()).unwrap()));
    let (mut positions, mut velocities) = (scene.positions(), scene.velocities());
    let mut statistics = Statistics::default();
    let step = Step {
        size: scene.time_step,
        time: 0.0,
        positions: &mut positions,
        velocities: &mut velocities,
        earlier: None,
        statistics: &mut statistics,
    };
    method.step(&system, step).unwrap();
    (positions, statistics, receiver.try_iter().collect())
}

#[test]
fn sparse_and_dense_solvers_take_the_same_step() {
    let mut scene = chain(24, Dimension::Two);
    scene.time_step = 0.1;
    scene.particles[7].fixed = true;
    let [sparse, dense] = [LinearSolver::Sparse, LinearSolver::Dense]
        .map(|solver| step::<2>(&scene, "implicit-euler", &[], solver));
    assert!(sparse.1.linear_solver.contains("sparse LDLᵀ 46 × 46"), "{}", sparse.1.linear_solver);
    assert!(largest_difference(&sparse.0, &dense.0) < 1e-11);
    assert!(largest_difference(&sparse.0, &scene.positions()) > 1e-2);
    // The pattern has the blocks of two neighbours to each side, and no others.
    let matrix = &sparse.2[0];
    assert!((0..10).all(|row| matrix[(row, row + 6)] == 0.0));
    assert!(matrix.iter().filter(|entry| **entry != 0.0).count() > 4 * (3 * 23));
}

/// The nearest positive semi-definite matrix.
fn nearest(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = matrix.symmetric_eigen();
    eigen.eigenvalues.apply(|eigenvalue| *eigenvalue = eigenvalue.max(0.0));
    eigen.recompose()
}

fn projection<const D: usize>(dimension: Dimension)
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    let mut scene = chain(3, dimension);
    scene.time_step = 0.7;
    scene.particles.iter_mut().for_each(|particle| particle.velocity = [0.0; 3]);
    let hessian = jacobian(&system::<D>(&scene), &scene.positions(), &scene.velocities()) * -0.49;
    let options = [("projection", "clamp")];
    let (_, statistics, systems) =
        step::<D>(&scene, "projected-newton", &options, LinearSolver::Dense);
    let mut expected = nearest(hessian.clone());
    assert!((&expected - &hessian).amax() > 0.05 && statistics.projections > 0);
    for (number, particle) in scene.particles.iter().enumerate() {
        (0..D).for_each(|axis| expected[(number * D + axis, number * D + axis)] += particle.mass);
    }
    assert!((&systems[0] - &expected).amax() < 1e-13, "{}{expected}", systems[0]);
}

#[test]
fn projection_is_that_of_the_whole_element() {
    projection::<2>(Dimension::Two);
    projection::<3>(Dimension::Three);
}

#[test]
fn gauss_newton_leaves_the_square_of_the_first_derivative() {
    let scene = chain(3, Dimension::Three);
    let (system, x, v) = (system::<3>(&scene), scene.positions(), scene.velocities());
    let mut found = Dense(DMatrix::zeros(9, 9));
    system.gauss_newton(&x, &v, 0.0, &mut found).unwrap();
    // U = ρ²/2 has ∂U/∂x = ρ ∂ρ/∂x.
    let force = DMatrix::from_vec(9, 1, force_at(&system, &x, &v));
    let energy = system.potential_energy(&x, &v, 0.0);
    let expected = &force * force.transpose() / (-2.0 * energy);
    let difference = (&found.0 - &expected).amax();
    assert!(expected.amax() > 0.01 && difference < 1e-14, "{difference:e} {expected}");
}

/// Springs and drag as laws on stencils.
struct Spring {
    stiffness: f64,
    rest_length: f64,
}

impl<const D: usize> StencilLaw<1, D> for Spring {
    const ORIGIN: Option<usize> = Some(1);

    fn energy(&self, at: &Local<1, D>) -> Option<f64> {
        Some(0.5 * self.stiffness * (at.d[0].norm() - self.rest_length).powi(2))
    }

    fn forces(&self, at: &Local<1, D>) -> Option<[Vector<D>; 1]> {
        let length = at.d[0].norm();
        Some([at.d[0] * (self.stiffness * (self.rest_length - length) / length)])
    }

    fn jacobians(&self, at: &Local<1, D>) -> Option<LocalJacobians<1, D>> {
        let length = at.d[0].norm();
        let along = at.d[0] * at.d[0].transpose() / (length * length);
        let across = (Block::identity() - along) * ((length - self.rest_length) / length);
        let by_position = [[(along + across) * -self.stiffness]];
        Some(LocalJacobians { by_position, ..LocalJacobians::zeros() })
    }
}

struct Drag(f64);

impl<const D: usize> StencilLaw<1, D> for Drag {
    const ORIGIN: Option<usize> = None;

    fn energy(&self, _: &Local<1, D>) -> Option<f64> {
        None
    }

    fn forces(&self, at: &Local<1, D>) -> Option<[Vector<D>; 1]> {
        Some([at.w[0] * -self.0])
    }

    fn jacobians(&self, _: &Local<1, D>) -> Option<LocalJacobians<1, D>> {
        let by_velocity = [[Block::identity() * -self.0]];
        Some(LocalJacobians { by_velocity, ..LocalJacobians::zeros() })
    }
}

#[test]
fn pairs_and_fields_are_stencils_of_two_and_of_one() {
    let mut scene = chain(5, Dimension::Two);
    scene.forces.clear();
    let spring = vocabulary().force("springforce").unwrap();
    for pair in [[0, 1], [3, 2], [1, 4]] {
        let parameters = spring.values(&[("k", 3.0), ("l0", 0.7)]);
        scene.forces.push(ForceElement::new(spring, &pair, None, parameters));
    }
    let drag = vocabulary().force("dragdamping").unwrap();
    scene.forces.push(ForceElement::new(drag, &[], None, drag.values(&[("b", 0.3)])));
    assert_eq!([spring.stencil, drag.stencil], [Stencil::Edge, Stencil::EveryParticle]);
    let kinds = [spring, drag]
        .map(|schema| *force::REGISTRY.iter().find(|kind| kind.schema == *schema).unwrap());
    let numbered: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
    let (x, v) = (scene.positions(), scene.velocities());
    let state = State { masses: &[1.0; 5], positions: &x, velocities: &v, time: 0.0 };
    let law = |element: &ForceElement| Spring {
        stiffness: element.parameter("k"),
        rest_length: element.parameter("l0"),
    };
    let drags = |element: &ForceElement| Drag(element.parameter("b"));
    let here: [Box<dyn force::Force<2>>; 2] = [
        Box::new(StencilForce::new(&scene, &numbered[..3], law)),
        Box::new(StencilForce::new(&scene, &numbered[3..], drags)),
    ];
    for ((kind, here), elements) in kinds.iter().zip(here).zip([&numbered[..3], &numbered[3..]]) {
        let theirs: Box<dyn force::Force<2>> = kind.build(&scene, elements);
        let values = |force: &dyn force::Force<2>| {
            let mut sum = vec![0.0; 10];
            force.add_force(state, 0..5, &mut sum).unwrap();
            let mut both = [Dense(DMatrix::zeros(10, 10)), Dense(DMatrix::zeros(10, 10))];
            force.add_jacobians(state, &mut Both(&mut both)).unwrap();
            let [x, v] = both.map(|dense| dense.0.as_slice().to_vec());
            [sum, x, v, vec![force.energy(state).unwrap_or(0.0)]]
        };
        for (ours, theirs) in values(here.as_ref()).iter().zip(values(theirs.as_ref())) {
            assert!(largest_difference(ours, &theirs) < 1e-14);
        }
    }
}

/// Both Jacobians.
struct Both<'a>(&'a mut [Dense; 2]);

impl<const D: usize> JacobianSink<D> for Both<'_> {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        let [by_position, by_velocity] = &mut self.0;
        by_position.add(element);
        by_velocity.add(ElementJacobians { by_position: element.by_velocity, ..element });
    }
}

fn parse(elements: &str) -> Result<Scene, String> {
    let text = format!(
        r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="0.1"/>
        {}{elements}</scene>"#,
        r#"<particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>"#.repeat(4)
    );
    let forces = vec![&BENDING.schema];
    let vocabulary = Vocabulary { forces, integrators: vocabulary().integrators };
    let parsed = xml::parse(&text, "bent.xml", &vocabulary, &ParseOptions::default());
    parsed.map(|parsed| parsed.scene).map_err(|error| error.to_string())
}

#[test]
fn a_scene_names_the_particles_of_a_stencil_by_its_attributes() {
    let element = r#"<testbendingforce i="3" j="0" k="1" stiffness="2" c0="0.5"/>"#;
    let scene = parse(element).unwrap();
    assert_eq!(scene.forces[0].particles[..], [3, 0, 1]);
    let mut written = Vec::new();
    write(&scene, &mut written).unwrap();
    let written = String::from_utf8(written).unwrap();
    assert!(written.contains(&element.replace('2', "2.0")), "{written}");
    for (wrong, message) in [
        (element.replace("k=\"1\"", "k=\"3\""), "<testbendingforce> names particle 3 twice"),
        (element.replace("k=\"1\"", "k=\"4\""), "4"),
        (element.replace(" k=\"1\"", ""), "k"),
    ] {
        let error = parse(&wrong).unwrap_err();
        assert!(error.contains(message) && error.starts_with("bent.xml:2:"), "{error}");
    }
}
