//! Elastic bodies in space, with the dense matrices of the plane: tetrahedra, triangles and hinges.
//!
//! ```text
//! body    F = (x_2 − x_1 | …) B     P = ∂ψ/∂F     (f_2 | …) = −V P Bᵀ     ∂f = −V dP Bᵀ of dF = (dx_2 − dx_1 | …) B
//! hinge   e = x_2 − x_1, a = x_3 − x_1, b = x_4 − x_1     θ = atan2(−|e| n_a·b, n_a·n_b) of n_a = e × a, n_b = b × e
//!         F = −c (θ − θ0) g     ∂F/∂x = −c (g gᵀ + (θ − θ0) H_θ)     c = 12 k |ē|²/(|n̄_a| + |n̄_b|)
//! damping ε' = ½ (F'ᵀF + FᵀF')  P += β F (2μ ε' + λ tr ε' I)         F −= c β θ' g of θ' = g·v
//! ```
//!
//! `B` is the inverse of the undeformed edges; of a triangle in its local axes, so that `F` is 3×2. The change of the
//! stress is by formulas too: `dR` from the singular values of `F`. Force and Hessian have a copy of each formula.
//!
//! Every force that is not here is computed by the `reference` crate's law. Sources: Sifakis and Barbič (2012), chapters 3
//! and 4; Smith, de Goes and Kim (2018); Tamstorf and Grinspun (2013).

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector};
use reference::laws::Laws;
use scene::schema::{Family, StepEquation};
use scene::{Dimension, ForceElement, Scene};

use super::{MAX_NEWTON_ITERATIONS, Motion, Vec3, steps_by_itself};

/// `F`, `P`, and the edges from the first corner.
pub(crate) type Gradient<const K: usize> = SMatrix<f64, 3, K>;
/// `B`.
pub(crate) type Square<const K: usize> = SMatrix<f64, K, K>;

/// Lamé's parameters `μ` and `λ`.
pub(crate) type Lame = [f64; 2];

type DampingChange<const K: usize> =
    fn(&Gradient<K>, &Gradient<K>, &Gradient<K>, Lame) -> Gradient<K>;

/// The formulas of a body with `K + 1` corners.
#[derive(Clone, Copy)]
pub(crate) struct Simplex<const K: usize> {
    /// The undeformed corners, of those in the file and of the initial positions.
    pub(crate) corners: fn(&[Vec3], &[Vec3]) -> Vec<Vec3>,
    /// The undeformed edges as columns.
    pub(crate) edges: fn(&[Vec3]) -> Square<K>,
    /// The corners of the state, in the order that the undeformed ones have.
    pub(crate) order: fn(&mut [Vec3]),
    /// `V`, of the determinants of the undeformed and of the deformed edges.
    pub(crate) size: fn(f64, f64) -> f64,
    /// `μ` and `λ`, of `E` and `ν`.
    pub(crate) lame: fn(f64, f64) -> Lame,
    /// `F`, of the edges and `B`.
    pub(crate) gradient: fn(&Gradient<K>, &Square<K>) -> Gradient<K>,
    /// `P`, of `F`.
    pub(crate) stress: fn(&Gradient<K>, Lame) -> Gradient<K>,
    /// `dP`, of `F` and `dF`.
    pub(crate) change: fn(&Gradient<K>, &Gradient<K>, Lame) -> Gradient<K>,
    /// The stress by damping for `β = 1`, of `F` and its rate.
    pub(crate) damping: fn(&Gradient<K>, &Gradient<K>, Lame) -> Gradient<K>,
    /// Its change, of `F`, its rate and `dF`.
    pub(crate) damping_change: DampingChange<K>,
    /// The forces on the corners but the first as columns, for `V = −1`: of `P` and `B`.
    pub(crate) pull: fn(&Gradient<K>, &Square<K>) -> Gradient<K>,
    /// The forces on all corners.
    pub(crate) share: fn(&mut [Vec3]),
    /// The blocks of the Hessian, as they are added.
    pub(crate) place: fn(&mut DMatrix<f64>),
}

/// The formulas of a hinge.
#[derive(Clone, Copy)]
pub(crate) struct Fold {
    /// `c`, of the initial positions, the positions and `k`.
    pub(crate) stiffness: fn(&[Vec3; 4], &[Vec3; 4], f64) -> f64,
    /// `θ`, of `e`, `a` and `b`.
    pub(crate) angle: fn(Vec3, Vec3, Vec3) -> f64,
    /// `θ − θ0`.
    pub(crate) change: fn(f64, f64) -> f64,
    /// `|e| n/|n|²` of `n = e × a`.
    pub(crate) slope: fn(Vec3, Vec3) -> Vec3,
    /// `g` of the four particles, of its parts by `e`, `a` and `b`.
    pub(crate) share: fn([Vec3; 3]) -> [Vec3; 4],
    /// The weights of `g gᵀ` and of `(θ − θ0) H_θ`.
    pub(crate) weights: [f64; 2],
    /// The weights of damping in the force, in `∂F/∂x` and in `∂F/∂v`.
    pub(crate) damping: [f64; 3],
    /// The blocks of the Hessian, as they are added.
    pub(crate) place: fn(&mut DMatrix<f64>),
}

/// The forces in space: each for the force and for its Jacobian.
#[derive(Clone, Copy)]
pub(crate) struct Solids {
    /// By the order of [`TETRAHEDRA`].
    pub(crate) tetrahedra: [[Simplex<3>; 2]; 3],
    /// By the order of [`TRIANGLES`].
    pub(crate) triangles: [[Simplex<2>; 2]; 3],
    pub(crate) fold: [Fold; 2],
}

const TETRAHEDRA: [&str; 3] = ["stvktetrahedron", "corotatedtetrahedron", "neohookeantetrahedron"];
const TRIANGLES: [&str; 3] = ["stvktriangle", "corotatedtriangle", "neohookeantriangle"];
const FOLD: &str = "hingebendingforce";

/// Whether the student supports the scene: in space, by a method that it has formulas for.
pub fn knows_in_space(scene: &Scene) -> bool {
    let is_own = steps_by_itself(scene.integrator.equation);
    let by_time = scene.forces.iter().any(|force| force.schema.depends_on().time);
    let minimises = scene.integrator.family == Family::Minimization;
    scene.dimension == Dimension::Three && is_own && !by_time && !minimises
}

impl Solids {
    /// Without mistakes.
    pub(super) fn faultless() -> Self {
        let solid = |stress, change| {
            let edges =
                |b: &[Vec3]| Matrix3::from_columns(&[b[1] - b[0], b[2] - b[0], b[3] - b[0]]);
            let lame = |e, nu| [e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))];
            [Simplex::right(edges, |undeformed, _| undeformed.abs() / 6.0, lame, stress, change); 2]
        };
        let sheet = |stress, change| {
            let lame = |e, nu| [e / (2.0 * (1.0 + nu)), e * nu / (1.0 - nu * nu)];
            [Simplex::right(own_axes, |undeformed, _| undeformed.abs() / 2.0, lame, stress, change);
                2]
        };
        let fold = Fold {
            stiffness: |start, _, k| {
                let [e, a, b] = sides(start);
                12.0 * k * e.norm_squared() / (e.cross(&a).norm() + e.cross(&b).norm())
            },
            angle: |e, a, b| {
                let (of_a, of_b) = (e.cross(&a), b.cross(&e));
                (-e.norm() * of_a.dot(&b)).atan2(of_a.dot(&of_b))
            },
            change: |theta, theta0| theta - theta0,
            slope: |e, a| {
                let n = e.cross(&a);
                e.norm() / n.norm_squared() * n
            },
            share: |[e, a, b]| [-e - a - b, e, a, b],
            weights: [1.0; 2],
            damping: [1.0; 3],
            place: |_| (),
        };
        Self {
            tetrahedra: [
                solid(venant_stress, venant_change),
                solid(corotated_stress, corotated_change),
                solid(solid_stress, solid_change),
            ],
            triangles: [
                sheet(venant_stress, venant_change),
                sheet(corotated_stress, corotated_change),
                sheet(sheet_stress, sheet_change),
            ],
            fold: [fold; 2],
        }
    }
}

/// Edges of a triangle in local axes, the first along its first edge.
fn own_axes(corners: &[Vec3]) -> Square<2> {
    let (u, v) = (corners[1] - corners[0], corners[2] - corners[0]);
    let length = u.norm();
    Square::<2>::new(length, u.dot(&v) / length, 0.0, u.cross(&v).norm() / length)
}

/// `2μ ε + λ tr ε I`, of `ε = ½ (FᵀF − I)`.
pub(crate) fn second_stress<const K: usize>(strain: Square<K>, [mu, lambda]: Lame) -> Square<K> {
    2.0 * mu * strain + lambda * strain.trace() * Square::identity()
}

pub(crate) fn strain<const K: usize>(f: &Gradient<K>) -> Square<K> {
    0.5 * (f.transpose() * f - Square::identity())
}

fn venant_stress<const K: usize>(f: &Gradient<K>, lame: Lame) -> Gradient<K> {
    f * second_stress(strain(f), lame)
}

/// The change of the strain along `dF`.
pub(crate) fn strain_along<const K: usize>(f: &Gradient<K>, df: &Gradient<K>) -> Square<K> {
    let product = df.transpose() * f;
    0.5 * (product + product.transpose())
}

fn venant_change<const K: usize>(f: &Gradient<K>, df: &Gradient<K>, lame: Lame) -> Gradient<K> {
    df * second_stress(strain(f), lame) + f * second_stress(strain_along(f, df), lame)
}

pub(crate) fn damping_stress<const K: usize>(
    f: &Gradient<K>,
    rate: &Gradient<K>,
    lame: Lame,
) -> Gradient<K> {
    f * second_stress(strain_along(f, rate), lame)
}

pub(crate) fn damping_change<const K: usize>(
    f: &Gradient<K>,
    rate: &Gradient<K>,
    df: &Gradient<K>,
    lame: Lame,
) -> Gradient<K> {
    df * second_stress(strain_along(f, rate), lame)
        + f * second_stress(strain_along(df, rate), lame)
}

/// `R`, `V` and the singular values, the last with the sign of `det F` where it has one: `F = R V Σ Vᵀ`.
pub(crate) fn polar<const K: usize>(f: &Gradient<K>) -> (Gradient<K>, Square<K>, SVector<f64, K>) {
    let nan = || DMatrix::repeat(3, K, f64::NAN);
    if !f.iter().all(|entry| entry.is_finite()) {
        return (Gradient::repeat(f64::NAN), Square::repeat(f64::NAN), SVector::repeat(f64::NAN));
    }
    let svd = DMatrix::from_iterator(3, K, f.iter().copied()).svd(true, true);
    let (mut u, v) = (svd.u.unwrap_or_else(nan), svd.v_t.unwrap_or_else(nan).transpose());
    let mut sigma = SVector::<f64, K>::from_fn(|n, _| svd.singular_values[n]);
    if K == 3 && u.determinant() * v.determinant() < 0.0 {
        let least = sigma.imin();
        sigma[least] = -sigma[least];
        let flipped = -u.column(least);
        u.set_column(least, &flipped);
    }
    let entries = |matrix: DMatrix<f64>| move |row: usize, column: usize| matrix[(row, column)];
    let (mut r, v): (Gradient<K>, Square<K>) =
        (SMatrix::from_fn(entries(&u * v.transpose())), SMatrix::from_fn(entries(v)));
    // A step of Newton's method, as far as the singular vectors are rounded.
    r += turned(&r, &v, &sigma, f);
    r *= 1.5 * Square::identity() - 0.5 * (r.transpose() * r);
    (r, v, sigma)
}

/// The change of `R` along a matrix: `R X + (I − R Rᵀ) dF S⁻¹`, with `X` antisymmetric and `X S + S X = RᵀdF − dFᵀR`.
fn turned<const K: usize>(
    r: &Gradient<K>,
    v: &Square<K>,
    sigma: &SVector<f64, K>,
    df: &Gradient<K>,
) -> Gradient<K> {
    let w = v.transpose() * (r.transpose() * df) * v;
    let x = Square::<K>::from_fn(|i, j| (w[(i, j)] - w[(j, i)]) / (sigma[i] + sigma[j]));
    let mut change = r * (v * x * v.transpose());
    if K == 2 {
        let inverse = v * Square::from_diagonal(&sigma.map(f64::recip)) * v.transpose();
        change += (df - r * (r.transpose() * df)) * inverse;
    }
    change
}

pub(crate) fn corotated_stress<const K: usize>(f: &Gradient<K>, [mu, lambda]: Lame) -> Gradient<K> {
    let (r, _, sigma) = polar(f);
    2.0 * mu * (f - r) + lambda * (sigma.sum() - K as f64) * r
}

/// The change of `R` along `dF`.
pub(crate) fn rotation_along<const K: usize>(f: &Gradient<K>, df: &Gradient<K>) -> Gradient<K> {
    let (r, v, sigma) = polar(f);
    turned(&r, &v, &sigma, df)
}

fn corotated_change<const K: usize>(
    f: &Gradient<K>,
    df: &Gradient<K>,
    [mu, lambda]: Lame,
) -> Gradient<K> {
    let (r, _, sigma) = polar(f);
    let dr = rotation_along(f, df);
    let growth = sigma.sum() - K as f64;
    2.0 * mu * (df - dr) + lambda * (r.dot(df) * r + growth * dr)
}

fn columns(f: &Gradient<3>) -> [Vec3; 3] {
    [0, 1, 2].map(|column| f.column(column).into())
}

/// `∂J/∂F`.
pub(crate) fn cofactors(f: &Gradient<3>) -> Gradient<3> {
    let [p, q, r] = columns(f);
    Matrix3::from_columns(&[q.cross(&r), r.cross(&p), p.cross(&q)])
}

/// Its change along `dF`.
fn cofactors_along(f: &Gradient<3>, df: &Gradient<3>) -> Gradient<3> {
    let ([p, q, r], [dp, dq, dr]) = (columns(f), columns(df));
    Matrix3::from_columns(&[
        dq.cross(&r) + q.cross(&dr),
        dr.cross(&p) + r.cross(&dp),
        dp.cross(&q) + p.cross(&dq),
    ])
}

fn solid_stress(f: &Gradient<3>, [mu, lambda]: Lame) -> Gradient<3> {
    let i = f.norm_squared();
    let growth = f.determinant() - 1.0;
    4.0 / 3.0 * mu * i / (i + 1.0) * f + ((lambda + 5.0 / 6.0 * mu) * growth - mu) * cofactors(f)
}

fn solid_change(f: &Gradient<3>, df: &Gradient<3>, [mu, lambda]: Lame) -> Gradient<3> {
    let (i, bulk) = (f.norm_squared(), lambda + 5.0 / 6.0 * mu);
    let g = cofactors(f);
    let shear = i / (i + 1.0) * df + 2.0 * f.dot(df) / (i + 1.0).powi(2) * f;
    4.0 / 3.0 * mu * shear
        + bulk * g.dot(df) * g
        + (bulk * (f.determinant() - 1.0) - mu) * cofactors_along(f, df)
}

/// `J`, `∂J/∂F` and the normal of a sheet.
pub(crate) fn area(f: &Gradient<2>) -> (f64, Gradient<2>, Vec3) {
    let (p, q): (Vec3, Vec3) = (f.column(0).into(), f.column(1).into());
    let normal = p.cross(&q);
    let (j, n) = (normal.norm(), normal.normalize());
    (j, Gradient::from_columns(&[q.cross(&n), n.cross(&p)]), n)
}

fn sheet_stress(f: &Gradient<2>, [mu, lambda]: Lame) -> Gradient<2> {
    let (j, g, _) = area(f);
    mu * (f - g) + (lambda + mu) * (j - 1.0) * g
}

fn sheet_change(f: &Gradient<2>, df: &Gradient<2>, [mu, lambda]: Lame) -> Gradient<2> {
    let (j, g, n) = area(f);
    let (p, q): (Vec3, Vec3) = (f.column(0).into(), f.column(1).into());
    let (dp, dq): (Vec3, Vec3) = (df.column(0).into(), df.column(1).into());
    let turned = dp.cross(&q) + p.cross(&dq);
    let dn = (turned - n.dot(&turned) * n) / j;
    let dg =
        Gradient::<2>::from_columns(&[dq.cross(&n) + q.cross(&dn), dn.cross(&p) + n.cross(&dp)]);
    mu * (df - dg) + (lambda + mu) * (g.dot(df) * g + (j - 1.0) * dg)
}

/// `e`, `a` and `b`.
fn sides(x: &[Vec3; 4]) -> [Vec3; 3] {
    [x[1] - x[0], x[2] - x[0], x[3] - x[0]]
}

/// A body at a state.
struct Shape<const K: usize> {
    inverse: Square<K>,
    size: f64,
    lame: Lame,
    beta: f64,
    f: Gradient<K>,
    rate: Gradient<K>,
}

fn edges<const K: usize>(x: &[Vec3]) -> Gradient<K> {
    Gradient::from_fn(|axis, corner| (x[corner + 1] - x[0])[axis])
}

impl<const K: usize> Simplex<K> {
    /// Without mistakes, of these geometry and material.
    fn right(
        edges: fn(&[Vec3]) -> Square<K>,
        size: fn(f64, f64) -> f64,
        lame: fn(f64, f64) -> Lame,
        stress: fn(&Gradient<K>, Lame) -> Gradient<K>,
        change: fn(&Gradient<K>, &Gradient<K>, Lame) -> Gradient<K>,
    ) -> Self {
        Self {
            corners: |given, _| given.to_vec(),
            edges,
            order: |_| (),
            size,
            lame,
            gradient: |edges, b| edges * b,
            stress,
            change,
            damping: damping_stress,
            damping_change,
            pull: |p, b| p * b.transpose(),
            share: |_| (),
            place: |_| (),
        }
    }

    fn shape(&self, element: &Element) -> Shape<K> {
        let p = |name: &str| element.of.parameter(name);
        let undeformed = (self.edges)(&(self.corners)(&element.corners, &element.start));
        let dynamic = |m: &Square<K>| DMatrix::from_fn(K, K, |a, b| m[(a, b)]);
        let inverse = dynamic(&undeformed).try_inverse();
        let inverse = inverse.unwrap_or_else(|| DMatrix::zeros(K, K));
        let inverse = Square::from_fn(|a, b| inverse[(a, b)]);
        let [deformed, rate] = [&element.x, &element.v].map(|corners| {
            let mut corners = corners.clone();
            (self.order)(&mut corners);
            edges::<K>(&corners)
        });
        let products: Square<K> = deformed.transpose() * deformed;
        let squared = dynamic(&products).determinant();
        let determinant = dynamic(&undeformed).determinant();
        Shape {
            size: (self.size)(determinant, squared.max(0.0).sqrt()),
            lame: (self.lame)(p("youngsmodulus"), p("poissonratio")),
            beta: p("beta"),
            f: (self.gradient)(&deformed, &inverse),
            rate: (self.gradient)(&rate, &inverse),
            inverse,
        }
    }

    /// On every corner, of a stress.
    fn pulls(&self, shape: &Shape<K>, stress: &Gradient<K>) -> Vec<Vec3> {
        let pulls = (self.pull)(stress, &shape.inverse) * -shape.size;
        let others = (0..K).map(|corner| pulls.column(corner).into_owned());
        let first = -others.clone().sum::<Vec3>();
        let mut all: Vec<Vec3> = [first].into_iter().chain(others).collect();
        (self.order)(&mut all);
        (self.share)(&mut all);
        all
    }

    fn forces(&self, element: &Element) -> Vec<Vec3> {
        let shape = self.shape(element);
        let Shape { f, rate, lame, beta, .. } = &shape;
        self.pulls(&shape, &((self.stress)(f, *lame) + *beta * (self.damping)(f, rate, *lame)))
    }

    fn jacobians(&self, element: &Element) -> [DMatrix<f64>; 2] {
        let shape = self.shape(element);
        let Shape { f, rate, lame, beta, .. } = &shape;
        let size = 3 * (K + 1);
        let mut matrices = [DMatrix::zeros(size, size), DMatrix::zeros(size, size)];
        for column in 0..size {
            let mut dx = vec![Vec3::zeros(); K + 1];
            dx[column / 3][column % 3] = 1.0;
            (self.order)(&mut dx);
            let df = (self.gradient)(&edges(&dx), &shape.inverse);
            let by_position =
                (self.change)(f, &df, *lame) + *beta * (self.damping_change)(f, rate, &df, *lame);
            let by_velocity = *beta * (self.damping)(f, &df, *lame);
            for (matrix, change) in matrices.iter_mut().zip([by_position, by_velocity]) {
                let pulls = self.pulls(&shape, &change);
                let all = pulls.iter().flat_map(|pull| pull.iter().copied());
                matrix.column_mut(column).iter_mut().zip(all).for_each(|(to, value)| *to = value);
            }
        }
        (self.place)(&mut matrices[0]);
        matrices
    }
}

impl Fold {
    /// `−c`, `θ − θ0`, `e a b` and the derivatives of `θ` by them.
    fn state(&self, element: &Element) -> (f64, f64, [Vec3; 3], [Vec3; 3]) {
        let of = |positions: &[Vec3]| std::array::from_fn(|place| positions[place]);
        let (x, start): ([Vec3; 4], [Vec3; 4]) = (of(&element.x), of(&element.start));
        let [e, a, b] = sides(&x);
        let stiffness = (self.stiffness)(&start, &x, element.of.parameter("stiffness"));
        let change = (self.change)((self.angle)(e, a, b), element.of.parameter("theta0"));
        let (of_a, of_b) = (-(self.slope)(e, a), (self.slope)(e, b));
        let of_e = -(a.dot(&e) * of_a + b.dot(&e) * of_b) / e.norm_squared();
        (-stiffness, change, [e, a, b], [of_e, of_a, of_b])
    }

    fn forces(&self, element: &Element) -> Vec<Vec3> {
        let (c, change, _, by) = self.state(element);
        let g = (self.share)(by);
        let rate: f64 = g.iter().zip(&element.v).map(|(g, v)| g.dot(v)).sum();
        let damped = change + self.damping[0] * element.of.parameter("beta") * rate;
        g.map(|gradient| c * damped * gradient).to_vec()
    }

    fn jacobians(&self, element: &Element) -> [DMatrix<f64>; 2] {
        let (c, change, [e, a, b], by) = self.state(element);
        let vector = |all: &[Vec3]| DVector::from_vec(flat(all));
        let (g, v) = (vector(&(self.share)(by)), vector(&element.v));
        // The derivatives of the slope by the side and by e.
        let bent = |side: Vec3| -> [Matrix3<f64>; 2] {
            let n = e.cross(&side);
            let (n2, length) = (n.norm_squared(), e.norm());
            let across = length / n2 * (Matrix3::identity() - 2.0 / n2 * n * n.transpose());
            let by_e = n * e.transpose() / (length * n2) - across * side.cross_matrix();
            [across * e.cross_matrix(), by_e]
        };
        let ([aa, ae], [bb, be]) = (bent(a), bent(b));
        let ([aa, ae], zero) = ([-aa, -ae], Matrix3::zeros());
        let squared = e.norm_squared();
        let tilt = |side: Vec3, slope: Vec3, by_e: Matrix3<f64>| {
            let part = side.dot(&e) / squared;
            let along = (side - 2.0 * part * e) / squared;
            -(slope * along.transpose()) - part * by_e
        };
        let ee = tilt(a, by[1], ae) + tilt(b, by[2], be);
        let inner = [[ee, ae.transpose(), be.transpose()], [ae, aa, zero], [be, zero, bb]];
        // The first particle is the origin of e, a and b.
        let weight = |particle: usize, side: usize| match particle {
            0 => -1.0,
            particle if particle == side + 1 => 1.0,
            _ => 0.0,
        };
        let mut curvature = DMatrix::zeros(12, 12);
        for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
            let sides = (0..3).flat_map(|one| (0..3).map(move |other| (one, other)));
            let block: Matrix3<f64> = sides
                .map(|(one, other)| weight(row, one) * weight(column, other) * inner[one][other])
                .sum();
            curvature.fixed_view_mut::<3, 3>(3 * row, 3 * column).copy_from(&block);
        }
        let [outer, second] = self.weights;
        let beta = element.of.parameter("beta");
        let [_, of_x, of_v] = self.damping.map(|weight| weight * beta);
        let product = &g * g.transpose();
        let turning = &g * (&curvature * &v).transpose() + g.dot(&v) * &curvature;
        let mut dx = c * (outer * &product + second * change * curvature + of_x * turning);
        (self.place)(&mut dx);
        [dx, c * of_v * product]
    }
}

/// An element at a state.
struct Element<'a> {
    of: &'a ForceElement,
    x: Vec<Vec3>,
    v: Vec<Vec3>,
    start: Vec<Vec3>,
    /// The undeformed corners of the file; none of a hinge.
    corners: Vec<Vec3>,
}

/// A motion in space.
pub(super) struct Space {
    solids: Solids,
    scene: Scene,
    x: Vec<Vec3>,
    v: Vec<Vec3>,
}

impl Space {
    pub(super) fn new(solids: Solids, scene: Scene) -> Self {
        let each = scene.particles.iter();
        let (x, v) = each.map(|p| (Vec3::from(p.position), Vec3::from(p.velocity))).unzip();
        Self { solids, x, v, scene }
    }

    fn element<'a>(&self, of: &'a ForceElement, [x, v]: [&[Vec3]; 2]) -> Element<'a> {
        let its = |all: &[Vec3]| of.particles.iter().map(|particle| all[*particle]).collect();
        let start = |particle: &usize| Vec3::from(self.scene.particles[*particle].position);
        Element {
            x: its(x),
            v: its(v),
            start: of.particles.iter().map(start).collect(),
            corners: of.undeformed().iter().map(|corner| Vec3::from(*corner)).collect(),
            of,
        }
    }

    /// The forces on all particles, and `∂F/∂x` and `∂F/∂v`.
    fn forces(&self, x: &[Vec3], v: &[Vec3]) -> (DVector<f64>, [DMatrix<f64>; 2]) {
        let size = 3 * x.len();
        let (mut force, mut dx) = (DVector::zeros(size), DMatrix::zeros(size, size));
        let mut dv = dx.clone();
        let mut others = Vec::new();
        for of in &self.scene.forces {
            let element = || self.element(of, [x, v]);
            let place = |tags: &[&str]| tags.iter().position(|tag| *tag == of.schema.tag);
            let (forces, blocks) = if let Some(material) = place(&TETRAHEDRA) {
                let [own, jacobian] = self.solids.tetrahedra[material];
                (own.forces(&element()), jacobian.jacobians(&element()))
            } else if let Some(material) = place(&TRIANGLES) {
                let [own, jacobian] = self.solids.triangles[material];
                (own.forces(&element()), jacobian.jacobians(&element()))
            } else if of.schema.tag == FOLD {
                let [own, jacobian] = self.solids.fold;
                (own.forces(&element()), jacobian.jacobians(&element()))
            } else {
                others.push(of.clone());
                continue;
            };
            for (row, (i, pull)) in of.particles.iter().zip(&forces).enumerate() {
                let mut own = force.fixed_rows_mut::<3>(3 * i);
                own += pull;
                for (column, j) in of.particles.iter().enumerate() {
                    for (matrix, blocks) in [&mut dx, &mut dv].into_iter().zip(&blocks) {
                        let mut view = matrix.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                        view += blocks.fixed_view::<3, 3>(3 * row, 3 * column);
                    }
                }
            }
        }
        let laws = Laws::of(&self.scene, &others);
        let (x, v) = (flat(x), flat(v));
        force += DVector::from_vec(laws.force(&x, &v, 0.0));
        let by_law = laws.jacobians(&x, &v, 0.0);
        (force, [dx + by_law.by_position, dv + by_law.by_velocity])
    }

    fn implicit_velocities(&self, max_iterations: usize) -> Vec<Vec3> {
        let h = self.scene.time_step;
        let mut u = self.v.clone();
        for _ in 0..max_iterations {
            let ahead: Vec<Vec3> = self.x.iter().zip(&u).map(|(x, u)| x + h * u).collect();
            let (force, [dx, dv]) = self.forces(&ahead, &u);
            let mut matrix = -(h * h * dx + h * dv);
            let mut right = h * force;
            for (i, particle) in self.scene.particles.iter().enumerate() {
                for axis in 0..3 {
                    let dof = 3 * i + axis;
                    matrix[(dof, dof)] += particle.mass;
                    right[dof] -= particle.mass * (u[i] - self.v[i])[axis];
                    if particle.fixed {
                        matrix.row_mut(dof).fill(0.0);
                        matrix.column_mut(dof).fill(0.0);
                        (matrix[(dof, dof)], right[dof]) = (1.0, 0.0);
                    }
                }
            }
            let nonsense = || DVector::repeat(right.len(), f64::NAN);
            let delta = matrix.lu().solve(&right).unwrap_or_else(nonsense);
            for (i, u) in u.iter_mut().enumerate() {
                *u += delta.fixed_rows::<3>(3 * i);
            }
            if delta.norm() < 1e-9 {
                break;
            }
        }
        u
    }
}

impl Motion for Space {
    fn step(&mut self) {
        let h = self.scene.time_step;
        let new = match self.scene.integrator.equation {
            StepEquation::LinearizedImplicitEuler => self.implicit_velocities(1),
            StepEquation::ImplicitEuler => self.implicit_velocities(MAX_NEWTON_ITERATIONS),
            _ => {
                let (force, _) = self.forces(&self.x, &self.v);
                let kicked = |(i, v): (usize, &Vec3)| match &self.scene.particles[i] {
                    particle if particle.fixed => *v,
                    particle => v + h / particle.mass * force.fixed_rows::<3>(3 * i),
                };
                self.v.iter().enumerate().map(kicked).collect()
            }
        };
        let is_explicit = self.scene.integrator.equation == StepEquation::ExplicitEuler;
        let along = if is_explicit { &self.v } else { &new };
        self.x.iter_mut().zip(along).for_each(|(x, v)| *x += h * v);
        self.v = new;
    }

    fn state(&self) -> [Vec<f64>; 2] {
        [flat(&self.x), flat(&self.v)]
    }
}

fn flat(vectors: &[Vec3]) -> Vec<f64> {
    vectors.iter().flat_map(|vector| vector.iter().copied()).collect()
}
