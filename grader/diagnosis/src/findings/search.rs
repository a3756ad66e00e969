//! Search for the changes of a right simulator that make a submission's steps.
//!
//! ```text
//! simplest failing scene ── every change of its terms, integrator, … ── those that make its sampled steps
//!                        ── do they make those of other scenes, and leave alone the scenes that passed?
//!                        ── the one that explains most; whole scenes replayed ── made; then the scenes that are left
//! ```
//!
//! The residual of a step is a sum over terms, so the effect of a changed term is computed once, and pairs of changes are
//! found by sorting. A choice between changes that explain the same is made again once another cause is known. Limits:
//! [`ROUNDS`] changes, [`TRIED`] scenes in each round, [`WEIGHED`] changes that are compared with other scenes, [`REPLAYED`]
//! that are replayed, [`RETRIES`] further searches, [`CEILING`] of time.

use std::collections::{BTreeSet, HashMap};

use crate::change::candidates::{self, Numbered, NumberedForce};
use crate::change::{Change, Effect, Factor, Model, Place, Quantity, Rule, Task, Term};
use crate::change::{round_changes, rounds};
use rayon::prelude::*;
use scene::Scene;
use scene::schema::{Convergence, IntegratorSchema, Matrix};

use super::evidence::{Agreement, LEFT, SceneEvidence};
use super::fit::{self, simplest};
use super::form::Kind;
use super::judged::Outcome;
use crate::steps::Evidence;

/// Maximum number of changes, omissions included.
const ROUNDS: usize = 16;

/// Maximum number of mistakes: changes other than features that are left out.
const MISTAKES: usize = 4;

/// In a submission of fewer scenes than this, one scene is proof enough.
const SMALL: usize = 10;

/// Passed scenes that are replayed with a change.
const PASSED: usize = 12;

/// Scenes whose changes are enumerated in a round.
const TRIED: usize = 8;

/// Changes of one scene, and of one place in it, that are compared with one step of [`PROBED`] other scenes; and those
/// that are compared with all evidence, with one in each of as many other places.
const WEIGHED: usize = 48;
const WEIGHED_OF_PLACE: usize = 8;
const PROBED: usize = 24;
const WEIGHED_FULLY: usize = 6;

/// Processor time of a search, in estimated milliseconds: an estimate, so that the same traces have the same findings on
/// every machine. What is found by then is what is said. Without it, pairs of changes in a net of 25 particles take 12 s.
const CEILING: u64 = 8_000;

/// Changes that are replayed in a round.
const REPLAYED: usize = 12;

/// Samples of a scene by which changes are chosen first.
const FIRST: usize = 4;

/// Coordinates of the largest scenes in which numbers in formulas are looked for.
const NUMBERED: usize = 40;

/// Searches without what explains few scenes.
const RETRIES: usize = 2;

/// Changes of one task that are named together.
const SYNONYMS: usize = 2;

/// Changes kept that explain some of the scenes of a cause.
const RIVALS: usize = 12;

/// The least rank of changes that only most of their scenes prove.
pub(super) const FAR_FETCHED: u8 = 3;

/// Jacobians that the same change of the matrix may be in.
const TOGETHER: usize = 3;

/// Relative distance of a fitted number from a power of the time step at which it is taken for that.
const ACCIDENTAL: f64 = 1e-4;

/// Fitted factors below this are no finding: a scene of few forces determines them by its rounding.
const TINY: f64 = 1e-6;

/// Minimum ratio of a defect to the noise for changes to be distinguishable.
const CLEAR: f64 = 300.0;

/// Changes that are proven together.
#[derive(Debug, Clone)]
pub(super) struct Cause {
    /// Equally good descriptions, the simplest first.
    pub(super) alternatives: Vec<Change>,
    /// Changes that explain some of its scenes, and possibly more once other causes are known.
    rivals: Vec<Change>,
    /// Scenes that it explains, with the causes found before it: by number.
    pub(super) scenes: Vec<usize>,
    /// Scenes where Newton's method converges slowly or not at all with it: no statement.
    pub(super) open: usize,
    /// Wrong scenes in which it acts, and that nothing explains: by number.
    pub(super) unexplained: Vec<usize>,
    /// Causes of one number were found together, and stand only beside each other.
    group: usize,
}

impl Cause {
    pub(super) fn change(&self) -> &Change {
        &self.alternatives[0]
    }

    /// Whether it is a feature that the program lacks: no mistake in rounds makes the same traces.
    pub(super) fn is_lack(&self) -> bool {
        is_lack(self.change()) && !self.alternatives.iter().any(is_of_rounds)
    }
}

/// Whether a change is what a program does that lacks a feature.
fn is_lack(change: &Change) -> bool {
    match &change.effect {
        Effect::Factor(_, quantities, factor) => {
            quantities.len() == Quantity::ALL.len() && factor.number == 0.0
        }
        Effect::Method(_, rule) => match rule {
            Rule::Idle => true,
            Rule::Replaced(method) => {
                use reference::method::OnePoint::{Explicit, Symplectic};
                matches!(method, Explicit | Symplectic)
            }
            _ => false,
        },
        _ => false,
    }
}

/// A change, or two, with what they explain.
struct Weighed {
    changes: Vec<Change>,
    explained: BTreeSet<usize>,
    /// Failing scenes in which it acts, and that it does not explain.
    unexplained: usize,
    open: usize,
}

impl Weighed {
    /// A scene that is not explained counts a quarter: another mistake may be in it.
    fn score(&self) -> i64 {
        4 * self.explained.len() as i64 - self.unexplained as i64
    }

    fn rank(&self) -> u32 {
        let ranks = self.changes.iter().map(|change| u32::from(change.rank));
        ranks.sum::<u32>() + 4 * (self.changes.len() as u32 - 1)
    }
}

/// Finds the causes of the wrong steps of these scenes, and marks the scenes that they explain.
///
/// Where mistakes explain fewer scenes than they leave wrong, the search is repeated without them. The result that explains
/// more scenes by at most as many mistakes counts.
pub(super) fn causes(scenes: &mut [SceneEvidence<'_>]) -> Vec<Cause> {
    let start: Vec<bool> = scenes.iter().map(|scene| scene.explained).collect();
    let mut spent = 0;
    let mut found = search(scenes, &[], &mut spent);
    let mut excluded: Vec<Change> = Vec::new();
    for _ in 0..RETRIES {
        let doubtful = found
            .iter()
            .filter(|cause| !cause.is_lack() && cause.unexplained.len() > cause.scenes.len());
        let before = excluded.len();
        excluded.extend(doubtful.flat_map(|cause| cause.alternatives.clone()));
        if excluded.len() == before {
            break;
        }
        let marks: Vec<[bool; 2]> = scenes.iter().map(|s| [s.explained, s.open]).collect();
        for (scene, explained) in scenes.iter_mut().zip(&start) {
            (scene.explained, scene.open) = (*explained, false);
        }
        let other = search(scenes, &excluded, &mut spent);
        let mistakes = |found: &[Cause]| found.iter().filter(|cause| !cause.is_lack()).count();
        let n_explained = scenes.iter().filter(|scene| scene.explained).count();
        let is_better = n_explained > marks.iter().filter(|[explained, _]| *explained).count()
            && mistakes(&other) <= mistakes(&found);
        if is_better {
            found = other;
        } else {
            for (scene, [explained, open]) in scenes.iter_mut().zip(marks) {
                (scene.explained, scene.open) = (explained, open);
            }
            break;
        }
    }
    drop_all(scenes, &mut found, is_unlikely);
    for cause in &mut found {
        // Only a matrix of Jacobians shows them.
        if !cause.scenes.iter().any(|&number| super::is_linearized(&scenes[number])) {
            cause.alternatives.iter_mut().for_each(candidates::say_force_alone);
        }
    }
    found
}

/// Gives each wrong scene that all causes together make to those that act in it, and to no other: what was proven beside a
/// cause that is gone is proven again. A cause without a scene goes, and with it those that stand only beside it.
fn settle(scenes: &mut [SceneEvidence<'_>], found: &mut Vec<Cause>) {
    loop {
        for cause in found.iter_mut() {
            for number in cause.scenes.drain(..) {
                scenes[number].explained = false;
            }
        }
        explain_more(scenes, found);
        attribute(scenes, found);
        let gone = found.iter().filter(|cause| cause.scenes.is_empty());
        let gone: BTreeSet<usize> = gone.map(|cause| cause.group).collect();
        if gone.is_empty() {
            break;
        }
        found.retain(|cause| !gone.contains(&cause.group));
    }
    mark_open(scenes, found);
    let made: Vec<Change> = found.iter().map(|cause| cause.change().clone()).collect();
    let is_slow = |number: &usize| {
        let scene = &scenes[*number];
        let is_wrong = scene.is_newton() && scene.is_suspect() && !scene.explained;
        let model = || Model::new(&scene.scene, &made);
        is_wrong && scene.agrees_with(&model(), usize::MAX) == Agreement::Open
    };
    let slow: Vec<usize> = (0..scenes.len()).into_par_iter().filter(is_slow).collect();
    for cause in found {
        let change = cause.change().clone();
        let acts = |number: &usize| change.must_act_in(&scenes[*number].scene);
        let left = (0..scenes.len()).filter(|&number| scenes[number].is_left());
        cause.unexplained = left.filter(acts).collect();
        cause.open = slow.iter().filter(|number| acts(number)).count();
    }
}

/// Gives each explained scene to the causes without which its steps are not made: several, where they act together.
fn attribute(scenes: &[SceneEvidence<'_>], found: &mut [Cause]) {
    let made: Vec<Change> = found.iter().map(|cause| cause.change().clone()).collect();
    let explained: BTreeSet<usize> =
        found.iter().flat_map(|cause| cause.scenes.iter().copied()).collect();
    let needed = |number: usize| -> Vec<usize> {
        let scene = &scenes[number];
        let model = Model::new(&scene.scene, &made);
        let acting: Vec<usize> = (0..made.len())
            .filter(|&one| made[one].acts_in(&scene.scene) && model.is_changed_by(&made[one]))
            .collect();
        let is_needed = |one: &usize| {
            let others = acting.iter().filter(|other| *other != one);
            let others: Vec<Change> = others.map(|&other| made[other].clone()).collect();
            let model = Model::new(&scene.scene, &others);
            !model.can_step() || scene.agrees_with(&model, usize::MAX) != Agreement::Agrees
        };
        match acting.as_slice() {
            [_] => acting,
            _ => acting.iter().copied().filter(is_needed).collect(),
        }
    };
    let of_scenes: Vec<(usize, Vec<usize>)> =
        explained.into_par_iter().map(|number| (number, needed(number))).collect();
    for (one, cause) in found.iter_mut().enumerate() {
        let is_its = |(number, causes): &&(usize, Vec<usize>)| match causes.is_empty() {
            true => cause.scenes.contains(number),
            false => causes.contains(&one),
        };
        let of_it: Vec<usize> =
            of_scenes.iter().filter(is_its).map(|(number, _)| *number).collect();
        // A cause that no scene needs beside the others keeps those by which it was found.
        if !of_it.is_empty() {
            cause.scenes = of_it;
        }
    }
}

/// Causes of the wrong steps of these scenes, other than the excluded changes.
fn search(scenes: &mut [SceneEvidence<'_>], excluded: &[Change], spent: &mut u64) -> Vec<Cause> {
    let mut time_steps: Vec<f64> = scenes.iter().map(|scene| scene.scene.time_step).collect();
    time_steps.extend([0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 1.0 / 60.0, 1.0 / 30.0, 1.0]);
    time_steps.sort_by(f64::total_cmp);
    time_steps.dedup();
    let mut found: Vec<Cause> = Vec::new();
    let mut n_groups = 0;
    // Scenes that no change explained, with the number of changes that acted in them then.
    let mut tried: HashMap<(usize, bool), usize> = HashMap::new();
    for _ in 0..ROUNDS {
        let made: Vec<Change> = found.iter().map(|cause| cause.change().clone()).collect();
        let full = found.iter().filter(|cause| !cause.is_lack()).count() >= MISTAKES;
        let mut next = lacks(scenes, &made);
        if next.is_empty() {
            next = round(
                scenes,
                &made,
                excluded,
                &time_steps,
                &mut Tried { scenes: &mut tried, spent },
            );
        }
        next.retain(|cause| !full || cause.is_lack());
        if next.is_empty() {
            break;
        }
        let is_joint = next.iter().all(|cause| cause.scenes == next[0].scenes);
        n_groups += 1;
        for cause in next {
            for &number in &cause.scenes {
                scenes[number].explained = true;
            }
            n_groups += usize::from(!is_joint);
            found.push(Cause { group: n_groups, ..cause });
        }
        explain_more(scenes, &mut found);
        if prefer_rivals(scenes, &mut found) {
            found.retain(|cause| !cause.scenes.is_empty());
            explain_more(scenes, &mut found);
        }
    }
    mark_open(scenes, &found);
    drop_all(scenes, &mut found, is_refuted);
    found
}

/// Replaces causes by their rivals, where these explain more scenes beside the other causes. Returns whether it did.
fn prefer_rivals(scenes: &mut [SceneEvidence<'_>], found: &mut [Cause]) -> bool {
    let mut is_changed = false;
    for number in 0..found.len() {
        let others = found.iter().enumerate().filter(|(other, _)| *other != number);
        let made: Vec<Change> = others.map(|(_, cause)| cause.change().clone()).collect();
        let cause = &found[number];
        let better = |rival: &Change| {
            let all = [made.as_slice(), std::slice::from_ref(rival)].concat();
            let explains = |scene: &SceneEvidence<'_>| {
                let model = Model::new(&scene.scene, &all);
                model.can_step() && scene.agrees_with(&model, usize::MAX) == Agreement::Agrees
            };
            let mut left = scenes.iter().filter(|scene| scene.is_left());
            if !left.any(|scene| rival.acts_in(&scene.scene) && explains(scene)) {
                return None;
            }
            let weighed = weigh(scenes, &made, vec![rival.clone()], false)?;
            let Weighed { changes, explained, .. } = prove(scenes, &made, weighed)?;
            let is_still = |scene: &&usize| scenes[**scene].replay(&all) == Agreement::Agrees;
            let mut still: BTreeSet<usize> =
                cause.scenes.par_iter().filter(is_still).copied().collect();
            still.extend(explained);
            (still.len() > cause.scenes.len()).then_some((changes, still))
        };
        let Some((changes, explained)) = cause.rivals.iter().find_map(better) else { continue };
        let before = std::mem::take(&mut found[number].scenes);
        for scene in before.into_iter().chain(explained.iter().copied()) {
            scenes[scene].explained = explained.contains(&scene);
        }
        for cause in found.iter_mut() {
            cause.scenes.retain(|&scene| scenes[scene].explained);
        }
        let cause = &mut found[number];
        cause.rivals.retain(|rival| !changes.contains(rival));
        cause.alternatives = changes;
        cause.scenes = explained.into_iter().collect();
        is_changed = true;
    }
    is_changed
}

/// Marks the scenes that show nothing more with the changes found.
fn mark_open(scenes: &mut [SceneEvidence<'_>], found: &[Cause]) {
    let made: Vec<Change> = found.iter().map(|cause| cause.change().clone()).collect();
    scenes
        .par_iter_mut()
        .filter(|scene| scene.kind == Some(Kind::Wrong) && !scene.explained)
        .for_each(|scene| {
            let acts = |change: &&Change| change.acts_in(&scene.scene);
            let acting: Vec<&Change> = made.iter().filter(acts).collect();
            // With a wrong Jacobian, Newton's method ends where it may.
            let is_jacobian = |change: &&Change| matches!(change.place, Place::Jacobian(_));
            let is_astray = scene.is_newton() && acting.iter().any(is_jacobian);
            let model = Model::new(&scene.scene, &made);
            let agrees = || scene.agrees_with(&model, usize::MAX) != Agreement::Differs;
            scene.open = is_astray
                || !acting.is_empty() && model.can_step() && agrees()
                || steps_otherwise(scene, &made);
        });
}

/// Whether another method's steps are those of the scene: it is evidence of nothing else, though too little to say that the
/// scene's own method is not there.
fn steps_otherwise(scene: &SceneEvidence<'_>, made: &[Change]) -> bool {
    let mut lacks = candidates::replacements(&scene.scene).into_iter().filter(is_lack);
    lacks.any(|change| {
        let all = [made, &[change]].concat();
        let model = Model::new(&scene.scene, &all);
        scene.agrees_with(&model, usize::MAX) == Agreement::Agrees
            && scene.replay(&all) == Agreement::Agrees
    })
}

/// Whether a change is one of a task, or of a force beside rounds.
fn is_of_rounds(change: &Change) -> bool {
    matches!(change.place, Place::Task(_) | Place::ForceUnder(..))
}

/// Whether more scenes refute a mistake than it explains. A scene refutes one if nothing explains it, and all its terms and
/// rules are in a scene that the mistake explains: nothing else can be wrong there.
fn is_refuted(scenes: &[SceneEvidence<'_>], cause: &Cause) -> bool {
    let is_within = |inner: &Scene, outer: &Scene| {
        let has_fixed = |scene: &Scene| scene.particles.iter().any(|particle| particle.fixed);
        inner.integrator.name == outer.integrator.name
            && super::terms(inner).is_subset(&super::terms(outer))
            && (has_fixed(outer) || !has_fixed(inner))
    };
    let acts = |scene: &&SceneEvidence<'_>| cause.change().must_act_in(&scene.scene);
    let refuting = scenes.iter().filter(|scene| scene.is_left()).filter(acts).filter(|left| {
        let mut explained = cause.scenes.iter().map(|&number| &scenes[number].scene);
        explained.any(|explained| is_within(&left.scene, explained))
    });
    // The equation of rounds is known in full: one such scene says that something else is wrong.
    let enough = if is_of_rounds(cause.change()) { 1 } else { cause.scenes.len() + 1 };
    !cause.is_lack() && refuting.count() >= enough
}

/// Whether a mistake leaves too many scenes wrong in which it acts. A far-fetched one, such as a number that the steps
/// determine, may be another formula that has this value in a few scenes; a method that steps as another one does so in all
/// scenes. Both must explain most. Others must explain a third, as other mistakes may be in the same scenes.
fn is_unlikely(scenes: &[SceneEvidence<'_>], cause: &Cause) -> bool {
    let change = cause.change();
    let acts = |scene: &&SceneEvidence<'_>| change.must_act_in(&scene.scene) && scene.is_suspect();
    let unsettled = scenes.iter().filter(acts).filter(|scene| !scene.explained).count();
    let explained = cause.scenes.len();
    let is_replaced = matches!(change.effect, Effect::Method(_, Rule::Replaced(_)));
    let is_in_method = !cause.unexplained.is_empty() && is_all_of_a_method(scenes, cause);
    let is_far_fetched = !cause.is_lack() && change.rank >= FAR_FETCHED;
    match is_replaced || is_far_fetched {
        true => explained <= unsettled,
        false => !cause.is_lack() && (2 * explained < cause.unexplained.len() || is_in_method),
    }
}

/// Whether a mistake of a force explains scenes of one method alone, whose other scenes are wrong as well, more of them, and
/// without that force: something of the method is wrong, and this is a part of what it does.
fn is_all_of_a_method(scenes: &[SceneEvidence<'_>], cause: &Cause) -> bool {
    let methods: BTreeSet<&str> =
        cause.scenes.iter().map(|&number| scenes[number].scene.integrator.name).collect();
    let Some(name) = methods.first().filter(|_| methods.len() == 1) else { return false };
    let is_of_method = matches!(cause.change().place, Place::Integrator(_) | Place::FixedUnder(_));
    let of_method = |scene: &&SceneEvidence<'_>| {
        scene.scene.integrator.name == *name && !scene.scene.forces.is_empty()
    };
    let others =
        scenes.iter().filter(of_method).filter(|scene| !cause.change().acts_in(&scene.scene));
    let (wrong, right): (Vec<_>, Vec<_>) = others.partition(|scene| scene.is_left());
    !is_of_method && right.is_empty() && wrong.len() > cause.scenes.len()
}

/// Drops such mistakes. What a dropped mistake explained, alone or with others, is unexplained again.
fn drop_all(
    scenes: &mut [SceneEvidence<'_>],
    found: &mut Vec<Cause>,
    is_dropped: fn(&[SceneEvidence<'_>], &Cause) -> bool,
) {
    let gone = found.iter().filter(|cause| is_dropped(scenes, cause));
    let gone: BTreeSet<usize> = gone.map(|cause| cause.group).collect();
    let is_gone = |cause: &Cause| gone.contains(&cause.group);
    for &number in found.iter().filter(|cause| is_gone(cause)).flat_map(|cause| &cause.scenes) {
        scenes[number].explained = false;
    }
    found.retain(|cause| !is_gone(cause));
    settle(scenes, found);
}

/// Marks the scenes that the changes made so far explain together.
fn explain_more(scenes: &mut [SceneEvidence<'_>], found: &mut [Cause]) {
    let made: Vec<Change> = found.iter().map(|cause| cause.change().clone()).collect();
    let agrees = |scene: &SceneEvidence<'_>| {
        let model = Model::new(&scene.scene, &made);
        let is_changed =
            made.iter().any(|change| change.acts_in(&scene.scene) && model.is_changed_by(change));
        // The last steps before a number overflows show nothing.
        let explodes = matches!(scene.judged.outcome, Outcome::NotFinite(_));
        let most = if explodes { FIRST } else { usize::MAX };
        is_changed
            && model.can_step()
            && scene.agrees_with(&model, most) == Agreement::Agrees
            && (explodes || scene.replay(&made) == Agreement::Agrees)
    };
    let more: Vec<usize> = (0..scenes.len())
        .into_par_iter()
        .filter(|&number| {
            let scene = &scenes[number];
            scene.is_suspect() && !scene.explained && agrees(scene)
        })
        .collect();
    for number in more {
        scenes[number].explained = true;
        let scene = &scenes[number].scene;
        let acting = found.iter_mut().filter(|cause| cause.change().acts_in(scene));
        acting.for_each(|cause| cause.scenes.push(number));
    }
}

/// The best change, or pair of changes, beside those made; none if nothing is proven.
fn round(
    scenes: &[SceneEvidence<'_>],
    made: &[Change],
    excluded: &[Change],
    time_steps: &[f64],
    tried: &mut Tried<'_>,
) -> Vec<Cause> {
    let mut left: Vec<usize> = (0..scenes.len())
        .filter(|&number| scenes[number].is_suspect() && !scenes[number].explained)
        .collect();
    left.sort_by_key(|&number| scenes[number].simplicity());
    // Scenes of different kinds: two for each set of forces and integrator.
    let mut kinds: Vec<(Vec<&str>, &str)> = Vec::new();
    left.retain(|&number| {
        let scene = &scenes[number].scene;
        let mut tags: Vec<&str> = scene.forces.iter().map(|e| e.schema.tag).collect();
        tags.sort_unstable();
        tags.dedup();
        let kind = (tags, scene.integrator.name);
        let is_new = kinds.iter().filter(|known| **known == kind).count() < 2;
        kinds.push(kind);
        is_new
    });
    for pairs in [false, true] {
        let mut weighed: Vec<Weighed> = Vec::new();
        let mut most = if pairs { TRIED / 2 } else { TRIED };
        for &number in &left {
            // What explains an earlier scene need not be found again.
            if weighed.iter().any(|known| known.explained.contains(&number)) {
                continue;
            }
            let scene = &scenes[number];
            let acting = made.iter().filter(|change| change.acts_in(&scene.scene)).count();
            let size = scene.scene.particles.len() * scene.scene.dimension.count();
            let cost = cost(scene.scene.integrator, size, pairs);
            let is_over = *tried.spent + cost > CEILING;
            if most == 0 || is_over || tried.scenes.get(&(number, pairs)) == Some(&acting) {
                continue;
            }
            most -= 1;
            *tried.spent += cost;
            let mut survivors: Vec<Vec<Change>> = match pairs {
                false => {
                    let found = survivors(scene, made, time_steps);
                    found.into_iter().map(|change| vec![change]).collect()
                }
                true => {
                    let mut found = with_rules(scene, made);
                    found.extend(pairs_of(scene, made));
                    found
                }
            };
            survivors.retain(|changes| !changes.iter().any(|change| excluded.contains(change)));
            let first = |changes: &Vec<Change>| weigh(scenes, made, changes.clone(), true);
            let mut found: Vec<Weighed> =
                few_of_each_place(survivors).par_iter().filter_map(first).collect();
            found.sort_by_key(|one| (std::cmp::Reverse(one.score()), one.rank()));
            keep_best(&mut found);
            let fully = |one: Weighed| weigh(scenes, made, one.changes, false);
            let found: Vec<Weighed> = found.into_par_iter().filter_map(fully).collect();
            if found.is_empty() {
                tried.scenes.insert((number, pairs), acting);
            }
            weighed.extend(found);
        }
        let chosen = choose(scenes, made, weighed);
        if !chosen.is_empty() {
            return chosen;
        }
    }
    Vec::new()
}

/// What was tried in a search.
struct Tried<'a> {
    /// Scenes that no change explained, or no pair, with the number of changes that acted in them then.
    scenes: &'a mut HashMap<(usize, bool), usize>,
    /// Estimated milliseconds.
    spent: &'a mut u64,
}

/// Estimated milliseconds in which the changes of a scene, or their pairs, are enumerated. Measured on scenes of 6 to 50
/// coordinates: a pair of rules and terms solves a dense system each.
fn cost(integrator: &IntegratorSchema, size: usize, pairs: bool) -> u64 {
    let size = size as u64;
    let is_implicit = integrator.matrix == Matrix::Jacobians;
    let is_newton = matches!(integrator.convergence, Convergence::Update(_));
    match (pairs, is_implicit) {
        (true, true) => 40 * size + size.pow(3) / 10,
        (true, false) => 10 * size,
        (false, _) if is_newton => 30 * size,
        (false, _) => 6 * size,
    }
}

/// Keeps the first of this sorted list, and the first in each other place.
fn keep_best(sorted: &mut Vec<Weighed>) {
    let mut places: BTreeSet<Place> = BTreeSet::new();
    let mut kept = 0;
    sorted.retain(|one| {
        let is_new = places.insert(one.changes[0].place);
        kept += 1;
        kept <= WEIGHED_FULLY || is_new && places.len() <= WEIGHED_FULLY
    });
}

/// Features that are left out: forces whose own scenes show it, and methods in whose place another one steps.
fn lacks(scenes: &[SceneEvidence<'_>], made: &[Change]) -> Vec<Cause> {
    let suspects = || scenes.iter().filter(|scene| scene.is_suspect() && !scene.explained);
    let mut terms: Vec<Term> = Vec::new();
    let mut integrators: Vec<&'static str> = Vec::new();
    let mut changes: Vec<Change> = Vec::new();
    let mut silent: Vec<Change> = Vec::new();
    for scene in suspects() {
        for term in scene.scene.forces.iter().flat_map(|element| Term::of(element.schema)) {
            if !terms.contains(&term) {
                terms.push(term);
                changes.push(candidates::omission(term));
            }
        }
        let name = scene.scene.integrator.name;
        if !integrators.contains(&name) {
            integrators.push(name);
            let lacks = candidates::replacements(&scene.scene).into_iter().filter(is_lack);
            changes.extend(lacks.filter(|change| !is_idle_round(scene, change)));
            silent.push(candidates::integrator_factor(name, Quantity::Force, 0.0));
        }
    }
    let weighed = |changes: Vec<Change>| -> Vec<Weighed> {
        let of = |change: Change| weigh(scenes, made, vec![change], false);
        changes.into_par_iter().filter_map(of).collect()
    };
    // If the force alone is left out, its Jacobians are there.
    changes.retain(|change| {
        let Place::Force(term) = change.place else { return true };
        let explains = |change: Change| {
            weigh(scenes, made, vec![change], false).map_or(0, |one| one.explained.len())
        };
        !term.schema().depends_on().has_jacobian()
            || explains(candidates::factor(term, &[Quantity::Force], 0.0))
                <= explains(change.clone())
    });
    let mut silent = weighed(silent);
    silent.retain(is_in_most);
    changes.retain(|change| !made.contains(change));
    let mut found = weighed(changes);
    found.retain(|one| {
        let is_integrators = silent.iter().any(|other| {
            other.explained.is_superset(&one.explained)
                && one.changes[0].place != other.changes[0].place
        });
        !is_integrators && is_convincing(scenes, one)
    });
    found.sort_by_key(|one| std::cmp::Reverse(one.score()));
    let mut places: Vec<Place> = Vec::new();
    found.retain(|one| {
        let place = one.changes[0].place;
        let is_new = !places.contains(&place);
        places.push(place);
        is_new
    });
    // All together, as one replay shows as much as many.
    let together = Weighed {
        changes: found.iter().flat_map(|one| one.changes.clone()).collect(),
        explained: found.iter().flat_map(|one| one.explained.clone()).collect(),
        unexplained: 0,
        open: 0,
    };
    if found.len() > 1
        && let Some(Weighed { explained: all, .. }) = prove(scenes, made, together)
    {
        let cause = |one: Weighed| Cause {
            alternatives: one.changes,
            rivals: Vec::new(),
            scenes: one.explained.into_iter().filter(|number| all.contains(number)).collect(),
            open: one.open,
            unexplained: Vec::new(),
            group: 0,
        };
        return found.into_iter().map(cause).collect();
    }
    let mut causes: Vec<Cause> = Vec::new();
    for one in found {
        let mut all = made.to_vec();
        all.extend(causes.iter().map(|cause| cause.change().clone()));
        if let Some(Weighed { changes, explained, open, .. }) = prove(scenes, &all, one) {
            let scenes = explained.into_iter().collect();
            let (alternatives, rivals) = (changes, Vec::new());
            causes.push(Cause {
                alternatives,
                rivals,
                scenes,
                open,
                unexplained: Vec::new(),
                group: 0,
            });
        }
    }
    causes
}

/// Whether nothing moves in a scene of rounds. Springs at rest move neither if forces are left out of the rounds.
fn is_idle_round(scene: &SceneEvidence<'_>, change: &Change) -> bool {
    let is_idle = matches!(change.effect, Effect::Method(_, Rule::Idle));
    is_idle && rounds::is_of_rounds(&scene.scene)
}

/// Whether at least two scenes, and nearly all that use no other force, show that a feature is left out. Of a method, at
/// least three, and half of its scenes; that nothing moves under it, nearly all, since a scene at rest shows the same without a force.
fn is_convincing(scenes: &[SceneEvidence<'_>], one: &Weighed) -> bool {
    let Place::Force(term) = one.changes[0].place else {
        let is_idle = matches!(one.changes[0].effect, Effect::Method(_, Rule::Idle));
        let is_enough = one.explained.len() >= one.unexplained;
        return one.explained.len() > 2 && (is_in_most(one) || is_enough && !is_idle);
    };
    let integrators: BTreeSet<&str> =
        one.explained.iter().map(|&number| scenes[number].scene.integrator.name).collect();
    let is_own = |scene: &SceneEvidence<'_>| {
        scene.scene.forces.iter().all(|element| {
            let parts = element.schema.parts.iter();
            element.schema.tag == term.tag
                && parts
                    .filter(|part| element.has_part(part))
                    .all(|part| term.part.is_empty() || part.name == term.part)
        })
    };
    let own = (0..scenes.len()).filter(|&number| {
        let scene = &scenes[number];
        let is_judged = scene.is_suspect() && !scene.explained;
        is_judged && is_own(scene) && integrators.contains(scene.scene.integrator.name)
    });
    let own: Vec<usize> = own.collect();
    let shown = own.iter().filter(|number| one.explained.contains(number)).count();
    one.explained.len() > 1 && 10 * shown >= 9 * own.len()
}

/// Whether it explains nine tenths of the failing scenes in which it acts.
fn is_in_most(one: &Weighed) -> bool {
    one.explained.len() >= 9 * one.unexplained
}

/// The best of these that whole replays prove, with its alternatives.
fn choose(scenes: &[SceneEvidence<'_>], made: &[Change], mut weighed: Vec<Weighed>) -> Vec<Cause> {
    // Stable: of equal ones, the first that was enumerated.
    weighed.sort_by_key(|one| (std::cmp::Reverse(one.score()), one.open, one.rank()));
    let mut best: Option<(Weighed, Vec<Weighed>)> = None;
    let mut rivals: Vec<Change> = Vec::new();
    let mut replayed = 0;
    for one in weighed {
        match &mut best {
            None => {
                if replayed >= REPLAYED {
                    break;
                }
                replayed += 1;
                if let Some(one) = prove(scenes, made, one) {
                    best = Some((one, Vec::new()));
                }
            }
            Some((best, others)) => {
                let ([known], [change]) = (best.changes.as_slice(), one.changes.as_slice()) else {
                    continue;
                };
                let is_new = change != known && !rivals.contains(change);
                if is_new && rivals.len() < RIVALS && !one.explained.is_disjoint(&best.explained) {
                    rivals.push(change.clone());
                }
                // What explains the same scenes, by a change in another place.
                let is_same = one.explained.is_superset(&best.explained);
                let known = || std::iter::once(&*best).chain(others.iter());
                let in_place =
                    known().filter(|known| known.changes[0].place == change.place).count();
                // Of a task, the student should know each change that makes the same positions.
                let [most, most_others] = match is_of_rounds(change) {
                    true => [SYNONYMS, Task::ALL.len()],
                    false => [1, 3],
                };
                let is_other = in_place < most;
                let is_usual = one.rank() <= best.rank() + 2;
                if is_same
                    && is_other
                    && others.len() < most_others
                    && is_usual
                    && let Some(one) = prove(scenes, made, one)
                    && one.explained.is_superset(&best.explained)
                {
                    others.push(one);
                }
            }
        }
    }
    let Some((best, others)) = best else { return Vec::new() };
    let (open, lack) = (best.open, is_lack(&best.changes[0]));
    let together = in_each_jacobian(scenes, made, &best);
    let scenes: Vec<usize> = best.explained.iter().copied().collect();
    let mut causes: Vec<Cause> = best
        .changes
        .into_iter()
        .map(|change| Cause {
            alternatives: vec![change],
            rivals: Vec::new(),
            scenes: scenes.clone(),
            open,
            unexplained: Vec::new(),
            group: 0,
        })
        .collect();
    let is_clear_lack =
        lack && scenes.len() > 2 && !others.iter().any(|one| is_of_rounds(&one.changes[0]));
    if let ([cause], false) = (causes.as_mut_slice(), is_clear_lack) {
        cause.alternatives.extend(others.into_iter().flat_map(|other| other.changes));
        cause.alternatives.extend(together);
        cause.rivals = rivals;
    }
    causes
}

/// If the change is one of a kind of Jacobian in the matrix, and the scenes that it explains have few of that kind: the same
/// change of each of these, in the same words.
fn in_each_jacobian(scenes: &[SceneEvidence<'_>], made: &[Change], best: &Weighed) -> Vec<Change> {
    let [Change { effect: Effect::Method(_, Rule::Matrix(quantity, factor)), .. }] =
        best.changes.as_slice()
    else {
        return Vec::new();
    };
    let explained = best.explained.iter().map(|&number| &scenes[number].scene);
    let mut terms: BTreeSet<Term> = explained.flat_map(super::terms).collect();
    terms.retain(|term| !made.contains(&candidates::omission(*term)));
    let depends = |term: &Term| candidates::groups(*term).contains(&[*quantity].as_slice());
    let terms: Vec<Term> = terms.into_iter().filter(depends).collect();
    if terms.len() < 2 || terms.len() > TOGETHER {
        return Vec::new();
    }
    let changes = candidates::in_each(&terms, *quantity, *factor);
    let explained = best.explained.clone();
    let weighed = Weighed { changes, explained, unexplained: 0, open: 0 };
    let proven = prove(scenes, made, weighed);
    proven.filter(|one| one.explained == best.explained).map_or_else(Vec::new, |one| one.changes)
}

/// Replays whole scenes: the changes must leave alone what passed, and keeps those scenes that they reproduce.
fn prove(scenes: &[SceneEvidence<'_>], made: &[Change], weighed: Weighed) -> Option<Weighed> {
    let all: Vec<Change> = made.iter().chain(&weighed.changes).cloned().collect();
    let must_act = |scene: &Scene| weighed.changes.iter().any(|change| change.must_act_in(scene));
    let mut n_passed = 0;
    let mut wanted: Vec<usize> = (0..scenes.len())
        .filter(|&number| {
            let scene = &scenes[number];
            let is_explained = weighed.explained.contains(&number);
            let wanted = scene.is_settled() && must_act(&scene.scene) || is_explained;
            wanted && scene.judged.states.len() > 1
        })
        .collect();
    wanted.sort_by_key(|&number| scenes[number].simplicity());
    wanted.retain(|&number| {
        let is_other = !weighed.explained.contains(&number);
        n_passed += usize::from(is_other);
        !is_other || n_passed <= PASSED
    });
    let judged: Vec<(usize, Agreement)> =
        wanted.into_par_iter().map(|number| (number, scenes[number].replay(&all))).collect();
    let contradicts = |(number, agreement): &(usize, Agreement)| {
        let scene = &scenes[*number];
        *agreement == Agreement::Differs && scene.is_settled()
    };
    if judged.iter().any(contradicts) {
        return None;
    }
    let explained: BTreeSet<usize> = judged
        .iter()
        .filter(|(number, agreement)| {
            *agreement == Agreement::Agrees && weighed.explained.contains(number)
        })
        .map(|(number, _)| *number)
        .collect();
    // A replay that fails in most scenes is none.
    let is_most = 10 * explained.len() >= 9 * weighed.explained.len();
    // A force of one scene has no second that could confirm it.
    let has_one_scene = |change: &Change| match change.place {
        Place::Force(term) | Place::Jacobian(term) => {
            let has = |scene: &&SceneEvidence<'_>| super::terms(&scene.scene).contains(&term);
            scenes.iter().filter(has).count() == 1
        }
        _ => false,
    };
    let is_enough = match explained.len() {
        0 => false,
        1 => scenes.len() < SMALL || weighed.changes.iter().all(has_one_scene),
        _ => true,
    };
    let enough = is_most && is_enough;
    enough.then_some(Weighed { explained, ..weighed })
}

/// Compares changes with the samples of all scenes; `None` if a scene contradicts them.
fn weigh(
    scenes: &[SceneEvidence<'_>],
    made: &[Change],
    changes: Vec<Change>,
    is_probe: bool,
) -> Option<Weighed> {
    let all: Vec<Change> = made.iter().chain(&changes).cloned().collect();
    let mut weighed = Weighed { changes, explained: BTreeSet::new(), unexplained: 0, open: 0 };
    let concerned = scenes.iter().enumerate().filter(|(_, scene)| {
        let acts = weighed.changes.iter().any(|change| change.acts_in(&scene.scene));
        acts && !scene.evidence.is_empty() && (scene.passed || scene.is_suspect())
    });
    let concerned: Vec<(usize, &SceneEvidence<'_>)> = concerned.collect();
    let (stride, samples) = match is_probe {
        true => (concerned.len().div_ceil(PROBED).max(1), 1),
        false => (1, usize::MAX),
    };
    for (number, scene) in concerned.into_iter().step_by(stride) {
        let model = Model::new(&scene.scene, &all);
        if !model.can_step() || !weighed.changes.iter().any(|change| model.is_changed_by(change)) {
            continue;
        }
        let must_act = weighed.changes.iter().any(|change| change.must_act_in(&scene.scene));
        match (scene.agrees_with(&model, samples), scene.is_settled()) {
            (Agreement::Differs, _) if !must_act => {}
            (Agreement::Differs, true) => return None,
            (Agreement::Agrees, false) if !scene.explained => {
                weighed.explained.insert(number);
            }
            (Agreement::Open, false) if !scene.explained => weighed.open += 1,
            (Agreement::Differs, false) if !scene.explained => weighed.unexplained += 1,
            _ => {}
        }
    }
    // Something moves: then not nothing moves.
    let is_idle = |change: &Change| matches!(change.effect, Effect::Method(_, Rule::Idle));
    if weighed.changes.iter().any(is_idle) && 9 * weighed.unexplained > weighed.explained.len() {
        return None;
    }
    (is_probe || !weighed.explained.is_empty()).then_some(weighed)
}

/// The first few changes of each place.
fn few_of_each_place(changes: Vec<Vec<Change>>) -> Vec<Vec<Change>> {
    let mut counts: HashMap<Vec<Place>, usize> = HashMap::new();
    let mut kept = changes;
    let mut all = 0;
    kept.retain(|changes| {
        // Small scenes hardly distinguish the changes of rounds.
        if changes.iter().all(is_of_rounds) {
            return true;
        }
        let places: Vec<Place> = changes.iter().map(|change| change.place).collect();
        let count = counts.entry(places).or_default();
        *count += 1;
        all += usize::from(*count <= WEIGHED_OF_PLACE);
        *count <= WEIGHED_OF_PLACE && all <= WEIGHED
    });
    kept
}

/// The single changes that make the sampled steps of a scene, the most usual first.
fn survivors(scene: &SceneEvidence<'_>, made: &[Change], time_steps: &[f64]) -> Vec<Change> {
    let inner = &scene.scene;
    let model = Model::new(inner, made);
    let samples = clear_samples(scene);
    if samples.is_empty() {
        return Vec::new();
    }
    let name = inner.integrator.name;
    let mut found = in_terms(&model, name, &samples);
    let mut whole: Vec<Change> = candidates::replacements(inner);
    whole.extend(candidates::of_integrator(inner));
    whole.extend(candidates::of_fixed(inner));
    whole.extend(candidates::of_reading(inner, time_steps));
    whole.extend(candidates::of_process(inner));
    whole.extend(round_changes::of_rounds(inner));
    whole.extend(fit::of_rules(scene, made, &samples, |_| true));
    let by_steps = whole.par_iter().filter(|change| {
        let all: Vec<Change> = made.iter().chain([*change]).cloned().collect();
        let model = Model::new(inner, &all);
        scene.agrees_with(&model, usize::MAX) == Agreement::Agrees
    });
    let by_steps: Vec<Change> = by_steps.cloned().collect();
    found.extend(by_steps);
    if found.is_empty() {
        found.extend(fit::between(scene, made, &samples));
        found.extend(numbered_in_terms(&model, &samples));
    }
    if found.is_empty() {
        found = in_jacobians_of_newton(scene, made);
    }
    found.retain(|change| !is_accidental(change, inner.time_step));
    found.sort_by_key(|change| change.rank);
    found
}

/// Whether the number of a change is that of one scene, a power of its time step, or next to nothing: a change without a
/// number says the same of all scenes, if that is the mistake.
fn is_accidental(change: &Change, time_step: f64) -> bool {
    let Some(number) = change.effect.number() else { return false };
    let is_near = |power: i32| {
        let known = time_step.powi(power);
        (number.abs() - known).abs() <= ACCIDENTAL * known
    };
    number != 0.0 && number.abs() < TINY || [-2, -1, 1, 2].into_iter().any(is_near)
}

/// Wrong steps whose defect is far above the noise.
fn clear_samples<'a>(scene: &'a SceneEvidence<'_>) -> Vec<&'a Evidence> {
    let clear = scene.evidence.iter().filter(|evidence| {
        let far = |kind: usize| evidence.defect[kind] > CLEAR * evidence.noise[kind];
        evidence.is_wrong() && (far(0) || far(1))
    });
    clear.take(FIRST).collect()
}

/// A change of the integrator's rules, or of fixed particles, with one of a term.
fn with_rules(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let inner = &scene.scene;
    let samples = clear_samples(scene);
    let mut rules = candidates::of_integrator(inner);
    rules.extend(candidates::of_fixed(inner));
    rules.extend(fit::of_rules(scene, made, &samples, Numbered::moves));
    let of = |rule: &Change| -> Vec<Vec<Change>> {
        let with: Vec<Change> = made.iter().chain([rule]).cloned().collect();
        let model = Model::new(inner, &with);
        let found = in_terms(&model, inner.integrator.name, &samples).into_iter();
        found.map(|change| vec![rule.clone(), change]).collect()
    };
    let mut all: Vec<Vec<Change>> = rules.par_iter().flat_map_iter(of).collect();
    all.sort_by_key(|changes| changes.iter().map(|change| u32::from(change.rank)).sum::<u32>());
    all
}

/// Changes of one term's value, or of the sum of all terms, that cancel the residual.
fn in_terms(model: &Model, integrator: &'static str, samples: &[&Evidence]) -> Vec<Change> {
    let Some(base) = Base::of(model, samples) else { return Vec::new() };
    let mut found = Vec::new();
    for number in 0..model.n_terms() {
        let term = model.term(number);
        let fits = candidates::of_term(term).par_iter().filter(|change| base.is_cancelled(change));
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
fn numbered_in_terms(model: &Model, samples: &[&Evidence]) -> Vec<Change> {
    let is_large = |evidence: &&Evidence| evidence.sample.before.positions.len() > NUMBERED;
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
struct Base<'a> {
    model: &'a Model,
    samples: &'a [&'a Evidence],
    /// For each sample, the residual and its bound.
    residuals: Vec<(Vec<f64>, f64)>,
}

impl<'a> Base<'a> {
    /// `None` where positions or fixed particles are wrong: no term is to blame then.
    fn of(model: &'a Model, samples: &'a [&'a Evidence]) -> Option<Self> {
        let mut residuals = Vec::new();
        for evidence in samples {
            let residual = model.residual(&evidence.sample)?;
            let [x, v] = evidence.noise;
            let is_on_rule = residual.position.iter().all(|left| left.abs() <= LEFT * x);
            if !is_on_rule || model.moves_fixed(&evidence.sample, LEFT * v) {
                return None;
            }
            residuals.push((residual.momentum, LEFT * v * residual.stiffness));
        }
        Some(Self { model, samples, residuals })
    }

    fn is_cancelled(&self, change: &Change) -> bool {
        self.samples.iter().zip(&self.residuals).all(|(evidence, (residual, bound))| {
            let Some((_, effect)) = self.model.effect(change, &evidence.sample) else {
                return false;
            };
            effect
                .iter()
                .zip(residual)
                .all(|(effect, residual)| (residual + effect).abs() <= *bound)
        })
    }

    /// The number with which a changed force cancels the residual, if there is one.
    fn numbered(&self, force: &NumberedForce) -> Option<Change> {
        let (evidence, (residual, _)) = self.samples.iter().zip(&self.residuals).next()?;
        let along = |number: f64| -> Option<f64> {
            let (_, effect) = self.model.effect(&force.with(number), &evidence.sample)?;
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
        let value = |evidence: &&Evidence| -> Option<Vec<f64>> {
            let (_, effect) = self.model.effect(&left_out, &evidence.sample)?;
            Some(effect.into_iter().map(|effect| -effect).collect())
        };
        let values = self.samples.iter().map(value).collect::<Option<Vec<_>>>()?;
        self.fitted(&values).map(make)
    }

    /// The factor of some quantities of some terms that cancels the residual, if there is one.
    fn factor(
        &self,
        terms: &[usize],
        quantities: &[Quantity],
        make: &dyn Fn(f64) -> Change,
    ) -> Option<Change> {
        let value = |evidence: &Evidence| {
            let mut sum = vec![0.0; self.residuals[0].0.len()];
            for (term, quantity) in
                terms.iter().flat_map(|term| quantities.iter().map(move |q| (*term, *q)))
            {
                let value = self.model.contribution(term, quantity, &evidence.sample);
                sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
            }
            sum
        };
        let values: Vec<Vec<f64>> = self.samples.iter().map(|evidence| value(evidence)).collect();
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

/// Jacobians that only the end of Newton's method shows: implicit Euler converges elsewhere with them.
fn in_jacobians_of_newton(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Change> {
    let inner = &scene.scene;
    if reference::method::Method::one_point(inner.integrator)
        != Some(reference::method::OnePoint::Implicit)
    {
        return Vec::new();
    }
    let model = Model::new(inner, made);
    let terms = (0..model.n_terms()).map(|number| model.term(number));
    let all: Vec<&Change> = terms
        .flat_map(candidates::of_term)
        .filter(|change| matches!(change.place, Place::Jacobian(_)) && change.rank < 2)
        .collect();
    let fits = all.into_par_iter().filter(|change| {
        let all: Vec<Change> = made.iter().chain([*change]).cloned().collect();
        scene.agrees_with(&Model::new(inner, &all), usize::MAX) == Agreement::Agrees
    });
    fits.cloned().collect()
}

/// Pairs of changes of different values that together cancel the residual.
fn pairs_of(scene: &SceneEvidence<'_>, made: &[Change]) -> Vec<Vec<Change>> {
    let inner = &scene.scene;
    let model = Model::new(inner, made);
    let samples = clear_samples(scene);
    let Some(base) = Base::of(&model, &samples) else { return Vec::new() };
    let all: Vec<&Change> = (0..model.n_terms())
        .flat_map(|number| candidates::of_term(model.term(number)))
        .filter(|change| change.rank < 3)
        .collect();
    // Effects on all samples, in units of their bounds.
    let effect = |change: &&'static Change| -> Option<(&'static Change, Vec<f64>)> {
        let mut whole = Vec::new();
        for (evidence, (_, bound)) in samples.iter().zip(&base.residuals) {
            let (_, effect) = model.effect(change, &evidence.sample)?;
            whole.extend(effect.into_iter().map(|value| value / bound));
        }
        let is_there = whole.iter().any(|value| value.abs() > 1.0);
        (is_there && whole.iter().all(|value| value.is_finite())).then_some((*change, whole))
    };
    let effects: Vec<(&Change, Vec<f64>)> = all.par_iter().filter_map(effect).collect();
    let residual: Vec<f64> = base
        .residuals
        .iter()
        .flat_map(|(residual, bound)| {
            residual.iter().map(|value| value / *bound).collect::<Vec<_>>()
        })
        .collect();
    if effects.is_empty() || residual.is_empty() {
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

/// The value that a change is made in: two changes of one value do not add up.
fn value_of(change: &Change) -> Option<(Term, Quantity)> {
    match &change.effect {
        Effect::Formula(term, quantity, _)
        | Effect::Blocks(term, quantity, _)
        | Effect::Axes(term, quantity, _)
        | Effect::Particles(term, quantity, _) => Some((*term, *quantity)),
        Effect::Factor(term, quantities, Factor { .. }) => Some((*term, quantities[0])),
        Effect::Derived(term, _) | Effect::Ends(term, _) | Effect::Length(term, _) => {
            Some((*term, Quantity::Force))
        }
        Effect::Method(..) | Effect::Fixed(_) | Effect::Scene(_) | Effect::Rounds(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_changes_in_a_large_net_do_not_fit_into_a_search() {
        let linearized = simulator::vocabulary().integrator("linearized-implicit-euler");
        let linearized = linearized.expect("an integrator of the registry");
        let all = |size: usize, pairs: bool, count: u64| count * cost(linearized, size, pairs);
        assert!(all(50, true, 1) > CEILING);
        // The largest net alone, and pairs in the scenes of few particles that most mistakes show in.
        assert!(all(50, false, TRIED as u64) < CEILING);
        assert!(all(8, true, TRIED as u64) < CEILING);
    }
}
