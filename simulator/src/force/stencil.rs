//! Forces on stencils of any number of particles.
//!
//! A law sees its element on *local coordinates*: the positions and velocities of `M` particles relative to one more, the
//! origin,
//!
//! ```text
//! d_a = x_a − x_o       w_a = v_a − v_o       a = 1 … M
//! ```
//!
//! and states the forces `f_a` on the `M` particles and the blocks `∂f_a/∂d_b` and `∂f_a/∂w_b`. The force on the origin is
//! `−Σ f_a`: the element conserves momentum, and a translation changes nothing. A law without an origin depends on the
//! particles' own positions and velocities, as a field does.
//!
//! The assembly is here, once. `pair.rs` is the same for `M = 1` with an origin, in vectorised batches.

use std::ops::Range;

use super::{
    Block, Coupling, Degenerate, ElementJacobians, Force, JacobianSink, Numbered, State, Vector,
    add_to, vector_of,
};
use crate::parts::Parts;
use scene::{ForceElement, Scene};

/// The law of one element.
pub trait StencilLaw<const M: usize, const D: usize>: Send + Sync {
    /// The place in the stencil of the particle that the others are relative to; `None` if the law depends on the
    /// particles' own positions and velocities.
    const ORIGIN: Option<usize>;

    /// Potential energy; `None` if the law has none.
    fn energy(&self, at: &Local<M, D>) -> Option<f64>;

    /// Rayleigh's dissipation function, as in [`Force::dissipation`].
    fn dissipation(&self, _at: &Local<M, D>) -> f64 {
        0.0
    }

    /// The forces on the `M` particles, in the order of the stencil; `None` where they are not defined.
    fn forces(&self, at: &Local<M, D>) -> Option<[Vector<D>; M]>;

    /// The derivatives of these forces; `None` where they are not defined.
    fn jacobians(&self, at: &Local<M, D>) -> Option<LocalJacobians<M, D>>;

    /// Whether both Jacobians are the same numbers at every state.
    fn has_constant_jacobians(&self) -> bool {
        false
    }
}

/// An element on its local coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Local<const M: usize, const D: usize> {
    /// Positions.
    pub d: [Vector<D>; M],
    /// Velocities.
    pub w: [Vector<D>; M],
    /// Time, in seconds from the start of the scene.
    pub time: f64,
}

/// Derivatives of the forces on local coordinates: block `[a][b]` is that of the force on `a` by the coordinates of `b`.
#[derive(Debug, Clone, Copy)]
pub struct LocalJacobians<const M: usize, const D: usize> {
    /// `∂f_a/∂d_b`.
    pub by_position: [[Block<D>; M]; M],
    /// `∂f_a/∂w_b`.
    pub by_velocity: [[Block<D>; M]; M],
}

impl<const M: usize, const D: usize> LocalJacobians<M, D> {
    /// Zeros.
    pub fn zeros() -> Self {
        Self { by_position: [[Block::zeros(); M]; M], by_velocity: [[Block::zeros(); M]; M] }
    }
}

/// All elements of one law in a scene.
pub struct StencilForce<L, const M: usize> {
    /// Elements that move something, in the order of the file.
    active: Vec<Element<L, M>>,
    /// Elements between fixed particles: they have an energy, and move nothing.
    inert: Vec<Element<L, M>>,
    /// Ranges of particles, each with the active elements that act on one of them.
    parts: Vec<(Range<usize>, Vec<u32>)>,
}

struct Element<L, const M: usize> {
    law: L,
    /// Its number among the scene's forces.
    number: usize,
    /// Its first `M` particles.
    particles: [u32; M],
    /// One more, if it has an origin.
    last: Option<u32>,
    /// Whether its Jacobians are symmetric at every state.
    symmetric: bool,
}

impl<L, const M: usize> StencilForce<L, M> {
    /// The elements, each with the law that `law` makes of it.
    pub fn new(scene: &Scene, elements: &[Numbered<'_>], law: impl Fn(&ForceElement) -> L) -> Self {
        let law = &law;
        let stencils = elements.iter().flat_map(|(number, description)| {
            let stencils = description.stencils(scene.particles.len());
            stencils.map(|particles| Element {
                law: law(description),
                number: *number,
                particles: std::array::from_fn(|place| particles[place] as u32),
                last: particles.get(M).map(|last| *last as u32),
                symmetric: description.is_variational(),
            })
        });
        let is_free = |particle: &usize| !scene.particles[*particle].fixed;
        let moves = |element: &Element<L, M>| element.all().any(|particle| is_free(&particle));
        let (active, inert): (Vec<_>, Vec<_>) = stencils.partition(moves);
        let part = |range: &Range<usize>| {
            let acts = |element: &Element<L, M>| element.all().any(|p| range.contains(&p));
            let those = active.iter().zip(0..).filter(|(element, _)| acts(element));
            (range.clone(), those.map(|(_, number)| number).collect())
        };
        let parts = Parts::of_scene(scene).ranges().iter().map(part).collect();
        Self { active, inert, parts }
    }
}

impl<L, const M: usize> Element<L, M> {
    /// Its particles, in the order of the stencil.
    fn all(&self) -> impl Iterator<Item = usize> {
        self.particles.iter().chain(&self.last).map(|particle| *particle as usize)
    }

    #[inline]
    fn local<const D: usize>(&self, state: State<'_>) -> Local<M, D>
    where
        L: StencilLaw<M, D>,
    {
        let (others, origin) = (self.others::<D>(), self.origin::<D>());
        let coordinates = |values: &[f64]| {
            let own = others.map(|particle| vector_of(values, particle));
            match origin {
                Some(origin) => {
                    let of_origin = vector_of(values, origin);
                    own.map(|own| own - of_origin)
                }
                None => own,
            }
        };
        let (d, w) = (coordinates(state.positions), coordinates(state.velocities));
        Local { d, w, time: state.time }
    }

    /// The `M` particles that the law sees.
    #[inline]
    fn others<const D: usize>(&self) -> [usize; M]
    where
        L: StencilLaw<M, D>,
    {
        let origin = L::ORIGIN.unwrap_or(M);
        std::array::from_fn(|place| self.at(place + usize::from(place >= origin)))
    }

    #[inline]
    fn origin<const D: usize>(&self) -> Option<usize>
    where
        L: StencilLaw<M, D>,
    {
        L::ORIGIN.map(|place| self.at(place))
    }

    /// The particle at this place in the stencil.
    #[inline]
    fn at(&self, place: usize) -> usize {
        self.particles.get(place).copied().or(self.last).unwrap_or_default() as usize
    }

    fn hand_over<const D: usize>(
        &self,
        jacobians: &LocalJacobians<M, D>,
        sink: &mut dyn JacobianSink<D>,
    ) where
        L: StencilLaw<M, D>,
    {
        sink.add(ElementJacobians {
            particles: &self.others(),
            origin: self.origin(),
            by_position: jacobians.by_position.as_flattened(),
            by_velocity: jacobians.by_velocity.as_flattened(),
        });
    }

    #[cold]
    fn degenerate(&self) -> Degenerate {
        Degenerate { element: self.number, particles: self.all().collect() }
    }
}

impl<const M: usize, const D: usize, L: StencilLaw<M, D>> Force<D> for StencilForce<L, M> {
    fn energy(&self, state: State<'_>) -> Option<f64> {
        let all = self.active.iter().chain(&self.inert);
        all.map(|element| element.law.energy(&element.local(state))).sum()
    }

    fn dissipation(&self, state: State<'_>) -> f64 {
        let all = self.active.iter().chain(&self.inert);
        all.map(|element| element.law.dissipation(&element.local(state))).sum()
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        for (part, numbers) in self.parts.iter().filter(|(of, _)| particles.contains(&of.start)) {
            let mut add = |particle: usize, amount: Vector<D>| {
                if part.contains(&particle) {
                    add_to(force, particle - particles.start, &amount);
                }
            };
            for element in numbers.iter().map(|number| &self.active[*number as usize]) {
                let forces = element.law.forces(&element.local(state));
                let forces = forces.ok_or_else(|| element.degenerate())?;
                element.others().into_iter().zip(forces).for_each(|(of, force)| add(of, force));
                if let Some(origin) = element.origin() {
                    add(origin, -forces.iter().sum::<Vector<D>>());
                }
            }
        }
        Ok(())
    }

    fn add_jacobians(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        for element in &self.active {
            let jacobians = element.law.jacobians(&element.local(state));
            element.hand_over(&jacobians.ok_or_else(|| element.degenerate())?, sink);
        }
        Ok(())
    }

    fn has_constant_jacobians(&self) -> bool {
        self.active.iter().all(|element| element.law.has_constant_jacobians())
    }

    /// As of a pair: with `U = ρ²/2`, `∂²U/∂d² ≈ f fᵀ/(2U)`; the whole Hessian where `U` is 0, and nothing of an energy that
    /// is no square.
    fn add_gauss_newton(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        for element in &self.active {
            let local = element.local(state);
            let values = element.law.forces(&local).zip(element.law.jacobians(&local));
            let (f, mut jacobians) = values.ok_or_else(|| element.degenerate())?;
            let energy = element.law.energy(&local).unwrap_or(0.0);
            let scale = if energy > 0.0 { -0.5 / energy } else { 0.0 };
            if energy != 0.0 {
                jacobians.by_position = f.map(|a| f.map(|b| a * scale * b.transpose()));
            }
            element.hand_over(&jacobians, sink);
        }
        Ok(())
    }

    fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        for element in &self.active {
            // In the order in which Jacobians are handed over.
            let particles = element.others().into_iter().chain(element.origin()).collect();
            visit(Coupling::Stencil { particles, symmetric: element.symmetric });
        }
    }
}
