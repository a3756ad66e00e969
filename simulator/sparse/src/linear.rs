//! Block linear systems, split into connected components with a solver each.
//!
//! The blocks are first split into the connected components of the coupling graph. An uncoupled block
//! needs a division; a component of several blocks is a separate system, dense
//! ([`DenseSystem`]) or sparse ([`SparseSystem`]) by its size. Fourteen separate springs are thus
//! fourteen 4 × 4 systems, and never one of 56 rows. The split is made once; its cost is in proportion
//! to the couplings.

use nalgebra::{DMatrix, SMatrix};

use crate::LinearError;
use crate::dense::{DenseMethod, DenseSystem};
use crate::sizes::{MAX_DENSE_BLOCKS, MAX_SMALL_BLOCKS};
use crate::statistics::LinearStatistics;
use crate::system::SparseSystem;

/// Two blocks that the matrix couples; a block with itself if its own `D × D` entries are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Link {
    /// The two.
    pub blocks: [usize; 2],
    /// Whether the contribution of this link to the matrix is symmetric.
    pub symmetric: bool,
}

/// The solver for the components of a matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum LinearSolver {
    /// Chosen for each component by size and symmetry.
    #[default]
    Auto,
    /// Dense for every component.
    Dense,
    /// Sparse for every component.
    Sparse,
}

/// A square matrix of `D × D` blocks, with a solver.
pub struct BlockMatrix<const D: usize> {
    locations: Vec<BlockLocation>,
    /// Diagonals of the uncoupled blocks, `D` entries each.
    diagonal: Vec<f64>,
    parts: Vec<Component<D>>,
    /// Offsets of the blocks of elements, one element after another; [`NOT_KEPT`] where there is none.
    offsets: Vec<u32>,
}

/// In the place of the offset of a block that a matrix does not keep.
const NOT_KEPT: u32 = u32::MAX;

/// Where the entries of a block are.
#[derive(Clone, Copy)]
enum BlockLocation {
    /// On the diagonal, as the block of this number.
    Diagonal(usize),
    /// In a component, as its block of this number.
    Component { part: usize, local: usize },
}

/// Where the four blocks of a pair are, found once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairSlot {
    part: u32,
    /// Offsets of the blocks `(i, i)`, `(j, j)`, `(i, j)` and `(j, i)`; the last two are one where the
    /// system keeps but one of them.
    offsets: [u32; 4],
}

/// Where the blocks between the members of an element are, found once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElementSlot {
    part: u32,
    /// Place of the first of their offsets.
    first: usize,
}

struct Component<const D: usize> {
    blocks: Vec<usize>,
    system: ComponentSystem<D>,
}

enum ComponentSystem<const D: usize> {
    Dense(Box<DenseSystem>),
    Sparse(Box<SparseSystem<D>>),
}

impl<const D: usize> BlockMatrix<D> {
    /// A zero matrix of `n_blocks` blocks a side, coupled by `links`.
    pub fn new(n_blocks: usize, links: &[Link], choice: LinearSolver) -> Self {
        let mut sets = DisjointSets::new(n_blocks);
        let mut coupled = vec![false; n_blocks];
        for &Link { blocks: [a, b], .. } in links {
            sets.join(a, b);
            coupled[a] = true;
            coupled[b] = true;
        }
        let mut symmetric = vec![true; n_blocks];
        for link in links.iter().filter(|link| !link.symmetric) {
            symmetric[sets.root(link.blocks[0])] = false;
        }

        let mut locations = Vec::with_capacity(n_blocks);
        let mut n_diagonal = 0;
        let mut members: Vec<Vec<usize>> = Vec::new();
        let mut part_of_root = vec![None; n_blocks];
        for block in 0..n_blocks {
            if !coupled[block] {
                locations.push(BlockLocation::Diagonal(n_diagonal));
                n_diagonal += 1;
                continue;
            }
            let part = *part_of_root[sets.root(block)].get_or_insert_with(|| {
                members.push(Vec::new());
                members.len() - 1
            });
            locations.push(BlockLocation::Component { part, local: members[part].len() });
            members[part].push(block);
        }
        let mut couplings: Vec<Vec<[usize; 2]>> = vec![Vec::new(); members.len()];
        for &Link { blocks: [a, b], .. } in links {
            if let (
                BlockLocation::Component { part, local: a },
                BlockLocation::Component { local: b, .. },
            ) = (locations[a], locations[b])
            {
                couplings[part].push([a, b]);
            }
        }
        let part_of = |(blocks, couplings): (Vec<usize>, Vec<[usize; 2]>)| {
            let symmetric = symmetric[sets.root(blocks[0])];
            Component {
                system: ComponentSystem::new(blocks.len(), &couplings, symmetric, choice),
                blocks,
            }
        };
        let parts = members.into_iter().zip(couplings).map(part_of).collect();
        Self { locations, diagonal: vec![0.0; n_diagonal * D], parts, offsets: Vec::new() }
    }

    /// Sets the matrix to zero.
    pub fn clear(&mut self) {
        self.diagonal.fill(0.0);
        self.parts.iter_mut().for_each(|part| part.system.clear());
    }

    /// Adds `value` to the diagonal of block `(block, block)`.
    pub fn add_diagonal(&mut self, block: usize, value: f64) {
        match self.locations[block] {
            BlockLocation::Diagonal(number) => {
                self.diagonal[number * D..][..D].iter_mut().for_each(|entry| *entry += value);
            }
            BlockLocation::Component { part, local } => {
                self.parts[part].system.add_diagonal(local, value);
            }
        }
    }

    /// Adds `block` to block `(row, column)`, which the links must couple. Of an uncoupled block, only
    /// the diagonal is kept.
    pub fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        match (self.locations[row], self.locations[column]) {
            (BlockLocation::Diagonal(number), _) => {
                for (entry, value) in
                    self.diagonal[number * D..][..D].iter_mut().zip(block.diagonal().iter())
                {
                    *entry += value;
                }
            }
            (
                BlockLocation::Component { part, local },
                BlockLocation::Component { local: local_column, .. },
            ) => {
                self.parts[part].system.add(local, local_column, block);
            }
            (BlockLocation::Component { .. }, BlockLocation::Diagonal(_)) => {
                debug_assert!(false, "block ({row}, {column}) is not coupled");
            }
        }
    }

    /// Where the blocks of the pair `i ≠ j` are, for [`add_pair`](Self::add_pair); `None` if the links
    /// do not couple the two, or where an offset is beyond 32 bits.
    pub fn pair_slot(&self, [i, j]: [usize; 2]) -> Option<PairSlot> {
        let (
            BlockLocation::Component { part, local: i },
            BlockLocation::Component { part: other, local: j },
        ) = (self.locations[i], self.locations[j])
        else {
            return None;
        };
        if part != other || i == j {
            return None;
        }
        let system = &self.parts[part].system;
        let (ij, ji) = (system.offset(i, j), system.offset(j, i));
        let mut narrow = [0; 4];
        let offsets = [system.offset(i, i), system.offset(j, j), ij.or(ji), ji.or(ij)];
        for (narrow, offset) in narrow.iter_mut().zip(offsets) {
            *narrow = u32::try_from(offset?).ok()?;
        }
        Some(PairSlot { part: u32::try_from(part).ok()?, offsets: narrow })
    }

    /// Adds `block`, which must be symmetric if the component is, to the diagonal blocks of the pair that
    /// `slot` is of, and its negative to the other two.
    #[inline]
    pub fn add_pair(&mut self, slot: PairSlot, block: &SMatrix<f64, D, D>) {
        self.parts[slot.part as usize].system.add_pair(slot.offsets, block);
    }

    /// Where the blocks between these members are, for [`add_at`](Self::add_at), in which each member is named by its place
    /// here; `None` as a member is no block of the matrix. `None` if the links do not couple them all, or where an offset is
    /// beyond 32 bits.
    pub fn element_slot(&mut self, members: &[Option<usize>]) -> Option<ElementSlot> {
        let location = |member: &usize| match self.locations[*member] {
            BlockLocation::Component { part, local } => Some((part, local)),
            BlockLocation::Diagonal(_) => None,
        };
        let part = members.iter().flatten().next().and_then(location)?.0;
        let mut offsets = Vec::with_capacity(members.len().pow(2));
        for row in members {
            for column in members {
                let (Some(row), Some(column)) = (row, column) else {
                    offsets.push(NOT_KEPT);
                    continue;
                };
                let (of_row, of_column) = (location(row)?, location(column)?);
                if of_row.0 != part || of_column.0 != part {
                    return None;
                }
                let offset = self.parts[part].system.offset(of_row.1, of_column.1);
                offsets.push(match offset {
                    Some(offset) => u32::try_from(offset).ok().filter(|kept| *kept != NOT_KEPT)?,
                    None => NOT_KEPT,
                });
            }
        }
        let slot = ElementSlot { part: u32::try_from(part).ok()?, first: self.offsets.len() };
        self.offsets.extend(offsets);
        Some(slot)
    }

    /// Adds to the block at this place of those of an element, row by row. As in [`add`](Self::add), what is added above the
    /// diagonal of a symmetric matrix is ignored, and so are rows and columns of what is no block.
    #[inline]
    pub fn add_at(&mut self, slot: ElementSlot, place: usize, block: &SMatrix<f64, D, D>) {
        let offset = self.offsets[slot.first + place];
        if offset != NOT_KEPT {
            self.parts[slot.part as usize].system.add_at(offset as usize, block);
        }
    }

    /// Factorises the matrix, solves for the right-hand side in `values` and puts the solution there.
    ///
    /// # Errors
    /// If a component is singular to working precision, or contains an infinity or a NaN.
    pub fn solve(
        &mut self,
        values: &mut [f64],
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError> {
        self.solve_components(values, statistics, ComponentSystem::solve)
    }

    /// Solves for another right-hand side with the matrix that was solved last, which must not have been
    /// changed since; components of more than [`MAX_SMALL_BLOCKS`] blocks are not factorised again.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_again(
        &mut self,
        values: &mut [f64],
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError> {
        self.solve_components(values, statistics, ComponentSystem::solve_again)
    }

    /// Makes the next solve factorise the matrix, for one that will be solved again many times.
    pub fn forget_factors(&mut self) {
        for Component { system, .. } in &mut self.parts {
            if let ComponentSystem::Sparse(system) = system {
                system.forget_factor();
            }
        }
    }

    fn solve_components(
        &mut self,
        values: &mut [f64],
        statistics: &mut LinearStatistics,
        solve: fn(&mut ComponentSystem<D>, &mut LinearStatistics) -> Result<(), LinearError>,
    ) -> Result<(), LinearError> {
        statistics.solves += 1;
        for (block, place) in self.locations.iter().enumerate() {
            if let BlockLocation::Diagonal(number) = *place {
                let entries = &self.diagonal[number * D..][..D];
                for (value, entry) in values[block * D..][..D].iter_mut().zip(entries) {
                    if *entry == 0.0 {
                        return Err(LinearError::Singular { pivot: 0, size: 1 });
                    }
                    if !entry.is_finite() {
                        return Err(LinearError::NotFinite { size: 1 });
                    }
                    *value /= entry;
                }
            }
        }
        for Component { blocks, system } in &mut self.parts {
            for (local, block) in blocks.iter().enumerate() {
                system.right_mut()[local * D..][..D].copy_from_slice(&values[block * D..][..D]);
            }
            solve(system, statistics)?;
            for (local, block) in blocks.iter().enumerate() {
                values[block * D..][..D].copy_from_slice(&system.solution()[local * D..][..D]);
            }
        }
        Ok(())
    }

    /// Magnitude of the smallest pivot of the matrix that was solved last; infinite if no part of it was factorised. It is
    /// small if the matrix is nearly singular. If the matrix is not definite, it may be small without.
    pub fn smallest_pivot(&self) -> f64 {
        let of_part = |Component { system, .. }: &Component<D>| match system {
            ComponentSystem::Dense(system) => system.smallest_pivot(),
            ComponentSystem::Sparse(system) => system.smallest_pivot(),
        };
        let diagonal = self.diagonal.iter().map(|entry| entry.abs());
        diagonal.chain(self.parts.iter().map(of_part)).fold(f64::INFINITY, f64::min)
    }

    /// The matrix in dense form, for inspection; cost: the square of the size.
    pub fn to_dense(&self) -> DMatrix<f64> {
        let size = self.locations.len() * D;
        let mut dense = DMatrix::zeros(size, size);
        for (block, place) in self.locations.iter().enumerate() {
            if let BlockLocation::Diagonal(number) = *place {
                for axis in 0..D {
                    let row = block * D + axis;
                    dense[(row, row)] = self.diagonal[number * D + axis];
                }
            }
        }
        for Component { blocks, system } in &self.parts {
            let global = |local: usize| blocks[local / D] * D + local % D;
            system.read(&mut |row, column, entry| dense[(global(row), global(column))] = entry);
        }
        dense
    }

    /// The solvers chosen, in words.
    pub fn describe(&self) -> String {
        let mut kinds: Vec<(String, usize)> = Vec::new();
        if !self.diagonal.is_empty() {
            kinds.push((format!("diagonal of {}", self.diagonal.len()), 1));
        }
        for Component { system, .. } in &self.parts {
            let kind = system.describe();
            match kinds.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, count)) => *count += 1,
                None => kinds.push((kind, 1)),
            }
        }
        let words = kinds.into_iter().map(|(kind, count)| match count {
            1 => kind,
            _ => format!("{count} of {kind}"),
        });
        let words: Vec<String> = words.collect();
        if words.is_empty() { "nothing to solve".to_owned() } else { words.join(", ") }
    }
}

impl<const D: usize> ComponentSystem<D> {
    /// The system for a component of `n_blocks` blocks.
    fn new(
        n_blocks: usize,
        couplings: &[[usize; 2]],
        symmetric: bool,
        choice: LinearSolver,
    ) -> Self {
        let method = match (n_blocks, symmetric) {
            (..=MAX_SMALL_BLOCKS, _) => DenseMethod::CompletePivoting,
            (_, true) => DenseMethod::Cholesky,
            (_, false) => DenseMethod::Lu,
        };
        let dense = match choice {
            LinearSolver::Auto => {
                n_blocks <= MAX_SMALL_BLOCKS || (n_blocks <= MAX_DENSE_BLOCKS && !symmetric)
            }
            LinearSolver::Dense => true,
            LinearSolver::Sparse => false,
        };
        if dense {
            Self::Dense(Box::new(DenseSystem::new(n_blocks * D, method)))
        } else {
            Self::Sparse(Box::new(SparseSystem::new(n_blocks, couplings, symmetric)))
        }
    }

    fn clear(&mut self) {
        match self {
            Self::Dense(system) => system.matrix.fill(0.0),
            Self::Sparse(system) => system.clear(),
        }
    }

    fn add_diagonal(&mut self, block: usize, value: f64) {
        match self {
            Self::Dense(system) => {
                let rows = block * D..block * D + D;
                rows.for_each(|row| system.matrix[(row, row)] += value);
            }
            Self::Sparse(system) => system.add_diagonal(block, value),
        }
    }

    fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        match self {
            Self::Dense(system) => {
                let mut view = system.matrix.fixed_view_mut::<D, D>(row * D, column * D);
                view += block;
            }
            Self::Sparse(system) => system.add(row, column, block),
        }
    }

    /// Where block `(row, column)` is; `None` if it is not kept.
    fn offset(&self, row: usize, column: usize) -> Option<usize> {
        match self {
            Self::Dense(system) => Some((column * system.size() + row) * D),
            Self::Sparse(system) => system.offset(row, column),
        }
    }

    #[inline]
    fn add_at(&mut self, offset: usize, block: &SMatrix<f64, D, D>) {
        match self {
            Self::Dense(system) => {
                let size = system.size();
                let entries = &mut system.matrix.as_mut_slice()[offset..];
                for (entries, column) in entries.chunks_mut(size).zip(block.column_iter()) {
                    entries
                        .iter_mut()
                        .zip(column.iter())
                        .for_each(|(entry, value)| *entry += value);
                }
            }
            Self::Sparse(system) => system.add_at(offset, block),
        }
    }

    #[inline]
    fn add_pair(&mut self, [ii, jj, ij, ji]: [u32; 4], block: &SMatrix<f64, D, D>) {
        let negative = -block;
        self.add_at(ii as usize, block);
        self.add_at(jj as usize, block);
        self.add_at(ij as usize, &negative);
        // The last two are one where the system keeps but one of them.
        if ij != ji {
            self.add_at(ji as usize, &negative);
        }
    }

    fn read(&self, to: &mut dyn FnMut(usize, usize, f64)) {
        match self {
            Self::Dense(system) => {
                let size = system.size();
                for (row, column) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
                    to(row, column, system.matrix[(row, column)]);
                }
            }
            Self::Sparse(system) => system.read(to),
        }
    }

    fn right_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Dense(system) => system.right_mut(),
            Self::Sparse(system) => system.right_mut(),
        }
    }

    fn solution(&self) -> &[f64] {
        match self {
            Self::Dense(system) => system.solution(),
            Self::Sparse(system) => system.solution(),
        }
    }

    fn solve(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        match self {
            Self::Dense(system) => system.solve(statistics),
            Self::Sparse(system) => system.solve(statistics),
        }
    }

    fn solve_again(&mut self, statistics: &mut LinearStatistics) -> Result<(), LinearError> {
        match self {
            Self::Dense(system) => system.solve_again(statistics),
            Self::Sparse(system) => system.solve_again(statistics),
        }
    }

    fn describe(&self) -> String {
        let (kind, size) = match self {
            Self::Dense(system) => {
                let kind = match system.method() {
                    DenseMethod::CompletePivoting => "dense complete-pivoting LU",
                    DenseMethod::Cholesky => "dense Cholesky",
                    DenseMethod::Lu => "dense LU",
                };
                (kind, system.size())
            }
            Self::Sparse(system) if system.is_symmetric() => ("sparse LDLᵀ", system.size()),
            Self::Sparse(system) => ("sparse LU", system.size()),
        };
        format!("{kind} {size} × {size}")
    }
}

/// Sets of blocks that are joined pair by pair: nearly linear, by size and path halving.
struct DisjointSets {
    parent: Vec<usize>,
    size: Vec<usize>,
}

impl DisjointSets {
    fn new(n: usize) -> Self {
        Self { parent: (0..n).collect(), size: vec![1; n] }
    }

    fn root(&mut self, mut block: usize) -> usize {
        while self.parent[block] != block {
            self.parent[block] = self.parent[self.parent[block]];
            block = self.parent[block];
        }
        block
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return;
        }
        let (small, large) = if self.size[a] < self.size[b] { (a, b) } else { (b, a) };
        self.parent[small] = large;
        self.size[large] += self.size[small];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(a: usize, b: usize) -> Link {
        Link { blocks: [a, b], symmetric: true }
    }

    #[test]
    fn each_component_gets_the_cheapest_solver() {
        let one_sided = Link { blocks: [5, 6], symmetric: false };
        let mut links = vec![link(1, 2), link(3, 3), one_sided, link(6, 7), link(7, 4)];
        links.extend((8..11).map(|block| link(block, block + 1)));
        let matrix = BlockMatrix::<2>::new(12, &links, LinearSolver::Auto);
        let expected = "diagonal of 2, dense complete-pivoting LU 4 × 4, \
                        dense complete-pivoting LU 2 × 2, dense LU 8 × 8, sparse LDLᵀ 8 × 8";
        assert_eq!(matrix.describe(), expected);
    }

    #[test]
    fn separate_springs_stay_separate() {
        let links: Vec<Link> = (0..14).map(|pair| link(2 * pair, 2 * pair + 1)).collect();
        assert_eq!(
            BlockMatrix::<2>::new(28, &links, LinearSolver::Auto).describe(),
            "14 of dense complete-pivoting LU 4 × 4"
        );
    }

    #[test]
    fn solution_is_scattered_to_its_blocks() {
        // Blocks 0 and 2 coupled, block 1 alone.
        let mut matrix = BlockMatrix::<2>::new(3, &[link(0, 2)], LinearSolver::Auto);
        for block in 0..3 {
            matrix.add_diagonal(block, 2.0);
        }
        let turn = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 1.0, 0.0);
        matrix.add(0, 2, &turn);
        matrix.add(2, 0, &turn);
        // x = (1, 2 | 3, 4 | 5, 6)
        let mut values = [2.0 + 6.0, 4.0 + 5.0, 6.0, 8.0, 10.0 + 2.0, 12.0 + 1.0];
        matrix.solve(&mut values, &mut LinearStatistics::default()).unwrap();
        for (value, expected) in values.iter().zip([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) {
            assert!((value - expected).abs() < 1e-14, "{values:?}");
        }
    }

    #[test]
    fn pair_slots_equal_block_lookup() {
        let mut links: Vec<Link> = (0..9).map(|block| link(block, block + 1)).collect();
        links.extend([link(0, 5), link(2, 9), link(10, 11)]);
        for (symmetric, choice) in [true, false].into_iter().flat_map(|symmetric| {
            [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse]
                .map(|choice| (symmetric, choice))
        }) {
            links.iter_mut().for_each(|link| link.symmetric = symmetric);
            let mut by_slot = BlockMatrix::<3>::new(13, &links, choice);
            let mut by_block = BlockMatrix::<3>::new(13, &links, choice);
            assert_eq!(by_slot.pair_slot([0, 12]), None);
            assert_eq!(by_slot.pair_slot([0, 11]), None);
            let mut random = fastrand::Rng::with_seed(2);
            for Link { blocks: [a, b], .. } in &links {
                // Each way round.
                for [i, j] in [[*a, *b], [*b, *a]] {
                    let mut block = SMatrix::<f64, 3, 3>::from_fn(|_, _| random.f64() - 0.5);
                    if symmetric {
                        block += block.transpose();
                    }
                    let slot = by_slot.pair_slot([i, j]).unwrap();
                    by_slot.add_pair(slot, &block);
                    for (row, column, block) in
                        [(i, i, block), (j, j, block), (i, j, -block), (j, i, -block)]
                    {
                        by_block.add(row, column, &block);
                    }
                }
            }
            let mut solutions = [(); 2].map(|()| -> Vec<f64> { (0..39).map(f64::from).collect() });
            for (matrix, solution) in [by_slot, by_block].iter_mut().zip(&mut solutions) {
                (0..13).for_each(|block| matrix.add_diagonal(block, 4.0));
                matrix.solve(solution, &mut LinearStatistics::default()).unwrap();
            }
            assert_eq!(solutions[0], solutions[1], "{choice:?}");
        }
    }

    #[test]
    fn element_slots_equal_block_lookup() {
        let mut links: Vec<Link> = (0..9).map(|block| link(block, block + 1)).collect();
        links.extend([link(1, 4), link(4, 6), link(1, 6), link(10, 11)]);
        // The third member is fixed.
        let members = [Some(6), Some(1), None, Some(4)];
        for (symmetric, choice) in [true, false].into_iter().flat_map(|symmetric| {
            [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse]
                .map(|choice| (symmetric, choice))
        }) {
            links.iter_mut().for_each(|link| link.symmetric = symmetric);
            let mut by_slot = BlockMatrix::<2>::new(13, &links, choice);
            let mut by_block = BlockMatrix::<2>::new(13, &links, choice);
            assert_eq!(by_slot.element_slot(&[Some(1), Some(11)]), None);
            assert_eq!(by_slot.element_slot(&[Some(12)]), None);
            let [slot, first] = [(); 2].map(|()| by_slot.element_slot(&members).unwrap());
            assert_ne!(slot, first);
            let mut random = fastrand::Rng::with_seed(2);
            for (place, (row, column)) in
                members.iter().flat_map(|row| members.map(|column| (*row, column))).enumerate()
            {
                let block = SMatrix::from_fn(|_, _| random.f64() - 0.5);
                by_slot.add_at(slot, place, &block);
                if let (Some(row), Some(column)) = (row, column) {
                    by_block.add(row, column, &block);
                }
            }
            assert!(by_block.to_dense().norm() > 0.0);
            assert_eq!(by_slot.to_dense(), by_block.to_dense(), "{symmetric} {choice:?}");
        }
    }

    #[test]
    fn the_smallest_pivot_is_about_the_smallest_eigenvalue_of_a_definite_matrix() {
        for (n_blocks, symmetric) in [(2, true), (2, false), (9, true), (9, false), (40, true)] {
            for choice in [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse] {
                let mut links: Vec<Link> =
                    (1..n_blocks).map(|block| link(block - 1, block)).collect();
                links.iter_mut().for_each(|link| link.symmetric = symmetric);
                let mut matrix = BlockMatrix::<2>::new(n_blocks, &links, choice);
                assert_eq!(matrix.smallest_pivot(), f64::INFINITY);
                for smallest in [1.0, 1e-9] {
                    // Nothing but this holds a motion of all blocks together.
                    matrix.clear();
                    (0..n_blocks).for_each(|block| matrix.add_diagonal(block, smallest));
                    for Link { blocks: [i, j], .. } in &links {
                        let slot = matrix.pair_slot([*i, *j]).unwrap();
                        matrix.add_pair(slot, &SMatrix::identity());
                    }
                    let mut values = vec![1.0; 2 * n_blocks];
                    matrix.solve(&mut values, &mut LinearStatistics::default()).unwrap();
                    let pivot = matrix.smallest_pivot();
                    let bounds = 0.9 * smallest..2.0 * n_blocks as f64 * smallest;
                    assert!(
                        bounds.contains(&pivot),
                        "{n_blocks} {symmetric} {choice:?}: {pivot:e}"
                    );
                }
            }
        }
        let mut alone = BlockMatrix::<2>::new(2, &[], LinearSolver::Auto);
        alone.add_diagonal(0, 3.0);
        alone.add_diagonal(1, -2.0);
        assert_eq!(alone.smallest_pivot(), 2.0);
    }

    #[test]
    fn every_storage_holds_the_same_matrix() {
        for symmetric in [true, false] {
            let mut links: Vec<Link> = (0..5).map(|block| link(block, block + 1)).collect();
            links.iter_mut().for_each(|link| link.symmetric = symmetric);
            let choices = [LinearSolver::Dense, LinearSolver::Sparse];
            let shown = choices.map(|choice| {
                // Block 6 is coupled to no other.
                let mut matrix = BlockMatrix::<2>::new(7, &links, choice);
                let mut random = fastrand::Rng::with_seed(3);
                for Link { blocks: [i, j], .. } in &links {
                    let mut block = SMatrix::<f64, 2, 2>::from_fn(|_, _| random.f64());
                    if symmetric {
                        block += block.transpose();
                    }
                    matrix.add_pair(matrix.pair_slot([*i, *j]).unwrap(), &block);
                }
                (0..7).for_each(|block| matrix.add_diagonal(block, 4.0));
                matrix.to_dense()
            });
            assert_eq!(shown[0], shown[1]);
            assert_eq!(shown[0] == shown[0].transpose(), symmetric);
            assert_eq!((shown[0][(12, 12)], shown[0][(12, 0)], shown[0][(0, 4)]), (4.0, 0.0, 0.0));
            // The blocks of a pair cancel: every row of a column of blocks sums to the diagonal's addition.
            let column_sum = (0..14).step_by(2).map(|row| shown[0][(row, 2)]).sum::<f64>();
            assert!((column_sum - 4.0).abs() < 1e-14, "{column_sum}");
        }
    }

    #[test]
    fn dense_gives_way_to_sparse_by_size() {
        let sides = |size| [size - 1, size, size + 1];
        for n_blocks in [MAX_SMALL_BLOCKS, MAX_DENSE_BLOCKS].into_iter().flat_map(sides) {
            for symmetric in [true, false] {
                let mut links: Vec<Link> =
                    (1..n_blocks).map(|block| link(block / 3, block)).collect();
                links.iter_mut().for_each(|link| link.symmetric = symmetric);
                let solve = |choice| {
                    let mut matrix = BlockMatrix::<3>::new(n_blocks, &links, choice);
                    let mut random = fastrand::Rng::with_seed(6);
                    for Link { blocks: [a, b], .. } in &links {
                        let block = SMatrix::<f64, 3, 3>::from_fn(|_, _| random.f64() - 0.5);
                        matrix.add(*b, *a, &block.transpose());
                        matrix.add(*a, *b, &(block * if symmetric { 1.0 } else { -2.0 }));
                    }
                    (0..n_blocks).for_each(|block| matrix.add_diagonal(block, 6.0));
                    let mut values: Vec<f64> = (0..3 * n_blocks).map(|row| row as f64).collect();
                    matrix.solve(&mut values, &mut LinearStatistics::default()).unwrap();
                    (matrix.describe(), values)
                };
                let (words, found) = solve(LinearSolver::Auto);
                let expected = match (n_blocks, symmetric) {
                    (..=MAX_SMALL_BLOCKS, _) => "dense complete-pivoting LU",
                    (..=MAX_DENSE_BLOCKS, false) => "dense LU",
                    (_, true) => "sparse LDLᵀ",
                    (_, false) => "sparse LU",
                };
                let size = 3 * n_blocks;
                assert_eq!(words, format!("{expected} {size} × {size}"));
                for choice in [LinearSolver::Dense, LinearSolver::Sparse] {
                    let pairs = solve(choice).1.into_iter().zip(&found);
                    let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(worst < 1e-13 * size as f64, "{words}: {worst:e}");
                }
            }
        }
    }

    #[test]
    fn every_solver_gives_the_same_solution() {
        for n_blocks in [1, 2, 3, 4, 9, 20] {
            for symmetric in [true, false] {
                let mut links: Vec<Link> =
                    (1..n_blocks).map(|block| link(block / 2, block)).collect();
                links.push(link(0, 0));
                links.iter_mut().for_each(|link| link.symmetric = symmetric);
                let choices = [LinearSolver::Auto, LinearSolver::Dense, LinearSolver::Sparse];
                let solutions = choices.map(|choice| {
                    let mut matrix = BlockMatrix::<2>::new(n_blocks, &links, choice);
                    let words = matrix.describe();
                    match choice {
                        LinearSolver::Auto => {}
                        LinearSolver::Dense => assert!(!words.contains("sparse"), "{words}"),
                        LinearSolver::Sparse => assert!(!words.contains("dense"), "{words}"),
                    }
                    let mut random = fastrand::Rng::with_seed(6);
                    for Link { blocks: [a, b], .. } in &links {
                        let mut block = SMatrix::<f64, 2, 2>::from_fn(|_, _| random.f64() - 0.5);
                        if a == b {
                            block += block.transpose();
                        } else {
                            matrix.add(*b, *a, &block.transpose());
                            block *= if symmetric { 1.0 } else { -2.0 };
                        }
                        matrix.add(*a, *b, &block);
                    }
                    (0..n_blocks).for_each(|block| matrix.add_diagonal(block, 1.5));
                    let statistics = &mut LinearStatistics::default();
                    [1.0, -3.0].map(|right| {
                        let mut values = vec![right; 2 * n_blocks];
                        match right {
                            1.0 => matrix.solve(&mut values, statistics).unwrap(),
                            _ => matrix.solve_again(&mut values, statistics).unwrap(),
                        }
                        values
                    })
                });
                for (other, right) in (1..3).flat_map(|other| [(other, 0), (other, 1)]) {
                    let pairs = solutions[0][right].iter().zip(&solutions[other][right]);
                    for (a, b) in pairs {
                        assert!(
                            (a - b).abs() < 1e-12,
                            "{n_blocks} {symmetric} {:?}: {a} {b}",
                            choices[other]
                        );
                    }
                }
            }
        }
    }
}
