//! Forces: energy, force and both Jacobians of each, one force a file.
//!
//! # Conventions
//!
//! Positions `x` and velocities `v` hold `n·D` numbers, particle-major: `x0 y0 x1 y1 …`.
//! With `U` the potential energy and `F` the force, both of the same shape,
//!
//! ```text
//! force       F          F = −∇U where the force has an energy: the gradient is −F
//! jacobian_x  ∂F/∂x      = −∇²U where the force has an energy (the Hessian is −∂F/∂x)
//! jacobian_v  ∂F/∂v
//! ```
//!
//! Jacobians are of the *force*, not of the energy's gradient, and block `(a, b)` is the derivative of
//! the force on particle `a` by the position or velocity of particle `b`; `∂F/∂x` is symmetric where
//! the force has an energy, and need not be elsewhere.
//!
//! Every method *adds* to what it is given. No method knows which particles are fixed: the
//! [`system`](crate::system) leaves their degrees of freedom out.
//!
//! # Adding a force
//!
//! docs/adding-a-force.md walks through an example: a new file with a [`ForceKind`], a line in [`REGISTRY`], its law a
//! second time in the grader's `reference` crate, and a scene. All else derives from the facts of its
//! [`ForceSchema`].

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use scene::schema::ForceSchema;
use scene::{ForceElement, Particles, Scene};

mod batches;
mod law;
mod pair;
mod reciprocal;
pub mod stencil;
mod uniform;

mod constant;
mod drag;
mod elastic_bending;
mod elastic_spring;
mod elastic_triangle;
mod finite_element;
mod gravitational;
mod green_spring;
mod hinge_bending;
mod scripted_spring;
mod simple_gravity;
mod spring;
mod vortex;
mod wind;

/// A vector of one particle.
pub type Vector<const D: usize> = SVector<f64, D>;

/// A block of a Jacobian: one particle by one particle.
pub type Block<const D: usize> = SMatrix<f64, D, D>;

/// Every force, in the order in which they are summed.
pub static REGISTRY: &[&ForceKind] = &[
    &simple_gravity::KIND,
    &constant::KIND,
    &spring::KIND,
    &gravitational::KIND,
    &drag::KIND,
    &vortex::KIND,
    &green_spring::KIND,
    &wind::KIND,
    &scripted_spring::KIND,
    &elastic_spring::KIND,
    &elastic_bending::KIND,
    &elastic_triangle::KIND,
    &finite_element::ST_VENANT_KIRCHHOFF,
    &finite_element::COROTATED,
    &finite_element::NEO_HOOKEAN,
    &finite_element::solid::ST_VENANT_KIRCHHOFF,
    &finite_element::solid::COROTATED,
    &finite_element::solid::NEO_HOOKEAN,
    &hinge_bending::KIND,
    &drag::BY_MASS,
];

/// A force as the registry knows it: how a scene mentions it, and how it is built.
pub struct ForceKind {
    /// How a scene mentions it.
    pub schema: ForceSchema,
    /// Builds it for two dimensions, if it exists there.
    pub build_2d: fn(&Scene, &[Numbered<'_>]) -> Box<dyn Force<2>>,
    /// Builds it for three dimensions.
    pub build_3d: fn(&Scene, &[Numbered<'_>]) -> Box<dyn Force<3>>,
}

/// Builds a force in the plane that does not exist there.
///
/// # Panics
/// Always: no scene of two dimensions has the force.
fn in_space_only(_: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<2>> {
    let tags = elements.iter().map(|(_, element)| element.schema.tag);
    panic!("in the plane: {}", tags.collect::<Vec<_>>().join(", "))
}

/// A force element and its number among the scene's.
pub type Numbered<'a> = (usize, &'a ForceElement);

/// All elements of one kind in a scene, as one force.
pub trait Force<const D: usize>: Send + Sync {
    /// Potential energy, in units of force times length; `None` for a force that has none.
    fn energy(&self, state: State<'_>) -> Option<f64>;

    /// Rayleigh's dissipation function `R`, in units of power: the force is then `−∂R/∂v`, and `R` does not
    /// depend on the positions. Zero for a force that is none of it.
    fn dissipation(&self, _state: State<'_>) -> f64 {
        0.0
    }

    /// Adds the force on these particles to `force`, `D` numbers each: on all of them, or on what is one thread's in
    /// a large scene ([`parts`](crate::parts)).
    ///
    /// # Errors
    /// Where the force is not defined at this state.
    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate>;

    /// Hands the Jacobians of each element to `sink`. A force that depends on neither positions nor velocities hands over
    /// nothing.
    ///
    /// # Errors
    /// Where the force is not defined at this state.
    fn add_jacobians(
        &self,
        _state: State<'_>,
        _sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        Ok(())
    }

    /// Whether [`add_jacobians`](Self::add_jacobians) hands over the same numbers at every state and time, bit for bit.
    fn has_constant_jacobians(&self) -> bool {
        false
    }

    /// Hands Gauss–Newton's approximations of these blocks to `sink`: the part of `∂F/∂x` that is left where the energy is
    /// a square, and its second derivative without that of the square's root. The Jacobians themselves for a force whose
    /// energy or dissipation function is linear or quadratic.
    ///
    /// # Errors
    /// Where the force is not defined at this state.
    fn add_gauss_newton(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        self.add_jacobians(state, sink)
    }

    /// Says, element by element, which particles the Jacobians couple; nothing for an element whose
    /// Jacobians are zero.
    fn couplings(&self, _visit: &mut dyn FnMut(Coupling)) {}
}

/// Receives Jacobians.
pub trait JacobianSink<const D: usize> {
    /// Adds the Jacobians of one element.
    fn add(&mut self, element: ElementJacobians<'_, D>);

    /// The same for the force on `i` of a pair, by `x_i − x_j` and `v_i − v_j`.
    fn add_pair(&mut self, [i, j]: [usize; 2], by_position: &Block<D>, by_velocity: &Block<D>) {
        self.add(ElementJacobians::single(&i, Some(j), by_position, by_velocity));
    }
}

/// The Jacobians of one element, on its local coordinates: of `m` particles, relative to another one, the origin. With
/// `d_b` the position of particle `b` from the origin's and `f_a` the force on particle `a`, block `(a, b)` is
/// `∂f_a/∂d_b`; the force on the origin is `−Σ f_a`. An element without an origin depends on the particles' own
/// positions and velocities.
#[derive(Debug, Clone, Copy)]
pub struct ElementJacobians<'a, const D: usize> {
    /// The `m` particles.
    pub particles: &'a [usize],
    /// The particle that they are relative to.
    pub origin: Option<usize>,
    /// Blocks by position, `m²` of them, row by row.
    pub by_position: &'a [Block<D>],
    /// Blocks by velocity, likewise.
    pub by_velocity: &'a [Block<D>],
}

impl<'a, const D: usize> ElementJacobians<'a, D> {
    /// Those of one particle, or of one relative to the origin.
    pub fn single(
        particle: &'a usize,
        origin: Option<usize>,
        by_position: &'a Block<D>,
        by_velocity: &'a Block<D>,
    ) -> Self {
        let [by_position, by_velocity] = [by_position, by_velocity].map(std::slice::from_ref);
        Self { particles: std::slice::from_ref(particle), origin, by_position, by_velocity }
    }

    /// Calls `add` with row, column and block of each pair of particles, the origin among them, of blocks on the local
    /// coordinates: [`by_position`](Self::by_position) or [`by_velocity`](Self::by_velocity).
    pub fn spread(&self, blocks: &[Block<D>], mut add: impl FnMut(usize, usize, &Block<D>)) {
        let particle = |place: usize| self.particles.get(place).copied().or(self.origin);
        self.spread_places(blocks, |row, column, block| {
            if let (Some(row), Some(column)) = (particle(row), particle(column)) {
                add(row, column, block);
            }
        });
    }

    /// The same with the places of the particles in the list in place of their numbers; the origin is after the last one.
    #[inline(always)]
    pub fn spread_places(&self, blocks: &[Block<D>], mut add: impl FnMut(usize, usize, &Block<D>)) {
        let m = self.particles.len();
        let minus = |total: Block<D>, block: &Block<D>| total - block;
        for (row, blocks) in blocks.chunks_exact(m).enumerate() {
            blocks.iter().enumerate().for_each(|(column, block)| add(row, column, block));
            if self.origin.is_some() {
                add(row, m, &blocks.iter().fold(Block::zeros(), minus));
            }
        }
        if self.origin.is_some() {
            for column in 0..m {
                let below = blocks.iter().skip(column).step_by(m);
                add(m, column, &below.fold(Block::zeros(), minus));
            }
            add(m, m, &blocks.iter().sum());
        }
    }
}

/// The state that a force depends on.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Mass of each particle.
    pub masses: &'a [f64],
    /// Positions, `n·D`, particle-major.
    pub positions: &'a [f64],
    /// Velocities, the same shape.
    pub velocities: &'a [f64],
    /// Time, in seconds from the start of the scene.
    pub time: f64,
}

/// The particles that the Jacobians of one element couple.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Coupling {
    /// A particle to itself, coordinate by coordinate: a multiple of the identity.
    Diagonal(usize),
    /// All particles of a stencil to themselves and each other.
    Stencil {
        /// The particles, all different, in the order of [`ElementJacobians`]: the origin comes last.
        particles: Particles,
        /// Whether all blocks together are a symmetric matrix.
        symmetric: bool,
    },
}

/// A force element has no value where its particles are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Degenerate {
    /// The element's number among the scene's forces.
    pub element: usize,
    /// The particles.
    pub particles: Particles,
}

/// The vector of one particle in a slice of `n·D` numbers.
pub(crate) fn vector_of<const D: usize>(values: &[f64], particle: usize) -> Vector<D> {
    Vector::from_column_slice(&values[particle * D..particle * D + D])
}

/// Adds to the vector of one particle.
pub(crate) fn add_to<const D: usize>(values: &mut [f64], particle: usize, amount: &Vector<D>) {
    for (value, amount) in values[particle * D..particle * D + D].iter_mut().zip(amount.iter()) {
        *value += amount;
    }
}
