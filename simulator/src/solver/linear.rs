//! Systems made of `D × D` blocks, where each part gets the solver it needs.
//!
//! The blocks are first split into the connected parts of the graph that the couplings draw. A block
//! that nothing couples needs a division; a part whose blocks are coupled is a system of its own, dense
//! ([`DenseSystem`]) or sparse ([`SparseSystem`]) by its size. Fourteen separate springs are thus
//! fourteen 4 × 4 systems, and never one of 56 rows. The split is made once; its cost is in proportion
//! to the couplings.

use nalgebra::SMatrix;

use super::LinearError;
use super::dense::{DenseSystem, Method};
use super::sparse::SparseSystem;
use crate::statistics::LinearStatistics;

/// The most blocks that are solved by complete pivoting from the start.
pub const SMALL: usize = 3;

/// The most blocks of a dense part.
pub const DENSE: usize = 16;

/// Two blocks that the matrix couples; a block with itself if its own `D × D` entries are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Link {
    /// The two.
    pub blocks: [usize; 2],
    /// Whether what this link adds to the matrix is symmetric.
    pub symmetric: bool,
}

/// A square matrix of `D × D` blocks, with a solver.
pub struct BlockMatrix<const D: usize> {
    places: Vec<Place>,
    /// Diagonals of the uncoupled blocks, `D` entries each.
    diagonal: Vec<f64>,
    parts: Vec<Part<D>>,
}

/// Where the entries of a block are.
#[derive(Clone, Copy)]
enum Place {
    /// On the diagonal, as the block of this number.
    Diagonal(usize),
    /// In a part, as its block of this number.
    Part { part: usize, local: usize },
}

struct Part<const D: usize> {
    blocks: Vec<usize>,
    system: System<D>,
}

enum System<const D: usize> {
    Dense(DenseSystem),
    Sparse(Box<SparseSystem<D>>),
}

impl<const D: usize> BlockMatrix<D> {
    /// A zero matrix of `n_blocks` blocks a side, coupled by `links`.
    pub fn new(n_blocks: usize, links: &[Link]) -> Self {
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

        let mut places = Vec::with_capacity(n_blocks);
        let mut n_diagonal = 0;
        let mut members: Vec<Vec<usize>> = Vec::new();
        let mut part_of_root = vec![None; n_blocks];
        for block in 0..n_blocks {
            if !coupled[block] {
                places.push(Place::Diagonal(n_diagonal));
                n_diagonal += 1;
                continue;
            }
            let part = *part_of_root[sets.root(block)].get_or_insert_with(|| {
                members.push(Vec::new());
                members.len() - 1
            });
            places.push(Place::Part { part, local: members[part].len() });
            members[part].push(block);
        }
        let mut couplings: Vec<Vec<[usize; 2]>> = vec![Vec::new(); members.len()];
        for &Link { blocks: [a, b], .. } in links {
            if let (Place::Part { part, local: a }, Place::Part { local: b, .. }) =
                (places[a], places[b])
            {
                couplings[part].push([a, b]);
            }
        }
        let part_of = |(blocks, couplings): (Vec<usize>, Vec<[usize; 2]>)| {
            let symmetric = symmetric[sets.root(blocks[0])];
            Part { system: System::new(blocks.len(), &couplings, symmetric), blocks }
        };
        let parts = members.into_iter().zip(couplings).map(part_of).collect();
        Self { places, diagonal: vec![0.0; n_diagonal * D], parts }
    }

    /// Sets the matrix to zero.
    pub fn clear(&mut self) {
        self.diagonal.fill(0.0);
        self.parts.iter_mut().for_each(|part| part.system.clear());
    }

    /// Adds `value` to the diagonal of block `(block, block)`.
    pub fn add_diagonal(&mut self, block: usize, value: f64) {
        match self.places[block] {
            Place::Diagonal(number) => {
                self.diagonal[number * D..][..D].iter_mut().for_each(|entry| *entry += value);
            }
            Place::Part { part, local } => {
                self.parts[part].system.add_diagonal(local, value);
            }
        }
    }

    /// Adds `block` to block `(row, column)`, which the links must couple. Of an uncoupled block, only
    /// the diagonal is kept.
    pub fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        match (self.places[row], self.places[column]) {
            (Place::Diagonal(number), _) => {
                for (entry, value) in
                    self.diagonal[number * D..][..D].iter_mut().zip(block.diagonal().iter())
                {
                    *entry += value;
                }
            }
            (Place::Part { part, local }, Place::Part { local: local_column, .. }) => {
                self.parts[part].system.add(local, local_column, block);
            }
            (Place::Part { .. }, Place::Diagonal(_)) => {
                debug_assert!(false, "block ({row}, {column}) is not coupled");
            }
        }
    }

    /// Solves for the right-hand side in `values` and puts the solution there.
    ///
    /// # Errors
    /// Where a part is singular to working precision, or holds what is not finite.
    pub fn solve(
        &mut self,
        values: &mut [f64],
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError> {
        statistics.solves += 1;
        for (block, place) in self.places.iter().enumerate() {
            if let Place::Diagonal(number) = *place {
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
        for Part { blocks, system } in &mut self.parts {
            for (local, block) in blocks.iter().enumerate() {
                system.right_mut()[local * D..][..D].copy_from_slice(&values[block * D..][..D]);
            }
            system.solve(statistics)?;
            for (local, block) in blocks.iter().enumerate() {
                values[block * D..][..D].copy_from_slice(&system.solution()[local * D..][..D]);
            }
        }
        Ok(())
    }

    /// The solvers chosen, in words.
    pub fn describe(&self) -> String {
        let mut kinds: Vec<(String, usize)> = Vec::new();
        if !self.diagonal.is_empty() {
            kinds.push((format!("diagonal of {}", self.diagonal.len()), 1));
        }
        for Part { system, .. } in &self.parts {
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

impl<const D: usize> System<D> {
    /// The system that fits a part of `n_blocks` blocks.
    fn new(n_blocks: usize, couplings: &[[usize; 2]], symmetric: bool) -> Self {
        let dense = |method| Self::Dense(DenseSystem::new(n_blocks * D, method));
        match (n_blocks, symmetric) {
            (..=SMALL, _) => dense(Method::CompletePivoting),
            (..=DENSE, true) => dense(Method::Cholesky),
            (..=DENSE, false) => dense(Method::Lu),
            _ => Self::Sparse(Box::new(SparseSystem::new(n_blocks, couplings, symmetric))),
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
            Self::Dense(DenseSystem { matrix, .. }) => {
                (block * D..block * D + D).for_each(|row| matrix[(row, row)] += value);
            }
            Self::Sparse(system) => system.add_diagonal(block, value),
        }
    }

    fn add(&mut self, row: usize, column: usize, block: &SMatrix<f64, D, D>) {
        match self {
            Self::Dense(DenseSystem { matrix, .. }) => {
                let mut view = matrix.fixed_view_mut::<D, D>(row * D, column * D);
                view += block;
            }
            Self::Sparse(system) => system.add(row, column, block),
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

    fn describe(&self) -> String {
        let (kind, size) = match self {
            Self::Dense(system) => {
                let kind = match system.method() {
                    Method::CompletePivoting => "dense complete-pivoting LU",
                    Method::Cholesky => "dense Cholesky",
                    Method::Lu => "dense LU",
                };
                (kind, system.size())
            }
            Self::Sparse(system) if system.is_symmetric() => ("sparse Cholesky", system.size()),
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
    fn each_part_gets_what_it_needs() {
        let one_sided = Link { blocks: [5, 6], symmetric: false };
        let mut links = vec![link(1, 2), link(3, 3), one_sided, link(6, 7), link(7, 4)];
        links.extend((8..11).map(|block| link(block, block + 1)));
        let matrix = BlockMatrix::<2>::new(12, &links);
        let expected = "diagonal of 2, dense complete-pivoting LU 4 × 4, \
                        dense complete-pivoting LU 2 × 2, dense LU 8 × 8, dense Cholesky 8 × 8";
        assert_eq!(matrix.describe(), expected);
    }

    #[test]
    fn separate_springs_stay_separate() {
        let links: Vec<Link> = (0..14).map(|pair| link(2 * pair, 2 * pair + 1)).collect();
        assert_eq!(
            BlockMatrix::<2>::new(28, &links).describe(),
            "14 of dense complete-pivoting LU 4 × 4"
        );
    }

    #[test]
    fn the_solution_lands_where_the_blocks_are() {
        // Blocks 0 and 2 coupled, block 1 alone.
        let mut matrix = BlockMatrix::<2>::new(3, &[link(0, 2)]);
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
}
