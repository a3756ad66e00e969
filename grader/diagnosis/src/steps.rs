//! Redoes each step of a trace from the trace's own previous state, or its last two if the method uses both.
//!
//! A step is right within ten times the change of our own step when the last bits of its start change, plus the floor
//! of [`bound`](crate::bound), plus the error that a linear solver of backward error 1e-12 may leave.

use crate::change::Sample;
use fastrand::Rng;
use scene::Scene;
use scene::trace::State;
use simulator::solver::linear::LinearSolver;

use crate::bound::Bound;
use crate::stepping::Stepper;

/// Number of starts with other last bits.
const PERTURBED: u64 = 3;

/// Ten times the error of an iterative solver, relative to the change of the velocities.
const SOLVER: f64 = 1e-11;

/// Maximum number of wrong steps that are examined.
const SAMPLES: usize = 10;

/// Maximum number of right steps that are kept as evidence.
const RIGHT: usize = 2;

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
    /// Whether the first step is right and every later one is wrong.
    pub fn is_right_first_alone(&self) -> bool {
        let Self { total, wrong, ranges, .. } = self;
        *total > 2 && wrong + 1 == *total && ranges.first().is_some_and(|range| range[0] == 2)
    }

    /// The description.
    pub fn words(&self) -> String {
        let start = if self.starts_right {
            ""
        } else {
            "the trace does not start from the scene's initial state; "
        };
        let Self { total, wrong, ranges, .. } = self;
        let rest = match (*wrong, ranges.as_slice()) {
            (0, _) => format!("each of the {total} steps is right within its error bound"),
            (1, _) if *total == 1 => "its only step is wrong".to_owned(),
            (wrong, _) if wrong == *total => {
                format!("all {total} steps are wrong")
            }
            (1, [[only, _]]) => format!("only step {only} of {total} is wrong"),
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

/// A step of a trace, with the errors that a right program may have in it.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// The states around it.
    pub sample: Sample,
    /// Accepted errors: position, velocity.
    pub noise: [f64; 2],
    /// Differences from our step: position, velocity.
    pub defect: [f64; 2],
}

impl Evidence {
    /// Whether the step is wrong.
    pub fn is_wrong(&self) -> bool {
        let within = |kind: usize| self.defect[kind] <= self.noise[kind];
        !(within(0) && within(1))
    }
}

/// Redoes steps of a scene.
pub struct Judge {
    stepper: Stepper,
    random: Rng,
    h: f64,
    /// Relative error of the numbers of the trace.
    rounding: f64,
}

impl Judge {
    /// Judges steps of `scene` whose numbers have this relative error.
    pub fn new(scene: &Scene, rounding: f64) -> Self {
        let stepper = Stepper::new(scene, LinearSolver::Auto);
        Self { stepper, random: Rng::with_seed(0), h: scene.time_step, rounding }
    }

    /// Compares the step after `before` with `after`; `None` if our own step fails.
    pub fn step(&mut self, before: Before<'_>, after: &State) -> Option<[[f64; 2]; 2]> {
        let ours = self.step_from(before, false)?;
        let defect = distance(&ours, after);
        // Identical bits need no noise estimate.
        if defect == [0.0; 2] {
            return Some([defect; 2]);
        }
        Some([defect, self.noise(before, &ours)])
    }

    /// The accepted errors of the step to `ours`.
    fn noise(&mut self, before: Before<'_>, ours: &State) -> [f64; 2] {
        let mut spread = [0.0_f64; 2];
        for _ in 0..PERTURBED {
            if let Some(other) = self.step_from(before, true) {
                let [position, velocity] = distance(ours, &other);
                spread = [spread[0].max(position), spread[1].max(velocity)];
            }
        }
        let size =
            |values: &[f64]| values.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        let changes = ours.velocities.iter().zip(&before.state.velocities).map(|(a, b)| a - b);
        let change = changes.fold(0.0, |size: f64, change| size.max(change.abs()));
        [
            Bound::of(spread[0], size(&ours.positions)).tolerance
                + self.h * SOLVER * change
                + self.rounding * size(&ours.positions),
            Bound::of(spread[1], size(&ours.velocities)).tolerance
                + SOLVER * change
                + self.rounding * size(&ours.velocities),
        ]
    }

    fn step_from(&mut self, before: Before<'_>, perturbed: bool) -> Option<State> {
        let mut state = before.state.clone();
        let mut earlier = before.earlier.cloned();
        if perturbed {
            let unit = f64::EPSILON.max(0.1 * self.rounding);
            for state in [&mut state].into_iter().chain(&mut earlier) {
                for value in state.positions.iter_mut().chain(&mut state.velocities) {
                    *value += unit * f64::from(self.random.i8(-1..=1)) * *value;
                }
            }
        }
        let State { positions, velocities, .. } = &mut state;
        let done = self.stepper.step(before.step, earlier.as_ref(), positions, velocities);
        done.then_some(state)
    }
}

/// The start of a step of a trace.
#[derive(Debug, Clone, Copy)]
pub struct Before<'a> {
    /// The step, counted from 0.
    pub step: u64,
    /// The state one step earlier, if there is one and the method uses it.
    pub earlier: Option<&'a State>,
    /// The state.
    pub state: &'a State,
}

impl<'a> Before<'a> {
    /// That of a step of `states`, which are those of `scene` from the first on.
    fn of(scene: &Scene, states: &'a [State], step: usize) -> Self {
        let earlier = step.checked_sub(1).filter(|_| scene.integrator.equation.is_two_step());
        Self {
            step: step as u64,
            earlier: earlier.map(|earlier| &states[earlier]),
            state: &states[step],
        }
    }
}

/// The rounding of a trace's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// Whether all its numbers are in single precision.
    pub single_precision: bool,
    /// The largest number of digits of any of its numbers.
    pub digits: usize,
}

impl Rounding {
    /// That of these states. Numbers that stay as they are count for nothing: those of a scene have few digits.
    pub fn of(states: &[State]) -> Self {
        fn all(state: &State) -> impl Iterator<Item = f64> {
            let State { positions, velocities, .. } = state;
            positions.iter().chain(velocities).copied()
        }
        let values = || {
            let pairs = states.windows(2).flat_map(move |pair| all(&pair[0]).zip(all(&pair[1])));
            pairs.filter(|(before, after)| before != after).map(|(_, after)| after)
        };
        let mut most = 0;
        for value in values() {
            most = most.max(digits(value));
            if most > FEW_DIGITS {
                break;
            }
        }
        let exact = |value: f64| f64::from(value as f32) == value;
        // Any number of up to seven digits is the decimal of some f32; most f32 need more.
        let tells = most > f32::DIGITS as usize + 1;
        let single_precision =
            values().next().is_some() && (values().all(exact) || tells && values().all(is_single));
        Self { single_precision, digits: most }
    }

    /// The relative error of the numbers; 0 if they have all their digits.
    pub fn unit(self) -> f64 {
        match self {
            Self { single_precision: true, .. } => f64::from(f32::EPSILON),
            Self { digits: FEWEST_DIGITS..=FEW_DIGITS, .. } => {
                10.0_f64.powi(1 - self.digits as i32)
            }
            _ => 0.0,
        }
    }
}

/// Traces with at most this many digits are rounded; an f64 has up to 17.
const FEW_DIGITS: usize = 15;

/// Traces with fewer digits than this are of simple numbers, not rounded.
const FEWEST_DIGITS: usize = 4;

/// Redoes all steps of a trace whose numbers have at least this relative error. Returns which are wrong, and evidence from some.
pub fn examine(scene: &Scene, states: &[State], error: f64) -> (WrongSteps, Vec<Evidence>) {
    let rounding = Rounding::of(states);
    let mut found = WrongSteps {
        starts_right: states.first().is_some_and(|state| is_start(scene, state)),
        single_precision: rounding.single_precision,
        digits: rounding.digits,
        ..WrongSteps::default()
    };
    let mut judge = Judge::new(scene, rounding.unit().max(error));
    let mut kept = Vec::new();
    let mut n_right = 0;
    for (step, pair) in states.windows(2).enumerate() {
        let before = Before::of(scene, states, step);
        let Some([defect, noise]) = judge.step(before, &pair[1]) else { continue };
        found.total += 1;
        let sample = || Sample {
            step: step as u64,
            earlier: step.checked_sub(1).map(|earlier| states[earlier].clone()),
            before: pair[0].clone(),
            after: pair[1].clone(),
        };
        if defect[0] <= noise[0] && defect[1] <= noise[1] {
            if n_right < RIGHT {
                let noise = match defect == [0.0; 2] {
                    true => judge.noise(before, &pair[1]),
                    false => noise,
                };
                kept.push(Evidence { sample: sample(), noise, defect });
            }
            n_right += 1;
            continue;
        }
        let number = step as u64 + 1;
        found.wrong += 1;
        let ranges = &mut found.ranges;
        let n_ranges = ranges.len();
        match ranges.last_mut() {
            Some(range) if range[1] + 1 == number => range[1] = number,
            _ if n_ranges < RANGES => ranges.push([number; 2]),
            _ => {}
        }
        // The first two, and then fewer and fewer of the later ones.
        let wanted = found.wrong <= 2 || found.wrong.is_power_of_two();
        if wanted && kept.len() < SAMPLES {
            kept.push(Evidence { sample: sample(), noise, defect });
        }
    }
    (found, kept)
}

/// Evidence from some steps of a trace that is right.
pub fn sampled(scene: &Scene, states: &[State]) -> Vec<Evidence> {
    let last = states.len().saturating_sub(2);
    let mut steps = vec![0, last / 3, last];
    steps.dedup();
    let mut judge = Judge::new(scene, 0.0);
    let evidence = |step: usize| {
        let after = states.get(step + 1)?;
        let before = Before::of(scene, states, step);
        let [defect, _] = judge.step(before, after)?;
        let noise = judge.noise(before, after);
        let earlier = step.checked_sub(1).map(|earlier| states[earlier].clone());
        let (before, after) = (states[step].clone(), after.clone());
        let sample = Sample { step: step as u64, earlier, before, after };
        Some(Evidence { sample, noise, defect })
    };
    steps.into_iter().filter_map(evidence).collect()
}

/// Whether a state is the scene's initial one.
fn is_start(scene: &Scene, state: &State) -> bool {
    let dimension = scene.dimension.count();
    scene.particles.iter().enumerate().all(|(number, particle)| {
        (0..dimension).all(|axis| {
            let place = number * dimension + axis;
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b.abs();
            close(state.positions[place], particle.position[axis])
                && close(state.velocities[place], particle.velocity[axis])
        })
    })
}

/// Whether a number is an f32, or the shortest decimal of one.
pub(crate) fn is_single(value: f64) -> bool {
    let narrow = value as f32;
    f64::from(narrow) == value || format!("{narrow:e}").parse() == Ok(value)
}

/// The smallest number of digits that identifies a number.
pub(crate) fn digits(value: f64) -> usize {
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
