//! Compares the Newton systems of the implicit methods with differences of their residual.
//!
//! Each iteration of an implicit method solves `A δ = r(u)` with
//!
//! ```text
//! r(u) = M (v − u) + h F(q + h u, u)          A = −∂r/∂u = M − h² ∂F/∂x − h ∂F/∂v
//! ```
//!
//! `A`, as stored before its factorization, is compared entry by entry with extrapolated differences of `r`, and the
//! right-hand side with `r`, at every iteration of selected scenes. Systems with a projected element differ by design,
//! and are counted but not judged. The iterates use all their digits, so that no step is exact: the differences divide
//! by the rounded steps. Cost: `16·n·D` evaluations of the force for each system.

use std::sync::mpsc;

use nalgebra::DMatrix;
use rayon::prelude::*;
use scene::schema::Matrix;
use scene::trace::State;
use scene::{Dimension, Overrides, ParseOptions, Scene, xml};
use simulator::force::ForceKind;
use simulator::integrator::{BuildIntegrator, IntegratorKind, NewtonSystem, REGISTRY, Step};
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use simulator::system::{BuildForce, System};
use simulator::vocabulary;

use super::check::largest;
use jacobian::ridders::{Difference, Estimate, Ladder, differentiate, power_of_two};
use jacobian::verdict::{ROUNDING, Reason, Verdict};
use reference::law::Scale;
use reference::laws::Laws;

/// Ratio of a difference to its tolerance above which it is a contradiction.
const CLEAR: f64 = 8.0;

/// The result for one method and one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonCheck {
    /// The integrator's name.
    pub integrator: &'static str,
    /// The scene's description.
    pub scene: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// Number of linear systems solved.
    pub systems: usize,
    /// Number of systems that could be judged.
    pub evidence: usize,
    /// The largest difference between two entries, in terms of the tolerance; reported relative to the largest entry.
    pub error: Option<Estimate>,
}

/// A scene. It is stepped by every method that solves with Jacobians and supports its forces.
struct Case {
    name: &'static str,
    text: &'static str,
}

/// Unsymmetric, symmetric and decoupled systems; dense and sparse; in two and three dimensions.
const CASES: &[Case] = &[
    Case {
        name: "damped springs, drag and gravity; one particle fixed",
        text: r#"<scene><duration time="0.15"/><integrator type="implicit" dt="0.05"/>
            <particle m="1.5" px="0" py="0" vx="0" vy="0" fixed="1"/>
            <particle m="0.7" px="1.1" py="0.3" vx="0.4" vy="-1" fixed="0"/>
            <particle m="1.2" px="2.3" py="-0.2" vx="-0.5" vy="0.8" fixed="0"/>
            <particle m="0.9" px="1.4" py="1.2" vx="0.9" vy="0.1" fixed="0"/>
            <particle m="1.1" px="0.2" py="1.3" vx="-0.3" vy="0.6" fixed="0"/>
            <edge i="0" j="1"/><edge i="1" j="2"/><edge i="2" j="3"/><edge i="4" j="3"/>
            <edge i="0" j="4"/><edge i="1" j="3"/>
            <springforce edge="0" k="60" l0="0.9" b="0.8"/><springforce edge="1" k="45" l0="1.4" b="1.5"/>
            <springforce edge="2" k="80" l0="1.2" b="0.4"/><springforce edge="3" k="30" l0="1" b="2"/>
            <springforce edge="4" k="55" l0="1.5" b="0"/><springforce edge="5" k="70" l0="0.7" b="0.3"/>
            <simplegravity fx="0" fy="-9.81"/><dragdamping b="0.4"/></scene>"#,
    },
    Case {
        name: "a chain in space under tension; sparse",
        text: r#"<scene><duration time="0.06"/><integrator type="implicit" dt="0.02"/>
            <particle m="1" px="0" py="0" pz="0.1" vx="0" vy="0" vz="0" fixed="1"/>
            <particle m="0.8" px="1.2" py="0.1" pz="0.3" vx="0.1" vy="-0.4" vz="0.2" fixed="0"/>
            <particle m="1.3" px="2.5" py="-0.2" pz="0" vx="-0.2" vy="0.3" vz="0.5" fixed="0"/>
            <particle m="0.6" px="3.6" py="0.3" pz="0.2" vx="0.6" vy="0.2" vz="-0.1" fixed="0"/>
            <particle m="1.1" px="4.9" py="0" pz="-0.3" vx="0" vy="-0.5" vz="0.3" fixed="0"/>
            <particle m="0.9" px="6.2" py="0.2" pz="0.1" vx="0.3" vy="0.1" vz="0.4" fixed="0"/>
            <edge i="0" j="1"/><edge i="1" j="2"/><edge i="2" j="3"/><edge i="3" j="4"/><edge i="4" j="5"/>
            <springforce edge="0" k="900" l0="0.9"/><springforce edge="1" k="700" l0="1"/>
            <springforce edge="2" k="800" l0="0.8"/><springforce edge="3" k="650" l0="1"/>
            <greenspringforce edge="4" k="300" l0="1"/>
            <simplegravity fx="0" fy="-9.81" fz="0.5"/><dragdamping b="0.3"/></scene>"#,
    },
    Case {
        name: "vortex and gravitation between three, wind",
        text: r#"<scene><duration time="0.15"/><integrator type="implicit" dt="0.05"/>
            <particle m="2" px="0.1" py="0" vx="0.2" vy="0.1" fixed="0"/>
            <particle m="1" px="1.3" py="0.4" vx="-0.3" vy="0.7" fixed="0"/>
            <particle m="1.4" px="-0.6" py="1.5" vx="0.5" vy="0.2" fixed="0"/>
            <vortexforce i="0" j="1" kbs="0.8" kvc="1.7"/><gravitationalforce i="1" j="2" G="0.9"/>
            <windforce strength="0.7"/></scene>"#,
    },
];

/// Checks every case with every method of it, in parallel.
pub(super) fn check_all() -> Vec<NewtonCheck> {
    let solving = |kind: &&&IntegratorKind| kind.schema.matrix == Matrix::Jacobians;
    let with_each =
        |case: &'static Case| REGISTRY.iter().filter(solving).map(move |kind| (case, *kind));
    let jobs: Vec<(&Case, &IntegratorKind)> = CASES.iter().flat_map(with_each).collect();
    jobs.into_par_iter().filter_map(|(case, kind)| check(case, kind)).collect()
}

/// `None` if the method does not support a force, or the scene cannot be parsed; a test ensures that it can.
fn check(case: &'static Case, integrator: &'static IntegratorKind) -> Option<NewtonCheck> {
    let vocabulary = vocabulary();
    let overrides = Overrides { integrator: Some(&integrator.schema), ..Overrides::default() };
    let options = ParseOptions { overrides, ..ParseOptions::default() };
    let scene = xml::parse(case.text, case.name, &vocabulary, &options).ok()?.scene;
    let tally = match scene.dimension {
        Dimension::Two => run::<2>(&scene, integrator),
        Dimension::Three => run::<3>(&scene, integrator),
    };
    Some(tally.finish(integrator.schema.name, case.name))
}

/// Simulates `scene` and judges every system.
fn run<const D: usize>(scene: &Scene, integrator: &IntegratorKind) -> Tally
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    let system = System::<D>::new(scene);
    let (mut positions, mut velocities) = (scene.positions(), scene.velocities());
    let mut method = integrator.build(scene, &system, LinearSolver::Auto);
    let (sender, receiver) = mpsc::channel();
    method.observe(Box::new(move |system| {
        // The receiver outlives the method.
        let _ = sender.send(Observed::of(system));
    }));
    let mut tally = Tally::default();
    let h = scene.time_step;
    let mut earlier: Option<State> = None;
    for step in 0..scene.n_steps() {
        let time = step as f64 * h;
        let mut statistics = Statistics::default();
        let start =
            State { time: None, positions: positions.clone(), velocities: velocities.clone() };
        let taken = method.step(
            &system,
            Step {
                size: h,
                time,
                positions: &mut positions,
                velocities: &mut velocities,
                earlier: earlier.as_ref(),
                statistics: &mut statistics,
            },
        );
        earlier = Some(start);
        for observed in receiver.try_iter() {
            tally.add(&observed.judge(&system, scene));
        }
        if taken.is_err() {
            tally.failed = true;
            break;
        }
    }
    tally
}

/// A system with all inputs of its residual.
struct Observed {
    h: f64,
    time: f64,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    iterate: Vec<f64>,
    matrix: DMatrix<f64>,
    residual: Vec<f64>,
    projected: bool,
}

/// The result of comparing a system with its residual.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Finding {
    /// The matrix differs by design.
    Projected,
    /// The differences could not be computed.
    Unknown,
    /// The largest difference, in terms of the tolerance and relative.
    Judged(f64, Estimate),
}

impl Observed {
    fn of(system: &NewtonSystem<'_>) -> Self {
        Self {
            h: system.h,
            time: system.time,
            positions: system.positions.to_vec(),
            velocities: system.velocities.to_vec(),
            iterate: system.iterate.to_vec(),
            matrix: system.matrix.clone(),
            residual: system.residual.to_vec(),
            projected: !system.exact,
        }
    }

    fn judge<const D: usize>(&self, system: &System<D>, scene: &Scene) -> Finding {
        if self.projected {
            return Finding::Projected;
        }
        let Self { h, time, .. } = *self;
        let free: Vec<usize> =
            (0..self.iterate.len()).filter(|dof| !system.fixed()[dof / D]).collect();
        let moved = |iterate: &[f64]| -> Vec<f64> {
            self.positions.iter().zip(iterate).map(|(q, u)| q + h * u).collect()
        };
        let mut force = vec![0.0; self.iterate.len()];
        let mut residual = |iterate: &[f64], residual: &mut [f64]| {
            if system.force(&moved(iterate), iterate, time, &mut force).is_err() {
                return false;
            }
            for (residual, dof) in residual.iter_mut().zip(&free) {
                let mass = system.masses()[dof / D];
                *residual = mass * (self.velocities[*dof] - iterate[*dof]) + h * force[*dof];
            }
            residual.iter().all(|value| value.is_finite())
        };
        let end = moved(&self.iterate);
        let (scales, shortest) = scales(scene, &end, &self.iterate, time);
        let (far, fast) = (largest(&end), largest(&self.iterate).max(largest(&self.velocities)));
        // The end of the step is rounded, and so are the sums in the residual.
        let noise: Vec<f64> = free
            .iter()
            .map(|dof| {
                let Scale { force, by_position, by_velocity, .. } = scales[dof / D];
                let rounded = by_position * far + by_velocity * fast;
                let mass = system.masses()[dof / D];
                ROUNDING * (mass * fast + h * (force + rounded))
            })
            .collect();
        let rounding: Vec<f64> = free
            .iter()
            .map(|dof| {
                let Scale { by_position, by_velocity, .. } = scales[dof / D];
                let mass = system.masses()[dof / D];
                ROUNDING * (mass + h * (h * by_position + by_velocity))
            })
            .collect();

        let mut here = vec![0.0; free.len()];
        if !residual(&self.iterate, &mut here) {
            return Finding::Unknown;
        }
        let mut worst = (0.0, Estimate { value: 0.0, uncertainty: 0.0 });
        let mut compare = |value: f64, expected: f64, allowance: f64, size: f64| {
            let error = (value - expected).abs();
            let excess = if error == 0.0 { 0.0 } else { error / allowance };
            if excess > worst.0 || excess.is_nan() {
                let unit = if size > 0.0 { size } else { 1.0 };
                worst = (excess, Estimate { value: error / unit, uncertainty: allowance / unit });
            }
        };
        let size = largest(&here);
        for ((value, expected), noise) in self.residual.iter().zip(&here).zip(&noise) {
            compare(*value, *expected, *noise, size);
        }
        let first = power_of_two(shortest.map_or(1.0, |length| 0.25 * length / h));
        let size = self.matrix.amax();
        for (column, dof) in free.iter().enumerate() {
            let differences =
                differentiate(&mut residual, &self.iterate, *dof, Ladder::rounded(first), &noise);
            for (row, difference) in differences.iter().enumerate() {
                let Difference::Smooth(Estimate { value, uncertainty }) = difference else {
                    return Finding::Unknown;
                };
                compare(self.matrix[(row, column)], -value, uncertainty + rounding[row], size);
            }
        }
        Finding::Judged(worst.0, worst.1)
    }
}

/// The scales of all forces of a scene, and the shortest distance of two particles joined by one.
fn scales(scene: &Scene, x: &[f64], v: &[f64], time: f64) -> (Vec<Scale>, Option<f64>) {
    let laws = Laws::new(scene);
    (laws.scales(x, v, time), laws.shortest(x))
}

/// The systems judged so far.
#[derive(Default)]
struct Tally {
    systems: usize,
    evidence: usize,
    failed: bool,
    worst: Option<(f64, Estimate)>,
}

impl Tally {
    fn add(&mut self, finding: &Finding) {
        self.systems += 1;
        if let Finding::Judged(excess, error) = *finding {
            self.evidence += 1;
            if self.worst.is_none_or(|(known, _)| excess > known || excess.is_nan()) {
                self.worst = Some((excess, error));
            }
        }
    }

    fn finish(self, integrator: &'static str, scene: &'static str) -> NewtonCheck {
        let verdict = match self.worst {
            Some((excess, _)) if excess.is_nan() || excess > CLEAR => Verdict::Wrong,
            _ if self.failed => Verdict::Inconclusive(Reason::Degenerate),
            None => Verdict::Inconclusive(Reason::NoEvidence),
            Some(_) => Verdict::Correct,
        };
        let Self { systems, evidence, worst, .. } = self;
        NewtonCheck {
            integrator,
            scene,
            verdict,
            systems,
            evidence,
            error: worst.map(|each| each.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_newton_system_is_the_derivative_of_its_residual() {
        let checks = check_all();
        let takers = |case: &Case| {
            let options = ParseOptions::default();
            let scene = xml::parse(case.text, "", &vocabulary(), &options).unwrap().scene;
            let takes = |kind: &&&IntegratorKind| {
                scene.forces.iter().all(|force| (kind.schema.refuses)(force).is_none())
            };
            let solving = REGISTRY.iter().filter(|kind| kind.schema.matrix == Matrix::Jacobians);
            solving.filter(takes).count()
        };
        let expected: usize = CASES.iter().map(takers).sum();
        assert_eq!(checks.len(), expected);
        for check in checks {
            assert_eq!(check.verdict, Verdict::Correct, "{check:?}");
            // A projected system has another matrix; most systems of the chain under tension are not projected.
            let few = if check.integrator == "projected-newton" { check.systems / 2 } else { 0 };
            assert!(check.evidence + few >= check.systems, "{check:?}");
            // Implicit Euler takes several iterations a step.
            let least = if check.integrator == "implicit-euler" { 6 } else { 3 };
            assert!(check.systems >= least, "{check:?}");
            let error = check.error.unwrap();
            assert!(error.uncertainty < 1e-9, "{check:?}");
        }
    }

    /// The verdict on the first system of the damped springs, after `spoil`.
    fn verdict(spoil: fn(&mut Observed)) -> Verdict {
        let text = CASES[0].text;
        let scene = xml::parse(text, "", &vocabulary(), &ParseOptions::default()).unwrap().scene;
        let system = System::<2>::new(&scene);
        let integrator = REGISTRY.iter().find(|kind| kind.schema.name == "implicit-euler").unwrap();
        let mut method: Box<dyn simulator::integrator::Integrator<2>> =
            integrator.build(&scene, &system, LinearSolver::Auto);
        let (sender, receiver) = mpsc::channel();
        method.observe(Box::new(move |system| sender.send(Observed::of(system)).unwrap()));
        let step = Step {
            size: 0.05,
            time: 0.0,
            positions: &mut scene.positions(),
            velocities: &mut scene.velocities(),
            earlier: None,
            statistics: &mut Statistics::default(),
        };
        method.step(&system, step).unwrap();
        let mut observed = receiver.recv().unwrap();
        spoil(&mut observed);
        let mut tally = Tally::default();
        tally.add(&observed.judge(&system, &scene));
        tally.finish("", "").verdict
    }

    #[test]
    fn a_wrong_newton_system_is_called_wrong() {
        assert_eq!(verdict(|_| ()), Verdict::Correct);
        assert_eq!(
            verdict(|observed| observed.projected = true).reason(),
            Some(Reason::NoEvidence)
        );
        type Spoil = fn(&mut Observed);
        let mistakes: [(&str, Spoil); 6] = [
            ("one entry off by a millionth", |observed| observed.matrix[(1, 0)] *= 1.0 + 1e-6),
            ("transposed", |observed| observed.matrix.transpose_mut()),
            ("another time step", |observed| observed.h *= 1.001),
            ("the mass missing", |observed| observed.matrix[(0, 0)] -= 0.7),
            ("another residual", |observed| observed.residual[3] *= 1.0 + 1e-9),
            ("NaN", |observed| observed.matrix[(2, 2)] = f64::NAN),
        ];
        for (name, spoil) in mistakes {
            assert_eq!(verdict(spoil), Verdict::Wrong, "{name}");
        }
    }
}
