//! Single steps of the built-in simulator from a given state, and the one before it if the method uses it.
//!
//! Shapes: positions and velocities hold `n·D` numbers, particle-major. Cost: one step of the scene's integrator.

use scene::Scene;
use scene::state::{Energies, StateView};
use scene::trace::State;
use simulator::simulation::Simulation;
use simulator::solver::linear::LinearSolver;

/// The physics and the integrator of a scene.
pub struct Stepper {
    simulation: Simulation,
    time_step: f64,
}

/// Energy and momentum of a state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Invariants {
    /// Kinetic and potential energy.
    pub energy: f64,
    /// Momentum; z is 0 in two dimensions.
    pub momentum: [f64; 3],
}

impl Stepper {
    /// The physics of `scene` with the given linear solver.
    ///
    /// # Panics
    /// If the scene's integrator is not in the registry.
    pub fn new(scene: &Scene, solver: LinearSolver) -> Self {
        Self { simulation: Simulation::with_solver(scene, solver), time_step: scene.time_step }
    }

    /// Replaces the state at the beginning of step `step`, counted from 0, by the state at its end. `earlier` is the state
    /// one step before; the first step has none. Returns false if the step fails or its result is not finite.
    pub fn step(
        &mut self,
        step: u64,
        earlier: Option<&State>,
        positions: &mut [f64],
        velocities: &mut [f64],
    ) -> bool {
        self.simulation.set_state(step, earlier, positions, velocities);
        let done = matches!(self.simulation.advance(), Ok(true));
        let state = self.simulation.state();
        positions.copy_from_slice(state.positions);
        velocities.copy_from_slice(state.velocities);
        done
    }

    /// Energies and momentum of the state at the beginning of step `step`.
    pub fn energies(&self, step: u64, positions: &[f64], velocities: &[f64]) -> Energies {
        let time = step as f64 * self.time_step;
        self.simulation.energies_of(StateView { step, time, positions, velocities })
    }

    /// Energy and momentum of the state at the beginning of step `step`.
    pub fn invariants(&self, step: u64, positions: &[f64], velocities: &[f64]) -> Invariants {
        let energies = self.energies(step, positions, velocities);
        let mut momentum = [0.0; 3];
        momentum[..energies.momentum.len()].copy_from_slice(&energies.momentum);
        Invariants { energy: energies.kinetic + energies.potential, momentum }
    }
}
