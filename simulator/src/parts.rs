//! The particles of a large scene, divided among threads.
//!
//! A thread has the same particles in every pass over them, so that their numbers stay in the caches of its core.

use std::ops::Range;

use crate::sizes::PARALLEL;
use scene::Scene;

/// Ranges of particles in ascending order, at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Parts(Vec<Range<usize>>);

impl Parts {
    /// All particles of a scene: one range, or one a thread where the scene is large.
    pub(crate) fn of_scene(scene: &Scene) -> Self {
        let is_small = scene.forces.len() < PARALLEL;
        Self::new(scene.particles.len(), if is_small { 1 } else { rayon::current_num_threads() })
    }

    /// So many ranges of nearly the same size.
    pub(crate) fn new(n_particles: usize, n_parts: usize) -> Self {
        let border = |part: usize| part * n_particles / n_parts;
        Self((0..n_parts).map(|part| border(part)..border(part + 1)).collect())
    }

    /// The ranges.
    pub(crate) fn ranges(&self) -> &[Range<usize>] {
        &self.0
    }

    /// Does work on each range, at the same time, and merges the results. It is given the range's share of each of the
    /// slices, which hold `width` numbers a particle.
    pub(crate) fn map<const N: usize, R: Send>(
        &self,
        width: usize,
        slices: [&mut [f64]; N],
        work: impl Fn(Range<usize>, [&mut [f64]; N]) -> R + Sync,
        merge: impl Fn(R, R) -> R + Sync,
    ) -> R {
        map(&self.0, width, slices, &work, &merge)
    }
}

fn map<const N: usize, R: Send>(
    ranges: &[Range<usize>],
    width: usize,
    mut slices: [&mut [f64]; N],
    work: &(impl Fn(Range<usize>, [&mut [f64]; N]) -> R + Sync),
    merge: &(impl Fn(R, R) -> R + Sync),
) -> R {
    if let [range] = ranges {
        return work(range.clone(), slices);
    }
    let (first, second) = ranges.split_at(ranges.len() / 2);
    let border = (second[0].start - first[0].start) * width;
    let of_first = slices.each_mut().map(|slice| {
        let (of_first, rest) = std::mem::take(slice).split_at_mut(border);
        *slice = rest;
        of_first
    });
    let (first, second) = rayon::join(
        || map(first, width, of_first, work, merge),
        || map(second, width, slices, work, merge),
    );
    merge(first, second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_split_numbers_evenly() {
        for n_parts in [1, 2, 3, 7, 20] {
            let parts = Parts::new(11, n_parts);
            let (mut a, mut b) = ([0.0; 22], [0.0; 22]);
            let work = |range: Range<usize>, [a, b]: [&mut [f64]; 2]| {
                assert_eq!((a.len(), b.len()), (2 * range.len(), 2 * range.len()));
                for (place, number) in a.iter_mut().enumerate() {
                    *number = (2 * range.start + place) as f64;
                }
                b.fill(range.len() as f64);
                range.len()
            };
            assert_eq!(parts.map(2, [&mut a, &mut b], work, |left, right| left + right), 11);
            assert!(a.iter().enumerate().all(|(place, number)| *number == place as f64));
            assert!(parts.ranges().len() == n_parts && b.iter().all(|count| *count >= 1.0));
        }
    }
}
