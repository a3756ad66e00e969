//! Properties of the factorisation of many random forests, whatever the number of threads.
//!
//! A matrix of several components has several roots in its elimination tree, among them roots that are alone.

use std::ops::Range;
use std::sync::LazyLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::blocks::BlockColumns;
use crate::checked::Checked;
use crate::factor::with_large_fronts;
use crate::forest::Forest;
use crate::pivot::Inertia;
use crate::sizes::{BRANCHES, DEEPEST, LARGE, MAX_UNORDERED_BLOCKS, MIN_PRODUCTS, PANEL};
use crate::statistics::LinearStatistics;
use crate::symbolic::{Branch, SymbolicFactor};

/// Pools of 1, 2, 3 and 5 threads.
static POOLS: LazyLock<[ThreadPool; 4]> = LazyLock::new(|| {
    [1, 2, 3, 5].map(|count| ThreadPoolBuilder::new().num_threads(count).build().unwrap())
});

/// Rows from which on fronts are large, and the pool: compared with no large fronts in one thread.
const WAYS: [(usize, usize); 7] =
    [(0, 0), (LARGE, 0), (0, 1), (LARGE, 1), (LARGE, 2), (0, 3), (LARGE, 3)];

/// The kind of matrix that is made for a forest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Definite,
    Indefinite,
    Unsymmetric,
}

impl Forest {
    /// A matrix that every order of elimination without exchanges of blocks factorises stably: each diagonal entry exceeds
    /// the sum of the others of its row and column. Of an indefinite matrix, the large entries of half the diagonal blocks
    /// stand on their other diagonal, and are exchanged. With a penalty, pinned particles have entries of 1e10.
    fn matrix<const D: usize>(&self, kind: Kind, random: &mut fastrand::Rng) -> BlockColumns<D> {
        let symmetric = kind != Kind::Unsymmetric;
        let mut matrix = BlockColumns::<D>::new(self.n_particles, &self.pairs, symmetric);
        let mut sums = vec![[0.0; D]; self.n_particles];
        for column in 0..self.n_particles {
            for place in matrix.starts[column]..matrix.starts[column + 1] {
                let row = matrix.rows[place] as usize;
                for (j, i) in (0..D).flat_map(|j| (0..D).map(move |i| (j, i))) {
                    let entry = &mut matrix.values[place * D * D + j * D + i];
                    if row != column {
                        *entry = random.f64() - 0.5;
                        sums[row][i] += entry.abs();
                        sums[column][j] += entry.abs();
                    }
                }
            }
        }
        let weight = 1e-3 + random.f64();
        for (particle, sums) in sums.iter().enumerate() {
            let definite = kind == Kind::Definite || random.bool();
            let sign = if definite { 1.0 } else { -1.0 };
            let pin = if self.pinned[particle] { 1e10 } else { 0.0 };
            let turned = kind == Kind::Indefinite && random.bool();
            let block = nalgebra::SMatrix::<f64, D, D>::from_fn(|i, j| {
                let is_large = if turned { i + j + 1 == D } else { i == j };
                if is_large {
                    sign * (1.0 + weight) * (sums[i].max(sums[j]) + weight) + sign * pin
                } else {
                    0.25 * weight * weight / (1.0 + (i + j) as f64)
                }
            });
            matrix.add_at(matrix.starts[particle] * D * D, &block);
        }
        matrix
    }

    /// A graph of so many particles.
    fn of(n_particles: usize, pairs: Vec<[usize; 2]>) -> Self {
        let name = format!("{n_particles} particles");
        Self { name, n_particles, pairs, pinned: vec![false; n_particles] }
    }

    /// A net of so many rows and columns, with one diagonal in each cell.
    fn net(rows: usize, columns: usize) -> Self {
        let mut pairs = Vec::new();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)))
        {
            let neighbours = [(row, column + 1), (row + 1, column), (row + 1, column + 1)];
            let inside = neighbours.iter().filter(|(row, column)| *row < rows && *column < columns);
            let own = row * columns + column;
            pairs.extend(inside.map(|(row, column)| [own, row * columns + column]));
        }
        Self::of(rows * columns, pairs)
    }

    /// Without the pinned particles: what is joined through them alone falls apart.
    fn without_pinned(&self) -> Self {
        let mut left = 0;
        let mut numbers = Vec::with_capacity(self.n_particles);
        for pinned in &self.pinned {
            numbers.push((!pinned).then_some(left));
            left += usize::from(!pinned);
        }
        let pair = |[i, j]: &[usize; 2]| Some([numbers[*i]?, numbers[*j]?]);
        Self {
            name: format!("{}, which are left out", self.name),
            n_particles: left,
            pairs: self.pairs.iter().filter_map(pair).collect(),
            pinned: vec![false; left],
        }
    }
}

/// Counts of cases among the forests: a test shows by them that it has tested something.
#[derive(Debug, Default)]
struct Met {
    divided: u32,
    of_several_roots: u32,
    with_large_fronts: u32,
}

/// Factorises and solves in every way: the same bits, and a solution at rounding after at most one refinement.
fn check<const D: usize>(forest: &Forest, kind: Kind, seed: u64, met: &mut Met) {
    let matrix = forest.matrix::<D>(kind, &mut fastrand::Rng::with_seed(seed));
    let symbolic = SymbolicFactor::new(&matrix.starts, &matrix.rows);
    let what = format!("{}, {D}D, {kind:?}", forest.name);
    let (inertia, _) = check_matrix(&matrix, &symbolic, &WAYS, &what);
    // Of many particles, some are indefinite.
    if forest.n_particles > if kind == Kind::Indefinite { 60 } else { 0 } {
        assert_eq!(inertia == Inertia::Definite, kind == Kind::Definite, "{what}");
    }
    let n_roots = symbolic.fronts.iter().filter(|front| front.n_rows() == 0).count();
    let divided = symbolic.is_divided();
    met.divided += u32::from(divided);
    met.of_several_roots += u32::from(divided && n_roots > 1);
    met.with_large_fronts += u32::from(divided && symbolic.max_height * D >= LARGE);
}

/// The signs of the pivots and the bits of the solution, in every way the same.
fn check_matrix<const D: usize>(
    matrix: &BlockColumns<D>,
    symbolic: &SymbolicFactor,
    ways: &[(usize, usize)],
    what: &str,
) -> (Inertia, Vec<u64>) {
    check_places(symbolic, what);
    let run = |large, pool: usize| {
        let mut factor = with_large_fronts::<D>(symbolic, matrix.symmetric, large).unwrap();
        POOLS[pool].install(|| {
            // The second time, workspaces are not zero.
            factor.factorise(symbolic, &matrix.values);
            let inertia = factor.factorise(symbolic, &matrix.values);
            let mut checked = Checked::new(matrix.size());
            let right = checked.right.iter_mut().enumerate();
            right.for_each(|(row, value)| *value = (row % 17) as f64 - 7.5);
            let statistics = &mut LinearStatistics::default();
            let solved = checked.attempt(matrix, 1, statistics, |b| {
                factor.solve(symbolic, b);
                true
            });
            assert_eq!(solved, Some(true), "{what}: {:e}", checked.error);
            let bits: Vec<u64> = checked.solution.iter().map(|value| value.to_bits()).collect();
            (inertia, bits)
        })
    };
    let expected = run(usize::MAX, 0);
    for &(large, pool) in ways {
        let n_threads = POOLS[pool].current_num_threads();
        assert!(run(large, pool) == expected, "{what}: fronts from {large}, {n_threads} threads");
    }
    expected
}

/// Each branch has a separate part of the workspace, every front a place in it, and no two update matrices that wait
/// at the same time have a place in common.
fn check_places(symbolic: &SymbolicFactor, what: &str) {
    let whole = 0..symbolic.n_updates;
    check_branches(symbolic, &symbolic.branches, &whole, what);
    let fronts: Vec<usize> = symbolic.branches.iter().flat_map(|one| one.fronts.clone()).collect();
    assert!(fronts.into_iter().eq(0..symbolic.fronts.len()), "{what}");
}

fn check_branches(
    symbolic: &SymbolicFactor,
    branches: &[Branch],
    workspace: &Range<usize>,
    what: &str,
) {
    for (number, branch) in branches.iter().enumerate() {
        let end = branches.get(number + 1).map_or(workspace.end, |next| next.update);
        let own = branch.update..end;
        assert!(workspace.start <= own.start && own.start <= own.end && own.end <= workspace.end);
        check_branches(symbolic, &branch.branches, &own, what);
        let place = |front: usize| {
            let front = &symbolic.fronts[front];
            front.update..front.update + front.n_rows().pow(2)
        };
        let mut waiting: Vec<usize> =
            branch.branches.iter().map(|inner| inner.fronts.end - 1).collect();
        for front in branch.trunk() {
            let made = place(front);
            assert!(own.start <= made.start && made.end <= own.end, "{what}: front {front}");
            let apart = |other: &usize| {
                let other = place(*other);
                other.end <= made.start || made.end <= other.start
            };
            assert!(made.is_empty() || waiting.iter().all(apart), "{what}: front {front}");
            let [start, end] = symbolic.fronts[front].children;
            let children = &symbolic.children[start..end];
            waiting.retain(|waiting| !children.contains(&(*waiting as u32)));
            // A root waits for nobody.
            waiting.extend((!made.is_empty()).then_some(front));
        }
    }
}

/// The forest of a seed, as every kind of matrix; with pinned particles as unknowns, and without them.
fn check_forest(seed: u64, most: usize, met: &mut Met) {
    let forest = Forest::new(seed, most);
    for forest in [forest.without_pinned(), forest] {
        for kind in [Kind::Definite, Kind::Indefinite, Kind::Unsymmetric] {
            match (seed + kind as u64) % 3 {
                0 => check::<1>(&forest, kind, seed, met),
                1 => check::<2>(&forest, kind, seed, met),
                _ => check::<3>(&forest, kind, seed, met),
            }
        }
    }
}

#[test]
fn forests_have_the_same_bits_by_any_number_of_threads() {
    let mut met = Met::default();
    for seed in 0..8 {
        check_forest(seed, 12_000, &mut met);
    }
    let Met { divided, of_several_roots, with_large_fronts } = met;
    assert!(divided >= 3 && of_several_roots >= 3 && with_large_fronts >= 1, "{met:?}");
}

#[test]
#[ignore = "long: minutes"]
fn long_two_thousand_forests_have_the_same_bits_by_any_number_of_threads() {
    let mut met = Met::default();
    for seed in 1_000..3_000 {
        check_forest(seed, 1_500 << (seed % 5), &mut met);
    }
    let Met { divided, of_several_roots, with_large_fronts } = met;
    assert!(divided >= 500 && of_several_roots >= 400 && with_large_fronts >= 300, "{met:?}");
}

#[test]
fn equal_nets_side_by_side_have_the_same_bits_by_any_number_of_threads() {
    let mut met = Met::default();
    for (count, side) in [(1, 60), (2, 40), (2, 60), (3, 40), (50, 12)] {
        let forest = Forest::nets(count, side);
        check::<1>(&forest, Kind::Definite, 1, &mut met);
        check::<2>(&forest, Kind::Unsymmetric, 1, &mut met);
        check::<3>(&forest, Kind::Indefinite, 1, &mut met);
    }
    assert!(met.of_several_roots >= 6, "{met:?}");
}

/// The symbolic factor of a graph.
fn symbolic(forest: &Forest) -> SymbolicFactor {
    let matrix = forest.matrix::<1>(Kind::Definite, &mut fastrand::Rng::with_seed(1));
    SymbolicFactor::new(&matrix.starts, &matrix.rows)
}

#[test]
fn small_matrices_keep_the_order_of_the_file() {
    // Stars around their first particle, which every other order eliminates late.
    for size in MAX_UNORDERED_BLOCKS - 1..=MAX_UNORDERED_BLOCKS + 2 {
        let star = Forest::of(size, (1..size).map(|i| [0, i]).collect());
        let in_order = symbolic(&star).order.into_iter().eq(0..size as u32);
        assert_eq!(in_order, size <= MAX_UNORDERED_BLOCKS, "{size}");
        for kind in [Kind::Definite, Kind::Unsymmetric] {
            check::<1>(&star, kind, 1, &mut Met::default());
            check::<2>(&star, kind, 1, &mut Met::default());
            check::<3>(&star, kind, 1, &mut Met::default());
        }
    }
}

#[test]
fn threads_begin_at_a_number_of_products() {
    // The first size of a net of this width that is divided, and the one before it.
    let is_large = |rows: &usize| symbolic(&Forest::net(*rows, 47)).n_products >= MIN_PRODUCTS;
    let first = (30..70).find(is_large).expect("a net of 47 by 70 is large");
    for (rows, divided) in [(first - 1, false), (first, true)] {
        let net = Forest::net(rows, 47);
        assert_eq!(symbolic(&net).is_divided(), divided, "{rows}");
        check::<2>(&net, Kind::Definite, 1, &mut Met::default());
        check::<3>(&net, Kind::Unsymmetric, 1, &mut Met::default());
    }
}

#[test]
fn branches_of_any_cost_have_the_same_bits() {
    for count in [BRANCHES - 1, BRANCHES, BRANCHES + 1] {
        let nets = Forest::nets(count as usize, 24);
        // Equal nets are just what is not divided further, or just what is.
        let symbolic = symbolic(&nets);
        assert_eq!(symbolic.branches.len() as u64, count);
        let leaves = symbolic.branches.iter().all(|branch| branch.branches.is_empty());
        assert_eq!(leaves, count >= BRANCHES, "{count}");
        check::<1>(&nets, Kind::Definite, 1, &mut Met::default());
        check::<3>(&nets, Kind::Indefinite, 1, &mut Met::default());
    }
}

#[test]
fn branches_of_any_depth_have_the_same_bits() {
    let forest = Forest::nets(2, 60);
    let matrix = forest.matrix::<2>(Kind::Definite, &mut fastrand::Rng::with_seed(1));
    let solutions = [0, 1, 2, DEEPEST].map(|levels| {
        let symbolic = SymbolicFactor::with_levels(&matrix.starts, &matrix.rows, levels);
        assert!(depth(&symbolic.branches) <= levels + 1);
        check_matrix(&matrix, &symbolic, &WAYS, &format!("{levels} levels"))
    });
    assert!(solutions.iter().all(|solution| *solution == solutions[0]));
}

/// Levels of branches within branches.
fn depth(branches: &[Branch]) -> usize {
    branches.iter().map(|branch| 1 + depth(&branch.branches)).max().unwrap_or(0)
}

#[test]
fn large_fronts_have_the_same_bits() {
    let forest = Forest::nets(1, 60);
    let matrix = forest.matrix::<2>(Kind::Unsymmetric, &mut fastrand::Rng::with_seed(1));
    let symbolic = SymbolicFactor::new(&matrix.starts, &matrix.rows);
    let highest = 2 * symbolic.max_height;
    assert!(highest > LARGE + 1, "{highest}");
    // One front more or less is large.
    let limits = [LARGE - 1, LARGE, LARGE + 1, highest - 1, highest, highest + 1];
    let ways: Vec<_> = limits.into_iter().flat_map(|large| [(large, 0), (large, 2)]).collect();
    check_matrix(&matrix, &symbolic, &ways, "a net");
}

#[test]
fn fronts_of_every_small_size_have_the_same_bits() {
    // Two groups of particles, each joined to a third one, and all pairs in each: up to three panels of pivots, and up
    // to four chunks or tiles of rows, whole and not.
    let met = &mut Met::default();
    for n_pivots in 1..=2 * PANEL + 1 {
        for n_rows in [0, 1, 2, 3, 5, 7, 8, 9, 11, 16, 17] {
            let all = 2 * n_pivots + n_rows;
            let group = |i: usize| (i / n_pivots).min(2);
            let is_joined = |[i, j]: &[usize; 2]| group(*i) == group(*j) || group(*j) == 2;
            let pairs = (0..all).flat_map(|j| (0..j).map(move |i| [i, j]));
            let forest = Forest::of(all, pairs.filter(is_joined).collect());
            let kind = [Kind::Definite, Kind::Indefinite, Kind::Unsymmetric][n_rows % 3];
            check::<1>(&forest, kind, 1, met);
            check::<2>(&forest, kind, 1, met);
            check::<3>(&forest, kind, 1, met);
        }
    }
}
