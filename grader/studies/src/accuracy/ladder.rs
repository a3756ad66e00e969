//! Ladder of measurements: each method with each setting, at each time step.
//!
//! ```text
//! h_k = T/(8·2^k)        k = 0, 1, …        T: the duration
//! ```
//!
//! For any time step of a scene, its ladder starts with so few steps that even a method of order 5 has errors far above
//! rounding, and stops where shorter steps only show rounding ([`super::AccuracyConfig`] sets the limits). In between is
//! the range where the error is proportional to a power of the step ([`super::order`] finds it). The first steps may be
//! unstable: that is an outcome as well.
//!
//! The methods are those of the simulator's registry that support the scene. A method with an entry in `SETTINGS` is
//! measured once per setting.

use scene::Scene;
use scene::schema::{IntegratorOptions, IntegratorSchema};
use simulator::integrator::REGISTRY;

/// Number of steps at the start of the ladder. Runs are compared with the reference after each of them.
pub const STEPS: u64 = 8;

/// The scene with the coarsest time step of its ladder.
pub fn coarsest(scene: Scene) -> Scene {
    let time_step = scene.time_step * scene.n_steps() as f64 / STEPS as f64;
    let steps = if time_step > 0.0 { STEPS } else { 0 };
    Scene { time_step, duration: duration(steps, time_step), ..scene }
}

/// A method with its setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// The method.
    pub integrator: &'static IntegratorSchema,
    /// The option that is set, and its value.
    pub setting: Option<(&'static str, &'static str)>,
    /// The theoretical order; `None` if there is none.
    pub order: Option<f64>,
}

impl Method {
    /// Its label in reports.
    pub fn label(&self) -> String {
        match self.setting {
            Some((option, value)) => format!("{} {option}={value}", self.integrator.name),
            None => self.integrator.name.to_owned(),
        }
    }

    /// The scene with this method, each of its steps divided into `refinement` steps.
    pub fn scene(&self, scene: &Scene, refinement: u64) -> Scene {
        let mut options = IntegratorOptions::defaults(self.integrator);
        if let Some((option, value)) = self.setting {
            let set = options.set(option, value);
            debug_assert!(set.is_ok(), "{option}={value}");
        }
        let steps = scene.n_steps() * refinement;
        // Division by a power of two is exact: every time step has the same digits.
        let time_step = scene.time_step / refinement as f64;
        Scene {
            integrator: self.integrator,
            integrator_options: options,
            time_step,
            duration: duration(steps, time_step),
            ..scene.clone()
        }
    }
}

/// The duration of `steps` steps: a number whose quotient by the time step rounds up to `steps`.
fn duration(steps: u64, time_step: f64) -> f64 {
    let duration = steps as f64 * time_step;
    if (duration / time_step).ceil() > steps as f64 { duration.next_down() } else { duration }
}

/// Every method that supports the scene, in the order of the registry.
pub fn methods(scene: &Scene) -> Vec<Method> {
    let mut methods = Vec::new();
    for kind in REGISTRY {
        let integrator = &kind.schema;
        if scene.forces.iter().any(|force| (integrator.refuses)(force).is_some()) {
            continue;
        }
        let with_velocity = scene.forces.iter().any(|force| force.depends_on().velocity);
        let order = f64::from(if with_velocity {
            integrator.order.with_velocity
        } else {
            integrator.order.without_velocity
        });
        // A step that ends within a tolerance leaves an error that no shorter step takes away: only the tightest
        // tolerance has an order.
        let settings = integrator.options.iter().flat_map(|option| {
            option.accuracy.iter().map(|setting| Method {
                integrator,
                setting: Some((option.name, setting.value)),
                order: setting.converges.then_some(order),
            })
        });
        let n_known = methods.len();
        methods.extend(settings);
        if methods.len() == n_known {
            methods.push(Method { integrator, setting: None, order: Some(order) });
        }
    }
    methods
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_a_valid_option_value() {
        for kind in REGISTRY {
            for option in kind.schema.options {
                for setting in option.accuracy {
                    let mut options = IntegratorOptions::defaults(&kind.schema);
                    let name = kind.schema.name;
                    let (option, value) = (option.name, setting.value);
                    assert!(options.set(option, value).is_ok(), "{name} {option}={value}");
                }
            }
        }
    }

    #[test]
    fn ladder_takes_the_requested_steps() {
        for time_step in [0.1, 0.3, 1e-3, 0.7, 0.005, 1.0 / 3.0] {
            for steps in 1..2000 {
                let quotient = duration(steps, time_step) / time_step;
                assert_eq!(quotient.ceil(), steps as f64, "{steps} of {time_step}");
            }
        }
    }
}
