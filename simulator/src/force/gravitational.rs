//! Gravitation between two particles.
//!
//! ```text
//! U    = −G m_i m_j / l                    l = |d|,  n = d/l
//! f    = −G m_i m_j / l² n
//! ∂f/∂d = −G m_i m_j / l³ (I − 3 n nᵀ)
//! ```
//!
//! Source: hand-out of milestone 2, section 3.2; of milestone 3, section 8.5. Not defined where the two
//! particles are in the same place.

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
        tag: "gravitationalforce",
        title: "gravitation between two particles",
        formula: "`F_i = −G m_i m_j / l² n`, `F_j = −F_i`",
        derivatives: Derivatives {
            by_position: "`−G m_i m_j/l³ (I − 3 n nᵀ)`",
            by_velocity: "0",
            energy: "`U = −G m_i m_j/l`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Named(&["i", "j"]),
        parameters: &[ParameterSchema::new(
            "G",
            "gravitational constant",
            (0.1, 10.0),
            [0.5, 0.75, 0.625],
        )],
        parts: &[PartSchema::whole(&["G"], &[], Dependence::POSITION, Potential::Energy)],
        masses: Masses::Product,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<gravitationalforce i="0" j="1" G="0.000118419"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::<Vec<_>>::new::<D>(scene, elements, |element, [i, j]| {
        let masses = scene.particles[i].mass * scene.particles[j].mass;
        Gravitation { strength: element.parameter("G") * masses }
    }))
}

/// `strength` is `G m_i m_j`.
#[derive(Clone, Copy)]
struct Gravitation {
    strength: f64,
}

impl<const D: usize> PairLaw<D> for Gravitation {
    const USES_VELOCITY: bool = false;

    fn energy(&self, distance: f64) -> Option<f64> {
        Some(-self.strength / distance)
    }

    fn force(&self, d: &Vector<D>, _w: &Vector<D>) -> Option<Vector<D>> {
        let distance = d.norm();
        if distance == 0.0 {
            return None;
        }
        let n = d * (1.0 / distance);
        Some(n * -(self.strength / (distance * distance)))
    }

    fn jacobians(&self, d: &Vector<D>, _w: &Vector<D>) -> Option<(Block<D>, Block<D>)> {
        let distance = d.norm();
        if distance == 0.0 {
            return None;
        }
        let n = d * (1.0 / distance);
        let shape = Block::identity() - n * n.transpose() * 3.0;
        let strength = self.strength / (distance * distance * distance);
        Some((shape * -strength, Block::zeros()))
    }
}
