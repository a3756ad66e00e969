//! Which traces are kept as evidence.

use crate::change::rounds::is_of_rounds;

use scene::Scene;

/// Maximum count of numbers that are recorded for a scene, and of rows of the matrix of a step: coordinates, or particles
/// where rounds of local and global steps solve for all coordinates by one matrix.
const MAX_NUMBERS: u64 = 200_000;
const MAX_ROWS: usize = 120;

/// Whether the states of a scene are few enough to be recorded.
pub fn is_recorded(scene: &Scene) -> bool {
    let coordinates = scene.particles.len() * scene.dimension.count();
    let numbers = (scene.n_steps() + 1).saturating_mul(2 * coordinates as u64);
    let rows = if is_of_rounds(scene) { scene.particles.len() } else { coordinates };
    rows <= MAX_ROWS && numbers <= MAX_NUMBERS
}
