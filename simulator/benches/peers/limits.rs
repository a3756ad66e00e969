//! Limits of the processor and its memory, each measured by the plainest loop that reaches it, on one core.

use std::hint::black_box;
use std::time::Instant;

use pulp::Simd;

/// Limits of one core. Times are in ns.
pub(crate) struct Limits {
    /// A square root, among many in vectors.
    pub(crate) root: f64,
    /// A division, likewise.
    pub(crate) division: f64,
    /// Operations a ns: multiplications and additions, fused, in registers.
    pub(crate) peak: f64,
    /// Bytes a ns that are read from an array of so many bytes.
    pub(crate) bandwidths: [(usize, f64); 5],
}

/// The work of a step.
#[derive(Clone, Copy)]
pub(crate) struct Work {
    /// Square roots that cannot be avoided.
    pub(crate) roots: f64,
    /// Cores that share them.
    pub(crate) cores: usize,
    /// Multiplications and additions with a sparse factor.
    pub(crate) operations: f64,
    /// Bytes of the factor that are read.
    pub(crate) bytes: f64,
    /// Bytes of the factor.
    pub(crate) factor: f64,
}

impl Limits {
    /// Measures them, in less than a second.
    pub(crate) fn measure() -> Self {
        let values: Vec<f64> = (0..1024).map(|number| 1.0 + f64::from(number)).collect();
        let mut results = values.clone();
        let arch = pulp::Arch::new();
        let root = least(values.len(), || {
            arch.dispatch(
                #[inline(always)]
                || each(black_box(&values), &mut results, f64::sqrt),
            );
        });
        let division = least(values.len(), || {
            arch.dispatch(
                #[inline(always)]
                || each(black_box(&values), &mut results, f64::recip),
            );
        });
        let operations = arch.dispatch(MultiplyAdd(1));
        let peak = 1.0 / least(operations * ROUNDS, || _ = arch.dispatch(MultiplyAdd(ROUNDS)));
        let bandwidths = [1 << 14, 1 << 20, 1 << 24, 1 << 26, 1 << 28].map(|bytes| {
            let words = vec![1_u64; bytes / 8];
            let read = || {
                arch.dispatch(
                    #[inline(always)]
                    || black_box(&words).iter().fold(0, |sum: u64, word| sum.wrapping_add(*word)),
                )
            };
            (bytes, 1.0 / least(bytes, || _ = black_box(read())))
        });
        Self { root, division, peak, bandwidths }
    }

    /// The least time of this work: its roots, and with the factor the longer of computing and reading.
    pub(crate) fn time(&self, work: &Work) -> f64 {
        let holds = |(bytes, _): &&(usize, f64)| *bytes as f64 >= work.factor;
        let fitting = self.bandwidths.iter().find(holds).unwrap_or(&self.bandwidths[4]);
        let factor = (work.operations / self.peak).max(work.bytes / fitting.1);
        work.roots * self.root / work.cores as f64 + factor
    }
}

#[inline(always)]
fn each(values: &[f64], results: &mut [f64], operation: impl Fn(f64) -> f64) {
    for (result, value) in results.iter_mut().zip(values) {
        *result = operation(*value);
    }
    black_box(results);
}

/// The least time of many runs, divided by what a run handles.
fn least(count: usize, mut run: impl FnMut()) -> f64 {
    let start = Instant::now();
    let (mut best, mut runs) = (f64::INFINITY, 0);
    while runs < 5 || start.elapsed().as_millis() < 100 {
        let start = Instant::now();
        run();
        best = best.min(start.elapsed().as_secs_f64());
        runs += 1;
    }
    best * 1e9 / count as f64
}

/// Rounds that take long enough to be timed.
const ROUNDS: usize = 10_000;

/// Independent sums: more than the processor has under way.
const SUMS: usize = 12;

/// So many rounds of multiplications and additions; the operations of a round.
struct MultiplyAdd(usize);

impl pulp::WithSimd for MultiplyAdd {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let [factor, term] = [black_box(0.5), black_box(1.0)].map(|value| simd.splat_f64s(value));
        let mut sums = [term; SUMS];
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = simd.mul_add_f64s(*sum, factor, term);
            }
        }
        black_box(sums);
        2 * SUMS * S::F64_LANES
    }
}
