//! The equations of a step, term by term, evaluated at the states of a trace.
//!
//! Vectors hold `n·D` numbers, particle-major. Forces and Jacobians come from the reference laws, independent of the
//! simulator.

use nalgebra::{DMatrix, DVector, Vector3};
use simulator::scene::schema::ForceSchema;
use simulator::scene::{ForceElement, Scene};

use super::formulas::{self, Pair};
use super::steps::Sample;
use reference::laws::Laws;
pub(super) use reference::method::OnePoint as Method;

/// A force, or a part of one.
#[derive(Debug, Clone)]
pub(super) struct Term {
    /// Its description: `springforce's damping`.
    pub(super) name: String,
    pub(super) tag: &'static str,
    pub(super) elements: Vec<ForceElement>,
}

impl Term {
    /// Every term of a scene.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let mut schemas: Vec<&'static ForceSchema> = Vec::new();
        for element in &scene.forces {
            if !schemas.contains(&element.schema) {
                schemas.push(element.schema);
            }
        }
        schemas.into_iter().flat_map(|schema| Self::of(scene, schema)).collect()
    }

    /// The terms of one force: its parts, where they stand alone and more than one is there.
    fn of(scene: &Scene, schema: &'static ForceSchema) -> Vec<Self> {
        let tag = schema.tag;
        let is_of = |element: &&ForceElement| element.schema == schema;
        let elements: Vec<ForceElement> = scene.forces.iter().filter(is_of).cloned().collect();
        let whole = |elements| vec![Self { name: tag.to_owned(), tag, elements }];
        if !schema.is_separable() {
            return whole(elements);
        }
        let alone = |number: usize| {
            let mut alone = elements.clone();
            for element in &mut alone {
                let others = schema.parts.iter().enumerate().filter(|(other, _)| *other != number);
                others.for_each(|(_, part)| element.remove_part(part));
            }
            // The first part keeps elements of which nothing is left.
            alone.retain(|element| number == 0 || element.has_part(&schema.parts[number]));
            alone
        };
        let parts: Vec<(usize, Vec<ForceElement>)> =
            (0..schema.parts.len()).map(|number| (number, alone(number))).collect();
        let mut there: Vec<_> = parts.into_iter().filter(|(_, part)| !part.is_empty()).collect();
        if there.len() == 1 {
            return whole(there.swap_remove(0).1);
        }
        let term = |(number, elements): (usize, Vec<ForceElement>)| Self {
            name: formulas::name_of(schema, schema.parts[number].name),
            tag,
            elements,
        };
        there.into_iter().map(term).collect()
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

    /// Whether a step solves an equation.
    pub(super) fn is_implicit(&self) -> bool {
        matches!(self.method, Method::Linearized | Method::Implicit)
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
        Pair { element: element.clone(), d: vector(&at.x, i) - vector(&at.x, j), w: v[0] - v[1], v }
    }

    pub(super) fn force(&self, elements: &[ForceElement], at: &Point) -> DVector<f64> {
        DVector::from_vec(Laws::of(self.scene, elements).force(&at.x, &at.v, at.time))
    }

    /// `∂F/∂x` and `∂F/∂v`.
    pub(super) fn jacobians(
        &self,
        elements: &[ForceElement],
        at: &Point,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let found = Laws::of(self.scene, elements).jacobians(&at.x, &at.v, at.time);
        (found.by_position, found.by_velocity)
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
