//! Reciprocals of vectors, correctly rounded, without the divider where the processor has a faster way.
//!
//! A spring needs a square root and a division. Both occupy the same unit of the processor, which works on nothing else
//! for some 17 cycles per four springs. Where the processor estimates reciprocals of eight numbers at once (AVX-512), the
//! division is done by multiplications instead, while that unit extracts roots: with `y` the estimate of `1/b`, of a
//! relative error of at most 2⁻¹⁴,
//!
//! ```text
//! e = 1 − b y,   y ← y + e y       three times, each line rounded once (fused)
//! ```
//!
//! Its bits are those of the division. The exact `y + e y` is `1/b − b δ²`, where `δ` is the error of `y`: after two rounds,
//! less than 0.63 units in the last place. With `b = B 2⁻⁵²` in [1, 2), the third round is rounded to another number than
//! `1/b` only if the midpoint `M 2⁻⁵⁴` of two numbers is between the two: `0 < 2¹⁰⁶ − B M ≤ 2¹⁰⁶ (b δ)² < 1.6`, hence
//! `B M = 2¹⁰⁶ − 1`. The only divisor of this number in [2⁵², 2⁵³) is `2⁵³ − 1`: all bits are set, and the third `e`
//! is 2⁻⁵³, or the result is right. Such vectors are marked, and those of which a reciprocal is no normal number. Source: P. Markstein,
//! Computation of elementary functions on the IBM RISC System/6000 processor, IBM J. Res. Dev. 34 (1990).

use pulp::Simd;

/// `1/b` of each lane, with the bits of the division where `exact` stays set, for `b ≥ 0`. There, the reciprocal is a
/// finite number.
#[inline(always)]
pub(super) fn reciprocal<S: Simd>(simd: S, b: S::f64s, exact: &mut S::m64s) -> S::f64s {
    let one = simd.splat_f64s(1.0);
    let Some(estimate) = estimate(simd, b) else {
        let reciprocal = simd.div_f64s(one, b);
        let finite = simd.less_than_f64s(reciprocal, simd.splat_f64s(f64::INFINITY));
        *exact = simd.and_m64s(*exact, finite);
        return reciprocal;
    };
    let minus_b = simd.neg_f64s(b);
    let residual = |y| simd.mul_add_f64s(minus_b, y, one);
    let once = simd.mul_add_f64s(residual(estimate), estimate, estimate);
    let twice = simd.mul_add_f64s(residual(once), once, once);
    let last = residual(twice);
    let reciprocal = simd.mul_add_f64s(last, twice, twice);
    let normal = simd.greater_than_or_equal_f64s(reciprocal, simd.splat_f64s(f64::MIN_POSITIVE));
    let all_bits_set = simd.equal_f64s(last, simd.splat_f64s(0.5 * f64::EPSILON));
    *exact = simd.and_m64s(*exact, simd.and_m64s(normal, simd.not_m64s(all_bits_set)));
    reciprocal
}

/// Estimates of the reciprocals, on processors that have them.
#[cfg(not(target_arch = "x86_64"))]
fn estimate<S: Simd>(_simd: S, _b: S::f64s) -> Option<S::f64s> {
    None
}

/// Estimates of the reciprocals, on processors that have them.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn estimate<S: Simd>(simd: S, b: S::f64s) -> Option<S::f64s> {
    if let Some(simd) = (&simd as &dyn std::any::Any).downcast_ref::<pulp::x86::V4>() {
        let estimate = simd.avx512f._mm512_rcp14_pd(pulp::bytemuck::cast(b));
        return Some(pulp::bytemuck::cast(estimate));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Check([f64; 8]);

    impl pulp::WithSimd for Check {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            for b in S::as_simd_f64s(&self.0).0 {
                let mut exact = simd.equal_f64s(simd.splat_f64s(0.0), simd.splat_f64s(0.0));
                let reciprocal = reciprocal(simd, *b, &mut exact);
                let lanes: &[f64] = pulp::bytemuck::cast_slice(std::slice::from_ref(b));
                let divided = lanes.iter().map(|b| (1.0 / b).to_bits());
                if simd.first_true_m64s(simd.not_m64s(exact)) < S::F64_LANES {
                    let exotic = |b: &f64| !(1.0 / b).is_normal() || b.to_bits() << 12 == !0 << 12;
                    assert!(lanes.iter().any(exotic), "{lanes:?}");
                    continue;
                }
                let bits: &[u64] = pulp::bytemuck::cast_slice(std::slice::from_ref(&reciprocal));
                assert!(divided.eq(bits.iter().copied()), "{lanes:?}");
                assert!(lanes.iter().all(|b| (1.0 / b).is_finite()), "{lanes:?}");
            }
        }
    }

    #[test]
    fn reciprocals_have_the_bits_of_divisions() {
        let mut rng = fastrand::Rng::with_seed(1);
        let arch = pulp::Arch::new();
        for _ in 0..200_000 {
            arch.dispatch(Check(std::array::from_fn(|_| f64::from_bits(rng.u64(..) >> 1))));
            arch.dispatch(Check(std::array::from_fn(|_| 1.0 + rng.f64())));
        }
        let below = |value: f64| f64::from_bits(value.to_bits() - 1);
        for value in [0.0, f64::MIN_POSITIVE, 5e-324, 1e-310, f64::MAX, f64::INFINITY, f64::NAN] {
            let mut values = [value; 8];
            arch.dispatch(Check(values));
            values[3] = 1.0;
            arch.dispatch(Check(values));
        }
        // All bits of the significand are set.
        for exponent in -1021..1023 {
            let power = f64::from_bits((exponent + 1023_i64) as u64 * (1 << 52));
            arch.dispatch(Check(std::array::from_fn(|_| below(power))));
            arch.dispatch(Check(std::array::from_fn(|lane| [power, below(power)][lane % 2])));
        }
    }
}
