//! Integrator, time step and duration of a generated scene.
//!
//! Symplectic Euler stays stable as long as
//!
//! ```text
//! h² ω² + 2 h c < 4        ω² = max_i Σ_e Σ_j ‖K^e_ij‖ / m_i        c = max_i Σ_e Σ_j ‖B^e_ij‖ / m_i
//! ```
//!
//! with the blocks of the Jacobians `K^e = ∂F/∂x` and `B^e = ∂F/∂v` of each element at the start, their Frobenius norms, and
//! the free particles `i`: ω² and c bound the eigenvalues of M⁻¹K and M⁻¹B, as in Gershgorin's theorem, and the inequality is
//! the Jury criterion of `v' = v − h (ω² x + c v)`, `x' = x + h v'`. A spring at its rest length adds 2k/m. A time step that is
//! chosen here makes the left side at most 1, which leaves room for elements that stretch and turn. Explicit Euler is given the
//! same step: it has no such bound, and gains energy at any step where damping does not take it away.

use super::error::{GenerateErrorKind, check};
use super::options::{OptionSpec, Rule, options};
use crate::force::{ElementJacobians, ForceKind, JacobianSink};
use crate::system::{BuildForce, System};
use crate::vocabulary;
use scene::schema::{Domain, Family, IntegratorOptions, IntegratorSchema, OptionError};
use scene::spelling::closest;
use scene::{Dimension, MAX_STEPS, Scene, step_count};

/// The heading of these options.
const HEADING: &str = "Stepping and output";

options! {
    /// Integrator, time step and duration of a generated scene.
    pub struct Timeline {
        /// Time integrator; see simulate --help.
        integrator: &'static IntegratorSchema => OptionSpec::value("integrator", "TYPE").heading(HEADING);
        /// Set an option of the integrator; may be given several times.
        options: Vec<(String, String)> => OptionSpec::value("option", "NAME=VALUE").heading(HEADING);
        /// Time step in seconds [default: one that suits the scene, and the stability of symplectic Euler; explicit Euler gains energy at any].
        time_step: Option<f64> => OptionSpec::value("dt", "SECONDS").heading(HEADING);
        /// Simulated time in seconds.
        duration: f64 => OptionSpec::number("duration", "SECONDS", Domain::NonNegative).heading(HEADING);
        /// Simulated time, in time steps.
        steps: Option<u64> => OptionSpec::value("steps", "COUNT").heading(HEADING).rule(Rule::Excludes("duration"));
    }
}

/// Parses the name of an integrator.
///
/// # Errors
/// If there is no such integrator; the message names the most similar one, and lists all.
pub fn parse_integrator(text: &str) -> Result<&'static IntegratorSchema, String> {
    let vocabulary = vocabulary();
    vocabulary.integrator(text).ok_or_else(|| {
        let names: Vec<&str> = vocabulary.integrators.iter().map(|schema| schema.name).collect();
        let known = format!("known types: {}", names.join(", "));
        closest(text, &names)
            .map_or(known.clone(), |name| format!("did you mean {name:?}? {known}"))
    })
}

/// Parses `NAME=VALUE`.
///
/// # Errors
/// If there is no `=`.
pub fn parse_option(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE, such as iterations=20")?;
    Ok((name.trim().to_owned(), value.trim().to_owned()))
}

impl Timeline {
    /// A timeline of that integrator and of that many seconds, its time step chosen.
    pub(super) fn of(integrator: &str, seconds: f64) -> Self {
        let integrator = vocabulary().integrator(integrator);
        let integrator = integrator.expect("the generators name integrators of the registry");
        Self { integrator, options: Vec::new(), time_step: None, duration: seconds, steps: None }
    }

    /// Gives the scene its time step and duration. `usual` is the time step that suits the kind.
    pub(super) fn apply(&self, usual: f64, scene: &mut Scene) -> Result<(), GenerateErrorKind> {
        scene.integrator = self.integrator;
        scene.integrator_options = IntegratorOptions::defaults(self.integrator);
        for (option, text) in &self.options {
            let (integrator, option, text) = (self.integrator.name, option.clone(), text.clone());
            match scene.integrator_options.set(&option, &text) {
                Ok(()) => {}
                Err(OptionError::Unknown) => {
                    return Err(GenerateErrorKind::UnknownOption { integrator, option });
                }
                Err(OptionError::Value { must_be }) => {
                    return Err(GenerateErrorKind::OptionValue {
                        integrator,
                        option,
                        text,
                        must_be,
                    });
                }
            }
        }
        if let Some((option, must_be)) = scene.integrator_options.excess() {
            let (integrator, option) = (self.integrator.name, option.name.to_owned());
            let text = scene.integrator_options.count(&option).to_string();
            return Err(GenerateErrorKind::OptionValue { integrator, option, text, must_be });
        }
        scene.time_step = match self.time_step {
            Some(time_step) => time_step,
            None if self.is_explicit() => usual.min(round_down(longest_stable(scene))),
            None => usual,
        };
        check("dt", scene.time_step, Domain::Positive)?;
        scene.duration =
            self.steps.map_or(self.duration, |steps| duration_of(steps, scene.time_step));
        let steps = step_count(scene.duration, scene.time_step);
        if steps > MAX_STEPS as f64 {
            let (duration, time_step) = (scene.duration, scene.time_step);
            return Err(GenerateErrorKind::TooManySteps { duration, time_step, steps });
        }
        Ok(())
    }

    /// Whether a step too long for the forces makes the method explode.
    fn is_explicit(&self) -> bool {
        matches!(self.integrator.family, Family::Explicit | Family::Symplectic)
    }
}

/// The duration that gives this many steps: their product, or the next numbers below it where rounding
/// would add a step (7 steps of 0.01 s are 0.07 s, and 0.07 / 0.01 rounds to more than 7).
fn duration_of(steps: u64, time_step: f64) -> f64 {
    let mut duration = steps as f64 * time_step;
    while duration.is_finite() && step_count(duration, time_step) > steps as f64 {
        duration = duration.next_down();
    }
    duration
}

/// The longest time step with h² ω² + 2 h c ≤ 1; infinite without forces that depend on the state.
fn longest_stable(scene: &Scene) -> f64 {
    match scene.dimension {
        Dimension::Two => longest_stable_of::<2>(scene),
        Dimension::Three => longest_stable_of::<3>(scene),
    }
}

fn longest_stable_of<const D: usize>(scene: &Scene) -> f64
where
    ForceKind: BuildForce<D>,
{
    let mut sums = NormSums(vec![[0.0; 2]; scene.particles.len()]);
    let system = System::<D>::new(scene);
    if system.jacobians(&scene.positions(), &scene.velocities(), 0.0, &mut sums).is_err() {
        return f64::INFINITY;
    }
    let free = scene.particles.iter().zip(&sums.0).filter(|(particle, _)| !particle.fixed);
    let [omega_squared, c] =
        free.fold([0.0, 0.0], |[omega_squared, c]: [f64; 2], (particle, sum)| {
            [omega_squared.max(sum[0] / particle.mass), c.max(sum[1] / particle.mass)]
        });
    1.0 / (c + (c * c + omega_squared).sqrt())
}

/// The norms of the blocks in the row of each particle: by position, and by velocity.
struct NormSums(Vec<[f64; 2]>);

impl<const D: usize> JacobianSink<D> for NormSums {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        for (place, blocks) in [element.by_position, element.by_velocity].into_iter().enumerate() {
            element.spread(blocks, |row, _, block| self.0[row][place] += block.norm());
        }
    }
}

/// The next of …, 0.01, 0.02, 0.05, 0.1, … at or below a number above 0; the number where none is.
pub(super) fn round_down(value: f64) -> f64 {
    let decades = (-20..=3).rev();
    let mut steps = decades.flat_map(|decade| [5, 2, 1].map(|digit| format!("{digit}e{decade}")));
    steps.find_map(|text| text.parse().ok().filter(|step| *step <= value)).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_steps_is_the_one_asked_for() {
        let mut shortened = 0;
        for time_step in [0.01, 0.004, 0.1, 1.0 / 24.0, 1e-300, 3.0] {
            for steps in 0..3000 {
                let duration = duration_of(steps, time_step);
                assert_eq!(step_count(duration, time_step), steps as f64, "{steps} · {time_step}");
                shortened += u64::from(duration != steps as f64 * time_step);
            }
        }
        assert!(shortened > 0, "plain products are not enough");
    }

    #[test]
    fn a_chosen_time_step_is_a_round_number_at_or_below_the_bound() {
        for (bound, step) in
            [(0.0123, 0.01), (0.02, 0.02), (0.0999, 0.05), (7.1e-5, 5e-5), (f64::INFINITY, 5e3)]
        {
            assert_eq!(round_down(bound), step, "{bound}");
        }
        assert_eq!(round_down(1e-30), 1e-30);
    }
}
