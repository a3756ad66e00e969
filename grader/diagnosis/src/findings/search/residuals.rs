//! Changes that make the sampled steps of one scene: most are found in the residual of a step.
//!
//! The residual is a sum over terms, so the effect of a changed term is computed once; numbers in changes are fitted, and
//! pairs of changes are found by sorting.

use crate::change::candidates::{self, Numbered, NumberedForce};
use crate::change::helper;
use crate::change::round_changes;
use crate::change::{Change, Contributions, Effect, Model, Place, Quantity, Rule, Sample, Term};
use rayon::prelude::*;
use scene::schema::Matrix;

use crate::findings::evidence::{Agreement, Samples, SceneEvidence};
use crate::findings::fit::{self, simplest};
use crate::findings::thresholds::Thresholds;
use crate::steps::Evidence;

/// The single changes that make the sampled steps of a scene, the most usual first.
pub(super) fn survivors(
    scene: &SceneEvidence<'_>,
    made: &[Change],
    time_steps: &[f64],
) -> Vec<Change> {
    let inner = &scene.scene;
    let model = scene.model(made);
    if !scene.has_clear_sample() {
        return Vec::new();
    }
    let samples = scene.clear_samples(&model);
    let name = inner.integrator.name;
    let mut found = in_terms(&model, name, &samples);
    let mut whole: Vec<Change> = candidates::replacements(inner);
    whole.extend(candidates::of_integrator(inner));
    whole.extend(candidates::of_fixed(inner));
    // Newton's method ends in the same place by most matrices.
    let helpers = candidates::of_helpers(inner).into_iter();
    whole.extend(helpers.filter(|change| !scene.is_newton() || !is_of_matrix(change)));
    whole.extend(candidates::of_reading(inner, time_steps));
    let is_end = |change: &Change| matches!(change.effect, Effect::Method(_, Rule::Newton(_)));
    let (ends, others): (Vec<Change>, Vec<Change>) =
        candidates::of_process(inner).into_iter().partition(is_end);
    whole.extend(others);
    whole.extend(fit::ends(scene, made, ends));
    whole.extend(round_changes::of_rounds(inner));
    whole.extend(fit::of_rules(scene, made, &samples, |_| true));
    let makes = |change: &Change| makes(scene, made, change);
    let by_steps = whole.par_iter().filter(|change| makes(change));
    let by_steps: Vec<Change> = by_steps.cloned().collect();
    found.extend(by_steps);
    let values: Vec<Change> =
        found.iter().filter_map(|change| candidates::value_of_factor(inner, change)).collect();
    found.extend(values.into_iter().filter(makes));
    if model.remembers() && inner.integrator.matrix != Matrix::Jacobians {
        let terms = (0..model.n_terms()).map(|number| model.term(number));
        let usual = terms.flat_map(candidates::of_term).filter(|change| change.rank < 2);
        let fits = usual.collect::<Vec<_>>().into_par_iter().filter(|change| makes(change));
        found.extend(fits.cloned().collect::<Vec<Change>>());
    }
    if found.is_empty() {
        found.extend(fit::between(scene, made, &samples));
        found.extend(numbered_in_terms(&model, &samples));
    }
    if found.is_empty() || scene.is_nearly_right() {
        found.extend(in_jacobians_of_newton(scene, made));
    }
    found.retain(|change| !is_accidental(change, inner.time_step, scene.limits));
    found.sort_by_key(|change| change.rank);
    found
}

/// Whether a change of the functions on vectors is one of Jacobians alone.
fn is_of_matrix(change: &Change) -> bool {
    use helper::Helper::{Blocks, Entries};
    matches!(&change.effect, Effect::Blocks(..) | Effect::Helper(.., Blocks(..) | Entries(..)))
}

/// Whether a change makes the sampled steps with those made; not so once the work is over its limit.
fn makes(scene: &SceneEvidence<'_>, made: &[Change], change: &Change) -> bool {
    let all = [made, std::slice::from_ref(change)].concat();
    !scene.work.is_over() && scene.agrees_with(&scene.model(&all), usize::MAX) == Agreement::Agrees
}

/// Whether the number of a change is that of one scene, a power of its time step, or next to nothing: a change without a
/// number says the same of all scenes, if that is the mistake.
fn is_accidental(change: &Change, time_step: f64, limits: &Thresholds) -> bool {
    let Some(number) = change.effect.number() else { return false };
    let is_near = |power: i32| {
        let known = time_step.powi(power);
        (number.abs() - known).abs() <= limits.accidental * known
    };
    number != 0.0 && number.abs() < limits.tiny || [-2, -1, 1, 2].into_iter().any(is_near)
}

/// A change of the integrator's rules, or of fixed particles, with one of a term.
pub(super) fn with_rules(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let samples = scene.clear_samples(&scene.model(made));
    with_each(&rules_of(scene, made, &samples), scene, made, &samples)
}

/// The changes of the integrator's rules, and of fixed particles.
fn rules_of(scene: &SceneEvidence<'_>, made: &[Change], samples: &Samples<'_>) -> Vec<Change> {
    let mut rules = candidates::of_integrator(&scene.scene);
    rules.extend(candidates::of_fixed(&scene.scene));
    rules.extend(fit::of_rules(scene, made, samples, Numbered::moves));
    rules
}

/// Two changes of a method's rules, or of fixed particles; of a linearized method, which costs more, the most usual alone, and
/// those with values that are kept. None of Newton's method: by two of them, it may end in many places.
pub(super) fn pairs_of_rules(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    if scene.is_newton() {
        return Vec::new();
    }
    let mut rules = rules_of(scene, made, &scene.clear_samples(&scene.model(made)));
    let is_kept = |rule: &Change| matches!(rule.effect, Effect::Method(_, Rule::Kept(_)));
    let is_tried = |first: &Change, second: &Change| {
        let are_usual = first.rank < 2 && second.rank < 2;
        let is_quick = scene.scene.integrator.matrix != Matrix::Jacobians;
        (is_quick || are_usual || is_kept(first)) && !first.undoes(second)
    };
    rules.sort_by_key(|rule| (!is_kept(rule), rule.rank));
    let of = |number: usize| {
        let first = &rules[number];
        let beside = [made, std::slice::from_ref(first)].concat();
        let others = rules[number + 1..].iter().filter(|second| is_tried(first, second));
        let fits = others.filter(|second| makes(scene, &beside, second));
        fits.map(|second| vec![first.clone(), second.clone()]).collect::<Vec<Vec<Change>>>()
    };
    (0..rules.len()).into_par_iter().flat_map_iter(of).collect()
}

/// Of positions or fixed particles that are wrong in a scene, the rules with which they are right: another change can be
/// looked for with these alone.
pub(super) fn setting_right(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Change> {
    let samples = scene.clear_samples(&scene.model(made));
    let is_right = |changes: &[Change]| Base::of(&scene.model(changes), &samples).is_some();
    if samples.is_empty() || is_right(made) {
        return Vec::new();
    }
    let mut rules = rules_of(scene, made, &samples);
    rules.retain(|rule| is_right(&[made, std::slice::from_ref(rule)].concat()));
    rules
}

/// A change of the reading, or of the functions on vectors, with one of a term. Of a linearized method, which reads a scene as
/// explicit ones do and costs more, only those of matrices; none of Newton's method.
pub(super) fn with_reading(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let inner = &scene.scene;
    if scene.is_newton() {
        return Vec::new();
    }
    let mut rules = candidates::of_helpers(inner);
    match inner.integrator.matrix {
        Matrix::Jacobians => rules.retain(is_of_matrix),
        _ => rules.extend(candidates::of_reading(inner, &[])),
    }
    with_each(&rules, scene, made, &scene.clear_samples(&scene.model(made)))
}

/// Each of these changes with one of a term; the most usual first.
fn with_each(
    rules: &[Change],
    scene: &SceneEvidence<'_>,
    made: &[Change],
    samples: &Samples<'_>,
) -> Vec<Vec<Change>> {
    let inner = &scene.scene;
    let of = |rule: &Change| -> Vec<Vec<Change>> {
        let with: Vec<Change> = made.iter().chain([rule]).cloned().collect();
        let model = scene.model(&with);
        let found = in_terms(&model, inner.integrator.name, samples).into_iter();
        found.map(|change| vec![rule.clone(), change]).collect()
    };
    let mut all: Vec<Vec<Change>> = rules.par_iter().flat_map_iter(of).collect();
    all.sort_by_key(|changes| changes.iter().map(|change| u32::from(change.rank)).sum::<u32>());
    all
}

/// A rule by which positions are right that are wrong without it, with each change that makes the sampled steps then.
pub(super) fn with_positions(
    scene: &SceneEvidence<'_>,
    made: &[Change],
    time_steps: &[f64],
) -> Vec<Vec<Change>> {
    let samples = scene.clear_samples(&scene.model(made));
    let is_on_rule = |changes: &[Change]| {
        let model = scene.model(changes);
        samples.iter().all(|evidence| {
            let residual = model.residual(&evidence.sample);
            residual.is_some_and(|residual| {
                let bound = samples.limits.left * evidence.noise[0];
                residual.position.iter().all(|left| left.abs() <= bound)
            })
        })
    };
    if samples.is_empty() || is_on_rule(made) {
        return Vec::new();
    }
    let mut rules = rules_of(scene, made, &samples);
    rules.retain(|rule| is_on_rule(&[made, std::slice::from_ref(rule)].concat()));
    rules.sort_by_key(|rule| rule.rank);
    // The same rule of one method, of several and of all is the same in a scene.
    let mut effects: Vec<&Effect> = Vec::new();
    for rule in &rules {
        if !effects.contains(&&rule.effect) {
            effects.push(&rule.effect);
        }
    }
    let mut all = Vec::new();
    for effect in effects.into_iter().take(FEW_RULES) {
        let same: Vec<&Change> = rules.iter().filter(|rule| rule.effect == *effect).collect();
        let beside = [made, &[same[0].clone()]].concat();
        for change in survivors(scene, &beside, time_steps) {
            all.extend(same.iter().map(|rule| vec![(*rule).clone(), change.clone()]));
        }
    }
    all
}

/// Rules of the matrix that a linearized method has with these changes and Newton's method in this scene has not: one function
/// makes the matrices of both.
pub(super) fn of_linearized(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Change> {
    let name = scene.scene.integrator.name;
    let twins = made.iter().filter_map(|change| candidates::of_newton(name, change));
    twins.filter(|twin| scene.is_newton() && !made.contains(twin)).collect()
}

/// A rule of the matrix of Newton's method that a linearized method has, alone or with an end.
pub(super) fn with_matrices(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let is_end = |change: &Change| matches!(change.effect, Effect::Method(_, Rule::Newton(_)));
    let mut ends = candidates::of_process(&scene.scene);
    ends.retain(is_end);
    let mut all = Vec::new();
    for twin in of_linearized(scene, made) {
        let beside = [made, std::slice::from_ref(&twin)].concat();
        let model = scene.model(&beside);
        if scene.agrees_with(&model, usize::MAX) == Agreement::Agrees {
            all.push(vec![twin]);
            continue;
        }
        let found = fit::ends(scene, &beside, ends.clone()).into_iter();
        all.extend(found.map(|end| vec![twin.clone(), end]));
    }
    all
}

/// Most rules by which positions are right and with which all changes are tried.
const FEW_RULES: usize = 3;

/// Changes of one term's value, or of the sum of all terms, that cancel the residual; none where it vanishes without them.
fn in_terms(model: &Model, integrator: &'static str, samples: &Samples<'_>) -> Vec<Change> {
    let Some(base) = Base::of(model, samples).filter(Base::is_wrong) else { return Vec::new() };
    let mut found = Vec::new();
    for number in 0..model.n_terms() {
        let term = model.term(number);
        let all = candidates::of_term(term).par_iter();
        let fits = all.filter(|change| base.cancels(change) == Some(false));
        found.extend(fits.cloned().collect::<Vec<Change>>());
        for quantities in candidates::groups(term) {
            let make = |factor: f64| candidates::factor(term, quantities, factor);
            found.extend(base.factor(&[number], quantities, &make));
        }
    }
    let all: Vec<usize> = (0..model.n_terms()).collect();
    for quantity in [&[Quantity::Force], &[Quantity::ByPosition], &[Quantity::ByVelocity]] {
        let make = |factor: f64| candidates::integrator_factor(integrator, quantity[0], factor);
        found.extend(base.factor(&all, quantity, &make));
    }
    found
}

/// Changes of one term with a number in them that cancels the residual.
fn numbered_in_terms(model: &Model, samples: &Samples<'_>) -> Vec<Change> {
    let is_large =
        |evidence: &&Evidence| evidence.sample.before.positions.len() > samples.limits.numbered;
    if samples.iter().any(is_large) {
        return Vec::new();
    }
    let Some(base) = Base::of(model, samples) else { return Vec::new() };
    let terms = || (0..model.n_terms()).map(|number| model.term(number));
    let forces: Vec<NumberedForce> = terms().flat_map(candidates::numbered_forces).collect();
    let mut found: Vec<Change> =
        forces.par_iter().filter_map(|force| base.numbered(force)).collect();
    let jacobians = [Quantity::ByPosition, Quantity::ByVelocity];
    for (term, quantity) in terms().flat_map(|term| jacobians.map(|quantity| (term, quantity))) {
        let stencil = term.schema().stencil;
        let size = if stencil.is_field() { 0 } else { stencil.size() };
        let blocks = (0..size).flat_map(|row| (0..size).map(move |column| [row, column]));
        let make =
            |place: [usize; 2]| move |by: f64| candidates::scaled_block(term, quantity, place, by);
        found.extend(blocks.filter_map(|place| base.scaled(&make(place))));
    }
    found
}

/// The residuals of sampled steps.
pub(super) struct Base<'a> {
    model: &'a Model,
    samples: &'a Samples<'a>,
    /// For each sample, the residual and its bound.
    residuals: Vec<(Vec<f64>, f64)>,
    /// For each sample, of what it is the sum.
    parts: Vec<Contributions>,
}

impl<'a> Base<'a> {
    /// `None` where positions or fixed particles are wrong: no term is to blame then. Nor without a sample.
    pub(super) fn of(model: &'a Model, samples: &'a Samples<'a>) -> Option<Self> {
        if samples.is_empty() {
            return None;
        }
        let mut residuals = Vec::new();
        for evidence in samples.iter() {
            let residual = model.residual(&evidence.sample)?;
            let [x, v] = evidence.noise;
            let is_on_rule =
                residual.position.iter().all(|left| left.abs() <= samples.limits.left * x);
            if !is_on_rule || model.moves_fixed(&evidence.sample, samples.limits.left * v) {
                return None;
            }
            residuals.push((residual.momentum, samples.limits.left * v * residual.stiffness));
        }
        let parts = samples.iter().map(|evidence| model.contributions(&evidence.sample));
        let parts = parts.collect();
        Some(Self { model, samples, residuals, parts })
    }

    /// The contribution of a change to the residual of the sample of this number.
    fn effect(&self, change: &Change, number: usize) -> Option<Vec<f64>> {
        self.term_and_effect(change, number).map(|(_, effect)| effect)
    }

    /// The number of the term that it changes, and the same.
    fn term_and_effect(&self, change: &Change, number: usize) -> Option<(usize, Vec<f64>)> {
        if self.model.is_over() {
            return None;
        }
        self.model.effect(change, &self.samples[number].sample, &self.parts[number])
    }

    /// Whether some residual does not vanish.
    pub(super) fn is_wrong(&self) -> bool {
        let is_off =
            |(residual, bound): &(Vec<f64>, f64)| residual.iter().any(|r| r.abs() > *bound);
        self.residuals.iter().any(is_off)
    }

    /// Each sample with its residual and the bound of that.
    pub(super) fn each(&self) -> impl Iterator<Item = (&Sample, &(Vec<f64>, f64))> {
        self.samples.iter().map(|evidence| &evidence.sample).zip(&self.residuals)
    }

    /// Whether a formula with this effect on the sample of this number is 0 there, as by a parameter that is 0: where all
    /// samples are so, they show that the value is missing, and not why.
    fn is_zero(&self, change: &Change, number: usize, term: usize, effect: &[f64]) -> bool {
        let old = |dof: usize| -> f64 {
            let quantities = change.effect.quantities().iter();
            quantities.map(|quantity| self.parts[number].of(term, *quantity)[dof]).sum()
        };
        matches!(change.effect, Effect::Formula(..))
            && effect.iter().enumerate().all(|(dof, effect)| effect + old(dof) == 0.0)
    }

    /// Whether a change cancels the residuals.
    fn is_cancelled(&self, change: &Change) -> bool {
        self.cancels(change).is_some()
    }

    /// If a change cancels the residuals, whether by a formula that is 0 in all samples.
    fn cancels(&self, change: &Change) -> Option<bool> {
        let mut is_missing = true;
        let is_it = self.residuals.iter().enumerate().all(|(number, (residual, bound))| {
            let Some((term, effect)) = self.term_and_effect(change, number) else { return false };
            is_missing = is_missing && self.is_zero(change, number, term, &effect);
            effect
                .iter()
                .zip(residual)
                .all(|(effect, residual)| (residual + effect).abs() <= *bound)
        });
        is_it.then_some(is_missing)
    }

    /// The number with which a changed force cancels the residual, if there is one.
    fn numbered(&self, force: &NumberedForce) -> Option<Change> {
        let (residual, _) = self.residuals.first()?;
        let along = |number: f64| -> Option<f64> {
            let effect = self.effect(&force.with(number), 0)?;
            let sum: f64 = effect.iter().zip(residual).map(|(a, b)| (a + b) * b).sum();
            sum.is_finite().then_some(sum)
        };
        let arguments = if force.is_angle() { fit::angles() } else { fit::sizes() };
        let fits = |number: f64| self.is_cancelled(&force.with(number));
        let number = fit::roots(&along, &arguments).into_iter().find(|number| fits(*number))?;
        Some(force.with(simplest(number, &fits)))
    }

    /// The factor with which a part cancels the residual: the effect is affine in it, and vanishes at 1.
    fn scaled(&self, make: &dyn Fn(f64) -> Change) -> Option<Change> {
        let left_out = make(0.0);
        let value = |number: usize| -> Option<Vec<f64>> {
            let effect = self.effect(&left_out, number)?;
            Some(effect.into_iter().map(|effect| -effect).collect())
        };
        let values = (0..self.samples.len()).map(value).collect::<Option<Vec<_>>>()?;
        self.fitted(&values).map(make)
    }

    /// The factor of some quantities of some terms that cancels the residual, if there is one.
    fn factor(
        &self,
        terms: &[usize],
        quantities: &[Quantity],
        make: &dyn Fn(f64) -> Change,
    ) -> Option<Change> {
        let value = |parts: &Contributions| {
            let mut sum = vec![0.0; self.residuals[0].0.len()];
            for (term, quantity) in
                terms.iter().flat_map(|term| quantities.iter().map(move |q| (*term, *q)))
            {
                let value = parts.of(term, quantity);
                sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
            }
            sum
        };
        let values: Vec<Vec<f64>> = self.parts.iter().map(value).collect();
        let number = self.fitted(&values)?;
        // The others are among the listed changes.
        let is_unusual = ![0.0, -1.0, 2.0, 0.5].contains(&number);
        is_unusual.then(|| Change { rank: 3, ..make(number) })
    }

    /// `values` are a part of the residual of each sample. Returns the factor of that part with which all residuals vanish;
    /// `None` if no factor does it, or 1.
    fn fitted(&self, values: &[Vec<f64>]) -> Option<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (mut product, mut square) = (0.0, 0.0);
        for (value, (residual, bound)) in values.iter().zip(&self.residuals) {
            // Samples weigh by their precision.
            let weight = 1.0 / (bound * bound);
            product += weight * dot(value, residual);
            square += weight * dot(value, value);
        }
        if square <= 0.0 || square.is_nan() {
            return None;
        }
        let exact = 1.0 - product / square;
        let fits = |factor: f64| {
            values.iter().zip(&self.residuals).all(|(value, (residual, bound))| {
                let pairs = value.iter().zip(residual);
                pairs.into_iter().all(|(g, r)| (r + (factor - 1.0) * g).abs() <= *bound)
            })
        };
        let is_other = (exact - 1.0).abs() >= 1e-4;
        (fits(exact) && is_other).then(|| simplest(exact, &fits))
    }
}

/// Jacobians, and rules of the matrix, that only the end of Newton's method shows: implicit Euler converges elsewhere with them.
fn in_jacobians_of_newton(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Change> {
    let inner = &scene.scene;
    if reference::method::Method::one_point(inner.integrator)
        != Some(reference::method::OnePoint::Implicit)
    {
        return Vec::new();
    }
    let model = scene.model(made);
    let terms = (0..model.n_terms()).map(|number| model.term(number));
    let all: Vec<&Change> = terms
        .flat_map(candidates::of_term)
        .filter(|change| matches!(change.place, Place::Jacobian(_)) && change.rank < 2)
        .collect();
    let of_matrix = candidates::of_newtons_matrix(inner);
    let all = all.into_par_iter().chain(&of_matrix);
    all.filter(|change| makes(scene, made, change)).cloned().collect()
}

/// Pairs of changes of different values that together cancel the residual.
pub(super) fn pairs_of(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let model = scene.model(made);
    let samples = scene.clear_samples(&model);
    let Some(base) = Base::of(&model, &samples) else { return Vec::new() };
    let all: Vec<&Change> = (0..model.n_terms())
        .flat_map(|number| candidates::of_term(model.term(number)))
        .filter(|change| change.rank < 3)
        .collect();
    // Effects on all samples, in units of their bounds.
    let effect = |change: &&'static Change| -> Option<(&'static Change, Vec<f64>)> {
        let mut whole = Vec::new();
        let mut is_missing = true;
        for (number, (_, bound)) in base.residuals.iter().enumerate() {
            let (term, effect) = base.term_and_effect(change, number)?;
            is_missing = is_missing && base.is_zero(change, number, term, &effect);
            whole.extend(effect.into_iter().map(|value| value / bound));
        }
        let is_there = whole.iter().any(|value| value.abs() > 1.0);
        (is_there && !is_missing && whole.iter().all(|value| value.is_finite()))
            .then_some((*change, whole))
    };
    let effects: Vec<(&Change, Vec<f64>)> = all.par_iter().filter_map(effect).collect();
    let residual: Vec<f64> = base
        .residuals
        .iter()
        .flat_map(|(residual, bound)| {
            residual.iter().map(|value| value / *bound).collect::<Vec<_>>()
        })
        .collect();
    if effects.is_empty() {
        return Vec::new();
    }
    // Pairs are found by a projection on one direction, sorted.
    let mut random = fastrand::Rng::with_seed(1);
    let direction: Vec<f64> = residual.iter().map(|_| random.f64() + 0.5).collect();
    let along = |vector: &[f64]| vector.iter().zip(&direction).map(|(a, b)| a * b).sum::<f64>();
    let width: f64 = direction.iter().sum();
    let mut sorted: Vec<(f64, usize)> =
        effects.iter().enumerate().map(|(k, (_, effect))| (along(effect), k)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let target = -along(&residual);
    let mut found: Vec<(u32, Vec<Change>)> = Vec::new();
    for (k, (first, effect)) in effects.iter().enumerate() {
        let wanted = target - along(effect);
        let from = sorted.partition_point(|(value, _)| *value < wanted - width);
        for &(value, other) in &sorted[from..] {
            if value > wanted + width {
                break;
            }
            let (second, more) = &effects[other];
            if other <= k || value_of(first) == value_of(second) {
                continue;
            }
            let sums = residual.iter().zip(effect).zip(more);
            if sums.into_iter().all(|((r, a), b)| (r + a + b).abs() <= 1.0) {
                let rank = u32::from(first.rank) + u32::from(second.rank);
                found.push((rank, vec![(*first).clone(), (*second).clone()]));
            }
        }
    }
    found.sort_by_key(|(rank, _)| *rank);
    found.into_iter().map(|(_, changes)| changes).collect()
}

/// Two changes of one value of a term, of which the first is one of its factor, its blocks, its components or its ends.
pub(super) fn within_terms(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let model = scene.model(made);
    let samples = scene.clear_samples(&model);
    let is_first = |change: &&Change| {
        use Effect::{Axes, Blocks, Ends};
        let is_factor =
            matches!(change.effect, Effect::Factor(_, _, factor) if factor.number != 0.0);
        change.rank < 2 && (is_factor || matches!(change.effect, Axes(..) | Blocks(..) | Ends(..)))
    };
    let of = |(term, first): (Term, &'static Change)| -> Vec<Vec<Change>> {
        let model = scene.model(&[made, std::slice::from_ref(first)].concat());
        let Some(base) = Base::of(&model, &samples) else { return Vec::new() };
        let seconds = candidates::of_term(term).iter().filter(|second| {
            value_of(second) == value_of(first)
                && second.effect != first.effect
                && base.is_cancelled(second)
        });
        seconds.map(|second| vec![first.clone(), second.clone()]).collect()
    };
    let terms = (0..model.n_terms()).map(|number| model.term(number));
    let firsts =
        terms.flat_map(|term| candidates::of_term(term).iter().map(move |one| (term, one)));
    let firsts: Vec<(Term, &Change)> = firsts.filter(|(_, change)| is_first(change)).collect();
    firsts.into_par_iter().flat_map_iter(of).collect()
}

/// The value that a change is made in: two changes of one value do not add up.
fn value_of(change: &Change) -> Option<(Term, Quantity)> {
    match &change.effect {
        Effect::Formula(term, quantity, _)
        | Effect::Axes(term, quantity, _)
        | Effect::Particles(term, quantity, _) => Some((*term, *quantity)),
        Effect::Factor(term, quantities, _)
        | Effect::Start(term, quantities, _)
        | Effect::Weight(term, quantities, _)
        | Effect::Blocks(term, quantities, _)
        | Effect::Length(term, quantities, _)
        | Effect::Masses(term, quantities, _) => Some((*term, quantities[0])),
        Effect::Derived(term, _) | Effect::Ends(term, _) | Effect::Read(term, _) => {
            Some((*term, Quantity::Force))
        }
        Effect::Gate(..)
        | Effect::Method(..)
        | Effect::Fixed(_)
        | Effect::Helper(..)
        | Effect::Scene(_)
        | Effect::Partly(..)
        | Effect::Rounds(_) => None,
    }
}
