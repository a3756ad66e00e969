//! Vortex: one particle stirs the other around it, and drags it along.
//!
//! With `r = |d|` and `R` the quarter turn `(x, y) → (−y, x)`, which in three dimensions is about the z
//! axis and leaves z alone,
//!
//! ```text
//! f    = kvc (kbs R d / r³ − w / r²)
//! ∂f/∂d = kvc (kbs (R − 3 R n nᵀ) / r³ + 2 w nᵀ / r³)            n = d/r
//! ∂f/∂w = −kvc / r² I
//! ```
//!
//! It has no energy. Source of the force: hand-out of milestone 3, section 11, and the course's
//! definition `F_j = (kvc/r²)(kbs R n̂ − (v_j − v_i))` with `n̂` from i to j. The course gives no
//! Jacobians; these follow from `∂(1/rᵖ)/∂d = −p d/rᵖ⁺²`. Not defined where the two particles are in
//! the same place.

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
        tag: "vortexforce",
        title: "vortex between two particles",
        formula: "`F_i = kvc/l² (kbs R n − w)`, `F_j = −F_i`",
        derivatives: Derivatives {
            by_position: "`kvc/l³ (kbs (R − 3 R n nᵀ) + 2 w nᵀ)`",
            by_velocity: "`−kvc/l² I`",
            energy: "none",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Named(&["i", "j"]),
        parameters: &[
            ParameterSchema::new(
                "kbs",
                "strength of the Biot-Savart rotation",
                (0.1, 10.0),
                [0.75, 1.25, -1.0],
            ),
            ParameterSchema::new(
                "kvc",
                "strength of the viscous coupling",
                (0.1, 10.0),
                [1.5, 1.0, 1.25],
            ),
        ],
        parts: &[
            PartSchema {
                name: "drag",
                title: "drag",
                meaning: "vortices with kbs = 0",
                scaled_by: &["kvc"],
                shaped_by: &[],
                stands_alone: true,
                depends_on: Dependence::STATE,
                derives_from: Potential::Neither,
            },
            PartSchema {
                name: "rotation",
                title: "rotation",
                meaning: "contribution of kbs to vortices",
                scaled_by: &["kbs"],
                shaped_by: &["kvc"],
                stands_alone: false,
                depends_on: Dependence::POSITION,
                derives_from: Potential::Neither,
            },
        ],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::Momentum,
        example: r#"<vortexforce i="0" j="1" kbs="0.8" kvc="1000"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::<Vec<_>>::new::<D>(scene, elements, |element, _| Vortex {
        biot_savart: element.parameter("kbs"),
        viscous: element.parameter("kvc"),
    }))
}

#[derive(Clone, Copy)]
struct Vortex {
    biot_savart: f64,
    viscous: f64,
}

/// The quarter turn about the z axis.
fn quarter_turn<const D: usize>() -> Block<D> {
    let mut turn = Block::identity();
    turn[(0, 0)] = 0.0;
    turn[(1, 1)] = 0.0;
    turn[(0, 1)] = -1.0;
    turn[(1, 0)] = 1.0;
    turn
}

impl<const D: usize> PairLaw<D> for Vortex {
    const USES_VELOCITY: bool = true;

    fn energy(&self, _distance: f64) -> Option<f64> {
        None
    }

    fn force(&self, d: &Vector<D>, w: &Vector<D>) -> Option<Vector<D>> {
        let distance_squared = d.norm_squared();
        if distance_squared == 0.0 {
            return None;
        }
        let turned = quarter_turn() * d / distance_squared.sqrt();
        Some((turned * self.biot_savart - w) * (self.viscous / distance_squared))
    }

    fn jacobians(&self, d: &Vector<D>, w: &Vector<D>) -> Option<(Block<D>, Block<D>)> {
        let distance_squared = d.norm_squared();
        if distance_squared == 0.0 {
            return None;
        }
        let distance = distance_squared.sqrt();
        let n = d / distance;
        let turn = quarter_turn();
        let rotation = (turn - turn * n * n.transpose() * 3.0) * self.biot_savart;
        let drag = w * n.transpose() * 2.0;
        let by_position = (rotation + drag) * (self.viscous / (distance_squared * distance));
        let by_velocity = Block::identity() * (-self.viscous / distance_squared);
        Some((by_position, by_velocity))
    }
}
