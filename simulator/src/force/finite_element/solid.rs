//! Tetrahedra, in space.
//!
//! ```text
//! F = (x_2 − x_1 | x_3 − x_1 | x_4 − x_1) B    B = (b_2 − b_1 | b_3 − b_1 | b_4 − b_1)⁻¹    U = V̄ ψ(F)
//! μ = E/(2 (1 + ν))    λ = E ν/((1 + ν) (1 − 2ν))    −1 < ν < ½
//! ```
//!
//! `V̄` is the undeformed volume, positive for both orientations. With `J = det F`, `G = ∂J/∂F` the cofactors, `I = ‖F‖²`
//! and `λ' = λ + 5/6 μ`,
//!
//! ```text
//! St. Venant–Kirchhoff   ψ = μ ‖ε‖² + λ/2 (tr ε)²                      ε = ½ (FᵀF − I)
//! corotated              ψ = μ ‖F − R‖² + λ/2 (tr S − 3)²              P = 2μ (F − R) + λ (tr S − 3) R
//! stable neo-Hookean     ψ = 2/3 μ (I − 3 − ln((I + 1)/4)) + λ'/2 (J − 1)² − μ (J − 1)
//!                        P = 4/3 μ I/(I + 1) F + (λ' (J − 1) − μ) G
//! ```
//!
//! `F = R S` is the polar decomposition with `det R = 1`, of inverted elements too: the smallest stretch, an eigenvalue of `S`,
//! has the sign of `J`. `dR = R [ω]ₓ`, where `(tr S I − S) ω` is the axial vector of `RᵀdF − dFᵀR`. There is no
//! nearest rotation where two stretches add up to 0: at reflections and their multiples, and where `F` has rank 1 or 0.
//!
//! The last energy is Smith, de Goes and Kim's with its logarithm, less its value at rest, in Lamé's parameters: their `μ` is
//! `4/3 μ`, their `λ` is `λ'`, their `α` is `1 + μ/λ'`. `λ'` is positive for every `ν` above −1. The logarithm cancels the
//! quadratic term at `F = 0`, where `J` is of third order: without it, there would be a minimum. Nowhere else is `P` 0
//! for `J ≤ 0`: inverted and flat elements are pushed back.
//!
//! Sources: Sifakis and Barbič, FEM simulation of 3D deformable solids (2012), sections 3.3 and 3.4; Smith, de Goes and
//! Kim, Stable neo-Hookean flesh simulation (2018), sections 3.3 and 3.4; de Rijk, A one-sided Jacobi algorithm for computing the
//! singular value decomposition (1989).

use std::marker::PhantomData;

use nalgebra::{Matrix3, Vector3};

use super::{
    Described, Element, Gradient, Lame, Material, Shape, StVenantKirchhoff, damped, damping,
    elastic, names, schema,
};
use crate::force::elastic_triangle::corner;
use crate::force::stencil::StencilForce;
use crate::force::{Force, ForceKind, Numbered, in_space_only};
use scene::schema::ParameterSchema;
use scene::{Dimension, ForceElement, Scene};

const PARAMETERS: &[ParameterSchema] = &[
    ParameterSchema::new("youngsmodulus", "Young's modulus", (1.0, 10.0), [0.25, 0.375, 0.3125])
        .non_negative(),
    ParameterSchema::new("poissonratio", "Poisson's ratio", (-0.25, 0.45), [0.25, 0.375, 0.125])
        .of_solid(),
    corner("xb1x", (0, 0), (-0.25, 0.0), [-0.25, -0.125, -0.375]),
    corner("xb1y", (0, 1), (-0.25, 0.0), [-0.375, -0.25, -0.125]),
    corner("xb1z", (0, 2), (-0.25, 0.0), [-0.125, -0.375, -0.25]),
    corner("xb2x", (1, 0), (1.0, 2.0), [1.25, 1.5, 1.375]),
    corner("xb2y", (1, 1), (-0.25, 0.25), [0.125, -0.0625, 0.0625]),
    corner("xb2z", (1, 2), (-0.25, 0.25), [-0.125, 0.0625, 0.1875]),
    corner("xb3x", (2, 0), (-0.25, 0.25), [0.0625, 0.125, -0.0625]),
    corner("xb3y", (2, 1), (1.0, 2.0), [1.5, 1.25, 1.375]),
    corner("xb3z", (2, 2), (-0.25, 0.25), [0.1875, 0.125, -0.0625]),
    corner("xb4x", (3, 0), (-0.25, 0.25), [-0.0625, 0.1875, 0.125]),
    corner("xb4y", (3, 1), (-0.25, 0.25), [0.0625, -0.125, 0.1875]),
    corner("xb4z", (3, 2), (1.0, 2.0), [1.375, 1.625, 1.25]),
];

const TETRAHEDRON: Shape = Shape {
    least_dimension: Dimension::Three,
    corners: &["i1", "i2", "i3", "i4"],
    parameters: &damped::<15>(PARAMETERS),
    parts: &[
        elastic(&"youngsmodulus", &names::<13>(PARAMETERS.split_at(1).1)),
        damping(&names::<14>(PARAMETERS)),
    ],
};

pub(in crate::force) static ST_VENANT_KIRCHHOFF: ForceKind = ForceKind {
    schema: schema(
        TETRAHEDRON,
        Described {
            tag: "stvktetrahedron",
            title: "St. Venant–Kirchhoff tetrahedron",
            formula: "`−∂U/∂x`, with `F = (x_i2 − x_i1 \\| x_i3 − x_i1 \\| x_i4 − x_i1) (b_2 − b_1 \\| b_3 − b_1 \\| b_4 − b_1)⁻¹`, `ε = ½ (FᵀF − I)`, `b` the undeformed corners, `μ = E/(2 (1 + ν))`, `λ = E ν/((1 + ν) (1 − 2ν))`",
            by_position: "`−∂²U/∂x²`: `F dS + dF S` with the stress `S = 2μ ε + λ tr ε I`",
            energy: "`U = V̄ (μ ‖ε‖² + λ/2 (tr ε)²)`, with `V̄` the undeformed volume",
            example: r#"<stvktetrahedron i1="0" i2="1" i3="2" i4="3" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb1z="0" xb2x="1" xb2y="0" xb2z="0" xb3x="0" xb3y="1" xb3z="0" xb4x="0" xb4y="0" xb4z="1"/>"#,
        },
    ),
    build_2d: in_space_only,
    build_3d: build::<StVenantKirchhoff<3, 3>>,
};

pub(in crate::force) static COROTATED: ForceKind = ForceKind {
    schema: schema(
        TETRAHEDRON,
        Described {
            tag: "corotatedtetrahedron",
            title: "corotated tetrahedron",
            formula: "`−∂U/∂x`, with `F`, `μ` and `λ` as of `stvktetrahedron`, and `F = R S` its polar decomposition with `det R = 1`",
            by_position: "`−∂²U/∂x²`, with `dR = R [ω]ₓ`: `(tr S I − S) ω` is the axial vector of `RᵀdF − dFᵀR`",
            energy: "`U = V̄ (μ ‖F − R‖² + λ/2 (tr S − 3)²)`",
            example: r#"<corotatedtetrahedron i1="0" i2="1" i3="2" i4="3" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb1z="0" xb2x="1" xb2y="0" xb2z="0" xb3x="0" xb3y="1" xb3z="0" xb4x="0" xb4y="0" xb4z="1"/>"#,
        },
    ),
    build_2d: in_space_only,
    build_3d: build::<Corotated>,
};

pub(in crate::force) static NEO_HOOKEAN: ForceKind = ForceKind {
    schema: schema(
        TETRAHEDRON,
        Described {
            tag: "neohookeantetrahedron",
            title: "stable neo-Hookean tetrahedron",
            formula: "`−∂U/∂x`, with `F`, `μ` and `λ` as of `stvktetrahedron`, `I = ‖F‖²`, `J = det F`, `λ' = λ + 5/6 μ`",
            by_position: "`−∂²U/∂x²`, with the second derivative of `J`",
            energy: "`U = V̄ (2/3 μ (I − 3 − ln((I + 1)/4)) + λ'/2 (J − 1)² − μ (J − 1))`",
            example: r#"<neohookeantetrahedron i1="0" i2="1" i3="2" i4="3" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb1z="0" xb2x="1" xb2y="0" xb2z="0" xb3x="0" xb3y="1" xb3z="0" xb4x="0" xb4y="0" xb4z="1"/>"#,
        },
    ),
    build_2d: in_space_only,
    build_3d: build::<NeoHookean>,
};

fn build<M: Material<3, 3> + 'static>(
    scene: &Scene,
    elements: &[Numbered<'_>],
) -> Box<dyn Force<3>> {
    Box::new(StencilForce::new(scene, elements, Element::<M, 3>::of_tetrahedron))
}

impl<M> Element<M, 3> {
    fn of_tetrahedron(element: &ForceElement) -> Self {
        let corners = element.undeformed();
        let [b1, b2, b3, b4] = [0, 1, 2, 3].map(|corner| Vector3::from(corners[corner]));
        let [u, v, w] = [b2 - b1, b3 - b1, b4 - b1];
        let cofactors = cofactors(&Matrix3::from_columns(&[u, v, w]));
        let determinant = u.dot(&cofactors.column(0));
        let (modulus, nu) = (element.parameter("youngsmodulus"), element.parameter("poissonratio"));
        let lame = Lame {
            mu: modulus / (2.0 * (1.0 + nu)),
            lambda: modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        };
        Self {
            lame,
            volume: determinant.abs() / 6.0,
            inverse: cofactors.transpose() / determinant,
            damping: element.parameter("beta"),
            material: PhantomData,
        }
    }
}

/// `G`.
fn cofactors(f: &Gradient<3, 3>) -> Gradient<3, 3> {
    let [p, q, r] = [0, 1, 2].map(|column| f.column(column));
    Gradient::from_columns(&[q.cross(&r), r.cross(&p), p.cross(&q)])
}

struct Corotated {
    lame: Lame,
    f: Gradient<3, 3>,
    polar: Polar,
}

impl Material<3, 3> for Corotated {
    fn at(lame: Lame, f: Gradient<3, 3>) -> Option<Self> {
        Some(Self { lame, f, polar: Polar::of(&f)? })
    }

    fn energy(&self) -> f64 {
        let (Lame { mu, lambda }, stretch) = (self.lame, self.polar.growth());
        mu * (self.f - self.polar.rotation).norm_squared() + 0.5 * lambda * stretch * stretch
    }

    fn stress(&self) -> Gradient<3, 3> {
        let (Lame { mu, lambda }, rotation) = (self.lame, self.polar.rotation);
        (self.f - rotation) * (2.0 * mu) + rotation * (lambda * self.polar.growth())
    }

    fn change(&self, df: &Gradient<3, 3>) -> Gradient<3, 3> {
        let (Lame { mu, lambda }, rotation) = (self.lame, self.polar.rotation);
        let turn = self.polar.turn(df);
        (df - turn) * (2.0 * mu)
            + rotation * (lambda * rotation.dot(df))
            + turn * (lambda * self.polar.growth())
    }
}

/// The polar decomposition `F = R S`, with `S = W diag(s) Wᵀ`.
struct Polar {
    /// `R`.
    rotation: Matrix3<f64>,
    /// `W`.
    axes: Matrix3<f64>,
    /// `s`, the smallest one last, with the sign of the determinant.
    stretches: [f64; 3],
}

/// A sweep of rotations squares the columns' cosines: six suffice.
const SWEEPS: usize = 20;

impl Polar {
    /// By one-sided Jacobi rotations `F W = U diag(s)`. `None` where two stretches add up to 0.
    fn of(f: &Matrix3<f64>) -> Option<Self> {
        let (mut scaled, mut axes) = (*f, Matrix3::identity());
        for _ in 0..SWEEPS {
            let mut is_orthogonal = true;
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                let (a, b) = (scaled.column(p), scaled.column(q));
                let (product, squared) = (a.dot(&b), [a.norm_squared(), b.norm_squared()]);
                if product.abs() <= f64::EPSILON * (squared[0] * squared[1]).sqrt() {
                    continue;
                }
                is_orthogonal = false;
                let half = (squared[1] - squared[0]) / (2.0 * product);
                let tangent = half.signum() / (half.abs() + (1.0 + half * half).sqrt());
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                for matrix in [&mut scaled, &mut axes] {
                    let (a, b) = (matrix.column(p) * cosine, matrix.column(q) * cosine);
                    matrix.set_column(p, &(a - b * tangent));
                    matrix.set_column(q, &(b + a * tangent));
                }
            }
            if is_orthogonal {
                break;
            }
        }
        let lengths = [0, 1, 2].map(|column| scaled.column(column).norm());
        // Of three columns in cyclic order, the last is the shortest: `W` stays a rotation.
        let last =
            (0..3).fold(0, |least, of| if lengths[of] < lengths[least] { of } else { least });
        let [first, second] = [(last + 1) % 3, (last + 2) % 3];
        let (u, v) =
            (scaled.column(first) / lengths[first], scaled.column(second) / lengths[second]);
        let normal = u.cross(&v);
        let stretches = [lengths[first], lengths[second], normal.dot(&scaled.column(last))];
        let axes = Matrix3::from_columns(&[first, second, last].map(|column| axes.column(column)));
        let rotation = Matrix3::from_columns(&[u, v, normal]) * axes.transpose();
        let least = stretches[0].min(stretches[1]) + stretches[2];
        (least > 0.0).then_some(Self { rotation, axes, stretches })
    }

    /// `tr S − 3`.
    fn growth(&self) -> f64 {
        self.stretches.iter().map(|stretch| stretch - 1.0).sum()
    }

    /// `dR`.
    fn turn(&self, df: &Matrix3<f64>) -> Matrix3<f64> {
        let change = self.rotation.transpose() * df;
        let axial = Vector3::new(
            change[(2, 1)] - change[(1, 2)],
            change[(0, 2)] - change[(2, 0)],
            change[(1, 0)] - change[(0, 1)],
        );
        let [p, q, r] = self.stretches;
        let others = Vector3::new(q + r, p + r, p + q);
        let omega = self.axes * (self.axes.transpose() * axial).component_div(&others);
        self.rotation * omega.cross_matrix()
    }
}

struct NeoHookean {
    mu: f64,
    /// `λ'`.
    bulk: f64,
    f: Gradient<3, 3>,
    /// `I`.
    squared: f64,
    /// `J − 1`.
    growth: f64,
    /// `G`.
    cofactors: Gradient<3, 3>,
}

impl NeoHookean {
    /// `I/(I + 1)`.
    fn hardening(&self) -> f64 {
        self.squared / (self.squared + 1.0)
    }

    /// `∂ψ/∂J`.
    fn pressure(&self) -> f64 {
        self.bulk * self.growth - self.mu
    }
}

impl Material<3, 3> for NeoHookean {
    fn at(Lame { mu, lambda }: Lame, f: Gradient<3, 3>) -> Option<Self> {
        let cofactors = cofactors(&f);
        Some(Self {
            mu,
            bulk: lambda + 5.0 / 6.0 * mu,
            f,
            squared: f.norm_squared(),
            growth: f.column(0).dot(&cofactors.column(0)) - 1.0,
            cofactors,
        })
    }

    fn energy(&self) -> f64 {
        let excess = self.squared - 3.0;
        2.0 / 3.0 * self.mu * (excess - libm::log1p(0.25 * excess))
            + (0.5 * self.bulk * self.growth - self.mu) * self.growth
    }

    fn stress(&self) -> Gradient<3, 3> {
        self.f * (4.0 / 3.0 * self.mu * self.hardening()) + self.cofactors * self.pressure()
    }

    fn change(&self, df: &Gradient<3, 3>) -> Gradient<3, 3> {
        let (larger, [p, q, r]) = (self.squared + 1.0, [0, 1, 2].map(|c| self.f.column(c)));
        let [dp, dq, dr] = [0, 1, 2].map(|column| df.column(column));
        let turn = Gradient::from_columns(&[
            dq.cross(&r) + q.cross(&dr),
            dr.cross(&p) + r.cross(&dp),
            dp.cross(&q) + p.cross(&dq),
        ]);
        let stretch = df * self.hardening() + self.f * (2.0 * self.f.dot(df) / (larger * larger));
        stretch * (4.0 / 3.0 * self.mu)
            + self.cofactors * (self.bulk * self.cofactors.dot(df))
            + turn * self.pressure()
    }
}
