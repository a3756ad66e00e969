//! Single steps of a trace, each redone from the trace's own states.
//!
//! ```text
//! envelope     the largest distance of a variant's step from ours, over the steps measured so far
//! tolerance    F (envelope + 4 ε size), as of whole traces
//! ```
//!
//! The variants are those of whole traces. Those of the start get other fifteenth digits in every state: a program may
//! write 15 digits and keep more.
//!
//! Cost: one step of ours for each step judged. The variants are stepped only where the tolerance so far is exceeded.

use fastrand::Rng;
use scene::Scene;
use scene::trace::State;

use super::variant::{Variant, variants};
use super::{Bound, Bounds, largest};
use crate::verdict::Quantity;

/// A step of a trace.
#[derive(Debug, Clone, Copy)]
pub struct SingleStep<'a> {
    /// Its number, counted from 0.
    pub step: u64,
    /// The state one step before, if there is one.
    pub earlier: Option<&'a State>,
    /// The state at its start.
    pub before: &'a State,
    /// The state at its end.
    pub after: &'a State,
}

/// A step that is out of tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct WrongStep {
    /// The first wrong particle.
    pub particle: usize,
    /// The wrong quantity of this particle, positions before velocities.
    pub quantity: Quantity,
    /// Its distance from our step's.
    pub residual: f64,
    /// The tolerance.
    pub bound: Bound,
    /// The state after our step.
    pub expected: State,
}

/// Judges single steps of a scene.
pub struct SingleSteps {
    scene: Scene,
    ours: Variant,
    /// Made when they are needed.
    variants: Option<Vec<Variant>>,
    random: Rng,
    envelope: Bounds,
    /// The largest coordinate and the largest velocity component so far.
    sizes: [f64; 2],
}

impl SingleSteps {
    /// Of a scene.
    pub fn new(scene: &Scene) -> Self {
        Self {
            scene: scene.clone(),
            ours: Variant::plain(scene),
            variants: None,
            random: Rng::with_seed(0),
            envelope: Bounds::default(),
            sizes: [0.0; 2],
        }
    }

    /// Coordinates of a particle.
    pub fn dimension(&self) -> usize {
        self.scene.dimension.count()
    }

    /// The fault of a step; `None` if it is right, or if our own step fails.
    pub fn check(&mut self, step: SingleStep<'_>) -> Option<WrongStep> {
        self.ours.restart(step.step, step.earlier, step.before, &mut self.random);
        if !self.ours.advance() {
            return None;
        }
        let (positions, velocities) = self.ours.state();
        let size = |size: f64, values: &[f64]| {
            values.iter().fold(size, |size: f64, value| size.max(value.abs()))
        };
        self.sizes = [size(self.sizes[0], &positions), size(self.sizes[1], &velocities)];
        let expected = State { time: None, positions, velocities };
        self.wrong(&expected, step.after)?;
        self.measure(step);
        let (particle, quantity, residual, bound) = self.wrong(&expected, step.after)?;
        Some(WrongStep { particle, quantity, residual, bound, expected })
    }

    /// Steps the variants, and widens the envelope by their differences.
    fn measure(&mut self, SingleStep { step, earlier, before, .. }: SingleStep<'_>) {
        let axes = self.dimension();
        let variants = self.variants.get_or_insert_with(|| variants(&self.scene));
        variants.retain_mut(|variant| {
            variant.restart(step, earlier, before, &mut self.random);
            variant.advance()
        });
        let Bounds { position, velocity } = largest(&self.ours, variants, axes);
        self.envelope = Bounds {
            position: self.envelope.position.max(position),
            velocity: self.envelope.velocity.max(velocity),
        };
    }

    /// The first wrong particle: its wrong quantity, the residual and the bound.
    fn wrong(&self, expected: &State, got: &State) -> Option<(usize, Quantity, f64, Bound)> {
        let axes = self.dimension();
        let quantities = [
            (Quantity::Position, &expected.positions, &got.positions),
            (Quantity::Velocity, &expected.velocities, &got.velocities),
        ];
        let bounds = [
            Bound::of(self.envelope.position, self.sizes[0]),
            Bound::of(self.envelope.velocity, self.sizes[1]),
        ];
        (0..self.scene.particles.len()).find_map(|particle| {
            let range = particle * axes..(particle + 1) * axes;
            quantities.iter().zip(bounds).find_map(|(&(quantity, expected, got), bound)| {
                let pairs = expected[range.clone()].iter().zip(&got[range.clone()]);
                let residual = pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
                (residual > bound.tolerance).then_some((particle, quantity, residual, bound))
            })
        })
    }
}
