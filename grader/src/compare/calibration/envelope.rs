//! The envelope of a scene: a non-decreasing step function over the states, with few steps.
//!
//! A step has the height of the envelope at the step's end, and ends before the envelope has grown by half since the
//! step's start. So the function is never below the envelope, and at most half above it.

use serde::Deserialize;

/// Maximum growth of the envelope within a step, as a factor.
const GROWTH: f64 = 1.5;

/// Bounds on the differences between correct programs, over the states of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Number of variants it was measured with.
    pub variants: usize,
    /// Its steps, in order.
    checkpoints: Vec<Checkpoint>,
    /// The prediction horizon; `None` if all states are compared.
    pub horizon: Option<Horizon>,
}

/// The end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Checkpoint {
    /// The last state of the step.
    to_step: u64,
    bounds: Bounds,
}

/// A bound on positions and one on velocities.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bounds {
    /// Bound on the distance in position.
    pub position: f64,
    /// Bound on the distance in velocity.
    pub velocity: f64,
}

/// The prediction horizon: from here on, states are not compared.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Horizon {
    /// The first state that is not compared.
    pub step: u64,
    /// The largest difference in energy between variants from there on.
    pub energy: f64,
    /// The largest difference in momentum between variants from there on.
    pub momentum: f64,
}

impl Envelope {
    /// That of programs that do not differ: only the floor is left of a tolerance.
    pub fn zero() -> Self {
        Self { variants: 0, checkpoints: Vec::new(), horizon: None }
    }

    /// The envelope at this state. After the last step, the last value holds.
    pub fn at(&self, step: u64) -> Bounds {
        let place = self.checkpoints.partition_point(|checkpoint| checkpoint.to_step < step);
        let found = self.checkpoints.get(place).or(self.checkpoints.last());
        found.map(|checkpoint| checkpoint.bounds).unwrap_or_default()
    }

    /// Whether this state is before the horizon.
    pub fn is_predictable(&self, step: u64) -> bool {
        self.horizon.is_none_or(|horizon| step < horizon.step)
    }
}

/// An envelope under construction.
pub(super) struct Builder {
    envelope: Envelope,
    /// The envelope at the start of the current step.
    base: Bounds,
    /// The envelope so far.
    largest: Bounds,
}

impl Builder {
    pub(super) fn new(variants: usize) -> Self {
        let envelope = Envelope { variants, checkpoints: Vec::new(), horizon: None };
        Self { envelope, base: Bounds::default(), largest: Bounds::default() }
    }

    pub(super) fn is_predictable(&self) -> bool {
        self.envelope.horizon.is_none()
    }

    /// Adds the differences between variants at the next state.
    pub(super) fn add(&mut self, step: u64, found: Bounds) {
        self.largest = Bounds {
            position: self.largest.position.max(found.position),
            velocity: self.largest.velocity.max(found.velocity),
        };
        let fits = |now: f64, base: f64| now <= GROWTH * base;
        let extends = fits(self.largest.position, self.base.position)
            && fits(self.largest.velocity, self.base.velocity);
        let bounds = Bounds {
            position: rounded_up(self.largest.position),
            velocity: rounded_up(self.largest.velocity),
        };
        match self.envelope.checkpoints.last_mut() {
            Some(last) if extends => *last = Checkpoint { to_step: step, bounds },
            _ => {
                self.base = self.largest;
                self.envelope.checkpoints.push(Checkpoint { to_step: step, bounds });
            }
        }
    }

    /// Sets the horizon to this state.
    pub(super) fn end_at(&mut self, step: u64) {
        self.envelope.horizon = Some(Horizon { step, energy: 0.0, momentum: 0.0 });
    }

    /// Adds a difference in energy and in momentum beyond the horizon.
    pub(super) fn add_beyond(&mut self, (energy, momentum): (f64, f64)) {
        if let Some(horizon) = &mut self.envelope.horizon {
            horizon.energy = horizon.energy.max(rounded_up(energy));
            horizon.momentum = horizon.momentum.max(rounded_up(momentum));
        }
    }

    pub(super) fn finish(self) -> Envelope {
        self.envelope
    }
}

/// The number rounded up to two digits.
fn rounded_up(value: f64) -> f64 {
    // 5 % is half a unit of the second digit of 1.0, the worst case.
    format!("{:.1e}", value * 1.05).parse().unwrap_or(f64::INFINITY)
}

/// An envelope in its stored form, with the name of its scene.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredEnvelope {
    /// The scene.
    pub name: String,
    variants: usize,
    to_step: Vec<u64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    horizon: Option<Horizon>,
}

impl StoredEnvelope {
    /// The stored form of an envelope.
    pub fn of(name: &str, envelope: &Envelope) -> Self {
        let of_each = |quantity: fn(&Bounds) -> f64| {
            let checkpoints = envelope.checkpoints.iter();
            checkpoints.map(|checkpoint| quantity(&checkpoint.bounds)).collect()
        };
        Self {
            name: name.to_owned(),
            variants: envelope.variants,
            to_step: envelope.checkpoints.iter().map(|checkpoint| checkpoint.to_step).collect(),
            position: of_each(|bounds| bounds.position),
            velocity: of_each(|bounds| bounds.velocity),
            horizon: envelope.horizon,
        }
    }

    /// Its TOML entry in the file of envelopes.
    pub fn entry(&self) -> String {
        let name = toml::Value::String(self.name.clone());
        let list = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
            values.join(", ")
        };
        let mut text = format!(
            "[[scene]]\nname = {name}\nvariants = {}\nto_step = {:?}\nposition = [{}]\nvelocity = [{}]\n",
            self.variants,
            self.to_step,
            list(&self.position),
            list(&self.velocity),
        );
        if let Some(Horizon { step, energy, momentum }) = self.horizon {
            text += &format!(
                "horizon = {{ step = {step}, energy = {energy:e}, momentum = {momentum:e} }}\n"
            );
        }
        text
    }

    /// The envelope; `None` unless the lists are sorted, finite and of equal length.
    pub fn envelope(&self) -> Option<Envelope> {
        let Self { to_step, position, velocity, .. } = self;
        let sorted = to_step.is_sorted() && position.is_sorted() && velocity.is_sorted();
        let same = to_step.len() == position.len() && to_step.len() == velocity.len();
        let finite =
            position.iter().chain(velocity).all(|value| value.is_finite() && *value >= 0.0);
        if !(sorted && same && finite) {
            return None;
        }
        let bounds = position.iter().zip(velocity);
        let checkpoints = to_step.iter().zip(bounds).map(|(&to_step, (&position, &velocity))| {
            Checkpoint { to_step, bounds: Bounds { position, velocity } }
        });
        Some(Envelope {
            variants: self.variants,
            checkpoints: checkpoints.collect(),
            horizon: self.horizon,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_up_to_two_digits_never_lowers_a_value() {
        for value in [0.0, 1e-16, 1.0, 1.04e-9, 9.96e3, 2.0f64.powi(-52), 3.3333] {
            let rounded = rounded_up(value);
            assert!(rounded >= value && rounded <= 1.16 * value, "{value}: {rounded}");
        }
    }

    #[test]
    fn the_stored_envelope_is_never_below_and_at_most_three_quarters_above_the_largest_so_far() {
        let mut builder = Builder::new(1);
        let found = |step: u64| {
            let growth = 1e-16 * 1.07_f64.powf(step as f64);
            Bounds { position: growth * (1.0 + (step as f64).sin().abs()), velocity: 3.0 * growth }
        };
        (0..400).for_each(|step| builder.add(step, found(step)));
        let envelope = builder.finish();
        let stored = StoredEnvelope::of("scene", &envelope);
        assert_eq!(stored.envelope(), Some(envelope.clone()));
        let mut largest = Bounds::default();
        for step in 0..400 {
            largest.position = largest.position.max(found(step).position);
            largest.velocity = largest.velocity.max(found(step).velocity);
            let Bounds { position, velocity } = envelope.at(step);
            assert!((largest.position..=1.75 * largest.position).contains(&position), "{step}");
            assert!((largest.velocity..=1.75 * largest.velocity).contains(&velocity), "{step}");
        }
        assert!(envelope.checkpoints.len() < 100);
    }
}
