//! How a trace is packed, for `build.rs`, which packs, and `installed.rs`, which unpacks.
//!
//! Each number is stored as its distance from a prediction, counted in doubles. A column is predicted by the polynomial through its
//! last numbers, or by a step along the column of its velocity: `x + dt v`, with the velocity after the step, before it, or
//! the mean of both. Sums and products of doubles are the same on every platform, so that each number comes back to the bit.
//! The oracle takes a third of what it takes as deflated text.

use std::io::Write as _;

/// The number of polynomials: of degree 0, 1, and so on.
const POLYNOMIALS: usize = 7;

/// Distances to the column of velocities: the dimensions.
const DISTANCES: [usize; 2] = [2, 3];

/// The number of ways to predict a column.
pub(crate) const WAYS: usize = POLYNOMIALS + 3 * DISTANCES.len();

/// The order in which columns are packed: the time, then from the last one, as velocities stand behind positions.
pub(crate) fn order(columns: usize) -> impl Iterator<Item = usize> {
    (0..columns.min(1)).chain((1..columns).rev())
}

/// How far to the right the column of velocities is; `None` for a polynomial.
pub(crate) fn distance(way: usize) -> Option<usize> {
    way.checked_sub(POLYNOMIALS).and_then(|way| DISTANCES.get(way / 3).copied())
}

/// Predicts the number that follows these, from the velocities up to its row where the way needs them.
pub(crate) fn predict(way: usize, before: &[f64], velocities: &[f64], dt: f64) -> f64 {
    let row = before.len();
    let Some(last) = before.last() else { return 0.0 };
    if way >= POLYNOMIALS {
        let velocity = match (way - POLYNOMIALS) % 3 {
            0 => velocities[row],
            1 => velocities[row - 1],
            _ => (velocities[row - 1] + velocities[row]) / 2.0,
        };
        return last + dt * velocity;
    }
    let points = (way + 1).min(row);
    let mut binomial = 1.0;
    let mut sum = 0.0;
    for (back, value) in before.iter().rev().take(points).enumerate() {
        binomial = binomial * (points - back) as f64 / (back + 1) as f64;
        sum += if back % 2 == 0 { binomial * value } else { -binomial * value };
    }
    sum
}

/// Place of a double among all doubles, in their order, from its bits; its own inverse.
pub(crate) fn rank(bits: u64) -> u64 {
    let negative = bits.cast_signed() >> 63;
    bits ^ negative.cast_unsigned() >> 1
}

/// The text of a trace: its header, and a line for each row, which begins with the number of the row.
pub(crate) fn text(header: &str, columns: &[Vec<f64>]) -> Vec<u8> {
    let mut text = format!("{header}\n").into_bytes();
    let mut digits = ryu::Buffer::new();
    for row in 0..columns.first().map_or(0, Vec::len) {
        let _ = write!(text, "{row}");
        for column in columns {
            text.push(b',');
            text.extend(digits.format(column[row]).bytes());
        }
        text.push(b'\n');
    }
    text
}
