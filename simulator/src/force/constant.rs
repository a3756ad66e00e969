//! Constant force: one force `f` for every particle, whatever its mass.
//!
//! ```text
//! U = −Σ f·x_i       F_i = f       ∂F/∂x = ∂F/∂v = 0
//! ```
//!
//! Source: the course's scene schema. Several elements add up.

use super::uniform::{PARTS, Uniform, Weight, components};
use super::{Force, ForceKind, Numbered};
use scene::schema::{Conserves, Derivatives, ForceSchema, Initial, Masses, Stencil};
use scene::{Dimension, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "constantforce",
        title: "constant force",
        formula: "`(fx, fy)` on every particle",
        derivatives: Derivatives {
            by_position: "0", by_velocity: "0", energy: "`U = −Σ f·x_i`"
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::EveryParticle,
        parameters: &components(
            ["force along x", "force along y", "force along z"],
            [-0.75, 1.5, 0.625],
        ),
        parts: &PARTS,
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::Nothing,
        example: r#"<constantforce fx="0.5" fy="-1"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(_scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(Uniform::<D>::new(elements, Weight::One))
}
