//! Tetrahedra of the materials of finite elements, by invariants of the deformation.
//!
//! ```text
//! I = tr(D⁻¹C)    A = tr(D N)/det D    J = volume/undeformed volume, with the sign of the orientation
//! St. Venant–Kirchhoff   ψ = μ/4 (I² − 2A − 2I + 3) + λ/8 (I − 3)²
//! corotated              ψ = μ (I − 2s + 3) + λ/2 (s − 3)²       (s² − I)² = 4 A + 8 J s
//! stable neo-Hookean     ψ = m/2 (I − 3 − ln((I + 1)/4)) + l/2 ((J − α)² − (1 − α)²)
//!                        m = 4/3 μ    l = λ + 5/6 μ    α = 1 + m/l − m/(4l)
//! ```
//!
//! `D` are the inner products of the undeformed edges from the first corner, `C` those of the state, `N` those of the cross
//! products of its edges: no `F` is formed, and no derivative. `A` is the sum of the squares of the products of two `σ`. `s`, the largest `tr(RᵀF)` of a rotation `R`, is the largest root: with `σ` the singular values, the smallest one
//! with the sign of `J`, `s` is their sum, and `(s² − I)/2` the sum of their products. All four roots are real, so Newton's
//! method from above falls to it. A step more for each level of dual numbers gives the derivatives.
//!
//! Sources: Sifakis and Barbič (2012), sections 3.3 and 3.4; Smith, de Goes and Kim (2018), sections 3.3 and 3.4.

use num_dual::Dual;

use super::material::{Damping, damping_scale, quadratic_strain_scale};
use super::stencil::{cross, forces_of};
use super::{At, Law, Number, Scale, Symmetry, Vector, difference, dot, named};

/// The laws of this file.
pub(super) static LAWS: &[&Law] = &[&ST_VENANT_KIRCHHOFF, &COROTATED, &NEO_HOOKEAN];

const PARAMETERS: &[&str] = &[
    "youngsmodulus",
    "poissonratio",
    "xb1x",
    "xb1y",
    "xb1z",
    "xb2x",
    "xb2y",
    "xb2z",
    "xb3x",
    "xb3y",
    "xb3z",
    "xb4x",
    "xb4y",
    "xb4z",
    "beta",
];

static ST_VENANT_KIRCHHOFF: Law = Law::of_stencil(
    "stvktetrahedron",
    PARAMETERS,
    Symmetry::Isotropic,
    4,
    (st_venant_kirchhoff, st_venant_kirchhoff),
    st_venant_kirchhoff_scale,
);

static COROTATED: Law = Law::of_stencil(
    "corotatedtetrahedron",
    PARAMETERS,
    Symmetry::Isotropic,
    4,
    (corotated, corotated),
    corotated_scale,
)
.smooth_within(corotated_smooth);

static NEO_HOOKEAN: Law = Law::of_stencil(
    "neohookeantetrahedron",
    PARAMETERS,
    Symmetry::Isotropic,
    4,
    (neo_hookean, neo_hookean),
    neo_hookean_scale,
);

/// The undeformed element.
struct Solid {
    mu: f64,
    lambda: f64,
    /// `V̄`.
    volume: f64,
    /// Six times the volume, with its sign.
    determinant: f64,
    /// `D`.
    products: [Vector<f64>; 3],
    /// `D⁻¹`.
    inverse: [Vector<f64>; 3],
}

/// `I`, `A` and `J`.
struct Invariants<T> {
    i: T,
    areas: T,
    j: T,
}

fn edges<T: Number>(x: &[Vector<T>]) -> [Vector<T>; 3] {
    [1, 2, 3].map(|corner| difference(&x[corner], &x[0]))
}

/// The inner products of vectors with each other.
fn products<T: Number>(of: [Vector<T>; 3]) -> [Vector<T>; 3] {
    of.map(|a| of.map(|b| dot(a, b)))
}

/// The cross products of the other two.
fn crossed<T: Number>([a, b, c]: [Vector<T>; 3]) -> [Vector<T>; 3] {
    [cross(&b, &c), cross(&c, &a), cross(&a, &b)]
}

impl Solid {
    fn new(p: &[f64]) -> Self {
        let [modulus, nu] = named(p);
        let corners: [Vector<f64>; 4] = std::array::from_fn(|corner| named(&p[2 + 3 * corner..]));
        let edges = edges(&corners);
        let determinant = dot(edges[0], cross(&edges[1], &edges[2]));
        let products = products(edges);
        let adjugate = crossed(products);
        Self {
            mu: 0.5 * modulus / (1.0 + nu),
            lambda: modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            volume: determinant.abs() / 6.0,
            determinant,
            products,
            inverse: adjugate.map(|row| row.map(|value| value / (determinant * determinant))),
        }
    }

    fn invariants<T: Number>(&self, x: &[Vector<T>]) -> Invariants<T> {
        let edges = edges(x);
        let normals = crossed(edges);
        // The sum of the products of two matrices' entries.
        let sum = |plain: [Vector<f64>; 3], other: [Vector<T>; 3]| {
            let pairs = plain.as_flattened().iter().zip(other.as_flattened());
            pairs.map(|(plain, other)| *other * *plain).sum::<T>()
        };
        Invariants {
            i: sum(self.inverse, products(edges)),
            areas: sum(self.products, products(normals)) / (self.determinant * self.determinant),
            j: dot(edges[0], normals[0]) / self.determinant,
        }
    }
}

impl<T: Number> Invariants<T> {
    /// `(s² − I)² − 4 A − 8 J s` and its derivative.
    fn quartic(&self, s: T) -> [T; 2] {
        let excess = s * s - self.i;
        let value = excess * excess - self.areas * 4.0 - self.j * s * 8.0;
        [value, s * excess * 4.0 - self.j * 8.0]
    }

    /// `s`.
    fn trace(&self) -> T {
        let plain = Invariants { i: self.i.re(), areas: self.areas.re(), j: self.j.re() };
        let fallen = |s: f64| {
            let [value, slope] = plain.quartic(s);
            s - value / slope
        };
        let mut root = (3.0 * plain.i).sqrt();
        let mut next = fallen(root);
        while next < root {
            (root, next) = (next, fallen(next));
        }
        let mut s = T::from(root);
        for _ in 0..2 {
            let [value, slope] = self.quartic(s);
            s -= value / slope;
        }
        s
    }
}

/// The forces of an energy and of the damping, which is that of the triangles.
fn damped<T: Number>(
    p: &[f64],
    at: &[At<'_, T>],
    energy: impl Fn(&[Vector<Dual<T>>]) -> Dual<T>,
) -> Vec<Vector<T>> {
    let Solid { inverse, mu, lambda, volume, .. } = Solid::new(p);
    let damping = Damping { inverse, mu, lambda, size: p[14] * volume };
    damping.add_to(at, forces_of(at, energy))
}

fn st_venant_kirchhoff<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    damped(p, at, |x| st_venant_kirchhoff_energy(p, x))
}

pub(super) fn st_venant_kirchhoff_energy<T: Number>(p: &[f64], x: &[Vector<T>]) -> T {
    let solid = Solid::new(p);
    let Invariants { i, areas, .. } = solid.invariants(x);
    let growth = i - 3.0;
    let density = (i * i - areas * 2.0 - i * 2.0 + 3.0) * (0.25 * solid.mu)
        + growth * growth * (0.125 * solid.lambda);
    density * solid.volume
}

fn corotated<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    damped(p, at, |x| corotated_energy(p, x))
}

pub(super) fn corotated_energy<T: Number>(p: &[f64], x: &[Vector<T>]) -> T {
    let solid = Solid::new(p);
    let invariants = solid.invariants(x);
    let s = invariants.trace();
    let growth = s - 3.0;
    let density =
        (invariants.i - s * 2.0 + 3.0) * solid.mu + growth * growth * (0.5 * solid.lambda);
    density * solid.volume
}

fn neo_hookean<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    damped(p, at, |x| neo_hookean_energy(p, x))
}

pub(super) fn neo_hookean_energy<T: Number>(p: &[f64], x: &[Vector<T>]) -> T {
    let solid = Solid::new(p);
    let Invariants { i, j, .. } = solid.invariants(x);
    let (m, l) = (4.0 / 3.0 * solid.mu, solid.lambda + 5.0 / 6.0 * solid.mu);
    // Without stiffness, the volume at rest is 0/0.
    let alpha = if l == 0.0 { 1.0 } else { 1.0 + m / l - m / (4.0 * l) };
    let (growth, rest) = (j - alpha, 1.0 - alpha);
    let density = (less_logarithm(i) - 3.0 + 4.0_f64.ln()) * (0.5 * m)
        + (growth * growth - rest * rest) * (0.5 * l);
    density * solid.volume
}

/// `I − ln(I + 1)`, near 0 by its series: the derivatives of both terms cancel there.
fn less_logarithm<T: Number>(i: T) -> T {
    if i.re() > 0.01 {
        return i - (i + 1.0).ln();
    }
    (2..9).map(|n| i.powi(n) * (if n % 2 == 0 { 1.0 } else { -1.0 } / f64::from(n))).sum()
}

/// Sizes that bound the rounding of every material.
struct Sizes {
    /// `2 (|μ| + |λ|) V̄`.
    stiffness: f64,
    /// The largest stretch per length.
    weight: f64,
    /// `√I`.
    stretch: f64,
    /// `s`.
    trace: f64,
    /// The product of the sums of two `σ`.
    gap: f64,
    damping: Scale,
}

fn sizes(p: &[f64], at: &[At<'_, f64>]) -> Sizes {
    let solid = Solid::new(p);
    let positions: Vec<Vector<f64>> = at.iter().map(|at| at.position).collect();
    let invariants = solid.invariants(&positions);
    let trace = invariants.trace();
    let stiffness = 2.0 * (solid.mu.abs() + solid.lambda.abs()) * solid.volume;
    let weight = (0..3).map(|axis| solid.inverse[axis][axis]).sum::<f64>().sqrt();
    let stretch = invariants.i.sqrt();
    Sizes {
        stiffness,
        weight,
        stretch,
        damping: damping_scale(p[14] * stiffness, weight, stretch, at),
        trace,
        gap: invariants.quartic(trace)[1] / 8.0,
    }
}

fn st_venant_kirchhoff_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let Sizes { stiffness, weight, stretch, damping, .. } = sizes(p, at);
    quadratic_strain_scale(stiffness, weight, stretch) + damping
}

fn corotated_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let Sizes { stiffness, weight, stretch, trace, gap, damping } = sizes(p, at);
    // How much less well `s` is known than the invariants.
    let lost = 1.0 + trace.powi(3) / (8.0 * gap.abs());
    let size = 3.0 + stretch;
    Scale {
        energy: stiffness * size * size * lost,
        force: stiffness * weight * size * lost,
        by_position: 4.0 * stiffness * weight * weight * (1.0 + size / trace) * lost * lost,
        by_velocity: 0.0,
    } + damping
}

fn neo_hookean_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let Sizes { stiffness, weight, stretch, damping, .. } = sizes(p, at);
    let squared = stretch * stretch;
    let (volume, hardening) = (1.0 + squared * stretch, squared.min(1.0));
    let bulk = squared * squared + stretch * volume;
    Scale {
        energy: stiffness * (1.0 + squared + volume * volume),
        force: stiffness * weight * stretch * (hardening + stretch * volume),
        by_position: stiffness * weight * weight * (hardening + bulk),
        by_velocity: 0.0,
    } + damping
}

/// The way to the nearest state where two `σ` add up to 0, at least.
fn corotated_smooth(p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let Sizes { weight, stretch, gap, .. } = sizes(p, at);
    gap.abs() / (2.0 * stretch * stretch * weight)
}
