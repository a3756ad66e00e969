//! Spring of squared length: the lecture's, whose energy needs no square root.
//!
//! ```text
//! U     = l0² k/2 (l²/l0² − 1)²              l² = |d|²
//! f     = −2 k (l²/l0² − 1) d
//! ∂f/∂d = −2 k/l0² (2 d dᵀ + (l² − l0²) I)
//! ```
//!
//! `(l²/l0² − 1)/2` is the Green strain of the spring. Near its rest length it is four times as stiff as a
//! Hookean spring of the same `k`; it is defined everywhere, at length zero as well. Source: lecture on
//! optimisation time integration, "Mass-Spring Elasticity Energy".

use super::law::PairLaw;
use super::pair::PairForce;
use super::{Block, Force, ForceKind, Numbered, Vector};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "greenspringforce",
        title: "spring of squared length (Green strain)",
        formula: "`F_i = −2 k (l²/l0² − 1) (x_i − x_j)`, `F_j = −F_i`: the gradient of the energy `l0² k/2 (l²/l0² − 1)²`, negated",
        derivatives: Derivatives {
            by_position: "`−2 k/l0² (2 d dᵀ + (l² − l0²) I)`",
            by_velocity: "0",
            energy: "`U = l0² k/2 (l²/l0² − 1)²`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Edge,
        parameters: &[
            ParameterSchema::new("k", "stiffness", (1.0, 10.0), [0.25, 0.375, 0.3125])
                .non_negative(),
            ParameterSchema::new("l0", "rest length", (1.0, 3.0), [1.25, 2.5, 1.125])
                .positive()
                .length(),
        ],
        parts: &[PartSchema::whole(&["k"], &["l0"], Dependence::POSITION, Potential::Energy)],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<greenspringforce edge="0" k="100" l0="1"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::<Vec<_>>::new::<D>(scene, elements, |element, _| GreenSpring {
        stiffness: element.parameter("k"),
        rest_length_squared: element.parameter("l0") * element.parameter("l0"),
    }))
}

#[derive(Clone, Copy)]
struct GreenSpring {
    stiffness: f64,
    rest_length_squared: f64,
}

impl GreenSpring {
    /// `l²/l0² − 1`.
    fn strain(&self, length_squared: f64) -> f64 {
        length_squared / self.rest_length_squared - 1.0
    }
}

impl<const D: usize> PairLaw<D> for GreenSpring {
    const USES_VELOCITY: bool = false;

    fn energy(&self, distance: f64) -> Option<f64> {
        let strain = self.strain(distance * distance);
        Some(0.5 * self.rest_length_squared * self.stiffness * strain * strain)
    }

    fn force(&self, d: &Vector<D>, _w: &Vector<D>) -> Option<Vector<D>> {
        Some(d * (-2.0 * self.stiffness * self.strain(d.norm_squared())))
    }

    fn jacobians(&self, d: &Vector<D>, _w: &Vector<D>) -> Option<(Block<D>, Block<D>)> {
        let stretch = Block::identity() * (d.norm_squared() - self.rest_length_squared);
        let shape = d * d.transpose() * 2.0 + stretch;
        Some((shape * (-2.0 * self.stiffness / self.rest_length_squared), Block::zeros()))
    }
}
