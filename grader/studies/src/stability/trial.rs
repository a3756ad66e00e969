//! Trial: runs a case with a method and a time step, and checks each result.
//!
//! ```text
//! blow-up     E − E₀ > 10 S        S: the available energy of the case (Case::energy)
//! equation    each of the first 32 steps, every 2ᵏ-th and the last satisfy the method's equation (equation.rs)
//! momentum    Σ m (v − v₀) equals the impulse of external forces, within the summed bounds of the equations
//! spin        Σ m x × v is conserved by symplectic explicit methods if all forces conserve it
//! recurrence  the state of an oscillator is a power of its matrix, if the case is an oscillator and steps are not
//!             divided by error control
//! residual    no linear solution was accepted with a residual above 256 ε
//! ```
//!
//! A failed check gives the outcome `WRONG`, a silent violation of the method, whatever was expected.

use std::time::Instant;

use nalgebra::DVector;
use scene::schema::{Conserves, Dependence, Family, IntegratorSchema};
use scene::{ForceElement, Scene};
use simulator::simulation::{Simulation, SimulationOptions};

use super::cases::Case;
use super::outcome::{Measured, Outcome, Reason, Trial};
use reference::equation::{Equation, State};
use reference::laws::Laws;
use reference::method::Method;

/// A rise of the energy by more than this many times the available energy is a blow-up.
pub const BOUND: f64 = 10.0;

/// Number of first steps that are all checked.
const FIRST_STEPS: u64 = 32;

/// Bound of the residual of a linear solution: see `equation.rs`.
const RESIDUAL: f64 = 256.0 * f64::EPSILON;

/// A trial to run.
#[derive(Clone, Copy)]
pub struct Task {
    /// The case.
    pub case: &'static Case,
    /// The method.
    pub integrator: &'static IntegratorSchema,
    /// Time step in seconds.
    pub time_step: f64,
    /// Number of steps.
    pub steps: u64,
    /// Whether the simulator falls back on other methods for steps that fail.
    pub robust: bool,
}

/// Runs a trial; `None` if the method does not support the case's forces.
pub fn run(task: Task) -> Option<Trial> {
    let Task { case, integrator, time_step, steps, robust } = task;
    let draft = (case.draft)();
    if !draft.is_taken_by(integrator) {
        return None;
    }
    let scene = draft.scene(case.name, integrator, time_step, steps);
    let started = Instant::now();
    let (outcome, measured) = Run::new(case, &scene, robust).finish();
    Some(Trial {
        case: case.name,
        method: integrator.name,
        time_step,
        steps,
        robust,
        outcome,
        measured,
        seconds: started.elapsed().as_secs_f64(),
    })
}

struct Run<'a> {
    case: &'a Case,
    scene: &'a Scene,
    simulation: Simulation,
    equation: Equation,
    measured: Measured,
    /// The energy and the momentum at the start.
    energy: f64,
    momentum: Vec<f64>,
    /// Largest bound of a step's equations, summed over the particles.
    allowed: f64,
    /// Largest momentum carried or added so far.
    carried: f64,
    failed: Option<(&'static str, f64)>,
}

impl<'a> Run<'a> {
    fn new(case: &'a Case, scene: &'a Scene, robust: bool) -> Self {
        let config = SimulationOptions { robust, ..SimulationOptions::default() };
        let simulation = Simulation::with_options(scene, config);
        let energies = simulation.energies().ok();
        let energy = energies.as_ref().map_or(f64::NAN, |all| all.kinetic + all.potential);
        let momentum = energies.map_or_else(Vec::new, |all| all.momentum);
        Self {
            case,
            scene,
            simulation,
            equation: Equation::new(scene),
            measured: Measured::default(),
            energy,
            momentum,
            allowed: 0.0,
            carried: 0.0,
            failed: None,
        }
    }

    fn finish(mut self) -> (Outcome, Measured) {
        let outcome = self.advance();
        let statistics = self.simulation.statistics();
        let measured = &mut self.measured;
        measured.steps = statistics.steps;
        measured.newton_iterations = statistics.newton_iterations;
        measured.max_newton_iterations = statistics.max_newton_iterations;
        measured.worst_residual = statistics.linear.worst_residual;
        measured.rescue = statistics.fallback;
        self.check_end();
        let outcome = match (outcome, self.failed) {
            (_, Some((check, excess))) => Outcome::Wrong { check: check.to_owned(), excess },
            (outcome, None) => outcome,
        };
        (outcome, self.measured)
    }

    fn advance(&mut self) -> Outcome {
        let n_steps = self.simulation.n_steps();
        let (mut earlier, mut from) = (None, State::default());
        for step in 1..=n_steps {
            let is_checked = step <= FIRST_STEPS || step.is_power_of_two() || step == n_steps;
            if is_checked {
                let state = self.simulation.state();
                from = State { x: state.positions.to_vec(), v: state.velocities.to_vec() };
                earlier = self
                    .simulation
                    .earlier()
                    .map(|state| State { x: state.positions.clone(), v: state.velocities.clone() });
            }
            let substepped = self.simulation.statistics().fallback.substepped;
            if let Err(error) = self.simulation.advance() {
                let message = error.kind.to_string();
                return Outcome::Failed { step, reason: Reason::of(&error.kind), message };
            }
            let energies = match self.simulation.energies() {
                Ok(energies) => energies,
                Err(error) => {
                    let message = error.kind.to_string();
                    return Outcome::Failed { step, reason: Reason::of(&error.kind), message };
                }
            };
            let rise = (energies.kinetic + energies.potential - self.energy) / self.case.energy;
            self.measured.energy = rise;
            self.measured.energy_rise = self.measured.energy_rise.max(rise);
            // A step replaced by smaller steps does not satisfy this equation.
            if is_checked && self.simulation.statistics().fallback.substepped == substepped {
                let time = (step - 1) as f64 * self.scene.time_step;
                self.check_equation(earlier.as_ref(), &from, time);
            }
            if rise > BOUND {
                return Outcome::BlowUp { step };
            }
            if is_checked {
                self.check_momentum(&energies.momentum, step);
            }
        }
        Outcome::Survived
    }

    /// Records a check: wrong if above 1 or NaN.
    fn note(&mut self, check: &'static str, excess: f64) {
        let holds = excess <= 1.0;
        if !holds && self.failed.is_none() {
            self.failed = Some((check, excess));
        }
    }

    fn check_equation(&mut self, earlier: Option<&State>, from: &State, time: f64) {
        let state = self.simulation.state();
        let to = State { x: state.positions.to_vec(), v: state.velocities.to_vec() };
        let (excess, allowed) = self.equation.excess(earlier, from, &to, time);
        self.allowed = self.allowed.max(allowed);
        self.measured.equation = Some(self.measured.equation.unwrap_or(0.0).max(excess));
        self.note("equation", excess);
    }

    /// Checks momentum: forces between particles conserve it, and gravity adds to it at a constant rate.
    ///
    /// The equation of momentum is the sum of the particles' equations, so its bound is the sum of their bounds, which
    /// accumulates with every step. Storing `v'` and summing `m v'` over `n` particles adds a rounding error of
    /// `(n + 1) ε Σ m |v'|`, `n + 1 < 256`, of the largest momentum carried so far.
    fn check_momentum(&mut self, momentum: &[f64], step: u64) {
        let scene = self.scene;
        let is_uniform = |force: &ForceElement| force.schema.depends_on() == Dependence::NOTHING;
        let keeps_momentum = |force: &ForceElement| force.schema.conserves >= Conserves::Momentum;
        let is_free = scene.particles.iter().all(|particle| !particle.fixed)
            && scene.forces.iter().all(|force| keeps_momentum(force) || is_uniform(force));
        if !is_free || scene.particles.is_empty() {
            return;
        }
        let time = step as f64 * scene.time_step;
        let state = self.simulation.state();
        let axes = scene.dimension.count();
        let carried = state.velocities.chunks(axes).zip(&scene.particles);
        let carried: f64 = carried
            .map(|(v, particle)| particle.mass * v.iter().map(|v| v.abs()).sum::<f64>())
            .sum();
        // The same at every state and time.
        let pushes: Vec<ForceElement> =
            scene.forces.iter().filter(|force| is_uniform(force)).cloned().collect();
        let uniform = Laws::of(scene, &pushes).force(state.positions, state.velocities, 0.0);
        let mut drift = 0.0_f64;
        let mut given = 0.0_f64;
        for (axis, (momentum, start)) in momentum.iter().zip(&self.momentum).enumerate() {
            let push: f64 = uniform.iter().skip(axis).step_by(axes).sum();
            drift = drift.max((momentum - start - time * push).abs());
            given += start.abs() + (time * push).abs();
        }
        // Rounding errors from faster motion earlier remain in the sum.
        self.carried = self.carried.max(carried + given);
        let size = self.carried;
        let relative = if drift == 0.0 { 0.0 } else { drift / size };
        self.measured.momentum = Some(self.measured.momentum.unwrap_or(0.0).max(relative));
        let allowed = step as f64 * (self.allowed + RESIDUAL * size);
        self.note("momentum", if drift == 0.0 { 0.0 } else { drift / allowed });
    }

    fn check_end(&mut self) {
        let residual = self.measured.worst_residual;
        self.note("linear residual", residual / RESIDUAL);
        if self.measured.steps < self.simulation.n_steps() {
            return;
        }
        if self.measured.rescue.substepped == 0 {
            self.check_recurrence();
        }
        self.check_spin();
    }

    /// Compares an oscillator's state with the power of its matrix, in the norm `|x| + |v|/ω`, in which the power does
    /// not grow for a stable step.
    fn check_recurrence(&mut self) {
        let Some(oscillator) = self.case.oscillator else { return };
        let (scene, steps) = (self.scene, self.measured.steps);
        let (h, omega) = (scene.time_step, oscillator.omega);
        let method = Method::of(scene.integrator.equation);
        if matches!(method, Method::Controlled(_)) {
            return;
        }
        let [first, matrix] = [false, true].map(|has_earlier| {
            method.with_earlier(has_earlier).oscillator(h * omega, oscillator.zeta)
        });
        let particle = scene.particles.iter().position(|particle| !particle.fixed).unwrap_or(0);
        let axes = scene.dimension.count();
        let state = self.simulation.state();
        let (positions, velocities) = (state.positions.to_vec(), state.velocities.to_vec());
        let start = &scene.particles[particle];
        // Bound of the rounding error and of the tolerance for an update of the velocity, in a step.
        let tolerance = scene.integrator.convergence.tolerance(scene);
        for axis in 0..axes {
            // The first step of a two-step method uses no earlier state, which stays zero.
            let mut z = DVector::zeros(matrix.nrows());
            (z[0], z[1]) = (start.position[axis], start.velocity[axis] / omega);
            let mut largest = z[0].abs() + z[1].abs();
            for step in 0..steps {
                z = if step == 0 { &first * z } else { &matrix * z };
                largest = largest.max(z[0].abs() + z[1].abs());
            }
            let place = particle * axes + axis;
            let got = [positions[place], velocities[place] / omega];
            let error = (got[0] - z[0]).abs() + (got[1] - z[1]).abs();
            let factor = matrix.amax().max(1.0);
            let rounding = RESIDUAL * factor * largest;
            let allowed = steps as f64 * (rounding + (h + 1.0 / omega) * tolerance);
            self.note("recurrence", if error == 0.0 { 0.0 } else { error / allowed });
        }
    }

    /// Checks spin: forces that are turned with their particles conserve it, and so does `x' = x + h v'`: `m x' × v' − m x × v = m x × (v' − v)`.
    /// Velocity Verlet is half a step of this and half a step of its adjoint.
    ///
    /// The bound is that of the step's equation times the largest coordinate as its lever arm, plus the rounding error
    /// of the products, of size `m |x| |v|`.
    fn check_spin(&mut self) {
        let scene = self.scene;
        let keeps_spin =
            |force: &ForceElement| force.schema.conserves >= Conserves::AngularMomentum;
        let is_free = scene.forces.iter().all(keeps_spin)
            && scene.particles.iter().all(|particle| !particle.fixed);
        if scene.integrator.family != Family::Symplectic || !is_free {
            return;
        }
        let axes = scene.dimension.count();
        let spin = |x: &[f64], v: &[f64], mass: f64| mass * (x[0] * v[1] - x[1] * v[0]);
        let size = |x: &[f64], v: &[f64], mass: f64| mass * x[0].hypot(x[1]) * v[0].hypot(v[1]);
        let state = self.simulation.state();
        let (mut drift, mut scale) = (0.0, 0.0);
        let vectors = state.positions.chunks(axes).zip(state.velocities.chunks(axes));
        for (particle, (x, v)) in scene.particles.iter().zip(vectors) {
            let (x0, v0) = (&particle.position, &particle.velocity);
            drift += spin(x, v, particle.mass) - spin(x0, v0, particle.mass);
            scale += size(x, v, particle.mass) + size(x0, v0, particle.mass);
        }
        let arm = state.positions.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let steps = self.measured.steps as f64;
        let allowed = steps * (RESIDUAL * scale + arm * self.allowed);
        self.note("spin", if drift == 0.0 { 0.0 } else { drift.abs() / allowed });
    }
}
