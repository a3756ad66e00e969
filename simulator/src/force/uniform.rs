//! A force that is the same everywhere: the assembly shared by simple gravity and the constant force.
//!
//! ```text
//! U = −Σ w_i f·x_i       F_i = w_i f       ∂F/∂x = ∂F/∂v = 0       w_i = m_i or 1
//! ```

use std::ops::Range;

use super::{Degenerate, Force, Numbered, State, Vector, add_to, vector_of};
use scene::schema::{Dependence, ParameterSchema, PartSchema, Potential};

/// Factor of a uniform force's vector on each particle.
#[derive(Clone, Copy)]
pub(super) enum Weight {
    /// The particle's mass: the vector is an acceleration.
    Mass,
    /// Nothing: the vector is a force.
    One,
}

/// The sum of all elements of one kind.
pub(super) struct Uniform<const D: usize> {
    vector: Vector<D>,
    weight: Weight,
}

impl<const D: usize> Uniform<D> {
    /// The sum of the elements' vectors.
    pub(super) fn new(elements: &[Numbered<'_>], weight: Weight) -> Self {
        let vector_of_element = |(_, element): &Numbered<'_>| -> Vector<D> {
            Vector::from_fn(|axis, _| element.parameter(COMPONENTS[axis]))
        };
        Self { vector: elements.iter().map(vector_of_element).sum(), weight }
    }

    fn on(&self, mass: f64) -> Vector<D> {
        match self.weight {
            Weight::Mass => self.vector * mass,
            Weight::One => self.vector,
        }
    }
}

/// The attributes.
const COMPONENTS: [&str; 3] = ["fx", "fy", "fz"];

/// The attributes `fx fy fz`, whose meanings and samples these are in their order.
pub(super) const fn components(
    meanings: [&'static str; 3],
    samples: [f64; 3],
) -> [ParameterSchema; 3] {
    const TYPICAL: (f64, f64) = (-10.0, 10.0);
    [
        ParameterSchema::new(COMPONENTS[0], meanings[0], TYPICAL, [samples[0]; 3]),
        ParameterSchema::new(COMPONENTS[1], meanings[1], TYPICAL, [samples[1]; 3]),
        ParameterSchema::new(COMPONENTS[2], meanings[2], TYPICAL, [samples[2]; 3])
            .default_to(0.0)
            .in_three_dimensions(),
    ]
}

/// The one part of a uniform force.
pub(super) static PARTS: [PartSchema; 1] = [PartSchema {
    name: "all",
    title: "",
    meaning: "the force",
    scaled_by: &COMPONENTS,
    shaped_by: &[],
    stands_alone: true,
    depends_on: Dependence::NOTHING,
    derives_from: Potential::Energy,
}];

impl<const D: usize> Force<D> for Uniform<D> {
    fn energy(&self, state: State<'_>) -> Option<f64> {
        let of_particle = |(particle, mass): (usize, &f64)| {
            -self.on(*mass).dot(&vector_of(state.positions, particle))
        };
        Some(state.masses.iter().enumerate().map(of_particle).sum())
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        for (place, mass) in state.masses[particles].iter().enumerate() {
            add_to(force, place, &self.on(*mass));
        }
        Ok(())
    }

    fn has_constant_jacobians(&self) -> bool {
        true
    }
}
