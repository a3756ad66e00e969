//! Elastic spring: a bar of a given modulus, whose stiffness is that per length.
//!
//! ```text
//! U = α/(2 l0) (l − l0)²        f, ∂f/∂d: those of a spring of stiffness α/l0 without damping        l = |d|
//! ```
//!
//! `α` is Young's modulus times the cross-section. Source: hand-out of Theme 4, milestone 1.

use super::pair::PairForce;
use super::spring::{Spring, Springs};
use super::{Force, ForceKind, Numbered};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "elasticbodyspringforce",
        title: "elastic spring of an elastic body",
        formula: "`F_i1 = −α/l0 (l − l0) n`, `F_i2 = −F_i1`",
        derivatives: Derivatives {
            by_position: "that of a `springforce` with `k = α/l0`, `b = 0`",
            by_velocity: "0",
            energy: "`U = α/(2 l0) (l − l0)²`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Named(&["i1", "i2"]),
        parameters: &[
            ParameterSchema::new("alpha", "modulus", (1.0, 100.0), [4.0, 6.0, 5.0]).non_negative(),
            ParameterSchema::new("l0", "rest length", (0.5, 2.0), [0.75, 2.5, 0.625])
                .positive()
                .length(),
        ],
        parts: &[PartSchema::whole(&["alpha"], &["l0"], Dependence::POSITION, Potential::Energy)],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<elasticbodyspringforce i1="0" i2="1" alpha="100" l0="0.5"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::<Springs<D>>::new::<D>(scene, elements, |element, _| {
        let rest_length = element.parameter("l0");
        Spring { stiffness: element.parameter("alpha") / rest_length, rest_length, damping: 0.0 }
    }))
}
