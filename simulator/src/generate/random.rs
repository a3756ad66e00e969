//! Pseudo-random numbers, reproducible for a seed across versions.
//!
//! SplitMix64 (Steele, Lea, Flood 2014, figure 17). A crate's generator may change with its version,
//! and a seed that stands in a course's exercise would then mean another scene.

/// A sequence of numbers, its state.
pub(super) struct Random(pub(super) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From -1 to 1, uniformly.
    pub(super) fn signed(&mut self) -> f64 {
        // The upper 53 bits: a multiple of 2^-52 from 0 up to 2.
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A point of the unit disc or, with three axes, of the unit ball, uniformly.
    pub(super) fn in_ball(&mut self, axes: usize) -> [f64; 3] {
        loop {
            let mut point = [0.0; 3];
            for coordinate in &mut point[..axes] {
                *coordinate = self.signed();
            }
            if point.iter().map(|x| x * x).sum::<f64>() <= 1.0 {
                return point;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn the_sequence_is_the_published_one() {
        let mut random = Random(1_234_567);
        let expected: [u64; 3] =
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([(); 3].map(|()| random.next()), expected);
    }
}
