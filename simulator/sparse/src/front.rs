//! Elimination of a large front, in tiles that fit registers and caches.
//!
//! The columns of a front are copied to chunks of eight rows, each with all columns: a tile of a product then reads
//! consecutive numbers. A panel is updated by all panels before it when its turn comes, some rows at a time, and the
//! update matrix at the end, tile by tile, by one panel after another. So each number is the result of the same operations
//! in the same order as in a small front ([`factor`](crate::factor)), and has the same bits.
//!
//! Threads share the rows below a panel and the columns of the update matrix.

#![expect(clippy::needless_range_loop, reason = "indices run over several arrays at once")]

use std::ops::Range;

use pulp::Simd;

use crate::pivot::{Inertia, PivotBlock, zeros};
use crate::sizes::{BLOCK, CHUNK, GRAIN, PANEL};
use crate::symbolic::Front;

/// Consecutive rows of a column.
type Chunk = [f64; CHUNK];

/// `X` and `W` of the front that is eliminated, chunk by chunk, each with all columns of the front. Rows of pivots and
/// other rows are in different chunks, whose last ones are filled up by zeros.
pub(crate) struct FrontWorkspace<const D: usize> {
    x: Vec<Chunk>,
    w: Vec<Chunk>,
    /// Columns of the front while it is assembled, which the caches then hold.
    columns: Vec<f64>,
    multipliers: [Multipliers<D>; 2],
}

/// Entries of `X` or `W` in the rows of a panel: of a pivot, a later block, a row in it, and a column of the pivot.
type Multipliers<const D: usize> = [[[[f64; D]; D]; PANEL]; PANEL];

impl<const D: usize> FrontWorkspace<D> {
    /// The size that a front needs, in chunks.
    pub(crate) fn size_for(front: &Front) -> usize {
        n_chunks(front.n_pivots * D, front.height() * D) * front.n_pivots * D
    }

    /// A workspace of so many chunks; `None` if there is not enough memory.
    pub(crate) fn new(size: usize) -> Option<Self> {
        Some(Self {
            x: zeros(size, [0.0; CHUNK])?,
            w: zeros(size, [0.0; CHUNK])?,
            columns: zeros(size.checked_mul(CHUNK)?, 0.0)?,
            multipliers: [[[[[0.0; D]; D]; PANEL]; PANEL]; 2],
        })
    }

    /// Where the columns of a front are assembled.
    pub(crate) fn columns(&mut self, front: &Front) -> &mut [f64] {
        &mut self.columns[..front.n_pivots * front.height() * D * D]
    }

    /// Takes the columns that were assembled for those of `W`: of the upper triangle, or of a symmetric matrix; or for those
    /// of `X`.
    #[inline(always)]
    pub(crate) fn pack(&mut self, front: &Front, of_w: bool) {
        let to = if of_w { &mut self.w } else { &mut self.x };
        pack(&self.columns, front.height() * D, front.n_pivots * D, to);
    }

    /// Eliminates the pivots of the front that was packed, with its columns and update matrix of each triangle. Its columns
    /// become columns of `L`, its rows rows of `U`, and its update matrix loses what they contribute. `threads`: whether
    /// threads share the work.
    #[inline(always)]
    pub(crate) fn eliminate<const SYMMETRIC: bool, S: Simd>(
        &mut self,
        simd: S,
        pivots: &mut [PivotBlock<D>],
        [lower, update]: [&mut [f64]; 2],
        [upper, upper_update]: [&mut [f64]; 2],
        threads: bool,
    ) -> Inertia {
        let n_columns = pivots.len() * D;
        let height = lower.len() / n_columns;
        let size = n_chunks(n_columns, height) * n_columns;
        let (x, w) = (&mut self.x[..size], &mut self.w[..size]);
        let multipliers = &mut self.multipliers;
        let inertia =
            factorise_columns::<D, SYMMETRIC, S>(simd, pivots, [x, w], multipliers, threads);
        if inertia == Inertia::Singular {
            return inertia;
        }
        let below = n_columns.div_ceil(CHUNK) * n_columns;
        let n_rows = height - n_columns;
        let product = Product { x: &x[below..], w: &w[below..], n_columns, n_rows, block: D };
        product.subtract(simd, update, 0, threads);
        if !SYMMETRIC {
            let transposed = Product { x: product.w, w: product.x, ..product };
            transposed.subtract(simd, upper_update, 0, threads);
            unpack(w, height, n_columns, upper);
        }
        unpack(x, height, n_columns, lower);
        inertia
    }
}

/// Chunks of the rows of a front.
fn n_chunks(n_columns: usize, height: usize) -> usize {
    n_columns.div_ceil(CHUNK) + (height - n_columns).div_ceil(CHUNK)
}

/// Copies the columns of a front to chunks.
#[inline(always)]
fn pack(columns: &[f64], height: usize, n_columns: usize, chunks: &mut [Chunk]) {
    for column in 0..n_columns {
        let mut place = column;
        let (own, below) = columns[column * height..][..height].split_at(n_columns);
        for rows in [own, below] {
            let (whole, rest) = rows.as_chunks::<CHUNK>();
            for rows in whole {
                chunks[place] = *rows;
                place += n_columns;
            }
            if !rest.is_empty() {
                chunks[place] = [0.0; CHUNK];
                chunks[place][..rest.len()].copy_from_slice(rest);
                place += n_columns;
            }
        }
    }
}

/// Copies chunks to the columns of a front.
#[inline(always)]
fn unpack(chunks: &[Chunk], height: usize, n_columns: usize, columns: &mut [f64]) {
    let n_own = n_columns.div_ceil(CHUNK);
    for column in 0..n_columns {
        for (number, rows) in chunks[column..].iter().step_by(n_columns).enumerate() {
            let row =
                if number < n_own { number * CHUNK } else { n_columns + (number - n_own) * CHUNK };
            // The padding of a chunk is overwritten by the next one.
            let target = &mut columns[column * height + row..];
            match target.first_chunk_mut() {
                Some(target) => *target = *rows,
                None => target.copy_from_slice(&rows[..target.len()]),
            }
        }
    }
}

/// Makes `X` and `W` of the columns of a front, panel by panel. Each panel is first updated by those before it.
#[inline(always)]
fn factorise_columns<const D: usize, const SYMMETRIC: bool, S: Simd>(
    simd: S,
    pivots: &mut [PivotBlock<D>],
    [x, w]: [&mut [Chunk]; 2],
    [of_x, of_w]: &mut [Multipliers<D>; 2],
    threads: bool,
) -> Inertia {
    let n_columns = pivots.len() * D;
    let mut inertia = if SYMMETRIC { Inertia::Definite } else { Inertia::Indefinite };
    for (number, pivots) in pivots.chunks_mut(PANEL).enumerate() {
        let from = number * PANEL * D;
        let to = from + pivots.len() * D;
        let above = from / CHUNK * n_columns;
        let below = to.div_ceil(CHUNK) * n_columns;
        let (own_x, x) = x[above..].split_at_mut(below - above);
        let (own_w, w) = w[above..].split_at_mut(below - above);
        let mut panel = Panel { columns: from..to, n_columns, pivots, of_x, of_w };
        if SYMMETRIC {
            panel.update(simd, own_w, Some(own_x), None);
        } else {
            panel.update(simd, own_x, None, Some(own_w));
            panel.update(simd, own_w, None, Some(own_x));
        }
        inertia = inertia.max(panel.factorise::<SYMMETRIC, S>(simd, [own_x, own_w]));
        if inertia == Inertia::Singular {
            break;
        }
        panel.reduce::<SYMMETRIC, S>(simd, [own_x, own_w], [x, w], threads);
    }
    inertia
}

/// Expands `$tiles` for some vectors at a time with the number of these, and of columns, that fit into the registers.
macro_rules! each_tile {
    ($s:ident, $vectors:expr, $tiles:ident) => {
        let Range { start: mut vector, end } = $vectors;
        if $s::F64_LANES == CHUNK {
            while vector + 3 <= end {
                $tiles!(3, 8, vector);
                vector += 3;
            }
            if vector + 2 <= end {
                $tiles!(2, 8, vector);
                vector += 2;
            }
            if vector < end {
                $tiles!(1, 8, vector);
            }
        } else {
            while vector + 2 <= end {
                $tiles!(2, 4, vector);
                vector += 2;
            }
            if vector < end {
                $tiles!(1, 4, vector);
            }
        }
    };
}

/// Columns of a front that are factorised together.
struct Panel<'a, const D: usize> {
    columns: Range<usize>,
    /// Columns of the front.
    n_columns: usize,
    pivots: &'a mut [PivotBlock<D>],
    of_x: &'a mut Multipliers<D>,
    of_w: &'a mut Multipliers<D>,
}

impl<const D: usize> Panel<'_, D> {
    /// Subtracts the products of the columns before the panel from its columns in some chunks of rows. The first factor
    /// is in the same rows of `left`, the second one in the rows of the panel, the first ones of `right`; `None`: in
    /// `target`.
    #[inline(always)]
    fn update<S: Simd>(
        &self,
        simd: S,
        target: &mut [Chunk],
        left: Option<&[Chunk]>,
        right: Option<&[Chunk]>,
    ) {
        let Range { start, end } = self.columns;
        let (n_columns, depth) = (self.n_columns, PANEL * D);
        if start == 0 {
            return;
        }
        let vectors = target.len() / n_columns * (CHUNK / S::F64_LANES);
        macro_rules! tiles {
            ($n:literal, $g:literal, $vector:expr) => {
                for column in (0..end - start).step_by($g) {
                    for k in (0..start).step_by(depth) {
                        let sums = {
                            let (left, right) = (left.unwrap_or(target), right.unwrap_or(target));
                            let right = &right[column / CHUNK * n_columns + k..][..depth];
                            tile::<S, $n, $g>(simd, left, n_columns, k, $vector, right, column)
                        };
                        let width = $g.min(end - start - column);
                        for n in 0..$n {
                            let (chunk, lanes) = place::<S>($vector + n);
                            let columns =
                                &mut target[chunk * n_columns + start + column..][..width];
                            for g in 0..$g {
                                if let Some(rows) = columns.get_mut(g) {
                                    let rows = &mut S::as_mut_simd_f64s(rows).0[lanes];
                                    *rows = simd.sub_f64s(*rows, sums[g][n]);
                                }
                            }
                        }
                    }
                }
            };
        }
        each_tile!(S, 0..vectors, tiles);
    }

    /// Factorises the pivots, in the chunks with the rows of the panel.
    #[inline(always)]
    fn factorise<const SYMMETRIC: bool, S: Simd>(
        &mut self,
        simd: S,
        [x, w]: [&mut [Chunk]; 2],
    ) -> Inertia {
        let mut inertia = Inertia::Definite;
        let n_columns = self.n_columns;
        let first = self.columns.start;
        for pivot in 0..self.pivots.len() {
            let assembled = if SYMMETRIC { &*w } else { &*x };
            let entry = |values: &[Chunk], row: usize, column: usize| {
                values[row / CHUNK * n_columns + first + column][row % CHUNK]
            };
            let block = std::array::from_fn(|j| {
                std::array::from_fn(|i| entry(assembled, pivot * D + i, pivot * D + j))
            });
            let (factorised, definite) = PivotBlock::new::<SYMMETRIC>(block);
            let Some(factorised) = factorised else { return Inertia::Singular };
            if !definite {
                inertia = Inertia::Indefinite;
            }
            self.pivots[pivot] = factorised;
            for (x, w) in x.chunks_exact_mut(n_columns).zip(w.chunks_exact_mut(n_columns)) {
                let rows = || self.columns.clone();
                self.scale::<SYMMETRIC>(pivot, [&mut x[rows()], &mut w[rows()]]);
            }
            for later in pivot + 1..self.pivots.len() {
                for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                    let (row, column) = (later * D + i, pivot * D + j);
                    self.of_w[pivot][later][i][j] = entry(w, row, column);
                    if !SYMMETRIC {
                        self.of_x[pivot][later][i][j] = entry(x, row, column);
                    }
                }
            }
            for (x, w) in x.chunks_exact_mut(n_columns).zip(w.chunks_exact_mut(n_columns)) {
                let rows = || self.columns.clone();
                self.eliminate::<SYMMETRIC, S>(simd, pivot, [&mut x[rows()], &mut w[rows()]]);
            }
        }
        inertia
    }

    /// Eliminates the pivots from the rows below the panel.
    fn reduce<const SYMMETRIC: bool, S: Simd>(
        &self,
        simd: S,
        own: [&[Chunk]; 2],
        [x, w]: [&mut [Chunk]; 2],
        threads: bool,
    ) {
        let work = x.len() / self.n_columns * CHUNK * self.columns.len() * self.columns.end;
        if threads && work > 2 * GRAIN && x.len() > self.n_columns {
            let half = x.len() / self.n_columns / 2 * self.n_columns;
            let (x, rest_x) = x.split_at_mut(half);
            let (w, rest_w) = w.split_at_mut(half);
            rayon::join(
                || self.reduce::<SYMMETRIC, S>(simd, own, [x, w], true),
                || self.reduce::<SYMMETRIC, S>(simd, own, [rest_x, rest_w], true),
            );
            return;
        }
        simd.vectorize(RowsWork::<'_, '_, D, SYMMETRIC, S> {
            panel: self,
            simd,
            own,
            rows: [x, w],
        });
    }

    #[inline(always)]
    fn reduce_rows<const SYMMETRIC: bool, S: Simd>(
        &self,
        simd: S,
        [own_x, own_w]: [&[Chunk]; 2],
        [x, w]: [&mut [Chunk]; 2],
    ) {
        let size = BLOCK * self.n_columns;
        for (x, w) in x.chunks_mut(size).zip(w.chunks_mut(size)) {
            if SYMMETRIC {
                self.update(simd, w, Some(x), Some(own_w));
            } else {
                self.update(simd, x, None, Some(own_w));
                self.update(simd, w, None, Some(own_x));
            }
            let rows = x.chunks_exact_mut(self.n_columns).zip(w.chunks_exact_mut(self.n_columns));
            for (x, w) in rows {
                let (x, w) = (&mut x[self.columns.clone()], &mut w[self.columns.clone()]);
                for pivot in 0..self.pivots.len() {
                    self.scale::<SYMMETRIC>(pivot, [x, w]);
                    self.eliminate::<SYMMETRIC, S>(simd, pivot, [x, w]);
                }
            }
        }
    }

    /// `X = V B⁻¹` of a pivot in a chunk of rows.
    #[inline(always)]
    fn scale<const SYMMETRIC: bool>(&self, pivot: usize, [x, w]: [&mut [Chunk]; 2]) {
        let PivotBlock { lu, rows, columns } = &self.pivots[pivot];
        let v = if SYMMETRIC { &w[pivot * D..][..D] } else { &x[pivot * D..][..D] };
        // Bᵀ Xᵀ = Vᵀ is solved row by row of X; written column by column, it fits vectors.
        let mut solved: [Chunk; D] = std::array::from_fn(|i| v[rows[i]]);
        for i in 0..D {
            for k in 0..i {
                for r in 0..CHUNK {
                    solved[i][r] -= lu[i][k] * solved[k][r];
                }
            }
        }
        let x = &mut x[pivot * D..][..D];
        for i in (0..D).rev() {
            for k in i + 1..D {
                for r in 0..CHUNK {
                    solved[i][r] -= lu[i][k] * solved[k][r];
                }
            }
            for r in 0..CHUNK {
                solved[i][r] *= lu[i][i];
            }
            x[columns[i]] = solved[i];
        }
    }

    /// Subtracts the products of a pivot from the later columns of the panel in a chunk of rows.
    #[inline(always)]
    fn eliminate<const SYMMETRIC: bool, S: Simd>(
        &self,
        simd: S,
        pivot: usize,
        [x, w]: [&mut [Chunk]; 2],
    ) {
        let (x, later_x) = x[pivot * D..].split_at_mut(D);
        let (w, later_w) = w[pivot * D..].split_at_mut(D);
        let of_w = &self.of_w[pivot][pivot + 1..];
        if SYMMETRIC {
            subtract_products(simd, x, of_w, later_w);
        } else {
            subtract_products(simd, x, of_w, later_x);
            subtract_products(simd, w, &self.of_x[pivot][pivot + 1..], later_w);
        }
    }
}

#[inline(always)]
fn subtract_products<const D: usize, S: Simd>(
    simd: S,
    columns: &[Chunk],
    multipliers: &[[[f64; D]; D]],
    later: &mut [Chunk],
) {
    for lanes in 0..CHUNK / S::F64_LANES {
        let columns: [S::f64s; D] = std::array::from_fn(|j| S::as_simd_f64s(&columns[j]).0[lanes]);
        for (later, multipliers) in later.iter_mut().zip(multipliers.as_flattened()) {
            let mut sum = simd.splat_f64s(0.0);
            for j in 0..D {
                let multiplier = simd.splat_f64s(multipliers[j]);
                sum = simd.add_f64s(sum, simd.mul_f64s(columns[j], multiplier));
            }
            let later = &mut S::as_mut_simd_f64s(later).0[lanes];
            *later = simd.sub_f64s(*later, sum);
        }
    }
}

/// The first row that is used, of the columns of a chunk in an update matrix: that of the chunk where the diagonal block
/// of the first column begins.
pub(crate) fn first_row(column: usize, block: usize) -> usize {
    column / CHUNK * CHUNK / block * block / CHUNK * CHUNK
}

/// `X Wᵀ` of the rows below the pivots of a front.
#[derive(Clone, Copy)]
struct Product<'a> {
    x: &'a [Chunk],
    w: &'a [Chunk],
    /// Columns of the front.
    n_columns: usize,
    /// Rows of the update matrix.
    n_rows: usize,
    /// Rows of a block.
    block: usize,
}

impl Product<'_> {
    /// Subtracts the product from the columns of the update matrix from `first` on, on and below the diagonal.
    fn subtract<S: Simd>(self, simd: S, columns: &mut [f64], first: usize, threads: bool) {
        let n_rows = self.n_rows;
        if n_rows == 0 {
            return;
        }
        let n = columns.len() / n_rows;
        let work = n * (n_rows - first - n / 2) * self.n_columns;
        if threads && work > 2 * GRAIN && n > CHUNK {
            // Halves of the area below the diagonal.
            let [all, rest] = [n_rows - first, n_rows - first - n].map(|side| side.pow(2) as f64);
            let side = (0.5 * (all + rest)).sqrt() as usize;
            let half = (n_rows - first - side).min(n) / CHUNK * CHUNK;
            let half = half.max(CHUNK);
            let (left, right) = columns.split_at_mut(half * n_rows);
            rayon::join(
                || self.subtract(simd, left, first, true),
                || self.subtract(simd, right, first + half, true),
            );
            return;
        }
        simd.vectorize(ProductWork { product: self, simd, columns, first });
    }

    #[inline(always)]
    fn subtract_columns<S: Simd>(self, simd: S, target: &mut [f64], first: usize) {
        let Self { x, w, n_columns, n_rows, block } = self;
        let depth = PANEL * block;
        let width = target.len() / n_rows;
        macro_rules! tiles {
            ($n:literal, $g:literal, $vector:expr, $columns:expr) => {{
                let row = $vector * S::F64_LANES;
                let rows = (n_rows - row).min($n * S::F64_LANES);
                for column in $columns.step_by($g) {
                    let whole = rows == $n * S::F64_LANES && column + $g <= width;
                    let right = &w[(first + column) / CHUNK * n_columns..][..n_columns];
                    for k in (0..n_columns).step_by(depth) {
                        let right = &right[k..][..depth.min(n_columns - k)];
                        let sums = tile::<S, $n, $g>(simd, x, n_columns, k, $vector, right, column);
                        if whole {
                            for g in 0..$g {
                                let rows = &mut target[(column + g) * n_rows + row..];
                                let rows = &mut rows[..$n * S::F64_LANES];
                                let rows = S::as_mut_simd_f64s(rows).0;
                                for n in 0..$n {
                                    rows[n] = simd.sub_f64s(rows[n], sums[g][n]);
                                }
                            }
                        } else {
                            let columns = target[column * n_rows..].chunks_exact_mut(n_rows);
                            for (column, sums) in columns.zip(sums) {
                                let sums = pulp::bytemuck::cast_slice::<S::f64s, f64>(&sums);
                                for (row, sum) in column[row..].iter_mut().zip(sums) {
                                    *row -= sum;
                                }
                            }
                        }
                    }
                }
            }};
        }
        // Columns up to the last one of a diagonal block in the chunk of a vector.
        let left = |vector: usize| {
            let end = (vector * S::F64_LANES + 1).next_multiple_of(CHUNK);
            let end = if end.is_multiple_of(block) { end } else { end + CHUNK };
            end.saturating_sub(first).min(width)
        };
        let start = first_row(first, block) / S::F64_LANES;
        let end = n_rows.div_ceil(S::F64_LANES);
        let most = if S::F64_LANES == CHUNK { 3 } else { 2 };
        for vector in (start..end).step_by(most) {
            let last = end.min(vector + most);
            let mut done = 0;
            for vector in vector..last {
                // Tiles that are above the diagonal are left out.
                let columns = done..left(vector);
                done = columns.end;
                match (S::F64_LANES == CHUNK, last - vector) {
                    (true, 3) => tiles!(3, 8, vector, columns),
                    (true, 2) => tiles!(2, 8, vector, columns),
                    (true, _) => tiles!(1, 8, vector, columns),
                    (false, 2) => tiles!(2, 4, vector, columns),
                    (false, _) => tiles!(1, 4, vector, columns),
                }
            }
        }
    }
}

// Work of a thread, compiled for its vectors. A closure might not be: a separate function calls it.
struct RowsWork<'a, 'b, const D: usize, const SYMMETRIC: bool, S> {
    panel: &'a Panel<'b, D>,
    simd: S,
    own: [&'a [Chunk]; 2],
    rows: [&'a mut [Chunk]; 2],
}

struct ProductWork<'a, S> {
    product: Product<'a>,
    simd: S,
    columns: &'a mut [f64],
    first: usize,
}

impl<const D: usize, const SYMMETRIC: bool, S: Simd> pulp::NullaryFnOnce
    for RowsWork<'_, '_, D, SYMMETRIC, S>
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.panel.reduce_rows::<SYMMETRIC, S>(self.simd, self.own, self.rows);
    }
}

impl<S: Simd> pulp::NullaryFnOnce for ProductWork<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.product.subtract_columns(self.simd, self.columns, self.first);
    }
}

/// The chunk of a vector of rows, and its number among the vectors of the chunk.
#[inline(always)]
fn place<S: Simd>(vector: usize) -> (usize, usize) {
    let vectors = CHUNK / S::F64_LANES;
    (vector / vectors, vector % vectors)
}

/// Sums of products of `N` vectors of rows of `left`, in its columns from `k` on, with `G` rows of a chunk `right`, in as
/// many columns; those of the chunk's half that holds `column`.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "places in two factors")]
fn tile<S: Simd, const N: usize, const G: usize>(
    simd: S,
    left: &[Chunk],
    n_columns: usize,
    k: usize,
    vector: usize,
    right: &[Chunk],
    column: usize,
) -> [[S::f64s; N]; G] {
    let depth = right.len();
    let rows: [&[Chunk]; N] =
        std::array::from_fn(|n| &left[place::<S>(vector + n).0 * n_columns + k..][..depth]);
    let lanes: [usize; N] = std::array::from_fn(|n| place::<S>(vector + n).1);
    let half = column % CHUNK / G;
    let mut sums = [[simd.splat_f64s(0.0); N]; G];
    for k in 0..depth {
        let factors = &right[k].as_chunks::<G>().0[half % (CHUNK / G)];
        let rows: [S::f64s; N] = std::array::from_fn(|n| S::as_simd_f64s(&rows[n][k]).0[lanes[n]]);
        for g in 0..G {
            let factor = simd.splat_f64s(factors[g]);
            for n in 0..N {
                sums[g][n] = simd.add_f64s(sums[g][n], simd.mul_f64s(rows[n], factor));
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A front of blocks of three rows, eliminated with or without threads.
    #[derive(Clone, Copy)]
    struct Elimination<const SYMMETRIC: bool> {
        n_pivots: usize,
        n_rows: usize,
        threads: bool,
    }

    impl<const SYMMETRIC: bool> pulp::WithSimd for Elimination<SYMMETRIC> {
        /// The bits below the diagonal blocks of columns and update matrices; none where vectors are short.
        type Output = Vec<u64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<u64> {
            if S::F64_LANES < 4 {
                return Vec::new();
            }
            let Self { n_pivots, n_rows, threads } = self;
            let front = Front {
                first: 0,
                n_pivots,
                rows: [0, n_rows],
                panel: 0,
                update: 0,
                children: [0; 2],
                entries: [0; 2],
            };
            let (height, n_columns, n_below) = (front.height() * 3, n_pivots * 3, n_rows * 3);
            let mut workspace =
                FrontWorkspace::<3>::new(FrontWorkspace::<3>::size_for(&front)).unwrap();
            let mut random = fastrand::Rng::with_seed(3);
            let mut triangle = |of_w: bool| {
                let columns = workspace.columns(&front);
                columns.iter_mut().for_each(|entry| *entry = random.f64() - 0.5);
                (0..n_columns).for_each(|column| columns[column * height + column] += 400.0);
                workspace.pack(&front, of_w);
                let update: Vec<f64> = (0..n_below * n_below).map(|_| random.f64()).collect();
                (vec![0.0; n_columns * height], update)
            };
            let (mut lower, mut update) = triangle(SYMMETRIC);
            let (mut upper, mut upper_update) =
                if SYMMETRIC { Default::default() } else { triangle(true) };
            let zero = PivotBlock { lu: [[0.0; 3]; 3], rows: [0; 3], columns: [0; 3] };
            let mut pivots = vec![zero; n_pivots];
            let inertia = workspace.eliminate::<SYMMETRIC, S>(
                simd,
                &mut pivots,
                [&mut lower, &mut update],
                [&mut upper, &mut upper_update],
                threads,
            );
            assert_ne!(inertia, Inertia::Singular);
            let mut bits = Vec::new();
            for (matrix, height) in
                [(lower, height), (upper, height), (update, n_below), (upper_update, n_below)]
            {
                for (column, entries) in matrix.chunks_exact(height).enumerate() {
                    let below = &entries[column / 3 * 3 + 3..];
                    bits.extend(below.iter().map(|entry| entry.to_bits()));
                }
            }
            bits
        }
    }

    #[test]
    fn a_front_shared_by_threads_has_the_same_bits() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let (few, many) = (16, 80);
        // The update matrix of the first is shared from some number of rows on, and the last panel of the second.
        let product = |n_rows: &usize| {
            let rows = 3 * n_rows;
            rows * (rows - rows / 2) * 3 * few > 2 * GRAIN
        };
        let panel = |n_rows: &usize| {
            let rows = (3 * n_rows).next_multiple_of(CHUNK);
            rows * 3 * PANEL * 3 * many > 2 * GRAIN
        };
        let first_product = (1..).find(product).unwrap();
        let first_panel = (1..).find(panel).unwrap();
        for (n_pivots, first) in [(few, first_product), (many, first_panel)] {
            for n_rows in [first - 1, first, first + 1] {
                let eliminate = |threads| {
                    pool.install(|| {
                        let arch = pulp::Arch::new();
                        let symmetric = Elimination::<true> { n_pivots, n_rows, threads };
                        let other = Elimination::<false> { n_pivots, n_rows, threads };
                        (arch.dispatch(symmetric), arch.dispatch(other))
                    })
                };
                assert!(eliminate(true) == eliminate(false), "{n_pivots} pivots, {n_rows} rows");
            }
        }
    }
}
