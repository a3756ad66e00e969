//! Searches for one candidate that explains all wrong steps.

use simulator::scene::Scene;

use super::candidates::{Candidate, Culprit, Trial, Tried};
use super::physics::{Method, Physics, Term};
use super::steps::{Sample, WrongSteps};

/// Maximum number of coordinates of a scene that is diagnosed.
const MAX_COORDINATES: usize = 120;

/// Maximum number of alternative explanations in different places.
const MAX_ALTERNATIVES: usize = 3;

/// Minimum ratio of a defect to the noise for candidates to be distinguishable.
const CLEAR: f64 = 1e4;

/// Maximum remainder of an explanation, as a multiple of the noise.
const LEFT: f64 = 3.0;

/// An explanation of the examined wrong steps, up to rounding.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The mistake; several candidates explain the steps equally well.
    pub candidates: Vec<Candidate>,
    /// The part of the defect that remains, relative to the defect.
    pub remainder: f64,
}

impl Explanation {
    fn of(words: impl Into<String>, culprit: Culprit, remainder: f64) -> Self {
        let candidate = Candidate { words: words.into(), culprit };
        Self { candidates: vec![candidate], remainder }
    }

    /// The description.
    pub fn words(&self) -> String {
        let all: Vec<&str> =
            self.candidates.iter().map(|candidate| candidate.words.as_str()).collect();
        all.join(", or ")
    }
}

/// Explains these wrong steps.
pub(super) fn explain(
    scene: &Scene,
    samples: &[Sample],
    steps: &WrongSteps,
) -> Option<Explanation> {
    if samples.is_empty() {
        return None;
    }
    if let Some(found) = by_precision(samples, steps) {
        return Some(found);
    }
    let physics = Physics::new(scene, reference::method::Method::one_point(scene.integrator)?);
    if physics.mass.len() > MAX_COORDINATES {
        return None;
    }
    let motion = Motion::of(&physics, samples);
    if let Some(found) = by_fixed_velocities(&physics, samples, &motion) {
        return found.explanation;
    }
    let noise = momentum_noise(&physics, samples);
    if !motion.positions_right {
        let other = other_method(&physics, samples, noise);
        // Velocities that are wrong as well mean two mistakes, neither of which can be identified.
        let velocities_right = || Trial::new(&physics, samples).norm() <= LEFT * noise;
        return other.or_else(|| velocities_right().then_some(motion.explanation).flatten());
    }
    let trial = Trial::new(&physics, samples);
    let size = trial.norm();
    if size.is_nan() || size < CLEAR * noise {
        return None;
    }
    let n_terms = Term::all(scene).len();
    let mut tried = trial.run();
    if let Some(Explanation { candidates, .. }) = other_method(&physics, samples, noise) {
        let other = |candidate| Tried { candidate, rest: 0.0, named: true };
        tried.splice(0..0, candidates.into_iter().map(other));
    }
    choose(tried, n_terms, size, noise)
}

/// The candidates that leave no more than rounding; none if they are too many.
///
/// An unusual factor is reported only if nothing else fits and only one term can have it: in a motion that keeps its
/// proportions, any term with some factor explains everything. Jacobians are never reported with an unusual factor.
fn choose(mut tried: Vec<Tried>, n_terms: usize, size: f64, noise: f64) -> Option<Explanation> {
    tried.retain(|tried| tried.rest <= LEFT * noise);
    let is_named = tried.iter().any(|tried| tried.named);
    let mut found: Vec<Candidate> = Vec::new();
    let mut remainder = 0.0_f64;
    for Tried { candidate, rest, named } in tried {
        if named != is_named {
            continue;
        }
        // Of several descriptions of the same place, the simplest.
        if found.iter().all(|known| known.culprit != candidate.culprit) {
            found.push(candidate);
            remainder = remainder.max(rest / size);
        }
    }
    let most = match is_named {
        true => MAX_ALTERNATIVES,
        // The only term, and the sum of all terms.
        false if n_terms == 1 => 2,
        false => 1,
    };
    let is_jacobian = |each: &Candidate| matches!(each.culprit, Culprit::Jacobian(_));
    let is_guess = !is_named && found.iter().any(is_jacobian);
    let told = (1..=most).contains(&found.len()) && !is_guess;
    told.then_some(Explanation { candidates: found, remainder })
}

/// Norm of `r` that rounding alone may cause.
fn momentum_noise(physics: &Physics<'_>, samples: &[Sample]) -> f64 {
    let h = physics.h;
    let of = |sample: &Sample| {
        let mass = physics.mass.iter().copied().fold(0.0, f64::max);
        let stiffness = match physics.is_implicit() {
            true => {
                let at = physics.point(sample);
                let (k, b) = physics.jacobians(&physics.scene.forces, &at);
                h * (h * k.norm() + b.norm())
            }
            false => 0.0,
        };
        let size = (physics.mass.len() as f64).sqrt();
        (mass + stiffness) * size * sample.noise[1]
    };
    samples.iter().map(|sample| of(sample).powi(2)).sum::<f64>().sqrt()
}

/// Traces with fewer digits than this were rounded; 15 digits are within tolerance.
const FEW_DIGITS: usize = 14;

/// Explains the steps by single precision, or by few digits, if that is all.
fn by_precision(samples: &[Sample], steps: &WrongSteps) -> Option<Explanation> {
    let (unit, words) = if steps.single_precision {
        let words = "all numbers of the trace are in single precision (float instead of double)";
        (f64::from(f32::EPSILON), words.to_owned())
    } else if steps.digits < FEW_DIGITS {
        let words = format!("the numbers of the trace have only {} digits", steps.digits);
        (10.0_f64.powi(1 - i32::try_from(steps.digits).ok()?), words)
    } else {
        return None;
    };
    let within = |sample: &Sample| {
        let size = |values: &[f64]| values.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        // A handful of rounding errors of numbers of that size.
        let bound = |values: &[f64]| 64.0 * unit * size(values);
        sample.defect[0] <= bound(&sample.after.positions)
            && sample.defect[1] <= bound(&sample.after.velocities) + bound(&sample.after.positions)
    };
    samples.iter().all(within).then(|| Explanation::of(words, Culprit::Output, 0.0))
}

/// The result of a search that may end without an explanation.
struct Answer {
    explanation: Option<Explanation>,
}

/// Explains the steps by fixed particles that do not keep their velocity.
fn by_fixed_velocities(
    physics: &Physics<'_>,
    samples: &[Sample],
    motion: &Motion,
) -> Option<Answer> {
    let changes = |sample: &Sample| {
        let delta = physics.delta(sample);
        (0..delta.len()).any(|dof| physics.fixed[dof] && delta[dof].abs() > LEFT * sample.noise[1])
    };
    if !samples.iter().any(changes) {
        return None;
    }
    let right = motion.positions_right
        && Trial::new(physics, samples).norm() <= LEFT * momentum_noise(physics, samples);
    let words = "fixed particles do not keep their velocity";
    let explanation = right.then(|| Explanation::of(words, Culprit::Fixed, 0.0));
    Some(Answer { explanation })
}

/// The position rule.
struct Motion {
    positions_right: bool,
    explanation: Option<Explanation>,
}

/// A rule for new positions: description, and the factors of the old and the new velocity as functions of `h`.
type Rule = (&'static str, fn(f64) -> [f64; 2]);

const RULES: [Rule; 8] = [
    ("positions move with the old velocity, not the new one", |h| [h, 0.0]),
    ("positions move with the new velocity, not the old one", |h| [0.0, h]),
    ("positions do not move", |_| [0.0, 0.0]),
    ("positions move with the mean of the old and the new velocity", |h| [0.5 * h, 0.5 * h]),
    ("positions move by the old velocity without h", |_| [1.0, 0.0]),
    ("positions move by the new velocity without h", |_| [0.0, 1.0]),
    ("positions move against the old velocity", |h| [-h, 0.0]),
    ("positions move against the new velocity", |h| [0.0, -h]),
];

impl Motion {
    fn of(physics: &Physics<'_>, samples: &[Sample]) -> Self {
        let right = match physics.method {
            Method::Explicit => RULES[0].1,
            _ => RULES[1].1,
        };
        let all = |_: usize| true;
        if follows(physics, samples, right, all) {
            return Self { positions_right: true, explanation: None };
        }
        let free = |dof: usize| !physics.fixed[dof];
        let fixed = |dof: usize| physics.fixed[dof];
        let explanation = if follows(physics, samples, right, free) {
            let words = match follows(physics, samples, |_| [0.0, 0.0], fixed) {
                true => "fixed particles stand still, although they have a velocity",
                false => "fixed particles are not moved by their velocity",
            };
            Some((words, Culprit::Fixed))
        } else {
            let mut rules =
                RULES.into_iter().filter(|(_, rule)| follows(physics, samples, *rule, all));
            match (rules.next(), rules.next()) {
                (Some((words, _)), None) => Some((words, Culprit::Integrator)),
                _ => None,
            }
        };
        let explanation = explanation.map(|(words, culprit)| Explanation::of(words, culprit, 0.0));
        Self { positions_right: false, explanation }
    }
}

/// Whether these coordinates follow the rule in all samples, up to rounding.
fn follows(
    physics: &Physics<'_>,
    samples: &[Sample],
    rule: fn(f64) -> [f64; 2],
    which: impl Fn(usize) -> bool,
) -> bool {
    let [of_old, of_new] = rule(physics.h);
    samples.iter().all(|Sample { before, after, noise, .. }| {
        (0..physics.mass.len()).filter(|&dof| which(dof)).all(|dof| {
            let moved = of_old * before.velocities[dof] + of_new * after.velocities[dof];
            let rounding = 8.0 * f64::EPSILON * moved.abs();
            (after.positions[dof] - before.positions[dof] - moved).abs()
                <= LEFT * noise[0] + rounding
        })
    })
}

/// Whether the steps are those of another method.
fn other_method(physics: &Physics<'_>, samples: &[Sample], noise: f64) -> Option<Explanation> {
    for integrator in simulator::vocabulary().integrators {
        let method = reference::method::Method::one_point(integrator);
        let Some(method) = method.filter(|method| *method != physics.method) else { continue };
        let other = Physics::new(physics.scene, method);
        if Motion::of(&other, samples).positions_right
            && Trial::new(&other, samples).norm() <= LEFT * noise
        {
            let words = format!("the steps are those of {}", integrator.name);
            return Some(Explanation::of(words, Culprit::Integrator, 0.0));
        }
    }
    None
}
