//! Random graphs of many components, for the tests: 1 to 50 chains, stars, nets, trees and nets with dense rows.

use std::ops::RangeInclusive;

/// Particles of a component.
const SIZES: RangeInclusive<usize> = 1..=5_000;

/// Components of a forest.
const COMPONENTS: RangeInclusive<usize> = 1..=50;

/// Particles that are joined and, some of them, pinned.
#[derive(Debug)]
pub(crate) struct Forest {
    /// The drawn parameters, for messages.
    pub(crate) name: String,
    pub(crate) n_particles: usize,
    /// No pair twice, and no particle with itself.
    pub(crate) pairs: Vec<[usize; 2]>,
    pub(crate) pinned: Vec<bool>,
}

/// The shape of a component.
#[derive(Debug, Clone, Copy)]
enum Shape {
    Chain,
    Star,
    Tree,
    /// A rectangle with one diagonal in each cell.
    Net,
    /// A net, some particles of which are joined to many others.
    DenseRows,
}

impl Forest {
    /// The forest of this seed, of about `most` particles at most.
    pub(crate) fn new(seed: u64, most: usize) -> Self {
        let mut random = fastrand::Rng::with_seed(seed);
        let n_components = random.usize(COMPONENTS);
        let share = (most / n_components).clamp(*SIZES.start(), *SIZES.end());
        let equal = random.bool().then(|| size(&mut random, share));
        let mut forest =
            Self { name: String::new(), n_particles: 0, pairs: Vec::new(), pinned: Vec::new() };
        let mut shapes = [0; 5];
        while shapes.iter().sum::<usize>() < n_components && forest.n_particles < most {
            let room = (most - forest.n_particles).min(*SIZES.end());
            let size = equal.unwrap_or_else(|| size(&mut random, room));
            let all = [Shape::Chain, Shape::Star, Shape::Tree, Shape::Net, Shape::DenseRows];
            let shape = random.usize(..all.len());
            shapes[shape] += 1;
            forest.add(all[shape], size, &mut random);
        }
        if random.bool() {
            forest.shuffle(&mut random);
        }
        let counts = format!("{shapes:?} chains, stars, trees, nets and nets with dense rows");
        let equal = equal.map_or(String::new(), |size| format!(" of {size} each"));
        let pinned = forest.pinned.iter().filter(|pinned| **pinned).count();
        forest.name = format!(
            "seed {seed}: {counts}{equal}, {} particles, {pinned} pinned",
            forest.n_particles
        );
        forest
    }

    /// Equal nets of so many particles a side, one after another.
    pub(crate) fn nets(count: usize, side: usize) -> Self {
        let name = format!("{count} nets of {side} by {side}");
        let mut forest = Self { name, n_particles: 0, pairs: Vec::new(), pinned: Vec::new() };
        for _ in 0..count {
            forest.join(Shape::Net, side * side, side, &mut fastrand::Rng::with_seed(1));
        }
        forest
    }

    /// Adds a component, in one of three cases with a region that is pinned.
    fn add(&mut self, shape: Shape, size: usize, random: &mut fastrand::Rng) {
        let first = self.n_particles;
        let width = 1 + random.usize(..=2 * size.isqrt());
        self.join(shape, size, width.min(size), random);
        let region = match random.u32(..12) {
            // All of it, a part from one end, or one row of a net.
            0 => 0..size,
            1 => 0..random.usize(..=size),
            2 | 3 => size / 2 / width * width..size.min((size / 2 / width + 1) * width),
            _ => 0..0,
        };
        self.pinned[first..][region].fill(true);
    }

    fn join(&mut self, shape: Shape, size: usize, width: usize, random: &mut fastrand::Rng) {
        let first = self.n_particles;
        let pairs = &mut self.pairs;
        let mut pair = |i: usize, j: usize| pairs.push([first + i, first + j]);
        match shape {
            Shape::Chain => (1..size).for_each(|i| pair(i - 1, i)),
            Shape::Star => {
                let centre = random.usize(..size);
                (0..size).filter(|i| *i != centre).for_each(|i| pair(centre, i));
            }
            Shape::Tree => (1..size).for_each(|i| pair(random.usize(..i), i)),
            Shape::Net | Shape::DenseRows => {
                for i in 0..size {
                    let in_row = i % width + 1 < width;
                    for (step, exists) in [(1, in_row), (width, true), (width + 1, in_row)] {
                        // A net that is one particle wide has one neighbour below.
                        if exists && i + step < size {
                            pair(i, i + step);
                        }
                    }
                }
            }
        }
        if let Shape::DenseRows = shape {
            for _ in 0..random.usize(..4) {
                let (centre, stride) = (random.usize(..size), random.usize(1..40));
                (0..size).step_by(stride).filter(|i| *i != centre).for_each(|i| pair(centre, i));
            }
            let added = &mut self.pairs;
            added.iter_mut().for_each(|pair| pair.sort_unstable());
            added.sort_unstable();
            added.dedup();
        }
        self.n_particles += size;
        self.pinned.resize(self.n_particles, false);
    }

    /// Numbers the particles, and lists the pairs, in another order.
    fn shuffle(&mut self, random: &mut fastrand::Rng) {
        let mut number: Vec<usize> = (0..self.n_particles).collect();
        random.shuffle(&mut number);
        let mut pinned = vec![false; self.n_particles];
        for (particle, is_pinned) in self.pinned.iter().enumerate() {
            pinned[number[particle]] = *is_pinned;
        }
        self.pinned = pinned;
        self.pairs.iter_mut().for_each(|pair| *pair = pair.map(|particle| number[particle]));
        random.shuffle(&mut self.pairs);
    }
}

/// A size of up to `most`; small ones are as likely as large ones.
fn size(random: &mut fastrand::Rng, most: usize) -> usize {
    ((most as f64 + 1.0).powf(random.f64()) as usize).clamp(1, most)
}
