//! Map of the measured spectral radius over `h ω` and the damping ratio.

use rayon::prelude::*;
use scene::schema::IntegratorSchema;
use simulator::integrator::REGISTRY;

use super::measured::Linear;

/// Cells along each axis.
pub const CELLS: [usize; 2] = [60, 48];

/// Decimal logarithms of the first and last edge along each axis.
pub const EDGES: [[f64; 2]; 2] = [[-2.0, 2.0], [-2.0, 2.0]];

/// A method's map.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The method.
    pub method: &'static str,
    /// Spectral radius at the centre of each cell, by rows of equal damping ratio from the lowest.
    pub radii: Vec<f64>,
}

/// The centre of a cell, as `(h ω, ζ)`.
pub fn middle(column: usize, row: usize) -> [f64; 2] {
    let at = |axis: usize, number: usize| {
        let [low, high] = EDGES[axis];
        10.0_f64.powf(low + (high - low) * (number as f64 + 0.5) / CELLS[axis] as f64)
    };
    [at(0, column), at(1, row)]
}

/// The maps of all methods that support a damped oscillator.
pub fn maps() -> Vec<Map> {
    let taken = Linear::oscillator(1.0);
    let takers = REGISTRY.iter().filter(|kind| taken.is_taken_by(&kind.schema));
    takers.map(|kind| map(&kind.schema)).collect()
}

fn map(integrator: &'static IntegratorSchema) -> Map {
    let row = |row: usize| -> Vec<f64> {
        let [_, zeta] = middle(0, row);
        let scene = Linear::oscillator(zeta);
        (0..CELLS[0]).map(|column| scene.radius(integrator, middle(column, row)[0])).collect()
    };
    let rows: Vec<Vec<f64>> = (0..CELLS[1]).into_par_iter().map(row).collect();
    Map { method: integrator.name, radii: rows.concat() }
}
