//! Sparse matrix of `D × D` blocks, stored by block columns.
//!
//! Each block column holds its diagonal block first and then the others by ascending row; a block is `D²`
//! contiguous numbers, column by column. Of a symmetric matrix only the blocks on and below the diagonal
//! are kept. Storage is in proportion to the couplings, and a product is one pass over it.

use nalgebra::SMatrix;

use crate::checked::Product;

/// The matrix.
pub(crate) struct BlockColumns<const D: usize> {
    pub(crate) values: Vec<f64>,
    /// Start of each block column in `rows`.
    pub(crate) starts: Vec<usize>,
    /// Block rows of each block column: its own, and then the others, ascending.
    pub(crate) rows: Vec<u32>,
    pub(crate) symmetric: bool,
    /// The most entries that a row has.
    row_length: usize,
}

impl<const D: usize> BlockColumns<D> {
    pub(crate) fn new(n_blocks: usize, couplings: &[[usize; 2]], symmetric: bool) -> Self {
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); n_blocks];
        for &[a, b] in couplings.iter().filter(|[a, b]| a != b) {
            columns[a].push(b as u32);
            columns[b].push(a as u32);
        }
        let mut starts = Vec::with_capacity(n_blocks + 1);
        let (mut rows, mut row_length) = (Vec::new(), 0);
        for (own, mut column) in columns.into_iter().enumerate() {
            column.sort_unstable();
            column.dedup();
            // As many as a row has: the pattern is symmetric.
            row_length = row_length.max((column.len() + 1) * D);
            starts.push(rows.len());
            rows.push(own as u32);
            rows.extend(column.into_iter().filter(|row| !symmetric || *row as usize > own));
        }
        starts.push(rows.len());
        let values = vec![0.0; rows.len() * D * D];
        Self { values, starts, rows, symmetric, row_length }
    }

    pub(crate) fn n_blocks(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn size(&self) -> usize {
        self.n_blocks() * D
    }

    /// Offset of block `(row, column)` in the values; `None` for one above the diagonal of a symmetric
    /// matrix, which is not kept.
    ///
    /// # Panics
    /// If the couplings do not hold that block.
    pub(crate) fn offset(&self, row: usize, column: usize) -> Option<usize> {
        if self.symmetric && row < column {
            return None;
        }
        let start = self.starts[column];
        if row == column {
            return Some(start * D * D);
        }
        let others = &self.rows[start + 1..self.starts[column + 1]];
        let place = others.binary_search(&(row as u32));
        let place = place.expect("the couplings hold every block that is filled");
        Some((start + 1 + place) * D * D)
    }

    /// Adds to the block that starts at `offset`.
    #[inline]
    pub(crate) fn add_at(&mut self, offset: usize, block: &SMatrix<f64, D, D>) {
        let entries = &mut self.values[offset..][..D * D];
        for (entry, value) in entries.iter_mut().zip(block.iter()) {
            *entry += value;
        }
    }

    pub(crate) fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        if let Some(offset) = self.offset(row, column) {
            self.add_at(offset, block);
        }
    }

    /// Adds `value` to the diagonal of block `(block, block)`.
    pub(crate) fn add_diagonal(&mut self, block: usize, value: f64) {
        let entries = &mut self.values[self.starts[block] * D * D..][..D * D];
        entries.iter_mut().step_by(D + 1).for_each(|entry| *entry += value);
    }

    /// Calls `to` with row, column and value of each entry, both triangles of a symmetric matrix.
    pub(crate) fn read(&self, to: &mut dyn FnMut(usize, usize, f64)) {
        let mut blocks = self.values.chunks_exact(D * D);
        for column in 0..self.n_blocks() {
            let rows = &self.rows[self.starts[column]..self.starts[column + 1]];
            for (row, block) in rows.iter().zip(&mut blocks) {
                let row = *row as usize;
                for (place, entry) in block.iter().enumerate() {
                    let (i, j) = (row * D + place % D, column * D + place / D);
                    to(i, j, *entry);
                    if self.symmetric && row != column {
                        to(j, i, *entry);
                    }
                }
            }
        }
    }
}

impl<const D: usize> Product for BlockColumns<D> {
    fn row_length(&self) -> usize {
        self.row_length
    }

    fn add_products(&self, x: &[f64], product: &mut [f64], scale: &mut [f64]) {
        let mut blocks = self.values.chunks_exact(D * D);
        for column in 0..self.n_blocks() {
            let right: [f64; D] = vector(x, column);
            let rows = &self.rows[self.starts[column]..self.starts[column + 1]];
            // Sums of this column's transposed blocks.
            let (mut own, mut own_scale) = ([0.0; D], [0.0; D]);
            for (row, block) in rows.iter().zip(&mut blocks) {
                let row = *row as usize;
                let left: [f64; D] = vector(x, row);
                let (mut sums, mut scales) = ([0.0; D], [0.0; D]);
                let both = self.symmetric && row != column;
                for j in 0..D {
                    for i in 0..D {
                        let entry = block[j * D + i];
                        let term = entry * right[j];
                        sums[i] += term;
                        scales[i] += term.abs();
                        if both {
                            let term = entry * left[i];
                            own[j] += term;
                            own_scale[j] += term.abs();
                        }
                    }
                }
                add(product, row, sums);
                add(scale, row, scales);
            }
            if self.symmetric {
                add(product, column, own);
                add(scale, column, own_scale);
            }
        }
    }

    fn add_row_sums(&self, sums: &mut [f64]) {
        let mut blocks = self.values.chunks_exact(D * D);
        for column in 0..self.n_blocks() {
            let rows = &self.rows[self.starts[column]..self.starts[column + 1]];
            for (row, block) in rows.iter().zip(&mut blocks) {
                let row = *row as usize;
                for j in 0..D {
                    for i in 0..D {
                        sums[row * D + i] += block[j * D + i].abs();
                        if self.symmetric && row != column {
                            sums[column * D + j] += block[j * D + i].abs();
                        }
                    }
                }
            }
        }
    }
}

fn vector<const D: usize>(values: &[f64], block: usize) -> [f64; D] {
    let mut vector = [0.0; D];
    vector.copy_from_slice(&values[block * D..][..D]);
    vector
}

fn add<const D: usize>(values: &mut [f64], block: usize, amounts: [f64; D]) {
    for (value, amount) in values[block * D..][..D].iter_mut().zip(amounts) {
        *value += amount;
    }
}
