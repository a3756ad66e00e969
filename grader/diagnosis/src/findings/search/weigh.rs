//! Weighs changes against all scenes: by sampled steps first, then by replay of whole scenes.

use std::collections::{BTreeSet, HashMap};

use crate::change::candidates;
use crate::change::rounds;
use crate::change::{Change, Effect, Place, Quantity, Rule, SceneRule, Task, Term};
use rayon::prelude::*;
use reference::method::Method;
use scene::Scene;

use super::{Cause, Search, is_lack, is_of_rounds};
use crate::findings::evidence::{Agreement, Marked};

/// A change, or two, with what they explain.
pub(super) struct Weighed {
    pub(super) changes: Vec<Change>,
    pub(super) explained: BTreeSet<usize>,
    /// Failing scenes in which it acts, and that it does not explain.
    unexplained: usize,
    open: usize,
}

impl Weighed {
    /// A scene that is not explained counts a quarter: another mistake may be in it.
    fn score(&self) -> i64 {
        4 * self.explained.len() as i64 - self.unexplained as i64
    }

    /// Whether it is another method's steps in few of the scenes: something else is wrong that these do not show.
    fn is_doubtful(&self) -> bool {
        let is_replaced =
            |change: &Change| matches!(change.effect, Effect::Method(_, Rule::Replaced(_)));
        self.explained.len() <= self.unexplained && self.changes.iter().any(is_replaced)
    }

    fn rank(&self) -> u32 {
        let ranks = self.changes.iter().map(|change| u32::from(change.rank));
        ranks.sum::<u32>() + 4 * (self.changes.len() as u32 - 1)
    }
}

impl Search<'_> {
    /// Features that are left out: forces whose own scenes show it, and methods in whose place another one steps.
    /// A method with a known mistake is not taken to step in place of another one, unless all are asked for: the same mistake
    /// may be in both.
    pub(super) fn lacks(&self, made: &[Change], all: bool) -> Vec<Cause> {
        let suspects = || self.scenes.iter().filter(|scene| scene.is_suspect() && !scene.explained);
        let mut terms: Vec<Term> = Vec::new();
        let mut integrators: Vec<&'static str> = Vec::new();
        let mut changes: Vec<Change> = Vec::new();
        // Changes that leave all forces out.
        let mut silent: Vec<Change> = candidates::taken_as_fixed().into();
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
                let is_plain = |change: &Change| all || !is_by_changed(change, made);
                changes.extend(
                    lacks.filter(|change| is_plain(change) && !is_idle_round(scene, change)),
                );
                silent.push(candidates::integrator_factor(name, Quantity::Force, 0.0));
            }
        }
        let weighed = |changes: Vec<Change>| -> Vec<Weighed> {
            let of = |change: Change| self.weigh(made, vec![change], false);
            changes.into_par_iter().filter_map(of).collect()
        };
        changes.retain(|change| !made.contains(change));
        // If the force alone is left out, or with one Jacobian, the others are there.
        changes.retain(|change| {
            let Place::Force(term) = change.place else { return true };
            let explains = |change: Change| {
                self.weigh(made, vec![change], false).map_or(0, |one| one.explained.len())
            };
            if !term.schema().depends_on().has_jacobian() {
                return true;
            }
            let mut parts = candidates::partial_omissions(term);
            parts.push(candidates::factor(term, &[Quantity::Force], 0.0));
            let all = explains(change.clone());
            parts.into_iter().all(|part| explains(part) <= all)
        });
        let mut silent = weighed(silent);
        silent.retain(|one| self.is_in_most(one));
        let mut found = weighed(changes);
        found.retain(|one| {
            let is_of_all = silent.iter().any(|other| {
                other.explained.is_superset(&one.explained)
                    && one.changes[0].place != other.changes[0].place
            });
            // Another mistake may hide that it is left out, until that is found.
            let is_elsewhere = !all
                && crate::findings::acts_elsewhere(&one.changes[0], &one.explained, &self.scenes);
            !is_of_all && !is_elsewhere && self.is_convincing(one)
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
            && let Some(Weighed { explained: all, .. }) = self.prove(made, together)
        {
            let cause = |one: Weighed| Cause {
                rivals: self.rivals(&one.changes[0]),
                alternatives: one.changes,
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
            if let Some(Weighed { changes, explained, open, .. }) = self.prove(&all, one) {
                let scenes = explained.into_iter().collect();
                let (rivals, alternatives) = (self.rivals(&changes[0]), changes);
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

    /// Changes that look like a force that is left out where other mistakes are in all scenes that distinguish them: the force
    /// alone, its Jacobians kept, and its parameters cut to integers. Like a method in the place of another: its positions, which
    /// move as there, without its fixed particles.
    fn rivals(&self, lack: &Change) -> Vec<Change> {
        let Place::Force(term) = lack.place else {
            let is_its =
                |scene: &&Marked<'_>| lack.place == Place::Integrator(scene.scene.integrator.name);
            let scene = self.scenes.iter().find(is_its).filter(|_| lack.is_order_of_updates());
            let mut all = scene.map_or_else(Vec::new, |one| candidates::of_integrator(&one.scene));
            all.retain(|change| {
                matches!(
                    change.effect,
                    Effect::Method(
                        _,
                        Rule::Position { old: 0.0, new: 1.0, h: 1 }
                            | Rule::Position { old: 1.0, new: 0.0, h: 1 }
                    )
                )
            });
            return all;
        };
        let has_jacobian = term.schema().depends_on().has_jacobian();
        let alone = has_jacobian.then(|| candidates::factor(term, &[Quantity::Force], 0.0));
        let mut all: Vec<Change> = alone.into_iter().collect();
        for scene in self.scenes.iter().filter(|scene| scene.is_suspect()) {
            let is_cut = |change: &Change| matches!(change.effect, Effect::Scene(SceneRule::Integer(tag, _)) if tag == term.tag);
            let readings = candidates::of_reading(&scene.scene, &[]);
            for change in readings.into_iter().filter(is_cut) {
                if !all.contains(&change) {
                    all.push(change);
                }
            }
        }
        all
    }

    /// Whether at least two scenes, and nearly all that use no other force, show that a feature is left out. Of a method, at
    /// least three, and half of its scenes; that nothing moves under it, nearly all, since a scene at rest shows the same without a force.
    fn is_convincing(&self, one: &Weighed) -> bool {
        let Place::Force(term) = one.changes[0].place else {
            let is_idle = matches!(one.changes[0].effect, Effect::Method(_, Rule::Idle));
            let is_enough = one.explained.len() >= one.unexplained;
            return one.explained.len() > 2 && (self.is_in_most(one) || is_enough && !is_idle);
        };
        let integrators: BTreeSet<&str> =
            one.explained.iter().map(|&number| self.scenes[number].scene.integrator.name).collect();
        let is_own = |scene: &Marked<'_>| {
            scene.scene.forces.iter().all(|element| {
                let parts = element.schema.parts.iter();
                element.schema.tag == term.tag
                    && parts
                        .filter(|part| element.has_part(part))
                        .all(|part| term.part.is_empty() || part.name == term.part)
            })
        };
        let own = (0..self.scenes.len()).filter(|&number| {
            let scene = &self.scenes[number];
            let is_judged = scene.is_suspect() && !scene.explained;
            is_judged && is_own(scene) && integrators.contains(scene.scene.integrator.name)
        });
        let own: Vec<usize> = own.collect();
        let shown = own.iter().filter(|number| one.explained.contains(number)).count();
        one.explained.len() > 1 && self.is_nearly_all(shown, own.len() - shown)
    }

    /// Whether it explains nearly all failing scenes in which it acts.
    fn is_in_most(&self, one: &Weighed) -> bool {
        self.is_nearly_all(one.explained.len(), one.unexplained)
    }

    fn is_nearly_all(&self, right: usize, wrong: usize) -> bool {
        right >= self.limits.most * wrong
    }

    /// The best of these that whole replays prove, with its alternatives.
    pub(super) fn choose(&self, made: &[Change], mut weighed: Vec<Weighed>) -> Vec<Cause> {
        // Stable: of equal ones, the first that was enumerated.
        weighed.sort_by_key(|one| {
            (one.is_doubtful(), std::cmp::Reverse(one.score()), one.open, one.rank())
        });
        let mut best: Option<(Weighed, Vec<Weighed>)> = None;
        let mut rivals: Vec<Change> = Vec::new();
        let mut replayed = 0;
        for one in weighed {
            match &mut best {
                None => {
                    if replayed >= self.limits.replayed {
                        break;
                    }
                    replayed += 1;
                    if let Some(one) = self.prove(made, one) {
                        best = Some((one, Vec::new()));
                    }
                }
                Some((best, others)) => {
                    let ([known], [change]) = (best.changes.as_slice(), one.changes.as_slice())
                    else {
                        continue;
                    };
                    let is_new = change != known && !rivals.contains(change) && !one.is_doubtful();
                    if is_new
                        && rivals.len() < self.limits.rivals
                        && !one.explained.is_disjoint(&best.explained)
                    {
                        rivals.push(change.clone());
                    }
                    // A change in another place that explains the same scenes is an alternative.
                    let is_same = one.explained.is_superset(&best.explained);
                    let known = || std::iter::once(&*best).chain(others.iter());
                    let in_place =
                        known().filter(|known| known.changes[0].place == change.place).count();
                    // Of a task, the student should know each change that makes the same positions.
                    let [most, most_others] = match is_of_rounds(change) {
                        true => [2, Task::ALL.len()],
                        false => [1, 3],
                    };
                    let is_other = in_place < most;
                    let is_usual = one.rank() <= best.rank() + 2;
                    if is_same
                        && is_other
                        && others.len() < most_others
                        && is_usual
                        && let Some(one) = self.prove(made, one)
                        && one.explained.is_superset(&best.explained)
                    {
                        others.push(one);
                    }
                }
            }
        }
        let Some((best, others)) = best else { return Vec::new() };
        let (open, lack) = (best.open, is_lack(&best.changes[0]));
        let together = self.in_each_jacobian(made, &best);
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
        let is_clear_lack = lack
            && self.scenes.len() > 2
            && !others.iter().any(|one| is_of_rounds(&one.changes[0]));
        if let ([cause], false) = (causes.as_mut_slice(), is_clear_lack) {
            cause.alternatives.extend(others.into_iter().flat_map(|other| other.changes));
            cause.alternatives.extend(together);
            cause.rivals = rivals;
        }
        causes
    }

    /// If the change is one of a kind of Jacobian in the matrix, and the scenes that it explains have few of that kind: the same
    /// change of each of these, in the same words.
    fn in_each_jacobian(&self, made: &[Change], best: &Weighed) -> Vec<Change> {
        let [Change { effect: Effect::Method(_, Rule::Matrix(quantity, factor)), .. }] =
            best.changes.as_slice()
        else {
            return Vec::new();
        };
        let explained = best.explained.iter().map(|&number| &self.scenes[number].scene);
        let mut terms: BTreeSet<Term> = explained.flat_map(crate::findings::terms).collect();
        terms.retain(|term| !made.contains(&candidates::omission(*term)));
        let depends = |term: &Term| candidates::groups(*term).contains(&[*quantity].as_slice());
        let terms: Vec<Term> = terms.into_iter().filter(depends).collect();
        if terms.len() < 2 || terms.len() > self.limits.together {
            return Vec::new();
        }
        let changes = candidates::in_each(&terms, *quantity, *factor);
        let explained = best.explained.clone();
        let weighed = Weighed { changes, explained, unexplained: 0, open: 0 };
        let proven = self.prove(made, weighed);
        proven
            .filter(|one| one.explained == best.explained)
            .map_or_else(Vec::new, |one| one.changes)
    }

    /// Replays whole scenes: the changes must leave alone what passed, and keeps those scenes that they reproduce.
    pub(super) fn prove(&self, made: &[Change], weighed: Weighed) -> Option<Weighed> {
        let all: Vec<Change> = made.iter().chain(&weighed.changes).cloned().collect();
        let must_act =
            |scene: &Scene| weighed.changes.iter().any(|change| change.must_act_in(scene));
        let mut n_passed = 0;
        let mut wanted: Vec<usize> = (0..self.scenes.len())
            .filter(|&number| {
                let scene = &self.scenes[number];
                let is_explained = weighed.explained.contains(&number);
                let wanted = scene.is_settled() && must_act(&scene.scene) || is_explained;
                wanted && scene.judged.states.len() > 1
            })
            .collect();
        wanted.sort_by_key(|&number| self.scenes[number].simplicity());
        wanted.retain(|&number| {
            let is_other = !weighed.explained.contains(&number);
            n_passed += usize::from(is_other);
            !is_other || n_passed <= self.limits.passed
        });
        let judged: Vec<(usize, Agreement)> = wanted
            .into_par_iter()
            .map(|number| (number, self.scenes[number].replay(&all)))
            .collect();
        let contradicts = |(number, agreement): &(usize, Agreement)| {
            let scene = &self.scenes[*number];
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
        let wrong = weighed.explained.len() - explained.len();
        let is_most = self.is_nearly_all(explained.len(), wrong);
        // A change that acts in one scene has no second one to confirm it. A slip of a solver has no effect on most matrices.
        let has_one_scene = |change: &Change| {
            let is_of_solver = matches!(change.effect, Effect::Method(_, Rule::Solver(_)));
            let shows = |scene: &&Marked<'_>| {
                change.must_act_in(&scene.scene) && (scene.is_suspect() || !is_of_solver)
            };
            self.scenes.iter().filter(shows).count() == 1
        };
        let is_enough = match explained.len() {
            0 => false,
            1 => self.scenes.len() < self.limits.small || weighed.changes.iter().all(has_one_scene),
            _ => true,
        };
        let enough = is_most && is_enough;
        enough.then_some(Weighed { explained, ..weighed })
    }

    /// Compares changes with the samples of all scenes; `None` if a scene contradicts them, or one of those made.
    pub(super) fn weigh(
        &self,
        made: &[Change],
        changes: Vec<Change>,
        is_probe: bool,
    ) -> Option<Weighed> {
        let all: Vec<Change> = made.iter().chain(&changes).cloned().collect();
        let is_undone = |place: usize| all[..place].iter().any(|before| before.undoes(&all[place]));
        if (made.len()..all.len()).any(is_undone) {
            return None;
        }
        let mut weighed = Weighed { changes, explained: BTreeSet::new(), unexplained: 0, open: 0 };
        let concerned = self.scenes.iter().enumerate().filter(|(_, scene)| {
            let acts = weighed.changes.iter().any(|change| change.acts_in(&scene.scene));
            let is_compared = !scene.is_set_aside && (scene.passed || scene.is_suspect());
            acts && !scene.evidence.is_empty() && is_compared
        });
        let concerned: Vec<(usize, &Marked<'_>)> = concerned.collect();
        let (stride, samples) = match is_probe {
            true => (concerned.len().div_ceil(self.limits.probed).max(1), 1),
            false => (1, usize::MAX),
        };
        for (number, scene) in concerned.into_iter().step_by(stride) {
            let model = scene.model(&all);
            if !model.can_step()
                || !weighed.changes.iter().any(|change| model.is_changed_by(change))
            {
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
        if weighed.changes.iter().any(is_idle) && !self.is_in_most(&weighed) {
            return None;
        }
        (is_probe || !weighed.explained.is_empty()).then_some(weighed)
    }

    /// Those of the changes that the scenes do not contradict, the best first: by one step of some scenes, then by all evidence.
    pub(super) fn weigh_all(&self, made: &[Change], changes: Vec<Vec<Change>>) -> Vec<Weighed> {
        let limits = self.limits;
        let mut counts: HashMap<Vec<Place>, usize> = HashMap::new();
        let mut all = 0;
        let mut few = changes;
        few.retain(|changes| {
            // Small scenes hardly distinguish the changes of rounds.
            if changes.iter().all(is_of_rounds) {
                return true;
            }
            let places: Vec<Place> = changes.iter().map(|change| change.place).collect();
            let count = counts.entry(places).or_default();
            *count += 1;
            let is_early = *count <= limits.weighed_of_place;
            all += usize::from(is_early);
            is_early && all <= limits.weighed
        });
        let first = |changes: &Vec<Change>| self.weigh(made, changes.clone(), true);
        let mut found: Vec<Weighed> = few.par_iter().filter_map(first).collect();
        found.sort_by_key(|one| (std::cmp::Reverse(one.score()), one.rank()));
        // The first ones, and the first in each other place.
        let mut places: BTreeSet<Place> = BTreeSet::new();
        let mut kept = 0;
        found.retain(|one| {
            let is_new = places.insert(one.changes[0].place);
            kept += 1;
            kept <= limits.weighed_fully || is_new && places.len() <= limits.weighed_fully
        });
        let fully = |one: Weighed| self.weigh(made, one.changes, false);
        found.into_par_iter().filter_map(fully).collect()
    }
}

/// Whether the method that steps in the place of another one has a mistake.
fn is_by_changed(change: &Change, made: &[Change]) -> bool {
    let Effect::Method(_, Rule::Replaced(method)) = change.effect else { return false };
    let is_its = |name: &str| {
        let known = simulator::vocabulary().integrator(name);
        known.is_some_and(|known| Method::one_point(known) == Some(method))
    };
    made.iter().any(|change| matches!(&change.effect, Effect::Method(name, _) if is_its(name)))
}

/// Whether nothing moves in a scene of rounds. Springs at rest move neither if forces are left out of the rounds.
fn is_idle_round(scene: &Marked<'_>, change: &Change) -> bool {
    let is_idle = matches!(change.effect, Effect::Method(_, Rule::Idle));
    is_idle && rounds::is_of_rounds(&scene.scene)
}
