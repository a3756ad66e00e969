//! Multifrontal block factorisation of a sparse matrix with a symmetric pattern: `P A Pᵀ = L B Lᵀ` of a symmetric
//! matrix, definite or not, and `P A Pᵀ = L B U` of any other.
//!
//! `L` has unit diagonal blocks, and `B` is made of `D × D` blocks. Each of these is factorised with complete pivoting
//! where it needs it, so that a block with zeros on its diagonal is no harm; blocks are not exchanged for each other,
//! so that the symbolic factor ([`symbolic`](crate::symbolic)) holds for every matrix of a pattern. Accuracy
//! lost where a whole pivot block is tiny shows in the backward error of the solution
//! ([`checked`](crate::checked)), and the caller then tries another method.
//!
//! With `V` the columns below a pivot block `B`, and `W` the transposed rows to its right (`V = W` in a symmetric matrix),
//! `X = V B⁻¹` are the columns of `L`, and `X Wᵀ` is subtracted from what is to the right. The rows of `U` are kept
//! transposed, in the layout of `L`: the same kernel subtracts `W Xᵀ` from them. Tiles are held in registers. Large
//! fronts have a separate kernel ([`front`](crate::front)).
//!
//! Threads eliminate the branches of a large tree at the same time, and share the work on each large front that the
//! branches have in common. Every number is computed by one thread, from the same numbers in the same order.
//!
//! Everything is sums and products in a fixed order, never fused, whatever vectors the processor has: the
//! bits are the same on all of them. Cost: `2 D³` operations for each product of blocks in the symbolic factor, twice that
//! without symmetry; a solution is two passes over the factor. Nothing is allocated after [`new`].

#![expect(clippy::needless_range_loop, reason = "indices run over several arrays at once")]

use std::ops::Range;

use pulp::Simd;

use crate::front::{FrontWorkspace, first_row};
use crate::pivot::{Inertia, PivotBlock, zeros};
use crate::sizes::{LARGE, PANEL, TILE_ROWS};
use crate::statistics::FactorWork;
use crate::symbolic::{Branch, Front, SymbolicFactor};

/// The numeric factor of blocks of some size.
pub(crate) trait Factor: Send + Sync {
    /// Factorises the matrix whose blocks are `values`.
    fn factorise(&mut self, symbolic: &SymbolicFactor, values: &[f64]) -> Inertia;

    /// Overwrites a right-hand side by the solution.
    fn solve(&mut self, symbolic: &SymbolicFactor, values: &mut [f64]);

    /// Magnitude of the smallest pivot of the last factorisation.
    fn smallest_pivot(&self) -> f64;

    /// The work since the last call.
    fn take_work(&mut self) -> FactorWork;
}

/// Allocates a factor, with fronts that are large from so many rows on; `None` if there is not enough memory.
type Allocate = fn(&SymbolicFactor, bool, usize) -> Option<Box<dyn Factor>>;

/// Factors of blocks of one to three rows: compiled in this crate, and not again in each that solves.
static OF_FEW_ROWS: [Allocate; 3] = [allocate::<1>, allocate::<2>, allocate::<3>];

fn allocate<const D: usize>(
    symbolic: &SymbolicFactor,
    symmetric: bool,
    large: usize,
) -> Option<Box<dyn Factor>> {
    Some(Box::new(BlockFactor::<D>::new(symbolic, symmetric, large)?))
}

/// Allocates the factor of blocks of `D` rows; `None` if there is not enough memory.
pub(crate) fn new<const D: usize>(
    symbolic: &SymbolicFactor,
    symmetric: bool,
) -> Option<Box<dyn Factor>> {
    let large = if uses_threads(symbolic) { LARGE } else { usize::MAX };
    with_large_fronts::<D>(symbolic, symmetric, large)
}

/// The same with fronts that are large from so many rows on.
pub(crate) fn with_large_fronts<const D: usize>(
    symbolic: &SymbolicFactor,
    symmetric: bool,
    large: usize,
) -> Option<Box<dyn Factor>> {
    let allocate =
        if const { 0 < D && D <= OF_FEW_ROWS.len() } { OF_FEW_ROWS[D - 1] } else { allocate::<D> };
    allocate(symbolic, symmetric, large)
}

/// The numeric factor, with the workspace of factorisation and substitution.
pub(crate) struct BlockFactor<const D: usize> {
    lower: Triangle,
    /// Rows of `U`, transposed; empty for a symmetric matrix.
    upper: Triangle,
    /// Diagonal blocks, transposed and factorised.
    pivots: Vec<PivotBlock<D>>,
    /// Of each branch that is not divided. Fronts above several branches use that of the heaviest one.
    workspaces: Vec<Workspace<D>>,
    /// A right-hand side in the order of elimination.
    permuted: Vec<f64>,
    /// The part of it that a front sees.
    gathered: Vec<f64>,
    /// Rows of a front from which on it is eliminated in chunks.
    large: usize,
    /// Work since the last query.
    work: FactorWork,
}

/// A triangle of the factor.
#[derive(Default)]
struct Triangle {
    /// Columns, front by front, each front's from its first pivot on; only what is below the diagonal blocks is
    /// meaningful.
    columns: Vec<f64>,
    /// Update matrices that wait for their parents.
    updates: Vec<f64>,
}

/// Workspace of a thread.
struct Workspace<const D: usize> {
    /// `V` of the current panel of a small front.
    unscaled: Vec<f64>,
    large: FrontWorkspace<D>,
}

impl<const D: usize> BlockFactor<D> {
    /// Allocates the factor, with fronts that are large from so many rows on; `None` if there is not enough memory.
    pub(crate) fn new(symbolic: &SymbolicFactor, symmetric: bool, large: usize) -> Option<Self> {
        let height = symbolic.max_height * D;
        let workspaces = Workspace::of_branches(symbolic, &symbolic.branches, large);
        let zero = PivotBlock { lu: [[0.0; D]; D], rows: [0; D], columns: [0; D] };
        Some(Self {
            lower: Triangle::new(symbolic, D)?,
            upper: if symmetric { Triangle::default() } else { Triangle::new(symbolic, D)? },
            pivots: vec![zero; symbolic.order.len()],
            workspaces: workspaces?,
            permuted: zeros(symbolic.order.len() * D, 0.0)?,
            gathered: zeros(height, 0.0)?,
            large,
            work: FactorWork::default(),
        })
    }

    /// Whether it is the factor of a symmetric matrix.
    fn is_symmetric(&self) -> bool {
        self.upper.columns.is_empty()
    }
}

impl<const D: usize> Factor for BlockFactor<D> {
    fn factorise(&mut self, symbolic: &SymbolicFactor, values: &[f64]) -> Inertia {
        let products = if self.is_symmetric() { 1 } else { 2 } * symbolic.n_products;
        self.work.operations += 2 * (D * D * D) as u64 * products;
        let threads = uses_threads(symbolic);
        let arch = pulp::Arch::new();
        let mut run = || {
            if self.is_symmetric() {
                arch.dispatch(Factorise::<D, true> { symbolic, values, factor: self, threads })
            } else {
                arch.dispatch(Factorise::<D, false> { symbolic, values, factor: self, threads })
            }
        };
        if threads { rayon::scope(|_| run()) } else { run() }
    }

    fn smallest_pivot(&self) -> f64 {
        let reciprocals = self.pivots.iter().flat_map(|pivot| (0..D).map(|k| pivot.lu[k][k].abs()));
        reciprocals.fold(0.0, f64::max).recip()
    }

    fn solve(&mut self, symbolic: &SymbolicFactor, values: &mut [f64]) {
        let arch = pulp::Arch::new();
        self.work.add_substitutions(symbolic.n_factor * D * D, 1);
        if self.is_symmetric() {
            arch.dispatch(Solve::<D, true> { symbolic, values, factor: self })
        } else {
            arch.dispatch(Solve::<D, false> { symbolic, values, factor: self })
        }
    }

    fn take_work(&mut self) -> FactorWork {
        std::mem::take(&mut self.work)
    }
}

impl BlockFactor<1> {
    /// Entry `(row, column)` of the Cholesky factor `L √B` of a definite matrix, counted from the first row and column of
    /// a front.
    pub(crate) fn cholesky_entry(&self, front: &Front, row: usize, column: usize) -> f64 {
        let root = self.pivots[front.first + column].lu[0][0].sqrt().recip();
        if row == column {
            root
        } else {
            self.lower.columns[front.panel + column * front.height() + row] * root
        }
    }
}

impl Triangle {
    fn new(symbolic: &SymbolicFactor, dimension: usize) -> Option<Self> {
        let area = dimension * dimension;
        let columns = zeros(symbolic.n_factor.checked_mul(area)?, 0.0)?;
        Some(Self { columns, updates: zeros(symbolic.n_updates.checked_mul(area)?, 0.0)? })
    }

    fn view(&mut self) -> TriangleView<'_> {
        let Self { columns, updates } = self;
        TriangleView { columns, updates, panel: 0, update: 0 }
    }
}

impl<const D: usize> Workspace<D> {
    /// A workspace for each branch that is not divided, large enough for all fronts that use it.
    fn of_branches(
        symbolic: &SymbolicFactor,
        branches: &[Branch],
        from: usize,
    ) -> Option<Vec<Self>> {
        let mut sizes = Vec::new();
        for branch in branches {
            Self::add_sizes(symbolic, branch, from, &mut sizes);
        }
        let new = |[small, large]: [usize; 2]| {
            Some(Self { unscaled: zeros(small, 0.0)?, large: FrontWorkspace::new(large)? })
        };
        sizes.into_iter().map(new).collect()
    }

    /// Appends the sizes for a branch: for small fronts, and for large ones.
    fn add_sizes(
        symbolic: &SymbolicFactor,
        branch: &Branch,
        from: usize,
        sizes: &mut Vec<[usize; 2]>,
    ) {
        let first = sizes.len();
        for inner in &branch.branches {
            Self::add_sizes(symbolic, inner, from, sizes);
        }
        if sizes.len() == first {
            sizes.push([0; 2]);
        }
        let [small, large] = &mut sizes[first + branch.heaviest];
        for front in &symbolic.fronts[branch.trunk()] {
            // On a processor with short vectors, large fronts are eliminated as small ones are.
            *small = (*small).max(front.height() * D * PANEL * D);
            if front.height() * D >= from {
                *large = (*large).max(FrontWorkspace::<D>::size_for(front));
            }
        }
    }
}

/// Whether several threads factorise.
fn uses_threads(symbolic: &SymbolicFactor) -> bool {
    symbolic.is_divided() && rayon::current_num_threads() > 1
}

/// Factor slices of consecutive fronts.
struct Part<'a, const D: usize> {
    lower: TriangleView<'a>,
    upper: TriangleView<'a>,
    pivots: &'a mut [PivotBlock<D>],
    /// Number of the first pivot.
    first: usize,
}

/// Triangle slices of consecutive fronts.
struct TriangleView<'a> {
    columns: &'a mut [f64],
    updates: &'a mut [f64],
    /// Offsets of the two in the triangle.
    panel: usize,
    update: usize,
}

impl<'a, const D: usize> Part<'a, D> {
    /// The pivots of a front, and its columns and update matrix in the lower and the upper triangle.
    #[inline(always)]
    fn of_front<const SYMMETRIC: bool>(
        &mut self,
        front: &Front,
    ) -> (&mut [PivotBlock<D>], [&mut [f64]; 2], [&mut [f64]; 2]) {
        let pivots = &mut self.pivots[front.first - self.first..][..front.n_pivots];
        let upper = if SYMMETRIC { Default::default() } else { self.upper.front::<D>(front) };
        (pivots, self.lower.front::<D>(front), upper)
    }

    fn reborrow(&mut self) -> Part<'_, D> {
        let Self { lower, upper, pivots, first } = self;
        Part { lower: lower.reborrow(), upper: upper.reborrow(), pivots, first: *first }
    }

    /// The parts before and from the first front of `branch` on.
    fn split(self, symbolic: &SymbolicFactor, branch: &Branch) -> [Self; 2] {
        let front = &symbolic.fronts[branch.fronts.start];
        let at = [front.panel * D * D, branch.update * D * D];
        let [lower, upper] = [self.lower, self.upper].map(|triangle| triangle.split(at));
        let (pivots, rest) = self.pivots.split_at_mut(front.first - self.first);
        let ([lower, lower_rest], [upper, upper_rest]) = (lower, upper);
        [
            Self { lower, upper, pivots, first: self.first },
            Self { lower: lower_rest, upper: upper_rest, pivots: rest, first: front.first },
        ]
    }
}

impl TriangleView<'_> {
    fn reborrow(&mut self) -> TriangleView<'_> {
        let Self { columns, updates, panel, update } = self;
        TriangleView { columns, updates, panel: *panel, update: *update }
    }

    fn split(self, [panel, update]: [usize; 2]) -> [Self; 2] {
        // The upper triangle of a symmetric matrix is empty.
        let at = self.columns.len().min(panel - self.panel);
        let (columns, columns_rest) = self.columns.split_at_mut(at);
        let at = self.updates.len().min(update - self.update);
        let (updates, updates_rest) = self.updates.split_at_mut(at);
        [
            Self { columns, updates, ..self },
            Self { columns: columns_rest, updates: updates_rest, panel, update },
        ]
    }

    /// The columns of a front, and all update matrices.
    fn parts<const D: usize>(&mut self, front: &Front) -> [&mut [f64]; 2] {
        let panel = front.panel * D * D - self.panel;
        [&mut self.columns[panel..][..front.n_pivots * front.height() * D * D], self.updates]
    }

    /// The columns of a front, and its update matrix.
    fn front<const D: usize>(&mut self, front: &Front) -> [&mut [f64]; 2] {
        let update = front.update * D * D - self.update;
        let [columns, updates] = self.parts::<D>(front);
        [columns, &mut updates[update..][..front.n_rows().pow(2) * D * D]]
    }
}

// Code that is compiled for the vectors that the processor has: everything below is inlined into these.
struct Factorise<'a, const D: usize, const SYMMETRIC: bool> {
    symbolic: &'a SymbolicFactor,
    values: &'a [f64],
    factor: &'a mut BlockFactor<D>,
    threads: bool,
}

struct Solve<'a, const D: usize, const SYMMETRIC: bool> {
    symbolic: &'a SymbolicFactor,
    values: &'a mut [f64],
    factor: &'a mut BlockFactor<D>,
}

impl<const D: usize, const SYMMETRIC: bool> pulp::WithSimd for Factorise<'_, D, SYMMETRIC> {
    type Output = Inertia;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Inertia {
        let Self { symbolic, values, factor, threads } = self;
        let BlockFactor { lower, upper, pivots, workspaces, large, .. } = factor;
        let large = *large;
        let elimination =
            Elimination::<'_, D, SYMMETRIC, S> { simd, symbolic, values, large, threads };
        let part = Part { lower: lower.view(), upper: upper.view(), pivots, first: 0 };
        elimination.branches(&symbolic.branches, part, workspaces)
    }
}

/// Data shared by all fronts of a factorisation.
#[derive(Clone, Copy)]
struct Elimination<'a, const D: usize, const SYMMETRIC: bool, S> {
    simd: S,
    symbolic: &'a SymbolicFactor,
    values: &'a [f64],
    /// Rows of a front from which on it is eliminated in chunks.
    large: usize,
    threads: bool,
}

impl<const D: usize, const SYMMETRIC: bool, S: Simd> Elimination<'_, D, SYMMETRIC, S> {
    /// Eliminates the fronts of branches that do not depend on each other.
    fn branches(
        self,
        branches: &[Branch],
        mut part: Part<'_, D>,
        workspaces: &mut [Workspace<D>],
    ) -> Inertia {
        match branches {
            [] => Inertia::Definite,
            [branch] => {
                let inertia = self.branches(&branch.branches, part.reborrow(), workspaces);
                if inertia == Inertia::Singular {
                    return inertia;
                }
                let threads = self.threads && !branch.branches.is_empty();
                let trunk = self.fronts(
                    branch.trunk(),
                    &mut part,
                    &mut workspaces[branch.heaviest],
                    threads,
                );
                inertia.max(trunk)
            }
            _ => {
                let (first, second) = branches.split_at(branches.len() / 2);
                let [before, from] = part.split(self.symbolic, &second[0]);
                let n_leaves = first.iter().map(|branch| branch.n_leaves).sum();
                let (of_first, of_second) = workspaces.split_at_mut(n_leaves);
                let (first, second) = join(
                    self.threads,
                    || self.branches(first, before, of_first),
                    || self.branches(second, from, of_second),
                );
                first.max(second)
            }
        }
    }

    /// Eliminates fronts, children before parents.
    fn fronts(
        self,
        fronts: Range<usize>,
        part: &mut Part<'_, D>,
        workspace: &mut Workspace<D>,
        threads: bool,
    ) -> Inertia {
        self.simd.vectorize(FrontsWork { elimination: self, fronts, part, workspace, threads })
    }

    #[inline(always)]
    fn fronts_in_vectors(
        self,
        fronts: Range<usize>,
        part: &mut Part<'_, D>,
        workspace: &mut Workspace<D>,
        threads: bool,
    ) -> Inertia {
        let Self { simd, symbolic, values, large: large_from, .. } = self;
        let mut inertia = if SYMMETRIC { Inertia::Definite } else { Inertia::Indefinite };
        for front in &symbolic.fronts[fronts] {
            let Workspace { unscaled, large } = &mut *workspace;
            // Scalars and short vectors gain nothing from chunks; left out, they are not compiled.
            let is_large = const { D > 1 && S::F64_LANES >= 4 } && front.height() * D >= large_from;
            // A symmetric matrix has one triangle.
            for above in [false, true].into_iter().take(if SYMMETRIC { 1 } else { 2 }) {
                let transposed = (!SYMMETRIC).then_some(above);
                let triangle = if above { &mut part.upper } else { &mut part.lower };
                let columns = is_large.then(|| large.columns(front));
                assemble::<D>(symbolic, front, values, transposed, columns, triangle);
                if is_large {
                    large.pack(front, SYMMETRIC || above);
                }
            }
            let (pivots, lower, upper) = part.of_front::<SYMMETRIC>(front);
            let found = if is_large {
                large.eliminate::<SYMMETRIC, S>(simd, pivots, lower, upper, threads)
            } else {
                eliminate::<D, SYMMETRIC>(front, lower, upper, pivots, unscaled)
            };
            inertia = inertia.max(found);
            if inertia == Inertia::Singular {
                break;
            }
        }
        inertia
    }
}

// Work of a thread, compiled for its vectors. A closure might not be: a separate function calls it.
struct FrontsWork<'a, 'b, 'c, const D: usize, const SYMMETRIC: bool, S> {
    elimination: Elimination<'a, D, SYMMETRIC, S>,
    fronts: Range<usize>,
    part: &'b mut Part<'c, D>,
    workspace: &'b mut Workspace<D>,
    threads: bool,
}

impl<const D: usize, const SYMMETRIC: bool, S: Simd> pulp::NullaryFnOnce
    for FrontsWork<'_, '_, '_, D, SYMMETRIC, S>
{
    type Output = Inertia;

    #[inline(always)]
    fn call(self) -> Inertia {
        let Self { elimination, fronts, part, workspace, threads } = self;
        elimination.fronts_in_vectors(fronts, part, workspace, threads)
    }
}

/// Does both, at the same time with `threads`.
fn join<A: Send, B: Send>(
    threads: bool,
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    if threads { rayon::join(first, second) } else { (first(), second()) }
}

/// Sets a front of one triangle to the matrix's own blocks and the update matrices of its children. `transposed`: the
/// blocks above the diagonal or those on and below it; `None`: all, for both have one place. `columns`: where the front's
/// columns are put; `None`: where they stay.
#[inline(always)]
fn assemble<const D: usize>(
    symbolic: &SymbolicFactor,
    front: &Front,
    values: &[f64],
    transposed: Option<bool>,
    columns: Option<&mut [f64]>,
    triangle: &mut TriangleView<'_>,
) {
    let (height, rows) = (front.height() * D, front.n_rows() * D);
    let offset = triangle.update;
    let [panel, updates] = triangle.parts::<D>(front);
    let large = columns.is_some();
    let panel = columns.unwrap_or(panel);
    let update = &mut updates[front.update * D * D - offset..][..rows * rows];
    panel.fill(0.0);
    if large {
        // Most of what is above the diagonal is not used.
        for column in 0..rows {
            update[column * rows..][..rows][first_row(column, D)..].fill(0.0);
        }
    } else {
        update.fill(0.0);
    }
    for entry in &symbolic.entries[front.entries[0]..front.entries[1]] {
        if transposed.is_some_and(|transposed| transposed != entry.transposed) {
            continue;
        }
        let block = &values[entry.source as usize * D * D..][..D * D];
        let corner = entry.column as usize * D * height + entry.row as usize * D;
        let target = &mut panel[corner..][..(D - 1) * height + D];
        for j in 0..D {
            for i in 0..D {
                target[j * height + i] =
                    if entry.transposed { block[i * D + j] } else { block[j * D + i] };
            }
        }
    }
    for child in &symbolic.children[front.children[0]..front.children[1]] {
        let child = &symbolic.fronts[*child as usize];
        extend_add::<D>(symbolic, front, child, panel, updates, offset);
    }
}

/// Adds the update matrix of `child` to `front`: to its panel, and to its own update matrix.
#[inline(always)]
fn extend_add<const D: usize>(
    symbolic: &SymbolicFactor,
    front: &Front,
    child: &Front,
    panel: &mut [f64],
    updates: &mut [f64],
    offset: usize,
) {
    let places = &symbolic.rows_in_parent[child.rows[0]..child.rows[1]];
    let (height, child_rows, own_rows) =
        (front.height() * D, child.n_rows() * D, front.n_rows() * D);
    let (from, to) = (child.update * D * D - offset, front.update * D * D - offset);
    // The two update matrices are apart.
    let (source, update) = if from < to {
        let (low, high) = updates.split_at_mut(to);
        (&low[from..], high)
    } else {
        let (low, high) = updates.split_at_mut(from);
        (&*high, &mut low[to..])
    };
    let into_panel = places.partition_point(|place| (*place as usize) < front.n_pivots);
    for (number, &column) in places.iter().enumerate() {
        let column = column as usize;
        // The columns of a block, from the first row that they have in common with the child.
        let (target, stride, above) = if number < into_panel {
            (&mut panel[column * D * height..], height, 0)
        } else {
            let column = (column - front.n_pivots) * D;
            (&mut update[column * own_rows..], own_rows, front.n_pivots)
        };
        let mut targets = target.chunks_exact_mut(stride);
        let targets: [_; D] =
            std::array::from_fn(|_| targets.next().unwrap_or_default().as_chunks_mut::<D>().0);
        let sources: [_; D] = std::array::from_fn(|j| {
            let column = &source[(number * D + j) * child_rows..][..child_rows];
            column[number * D..].as_chunks::<D>().0
        });
        for (number, row) in places[number..].iter().enumerate() {
            let row = *row as usize - above;
            for j in 0..D {
                for i in 0..D {
                    targets[j][row][i] += sources[j][number][i];
                }
            }
        }
    }
}

/// Eliminates the pivots of a front: its columns become columns of `L`, its rows rows of `U`, and its update matrix
/// loses what they contribute.
#[inline(always)]
fn eliminate<const D: usize, const SYMMETRIC: bool>(
    front: &Front,
    [panel, update]: [&mut [f64]; 2],
    [rows, upper_update]: [&mut [f64]; 2],
    pivots: &mut [PivotBlock<D>],
    unscaled: &mut [f64],
) -> Inertia {
    let height = front.height() * D;
    let n_columns = pivots.len() * D;
    let n_rows = height - n_columns;
    let mut inertia = Inertia::Definite;
    let mut start = 0;
    while start < pivots.len() {
        let end = (start + PANEL).min(pivots.len());
        for pivot in start..end {
            let below = (pivot + 1) * D;
            let (left, right) = panel.split_at_mut(below * height);
            let own = &mut left[pivot * D * height..];
            let block =
                std::array::from_fn(|j| std::array::from_fn(|i| own[j * height + pivot * D + i]));
            let (factorised, definite) = PivotBlock::new::<SYMMETRIC>(block);
            let Some(factorised) = factorised else { return Inertia::Singular };
            if !definite {
                inertia = Inertia::Indefinite;
            }
            pivots[pivot] = factorised;
            let kept = &mut unscaled[(pivot - start) * D * height..][..D * height];
            scale(&factorised, own, kept, height, below);
            let inside = (end - pivot - 1) * D;
            if inside == 0 {
                continue;
            }
            let x = Operand { columns: own, offset: below };
            let reach = height - below;
            let target = &mut right[below..];
            if SYMMETRIC {
                let w = Operand { columns: kept, offset: below };
                subtract::<D>(target, height, inside, x, w, height, reach, D);
            } else {
                let (left, right) = rows.split_at_mut(below * height);
                let w = Operand { columns: &left[pivot * D * height..], offset: below };
                for (target, x, w) in [(target, x, w), (&mut right[below..], w, x)] {
                    subtract::<D>(target, height, inside, x, w, height, reach, D);
                }
            }
        }
        let done = end * D;
        let depth = (end - start) * D;
        let (left, right) = panel.split_at_mut(done * height);
        let (rows_left, rows_right) = rows.split_at_mut(if SYMMETRIC { 0 } else { done * height });
        let x = &left[start * D * height..];
        let w = if SYMMETRIC { &*unscaled } else { &rows_left[start * D * height..] };
        let wide = n_columns - done;
        // One loop, so that the tiles are compiled once. There are no later columns after the last panel.
        let targets = [
            (right.get_mut(done..).unwrap_or_default(), height, wide, done, x, w),
            (&mut *update, n_rows, n_rows, n_columns, x, w),
            (rows_right.get_mut(done..).unwrap_or_default(), height, wide, done, w, x),
            (&mut *upper_update, n_rows, n_rows, n_columns, w, x),
        ];
        let n_targets = if SYMMETRIC { 2 } else { 4 };
        for (target, stride, width, offset, x, w) in targets.into_iter().take(n_targets) {
            let (x, w) = (Operand { columns: x, offset }, Operand { columns: w, offset });
            subtract::<D>(target, stride, width, x, w, height, height - offset, depth);
        }
        start = end;
    }
    inertia
}

/// Keeps the rows of `columns` from `first` on as `V`, and overwrites them by `X = V B⁻¹`.
#[inline(always)]
fn scale<const D: usize>(
    pivot: &PivotBlock<D>,
    columns: &mut [f64],
    kept: &mut [f64],
    height: usize,
    first: usize,
) {
    // Bᵀ Xᵀ = Vᵀ is solved row by row of X; written column by column, it fits vectors.
    let mut row = first;
    while row + TILE_ROWS <= height {
        scale_rows::<D, TILE_ROWS>(pivot, columns, kept, height, row);
        row += TILE_ROWS;
    }
    while row + 2 <= height {
        scale_rows::<D, 2>(pivot, columns, kept, height, row);
        row += 2;
    }
    if row < height {
        scale_rows::<D, 1>(pivot, columns, kept, height, row);
    }
}

#[inline(always)]
fn scale_rows<const D: usize, const R: usize>(
    pivot: &PivotBlock<D>,
    columns: &mut [f64],
    kept: &mut [f64],
    height: usize,
    row: usize,
) {
    for j in 0..D {
        kept[j * height + row..][..R].copy_from_slice(&columns[j * height + row..][..R]);
    }
    let mut x = [[0.0; R]; D];
    for i in 0..D {
        x[i].copy_from_slice(&kept[pivot.rows[i] * height + row..][..R]);
        for k in 0..i {
            for r in 0..R {
                x[i][r] -= pivot.lu[i][k] * x[k][r];
            }
        }
    }
    for i in (0..D).rev() {
        for k in i + 1..D {
            for r in 0..R {
                x[i][r] -= pivot.lu[i][k] * x[k][r];
            }
        }
        for r in 0..R {
            x[i][r] *= pivot.lu[i][i];
        }
        columns[pivot.columns[i] * height + row..][..R].copy_from_slice(&x[i]);
    }
}

/// Columns, and the row of them that belongs to the first row of a target.
#[derive(Clone, Copy)]
struct Operand<'a> {
    columns: &'a [f64],
    offset: usize,
}

/// Subtracts `X Wᵀ` from the first `width` columns of a target of `rows` rows, on and below its diagonal
/// blocks; what is above them is left undefined. `stride` and `height` are what the columns are apart.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "sizes of three matrices")]
fn subtract<const D: usize>(
    target: &mut [f64],
    stride: usize,
    width: usize,
    x: Operand<'_>,
    w: Operand<'_>,
    height: usize,
    rows: usize,
    depth: usize,
) {
    let mut column = 0;
    macro_rules! groups {
        ($wide:literal) => {
            while width - column >= $wide {
                let mut row = column;
                while row + TILE_ROWS <= rows {
                    tile::<$wide, TILE_ROWS>(target, stride, x, w, height, [row, column], depth);
                    row += TILE_ROWS;
                }
                if row + 4 <= rows {
                    tile::<$wide, 4>(target, stride, x, w, height, [row, column], depth);
                    row += 4;
                }
                if row + 2 <= rows {
                    tile::<$wide, 2>(target, stride, x, w, height, [row, column], depth);
                    row += 2;
                }
                if row < rows {
                    tile::<$wide, 1>(target, stride, x, w, height, [row, column], depth);
                }
                column += $wide;
            }
        };
    }
    match D {
        1 => {
            groups!(4);
            groups!(1);
        }
        2 => {
            groups!(4);
            groups!(2);
        }
        _ => {
            groups!(6);
            groups!(3);
        }
    }
}

/// Subtracts a tile of `X Wᵀ` of `R` rows and `G` columns.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "sizes of three matrices")]
fn tile<const G: usize, const R: usize>(
    target: &mut [f64],
    stride: usize,
    x: Operand<'_>,
    w: Operand<'_>,
    height: usize,
    [row, column]: [usize; 2],
    depth: usize,
) {
    let mut sums = [[0.0; R]; G];
    let (mut of_x, mut of_w) = (x.offset + row, w.offset + column);
    for _ in 0..depth {
        let left = &x.columns[of_x..][..R];
        let right = &w.columns[of_w..][..G];
        for g in 0..G {
            for r in 0..R {
                sums[g][r] += left[r] * right[g];
            }
        }
        of_x += height;
        of_w += height;
    }
    for (g, sums) in sums.iter().enumerate() {
        let target = &mut target[(column + g) * stride + row..][..R];
        for r in 0..R {
            target[r] -= sums[r];
        }
    }
}

impl<const D: usize, const SYMMETRIC: bool> pulp::WithSimd for Solve<'_, D, SYMMETRIC> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { symbolic, values, factor } = self;
        let BlockFactor { lower, upper, pivots, permuted, gathered, .. } = factor;
        for (target, block) in permuted.chunks_exact_mut(D).zip(&symbolic.order) {
            target.copy_from_slice(&values[*block as usize * D..][..D]);
        }
        for front in &symbolic.fronts {
            forward::<D>(symbolic, front, &lower.columns, permuted, gathered);
        }
        if SYMMETRIC {
            for (values, pivot) in permuted.chunks_exact_mut(D).zip(&*pivots) {
                let mut block = [0.0; D];
                block.copy_from_slice(values);
                pivot.solve(&mut block);
                values.copy_from_slice(&block);
            }
        }
        for front in symbolic.fronts.iter().rev() {
            let (columns, pivots) = if SYMMETRIC {
                (&lower.columns, None)
            } else {
                (&upper.columns, Some(&pivots[front.first..]))
            };
            backward::<D>(symbolic, front, columns, pivots, [permuted, gathered]);
        }
        for (source, block) in permuted.chunks_exact(D).zip(&symbolic.order) {
            values[*block as usize * D..][..D].copy_from_slice(source);
        }
    }
}

/// Solves with the columns of `L` of one front.
#[inline(always)]
fn forward<const D: usize>(
    symbolic: &SymbolicFactor,
    front: &Front,
    columns: &[f64],
    permuted: &mut [f64],
    gathered: &mut [f64],
) {
    let height = front.height() * D;
    let n_columns = front.n_pivots * D;
    let panel = &columns[front.panel * D * D..][..n_columns * height];
    let gathered = &mut gathered[..height];
    let own = front.first * D;
    gathered[..n_columns].copy_from_slice(&permuted[own..][..n_columns]);
    gathered[n_columns..].fill(0.0);
    for (pivot, columns) in panel.chunks_exact(D * height).enumerate() {
        let (done, below) = gathered.split_at_mut((pivot + 1) * D);
        let mut x = [0.0; D];
        x.copy_from_slice(&done[pivot * D..]);
        let rows = below.len();
        let columns: [&[f64]; D] =
            std::array::from_fn(|j| &columns[j * height + (pivot + 1) * D..][..rows]);
        for i in 0..rows {
            let mut sum = 0.0;
            for j in 0..D {
                sum += columns[j][i] * x[j];
            }
            below[i] -= sum;
        }
    }
    permuted[own..][..n_columns].copy_from_slice(&gathered[..n_columns]);
    let rows = &symbolic.rows[front.rows[0]..front.rows[1]];
    for (change, row) in gathered[n_columns..].chunks_exact(D).zip(rows) {
        let target = &mut permuted[*row as usize * D..][..D];
        for i in 0..D {
            target[i] += change[i];
        }
    }
}

/// Solves with the transposed columns of one front: with those of `L`, or, with `pivots`, with those of `B U`.
#[inline(always)]
fn backward<const D: usize>(
    symbolic: &SymbolicFactor,
    front: &Front,
    columns: &[f64],
    pivots: Option<&[PivotBlock<D>]>,
    [permuted, gathered]: [&mut Vec<f64>; 2],
) {
    let height = front.height() * D;
    let n_columns = front.n_pivots * D;
    let panel = &columns[front.panel * D * D..][..n_columns * height];
    let gathered = &mut gathered[..height];
    let own = front.first * D;
    gathered[..n_columns].copy_from_slice(&permuted[own..][..n_columns]);
    let rows = &symbolic.rows[front.rows[0]..front.rows[1]];
    for (target, row) in gathered[n_columns..].chunks_exact_mut(D).zip(rows) {
        target.copy_from_slice(&permuted[*row as usize * D..][..D]);
    }
    for (pivot, columns) in panel.chunks_exact(D * height).enumerate().rev() {
        let (done, below) = gathered.split_at_mut((pivot + 1) * D);
        for (j, x) in done[pivot * D..].iter_mut().enumerate() {
            *x -= dot(&columns[j * height + (pivot + 1) * D..][..below.len()], below);
        }
        if let Some(pivots) = pivots {
            let mut block = [0.0; D];
            block.copy_from_slice(&done[pivot * D..]);
            pivots[pivot].solve_transposed(&mut block);
            done[pivot * D..].copy_from_slice(&block);
        }
    }
    permuted[own..][..n_columns].copy_from_slice(&gathered[..n_columns]);
}

/// A scalar product in eight sums, so that it fits vectors and is the same bits without them.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_whole, b_whole) = (a.chunks_exact(8), b.chunks_exact(8));
    let (a_rest, b_rest) = (a_whole.remainder(), b_whole.remainder());
    for (a, b) in a_whole.zip(b_whole) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let mut sum =
        ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += a * b;
    }
    sum
}
