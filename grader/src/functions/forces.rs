//! Values of a force that functions return: by the law of `reference`, at the states of `white_box`, one element a call.
//!
//! ```text
//! arguments    D, then masses, positions, velocities of the element's particles, its parameters in the order of the schema
//! ```
//!
//! Particles are those that the element acts on, in its order; one for a field. Time is 0.

use reference::law::{self, Expectation, Law, Scale};
use scene::schema::Stencil;
use scene::{Edge, ForceElement, Scene};
use simulator::force::{self, ForceKind};

use super::Call;
use crate::white_box::{CheckState, states};

/// Rounding errors of a value, in `ε` times the size of its terms: some ten operations by another formula, with a margin of a
/// hundred. Mistakes of a part in a million are far above it.
const ROUNDINGS: f64 = 1024.0;

/// Random states, besides the hard ones.
const RANDOM: u32 = 8;

/// Something of a force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceQuantity {
    tag: &'static str,
    gives: Gives,
}

/// The value that a function returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gives {
    /// The force on each particle.
    Force,
    /// The potential energy.
    Energy,
    /// Its gradient, minus the force.
    Gradient,
    /// The derivative of the force by the positions.
    JacobianX,
    /// The derivative of the force by the velocities.
    JacobianV,
    /// The derivative of the gradient by the positions.
    HessianX,
    /// The derivative of the gradient by the velocities.
    HessianV,
}

impl Gives {
    /// All.
    pub(super) const ALL: [Self; 7] = [
        Self::Force,
        Self::Energy,
        Self::Gradient,
        Self::JacobianX,
        Self::JacobianV,
        Self::HessianX,
        Self::HessianV,
    ];

    /// Its name in packs.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Energy => "energy",
            Self::Gradient => "gradient",
            Self::JacobianX => "jacobian-x",
            Self::JacobianV => "jacobian-v",
            Self::HessianX => "hessian-x",
            Self::HessianV => "hessian-v",
        }
    }

    fn size(self, scale: &Scale) -> f64 {
        match self {
            Self::Force | Self::Gradient => scale.force,
            Self::Energy => scale.energy,
            Self::JacobianX | Self::HessianX => scale.by_position,
            Self::JacobianV | Self::HessianV => scale.by_velocity,
        }
    }
}

impl ForceQuantity {
    pub(super) fn parse(tag: &str, gives: &str) -> Result<Self, String> {
        let kind = force::REGISTRY.iter().find(|kind| kind.schema.tag == tag);
        let kind = kind.filter(|kind| is_of_own_particles(kind) && law::find(tag).is_some());
        let kind = kind.ok_or_else(|| {
            let tags = force::REGISTRY.iter().filter(|kind| is_of_own_particles(kind));
            let tags: Vec<&str> = tags.map(|kind| kind.schema.tag).collect();
            let (tags, own) = (tags.join(", "), super::fast_mass_spring::OWNER);
            format!("there is nothing called {tag:?}\n  help: name a force ({tags}) or {own}")
        })?;
        let gives =
            Gives::ALL.into_iter().find(|known| known.name() == gives).ok_or_else(|| {
                let names = Gives::ALL.map(Gives::name).join(", ");
                format!("{tag} gives no {gives:?}\n  help: it gives {names}")
            })?;
        let quantity = Self { tag: kind.schema.tag, gives };
        if quantity.calls().is_empty() {
            return Err(format!(
                "{tag} has no {}\n  help: grade something else of it",
                gives.name()
            ));
        }
        Ok(quantity)
    }

    /// Its calls, in the plane if the force exists there.
    pub(super) fn calls(self) -> Vec<Call> {
        let kind = force::REGISTRY.iter().copied().find(|kind| kind.schema.tag == self.tag);
        let (Some(kind), Some(law)) = (kind, law::find(self.tag)) else { return Vec::new() };
        let states = states(kind, kind.schema.least_dimension, RANDOM, 1);
        states.iter().filter_map(|state| self.call(law, state)).collect()
    }

    /// The call for the first element of a state; `None` where it has no value.
    fn call(self, law: &'static Law, state: &CheckState) -> Option<Call> {
        let scene = alone(&state.scene, law.size());
        let (x, v) = (scene.positions(), scene.velocities());
        let axes = scene.dimension.count();
        let expectation = Expectation::new(law, &scene);
        let negative = |values: &mut Vec<f64>| values.iter_mut().for_each(|value| *value = -*value);
        let mut expected: Vec<f64> = match self.gives {
            Gives::Force | Gives::Gradient => expectation.force(&x, &v, 0.0),
            Gives::Energy => vec![expectation.energy(&x, &v, 0.0)?],
            Gives::JacobianX | Gives::HessianX => {
                let matrix = expectation.jacobians(&x, &v, 0.0).by_position;
                matrix.transpose().iter().copied().collect()
            }
            Gives::JacobianV | Gives::HessianV => {
                let matrix = expectation.jacobians(&x, &v, 0.0).by_velocity;
                matrix.transpose().iter().copied().collect()
            }
        };
        if matches!(self.gives, Gives::Gradient | Gives::HessianX | Gives::HessianV) {
            negative(&mut expected);
        }
        let scales = expectation.scales(&x, &v, 0.0);
        let scale = scales.iter().map(|scale| self.gives.size(scale)).fold(0.0, f64::max);
        let rows = if self.gives == Gives::Energy { 1 } else { x.len() };
        let masses = scene.particles.iter().map(|particle| particle.mass);
        let parameters = scene.forces[0].parameters.iter().copied();
        let arguments = [axes as f64].into_iter().chain(masses).chain(x).chain(v);
        let is_finite = expected.iter().all(|value| value.is_finite());
        is_finite.then(|| Call {
            state: state.name.clone(),
            arguments: arguments.chain(parameters).collect(),
            rows,
            bounds: vec![ROUNDINGS * f64::EPSILON * scale; expected.len()],
            expected,
            at_least: Vec::new(),
            block: axes,
        })
    }
}

/// Whether a force depends on nothing but the particles of an element.
fn is_of_own_particles(kind: &ForceKind) -> bool {
    !(kind.schema.stencil.is_field() && kind.schema.depends_on().position)
}

/// The scene of the first element alone, on as many particles as it acts on.
fn alone(scene: &Scene, size: usize) -> Scene {
    let element = &scene.forces[0];
    let schema = element.schema;
    let is_field = schema.stencil.is_field();
    let particles: Vec<usize> =
        if is_field { (0..size).collect() } else { element.particles.to_vec() };
    let own: Vec<usize> = (0..size).collect();
    let edge = (schema.stencil == Stencil::Edge).then_some(0);
    let acts_on: &[usize] = if is_field { &[] } else { &own };
    let edges = scene.edges.iter().take(1).map(|edge| Edge { particles: [0, 1], ..edge.clone() });
    Scene {
        particles: particles.iter().map(|number| scene.particles[*number].clone()).collect(),
        edges: if edge.is_some() { edges.collect() } else { Vec::new() },
        forces: vec![ForceElement::new(schema, acts_on, edge, element.parameters.clone())],
        ..scene.clone()
    }
}

#[cfg(test)]
mod tests {
    use scene::schema::Potential;

    use super::*;
    use crate::white_box::simulated;

    #[test]
    fn each_force_with_an_energy_has_that_of_the_simulator_by_its_law() {
        for kind in force::REGISTRY {
            let tag = kind.schema.tag;
            let mut parts = kind.schema.parts.iter();
            let has_energy = parts.any(|part| part.derives_from == Potential::Energy);
            let quantity = ForceQuantity { tag, gives: Gives::Energy };
            assert_eq!(
                !quantity.calls().is_empty(),
                has_energy,
                "{tag}: grader/reference/src/law/energy.rs lists the energies of forces that derive from one, and of no others"
            );
            let law = law::find(tag).unwrap();
            for state in &states(kind, kind.schema.least_dimension, RANDOM, 1) {
                let scene = alone(&state.scene, law.size());
                let (x, v) = (scene.positions(), scene.velocities());
                let simulated = simulated(&scene).energy(&x, &v, 0.0).filter(|u| u.is_finite());
                let call = quantity.call(law, state);
                let state = &state.name;
                assert_eq!(call.is_some(), simulated.is_some(), "{tag} at {state}");
                if let (Some(call), Some(simulated)) = (call, simulated) {
                    let error = (call.expected[0] - simulated).abs();
                    assert!(error <= call.bounds[0], "{tag} at {state}: off by {error:e}");
                }
            }
        }
    }
}
