//! The built-in simulator as a submission.

use scene::Scene;
use scene::trace::State;
use simulator::simulation::{Simulation, SimulationError};
use simulator::solver::linear::LinearSolver;

use super::StateSource;
use crate::verdict::Failure;

/// Starts the built-in simulator on a scene.
pub fn start(scene: &Scene, solver: LinearSolver) -> Box<dyn StateSource> {
    Box::new(BuiltInStates { simulation: Simulation::with_solver(scene, solver), started: false })
}

struct BuiltInStates {
    simulation: Simulation,
    started: bool,
}

impl StateSource for BuiltInStates {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        if self.started {
            let gave_up =
                |error: SimulationError| Failure::GaveUp { reason: error.to_string().into() };
            if !self.simulation.advance().map_err(gave_up)? {
                return Ok(false);
            }
        }
        self.started = true;
        let view = self.simulation.state();
        state.time = Some(view.time);
        state.positions.copy_from_slice(view.positions);
        state.velocities.copy_from_slice(view.velocities);
        Ok(true)
    }
}
