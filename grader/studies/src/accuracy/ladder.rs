//! Ladder of measurements: each method with each setting, at each time step.
//!
//! ```text
//! h_k = h_0/2^k        k = 0, 1, …, rungs − 1
//! ```
//!
//! The methods are those of the simulator's registry that support the scene. A method with an entry in `SETTINGS` is
//! measured once per setting.

use simulator::integrator::REGISTRY;
use simulator::scene::Scene;
use simulator::scene::schema::{IntegratorOptions, IntegratorSchema};

/// Settings of an option that affects accuracy.
struct Setting {
    integrator: &'static str,
    option: &'static str,
    value: &'static str,
    /// Whether the error tends to zero with the time step.
    converges: bool,
}

/// A solver's tolerance leaves an error that smaller time steps do not reduce: only the tightest tolerance has an
/// order.
const SETTINGS: &[Setting] = &[
    Setting {
        integrator: "projected-newton",
        option: "tolerance",
        value: "1e-2",
        converges: false,
    },
    Setting {
        integrator: "projected-newton",
        option: "tolerance",
        value: "1e-5",
        converges: false,
    },
    Setting {
        integrator: "projected-newton",
        option: "tolerance",
        value: "1e-10",
        converges: true,
    },
    Setting { integrator: "fast-mass-spring", option: "iterations", value: "1", converges: true },
    Setting { integrator: "fast-mass-spring", option: "iterations", value: "10", converges: true },
    Setting { integrator: "fast-mass-spring", option: "iterations", value: "100", converges: true },
];

/// The order of a method on smooth motions: its error is proportional to this power of the time step.
pub fn theoretical_order(integrator: &str) -> Option<f64> {
    match integrator {
        // Implicit Euler's relatives solve its equation to first order or better.
        "explicit-euler"
        | "symplectic-euler"
        | "linearized-implicit-euler"
        | "implicit-euler"
        | "projected-newton"
        | "fast-mass-spring" => Some(1.0),
        _ => None,
    }
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
        let order = theoretical_order(integrator.name);
        let settings: Vec<&Setting> =
            SETTINGS.iter().filter(|setting| setting.integrator == integrator.name).collect();
        if settings.is_empty() {
            methods.push(Method { integrator, setting: None, order });
        }
        methods.extend(settings.into_iter().map(|setting| Method {
            integrator,
            setting: Some((setting.option, setting.value)),
            order: order.filter(|_| setting.converges),
        }));
    }
    methods
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_one_that_its_integrator_has() {
        for Setting { integrator, option, value, .. } in SETTINGS {
            let kind = REGISTRY.iter().find(|kind| kind.schema.name == *integrator);
            let mut options = IntegratorOptions::defaults(&kind.expect("registered").schema);
            assert!(options.set(option, value).is_ok(), "{integrator} {option}={value}");
        }
    }

    #[test]
    fn every_integrator_has_an_order() {
        for kind in REGISTRY {
            assert!(theoretical_order(kind.schema.name).is_some(), "{}", kind.schema.name);
        }
    }

    #[test]
    fn as_many_steps_are_taken_as_were_asked_for() {
        for time_step in [0.1, 0.3, 1e-3, 0.7, 0.005, 1.0 / 3.0] {
            for steps in 1..2000 {
                let quotient = duration(steps, time_step) / time_step;
                assert_eq!(quotient.ceil(), steps as f64, "{steps} of {time_step}");
            }
        }
    }
}
