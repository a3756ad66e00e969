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

mod energy;
mod field;
mod material;
mod pair;
mod solid;
mod stencil;

use nalgebra::DMatrix;
use num_dual::{Dual64, DualNum};
use scene::schema::{ForceSchema, ParameterSchema};
use scene::{ForceElement, Parameters, Particles, Scene};

pub use stencil::forces_of;

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
pub type Vector<T> = [T; 3];

/// Every law.
pub fn all() -> impl Iterator<Item = &'static Law> {
    let laws = [field::LAWS, pair::LAWS, stencil::LAWS, material::LAWS, solid::LAWS];
    laws.into_iter().flatten().copied()
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
    /// The law of elements of `size` particles, as numbers and as dual numbers.
    pub const fn of_stencil(
        tag: &'static str,
        parameters: &'static [&'static str],
        symmetry: Symmetry,
        size: usize,
        (plain, dual): (StencilLaw<f64>, StencilLaw<Dual64>),
        scale: StencilScale,
    ) -> Self {
        let form = Form::Stencil { size, plain, dual, scale, smooth: None };
        Self { tag, parameters, symmetry, form }
    }

    /// The same, smooth only within this length of the particles' places.
    pub const fn smooth_within(mut self, length: StencilLength) -> Self {
        if let Form::Stencil { smooth, .. } = &mut self.form {
            *smooth = Some(length);
        }
        self
    }

    /// Whether it is the force on each particle by itself.
    pub fn is_field(&self) -> bool {
        matches!(self.form, Form::Field { .. })
    }

    /// The number of particles that it is evaluated on together.
    pub fn size(&self) -> usize {
        match self.form {
            Form::Field { .. } => 1,
            Form::Pair { .. } => 2,
            Form::Stencil { size, .. } => size,
        }
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
    /// Those of a force, in the order of its parameters.
    pub fn of(schema: &ForceSchema) -> Vec<Self> {
        let term = |parameter: &ParameterSchema| {
            let depends_on = schema.depends_through(parameter.name);
            let (by_position, by_velocity) = (depends_on.position, depends_on.velocity);
            Self { parameter: parameter.name, by_position, by_velocity }
        };
        schema.parameters.iter().map(term).collect()
    }
}

/// Arguments of a law. The functions take the parameters of an element in the order of [`Law::parameters`].
enum Form {
    /// The force on `i` as a function of `d = x_i − x_j` and `w = v_i − v_j`; the force on `j` is its negative.
    Pair {
        plain: PairLaw<f64>,
        dual: PairLaw<Dual64>,
        /// By parameters, product of the masses, `|d|` and `|w|`.
        scale: fn(&[f64], f64, f64, f64) -> Scale,
        /// The parameters that these functions take, at a time.
        at: fn(&[f64], f64) -> Parameters,
    },
    /// The forces on the particles of an element.
    Stencil {
        size: usize,
        plain: StencilLaw<f64>,
        dual: StencilLaw<Dual64>,
        scale: StencilScale,
        /// The length within which it is smooth, if that is shorter than the distances of the particles.
        smooth: Option<StencilLength>,
    },
    /// The force on each particle by itself.
    Field { plain: FieldLaw<f64>, dual: FieldLaw<Dual64>, scale: fn(&[f64], &At<'_, f64>) -> Scale },
}

impl Form {
    /// A pair's that is the same at all times.
    const fn pair(
        plain: PairLaw<f64>,
        dual: PairLaw<Dual64>,
        scale: fn(&[f64], f64, f64, f64) -> Scale,
    ) -> Self {
        Self::Pair { plain, dual, scale, at: |parameters, _| parameters.into() }
    }
}

/// `f(parameters, masses, d, w)`.
type PairLaw<T> = fn(&[f64], [f64; 2], Vector<T>, Vector<T>) -> Vector<T>;

/// `f(parameters, particles)`, the force on each of the particles.
pub type StencilLaw<T> = fn(&[f64], &[At<'_, T>]) -> Vec<Vector<T>>;

/// The largest scale of the particles, from the velocities themselves and not from their differences.
pub type StencilScale = fn(&[f64], &[At<'_, f64>]) -> Scale;

/// A length, by the parameters and the particles' places.
pub type StencilLength = fn(&[f64], &[At<'_, f64>]) -> f64;

/// `f(parameters, particle)`.
type FieldLaw<T> = fn(&[f64], &At<'_, T>) -> Vector<T>;

/// A law for one number type.
enum Evaluate<T> {
    Pair(PairLaw<T>, fn(&[f64], f64) -> Parameters),
    Stencil(StencilLaw<T>),
    Field(FieldLaw<T>),
}

/// A number type that every law is stated for.
trait Stated: Number {
    fn law(form: &'static Form) -> Evaluate<Self>;
}

impl Stated for f64 {
    fn law(form: &'static Form) -> Evaluate<Self> {
        match form {
            Form::Pair { plain, at, .. } => Evaluate::Pair(*plain, *at),
            Form::Stencil { plain, .. } => Evaluate::Stencil(*plain),
            Form::Field { plain, .. } => Evaluate::Field(*plain),
        }
    }
}

impl Stated for Dual64 {
    fn law(form: &'static Form) -> Evaluate<Self> {
        match form {
            Form::Pair { dual, at, .. } => Evaluate::Pair(*dual, *at),
            Form::Stencil { dual, .. } => Evaluate::Stencil(*dual),
            Form::Field { dual, .. } => Evaluate::Field(*dual),
        }
    }
}

/// A particle that a law acts on.
#[derive(Clone, Copy)]
pub struct At<'a, T> {
    /// Its mass.
    pub mass: f64,
    /// Its position.
    pub position: Vector<T>,
    /// Its velocity.
    pub velocity: Vector<T>,
    /// The time.
    pub time: f64,
    /// Its initial position.
    pub start: [f64; 3],
    /// 2 in the plane, 3 in space.
    pub dimension: usize,
    /// The initial positions of all particles.
    starts: &'a [[f64; 3]],
}

impl<'a> At<'a, f64> {
    fn dual(&self) -> At<'a, Dual64> {
        let [position, velocity] = [self.position, self.velocity].map(|of| of.map(Dual64::from));
        let At { mass, time, start, dimension, starts, .. } = *self;
        At { mass, position, velocity, time, start, dimension, starts }
    }
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

impl std::ops::Add for Scale {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

/// A law with a scene's masses and elements. The scene's forces must all be of the law's kind.
pub struct Expectation<'a> {
    /// The law.
    pub law: &'static Law,
    scene: &'a Scene,
    stencils: Vec<Stencil<'a>>,
    starts: Vec<[f64; 3]>,
}

/// Particles that a law is evaluated on together.
pub struct Stencil<'a> {
    /// The element that they are of; that of a field has a stencil for each particle.
    pub element: &'a ForceElement,
    /// Its number.
    pub number: usize,
    /// The particles.
    pub particles: Particles,
}

impl<'a> Expectation<'a> {
    /// The law of these elements.
    ///
    /// # Panics
    /// Where an element acts on another number of particles than the law. A test holds that each registered force fits.
    pub fn new(law: &'static Law, scene: &'a Scene) -> Self {
        let starts = scene.particles.iter().map(|particle| particle.position).collect();
        let stencils = scene.forces.iter().enumerate().flat_map(|(number, element)| {
            let stencils = element.stencils(scene.particles.len());
            stencils.map(move |particles| Stencil { element, number, particles })
        });
        let stencils: Vec<Stencil<'_>> = stencils.collect();
        let fits = stencils.iter().all(|stencil| stencil.particles.len() == law.size());
        assert!(fits, "an element of {} does not fit its law in grader/reference", law.tag);
        Self { law, scene, stencils, starts }
    }

    /// The stencils of the law, in the order of the elements.
    pub fn stencils(&self) -> &[Stencil<'a>] {
        &self.stencils
    }

    fn dimension(&self) -> usize {
        self.scene.dimension.count()
    }

    /// The force on every particle.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        self.total(x, v, time)
    }

    /// The derivative of the force as `(x, v)` moves along `(dx, dv)`.
    pub fn along(&self, [x, v]: [&[f64]; 2], [dx, dv]: [&[f64]; 2], time: f64) -> Vec<f64> {
        let seeded = |values: &[f64], along: &[f64]| -> Vec<Dual64> {
            values.iter().zip(along).map(|(value, along)| Dual64::new(*value, *along)).collect()
        };
        let force = self.total(&seeded(x, dx), &seeded(v, dv), time);
        force.iter().map(|force| force.eps).collect()
    }

    /// The forces on the particles of a stencil.
    pub fn forces_on(
        &self,
        stencil: &Stencil<'_>,
        x: &[f64],
        v: &[f64],
        time: f64,
    ) -> Vec<Vector<f64>> {
        self.evaluate(stencil, &self.all_at(stencil, x, v, time))
    }

    /// Both Jacobians of the forces on the particles of a stencil, column by column.
    pub fn jacobians_on(
        &self,
        stencil: &Stencil<'_>,
        x: &[f64],
        v: &[f64],
        time: f64,
    ) -> Jacobians {
        let here = self.all_at(stencil, x, v, time);
        let here: Vec<At<'_, Dual64>> = here.iter().map(At::dual).collect();
        let dimension = self.dimension();
        let mut jacobians = Jacobians::zeros(here.len() * dimension);
        let Jacobians { by_position, by_velocity } = &mut jacobians;
        for (is_velocity, matrix) in [(false, by_position), (true, by_velocity)] {
            for (column, mut entries) in matrix.column_iter_mut().enumerate() {
                let mut seeded = here.clone();
                let At { position, velocity, .. } = &mut seeded[column / dimension];
                let moved = if is_velocity { velocity } else { position };
                moved[column % dimension].eps = 1.0;
                let forces = self.evaluate(stencil, &seeded);
                for (row, entry) in entries.iter_mut().enumerate() {
                    *entry = forces[row / dimension][row % dimension].eps;
                }
            }
        }
        jacobians
    }

    /// Both Jacobians.
    pub fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Jacobians {
        let dimension = self.dimension();
        let mut sum = Jacobians::zeros(x.len());
        for stencil in &self.stencils {
            let own = self.jacobians_on(stencil, x, v, time);
            let of =
                |place: usize| stencil.particles[place / dimension] * dimension + place % dimension;
            for (sum, own) in
                [(&mut sum.by_position, &own.by_position), (&mut sum.by_velocity, &own.by_velocity)]
            {
                for (column, entries) in own.column_iter().enumerate() {
                    for (row, entry) in entries.iter().enumerate() {
                        sum[(of(row), of(column))] += entry;
                    }
                }
            }
        }
        sum
    }

    /// The scale of each particle's values.
    pub fn scales(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Scale> {
        self.scales_at(x, v, time, |[i, j]| norm(&difference(i, j)))
    }

    /// The scale if the velocities themselves have rounding errors too.
    pub fn scales_of_rounded(&self, x: &[f64], v: &[f64], time: f64) -> Vec<Scale> {
        self.scales_at(x, v, time, |[i, j]| norm(i) + norm(j))
    }

    fn scales_at(
        &self,
        x: &[f64],
        v: &[f64],
        time: f64,
        speed: impl Fn([&Vector<f64>; 2]) -> f64,
    ) -> Vec<Scale> {
        let mut scales = vec![Scale::default(); self.scene.particles.len()];
        for stencil in &self.stencils {
            let parameters = &stencil.element.parameters;
            let at = self.all_at(stencil, x, v, time);
            let scale = match (&self.law.form, &at[..]) {
                (Form::Pair { scale, at, .. }, [i, j]) => scale(
                    &at(parameters, time),
                    i.mass * j.mass,
                    norm(&difference(&i.position, &j.position)),
                    speed([&i.velocity, &j.velocity]),
                ),
                (Form::Field { scale, .. }, [particle]) => scale(parameters, particle),
                (Form::Stencil { scale, .. }, all) => scale(parameters, all),
                _ => Scale::default(),
            };
            stencil.particles.iter().for_each(|particle| scales[*particle] += scale);
        }
        scales
    }

    /// The length within which the law is smooth: the shortest distance between two particles of an element or what the law
    /// says, or a fifth of the box over which a field varies with the position.
    pub fn shortest(&self, x: &[f64]) -> Option<f64> {
        if self.law.is_field() {
            let varies = self.scene.forces.iter().any(|force| force.schema.depends_on().position);
            return varies.then(|| 0.2 * field::diagonal(&self.starts));
        }
        let position = |particle: &usize| vector(x, self.dimension(), *particle);
        let lengths = self.stencils.iter().flat_map(|Stencil { particles, .. }| {
            let pairs = particles
                .iter()
                .enumerate()
                .flat_map(|(place, i)| particles[place + 1..].iter().map(move |j| (i, j)));
            pairs.map(|(i, j)| norm(&difference(&position(i), &position(j))))
        });
        let Form::Stencil { smooth: Some(smooth), .. } = self.law.form else {
            return lengths.reduce(f64::min);
        };
        let rest = vec![0.0; x.len()];
        let within = self
            .stencils
            .iter()
            .map(|of| smooth(&of.element.parameters, &self.all_at(of, x, &rest, 0.0)));
        lengths.chain(within).reduce(f64::min)
    }

    /// Whether the law couples these particles, or both are the same.
    pub fn joins(&self, a: usize, b: usize) -> bool {
        let has = |of: &Stencil<'_>| of.particles.contains(&a) && of.particles.contains(&b);
        a == b || self.stencils.iter().any(has)
    }

    fn all_at<T: Number>(
        &self,
        stencil: &Stencil<'_>,
        x: &[T],
        v: &[T],
        time: f64,
    ) -> Vec<At<'_, T>> {
        let at = |particle: &usize| At {
            mass: self.scene.particles[*particle].mass,
            position: vector(x, self.dimension(), *particle),
            velocity: vector(v, self.dimension(), *particle),
            time,
            start: self.starts[*particle],
            dimension: self.dimension(),
            starts: &self.starts,
        };
        stencil.particles.iter().map(at).collect()
    }

    fn evaluate<T: Stated>(&self, stencil: &Stencil<'_>, at: &[At<'_, T>]) -> Vec<Vector<T>> {
        let parameters = &stencil.element.parameters;
        match (T::law(&self.law.form), at) {
            (Evaluate::Pair(law, parameters_at), [i, j]) => {
                let parameters = parameters_at(parameters, i.time);
                let d = difference(&i.position, &j.position);
                let w = difference(&i.velocity, &j.velocity);
                let force = law(&parameters, [i.mass, j.mass], d, w);
                vec![force, force.map(|component| -component)]
            }
            (Evaluate::Field(law), [particle]) => vec![law(parameters, particle)],
            (Evaluate::Stencil(law), all) => law(parameters, all),
            _ => Vec::new(),
        }
    }

    fn total<T: Stated>(&self, x: &[T], v: &[T], time: f64) -> Vec<T> {
        let dimension = self.dimension();
        let mut total = vec![T::from(0.0); x.len()];
        for stencil in &self.stencils {
            let forces = self.evaluate(stencil, &self.all_at(stencil, x, v, time));
            for (particle, force) in stencil.particles.iter().zip(forces) {
                for axis in 0..dimension {
                    total[particle * dimension + axis] += force[axis];
                }
            }
        }
        total
    }
}

/// The parameters of an element by name.
///
/// # Panics
/// Where they are fewer. A test holds that each law names those of its force.
fn named<const N: usize>(parameters: &[f64]) -> [f64; N] {
    std::array::from_fn(|place| parameters[place])
}

fn vector<T: Number>(values: &[T], dimension: usize, particle: usize) -> Vector<T> {
    std::array::from_fn(|axis| {
        if axis < dimension { values[particle * dimension + axis] } else { T::from(0.0) }
    })
}

/// `a − b`.
pub fn difference<T: Number>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// `a·b`.
pub fn dot<T: Number>(a: Vector<T>, b: Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `|a|`.
pub fn norm(a: &Vector<f64>) -> f64 {
    dot(*a, *a).sqrt()
}
