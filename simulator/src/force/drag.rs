//! Linear drag: every particle is slowed in proportion to its velocity, whatever its mass, or in proportion to its mass,
//! which is the part of Rayleigh's damping `α M + β K` that needs no elastic body.
//!
//! ```text
//! F_i = −c_i v_i       ∂F/∂x = 0       ∂F_i/∂v_i = −c_i I       c_i = b or α m_i
//! ```
//!
//! It has no energy, but a dissipation function `R = ½ Σ c_i |v_i|²`. Source: hand-out of milestone 2, section 3.3; of milestone 3, section 8.6. Several
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

pub(super) static BY_MASS: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "massdamping",
        title: "damping in proportion to mass",
        formula: "`−alpha m v` on every particle",
        derivatives: Derivatives {
            by_position: "0",
            by_velocity: "of each particle by itself: `∂F_i/∂v_i = −alpha m_i I`",
            energy: r"dissipation `alpha/2 Σ m_i \|v_i\|²`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::EveryParticle,
        parameters: &[ParameterSchema::new(
            "alpha",
            "damping per mass, per second",
            (0.1, 10.0),
            [0.75, 0.5, 1.25],
        )
        .non_negative()],
        parts: &[PartSchema::whole(&["alpha"], &[], Dependence::VELOCITY, Potential::Dissipation)],
        masses: Masses::Own,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::Nothing,
        example: r#"<massdamping alpha="0.5"/>"#,
    },
    build_2d: build_by_mass::<2>,
    build_3d: build_by_mass::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    let damping = elements.iter().map(|(_, element)| element.parameter("b")).sum();
    Box::new(Drag { damping: vec![damping; scene.particles.len()] })
}

fn build_by_mass<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    let alpha: f64 = elements.iter().map(|(_, element)| element.parameter("alpha")).sum();
    Box::new(Drag { damping: scene.particles.iter().map(|each| alpha * each.mass).collect() })
}

struct Drag {
    /// `c`, by particle.
    damping: Vec<f64>,
}

impl<const D: usize> Force<D> for Drag {
    fn energy(&self, _state: State<'_>) -> Option<f64> {
        None
    }

    fn dissipation(&self, state: State<'_>) -> f64 {
        let velocities = state.velocities.chunks_exact(D);
        let squared = |v: &[f64]| v.iter().map(|component| component * component).sum::<f64>();
        0.5 * self.damping.iter().zip(velocities).map(|(c, v)| c * squared(v)).sum::<f64>()
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        for (place, particle) in particles.enumerate() {
            let damping = -self.damping[particle];
            add_to(force, place, &(vector_of::<D>(state.velocities, particle) * damping));
        }
        Ok(())
    }

    fn add_jacobians(
        &self,
        _state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        for (particle, damping) in self.damping.iter().enumerate() {
            let by_velocity = Block::identity() * -damping;
            sink.add(ElementJacobians::single(&particle, None, &Block::zeros(), &by_velocity));
        }
        Ok(())
    }

    fn has_constant_jacobians(&self) -> bool {
        true
    }

    fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        (0..self.damping.len()).map(Coupling::Diagonal).for_each(visit);
    }
}
