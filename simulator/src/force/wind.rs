//! Wind: a force on every particle that changes with time and with where the particle is.
//!
//! ```text
//! F_i = s (3 + 3/2 (1 + cos 5φ), 1 + cos(0.3 + φ), sin φ)       φ = x_i/d + t
//! ∂F_i/∂x_i = s/d (−15/2 sin 5φ, −sin(0.3 + φ), cos φ) e_xᵀ     ∂F/∂v = 0
//! ```
//!
//! with `s` the strength, `x_i` the particle's x in the state that the force is evaluated at, `d` the diagonal of the
//! box around all particles of the scene's initial state, and `t` the time in seconds; where `d` is 0, `φ = t`. In two
//! dimensions the third component is left out. Only the first column of the Jacobian is not zero, so it is not
//! symmetric, and the force has no energy. Cost: three sines a particle.
//!
//! Source: *Computer Graphics – Mass-Spring Systems*, the assignment's program. It evaluates external forces once a
//! step, at its start, and so does `fast-mass-spring`; other methods evaluate wind where they evaluate all forces.
//! Several elements add up.

use std::ops::Range;

use libm::{cos, sin};

use super::{
    Block, Coupling, Degenerate, ElementJacobians, Force, ForceKind, JacobianSink, Numbered, State,
};
use super::{Vector, add_to};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, Particles, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "windforce",
        title: "wind",
        formula: "`strength (3 + 1.5 (1 + cos 5φ), 1 + cos(0.3 + φ), sin φ)` on every particle",
        derivatives: Derivatives {
            by_position: "of each particle by itself: `∂F_i/∂x_i` has one column, that of x: `strength/d (−7.5 sin 5φ, −sin(0.3 + φ), cos φ)`",
            by_velocity: "0",
            energy: "none",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::EveryParticle,
        parameters: &[ParameterSchema::new("strength", "strength", (0.5, 2.0), [0.75, 0.5, 1.25])
            .default_to(1.0)],
        parts: &[PartSchema {
            name: "all",
            title: "",
            meaning: "the force",
            scaled_by: &["strength"],
            shaped_by: &[],
            stands_alone: true,
            depends_on: Dependence::POSITION.or(Dependence::TIME),
            derives_from: Potential::Neither,
        }],
        masses: Masses::None,
        initial: Initial::BoxDiagonal,
        ignored: &[],
        conserves: Conserves::Nothing,
        example: r#"<windforce strength="1"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    let extent = |axis: usize| {
        let along = || scene.particles.iter().map(|particle| particle.position[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let diagonal = (0..D).map(|axis| extent(axis) * extent(axis)).sum::<f64>().sqrt();
    Box::new(Wind {
        strength: elements.iter().map(|(_, element)| element.parameter("strength")).sum(),
        wave_number: if diagonal == 0.0 { 0.0 } else { 1.0 / diagonal },
        n_particles: scene.particles.len(),
    })
}

struct Wind {
    strength: f64,
    /// `1/d`; 0 where `d` is 0.
    wave_number: f64,
    n_particles: usize,
}

impl Wind {
    /// `φ` of a particle.
    fn phase<const D: usize>(&self, state: State<'_>, particle: usize) -> f64 {
        state.positions[particle * D] * self.wave_number + state.time
    }

    /// `s` times the first components.
    fn vector<const D: usize>(&self, components: [f64; 3]) -> Vector<D> {
        Vector::from_fn(|axis, _| self.strength * components[axis])
    }
}

impl<const D: usize> Force<D> for Wind {
    fn energy(&self, _state: State<'_>) -> Option<f64> {
        None
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        for (place, particle) in particles.enumerate() {
            let phi = self.phase::<D>(state, particle);
            let components = [3.0 + 1.5 * (1.0 + cos(5.0 * phi)), 1.0 + cos(0.3 + phi), sin(phi)];
            add_to(force, place, &self.vector::<D>(components));
        }
        Ok(())
    }

    fn add_jacobians(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        if self.wave_number == 0.0 {
            return Ok(());
        }
        for particle in 0..self.n_particles {
            let phi = self.phase::<D>(state, particle);
            let by_phase = self.vector::<D>([-7.5 * sin(5.0 * phi), -sin(0.3 + phi), cos(phi)]);
            let mut by_position = Block::<D>::zeros();
            by_position.set_column(0, &(by_phase * self.wave_number));
            sink.add(ElementJacobians::single(&particle, None, &by_position, &Block::zeros()));
        }
        Ok(())
    }

    fn has_constant_jacobians(&self) -> bool {
        self.wave_number == 0.0
    }

    fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        if self.wave_number != 0.0 {
            let own = |particle| {
                let particles = Particles::from_slice(&[particle]);
                Coupling::Stencil { particles, symmetric: false }
            };
            (0..self.n_particles).map(own).for_each(visit);
        }
    }
}
