//! Symbolic factorisation of blocks: elimination order, fronts and storage offsets.
//!
//! Made once for a pattern, by the multifrontal method (Duff and Reid 1983): the blocks are put in order
//! of approximate minimum degree (Amestoy, Davis and Duff 1996), their elimination tree is found (Liu 1990),
//! and neighbours in the tree are amalgamated into *fronts* wherever the zeros that are then stored cost less
//! than another front. A front eliminates its pivots, a few blocks that follow each other in the
//! order, and leaves an update matrix on its other rows, which its parent in the tree assembles (extend-add). Every
//! offset is known before a number is. Cost: in proportion to the entries of the factor, in blocks.

use std::iter;
use std::mem;
use std::ops::Range;

use crate::sizes::{BRANCHES, DEEPEST, MAX_UNORDERED_BLOCKS, MIN_PRODUCTS};

/// The symbolic factor of a sparsity pattern.
pub(crate) struct SymbolicFactor {
    /// The block at each place of the order.
    pub(crate) order: Vec<u32>,
    /// Children before parents.
    pub(crate) fronts: Vec<Front>,
    /// Subtrees that threads may eliminate at the same time, ascending.
    pub(crate) branches: Vec<Branch>,
    /// Places of the rows below the pivots of each front, ascending.
    pub(crate) rows: Vec<u32>,
    /// Number of each of these rows among all rows of the parent front.
    pub(crate) rows_in_parent: Vec<u32>,
    /// The children of each front.
    pub(crate) children: Vec<u32>,
    /// Where the blocks of the matrix go, front by front.
    pub(crate) entries: Vec<Entry>,
    /// Blocks of the factor.
    pub(crate) n_factor: usize,
    /// Blocks in the workspace of the update matrices.
    pub(crate) n_updates: usize,
    /// The most rows of a front, in blocks.
    pub(crate) max_height: usize,
    /// Products of blocks in a factorisation.
    pub(crate) n_products: u64,
}

/// A subtree: fronts that depend on no other ones.
#[derive(Debug, Clone)]
pub(crate) struct Branch {
    pub(crate) fronts: Range<usize>,
    /// The subtrees in it that threads may eliminate at the same time, its first fronts; none of a small one.
    pub(crate) branches: Vec<Branch>,
    /// Subtrees in it that are not divided, itself included.
    pub(crate) n_leaves: usize,
    /// The number among them of that in the most costly branch, and in that the most costly one, and so on.
    pub(crate) heaviest: usize,
    /// Offset of their update matrices in the workspace.
    pub(crate) update: usize,
}

impl Branch {
    fn leaf(fronts: Range<usize>) -> Self {
        Self { fronts, branches: Vec::new(), n_leaves: 1, heaviest: 0, update: 0 }
    }

    /// The fronts that are in none of its branches.
    pub(crate) fn trunk(&self) -> Range<usize> {
        self.branches.last().map_or(self.fronts.start, |last| last.fronts.end)..self.fronts.end
    }
}

/// One dense step of the elimination; all counts in blocks.
#[derive(Debug, Clone)]
pub(crate) struct Front {
    /// Place of the first pivot.
    pub(crate) first: usize,
    pub(crate) n_pivots: usize,
    /// Range of the rows below the pivots.
    pub(crate) rows: [usize; 2],
    /// Offset of the pivots' columns in the factor: `n_pivots` columns of `n_pivots + rows`.
    pub(crate) panel: usize,
    /// Offset of the update matrix in the workspace.
    pub(crate) update: usize,
    pub(crate) children: [usize; 2],
    pub(crate) entries: [usize; 2],
}

impl Front {
    pub(crate) fn n_rows(&self) -> usize {
        self.rows[1] - self.rows[0]
    }

    pub(crate) fn height(&self) -> usize {
        self.n_pivots + self.n_rows()
    }
}

/// Where a block of the matrix goes in its front.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    /// Its number among the blocks stored.
    pub(crate) source: u32,
    pub(crate) row: u32,
    pub(crate) column: u32,
    pub(crate) transposed: bool,
}

/// A front while the tree is still being amalgamated.
#[derive(Default)]
struct Node {
    pivots: Vec<u32>,
    rows: Vec<u32>,
    parent: Option<usize>,
    children: Vec<usize>,
}

impl SymbolicFactor {
    /// The symbolic factor of a matrix with the blocks `(rows[i], column)`, `i` in
    /// `starts[column]..starts[column + 1]`: of a symmetric matrix those on and below its diagonal, else all, in a
    /// symmetric pattern.
    pub(crate) fn new(starts: &[usize], rows: &[u32]) -> Self {
        Self::with_levels(starts, rows, DEEPEST)
    }

    /// The same with so many levels of branches within branches at most.
    pub(crate) fn with_levels(starts: &[usize], rows: &[u32], levels: usize) -> Self {
        let n_blocks = starts.len() - 1;
        let neighbours = neighbours(starts, rows);
        let order = minimum_degree(&neighbours);
        let nodes = amalgamate(elimination_tree(&order, &neighbours));
        let numbered = postorder(&nodes);

        // The final order: pivots front by front.
        let mut place = vec![0_u32; n_blocks];
        let mut final_order = Vec::with_capacity(n_blocks);
        for &node in &numbered {
            for &pivot in &nodes[node].pivots {
                place[pivot as usize] = final_order.len() as u32;
                final_order.push(pivot);
            }
        }
        let mut front_of_node = vec![0_usize; nodes.len()];
        for (front, &node) in numbered.iter().enumerate() {
            front_of_node[node] = front;
        }

        let mut symbolic = Self {
            order: final_order,
            fronts: Vec::with_capacity(nodes.len()),
            branches: Vec::new(),
            rows: Vec::new(),
            rows_in_parent: Vec::new(),
            children: Vec::new(),
            entries: Vec::new(),
            n_factor: 0,
            n_updates: 0,
            max_height: 0,
            n_products: 0,
        };
        let mut first = 0;
        for &node in &numbered {
            let Node { pivots, rows, children, .. } = &nodes[node];
            let start = symbolic.rows.len();
            symbolic.rows.extend(rows.iter().map(|row| place[*row as usize]));
            symbolic.rows[start..].sort_unstable();
            let first_child = symbolic.children.len();
            symbolic.children.extend(children.iter().map(|child| front_of_node[*child] as u32));
            symbolic.children[first_child..].sort_unstable();
            let front = Front {
                first,
                n_pivots: pivots.len(),
                rows: [start, symbolic.rows.len()],
                panel: symbolic.n_factor,
                update: 0,
                children: [first_child, symbolic.children.len()],
                entries: [0, 0],
            };
            first += pivots.len();
            symbolic.n_factor += front.n_pivots * front.height();
            symbolic.max_height = symbolic.max_height.max(front.height());
            symbolic.n_products += n_products(front.n_pivots, front.n_rows());
            symbolic.fronts.push(front);
        }
        symbolic.place_rows_in_parents(&numbered, &nodes, &front_of_node);
        symbolic.take_branches(levels);
        symbolic.place_updates();
        symbolic.place_entries(starts, rows, &place);
        symbolic
    }

    fn place_rows_in_parents(&mut self, numbered: &[usize], nodes: &[Node], front_of: &[usize]) {
        self.rows_in_parent = vec![0; self.rows.len()];
        for (front, &node) in self.fronts.iter().zip(numbered) {
            let Some(parent) = nodes[node].parent else { continue };
            let parent = &self.fronts[front_of[parent]];
            for row in front.rows[0]..front.rows[1] {
                self.rows_in_parent[row] = local_row(parent, &self.rows, self.rows[row]);
            }
        }
    }

    /// Divides the tree into branches, down to those that cost a small part of the whole.
    fn take_branches(&mut self, levels: usize) {
        // The first front and the cost of each subtree, which ends with its root.
        let mut subtrees: Vec<(usize, u64)> = Vec::with_capacity(self.fronts.len());
        let mut roots = Vec::new();
        for (number, front) in self.fronts.iter().enumerate() {
            let own = (number, cost(front.n_pivots, front.n_rows()));
            let children = self.children_of(number).iter().map(|child| subtrees[*child as usize]);
            subtrees.push(children.fold(own, |a, b| (a.0.min(b.0), a.1 + b.1)));
            if front.n_rows() == 0 {
                roots.push(number as u32);
            }
        }
        let whole = roots.iter().map(|root| subtrees[*root as usize].1).sum::<u64>();
        let limit = whole / BRANCHES;
        let branch = |root: &u32| self.branch(*root as usize, &subtrees, limit, levels);
        self.branches = if self.n_products < MIN_PRODUCTS {
            vec![Branch::leaf(0..self.fronts.len())]
        } else {
            roots.iter().map(branch).collect()
        };
    }

    /// Whether there is work for several threads.
    pub(crate) fn is_divided(&self) -> bool {
        self.branches.len() > 1 || self.branches.iter().any(|branch| !branch.branches.is_empty())
    }

    fn children_of(&self, front: usize) -> &[u32] {
        let [start, end] = self.fronts[front].children;
        &self.children[start..end]
    }

    /// The subtree of a front, divided where it costs more than `limit`, so many levels deep at most.
    fn branch(&self, root: usize, subtrees: &[(usize, u64)], limit: u64, levels: usize) -> Branch {
        let (first, cost) = subtrees[root];
        let fronts = first..root + 1;
        if cost <= limit || levels == 0 {
            return Branch::leaf(fronts);
        }
        // A chain of fronts is one trunk.
        let mut top = root;
        while let [child] = *self.children_of(top)
            && subtrees[child as usize].1 > limit
        {
            top = child as usize;
        }
        let mut whole = Branch { fronts, n_leaves: 0, ..Branch::leaf(0..0) };
        let mut most = 0;
        for child in self.children_of(top).iter().map(|child| *child as usize) {
            let branch = self.branch(child, subtrees, limit, levels - 1);
            if subtrees[child].1 > most {
                most = subtrees[child].1;
                whole.heaviest = whole.n_leaves + branch.heaviest;
            }
            whole.n_leaves += branch.n_leaves;
            whole.branches.push(branch);
        }
        whole.n_leaves = whole.n_leaves.max(1);
        whole
    }

    /// Gives each branch a separate part of the workspace.
    fn place_updates(&mut self) {
        let mut branches = mem::take(&mut self.branches);
        self.n_updates = self.place_updates_of(&mut branches, 0);
        self.branches = branches;
    }

    /// Places the update matrices of some branches one after another, from `start` on; returns where they end.
    fn place_updates_of(&mut self, branches: &mut [Branch], mut start: usize) -> usize {
        for branch in branches {
            branch.update = start;
            let end = self.place_updates_of(&mut branch.branches, start);
            // The update matrices of the branches' roots wait for the trunk.
            let mut gaps = Gaps::from(start);
            for of_root in branch.branches.iter().map(|inner| inner.fronts.end - 1) {
                let front = &self.fronts[of_root];
                gaps.take(front.update..front.update + front.n_rows().pow(2));
            }
            start = end.max(self.place_updates_in(branch.trunk(), gaps));
        }
        start
    }

    /// Gives each update matrix its place: the first gap that is wide enough from when it is made until its parent has
    /// assembled it. Returns where they end.
    fn place_updates_in(&mut self, fronts: Range<usize>, mut gaps: Gaps) -> usize {
        let mut last = 0;
        for number in fronts {
            let length = self.fronts[number].n_rows().pow(2);
            // That of a root is empty, and has a place in its branch all the same.
            let place = gaps.first(length);
            self.fronts[number].update = place;
            last = last.max(place + length);
            for child in self.children_of(number) {
                let child = &self.fronts[*child as usize];
                gaps.give_back(child.update..child.update + child.n_rows().pow(2));
            }
        }
        last
    }

    fn place_entries(&mut self, starts: &[usize], rows: &[u32], place: &[u32]) {
        let mut front_of_place = vec![0_u32; place.len()];
        for (number, front) in self.fronts.iter().enumerate() {
            front_of_place[front.first..][..front.n_pivots].fill(number as u32);
        }
        let mut entries: Vec<(u32, Entry)> = Vec::with_capacity(rows.len());
        for column in 0..place.len() {
            for source in starts[column]..starts[column + 1] {
                let (row, column) = (place[rows[source] as usize], place[column]);
                let transposed = row < column;
                let (low, high) = (row.min(column), row.max(column));
                let number = front_of_place[low as usize];
                let front = &self.fronts[number as usize];
                let entry = Entry {
                    source: source as u32,
                    row: local_row(front, &self.rows, high),
                    column: low - front.first as u32,
                    transposed,
                };
                entries.push((number, entry));
            }
        }
        entries.sort_unstable_by_key(|(front, entry)| {
            (*front, entry.column, entry.row, entry.transposed)
        });
        let mut end = 0;
        for (number, front) in self.fronts.iter_mut().enumerate() {
            let start = end;
            while end < entries.len() && entries[end].0 as usize == number {
                end += 1;
            }
            front.entries = [start, end];
        }
        self.entries = entries.into_iter().map(|(_, entry)| entry).collect();
    }
}

/// Parts of a workspace that are free, ascending and apart; the last one has no end.
struct Gaps(Vec<Range<usize>>);

impl Gaps {
    /// All from `start` on.
    fn from(start: usize) -> Self {
        Self(iter::once(start..usize::MAX).collect())
    }

    /// Takes the first of so many numbers that are free.
    fn first(&mut self, length: usize) -> usize {
        let gap = self.0.iter().position(|gap| gap.len() >= length).unwrap_or(self.0.len() - 1);
        let start = self.0[gap].start;
        self.take(start..start + length);
        start
    }

    /// Takes numbers that are free.
    fn take(&mut self, taken: Range<usize>) {
        let gap = self.0.partition_point(|gap| gap.end < taken.end);
        let Range { start, end } = self.0[gap];
        let left = [start..taken.start, taken.end..end];
        self.0.splice(gap..=gap, left.into_iter().filter(|gap| !gap.is_empty()));
    }

    /// Gives numbers back.
    fn give_back(&mut self, free: Range<usize>) {
        if free.is_empty() {
            return;
        }
        let next = self.0.partition_point(|gap| gap.end < free.start);
        let joined = self.0[next..].iter().take_while(|gap| gap.start <= free.end).count();
        let hull = self.0[next..next + joined]
            .iter()
            .fold(free, |all, gap| all.start.min(gap.start)..all.end.max(gap.end));
        self.0.splice(next..next + joined, [hull]);
    }
}

/// Number of the row at `place` among all rows of `front`.
fn local_row(front: &Front, rows: &[u32], place: u32) -> u32 {
    let pivot = place as usize - front.first;
    if pivot < front.n_pivots {
        return pivot as u32;
    }
    let below = &rows[front.rows[0]..front.rows[1]];
    (front.n_pivots + below.partition_point(|row| *row < place)) as u32
}

/// Products of blocks that a front of so many pivots and rows below them takes.
fn n_products(n_pivots: usize, n_rows: usize) -> u64 {
    (0..n_pivots as u64)
        .map(|pivot| {
            let below = pivot + n_rows as u64;
            below * (below + 3) / 2 + 1
        })
        .sum()
}

/// All neighbours of each block, ascending.
fn neighbours(starts: &[usize], rows: &[u32]) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); starts.len() - 1];
    for column in 0..starts.len() - 1 {
        for &row in &rows[starts[column]..starts[column + 1]] {
            if row as usize != column {
                neighbours[row as usize].push(column as u32);
                neighbours[column].push(row);
            }
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        // A matrix that is not symmetric has both blocks of a pair.
        list.dedup();
    }
    neighbours
}

/// The blocks in order of approximate minimum degree.
fn minimum_degree(neighbours: &[Vec<u32>]) -> Vec<u32> {
    let n_blocks = neighbours.len();
    if n_blocks <= MAX_UNORDERED_BLOCKS {
        return (0..n_blocks as u32).collect();
    }
    let (mut starts, mut rows) = (vec![0], Vec::new());
    for (block, list) in neighbours.iter().enumerate() {
        let below = list.partition_point(|row| (*row as usize) < block);
        rows.extend(list[..below].iter().map(|row| *row as usize));
        // Of no account for the order; the crate counts on it.
        rows.push(block);
        rows.extend(list[below..].iter().map(|row| *row as usize));
        starts.push(rows.len());
    }
    let found = amd::order(n_blocks, &starts, &rows, &amd::Control::default());
    let (found, ..) = found.expect("rows in range, ascending and without repetition");
    found.into_iter().map(|block| block as u32).collect()
}

/// Eliminates block by block in `order`: a tree of fronts of one pivot each.
fn elimination_tree(order: &[u32], neighbours: &[Vec<u32>]) -> Vec<Node> {
    let n_blocks = order.len();
    let mut place = vec![0_u32; n_blocks];
    for (number, block) in order.iter().enumerate() {
        place[*block as usize] = number as u32;
    }
    // A node has the number of its pivot's place; rows are places until the end.
    let mut nodes: Vec<Node> = Vec::with_capacity(n_blocks);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); n_blocks];
    let mut seen = vec![u32::MAX; n_blocks];
    for (number, &block) in order.iter().enumerate() {
        let mut rows = Vec::new();
        let mut visit = |row: u32| {
            if row as usize > number && seen[row as usize] != number as u32 {
                seen[row as usize] = number as u32;
                rows.push(row);
            }
        };
        neighbours[block as usize].iter().for_each(|other| visit(place[*other as usize]));
        let own = mem::take(&mut children[number]);
        for &child in &own {
            let child: &Node = &nodes[child];
            child.rows.iter().for_each(|row| visit(*row));
        }
        nodes.push(Node { pivots: vec![block], rows, parent: None, children: own });
        let parent = nodes[number].rows.iter().min().map(|row| *row as usize);
        nodes[number].parent = parent;
        if let Some(parent) = parent {
            children[parent].push(number);
        }
    }
    for node in &mut nodes {
        node.rows.iter_mut().for_each(|row| *row = order[*row as usize]);
    }
    nodes
}

/// Cost of a front, in units of a tenth of a nanosecond on the machine it was measured on: its set-up,
/// its columns, the update matrix that is cleared, filled and handed on, and the products of blocks. Only
/// ratios matter, and they only choose between plans that are all right.
fn cost(n_pivots: usize, n_rows: usize) -> u64 {
    let rows = n_rows as u64;
    600 + 150 * n_pivots as u64 + 16 * rows * rows + 8 * n_products(n_pivots, n_rows)
}

/// Joins each front with its parent where the two together cost no more than each alone.
fn amalgamate(mut nodes: Vec<Node>) -> Vec<Node> {
    // Nodes are numbered children first, and an amalgamated node passes its children to its parent.
    for number in 0..nodes.len() {
        let mut children = mem::take(&mut nodes[number].children);
        // The widest first: it has the most rows in common with its parent.
        children.sort_by_key(|child| std::cmp::Reverse((nodes[*child].rows.len(), *child)));
        let mut kept = Vec::new();
        for child in children {
            let (parent, joining) = (&nodes[number], &nodes[child]);
            let pivots = parent.pivots.len() + joining.pivots.len();
            let apart = cost(parent.pivots.len(), parent.rows.len())
                + cost(joining.pivots.len(), joining.rows.len());
            if cost(pivots, parent.rows.len()) > apart {
                kept.push(child);
                continue;
            }
            let of_child = mem::take(&mut nodes[child]);
            let mut pivots = of_child.pivots;
            pivots.append(&mut nodes[number].pivots);
            nodes[number].pivots = pivots;
            for grandchild in of_child.children {
                nodes[grandchild].parent = Some(number);
                kept.push(grandchild);
            }
        }
        nodes[number].children = kept;
    }
    nodes
}

/// The nodes that are left, children before parents.
fn postorder(nodes: &[Node]) -> Vec<usize> {
    let mut order = Vec::new();
    let roots = (0..nodes.len()).rev();
    let roots =
        roots.filter(|root| nodes[*root].parent.is_none() && !nodes[*root].pivots.is_empty());
    let mut pending: Vec<usize> = roots.collect();
    // Parents before children, and then the other way round.
    while let Some(node) = pending.pop() {
        order.push(node);
        pending.extend(&nodes[node].children);
    }
    order.reverse();
    order
}
