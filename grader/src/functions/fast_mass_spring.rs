//! The matrices of fast mass-spring, and its step, on small nets.
//!
//! With `n` particles, `m` springs and `p` pins:
//!
//! ```text
//! A  m × n   +1 at the first end of a spring, −1 at the second        r  m × 1   lengths of the springs
//! M  n × n   masses on the diagonal                                   C  p × n   1 at the pinned particle of each row
//! Q  n × n   k AᵀA + M/h² + w CᵀC, of its factor                      step       50 rounds: d of each spring, then Q p = b
//!
//! arguments  n m p k h, positions at rest (n × 3), springs (m × 2), masses, pins, forces, positions one step ago, positions,
//!            then A, M, C, r, Q
//! ```
//!
//! (Liu et al., *Fast Simulation of Mass-Spring Systems*, 2013, and the assignment made of it.) In `Q`, each large weight `w` is
//! right. The step is given the right matrices, with the assignment's weight of 1e10, so that it is judged by itself.

use nalgebra::DMatrix;

use super::Call;

/// The name before the slash in packs.
pub(super) const OWNER: &str = "fast-mass-spring";

/// Rounds of a step.
const ROUNDS: usize = 50;

/// The weight of the assignment, and the smallest one that counts as large.
const WEIGHTS: [f64; 2] = [1e10, 1e7];

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
    /// The rounds of one step.
    Step,
}

impl Matrix {
    /// All.
    pub const ALL: [Self; 6] =
        [Self::Incidence, Self::Masses, Self::Pins, Self::Lengths, Self::Quadratic, Self::Step];

    /// Its name in packs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Incidence => "A",
            Self::Masses => "M",
            Self::Pins => "C",
            Self::Lengths => "r",
            Self::Quadratic => "Q",
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
        let calls = nets().into_iter().map(|net| self.call(&net));
        calls.filter(|call| !call.expected.is_empty()).collect()
    }

    fn call(self, net: &Net) -> Call {
        let matrix = match self {
            Self::Incidence => net.incidence(),
            Self::Masses => DMatrix::from_diagonal(&net.masses.clone().into()),
            Self::Pins => net.selection(),
            Self::Lengths => DMatrix::from_column_slice(net.edges.len(), 1, &net.lengths()),
            Self::Quadratic => net.quadratic(WEIGHTS[1]),
            Self::Step => net.step(),
        };
        let by_row: Vec<f64> = matrix.transpose().iter().copied().collect();
        let largest = matrix.amax();
        let weighted = net.quadratic(WEIGHTS[0]);
        let bound = |place: usize| {
            let (row, column) = (place / matrix.ncols(), place % matrix.ncols());
            match self {
                Self::Step => STEP * largest,
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

    fn step(&self) -> DMatrix<f64> {
        let [rest, before, now] = &self.positions;
        let (a, c, lengths) = (self.incidence(), self.selection(), self.lengths());
        let masses = DMatrix::from_diagonal(&self.masses.clone().into());
        let inertia = masses * (2.0 * now - before) / (self.time_step * self.time_step);
        let fixed = WEIGHTS[0] * c.transpose() * &c * rest + inertia + &self.forces;
        let factor = self.quadratic(WEIGHTS[0]).lu();
        let mut p = now.clone();
        for _ in 0..ROUNDS {
            let mut d = &a * &p;
            for (mut row, length) in d.row_iter_mut().zip(&lengths) {
                row *= length / row.norm();
            }
            let b = self.stiffness * a.transpose() * d + &fixed;
            p = factor.solve(&b).unwrap_or(p);
        }
        p
    }
}
