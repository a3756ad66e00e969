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
//! A law also says how large the terms are that its values are sums of ([`Scale`]), which bounds their
//! rounding. Units are the scene's. Cost: one evaluation of the force a column.

mod field;
mod pair;

use nalgebra::DMatrix;
use num_dual::{Dual64, DualNum};
use scene::schema::{ForceSchema, ParameterSchema};
use scene::{ForceElement, Scene};

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

/// Every law.
pub fn all() -> impl Iterator<Item = &'static Law> {
    field::LAWS.iter().chain(pair::LAWS).copied()
}

/// The law of the force with this tag.
pub fn find(tag: &str) -> Option<&'static Law> {
    all().find(|law| law.tag == tag)
}

/// A force law as stated in the documents.
pub struct Law {
    /// The tag of its force.
    pub tag: &'static str,
    /// The names of its parameters, in the order in which its functions take them.
    pub parameters: &'static [&'static str],
    /// About which axes the law is the same however the scene is turned.
    pub symmetry: Symmetry,
    form: Form,
}

impl Law {
    /// What the registry says of the force.
    ///
    /// # Panics
    /// Where the law is of no registered force. A test holds that it is.
    pub fn schema(&self) -> &'static ForceSchema {
        let mut kinds = simulator::force::REGISTRY.iter();
        let kind = kinds.find(|kind| kind.schema.tag == self.tag);
        &kind.unwrap_or_else(|| panic!("{} is no registered force", self.tag)).schema
    }

    /// Where each parameter shows, in the order of the registry.
    pub fn terms(&self) -> Vec<Term> {
        let schema = self.schema();
        let term = |parameter: &ParameterSchema| {
            let depends_on = schema.depends_through(parameter.name);
            let (by_position, by_velocity) = (depends_on.position, depends_on.velocity);
            Term { parameter: parameter.name, by_position, by_velocity }
        };
        schema.parameters.iter().map(term).collect()
    }

    /// Whether its forces are between two particles.
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

/// What a law is a function of.
enum Form {
    /// The force on `i` as a function of `d = x_i − x_j` and `w = v_i − v_j`; the force on `j` is its negative.
    Pair {
        plain: PairLaw<f64>,
        dual: PairLaw<Dual64>,
        /// By parameters, product of the masses, `|d|` and `|w|`.
        scale: fn(&Parameters, f64, f64, f64) -> Scale,
        /// The parameters that these functions take, at a time.
        at: fn(&Parameters, f64) -> Parameters,
    },
    /// The force on each particle by itself.
    Field {
        plain: FieldLaw<f64>,
        dual: FieldLaw<Dual64>,
        scale: fn(&Parameters, &At<'_, f64>) -> Scale,
    },
}

/// The most parameters of a law.
const MAX_PARAMETERS: usize = 4;

/// The parameters of an element, in the order of [`Law::parameters`].
type Parameters = [f64; MAX_PARAMETERS];

/// `f(parameters, masses, d, w)`.
type PairLaw<T> = fn(&Parameters, [f64; 2], Vector<T>, Vector<T>) -> Vector<T>;

/// `f(parameters, particle)`.
type FieldLaw<T> = fn(&Parameters, &At<'_, T>) -> Vector<T>;

/// A particle in a field.
struct At<'a, T> {
    mass: f64,
    position: Vector<T>,
    velocity: Vector<T>,
    time: f64,
    /// The initial positions of all particles.
    starts: &'a [[f64; 3]],
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
    /// The parameters of each element.
    parameters: Vec<Parameters>,
    starts: Vec<[f64; 3]>,
}

impl<'a> Expectation<'a> {
    /// The law of these elements.
    ///
    /// # Panics
    /// Where an element acts on another number of particles than the law. A test holds that each registered force fits.
    pub fn new(law: &'static Law, scene: &'a Scene) -> Self {
        let starts = scene.particles.iter().map(|particle| particle.position).collect();
        let parameters_of = |element: &ForceElement| {
            let fits = law.is_pair() == element.pair().is_some();
            assert!(fits, "an element of {} does not fit its law in grader/reference", law.tag);
            let mut values = [0.0; MAX_PARAMETERS];
            for (value, name) in values.iter_mut().zip(law.parameters) {
                *value = element.parameter(name);
            }
            values
        };
        let parameters = scene.forces.iter().map(parameters_of).collect();
        Self { law, scene, parameters, starts }
    }

    fn dimension(&self) -> usize {
        self.scene.dimension.count()
    }

    /// The force on every particle.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        self.total(x, v, time, |form| match form {
            Form::Pair { plain, at, .. } => Evaluate::Pair(*plain, *at),
            Form::Field { plain, .. } => Evaluate::Field(*plain),
        })
    }

    /// The derivative of the force as `(x, v)` moves along `(dx, dv)`.
    pub fn along(&self, [x, v]: [&[f64]; 2], [dx, dv]: [&[f64]; 2], time: f64) -> Vec<f64> {
        let seeded = |values: &[f64], along: &[f64]| -> Vec<Dual64> {
            values.iter().zip(along).map(|(value, along)| Dual64::new(*value, *along)).collect()
        };
        let force = self.total(&seeded(x, dx), &seeded(v, dv), time, |form| match form {
            Form::Pair { dual, at, .. } => Evaluate::Pair(*dual, *at),
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
                    Form::Pair { dual, at, .. } => Evaluate::Pair(*dual, *at),
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
        for (element, parameters) in self.scene.forces.iter().zip(&self.parameters) {
            match (&self.law.form, element.pair()) {
                (Form::Pair { scale, at, .. }, Some([i, j])) => {
                    let parameters = &at(parameters, time);
                    let length = norm(&difference(x, dimension, [i, j]));
                    let speed = speed([i, j]);
                    let masses = self.scene.particles[i].mass * self.scene.particles[j].mass;
                    let scale = scale(parameters, masses, length, speed);
                    scales[i] += scale;
                    scales[j] += scale;
                }
                (Form::Field { scale, .. }, _) => {
                    for (particle, sum) in scales.iter_mut().enumerate() {
                        *sum += scale(parameters, &self.at(particle, x, v, time));
                    }
                }
                (Form::Pair { .. }, None) => {}
            }
        }
        scales
    }

    /// The length within which the law is smooth: the shortest distance between two particles joined by an element, or a
    /// fifth of the box over which a field varies with the position.
    pub fn shortest(&self, x: &[f64]) -> Option<f64> {
        if !self.law.is_pair() {
            let varies = self.law.schema().depends_on().position;
            return varies.then(|| 0.2 * field::diagonal(&self.starts));
        }
        let lengths = self.scene.forces.iter().filter_map(|element| {
            element.pair().map(|pair| norm(&difference(x, self.dimension(), pair)))
        });
        lengths.reduce(f64::min)
    }

    /// Whether the law couples these particles, or both are the same.
    pub fn joins(&self, a: usize, b: usize) -> bool {
        let is_pair = |pair: [usize; 2]| pair == [a, b] || pair == [b, a];
        a == b || self.scene.forces.iter().any(|element| element.pair().is_some_and(is_pair))
    }

    fn at<T: Number>(&self, particle: usize, x: &[T], v: &[T], time: f64) -> At<'_, T> {
        At {
            mass: self.scene.particles[particle].mass,
            position: vector(x, self.dimension(), particle),
            velocity: vector(v, self.dimension(), particle),
            time,
            starts: &self.starts,
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
        for (element, parameters) in self.scene.forces.iter().zip(&self.parameters) {
            match (choose(&self.law.form), element.pair()) {
                (Evaluate::Pair(law, at), Some([i, j])) => {
                    let parameters = &at(parameters, time);
                    let masses = [i, j].map(|particle| self.scene.particles[particle].mass);
                    let d = difference(x, dimension, [i, j]);
                    let w = difference(v, dimension, [i, j]);
                    let force = law(parameters, masses, d, w);
                    for axis in 0..dimension {
                        total[i * dimension + axis] += force[axis];
                        total[j * dimension + axis] -= force[axis];
                    }
                }
                (Evaluate::Field(law), _) => {
                    for particle in 0..self.scene.particles.len() {
                        let force = law(parameters, &self.at(particle, x, v, time));
                        for axis in 0..dimension {
                            total[particle * dimension + axis] += force[axis];
                        }
                    }
                }
                (Evaluate::Pair(..), None) => {}
            }
        }
        total
    }
}

/// A law for one number type.
enum Evaluate<T> {
    Pair(PairLaw<T>, fn(&Parameters, f64) -> Parameters),
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
