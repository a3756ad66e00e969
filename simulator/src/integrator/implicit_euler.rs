//! Implicit (backward) Euler, first order: Newton's method on the velocities of the step's end.
//!
//! ```text
//! M (v' − v) = h F(q + h v', v')        q' = q + h v'
//! ```
//!
//! Newton starts from `v` and stops when the l2 norm of the update is below 1e-9. Source: hand-out of
//! milestone 3, sections 5 and 10, equation (1).
//!
//! The damped step solves the same equations with a line search. If all forces derive from energies, Newton starts
//! from a minimum of the incremental potential ([`projected_newton`](super::projected_newton)), which is a solution;
//! otherwise the line search is on the residual in the norm `‖r‖²_W = Σ r_i²/m_i`, which has the unit of an energy.

use sparse::linear::LinearSolver;

use super::backward::{Curvature, Linearisation, Point};
use super::projected_newton::{MinimiserOptions, Norm, ProjectedNewton};
use super::record::Recording;
use super::{
    Integrator, IntegratorKind, Interrupt, IterationRecorder, Observer, Step, StepError, drift,
};
use crate::solver::line_search::backtrack_residual;
use crate::solver::newton::{Equations, NewtonError, NewtonOptions, newton};
use crate::solver::psd::Projection;
use crate::statistics::Statistics;
use crate::system::System;
use scene::Scene;
use scene::schema::{
    Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "implicit-euler",
        aliases: &["implicit"],
        summary: "m (v' - v) = h F(q', v'), q' = q + h v', by Newton's method to 1e-9",
        formula: "`M (v' − v) = h F(q', v', t + h)`, `q' = q + h v'`, by Newton's method from `v` until the update's l2 norm is below 1e-9",
        equation: StepEquation::ImplicitEuler,
        family: Family::Implicit,
        matrix: Matrix::Jacobians,
        convergence: Convergence::Update(NEWTON.tolerance),
        order: Order::always(1),
        options: &[],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

/// A hundred quadratically converging iterations would be far more than a solvable step takes.
pub(super) const NEWTON: NewtonOptions = NewtonOptions { tolerance: 1e-9, max_iterations: 100 };

fn build<const D: usize>(
    _scene: &Scene,
    system: &System<D>,
    solver: LinearSolver,
) -> Box<dyn Integrator<D>> {
    Box::new(ImplicitEuler::new(system, solver))
}

/// Descent to near the minimum, where Newton's method takes over: with projected Hessians the last digits converge
/// slowly.
const DESCENT: MinimiserOptions = MinimiserOptions {
    tolerance: 1e-2,
    curvature: Curvature::Jacobians(Projection::Clamp),
    norm: Norm::Component,
    min_iterations: 0,
    line_search: true,
    max_iterations: 200,
};

/// Descent on the incremental potential.
struct EnergyDescent<const D: usize> {
    solver: LinearSolver,
    /// Built at its first use.
    minimiser: Option<ProjectedNewton<D>>,
}

pub(super) struct ImplicitEuler<const D: usize> {
    /// `None` unless all forces derive from energies.
    descent: Option<EnergyDescent<D>>,
    linearisation: Linearisation<D>,
    iterate: Vec<f64>,
    delta: Vec<f64>,
    recording: Recording,
}

impl<const D: usize> Integrator<D> for ImplicitEuler<D> {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        self.iterate.copy_from_slice(step.velocities);
        self.newton(system, step, None)
    }

    fn step_damped(
        &mut self,
        system: &System<D>,
        mut step: Step<'_>,
    ) -> Option<Result<(), StepError>> {
        let Some(EnergyDescent { solver, minimiser }) = &mut self.descent else {
            self.iterate.copy_from_slice(step.velocities);
            let line_search = LineSearch::new(step.velocities.len());
            return Some(self.newton(system, step, Some(line_search)));
        };
        let minimiser =
            minimiser.get_or_insert_with(|| ProjectedNewton::new(system, *solver, DESCENT));
        match minimiser.minimise(system, &mut step) {
            // Even without convergence, the descent is a good initial guess.
            Ok(_) | Err(StepError::NotConverged { .. }) => {}
            Err(error) => return Some(Err(error)),
        }
        self.iterate.copy_from_slice(&minimiser.iterate);
        Some(self.newton(system, step, None))
    }

    fn observe(&mut self, observer: Observer) {
        self.linearisation.observe(observer);
    }

    fn record_by(&mut self, recorder: IterationRecorder) -> bool {
        self.recording = Recording::to(recorder);
        true
    }

    fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.linearisation.interrupt_by(interrupt);
    }
}

impl<const D: usize> ImplicitEuler<D> {
    pub(super) fn new(system: &System<D>, solver: LinearSolver) -> Self {
        let zeros = vec![0.0; system.n_particles() * D];
        let linearisation = Linearisation::new(system, solver);
        let descent = system.is_variational().then_some(EnergyDescent { solver, minimiser: None });
        let recording = Recording::default();
        Self { linearisation, iterate: zeros.clone(), delta: zeros, descent, recording }
    }

    /// Newton's method from the iterate.
    fn newton(
        &mut self,
        system: &System<D>,
        step: Step<'_>,
        line_search: Option<LineSearch>,
    ) -> Result<(), StepError> {
        let Step { size: h, time, positions, velocities, statistics, .. } = step;
        let linearisation = &mut self.linearisation;
        let mut equation = Equation {
            system,
            linearisation,
            start: (h, time + h, positions, velocities),
            line_search,
            statistics,
            recording: &mut self.recording,
            updates: 0,
        };
        let result = newton(&mut self.iterate, &mut self.delta, NEWTON, &mut equation);
        let residual = equation.linearisation.residual;
        let end = Point { h, time: time + h, positions, velocities, iterate: &self.iterate };
        let iterations = result.map_err(|error| failure(error, residual, end))?;
        self.recording.record(system, end, iterations, (Some(1.0), 0));
        statistics.newton_iterations += iterations;
        statistics.max_newton_iterations = statistics.max_newton_iterations.max(iterations);
        velocities.copy_from_slice(&self.iterate);
        drift(positions, velocities, h);
        Ok(())
    }
}

/// An update `δ` moves positions by `h δ`: it may be rounding where it is this small a part of `‖q‖/h`.
const POSITIONS: f64 = 16.0 * f64::EPSILON;

fn failure(error: NewtonError<StepError>, residual: f64, end: Point<'_>) -> StepError {
    match error {
        NewtonError::Update(error) => error,
        NewtonError::BelowRounding { iterations, update, size } => {
            StepError::BelowRounding { iterations, update, speed: size }
        }
        NewtonError::NotConverged { iterations, update } => {
            let Point { h: step, positions, .. } = end;
            let size = positions.iter().map(|place| place * place).sum::<f64>().sqrt();
            let rounding = POSITIONS * size / step;
            if update <= rounding {
                let tolerance = NEWTON.tolerance;
                StepError::BelowPositions { iterations, update, tolerance, size, step, rounding }
            } else {
                StepError::NotConverged { iterations, update, residual }
            }
        }
    }
}

/// `r(u) = M (v − u) + h F(q + h u, u)`.
struct Equation<'a, const D: usize> {
    system: &'a System<D>,
    linearisation: &'a mut Linearisation<D>,
    /// Step, its end, and the state it starts from.
    start: (f64, f64, &'a [f64], &'a [f64]),
    /// `None` for whole steps.
    line_search: Option<LineSearch>,
    statistics: &'a mut Statistics,
    recording: &'a mut Recording,
    /// Newton steps so far.
    updates: u64,
}

/// Workspace of the line search.
struct LineSearch {
    iterate: Vec<f64>,
    positions: Vec<f64>,
    force: Vec<f64>,
}

impl LineSearch {
    fn new(size: usize) -> Self {
        let zeros = vec![0.0; size];
        Self { iterate: zeros.clone(), positions: zeros.clone(), force: zeros }
    }
}

impl<const D: usize> Equations for Equation<'_, D> {
    type Error = StepError;

    fn update(&mut self, iterate: &[f64], delta: &mut [f64]) -> Result<(), StepError> {
        let (h, time, positions, velocities) = self.start;
        let point = Point { h, time, positions, velocities, iterate };
        if self.line_search.is_none() {
            let step_length = (self.updates > 0).then_some(1.0);
            self.recording.record(self.system, point, self.updates, (step_length, 0));
            self.updates += 1;
        }
        self.linearisation.solve(self.system, point, delta, self.statistics)
    }

    fn advance(&mut self, iterate: &mut [f64], delta: &[f64]) -> bool {
        let Some(LineSearch { iterate: trial, positions, force }) = &mut self.line_search else {
            iterate.iter_mut().zip(delta).for_each(|(value, change)| *value += change);
            return true;
        };
        let (h, time, start, velocities) = self.start;
        let halvings = backtrack_residual(iterate, delta, trial, |iterate| {
            positions.copy_from_slice(start);
            drift(positions, iterate, h);
            self.statistics.force_evaluations += 1;
            if self.system.force(positions, iterate, time, force).is_err() {
                return f64::INFINITY;
            }
            // A fixed particle has no force and keeps its velocity: it adds nothing.
            let particles = iterate.chunks_exact(D).zip(velocities.chunks_exact(D));
            let mut sum = 0.0;
            for (((iterate, start), force), mass) in
                particles.zip(force.chunks_exact(D)).zip(self.system.masses())
            {
                for axis in 0..D {
                    let residual = mass * (start[axis] - iterate[axis]) + h * force[axis];
                    sum += 0.5 * residual * residual / mass;
                }
            }
            sum
        });
        self.statistics.line_search_halvings += halvings.unwrap_or(0);
        halvings.is_some()
    }
}
