//! Closed-form motions: the exact state of a scene at any time.
//!
//! Each reads masses, initial states and parameters from the scene that is simulated. The formulas are textbook
//! mechanics, independent of the simulator.

mod chain;
mod field;
mod orbit;
mod oscillator;

pub use chain::chain;
pub use field::{dragged, thrown, windy};
pub use orbit::orbit;
pub use oscillator::oscillator;

use scene::{ForceElement, Scene};

/// Sets positions and velocities (`n·D`, particle-major) at a time in seconds.
type Motion = dyn Fn(f64, &mut [f64], &mut [f64]) + Send + Sync;

/// A motion known in closed form.
pub struct Closed {
    state: Box<Motion>,
    /// The largest angular rate of the motion, in radians per second; it scales the effect of rounding errors of the
    /// time on the state.
    pub rate: f64,
}

impl Closed {
    fn new(rate: f64, state: impl Fn(f64, &mut [f64], &mut [f64]) + Send + Sync + 'static) -> Self {
        Self { state: Box::new(state), rate }
    }

    /// Sets positions and velocities (`n·D`, particle-major) at a time in seconds.
    pub fn at(&self, time: f64, positions: &mut [f64], velocities: &mut [f64]) {
        (self.state)(time, positions, velocities);
    }
}

/// The first force of a kind.
fn force<'a>(scene: &'a Scene, tag: &str) -> Option<&'a ForceElement> {
    scene.forces.iter().find(|element| element.schema.tag == tag)
}

/// The parameter of the first force of a kind; 0 where there is none.
fn parameter(scene: &Scene, tag: &str, name: &str) -> f64 {
    force(scene, tag).map_or(0.0, |element| element.parameter(name))
}
