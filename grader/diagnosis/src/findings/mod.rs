//! Findings: what is wrong in a submission, each with its evidence. Every report shows this one list.
//!
//! ```text
//! traces ── form.rs       faults of the output, settled first
//!        ── initial.rs    what is read wrongly of particles, by all first states
//!        ── rows.rs       faults of the rows of all traces: how many there are, and which
//!        ── restore.rs    traces without such a fault, where other mistakes are looked for
//!        ── evidence.rs   which steps are wrong by themselves; replay of whole scenes with a change
//!        ── fit.rs        numbers in changes, from the steps
//!        ── search.rs     changes that make the same steps, proven by replay; up to three mistakes together
//!        ── scope.rs      what is left: a feature, where exactly its scenes fail
//!        ── shared.rs     what the scenes share that are left then, in groups
//!        ── tasks.rs      what that says of each task of the hand-out on rounds
//! ```
//!
//! Better to say less than to say what is not so. A cause is named if whole scenes, stepped with the mistake put in, are
//! the submission's traces, and the scenes that passed stay as they are. A feature is named without a cause if it is the
//! only one whose scenes are exactly those that fail. Otherwise nothing is named.

mod evidence;
mod feature;
mod finding;
mod fit;
mod form;
mod initial;
mod judged;
mod restore;
mod rows;
mod scope;
mod search;
mod shared;
mod tasks;
mod thresholds;
mod trace;

use std::collections::BTreeSet;

use crate::change::{Change, Place, Term, place_in_registry, rounds};
use rayon::prelude::*;
use scene::schema::{Convergence, Masses, Matrix};
use scene::{ForceElement, Scene};
use simulator::force;
use simulator::integrator;

use crate::explanation::Explanation;
use crate::roots::Roots;
use crate::steps::Evidence;

use evidence::{Marked, SceneEvidence};
pub use feature::{Family, Feature, Part, Symptom};
pub use finding::{Finding, FindingKind, Progress};
use form::Kind;
pub use judged::{ContextRow, Diagnosis, FirstWrong, Found, JudgedScene, Outcome, Restarts};
use restore::Restored;
use scope::Failing;
use search::{Assignment, Cause};
use shared::{Right, Shared};
pub use tasks::of_passed as tasks_of_passed;
pub use tasks::{TaskFinding, TaskVerdict};
pub use thresholds::Thresholds;
pub use trace::is_recorded;

/// Messages of which each is looked at by itself.
const MESSAGES: usize = 3;

/// Minimum number of failing scenes from which a feature is inferred.
const FEW: usize = 2;

/// The words of a program that ends where a named mistake acts.
const NAMED: &str = "where what is named above acts, which may be why";

/// Follows the words of a program that ends with a singular matrix where particles are fixed.
const SINGULAR: &str = ", as where the diagonal entries of their cleared rows are not set to 1";

/// The findings in a submission.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Findings {
    /// The findings, in the order in which a student should read them.
    pub list: Vec<Finding>,
    /// Implemented features and the next one; `None` if the submission lacks nothing, or has nothing.
    pub progress: Option<Progress>,
    /// Wrong scenes that the mistakes found may explain, or not: with them, Newton's method ends where it may.
    pub open: Vec<String>,
    /// The tasks of the hand-out on rounds of local and global steps; empty unless all scenes are of that method.
    pub tasks: Vec<TaskFinding>,
}

impl From<Place> for Feature {
    fn from(place: Place) -> Self {
        let part = |term: Term| match term.part {
            "" => Part::All(term.tag),
            part => Part::One(term.tag, part),
        };
        match place {
            Place::Force(term) | Place::ForceUnder(term, _) => Self::Force(part(term)),
            Place::Jacobian(term) => Self::Jacobian(part(term)),
            Place::Integrator(name) => Self::Integrator(name),
            Place::Fixed(None) => Self::Fixed(Family::Any),
            Place::Fixed(Some(false)) => Self::Fixed(Family::Explicit),
            Place::Fixed(Some(true)) => Self::Fixed(Family::Implicit),
            Place::FixedUnder(name) => Self::Fixed(Family::of(name)),
            Place::Task(task) => Self::Task(task),
            Place::Reading => Self::Reading,
            Place::Helpers => Self::Helpers,
        }
    }
}

/// The terms of a scene.
fn terms(scene: &Scene) -> BTreeSet<Term> {
    let in_element = |element: &ForceElement| {
        let is_there =
            |term: &Term| term.part.is_empty() || element.has_part(element.schema.part(term.part));
        Term::of(element.schema).into_iter().filter(is_there).collect::<Vec<Term>>()
    };
    scene.forces.iter().flat_map(in_element).collect()
}

/// Simplest first: number of terms, then the forces and the integrator in the order of the registries, then the size.
fn simplicity(scene: &Scene) -> [usize; 5] {
    let last =
        scene.forces.iter().filter_map(|element| place_in_registry(element.schema.tag)).max();
    let order = integrator::REGISTRY.iter().position(|k| k.schema.name == scene.integrator.name);
    let (force, order) = (last.unwrap_or(0), order.unwrap_or(usize::MAX));
    [terms(scene).len(), force, order, scene.particles.len(), scene.forces.len()]
}

impl Findings {
    /// Looks for what is wrong in a submission, from all its scenes together. Returns the findings, and what is found in
    /// each scene.
    pub fn of(judged: &[JudgedScene<'_>], limits: &Thresholds) -> (Self, Vec<Found>) {
        let evidence = judged.par_iter().map(|judged| SceneEvidence::of(judged, limits));
        let mut evidence: Vec<SceneEvidence<'_>> = evidence.collect();
        evidence::settle_last_states(&mut evidence);
        evidence::settle_first_states(&mut evidence);
        initial::settle(&mut evidence);
        rows::settle(&mut evidence);
        let mut scenes: Vec<Marked<'_>> = evidence.iter().map(Marked::new).collect();
        // A message of the compiler is in the report already.
        if scenes.iter().any(|scene| scene.kind == Some(Kind::NotBuilt)) {
            return (Self::default(), vec![Found::default(); judged.len()]);
        }
        let mut list = outputs(&mut scenes);
        let (restored, examined): (Vec<Restored>, Vec<_>) =
            restore::all(&scenes).into_iter().unzip();
        let rejudged = restored.iter().map(|one| one.judged(&judged[one.number]));
        let rejudged: Vec<JudgedScene<'_>> = rejudged.collect();
        let shown = rejudged.iter().zip(examined).zip(&restored);
        let shown = shown.map(|((judged, steps), one)| {
            SceneEvidence::of_steps(judged, steps, one.rounding, limits)
        });
        let shown: Vec<SceneEvidence<'_>> = shown.collect();
        for (one, shown) in restored.iter().zip(&shown) {
            scenes[one.number] = Marked::new(shown);
            scenes[one.number].explained = one.is_right && !one.passed;
        }
        let layout = restored.first().and_then(|one| one.layout.clone());
        for one in restored.iter().filter(|one| !one.passed) {
            let name = judged[one.number].name;
            let fault = list.iter_mut().find(|finding| finding.features.contains(&one.feature));
            let Some(fault) = fault else { continue };
            if let Some(layout) = &layout
                && let [words] = fault.words.as_mut_slice()
                && !words.ends_with(layout)
            {
                *words = format!("{words}: {layout}");
            }
            fault.add_scenes(vec![name.to_owned()]);
        }
        let roots: Vec<Option<u64>> = scenes.par_iter().map(other_root).collect();
        let other_roots = other_roots(&mut scenes, &roots);
        let Assignment { mut scenes, causes } = search::causes(&scenes, limits);
        // A wrong matrix leads Newton's method elsewhere.
        let has_wrong_jacobian = scenes
            .iter()
            .any(|scene| scene.is_suspect() && !scene.explained && is_linearized(scene));
        let is_known = |cause: &Cause| {
            matches!(cause.change().place, Place::Jacobian(_)) || cause.change().is_of_system()
        };
        let mut open = names(scenes.iter().filter(|scene| scene.open && !scene.explained));
        if causes.iter().any(is_known) {
            open.extend(other_roots.into_iter().flat_map(|finding| finding.scenes));
        } else if !has_wrong_jacobian {
            list.extend(other_roots);
        }
        take_rounded(&mut scenes, &mut list);
        let mut to_look_at = features(&scenes, &causes);
        let shared = shared::common(&scenes, &causes, &to_look_at);
        // The steps of a program that lacks a method are no evidence of that method.
        let lacking: Vec<Feature> = causes
            .iter()
            .filter(|cause| is_lack(cause, &causes))
            .map(|cause| cause.change().place.into())
            .collect();
        let is_of_lacking = |place: Place| matches!(place, Place::FixedUnder(name) if lacking.contains(&Feature::Integrator(name)));
        let said: Vec<&Cause> =
            causes.iter().filter(|cause| !is_of_lacking(cause.change().place)).collect();
        let exceptions: Vec<Vec<usize>> =
            said.iter().map(|cause| exceptions(cause, &scenes, &to_look_at, &shared)).collect();
        let of_each = said.iter().zip(&exceptions);
        let mut kinds: Vec<FindingKind> = of_each
            .map(|(cause, exceptions)| match exceptions.as_slice() {
                _ if is_lack(cause, &causes) => {
                    match acts_elsewhere(cause.change(), &cause.scenes, &scenes) {
                        true => FindingKind::Feature,
                        false => FindingKind::NoEffect,
                    }
                }
                [] => FindingKind::Cause,
                _ if is_vague(cause, exceptions, &scenes, limits) => FindingKind::Feature,
                _ => FindingKind::Possible,
            })
            .collect();
        // Unproven causes that act only together with unreported ones are not reported.
        let silent: Vec<&Cause> = said
            .iter()
            .zip(&kinds)
            .filter(|(_, kind)| **kind == FindingKind::Feature)
            .map(|(cause, _)| *cause)
            .collect();
        for (cause, kind) in said.iter().zip(&mut kinds) {
            let is_beside = |other: &Cause| cause.scenes.iter().all(|n| other.scenes.contains(n));
            if *kind == FindingKind::Possible && silent.iter().any(|other| is_beside(other)) {
                *kind = FindingKind::Feature;
            }
        }
        let of_named = said.iter().zip(&kinds).filter(|(_, kind)| **kind != FindingKind::Feature);
        let of_named: Vec<Change> = of_named.map(|(cause, _)| cause.change().clone()).collect();
        let of_causes = said.into_iter().zip(kinds).zip(exceptions);
        let (vague, named): (Vec<Finding>, Vec<Finding>) = of_causes
            .map(|((cause, kind), exceptions)| of_cause(cause, kind, &scenes, exceptions.len()))
            .partition(|finding| finding.kind == FindingKind::Feature);
        // Scenes that a change of the same feature explains are not said to be unexplained, nor twice to share something.
        let is_said = |features: &[Feature], scene: &String| {
            let same = named.iter().filter(|other| other.features == features);
            let shared = shared.iter().map(|shared| &shared.finding);
            same.chain(shared).any(|other| other.scenes.contains(scene))
        };
        let is_new = |finding: &Finding| {
            !finding.scenes.iter().all(|scene| is_said(&finding.features, scene))
        };
        let vague: Vec<Finding> = vague.into_iter().filter(is_new).collect();
        list.extend(named);
        for finding in vague {
            match to_look_at.iter_mut().find(|known| known.features == finding.features) {
                Some(known) => known.add_scenes(finding.scenes),
                None => to_look_at.push(finding),
            }
        }
        say_less(&mut to_look_at, &causes, &scenes);
        list.extend(to_look_at);
        list.extend(shared.into_iter().map(|shared| shared.finding));
        list.extend(ends(&scenes, &of_named));
        let mut found = Vec::new();
        for (number, (scene, root)) in scenes.iter().zip(&roots).enumerate() {
            let lacks = causes.iter().find(|c| is_lack(c, &causes) && c.scenes.contains(&number));
            let lacks = lacks.map(|cause| cause.change().words.clone());
            let is_wrong = !scene.passed && scene.steps.total > 0;
            let diagnosis = is_wrong.then(|| {
                let acting: Vec<&Cause> = causes
                    .iter()
                    .filter(|cause| cause.scenes.contains(&number) && scene.explained)
                    .filter(|cause| cause.change().acts_in(scene.judged.scene))
                    .collect();
                let changes: Vec<Change> =
                    acting.iter().map(|cause| cause.change().clone()).collect();
                // In numbers, only as they stand in the trace.
                let is_restored = restored.iter().any(|one| one.number == number);
                let explanation = || {
                    Explanation::of(
                        scene.judged.scene,
                        &scene.evidence,
                        &changes,
                        scene.judged.first_wrong.map(|first| first.particle),
                    )
                };
                Diagnosis {
                    steps: evidence[number].steps.clone(),
                    causes: acting.iter().map(|cause| cause.words().join(", or ")).collect(),
                    other_root: *root,
                    restarts: None,
                    explanation: if is_restored { None } else { explanation() },
                }
            });
            found.push(Found { diagnosis, lacks });
        }
        let unnamed = refused(&scenes, &mut list);
        let tasks = tasks::of(&scenes, &list);
        list.extend(unnamed);
        drop_lacking(&mut list);
        tell_once(&mut list);
        list.iter_mut().for_each(|finding| finding.example = example(finding, &scenes));
        // Stable: causes keep the order in which they were found.
        list.sort_by_key(|finding| (finding.kind, finding.in_order_of_work()));
        let progress = progress(judged, &found, &list);
        (Self { list, progress, open, tasks }, found)
    }
}

/// One case of a finding in numbers, in words, where its own words say less, and how many of its scenes were not run.
fn example(finding: &Finding, scenes: &[Marked<'_>]) -> Option<String> {
    let is_in = |scene: &&Marked<'_>| finding.scenes.iter().any(|one| one == scene.judged.name);
    let concerned = scenes.iter().filter(is_in);
    let (mut run, not_run): (Vec<&Marked<'_>>, Vec<_>) =
        concerned.partition(|scene| scene.judged.was_run);
    run.sort_by_key(|scene| scene.simplicity());
    let not_run = (!not_run.is_empty())
        .then(|| format!("{} not run, after others that ended alike", not_run.len()));
    let parts: Vec<String> = case(finding, &run).into_iter().chain(not_run).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The first case of a finding in these scenes that says more than its own words.
fn case(finding: &Finding, concerned: &[&Marked<'_>]) -> Option<String> {
    let malformed = |scene: &&Marked<'_>| match &scene.judged.outcome {
        Outcome::Malformed(what)
            if matches!(scene.kind, Some(Kind::Malformed | Kind::TimeColumn(_))) =>
        {
            Some(format!("in {}, {what}", scene.judged.name))
        }
        Outcome::Fields { expected, found } if scene.kind == Some(Kind::Malformed) => {
            let name = scene.judged.name;
            Some(format!("in {name}, the number of fields is {found}, not {expected}"))
        }
        _ => None,
    };
    let stopped = |scene: &&Marked<'_>| match &scene.judged.outcome {
        Outcome::Stopped(line) | Outcome::Crashed(Some(line)) => {
            Some(format!("in {}: \"{line}\"", scene.judged.name))
        }
        _ => None,
    };
    let mut each = concerned.iter();
    match finding.kind {
        FindingKind::Output => each.find_map(malformed),
        FindingKind::Ends(Symptom::Error | Symptom::Crash) | FindingKind::Common
            if concerned.iter().any(|scene| stopped(scene).is_some()) =>
        {
            each.find_map(stopped)
        }
        FindingKind::Feature | FindingKind::Common => {
            let misplaced = each.find_map(|scene| scene.misplaced());
            let is_late = concerned.iter().all(|scene| scene.steps.is_right_first_alone());
            let late = "the first step of each is right and all later ones are wrong, as where something is \
                        kept from the step before, or does not show in the first state";
            let late = (is_late && !concerned.is_empty()).then(|| late.to_owned());
            let part = || concerned.first().and_then(|scene| scene.wrong_part());
            misplaced.or_else(|| nearly_right(concerned)).or(late).or_else(part)
        }
        _ => {
            let is_of_fixed = finding.features.iter().any(|one| matches!(one, Feature::Fixed(_)));
            each.filter(|_| is_of_fixed).find_map(|scene| scene.misplaced())
        }
    }
}

/// Says that the steps of all of these scenes are right to few digits.
fn nearly_right(scenes: &[&Marked<'_>]) -> Option<String> {
    let error = scenes.iter().map(|scene| scene.relative_error).reduce(f64::max)?;
    let reasons = if scenes.iter().all(|scene| scene.is_newton()) {
        "where Newton's method ends early, or slowly, as its matrix is not that of its equation"
    } else if scenes.iter().all(|scene| is_linearized(scene)) {
        "with single precision, a linear solver that ends early, or differences in the place of derivatives"
    } else {
        "with single precision"
    };
    let are_all = scenes.len() >= FEW && scenes.iter().all(|scene| scene.is_nearly_right());
    are_all.then(|| {
        format!("each step is right but for an error of {error:.0e} of its change, as {reasons}")
    })
}

/// Merges the same rule of several methods, which a program has in one place: `a, b: the rule`.
fn tell_once(list: &mut Vec<Finding>) {
    let rule = |finding: &Finding| match (&finding.features[..], &finding.words[..]) {
        ([Feature::Integrator(name)], [words]) if finding.kind == FindingKind::Cause => {
            words.strip_prefix(&format!("{name}: ")).map(str::to_owned)
        }
        _ => None,
    };
    let rules: Vec<Option<String>> = list.iter().map(rule).collect();
    let mut merged: Vec<(Option<String>, Finding)> = Vec::new();
    for (rule, finding) in rules.into_iter().zip(list.drain(..)) {
        let known = merged.iter_mut().find(|(known, _)| rule.is_some() && *known == rule);
        match (known, &rule) {
            (Some((_, known)), Some(rule)) => {
                known.features.extend(finding.features);
                let names = known.features.iter().filter_map(|feature| match feature {
                    Feature::Integrator(name) => Some(*name),
                    _ => None,
                });
                let names: Vec<&str> = names.collect();
                known.words = vec![format!("{}: {rule}", names.join(", ")); known.features.len()];
                known.add_scenes(finding.scenes);
                known.open += finding.open;
            }
            _ => merged.push((rule, finding)),
        }
    }
    list.extend(merged.into_iter().map(|(_, finding)| finding));
}

/// Drops the advice to look at a force that is not there.
fn drop_lacking(list: &mut Vec<Finding>) {
    let tag = |feature: &Feature| match feature {
        Feature::Force(part) | Feature::Jacobian(part) => Some(part.tag()),
        _ => None,
    };
    let lacks = list.iter().filter(|finding| finding.kind.is_lack());
    let lacking: Vec<&str> = lacks.flat_map(|finding| &finding.features).filter_map(tag).collect();
    let is_lacking = |feature: &Feature| tag(feature).is_some_and(|tag| lacking.contains(&tag));
    let kept = |finding: &Finding| {
        finding.kind != FindingKind::Feature || !finding.features.iter().all(is_lacking)
    };
    let kept: Vec<bool> = list.iter().map(kept).collect();
    let mut kept = kept.into_iter();
    list.retain(|_| kept.next() == Some(true));
}

/// Whether a cause is a feature that is not there. A method with another mistake is there, as is one whose updates
/// stand in the wrong order.
fn is_lack(cause: &Cause, causes: &[Cause]) -> bool {
    let is_of_it = |other: &Cause| !other.is_lack() && other.change().place == cause.change().place;
    cause.is_lack() && !cause.change().is_order_of_updates() && !causes.iter().any(is_of_it)
}

/// Whether a force that seems to be left out in these scenes has an effect under other methods: several of their scenes with it are
/// wrong without it as well, and others are right.
fn acts_elsewhere<'a>(
    change: &Change,
    shown: impl IntoIterator<Item = &'a usize>,
    scenes: &[Marked<'_>],
) -> bool {
    let shown = shown.into_iter();
    let methods: BTreeSet<&str> =
        shown.map(|number| scenes[*number].scene.integrator.name).collect();
    let is_of_force = matches!(change.place, Place::Force(_));
    let others: Vec<&Marked<'_>> = scenes
        .iter()
        .filter(|scene| {
            let has_forces = !scene.scene.forces.is_empty();
            has_forces && !methods.contains(scene.scene.integrator.name)
        })
        .collect();
    let acts = |scene: &&&Marked<'_>| change.acts_in(&scene.scene) && scene.is_left();
    let is_right = |scene: &&Marked<'_>| scene.is_settled();
    is_of_force && others.iter().filter(acts).count() >= FEW && others.iter().any(is_right)
}

/// Wrong scenes in which a cause acts, and that neither it nor another finding explains. A scene is explained where
/// something stands out that no right scene has, other than what the cause is about, or where most scenes of its method are wrong in
/// which the cause does not act. Newton's method ends nearly alike by most
/// matrices: a Jacobian that it alone shows has no excuse in steps of one iteration, which show each entry.
fn exceptions(
    cause: &Cause,
    scenes: &[Marked<'_>],
    to_look_at: &[Finding],
    shared: &[Shared],
) -> Vec<usize> {
    let own = Feature::from(cause.change().place);
    let is_by_newton = matches!(own, Feature::Jacobian(_))
        && cause.scenes.iter().all(|number| scenes[*number].is_newton());
    let wrong = search::wrong_otherwise(cause.change(), scenes);
    let is_excused = |number: &&usize| {
        // Something else makes numbers that are not finite at once.
        if scenes[**number].fails_at_once() {
            return true;
        }
        if is_by_newton && is_linearized(&scenes[**number]) {
            return false;
        }
        let inner = &scenes[**number].scene;
        if is_wrong_anyway(cause, inner, scenes) || !terms(inner).is_disjoint(&wrong) {
            return true;
        }
        let has_it = |finding: &Finding| finding.has(scenes[**number].judged.name);
        let mut others = to_look_at.iter().filter(|finding| !finding.features.contains(&own));
        let mut apart = shared.iter().filter(|one| one.apart.is_some() && one.apart != Some(own));
        others.any(has_it) || apart.any(|one| has_it(&one.finding))
    };
    cause.unexplained.iter().filter(|number| !is_excused(number)).copied().collect()
}

/// Whether most scenes with forces of a scene's method are wrong for no known reason in which a cause of a force does not act.
fn is_wrong_anyway(cause: &Cause, inner: &Scene, scenes: &[Marked<'_>]) -> bool {
    let change = cause.change();
    let is_of_force = matches!(change.place, Place::Force(_) | Place::Jacobian(_));
    let others = scenes.iter().filter(|scene| {
        scene.scene.integrator.name == inner.integrator.name
            && !scene.scene.forces.is_empty()
            && !change.acts_in(&scene.scene)
    });
    let (wrong, right): (Vec<&Marked<'_>>, Vec<&Marked<'_>>) =
        others.filter(|one| one.is_left() || one.is_settled()).partition(|one| one.is_left());
    is_of_force && wrong.len() >= FEW && wrong.len() > right.len()
}

/// Whether a cause is not said unless it is proven: one with a number, one that explains less than twice as many scenes as it
/// leaves, or less than three times as many as speak against it. Of a method, all others do; of a force or of all methods, those that have
/// nothing else in them.
fn is_vague(
    cause: &Cause,
    exceptions: &[usize],
    scenes: &[Marked<'_>],
    limits: &Thresholds,
) -> bool {
    let is_of_method = matches!(cause.change().place, Place::Integrator(_) | Place::FixedUnder(_));
    let is_against = |number: &&usize| {
        let inner = &scenes[**number].scene;
        let is_within = |outer: &usize| search::is_within(inner, &scenes[*outer].scene);
        is_of_method || cause.scenes.iter().any(is_within)
    };
    let explained = cause.scenes.len();
    cause.change().rank >= limits.far_fetched
        || explained < 2 * exceptions.len()
        || explained < 3 * exceptions.iter().filter(is_against).count()
}

/// Says less of features where a cause explains other scenes of them. If a force is wrong, its Jacobian may be right and fit no
/// more. Where masses are read wrongly, what they are a factor of may be right.
fn say_less(to_look_at: &mut Vec<Finding>, causes: &[Cause], scenes: &[Marked<'_>]) {
    let of_masses: Vec<&Change> =
        causes.iter().map(Cause::change).filter(|change| change.is_of_masses()).collect();
    let has_wrong_masses = |finding: &Finding| {
        let mut its = scenes.iter().filter(|scene| finding.has(scene.judged.name));
        its.all(|scene| of_masses.iter().any(|change| change.acts_in(&scene.scene)))
    };
    let is_of_masses = |feature: &Feature| match feature {
        Feature::Force(part) => part.schema().masses != Masses::None,
        _ => false,
    };
    to_look_at.retain(|one| !(one.features.iter().any(is_of_masses) && has_wrong_masses(one)));
    for finding in to_look_at {
        let [Feature::Jacobian(part)] = finding.features[..] else { continue };
        let force = Feature::Force(part);
        if causes.iter().any(|cause| Feature::from(cause.change().place) == force) {
            finding.features = vec![force];
            finding.words = vec![force.to_string()];
        }
    }
}

/// The finding on a cause, of this kind. The words of a mere feature are no change.
fn of_cause(cause: &Cause, kind: FindingKind, scenes: &[Marked<'_>], exceptions: usize) -> Finding {
    let mut features: Vec<Feature> =
        cause.alternatives.iter().map(|change| change.place.into()).collect();
    let numbers = cause.scenes.iter();
    if kind == FindingKind::Feature {
        let numbers = numbers.chain(&cause.unexplained);
        let words = features.iter().map(Feature::to_string).collect();
        return Finding::new(kind, features, words, names(numbers.map(|n| &scenes[*n])));
    }
    let mut words: Vec<String> =
        cause.alternatives.iter().map(|change| change.words.clone()).collect();
    if cause.change().leaves_all_forces_out() {
        let inner = cause.scenes.iter().map(|number| &scenes[*number].scene);
        let all: BTreeSet<Term> = inner.flat_map(terms).collect();
        features.extend(all.into_iter().map(|term| Feature::from(Place::Force(term))));
        words = vec![cause.change().words.clone(); features.len()];
    }
    let scenes = names(numbers.map(|number| &scenes[*number]));
    let finding = Finding::new(kind, features, words, scenes);
    Finding { open: cause.open, unexplained: exceptions, ..finding }
}

fn names<'a, 'b: 'a>(scenes: impl Iterator<Item = &'a Marked<'b>>) -> Vec<String> {
    scenes.map(|scene| scene.judged.name.to_owned()).collect()
}

/// The faults of the output; scenes that they spoil are explained.
fn outputs(scenes: &mut [Marked<'_>]) -> Vec<Finding> {
    let mut kinds: Vec<(Kind, Vec<usize>)> = Vec::new();
    for (number, scene) in scenes.iter_mut().enumerate() {
        let Some(kind) = scene.kind.clone().filter(|kind| kind.feature().is_some()) else {
            continue;
        };
        scene.explained = true;
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, numbers)) => numbers.push(number),
            None => kinds.push((kind, vec![number])),
        }
    }
    let is_time_step = |kind: &Kind| matches!(kind, Kind::TimeStep(_));
    // Times that count by the one time step are those of a constant dt.
    let (time_steps, mut kinds): (Vec<_>, Vec<_>) =
        kinds.into_iter().partition(|(kind, _)| is_time_step(kind));
    match time_steps.as_slice() {
        [_] if constant_step(scenes).is_some() => kinds.extend(time_steps),
        [] => {}
        _ => {
            let numbers = time_steps.into_iter().flat_map(|(_, numbers)| numbers).collect();
            let rule = time_step_rule(scenes).map(|rule| TIME_STEPS[rule].0);
            let rule = rule.map_or(Kind::Times, Kind::TimeSteps);
            kinds.push((rule, numbers));
        }
    }
    settle_open(&mut kinds);
    kinds.sort_by_key(|(_, numbers)| std::cmp::Reverse(numbers.len()));
    // A fault of most traces can look like another one in a few.
    let count = |(_, numbers): &(Kind, Vec<usize>)| numbers.len();
    let all: usize = kinds.iter().map(count).sum();
    if let Some(most) = kinds.first().filter(|first| 4 * count(first) >= 3 * all) {
        let most = most.0.clone();
        let is_clear = |kind: &Kind| {
            use Kind::{FixedLeftOut, StateTooFew, StateTooMany, TimeStep, TimeSteps};
            matches!(kind, TimeStep(_) | TimeSteps(_) | FixedLeftOut | StateTooFew | StateTooMany)
        };
        kinds.retain(|(kind, _)| *kind == most || is_clear(kind));
    }
    let mut list: Vec<Finding> = Vec::new();
    for (kind, numbers) in kinds {
        let features = kind.features();
        let found = names(numbers.iter().map(|number| &scenes[*number]));
        let known = list.iter_mut().find(|known| known.features == features);
        match known.filter(|_| kind != Kind::FixedLeftOut) {
            Some(known) => {
                known.add_scenes(found);
                if features == [Feature::States] {
                    let counted = rows::miscounted(scenes).unwrap_or_default();
                    known.words =
                        vec![format!("{}: too few or too many{counted}", Feature::States)];
                }
            }
            None => {
                let is_counted = features == [Feature::States];
                let counted = is_counted.then(|| rows::miscounted(scenes)).flatten();
                let sentence = kind.sentence() + &counted.unwrap_or_default();
                let words = vec![sentence; features.len()];
                list.push(Finding::new(FindingKind::Output, features, words, found));
            }
        }
    }
    list
}

/// The one time step by which wrong times count, of scenes of several, if no scene of another one passed.
fn constant_step(scenes: &[Marked<'_>]) -> Option<f64> {
    let wrong = scenes.iter().filter_map(|scene| match scene.judged.outcome {
        Outcome::OtherTimes(step) => Some((scene.judged.scene.time_step, step)),
        _ => None,
    });
    let wrong: Vec<(f64, f64)> = wrong.collect();
    let [(own, step), ..] = *wrong.as_slice() else { return None };
    let is_same = |other: f64| (other - step).abs() <= 1e-9 * step;
    let is_constant = wrong.iter().all(|(_, step)| is_same(*step))
        && wrong.iter().any(|(other, _)| *other != own)
        && scenes.iter().all(|scene| !scene.passed || is_same(scene.judged.scene.time_step));
    is_constant.then_some(step)
}

/// How the time step differs, of the traces whose times count by another one, by its place in [`TIME_STEPS`]: so in all of
/// these, and not at all in the scenes that passed.
fn time_step_rule(scenes: &[Marked<'_>]) -> Option<usize> {
    let is_so = |scene: &Marked<'_>, rule: fn(&Scene) -> f64| {
        let inner = scene.judged.scene;
        let step = match scene.judged.outcome {
            Outcome::OtherTimes(step) => step,
            _ if scene.passed => inner.time_step,
            _ => return true,
        };
        (rule(inner) - step).abs() <= 1e-9 * step
    };
    let is_of_all = |rule: &usize| scenes.iter().all(|scene| is_so(scene, TIME_STEPS[*rule].1));
    let mut rules = (0..TIME_STEPS.len()).filter(is_of_all);
    let rule = rules.next()?;
    rules.next().is_none().then_some(rule)
}

/// A way to change the time step of a scene, in words, and the time step.
type TimeStepRule = (&'static str, fn(&Scene) -> f64);

/// Ways to change the time step of a scene.
const TIME_STEPS: [TimeStepRule; 6] = [
    ("dt is the duration divided by the number of steps", |scene| {
        scene.duration / scene.n_steps() as f64
    }),
    ("dt is the duration divided by the number of steps, rounded down", |scene| {
        scene.duration / (scene.duration / scene.time_step).floor()
    }),
    ("dt is rounded to 2 decimals", |scene| (scene.time_step * 1e2).round() / 1e2),
    ("dt is rounded to 3 decimals", |scene| (scene.time_step * 1e3).round() / 1e3),
    ("dt is rounded to 4 decimals", |scene| (scene.time_step * 1e4).round() / 1e4),
    ("dt is rounded to single precision", |scene| f64::from(scene.time_step as f32)),
];

/// Gives the scenes that do not tell reading from writing to the kind that others tell: under forces that look alike in
/// both orders, a scene read so is one written so.
fn settle_open(kinds: &mut Vec<(Kind, Vec<usize>)>) {
    for (open, read, written) in [
        (Kind::OrderOpen, Kind::OrderRead, Kind::Order),
        (Kind::InitialOpen, Kind::InitialState, Kind::InitialWritten),
    ] {
        let has = |kind: &Kind| kinds.iter().any(|(known, _)| known == kind);
        let known = match (has(&read), has(&written)) {
            (true, false) => read,
            (false, true) => written,
            _ => continue,
        };
        if let Some(place) = kinds.iter().position(|(kind, _)| *kind == open) {
            let (_, numbers) = kinds.remove(place);
            if let Some((_, all)) = kinds.iter_mut().find(|(kind, _)| *kind == known) {
                all.extend(numbers);
            }
        }
    }
}

/// Adds to the finding on the precision the scenes that it explains, although their numbers are off by more than one rounding:
/// each step is right, or nearly so in single precision.
fn take_rounded(scenes: &mut [Marked<'_>], list: &mut [Finding]) {
    let is_precision = |finding: &&mut Finding| finding.features == [Feature::Precision];
    let Some(finding) = list.iter_mut().find(is_precision) else { return };
    let is_rounded = |scene: &&mut Marked<'_>| {
        let is_open = scene.kind == Some(Kind::Wrong) && !scene.explained && scene.rounding > 0.0;
        let is_near = || scene.steps.single_precision && scene.is_near();
        is_open && (scene.steps.wrong == 0 || is_near())
    };
    for scene in scenes.iter_mut().filter(is_rounded) {
        scene.explained = true;
        finding.scenes.push(scene.judged.name.to_owned());
    }
}

/// The first wrong step of implicit Euler that satisfies its own equation, counted from 1.
fn other_root(scene: &Marked<'_>) -> Option<u64> {
    let roots = Roots::of(scene.judged.scene).filter(|_| scene.is_suspect())?;
    let first = scene.evidence.iter().find(|evidence| evidence.is_wrong())?;
    let Evidence { sample, defect, .. } = first;
    let size = sample.after.velocities.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let is_solved =
        roots.solves(sample.step, sample.earlier.as_ref(), &sample.before, &sample.after);
    (is_solved && defect[1] > 1e-5 * size).then_some(sample.step + 1)
}

fn other_roots(scenes: &mut [Marked<'_>], roots: &[Option<u64>]) -> Option<Finding> {
    let mut found = Vec::new();
    let mut feature = None;
    for (scene, _) in scenes.iter_mut().zip(roots).filter(|(_, root)| root.is_some()) {
        (scene.explained, scene.has_other_root) = (true, true);
        feature = Some(Feature::Integrator(scene.judged.scene.integrator.name));
        found.push(scene.judged.name.to_owned());
    }
    let words = "Newton's method ends at another solution than from the old velocities";
    Some(Finding::new(FindingKind::OtherRoot, vec![feature?], vec![words.to_owned()], found))
}

/// Whether a step is one step of Newton's method.
fn is_linearized(scene: &Marked<'_>) -> bool {
    let integrator = scene.judged.scene.integrator;
    integrator.convergence == Convergence::Direct && integrator.matrix == Matrix::Jacobians
}

/// The features to look at: the one whose scenes are exactly those that are wrong for no proven reason, or those that
/// remain when every feature of a right scene is set aside.
fn features(scenes: &[Marked<'_>], causes: &[Cause]) -> Vec<Finding> {
    // The steps of a program that lacks a method are no evidence of its other features.
    let is_missing = |method| {
        let of_method = |c: &Cause| Feature::from(c.change().place) == Feature::Integrator(method);
        causes.iter().any(|cause| is_lack(cause, causes) && of_method(cause))
    };
    let failing = scenes.iter().filter(|scene| is_unexplained(scene));
    let failing: Vec<&Marked<'_>> =
        failing.filter(|scene| !is_missing(scene.judged.scene.integrator.name)).collect();
    let lacks =
        |number: usize| causes.iter().any(|c| is_lack(c, causes) && c.scenes.contains(&number));
    let right = scenes.iter().enumerate().filter(|(number, scene)| {
        scene.passed || (scene.explained && scene.steps.total > 0 && !lacks(*number))
    });
    let right: Vec<&Scene> = right.map(|(_, scene)| scene.judged.scene).collect();
    let made: Vec<Change> = causes.iter().map(|cause| cause.change().clone()).collect();
    let wrong: Vec<Failing<'_>> = failing.par_iter().map(|scene| scene.failing(&made)).collect();
    let mut found = match scope::only(&wrong, &right, FEW) {
        Some((Feature::Everything, ..)) => Vec::new(),
        Some(only) => vec![only],
        None => scope::eliminated(&wrong, &right, FEW),
    };
    // Rounds have separate formulas of springs, which are tasks.
    let is_of_rounds = failing.iter().all(|scene| rounds::is_of_rounds(scene.judged.scene));
    let is_spring = |feature: &Feature| match feature {
        Feature::Force(part) | Feature::Jacobian(part) => part.tag() == "springforce",
        _ => false,
    };
    found.retain(|(feature, ..)| !(is_of_rounds && is_spring(feature)));
    // A wrong Jacobian leads Newton's method astray. One step of it, in a scene that passed, shows a right one.
    let passed = scenes.iter().filter(|scene| scene.passed && is_linearized(scene));
    let known: BTreeSet<Term> = passed.flat_map(|scene| terms(scene.judged.scene)).collect();
    // So does a wrong linear system or solver that is found in another method.
    let is_of_system = made.iter().any(Change::is_of_system);
    found.retain(|(feature, _, numbers)| {
        let is_open = |number: &usize| {
            let scene = failing[*number];
            scene.is_newton() && (is_of_system || !terms(scene.judged.scene).is_subset(&known))
        };
        !(matches!(feature, Feature::Integrator(_)) && numbers.iter().any(is_open))
    });
    let finding = |guilty| of_guilty(FindingKind::Feature, guilty, &failing);
    found.into_iter().map(finding).collect()
}

/// Whether a scene is wrong for no known reason. One without a wrong step shows nothing, unless it is too large for its
/// steps to be examined.
fn is_unexplained(scene: &Marked<'_>) -> bool {
    let is_wrong =
        scene.is_suspect() || scene.kind == Some(Kind::Wrong) && !is_recorded(scene.judged.scene);
    is_wrong && !scene.explained && !scene.open
}

/// The finding on a feature whose scenes fail.
fn of_guilty(
    kind: FindingKind,
    (feature, detail, numbers): scope::Guilty,
    failing: &[&Marked<'_>],
) -> Finding {
    let words = match detail.as_str() {
        "" => feature.to_string(),
        detail => format!("{feature}, {detail}"),
    };
    let scenes = names(numbers.into_iter().map(|number| failing[number]));
    Finding::new(kind, vec![feature], vec![words], scenes)
}

/// The features whose scenes are exactly those that crash, report an error, do not end, or take too much memory.
fn ends(scenes: &[Marked<'_>], named: &[Change]) -> Vec<Finding> {
    let is_there = |place: Place, scene: &Scene| match place {
        Place::Force(term) | Place::Jacobian(term) => {
            terms(scene).into_iter().any(|one| term.includes(one))
        }
        _ => true,
    };
    let acts = |scene: &&Marked<'_>| {
        let inner = &scene.scene;
        named.iter().any(|change| change.must_act_in(inner) && is_there(change.place, inner))
    };
    let of = |(symptom, failing): (Symptom, Vec<&Marked<'_>>)| -> Vec<Finding> {
        // Another mistake may end the program in scenes in which it acts.
        if failing.iter().all(acts) {
            let scenes = names(failing.iter().copied());
            let kind = FindingKind::Ends(symptom);
            return vec![Finding::new(kind, Vec::new(), vec![NAMED.to_owned()], scenes)];
        }
        let has_run = |scene: &&Marked<'_>| scene.passed || scene.judged.states.len() > 1;
        let ran: Vec<&Marked<'_>> = scenes.iter().filter(has_run).collect();
        let right: Vec<&Scene> = ran.iter().map(|scene| scene.judged.scene).collect();
        let wrong = failing.iter().map(|scene| Failing::of(scene.judged.scene));
        let wrong: Vec<Failing<'_>> = wrong.collect();
        let found = match scope::only(&wrong, &right, FEW) {
            Some(only) => vec![only],
            None => scope::eliminated(&wrong, &right, FEW),
        };
        let is_one_message = symptom == Symptom::Error
            && failing.windows(2).all(|pair| pair[0].judged.outcome == pair[1].judged.outcome);
        if found.is_empty() && is_one_message {
            // A common property of these scenes says less than the message.
            return vec![shared::unnamed(symptom.to_string(), &failing)];
        }
        if found.is_empty() {
            let right: Vec<Right<'_>> = ran.into_iter().map(Right::of).collect();
            let groups = shared::groups(failing, &right, &format!("{symptom}; "));
            return groups.into_iter().map(|shared| shared.finding).collect();
        }
        let is_singular = failing.iter().all(|scene| match &scene.judged.outcome {
            Outcome::Stopped(line) => line.to_lowercase().contains("singular"),
            _ => false,
        });
        let finding = |guilty| {
            let mut finding = of_guilty(FindingKind::Ends(symptom), guilty, &failing);
            let is_of_rows = is_singular && finding.features == [Feature::Fixed(Family::Implicit)];
            let rows = if is_of_rows { SINGULAR } else { "" };
            finding.words.iter_mut().for_each(|words| words.push_str(rows));
            finding
        };
        found.into_iter().map(finding).collect()
    };
    let symptoms = Symptom::ALL.into_iter().filter(|symptom| *symptom != Symptom::Wrong);
    let groups = symptoms.flat_map(|symptom| {
        let is_it =
            |scene: &&Marked<'_>| scene.kind.as_ref().is_some_and(|kind| kind.symptom() == symptom);
        let groups = by_message(scenes.iter().filter(is_it).collect());
        groups.into_iter().map(move |failing| (symptom, failing))
    });
    groups.flat_map(of).collect()
}

/// These scenes, none or some that end with one message each: all together where there are many messages.
fn by_message<'a, 'b>(failing: Vec<&'a Marked<'b>>) -> Vec<Vec<&'a Marked<'b>>> {
    let words = |scene: &Marked<'_>| match &scene.judged.outcome {
        Outcome::Stopped(line) => line.replace(|c: char| c.is_ascii_digit(), ""),
        _ => String::new(),
    };
    let mut groups: Vec<(String, Vec<&Marked<'_>>)> = Vec::new();
    for scene in &failing {
        let message = words(scene);
        match groups.iter_mut().find(|(known, _)| *known == message) {
            Some((_, group)) => group.push(scene),
            None => groups.push((message, vec![scene])),
        }
    }
    match groups.len() {
        0 => Vec::new(),
        1..=MESSAGES => groups.into_iter().map(|(_, group)| group).collect(),
        _ => vec![failing],
    }
}

/// The features that the program says it lacks, one finding for each name.
fn refused(scenes: &[Marked<'_>], list: &mut [Finding]) -> Vec<Finding> {
    let mut found: Vec<(Option<String>, Vec<&Marked<'_>>)> = Vec::new();
    for scene in scenes {
        let Outcome::Refused(lacks) = &scene.judged.outcome else { continue };
        // Without a name, it is that of the integrator or force whose scenes are all refused, if others are not.
        let is_refused = |other: &Marked<'_>| matches!(other.judged.outcome, Outcome::Refused(_));
        let refuses_all = |has: &dyn Fn(&Scene) -> bool| {
            let mut its = scenes.iter().filter(|other| has(other.judged.scene));
            its.all(is_refused) && !scenes.iter().all(is_refused)
        };
        let name = scene.judged.scene.integrator.name;
        let tags = scene.judged.scene.forces.iter().map(|element| element.schema.tag);
        let its_name = || match refuses_all(&|scene| scene.integrator.name == name) {
            true => Some(name),
            false => tags.into_iter().find(|tag| {
                let has = |scene: &Scene| scene.forces.iter().any(|e| e.schema.tag == *tag);
                refuses_all(&has)
            }),
        };
        let lacks = lacks.clone().or_else(|| its_name().map(str::to_owned));
        match found.iter_mut().find(|(known, _)| *known == lacks) {
            Some((_, scenes)) => scenes.push(scene),
            None => found.push((lacks, vec![scene])),
        }
    }
    found.sort_by_key(|(_, scenes)| scenes.iter().map(|scene| scene.simplicity()).min());
    let finding = |(lacks, scenes): (Option<String>, Vec<&Marked<'_>>)| {
        let integrator = simulator::vocabulary();
        let feature = match &lacks {
            Some(name) => match integrator.integrator(name) {
                Some(schema) => Feature::Integrator(schema.name),
                None => integrator
                    .force(name)
                    .map_or(Feature::Everything, |schema| Feature::Force(Part::of(schema)[0])),
            },
            None => Feature::Everything,
        };
        let words = lacks.unwrap_or_else(|| {
            "the program refuses scenes, and names no force, method or format that it lacks"
                .to_owned()
        });
        let scenes = names(scenes.into_iter());
        let known = list.iter_mut().find(|known| {
            known.kind == FindingKind::NotImplemented && known.words.first() == Some(&words)
        });
        match known {
            Some(known) => {
                known.add_scenes(scenes);
                None
            }
            None => {
                Some(Finding::new(FindingKind::NotImplemented, vec![feature], vec![words], scenes))
            }
        }
    };
    found.into_iter().filter_map(finding).collect()
}

/// The implemented features, and the simplest scene with one that is missing.
fn progress(judged: &[JudgedScene<'_>], found: &[Found], list: &[Finding]) -> Option<Progress> {
    let is_lacking = |(scene, found): &(&JudgedScene<'_>, &Found)| {
        found.lacks.is_some() || matches!(scene.outcome, Outcome::Refused(_))
    };
    let lacking: Vec<&JudgedScene<'_>> =
        judged.iter().zip(found).filter(is_lacking).map(|(scene, _)| scene).collect();
    if lacking.is_empty() || !list.iter().any(|f| f.kind.is_lack()) {
        return None;
    }
    let passed = || judged.iter().filter(|scene| scene.outcome == Outcome::Passed);
    // A feature that a finding names is not listed as implemented.
    let named = || list.iter().flat_map(|finding| &finding.features);
    let mut implemented = Vec::new();
    if passed().any(|scene| scene.scene.forces.is_empty()) {
        implemented.push("free motion".to_owned());
    }
    for kind in force::REGISTRY {
        let has = |scene: &Scene| scene.forces.iter().any(|e| e.schema.tag == kind.schema.tag);
        let tag = kind.schema.tag;
        let is_named = named().any(|f| matches!(f, Feature::Force(part) if part.tag() == tag));
        if !is_named && passed().any(|scene| has(scene.scene)) {
            implemented.push(kind.schema.title.to_owned());
        }
    }
    for kind in integrator::REGISTRY {
        let is_of =
            |scene: &Scene| scene.integrator.name == kind.schema.name && !scene.forces.is_empty();
        let is_named = named().any(|f| *f == Feature::Integrator(kind.schema.name));
        if !is_named && passed().any(|scene| is_of(scene.scene)) {
            implemented.push(kind.schema.name.to_owned());
        }
    }
    // All else comes after what is required.
    let is_wrong = |scene: &JudgedScene<'_>| scene.is_required && scene.outcome != Outcome::Passed;
    let waits = judged.iter().any(is_wrong);
    let next = lacking.iter().filter(|scene| scene.is_required || !waits);
    let next = next.min_by_key(|scene| simplicity(scene.scene)).map(|scene| {
        let inner = scene.scene;
        let mut titles: Vec<&str> = Vec::new();
        for element in &inner.forces {
            if !titles.contains(&element.schema.title) {
                titles.push(element.schema.title);
            }
        }
        let what = if titles.is_empty() { "free motion".to_owned() } else { titles.join(" and ") };
        (format!("{what} under {}", inner.integrator.name), scene.name.to_owned())
    });
    if implemented.is_empty() && lacking.len() == judged.len() {
        implemented.push("nothing yet".to_owned());
    }
    Some(Progress { implemented, next })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::change::Quantity;
    use crate::change::candidates;

    /// A scene without steps, of this method and with gravitation, or a field.
    fn scene_with(integrator: &str, is_gravitation: bool) -> Scene {
        let force = match is_gravitation {
            true => r#"<gravitationalforce i="0" j="1" G="1"/>"#,
            false => r#"<simplegravity fx="0" fy="1"/>"#,
        };
        let text = format!(
            r#"<scene> <duration time="1"/> <integrator type="{integrator}" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>
  <particle m="1" px="1" py="0" vx="0" vy="0" fixed="0"/>
  {force}
</scene>"#
        );
        let options = scene::ParseOptions::default();
        let parsed = scene::xml::parse(&text, "a.xml", &simulator::vocabulary(), &options);
        parsed.expect("a scene").scene
    }

    /// One with gravitation.
    fn scene(integrator: &str) -> Scene {
        scene_with(integrator, true)
    }

    fn judged<'a>(name: &'a str, scene: &'a Scene) -> JudgedScene<'a> {
        JudgedScene::wrong(name, scene, &[])
    }

    #[test]
    fn steps_of_one_iteration_speak_against_a_jacobian_that_newtons_method_alone_shows() {
        let [newton, linearized] = ["implicit-euler", "linearized-implicit-euler"].map(scene);
        let limits = Thresholds::default();
        let judged = [judged("newton", &newton), judged("linearized", &linearized)];
        let evidence = judged.each_ref().map(|one| SceneEvidence::of(one, &limits));
        let scenes = evidence.each_ref().map(Marked::new);
        let method = vec![Feature::Integrator("linearized-implicit-euler")];
        let of_method =
            Finding::new(FindingKind::Feature, method, Vec::new(), vec!["linearized".to_owned()]);
        let gravitation = Term { tag: "gravitationalforce", part: "" };
        let of = |quantity: &'static [Quantity], explained: usize| {
            let change = candidates::factor(gravitation, quantity, 0.0);
            let cause = Cause::of_scenes(change, vec![explained], vec![1]);
            exceptions(&cause, &scenes, std::slice::from_ref(&of_method), &[])
        };
        assert_eq!(of(&[Quantity::ByPosition], 0), [1]);
        // A finding on the method explains its scenes otherwise.
        assert!(of(&[Quantity::ByPosition], 1).is_empty());
        assert!(of(&[Quantity::Force], 0).is_empty());
    }

    #[test]
    fn a_scene_that_was_not_run_is_not_quoted() {
        let scene = scene("explicit-euler");
        let limits = Thresholds::default();
        let stopped = |name, was_run| JudgedScene {
            outcome: Outcome::Stopped("singular matrix".to_owned()),
            was_run,
            ..judged(name, &scene)
        };
        let judged = [stopped("a", false), stopped("b", true), stopped("c", false)];
        let evidence = judged.each_ref().map(|one| SceneEvidence::of(one, &limits));
        let scenes = evidence.each_ref().map(Marked::new);
        let kind = FindingKind::Ends(Symptom::Error);
        let names = judged.iter().map(|one| one.name.to_owned()).collect();
        let finding = Finding::new(kind, Vec::new(), Vec::new(), names);
        let words = "in b: \"singular matrix\"; 2 not run, after others that ended alike";
        assert_eq!(example(&finding, &scenes).as_deref(), Some(words));
    }

    #[test]
    fn scenes_of_a_method_that_is_wrong_without_a_force_do_not_speak_against_it() {
        let explicit = scene("explicit-euler");
        let implicit = [true, false, false].map(|is_it| scene_with("implicit-euler", is_it));
        let limits = Thresholds::default();
        let all = [&explicit, &implicit[0], &implicit[1], &implicit[2]];
        let judged = all.map(|one| judged("a", one));
        let mut evidence = judged.each_ref().map(|one| SceneEvidence::of(one, &limits));
        evidence.iter_mut().for_each(|one| one.steps.wrong = 1);
        let gravitation = Term { tag: "gravitationalforce", part: "" };
        let doubled = candidates::factor(gravitation, &[Quantity::Force], 2.0);
        let cause = Cause::of_scenes(doubled, vec![0], vec![1]);
        let scenes = evidence.each_ref().map(Marked::new);
        assert!(exceptions(&cause, &scenes, &[], &[]).is_empty());
        let mut right = evidence.each_ref().map(Marked::new);
        right[3].explained = true;
        assert_eq!(exceptions(&cause, &right, &[], &[]), [1]);
    }

    #[test]
    fn forces_with_masses_are_not_to_be_looked_at_where_masses_are_read_wrongly() {
        let both = ["linearized-implicit-euler", "explicit-euler"];
        let inner = both.map(scene);
        let limits = Thresholds::default();
        let judged = [0, 1].map(|one| judged(both[one], &inner[one]));
        let evidence = judged.each_ref().map(|one| SceneEvidence::of(one, &limits));
        let scenes = evidence.each_ref().map(Marked::new);
        let of_masses = candidates::of_integrator(&inner[0]);
        let of_masses =
            of_masses.into_iter().find(Change::is_of_masses).expect("a change of masses");
        let cause = Cause::of_scenes(of_masses, vec![0], Vec::new());
        let gravitation = Feature::Force(Part::All("gravitationalforce"));
        let is_said = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            let (kind, features) = (FindingKind::Feature, vec![gravitation]);
            let mut list = vec![Finding::new(kind, features, Vec::new(), names)];
            say_less(&mut list, std::slice::from_ref(&cause), &scenes);
            !list.is_empty()
        };
        assert!(!is_said(&both[..1]));
        assert!(is_said(&both));
    }

    #[test]
    fn what_is_not_proven_explains_three_times_as_many_scenes_as_speak_against_it() {
        let inner = scene("explicit-euler");
        let limits = Thresholds::default();
        let judged = judged("a", &inner);
        let evidence = SceneEvidence::of(&judged, &limits);
        let change = candidates::replacements(&inner).remove(0);
        let is_vague = |explained: usize| {
            let cause = Cause::of_scenes(change.clone(), vec![0; explained], Vec::new());
            is_vague(&cause, &[0, 0], &[Marked::new(&evidence)], &limits)
        };
        assert!(is_vague(5) && !is_vague(6));
    }
}
