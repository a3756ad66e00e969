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
use simulator::scene::{ForceElement, Scene};

use super::closed::starts;
use crate::law::{self, Expectation};

/// Tolerances, relative and (scaled by the size of the scene) absolute: of the reference, and of the second run for the
/// error bar.
pub const TOLERANCES: [f64; 2] = [1e-13, 1e-10];

/// Maximum number of steps between two samples; beyond it, the scene is too stiff for an explicit method.
const MAX_STEPS: usize = 200_000;

/// The states of a scene at `times`, which ascend from 0: positions and velocities one after the other, `2·n·D`
/// numbers each.
///
/// # Errors
/// A message, if the method does not reach the last time.
pub fn solve(scene: &Scene, times: &[f64], tolerance: f64) -> Result<Vec<Vec<f64>>, String> {
    let parts = parts(scene);
    let motion = Motion::new(scene, &parts)?;
    let (positions, velocities) = starts(scene);
    let mut state = [positions, velocities].concat();
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

/// Copies of the scene, one per kind of force, each with the forces of that kind only.
pub fn parts(scene: &Scene) -> Vec<Scene> {
    let mut parts: Vec<Scene> = Vec::new();
    for element in &scene.forces {
        let is_of_kind = |part: &&mut Scene| part.forces[0].schema == element.schema;
        if let Some(part) = parts.iter_mut().find(is_of_kind) {
            part.forces.push(element.clone());
        } else {
            let forces: Vec<ForceElement> = vec![element.clone()];
            parts.push(Scene { forces, ..scene.clone() });
        }
    }
    parts
}

/// The laws of a scene, summed.
pub struct Motion<'a> {
    scene: &'a Scene,
    laws: Vec<Expectation<'a>>,
}

impl<'a> Motion<'a> {
    /// # Errors
    /// If a force has no law.
    pub fn new(scene: &'a Scene, parts: &'a [Scene]) -> Result<Self, String> {
        let law = |part: &'a Scene| {
            let tag = part.forces[0].schema.tag;
            let law = law::find(tag).ok_or_else(|| format!("no reference law for <{tag}>"))?;
            Ok(Expectation::new(law, part))
        };
        let laws = parts.iter().map(law).collect::<Result<_, String>>()?;
        Ok(Self { scene, laws })
    }

    /// The force on every particle; zero on fixed ones.
    pub fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        let dimension = self.scene.dimension.count();
        let mut total = vec![0.0; x.len()];
        for law in &self.laws {
            for (sum, force) in total.iter_mut().zip(law.force(x, v, time)) {
                *sum += force;
            }
        }
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
