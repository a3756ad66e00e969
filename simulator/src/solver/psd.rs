//! Projection of a symmetric block to a positive semi-definite one.
//!
//! With the eigendecomposition `A = Q Λ Qᵀ`, the projection is `Q f(Λ) Qᵀ`:
//!
//! ```text
//! clamp      f(λ) = max(λ, 0)      the nearest semi-definite matrix in the Frobenius norm (Higham 1988)
//! absolute   f(λ) = |λ|            keeps the size of a negative curvature (Chen et al. 2024)
//! ```
//!
//! The lecture's `make_PD` is the first. Projected element by element, the sum of the elements is
//! semi-definite as well (Teran et al. 2005). The Hessian of two particles by their difference is
//! `(H −H; −H H)`, with twice the eigenvalues of `H` and as many zeros: projecting `H` projects it. A
//! block that is semi-definite already is returned as it is, to the bit.

use nalgebra::SMatrix;

/// The projection of a block.
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
        self.project_negative(block)
    }

    fn project_negative<const D: usize>(
        self,
        block: SMatrix<f64, D, D>,
    ) -> (SMatrix<f64, D, D>, bool) {
        let (eigenvalues, vectors) = eigen(block);
        let (mut projected, mut changed) = (block, false);
        for (number, eigenvalue) in eigenvalues.into_iter().enumerate() {
            if eigenvalue < 0.0 {
                let change = if self == Self::Clamp { -eigenvalue } else { -2.0 * eigenvalue };
                let vector = vectors.column(number);
                projected += vector * vector.transpose() * change;
                changed = true;
            }
        }
        (projected, changed)
    }
}

/// Sweeps after which a block of a few rows is diagonal: they converge quadratically.
const MAX_SWEEPS: usize = 20;

/// Eigenvalues and, as columns, eigenvectors of a symmetric block, by Jacobi's rotations: exact to
/// rounding for small eigenvalues beside large ones (Demmel and Veselić 1992), and an axis that the block
/// does not couple to the others is left alone to the bit. A library's method for any size would
/// be neither here.
fn eigen<const D: usize>(mut block: SMatrix<f64, D, D>) -> ([f64; D], SMatrix<f64, D, D>) {
    let mut vectors = SMatrix::identity();
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..D {
            for q in p + 1..D {
                let coupling = block[(p, q)];
                let (first, second) = (block[(p, p)], block[(q, q)]);
                if coupling.abs() <= f64::EPSILON * 0.125 * (first.abs() * second.abs()).sqrt()
                    || coupling == 0.0
                {
                    continue;
                }
                rotated = true;
                let theta = (second - first) / (2.0 * coupling);
                let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
                let sine = tangent * cosine;
                rotate(&mut block, p, q, cosine, sine);
                block = block.transpose();
                rotate(&mut block, p, q, cosine, sine);
                block[(p, q)] = 0.0;
                block[(q, p)] = 0.0;
                rotate(&mut vectors, p, q, cosine, sine);
            }
        }
        if !rotated {
            break;
        }
    }
    (std::array::from_fn(|number| block[(number, number)]), vectors)
}

/// Turns columns `p` and `q` into each other.
fn rotate<const D: usize>(
    matrix: &mut SMatrix<f64, D, D>,
    p: usize,
    q: usize,
    cosine: f64,
    sine: f64,
) {
    for row in 0..D {
        let (first, second) = (matrix[(row, p)], matrix[(row, q)]);
        matrix[(row, p)] = cosine * first - sine * second;
        matrix[(row, q)] = sine * first + cosine * second;
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
    fn zeros_are_semidefinite() {
        let zero = SMatrix::<f64, 3, 3>::zeros();
        assert_eq!(Projection::Clamp.project(zero), (zero, false));
        let flat = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 1.0, 0.0);
        assert!(Projection::Clamp.project(flat).1);
    }
}
