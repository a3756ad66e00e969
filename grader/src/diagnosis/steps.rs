//! Redoes each step of a trace from the trace's own previous state.
//!
//! A step is right within ten times the change of our own step when the last bits of its start change, plus the floor
//! of [`calibration`](crate::calibration), plus the error that a linear solver of backward error 1e-12 may leave.

use fastrand::Rng;
use simulator::scene::Scene;
use simulator::solver::linear::LinearSolver;
use simulator::trace::State;

use crate::calibration::Bound;
use crate::stepping::Stepper;

/// Number of starts with other last bits.
const PERTURBED: u64 = 3;

/// Ten times the error of an iterative solver, relative to the change of the velocities.
const SOLVER: f64 = 1e-11;

/// Maximum number of wrong steps that are examined.
const SAMPLES: usize = 10;

/// Maximum number of reported ranges of wrong steps.
const RANGES: usize = 6;

/// The steps of a trace that are wrong by themselves.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WrongSteps {
    /// Number of examined steps.
    pub total: u64,
    /// Number of wrong steps.
    pub wrong: u64,
    /// The first ranges of wrong steps: first and last step, counted from 1.
    pub ranges: Vec<[u64; 2]>,
    /// Whether the trace starts from the scene's initial state.
    pub starts_right: bool,
    /// Whether all its numbers are in single precision.
    pub single_precision: bool,
    /// The largest number of digits of any of its numbers.
    pub digits: usize,
}

impl WrongSteps {
    /// The description.
    pub fn words(&self) -> String {
        let start = if self.starts_right {
            ""
        } else {
            "the trace does not start from the scene's initial state; "
        };
        let Self { total, wrong, ranges, .. } = self;
        let rest = match (*wrong, ranges.as_slice()) {
            (0, _) => format!("all {total} steps are right up to rounding"),
            (wrong, _) if wrong == *total => {
                format!("all {total} steps are wrong")
            }
            (1, [[only, _]]) => {
                format!("only step {only} of {total} is wrong, and causes the other differences")
            }
            (2, [[first, last]]) if last - first == 1 => format!(
                "steps {first} and {last} of {total} are wrong, which fits a wrong state {first}"
            ),
            (wrong, ranges) => {
                let name = |&[first, last]: &[u64; 2]| match first == last {
                    true => first.to_string(),
                    false => format!("{first}–{last}"),
                };
                let names: Vec<String> = ranges.iter().map(name).collect();
                let told: u64 = ranges.iter().map(|[first, last]| last - first + 1).sum();
                let more = if told < wrong { ", …" } else { "" };
                let names = names.join(", ");
                format!("{wrong} of {total} steps are wrong: {names}{more}")
            }
        };
        format!("{start}{rest}")
    }
}

/// A wrong step.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// Number of the state it starts from.
    pub(super) step: u64,
    pub(super) before: State,
    pub(super) after: State,
    /// Accepted errors of a right step: position, velocity.
    pub(super) noise: [f64; 2],
    /// Differences from our step: position, velocity.
    pub(super) defect: [f64; 2],
}

/// Redoes the steps of a trace while it is read.
pub(super) struct SingleSteps<'a> {
    scene: &'a Scene,
    stepper: Stepper,
    random: Rng,
    states: u64,
    before: Option<State>,
    found: WrongSteps,
    samples: Vec<Sample>,
}

impl<'a> SingleSteps<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let found =
            WrongSteps { starts_right: true, single_precision: true, ..WrongSteps::default() };
        Self {
            scene,
            stepper: Stepper::new(scene, LinearSolver::Auto),
            random: Rng::with_seed(0),
            states: 0,
            before: None,
            found,
            samples: Vec::new(),
        }
    }

    /// Adds the next state.
    pub(super) fn add(&mut self, state: &State) {
        match self.before.take() {
            None => self.found.starts_right = self.is_start(state),
            Some(before) => {
                let single = |value: &f64| f64::from(*value as f32) == *value;
                let values = || state.positions.iter().chain(&state.velocities);
                self.found.single_precision &= values().all(single);
                let most = values().map(|value| digits(*value)).max().unwrap_or(0);
                self.found.digits = self.found.digits.max(most);
                self.judge(&before, state);
            }
        }
        self.before = Some(state.clone());
        self.states += 1;
    }

    fn is_start(&self, state: &State) -> bool {
        let dimension = self.scene.dimension.count();
        self.scene.particles.iter().enumerate().all(|(number, particle)| {
            (0..dimension).all(|axis| {
                let place = number * dimension + axis;
                let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b.abs();
                close(state.positions[place], particle.position[axis])
                    && close(state.velocities[place], particle.velocity[axis])
            })
        })
    }

    fn judge(&mut self, before: &State, after: &State) {
        let step = self.states - 1;
        let Some(ours) = self.step_from(step, before, false) else { return };
        self.found.total += 1;
        let defect = distance(&ours, after);
        // Identical bits need no noise estimate.
        if defect == [0.0; 2] {
            return;
        }
        let mut spread = [0.0_f64; 2];
        for _ in 0..PERTURBED {
            if let Some(other) = self.step_from(step, before, true) {
                let [position, velocity] = distance(&ours, &other);
                spread = [spread[0].max(position), spread[1].max(velocity)];
            }
        }
        let size =
            |values: &[f64]| values.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        let changes = ours.velocities.iter().zip(&before.velocities).map(|(a, b)| a - b);
        let change = changes.fold(0.0, |size: f64, change| size.max(change.abs()));
        let h = self.scene.time_step;
        let noise = [
            Bound::of(spread[0], size(&ours.positions)).tolerance + h * SOLVER * change,
            Bound::of(spread[1], size(&ours.velocities)).tolerance + SOLVER * change,
        ];
        if defect[0] <= noise[0] && defect[1] <= noise[1] {
            return;
        }
        let number = step + 1;
        self.found.wrong += 1;
        let ranges = &mut self.found.ranges;
        let n_ranges = ranges.len();
        match ranges.last_mut() {
            Some(range) if range[1] + 1 == number => range[1] = number,
            _ if n_ranges < RANGES => ranges.push([number; 2]),
            _ => {}
        }
        // The first two, and then fewer and fewer of the later ones.
        let wanted = self.found.wrong <= 2 || self.found.wrong.is_power_of_two();
        if wanted && self.samples.len() < SAMPLES {
            let (before, after) = (before.clone(), after.clone());
            self.samples.push(Sample { step, before, after, noise, defect });
        }
    }

    fn step_from(&mut self, step: u64, before: &State, perturbed: bool) -> Option<State> {
        let mut state = before.clone();
        if perturbed {
            for value in state.positions.iter_mut().chain(&mut state.velocities) {
                *value += f64::EPSILON * f64::from(self.random.i8(-1..=1)) * *value;
            }
        }
        let done = self.stepper.step(step, &mut state.positions, &mut state.velocities);
        done.then_some(state)
    }

    pub(super) fn finish(self) -> (WrongSteps, Vec<Sample>) {
        (self.found, self.samples)
    }
}

/// The smallest number of digits that identifies a number.
fn digits(value: f64) -> usize {
    let text = format!("{value:e}");
    let mantissa = text.split('e').next().unwrap_or("");
    mantissa.chars().filter(char::is_ascii_digit).count()
}

/// The largest differences: position, velocity.
fn distance(a: &State, b: &State) -> [f64; 2] {
    let largest =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    [largest(&a.positions, &b.positions), largest(&a.velocities, &b.velocities)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_digits_is_minimal() {
        for (value, count) in [(0.1, 1), (-1.25e-7, 3), (1.0 / 3.0, 16), (0.1 + 0.2, 17)] {
            assert_eq!(digits(value), count, "{value}");
        }
    }
}
