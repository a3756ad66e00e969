//! Local step: the springs' contribution to the gradient at the iterate.
//!
//! ```text
//! d = l0 (x_i − x_j)/l        k (d − (x_i − x_j)) = k (l0 − l)/l (x_i − x_j)        l = |x_i − x_j|
//! ```
//!
//! The second is what a spring adds to `b − Q x` on particle `i`, and takes from it on `j`: the projection `d`
//! itself is never stored. In this form both ends get the same number with opposite signs, and a spring near
//! its rest length no rounding error of the size of `k l0`. Springs are a structure of arrays, eight at a time
//! with one square root and one division each; ends are slots of the elimination order, and springs sorted by
//! them. Cost: one pass over the springs.

use crate::sizes::GROUP;

/// A spring, as the scene has it.
#[derive(Debug, Clone, Copy)]
pub(super) struct ElasticSpring {
    /// Particles, or slots.
    pub(super) ends: [usize; 2],
    pub(super) stiffness: f64,
    pub(super) rest_length: f64,
    /// Number among the scene's forces.
    pub(super) element: usize,
}

/// A spring without a direction.
#[derive(Debug, Default)]
pub(super) struct Undirected {
    /// Number among the scene's forces.
    pub(super) element: usize,
    /// Slots of its particles.
    pub(super) slots: [usize; 2],
}

/// All springs of a scene, in groups; the last is filled up with springs that do nothing.
pub(super) struct SpringGroups {
    ends: Vec<[[u32; 2]; GROUP]>,
    stiffness: Vec<[f64; GROUP]>,
    rest_length: Vec<[f64; GROUP]>,
    elements: Vec<usize>,
}

impl SpringGroups {
    /// The springs, whose ends are slots; `spare` is an unused slot.
    pub(super) fn new(springs: &mut [ElasticSpring], spare: usize) -> Self {
        springs
            .sort_by_key(|spring| (spring.ends.iter().max().copied(), spring.ends, spring.element));
        let n_groups = springs.len().div_ceil(GROUP);
        let mut groups = Self {
            ends: vec![[[spare as u32; 2]; GROUP]; n_groups],
            stiffness: vec![[0.0; GROUP]; n_groups],
            rest_length: vec![[0.0; GROUP]; n_groups],
            elements: springs.iter().map(|spring| spring.element).collect(),
        };
        for (number, spring) in springs.iter().enumerate() {
            let (group, lane) = (number / GROUP, number % GROUP);
            groups.ends[group][lane] = spring.ends.map(|end| end as u32);
            groups.stiffness[group][lane] = spring.stiffness;
            groups.rest_length[group][lane] = spring.rest_length;
        }
        groups
    }

    /// Adds `Σ k Aᵀ (d − A x)` to `right`, and returns the springs' energy `Σ k/2 (l − l0)²` where `ENERGY`
    /// is true.
    ///
    /// # Errors
    /// A spring of length zero that has a rest length, and so no direction.
    pub(super) fn pull<const P: usize, const ENERGY: bool>(
        &self,
        x: &[[f64; P]],
        right: &mut [[f64; P]],
    ) -> Result<f64, Undirected> {
        let mut energy = [0.0; GROUP];
        let mut undefined = false;
        for ((ends, stiffness), rest_length) in
            self.ends.iter().zip(&self.stiffness).zip(&self.rest_length)
        {
            let mut d = [[0.0; GROUP]; P];
            for (lane, [i, j]) in ends.iter().enumerate() {
                let (a, b) = (&x[*i as usize], &x[*j as usize]);
                for axis in 0..P {
                    d[axis][lane] = a[axis] - b[axis];
                }
            }
            let mut factor = [0.0; GROUP];
            for lane in 0..GROUP {
                let mut squared = 0.0;
                for component in &d {
                    squared += component[lane] * component[lane];
                }
                let length = f64::sqrt(squared);
                let shortening = rest_length[lane] - length;
                undefined |= (length == 0.0) & (rest_length[lane] > 0.0);
                // A spring of length zero without a rest length pulls at nothing: 0/tiny.
                let length = if length == 0.0 { f64::MIN_POSITIVE } else { length };
                factor[lane] = stiffness[lane] * shortening / length;
                if ENERGY {
                    energy[lane] += 0.5 * stiffness[lane] * shortening * shortening;
                }
            }
            for (lane, [i, j]) in ends.iter().enumerate() {
                let force: [f64; P] = std::array::from_fn(|axis| factor[lane] * d[axis][lane]);
                let a = &mut right[*i as usize];
                for axis in 0..P {
                    a[axis] += force[axis];
                }
                let b = &mut right[*j as usize];
                for axis in 0..P {
                    b[axis] -= force[axis];
                }
            }
        }
        if undefined {
            return Err(self.find_undefined(x));
        }
        Ok(energy.iter().sum())
    }

    /// The first element of the file that is of length zero, and should not be.
    fn find_undefined<const P: usize>(&self, x: &[[f64; P]]) -> Undirected {
        let ends = self.ends.as_flattened().iter();
        let springs = ends.zip(self.rest_length.as_flattened()).zip(&self.elements);
        let undefined = springs.filter(|(([i, j], rest_length), _)| {
            let (a, b) = (&x[*i as usize], &x[*j as usize]);
            let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
            squared == 0.0 && **rest_length > 0.0
        });
        let first = undefined.min_by_key(|(_, element)| **element);
        first.map_or(Undirected::default(), |((slots, _), element)| Undirected {
            element: *element,
            slots: slots.map(|slot| slot as usize),
        })
    }
}
