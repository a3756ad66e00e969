//! States of a simulation, with their energies and momentum, as plain data.

/// One state of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateView<'a> {
    /// Number of the state: 0 is the initial one.
    pub step: u64,
    /// `step` times the time step, in seconds.
    pub time: f64,
    /// Positions, `n·D`, particle-major.
    pub positions: &'a [f64],
    /// Velocities, the same shape.
    pub velocities: &'a [f64],
}

/// Energies and momentum of a state. Fixed particles count as any other.
#[derive(Debug, Clone, PartialEq)]
pub struct Energies {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy of the forces that have one.
    pub potential: f64,
    /// Momentum, one component a dimension.
    pub momentum: Vec<f64>,
}
