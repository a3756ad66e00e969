//! The matrices of fast mass-spring, one round of it, and its step, on small nets.
//!
//! With `n` particles, `m` springs and `p` pins:
//!
//! ```text
//! A  m × n   +1 at the first end of a spring, −1 at the second        r  m × 1   lengths of the springs
//! M  n × n   masses on the diagonal                                   C  p × n   1 at the pinned particle of each row
//! Q  n × n   k AᵀA + M/h² + w CᵀC, of its factor                      step       50 rounds: d of each spring, then Q p = b
//!                                                                     round      one round
//!
//! arguments  n m p k h, positions at rest (n × 3), springs (m × 2), masses, pins, forces, positions one step ago, positions,
//!            then A, M, C, r, Q
//! ```
//!
//! (Liu et al., *Fast Simulation of Mass-Spring Systems*, 2013, and the assignment made of it.) In `Q`, each large weight `w` is
//! right. The step is given the right matrices, with the assignment's weight of 1e10, so that it is judged by itself.
//!
//! A hand-in has all rounds in one function. One round is judged by it where the others change nothing. With `p` any positions and
//! `c` a point, the springs of `p₀ = c + σ (p − c)` have the directions of those of `p`, so that both have the same `d`. Forces
//!
//! ```text
//! f = Q p − k Aᵀ d − w CᵀC V − M (2 p₀ − p₋₁)/h²
//! ```
//!
//! make `Q⁻¹ b = p`: the first round from `p₀` gives `p`, and so does each round from `p`. Springs that are longer than at rest keep
//! rounding errors from growing.

use nalgebra::DMatrix;

use super::Call;

/// The name before the slash in packs.
pub(super) const OWNER: &str = "fast-mass-spring";

/// Rounds of a step.
const ROUNDS: usize = 50;

/// The weight of the assignment, and the smallest one that counts as large.
const WEIGHTS: [f64; 2] = [1e10, 1e7];

/// Distances before a round that settles, relative to those after it.
const SHRUNK: f64 = 0.8;

/// Bound of an entry of a matrix, relative to its size: rounding of a factor and its product, with a margin of fifty.
const MATRIX: f64 = 1e-13;

/// Bound of a position after a step, relative to the largest coordinate. Dense and sparse factors differ by 1e-14 over the thirty
/// steps of whole scenes.
const STEP: f64 = 1e-9;

/// A matrix, or the step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matrix {
    /// The signed incidence matrix.
    Incidence,
    /// The masses.
    Masses,
    /// The selection of pinned particles.
    Pins,
    /// The lengths at rest.
    Lengths,
    /// The matrix of the global step, of its factor.
    Quadratic,
    /// A round of local and global step.
    Round,
    /// The rounds of one step.
    Step,
}

impl Matrix {
    /// All.
    pub const ALL: [Self; 7] = [
        Self::Incidence,
        Self::Masses,
        Self::Pins,
        Self::Lengths,
        Self::Quadratic,
        Self::Round,
        Self::Step,
    ];

    /// Its name in packs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Incidence => "A",
            Self::Masses => "M",
            Self::Pins => "C",
            Self::Lengths => "r",
            Self::Quadratic => "Q",
            Self::Round => "round",
            Self::Step => "step",
        }
    }

    pub(super) fn parse(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|matrix| matrix.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("{OWNER} has no {name:?}\n  help: it has {names}")
        })
    }

    pub(super) fn calls(self) -> Vec<Call> {
        // Without pins, C has no entry.
        let calls = nets().into_iter().map(|net| match self {
            Self::Round => self.call(&net.settling()),
            _ => self.call(&net),
        });
        calls.filter(|call| !call.expected.is_empty()).collect()
    }

    fn call(self, net: &Net) -> Call {
        let matrix = match self {
            Self::Incidence => net.incidence(),
            Self::Masses => DMatrix::from_diagonal(&net.masses.clone().into()),
            Self::Pins => net.selection(),
            Self::Lengths => DMatrix::from_column_slice(net.edges.len(), 1, &net.lengths()),
            Self::Quadratic => net.quadratic(WEIGHTS[1]),
            Self::Round => net.rounds(1),
            Self::Step => net.rounds(ROUNDS),
        };
        let by_row: Vec<f64> = matrix.transpose().iter().copied().collect();
        let largest = matrix.amax();
        let weighted = net.quadratic(WEIGHTS[0]);
        let bound = |place: usize| {
            let (row, column) = (place / matrix.ncols(), place % matrix.ncols());
            match self {
                Self::Round | Self::Step => STEP * largest,
                Self::Quadratic => {
                    MATRIX * (weighted[(row, row)] * weighted[(column, column)]).sqrt()
                }
                _ => MATRIX * largest,
            }
        };
        let pinned = net.pins.iter().map(|pin| pin * matrix.ncols() + pin);
        Call {
            state: net.name.to_owned(),
            arguments: net.arguments(),
            rows: matrix.nrows(),
            bounds: (0..by_row.len()).map(bound).collect(),
            expected: by_row,
            at_least: if self == Self::Quadratic { pinned.collect() } else { Vec::new() },
            block: 1,
        }
    }
}

/// Particles with springs between them.
struct Net {
    name: &'static str,
    stiffness: f64,
    time_step: f64,
    /// At rest, one step ago, now; `n × 3`.
    positions: [DMatrix<f64>; 3],
    forces: DMatrix<f64>,
    edges: Vec<[usize; 2]>,
    masses: Vec<f64>,
    pins: Vec<usize>,
}

/// Nets with other numbers of particles, springs and pins, springs in both directions, and other masses.
fn nets() -> Vec<Net> {
    let chain = (0..4).map(|number| [number, number + 1]).collect();
    let square = vec![[1, 0], [1, 2], [3, 2], [0, 3], [0, 2], [4, 1], [3, 4]];
    let free = vec![[2, 0], [0, 1], [1, 2]];
    vec![
        net("a spring", vec![[0, 1]], &[1], (420.0, 1.0 / 30.0), 1),
        net("a chain of five", chain, &[0, 4], (85.0, 0.02), 2),
        net("a square with a diagonal and a tail", square, &[3, 1], (230.0, 0.01), 3),
        net("a triangle without pins", free, &[], (50.0, 0.05), 4),
    ]
}

fn net(
    name: &'static str,
    edges: Vec<[usize; 2]>,
    pins: &[usize],
    (stiffness, time_step): (f64, f64),
    seed: u64,
) -> Net {
    let n = 1 + edges.iter().flatten().copied().max().unwrap_or(0);
    let mut rng = fastrand::Rng::with_seed(seed);
    let mut random = |size: f64| DMatrix::from_fn(n, 3, |_, _| size * (2.0 * rng.f64() - 1.0));
    let rest =
        DMatrix::from_fn(n, 3, |row, axis| row as f64 * [0.8, 0.3, -0.5][axis]) + random(0.3);
    let mut before = &rest + random(0.1);
    let mut now = &before + random(0.02);
    for pin in pins {
        before.set_row(*pin, &rest.row(*pin));
        now.set_row(*pin, &rest.row(*pin));
    }
    let forces = random(4.0);
    let masses = (0..n).map(|number| 0.5 + 0.25 * number as f64).collect();
    let positions = [rest, before, now];
    Net { name, stiffness, time_step, positions, forces, edges, masses, pins: pins.to_vec() }
}

impl Net {
    fn arguments(&self) -> Vec<f64> {
        let counts = [self.masses.len(), self.edges.len(), self.pins.len()];
        let indices = |all: &[usize]| all.iter().map(|index| *index as f64).collect::<Vec<_>>();
        let rows = |matrix: &DMatrix<f64>| matrix.transpose().iter().copied().collect::<Vec<_>>();
        let [rest, before, now] = &self.positions;
        [
            indices(&counts),
            vec![self.stiffness, self.time_step],
            rows(rest),
            indices(self.edges.as_flattened()),
            self.masses.clone(),
            indices(&self.pins),
            rows(&self.forces),
            rows(before),
            rows(now),
            rows(&self.incidence()),
            rows(&DMatrix::from_diagonal(&self.masses.clone().into())),
            rows(&self.selection()),
            self.lengths(),
            rows(&self.quadratic(WEIGHTS[0])),
        ]
        .concat()
    }

    fn incidence(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.edges.len(), self.masses.len());
        for (row, [first, second]) in self.edges.iter().enumerate() {
            matrix[(row, *first)] = 1.0;
            matrix[(row, *second)] = -1.0;
        }
        matrix
    }

    fn selection(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.pins.len(), self.masses.len());
        self.pins.iter().enumerate().for_each(|(row, pin)| matrix[(row, *pin)] = 1.0);
        matrix
    }

    fn lengths(&self) -> Vec<f64> {
        (self.incidence() * &self.positions[0]).row_iter().map(|row| row.norm()).collect()
    }

    fn quadratic(&self, weight: f64) -> DMatrix<f64> {
        let (a, c) = (self.incidence(), self.selection());
        let masses = DMatrix::from_diagonal(&self.masses.clone().into());
        self.stiffness * a.transpose() * a
            + masses / (self.time_step * self.time_step)
            + weight * c.transpose() * c
    }

    /// `Q p` without the springs.
    fn fixed(&self) -> DMatrix<f64> {
        let [rest, before, now] = &self.positions;
        let c = self.selection();
        let masses = DMatrix::from_diagonal(&self.masses.clone().into());
        let inertia = masses * (2.0 * now - before) / (self.time_step * self.time_step);
        WEIGHTS[0] * c.transpose() * &c * rest + inertia + &self.forces
    }

    /// `k Aᵀ d`, with `d` the springs at `p`, as long as at rest.
    fn springs(&self, p: &DMatrix<f64>) -> DMatrix<f64> {
        let a = self.incidence();
        let mut d = &a * p;
        for (mut row, length) in d.row_iter_mut().zip(self.lengths()) {
            row *= length / row.norm();
        }
        self.stiffness * a.transpose() * d
    }

    fn rounds(&self, count: usize) -> DMatrix<f64> {
        let factor = self.quadratic(WEIGHTS[0]).lu();
        let fixed = self.fixed();
        (0..count).fold(self.positions[2].clone(), |p, _| {
            factor.solve(&(self.springs(&p) + &fixed)).unwrap_or(p)
        })
    }

    /// The net with positions and forces from which one round leads to what the next one keeps.
    fn settling(mut self) -> Self {
        let rest = &self.positions[0];
        let is_free = |row: usize| !self.pins.contains(&row);
        // Free particles to both sides of the net in turn, so that springs are longer than at rest.
        let side = |row: usize, axis: usize| {
            [0.3, -0.8, 0.1][axis] * if row.is_multiple_of(2) { 1.2 } else { -1.0 }
        };
        let aside =
            DMatrix::from_fn(
                rest.nrows(),
                3,
                |row, axis| {
                    if is_free(row) { side(row, axis) } else { 0.0 }
                },
            );
        let end = rest + aside;
        let centre = rest.row(self.pins.first().copied().unwrap_or(0)).into_owned();
        let mut start = end.clone();
        for mut row in start.row_iter_mut() {
            let offset = SHRUNK * (row.clone_owned() - &centre);
            row.copy_from(&(&centre + offset));
        }
        self.positions[2] = start;
        self.forces.fill(0.0);
        self.forces = self.quadratic(WEIGHTS[0]) * &end - self.springs(&end) - self.fixed();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest error of a step of `count` rounds, relative to the bound of its entries.
    fn excess(matrix: Matrix, count: usize, change: impl Fn(&mut Net)) -> f64 {
        let of_net = |net: Net| {
            let mut net = if matrix == Matrix::Round { net.settling() } else { net };
            let call = matrix.call(&net);
            change(&mut net);
            let stated = net.rounds(count).transpose();
            let errors = stated.iter().zip(&call.expected).zip(&call.bounds);
            errors.map(|((a, b), bound)| (a - b).abs() / bound).fold(0.0, f64::max)
        };
        nets().into_iter().map(of_net).fold(0.0, f64::max)
    }

    #[test]
    fn a_round_is_judged_whatever_the_number_of_rounds() {
        for count in [1, 2, 10, ROUNDS, 200] {
            let error = excess(Matrix::Round, count, |_| {});
            assert!(error < 1e-2, "{count} rounds: {error}");
            let is_right = excess(Matrix::Step, count, |_| {}) <= 1.0;
            assert_eq!(is_right, count >= ROUNDS, "{count} rounds");
        }
        // No round at all, and a mistake in each term.
        assert!(excess(Matrix::Round, 0, |_| {}) > 1e3);
        for change in [
            (|net| net.forces *= 1.0 + 1e-6) as fn(&mut Net),
            |net| net.masses.iter_mut().for_each(|mass| *mass *= 1.0 + 1e-6),
            |net| net.stiffness *= 1.0 + 1e-6,
            |net| net.time_step *= 1.0 + 1e-6,
            |net| net.positions[1] *= 1.0 + 1e-6,
            |net| net.positions[0] *= 1.0 + 1e-6,
        ] {
            assert!(excess(Matrix::Round, ROUNDS, change) > 1.0);
        }
    }
}
