//! Laws of forces between two particles: `f(d, w)` and its derivatives, of one element or of many at once.
//!
//! `d = x_i − x_j` and `w = v_i − v_j`; the force on `i` is `f`, the force on `j` is `−f`.

use pulp::Simd;

use super::{Block, Vector};

/// The law of one element.
pub(super) trait PairLaw<const D: usize>: Copy + Send + Sync {
    /// Whether the force depends on `w`.
    const USES_VELOCITY: bool;

    /// Potential energy at this distance; `None` if the law has no energy.
    fn energy(&self, distance: f64) -> Option<f64>;

    /// `f(d, w)`; `None` where it is not defined.
    fn force(&self, d: &Vector<D>, w: &Vector<D>) -> Option<Vector<D>>;

    /// `∂f/∂d` and `∂f/∂w`; `None` where they are not defined.
    fn jacobians(&self, d: &Vector<D>, w: &Vector<D>) -> Option<(Block<D>, Block<D>)>;

    /// Whether both Jacobians are the same numbers at every state.
    fn has_constant_jacobians(&self) -> bool {
        false
    }

    /// The law at this time, for one that changes with it: all else is asked of what this returns.
    fn at(self, _time: f64) -> Self {
        self
    }
}

/// The laws of many elements, by slot.
pub(super) trait PairLaws<const D: usize>: Default + Send + Sync {
    /// The law of each.
    type Law: PairLaw<D>;

    /// Puts a law into the next slot.
    fn push(&mut self, law: Self::Law);

    /// The law in this slot.
    fn law(&self, slot: usize) -> Self::Law;

    /// Whether the force depends on `w` in any slot.
    fn use_velocity(&self) -> bool {
        Self::Law::USES_VELOCITY
    }

    /// The force on the first particle of each element from this slot on.
    ///
    /// # Errors
    /// Where one of the forces is not defined.
    #[inline(always)]
    fn forces<S: Simd>(
        &self,
        _simd: S,
        first_slot: usize,
        relative: impl Relative<D>,
        forces: &mut [[f64; D]],
    ) -> Result<(), Undefined> {
        one_by_one(self, first_slot, relative, forces)
    }
}

/// The values of [`PairLaws::forces`], without vectors.
#[inline(always)]
pub(super) fn one_by_one<const D: usize>(
    laws: &impl PairLaws<D>,
    first_slot: usize,
    relative: impl Relative<D>,
    forces: &mut [[f64; D]],
) -> Result<(), Undefined> {
    for (idx, force) in forces.iter_mut().enumerate() {
        let law = laws.law(first_slot + idx).at(relative.time());
        let of_first = law.force(&relative.position(idx), &relative.velocity(idx));
        *force = of_first.ok_or(Undefined)?.into();
    }
    Ok(())
}

/// A force is not defined in one of the slots.
pub(super) struct Undefined;

impl<const D: usize, L: PairLaw<D>> PairLaws<D> for Vec<L> {
    type Law = L;

    fn push(&mut self, law: L) {
        Vec::push(self, law);
    }

    #[inline(always)]
    fn law(&self, slot: usize) -> L {
        self[slot]
    }
}

/// Relative positions and velocities of the two particles of some elements.
pub(super) trait Relative<const D: usize>: Copy {
    /// `d = x_i − x_j` of `F64_LANES` elements from this one on, particle-major.
    fn positions<S: Simd>(self, simd: S, first: usize) -> [S::f64s; D];
    /// `w = v_i − v_j`, likewise.
    fn velocities<S: Simd>(self, simd: S, first: usize) -> [S::f64s; D];
    /// `d` of one element.
    fn position(self, idx: usize) -> Vector<D>;
    /// `w` of one element; 0 where velocities were not asked for.
    fn velocity(self, idx: usize) -> Vector<D>;
    /// The time of the state.
    fn time(self) -> f64;
}
