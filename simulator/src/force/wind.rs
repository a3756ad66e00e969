//! Wind: a force on every particle that changes with time and with where the particle started.
//!
//! ```text
//! F_i = s (3 + 3/2 (1 + cos 5φ), 1 + cos(0.3 + φ), sin φ)       φ = x_i(0)/d + t
//! U = −Σ F_i·x_i       ∂F/∂x = ∂F/∂v = 0
//! ```
//!
//! with `s` the strength, `x_i(0)` the particle's x in the scene's initial state, `d` the diagonal of the
//! box around all particles of that state, and `t` the time in seconds; where `d` is 0, `φ = t`. In two
//! dimensions the third component is left out. The force does not depend on the state, and so `U` is a
//! potential, but that of the moment: energy is not conserved. Cost: three sines a particle. Source:
//! *Computer Graphics – Mass-Spring Systems*, the assignment's program. Several elements add up.

use std::ops::Range;

use libm::{cos, sin};

use super::{Degenerate, Force, ForceKind, Numbered, State};
use super::{Vector, add_to, vector_of};
use crate::scene::Scene;
use crate::scene::schema::{
    ActsOn, Dependence, ForceSchema, Masses, ParameterSchema, PartSchema, Potential,
};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "windforce",
        title: "wind",
        formula: "`strength (3 + 1.5 (1 + cos 5φ), 1 + cos(0.3 + φ), sin φ)` on every particle",
        acts_on: ActsOn::EveryParticle,
        parameters: &[ParameterSchema::new("strength", "strength", (0.5, 2.0), [0.75, 0.5, 1.25])
            .default_to(1.0)],
        parts: &[PartSchema {
            name: "all",
            title: "",
            meaning: "the force",
            scaled_by: &["strength"],
            shaped_by: &[],
            stands_alone: true,
            depends_on: Dependence::TIME,
            derives_from: Potential::Energy,
        }],
        masses: Masses::None,
        central: false,
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
    let phase = |x: f64| if diagonal == 0.0 { 0.0 } else { x / diagonal };
    Box::new(Wind {
        strength: elements.iter().map(|(_, element)| element.parameter("strength")).sum(),
        phases: scene.particles.iter().map(|particle| phase(particle.position[0])).collect(),
    })
}

struct Wind {
    strength: f64,
    /// `x_i(0)/d` of each particle.
    phases: Vec<f64>,
}

impl Wind {
    /// The force on each of these particles, in their order.
    fn forces<const D: usize>(
        &self,
        particles: Range<usize>,
        time: f64,
    ) -> impl Iterator<Item = Vector<D>> {
        self.phases[particles].iter().map(move |phase| {
            let phi = phase + time;
            let force = [3.0 + 1.5 * (1.0 + cos(5.0 * phi)), 1.0 + cos(0.3 + phi), sin(phi)];
            Vector::from_fn(|axis, _| self.strength * force[axis])
        })
    }
}

impl<const D: usize> Force<D> for Wind {
    fn energy(&self, state: State<'_>) -> Option<f64> {
        let of_particle = |(particle, force): (usize, Vector<D>)| {
            -force.dot(&vector_of(state.positions, particle))
        };
        let forces = self.forces(0..self.phases.len(), state.time);
        Some(forces.enumerate().map(of_particle).sum())
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        for (place, of_particle) in self.forces::<D>(particles, state.time).enumerate() {
            add_to(force, place, &of_particle);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::{ParseOptions, xml};
    use crate::system::System;
    use crate::vocabulary;

    const SCENE: &str = r#"<scene>
        <duration time="1"/><integrator type="symplectic-euler" dt="0.1"/>
        <particle m="2" px="-1" py="5" pz="1" vx="0" vy="0" fixed="0"/>
        <particle m="3" px="1" py="6" pz="3" vx="0" vy="0" fixed="0"/>
        <particle m="3" px="0" py="6" pz="3" vx="0" vy="0" fixed="1"/>
        <windforce/>
        <windforce strength="0.5"/>
    </scene>"#;

    fn scene(text: &str) -> crate::scene::Scene {
        xml::parse(text, "wind.xml", &vocabulary(), &ParseOptions::default()).unwrap().scene
    }

    fn assert_close(values: &[f64], expected: &[f64]) {
        assert_eq!(values.len(), expected.len());
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{values:?} {expected:?}");
        }
    }

    /// The formula at phase `phi`, for a strength of 1.5 in all.
    fn wind(phi: f64) -> [f64; 3] {
        let x = 4.5 + 1.5 * (5.0 * phi).cos();
        [x, (0.3 + phi).cos() + 1.0, phi.sin()].map(|component| 1.5 * component)
    }

    #[test]
    fn it_depends_on_time_and_on_where_a_particle_started() {
        // The box is 2 × 1 × 2, and its diagonal 3. Where the particles are by now does not matter.
        let system = System::<3>::new(&scene(SCENE));
        let mut force = [0.0; 9];
        system.force(&[7.0; 9], &[0.0; 9], 0.75, &mut force).unwrap();
        let third = 1.0 / 3.0;
        let expected = [wind(0.75 - third), wind(0.75 + third), [0.0; 3]].concat();
        assert_close(&force, &expected);
    }

    #[test]
    fn in_two_dimensions_the_box_and_the_force_are_flat() {
        let flat = SCENE.replace(r#"pz="1""#, "").replace(r#"pz="3""#, "");
        let system = System::<2>::new(&scene(&flat));
        let mut force = [0.0; 6];
        system.force(&[0.0; 6], &[0.0; 6], 0.25, &mut force).unwrap();
        let fifth = 1.0 / 5.0_f64.sqrt();
        let expected = [wind(0.25 - fifth), wind(0.25 + fifth), [0.0; 3]];
        assert_close(&force, &expected.map(|[x, y, _]| [x, y]).concat());
    }

    #[test]
    fn a_single_particle_feels_the_time_alone() {
        let single = r#"<scene><duration time="1"/><integrator type="implicit" dt="0.1"/>
            <particle m="1" px="4" py="0" pz="0" vx="0" vy="0" fixed="0"/>
            <windforce strength="1.5"/></scene>"#;
        let system = System::<3>::new(&scene(single));
        let mut force = [0.0; 3];
        system.force(&[4.0, 0.0, 0.0], &[0.0; 3], 0.5, &mut force).unwrap();
        assert_close(&force, &wind(0.5));
    }

    #[test]
    fn its_potential_is_that_of_the_moment() {
        let system = System::<3>::new(&scene(SCENE));
        let positions: Vec<f64> = (0..9).map(f64::from).collect();
        let energy = |positions: &[f64]| system.potential_energy(positions, &[0.0; 9], 0.75);
        let mut force = [0.0; 9];
        system.force(&positions, &[0.0; 9], 0.75, &mut force).unwrap();
        for axis in 0..6 {
            // It is linear in the positions: differences are exact but for rounding.
            let mut moved = positions.clone();
            moved[axis] += 1.0;
            let slope = energy(&moved) - energy(&positions);
            assert!((slope + force[axis]).abs() < 1e-11, "{axis}: {slope} {}", force[axis]);
        }
    }
}
