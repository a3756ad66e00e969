//! Reference motions without a closed form, by Dormand and Prince's method of order 8(5,3) with adaptive step size.
//!
//! ```text
//! x' = v        v' = F(x, v, t)/m        F: the laws of jacobian/law, not the simulator's forces
//! ```
//!
//! Each motion is computed to two tolerances; the difference is the error bar. Each interval between samples is
//! integrated separately, so that no sample is interpolated. Method: `differential-equations`, DOP853. Source: Hairer,
//! Nørsett and Wanner, *Solving Ordinary Differential Equations I*, section II.10.

use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};
use scene::Scene;

use crate::laws::Laws;

/// Tolerances, relative and (scaled by the size of the scene) absolute: of the reference, and of the second run for the
/// error bar.
pub const TOLERANCES: [f64; 2] = [1e-13, 1e-12];

/// Maximum number of steps between two samples; beyond it, the scene is too stiff for an explicit method.
const MAX_STEPS: usize = 200_000;

/// The states of a scene at `times`, which ascend from 0: positions and velocities one after the other, `2·n·D`
/// numbers each.
///
/// # Errors
/// A message, if the method does not reach the last time.
pub fn solve(scene: &Scene, times: &[f64], tolerance: f64) -> Result<Vec<Vec<f64>>, String> {
    let motion = Motion::new(scene);
    let mut state = [scene.positions(), scene.velocities()].concat();
    let size = |values: &[f64]| values.iter().fold(0.0, |max: f64, value| max.max(value.abs()));
    let scale = match size(&state) {
        0.0 => 1.0,
        size => size,
    };
    let mut states = vec![state.clone()];
    for stretch in times.windows(2) {
        let method = ExplicitRungeKutta::dop853()
            .rtol(tolerance)
            .atol(tolerance * scale)
            .max_steps(MAX_STEPS);
        let solution = IVP::ode(&motion, stretch[0], stretch[1], state).method(method).solve();
        let solution = solution.map_err(|_| {
            format!(
                "the reference method cannot integrate from t = {} s to {} s",
                stretch[0], stretch[1]
            )
        })?;
        let end = solution.y.last().filter(|end| end.iter().all(|value| value.is_finite()));
        state = end.cloned().ok_or_else(|| {
            format!("the reference is not finite between t = {} s and {} s", stretch[0], stretch[1])
        })?;
        states.push(state.clone());
    }
    Ok(states)
}

/// The equation of motion of a scene, by the laws.
pub struct Motion<'a> {
    scene: &'a Scene,
    laws: Laws,
}

impl<'a> Motion<'a> {
    /// That of `scene`.
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene, laws: Laws::new(scene) }
    }

    /// The force on every particle; zero on fixed ones.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        let dimension = self.scene.dimension.count();
        let mut total = self.laws.force(x, v, time);
        for (force, particle) in total.chunks_exact_mut(dimension).zip(&self.scene.particles) {
            if particle.fixed {
                force.fill(0.0);
            }
        }
        total
    }
}

impl ODE<f64, Vec<f64>> for Motion<'_> {
    fn diff(&self, time: f64, state: &Vec<f64>, rate: &mut Vec<f64>) {
        let dimension = self.scene.dimension.count();
        let (x, v) = state.split_at(state.len() / 2);
        let force = self.force(x, v, time);
        rate[..x.len()].copy_from_slice(v);
        for (place, force) in force.iter().enumerate() {
            rate[x.len() + place] = force / self.scene.particles[place / dimension].mass;
        }
    }
}
