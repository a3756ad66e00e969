//! Problems of the accuracy study, with or without a closed form.
//!
//! Each is a scene file that any simulator can read. To add a problem, add a file in `scenes/`, a line in [`PROBLEMS`], and
//! a closed form if there is one.

use scene::{ParseOptions, Scene, xml};
use simulator::vocabulary;

use super::order::{Exception, Expected};
use ::reference::closed::{self, Closed};

/// A scene whose solution is known or computed by a method of high order.
pub struct Problem {
    /// Its name.
    pub name: &'static str,
    /// Short description of the motion.
    pub title: &'static str,
    /// The scene file.
    pub xml: &'static str,
    /// The closed form of its motion, if any.
    pub closed: Option<fn(&Scene) -> Closed>,
    /// Exceptions from the usual orders, with reasons.
    pub exceptions: &'static [Exception],
}

impl Problem {
    /// The scene.
    ///
    /// # Panics
    /// Never: a test reads them all.
    pub fn scene(&self) -> Scene {
        let parsed = xml::parse(self.xml, self.name, &vocabulary(), &ParseOptions::default());
        parsed.expect("the scenes of the registry are well-formed").scene
    }
}

macro_rules! problem {
    ($name:literal, $title:literal, $closed:expr, $exceptions:expr) => {
        Problem {
            name: $name,
            title: $title,
            xml: include_str!(concat!("scenes/", $name, ".xml")),
            closed: $closed,
            exceptions: $exceptions,
        }
    };
}

/// Methods that evaluate gravitation at the start of a step and move with the new velocity.
const EXPLICIT_FORCE: &[&str] = &["symplectic-euler", "fast-mass-spring"];

/// Runge–Kutta 4 on undamped linear springs: `|R(ihω)|² = 1 − (hω)⁶/72 + …`.
const ENERGY_OF_SPRINGS: Exception = Exception {
    integrators: &["runge-kutta-4"],
    quantity: super::Quantity::Energy,
    expected: Expected::Order(5.0),
    reason: "a step leaves 1 − (hω)⁶/72 of the energy of an undamped linear oscillation",
};

/// Symplectic Euler where forces depend on positions alone.
const LEAPFROG: Exception = Exception {
    integrators: &["symplectic-euler"],
    quantity: super::Quantity::Velocity,
    expected: Expected::Order(2.0),
    reason: "from rest, symplectic Euler is the leapfrog method with positions half a step ahead",
};

/// All problems, those with a closed form first.
pub static PROBLEMS: &[Problem] = &[
    problem!(
        "free-fall",
        "throw under gravity",
        Some(closed::thrown),
        &[Exception {
            integrators: &[],
            quantity: super::Quantity::Velocity,
            expected: Expected::Exact,
            reason: "a constant force: every method adds h g",
        }]
    ),
    problem!("falling-with-drag", "fall in a viscous liquid", Some(closed::dragged), &[]),
    problem!("wind", "particle in a wind that changes with time", Some(closed::windy), &[]),
    problem!(
        "oscillator",
        "mass on a spring, undamped",
        Some(closed::oscillator),
        &[ENERGY_OF_SPRINGS]
    ),
    problem!("damped-oscillator", "mass on a spring, damped", Some(closed::oscillator), &[]),
    problem!("stiff-damped-spring", "rates of 20/s and 380/s", Some(closed::oscillator), &[]),
    problem!(
        "ellipse",
        "spring of rest length zero, in the plane",
        Some(closed::oscillator),
        &[ENERGY_OF_SPRINGS]
    ),
    problem!("kepler-orbit", "two unequal bodies, eccentric orbit", Some(closed::orbit), &[]),
    problem!(
        "eccentric-orbit",
        "two unequal bodies, eccentricity 0.9",
        Some(closed::orbit),
        &[
            Exception {
                integrators: &["runge-kutta-4"],
                quantity: super::Quantity::Energy,
                expected: Expected::Order(5.0),
                reason: "the errors in h⁴ before and after the nearest point cancel",
            },
            Exception {
                integrators: &["bdf2"],
                quantity: super::Quantity::Energy,
                expected: Expected::Order(3.0),
                reason: "the errors in h² before and after the nearest point cancel",
            },
        ]
    ),
    problem!(
        "circular-orbit",
        "two equal bodies, circular orbit",
        Some(closed::orbit),
        &[
            Exception {
                integrators: EXPLICIT_FORCE,
                quantity: super::Quantity::Energy,
                expected: Expected::Order(2.0),
                reason: "force and velocity are at right angles on a circle, where the term in h vanishes",
            },
            Exception {
                integrators: &["velocity-verlet", "implicit-midpoint"],
                quantity: super::Quantity::Energy,
                expected: Expected::Order(4.0),
                reason: "a symmetric method conserves an energy that differs by h², and by the same amount all along a circle",
            },
            Exception {
                integrators: &["runge-kutta-4"],
                quantity: super::Quantity::Energy,
                expected: Expected::Order(5.0),
                reason: "on a circle, the term in h⁴ turns the orbit and leaves its energy",
            },
        ]
    ),
    problem!(
        "chain-modes",
        "six masses in a line, all modes",
        Some(closed::chain),
        &[ENERGY_OF_SPRINGS]
    ),
    problem!("spring-pendulum", "elastic pendulum", None, &[]),
    problem!("pendulum", "pendulum on a stiff spring", None, &[LEAPFROG]),
    problem!("hanging-net", "net of sixteen particles, falling", None, &[]),
    problem!("net", "net of the slides, hung by two corners", None, &[LEAPFROG]),
    problem!("flag", "flag in the wind, in three dimensions", None, &[]),
    problem!("vortex-pair", "two particles in a vortex", None, &[]),
    problem!("combined", "dumbbell, drag, gravity and gravitation", None, &[]),
    problem!("squared-springs", "triangle of springs of squared length", None, &[]),
];
