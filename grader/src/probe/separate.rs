//! Separates `K` and `B` of a part, from the matrices of steps with several `h`.
//!
//! ```text
//! A_h = h² K + h B      for each of the time steps: least squares, entry by entry, weighted by the bounds
//! ```
//!
//! Three time steps for two unknowns leave a misfit, which shows whether the matrix has this form at all. The matrix of
//! a part is the matrix of the whole force minus that of the force without the part.

use nalgebra::DMatrix;

use super::differences::{Differences, Estimate};
use super::identify::{Fit, Steps};
use super::noise::CLEAR;
use super::scenes::TIME_STEPS;
use super::verdict::{Block, Entry};

/// Tolerance for directions that two sets of steps share.
const SHARED: f64 = 1e-6;

/// The derivatives of a part at one state.
pub(super) struct Derivatives {
    pub(super) own: [Estimate; 2],
    pub(super) ours: [DMatrix<f64>; 2],
    /// The largest force.
    pub(super) force: f64,
}

impl Derivatives {
    /// Whether a block is not zero.
    pub(super) fn shows(&self, block: Block, which: usize, count: usize) -> bool {
        let own = &self.own[which];
        let size = own.value.nrows();
        (0..size * size).any(|index| {
            let (row, column) = (index % size, index / size);
            let clear = own.value[index].abs() > CLEAR * own.bound[index];
            block.holds(row / count, column / count) && clear
        })
    }

    pub(super) fn new(full: &Differences, without: Option<&Differences>) -> Self {
        let forces = full.samples.iter().flat_map(|sample| &sample.force);
        let force = forces.fold(0.0, |most: f64, force| most.max(force.abs()));
        let own = [full.by_position.clone(), full.by_velocity.clone()];
        let ours = full.ours.clone();
        match without {
            None => Self { own, ours, force },
            Some(without) => Self {
                own: [own[0].minus(&without.by_position), own[1].minus(&without.by_velocity)],
                ours: [&ours[0] - &without.ours[0], &ours[1] - &without.ours[1]],
                force,
            },
        }
    }
}

/// A part's matrix of one step.
pub(super) struct PartMatrix {
    pub(super) matrix: Estimate,
    /// Projects on the directions in which the steps determine it.
    pub(super) moved: DMatrix<f64>,
}

/// The part's matrix at each state for each time step.
pub(super) fn part_matrices(full: &Steps, without: Option<&Steps>) -> Vec<Vec<PartMatrix>> {
    let states = full.fits.iter().enumerate().map(|(state, fits)| {
        let steps = fits.iter().enumerate().map(|(step, fit)| match without {
            None => PartMatrix { matrix: fit.matrix.clone(), moved: fit.moved.clone() },
            Some(without) => part_matrix(fit, &without.fits[state][step]),
        });
        steps.collect()
    });
    states.collect()
}

/// The difference of two fits. In directions in which only one of them moves the particles, the part gets its expected
/// value.
fn part_matrix(full: &Fit, without: &Fit) -> PartMatrix {
    let mut matrix = full.matrix.minus(&without.matrix);
    if !full.is_partial && !without.is_partial {
        return PartMatrix { matrix, moved: full.moved.clone() };
    }
    // Directions that both projections leave unchanged.
    let size = full.moved.nrows();
    let both = (&full.moved + &without.moved).symmetric_eigen();
    let kept = both.eigenvalues.map(|value| f64::from(value > 2.0 - SHARED));
    let moved = &both.eigenvectors * DMatrix::from_diagonal(&kept) * both.eigenvectors.transpose();
    let left_out = DMatrix::identity(size, size) - &moved;
    matrix.value -= (&full.excess - &without.excess) * left_out;
    PartMatrix { matrix, moved }
}

/// `K` and `B` of one state.
pub(super) struct Separated {
    pub(super) matrices: [Estimate; 2],
    /// Misfit of `h² K + h B` and the measured matrices, as a multiple of the bound.
    pub(super) misfit: f64,
}

/// Least squares for `A_h = h² K + h B`, entry by entry, each matrix weighted by its bound.
pub(super) fn separate(steps: &[PartMatrix]) -> Separated {
    let matrices: Vec<&Estimate> = steps.iter().map(|step| &step.matrix).collect();
    let size = matrices.first().map_or(0, |first| first.value.nrows());
    let [mut by_x, mut by_v] = [Estimate::zeros(size), Estimate::zeros(size)];
    let mut misfit: f64 = 0.0;
    for index in 0..size * size {
        let [mut xx, mut xv, mut vv] = [0.0; 3];
        for (matrix, h) in matrices.iter().copied().zip(TIME_STEPS) {
            let weight = (1.0 / matrix.bound[index]).powi(2);
            xx += weight * h.powi(4);
            xv += weight * h.powi(3);
            vv += weight * h.powi(2);
        }
        let determinant = xx * vv - xv * xv;
        for (matrix, h) in matrices.iter().copied().zip(TIME_STEPS) {
            let (value, bound) = (matrix.value[index], matrix.bound[index]);
            let weight = (1.0 / bound).powi(2);
            let share_x = weight * (vv * h * h - xv * h) / determinant;
            let share_v = weight * (xx * h - xv * h * h) / determinant;
            by_x.value[index] += share_x * value;
            by_x.bound[index] += share_x.abs() * bound;
            by_v.value[index] += share_v * value;
            by_v.bound[index] += share_v.abs() * bound;
        }
        for (matrix, h) in matrices.iter().copied().zip(TIME_STEPS) {
            let made = h * h * by_x.value[index] + h * by_v.value[index];
            let slack = h * h * by_x.bound[index] + h * by_v.bound[index];
            let off = (matrix.value[index] - made).abs() / (matrix.bound[index] + slack);
            misfit = misfit.max(off);
        }
    }
    Separated { matrices: [by_x, by_v], misfit }
}

/// The entries of a block at one state.
pub(super) fn block_entries<'a>(
    block: Block,
    state: usize,
    count: usize,
    found: &'a Separated,
    expected: &'a Derivatives,
) -> impl Iterator<Item = Entry> + use<'a> {
    let which = usize::from(!block.is_by_position());
    let found = &found.matrices[which];
    let size = found.value.nrows();
    let indices = (0..size).flat_map(move |row| (0..size).map(move |column| (row, column)));
    let own = &expected.own[which];
    indices.filter(move |(row, column)| block.holds(row / count, column / count)).map(
        move |(row, column)| Entry {
            state,
            row: (row / count, row % count),
            column: Some((column / count, column % count)),
            measured: found.value[(row, column)],
            expected: own.value[(row, column)],
            ours: expected.ours[which][(row, column)],
            bound: found.bound[(row, column)] + own.bound[(row, column)],
            block: None,
        },
    )
}

/// The block of two particles, row by row.
pub(super) fn part_of(matrix: &DMatrix<f64>, row: usize, column: usize, count: usize) -> Vec<f64> {
    let view = matrix.view((row * count, column * count), (count, count));
    view.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<f64>>()).collect()
}
