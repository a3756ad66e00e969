//! Properties of a Jacobian as a whole, on request: symmetry, and invariance under translation and rotation.
//!
//! ```text
//! symmetry      J = Jᵀ
//! translation   Σ_b J_ab = 0: nothing changes if all particles move alike
//! rotation      f(Rx) = R f(x), by J R' x = R' f(x) for each generator R' of the rotations
//! ```

use crate::function::Function;
use crate::state::{Observation, State};
use crate::verdict::{ROUNDING, Reason, Verdict};

/// Violation, relative to the size of the terms, above which a property does not hold.
const VIOLATED: f64 = 1e-9;

/// A property of a Jacobian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Property {
    /// It is symmetric.
    Symmetry,
    /// It does not change when all particles move alike.
    Translation,
    /// It rotates with the particles.
    Rotation,
}

impl Property {
    /// All.
    pub const ALL: [Self; 3] = [Self::Symmetry, Self::Translation, Self::Rotation];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Symmetry => "symmetry",
            Self::Translation => "translation",
            Self::Rotation => "rotation",
        }
    }
}

/// A property with its verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PropertyFinding {
    /// The property.
    pub property: Property,
    /// The verdict.
    pub verdict: Verdict,
    /// The largest violation, relative to the terms.
    pub error: f64,
}

/// Checks a property at one state, of a function of particles with `dimension` coordinates.
pub fn check(
    property: Property,
    function: &Function<'_>,
    state: &State,
    seen: &Observation,
    dimension: usize,
) -> PropertyFinding {
    let (rows, columns, d) = (function.rows, function.columns, dimension.max(1));
    let all = seen.matrix.dense();
    let at = |row: usize, column: usize| all[column * rows + row];
    // Sums that must vanish, each with the sum of the sizes of its terms.
    let mut sums: Vec<(f64, f64)> = Vec::new();
    let is_square = rows == columns && rows.is_multiple_of(d);
    match property {
        Property::Symmetry if rows == columns => {
            let largest = all.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let pairs = (0..rows).flat_map(|row| (0..row).map(move |column| (row, column)));
            sums.extend(pairs.map(|(row, column)| (at(row, column) - at(column, row), largest)));
        }
        Property::Translation if columns.is_multiple_of(d) => {
            for (row, axis) in (0..rows).flat_map(|row| (0..d).map(move |axis| (row, axis))) {
                let terms = || (axis..columns).step_by(d).map(|column| at(row, column));
                sums.push((terms().sum(), terms().map(f64::abs).sum()));
            }
        }
        Property::Rotation if is_square && d > 1 => {
            for (i, j) in (0..d).flat_map(|i| (0..i).map(move |j| (i, j))) {
                let turned = |values: &[f64], place: usize| match place % d {
                    axis if axis == i => values[place - i + j],
                    axis if axis == j => -values[place - j + i],
                    _ => 0.0,
                };
                for row in 0..rows {
                    let product = |column| at(row, column) * turned(&state.x, column);
                    let sum: f64 = (0..columns).map(product).sum();
                    let size: f64 = (0..columns).map(|column| product(column).abs()).sum();
                    let force = turned(&seen.values, row);
                    let noise = seen.noise[row] / VIOLATED;
                    sums.push((sum - force, size + force.abs() + noise));
                }
            }
        }
        _ => {
            let verdict = Verdict::Inconclusive(Reason::NoEvidence);
            return PropertyFinding { property, verdict, error: 0.0 };
        }
    }
    let unit = if seen.single { f64::from(f32::EPSILON) / f64::EPSILON } else { 1.0 };
    let largest = sums.iter().map(|(sum, size)| if *size > 0.0 { sum.abs() / size } else { 0.0 });
    let error = largest.fold(0.0, f64::max);
    let allowed = (unit * ROUNDING * columns as f64).max(VIOLATED);
    let verdict = if error > allowed { Verdict::Wrong } else { Verdict::Correct };
    PropertyFinding { property, verdict, error }
}
