//! The equations of a step, term by term, evaluated at the states of a trace.
//!
//! Vectors hold `n·D` numbers, particle-major. Forces and Jacobians come from the reference laws, independent of the
//! simulator.

use nalgebra::{DMatrix, DVector, Vector3};
use simulator::scene::{ForceElement, Scene};

use super::formulas::Pair;
use super::steps::Sample;
use reference::law;

/// A method of the course.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    Explicit,
    Symplectic,
    Linearized,
    Implicit,
}

impl Method {
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        match scene.integrator.name {
            "explicit-euler" => Some(Self::Explicit),
            "symplectic-euler" => Some(Self::Symplectic),
            "linearized-implicit-euler" => Some(Self::Linearized),
            "implicit-euler" => Some(Self::Implicit),
            _ => None,
        }
    }

    pub(super) fn is_implicit(self) -> bool {
        matches!(self, Self::Linearized | Self::Implicit)
    }
}

/// A force, or a part of one.
#[derive(Debug, Clone)]
pub(super) struct Term {
    /// Its description: `springforce's damping`.
    pub(super) name: String,
    pub(super) tag: &'static str,
    pub(super) elements: Vec<ForceElement>,
}

impl Term {
    /// Every term of a scene. Damping and elasticity of a spring are separate terms.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let mut tags: Vec<&'static str> = Vec::new();
        for element in &scene.forces {
            if !tags.contains(&element.schema.tag) {
                tags.push(element.schema.tag);
            }
        }
        let mut terms = Vec::new();
        for tag in tags {
            let of = |change: fn(&mut ForceElement)| {
                let is_of = |element: &&ForceElement| element.schema.tag == tag;
                let mut elements: Vec<ForceElement> =
                    scene.forces.iter().filter(is_of).cloned().collect();
                elements.iter_mut().for_each(change);
                elements
            };
            if tag != "springforce" {
                terms.push(Self { name: tag.to_owned(), tag, elements: of(|_| ()) });
                continue;
            }
            let elastic = of(|element| element.parameters[2] = 0.0);
            let mut damping = of(|element| element.parameters[0] = 0.0);
            damping.retain(|element| element.parameters[2] != 0.0);
            let is_damped = !damping.is_empty();
            let name = if is_damped { "springforce's elastic part" } else { "springforce" };
            terms.push(Self { name: name.to_owned(), tag, elements: elastic });
            if is_damped {
                let name = "springforce's damping".to_owned();
                terms.push(Self { name, tag, elements: damping });
            }
        }
        terms
    }
}

/// An evaluation point of the forces: positions, velocities, time.
pub(super) struct Point {
    pub(super) x: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) time: f64,
}

/// A scene whose steps are examined.
pub(super) struct Physics<'a> {
    pub(super) scene: &'a Scene,
    pub(super) method: Method,
    pub(super) dimension: usize,
    pub(super) h: f64,
    /// Masses, one a coordinate.
    pub(super) mass: Vec<f64>,
    pub(super) fixed: Vec<bool>,
}

impl<'a> Physics<'a> {
    pub(super) fn new(scene: &'a Scene, method: Method) -> Self {
        let dimension = scene.dimension.count();
        let each = || scene.particles.iter().flat_map(|particle| vec![particle; dimension]);
        Self {
            scene,
            method,
            dimension,
            h: scene.time_step,
            mass: each().map(|particle| particle.mass).collect(),
            fixed: each().map(|particle| particle.fixed).collect(),
        }
    }

    /// The point at which the method evaluates forces in a step.
    pub(super) fn point(&self, sample: &Sample) -> Point {
        let (x, v) = (&sample.before.positions, &sample.before.velocities);
        let time = sample.step as f64 * self.h;
        match self.method {
            Method::Explicit | Method::Symplectic => Point { x: x.clone(), v: v.clone(), time },
            Method::Linearized => Point { x: self.along(x, v), v: v.clone(), time: time + self.h },
            Method::Implicit => {
                let new = &sample.after.velocities;
                Point { x: self.along(x, new), v: new.clone(), time: time + self.h }
            }
        }
    }

    /// `x + h v`.
    pub(super) fn along(&self, x: &[f64], v: &[f64]) -> Vec<f64> {
        x.iter().zip(v).map(|(x, v)| x + self.h * v).collect()
    }

    /// The inputs of formulas for an element between two particles.
    pub(super) fn pair(&self, element: &ForceElement, at: &Point) -> Pair {
        let [i, j] = element.pair.unwrap_or_default();
        let vector = |values: &[f64], particle: usize| {
            let component = |axis: usize, _| match axis < self.dimension {
                true => values[particle * self.dimension + axis],
                false => 0.0,
            };
            Vector3::from_fn(component)
        };
        let v = [i, j].map(|particle| vector(&at.v, particle));
        let p = [0, 1, 2].map(|place| element.parameters[place]);
        Pair { p, d: vector(&at.x, i) - vector(&at.x, j), w: v[0] - v[1], v }
    }

    pub(super) fn force(&self, elements: &[ForceElement], at: &Point) -> DVector<f64> {
        DVector::from_vec(law::force_of(self.scene, elements, &at.x, &at.v, at.time))
    }

    /// `∂F/∂x` and `∂F/∂v`.
    pub(super) fn jacobians(
        &self,
        elements: &[ForceElement],
        at: &Point,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let size = at.x.len();
        let (mut k, mut b) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
        let only = Scene { forces: elements.to_vec(), ..self.scene.clone() };
        for (law, scene) in law::by_law(&only) {
            let found = law::Expectation::new(law, &scene).jacobians(&at.x, &at.v, at.time);
            k += found.by_position;
            b += found.by_velocity;
        }
        (k, b)
    }

    /// `v' − v` in the trace.
    pub(super) fn delta(&self, sample: &Sample) -> DVector<f64> {
        let pairs = sample.after.velocities.iter().zip(&sample.before.velocities);
        DVector::from_iterator(self.mass.len(), pairs.map(|(new, old)| new - old))
    }

    /// `M δ`.
    pub(super) fn momentum(&self, delta: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(delta.len(), |dof, _| self.mass[dof] * delta[dof])
    }

    /// The vector with the components of fixed particles set to zero.
    pub(super) fn free(&self, mut vector: DVector<f64>) -> DVector<f64> {
        for (value, fixed) in vector.iter_mut().zip(&self.fixed) {
            if *fixed {
                *value = 0.0;
            }
        }
        vector
    }

    /// The velocities after each of the first `most` Newton iterations from the old ones, without fixed particles.
    pub(super) fn newton(&self, sample: &Sample, most: usize) -> Vec<Vec<f64>> {
        let (x, v) = (&sample.before.positions, &sample.before.velocities);
        let free: Vec<usize> = (0..v.len()).filter(|&dof| !self.fixed[dof]).collect();
        let mut iterate = v.clone();
        let mut found = Vec::new();
        for _ in 0..most {
            let time = (sample.step + 1) as f64 * self.h;
            let at = Point { x: self.along(x, &iterate), v: iterate.clone(), time };
            let force = self.force(&self.scene.forces, &at);
            let (k, b) = self.jacobians(&self.scene.forces, &at);
            let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
                let place = (free[i], free[j]);
                let mass = if i == j { self.mass[free[i]] } else { 0.0 };
                mass - self.h * (self.h * k[place] + b[place])
            });
            let right = DVector::from_fn(free.len(), |i, _| {
                let dof = free[i];
                self.h * force[dof] - self.mass[dof] * (iterate[dof] - v[dof])
            });
            let Some(update) = matrix.lu().solve(&right) else { break };
            for (place, &dof) in free.iter().enumerate() {
                iterate[dof] += update[place];
            }
            found.push(iterate.clone());
        }
        found
    }
}
