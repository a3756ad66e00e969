//! Forces of a whole scene by the reference laws, for checks of step equations.

use nalgebra::DVector;
use simulator::scene::Scene;

use crate::law::{self, Expectation, Law};

/// The laws of a scene's forces, one kind at a time.
pub struct Laws {
    parts: Vec<(&'static Law, Scene)>,
}

/// Magnitudes of the terms of a particle's force and its derivatives, in the scene's units.
#[derive(Debug, Clone, Copy, Default)]
pub struct Magnitude {
    /// Of a component of the force.
    pub force: f64,
    /// Of an entry of `∂F/∂x`.
    pub by_position: f64,
    /// Of an entry of `∂F/∂v`.
    pub by_velocity: f64,
}

impl Laws {
    /// The laws of the scene's forces. Every registered force has one.
    pub fn new(scene: &Scene) -> Self {
        let kinds = simulator::force::REGISTRY.iter().filter_map(|kind| {
            let law = law::find(kind.schema.tag)?;
            let mut part = scene.clone();
            part.forces.retain(|force| force.schema.tag == kind.schema.tag);
            (!part.forces.is_empty()).then_some((law, part))
        });
        Self { parts: kinds.collect() }
    }

    /// The force on every particle, `n·D`, fixed ones included.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        self.sum(x.len(), |law| law.force(x, v, time))
    }

    /// The derivative of the force as `(x, v)` moves along `(dx, dv)`.
    pub fn along(&self, [x, v]: [&[f64]; 2], [dx, dv]: [&[f64]; 2], time: f64) -> Vec<f64> {
        self.sum(x.len(), |law| law.along([x, v], [dx, dv], time))
    }

    /// The magnitudes for every particle.
    pub fn magnitudes(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Magnitude> {
        let mut sums = Vec::new();
        for (law, scene) in &self.parts {
            let scales = Expectation::new(law, scene).scales_of_rounded(x, v, time);
            sums.resize(scales.len(), Magnitude::default());
            for (sum, scale) in sums.iter_mut().zip(&scales) {
                sum.force += scale.force;
                sum.by_position += scale.by_position;
                sum.by_velocity += scale.by_velocity;
            }
        }
        sums
    }

    fn sum(&self, size: usize, part: impl Fn(&Expectation<'_>) -> Vec<f64>) -> Vec<f64> {
        let mut total = DVector::zeros(size);
        for (law, scene) in &self.parts {
            total += DVector::from_vec(part(&Expectation::new(law, scene)));
        }
        total.data.into()
    }
}
