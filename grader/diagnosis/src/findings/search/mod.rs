//! Search for the changes of a right simulator that make a submission's steps.
//!
//! ```text
//! simplest failing scene ── every change of its terms, integrator, … ── those that make its sampled steps   residuals.rs
//!                        ── do they make those of other scenes, and leave alone the scenes that passed?     weigh.rs
//!                        ── the one that explains most; whole scenes replayed ── made; then the scenes that are left
//! ```
//!
//! A function of the scenes, of what is known of them already, and of the [`Thresholds`]: the same input has the same causes
//! on every machine. A choice between changes that explain the same is made again once another cause is known.

mod gates;
mod matrix;
mod residuals;
mod weigh;

use std::collections::{BTreeSet, HashMap};

use crate::change::candidates;
use crate::change::gate::Measure;
use crate::change::{
    Change, Effect, Ends, Memory, Model, Place, Quantity, Rule, SceneRule, Term, Which,
};
use rayon::prelude::*;
use scene::Scene;
use scene::schema::{Convergence, IntegratorSchema, Matrix};

use super::evidence::{Agreement, Marked};
use super::form::Kind;
use super::judged::Outcome;
use super::thresholds::Thresholds;
use super::trace::is_large;
use residuals::{
    of_linearized, pairs_of, pairs_of_rules, survivors, with_matrices, with_positions,
    with_reading, with_rules, within_terms,
};
use weigh::Weighed;

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
    /// Causes of one number were found together, and hold only together.
    group: usize,
}

impl Cause {
    /// One that explains these scenes, and not those.
    pub(super) fn of_scenes(change: Change, scenes: Vec<usize>, unexplained: Vec<usize>) -> Self {
        let (alternatives, rivals) = (vec![change], Vec::new());
        Self { alternatives, rivals, scenes, open: 0, unexplained, group: 0 }
    }

    pub(super) fn change(&self) -> &Change {
        &self.alternatives[0]
    }

    /// The alternatives in words, each once.
    pub(super) fn words(&self) -> Vec<String> {
        let mut words: Vec<String> =
            self.alternatives.iter().map(|change| change.words.clone()).collect();
        words.dedup();
        words
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

/// Parts of the work that is left which the changes of one scene may take: a small one first, as they may be found in less
/// work in other scenes.
const PARTS: [u64; 2] = [4, 1];

/// The scenes whose changes, or pairs of them, are enumerated.
#[derive(Default)]
struct Seen {
    scenes: BTreeSet<(usize, bool)>,
    /// Those among them that needed more work than was allowed.
    cut: BTreeSet<(usize, bool)>,
    /// The work that is left is divided by this for each.
    part: u64,
}

impl Seen {
    /// Allows this part of the work that is left, also to those that needed more before.
    fn allow(&mut self, part: u64) {
        self.part = part;
        for one in std::mem::take(&mut self.cut) {
            self.scenes.remove(&one);
        }
    }
}

/// The result of a search.
pub(super) struct Assignment<'a> {
    /// The scenes, with what is known of them.
    pub(super) scenes: Vec<Marked<'a>>,
    /// The causes of their wrong steps, in the order in which they were found.
    pub(super) causes: Vec<Cause>,
}

/// Finds the causes of the wrong steps of these scenes.
///
/// Where mistakes explain fewer scenes than they leave wrong, the search is repeated without them. The result that explains
/// more scenes counts, if it has at most as many mistakes or more scenes for each.
pub(super) fn causes<'a>(scenes: &[Marked<'a>], limits: &'a Thresholds) -> Assignment<'a> {
    let mut best = Search::new(scenes, limits);
    best.run();
    for _ in 0..limits.retries {
        let is_doubtful =
            |cause: &&Cause| !cause.is_lack() && cause.unexplained.len() > cause.scenes.len();
        let doubtful = best.found.iter().filter(is_doubtful);
        let doubtful: Vec<Change> = doubtful.flat_map(|cause| cause.alternatives.clone()).collect();
        if doubtful.is_empty() {
            break;
        }
        let mut other = Search::new(scenes, limits);
        other.excluded = [best.excluded.as_slice(), &doubtful].concat();
        other.run();
        let [(scenes, mistakes), (known, by)] =
            [&other, &best].map(|search| (search.n_explained(), search.n_mistakes()));
        if scenes <= known || mistakes > by && scenes * by <= known * mistakes {
            break;
        }
        best = other;
    }
    for scene in &mut best.scenes {
        scene.is_set_aside = false;
    }
    best.explain_more();
    best.drop_all(Search::is_unlikely);
    best.drop_alternatives();
    let Search { scenes, found: mut causes, .. } = best;
    for cause in &mut causes {
        // Only a matrix of Jacobians shows them.
        if !cause.scenes.iter().any(|&number| super::is_linearized(&scenes[number])) {
            cause.alternatives.iter_mut().for_each(candidates::say_force_alone);
        }
    }
    Assignment { scenes, causes }
}

/// A search: what is known of each scene, and the causes found so far.
struct Search<'a> {
    limits: &'a Thresholds,
    scenes: Vec<Marked<'a>>,
    found: Vec<Cause>,
    /// Changes that are not looked for.
    excluded: Vec<Change>,
    /// Scenes that no change explained, or no pair, with the number of changes that acted in them then.
    tried: HashMap<(usize, bool), usize>,
    /// Time steps that a program may have in place of a scene's.
    time_steps: Vec<f64>,
}

impl<'a> Search<'a> {
    fn new(scenes: &[Marked<'a>], limits: &'a Thresholds) -> Self {
        let mut time_steps =
            vec![0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 1.0 / 60.0, 1.0 / 30.0, 1.0];
        time_steps.extend(scenes.iter().map(|scene| scene.scene.time_step));
        time_steps.sort_by(f64::total_cmp);
        time_steps.dedup();
        let mut scenes = scenes.to_vec();
        for scene in &mut scenes {
            scene.is_set_aside = is_large(&scene.scene);
        }
        Self {
            limits,
            scenes,
            found: Vec::new(),
            excluded: Vec::new(),
            tried: HashMap::new(),
            time_steps,
        }
    }

    /// Milliseconds of its ceiling that are left, by what is counted.
    fn remaining(&self) -> u64 {
        let spent: u64 = self.scenes.iter().map(|scene| scene.work.nanoseconds()).sum();
        self.limits.ceiling.saturating_sub(spent / 1_000_000)
    }

    fn n_mistakes(&self) -> usize {
        self.found.iter().filter(|cause| !cause.is_lack()).count()
    }

    fn n_explained(&self) -> usize {
        self.scenes.iter().filter(|scene| scene.explained).count()
    }

    fn made(&self) -> Vec<Change> {
        self.found.iter().map(|cause| cause.change().clone()).collect()
    }

    /// Adds causes until nothing more is proven. Each explains a scene that none before it does.
    fn run(&mut self) {
        let mut n_groups = 0;
        for _ in 0..self.scenes.len() {
            let made = self.made();
            let full = self.n_mistakes() >= self.limits.mistakes;
            let mut next = self.lacks(&made, false);
            if next.is_empty() {
                next = self.matrices_of_newton(&made);
            }
            if next.is_empty() {
                next = self.round(&made);
            }
            if next.is_empty() {
                next = self.lacks(&made, true);
            }
            next.retain(|cause| !full || cause.is_lack());
            if next.is_empty() && self.merge_in_matrix() {
                continue;
            }
            if next.is_empty() {
                break;
            }
            let is_joint = next.iter().all(|cause| cause.scenes == next[0].scenes);
            n_groups += 1;
            for cause in next {
                for &number in &cause.scenes {
                    self.scenes[number].explained = true;
                }
                n_groups += usize::from(!is_joint);
                self.found.push(Cause { group: n_groups, ..cause });
            }
            self.explain_more();
            if self.prefer_rivals() {
                self.found.retain(|cause| !cause.scenes.is_empty());
                self.explain_more();
            }
            self.exclude_accidents();
        }
        self.mark_open();
        self.drop_all(Self::is_refuted);
        // A later cause may have taken scenes from one, and not from its rival.
        if self.prefer_rivals() {
            self.settle();
        }
    }

    /// Mistakes of a linearized method that Newton's method has as well, alone or with an end.
    fn matrices_of_newton(&self, made: &[Change]) -> Vec<Cause> {
        let has_it =
            |scene: &&Marked<'_>| scene.is_left() && !of_linearized(scene, made).is_empty();
        let mut left: Vec<&Marked<'_>> = self.scenes.iter().filter(has_it).collect();
        left.sort_by_key(|scene| scene.simplicity());
        left.truncate(self.limits.tried);
        let of_each = left.par_iter().map(|scene| with_matrices(scene, made));
        let mut found: Vec<Vec<Change>> = Vec::new();
        for changes in of_each.collect::<Vec<_>>().into_iter().flatten() {
            let is_excluded = changes.iter().any(|change| self.excluded.contains(change));
            if !is_excluded && !found.contains(&changes) {
                found.push(changes);
            }
        }
        let weighed = self.weigh_all(made, found);
        self.choose(made, weighed)
    }

    /// The best change, or pair of changes, to add to those made; none if nothing is proven.
    fn round(&mut self, made: &[Change]) -> Vec<Cause> {
        let scenes = &self.scenes;
        let is_left = |number: &usize| {
            let scene = &scenes[*number];
            scene.is_suspect() && !scene.explained && !shows_nothing(scene, made)
        };
        let mut left: Vec<usize> = (0..scenes.len()).into_par_iter().filter(is_left).collect();
        left.sort_by_key(|&number| self.scenes[number].simplicity());
        // Scenes of different kinds: two for each set of forces and integrator.
        let mut kinds: Vec<(Vec<&str>, &str)> = Vec::new();
        left.retain(|&number| {
            let scene = &self.scenes[number].scene;
            let mut tags: Vec<&str> = scene.forces.iter().map(|e| e.schema.tag).collect();
            tags.sort_unstable();
            tags.dedup();
            let kind = (tags, scene.integrator.name);
            let is_new = kinds.iter().filter(|known| **known == kind).count() < 2;
            kinds.push(kind);
            is_new
        });
        let left = self.covering(left);
        let mut gates = gates::Known::default();
        let [mut seen, mut beside] = [Seen::default(), Seen::default()];
        for part in PARTS {
            seen.allow(part);
            beside.allow(part);
            loop {
                let n_before = seen.scenes.len();
                for pairs in [false, true] {
                    let weighed = self.enumerate(made, &left, pairs, &mut seen, &mut gates);
                    let chosen = self.choose(made, weighed);
                    if !chosen.is_empty() {
                        return chosen;
                    }
                    if !pairs {
                        let chosen = self.beside_alternatives(&left, &mut beside);
                        if !chosen.is_empty() {
                            return chosen;
                        }
                    }
                }
                if seen.scenes.len() == n_before {
                    break;
                }
            }
        }
        Vec::new()
    }

    /// The best change in other scenes of a cause's methods, in which an alternative of it acts and it does not: the cause is the
    /// alternative then.
    fn beside_alternatives(&mut self, left: &[usize], seen: &mut Seen) -> Vec<Cause> {
        for number in 0..self.found.len() {
            let change = self.found[number].change().clone();
            let methods = self.methods(&self.found[number]);
            for alternative in self.found[number].alternatives.split_off(1) {
                let acts_alone = |scene: &Scene| {
                    methods.contains(scene.integrator.name)
                        && alternative.must_act_in(scene)
                        && !change.acts_in(scene)
                };
                let scenes = left.iter().copied();
                let scenes = scenes.filter(|one| acts_alone(&self.scenes[*one].scene));
                let scenes: Vec<usize> = scenes.collect();
                let mut made = self.made();
                made[number] = alternative.clone();
                let mut gates = gates::Known::default();
                let weighed = self.enumerate(&made, &scenes, false, seen, &mut gates);
                let chosen = self.choose(&made, weighed);
                if !chosen.is_empty() {
                    self.found[number].alternatives = vec![alternative];
                    return chosen;
                }
                self.found[number].alternatives.push(alternative);
            }
        }
        Vec::new()
    }

    /// These scenes, those first that have a term under a method, or fixed particles under it, that no scene before has.
    fn covering(&self, scenes: Vec<usize>) -> Vec<usize> {
        let mut known: BTreeSet<(&str, Option<Term>)> = BTreeSet::new();
        let (mut first, mut others) = (Vec::new(), Vec::new());
        for number in scenes {
            let scene = &self.scenes[number].scene;
            let name = scene.integrator.name;
            let has_fixed = scene.particles.iter().any(|particle| particle.fixed);
            let mut is_new = has_fixed && known.insert((name, None));
            for term in super::terms(scene) {
                is_new |= known.insert((name, Some(term)));
            }
            if is_new { first.push(number) } else { others.push(number) }
        }
        first.extend(others);
        first
    }

    /// Changes, or pairs of them, that make the steps of some of these scenes that are not seen yet, with what they explain.
    fn enumerate(
        &mut self,
        made: &[Change],
        left: &[usize],
        pairs: bool,
        seen: &mut Seen,
        gates: &mut gates::Known,
    ) -> Vec<Weighed> {
        let mut weighed: Vec<Weighed> = Vec::new();
        let mut most = if pairs { self.limits.tried / 2 } else { self.limits.tried };
        for &number in left {
            // A scene that a known change explains is not searched.
            if weighed.iter().any(|known| known.explained.contains(&number)) {
                continue;
            }
            let scene = self.scenes[number];
            let model = scene.model(made);
            let acts =
                |change: &&Change| change.acts_in(&scene.scene) && model.is_changed_by(change);
            let acting = made.iter().filter(acts).count();
            let size = scene.scene.particles.len() * scene.scene.dimension.count();
            let allowed = self.remaining() / seen.part;
            let is_known = self.tried.get(&(number, pairs)) == Some(&acting);
            let needed = estimated(scene.scene.integrator, size, pairs);
            if most == 0 || needed > allowed || is_known || !seen.scenes.insert((number, pairs)) {
                continue;
            }
            most -= 1;
            scene.work.allow(allowed);
            let mut survivors: Vec<Vec<Change>> = match pairs {
                false => {
                    let mut found = survivors(&scene, made, &self.time_steps);
                    let all = &self.scenes;
                    found.extend(gates::of_scene(number, all, made, gates, self.limits));
                    found.sort_by_key(|change| change.rank);
                    found.into_iter().map(|change| vec![change]).collect()
                }
                true => {
                    let mut found = with_rules(&scene, made);
                    found.extend(pairs_of(&scene, made));
                    found.extend(within_terms(&scene, made));
                    if found.is_empty() {
                        found = with_positions(&scene, made, &self.time_steps);
                    }
                    if found.is_empty() {
                        found = with_reading(&scene, made);
                        found.extend(pairs_of_rules(&scene, made));
                        found.extend(gates::with_rules(number, &self.scenes, made, self.limits));
                    }
                    found
                }
            };
            // A partial enumeration may lack the right change.
            if scene.work.is_over() {
                seen.cut.insert((number, pairs));
                continue;
            }
            let is_excluded = |change: &Change| self.excluded.contains(change);
            survivors.retain(|changes| !changes.iter().any(is_excluded));
            let found = self.weigh_all(made, survivors);
            if found.is_empty() {
                self.tried.insert((number, pairs), acting);
            }
            weighed.extend(found);
        }
        weighed
    }

    /// Gives each wrong scene that all causes together make to those that act in it, and to no other: a cause proven
    /// together with one that is gone is proven again. A cause without a scene goes, and so do those that hold only with it.
    fn settle(&mut self) {
        loop {
            for cause in &mut self.found {
                for number in cause.scenes.drain(..) {
                    self.scenes[number].explained = false;
                }
            }
            self.explain_more();
            if let Some(unneeded) = self.attribute() {
                for number in self.found.remove(unneeded).scenes {
                    self.scenes[number].explained = false;
                }
                continue;
            }
            let gone = self.found.iter().filter(|cause| cause.scenes.is_empty());
            let gone: BTreeSet<usize> = gone.map(|cause| cause.group).collect();
            if gone.is_empty() {
                break;
            }
            self.found.retain(|cause| !gone.contains(&cause.group));
        }
        self.mark_open();
        let made = self.made();
        let scenes = &self.scenes;
        let is_slow = |number: &usize| {
            let scene = &scenes[*number];
            scene.is_suspect() && !scene.explained && shows_nothing(scene, &made)
        };
        let slow: Vec<usize> = (0..scenes.len()).into_par_iter().filter(is_slow).collect();
        for cause in &mut self.found {
            let change = cause.change().clone();
            let acts = |number: &usize| change.must_act_in(&scenes[*number].scene);
            let is_left = |scene: &Marked<'_>| scene.is_left() || scene.fails_at_once();
            let left = (0..scenes.len()).filter(|&number| is_left(&scenes[number]));
            cause.unexplained = left.filter(acts).collect();
            cause.open = slow.iter().filter(|number| acts(number)).count();
        }
    }

    /// Gives each explained scene to the causes without which its steps are not made: several, where they act together. Returns
    /// the place of the last cause that no scene needs in addition to the others.
    fn attribute(&mut self) -> Option<usize> {
        let made = self.made();
        let scenes = &self.scenes;
        let explained: BTreeSet<usize> =
            self.found.iter().flat_map(|cause| cause.scenes.iter().copied()).collect();
        let needed = |number: usize| -> Vec<usize> {
            let scene = &scenes[number];
            let model = scene.model(&made);
            let acting: Vec<usize> = (0..made.len())
                .filter(|&one| made[one].acts_in(&scene.scene) && model.is_changed_by(&made[one]))
                .collect();
            let is_needed = |one: &usize| {
                let others = acting.iter().filter(|other| *other != one);
                let others: Vec<Change> = others.map(|&other| made[other].clone()).collect();
                let model = scene.model(&others);
                !model.can_step() || scene.agrees_with(&model, usize::MAX) != Agreement::Agrees
            };
            match acting.as_slice() {
                [_] => acting,
                _ => acting.iter().copied().filter(is_needed).collect(),
            }
        };
        let of_scenes: Vec<(usize, Vec<usize>)> =
            explained.into_par_iter().map(|number| (number, needed(number))).collect();
        let mut unneeded = None;
        for (one, cause) in self.found.iter_mut().enumerate() {
            let is_its = |(number, causes): &&(usize, Vec<usize>)| match causes.is_empty() {
                true => cause.scenes.contains(number),
                false => causes.contains(&one),
            };
            let of_it: Vec<usize> =
                of_scenes.iter().filter(is_its).map(|(number, _)| *number).collect();
            if of_it.is_empty() && !cause.scenes.is_empty() {
                unneeded = Some(one);
            } else {
                cause.scenes = of_it;
            }
        }
        unneeded
    }

    /// Replaces causes by their rivals, where these explain more scenes with the other causes. Returns whether it did.
    fn prefer_rivals(&mut self) -> bool {
        let mut is_changed = false;
        for number in 0..self.found.len() {
            let others = self.found.iter().enumerate().filter(|(other, _)| *other != number);
            let made: Vec<Change> = others.map(|(_, cause)| cause.change().clone()).collect();
            let cause = &self.found[number];
            let better = |rival: &Change| {
                let all = [made.as_slice(), std::slice::from_ref(rival)].concat();
                let explains = |scene: &Marked<'_>| {
                    let model = scene.model(&all);
                    model.can_step() && scene.agrees_with(&model, usize::MAX) == Agreement::Agrees
                };
                let mut left = self.scenes.iter().filter(|scene| scene.is_left());
                if !left.any(|scene| rival.acts_in(&scene.scene) && explains(scene)) {
                    return None;
                }
                let weighed = self.weigh(&made, vec![rival.clone()], false)?;
                let Weighed { changes, explained, .. } = self.prove(&made, weighed)?;
                let is_still =
                    |scene: &&usize| self.scenes[**scene].replay(&all) == Agreement::Agrees;
                let mut still: BTreeSet<usize> =
                    cause.scenes.par_iter().filter(is_still).copied().collect();
                still.extend(explained);
                (still.len() > cause.scenes.len()).then_some((changes, still))
            };
            let mut rivals = cause.rivals.iter().chain(&cause.alternatives[1..]);
            let Some((changes, explained)) = rivals.find_map(better) else { continue };
            let before = std::mem::take(&mut self.found[number].scenes);
            for scene in before.into_iter().chain(explained.iter().copied()) {
                self.scenes[scene].explained = explained.contains(&scene);
            }
            for cause in &mut self.found {
                cause.scenes.retain(|&scene| self.scenes[scene].explained);
            }
            let cause = &mut self.found[number];
            cause.rivals.retain(|rival| !changes.contains(rival));
            cause.alternatives = changes;
            cause.scenes = explained.into_iter().collect();
            is_changed = true;
        }
        is_changed
    }

    /// Marks the scenes that show nothing more with the changes found.
    fn mark_open(&mut self) {
        let made = self.made();
        self.scenes
            .par_iter_mut()
            .filter(|scene| scene.kind == Some(Kind::Wrong) && !scene.explained)
            .for_each(|scene| {
                let acts = |change: &&Change| change.acts_in(&scene.scene);
                let acting: Vec<&Change> = made.iter().filter(acts).collect();
                // With a wrong Jacobian, Newton's method ends where it may.
                let is_jacobian = |change: &&Change| matches!(change.place, Place::Jacobian(_));
                let is_astray = scene.is_newton() && acting.iter().any(is_jacobian);
                let model = scene.model(&made);
                // No step shows what makes numbers that are not finite at once, unless it does so here.
                let is_finite = |model: &Model| {
                    let start = model.start();
                    model.step(&mut Memory::default(), 0, None, &start).is_some()
                };
                // Where a program goes on with what it divided by 0 is not known.
                let divides = || {
                    let right = || scene.model(&[]).dividing_by_zero();
                    !is_finite(&model.clone().dividing_by_zero()) && is_finite(&right())
                };
                let agrees = || match scene.is_infinite_at_once() {
                    true => !is_finite(&model),
                    false => scene.agrees_with(&model, usize::MAX) != Agreement::Differs,
                };
                scene.open = is_astray
                    || !acting.is_empty() && model.can_step() && (agrees() || divides())
                    || !scene.evidence.is_empty() && steps_otherwise(scene, &made);
            });
    }

    /// Drops such mistakes. Scenes that they explained, alone or with others, are unexplained again.
    fn drop_all(&mut self, is_dropped: fn(&Self, &Cause) -> bool) {
        let gone = self.found.iter().filter(|cause| is_dropped(self, cause));
        let gone: BTreeSet<usize> = gone.map(|cause| cause.group).collect();
        let is_gone = |cause: &Cause| gone.contains(&cause.group);
        for cause in self.found.iter().filter(|cause| is_gone(cause)) {
            for &number in &cause.scenes {
                self.scenes[number].explained = false;
            }
        }
        self.found.retain(|cause| !is_gone(cause));
        self.settle();
    }

    /// Drops far-fetched mistakes that are refuted already, and looks for them no more: a number that makes a few scenes right by
    /// accident would stand in the way of their mistake.
    fn exclude_accidents(&mut self) {
        let is_accident = |search: &Self, cause: &Cause| {
            !cause.is_lack()
                && cause.change().rank >= search.limits.far_fetched
                && search.is_refuted(cause)
        };
        let gone = self.found.iter().filter(|cause| is_accident(self, cause));
        let gone: Vec<Change> = gone.flat_map(|cause| cause.alternatives.clone()).collect();
        if !gone.is_empty() {
            self.excluded.extend(gone);
            self.drop_all(is_accident);
        }
    }

    /// Marks the scenes that the changes made so far explain together.
    fn explain_more(&mut self) {
        let made = self.made();
        let first = self.limits.first;
        let agrees = |scene: &Marked<'_>| {
            let model = scene.model(&made);
            let is_changed = made
                .iter()
                .any(|change| change.acts_in(&scene.scene) && model.is_changed_by(change));
            // The last steps before a number overflows show nothing.
            let explodes = matches!(scene.judged.outcome, Outcome::NotFinite(_));
            let most = if explodes { first } else { usize::MAX };
            is_changed
                && model.can_step()
                && scene.agrees_with(&model, most) == Agreement::Agrees
                && (explodes || scene.replay(&made) == Agreement::Agrees)
        };
        let more: Vec<usize> = (0..self.scenes.len())
            .into_par_iter()
            .filter(|&number| {
                let scene = &self.scenes[number];
                scene.is_suspect() && !scene.explained && agrees(scene)
            })
            .collect();
        for number in more {
            self.scenes[number].explained = true;
            let scene = &self.scenes[number].scene;
            let acting = self.found.iter_mut().filter(|cause| cause.change().acts_in(scene));
            acting.for_each(|cause| cause.scenes.push(number));
        }
    }

    /// Drops alternatives that say the same as a cause, and those by which another part of a force acts twice on a particle, where a
    /// cause is that this part acts on one particle alone.
    fn drop_alternatives(&mut self) {
        let ends = self.found.iter().filter_map(|cause| match cause.change().effect {
            Effect::Ends(term, Ends::First | Ends::Second) => Some(term),
            _ => None,
        });
        let ends: Vec<Term> = ends.collect();
        for cause in &mut self.found {
            let is_beside = |change: &Change| match change.effect {
                Effect::Ends(term, Ends::Again(_, parts)) => ends
                    .iter()
                    .any(|one| *one != term && one.tag == term.tag && parts.contains(&one.part)),
                _ => false,
            };
            if !is_beside(cause.change()) {
                cause.alternatives.retain(|change| !is_beside(change));
            }
            let said = cause.change().clone();
            cause.alternatives.retain(|change| !is_gate_of(change, &said));
        }
    }

    /// Whether more scenes refute a mistake than it explains. A scene refutes one if nothing explains it, and all its terms and
    /// rules are in a scene that the mistake explains: nothing else can be wrong there.
    fn is_refuted(&self, cause: &Cause) -> bool {
        let acts = |scene: &&Marked<'_>| cause.change().must_act_in(&scene.scene);
        let refuting =
            self.scenes.iter().filter(|scene| scene.is_left()).filter(acts).filter(|left| {
                let mut explained = cause.scenes.iter().map(|&number| &self.scenes[number].scene);
                explained.any(|explained| is_within(&left.scene, explained))
            });
        // The equation of rounds is known in full: one such scene says that something else is wrong.
        let enough = if is_of_rounds(cause.change()) { 1 } else { cause.scenes.len() + 1 };
        refuting.count() >= enough
    }

    /// Whether a mistake leaves too many scenes wrong in which it acts. A far-fetched one, such as a number that the steps
    /// determine, may be another formula that has this value in a few scenes; a method that steps as another one does so in all
    /// scenes. Both must explain most. Others must explain a third, as other mistakes may be in the same scenes.
    fn is_unlikely(&self, cause: &Cause) -> bool {
        let change = cause.change();
        let acts = |scene: &&Marked<'_>| change.must_act_in(&scene.scene) && scene.is_suspect();
        let unsettled = self.scenes.iter().filter(acts).filter(|scene| !scene.explained).count();
        let explained = cause.scenes.len();
        let wrong = wrong_otherwise(change, &self.scenes);
        let is_counted =
            |number: &&usize| super::terms(&self.scenes[**number].scene).is_disjoint(&wrong);
        let against = cause.unexplained.iter().filter(is_counted).count();
        let is_replaced = matches!(change.effect, Effect::Method(_, Rule::Replaced(_)));
        let is_in_method = !cause.unexplained.is_empty() && self.is_all_of_a_method(cause);
        let is_far_fetched = !cause.is_lack() && change.rank >= self.limits.far_fetched;
        match is_replaced || is_far_fetched {
            true => explained <= unsettled,
            false => !cause.is_lack() && (2 * explained < against || is_in_method),
        }
    }

    /// The methods of the scenes that a cause explains.
    fn methods(&self, cause: &Cause) -> BTreeSet<&'static str> {
        cause.scenes.iter().map(|&number| self.scenes[number].scene.integrator.name).collect()
    }

    /// Whether a mistake of a force explains scenes of one method alone, whose other scenes are wrong as well, more of them, and
    /// without that force: something of the method is wrong, and this is a part of what it does.
    fn is_all_of_a_method(&self, cause: &Cause) -> bool {
        let methods = self.methods(cause);
        let Some(name) = methods.first().filter(|_| methods.len() == 1) else { return false };
        let is_of_method =
            matches!(cause.change().place, Place::Integrator(_) | Place::FixedUnder(_));
        let of_method = |scene: &&Marked<'_>| {
            scene.scene.integrator.name == *name && !scene.scene.forces.is_empty()
        };
        let others = self
            .scenes
            .iter()
            .filter(of_method)
            .filter(|scene| !cause.change().acts_in(&scene.scene));
        let (wrong, right): (Vec<&Marked<'_>>, Vec<&Marked<'_>>) =
            others.partition(|scene| scene.is_left());
        !is_of_method && right.is_empty() && wrong.len() > cause.scenes.len()
    }
}

/// Terms that are wrong whatever this change is: several scenes with them are left wrong in which it does not act, and few
/// are right.
pub(super) fn wrong_otherwise(change: &Change, scenes: &[Marked<'_>]) -> BTreeSet<Term> {
    let mut counts: HashMap<Term, (usize, usize)> = HashMap::new();
    for scene in scenes {
        let is_left = scene.is_left() && !change.must_act_in(&scene.scene);
        for term in super::terms(&scene.scene) {
            let (left, right) = counts.entry(term).or_default();
            *left += usize::from(is_left);
            *right += usize::from(scene.is_settled());
        }
    }
    let is_wrong = |(left, right): (usize, usize)| left >= super::FEW && left > MOSTLY * right;
    counts.into_iter().filter(|(_, count)| is_wrong(*count)).map(|(term, _)| term).collect()
}

/// Scenes of a term that are left wrong, for each that is right, above which the term is wrong.
const MOSTLY: usize = 3;

/// Whether a change leaves elements out by a gate, and another one says the same of a parameter that is 0.
fn is_gate_of(change: &Change, said: &Change) -> bool {
    let Effect::Gate(_, _, gate) = &change.effect else { return false };
    let (Effect::Scene(rule) | Effect::Partly(_, rule)) = &said.effect else { return false };
    let SceneRule::LeftOut { which: Which::Zero(name), .. } = rule else { return false };
    gate.factor == 0.0 && matches!(gate.measure, Measure::Parameter(_, of) if of == *name)
}

/// Whether all terms and rules of a scene are in another one.
pub(super) fn is_within(inner: &Scene, outer: &Scene) -> bool {
    let has_fixed = |scene: &Scene| scene.particles.iter().any(|particle| particle.fixed);
    inner.integrator.name == outer.integrator.name
        && super::terms(inner).is_subset(&super::terms(outer))
        && (has_fixed(outer) || !has_fixed(inner))
}

/// Whether Newton's method converges slowly or not at all in a scene with these changes.
fn shows_nothing(scene: &Marked<'_>, made: &[Change]) -> bool {
    let acts = || made.iter().any(|change| change.acts_in(&scene.scene));
    scene.is_newton() && acts() && {
        let model = scene.model(made);
        model.can_step() && scene.agrees_with(&model, usize::MAX) == Agreement::Open
    }
}

/// Whether Newton's method converges slowly or not at all in a scene with what is wrong in a linearized method's matrix.
pub(super) fn stalls(scene: &Marked<'_>, made: &[Change]) -> bool {
    let twins = of_linearized(scene, made);
    !twins.is_empty() && shows_nothing(scene, &[made, &twins].concat())
}

/// Whether another method's steps are those of the scene: it is evidence of nothing else, though too little to say that the
/// scene's own method is not there.
fn steps_otherwise(scene: &Marked<'_>, made: &[Change]) -> bool {
    let mut lacks = candidates::replacements(&scene.scene).into_iter().filter(is_lack);
    lacks.any(|change| {
        let all = [made, &[change]].concat();
        let model = scene.model(&all);
        scene.agrees_with(&model, usize::MAX) == Agreement::Agrees
            && scene.replay(&all) == Agreement::Agrees
    })
}

/// Whether a change is one of a task, or of a force in a method of rounds.
fn is_of_rounds(change: &Change) -> bool {
    matches!(change.place, Place::Task(_) | Place::ForceUnder(..))
}

/// Milliseconds, as they are counted, in which the changes of a scene, or their pairs, are mostly enumerated: a scene that needs
/// more than is left is passed over. Each iteration of Newton's method solves a dense system.
fn estimated(integrator: &IntegratorSchema, size: usize, pairs: bool) -> u64 {
    let size = size as u64;
    let is_implicit = integrator.matrix == Matrix::Jacobians;
    let is_newton = matches!(integrator.convergence, Convergence::Update(_));
    match (pairs, is_implicit) {
        (true, true) if is_newton => 15 * size,
        (true, true) => 140 * size + size.pow(3) / 10,
        (true, false) => 40 * size,
        (false, _) if is_newton => 90 * size + size.pow(3) / 10,
        (false, true) => 19 * size,
        (false, false) => 6 * size,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::findings::evidence::SceneEvidence;
    use crate::findings::judged::JudgedScene;
    use scene::trace::State;

    const ELASTIC: Term = Term { tag: "springforce", part: "elastic" };

    /// The scene of this text.
    fn read(text: &str) -> Scene {
        let options = scene::ParseOptions::default();
        let scene = scene::xml::parse(text, "a.xml", &simulator::vocabulary(), &options);
        scene.expect("a scene").scene
    }

    /// The states of a scene with these changes.
    fn states(scene: &Scene, changes: &[Change]) -> Vec<State> {
        let model = Model::new(scene, changes);
        let mut states = vec![model.start()];
        for step in 0..scene.n_steps() {
            let before = &states[states.len() - 1];
            let made = model.step(&mut Memory::default(), step, None, before);
            states.push(made.expect("a step").state);
        }
        states
    }

    #[test]
    fn a_cause_that_no_scene_needs_beside_the_others_goes() {
        let scene = read(
            r#"<scene> <duration time="1"/> <integrator type="explicit-euler" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="0" vy="1" fixed="0"/>
  <particle m="2" px="1" py="0" vx="3" vy="4" fixed="0"/>
  <edge i="0" j="1"/> <springforce edge="0" k="1" l0="0.5"/>
</scene>"#,
        );
        let doubled = candidates::factor(ELASTIC, &[Quantity::Force], 2.0);
        let changes = [candidates::omission(ELASTIC), doubled];
        let states = states(&scene, &changes[..1]);
        let judged = JudgedScene::wrong("a", &scene, &states);
        let limits = Thresholds::default();
        let evidence = SceneEvidence::of(&judged, &limits);
        let mut search = Search::new(&[Marked::new(&evidence)], &limits);
        let cause = |change: &Change| Cause::of_scenes(change.clone(), vec![0], Vec::new());
        search.found = changes.iter().map(cause).collect();
        search.found[1].group = 1;
        search.settle();
        assert_eq!(search.made(), changes[..1]);
        assert_eq!(search.found[0].scenes, [0]);
    }

    #[test]
    fn work_is_counted_alike_each_time_and_what_is_enumerated_in_part_is_not_said() {
        let scene = read(
            r#"<scene> <duration time="1"/> <integrator type="linearized-implicit-euler" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="0" vy="1" fixed="0"/>
  <particle m="2" px="1" py="0" vx="3" vy="4" fixed="0"/>
  <edge i="0" j="1"/> <springforce edge="0" k="5" l0="0.5"/> <dragdamping b="2"/>
</scene>"#,
        );
        let drag = Term { tag: "dragdamping", part: "" };
        let factor = |(term, factor)| candidates::factor(term, &[Quantity::Force], factor);
        let both = [(ELASTIC, 2.0), (drag, -1.0)].map(factor);
        let states = states(&scene, &both);
        let judged = JudgedScene::wrong("a", &scene, &states);
        let search = |ceiling: u64| {
            let limits = Thresholds { ceiling, ..Thresholds::default() };
            let evidence = SceneEvidence::of(&judged, &limits);
            let found = causes(&[Marked::new(&evidence)], &limits).causes;
            let words: Vec<String> = found.iter().flat_map(Cause::words).collect();
            (words, evidence.work.nanoseconds())
        };
        let (words, work) = search(u64::MAX);
        assert_eq!(words.len(), 2, "{words:?}");
        assert_eq!(search(u64::MAX), (words.clone(), work));
        let whole = work / 1_000_000;
        let within = |hundredths: u64| search(hundredths * whole / 100).0;
        assert!((0..100).step_by(7).map(within).all(|found| found.is_empty() || found == words));
        assert_eq!(search(whole + 1).0, words);
    }

    #[test]
    fn pairs_of_changes_in_a_large_net_do_not_fit_into_a_search() {
        let linearized = simulator::vocabulary().integrator("linearized-implicit-euler");
        let linearized = linearized.expect("an integrator of the registry");
        let limits = Thresholds::default();
        let all = |size: usize, pairs: bool, count: u64| count * estimated(linearized, size, pairs);
        assert!(all(50, true, 1) > limits.ceiling);
        let newton = simulator::vocabulary().integrator("implicit-euler");
        let newton = newton.expect("an integrator of the registry");
        assert!(2 * estimated(newton, 32, false) > limits.ceiling);
        // The largest net alone, and pairs in the scenes of few particles that most mistakes show in.
        assert!(all(50, false, limits.tried as u64) < limits.ceiling);
        assert!(all(8, true, limits.tried as u64 / 2) < limits.ceiling);
    }
}
