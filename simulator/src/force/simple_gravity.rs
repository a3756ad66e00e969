//! Simple gravity: one acceleration `g` for every particle.
//!
//! ```text
//! U = −Σ m_i g·x_i       F_i = m_i g       ∂F/∂x = ∂F/∂v = 0
//! ```
//!
//! Source: hand-out of milestone 3, section 8.2. The attributes are called `fx`, `fy`, and are
//! accelerations. Several elements add up.

use super::uniform::{PARTS, Uniform, Weight, components};
use super::{Force, ForceKind, Numbered};
use scene::schema::{Conserves, Derivatives, ForceSchema, Initial, Masses, Stencil};
use scene::{Dimension, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "simplegravity",
        title: "simple gravity",
        formula: "`m (fx, fy)` on every particle: an acceleration",
        derivatives: Derivatives {
            by_position: "0",
            by_velocity: "0",
            energy: "`U = −Σ m_i g·x_i`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::EveryParticle,
        parameters: &components(
            ["acceleration along x", "acceleration along y", "acceleration along z"],
            [0.5, -1.25, 0.75],
        ),
        parts: &PARTS,
        masses: Masses::Own,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::Nothing,
        example: r#"<simplegravity fx="0" fy="-9.81"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(_scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(Uniform::<D>::new(elements, Weight::Mass))
}
