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
use scene::{ForceElement, Scene};

mod batches;
mod law;
mod pair;
mod reciprocal;
mod uniform;

mod constant;
mod drag;
mod gravitational;
mod green_spring;
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
];

/// A force as the registry knows it: how a scene mentions it, and how it is built.
pub struct ForceKind {
    /// How a scene mentions it.
    pub schema: ForceSchema,
    /// Builds it for two dimensions.
    pub build_2d: fn(&Scene, &[Numbered<'_>]) -> Box<dyn Force<2>>,
    /// Builds it for three dimensions.
    pub build_3d: fn(&Scene, &[Numbered<'_>]) -> Box<dyn Force<3>>,
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

    /// Hands every block of both Jacobians that is not zero by construction to `sink`. A block may
    /// come in several parts; they add up. There are none in a force that depends on neither.
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

/// Where blocks of Jacobians go.
pub trait JacobianSink<const D: usize> {
    /// Adds to the derivative of the force on particle `row` by the position (`jacobian_x`) and
    /// velocity (`jacobian_v`) of particle `column`.
    fn add(&mut self, row: usize, column: usize, jacobian_x: &Block<D>, jacobian_v: &Block<D>);

    /// Adds the blocks of two particles whose force depends on their difference alone: these to `(i, i)`
    /// and `(j, j)`, their negatives to `(i, j)` and `(j, i)`.
    fn add_pair(&mut self, [i, j]: [usize; 2], jacobian_x: &Block<D>, jacobian_v: &Block<D>) {
        self.add(i, i, jacobian_x, jacobian_v);
        self.add(j, j, jacobian_x, jacobian_v);
        self.add(i, j, &-jacobian_x, &-jacobian_v);
        self.add(j, i, &-jacobian_x, &-jacobian_v);
    }
}

/// What a force may look at.
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

/// What the Jacobians of one element couple.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coupling {
    /// The particle to itself, coordinate by coordinate: a multiple of the identity.
    Diagonal(usize),
    /// Two particles to themselves and each other; or one to itself, with a full block, where both are the same.
    Pair {
        /// The two.
        particles: [usize; 2],
        /// Whether all blocks together are a symmetric matrix.
        symmetric: bool,
    },
}

/// A force element has no value: its particles are in the same place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Degenerate {
    /// The element's number among the scene's forces.
    pub element: usize,
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
