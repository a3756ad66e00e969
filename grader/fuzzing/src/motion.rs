//! Motions held in memory.

use std::slice::Iter;

use grader::submission::{StateSource, builtin};
use grader::verdict::Failure;
use scene::Scene;
use scene::trace::{Shape, State, TraceError, TraceReader};
use simulator::simulation::Simulation;
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;

/// All states of a scene by our own simulator.
///
/// # Errors
/// Why a step fails.
pub fn simulate(scene: &Scene) -> Result<Vec<State>, String> {
    let mut source = builtin::start(scene, LinearSolver::Auto);
    let (mut state, mut states) = (State::zeros(Shape::of(scene)), Vec::new());
    loop {
        match source.read(&mut state) {
            Ok(true) => states.push(state.clone()),
            Ok(false) => return Ok(states),
            Err(Failure::GaveUp { reason }) => return Err(reason.text()),
            Err(_) => return Err("a step fails".to_owned()),
        }
    }
}

/// The counts of a scene by our own simulator, up to a step that fails.
pub(crate) fn statistics(scene: &Scene) -> Statistics {
    let mut simulation = Simulation::new(scene);
    while matches!(simulation.advance(), Ok(true)) {}
    simulation.statistics().clone()
}

/// States that are read once more.
pub struct Replay<'a>(Iter<'a, State>);

impl<'a> Replay<'a> {
    /// From the first state on.
    pub fn of(states: &'a [State]) -> Self {
        Self(states.iter())
    }

    fn next(&mut self, state: &mut State) -> bool {
        let next = self.0.next();
        if let Some(next) = next {
            state.clone_from(next);
        }
        next.is_some()
    }
}

impl TraceReader for Replay<'_> {
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError> {
        Ok(self.next(state))
    }
}

impl StateSource for Replay<'_> {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        Ok(self.next(state))
    }
}

/// States of which each is read once.
pub struct Held(std::vec::IntoIter<State>);

impl Held {
    /// From the first state on.
    pub fn of(states: Vec<State>) -> Self {
        Self(states.into_iter())
    }
}

impl StateSource for Held {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        let next = self.0.next();
        let is_there = next.is_some();
        if let Some(next) = next {
            *state = next;
        }
        Ok(is_there)
    }
}
