//! Stable steps of an oscillator, by Jury's criterion.
//!
//! With `a = h ω`, and `A` of the [module above](super):
//!
//! ```text
//! explicit     det = 1 − 2ζa + a²  tr = 2 − 2ζa     a ≤ 2ζ  (ζ ≤ 1)     a ≤ 2/(ζ + √(ζ² − 1))  (ζ > 1)
//! symplectic   det = 1 − 2ζa       tr = 2 − 2ζa − a²     4 − 4ζa − a² ≥ 0     a ≤ 2 (√(1 + ζ²) − ζ)
//! implicit     det = 1/(1 + 2ζa + a²), tr = (2 + 2ζa) det            any a
//! fast mass-s. det = (1 − 2ζa)/(1 + a²), tr = (2 − 2ζa)/(1 + a²)     4 − 4ζa + a² ≥ 0:  any a for ζ ≤ 1, and all
//!                                                                    but 2(ζ − √(ζ²−1)) < a < 2(ζ + √(ζ²−1)) above
//! ```
//!
//! Explicit Euler, overdamped: both eigenvalues `1 − a (ζ ± √(ζ²−1))` must be at least −1. Symplectic Euler: the
//! other condition, `ζ a ≤ 1`, follows, as `2ζ(√(1+ζ²) − ζ) = 2ζ/(√(1+ζ²) + ζ) < 1`.

/// The upper end of the interval of stable steps from zero, as `h ω`; 0 if none is stable, infinite if all are.
pub fn limit(method: &str, zeta: f64) -> f64 {
    match method {
        "explicit-euler" if zeta <= 1.0 => 2.0 * zeta,
        "explicit-euler" => 2.0 / (zeta + (zeta * zeta - 1.0).sqrt()),
        "symplectic-euler" => 2.0 / ((1.0 + zeta * zeta).sqrt() + zeta),
        "fast-mass-spring" if zeta > 1.0 => 2.0 / (zeta + (zeta * zeta - 1.0).sqrt()),
        _ => f64::INFINITY,
    }
}

/// The step from which a method is stable again, as `h ω`.
pub fn second_limit(method: &str, zeta: f64) -> Option<f64> {
    let returns = method == "fast-mass-spring" && zeta > 1.0;
    returns.then(|| 2.0 * (zeta + (zeta * zeta - 1.0).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::super::{leading, one_step};
    use super::*;

    #[test]
    fn the_formulas_are_where_the_spectral_radius_of_the_matrix_passes_one() {
        for method in simulator::integrator::REGISTRY.iter().map(|kind| kind.schema.name) {
            for zeta in [0.01, 0.3, 0.99, 1.01, 2.0, 30.0] {
                let radius = |a: f64| leading(one_step(method, a, zeta)).norm();
                let limit = limit(method, zeta);
                let second = second_limit(method, zeta).unwrap_or(f64::INFINITY);
                for a in (-400..=400).map(|e| 10.0_f64.powf(f64::from(e) / 80.0 + 0.001)) {
                    let stable = a < limit || a > second;
                    let radius = radius(a);
                    assert_eq!(radius <= 1.0, stable, "{method} ζ {zeta} a {a}: {radius}");
                }
            }
        }
    }
}
