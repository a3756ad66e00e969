//! Methods whose step is one of implicit Euler of another length, and from another start: Newton's method, its tolerance and
//! its line search are those of [`implicit_euler`](super::implicit_euler).

use sparse::linear::LinearSolver;

use super::implicit_euler::ImplicitEuler;
use super::{Integrator, Interrupt, IterationRecorder, Observer, Step, StepError};
use crate::system::System;
use scene::Scene;

/// A method's step in terms of implicit Euler's, with its workspace.
pub(super) trait Substep: Send + 'static {
    /// The workspace for so many coordinates.
    fn new(n_coordinates: usize) -> Self;

    /// Takes the step by one of `implicit`.
    fn step<const D: usize, R>(
        &mut self,
        system: &System<D>,
        step: Step<'_>,
        implicit: impl FnOnce(Step<'_>) -> R,
    ) -> R;
}

struct BySubstep<const D: usize, S> {
    implicit: ImplicitEuler<D>,
    substep: S,
}

/// Builds the method of this substep.
pub(super) fn build<const D: usize, S: Substep>(
    _scene: &Scene,
    system: &System<D>,
    solver: LinearSolver,
) -> Box<dyn Integrator<D>> {
    let substep = S::new(system.n_particles() * D);
    Box::new(BySubstep { implicit: ImplicitEuler::new(system, solver), substep })
}

impl<const D: usize, S: Substep> Integrator<D> for BySubstep<D, S> {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        self.substep.step(system, step, |step| self.implicit.step(system, step))
    }

    fn step_damped(&mut self, system: &System<D>, step: Step<'_>) -> Option<Result<(), StepError>> {
        self.substep.step(system, step, |step| self.implicit.step_damped(system, step))
    }

    fn observe(&mut self, observer: Observer) {
        self.implicit.observe(observer);
    }

    fn record_by(&mut self, recorder: IterationRecorder) -> bool {
        self.implicit.record_by(recorder)
    }

    fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.implicit.interrupt_by(interrupt);
    }
}
