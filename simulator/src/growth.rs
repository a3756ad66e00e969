//! Watch for runs whose energy grows by orders of magnitude.
//!
//! ```text
//! R = K + Σ|U_force| + Σ (h F_i)²/(2 m_i)  of the first state, or of a later one that was larger when it was looked at
//! closed scene:  K + U > 100 R
//! driven scene:  K > 1000 times R and every K so far
//! ```
//!
//! with `K` the kinetic and `U` the potential energy, and `F_i` the force on a particle. In a closed scene, forces derive
//! from energies or dissipate, none depends on time, and fixed particles rest. Its energy grows only by errors of the
//! method, of which the last term of `R` is the first: the energy of one kick from rest. In a driven scene (wind, vortices,
//! scripted springs, moving fixed particles; damped springs count as well, since their damping has no potential) energy may
//! reach any size, but does not grow that much from one look to the next. A force that depends on time may start from
//! nothing: there, the first looks only say what is large. The looks are after steps 1, 2, 4 and 8, each eighth step from
//! there on, and the last.
//!
//! Cost: `K` at each look. `U` and `F` are evaluated at the first state, and again only where `K > 100 R`.

use scene::{ForceElement, Scene};

/// Growth of the energy of a closed scene that is reported.
const CLOSED_GROWTH: f64 = 100.0;

/// Growth of the kinetic energy of a driven scene between two looks that is reported. A force that grows with the square
/// of the time multiplies it by 64 from one look to the next.
const DRIVEN_GROWTH: f64 = 1000.0;

/// Looks at steps 1, 2, 4 and 8, which give the kinetic energy a scale if a force depends on time.
const FIRST_LOOKS: u32 = 4;

/// Most steps between two looks.
const STRIDE: u64 = 8;

/// A look that found the energy grown by orders of magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyGrowth {
    /// Number of the state.
    pub step: u64,
    /// Its energy; the kinetic energy of a driven scene.
    pub energy: f64,
    /// Its reference `R`; the largest kinetic energy seen before, of a driven scene.
    pub before: f64,
    /// Whether it is the kinetic energy alone.
    pub kinetic: bool,
}

/// Energies of a state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    /// `K + U`.
    pub(crate) energy: f64,
    /// `K + Σ|U_force| + Σ (h F_i)²/(2 m_i)`.
    pub(crate) reference: f64,
}

/// The watch over one run.
#[derive(Debug)]
pub(crate) struct EnergyWatch {
    is_closed: bool,
    /// Whether a force depends on time.
    varies: bool,
    /// Looks since the start.
    looks: u32,
    /// `R`; `None` before the first step.
    reference: Option<f64>,
}

impl EnergyWatch {
    pub(crate) fn new(scene: &Scene) -> Self {
        let is_closed =
            |force: &ForceElement| force.is_variational() && !force.schema.depends_on().time;
        let rests =
            scene.particles.iter().all(|particle| !particle.fixed || particle.velocity == [0.0; 3]);
        Self {
            is_closed: rests && scene.forces.iter().all(is_closed),
            varies: scene.forces.iter().any(|force| force.schema.depends_on().time),
            looks: 0,
            reference: None,
        }
    }

    /// Starts from a state, unless it has started. `scale` is of that state.
    pub(crate) fn start(&mut self, scale: impl FnOnce() -> Scale) {
        self.reference.get_or_insert_with(|| scale().reference);
    }

    /// Starts anew from the next state.
    pub(crate) fn restart(&mut self) {
        self.reference = None;
        self.looks = 0;
    }

    /// Whether to look at the state with this number.
    pub(crate) fn is_due(step: u64, n_steps: u64) -> bool {
        step == n_steps || step.is_multiple_of(STRIDE) || (step < STRIDE && step.is_power_of_two())
    }

    /// Looks at a state. `scale` is of that state.
    pub(crate) fn look(
        &mut self,
        step: u64,
        kinetic: f64,
        scale: impl FnOnce() -> Scale,
    ) -> Option<EnergyGrowth> {
        let before = self.reference?;
        self.looks += 1;
        let grown = |energy, kinetic| Some(EnergyGrowth { step, energy, before, kinetic });
        if !self.is_closed {
            self.reference = Some(before.max(kinetic));
            let has_scale = !self.varies || self.looks > FIRST_LOOKS;
            return if has_scale && kinetic > DRIVEN_GROWTH * before {
                grown(kinetic, true)
            } else {
                None
            };
        }
        if kinetic <= CLOSED_GROWTH * before {
            return None;
        }
        let Scale { energy, reference } = scale();
        if energy > CLOSED_GROWTH * before {
            return grown(energy, false);
        }
        self.reference = Some(before.max(reference));
        None
    }
}
