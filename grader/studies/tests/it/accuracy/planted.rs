//! Fitted orders of integrators with planted mistakes, by the same code that measures the built-in ones.

use grader::submission::StateSource;
use grader::verdict::Failure;
use scene::Scene;
use scene::trace::State;
use simulator::system::System;
use studies::accuracy::measure::follow;
use studies::accuracy::order::{self, ErrorSample, Expected, Fit};
use studies::accuracy::reference::Reference;
use studies::accuracy::{Errors, Quantity, RunOutcome};

use super::{closed, problem};

/// One step from `(x, v)`, by the size of the step and the acceleration.
type StepRule = fn(h: f64, a: &dyn Fn(&[f64]) -> Vec<f64>, x: &mut [f64], v: &mut [f64]);

/// An integrator defined by its step rule.
struct Planted {
    system: System<2>,
    rule: StepRule,
    x: Vec<f64>,
    v: Vec<f64>,
    h: f64,
    steps_left: Option<u64>,
    n_steps: u64,
}

impl Planted {
    fn new(scene: &Scene, rule: StepRule) -> Self {
        let flat = |vector: fn(&scene::Particle) -> [f64; 3]| {
            scene.particles.iter().flat_map(|each| vector(each)[..2].to_vec()).collect()
        };
        Self {
            system: System::new(scene),
            rule,
            x: flat(|each| each.position),
            v: flat(|each| each.velocity),
            h: scene.time_step,
            steps_left: None,
            n_steps: scene.n_steps(),
        }
    }
}

impl StateSource for Planted {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        match self.steps_left {
            None => self.steps_left = Some(self.n_steps),
            Some(0) => return Ok(false),
            Some(left) => {
                let system = &self.system;
                let acceleration = |x: &[f64]| {
                    let mut force = vec![0.0; x.len()];
                    let still = vec![0.0; x.len()];
                    system.force(x, &still, 0.0, &mut force).unwrap();
                    for (force, mass) in force.chunks_exact_mut(2).zip(system.masses()) {
                        force.iter_mut().for_each(|component| *component /= mass);
                    }
                    force
                };
                (self.rule)(self.h, &acceleration, &mut self.x, &mut self.v);
                self.steps_left = Some(left - 1);
            }
        }
        state.positions.copy_from_slice(&self.x);
        state.velocities.copy_from_slice(&self.v);
        Ok(true)
    }
}

fn add(values: &mut [f64], factor: f64, amount: &[f64]) {
    values.iter_mut().zip(amount).for_each(|(value, amount)| *value += factor * amount);
}

/// The fits of position, velocity and energy on the elliptic oscillator.
fn orders(rule: StepRule) -> [Fit; 3] {
    let problem = problem("ellipse");
    let coarsest = problem.scene();
    let reference = Reference::new(&coarsest, closed(problem).as_ref()).unwrap();
    let mut samples = [Vec::new(), Vec::new(), Vec::new()];
    for refinement in (0..8).map(|rung| 1 << rung) {
        let mut scene = coarsest.clone();
        scene.time_step /= refinement as f64;
        let mut source = Planted::new(&scene, rule);
        let outcome = follow(&mut source, &scene, &reference, refinement);
        let RunOutcome::Finished { largest, .. } = outcome else { panic!("{outcome:?}") };
        let of = |errors: Errors, quantity| errors.of(quantity);
        for (samples, quantity) in samples.iter_mut().zip(Quantity::ALL) {
            samples.push(ErrorSample {
                time_step: scene.time_step,
                error: of(largest, quantity),
                floor: of(reference.floor, quantity),
                rounding: 0.0,
            });
        }
    }
    samples.map(|samples| order::fit(&samples))
}

fn symplectic(h: f64, a: &dyn Fn(&[f64]) -> Vec<f64>, x: &mut [f64], v: &mut [f64]) {
    let force = a(x);
    add(v, h, &force);
    add(x, h, v);
}

#[test]
fn without_a_mistake_the_little_integrator_has_order_one() {
    for fit in orders(symplectic) {
        assert_eq!(order::agrees(fit, Expected::Order(1.0)), Some(true), "{fit:?}");
    }
}

#[test]
fn every_planted_mistake_breaks_the_order() {
    let half_the_force: StepRule = |h, a, x, v| {
        let force = a(x);
        add(v, 0.5 * h, &force);
        add(x, h, v);
    };
    let position_by_both_velocities: StepRule = |h, a, x, v| {
        let before = v.to_vec();
        let force = a(x);
        add(v, h, &force);
        add(x, h, v);
        add(x, 0.01 * h, &before);
    };
    let velocity_of_the_step_before_the_force: StepRule = |h, a, x, v| {
        // The velocity decays at a constant rate: unwanted damping.
        let force = a(x);
        add(v, h, &force);
        v.iter_mut().for_each(|component| *component *= 1.0 - 0.02 * h);
        add(x, h, v);
    };
    let step_size_squared: StepRule = |h, a, x, v| {
        let force = a(x);
        add(v, h * h, &force);
        add(x, h, v);
    };
    let mistakes = [
        ("half the force", half_the_force),
        ("position by old and new velocity", position_by_both_velocities),
        ("unwanted damping", velocity_of_the_step_before_the_force),
        ("h squared", step_size_squared),
    ];
    for (name, rule) in mistakes {
        let [position, velocity, _] = orders(rule);
        for fit in [position, velocity] {
            let Fit::Slope { slope, .. } = fit else { panic!("{name}: {fit:?}") };
            // The integrator solves a different motion: the error tends to a constant.
            assert!(slope.abs() < 0.2, "{name}: {slope}");
            assert_eq!(order::agrees(fit, Expected::Order(1.0)), Some(false), "{name}");
        }
    }
}

#[test]
fn order_two_is_distinguished_from_order_one() {
    let verlet: StepRule = |h, a, x, v| {
        let force = a(x);
        add(v, 0.5 * h, &force);
        add(x, h, v);
        let force = a(x);
        add(v, 0.5 * h, &force);
    };
    for fit in orders(verlet) {
        assert_eq!(order::agrees(fit, Expected::Order(2.0)), Some(true), "{fit:?}");
        assert_eq!(order::agrees(fit, Expected::Order(1.0)), Some(false), "{fit:?}");
    }
}
