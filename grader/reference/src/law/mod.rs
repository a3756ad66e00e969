//! Reference force laws.
//!
//! Each law follows the documents' formulas, not the simulator's code, and is generic over the number type. Plain
//! numbers give the force; dual numbers ([`num_dual`]) give its derivatives, exact except for rounding. With `z` the
//! positions or velocities and `ε² = 0`,
//!
//! ```text
//! F(z + ε e) = F(z) + ε J e
//! ```
//!
//! A law also gives the magnitudes of its terms ([`Scale`]), which bound their rounding error, and the parameters
//! that each Jacobian depends on ([`Term`]), so that a check can confirm that it has covered them. Units are the
//! scene's. Cost: one evaluation of the force per column.

mod field;
mod pair;

use nalgebra::DMatrix;
use num_dual::{Dual64, DualNum};
use simulator::scene::{ForceElement, Scene};

/// Both Jacobians of a force.
#[derive(Debug, Clone, PartialEq)]
pub struct Jacobians {
    /// `∂F/∂x`.
    pub by_position: DMatrix<f64>,
    /// `∂F/∂v`.
    pub by_velocity: DMatrix<f64>,
}

impl Jacobians {
    /// Zeros of `size` rows and columns.
    pub fn zeros(size: usize) -> Self {
        Self { by_position: DMatrix::zeros(size, size), by_velocity: DMatrix::zeros(size, size) }
    }
}

/// A number, or a number with a derivative.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}

/// Position, velocity or force; `z` is 0 in two dimensions.
type Vector<T> = [T; 3];

/// Every law; one for each registered force.
static LAWS: &[&Law] = &[
    &field::SIMPLE_GRAVITY,
    &field::CONSTANT,
    &pair::SPRING,
    &pair::GRAVITATION,
    &field::DRAG,
    &pair::VORTEX,
    &pair::GREEN_SPRING,
    &field::WIND,
];

/// The law of the force with this tag.
pub fn find(tag: &str) -> Option<&'static Law> {
    LAWS.iter().find(|law| law.tag == tag).copied()
}

/// The laws that a scene uses, in the order of the registry, each with a scene of its elements only.
pub fn by_law(scene: &Scene) -> Vec<(&'static Law, Scene)> {
    let with = |law: &'static Law| {
        let is_of = |element: &&ForceElement| element.schema.tag == law.tag;
        let elements: Vec<ForceElement> = scene.forces.iter().filter(is_of).cloned().collect();
        (!elements.is_empty()).then(|| (law, Scene { forces: elements, ..scene.clone() }))
    };
    LAWS.iter().copied().filter_map(with).collect()
}

/// The total force of `elements`, of any laws, on the particles of `scene`.
pub fn force_of(
    scene: &Scene,
    elements: &[ForceElement],
    x: &[f64],
    v: &[f64],
    time: f64,
) -> Vec<f64> {
    let only = Scene { forces: elements.to_vec(), ..scene.clone() };
    let mut total = vec![0.0; x.len()];
    for (law, scene) in by_law(&only) {
        let force = Expectation::new(law, &scene).force(x, v, time);
        total.iter_mut().zip(&force).for_each(|(total, force)| *total += force);
    }
    total
}

/// A force law as stated in the documents.
pub struct Law {
    tag: &'static str,
    /// Whether its forces act between particles: invariant if all particles move alike.
    pub internal: bool,
    /// The rotations under which the law is invariant.
    pub symmetry: Symmetry,
    /// The Jacobians that each parameter affects, in the order of the schema.
    pub terms: &'static [Term],
    form: Form,
}

impl Law {
    /// Whether its forces act between two particles.
    pub fn is_pair(&self) -> bool {
        matches!(self.form, Form::Pair { .. })
    }
}

/// Rotational symmetry of a law.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// About any axis.
    Isotropic,
    /// About the z axis.
    AboutZ,
    /// None: the law contains a fixed direction.
    None,
}

/// The Jacobians that a parameter affects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Term {
    /// The attribute.
    pub parameter: &'static str,
    /// Whether in `∂F/∂x`.
    pub by_position: bool,
    /// Whether in `∂F/∂v`.
    pub by_velocity: bool,
}

impl Term {
    const fn new(parameter: &'static str, by_position: bool, by_velocity: bool) -> Self {
        Self { parameter, by_position, by_velocity }
    }

    const fn nowhere(parameter: &'static str) -> Self {
        Self::new(parameter, false, false)
    }
}

/// The arguments of a law.
enum Form {
    /// The force on `i` as a function of `d = x_i − x_j` and `w = v_i − v_j`; the force on `j` is its negative.
    Pair {
        plain: PairLaw<f64>,
        dual: PairLaw<Dual64>,
        /// As a function of the parameters, the product of the masses, `|d|` and `|w|`.
        scale: fn(&[f64], f64, f64, f64) -> Scale,
    },
    /// The force on a single particle.
    Field { plain: FieldLaw<f64>, dual: FieldLaw<Dual64>, scale: fn(&[f64], &At<'_, f64>) -> Scale },
}

/// `f(parameters, masses, d, w)`.
type PairLaw<T> = fn(&[f64], [f64; 2], Vector<T>, Vector<T>) -> Vector<T>;

/// `f(parameters, particle)`.
type FieldLaw<T> = fn(&[f64], &At<'_, T>) -> Vector<T>;

/// A particle in a field.
struct At<'a, T> {
    mass: f64,
    position: Vector<T>,
    velocity: Vector<T>,
    time: f64,
    /// The particle's number, and the initial positions of all particles.
    start: (usize, &'a [[f64; 3]]),
}

/// Magnitudes of the terms of each value: its rounding error is a few `ε` times these.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scale {
    /// Of the energy.
    pub energy: f64,
    /// Of a component of the force.
    pub force: f64,
    /// Of an entry of `∂F/∂x`.
    pub by_position: f64,
    /// Of an entry of `∂F/∂v`.
    pub by_velocity: f64,
}

impl std::ops::AddAssign for Scale {
    fn add_assign(&mut self, other: Self) {
        self.energy += other.energy;
        self.force += other.force;
        self.by_position += other.by_position;
        self.by_velocity += other.by_velocity;
    }
}

/// A law with a scene's masses and elements. The scene's forces must all be of the law's kind.
pub struct Expectation<'a> {
    /// The law.
    pub law: &'static Law,
    scene: &'a Scene,
    starts: Vec<[f64; 3]>,
}

impl<'a> Expectation<'a> {
    /// The law of these elements.
    pub fn new(law: &'static Law, scene: &'a Scene) -> Self {
        let starts = scene.particles.iter().map(|particle| particle.position).collect();
        Self { law, scene, starts }
    }

    fn dimension(&self) -> usize {
        self.scene.dimension.count()
    }

    /// The force on every particle.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        self.total(x, v, time, |form| match form {
            Form::Pair { plain, .. } => Evaluate::Pair(*plain),
            Form::Field { plain, .. } => Evaluate::Field(*plain),
        })
    }

    /// The derivative of the force as `(x, v)` moves along `(dx, dv)`.
    pub fn along(&self, [x, v]: [&[f64]; 2], [dx, dv]: [&[f64]; 2], time: f64) -> Vec<f64> {
        let seeded = |values: &[f64], along: &[f64]| -> Vec<Dual64> {
            values.iter().zip(along).map(|(value, along)| Dual64::new(*value, *along)).collect()
        };
        let force = self.total(&seeded(x, dx), &seeded(v, dv), time, |form| match form {
            Form::Pair { dual, .. } => Evaluate::Pair(*dual),
            Form::Field { dual, .. } => Evaluate::Field(*dual),
        });
        force.iter().map(|force| force.eps).collect()
    }

    /// Both Jacobians, column by column.
    pub fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Jacobians {
        let seeded = |values: &[f64], seed: Option<usize>| -> Vec<Dual64> {
            let number = |(place, value): (usize, &f64)| {
                Dual64::new(*value, f64::from(u8::from(seed == Some(place))))
            };
            values.iter().enumerate().map(number).collect()
        };
        let columns = |by_velocity: bool| {
            let mut matrix = DMatrix::zeros(x.len(), x.len());
            for column in 0..x.len() {
                let (x, v) = match by_velocity {
                    false => (seeded(x, Some(column)), seeded(v, None)),
                    true => (seeded(x, None), seeded(v, Some(column))),
                };
                let force = self.total(&x, &v, time, |form| match form {
                    Form::Pair { dual, .. } => Evaluate::Pair(*dual),
                    Form::Field { dual, .. } => Evaluate::Field(*dual),
                });
                for (entry, force) in matrix.column_mut(column).iter_mut().zip(&force) {
                    *entry = force.eps;
                }
            }
            matrix
        };
        Jacobians { by_position: columns(false), by_velocity: columns(true) }
    }

    /// The scale of each particle's values.
    pub fn scales(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Scale> {
        let dimension = self.dimension();
        self.scales_at(x, v, time, |pair| norm(&difference(v, dimension, pair)))
    }

    /// The scale if the velocities themselves have rounding errors too.
    pub fn scales_of_rounded(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Scale> {
        let speed = |particle| norm(&vector(v, self.dimension(), particle));
        self.scales_at(x, v, time, |[i, j]| speed(i) + speed(j))
    }

    fn scales_at(
        &self,
        x: &[f64],
        v: &[f64],
        time: f64,
        speed: impl Fn([usize; 2]) -> f64,
    ) -> Vec<Scale> {
        let dimension = self.dimension();
        let mut scales = vec![Scale::default(); self.scene.particles.len()];
        for element in &self.scene.forces {
            match (&self.law.form, element.pair) {
                (Form::Pair { scale, .. }, Some([i, j])) => {
                    let length = norm(&difference(x, dimension, [i, j]));
                    let speed = speed([i, j]);
                    let masses = self.scene.particles[i].mass * self.scene.particles[j].mass;
                    let scale = scale(&element.parameters, masses, length, speed);
                    scales[i] += scale;
                    scales[j] += scale;
                }
                (Form::Field { scale, .. }, _) => {
                    for (particle, sum) in scales.iter_mut().enumerate() {
                        *sum += scale(&element.parameters, &self.at(particle, x, v, time));
                    }
                }
                (Form::Pair { .. }, None) => {}
            }
        }
        scales
    }

    /// The shortest distance between two particles joined by an element: the law is smooth within it.
    pub fn shortest(&self, x: &[f64]) -> Option<f64> {
        let lengths = self.scene.forces.iter().filter_map(|element| {
            element.pair.map(|pair| norm(&difference(x, self.dimension(), pair)))
        });
        lengths.reduce(f64::min)
    }

    /// Whether the law couples these particles, or both are the same.
    pub fn joins(&self, a: usize, b: usize) -> bool {
        let is_pair = |pair: [usize; 2]| pair == [a, b] || pair == [b, a];
        a == b || self.scene.forces.iter().any(|element| element.pair.is_some_and(is_pair))
    }

    fn at<T: Number>(&self, particle: usize, x: &[T], v: &[T], time: f64) -> At<'_, T> {
        At {
            mass: self.scene.particles[particle].mass,
            position: vector(x, self.dimension(), particle),
            velocity: vector(v, self.dimension(), particle),
            time,
            start: (particle, &self.starts),
        }
    }

    fn total<T: Number>(
        &self,
        x: &[T],
        v: &[T],
        time: f64,
        choose: impl Fn(&'static Form) -> Evaluate<T>,
    ) -> Vec<T> {
        let dimension = self.dimension();
        let mut total = vec![T::from(0.0); x.len()];
        for element in &self.scene.forces {
            match (choose(&self.law.form), element.pair) {
                (Evaluate::Pair(law), Some([i, j])) => {
                    let masses = [i, j].map(|particle| self.scene.particles[particle].mass);
                    let d = difference(x, dimension, [i, j]);
                    let w = difference(v, dimension, [i, j]);
                    let force = law(&element.parameters, masses, d, w);
                    for axis in 0..dimension {
                        total[i * dimension + axis] += force[axis];
                        total[j * dimension + axis] -= force[axis];
                    }
                }
                (Evaluate::Field(law), _) => {
                    for particle in 0..self.scene.particles.len() {
                        let force = law(&element.parameters, &self.at(particle, x, v, time));
                        for axis in 0..dimension {
                            total[particle * dimension + axis] += force[axis];
                        }
                    }
                }
                (Evaluate::Pair(_), None) => {}
            }
        }
        total
    }
}

/// A law for one number type.
enum Evaluate<T> {
    Pair(PairLaw<T>),
    Field(FieldLaw<T>),
}

fn vector<T: Number>(values: &[T], dimension: usize, particle: usize) -> Vector<T> {
    std::array::from_fn(|axis| match axis < dimension {
        true => values[particle * dimension + axis],
        false => T::from(0.0),
    })
}

fn difference<T: Number>(values: &[T], dimension: usize, [i, j]: [usize; 2]) -> Vector<T> {
    let (first, second) = (vector(values, dimension, i), vector(values, dimension, j));
    std::array::from_fn(|axis| first[axis] - second[axis])
}

fn dot<T: Number>(a: Vector<T>, b: Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(vector: &Vector<f64>) -> f64 {
    dot(*vector, *vector).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulator::force;

    #[test]
    fn every_registered_force_has_a_law_that_knows_its_parameters() {
        for kind in force::REGISTRY {
            let tag = kind.schema.tag;
            let law = find(tag).unwrap_or_else(|| panic!("{tag} has no law in jacobian/law"));
            let known: Vec<&str> = law.terms.iter().map(|term| term.parameter).collect();
            let stated: Vec<&str> =
                kind.schema.parameters.iter().map(|parameter| parameter.name).collect();
            assert_eq!(known, stated, "{tag}");
        }
        assert_eq!(LAWS.len(), force::REGISTRY.len());
    }
}
