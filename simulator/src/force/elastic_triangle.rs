//! Constant strain triangle of St. Venant–Kirchhoff's material in plane stress.
//!
//! ```text
//! B = (b_2 − b_1 | b_3 − b_1)⁻¹ = (e g; f h)    ∇Φ = (x_2 − x_1 | x_3 − x_1) B = (p | q)
//! ε_xx = p·p − 1    ε_yy = q·q − 1    ε_xy = p·q
//! U = k/2 (ε_xx² + 2ν ε_xx ε_yy + ε_yy² + 2 (1 − ν) ε_xy²)    k = E Ā/(1 − ν²)
//! ```
//!
//! `b` are the undeformed corners and `Ā` their area, positive for both orientations. The strain is `∇Φᵀ∇Φ − I`, twice
//! Green's. With `(e, g)` the weights of corner 2 and `(f, h)` of corner 3, `∂p/∂d_a = w_a I` and `∂q/∂d_a = z_a I`,
//!
//! ```text
//! σ_xx = ε_xx + ν ε_yy    σ_yy = ε_yy + ν ε_xx    σ_xy = (1 − ν) ε_xy
//! G^xx_a = 2 w_a p        G^yy_a = 2 z_a q        G^xy_a = z_a p + w_a q
//! f_a = −k (σ_xx G^xx_a + σ_yy G^yy_a + 2 σ_xy G^xy_a)
//! ∂f_a/∂d_b = −k (2 (σ_xx w_a w_b + σ_yy z_a z_b + σ_xy (w_a z_b + z_a w_b)) I
//!             + G^xx_a G^xx_bᵀ + ν (G^xx_a G^yy_bᵀ + G^yy_a G^xx_bᵀ) + G^yy_a G^yy_bᵀ + 2 (1 − ν) G^xy_a G^xy_bᵀ)
//! ```
//!
//! The force is defined everywhere, of flat and of inverted triangles too. In space, the undeformed corners are taken in
//! their own plane; the material is isotropic, so that it does not matter how they are turned in it. Source: hand-out of
//! Theme 4, milestone 1.

use nalgebra::{Matrix2, Vector3};

use super::stencil::{Local, LocalJacobians, StencilForce, StencilLaw};
use super::{Block, Force, ForceKind, Numbered, Vector};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, ForceElement, Scene};

/// A coordinate of an undeformed corner.
pub(super) const fn corner(
    name: &'static str,
    (particle, axis): (usize, usize),
    typical: (f64, f64),
    samples: [f64; 3],
) -> ParameterSchema {
    let meaning = "coordinate of an undeformed corner";
    ParameterSchema::new(name, meaning, typical, samples).coordinate_of(particle, axis)
}

/// The particles of a triangle.
pub(super) const CORNERS: &[&str] = &["i1", "i2", "i3"];

/// The parameters of a triangle.
pub(super) const PARAMETERS: &[ParameterSchema] = &[
    ParameterSchema::new(
        "youngsmodulus",
        "Young's modulus times thickness",
        (1.0, 10.0),
        [0.25, 0.375, 0.3125],
    )
    .non_negative(),
    ParameterSchema::new("poissonratio", "Poisson's ratio", (-0.25, 0.45), [0.25, 0.375, 0.125])
        .except_unit(),
    corner("xb1x", (0, 0), (-0.5, 0.0), [-0.25, -0.125, -0.375]),
    corner("xb1y", (0, 1), (-0.5, 0.0), [-0.375, -0.25, -0.125]),
    corner("xb1z", (0, 2), (-0.25, 0.25), [0.125, -0.0625, -0.125]),
    corner("xb2x", (1, 0), (1.0, 2.0), [0.75, 0.875, 0.625]),
    corner("xb2y", (1, 1), (-0.25, 0.25), [0.125, -0.0625, 0.0625]),
    corner("xb2z", (1, 2), (-0.25, 0.25), [-0.125, 0.0625, 0.1875]),
    corner("xb3x", (2, 0), (-0.25, 0.25), [0.0625, 0.125, -0.0625]),
    corner("xb3y", (2, 1), (1.0, 2.0), [0.625, 0.75, 0.875]),
    corner("xb3z", (2, 2), (-0.25, 0.25), [0.1875, 0.125, -0.0625]),
];

/// Those that do not scale its force.
pub(super) const SHAPE: &[&str] =
    &["poissonratio", "xb1x", "xb1y", "xb1z", "xb2x", "xb2y", "xb2z", "xb3x", "xb3y", "xb3z"];

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "elasticbodycstforce",
        title: "constant strain triangle of an elastic body",
        formula: "`−∂U/∂x`, with `(p \\| q) = (x_i2 − x_i1 \\| x_i3 − x_i1) (b_2 − b_1 \\| b_3 − b_1)⁻¹`, `ε_xx = p·p − 1`, `ε_yy = q·q − 1`, `ε_xy = p·q`, and `b` the undeformed corners",
        derivatives: Derivatives {
            by_position: "`−∂²U/∂x²`, whole: `ε` is quadratic in `x`",
            by_velocity: "0",
            energy: "`U = E Ā/(2 (1 − ν²)) (ε_xx² + 2ν ε_xx ε_yy + ε_yy² + 2 (1 − ν) ε_xy²)`, with `Ā` the undeformed area",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Named(CORNERS),
        parameters: PARAMETERS,
        parts: &[PartSchema::whole(
            &["youngsmodulus"],
            SHAPE,
            Dependence::POSITION,
            Potential::Energy,
        )],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &["ebxx", "ebyy", "ebxy"],
        conserves: Conserves::AngularMomentum,
        example: r#"<elasticbodycstforce i1="0" i2="1" i3="2" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb2x="1" xb2y="0" xb3x="0" xb3y="1"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(StencilForce::new(scene, elements, Triangle::of_element::<D>))
}

struct Triangle {
    /// `k`.
    stiffness: f64,
    poisson_ratio: f64,
    /// `(w_a, z_a)` of corners 2 and 3: the rows of `B`.
    weights: [[f64; 2]; 2],
}

/// The inverse `B` of the undeformed edges, and the undeformed area.
pub(super) fn undeformed<const D: usize>(element: &ForceElement) -> (Matrix2<f64>, f64) {
    let corners = element.undeformed();
    let [b1, b2, b3] = [0, 1, 2].map(|corner| Vector3::from(corners[corner]));
    let (u, v) = (b2 - b1, b3 - b1);
    let edges = if D == 2 || (u.z == 0.0 && v.z == 0.0) {
        Matrix2::new(u.x, v.x, u.y, v.y)
    } else {
        let along = u / u.norm();
        Matrix2::new(u.norm(), along.dot(&v), 0.0, along.cross(&v).norm())
    };
    let determinant = edges[(0, 0)] * edges[(1, 1)] - edges[(0, 1)] * edges[(1, 0)];
    let inverse =
        Matrix2::new(edges[(1, 1)], -edges[(0, 1)], -edges[(1, 0)], edges[(0, 0)]) / determinant;
    (inverse, 0.5 * determinant.abs())
}

impl Triangle {
    fn of_element<const D: usize>(element: &ForceElement) -> Self {
        let (inverse, area) = undeformed::<D>(element);
        let poisson_ratio = element.parameter("poissonratio");
        Self {
            stiffness: element.parameter("youngsmodulus") * area
                / (1.0 - poisson_ratio * poisson_ratio),
            poisson_ratio,
            weights: [0, 1].map(|row| [inverse[(row, 0)], inverse[(row, 1)]]),
        }
    }

    fn strain<const D: usize>(&self, at: &Local<2, D>) -> Strain<D> {
        let [[e, g], [f, h]] = self.weights;
        let (p, q) = (at.d[0] * e + at.d[1] * f, at.d[0] * g + at.d[1] * h);
        let (xx, yy, xy) = (p.norm_squared() - 1.0, q.norm_squared() - 1.0, p.dot(&q));
        let nu = self.poisson_ratio;
        let stress = [xx + nu * yy, yy + nu * xx, (1.0 - nu) * xy];
        let gradients = self.weights.map(|[w, z]| [p * (2.0 * w), q * (2.0 * z), p * z + q * w]);
        Strain { strain: [xx, yy, xy], stress, gradients }
    }
}

/// Strain and stress, the latter without `k`: the components xx, yy and xy.
struct Strain<const D: usize> {
    strain: [f64; 3],
    stress: [f64; 3],
    /// The derivatives of each component of the strain by corners 2 and 3.
    gradients: [[Vector<D>; 3]; 2],
}

impl<const D: usize> StencilLaw<2, D> for Triangle {
    const ORIGIN: Option<usize> = Some(0);

    fn energy(&self, at: &Local<2, D>) -> Option<f64> {
        let Strain { strain: [xx, yy, xy], .. } = self.strain(at);
        let nu = self.poisson_ratio;
        let sum = xx * xx + 2.0 * nu * xx * yy + yy * yy + 2.0 * (1.0 - nu) * xy * xy;
        Some(0.5 * self.stiffness * sum)
    }

    fn forces(&self, at: &Local<2, D>) -> Option<[Vector<D>; 2]> {
        let Strain { stress: [xx, yy, xy], gradients, .. } = self.strain(at);
        let pull = |[gx, gy, gxy]: [Vector<D>; 3]| gx * xx + gy * yy + gxy * (2.0 * xy);
        Some(gradients.map(|gradients| pull(gradients) * -self.stiffness))
    }

    fn jacobians(&self, at: &Local<2, D>) -> Option<LocalJacobians<2, D>> {
        let Strain { stress: [xx, yy, xy], gradients, .. } = self.strain(at);
        let nu = self.poisson_ratio;
        let mut jacobians = LocalJacobians::zeros();
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let ([w, z], [other_w, other_z]) = (self.weights[a], self.weights[b]);
            let mixed = w * other_z + z * other_w;
            let turned = xx * w * other_w + yy * z * other_z + xy * mixed;
            let ([gx, gy, gxy], [hx, hy, hxy]) =
                (gradients[a], gradients[b].map(|gradient| gradient.transpose()));
            let hessian = Block::identity() * (2.0 * turned)
                + gx * hx
                + (gx * hy + gy * hx) * nu
                + gy * hy
                + gxy * hxy * (2.0 * (1.0 - nu));
            jacobians.by_position[a][b] = hessian * -self.stiffness;
        }
        Some(jacobians)
    }
}
