//! Recorded choices: everything random in a drawn scene is a choice among finitely many.
//!
//! ```text
//! scene = draw(c₀ c₁ c₂ …)       c: at each choice among n, the planned number modulo n; beyond the plan a random one, or 0
//! ```
//!
//! Any sequence of numbers draws a valid scene. So a change of some numbers is another scene, of which the rest stays
//! (MacIver and Donaldson, *Test-case reduction via test-case generation*, ECOOP 2020), and the bytes of a coverage-guided
//! fuzzer are a scene. Choice 0 is the simplest everywhere.

use std::time::Instant;

use fastrand::Rng;
use rayon::prelude::*;

use crate::shrink::Effort;

/// Bits of a number between 0 and 1.
const BITS: u32 = 53;

/// A sequence of choices that is being made.
#[derive(Debug, Clone)]
pub struct Choices {
    planned: Vec<u64>,
    made: Vec<u64>,
    /// Makes the choices beyond the plan; without it they are 0.
    random: Option<Rng>,
}

impl Choices {
    /// Random choices.
    pub fn random(seed: u64) -> Self {
        Self { planned: Vec::new(), made: Vec::new(), random: Some(Rng::with_seed(seed)) }
    }

    /// These choices, and random ones after them.
    pub fn from(planned: Vec<u64>, seed: u64) -> Self {
        Self { planned, made: Vec::new(), random: Some(Rng::with_seed(seed)) }
    }

    /// These choices, and the simplest after them.
    pub fn replayed(planned: Vec<u64>) -> Self {
        Self { planned, made: Vec::new(), random: None }
    }

    /// Two bytes a choice, and the simplest after them.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let choice = |pair: &[u8]| pair.iter().fold(0, |sum, byte| 256 * sum + u64::from(*byte));
        Self::replayed(bytes.chunks(2).map(choice).collect())
    }

    /// The choices made so far.
    pub fn into_made(self) -> Vec<u64> {
        self.made
    }

    /// A number below `n`, which is at least 1.
    pub fn below(&mut self, n: usize) -> usize {
        self.choose(n.max(1) as u64) as usize
    }

    fn choose(&mut self, n: u64) -> u64 {
        let choice = match (self.planned.get(self.made.len()), &mut self.random) {
            (Some(planned), _) => planned % n,
            (None, Some(random)) => random.u64(0..n),
            (None, None) => 0,
        };
        self.made.push(choice);
        choice
    }

    /// One of these.
    ///
    /// # Panics
    /// If the list is empty.
    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    /// Whether an event of a chance of `share` in 16 happens.
    pub fn chance(&mut self, share: usize) -> bool {
        // The simplest choice is that it does not.
        self.below(16) >= 16 - share
    }

    /// A number from 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        self.choose(1 << BITS) as f64 / (1_u64 << BITS) as f64
    }

    /// Permutes a list.
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        for place in (1..list.len()).rev() {
            // The simplest choice leaves everything in its place.
            let other = place - self.below(place + 1);
            list.swap(place, other);
        }
    }
}

/// Makes as many choices as possible the simplest, while `fails`: halves of them, then quarters, down to single ones. `fails`
/// returns the choices that were made, and what they drew. The second value counts its calls.
///
/// Cost: up to four calls a choice, as many at a time as there are threads.
pub fn simplest<T: Send>(
    choices: &[u64],
    fails: &(dyn Fn(Vec<u64>) -> Option<(Vec<u64>, T)> + Sync),
    effort: Effort,
) -> (Option<T>, usize) {
    let (start, mut runs) = (Instant::now(), 0);
    let weight = |choices: &[u64]| choices.iter().filter(|choice| **choice != 0).count();
    let (mut best, mut found) = (choices.to_vec(), None);
    let mut size = best.len();
    while size > 0 {
        let is_plain =
            |start: &usize| best.iter().skip(*start).take(size).all(|choice| *choice == 0);
        let starts: Vec<usize> =
            (0..best.len()).step_by(size).filter(|start| !is_plain(start)).collect();
        let mut is_simpler = false;
        for some in starts.chunks(rayon::current_num_threads().max(1)) {
            if runs >= effort.runs || start.elapsed() >= effort.time {
                return (found, runs);
            }
            let simpler = some.par_iter().find_map_first(|start| {
                let mut other = best.clone();
                other.iter_mut().skip(*start).take(size).for_each(|choice| *choice = 0);
                let (made, drawn) = fails(other)?;
                (weight(&made) < weight(&best)).then_some((made, drawn))
            });
            runs += some.len();
            if let Some((made, drawn)) = simpler {
                (best, found) = (made, Some(drawn));
                is_simpler = true;
            }
        }
        if !is_simpler {
            size = if size == 1 { 0 } else { size.div_ceil(2) };
        }
    }
    (found, runs)
}

/// The choices with some of them changed, or their end cut off, which is then drawn again.
pub fn mutated(choices: &[u64], random: &mut Rng) -> Vec<u64> {
    let mut other = choices.to_vec();
    if other.is_empty() {
        return other;
    }
    match random.u8(0..4) {
        0 => other.truncate(random.usize(0..other.len())),
        _ => {
            for _ in 0..random.usize(1..4) {
                let place = random.usize(0..other.len());
                other[place] = random.u64(..);
            }
        }
    }
    other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_that_were_made_are_made_again() {
        let make = |mut choices: Choices| {
            let mut list: Vec<usize> = (0..9).collect();
            let made = (choices.below(5), choices.unit(), choices.chance(8));
            choices.shuffle(&mut list);
            (made, list, choices.into_made())
        };
        let (first, list, made) = make(Choices::random(3));
        assert_eq!(make(Choices::replayed(made.clone())), (first, list, made));
        let (plain, list, _) = make(Choices::of_bytes(&[]));
        assert_eq!((plain, list), ((0, 0.0, false), (0..9).collect()));
    }

    #[test]
    fn the_choices_that_matter_are_left() {
        let fails = |planned: Vec<u64>| {
            let mut choices = Choices::replayed(planned);
            let list: Vec<usize> = (0..200).map(|_| choices.below(50)).collect();
            (list[7] > 20 && list[160] == 3).then(|| (choices.into_made(), list))
        };
        let mut random = Rng::with_seed(5);
        let mut planned: Vec<u64> = (0..200).map(|_| random.u64(0..50)).collect();
        (planned[7], planned[160]) = (33, 3);
        let (found, runs) = simplest(&planned, &fails, Effort::default());
        let found = found.unwrap();
        assert_eq!((found[7], found[160], found.iter().sum()), (33, 3, 36));
        assert!(runs < 100, "{runs}");
    }
}
