//! A force between three particles, for tests of elements of more than two: a bending spring, which resists a change of
//! the angle at its second particle.
//!
//! ```text
//! a = x_i − x_j,  b = x_k − x_j,  c = n_a · n_b         the cosine of the angle
//! U = k/2 (c − c0)²                                    g_a = ∂c/∂a = (n_b − c n_a)/|a|
//! f_a = −k (c − c0) g_a,  ∂f_a/∂b = −k (g_a g_bᵀ + (c − c0) ∂²c/∂a∂b)
//! ```

use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, Scene};
use simulator::force::stencil::{Local, LocalJacobians, StencilForce, StencilLaw};
use simulator::force::{Block, Force, ForceKind, Numbered, Vector};

pub(crate) static BENDING: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "testbendingforce",
        title: "bending spring",
        formula: "`F = −∂U/∂x` of `U = k/2 (c − c0)²`, with `c` the cosine of the angle at `j`",
        derivatives: Derivatives { by_position: "", by_velocity: "", energy: "" },
        least_dimension: Dimension::Two,
        stencil: Stencil::Named(&["i", "j", "k"]),
        parameters: &[
            ParameterSchema::new("stiffness", "stiffness", (0.5, 2.0), [0.75, 0.5, 1.25])
                .non_negative(),
            ParameterSchema::new("c0", "cosine at rest", (-1.0, 1.0), [0.25, -0.5, 0.75]),
        ],
        parts: &[PartSchema::whole(
            &["stiffness"],
            &["c0"],
            Dependence::POSITION,
            Potential::Energy,
        )],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<testbendingforce i="0" j="1" k="2" stiffness="2" c0="-1"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(StencilForce::new(scene, elements, |element| Bending {
        stiffness: element.parameter("stiffness"),
        rest: element.parameter("c0"),
    }))
}

struct Bending {
    stiffness: f64,
    rest: f64,
}

/// The arms' directions and lengths, and their cosine.
struct Arms<const D: usize> {
    n: [Vector<D>; 2],
    length: [f64; 2],
    cosine: f64,
}

impl<const D: usize> Arms<D> {
    fn of(d: &[Vector<D>; 2]) -> Option<Self> {
        let length = d.map(|d| d.norm());
        let n = [d[0] / length[0], d[1] / length[1]];
        length.iter().all(|length| *length > 0.0).then(|| Self {
            n,
            length,
            cosine: n[0].dot(&n[1]),
        })
    }

    fn gradient(&self) -> [Vector<D>; 2] {
        let [n, m] = self.n;
        [(m - n * self.cosine) / self.length[0], (n - m * self.cosine) / self.length[1]]
    }
}

impl<const D: usize> StencilLaw<2, D> for Bending {
    const ORIGIN: Option<usize> = Some(1);

    fn energy(&self, at: &Local<2, D>) -> Option<f64> {
        let bent = Arms::of(&at.d).map_or(f64::NAN, |arms| arms.cosine) - self.rest;
        Some(0.5 * self.stiffness * bent * bent)
    }

    fn forces(&self, at: &Local<2, D>) -> Option<[Vector<D>; 2]> {
        let arms = Arms::of(&at.d)?;
        Some(arms.gradient().map(|g| g * (-self.stiffness * (arms.cosine - self.rest))))
    }

    fn jacobians(&self, at: &Local<2, D>) -> Option<LocalJacobians<2, D>> {
        let arms = Arms::of(&at.d)?;
        let (g, c) = (arms.gradient(), arms.cosine);
        let mut jacobians = LocalJacobians::zeros();
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (n, m) = (arms.n[a], arms.n[b]);
            let curvature = if a == b {
                let across = Block::identity() - n * n.transpose();
                let mixed = g[a] * n.transpose() + n * g[a].transpose();
                (mixed * arms.length[a] + across * c) / -arms.length[a].powi(2)
            } else {
                let across = Block::identity() - m * m.transpose();
                (across - n * (n - m * c).transpose()) / (arms.length[a] * arms.length[b])
            };
            jacobians.by_position[a][b] =
                (g[a] * g[b].transpose() + curvature * (c - self.rest)) * -self.stiffness;
        }
        Some(jacobians)
    }
}
