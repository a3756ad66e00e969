//! Velocities of a trace that holds positions alone: `v' = (x' − x)/h`, and those of the scene in the initial state.

use super::{State, TraceError, TraceReader};
use crate::Scene;

/// A trace whose velocities are differences of positions.
pub(super) struct DerivedVelocities<R> {
    reader: R,
    time_step: f64,
    /// Velocities of the initial state.
    initial: Vec<f64>,
    /// Positions of the state before; `None` before the first.
    previous: Option<Vec<f64>>,
}

impl<R: TraceReader> DerivedVelocities<R> {
    pub(super) fn new(reader: R, scene: &Scene) -> Self {
        Self { reader, time_step: scene.time_step, initial: scene.velocities(), previous: None }
    }
}

impl<R: TraceReader> TraceReader for DerivedVelocities<R> {
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError> {
        if !self.reader.read(state)? {
            return Ok(false);
        }
        match &mut self.previous {
            None => {
                state.velocities.copy_from_slice(&self.initial);
                self.previous = Some(state.positions.clone());
            }
            Some(previous) => {
                let velocities = state.velocities.iter_mut().zip(&state.positions).zip(&*previous);
                for ((velocity, new), old) in velocities {
                    *velocity = (new - old) / self.time_step;
                }
                previous.copy_from_slice(&state.positions);
            }
        }
        Ok(true)
    }

    fn has_velocities(&self) -> bool {
        false
    }
}
