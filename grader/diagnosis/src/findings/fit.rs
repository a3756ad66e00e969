//! Changes with numbers in them, found from the steps: the residual of a step is affine in most of them.

use crate::change::candidates::{self, Numbered};
use crate::change::{Change, Effect, Guess, Iterate, Model, Newton, Rule};
use reference::method::{Method, OnePoint};
use scene::Scene;

use super::evidence::{Samples, SceneEvidence};
use crate::steps::Evidence;

/// A number counts as another one from this difference on.
const OTHER: f64 = 1e-4;

/// Parts of a step between which forces may be evaluated.
const PARTS: [f64; 9] = [-1.05, -0.65, -0.35, -0.05, 0.25, 0.55, 0.85, 1.35, 2.05];

/// Angles in degrees between which a rotation may be.
pub(super) fn angles() -> Vec<f64> {
    (0..=12).map(|k| 30.0 * f64::from(k) - 187.0).collect()
}

/// Sizes between which a number may be.
pub(super) fn sizes() -> Vec<f64> {
    (-10..=6).map(|k| 0.97 * 4.0_f64.powi(k)).collect()
}

/// Enough for the bits of a number that tolerances show.
const BISECTIONS: usize = 48;

/// Rules of the scene's integrator, with the numbers that cancel the residuals of all samples.
pub(super) fn of_rules(
    scene: &SceneEvidence<'_>,
    made: &[Change],
    samples: &Samples<'_>,
    wanted: impl Fn(Numbered) -> bool,
) -> Vec<Change> {
    let inner = &scene.scene;
    let Some(method) = Method::one_point(inner.integrator) else { return Vec::new() };
    let name = inner.integrator.name;
    let mut found: Vec<Change> = Numbered::of(method)
        .into_iter()
        .filter(|(family, _)| wanted(*family))
        .filter_map(|(family, right)| {
            let with = |numbers: &[f64]| {
                let mut all = made.to_vec();
                all.extend(family.with(name, method, numbers));
                scene.model(&all)
            };
            let numbers = affine(&with, &right, samples, family.moves())?;
            family.with(name, method, &numbers)
        })
        .collect();
    if wanted(Numbered::Damped) {
        found.extend(limit(inner, samples).map(|limit| candidates::speed_limit(name, limit)));
    }
    found
}

/// The numbers with which the residuals of all samples vanish. `None` if no numbers do, if the samples do not determine
/// them, or if they are those of a right program.
fn affine(
    with: &dyn Fn(&[f64]) -> Model,
    right: &[f64],
    samples: &Samples<'_>,
    moves: bool,
) -> Option<Vec<f64>> {
    let residuals = |numbers: &[f64]| -> Option<Vec<f64>> {
        let model = with(numbers);
        let mut all = Vec::new();
        for evidence in samples.iter() {
            let residual = model.residual(&evidence.sample)?;
            let [x, v] = evidence.noise;
            let (values, bound) = match moves {
                true => (residual.position, samples.limits.left * x),
                false => (residual.momentum, samples.limits.left * v * residual.stiffness),
            };
            all.extend(values.into_iter().map(|value| value / bound));
        }
        Some(all)
    };
    let base = residuals(right)?;
    let mut directions = Vec::new();
    for place in 0..right.len() {
        let mut moved = right.to_vec();
        moved[place] += 1.0;
        let moved = residuals(&moved)?;
        directions.push(moved.iter().zip(&base).map(|(a, b)| a - b).collect::<Vec<f64>>());
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let steps = match directions.as_slice() {
        [one] => vec![-dot(one, &base) / dot(one, one)],
        [a, b] => {
            let [aa, ab, bb] = [dot(a, a), dot(a, b), dot(b, b)];
            let determinant = aa * bb - ab * ab;
            // Parallel: the steps determine one number only.
            if determinant <= 1e-10 * aa * bb {
                return None;
            }
            let [ra, rb] = [dot(a, &base), dot(b, &base)];
            vec![(ab * rb - bb * ra) / determinant, (ab * ra - aa * rb) / determinant]
        }
        _ => return None,
    };
    let fits = |numbers: &[f64]| {
        (0..base.len()).all(|row| {
            let change = directions.iter().zip(numbers).zip(right);
            let sum: f64 = change.map(|((d, number), right)| d[row] * (number - right)).sum();
            (base[row] + sum).abs() <= 1.0
        })
    };
    let mut numbers: Vec<f64> =
        right.iter().zip(&steps).map(|(right, step)| right + step).collect();
    if !numbers.iter().all(|number| number.is_finite()) || !fits(&numbers) {
        return None;
    }
    for place in 0..numbers.len() {
        let known = numbers.clone();
        let with = |number: f64| {
            let mut numbers = known.clone();
            numbers[place] = number;
            fits(&numbers)
        };
        numbers[place] = simplest(known[place], &with);
    }
    let is_other = |(a, b): (&f64, &f64)| (a - b).abs() > OTHER * b.abs();
    numbers.iter().zip(right).any(is_other).then_some(numbers)
}

/// Those of these changes whose ends of Newton's method are all the ends of the scene's sampled steps: iterates are the same
/// whatever ends them. None where the right end is: a method that converges slowly is near its end before.
pub(super) fn ends(scene: &SceneEvidence<'_>, made: &[Change], all: Vec<Change>) -> Vec<Change> {
    let model = scene.model(made);
    let newton = |change: &Change| match change.effect {
        Effect::Method(_, Rule::Newton(newton)) => Some(newton),
        _ => None,
    };
    let right = Newton { iterations: usize::MAX, ..model.newton() };
    let mut is_right = true;
    let mut fitting = all;
    for evidence in &scene.evidence {
        let mut paths: Vec<((Guess, f64), Vec<Iterate>)> = Vec::new();
        let mut fits = |newton: &Newton| {
            let from = (newton.guess, newton.relaxation);
            let number = paths.iter().position(|(known, _)| *known == from).unwrap_or_else(|| {
                let path = model.iterates(&evidence.sample, newton.guess, newton.relaxation);
                paths.push((from, path));
                paths.len() - 1
            });
            let last = Iterate::last(&paths[number].1, newton);
            last.is_some_and(|last| scene.ends_at(evidence, &last.velocities))
        };
        fitting.retain(|change| newton(change).is_some_and(|newton| fits(&newton)));
        if fitting.is_empty() {
            return fitting;
        }
        is_right &= fits(&right);
    }
    if is_right { Vec::new() } else { fitting }
}

/// The speed at which a particle ends in every sample, and that none exceeds.
fn limit(scene: &Scene, samples: &Samples<'_>) -> Option<f64> {
    let axes = scene.dimension.count();
    let fastest = |evidence: &&Evidence| {
        let each = scene.particles.iter().zip(evidence.sample.after.velocities.chunks(axes));
        let free = each.filter(|(particle, _)| !particle.fixed);
        free.map(|(_, v)| v.iter().map(|v| v * v).sum::<f64>().sqrt()).fold(0.0, f64::max)
    };
    let speeds: Vec<f64> = samples.iter().map(fastest).collect();
    let most = speeds.iter().copied().fold(0.0, f64::max);
    let noise = samples.iter().map(|evidence| evidence.noise[1]).fold(0.0, f64::max);
    let is_all = |limit: f64| {
        speeds.iter().all(|speed| (speed - limit).abs() <= samples.limits.left * noise)
    };
    (speeds.len() > 1 && most > 0.0 && is_all(most)).then(|| simplest(most, &is_all))
}

/// Forces at another point between the ends of a step.
pub(super) fn between(
    scene: &SceneEvidence<'_>,
    made: &[Change],
    samples: &Samples<'_>,
) -> Option<Change> {
    let inner = &scene.scene;
    let name = inner.integrator.name;
    let method = Method::one_point(inner.integrator)?;
    let is_implicit = matches!(method, OnePoint::Linearized | OnePoint::Implicit);
    let residuals = |part: f64| -> Option<Vec<f64>> {
        let mut all = made.to_vec();
        all.push(candidates::forces_at(name, part, is_implicit));
        let model = scene.model(&all);
        let of = |evidence: &&Evidence| {
            let residual = model.residual(&evidence.sample)?;
            let bound = samples.limits.left * evidence.noise[1] * residual.stiffness;
            Some(residual.momentum.into_iter().map(|value| value / bound).collect::<Vec<f64>>())
        };
        samples.iter().map(of).collect::<Option<Vec<Vec<f64>>>>().map(|all| all.concat())
    };
    let right = residuals(f64::from(u8::from(is_implicit)))?;
    let along = |part: f64| -> Option<f64> {
        Some(residuals(part)?.iter().zip(&right).map(|(a, b)| a * b).sum())
    };
    let fits =
        |part: f64| residuals(part).is_some_and(|left| left.iter().all(|value| value.abs() <= 1.0));
    let part = roots(&along, &PARTS).into_iter().find(|part| fits(*part))?;
    Some(candidates::forces_at(name, simplest(part, &fits), is_implicit))
}

/// The roots between these arguments, by bisection.
pub(super) fn roots(of: &dyn Fn(f64) -> Option<f64>, arguments: &[f64]) -> Vec<f64> {
    let values: Vec<Option<f64>> = arguments.iter().map(|argument| of(*argument)).collect();
    let between = |place: usize| -> Option<f64> {
        let [first, last] = [values[place]?, values[place + 1]?];
        if first * last >= 0.0 {
            return None;
        }
        let [mut low, mut high] = [arguments[place], arguments[place + 1]];
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match of(middle)? * first > 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        Some(0.5 * (low + high))
    };
    (1..values.len()).filter_map(|place| between(place - 1)).collect()
}

/// The simplest number near `exact` that fits.
pub(super) fn simplest(exact: f64, fits: &dyn Fn(f64) -> bool) -> f64 {
    for denominator in 1..=6 {
        let fraction = (exact * f64::from(denominator)).round() / f64::from(denominator);
        if (fraction - exact).abs() < 1e-6 * exact.abs().max(1.0) && fits(fraction) {
            return fraction;
        }
    }
    for digits in 1..=9 {
        let rounded: f64 = format!("{exact:.digits$e}").parse().unwrap_or(exact);
        if (rounded - exact).abs() < 1e-6 * exact.abs() && fits(rounded) {
            return rounded;
        }
    }
    exact
}
