//! Checks every entry of both Jacobians at one state by three independent estimates.
//!
//! Shapes: `n·D` rows and columns. Cost: `2·n·D` columns, with 60 evaluations of the force and one of the law by dual
//! numbers for each.

use nalgebra::DMatrix;

use super::states::CheckState;
use super::subject::Subject;
use super::verdict::{BlockKind, By, Part};
use jacobian::ridders::{Estimate, Ladder, differentiate, exact_steps, power_of_two};
use jacobian::taylor::Steps;
use jacobian::verdict::{Entry, ROUNDING};
use reference::law::Jacobians;
use reference::law::{Expectation, Law, Scale, Term};

/// A quantity counts as nonzero if it is this many times its uncertainty.
const SEEN: f64 = 1e3;

/// The estimates at one state.
pub(super) struct Observation {
    pub(super) blocks: Vec<ObservedBlock>,
    /// Whether the force is clearly nonzero.
    pub(super) force_seen: bool,
}

/// One block with its entries, row by row.
pub(super) struct ObservedBlock {
    pub(super) kind: BlockKind,
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) entries: Vec<Entry>,
    /// The largest entry by the most accurate estimates.
    pub(super) size: f64,
    /// Whether that is clearly nonzero.
    pub(super) seen: bool,
    /// Whether each of the law's parameters clearly affects the block.
    pub(super) terms: Vec<bool>,
}

/// Observes `subject` at `state`; `None` if its force is undefined there. Dual numbers are used only if the subject's
/// force `is_the_laws` at every state, not only by chance at this one.
pub(super) fn observe(
    subject: &dyn Subject,
    state: &CheckState,
    law: &'static Law,
    is_the_laws: bool,
) -> Option<Observation> {
    let (x, v, time) = (state.positions(), state.velocities(), state.time);
    let size = x.len();
    let dimension = state.scene.dimension.count();
    let expectation = Expectation::new(law, &state.scene);
    let scales = expectation.scales(&x, &v, time);
    let mut force = vec![0.0; size];
    subject.force(&x, &v, time, &mut force).ok()?;
    if force.iter().any(|component| !component.is_finite()) {
        return None;
    }
    let dual = expectation.jacobians(&x, &v, time);
    let analytic = subject.jacobians(&x, &v, time).unwrap_or_else(|_| {
        let nothing = DMatrix::from_element(size, size, f64::NAN);
        Jacobians { by_position: nothing.clone(), by_velocity: nothing }
    });
    let noise: Vec<f64> = (0..size).map(|row| ROUNDING * scales[row / dimension].force).collect();
    let changed = with_each_parameter_changed(law, state, &x, &v);

    let mut blocks = Vec::new();
    for by in [By::Position, By::Velocity] {
        let (moved, first) = match by {
            By::Position => (&x, first_step(expectation.shortest(&x), 1.0)),
            By::Velocity => (&v, first_step(None, largest(&v).max(1.0))),
        };
        let mut evaluate = |moved: &[f64], force: &mut [f64]| {
            let (x, v) = match by {
                By::Position => (moved, v.as_slice()),
                By::Velocity => (x.as_slice(), moved),
            };
            subject.force(x, v, time, force).is_ok() && force.iter().all(|value| value.is_finite())
        };
        let columns: Vec<_> = (0..size)
            .map(|column| {
                let differences =
                    differentiate(&mut evaluate, moved, column, Ladder::exact(first), &noise);
                (differences, Steps::take(&mut evaluate, moved, column, (first, exact_steps), size))
            })
            .collect();
        let analytic = by.of(&analytic);
        let dual = by.of(&dual);
        let entry = |row: usize, column: usize| {
            let rounding = ROUNDING * by.scale(&scales[row / dimension]);
            let (differences, steps) = &columns[column];
            Entry {
                analytic: analytic[(row, column)],
                rounding,
                difference: differences[row],
                second: is_the_laws
                    .then(|| Estimate { value: dual[(row, column)], uncertainty: rounding }),
                taylor: steps.judge(row, analytic[(row, column)], noise[row], rounding),
            }
        };
        for (row, column) in pairs(scales.len()) {
            let places = || {
                (0..dimension * dimension).map(move |place| {
                    (row * dimension + place / dimension, column * dimension + place % dimension)
                })
            };
            let entries: Vec<Entry> = places().map(|(row, column)| entry(row, column)).collect();
            let known = || entries.iter().filter_map(Entry::sharpest);
            let seen = known().any(|estimate| estimate.value.abs() > SEEN * estimate.uncertainty);
            let clear = SEEN * SEEN * ROUNDING * by.scale(&scales[row]);
            let shows = |changed: &Option<Jacobians>| {
                let Some(changed) = changed else { return false };
                places().any(|place| (dual[place] - by.of(changed)[place]).abs() > clear)
            };
            let size = known().map(|estimate| estimate.value.abs()).fold(0.0, f64::max);
            let part = if row == column { Part::Direct } else { Part::Cross };
            let terms = changed.iter().map(shows).collect();
            let kind = BlockKind { by, part };
            blocks.push(ObservedBlock { kind, row, column, entries, size, seen, terms });
        }
    }
    let force_seen =
        force.iter().zip(&noise).any(|(component, noise)| component.abs() > SEEN * noise);
    Some(Observation { blocks, force_seen })
}

impl By {
    /// The Jacobian by this quantity.
    pub(super) fn of(self, jacobians: &Jacobians) -> &DMatrix<f64> {
        match self {
            Self::Position => &jacobians.by_position,
            Self::Velocity => &jacobians.by_velocity,
        }
    }

    /// The scale of its entries.
    pub(super) fn scale(self, scale: &Scale) -> f64 {
        match self {
            Self::Position => scale.by_position,
            Self::Velocity => scale.by_velocity,
        }
    }
}

/// Whether the force of `subject` at `state` is the law's, up to rounding; also true if both are undefined.
pub(super) fn has_the_laws_force(
    subject: &dyn Subject,
    state: &CheckState,
    law: &'static Law,
) -> bool {
    let (x, v, time) = (state.positions(), state.velocities(), state.time);
    let expectation = Expectation::new(law, &state.scene);
    let scales = expectation.scales(&x, &v, time);
    let mut force = vec![0.0; x.len()];
    if subject.force(&x, &v, time, &mut force).is_err() {
        return true;
    }
    let dimension = state.scene.dimension.count();
    let expected = expectation.force(&x, &v, time);
    force.iter().zip(&expected).enumerate().all(|(row, (force, expected))| {
        let error = (force - expected).abs();
        error <= 2.0 * ROUNDING * scales[row / dimension].force || !force.is_finite()
    })
}

/// The law's Jacobians with each parameter in turn increased by half; `None` for a parameter that is zero.
fn with_each_parameter_changed(
    law: &'static Law,
    state: &CheckState,
    x: &[f64],
    v: &[f64],
) -> Vec<Option<Jacobians>> {
    let changed = |term: &Term| {
        let mut scene = state.scene.clone();
        let mut is_there = false;
        for element in &mut scene.forces {
            let parameter = element.parameter_mut(term.parameter);
            is_there |= *parameter != 0.0;
            *parameter *= 1.5;
        }
        is_there.then(|| Expectation::new(law, &scene).jacobians(x, v, state.time))
    };
    Term::of(state.scene.forces[0].schema).iter().map(changed).collect()
}

/// A quarter of the distance to the nearest non-smooth point of the law, or `scale` if it is smooth everywhere.
pub(super) fn first_step(shortest: Option<f64>, scale: f64) -> f64 {
    match shortest {
        Some(length) if length > 0.0 => power_of_two(0.25 * length),
        _ => power_of_two(scale),
    }
}

pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// All pairs of particles.
fn pairs(n_particles: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n_particles).flat_map(move |row| (0..n_particles).map(move |column| (row, column)))
}
