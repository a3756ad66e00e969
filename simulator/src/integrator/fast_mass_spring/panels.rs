//! Supernodal Cholesky factor with substitution for all coordinates at once.
//!
//! ```text
//! Q = L Lᵀ        L y = b, then Lᵀ x = y, for the D columns of b at once
//! ```
//!
//! Columns of `L` with the same rows below them (a supernode) are cut into panels of up to eight columns. A
//! panel holds its lower triangle, the diagonal inverted, and then its rows, one after another: forward
//! substitution takes a sum along each row, backward substitution adds multiples of it, and both go through
//! memory in order. The index of a row is read once for all columns of a panel, and each entry of `L` once
//! for all coordinates of a particle, which stand side by side. Cost: two multiplications and additions an
//! entry and coordinate.

use crate::sizes::WIDEST;

/// The factor of an `n × n` matrix.
#[derive(Default)]
pub(super) struct Panels {
    panels: Vec<Panel>,
    /// Rows below the triangle of each panel.
    rows: Vec<u32>,
    /// Triangle, then rows, of each panel.
    values: Vec<f64>,
}

struct Panel {
    first: usize,
    width: usize,
    n_rows: usize,
}

impl Panels {
    /// An empty factor with the capacity for about so many entries.
    pub(super) fn with_capacity(
        n_values: usize,
    ) -> Result<Self, std::collections::TryReserveError> {
        let mut values = Vec::new();
        values.try_reserve_exact(n_values)?;
        Ok(Self { panels: Vec::new(), rows: Vec::new(), values })
    }

    /// Adds the supernode of `width` columns from `first` on, with these rows below its triangle.
    /// `value(i, j)` is the entry in the `i`-th of its rows, those of the triangle first, and `j`-th column.
    pub(super) fn push(
        &mut self,
        first: usize,
        width: usize,
        below: &[u32],
        value: impl Fn(usize, usize) -> f64,
    ) {
        let end = width + below.len();
        for start in (0..width).step_by(WIDEST) {
            let stop = (start + WIDEST).min(width);
            for column in start..stop {
                self.values.push(1.0 / value(column, column));
                self.values.extend((column + 1..stop).map(|row| value(row, column)));
            }
            for row in stop..end {
                self.values.extend((start..stop).map(|column| value(row, column)));
            }
            self.rows.extend((stop..width).map(|row| (first + row) as u32));
            self.rows.extend_from_slice(below);
            let (first, width, n_rows) = (first + start, stop - start, end - stop);
            self.panels.push(Panel { first, width, n_rows });
        }
    }

    /// Entries of the factor, with the zeros that its supernodes hold.
    pub(super) fn n_values(&self) -> usize {
        self.values.len()
    }

    /// Replaces the right-hand side by the solution, a particle an entry.
    pub(super) fn solve<const P: usize>(&self, x: &mut [[f64; P]]) {
        let (mut rows, mut values) = (self.rows.as_slice(), self.values.as_slice());
        for panel in &self.panels {
            let (of_panel, others) = rows.split_at(panel.n_rows);
            let (entries, rest) = values.split_at(panel.n_values());
            (rows, values) = (others, rest);
            panel.forward(entries, of_panel, x);
        }
        let (mut rows, mut values) = (self.rows.as_slice(), self.values.as_slice());
        for panel in self.panels.iter().rev() {
            let (others, of_panel) = rows.split_at(rows.len() - panel.n_rows);
            let (rest, entries) = values.split_at(values.len() - panel.n_values());
            (rows, values) = (others, rest);
            panel.backward(entries, of_panel, x);
        }
    }
}

impl Panel {
    fn n_values(&self) -> usize {
        self.width * (self.width + 1) / 2 + self.width * self.n_rows
    }

    fn forward<const P: usize>(&self, values: &[f64], rows: &[u32], x: &mut [[f64; P]]) {
        match self.width {
            1 => forward::<P, 1>(self.first, values, rows, x),
            2 => forward::<P, 2>(self.first, values, rows, x),
            3 => forward::<P, 3>(self.first, values, rows, x),
            4 => forward::<P, 4>(self.first, values, rows, x),
            5 => forward::<P, 5>(self.first, values, rows, x),
            6 => forward::<P, 6>(self.first, values, rows, x),
            7 => forward::<P, 7>(self.first, values, rows, x),
            _ => forward::<P, WIDEST>(self.first, values, rows, x),
        }
    }

    fn backward<const P: usize>(&self, values: &[f64], rows: &[u32], x: &mut [[f64; P]]) {
        match self.width {
            1 => backward::<P, 1>(self.first, values, rows, x),
            2 => backward::<P, 2>(self.first, values, rows, x),
            3 => backward::<P, 3>(self.first, values, rows, x),
            4 => backward::<P, 4>(self.first, values, rows, x),
            5 => backward::<P, 5>(self.first, values, rows, x),
            6 => backward::<P, 6>(self.first, values, rows, x),
            7 => backward::<P, 7>(self.first, values, rows, x),
            _ => backward::<P, WIDEST>(self.first, values, rows, x),
        }
    }
}

/// The `W` entries of the panel's columns.
fn columns<const P: usize, const W: usize>(first: usize, x: &[[f64; P]]) -> [[f64; P]; W] {
    let mut columns = [[0.0; P]; W];
    columns.copy_from_slice(&x[first..first + W]);
    columns
}

fn forward<const P: usize, const W: usize>(
    first: usize,
    values: &[f64],
    rows: &[u32],
    x: &mut [[f64; P]],
) {
    let mut y = columns::<P, W>(first, x);
    let (triangle, below) = values.split_at(W * (W + 1) / 2);
    let mut at = 0;
    for column in 0..W {
        y[column] = y[column].map(|value| value * triangle[at]);
        let of_column = y[column];
        for (y, entry) in y[column + 1..].iter_mut().zip(&triangle[at + 1..]) {
            for axis in 0..P {
                y[axis] -= entry * of_column[axis];
            }
        }
        at += W - column;
    }
    x[first..first + W].copy_from_slice(&y);
    let (entries, _) = below.as_chunks::<W>();
    for (entries, row) in entries.iter().zip(rows) {
        let mut sum = [0.0; P];
        for (entry, y) in entries.iter().zip(&y) {
            for axis in 0..P {
                sum[axis] += entry * y[axis];
            }
        }
        let x = &mut x[*row as usize];
        for axis in 0..P {
            x[axis] -= sum[axis];
        }
    }
}

fn backward<const P: usize, const W: usize>(
    first: usize,
    values: &[f64],
    rows: &[u32],
    x: &mut [[f64; P]],
) {
    let (triangle, below) = values.split_at(W * (W + 1) / 2);
    let mut sums = [[0.0; P]; W];
    let (entries, _) = below.as_chunks::<W>();
    for (entries, row) in entries.iter().zip(rows) {
        let x = x[*row as usize];
        for (entry, sum) in entries.iter().zip(&mut sums) {
            for axis in 0..P {
                sum[axis] += entry * x[axis];
            }
        }
    }
    let mut y = columns::<P, W>(first, x);
    let mut at = triangle.len();
    for column in (0..W).rev() {
        at -= W - column;
        let mut sum = sums[column];
        for (y, entry) in y[column + 1..].iter().zip(&triangle[at + 1..]) {
            for axis in 0..P {
                sum[axis] += entry * y[axis];
            }
        }
        for axis in 0..P {
            y[column][axis] = (y[column][axis] - sum[axis]) * triangle[at];
        }
    }
    x[first..first + W].copy_from_slice(&y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn a_dense_factor_solves_as_nalgebra_does_whatever_its_size() {
        let mut random = fastrand::Rng::with_seed(4);
        for size in 1..30 {
            let half = DMatrix::from_fn(size, size, |_, _| random.f64() - 0.5);
            let matrix = &half * half.transpose() + DMatrix::identity(size, size);
            let factor = matrix.clone().cholesky().unwrap().l();
            let mut panels = Panels::default();
            panels.push(0, size, &[], |i, j| factor[(i, j)]);
            let right: Vec<[f64; 3]> =
                (0..size).map(|_| [0; 3].map(|_| random.f64() - 0.5)).collect();
            let mut x = right.clone();
            panels.solve(&mut x);
            for axis in 0..3 {
                let of_axis = |values: &[[f64; 3]]| {
                    DVector::from_iterator(size, values.iter().map(|value| value[axis]))
                };
                let error = (&matrix * of_axis(&x) - of_axis(&right)).amax();
                assert!(error < 1e-13, "{size}: {error:e}");
            }
        }
    }

    #[test]
    fn supernode_rows_may_belong_to_any_later_column() {
        // L = (1 0 0 0; 2 1 0 0; 0 0 1 0; 3 4 5 1): columns 0 and 1 have row 3 below them, column 2 too.
        let factor = [
            [1.0, 0.0, 0.0, 0.0],
            [2.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [3.0, 4.0, 5.0, 1.0],
        ];
        let mut panels = Panels::default();
        panels.push(0, 2, &[3], |i, j| factor[[0, 1, 3][i]][j]);
        panels.push(2, 1, &[3], |i, j| factor[[2, 3][i]][j + 2]);
        panels.push(3, 1, &[], |_, _| 1.0);
        assert_eq!(panels.n_values(), 5 + 2 + 1);
        // L Lᵀ (1, 2, 3, 4): Lᵀ x = (17, 18, 23, 4), L y = (17, 52, 23, 242).
        let mut x = [[17.0], [52.0], [23.0], [242.0]];
        panels.solve(&mut x);
        assert_eq!(x, [[1.0], [2.0], [3.0], [4.0]]);
    }
}
