//! Elements that a force treats otherwise: the measure that tells them apart, and the number between them and the others.
//!
//! ```text
//! one scene     the pieces of a term in the order of a measure; one after the other is treated otherwise, until the
//!               residuals of all sampled steps vanish: between the last of these pieces and the next is the number
//! all scenes    the numbers that each allows; one that all scenes in which the force is right allow, and most others
//! ```

use crate::change::candidates;
use crate::change::gate::{self, Gate, Measure};
use crate::change::{Change, Model, Quantity, Term};
use rayon::prelude::*;

use super::residuals::{self, Base};
use crate::findings::evidence::Marked;
use crate::findings::thresholds::Thresholds;

/// Factors of the elements that are singled out.
const FACTORS: [f64; 3] = [0.0, -1.0, 2.0];

/// The most rules that gates are combined with: each costs as much as a scene without rules.
const FEW_RULES: usize = 3;

/// The elements or particles that are treated differently.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Subject {
    /// Some elements of a term, of a field some particles.
    Elements(Term, &'static [Quantity]),
    /// Some particles with all forces on them, under this integrator.
    Particles(&'static str),
}

/// A gate without its number.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rule {
    subject: Subject,
    measure: Measure,
    above: bool,
    factor: f64,
}

/// Open intervals of numbers.
type Intervals = Vec<(f64, f64)>;

/// A part of a step's residual.
struct Piece {
    /// Its number by each measure.
    values: Vec<Option<f64>>,
    /// Coordinates of all samples, and what is contributed there, in units of the bound.
    entries: Vec<(usize, f64)>,
}

/// The pieces of a term, and the residual in units of its bound.
struct Pieces {
    residual: Vec<f64>,
    measures: Vec<Measure>,
    all: Vec<Piece>,
}

impl Pieces {
    /// `None` where the scene has none.
    fn of(base: &Base<'_>, model: &Model, subject: Subject) -> Option<Self> {
        let axes = model.dimension();
        let (terms, measures): (Vec<usize>, _) = match subject {
            Subject::Elements(term, _) => {
                let is_of_it = |number: &usize| term.includes(model.term(*number));
                let terms = (0..model.n_terms()).filter(is_of_it).collect();
                (terms, Measure::of_force(term.schema(), axes))
            }
            Subject::Particles(_) => (Vec::new(), Measure::of_particles(axes)),
        };
        let mut residual = Vec::new();
        let mut all = Vec::new();
        for (sample, (left, bound)) in base.each() {
            let first = residual.len();
            residual.extend(left.iter().map(|left| left / bound));
            let pieces = match subject {
                Subject::Elements(_, quantities) => terms
                    .iter()
                    .flat_map(|term| model.pieces(*term, quantities, &measures, sample))
                    .collect(),
                Subject::Particles(_) => model.particle_pieces(&measures, sample),
            };
            for (effect, values) in pieces {
                let entries = effect.iter().enumerate().filter(|(_, value)| **value != 0.0);
                let entries = entries.map(|(dof, value)| (first + dof, value / bound)).collect();
                all.push(Piece { values, entries });
            }
        }
        Some(Self { residual, measures, all })
    }

    /// The numbers with which a rule makes the residual vanish. Those that single out no piece, or all, are left out unless asked for.
    fn allowed(&self, measure: usize, above: bool, factor: f64, with_ends: bool) -> Intervals {
        let mut order: Vec<(f64, &Piece)> = Vec::new();
        for piece in self.all.iter().filter(|piece| !piece.entries.is_empty()) {
            let Some(value) = piece.values[measure] else { return Vec::new() };
            order.push((value, piece));
        }
        order.sort_by(|a, b| if above { b.0.total_cmp(&a.0) } else { a.0.total_cmp(&b.0) });
        let outside = if above { f64::INFINITY } else { f64::NEG_INFINITY };
        let mut left = self.residual.clone();
        let mut n_wrong = left.iter().filter(|left| left.abs() > 1.0).count();
        let mut found = Vec::new();
        let interval = |a: f64, b: f64| (a.min(b), a.max(b));
        if with_ends && n_wrong == 0 {
            found.push(interval(outside, order.first().map_or(-outside, |(value, _)| *value)));
        }
        for (place, (value, piece)) in order.iter().enumerate() {
            for &(entry, part) in &piece.entries {
                let was = left[entry].abs() > 1.0;
                left[entry] += (factor - 1.0) * part;
                let is = left[entry].abs() > 1.0;
                n_wrong = n_wrong + usize::from(is) - usize::from(was);
            }
            let next = order.get(place + 1).map(|(next, _)| *next);
            let is_end = next.is_none();
            if n_wrong == 0 && next != Some(*value) && (with_ends || !is_end) {
                found.push(interval(*value, next.unwrap_or(-outside)));
            }
        }
        found
    }
}

/// Rules that make the sampled steps of a scene, with numbers that other scenes allow as well.
pub(super) fn of_scene(
    number: usize,
    scenes: &[Marked<'_>],
    made: &[Change],
    known: &mut Known,
    limits: &Thresholds,
) -> Vec<Change> {
    let scene = &scenes[number];
    let model = scene.model(made);
    let samples = scene.clear_samples(&model);
    let Some(base) = Base::of(&model, &samples) else { return Vec::new() };
    let parts: Vec<Term> = (0..model.n_terms()).map(|number| model.term(number)).collect();
    let mut wholes: Vec<Term> = parts.iter().map(|term| Term { part: "", ..*term }).collect();
    wholes.dedup();
    wholes.retain(|whole| parts.iter().filter(|term| whole.includes(**term)).count() > 1);
    let of_term = |term: Term| {
        let groups = candidates::groups(term).into_iter();
        groups.map(move |quantities| Subject::Elements(term, quantities))
    };
    let particles = Subject::Particles(scene.scene.integrator.name);
    let mut rules: Vec<Rule> = Vec::new();
    for subject in wholes.into_iter().chain(parts).flat_map(of_term).chain([particles]) {
        let Some(pieces) = Pieces::of(&base, &model, subject) else { continue };
        for (place, &measure) in pieces.measures.iter().enumerate() {
            for (above, factor) in
                [true, false].into_iter().flat_map(|above| FACTORS.map(|f| (above, f)))
            {
                // All elements of a scene may have a parameter that singles them out, as other scenes show.
                let with_all = matches!(measure, Measure::Parameter(..)) && base.is_wrong();
                if !pieces.allowed(place, above, factor, with_all).is_empty() {
                    rules.push(Rule { subject, measure, above, factor });
                }
            }
        }
    }
    rules.truncate(limits.gates);
    rules.iter().filter_map(|rule| known.with_number(rule, scenes, made)).collect()
}

/// The same, each with a rule that sets positions and fixed particles right where they are wrong without it.
pub(super) fn with_rules(
    number: usize,
    scenes: &[Marked<'_>],
    made: &[Change],
    limits: &Thresholds,
) -> Vec<Vec<Change>> {
    let rules = residuals::setting_right(&scenes[number], made).into_iter().take(FEW_RULES);
    let of = |rule: Change| {
        let with = [made, std::slice::from_ref(&rule)].concat();
        let found = of_scene(number, scenes, &with, &mut Known::default(), limits);
        found.into_iter().map(move |gate| vec![rule.clone(), gate])
    };
    rules.flat_map(of).collect()
}

/// The changes that the scenes allow, by rule: found once in a round.
#[derive(Default)]
pub(super) struct Known {
    found: Vec<(Rule, Option<Change>)>,
}

impl Known {
    fn with_number(
        &mut self,
        rule: &Rule,
        scenes: &[Marked<'_>],
        made: &[Change],
    ) -> Option<Change> {
        if let Some((_, found)) = self.found.iter().find(|(known, _)| known == rule) {
            return found.clone();
        }
        let found = number(rule, scenes, made).map(|at| change(rule, at));
        self.found.push((*rule, found.clone()));
        found
    }
}

/// The number of a rule; `None` if a scene in which the force is right contradicts it.
fn number(rule: &Rule, scenes: &[Marked<'_>], made: &[Change]) -> Option<f64> {
    let has_it = |scene: &&Marked<'_>| {
        let is_there = match rule.subject {
            Subject::Elements(term, _) => {
                scene.scene.forces.iter().any(|element| element.schema.tag == term.tag)
            }
            Subject::Particles(name) => scene.scene.integrator.name == name,
        };
        is_there && (scene.is_settled() || scene.is_suspect())
    };
    let concerned: Vec<&Marked<'_>> = scenes.iter().filter(has_it).collect();
    let of_each = concerned.par_iter().filter_map(|scene| {
        let model = scene.model(made);
        let samples = scene.all_samples();
        // Steps need not solve their equation where Newton's method ends early.
        let base =
            Base::of(&model, &samples).filter(|base| !scene.is_settled() || !base.is_wrong())?;
        let pieces = Pieces::of(&base, &model, rule.subject)?;
        let measure = pieces.measures.iter().position(|measure| *measure == rule.measure)?;
        let allowed = pieces.allowed(measure, rule.above, rule.factor, true);
        Some((scene.is_settled(), allowed))
    });
    let mut of_each: Vec<(bool, Intervals)> = of_each.collect();
    // Scenes in which nothing is wrong first: each must allow the number.
    of_each.sort_by_key(|(is_settled, _)| !is_settled);
    let mut left: Intervals = vec![(f64::NEG_INFINITY, f64::INFINITY)];
    for (is_settled, allowed) in of_each {
        let both = intersection(&left, &allowed);
        match (both.is_empty(), is_settled) {
            (true, true) => return None,
            (true, false) => {}
            (false, _) => left = both,
        }
    }
    left.retain(|(low, high)| low.is_finite() && high.is_finite());
    let (low, high) = left.into_iter().next()?;
    Some(match rule.measure.is_count() {
        true => (low.floor() + high.ceil()) / 2.0,
        false => gate::between(low, high, rule.above),
    })
}

fn intersection(a: &Intervals, b: &Intervals) -> Intervals {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a.0.max(b.0), a.1.min(b.1))));
    pairs.filter(|(low, high)| low < high).collect()
}

fn change(rule: &Rule, at: f64) -> Change {
    let Rule { subject, measure, above, factor } = *rule;
    let gate = Gate { measure, above, at, factor };
    match subject {
        Subject::Elements(term, quantities) => candidates::gated(term, quantities, gate),
        Subject::Particles(name) => candidates::gated_particles(name, gate),
    }
}
