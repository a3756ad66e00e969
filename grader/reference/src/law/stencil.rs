//! Laws of forces on elements of any number of particles.
//!
//! ```text
//! bending    U = α/(2 (|ē1| + |ē2|)) (θ − θ0)²                                 Theme 4, milestone 1
//!            tan θ = (e1 × e2)/(e1·e2);  in space |e1 × e2|/(e1·e2)
//! hinge      U = k (θ − θ0)² |ē|/h̄                                            Grinspun et al. (2003), section 4.1
//!            θ from u to −v about e, of u and v what is across e of both sides
//! triangle   U = E Ā/(2 (1 − ν²)) (ν (tr ε)² + (1 − ν) tr ε²)                  the same
//!            ε = ∇Φᵀ∇Φ − I:  eᵀ ε ē' = e·e' − ē·ē' for edges e, e' and the undeformed ē, ē'
//! ```
//!
//! Damping of a hinge adds `β θ'` to `θ − θ0`, with `θ'` the rate of the angle.
//!
//! A law with an energy `U(x)` is stated by it ([`forces_of`]): dual numbers of dual numbers give its Jacobians. The triangle is
//! stated by inner products of edges: no formula of the hand-out for the strain is repeated. With `D` the undeformed
//! products `ē_a·ē_b` and `C` those of the state, `tr ε = tr(D⁻¹C) − 2` and `tr ε² = tr((D⁻¹C − I)²)`.

use std::f64::consts::PI;

use num_dual::Dual;

use super::{At, Law, Number, Scale, Symmetry, Vector, difference, dot, named, norm};

/// The laws of this file.
pub(super) static LAWS: &[&Law] = &[&ELASTIC_BENDING, &TRIANGLE, &HINGE];

/// The forces of an energy on its particles, `f_a = −∂U/∂x_a`.
pub fn forces_of<T: Number>(
    at: &[At<'_, T>],
    energy: impl Fn(&[Vector<Dual<T>>]) -> Dual<T>,
) -> Vec<Vector<T>> {
    let positions = at.iter().map(|at| at.position.map(|re| Dual::new(re, T::from(0.0))));
    let positions: Vec<Vector<Dual<T>>> = positions.collect();
    let along = |particle: usize, axis: usize| {
        let mut moved = positions.clone();
        moved[particle][axis].eps = T::from(1.0);
        -energy(&moved).eps
    };
    (0..at.len()).map(|particle| std::array::from_fn(|axis| along(particle, axis))).collect()
}

static ELASTIC_BENDING: Law = Law::of_stencil(
    "elasticbodybendingforce",
    &["alpha", "theta0"],
    Symmetry::Isotropic,
    3,
    (elastic_bending, elastic_bending),
    elastic_bending_scale,
)
.smooth_within(elastic_bending_smooth);

fn elastic_bending<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    forces_of(at, |x| bending_energy(p, at, x))
}

pub(super) fn bending_energy<A, T: Number>(p: &[f64], at: &[At<'_, A>], x: &[Vector<T>]) -> T {
    let [alpha, theta0] = named(p);
    let stiffness = alpha / path(at);
    let in_plane = at.iter().all(|at| at.dimension == 2);
    let (first, second) = (difference(&x[1], &x[0]), difference(&x[2], &x[1]));
    let normal = cross(&first, &second);
    let sine = if in_plane { normal[2] } else { dot(normal, normal).sqrt() };
    let change = angle(sine, dot(first, second)) - theta0;
    change * change * (0.5 * stiffness)
}

/// `atan2(y, x)`. That of dual numbers divides by `x`, which is 0 at a right angle.
fn angle<T: Number>(y: T, x: T) -> T {
    let half_turn = PI.copysign(y.re());
    if y.re().abs() > x.re().abs() {
        -(x / y).atan() + 0.5 * half_turn
    } else if x.re() >= 0.0 {
        (y / x).atan()
    } else {
        (y / x).atan() + half_turn
    }
}

/// The length of the path through the initial positions.
fn path<T>(at: &[At<'_, T>]) -> f64 {
    at.windows(2).map(|pair| norm(&difference(&pair[1].start, &pair[0].start))).sum()
}

pub(super) fn cross<T: Number>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    std::array::from_fn(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        a[next] * b[last] - a[last] * b[next]
    })
}

fn elastic_bending_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let [alpha, theta0] = named(p);
    let bar = |end: usize| difference(&at[end].position, &at[1].position);
    let (first, second) = (bar(0), bar(2));
    let shortest = norm(&first).min(norm(&second));
    // In space, the plane of the bars is known less well the more they are in line.
    let sine = norm(&cross(&first, &second)) / (norm(&first) * norm(&second));
    let flatness = if at[0].dimension == 3 { 1.0 + 1.0 / sine } else { 1.0 };
    let (stiffness, angle) = (alpha / path(at), theta0.abs() + PI);
    let force = 2.0 * stiffness * angle * flatness / shortest;
    Scale {
        energy: stiffness * angle * angle * flatness,
        force,
        by_position: 4.0 * force * flatness / shortest,
        by_velocity: 0.0,
    }
}

/// The way to the fold, where the angle jumps; in space, to any place where the bars are in line.
fn elastic_bending_smooth(_p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let (first, second) = (
        difference(&at[1].position, &at[0].position),
        difference(&at[2].position, &at[1].position),
    );
    let way = norm(&cross(&first, &second)) / norm(&first).max(norm(&second));
    if at[0].dimension == 2 && dot(first, second) > 0.0 { norm(&first) } else { way }
}

static HINGE: Law = Law::of_stencil(
    "hingebendingforce",
    &["stiffness", "theta0", "beta"],
    Symmetry::Isotropic,
    4,
    (hinge, hinge),
    hinge_scale,
)
.smooth_within(hinge_smooth);

fn hinge<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    let [stiffness, _, beta] = named(p);
    let mut forces = forces_of(at, |x| hinge_energy(p, at, x));
    if beta == 0.0 {
        return forces;
    }
    // Those of the energy θ.
    let falls = forces_of(at, hinge_angle);
    let rate: T = at.iter().zip(&falls).map(|(at, fall)| -dot(at.velocity, *fall)).sum();
    let moment = rate * (2.0 * stiffness * per_height(at) * beta);
    for (force, fall) in forces.iter_mut().flatten().zip(falls.iter().flatten()) {
        *force += *fall * moment;
    }
    forces
}

pub(super) fn hinge_energy<A, T: Number>(p: &[f64], at: &[At<'_, A>], x: &[Vector<T>]) -> T {
    let [stiffness, theta0] = named(p);
    let change = hinge_angle(x) - theta0;
    change * change * (stiffness * per_height(at))
}

/// `|ē|/h̄`, with `h̄` a third of the mean of the heights over the edge.
fn per_height<T>(at: &[At<'_, T>]) -> f64 {
    let start: Vec<Vector<f64>> = at.iter().map(|at| at.start).collect();
    let [first, second] = heights(&start);
    6.0 * norm(&difference(&start[1], &start[0])) / (first + second)
}

fn hinge_angle<T: Number>(x: &[Vector<T>]) -> T {
    let edge = difference(&x[1], &x[0]);
    let length = dot(edge, edge).sqrt();
    let along = edge.map(|component| component / length);
    let across = |corner: usize| -> Vector<T> {
        let side = difference(&x[corner], &x[0]);
        let share = dot(side, along);
        std::array::from_fn(|axis| side[axis] - along[axis] * share)
    };
    let (u, v) = (across(2), across(3).map(|component| -component));
    angle(dot(along, cross(&u, &v)), dot(u, v))
}

/// Of the third and the fourth particle over the edge between the first two.
fn heights(x: &[Vector<f64>]) -> [f64; 2] {
    let edge = difference(&x[1], &x[0]);
    [2, 3].map(|corner| norm(&cross(&edge, &difference(&x[corner], &x[0]))) / norm(&edge))
}

fn hinge_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let [stiffness, theta0, beta] = named(p);
    let x: Vec<Vector<f64>> = at.iter().map(|at| at.position).collect();
    let edge = norm(&difference(&x[1], &x[0]));
    let [first, second] = heights(&x);
    let sides = [2, 3].map(|corner| norm(&difference(&x[corner], &x[0])));
    // How much less well a normal is known than the sides, and how far a corner reaches beyond the edge.
    let lost = 1.0 + (sides[0] / first).max(sides[1] / second);
    let reach = 1.0 + (sides[0] + sides[1]) / edge;
    let shortest = first.min(second).min(edge);
    let (energy, angle) = (stiffness * per_height(at), theta0.abs() + PI);
    let slope = lost * reach / shortest;
    let rate = slope * at.iter().map(|at| norm(&at.velocity)).sum::<f64>();
    let force = 2.0 * energy * (angle + beta * rate) * slope;
    Scale {
        energy: energy * angle * angle * lost,
        force,
        by_position: 4.0 * force * slope,
        by_velocity: 2.0 * energy * beta * slope * slope,
    }
}

/// The way to the fold, where the angle jumps, or to a triangle without an area.
fn hinge_smooth(_p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let x: Vec<Vector<f64>> = at.iter().map(|at| at.position).collect();
    let [first, second] = heights(&x);
    first.min(second) * (PI - hinge_angle(&x).abs()).min(1.0)
}

/// The parameters of a triangle.
pub(super) const TRIANGLE_PARAMETERS: &[&str] = &[
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
];

static TRIANGLE: Law = Law::of_stencil(
    "elasticbodycstforce",
    TRIANGLE_PARAMETERS,
    Symmetry::Isotropic,
    3,
    (triangle, triangle),
    triangle_scale,
);

/// The undeformed element.
pub(super) struct Undeformed {
    pub(super) modulus: f64,
    pub(super) nu: f64,
    /// `Ā`.
    pub(super) area: f64,
    /// The cross product of the edges from the first corner.
    pub(super) normal: Vector<f64>,
    /// `D⁻¹`, of the products of these edges.
    pub(super) inverse: [[f64; 2]; 2],
}

impl Undeformed {
    /// `E Ā/(1 − ν²)`.
    fn stiffness(&self) -> f64 {
        self.modulus * self.area / (1.0 - self.nu * self.nu)
    }
}

pub(super) fn undeformed(p: &[f64], dimension: usize) -> Undeformed {
    let [modulus, nu] = named(p);
    let mut corners: [Vector<f64>; 3] = std::array::from_fn(|corner| named(&p[2 + 3 * corner..]));
    if dimension == 2 {
        corners.iter_mut().for_each(|corner| corner[2] = 0.0);
    }
    let [u, v] = [1, 2].map(|corner| difference(&corners[corner], &corners[0]));
    let [uu, uv, vv] = [dot(u, u), dot(u, v), dot(v, v)];
    let normal = cross(&u, &v);
    let squared = dot(normal, normal);
    Undeformed {
        modulus,
        nu,
        area: 0.5 * squared.sqrt(),
        normal,
        inverse: [[vv / squared, -uv / squared], [-uv / squared, uu / squared]],
    }
}

fn triangle<T: Number>(p: &[f64], at: &[At<'_, T>]) -> Vec<Vector<T>> {
    forces_of(at, |x| triangle_energy(p, at, x))
}

pub(super) fn triangle_energy<A, T: Number>(p: &[f64], at: &[At<'_, A>], x: &[Vector<T>]) -> T {
    let of = undeformed(p, at[0].dimension);
    let (stiffness, nu, [first, second]) = (of.stiffness(), of.nu, of.inverse);
    let (u, v) = (difference(&x[1], &x[0]), difference(&x[2], &x[0]));
    let [uu, uv, vv] = [dot(u, u), dot(u, v), dot(v, v)];
    let strain = [
        [uu * first[0] + uv * first[1] - 1.0, uv * first[0] + vv * first[1]],
        [uu * second[0] + uv * second[1], uv * second[0] + vv * second[1] - 1.0],
    ];
    let trace = strain[0][0] + strain[1][1];
    let squared = strain[0][0] * strain[0][0]
        + strain[0][1] * strain[1][0] * 2.0
        + strain[1][1] * strain[1][1];
    (trace * trace * nu + squared * (1.0 - nu)) * (0.5 * stiffness)
}

fn triangle_scale(p: &[f64], at: &[At<'_, f64>]) -> Scale {
    let of = undeformed(p, at[0].dimension);
    let (stiffness, nu, inverse) = (of.stiffness(), of.nu, of.inverse);
    // The square of the largest stretch per squared length.
    let weight = 2.0 * inverse[0][0].max(inverse[1][1]);
    let edge = |corner: usize| norm(&difference(&at[corner].position, &at[0].position));
    let length = edge(1).max(edge(2));
    let strain = 1.0 + weight * length * length;
    let stiffness = stiffness.abs() * (1.0 + nu.abs());
    Scale {
        energy: 2.0 * stiffness * strain * strain,
        force: 4.0 * stiffness * strain * weight * length,
        by_position: 12.0 * stiffness * strain * weight,
        by_velocity: 0.0,
    }
}
