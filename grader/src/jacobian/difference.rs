//! Central differences of fourth order.

use nalgebra::DMatrix;

/// Distance of the samples. Rounding adds about `ε/δ`, truncation `δ⁴`; for forces that vary over a
/// length of 1 the two meet near this power of two, which makes `x ± δ` exact more often.
const DELTA: f64 = 1.0 / 1024.0;

/// The Jacobian of `function`, which fills a vector as long as its argument, at `x`.
pub(super) fn difference(x: &[f64], function: impl Fn(&[f64], &mut [f64])) -> DMatrix<f64> {
    let size = x.len();
    let mut jacobian = DMatrix::zeros(size, size);
    let mut moved = x.to_vec();
    let mut samples = [vec![0.0; size], vec![0.0; size], vec![0.0; size], vec![0.0; size]];
    for column in 0..size {
        for (sample, steps) in samples.iter_mut().zip([-2.0, -1.0, 1.0, 2.0]) {
            moved[column] = x[column] + steps * DELTA;
            function(&moved, sample);
        }
        moved[column] = x[column];
        let [far_below, below, above, far_above] = &samples;
        for row in 0..size {
            let near = above[row] - below[row];
            let far = far_above[row] - far_below[row];
            jacobian[(row, column)] = (8.0 * near - far) / (12.0 * DELTA);
        }
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_fourth_degree_are_differentiated_exactly() {
        let jacobian = difference(&[2.0, -1.0], |x, values| {
            values[0] = x[0].powi(4) + 3.0 * x[1];
            values[1] = x[0] * x[1];
        });
        let expected = DMatrix::from_row_slice(2, 2, &[32.0, 3.0, -1.0, 2.0]);
        assert!((jacobian - expected).amax() < 1e-11);
    }
}
