//! Triangles of the materials of finite elements, by invariants of the deformation.
//!
//! ```text
//! I = tr(D⁻¹C)    J = area/undeformed area, with the sign of the orientation in the plane
//! St. Venant–Kirchhoff   ψ = μ/4 (I² − 2J² − 2I + 2) + λ/8 (I − 2)²      ‖FᵀF‖² = I² − 2J²
//! corotated              ψ = μ (I − 2s + 2) + λ/2 (s − 2)²                s² = I + 2J
//! stable neo-Hookean     ψ = μ/2 (I − 2J) + (λ + μ)/2 (J − 1)²
//! Rayleigh's damping   R = β (μ/4 tr((D⁻¹C')²) + λ/8 (tr D⁻¹C')²)         f = −∂R/∂v, with C' the rate of C
//! ```
//!
//! `D` and `C` are as for the triangle in `stencil.rs`: no `F` is formed, and no derivative. `s` is the sum of the singular
//! values. Sources: Sifakis and Barbič (2012), sections 3.3 and 3.4; Smith, de Goes and Kim (2018), section 3, with `λ`
//! such that small strains meet Lamé's parameters of plane stress.

use num_dual::Dual;

use super::stencil::{TRIANGLE_PARAMETERS, Undeformed, cross, forces_of, undeformed};
use super::{At, Law, Number, Scale, Symmetry, Vector, difference, dot, norm};

/// The laws of this file.
pub(super) static LAWS: &[&Law] = &[&ST_VENANT_KIRCHHOFF, &COROTATED, &NEO_HOOKEAN];

const PARAMETERS: &[&str] = &{
    let mut all = ["beta"; 12];
    let mut place = 0;
    while place < TRIANGLE_PARAMETERS.len() {
        all[place] = TRIANGLE_PARAMETERS[place];
        place += 1;
    }
    all
};

static ST_VENANT_KIRCHHOFF: Law = Law::of_stencil(
    "stvktriangle",
    PARAMETERS,
    Symmetry::Isotropic,
    3,
    (st_venant_kirchhoff, st_venant_kirchhoff),
    st_venant_kirchhoff_scale,
);

static COROTATED: Law = Law::of_stencil(
    "corotatedtriangle",
    PARAMETERS,
    Symmetry::Isotropic,
    3,
    (corotated, corotated),
    corotated_scale,
)
.smooth_within(corotated_smooth);

static NEO_HOOKEAN: Law = Law::of_stencil(
    "neohookeantriangle",
    PARAMETERS,
    Symmetry::Isotropic,
    3,
    (neo_hookean, neo_hookean),
    neo_hookean_scale,
)
.smooth_within(neo_hookean_smooth);

/// An element with Lamé's parameters.
struct Solid {
    of: Undeformed,
    mu: f64,
    lambda: f64,
}

impl Solid {
    fn new<T>(p: &[f64], at: &[At<'_, T>]) -> Self {
        let of = undeformed(p, at[0].dimension);
        let Undeformed { modulus, nu, .. } = of;
        Self { mu: 0.5 * modulus / (1.0 + nu), lambda: modulus * nu / (1.0 - nu * nu), of }
    }

    /// `I`.
    fn squared_stretch<T: Number>(&self, x: &[Vector<T>]) -> T {
        let [[uu, uv], [_, vv]] = self.of.inverse;
        let (u, v) = (difference(&x[1], &x[0]), difference(&x[2], &x[0]));
        dot(u, u) * uu + dot(u, v) * (2.0 * uv) + dot(v, v) * vv
    }

    /// `J²`.
    fn squared_area<T: Number>(&self, x: &[Vector<T>]) -> T {
        let normal = cross(&difference(&x[1], &x[0]), &difference(&x[2], &x[0]));
        dot(normal, normal) * (1.0 / dot(self.of.normal, self.of.normal))
    }

    /// `J`.
    fn area<T: Number>(&self, x: &[Vector<T>], dimension: usize) -> T {
        if dimension == 3 {
            return self.squared_area(x).sqrt();
        }
        let normal = cross(&difference(&x[1], &x[0]), &difference(&x[2], &x[0]));
        normal[2] * (1.0 / self.of.normal[2])
    }
}

/// The forces of an energy and of the damping.
fn damped<T: Number>(
    p: &[f64],
    at: &[At<'_, T>],
    energy: impl Fn(&[Vector<Dual<T>>]) -> Dual<T>,
) -> Vec<Vector<T>> {
    let Solid { of, mu, lambda } = Solid::new(p, at);
    let damping = Damping { inverse: of.inverse, mu, lambda, size: p[11] * of.area };
    damping.add_to(at, forces_of(at, energy))
}

/// Rayleigh's damping of an element with `N + 1` corners.
pub(super) struct Damping<const N: usize> {
    /// `D⁻¹`.
    pub(super) inverse: [[f64; N]; N],
    pub(super) mu: f64,
    pub(super) lambda: f64,
    /// `β` times the area or the volume.
    pub(super) size: f64,
}

impl<const N: usize> Damping<N> {
    /// `R`.
    fn dissipation<T: Number>(&self, x: &[Vector<T>], v: &[Vector<T>]) -> T {
        let edges = |of: &[Vector<T>]| -> [Vector<T>; N] {
            std::array::from_fn(|corner| difference(&of[corner + 1], &of[0]))
        };
        let (x, v) = (edges(x), edges(v));
        let rate = |a: usize, b: usize| dot(x[a], v[b]) + dot(v[a], x[b]);
        let strain = |a: usize, b: usize| -> T {
            (0..N).map(|inner| rate(inner, b) * self.inverse[a][inner]).sum()
        };
        let strain: [[T; N]; N] = std::array::from_fn(|a| std::array::from_fn(|b| strain(a, b)));
        let trace: T = (0..N).map(|a| strain[a][a]).sum();
        let pairs = (0..N).flat_map(|a| (0..N).map(move |b| (a, b)));
        let squared: T = pairs.map(|(a, b)| strain[a][b] * strain[b][a]).sum();
        (squared * (0.25 * self.mu) + trace * trace * (0.125 * self.lambda)) * self.size
    }

    /// Adds its forces.
    pub(super) fn add_to<T: Number>(
        &self,
        at: &[At<'_, T>],
        mut forces: Vec<Vector<T>>,
    ) -> Vec<Vector<T>> {
        if self.size == 0.0 {
            return forces;
        }
        let constant = |re: T| Dual::new(re, T::from(0.0));
        let x: Vec<_> = at.iter().map(|at| at.position.map(constant)).collect();
        let v: Vec<_> = at.iter().map(|at| at.velocity.map(constant)).collect();
        for (particle, force) in forces.iter_mut().enumerate() {
            for (axis, component) in force.iter_mut().enumerate() {
                let mut moved = v.clone();
                moved[particle][axis].eps = T::from(1.0);
                *component -= self.dissipation(&x, &moved).eps;
            }
        }
        forces
    }
}

/// The scale of damping, by the largest stretch and that per length.
pub(super) fn damping_scale(
    stiffness: f64,
    weight: f64,
    stretch: f64,
    at: &[At<'_, f64>],
) -> Scale {
    let speed: f64 = at.iter().map(|at| norm(&at.velocity)).sum();
    let by_velocity = 4.0 * stiffness * weight * weight * stretch * stretch;
    Scale {
        energy: 0.0,
        force: by_velocity * speed,
        by_position: 3.0 * by_velocity * weight * speed / stretch,
        by_velocity,
    }
}

fn st_venant_kirchhoff<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    damped(p, at, |x| st_venant_kirchhoff_energy(p, at, x))
}

pub(super) fn st_venant_kirchhoff_energy<A, T: Number>(
    p: &[f64],
    at: &[At<'_, A>],
    x: &[Vector<T>],
) -> T {
    let solid = Solid::new(p, at);
    let (i, growth) = (solid.squared_stretch(x), solid.squared_stretch(x) - 2.0);
    let density = (i * growth - solid.squared_area(x) * 2.0 + 2.0) * (0.25 * solid.mu)
        + growth * growth * (0.125 * solid.lambda);
    density * solid.of.area
}

fn corotated<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    damped(p, at, |x| corotated_energy(p, at, x))
}

pub(super) fn corotated_energy<A, T: Number>(p: &[f64], at: &[At<'_, A>], x: &[Vector<T>]) -> T {
    let solid = Solid::new(p, at);
    let i = solid.squared_stretch(x);
    let s = (i + solid.area(x, at[0].dimension) * 2.0).sqrt();
    let density = (i - s * 2.0 + 2.0) * solid.mu + (s - 2.0) * (s - 2.0) * (0.5 * solid.lambda);
    density * solid.of.area
}

fn neo_hookean<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    damped(p, at, |x| neo_hookean_energy(p, at, x))
}

pub(super) fn neo_hookean_energy<A, T: Number>(p: &[f64], at: &[At<'_, A>], x: &[Vector<T>]) -> T {
    let solid = Solid::new(p, at);
    let j = solid.area(x, at[0].dimension);
    let density = (solid.squared_stretch(x) - j * 2.0) * (0.5 * solid.mu)
        + (j - 1.0) * (j - 1.0) * (0.5 * (solid.lambda + solid.mu));
    density * solid.of.area
}

/// Sizes that bound the rounding of every material.
struct Sizes {
    /// `(|μ| + |λ|) Ā`.
    stiffness: f64,
    /// The largest stretch per length.
    weight: f64,
    /// `√I`.
    stretch: f64,
    /// `|J|`.
    area: f64,
    /// `s`.
    trace: f64,
    /// In space, how much less well the normal is known than the edges.
    flatness: f64,
    damping: Scale,
}

fn sizes(p: &[f64], at: &[At<'_, f64>]) -> Sizes {
    let solid = Solid::new(p, at);
    let positions: Vec<Vector<f64>> = at.iter().map(|at| at.position).collect();
    let inverse = solid.of.inverse;
    let (i, j) = (solid.squared_stretch(&positions), solid.area(&positions, at[0].dimension));
    let stiffness = (solid.mu.abs() + solid.lambda.abs()) * solid.of.area;
    let (weight, stretch) = ((inverse[0][0] + inverse[1][1]).sqrt(), i.sqrt());
    Sizes {
        stiffness,
        weight,
        stretch,
        damping: damping_scale(p[11] * stiffness, weight, stretch, at),
        area: j.abs(),
        trace: (i + 2.0 * j).max(0.0).sqrt(),
        flatness: if at[0].dimension == 3 { 0.5 * i / j } else { 1.0 },
    }
}

fn st_venant_kirchhoff_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let Sizes { stiffness, weight, stretch, damping, .. } = sizes(p, at);
    quadratic_strain_scale(stiffness, weight, stretch) + damping
}

/// That of an energy quadratic in a strain that is quadratic in `F`.
pub(super) fn quadratic_strain_scale(stiffness: f64, weight: f64, stretch: f64) -> Scale {
    let strain = 1.0 + stretch * stretch;
    Scale {
        energy: stiffness * strain * strain,
        force: 2.0 * stiffness * weight * strain * stretch,
        by_position: 6.0 * stiffness * weight * weight * strain,
        by_velocity: 0.0,
    }
}

fn corotated_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let Sizes { stiffness, weight, stretch, trace, flatness, damping, .. } = sizes(p, at);
    // How much less well `R` is known: in the plane, `s²` is a sum that cancels near reflections.
    let turn = if at[0].dimension == 3 { flatness } else { 1.0 + stretch / trace };
    let size = 2.0 + stretch;
    Scale {
        energy: stiffness * size * size,
        force: stiffness * weight * size * turn,
        by_position: stiffness * weight * weight * (1.0 + size / trace * turn * turn),
        by_velocity: 0.0,
    } + damping
}

fn neo_hookean_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let Sizes { stiffness, weight, stretch, area, flatness, damping, .. } = sizes(p, at);
    let squared = stretch * stretch;
    Scale {
        energy: stiffness * (1.0 + squared + area * area),
        force: stiffness * weight * stretch * (1.0 + area) * flatness,
        by_position: stiffness * weight * weight * (1.0 + squared + area) * flatness * flatness,
        by_velocity: 0.0,
    } + damping
}

/// In the plane, the way to the nearest multiple of a reflection: `s` is the length of a linear function of the corners.
fn corotated_smooth(p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let Sizes { weight, trace, .. } = sizes(p, at);
    if at[0].dimension == 2 { trace / weight } else { height(at) }
}

/// In space, the way to the nearest flat triangle; in the plane, the longest edge: the energy is smooth.
fn neo_hookean_smooth(_p: &[f64], at: &[At<'_, f64>]) -> f64 {
    if at[0].dimension == 2 { longest(at) } else { height(at) }
}

/// The distance of the corners from a line.
fn height(at: &[At<'_, f64>]) -> f64 {
    let edge = |corner: usize| difference(&at[corner].position, &at[0].position);
    norm(&cross(&edge(1), &edge(2))) / longest(at)
}

fn longest(at: &[At<'_, f64>]) -> f64 {
    let edge = |[i, j]: [usize; 2]| norm(&difference(&at[i].position, &at[j].position));
    [[0, 1], [1, 2], [2, 0]].map(edge).into_iter().fold(0.0, f64::max)
}
