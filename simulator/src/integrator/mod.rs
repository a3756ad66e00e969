//! Time integrators: one step of size `h` from `(x, v)`, one method a file.
//!
//! A fixed particle feels no force: its velocity never changes, and its position moves with that
//! velocity under every method.
//!
//! # Adding an integrator
//!
//! docs/adding-an-integrator.md walks through an example: a new file with an [`IntegratorKind`], a line in
//! [`REGISTRY`], its [`StepEquation`](scene::schema::StepEquation), that equation a second time in the grader's
//! `reference` crate, and a scene. All else derives from the facts of its [`IntegratorSchema`].

use sparse::LinearError;
use sparse::linear::LinearSolver;

use crate::force::Degenerate;
use crate::statistics::Statistics;
use crate::system::System;
use scene::Scene;
use scene::schema::IntegratorSchema;
use scene::trace::State;

mod backward;
mod euler;
mod interrupt;
mod observe;
mod record;
mod substep;

mod bdf2;
mod dormand_prince;
mod explicit_euler;
mod fast_mass_spring;
mod implicit_euler;
mod implicit_midpoint;
mod linearized_implicit_euler;
mod projected_newton;
mod runge_kutta_4;
mod symplectic_euler;
mod velocity_verlet;

pub use interrupt::Interrupt;
pub use observe::{NewtonSystem, Observer};
pub use record::{Iterate, IterationRecorder};

/// Every integrator.
pub static REGISTRY: &[&IntegratorKind] = &[
    &explicit_euler::KIND,
    &symplectic_euler::KIND,
    &linearized_implicit_euler::KIND,
    &implicit_euler::KIND,
    &projected_newton::KIND,
    &fast_mass_spring::KIND,
    &velocity_verlet::KIND,
    &runge_kutta_4::KIND,
    &implicit_midpoint::KIND,
    &dormand_prince::KIND,
    &bdf2::KIND,
];

/// An integrator as the registry knows it.
pub struct IntegratorKind {
    /// How a scene mentions it.
    pub schema: IntegratorSchema,
    /// Builds it for two dimensions.
    pub build_2d: fn(&Scene, &System<2>, LinearSolver) -> Box<dyn Integrator<2>>,
    /// Builds it for three dimensions.
    pub build_3d: fn(&Scene, &System<3>, LinearSolver) -> Box<dyn Integrator<3>>,
}

/// The integrators, in `D` dimensions.
pub trait BuildIntegrator<const D: usize> {
    /// Makes room for the system, and chooses solvers that fit it. `scene` is what the system was made
    /// of; it holds the method's options.
    fn build(
        &self,
        scene: &Scene,
        system: &System<D>,
        solver: LinearSolver,
    ) -> Box<dyn Integrator<D>>;
}

impl BuildIntegrator<2> for IntegratorKind {
    fn build(
        &self,
        scene: &Scene,
        system: &System<2>,
        solver: LinearSolver,
    ) -> Box<dyn Integrator<2>> {
        (self.build_2d)(scene, system, solver)
    }
}

impl BuildIntegrator<3> for IntegratorKind {
    fn build(
        &self,
        scene: &Scene,
        system: &System<3>,
        solver: LinearSolver,
    ) -> Box<dyn Integrator<3>> {
        (self.build_3d)(scene, system, solver)
    }
}

/// A method with the room it needs for one system.
///
/// A step depends on its [`Step`] alone, and on no step before it: single steps are taken again from the states of a trace.
/// The driver keeps the earlier state that a two-step method uses.
pub trait Integrator<const D: usize>: Send {
    /// Replaces the state by the one a time `step.size` later.
    ///
    /// # Errors
    /// Where the step has no answer; the state is then meaningless.
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError>;

    /// The same step, its own equations solved by a slower way that fails less; `None` for a method that has none.
    /// It is tried where [`step`](Self::step) has failed, and from the same state.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    fn step_damped(
        &mut self,
        _system: &System<D>,
        _step: Step<'_>,
    ) -> Option<Result<(), StepError>> {
        None
    }

    /// Whether the method has seen that the end of its last step is finite. If not, the caller looks.
    fn is_finite(&self) -> bool {
        false
    }

    /// Hands the linear systems of later steps to `observer`. A method that solves none, or one of another
    /// form, never calls it.
    fn observe(&mut self, _observer: Observer) {}

    /// Hands the iterates of later steps to `recorder`. False for a method that does not solve implicit Euler's equations
    /// by iterations: it never calls it.
    fn record_by(&mut self, _recorder: IterationRecorder) -> bool {
        false
    }

    /// Ends a step with [`StepError::Interrupted`] once `interrupt` is raised. A method that does not iterate ends its step
    /// as usual.
    fn interrupt_by(&mut self, _interrupt: &Interrupt) {}
}

/// The state that a step replaces, and what is kept of the work.
pub struct Step<'a> {
    /// Time step `h`.
    pub size: f64,
    /// When the step starts, in seconds.
    pub time: f64,
    /// Positions, `n·D`, particle-major.
    pub positions: &'a mut [f64],
    /// Velocities, the same shape.
    pub velocities: &'a mut [f64],
    /// The state at `time - size`, for two-step methods; `None` at the start of a run. Other methods ignore it.
    pub earlier: Option<&'a State>,
    /// Counts of the work done.
    pub statistics: &'a mut Statistics,
}

/// A step that has no answer.
#[derive(Debug, Clone, PartialEq)]
pub enum StepError {
    /// A force is not defined where the step needs it.
    Degenerate(Degenerate),
    /// Newton's method did not converge.
    NotConverged {
        /// Iterations made.
        iterations: u64,
        /// l2 norm of the last update of the velocities.
        update: f64,
        /// l2 norm of the equations' residual, in units of momentum, at the last iterate but one.
        residual: f64,
    },
    /// Newton's method cannot reach its tolerance: rounding of the velocities is above it.
    BelowRounding {
        /// Iterations made.
        iterations: u64,
        /// l2 norm of the last update of the velocities.
        update: f64,
        /// l2 norm of the velocities.
        speed: f64,
    },
    /// The same: rounding of the positions, over the time step, is above it.
    BelowPositions {
        /// Iterations made.
        iterations: u64,
        /// l2 norm of the last update of the velocities.
        update: f64,
        /// The tolerance of an update.
        tolerance: f64,
        /// l2 norm of the positions.
        size: f64,
        /// Time step.
        step: f64,
        /// Rounding error of the positions divided by the time step.
        rounding: f64,
    },
    /// Newton's step points where the incremental potential does not become smaller.
    NoDescent {
        /// Iterations made.
        iterations: u64,
        /// Largest component of the step, as a change of velocity.
        update: f64,
    },
    /// Error control divides the step without end.
    ErrorControl {
        /// Steps tried, taken or rejected.
        trials: u64,
        /// The size of the last one, in seconds.
        size: f64,
    },
    /// A linear system could not be solved.
    Linear(LinearError),
    /// The step was abandoned ([`Interrupt`]).
    Interrupted,
}

impl From<Degenerate> for StepError {
    fn from(degenerate: Degenerate) -> Self {
        Self::Degenerate(degenerate)
    }
}

impl From<LinearError> for StepError {
    fn from(error: LinearError) -> Self {
        Self::Linear(error)
    }
}

/// `x ← x + h·v`.
fn drift(positions: &mut [f64], velocities: &[f64], h: f64) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for (position, velocity) in positions.iter_mut().zip(velocities) {
                *position += h * velocity;
            }
        },
    );
}

/// `v ← v + h·F/m` for the particles that are free.
fn kick<const D: usize>(system: &System<D>, force: &[f64], h: f64, velocities: &mut [f64]) {
    let force = force.as_chunks::<D>().0;
    let velocities = velocities.as_chunks_mut::<D>().0;
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for free in system.free() {
                let particles = velocities[free.clone()].iter_mut().zip(&force[free.clone()]);
                for ((velocity, force), mass) in particles.zip(&system.masses()[free.clone()]) {
                    for (velocity, force) in velocity.iter_mut().zip(force) {
                        *velocity += h * (force / mass);
                    }
                }
            }
        },
    );
}
