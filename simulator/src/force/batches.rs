//! Pairs of particles in batches that vector instructions can work on.
//!
//! Meshes list their springs row by row: element `s + 1` then joins the particles next to those of element
//! `s`. Such a *run*, `(i, j), (i+1, j+1), …`, reads and writes contiguous particles, and needs neither
//! gathers nor scatters. Several runs may alternate (the two diagonals of a net do, with period 2). Where a row of
//! the mesh ends, a run skips particles: it then has *holes*, elements that are evaluated with the others and count as
//! zero. Pairs without such a pattern are scattered.
//!
//! Batches keep each particle's sum in the order of the file, and so its bits. In `t` repeats of runs that
//! start at `(i_r, j_r)`, particle `p` is met at `t = p − i_r` and `t = p − j_r`: earlier by the ends of
//! runs that start at a higher particle. So the ends are added one after another, the one with the highest
//! first particle first; among equals, in the order of the file.
//!
//! Threads divide the particles, not the pairs: each adds to the sums of a range of particles, and evaluates
//! what moves one of them. A pair across two ranges is evaluated twice. Every sum is then the same bits for
//! any number of threads.
//!
//! Memory: 88 bytes a batch, and 8 for each run of one and for each scattered pair.

use std::cmp::Reverse;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use pulp::Simd;

use super::law::{PairLaw, PairLaws, Relative, Undefined};
use super::{State, Vector};
use crate::sizes::{BATCH, LANES, MAX_ADVANCE, MAX_PERIOD, MIN_REPEATS};

/// The number of an element that is none: of a hole, or of what fills the last vector of a run.
pub(super) const HOLE: u32 = u32::MAX;

/// The pairs of a force that move particles of a range, in batches.
#[derive(Debug)]
pub(super) struct Batches {
    /// The particles.
    range: Range<usize>,
    batches: Vec<Batch>,
    /// First pairs of runs, and scattered pairs.
    pairs: Vec<[u32; 2]>,
    /// Forces of a batch, with room for the largest one.
    scratch: Mutex<Vec<f64>>,
}

/// Some runs, or scattered pairs. Elements of a batch have consecutive slots; each run starts at a multiple of
/// [`LANES`] from the first.
#[derive(Debug, Clone, Copy)]
struct Batch {
    first_slot: u32,
    first_pair: u32,
    /// Elements of each run, or pairs.
    count: u32,
    /// Runs; 0 where the pairs are scattered.
    n_runs: u32,
    /// Bits of the elements of each run that are holes.
    holes: [u64; BATCH / 64],
    /// Ends of runs in the order in which they are added: twice the run, and one more for its second end.
    ends: [u8; 2 * MAX_PERIOD],
}

impl Batches {
    /// Batches of those of the pairs that move a particle of `range`. The pairs' numbers, or [`HOLE`], in the
    /// order of slots, are appended to `order`.
    pub(super) fn new(pairs: &[[u32; 2]], range: Range<usize>, order: &mut Vec<u32>) -> Self {
        let mut batches =
            Self { range, batches: Vec::new(), pairs: Vec::new(), scratch: Mutex::default() };
        let mut next = 0;
        while next < pairs.len() {
            match Block::at(pairs, next) {
                Some(block) => {
                    batches.push_block(pairs, next, block, order);
                    next += block.period * block.repeats;
                }
                None => {
                    if pairs[next]
                        .iter()
                        .any(|particle| batches.range.contains(&(*particle as usize)))
                    {
                        batches.push_scattered(pairs[next], order.len());
                        order.push(next as u32);
                    }
                    next += 1;
                }
            }
        }
        let slots = batches.batches.iter().map(Batch::n_slots).max();
        batches.scratch = Mutex::new(vec![0.0; 3 * slots.unwrap_or(0)]);
        batches
    }

    fn push_scattered(&mut self, pair: [u32; 2], slot: usize) {
        match self.batches.last_mut() {
            Some(batch) if batch.n_runs == 0 && (batch.count as usize) < BATCH => batch.count += 1,
            _ => self.push(Batch {
                first_slot: slot as u32,
                first_pair: 0,
                count: 1,
                n_runs: 0,
                holes: [0; _],
                ends: [0; _],
            }),
        }
        self.pairs.push(pair);
    }

    fn push_block(
        &mut self,
        pairs: &[[u32; 2]],
        first: usize,
        Block { period, repeats }: Block,
        order: &mut Vec<u32>,
    ) {
        let pairs = &pairs[first..first + period * repeats];
        let firsts = &pairs[..period];
        let advance = |repeat: &[[u32; 2]]| (repeat[0][0] - firsts[0][0]) as usize;
        let mut repeat_at = vec![HOLE; 1 + advance(&pairs[period * (repeats - 1)..])];
        for (number, repeat) in pairs.chunks_exact(period).enumerate() {
            repeat_at[advance(repeat)] = number as u32;
        }
        // The repeats that move a particle of the range, and those between them.
        let Range { start, end } = self.range;
        let met = firsts.as_flattened().iter().map(|particle| {
            let repeat =
                |border: usize| border.saturating_sub(*particle as usize).min(repeat_at.len());
            (repeat(start), repeat(end))
        });
        let met = met.filter(|(from, to)| from < to);
        let hull = |(from, to): (usize, usize), (a, b)| (from.min(a), to.max(b));
        let (from, to) = met.reduce(hull).unwrap_or((0, 0));
        for done in (from..to).step_by(BATCH / period) {
            let repeats = &repeat_at[done..to.min(done + BATCH / period)];
            let mut holes = [0; BATCH / 64];
            for (bit, number) in repeats.iter().enumerate() {
                holes[bit / 64] |= u64::from(*number == HOLE) << (bit % 64);
            }
            let particle = |end: usize| firsts[end / 2][end % 2];
            let mut ends: [u8; 2 * MAX_PERIOD] = std::array::from_fn(|end| end as u8);
            ends[..2 * period].sort_by_key(|end| Reverse(particle(usize::from(*end))));
            self.push(Batch {
                first_slot: order.len() as u32,
                first_pair: 0,
                count: repeats.len() as u32,
                n_runs: period as u32,
                holes,
                ends,
            });
            self.pairs.extend(firsts.iter().map(|pair| pair.map(|end| end + done as u32)));
            for run in 0..period {
                let of_run = |number: &u32| match *number {
                    HOLE => HOLE,
                    number => (first + run) as u32 + number * period as u32,
                };
                order.extend(repeats.iter().map(of_run));
                let stride = repeats.len().next_multiple_of(LANES);
                order.resize(order.len() + stride - repeats.len(), HOLE);
            }
        }
    }

    fn push(&mut self, batch: Batch) {
        self.batches.push(Batch { first_pair: self.pairs.len() as u32, ..batch });
    }

    /// The particles whose sums these are.
    pub(super) fn range(&self) -> Range<usize> {
        self.range.clone()
    }

    /// Adds to the sums of the range's particles what the laws make of all particles' positions, and of their
    /// velocities where `V` is set.
    ///
    /// # Errors
    /// Where a law is not defined.
    #[inline(always)]
    pub(super) fn add<const D: usize, const V: bool, S: Simd>(
        &self,
        simd: S,
        laws: &impl PairLaws<D>,
        State { positions, velocities, time, .. }: State<'_>,
        sums: &mut [f64],
    ) -> Result<(), Undefined> {
        let x = positions.as_chunks::<D>().0;
        let v = velocities.as_chunks::<D>().0;
        let sums = sums.as_chunks_mut::<D>().0;
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let forces = scratch.as_chunks_mut::<D>().0;
        for batch in &self.batches {
            let (slot, count) = (batch.first_slot as usize, batch.count as usize);
            if batch.n_runs == 0 {
                let pairs = &self.pairs[batch.first_pair as usize..][..count];
                let forces = &mut forces[..count];
                let relative = Scattered { pairs, x, v: V.then_some(v), time };
                laws.forces(simd, slot, relative, forces)?;
                self.add_scattered(pairs, forces, sums);
                continue;
            }
            let n_runs = batch.n_runs as usize;
            let firsts = &self.pairs[batch.first_pair as usize..][..n_runs];
            let stride = count.next_multiple_of(LANES);
            for (run, pair) in firsts.iter().enumerate() {
                let [i, j] = pair.map(|particle| particle as usize);
                // Whole vectors, but not beyond the last particle.
                let filled = stride.min(x.len() - i.max(j));
                let x = [&x[i..][..filled], &x[j..][..filled]];
                let v = if V { [&v[i..][..filled], &v[j..][..filled]] } else { [&v[..0]; 2] };
                let (slot, forces) = (slot + run * stride, &mut forces[run * stride..][..filled]);
                let relative = Run { x, v, time };
                if laws.forces(simd, slot, relative, forces).is_err() {
                    batch.forces_of_elements(laws, slot, relative, forces)?;
                }
                for (forces, holes) in forces.chunks_mut(64).zip(batch.holes) {
                    let mut holes = holes;
                    while holes != 0 {
                        forces[holes.trailing_zeros() as usize] = [0.0; D];
                        holes &= holes - 1;
                    }
                }
            }
            for end in &batch.ends[..2 * n_runs] {
                let (run, side) = (usize::from(end / 2), usize::from(end % 2));
                let first = firsts[run][side] as usize;
                let (from, to) = (first.max(self.range.start), (first + count).min(self.range.end));
                if from >= to {
                    continue;
                }
                let n = to - from;
                let sums = &mut sums[from - self.range.start..][..n];
                let forces = &forces[run * stride + from - first..][..n];
                match side {
                    0 => update(sums, forces, |sum, force| sum + force),
                    _ => update(sums, forces, |sum, force| sum - force),
                }
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn add_scattered<const D: usize>(
        &self,
        pairs: &[[u32; 2]],
        forces: &[[f64; D]],
        sums: &mut [[f64; D]],
    ) {
        // Lower indices wrap to huge values and miss.
        let place = |particle: u32| (particle as usize).wrapping_sub(self.range.start);
        for (force, &[i, j]) in forces.iter().zip(pairs) {
            if let Some(sum) = sums.get_mut(place(i)) {
                *sum = std::array::from_fn(|axis| sum[axis] + force[axis]);
            }
            if let Some(sum) = sums.get_mut(place(j)) {
                *sum = std::array::from_fn(|axis| sum[axis] - force[axis]);
            }
        }
    }
}

impl Batch {
    fn n_slots(&self) -> usize {
        (self.count as usize).next_multiple_of(LANES) * (self.n_runs as usize).max(1)
    }

    fn is_hole(&self, idx: usize) -> bool {
        self.holes[idx / 64] >> (idx % 64) & 1 != 0
    }

    /// The forces of a run's elements, where a hole between two particles in one place spoils them all.
    #[cold]
    fn forces_of_elements<const D: usize>(
        &self,
        laws: &impl PairLaws<D>,
        first_slot: usize,
        run: Run<'_, D>,
        forces: &mut [[f64; D]],
    ) -> Result<(), Undefined> {
        for idx in (0..self.count as usize).filter(|idx| !self.is_hole(*idx)) {
            let law = laws.law(first_slot + idx).at(run.time());
            let force = law.force(&run.position(idx), &run.velocity(idx));
            forces[idx] = force.ok_or(Undefined)?.into();
        }
        Ok(())
    }
}

/// All first particles, and all second ones.
#[derive(Clone, Copy)]
struct Run<'a, const D: usize> {
    x: [&'a [[f64; D]]; 2],
    v: [&'a [[f64; D]]; 2],
    time: f64,
}

/// Pairs, and the states of all particles.
#[derive(Clone, Copy)]
struct Scattered<'a, const D: usize> {
    pairs: &'a [[u32; 2]],
    x: &'a [[f64; D]],
    v: Option<&'a [[f64; D]]>,
    time: f64,
}

impl<const D: usize> Scattered<'_, D> {
    #[inline(always)]
    fn gather<S: Simd>(self, simd: S, x: &[[f64; D]], first: usize) -> [S::f64s; D] {
        let mut vectors = [simd.splat_f64s(0.0); D];
        let (vectors_d, _) =
            pulp::bytemuck::cast_slice_mut::<S::f64s, f64>(&mut vectors).as_chunks_mut::<D>();
        for (d, pair) in vectors_d.iter_mut().zip(&self.pairs[first..first + S::F64_LANES]) {
            let [i, j] = pair.map(|particle| x[particle as usize]);
            *d = std::array::from_fn(|axis| i[axis] - j[axis]);
        }
        vectors
    }
    #[inline(always)]
    fn difference(self, x: &[[f64; D]], idx: usize) -> Vector<D> {
        let [i, j] = self.pairs[idx].map(|particle| Vector::from(x[particle as usize]));
        i - j
    }
}

/// The vectors of `F64_LANES` elements or particles, from this one on.
#[inline(always)]
pub(super) fn load<const D: usize, S: Simd>(values: &[[f64; D]], first: usize) -> [S::f64s; D] {
    let (vectors, _) = S::as_simd_f64s(values[first..first + S::F64_LANES].as_flattened());
    vectors.as_chunks::<D>().0[0]
}

/// Sets the vectors of `F64_LANES` elements.
#[inline(always)]
pub(super) fn store<const D: usize, S: Simd>(values: &mut [[f64; D]], vectors: [S::f64s; D]) {
    S::as_mut_simd_f64s(values.as_flattened_mut()).0.copy_from_slice(&vectors);
}

#[inline(always)]
fn load_difference<const D: usize, S: Simd>(
    simd: S,
    [a, b]: [&[[f64; D]]; 2],
    first: usize,
) -> [S::f64s; D] {
    let mut difference = load::<D, S>(a, first);
    for (a, b) in difference.iter_mut().zip(load::<D, S>(b, first)) {
        *a = simd.sub_f64s(*a, b);
    }
    difference
}

impl<const D: usize> Relative<D> for Run<'_, D> {
    #[inline(always)]
    fn positions<S: Simd>(self, simd: S, first: usize) -> [S::f64s; D] {
        load_difference(simd, self.x, first)
    }
    #[inline(always)]
    fn velocities<S: Simd>(self, simd: S, first: usize) -> [S::f64s; D] {
        load_difference(simd, self.v, first)
    }
    #[inline(always)]
    fn position(self, idx: usize) -> Vector<D> {
        Vector::from(self.x[0][idx]) - Vector::from(self.x[1][idx])
    }
    #[inline(always)]
    fn velocity(self, idx: usize) -> Vector<D> {
        match self.v[0].get(idx) {
            Some(first) => Vector::from(*first) - Vector::from(self.v[1][idx]),
            None => Vector::zeros(),
        }
    }
    #[inline(always)]
    fn time(self) -> f64 {
        self.time
    }
}

impl<const D: usize> Relative<D> for Scattered<'_, D> {
    #[inline(always)]
    fn positions<S: Simd>(self, simd: S, first: usize) -> [S::f64s; D] {
        self.gather(simd, self.x, first)
    }
    #[inline(always)]
    fn velocities<S: Simd>(self, simd: S, first: usize) -> [S::f64s; D] {
        self.v.map_or([simd.splat_f64s(0.0); D], |v| self.gather(simd, v, first))
    }
    #[inline(always)]
    fn position(self, idx: usize) -> Vector<D> {
        self.difference(self.x, idx)
    }
    #[inline(always)]
    fn velocity(self, idx: usize) -> Vector<D> {
        self.v.map_or_else(Vector::zeros, |v| self.difference(v, idx))
    }
    #[inline(always)]
    fn time(self) -> f64 {
        self.time
    }
}

/// `z ← operation(z, a)`.
#[inline(always)]
fn update<const D: usize>(z: &mut [[f64; D]], a: &[[f64; D]], operation: impl Fn(f64, f64) -> f64) {
    let (wide, rest) = z.as_flattened_mut().as_chunks_mut::<LANES>();
    let (wide_a, rest_a) = a.as_flattened().as_chunks::<LANES>();
    for (z, a) in wide.iter_mut().zip(wide_a) {
        *z = std::array::from_fn(|lane| operation(z[lane], a[lane]));
    }
    for (z, a) in rest.iter_mut().zip(rest_a) {
        *z = operation(*z, *a);
    }
}

/// `repeats` times a pattern of `period` elements, each time some particles further.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Block {
    period: usize,
    repeats: usize,
}

impl Block {
    /// The block that starts at this pair and covers most; `None` where none is worth it.
    fn at(pairs: &[[u32; 2]], first: usize) -> Option<Self> {
        let blocks = (1..=MAX_PERIOD).filter_map(|period| Self::of_period(&pairs[first..], period));
        // The first of the longest: `max_by_key` would take the last.
        blocks.rev().max_by_key(|block| block.period * block.repeats)
    }

    /// The longest block of this period at the beginning of `pairs`.
    fn of_period(pairs: &[[u32; 2]], period: usize) -> Option<Self> {
        let firsts = pairs.get(..period)?;
        let (mut repeats, mut reach) = (1, 0);
        for repeat in pairs.chunks_exact(period).skip(1) {
            let advance = repeat[0][0].wrapping_sub(firsts[0][0]);
            let follows = |(first, pair): (&[u32; 2], &[u32; 2])| {
                first.map(|particle| particle.wrapping_add(advance)) == *pair
            };
            let near = (1..=MAX_ADVANCE).contains(&advance.wrapping_sub(reach));
            // Some holes are better than pairs that are scattered; many are not.
            let dense = repeats + 1 < MIN_REPEATS || 2 * (advance as usize) <= 3 * repeats;
            if !near || !dense || !firsts.iter().zip(repeat).all(follows) {
                break;
            }
            (repeats, reach) = (repeats + 1, advance);
        }
        (repeats >= MIN_REPEATS).then_some(Self { period, repeats })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nets_are_batched_into_runs() {
        // Rows, columns and both diagonals of a net of 30 by 30 particles.
        let particle = |row: u32, column: u32| row * 30 + column;
        let mut pairs = Vec::new();
        for (row, column) in (0..29).flat_map(|row| (0..30).map(move |column| (row, column))) {
            pairs.push([particle(row, column), particle(row + 1, column)]);
        }
        for (row, column) in (0..30).flat_map(|row| (0..29).map(move |column| (row, column))) {
            pairs.push([particle(row, column), particle(row, column + 1)]);
        }
        for (row, column) in (0..29).flat_map(|row| (0..29).map(move |column| (row, column))) {
            pairs.push([particle(row, column), particle(row + 1, column + 1)]);
            pairs.push([particle(row + 1, column), particle(row, column + 1)]);
        }
        let mut order = Vec::new();
        let batches = Batches::new(&pairs, 0..900, &mut order);
        assert!(batches.batches.iter().all(|batch| batch.n_runs > 0));
        // A row's end is a hole, not the end of a run.
        assert_eq!(
            batches.batches.len(),
            870_usize.div_ceil(512) + 899_usize.div_ceil(512) + 869_usize.div_ceil(256)
        );
        // Each pair has one slot.
        order.retain(|number| *number != HOLE);
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..pairs.len() as u32));
    }

    #[test]
    fn runs_respect_minimum_and_maximum_sizes() {
        // So many repeats of a pattern, in rows of 20 between which particles are skipped.
        let batches = |repeats: u32, period: u32, advance: u32| {
            let first = |repeat: u32| repeat + repeat / 20 * (advance - 1);
            let pairs = (0..repeats).flat_map(|repeat| {
                (0..period).map(move |run| [first(repeat) + run * run, first(repeat) + 50])
            });
            let pairs: Vec<[u32; 2]> = pairs.collect();
            let n_particles = first(repeats) as usize + 60;
            Batches::new(&pairs, 0..n_particles, &mut Vec::new()).batches
        };
        let n_runs = |repeats, period, advance| {
            batches(repeats, period, advance).iter().map(|batch| batch.n_runs).sum::<u32>()
        };
        let repeats = MIN_REPEATS as u32;
        assert_eq!([repeats - 1, repeats, repeats + 1].map(|n| n_runs(n, 1, 1)), [0, 1, 1]);
        let period = MAX_PERIOD as u32;
        assert_eq!([period - 1, period, period + 1].map(|n| n_runs(20, n, 1)), [3, 4, 0]);
        let advances = [MAX_ADVANCE - 1, MAX_ADVANCE, MAX_ADVANCE + 1];
        assert_eq!(advances.map(|n| n_runs(40, 1, n)), [1, 1, 2]);
        let size = BATCH as u32;
        assert_eq!([size - 1, size, size + 1].map(|n| batches(n, 1, 1).len()), [1, 1, 2]);
    }

    #[test]
    fn a_pair_across_a_border_is_in_both_ranges() {
        let pairs: Vec<[u32; 2]> = (0..99).map(|particle| [particle, particle + 1]).collect();
        let mut order = Vec::new();
        for range in [0..40, 40..100] {
            Batches::new(&pairs, range, &mut order);
        }
        order.retain(|number| *number != HOLE);
        order.sort_unstable();
        let twice: Vec<u32> =
            order.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect();
        assert_eq!((order.len(), twice), (100, vec![39]));
    }
}
