//! Forces between two particles that depend on their relative position and velocity alone.
//!
//! With `d = x_i − x_j` and `w = v_i − v_j`, such a force is `F_i = f(d, w)`, `F_j = −f(d, w)`, so that
//! with `A = ∂f/∂d` and `B = ∂f/∂w` the Jacobians of the pair are
//!
//! ```text
//! ∂F/∂x = (  A  −A )      ∂F/∂v = (  B  −B )
//!         ( −A   A )              ( −B   B )
//! ```
//!
//! Each law states `f`, `A` and `B` only; the assembly is here, once.

use super::{
    Block, Coupling, Degenerate, Force, JacobianSink, Numbered, State, Vector, add_to, vector_of,
};
use crate::scene::Scene;

/// The law of one element.
pub(super) trait PairLaw<const D: usize>: Send + Sync {
    /// Potential energy at this distance; `None` if the law has no energy.
    fn energy(&self, distance: f64) -> Option<f64>;

    /// `f(d, w)`; `None` where it is not defined.
    fn force(&self, d: &Vector<D>, w: &Vector<D>) -> Option<Vector<D>>;

    /// `∂f/∂d` and `∂f/∂w`; `None` where they are not defined.
    fn jacobians(&self, d: &Vector<D>, w: &Vector<D>) -> Option<(Block<D>, Block<D>)>;

    /// Whether both Jacobians are symmetric at every state.
    fn symmetric(&self) -> bool;
}

/// All elements of one law in a scene.
pub(super) struct PairForce<L> {
    /// Elements that move something.
    active: Vec<PairElement<L>>,
    /// Elements between two fixed particles: they have an energy, and move nothing.
    inert: Vec<PairElement<L>>,
}

struct PairElement<L> {
    i: u32,
    j: u32,
    element: u32,
    law: L,
}

impl<L> PairForce<L> {
    /// The elements, each with the law that `law` makes of its parameters and its two particles.
    pub(super) fn new(
        scene: &Scene,
        elements: &[Numbered<'_>],
        law: impl Fn(&[f64], [usize; 2]) -> L,
    ) -> Self {
        let (mut active, mut inert) = (Vec::new(), Vec::new());
        for &(element, description) in elements {
            let Some([i, j]) = description.pair else { continue };
            let law = law(&description.parameters, [i, j]);
            let moves = !(scene.particles[i].fixed && scene.particles[j].fixed);
            let list = if moves { &mut active } else { &mut inert };
            // No scene file holds 2³² of anything.
            let [i, j, element] = [i, j, element].map(|number| number as u32);
            list.push(PairElement { i, j, element, law });
        }
        Self { active, inert }
    }
}

impl<const D: usize, L: PairLaw<D>> Force<D> for PairForce<L> {
    fn energy(&self, state: State<'_>) -> Option<f64> {
        let mut sum = 0.0;
        for PairElement { i, j, law, .. } in self.active.iter().chain(&self.inert) {
            let (d, _) = relative::<D>(state, [*i, *j]);
            sum += law.energy(d.norm())?;
        }
        Some(sum)
    }

    fn add_force(&self, state: State<'_>, force: &mut [f64]) -> Result<(), Degenerate> {
        for &PairElement { i, j, ref law, element } in &self.active {
            let (d, w) = relative(state, [i, j]);
            let f = law.force(&d, &w).ok_or(Degenerate { element: element as usize })?;
            add_to(force, i as usize, &f);
            add_to(force, j as usize, &-f);
        }
        Ok(())
    }

    fn add_jacobians(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        for &PairElement { i, j, ref law, element } in &self.active {
            let (d, w) = relative(state, [i, j]);
            let jacobians = law.jacobians(&d, &w);
            let (a, b) = jacobians.ok_or(Degenerate { element: element as usize })?;
            sink.add_pair([i as usize, j as usize], &a, &b);
        }
        Ok(())
    }

    fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        for PairElement { i, j, law, .. } in &self.active {
            let particles = [*i as usize, *j as usize];
            visit(Coupling::Pair { particles, symmetric: law.symmetric() });
        }
    }
}

/// `d = x_i − x_j` and `w = v_i − v_j`.
#[inline]
fn relative<const D: usize>(state: State<'_>, pair: [u32; 2]) -> (Vector<D>, Vector<D>) {
    let [i, j] = pair.map(|particle| particle as usize);
    let d = vector_of(state.positions, i) - vector_of(state.positions, j);
    let w = vector_of(state.velocities, i) - vector_of(state.velocities, j);
    (d, w)
}
