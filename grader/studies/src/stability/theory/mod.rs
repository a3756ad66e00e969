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
//! two-step                      A = [ (1 + c) B     −c B      ]    of this z and the one before, with B that of implicit
//!                                   [ 1              0        ]    Euler at (1 − c) a; BDF2: c = 1/3
//! ```
//!
//! The linearized method evaluates at `x + h v` with the Jacobians there: for a linear force that is implicit Euler.
//! A method is stable if the spectral radius of `A` is at most 1, which for 2 × 2 matrices is Jury's criterion
//! `|det A| ≤ 1`, `|tr A| ≤ 1 + det A`. The matrix of a scene is measured from single steps of the
//! simulator ([`measured`]), independent of its code.

pub mod amplification;
pub mod boundary;
pub mod map;
pub mod measured;

use nalgebra::{Complex, DMatrix};

/// The eigenvalue of the largest modulus; of a pair, the one with the positive imaginary part.
pub fn leading(matrix: &DMatrix<f64>) -> Complex<f64> {
    let eigenvalues = matrix.complex_eigenvalues();
    let larger = |a: Complex<f64>, b: &Complex<f64>| if a.norm() >= b.norm() { a } else { *b };
    let largest = eigenvalues.iter().fold(Complex::default(), larger);
    if largest.im < 0.0 { largest.conj() } else { largest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::reference::method::{Method, stable_steps};
    use measured::Linear;

    #[test]
    fn measured_step_matrix_matches_the_method() {
        for kind in simulator::integrator::REGISTRY {
            let name = kind.schema.name;
            for (zeta, a) in [(0.0, 0.1), (0.1, 1.0), (1.0, 0.5), (1.0, 10.0)] {
                let scene = Linear::oscillator(zeta);
                if !scene.is_taken_by(&kind.schema) {
                    continue;
                }
                let measured = scene.matrix(&kind.schema, a).unwrap();
                let theory = Method::of(kind.schema.equation).oscillator(a, zeta);
                assert_eq!(measured.shape(), theory.shape(), "{name}");
                let off = (measured - &theory).amax() / theory.amax();
                assert!(off < 1e-13, "{name}, ζ = {zeta}, h ω = {a}: {off:e}");
            }
        }
    }

    #[test]
    fn the_stable_steps_end_where_the_spectral_radius_of_the_matrix_passes_one() {
        for kind in simulator::integrator::REGISTRY {
            let (name, equation) = (kind.schema.name, kind.schema.equation);
            for zeta in [0.01, 0.3, 0.99, 1.01, 2.0, 30.0] {
                let radius = |a: f64| leading(&Method::of(equation).oscillator(a, zeta)).norm();
                let [limit, second] = stable_steps(equation, zeta);
                for a in (-400..=400).map(|e| 10.0_f64.powf(f64::from(e) / 80.0 + 0.001)) {
                    let stable = a < limit || a > second;
                    let radius = radius(a);
                    assert_eq!(radius <= 1.0, stable, "{name} ζ {zeta} a {a}: {radius}");
                }
            }
        }
    }
}
