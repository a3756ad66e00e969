//! Each force's Jacobians against central differences of the force itself.
//!
//! For every registered force, in two and three dimensions, at many random states of two particles away
//! from where the force is not defined, with random parameters of which some are zero: the assembled `∂F/∂x` and `∂F/∂v` of the system are compared,
//! entry by entry, with
//!
//! ```text
//! F'(x) ≈ (8 (F(x+δ) − F(x−δ)) − (F(x+2δ) − F(x−2δ))) / 12δ           error O(δ⁴)
//! ```
//!
//! The error of a state is the largest difference of two entries, divided by the largest entry of either
//! matrix; where both are zero throughout, it is zero. A Jacobian that is zero at every state although
//! its differences are not has an error of 1, and one that is never anything but zero is reported as
//! such. Cost: `8nD` force evaluations a state.

mod difference;

use fastrand::Rng;
use nalgebra::DMatrix;
use simulator::force::{self, Block, ForceKind, JacobianSink};
use simulator::integrator;
use simulator::scene::schema::{ActsOn, Domain, IntegratorOptions, ParameterSchema};
use simulator::scene::{
    Dimension, EDGE_RADIUS, Edge, ForceElement, Location, PARTICLE_RADIUS, Particle, Rendering,
    Scene,
};
use simulator::system::{BuildForce, System};

use difference::difference;

/// The largest error of a correct Jacobian. Truncation and rounding leave about 1e-9.
pub const TOLERANCE: f64 = 1e-7;

/// Of so many values of a parameter that may be zero or left out, one is.
const ONE_IN: u32 = 8;

/// How to check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// Random states a force and dimension.
    pub states: u32,
    /// Seed of the random states.
    pub seed: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self { states: 200, seed: 1 }
    }
}

/// What was found for one force in one dimension.
#[derive(Debug, Clone, PartialEq)]
pub struct JacobianCheck {
    /// The force's tag.
    pub tag: &'static str,
    /// Two or three dimensions.
    pub dimension: Dimension,
    /// States checked.
    pub states: u32,
    /// `∂F/∂x`.
    pub by_position: Finding,
    /// `∂F/∂v`.
    pub by_velocity: Finding,
}

impl JacobianCheck {
    /// Whether both Jacobians agree with the differences.
    pub fn is_pass(&self) -> bool {
        self.by_position.is_pass() && self.by_velocity.is_pass()
    }
}

/// What was found for one Jacobian.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The largest relative error over all states.
    pub error: f64,
    /// States at which the Jacobian or its differences were not zero.
    pub evidence: u32,
    /// The entry with that error; `None` where the error is zero.
    pub worst: Option<WorstEntry>,
}

impl Finding {
    /// Whether the Jacobian agrees with the differences. A NaN does not.
    pub fn is_pass(&self) -> bool {
        self.error <= TOLERANCE
    }
}

/// One entry of a Jacobian, by the simulator and by differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstEntry {
    /// Number of the random state.
    pub state: u32,
    /// Row: particle and axis of the force.
    pub row: (usize, usize),
    /// Column: particle and axis of the position or velocity.
    pub column: (usize, usize),
    /// What the simulator says.
    pub analytic: f64,
    /// What the differences say.
    pub numeric: f64,
}

/// Checks every registered force whose tag `select` accepts.
pub fn check_all(config: Config, select: impl Fn(&str) -> bool) -> Vec<JacobianCheck> {
    let kinds = force::REGISTRY.iter().filter(|kind| select(kind.schema.tag));
    let both = |kind: &&'static ForceKind| [check::<2>(kind, config), check::<3>(kind, config)];
    kinds.flat_map(both).collect()
}

fn check<const D: usize>(kind: &'static ForceKind, config: Config) -> JacobianCheck
where
    ForceKind: BuildForce<D>,
{
    let mut rng = Rng::with_seed(config.seed);
    let mut findings = [Tally::default(), Tally::default()];
    for state in 0..config.states {
        let scene = random_scene::<D>(kind, &mut rng);
        let system = System::<D>::new(&scene);
        let positions = coordinates::<D>(&scene, |particle| particle.position);
        let velocities = coordinates::<D>(&scene, |particle| particle.velocity);
        let analytic = analytic(&system, &positions, &velocities);
        let numeric = [
            difference(&positions, |x, force| evaluate(&system, x, &velocities, force)),
            difference(&velocities, |v, force| evaluate(&system, &positions, v, force)),
        ];
        for ((finding, analytic), numeric) in findings.iter_mut().zip(&analytic).zip(&numeric) {
            finding.add::<D>(state, analytic, numeric);
        }
    }
    let [by_position, by_velocity] = findings.map(Tally::finish);
    JacobianCheck {
        tag: kind.schema.tag,
        dimension: dimension::<D>(),
        states: config.states,
        by_position,
        by_velocity,
    }
}

fn dimension<const D: usize>() -> Dimension {
    if D == 2 { Dimension::Two } else { Dimension::Three }
}

/// The force, or NaN where it is not defined: a NaN is never close to anything.
fn evaluate<const D: usize>(system: &System<D>, x: &[f64], v: &[f64], force: &mut [f64]) {
    if system.force(x, v, 0.0, force).is_err() {
        force.fill(f64::NAN);
    }
}

fn analytic<const D: usize>(system: &System<D>, x: &[f64], v: &[f64]) -> [DMatrix<f64>; 2] {
    let size = system.n_particles() * D;
    let mut matrices = Matrices([DMatrix::zeros(size, size), DMatrix::zeros(size, size)]);
    if system.jacobians(x, v, 0.0, &mut matrices).is_err() {
        matrices.0.iter_mut().for_each(|matrix| matrix.fill(f64::NAN));
    }
    matrices.0
}

struct Matrices([DMatrix<f64>; 2]);

impl<const D: usize> JacobianSink<D> for Matrices {
    fn add(&mut self, row: usize, column: usize, jacobian_x: &Block<D>, jacobian_v: &Block<D>) {
        for (matrix, block) in self.0.iter_mut().zip([jacobian_x, jacobian_v]) {
            let mut view = matrix.fixed_view_mut::<D, D>(row * D, column * D);
            view += block;
        }
    }
}

/// The worst of one Jacobian so far.
#[derive(Default)]
struct Tally {
    error: f64,
    evidence: u32,
    worst: Option<WorstEntry>,
}

impl Tally {
    fn add<const D: usize>(&mut self, state: u32, analytic: &DMatrix<f64>, numeric: &DMatrix<f64>) {
        let scale = analytic.amax().max(numeric.amax());
        let finite = |matrix: &DMatrix<f64>| matrix.iter().all(|entry| entry.is_finite());
        let sound = finite(analytic) && finite(numeric);
        if scale == 0.0 && sound {
            return;
        }
        self.evidence += 1;
        for ((row, column), (analytic, numeric)) in
            indices(analytic).zip(analytic.iter().zip(numeric.iter()))
        {
            let error = (analytic - numeric).abs() / scale;
            // A NaN is the worst there is, and stays it.
            if (error > self.error || error.is_nan()) && !self.error.is_nan() {
                self.error = error;
                self.worst = Some(WorstEntry {
                    state,
                    row: (row / D, row % D),
                    column: (column / D, column % D),
                    analytic: *analytic,
                    numeric: *numeric,
                });
            }
        }
    }

    fn finish(self) -> Finding {
        Finding { error: self.error, evidence: self.evidence, worst: self.worst }
    }
}

/// Row and column of each entry, in the order in which a matrix iterates.
fn indices(matrix: &DMatrix<f64>) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (rows, columns) = matrix.shape();
    (0..columns).flat_map(move |column| (0..rows).map(move |row| (row, column)))
}

/// Two particles half a unit to three units apart, with one element of the force.
fn random_scene<const D: usize>(kind: &'static ForceKind, rng: &mut Rng) -> Scene {
    let mut parameters = [0.0; simulator::scene::schema::MAX_PARAMETERS];
    for (value, parameter) in parameters.iter_mut().zip(kind.schema.parameters) {
        *value = random_parameter(parameter, rng);
    }
    let mut within = |low: f64, high: f64| low + (high - low) * rng.f64();
    let mut vector = |size: f64| -> [f64; 3] {
        std::array::from_fn(|axis| if axis < D { within(-size, size) } else { 0.0 })
    };
    let first = vector(1.0);
    let second = loop {
        let offset = vector(3.0);
        let distance = offset.iter().map(|component| component * component).sum::<f64>().sqrt();
        if (0.5..3.0).contains(&distance) {
            break std::array::from_fn(|axis| first[axis] + offset[axis]);
        }
    };
    let velocities = [vector(2.0), vector(2.0)];
    let particles =
        [first, second].into_iter().zip(velocities).map(|(position, velocity)| Particle {
            mass: within(0.5, 4.0),
            position,
            velocity,
            fixed: false,
            radius: PARTICLE_RADIUS,
            tag: None,
        });
    let acts_on_pair = kind.schema.acts_on != ActsOn::EveryParticle;
    let element = ForceElement {
        schema: &kind.schema,
        pair: acts_on_pair.then_some([0, 1]),
        edge: (kind.schema.acts_on == ActsOn::Edge).then_some(0),
        parameters,
        location: Location::default(),
    };
    Scene {
        name: "random state".to_owned(),
        description: None,
        tag: None,
        dimension: dimension::<D>(),
        duration: 0.0,
        time_step: 1.0,
        integrator: &integrator::REGISTRY[0].schema,
        integrator_options: IntegratorOptions::defaults(&integrator::REGISTRY[0].schema),
        max_simulation_frequency: None,
        particles: particles.collect(),
        edges: vec![Edge { particles: [0, 1], radius: EDGE_RADIUS }],
        forces: vec![element],
        rendering: Rendering::default(),
    }
}

/// A typical value; at times the parameter's default, or zero, for which a force may have a branch.
fn random_parameter(parameter: &ParameterSchema, rng: &mut Rng) -> f64 {
    let (low, high) = parameter.typical;
    let typical = low + (high - low) * rng.f64();
    let zero = (parameter.domain == Domain::NonNegative).then_some(0.0);
    match parameter.default.or(zero) {
        Some(special) if rng.u32(..ONE_IN) == 0 => special,
        _ => typical,
    }
}

fn coordinates<const D: usize>(scene: &Scene, of: fn(&Particle) -> [f64; 3]) -> Vec<f64> {
    scene.particles.iter().flat_map(|particle| of(particle).into_iter().take(D)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_registered_force_agrees_with_its_differences() {
        let checks = check_all(Config::default(), |_| true);
        assert_eq!(checks.len(), 2 * force::REGISTRY.len());
        for check in checks {
            // A wide margin to the tolerance: the verdict does not hang on rounding.
            let worst = check.by_position.error.max(check.by_velocity.error);
            assert!(worst < TOLERANCE / 20.0, "{check:?}");
        }
    }

    #[test]
    fn jacobians_are_checked_where_they_are_not_zero() {
        let expected: [(&str, bool, bool); 8] = [
            ("simplegravity", false, false),
            ("constantforce", false, false),
            ("springforce", true, true),
            ("gravitationalforce", true, false),
            ("dragdamping", false, true),
            ("vortexforce", true, true),
            ("greenspringforce", true, false),
            ("windforce", false, false),
        ];
        for check in check_all(Config::default(), |_| true) {
            let entry = expected.iter().find(|(tag, ..)| *tag == check.tag);
            let (_, by_position, by_velocity) = entry.expect("a line for each force");
            // A force whose parameters are zero is no evidence.
            let enough = |evidence: u32, expected: bool| match expected {
                true => 2 * evidence >= check.states,
                false => evidence == 0,
            };
            assert!(enough(check.by_position.evidence, *by_position), "{check:?}");
            assert!(enough(check.by_velocity.evidence, *by_velocity), "{check:?}");
        }
    }

    fn spring() -> &'static ForceKind {
        force::REGISTRY.iter().find(|kind| kind.schema.tag == "springforce").unwrap()
    }

    #[test]
    fn springs_are_checked_with_and_without_rest_length_and_damping() {
        let Config { states, seed } = Config::default();
        let mut rng = Rng::with_seed(seed);
        let branch = |scene: &Scene| {
            let [_, rest_length, damping, _] = scene.forces[0].parameters;
            (rest_length == 0.0, damping == 0.0)
        };
        let branches: Vec<(bool, bool)> =
            (0..states).map(|_| branch(&random_scene::<2>(spring(), &mut rng))).collect();
        let share = |wanted: (bool, bool)| branches.iter().filter(|is| **is == wanted).count();
        assert!(share((false, false)) > branches.len() / 2);
        assert!(share((false, true)) >= 10 && share((true, false)) >= 10);
        assert!(share((true, true)) >= 1);
    }

    #[test]
    fn a_jacobian_that_is_wrong_for_an_undamped_spring_is_called_wrong() {
        let finding = tally_of_spoilt_where(
            |parameters| parameters[2] == 0.0,
            |matrix| *matrix *= 1.0 + 1e-6,
        );
        assert!(!finding.is_pass(), "{finding:?}");
    }

    /// The tally for a spring's `∂F/∂x` after `spoil` has changed it.
    fn tally_of_spoilt(spoil: impl Fn(&mut DMatrix<f64>)) -> Finding {
        tally_of_spoilt_where(|_| true, spoil)
    }

    /// The same, changed only for springs with such parameters.
    fn tally_of_spoilt_where(
        select: impl Fn(&[f64]) -> bool,
        spoil: impl Fn(&mut DMatrix<f64>),
    ) -> Finding {
        let spring = spring();
        let mut rng = Rng::with_seed(7);
        let mut tally = Tally::default();
        for state in 0..50 {
            let scene = random_scene::<2>(spring, &mut rng);
            let system = System::<2>::new(&scene);
            let x = coordinates::<2>(&scene, |particle| particle.position);
            let v = coordinates::<2>(&scene, |particle| particle.velocity);
            let [mut by_position, _] = analytic(&system, &x, &v);
            if select(&scene.forces[0].parameters) {
                spoil(&mut by_position);
            }
            let numeric = difference(&x, |x, force| evaluate(&system, x, &v, force));
            tally.add::<2>(state, &by_position, &numeric);
        }
        tally.finish()
    }

    #[test]
    fn a_wrong_jacobian_is_called_wrong() {
        type Spoil = fn(&mut DMatrix<f64>);
        let mistakes: [(&str, Spoil); 7] = [
            ("sign", |matrix| *matrix = -&*matrix),
            ("transposed", |matrix| *matrix = matrix.transpose()),
            ("missing", |matrix| matrix.fill(0.0)),
            ("one entry off by a millionth", |matrix| matrix[(2, 1)] *= 1.0 + 1e-6),
            ("off-diagonal block", |matrix| matrix.fixed_view_mut::<2, 2>(0, 2).fill(0.0)),
            ("scaled", |matrix| *matrix *= 1.0 + 1e-6),
            ("NaN", |matrix| matrix[(3, 3)] = f64::NAN),
        ];
        assert!(tally_of_spoilt(|_| ()).is_pass());
        for (name, spoil) in mistakes {
            let finding = tally_of_spoilt(spoil);
            assert!(!finding.is_pass() && finding.worst.is_some(), "{name}: {finding:?}");
        }
    }
}
