//! Which traces are kept as evidence.

use scene::Scene;
use scene::schema::Matrix;

use crate::change::rounds::is_of_rounds;

/// Maximum count of numbers that are recorded for a scene.
const MAX_NUMBERS: u64 = 200_000;

/// Maximum count of rows of the matrix of a step with which many changes are made.
const MAX_ROWS: usize = 120;

/// Maximum work for the matrices of all steps with which a few changes are made: the sum of the cubes of their rows.
const MAX_WORK: u64 = 200_000_000;

/// Whether the states of a scene are few enough to be recorded.
pub fn is_recorded(scene: &Scene) -> bool {
    let coordinates = scene.particles.len() * scene.dimension.count();
    let numbers = (scene.n_steps() + 1).saturating_mul(2 * coordinates as u64);
    let work = (rows(scene) as u64).pow(3).saturating_mul(scene.n_steps());
    numbers <= MAX_NUMBERS && (!is_large(scene) || work <= MAX_WORK)
}

/// Whether a step takes so long that the scene is compared with the causes that others show, and with no other change.
pub(super) fn is_large(scene: &Scene) -> bool {
    rows(scene) > MAX_ROWS
}

/// Rows of the matrix of a step: coordinates, or particles where rounds of local and global steps solve for all coordinates
/// by one matrix.
fn rows(scene: &Scene) -> usize {
    match scene.integrator.matrix {
        _ if is_of_rounds(scene) => scene.particles.len(),
        Matrix::None => 0,
        _ => scene.particles.len() * scene.dimension.count(),
    }
}
