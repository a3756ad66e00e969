//! Linear drag: every particle is slowed in proportion to its velocity, whatever its mass.
//!
//! ```text
//! F_i = −b v_i       ∂F/∂x = 0       ∂F_i/∂v_i = −b I
//! ```
//!
//! It has no energy, but a dissipation function `R = b/2 Σ |v_i|²`. Source: hand-out of milestone 2, section 3.3; of milestone 3, section 8.6. Several
//! elements add up.

use std::ops::Range;

use super::{
    Block, Coupling, Degenerate, ElementJacobians, Force, ForceKind, JacobianSink, Numbered, State,
};
use super::{add_to, vector_of};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "dragdamping",
        title: "linear drag",
        formula: "`−b v` on every particle, whatever its mass",
        derivatives: Derivatives {
            by_position: "0",
            by_velocity: "of each particle by itself: `∂F_i/∂v_i = −b I`",
            energy: r"dissipation `b/2 Σ \|v_i\|²`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::EveryParticle,
        parameters: &[
            ParameterSchema::new("b", "damping", (0.1, 10.0), [0.75, 0.5, 1.25]).non_negative()
        ],
        parts: &[PartSchema::whole(&["b"], &[], Dependence::VELOCITY, Potential::Dissipation)],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::Nothing,
        example: r#"<dragdamping b="0.5"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    let damping = elements.iter().map(|(_, element)| element.parameter("b")).sum();
    let n_particles = scene.particles.len();
    Box::new(Drag { damping, n_particles })
}

struct Drag {
    damping: f64,
    n_particles: usize,
}

impl<const D: usize> Force<D> for Drag {
    fn energy(&self, _state: State<'_>) -> Option<f64> {
        None
    }

    fn dissipation(&self, state: State<'_>) -> f64 {
        let squared = state.velocities.iter().map(|component| component * component);
        0.5 * self.damping * squared.sum::<f64>()
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        for (place, particle) in particles.enumerate() {
            add_to(force, place, &(vector_of::<D>(state.velocities, particle) * -self.damping));
        }
        Ok(())
    }

    fn add_jacobians(
        &self,
        _state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        let by_velocity = Block::identity() * -self.damping;
        for particle in 0..self.n_particles {
            sink.add(ElementJacobians::single(&particle, None, &Block::zeros(), &by_velocity));
        }
        Ok(())
    }

    fn has_constant_jacobians(&self) -> bool {
        true
    }

    fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        (0..self.n_particles).map(Coupling::Diagonal).for_each(visit);
    }
}
