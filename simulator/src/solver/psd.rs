//! Projection of a symmetric matrix to a positive semi-definite one.
//!
//! With the eigendecomposition `A = Q Λ Qᵀ`, the projection is `Q f(Λ) Qᵀ`:
//!
//! ```text
//! clamp      f(λ) = max(λ, 0)      the nearest semi-definite matrix in the Frobenius norm (Higham 1988)
//! absolute   f(λ) = |λ|            keeps the size of a negative curvature (Chen et al. 2024)
//! ```
//!
//! The lecture's `make_PD` is the first. Projected element by element, the sum of the elements is
//! semi-definite as well (Teran et al. 2005). A matrix that is semi-definite already is returned as it is, to the bit; most
//! of these are known by their `L D Lᵀ`, without eigenvalues.
//!
//! An element whose energy depends on the differences `d_a = x_a − x_o` of `M` particles from another one, the origin,
//! has the Hessian `B K Bᵀ` by its positions, with `K` that by the differences and `Bᵀ B = I + 1 1ᵀ` for each axis. With
//! `S = (I + 1 1ᵀ)^½`, the columns of `Q = B S⁻¹` are orthonormal, and `B K Bᵀ = Q (S K S) Qᵀ`: the projection of the
//! whole is `B S⁻¹ P(S K S) S⁻¹ Bᵀ`. Of two particles, `S` is a factor, and projecting `K` projects the whole.
//!
//! ```text
//! S = I + (√(M + 1) − 1)/M 1 1ᵀ        S⁻¹ = I + (1/√(M + 1) − 1)/M 1 1ᵀ
//! ```

use nalgebra::SMatrix;

/// The projection of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Projection {
    /// Nothing.
    #[default]
    None,
    /// Negative eigenvalues become zero.
    Clamp,
    /// Negative eigenvalues change their sign.
    Absolute,
}

impl Projection {
    /// The projection of the symmetric `block`, and whether it is another.
    #[inline]
    pub fn project<const D: usize>(self, block: SMatrix<f64, D, D>) -> (SMatrix<f64, D, D>, bool) {
        if self == Self::None {
            return (block, false);
        }
        let (mut projected, mut turned, mut vectors) = (block, block, SMatrix::zeros());
        let [turned, vectors] = [&mut turned, &mut vectors].map(SMatrix::as_mut_slice);
        let changed = self.project_negative(D, projected.as_mut_slice(), turned, vectors);
        (projected, changed)
    }

    /// Projects the whole Hessian of an element of several particles, given by its blocks on local coordinates, row by
    /// row, and says whether it was another. The coordinates are relative to an origin or not. `scratch` is any vector.
    pub fn project_element<const D: usize>(
        self,
        blocks: &mut [SMatrix<f64, D, D>],
        is_relative: bool,
        scratch: &mut Vec<f64>,
    ) -> bool {
        if self == Self::None {
            return false;
        }
        let m = blocks.len().isqrt();
        let root = if is_relative { ((m + 1) as f64).sqrt() } else { 1.0 };
        let n = m * D;
        scratch.clear();
        scratch.resize(3 * n * n, 0.0);
        let (matrix, rest) = scratch.split_at_mut(n * n);
        let (turned, vectors) = rest.split_at_mut(n * n);
        let place = |row: usize, column: usize| {
            let (a, b) = (row / D, column / D);
            (a * m + b, (row % D, column % D))
        };
        let places = || (0..n).flat_map(|column| (0..n).map(move |row| (row, column)));
        for (entry, (row, column)) in matrix.iter_mut().zip(places()) {
            let (block, within) = place(row, column);
            *entry = blocks[block][within];
        }
        scale_mean::<D>(n, matrix, root);
        turned.copy_from_slice(matrix);
        // Compiled for the sizes of triangles and tetrahedra.
        let changed = match n {
            4 => self.project_negative(4, matrix, turned, vectors),
            6 => self.project_negative(6, matrix, turned, vectors),
            9 => self.project_negative(9, matrix, turned, vectors),
            _ => self.project_negative(n, matrix, turned, vectors),
        };
        if !changed {
            return false;
        }
        scale_mean::<D>(n, matrix, 1.0 / root);
        for (entry, (row, column)) in matrix.iter().zip(places()) {
            let (block, within) = place(row, column);
            blocks[block][within] = *entry;
        }
        true
    }

    /// Projects a matrix of `n` rows in place, given a copy of it and room for its eigenvectors.
    #[inline(always)]
    fn project_negative(
        self,
        n: usize,
        matrix: &mut [f64],
        turned: &mut [f64],
        vectors: &mut [f64],
    ) -> bool {
        if is_definite(n, matrix, vectors) {
            return false;
        }
        diagonalise(n, turned, vectors);
        let mut changed = false;
        for number in 0..n {
            let eigenvalue = turned[number * n + number];
            if eigenvalue < 0.0 {
                let change = if self == Self::Clamp { -eigenvalue } else { -2.0 * eigenvalue };
                let vector = &vectors[number * n..][..n];
                for (column, entries) in vector.iter().zip(matrix.chunks_exact_mut(n)) {
                    for (entry, row) in entries.iter_mut().zip(vector) {
                        *entry += row * column * change;
                    }
                }
                changed = true;
            }
        }
        changed
    }
}

/// Multiplies rows and columns of a matrix, stored column by column, by `I + (root − 1)/m 1 1ᵀ` for each of `D` axes.
fn scale_mean<const D: usize>(n: usize, matrix: &mut [f64], root: f64) {
    let m = n / D;
    let factor = (root - 1.0) / m as f64;
    for _ in 0..2 {
        for column in matrix.chunks_exact_mut(n) {
            for axis in 0..D {
                let sum: f64 = column.iter().skip(axis).step_by(D).sum();
                column.iter_mut().skip(axis).step_by(D).for_each(|entry| *entry += factor * sum);
            }
        }
        transpose(n, matrix);
    }
}

/// The part of the trace that eigenvalues must exceed: far above their rounding, which is some `n ε` of it.
const MARGIN: f64 = 1e-12;

/// Whether all eigenvalues of a symmetric matrix are positive beyond rounding: whether `A − τ I` is `L D Lᵀ` with positive
/// `D`. That costs a small part of the eigendecomposition, which would change nothing. `factor` is overwritten.
#[inline(always)]
fn is_definite(n: usize, matrix: &[f64], factor: &mut [f64]) -> bool {
    let margin = MARGIN * (0..n).map(|number| matrix[number * n + number]).sum::<f64>();
    factor.copy_from_slice(matrix);
    for pivot in 0..n {
        let (left, right) = factor.split_at_mut((pivot + 1) * n);
        let below = &left[pivot * n..];
        let reciprocal = 1.0 / (below[pivot] - margin);
        if !(margin > 0.0 && reciprocal > 0.0) {
            return false;
        }
        for (column, entries) in (pivot + 1..n).zip(right.chunks_exact_mut(n)) {
            let multiplier = below[column] * reciprocal;
            for (entry, value) in entries.iter_mut().zip(below).skip(column) {
                *entry -= multiplier * value;
            }
        }
    }
    true
}

/// Sweeps after which a block of a few rows is diagonal: they converge quadratically.
const MAX_SWEEPS: usize = 20;

/// Turns a symmetric matrix of `n` rows into its eigenvalues, on the diagonal, and sets `vectors` to its eigenvectors, as
/// columns, by Jacobi's rotations: exact to rounding for small eigenvalues next to large ones (Demmel and Veselić 1992),
/// and an axis that the block does not couple to the others is left alone to the bit. A library's method for any size
/// would be neither here. Both are stored column by column.
#[inline(always)]
fn diagonalise(n: usize, matrix: &mut [f64], vectors: &mut [f64]) {
    vectors.fill(0.0);
    (0..n).for_each(|number| vectors[number * n + number] = 1.0);
    // Rounding leaves a Hessian not quite symmetric: the triangle that is read, and the side that is turned first, alternate.
    let mut rows_first = false;
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let coupling = if rows_first { matrix[p * n + q] } else { matrix[q * n + p] };
                let (first, second) = (matrix[p * n + p], matrix[q * n + q]);
                if coupling.abs() <= f64::EPSILON * 0.125 * (first.abs() * second.abs()).sqrt()
                    || coupling == 0.0
                {
                    continue;
                }
                rotated = true;
                let theta = (second - first) / (2.0 * coupling);
                let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
                let turn = (cosine, tangent * cosine);
                if rows_first {
                    rotate_rows(n, matrix, p, q, turn);
                }
                rotate_columns(n, matrix, p, q, turn);
                if !rows_first {
                    rotate_rows(n, matrix, p, q, turn);
                }
                rows_first = !rows_first;
                matrix[q * n + p] = 0.0;
                matrix[p * n + q] = 0.0;
                rotate_columns(n, vectors, p, q, turn);
            }
        }
        if !rotated {
            break;
        }
    }
}

/// Turns columns `p` and `q` into each other.
#[inline(always)]
fn rotate_columns(n: usize, matrix: &mut [f64], p: usize, q: usize, (cosine, sine): (f64, f64)) {
    let (left, right) = matrix.split_at_mut(q * n);
    for (first, second) in left[p * n..][..n].iter_mut().zip(&mut right[..n]) {
        (*first, *second) = (cosine * *first - sine * *second, sine * *first + cosine * *second);
    }
}

/// The same of rows.
#[inline(always)]
fn rotate_rows(n: usize, matrix: &mut [f64], p: usize, q: usize, (cosine, sine): (f64, f64)) {
    for column in matrix.chunks_exact_mut(n) {
        let (first, second) = (column[p], column[q]);
        column[p] = cosine * first - sine * second;
        column[q] = sine * first + cosine * second;
    }
}

#[inline(always)]
fn transpose(n: usize, matrix: &mut [f64]) {
    for (row, column) in (0..n).flat_map(|row| (0..row).map(move |column| (row, column))) {
        matrix.swap(column * n + row, row * n + column);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random<const D: usize>(rng: &mut fastrand::Rng) -> SMatrix<f64, D, D> {
        let matrix = SMatrix::<f64, D, D>::from_fn(|_, _| rng.f64() - 0.5);
        matrix + matrix.transpose() + SMatrix::identity() * rng.f64()
    }

    /// For a symmetric `A`, `max(A, 0)` and `|A|` are known by what they do to the quadratic form, and by
    /// their products: `P (P − A) = 0` where `P = max(A, 0)`, `P² = A²` where `P = |A|`.
    fn holds<const D: usize>(rng: &mut fastrand::Rng) {
        let (mut changed, mut kept) = (0, 0);
        for _ in 0..200 {
            let block = random::<D>(rng);
            let (clamped, indefinite) = Projection::Clamp.project(block);
            let (absolute, _) = Projection::Absolute.project(block);
            for projected in [clamped, absolute] {
                assert_eq!(projected, projected.transpose());
                for _ in 0..20 {
                    let v = SMatrix::<f64, D, 1>::from_fn(|_, _| rng.f64() - 0.5);
                    assert!((v.transpose() * projected * v)[0] >= -1e-14);
                }
            }
            if indefinite {
                assert!((clamped * (clamped - block)).amax() < 1e-14, "{block}");
                assert!((absolute * absolute - block * block).amax() < 1e-14, "{block}");
                changed += 1;
            } else {
                assert_eq!([clamped, absolute], [block; 2]);
                kept += 1;
            }
            assert_eq!(Projection::None.project(block), (block, false));
        }
        assert!(changed > 20 && kept > 5, "{changed} {kept}");
    }

    #[test]
    fn a_projection_is_semidefinite_and_the_nearest_of_its_kind() {
        let mut rng = fastrand::Rng::with_seed(9);
        holds::<2>(&mut rng);
        holds::<3>(&mut rng);
    }

    #[test]
    fn a_matrix_is_called_definite_only_where_its_eigenvalues_are_positive() {
        let mut rng = fastrand::Rng::with_seed(4);
        let (mut definite, mut others) = (0, 0);
        for number in 0..2000 {
            // Of rank 5 or 9, and shifted by as little as rounding.
            let factor = SMatrix::<f64, 9, 9>::from_fn(|_, column| {
                if column < 5 + number % 2 * 4 { rng.f64() - 0.5 } else { 0.0 }
            });
            let mut matrix = factor * factor.transpose();
            let size = matrix.trace();
            let shift = size * 0.1_f64.powi(rng.i32(8..20)) * (rng.f64() - 0.3);
            matrix += SMatrix::identity() * shift;
            let (mut turned, mut vectors) = (matrix, SMatrix::<f64, 9, 9>::zeros());
            let is_definite = is_definite(9, matrix.as_slice(), vectors.as_mut_slice());
            diagonalise(9, turned.as_mut_slice(), vectors.as_mut_slice());
            let least = turned.diagonal().min();
            if is_definite {
                assert!(least > 0.0, "{least:e}");
                definite += 1;
            } else {
                assert!(least < 2.0 * MARGIN * size, "{least:e} of {size}");
                others += 1;
            }
        }
        assert!(definite > 500 && others > 500, "{definite} {others}");
    }

    #[test]
    fn zeros_are_semidefinite() {
        let zero = SMatrix::<f64, 3, 3>::zeros();
        assert_eq!(Projection::Clamp.project(zero), (zero, false));
        let flat = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 1.0, 0.0);
        assert!(Projection::Clamp.project(flat).1);
    }
}
