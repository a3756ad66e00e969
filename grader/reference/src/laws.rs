//! The forces of a whole scene by the laws, and their derivatives.

use nalgebra::DVector;
use scene::{ForceElement, Scene};

use crate::law::{self, Expectation, Jacobians, Law, Scale, Stencil};

/// The laws of a scene's forces, one kind at a time.
pub struct Laws {
    parts: Vec<(&'static Law, Scene)>,
    n_particles: usize,
}

impl Laws {
    /// The laws of the scene's forces, in the order of the registry.
    ///
    /// # Panics
    /// Where a force has no law. A test holds that every registered force has one.
    pub fn new(scene: &Scene) -> Self {
        Self::of(scene, &scene.forces)
    }

    /// The laws of these elements, on the particles of `scene`.
    ///
    /// # Panics
    /// As [`new`](Self::new).
    pub fn of(scene: &Scene, elements: &[ForceElement]) -> Self {
        let part = |tag: &'static str| {
            let is_of = |element: &&ForceElement| element.schema.tag == tag;
            let forces: Vec<ForceElement> = elements.iter().filter(is_of).cloned().collect();
            (!forces.is_empty()).then(|| {
                let law = law::find(tag);
                let law = law.unwrap_or_else(|| panic!("{tag} has no law in grader/reference"));
                (law, Scene { forces, ..scene.clone() })
            })
        };
        let registry = simulator::force::REGISTRY.iter();
        Self {
            parts: registry.filter_map(|kind| part(kind.schema.tag)).collect(),
            n_particles: scene.particles.len(),
        }
    }

    /// The force on every particle, `n·D`, fixed ones included.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        self.sum(x.len(), |law| law.force(x, v, time))
    }

    /// The derivative of the force as `(x, v)` moves along `(dx, dv)`.
    pub fn along(&self, [x, v]: [&[f64]; 2], [dx, dv]: [&[f64]; 2], time: f64) -> Vec<f64> {
        self.sum(x.len(), |law| law.along([x, v], [dx, dv], time))
    }

    /// Both Jacobians of the force.
    pub fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Jacobians {
        let mut sum = Jacobians::zeros(x.len());
        for (law, scene) in &self.parts {
            let part = Expectation::new(law, scene).jacobians(x, v, time);
            sum.by_position += part.by_position;
            sum.by_velocity += part.by_velocity;
        }
        sum
    }

    /// Visits what each law is evaluated on.
    pub fn each_stencil(&self, mut visit: impl FnMut(&Expectation<'_>, &Stencil<'_>)) {
        for (law, scene) in &self.parts {
            let law = Expectation::new(law, scene);
            law.stencils().iter().for_each(|stencil| visit(&law, stencil));
        }
    }

    /// The scale of each particle's values, of all forces together.
    pub fn scales(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Scale> {
        self.sum_of_scales(|law| law.scales(x, v, time))
    }

    /// The same at a state that was rounded.
    pub fn scales_of_rounded(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Scale> {
        self.sum_of_scales(|law| law.scales_of_rounded(x, v, time))
    }

    fn sum_of_scales(&self, part: impl Fn(&Expectation<'_>) -> Vec<Scale>) -> Vec<Scale> {
        let mut sums = vec![Scale::default(); self.n_particles];
        for (law, scene) in &self.parts {
            let scales = part(&Expectation::new(law, scene));
            sums.iter_mut().zip(scales).for_each(|(sum, scale)| *sum += scale);
        }
        sums
    }

    /// The shortest distance between two particles that a force joins.
    pub fn shortest(&self, x: &[f64]) -> Option<f64> {
        let of = |(law, scene): &(&'static Law, Scene)| Expectation::new(law, scene).shortest(x);
        self.parts.iter().filter_map(of).reduce(f64::min)
    }

    fn sum(&self, size: usize, part: impl Fn(&Expectation<'_>) -> Vec<f64>) -> Vec<f64> {
        let mut total = DVector::zeros(size);
        for (law, scene) in &self.parts {
            total += DVector::from_vec(part(&Expectation::new(law, scene)));
        }
        total.data.into()
    }
}
