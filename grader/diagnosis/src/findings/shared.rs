//! Common properties of wrong scenes for which nothing else is found, in groups.

use crate::change::{Change, Place, Term};
use scene::Scene;
use scene::schema::Matrix;
use simulator::force;
use simulator::integrator;

use super::evidence::Marked;
use super::feature::{Family, Feature};
use super::finding::{Finding, FindingKind};
use super::form::Kind;
use super::judged::Outcome;
use super::search::{Cause, stalls};
use super::{FEW, names, terms};

/// Maximum number of groups of wrong scenes that share something.
const GROUPS: usize = 3;

/// Wrong scenes that one right scene with the same property outweighs.
const PASSING: usize = 4;

/// A common property of unexplained wrong scenes.
pub(super) struct Shared {
    pub(super) finding: Finding,
    /// The one feature that they share and no right scene has.
    pub(super) apart: Option<Feature>,
}

/// A scene that does not show what is looked for.
#[derive(Clone, Copy)]
pub(super) struct Right<'a> {
    scene: &'a Scene,
    /// Whether it passes; else it fails in another way.
    passed: bool,
}

impl<'a> Right<'a> {
    pub(super) fn of(marked: &Marked<'a>) -> Self {
        Self { scene: marked.judged.scene, passed: marked.passed }
    }
}

/// A property of scenes, in words.
struct Property {
    words: String,
    /// The feature that it is; `None` for a circumstance.
    feature: Option<Feature>,
    holds: Box<dyn Fn(&Scene) -> bool>,
}

/// Properties that may distinguish wrong scenes from right ones: features first, then circumstances.
fn properties(right: &[Right<'_>]) -> Vec<Property> {
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
    let is_cut = |scene: &Scene| !scene.is_divided();
    add("a duration that is no multiple of dt", None, Box::new(is_cut));
    let most = right.iter().map(|right| right.scene.particles.len()).max().unwrap_or(0);
    let is_large = move |scene: &Scene| scene.particles.len() > most;
    add(&format!("more than {most} particles"), None, Box::new(is_large));
    all
}

/// Common properties of scenes that nothing explains and in which no feature stands out, in groups. Traces that are
/// not finite are separate groups.
pub(super) fn common(scenes: &[Marked<'_>], causes: &[Cause], found: &[Finding]) -> Vec<Shared> {
    let is_named = |scene: &Marked<'_>| {
        found.iter().any(|f| f.scenes.iter().any(|name| name == scene.judged.name))
    };
    let is_open = |scene: &&Marked<'_>| {
        scene.kind == Some(Kind::Wrong) && !scene.explained && !scene.open && !is_named(scene)
    };
    let is_finite = |scene: &&Marked<'_>| !matches!(scene.judged.outcome, Outcome::NotFinite(_));
    let made: Vec<Change> = causes.iter().map(|cause| cause.change().clone()).collect();
    let (stalling, open): (Vec<_>, Vec<_>) =
        scenes.iter().filter(is_open).partition(|scene| stalls(scene, &made));
    let (finite, other): (Vec<_>, Vec<_>) = open.into_iter().partition(is_finite);
    let is_right = |scene: &&Marked<'_>| scene.passed || scene.explained && scene.is_suspect();
    let right: Vec<Right<'_>> = scenes.iter().filter(is_right).map(Right::of).collect();
    let mut all = groups(other, &right, "NaN or infinite numbers in the trace; ");
    all.extend(groups(finite, &right, ""));
    if !stalling.is_empty() {
        let words = "with the linear system of the linearized method as it is found here, Newton's method hardly converges in these scenes";
        all.push(Shared { finding: unnamed(words.to_owned(), &stalling), apart: None });
    }
    all
}

/// Wrong scenes in groups: first those that share what no right scene has, the larger ones first; then the others together.
pub(super) fn groups(
    mut failing: Vec<&Marked<'_>>,
    right: &[Right<'_>],
    what: &str,
) -> Vec<Shared> {
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
            let pass = right.iter().filter(|right| holds(right.scene)).count();
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
        let alike = with(right, &best);
        let words = format!("{what}{}", shared_in_words(&best, &alike));
        let apart = if best.len() == 1 && alike.is_empty() { best[0].feature } else { None };
        found.push(Shared { finding: unnamed(words, &group), apart });
    }
    if !failing.is_empty() {
        let words = format!("{what}{}", rest_in_words(&all, &failing, right));
        found.push(Shared { finding: unnamed(words, &failing), apart: None });
    }
    found
}

/// The common properties of all of these scenes, and how many right scenes have them too.
fn rest_in_words(all: &[Property], failing: &[&Marked<'_>], right: &[Right<'_>]) -> String {
    let in_all = |one: &&Property| failing.iter().all(|scene| (one.holds)(scene.judged.scene));
    let mut shared: Vec<&Property> = all.iter().filter(in_all).collect();
    // Without what sets no right scene apart.
    let alike = with(right, &shared);
    for number in (0..shared.len()).rev() {
        let one = shared.remove(number);
        if with(right, &shared).len() > alike.len() {
            shared.insert(number, one);
        }
    }
    shared_in_words(&shared, &alike)
}

/// The right scenes that have all of these properties.
fn with<'a>(right: &[Right<'a>], properties: &[&Property]) -> Vec<Right<'a>> {
    let holds = |right: &&Right<'_>| properties.iter().all(|one| (one.holds)(right.scene));
    right.iter().filter(holds).copied().collect()
}

fn shared_in_words(shared: &[&Property], alike: &[Right<'_>]) -> String {
    let Some((last, before)) = shared.split_last() else {
        return "nothing that grade knows sets these scenes apart".to_owned();
    };
    let before: Vec<&str> = before.iter().map(|one| one.words.as_str()).collect();
    let list = match before.is_empty() {
        true => last.words.clone(),
        false => format!("{} and {}", before.join(", "), last.words),
    };
    let all_pass = alike.iter().all(|right| right.passed);
    let rest = match alike.len() {
        0 => "which no scene that passes has".to_owned(),
        1 if all_pass => "which 1 scene that passes has too".to_owned(),
        1 => "which 1 scene that does not fail so has too".to_owned(),
        count if all_pass => format!("which {count} scenes that pass have too"),
        count => format!("which {count} scenes that do not fail so have too"),
    };
    format!("the scenes share {list}, {rest}")
}

/// A common property of these scenes, without a feature.
pub(super) fn unnamed(words: String, scenes: &[&Marked<'_>]) -> Finding {
    let scenes = names(scenes.iter().copied());
    Finding::new(FindingKind::Common, Vec::new(), vec![words], scenes)
}
