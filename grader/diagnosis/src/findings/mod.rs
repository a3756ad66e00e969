//! Findings: what is wrong in a submission, each with its evidence. Every report shows this one list.
//!
//! ```text
//! traces ── form.rs       faults of the output, settled first
//!        ── evidence.rs   which steps are wrong by themselves; replay of whole scenes with a change
//!        ── fit.rs        numbers in changes, from the steps
//!        ── search.rs     changes that make the same steps, proven by replay; up to three mistakes together
//!        ── scope.rs      what is left: a feature, where exactly its scenes fail
//!        ── tasks.rs      what that says of each task of the hand-out on rounds
//! ```
//!
//! Better to say less than to say what is not so. A cause is named if whole scenes, stepped with the mistake put in, are
//! the submission's traces, and the scenes that passed stay as they are. A feature is named without a cause if it is the
//! only one whose scenes are exactly those that fail. Otherwise nothing is named.

mod evidence;
mod feature;
mod fit;
mod form;
mod judged;
mod scope;
mod search;
mod tasks;
mod thresholds;
mod trace;

use std::collections::BTreeSet;
use std::fmt;

use crate::change::{Change, Place, Term, rounds};
use rayon::prelude::*;
use scene::schema::{Convergence, Matrix};
use scene::{ForceElement, Scene};
use simulator::force;
use simulator::integrator;

use crate::explanation::Explanation;
use crate::roots::Roots;
use crate::steps::Evidence;

use evidence::{Marked, SceneEvidence};
pub use feature::{Family, Feature, Part, Symptom};
use form::Kind;
pub use judged::{ContextRow, Diagnosis, FirstWrong, Found, JudgedScene, Outcome, Restarts};
use scope::Failing;
use search::{Assignment, Cause};
pub use tasks::of_passed as tasks_of_passed;
pub use tasks::{TaskFinding, TaskVerdict};
pub use thresholds::Thresholds;
pub use trace::is_recorded;

/// Minimum number of failing scenes from which a feature is inferred.
const FEW: usize = 2;

/// Maximum number of groups of wrong scenes that share something.
const GROUPS: usize = 3;

/// Wrong scenes that one right scene with the same property outweighs.
const PASSING: usize = 4;

/// What was found in a submission.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Findings {
    /// The findings, in the order in which a student should read them.
    pub list: Vec<Finding>,
    /// What is implemented and what to do next; `None` if the submission lacks nothing, or has nothing.
    pub progress: Option<Progress>,
    /// The tasks of the hand-out on rounds of local and global steps; empty unless all scenes are of that method.
    pub tasks: Vec<TaskFinding>,
}

/// A finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Its kind.
    pub kind: FindingKind,
    /// The feature at fault; several if each explains everything alike.
    pub features: Vec<Feature>,
    /// The mistake as a sentence, one for each feature; the same for features at fault together, which follow each other.
    pub words: Vec<String>,
    /// The scenes that it explains, by name.
    pub scenes: Vec<String>,
    /// Scenes in which Newton's method converges slowly or not at all with the mistake: neither for nor against it.
    pub open: usize,
    /// Wrong scenes in which the mistake acts, and that no finding explains; 0 if it is proven.
    pub unexplained: usize,
}

/// How sure a finding is, and of what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FindingKind {
    /// A fault of the output.
    Output,
    /// A mistake, proven by replay: with the others that are named, it makes every wrong scene in which it acts, but for
    /// those that another finding explains.
    Cause,
    /// A mistake that makes most of the wrong scenes in which it acts, and not all.
    Possible,
    /// A feature whose scenes are wrong, without a cause.
    Feature,
    /// Runs that crash, do not end or take too much memory.
    Ends(Symptom),
    /// Implicit steps that satisfy their equation, with another solution.
    OtherRoot,
    /// What scenes that are wrong for no known reason have in common. It may be right.
    Common,
    /// A feature that is not there.
    NotImplemented,
}

impl FindingKind {
    /// The machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Output => "output",
            Self::Cause => "cause",
            Self::Possible => "possible-cause",
            Self::Feature => "feature",
            Self::Ends(symptom) => symptom.name(),
            Self::OtherRoot => "other-root",
            Self::Common => "common",
            Self::NotImplemented => "not-implemented",
        }
    }
}

impl Finding {
    /// The finding as a sentence.
    pub fn sentence(&self) -> String {
        let mut all = self.words.clone();
        all.dedup();
        let all = all.join(", or ");
        match self.kind {
            FindingKind::Feature => format!("Look at {all}"),
            FindingKind::NotImplemented => format!("Not implemented: {all}"),
            FindingKind::Ends(symptom) => format!("{symptom}: {all}"),
            FindingKind::Possible => format!("Perhaps {all}"),
            FindingKind::Common => format!("No cause found; {all}"),
            FindingKind::Output | FindingKind::Cause | FindingKind::OtherRoot => all,
        }
    }

    /// The order in which features that are not there should be made: that of the registries.
    fn in_order_of_work(&self) -> usize {
        let forces = force::REGISTRY.len();
        match (self.kind, self.features.first()) {
            (FindingKind::NotImplemented, Some(Feature::Force(part))) => {
                force::REGISTRY.iter().position(|kind| kind.schema.tag == part.tag()).unwrap_or(0)
            }
            (FindingKind::NotImplemented, Some(Feature::Integrator(name))) => {
                let place = integrator::REGISTRY.iter().position(|kind| kind.schema.name == *name);
                forces + place.unwrap_or(0)
            }
            _ => 0,
        }
    }

    /// What the findings take for granted: the symbols of formulas, and the hand-outs' sign convention.
    pub fn notes<'a>(list: impl Iterator<Item = &'a Self> + Clone) -> Vec<&'static str> {
        let is_of_change =
            |finding: &&Self| matches!(finding.kind, FindingKind::Cause | FindingKind::Possible);
        let causes = || list.clone().filter(is_of_change);
        let is_of_pair = |feature: &Feature| match feature {
            Feature::Force(part) | Feature::Jacobian(part) => part.schema().stencil.size() == 2,
            _ => false,
        };
        let is_symbol = |word: &str| ["d", "l", "n", "w", "nᵀ", "wᵀ", "n·w"].contains(&word);
        let mut words = causes()
            .filter(|finding| finding.features.iter().any(is_of_pair))
            .flat_map(|finding| &finding.words)
            .flat_map(|words| words.split(|c: char| c.is_whitespace() || "(),/".contains(c)));
        let is_jacobian = |finding: &Self| {
            finding.features.iter().all(|feature| matches!(feature, Feature::Jacobian(_)))
        };
        let mut notes = Vec::new();
        if words.any(is_symbol) {
            notes.push("Of particles i and j: d = x_i − x_j, l = |d|, n = d/l, w = v_i − v_j.");
        }
        if causes().any(is_jacobian) {
            notes.push(
                "If your code follows the starter code, accumulateddUdxdx adds −dF/dx and accumulateddUdxdv adds −dF/dv.",
            );
        }
        notes
    }

    /// The evidence in words.
    pub fn evidence(&self) -> String {
        let count = self.scenes.len();
        let scenes = |count: usize| {
            if count == 1 { "1 scene".to_owned() } else { format!("{count} scenes") }
        };
        let open = match self.open {
            0 => String::new(),
            open => format!(
                "; {open} more say nothing of it, as Newton's method hardly converges with this mistake"
            ),
        };
        match self.kind {
            FindingKind::Cause => {
                let all = scenes(count);
                format!("proven: reproduces your traces in {count} of {all} where it acts{open}")
            }
            FindingKind::Possible => {
                let all = scenes(count + self.unexplained);
                format!(
                    "not proven: reproduces your traces in {count} of {all} that are wrong where it acts{open}"
                )
            }
            FindingKind::Feature => {
                format!("wrong in {}; no change that grade tries explains it", scenes(count))
            }
            FindingKind::OtherRoot => {
                format!("{}: the step solves the same equation; another solution", scenes(count))
            }
            FindingKind::Output
            | FindingKind::Ends(_)
            | FindingKind::Common
            | FindingKind::NotImplemented => scenes(count),
        }
    }

    /// The finding on a program whose repeated runs of these scenes differ: no other finding is sure then.
    pub fn of_differing_runs(scenes: Vec<String>) -> Self {
        let words = "the program is not deterministic: the same scene gives different traces, as where a variable is \
                     used before it is set; what else is said may change from run to run";
        Self {
            kind: FindingKind::Output,
            features: vec![Feature::Output],
            words: vec![words.to_owned()],
            scenes,
            open: 0,
            unexplained: 0,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.sentence(), self.evidence())
    }
}

/// What an unfinished submission has, and what comes next.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// What is implemented.
    pub implemented: Vec<String>,
    /// The simplest required thing that is not there, or another one once nothing required is wrong: in words, and a scene.
    pub next: Option<(String, String)>,
}

impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Implemented: {}", self.implemented.join(", "))?;
        match &self.next {
            Some((what, scene)) => write!(f, "; next: {what}, scene {scene}"),
            None => Ok(()),
        }
    }
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
    let of_force = |tag: &str| force::REGISTRY.iter().position(|kind| kind.schema.tag == tag);
    let last = scene.forces.iter().filter_map(|element| of_force(element.schema.tag)).max();
    let order = integrator::REGISTRY.iter().position(|k| k.schema.name == scene.integrator.name);
    let (force, order) = (last.unwrap_or(0), order.unwrap_or(usize::MAX));
    [terms(scene).len(), force, order, scene.particles.len(), scene.forces.len()]
}

impl Findings {
    /// Looks for what is wrong in a submission, from all its scenes together. Returns the findings, and what is found in
    /// each scene.
    pub fn of(judged: &[JudgedScene<'_>], limits: &Thresholds) -> (Self, Vec<Found>) {
        let evidence = judged.par_iter().map(|judged| SceneEvidence::of(judged, limits));
        let evidence: Vec<SceneEvidence<'_>> = evidence.collect();
        let mut scenes: Vec<Marked<'_>> = evidence.iter().map(Marked::new).collect();
        // A message of the compiler is in the report already.
        if scenes.iter().any(|scene| scene.kind == Some(Kind::NotBuilt)) {
            return (Self::default(), vec![Found::default(); judged.len()]);
        }
        let roots: Vec<Option<u64>> = scenes.par_iter().map(other_root).collect();
        let mut list = outputs(&mut scenes);
        let other_roots = other_roots(&mut scenes, &roots);
        let Assignment { mut scenes, causes } = search::causes(&scenes, limits);
        // A wrong Jacobian leads Newton's method elsewhere.
        let has_wrong_jacobian = scenes
            .iter()
            .any(|scene| scene.is_suspect() && !scene.explained && is_linearized(scene));
        let is_known = |cause: &Cause| matches!(cause.change().place, Place::Jacobian(_));
        if !has_wrong_jacobian && !causes.iter().any(is_known) {
            list.extend(other_roots);
        }
        take_rounded(&mut scenes, &mut list);
        let mut to_look_at = features(&scenes, &causes);
        let shared = common(&scenes, &to_look_at);
        // What a program does in place of a method that it lacks is no evidence of that method.
        let lacking: Vec<Feature> = causes
            .iter()
            .filter(|cause| is_lack(cause, &causes))
            .map(|cause| cause.change().place.into())
            .collect();
        let is_of_lacking = |place: Place| matches!(place, Place::FixedUnder(name) if lacking.contains(&Feature::Integrator(name)));
        for cause in causes.iter().filter(|cause| !is_of_lacking(cause.change().place)) {
            let exceptions = exceptions(cause, &scenes, &to_look_at, &shared);
            // The words of a change with a number, or of one that explains the fewer scenes, are said only if it is proven.
            let is_vague =
                cause.change().rank >= limits.far_fetched || cause.scenes.len() <= exceptions;
            let kind = match exceptions {
                _ if is_lack(cause, &causes) => FindingKind::NotImplemented,
                0 => FindingKind::Cause,
                _ if is_vague => FindingKind::Feature,
                _ => FindingKind::Possible,
            };
            let finding = of_cause(cause, kind, &scenes, exceptions);
            if finding.kind != FindingKind::Feature {
                list.push(finding);
                continue;
            }
            match to_look_at.iter_mut().find(|known| known.features == finding.features) {
                Some(known) => known.scenes.extend(finding.scenes),
                None => to_look_at.push(finding),
            }
        }
        list.extend(to_look_at);
        list.extend(shared.into_iter().map(|shared| shared.finding));
        list.extend(ends(&scenes));
        let mut found = Vec::new();
        for (number, (scene, root)) in scenes.iter().zip(&roots).enumerate() {
            let lacks = causes.iter().find(|c| is_lack(c, &causes) && c.scenes.contains(&number));
            let lacks = lacks.map(|cause| cause.change().words.clone());
            let is_wrong = !scene.passed && scene.steps.total > 0;
            let diagnosis = is_wrong.then(|| {
                let acting = causes
                    .iter()
                    .filter(|cause| cause.scenes.contains(&number) && scene.explained)
                    .filter(|cause| cause.change().acts_in(scene.judged.scene));
                let changes: Vec<Change> = acting.map(|cause| cause.change().clone()).collect();
                Diagnosis {
                    steps: scene.steps.clone(),
                    causes: changes.iter().map(|change| change.words.clone()).collect(),
                    other_root: *root,
                    restarts: None,
                    explanation: Explanation::of(scene.judged.scene, &scene.evidence, &changes),
                }
            });
            found.push(Found { diagnosis, lacks });
        }
        let unnamed = refused(&scenes, &mut list);
        let tasks = tasks::of(&scenes, &list);
        list.extend(unnamed);
        drop_lacking(&mut list);
        // Stable: causes keep the order in which they were found.
        list.sort_by_key(|finding| (finding.kind, finding.in_order_of_work()));
        let progress = progress(judged, &found, &list);
        (Self { list, progress, tasks }, found)
    }
}

/// Drops the advice to look at a force that is not there.
fn drop_lacking(list: &mut Vec<Finding>) {
    let tag = |feature: &Feature| match feature {
        Feature::Force(part) | Feature::Jacobian(part) => Some(part.tag()),
        _ => None,
    };
    let lacks = list.iter().filter(|finding| finding.kind == FindingKind::NotImplemented);
    let lacking: Vec<&str> = lacks.flat_map(|finding| &finding.features).filter_map(tag).collect();
    let is_lacking = |feature: &Feature| tag(feature).is_some_and(|tag| lacking.contains(&tag));
    let kept = |finding: &Finding| {
        finding.kind != FindingKind::Feature || !finding.features.iter().all(is_lacking)
    };
    let kept: Vec<bool> = list.iter().map(kept).collect();
    let mut kept = kept.into_iter();
    list.retain(|_| kept.next() == Some(true));
}

/// Whether a cause is a feature that is not there. A method with a mistake of its own is there, as is one whose updates
/// stand in the wrong order.
fn is_lack(cause: &Cause, causes: &[Cause]) -> bool {
    let is_of_it = |other: &Cause| !other.is_lack() && other.change().place == cause.change().place;
    cause.is_lack() && !cause.change().is_order_of_updates() && !causes.iter().any(is_of_it)
}

/// Wrong scenes in which a cause acts, and that neither it nor another finding explains. A scene is explained where
/// something stands out that no right scene has, other than what the cause is about.
fn exceptions(
    cause: &Cause,
    scenes: &[Marked<'_>],
    to_look_at: &[Finding],
    shared: &[Shared],
) -> usize {
    let own = Feature::from(cause.change().place);
    let is_excused = |number: &&usize| {
        let has_it = |finding: &Finding| {
            finding.scenes.iter().any(|name| name == scenes[**number].judged.name)
        };
        let mut others = to_look_at.iter().filter(|finding| !finding.features.contains(&own));
        let mut apart = shared.iter().filter(|one| one.apart.is_some() && one.apart != Some(own));
        others.any(has_it) || apart.any(|one| has_it(&one.finding))
    };
    cause.unexplained.iter().filter(|number| !is_excused(number)).count()
}

/// The finding on a cause, of this kind. The words of a mere feature are no change.
fn of_cause(cause: &Cause, kind: FindingKind, scenes: &[Marked<'_>], exceptions: usize) -> Finding {
    let features: Vec<Feature> =
        cause.alternatives.iter().map(|change| change.place.into()).collect();
    let numbers = cause.scenes.iter();
    if kind == FindingKind::Feature {
        let numbers = numbers.chain(&cause.unexplained);
        return Finding {
            kind,
            words: features.iter().map(Feature::to_string).collect(),
            features,
            scenes: names(numbers.map(|number| &scenes[*number])),
            open: 0,
            unexplained: 0,
        };
    }
    Finding {
        kind,
        features,
        words: cause.alternatives.iter().map(|change| change.words.clone()).collect(),
        scenes: names(numbers.map(|number| &scenes[*number])),
        open: cause.open,
        unexplained: exceptions,
    }
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
    let is_constant = |numbers: &[usize]| {
        let mut steps = numbers.iter().map(|number| scenes[*number].scene.time_step);
        let first = steps.next();
        steps.any(|step| Some(step) != first)
    };
    match time_steps.as_slice() {
        [(_, numbers)] if is_constant(numbers) => kinds.extend(time_steps),
        [] => {}
        _ => {
            let numbers = time_steps.into_iter().flat_map(|(_, numbers)| numbers).collect();
            kinds.push((Kind::Times, numbers));
        }
    }
    settle_open(&mut kinds);
    kinds.sort_by_key(|(_, numbers)| std::cmp::Reverse(numbers.len()));
    // A fault of most traces can look like another one in a few.
    let count = |(_, numbers): &(Kind, Vec<usize>)| numbers.len();
    let all: usize = kinds.iter().map(count).sum();
    if kinds.first().is_some_and(|first| 4 * count(first) >= 3 * all) {
        kinds.truncate(1);
    }
    let mut list: Vec<Finding> = Vec::new();
    for (kind, numbers) in kinds {
        let features = kind.features();
        let found = names(numbers.iter().map(|number| &scenes[*number]));
        match list.iter_mut().find(|known| known.features == features) {
            Some(known) => known.scenes.extend(found),
            None => list.push(Finding {
                kind: FindingKind::Output,
                words: vec![kind.sentence(); features.len()],
                features,
                scenes: found,
                open: 0,
                unexplained: 0,
            }),
        }
    }
    list
}

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
/// each step is right, or all numbers are in single precision.
fn take_rounded(scenes: &mut [Marked<'_>], list: &mut [Finding]) {
    let is_precision = |finding: &&mut Finding| finding.features == [Feature::Precision];
    let Some(finding) = list.iter_mut().find(is_precision) else { return };
    let is_rounded = |scene: &&mut Marked<'_>| {
        let is_open = scene.kind == Some(Kind::Wrong) && !scene.explained && scene.rounding > 0.0;
        is_open && (scene.steps.wrong == 0 || scene.steps.single_precision)
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
    Some(Finding {
        kind: FindingKind::OtherRoot,
        features: vec![feature?],
        words: vec![words.to_owned()],
        scenes: found,
        open: 0,
        unexplained: 0,
    })
}

/// Whether a step is one step of Newton's method.
fn is_linearized(scene: &Marked<'_>) -> bool {
    let integrator = scene.judged.scene.integrator;
    integrator.convergence == Convergence::Direct && integrator.matrix == Matrix::Jacobians
}

/// The features to look at: the one whose scenes are exactly those that are wrong for no proven reason, or those that
/// remain when every feature of a right scene is set aside.
fn features(scenes: &[Marked<'_>], causes: &[Cause]) -> Vec<Finding> {
    // What a program does in place of a method that it lacks is no evidence of its other features.
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
    // Rounds have formulas of springs of their own, which are tasks.
    let is_of_rounds = failing.iter().all(|scene| rounds::is_of_rounds(scene.judged.scene));
    let is_spring = |feature: &Feature| match feature {
        Feature::Force(part) | Feature::Jacobian(part) => part.tag() == "springforce",
        _ => false,
    };
    found.retain(|(feature, ..)| !(is_of_rounds && is_spring(feature)));
    // A wrong Jacobian leads Newton's method astray. One step of it, in a scene that passed, shows a right one.
    let passed = scenes.iter().filter(|scene| scene.passed && is_linearized(scene));
    let known: BTreeSet<Term> = passed.flat_map(|scene| terms(scene.judged.scene)).collect();
    found.retain(|(feature, _, numbers)| {
        let is_open = |number: &usize| {
            let scene = failing[*number];
            scene.is_newton() && !terms(scene.judged.scene).is_subset(&known)
        };
        !(matches!(feature, Feature::Integrator(_)) && numbers.iter().any(is_open))
    });
    let finding = |(feature, detail, numbers): scope::Guilty| Finding {
        kind: FindingKind::Feature,
        features: vec![feature],
        words: vec![in_words(feature, &detail)],
        scenes: names(numbers.into_iter().map(|number| failing[number])),
        open: 0,
        unexplained: 0,
    };
    found.into_iter().map(finding).collect()
}

/// Whether a scene is wrong for no known reason. One without a wrong step shows nothing, unless it is too large for its
/// steps to be examined.
fn is_unexplained(scene: &Marked<'_>) -> bool {
    let is_wrong =
        scene.is_suspect() || scene.kind == Some(Kind::Wrong) && !is_recorded(scene.judged.scene);
    is_wrong && !scene.explained && !scene.open
}

/// What wrong scenes share that nothing explains.
struct Shared {
    finding: Finding,
    /// The one feature that they share and no right scene has.
    apart: Option<Feature>,
}

/// A property of scenes, in words.
struct Property {
    words: String,
    /// The feature that it is; `None` for a circumstance.
    feature: Option<Feature>,
    holds: Box<dyn Fn(&Scene) -> bool>,
}

/// Properties that may distinguish wrong scenes from right ones: features first, then circumstances.
fn properties(right: &[&Scene]) -> Vec<Property> {
    let mut all = Vec::new();
    let mut add = |words: &str, feature: Option<Feature>, holds: Box<dyn Fn(&Scene) -> bool>| {
        all.push(Property { words: words.to_owned(), feature, holds });
    };
    for term in Term::all() {
        let feature = Feature::from(Place::Force(term));
        let holds = move |scene: &Scene| terms(scene).contains(&term);
        add(&term.to_string(), Some(feature), Box::new(holds));
    }
    fn fixed(scene: &Scene) -> impl Iterator<Item = &scene::Particle> {
        scene.particles.iter().filter(|particle| particle.fixed)
    }
    let any = Some(Feature::Fixed(Family::Any));
    add("fixed particles", any, Box::new(|scene| fixed(scene).next().is_some()));
    for kind in integrator::REGISTRY {
        let name = kind.schema.name;
        let holds = move |scene: &Scene| scene.integrator.name == name;
        add(&format!("integrator {name}"), Some(Feature::Integrator(name)), Box::new(holds));
    }
    for (words, is_implicit) in [("explicit methods", false), ("implicit methods", true)] {
        let holds =
            move |scene: &Scene| (scene.integrator.matrix == Matrix::Jacobians) == is_implicit;
        add(words, None, Box::new(holds));
    }
    let moves = |scene: &Scene| fixed(scene).any(|particle| particle.velocity != [0.0; 3]);
    add("fixed particles that move", None, Box::new(moves));
    add("several fixed particles", None, Box::new(|scene| fixed(scene).count() > 1));
    add(
        "two forces on one edge",
        None,
        Box::new(|scene| {
            let edges: Vec<_> = scene.forces.iter().filter_map(|element| element.edge).collect();
            (1..edges.len()).any(|k| edges[..k].contains(&edges[k]))
        }),
    );
    for kind in force::REGISTRY {
        let tag = kind.schema.tag;
        let count = move |scene: &Scene| {
            scene.forces.iter().filter(|element| element.schema.tag == tag).count() > 1
        };
        add(&format!("several elements of {tag}"), None, Box::new(count));
    }
    let masses = |scene: &Scene| scene.particles.iter().any(|particle| particle.mass != 1.0);
    add("masses other than 1", None, Box::new(masses));
    let most = right.iter().map(|scene| scene.particles.len()).max().unwrap_or(0);
    let is_large = move |scene: &Scene| scene.particles.len() > most;
    add(&format!("more than {most} particles"), None, Box::new(is_large));
    all
}

/// What the scenes share that nothing explains and in which no feature stands out, in groups. Traces that are not finite
/// are groups of their own.
fn common(scenes: &[Marked<'_>], found: &[Finding]) -> Vec<Shared> {
    let is_named = |scene: &Marked<'_>| {
        found.iter().any(|f| f.scenes.iter().any(|name| name == scene.judged.name))
    };
    let is_open = |scene: &&Marked<'_>| {
        scene.kind == Some(Kind::Wrong) && !scene.explained && !scene.open && !is_named(scene)
    };
    let is_finite = |scene: &&Marked<'_>| !matches!(scene.judged.outcome, Outcome::NotFinite(_));
    let (finite, other): (Vec<_>, Vec<_>) = scenes.iter().filter(is_open).partition(is_finite);
    let is_right = |scene: &&Marked<'_>| scene.passed || scene.explained && scene.is_suspect();
    let right: Vec<&Scene> =
        scenes.iter().filter(is_right).map(|scene| scene.judged.scene).collect();
    let mut all = groups(other, &right, "NaN or infinite numbers in the trace; ");
    all.extend(groups(finite, &right, ""));
    all
}

/// Wrong scenes in groups: first those that share what no right scene has, the larger ones first; then the others together.
fn groups(mut failing: Vec<&Marked<'_>>, right: &[&Scene], what: &str) -> Vec<Shared> {
    let all = properties(right);
    let mut found = Vec::new();
    while failing.len() >= FEW && found.len() < GROUPS {
        let mut best: (usize, Vec<&Property>) = (0, Vec::new());
        let singles = all.iter().map(|one| vec![one]);
        let others = |number: usize| &all[number + 1..];
        let pairs = all.iter().enumerate();
        let pairs = pairs.flat_map(|(n, one)| others(n).iter().map(move |two| vec![one, two]));
        for properties in singles.chain(pairs) {
            let holds = |scene: &Scene| properties.iter().all(|one| (one.holds)(scene));
            let count = failing.iter().filter(|scene| holds(scene.judged.scene)).count();
            let pass = right.iter().filter(|scene| holds(scene)).count();
            let score = count.saturating_sub(PASSING * pass);
            // Of equal groups, the one that fewer and earlier properties describe.
            if count >= FEW && score > best.0 {
                best = (score, properties);
            }
        }
        let (_, best) = best;
        if best.is_empty() {
            break;
        }
        let is_in = |scene: &&Marked<'_>| best.iter().all(|one| (one.holds)(scene.judged.scene));
        let (group, rest): (Vec<_>, Vec<_>) = failing.into_iter().partition(is_in);
        failing = rest;
        let holds = |scene: &&&Scene| best.iter().all(|one| (one.holds)(scene));
        let pass = right.iter().filter(holds).count();
        let words = format!("{what}{}", shared_in_words(&best, pass));
        let apart = if best.len() == 1 && pass == 0 { best[0].feature } else { None };
        found.push(Shared { finding: unnamed(words, &group), apart });
    }
    if !failing.is_empty() {
        let words = format!("{what}{}", rest_in_words(&all, &failing, right));
        found.push(Shared { finding: unnamed(words, &failing), apart: None });
    }
    found
}

/// What all of these scenes share, and how many right scenes share it too.
fn rest_in_words(all: &[Property], failing: &[&Marked<'_>], right: &[&Scene]) -> String {
    let in_all = |one: &&Property| failing.iter().all(|scene| (one.holds)(scene.judged.scene));
    let mut shared: Vec<&Property> = all.iter().filter(in_all).collect();
    let count = |shared: &[&Property]| {
        right.iter().filter(|scene| shared.iter().all(|one| (one.holds)(scene))).count()
    };
    // Without what sets no right scene apart.
    let pass = count(&shared);
    for number in (0..shared.len()).rev() {
        let one = shared.remove(number);
        if count(&shared) > pass {
            shared.insert(number, one);
        }
    }
    shared_in_words(&shared, pass)
}

fn shared_in_words(shared: &[&Property], pass: usize) -> String {
    let Some((last, before)) = shared.split_last() else {
        return "nothing that grade knows sets these scenes apart".to_owned();
    };
    let before: Vec<&str> = before.iter().map(|one| one.words.as_str()).collect();
    let list = match before.is_empty() {
        true => last.words.clone(),
        false => format!("{} and {}", before.join(", "), last.words),
    };
    let rest = match pass {
        0 => "which no scene that passes has".to_owned(),
        1 => "which 1 scene that passes has too".to_owned(),
        pass => format!("which {pass} scenes that pass have too"),
    };
    format!("the scenes share {list}, {rest}")
}

fn unnamed(words: String, scenes: &[&Marked<'_>]) -> Finding {
    Finding {
        kind: FindingKind::Common,
        features: Vec::new(),
        words: vec![words],
        scenes: names(scenes.iter().copied()),
        open: 0,
        unexplained: 0,
    }
}

fn in_words(feature: Feature, circumstances: &str) -> String {
    match circumstances {
        "" => feature.to_string(),
        circumstances => format!("{feature}, {circumstances}"),
    }
}

/// The features whose scenes are exactly those that crash, do not end, or take too much memory.
fn ends(scenes: &[Marked<'_>]) -> Vec<Finding> {
    let of = |symptom: Symptom| -> Vec<Finding> {
        let failing: Vec<&Marked<'_>> = scenes
            .iter()
            .filter(|scene| scene.kind.as_ref().is_some_and(|kind| kind.symptom() == symptom))
            .collect();
        let ran = scenes.iter().filter(|scene| scene.passed || scene.judged.states.len() > 1);
        let right: Vec<&Scene> = ran.map(|scene| scene.judged.scene).collect();
        let wrong = failing.iter().map(|scene| Failing::of(scene.judged.scene));
        let wrong: Vec<Failing<'_>> = wrong.collect();
        let found = match scope::only(&wrong, &right, FEW) {
            Some(only) => vec![only],
            None => scope::eliminated(&wrong, &right, FEW),
        };
        if found.is_empty() {
            let groups = groups(failing, &right, &format!("{symptom}; "));
            return groups.into_iter().map(|shared| shared.finding).collect();
        }
        let finding = |(feature, detail, numbers): scope::Guilty| Finding {
            kind: FindingKind::Ends(symptom),
            features: vec![feature],
            words: vec![in_words(feature, &detail)],
            scenes: names(numbers.into_iter().map(|number| failing[number])),
            open: 0,
            unexplained: 0,
        };
        found.into_iter().map(finding).collect()
    };
    [Symptom::Crash, Symptom::TimeOut, Symptom::Memory].into_iter().flat_map(of).collect()
}

/// What the program says that it lacks, one finding for each name.
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
                known.scenes.extend(scenes);
                None
            }
            None => Some(Finding {
                kind: FindingKind::NotImplemented,
                features: vec![feature],
                words: vec![words],
                scenes,
                open: 0,
                unexplained: 0,
            }),
        }
    };
    found.into_iter().filter_map(finding).collect()
}

/// What is implemented, and the simplest scene of what is not.
fn progress(judged: &[JudgedScene<'_>], found: &[Found], list: &[Finding]) -> Option<Progress> {
    let is_lacking = |(scene, found): &(&JudgedScene<'_>, &Found)| {
        found.lacks.is_some() || matches!(scene.outcome, Outcome::Refused(_))
    };
    let lacking: Vec<&JudgedScene<'_>> =
        judged.iter().zip(found).filter(is_lacking).map(|(scene, _)| scene).collect();
    if lacking.is_empty() || !list.iter().any(|f| f.kind == FindingKind::NotImplemented) {
        return None;
    }
    let passed = || judged.iter().filter(|scene| scene.outcome == Outcome::Passed);
    // What a finding names is not said to be there.
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
    if implemented.is_empty() {
        implemented.push("nothing yet".to_owned());
    }
    Some(Progress { implemented, next })
}
