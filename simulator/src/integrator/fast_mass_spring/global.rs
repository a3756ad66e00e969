//! Global step: solves `Q δ = r`; the matrix is constant over a run and factorised once.
//!
//! ```text
//! Q = Σ k A_eᵀ A_e + M/h² (+ w on pins)        N × N, symmetric positive definite
//! ```
//!
//! A small matrix is factorised as a dense one by nalgebra, a large one by the sparse solver of the implicit methods
//! (`simulator/sparse/src/factor.rs`), in blocks of one row; both factors become [`Panels`]. The backward error of the last solution
//! of a step is checked (`simulator/sparse/src/checked.rs`), and the solution refined at most once.

use nalgebra::DMatrix;
use sparse::LinearError;
use sparse::checked::{Checked, Product, tolerance};
use sparse::cholesky::Cholesky;
use sparse::statistics::{FactorWork, LinearStatistics};

use super::panels::Panels;

/// How the matrix is factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Storage {
    Dense,
    Sparse,
}

/// `Q`, its rows still in the order of the scene.
pub(super) struct GlobalMatrix {
    /// Its diagonal.
    pub(super) diagonal: Vec<f64>,
    /// Stiffness `k` between two rows: `−k` in both places off the diagonal. Several add up.
    pub(super) links: Vec<([usize; 2], f64)>,
}

/// A factor of `Q` and the check of its solutions; rows in the order of elimination.
pub(super) struct GlobalSolver<const P: usize> {
    panels: Panels,
    matrix: Rows<P>,
    checked: Checked,
    correction: Vec<[f64; P]>,
    storage: Storage,
}

/// `Q`, row by row; it acts on vectors of `P` components.
struct Rows<const P: usize> {
    diagonal: Vec<f64>,
    /// The other entries.
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl<const P: usize> GlobalSolver<P> {
    /// Factorises `Q`; also returns the order of elimination: which row of `matrix` each row now is.
    ///
    /// # Errors
    /// If `Q` is not finite, not positive definite to working precision, or its factor is too large.
    pub(super) fn new(
        matrix: &GlobalMatrix,
        storage: Storage,
        statistics: &mut LinearStatistics,
    ) -> Result<(Self, Vec<usize>), LinearError> {
        let size = matrix.diagonal.len();
        let links = merge_links(&matrix.links);
        let finite = |mut values: std::slice::Iter<'_, f64>| values.all(|value| value.is_finite());
        if !finite(matrix.diagonal.iter()) || !links.iter().all(|(_, value)| value.is_finite()) {
            return Err(LinearError::NotFinite { size });
        }
        statistics.factorisations += 1;
        let (panels, order) = match storage {
            Storage::Dense => dense(&matrix.diagonal, &links)?,
            Storage::Sparse => {
                statistics.symbolic_analyses += 1;
                factorise_sparse(&matrix.diagonal, &links)?
            }
        };
        let mut place = vec![0; size];
        for (row, of_matrix) in order.iter().enumerate() {
            place[*of_matrix] = row;
        }
        let mut entries: Vec<(usize, u32, f64)> = links
            .iter()
            .flat_map(|&([a, b], value)| {
                let (a, b) = (place[a], place[b]);
                [(a, b as u32, value), (b, a as u32, value)]
            })
            .collect();
        entries.sort_unstable_by_key(|&(row, column, _)| (row, column));
        let mut starts = vec![0; size + 1];
        entries.iter().for_each(|(row, ..)| starts[row + 1] += 1);
        (0..size).for_each(|row| starts[row + 1] += starts[row]);
        let global = Self {
            panels,
            matrix: Rows {
                diagonal: order.iter().map(|row| matrix.diagonal[*row]).collect(),
                starts,
                columns: entries.iter().map(|entry| entry.1).collect(),
                values: entries.iter().map(|entry| entry.2).collect(),
            },
            checked: Checked::new(size * P),
            correction: vec![[0.0; P]; size],
            storage,
        };
        Ok((global, order))
    }

    /// Replaces the right-hand side by the solution.
    pub(super) fn solve(&self, x: &mut [[f64; P]]) {
        self.panels.solve(x);
    }

    /// Substitutes with the factor, for [`solve`](Self::solve).
    pub(super) fn work_of_solve(&self) -> FactorWork {
        let mut work = FactorWork::default();
        work.add_substitutions(self.panels.n_values(), P);
        work
    }

    /// Checks the solution `x` for `right` and refines it once if its backward error is more than rounding. Returns
    /// the correction that it then added.
    ///
    /// # Errors
    /// If the residual stays far above rounding.
    pub(super) fn check(
        &mut self,
        x: &mut [[f64; P]],
        right: &[[f64; P]],
        statistics: &mut LinearStatistics,
    ) -> Result<Option<&[[f64; P]]>, LinearError> {
        let Self { panels, matrix, checked, correction, .. } = self;
        checked.right.copy_from_slice(right.as_flattened());
        checked.solution.copy_from_slice(x.as_flattened());
        checked.compute_residual(matrix);
        if checked.error <= tolerance(matrix) {
            return checked.accept(matrix, statistics).map(|()| None);
        }
        checked.check_finite(&checked.solution)?;
        checked.check_finite(&checked.residual)?;
        statistics.refinements += 1;
        correction.as_flattened_mut().copy_from_slice(&checked.residual);
        panels.solve(correction);
        add(x, correction);
        checked.solution.copy_from_slice(x.as_flattened());
        checked.compute_residual(matrix);
        checked.accept(matrix, statistics).map(|()| Some(&**correction))
    }

    /// The solver, in words.
    pub(super) fn describe(&self) -> String {
        let size = self.matrix.diagonal.len();
        let kind = match self.storage {
            Storage::Dense => "dense",
            Storage::Sparse => "sparse",
        };
        let entries = self.panels.n_values();
        format!("constant {kind} Cholesky {size} × {size}, {entries} entries in its factor")
    }
}

impl<const P: usize> Product for Rows<P> {
    fn row_length(&self) -> usize {
        let lengths = self.starts.windows(2).map(|window| window[1] - window[0]);
        1 + lengths.max().unwrap_or(0)
    }

    fn add_products(&self, x: &[f64], product: &mut [f64], scale: &mut [f64]) {
        let x = x.as_chunks::<P>().0;
        let rows = product.as_chunks_mut::<P>().0.iter_mut().zip(scale.as_chunks_mut::<P>().0);
        for (row, (product, scale)) in rows.enumerate() {
            let mut add = |value: f64, x: &[f64; P]| {
                for axis in 0..P {
                    let term = value * x[axis];
                    product[axis] += term;
                    scale[axis] += term.abs();
                }
            };
            add(self.diagonal[row], &x[row]);
            let of_row = self.starts[row]..self.starts[row + 1];
            for (column, value) in self.columns[of_row.clone()].iter().zip(&self.values[of_row]) {
                add(*value, &x[*column as usize]);
            }
        }
    }

    fn add_row_sums(&self, sums: &mut [f64]) {
        for (row, sums) in sums.as_chunks_mut::<P>().0.iter_mut().enumerate() {
            let values = &self.values[self.starts[row]..self.starts[row + 1]];
            let sum = self.diagonal[row] + values.iter().map(|value| value.abs()).sum::<f64>();
            sums.iter_mut().for_each(|of_axis| *of_axis += sum);
        }
    }
}

/// Adds vector by vector.
pub(super) fn add<const P: usize>(values: &mut [[f64; P]], amounts: &[[f64; P]]) {
    for (value, amount) in values.iter_mut().zip(amounts) {
        for axis in 0..P {
            value[axis] += amount[axis];
        }
    }
}

/// One entry a pair of rows, the smaller row first, sorted; with the sign they have in `Q`.
fn merge_links(links: &[([usize; 2], f64)]) -> Vec<([usize; 2], f64)> {
    let ordered = links.iter().map(|&([a, b], stiffness)| ([a.min(b), a.max(b)], -stiffness));
    let mut links: Vec<([usize; 2], f64)> = ordered.collect();
    // Stable: several springs of one pair add up in the order of the file.
    links.sort_by_key(|link| link.0);
    links.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    links
}

fn dense(
    diagonal: &[f64],
    links: &[([usize; 2], f64)],
) -> Result<(Panels, Vec<usize>), LinearError> {
    let size = diagonal.len();
    let n_values = size.checked_mul(size).ok_or(LinearError::OutOfMemory { size })?;
    let mut panels =
        Panels::with_capacity(n_values).map_err(|_| LinearError::OutOfMemory { size })?;
    let mut matrix = DMatrix::zeros(size, size);
    (0..size).for_each(|row| matrix[(row, row)] = diagonal[row]);
    for &([a, b], value) in links {
        matrix[(a, b)] = value;
        matrix[(b, a)] = value;
    }
    let factor = matrix.cholesky().ok_or(LinearError::SingularToPrecision { size })?;
    let factor = factor.l_dirty();
    panels.push(0, size, &[], |row, column| factor[(row, column)]);
    Ok((panels, (0..size).collect()))
}

fn factorise_sparse(
    diagonal: &[f64],
    links: &[([usize; 2], f64)],
) -> Result<(Panels, Vec<usize>), LinearError> {
    let size = diagonal.len();
    if size == 0 {
        return Ok((Panels::default(), Vec::new()));
    }
    // The lower triangle, column by column: `links` are sorted by their smaller row, the column here.
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    let mut links = links.iter().peekable();
    for (column, on_diagonal) in diagonal.iter().enumerate() {
        rows.push(column as u32);
        values.push(*on_diagonal);
        while let Some(([_, row], value)) = links.next_if(|link| link.0[0] == column) {
            rows.push(*row as u32);
            values.push(*value);
        }
        starts.push(rows.len());
    }
    let factor = Cholesky::new(&starts, &rows, &values)?;
    let mut panels =
        Panels::with_capacity(factor.n_values()).map_err(|_| LinearError::OutOfMemory { size })?;
    for columns in factor.columns() {
        let entry = |row, column| columns.entry(row, column);
        panels.push(columns.first(), columns.count(), columns.below(), entry);
    }
    Ok((panels, factor.order().iter().map(|row| *row as usize).collect()))
}

#[cfg(test)]
#[path = "../../../sparse/src/forest.rs"]
mod forest;

#[cfg(test)]
mod tests {
    use super::forest::Forest;
    use super::*;

    /// The order of elimination, and the bits of the solutions for `P` right-hand sides at once.
    fn solve<const P: usize>(matrix: &GlobalMatrix, n_threads: usize) -> (Vec<usize>, Vec<u64>) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| {
            let statistics = &mut LinearStatistics::default();
            let solver = GlobalSolver::<P>::new(matrix, Storage::Sparse, statistics);
            let (mut solver, order) = solver.unwrap();
            let right: Vec<[f64; P]> = (0..order.len())
                .map(|row| std::array::from_fn(|axis| ((row * 5 + axis) % 17) as f64 - 7.5))
                .collect();
            let mut x = right.clone();
            solver.solve(&mut x);
            solver.check(&mut x, &right, statistics).unwrap();
            assert!(statistics.worst_residual < 1e-14, "{statistics:?}");
            (order, x.as_flattened().iter().map(|value| value.to_bits()).collect())
        })
    }

    /// Springs on the pairs of a forest; pinned particles have a weight.
    fn check(forest: &Forest) {
        let mut random = fastrand::Rng::with_seed(forest.pairs.len() as u64);
        let pins = forest.pinned.iter().map(|pinned| if *pinned { 1e10 } else { 0.0 });
        let mut matrix =
            GlobalMatrix { diagonal: pins.map(|pin| 0.5 + pin).collect(), links: Vec::new() };
        for &pair in &forest.pairs {
            let stiffness = 1e3 * random.f64();
            pair.iter().for_each(|row| matrix.diagonal[*row] += stiffness);
            matrix.links.push((pair, stiffness));
        }
        let (in_plane, in_space) = (solve::<2>(&matrix, 1), solve::<4>(&matrix, 1));
        for n_threads in [2, 3, 5] {
            let what = format!("{}, {n_threads} threads", forest.name);
            assert!(solve::<2>(&matrix, n_threads) == in_plane, "{what}");
            assert!(solve::<4>(&matrix, n_threads) == in_space, "{what}");
        }
    }

    #[test]
    fn several_right_hand_sides_of_a_forest_have_the_same_bits_by_any_number_of_threads() {
        check(&Forest::nets(2, 40));
        for seed in 0..16 {
            check(&Forest::new(seed, 8_000));
        }
    }

    #[test]
    #[ignore = "long: minutes"]
    fn long_several_right_hand_sides_of_two_thousand_forests_have_the_same_bits() {
        for seed in 1_000..3_000 {
            check(&Forest::new(seed, 1_500 << (seed % 5)));
        }
    }
}
