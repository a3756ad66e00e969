//! Which traces are kept as evidence.

use crate::suite::Case;

/// Maximum count of numbers that are recorded for a scene, and of coordinates of a state.
const MAX_NUMBERS: u64 = 200_000;
const MAX_COORDINATES: usize = 120;

/// Whether the states of a scene are few enough to be recorded.
pub fn is_recorded(case: &Case) -> bool {
    let coordinates = case.scene.particles.len() * case.scene.dimension.count();
    let numbers = (case.scene.n_steps() + 1).saturating_mul(2 * coordinates as u64);
    coordinates <= MAX_COORDINATES && numbers <= MAX_NUMBERS
}
