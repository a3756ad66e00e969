//! Stability of methods, by theory and by measurement.
//!
//! The oscillator `x'' = −ω² x − 2 ζ ω v`, with `z = (x, v/ω)` and `a = h ω`, is stepped by `z ← A z`:
//!
//! ```text
//! explicit                      A = [ 1             a         ]
//!                                   [ −a            1 − 2ζa   ]
//! symplectic                    A = [ 1 − a²        a(1−2ζa)  ]
//!                                   [ −a            1 − 2ζa   ]
//! implicit, linearized          A = [ 1 + 2ζa       a         ]
//! and projected Newton              [ −a            1         ] / (1 + 2ζa + a²)
//! fast mass-spring              A = [ 1             a(1−2ζa)  ]
//! (damping taken explicitly)        [ −a            1 − 2ζa   ] / (1 + a²)
//! ```
//!
//! The linearized method evaluates at `x + h v` with the Jacobians there: for a linear force that is implicit Euler.
//! A method is stable if the spectral radius of `A` is at most 1, which for 2 × 2 matrices is Jury's criterion
//! `|det A| ≤ 1`, `|tr A| ≤ 1 + det A` ([`limits`]). The matrix of a scene is measured from single steps of the
//! simulator ([`measured`]), independent of its code.

pub mod amplification;
pub mod boundary;
pub mod limits;
pub mod map;
pub mod measured;

use nalgebra::{Complex, Matrix2};

/// `A` of the method, for `a = h ω` and the damping ratio `ζ`; the identity for a method that there is no theory of.
pub fn one_step(method: &str, a: f64, zeta: f64) -> [[f64; 2]; 2] {
    let kept = 1.0 - 2.0 * zeta * a;
    match method {
        "explicit-euler" => [[1.0, a], [-a, kept]],
        "symplectic-euler" => [[1.0 - a * a, a * kept], [-a, kept]],
        "linearized-implicit-euler" | "implicit-euler" | "projected-newton" => {
            let d = 1.0 + 2.0 * zeta * a + a * a;
            [[(1.0 + 2.0 * zeta * a) / d, a / d], [-a / d, 1.0 / d]]
        }
        "fast-mass-spring" => {
            let d = 1.0 + a * a;
            [[1.0 / d, a * kept / d], [-a / d, kept / d]]
        }
        _ => [[1.0, 0.0], [0.0, 1.0]],
    }
}

/// The eigenvalue of largest modulus; of a conjugate pair, the one with positive imaginary part.
pub fn leading(matrix: [[f64; 2]; 2]) -> Complex<f64> {
    let [[p, q], [r, s]] = matrix;
    let eigenvalues = Matrix2::new(p, q, r, s).complex_eigenvalues();
    let (first, second) = (eigenvalues[0], eigenvalues[1]);
    let larger = if first.norm() >= second.norm() { first } else { second };
    if larger.im < 0.0 { larger.conj() } else { larger }
}
