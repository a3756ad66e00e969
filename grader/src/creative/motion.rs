//! A motion reduced to the states that a film shows.

use frames::Bounds;
use scene::Scene;
use scene::state::StateView;

/// Frames a second of simulated time.
const RATE: f64 = 24.0;

/// Number of coordinates in all frames together that is not exceeded by much.
const MAX_NUMBERS: u64 = 2_000_000;

/// Frames that a motion may have, however many particles there are.
const MIN_FRAMES: u64 = 60;

/// The states of a motion that are shown. Memory is bounded for scenes of any length.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Times, in seconds.
    pub times: Vec<f64>,
    /// Positions, one state after the other, each `n·D`, particle-major.
    pub positions: Vec<f64>,
    /// Bounds of all states, also of those that are not kept.
    pub bounds: Bounds,
    /// Seconds between two frames.
    interval: f64,
}

impl Motion {
    /// An empty motion of a scene.
    pub fn new(scene: &Scene) -> Self {
        let coordinates = (scene.particles.len() * scene.dimension.count()).max(1) as u64;
        let most = (MAX_NUMBERS / coordinates).max(MIN_FRAMES);
        let interval = (scene.duration / most as f64).max(1.0 / RATE);
        Self { times: Vec::new(), positions: Vec::new(), bounds: Bounds::default(), interval }
    }

    /// Adds a state if a frame is due. To be called for every state, in order.
    pub(super) fn add(&mut self, scene: &Scene, StateView { time, positions, .. }: StateView<'_>) {
        self.bounds.include(scene, positions);
        // A sum of time steps falls short of its frame by rounding.
        if self.times.len() as f64 * self.interval <= time + 1e-9 * time.max(1.0) {
            self.times.push(time);
            self.positions.extend_from_slice(positions);
        }
    }

    /// Seconds between two frames.
    pub fn interval(&self) -> f64 {
        self.interval
    }

    /// The positions of a frame.
    pub fn frame(&self, number: usize) -> &[f64] {
        let size = self.positions.len() / self.times.len().max(1);
        &self.positions[number * size..][..size]
    }
}
