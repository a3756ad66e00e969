//! Hinge bending: two triangles on a common edge resist a change of the angle between them, as in discrete shells.
//!
//! ```text
//! e = x_2 − x_1    a = x_3 − x_1    b = x_4 − x_1    n_a = e × a    n_b = b × e
//! θ = atan2(−|e| n_a·b, n_a·n_b), in [−π, π]
//! U = c/2 (θ − θ0)²    c = 6 k |ē|²/Ā
//! ```
//!
//! `θ` is the angle from `n_a` to `n_b` about `e`: 0 where the triangles are in one plane side by side, and positive where
//! they are folded away from their normals. `ē` and `Ā`, the edge and the sum of both areas, are those at the start of the
//! scene. `U` is Grinspun et al.'s `k (θ − θ0)² |ē|/h̄`, with `h̄` a third of the mean of both heights over the edge.
//! With `w(e, a) = |e| n/|n|²` of `n = e × a`, `α = a·e/|e|²` and `β = b·e/|e|²`,
//!
//! ```text
//! ∂θ/∂a = −w(e, a)    ∂θ/∂b = w(e, b)    ∂θ/∂e = −α ∂θ/∂a − β ∂θ/∂b
//! ∂w/∂a = |e|/|n|² (I − 2 n nᵀ/|n|²) [e]ₓ    ∂w/∂e = n eᵀ/(|e| |n|²) − |e|/|n|² (I − 2 n nᵀ/|n|²) [a]ₓ
//! ∂²U = c (∂θ ∂θᵀ + (θ − θ0) ∂²θ)
//! ```
//!
//! Rayleigh's damping adds `β θ'` to `θ − θ0` in the force, with the rate `θ' = ∂θ·v`: at rest it is `−β K v`, with `K` the
//! stiffness matrix, and no rotation feels it.
//!
//! `θ − θ0` is not wrapped to a turn. Where the triangles are folded onto each other, `θ` jumps by a turn, and with it the
//! force: at the fold itself, `θ` is π if `−n_a·b` is 0, and −π if it is −0, as in C. A triangle without an area has no normal,
//! and the force no value.
//!
//! Source: Grinspun, Hirani, Desbrun and Schröder, Discrete shells (2003), section 4.1 for the energy; Tamstorf and
//! Grinspun, Discrete bending forces and their Jacobians (2013), for the derivatives.

use super::finite_element::{BETA, damping, elastic};
use super::stencil::{Local, LocalJacobians, StencilForce, StencilLaw};
use super::{Block, Force, ForceKind, Numbered, Vector, in_space_only};
use scene::schema::{
    Conserves, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, Stencil,
};
use scene::{Dimension, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "hingebendingforce",
        title: "bending of two triangles about their common edge",
        formula: "`−c (θ − θ0) ∂θ/∂x`, `c = 6 k \\|ē\\|²/Ā` of the initial positions; with `e = x_i2 − x_i1`, `a = x_i3 − x_i1`, `b = x_i4 − x_i1`, `n_a = e × a`, `n_b = b × e`: `θ = atan2(−\\|e\\| n_a·b, n_a·n_b)`",
        derivatives: Derivatives {
            by_position: "`−c (∂θ ∂θᵀ + (θ − θ0) ∂²θ)`; `∂θ/∂a = −\\|e\\| n_a/\\|n_a\\|²`, `∂θ/∂b = −\\|e\\| n_b/\\|n_b\\|²`, `∂θ/∂e = −(a·e ∂θ/∂a + b·e ∂θ/∂b)/\\|e\\|²`",
            by_velocity: "`−c β ∂θ ∂θᵀ`, 0 without `beta`",
            energy: "`U = c/2 (θ − θ0)²`",
        },
        least_dimension: Dimension::Three,
        stencil: Stencil::Named(&["i1", "i2", "i3", "i4"]),
        parameters: &[
            ParameterSchema::new(
                "stiffness",
                "bending stiffness",
                (0.1, 2.0),
                [0.125, 0.1875, 0.15625],
            )
            .non_negative(),
            ParameterSchema::new("theta0", "angle at rest", (-1.5, 1.5), [0.375, -0.625, 0.5]),
            BETA,
        ],
        parts: &[elastic(&"stiffness", &["theta0"]), damping(&["stiffness"])],
        masses: Masses::None,
        initial: Initial::Hinge,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<hingebendingforce i1="0" i2="1" i3="2" i4="3" stiffness="0.5" theta0="0"/>"#,
    },
    build_2d: in_space_only,
    build_3d: build,
};

fn build(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<3>> {
    Box::new(StencilForce::new(scene, elements, |element| Hinge {
        stiffness: 2.0 * element.parameter("stiffness") * element.hinge_weight(&scene.particles),
        rest_angle: element.parameter("theta0"),
        damping: element.parameter("beta"),
    }))
}

struct Hinge {
    /// `c`.
    stiffness: f64,
    rest_angle: f64,
    /// `β`.
    damping: f64,
}

impl Hinge {
    /// `θ' = ∂θ·v`; `None` without damping.
    fn rate(&self, of: &Dihedral, at: &Local<3, 3>) -> Option<f64> {
        let along = || of.gradient.iter().zip(&at.w).map(|(gradient, w)| gradient.dot(w)).sum();
        (self.damping > 0.0).then(along)
    }
}

/// The angle, and its derivatives by `e`, `a` and `b`.
struct Dihedral {
    angle: f64,
    gradient: [Vector<3>; 3],
    edge: Vector<3>,
    wings: [Wing; 2],
}

/// A triangle on the edge.
struct Wing {
    /// `a`.
    side: Vector<3>,
    /// `e × a`.
    normal: Vector<3>,
    /// `α`.
    share: f64,
}

impl Wing {
    fn new(edge: Vector<3>, side: Vector<3>) -> Self {
        Self { side, normal: edge.cross(&side), share: side.dot(&edge) / edge.norm_squared() }
    }

    /// `w`.
    fn gradient(&self, edge: &Vector<3>) -> Vector<3> {
        self.normal * (edge.norm() / self.normal.norm_squared())
    }

    /// `∂w/∂e` and `∂w/∂a`.
    fn curvature(&self, edge: &Vector<3>) -> [Block<3>; 2] {
        let (length, squared) = (edge.norm(), self.normal.norm_squared());
        let mirror =
            Block::<3>::identity() - self.normal * self.normal.transpose() * (2.0 / squared);
        let turn = mirror * (length / squared);
        let along = self.normal * edge.transpose() / (length * squared);
        [along - turn * self.side.cross_matrix(), turn * edge.cross_matrix()]
    }

    /// `∂α/∂e`.
    fn slide(&self, edge: &Vector<3>) -> Vector<3> {
        (self.side - edge * (2.0 * self.share)) / edge.norm_squared()
    }
}

impl Dihedral {
    /// `None` where a triangle has no area.
    fn new(&Local { d: [edge, a, b], .. }: &Local<3, 3>) -> Option<Self> {
        let wings = [a, b].map(|side| Wing::new(edge, side));
        if wings.iter().any(|wing| wing.normal.norm_squared() == 0.0) {
            return None;
        }
        let [near, far] = &wings;
        let angle = libm::atan2(-edge.norm() * near.normal.dot(&b), -near.normal.dot(&far.normal));
        let (by_a, by_b) = (-near.gradient(&edge), far.gradient(&edge));
        let by_edge = -(by_a * near.share + by_b * far.share);
        Some(Self { angle, gradient: [by_edge, by_a, by_b], edge, wings })
    }

    /// `∂²θ`.
    fn hessian(&self) -> [[Block<3>; 3]; 3] {
        let mut hessian = [[Block::zeros(); 3]; 3];
        for ((place, wing), sign) in (1..).zip(&self.wings).zip([-1.0, 1.0]) {
            let [by_edge, by_side] = wing.curvature(&self.edge).map(|block| block * sign);
            hessian[place][place] = by_side;
            hessian[place][0] = by_edge;
            hessian[0][place] = by_edge.transpose();
            let slid = self.gradient[place] * wing.slide(&self.edge).transpose();
            hessian[0][0] -= slid + by_edge * wing.share;
        }
        // Each wing's part alone is not symmetric.
        hessian[0][0] = (hessian[0][0] + hessian[0][0].transpose()) * 0.5;
        hessian
    }
}

impl StencilLaw<3, 3> for Hinge {
    const ORIGIN: Option<usize> = Some(0);

    fn energy(&self, at: &Local<3, 3>) -> Option<f64> {
        let change = Dihedral::new(at)?.angle - self.rest_angle;
        Some(0.5 * self.stiffness * change * change)
    }

    fn forces(&self, at: &Local<3, 3>) -> Option<[Vector<3>; 3]> {
        let dihedral = Dihedral::new(at)?;
        let mut change = dihedral.angle - self.rest_angle;
        if let Some(rate) = self.rate(&dihedral, at) {
            change += self.damping * rate;
        }
        Some(dihedral.gradient.map(|gradient| gradient * (-self.stiffness * change)))
    }

    fn jacobians(&self, at: &Local<3, 3>) -> Option<LocalJacobians<3, 3>> {
        let dihedral = Dihedral::new(at)?;
        let (gradient, hessian) = (dihedral.gradient, dihedral.hessian());
        let mut change = dihedral.angle - self.rest_angle;
        // `∂(θ + β θ')/∂x`.
        let mut by_position = gradient;
        let rate = self.rate(&dihedral, at);
        if let Some(rate) = rate {
            change += self.damping * rate;
            for (slope, row) in by_position.iter_mut().zip(&hessian) {
                let turn: Vector<3> = row.iter().zip(&at.w).map(|(block, w)| block * w).sum();
                *slope += turn * self.damping;
            }
        }
        let mut jacobians = LocalJacobians::zeros();
        for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
            let outer = gradient[a] * by_position[b].transpose();
            jacobians.by_position[a][b] = (outer + hessian[a][b] * change) * -self.stiffness;
            if rate.is_some() {
                let outer = gradient[a] * gradient[b].transpose();
                jacobians.by_velocity[a][b] = outer * (-self.stiffness * self.damping);
            }
        }
        Some(jacobians)
    }
}
