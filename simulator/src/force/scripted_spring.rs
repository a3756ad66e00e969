//! Hookean spring whose rest length follows a script: it grows or shrinks, as of something inflated.
//!
//! ```text
//! r(t) = l0 + (l1 − l0) t/t1  for 0 ≤ t < t1,  l1 from then on
//! U    = k/2 (l − r(t))²       f, ∂f/∂d: those of a spring of rest length r(t)       l = |d|
//! ```
//!
//! At each moment it is a [spring](super::spring) of constant rest length without damping. `U` is the potential of the
//! moment: changing the rest length does work, and energy is not conserved. Source: hand-out of milestone 2, section
//! 3.1, which suggests it for an artistic effect and leaves the script open. For damping, add a `<springforce>` of `k` = 0.

use super::law::PairLaw;
use super::pair::PairForce;
use super::spring::Spring;
use super::{Block, Force, ForceKind, Numbered, Vector};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, ForceElement, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "scriptedspringforce",
        title: "spring with a scripted rest length",
        formula: "`F_i = −k (l − r) n`, `F_j = −F_i`, with the rest length `r = l0 + (l1 − l0) t/t1` up to the time `t1`, and `l1` from then on",
        derivatives: Derivatives {
            by_position: "that of a `springforce` with `l0 = r`, `b = 0`",
            by_velocity: "0",
            energy: "`U = k/2 (l − r)²`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Edge,
        parameters: &[
            ParameterSchema::new("k", "stiffness", (1.0, 100.0), [4.0, 6.0, 5.0]).non_negative(),
            ParameterSchema::new("l0", "rest length at first", (0.2, 2.0), [0.75, 2.5, 0.625])
                .non_negative()
                .length(),
            ParameterSchema::new("l1", "rest length at last", (0.2, 2.0), [1.5, 0.5, 1.25])
                .non_negative()
                .length(),
            ParameterSchema::new("t1", "time of the change", (0.5, 4.0), [2.0, 4.0, 8.0])
                .positive(),
        ],
        parts: &[PartSchema::whole(
            &["k"],
            &["l0", "l1", "t1"],
            Dependence::POSITION_AND_TIME,
            Potential::Energy,
        )],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<scriptedspringforce edge="0" k="100" l0="1" l1="2" t1="5"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::<Vec<_>>::new::<D>(scene, elements, |element, _| {
        ScriptedSpring::of_element(element)
    }))
}

#[derive(Clone, Copy)]
struct ScriptedSpring {
    first_length: f64,
    last_length: f64,
    duration: f64,
    /// The spring of the moment.
    spring: Spring,
}

impl ScriptedSpring {
    fn of_element(element: &ForceElement) -> Self {
        let [stiffness, first_length, last_length, duration] =
            ["k", "l0", "l1", "t1"].map(|name| element.parameter(name));
        let spring = Spring { stiffness, rest_length: first_length, damping: 0.0 };
        Self { first_length, last_length, duration, spring }
    }
}

impl<const D: usize> PairLaw<D> for ScriptedSpring {
    const USES_VELOCITY: bool = false;

    fn at(self, time: f64) -> Self {
        let Self { first_length, last_length, duration, spring } = self;
        let rest_length = if time < duration {
            first_length + (last_length - first_length) * (time / duration)
        } else {
            last_length
        };
        Self { spring: Spring { rest_length, ..spring }, ..self }
    }

    fn energy(&self, distance: f64) -> Option<f64> {
        PairLaw::<D>::energy(&self.spring, distance)
    }

    fn force(&self, d: &Vector<D>, w: &Vector<D>) -> Option<Vector<D>> {
        self.spring.force(d, w)
    }

    fn jacobians(&self, d: &Vector<D>, w: &Vector<D>) -> Option<(Block<D>, Block<D>)> {
        self.spring.jacobians(d, w)
    }
}
