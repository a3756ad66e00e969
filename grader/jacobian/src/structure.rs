//! Properties of a Jacobian as a whole: symmetry, and invariance under translation and rotation.
//!
//! ```text
//! symmetry      J = Jᵀ
//! translation   Σ_b J_ab = 0: nothing changes if all particles move alike
//! rotation      f(Rx) = R f(x), J(Rx) = R J(x) Rᵀ
//! ```
//!
//! Each is a list of [`Pair`]s: two numbers that must agree within an allowance. Matrices are functions of row and column.

use std::ops::Range;

use crate::function::Function;
use crate::state::{Observation, State};
use crate::verdict::{ROUNDING, Reason, Verdict};

/// Violation, relative to the size of the terms, above which a property does not hold.
const VIOLATED: f64 = 1e-9;

/// Two numbers that must agree within an allowance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The number found.
    pub value: f64,
    /// The number that it must be.
    pub expected: f64,
    /// The size of their difference that is due to rounding.
    pub allowance: f64,
}

impl Pair {
    /// The difference, in terms of the allowance; not a number if a number is not.
    pub fn excess(self) -> f64 {
        let error = (self.value - self.expected).abs();
        if error == 0.0 { 0.0 } else { error / self.allowance }
    }
}

/// `J = Jᵀ`, of `n` rows. `allowance` is by row and column.
pub fn symmetry(
    entry: impl Fn(usize, usize) -> f64,
    n: usize,
    allowance: impl Fn(usize, usize) -> f64,
) -> impl Iterator<Item = Pair> {
    let pairs = (0..n).flat_map(|row| (0..=row).map(move |column| (row, column)));
    pairs.map(move |(row, column)| Pair {
        value: entry(row, column),
        expected: entry(column, row),
        allowance: allowance(row, column),
    })
}

/// `Σ_b J_ab = 0`, of so many rows and columns. `allowance` is by row and axis.
pub fn translation(
    entry: impl Fn(usize, usize) -> f64,
    [rows, columns]: [usize; 2],
    dimension: usize,
    allowance: impl Fn(usize, usize) -> f64,
) -> impl Iterator<Item = Pair> {
    let places = (0..rows).flat_map(move |row| (0..dimension).map(move |axis| (row, axis)));
    places.map(move |(row, axis)| Pair {
        value: (axis..columns).step_by(dimension).map(|column| entry(row, column)).sum(),
        expected: 0.0,
        allowance: allowance(row, axis),
    })
}

/// A rotation of particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    dimension: usize,
    /// The matrix, by row and column.
    matrix: [[f64; 3]; 3],
}

impl Rotation {
    /// About z, by the angle of a triangle with sides 3, 4 and 5.
    pub fn about_z(dimension: usize) -> Self {
        Self { dimension, matrix: [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]] }
    }

    /// The same, followed by one about x.
    pub fn about_every_axis() -> Self {
        let about_x = [[1.0, 0.0, 0.0], [0.0, 0.28, -0.96], [0.0, 0.96, 0.28]];
        let about_z = Self::about_z(3).matrix;
        let product = |row: usize, column: usize| {
            (0..3).map(|inner| about_x[row][inner] * about_z[inner][column]).sum()
        };
        let matrix = std::array::from_fn(|row| std::array::from_fn(|column| product(row, column)));
        Self { dimension: 3, matrix }
    }

    /// The coordinates of the particle that coordinate `place` is of, and its axis.
    fn particle_of(self, place: usize) -> (Range<usize>, usize) {
        let (start, axis) = (place - place % self.dimension, place % self.dimension);
        (start..start + self.dimension, axis)
    }

    /// The vector of every particle, rotated.
    pub fn turned(self, values: &[f64]) -> Vec<f64> {
        let component = |place: usize| {
            let (particle, axis) = self.particle_of(place);
            self.matrix[axis].iter().zip(&values[particle]).map(|(r, value)| r * value).sum()
        };
        (0..values.len()).map(component).collect()
    }

    /// The entry of `R J Rᵀ` at a row and a column.
    pub fn conjugated(self, entry: impl Fn(usize, usize) -> f64, row: usize, column: usize) -> f64 {
        let (rows, across) = self.particle_of(row);
        let (columns, down) = self.particle_of(column);
        let along = |row: usize| -> f64 {
            let terms = columns.clone().zip(self.matrix[down]);
            terms.map(|(column, r)| entry(row, column) * r).sum()
        };
        rows.zip(self.matrix[across]).map(|(row, r)| r * along(row)).sum()
    }
}

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

impl PropertyFinding {
    fn without_evidence(property: Property) -> Self {
        Self { property, verdict: Verdict::Inconclusive(Reason::NoEvidence), error: 0.0 }
    }
}

/// Checks a property at one state, of a function of particles with `dimension` coordinates.
pub fn check(
    property: Property,
    function: &mut Function<'_>,
    state: &State,
    seen: &Observation,
    dimension: usize,
) -> PropertyFinding {
    let (rows, columns, d) = (function.rows, function.columns, dimension.max(1));
    let all = seen.matrix.dense();
    let at = |row: usize, column: usize| all[column * rows + row];
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    let size = largest(&all);
    // The allowance of a pair is the size of its terms.
    let pairs: Vec<Pair> = match property {
        Property::Symmetry if rows == columns => symmetry(at, rows, |_, _| size).collect(),
        Property::Translation if columns.is_multiple_of(d) => {
            let terms = |row: usize, axis: usize| {
                (axis..columns).step_by(d).map(|column| at(row, column).abs()).sum()
            };
            translation(at, [rows, columns], d, terms).collect()
        }
        Property::Rotation if rows == columns && rows.is_multiple_of(d) && (2..=3).contains(&d) => {
            let turn = if d == 2 { Rotation::about_z(2) } else { Rotation::about_every_axis() };
            let x = turn.turned(&state.x);
            let mut values = vec![0.0; rows];
            if !function.evaluate(&x, &mut values) {
                return PropertyFinding::without_evidence(property);
            }
            // The rotated arguments are rounded.
            let moved = largest(&x) * size * columns as f64;
            let force = largest(&seen.values) + moved + largest(&seen.noise) / VIOLATED;
            let turned = turn.turned(&seen.values).into_iter().zip(values);
            let of_values =
                turned.map(|(expected, value)| Pair { value, expected, allowance: force });
            let there = function.jacobian(&x).dense();
            let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
            let of_entries = places.map(|(row, column)| Pair {
                value: there[column * rows + row],
                expected: turn.conjugated(at, row, column),
                allowance: size,
            });
            of_values.chain(of_entries).collect()
        }
        _ => return PropertyFinding::without_evidence(property),
    };
    let unit = if seen.single { f64::from(f32::EPSILON) / f64::EPSILON } else { 1.0 };
    let allowed = (unit * ROUNDING * columns as f64).max(VIOLATED);
    let error = pairs.into_iter().map(Pair::excess).fold(0.0, f64::max);
    let verdict = if error > allowed { Verdict::Wrong } else { Verdict::Correct };
    PropertyFinding { property, verdict, error }
}
