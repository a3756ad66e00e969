//! Copy detection: runs a submission on slightly altered copies of the shipped scenes.
//!
//! A program that looks up stored traces passes only the scenes that it has stored. The grader therefore takes scenes
//! that the program passed, alters each in one property, and compares the first step with a loose tolerance:
//!
//! ```text
//! change     positions by 1 to 2 % of the scene's size, velocities or masses by 5 to 10 %, or the order of particles
//! right      |x₁ − x₁*| ≤ 1e-6 max |x₁*|    |v₁ − v₁*| ≤ 1e-6 max |v₁*|        x₁*, v₁*: our simulator's
//! used       where a stored trace, a trace at rest and a trace without forces are all off by far more
//! ```
//!
//! One right step on one altered scene proves that the program simulates, whatever other mistakes it has. The altered
//! property differs from scene to scene: a program that ignores masses, say, is not reported as a copy. Values are
//! replaced in the text of the scene ([`edit`](mod@edit)); the rest of the file stays. The alterations are
//! deterministic.
//!
//! Cost: no run if the probe finds a right force; one run if the first altered scene has a right step; at most
//! [`MOST`] + 1 runs otherwise.

use std::collections::{HashMap, HashSet};
use std::fmt;

use fastrand::Rng;
use simulator::scene::xml::edit::{self, AttributeValue};
use simulator::scene::{ParseOptions, Scene, xml};
use simulator::solver::linear::LinearSolver;
use simulator::trace::{Shape, State};
use simulator::vocabulary;

use crate::probe::{self, Probing};
use crate::submission::program::{Program, SceneSource};
use crate::submission::{StateSource, builtin};
use crate::suite::{Case, Feature, Suite, read_text};
use crate::verdict::{Failure, Verdict};

/// Maximum number of altered scenes.
pub const MOST: usize = 6;

/// Minimum number of altered scenes for a conclusion.
const FEWEST: usize = 3;

/// Minimum number of features among the altered scenes.
const FEWEST_FEATURES: usize = 2;

/// Maximum size of a scene file that is altered, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// Maximum error of a right step, relative to the largest number.
const RIGHT: f64 = 1e-6;

/// Minimum error of a wrong step, relative to the largest number.
const WRONG: f64 = 1e-4;

/// A program that passes shipped scenes, but takes no right step in altered copies of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Copied {
    /// Number of shipped scenes that it passed.
    pub passed: usize,
    /// The altered scenes: the shipped scene's name and the change.
    pub altered: Vec<(String, Alteration)>,
    /// A shipped scene whose first step is wrong once a line break is appended to the file, if there is one.
    pub bytes: Option<String>,
}

impl fmt::Display for Copied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { passed, altered, bytes } = self;
        let count = altered.len();
        write!(
            f,
            "Possibly copied answers: the program passes {passed} shipped scenes, but takes a wrong first \
             step in all {count} slightly altered copies of them"
        )?;
        match bytes {
            Some(scene) => {
                write!(f, ", and in {scene} with a line break appended to the file")
            }
            None => Ok(()),
        }
    }
}

/// The property of a scene that is altered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alteration {
    /// Positions of free particles.
    Positions,
    /// Velocities of free particles.
    Velocities,
    /// Masses of free particles.
    Masses,
    /// The order of particles.
    Order,
}

impl Alteration {
    const ALL: [Self; 4] = [Self::Positions, Self::Velocities, Self::Masses, Self::Order];

    /// "positions", "velocities", "masses" or "order".
    pub fn name(self) -> &'static str {
        match self {
            Self::Positions => "positions",
            Self::Velocities => "velocities",
            Self::Masses => "masses",
            Self::Order => "order",
        }
    }

    /// The text of the scene with this property altered.
    fn apply(self, text: &str, scene: &Scene, random: &mut Rng) -> Option<String> {
        if self == Self::Order {
            return reorder(text, random);
        }
        let [size, speed] = scales(scene);
        edit::edit(text, |AttributeValue { tag, number, name, .. }| {
            let particle = scene.particles.get(number).filter(|_| tag == "particle")?;
            let axis = || ["x", "y", "z"].iter().position(|axis| name.ends_with(axis));
            let (value, by) = match (self, name) {
                (Self::Positions, "px" | "py" | "pz") => (particle.position[axis()?], 0.02 * size),
                (Self::Velocities, "vx" | "vy" | "vz") => (particle.velocity[axis()?], 0.1 * speed),
                (Self::Masses, "m") => (particle.mass, 0.1 * particle.mass),
                _ => return None,
            };
            (!particle.fixed).then(|| moved(value, by, random))
        })
    }
}

/// Size of the scene and its largest speed; for a scene at rest, the speed that crosses it in its duration.
fn scales(scene: &Scene) -> [f64; 2] {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let first = scene.particles.first().map_or([0.0; 3], |particle| particle.position);
    let away = scene.particles.iter().flat_map(|particle| {
        particle.position.into_iter().zip(first).map(|(own, first)| (own - first).abs())
    });
    let size = match largest(&mut away.into_iter()) {
        0.0 => 1.0,
        size => size,
    };
    let speeds = scene.particles.iter().flat_map(|particle| particle.velocity.map(f64::abs));
    let speed = match largest(&mut speeds.into_iter()) {
        0.0 => size / scene.duration.max(scene.time_step),
        speed => speed,
    };
    [size, speed]
}

/// `value` moved by between half of `by` and all of it, in short decimal notation.
fn moved(value: f64, by: f64, random: &mut Rng) -> String {
    let sign = if random.bool() { 1.0 } else { -1.0 };
    let decimals = (3.0 - by.log10()).ceil().clamp(1.0, 300.0) as usize;
    format!("{:.decimals$}", value + sign * by * (0.5 + 0.5 * random.f64()))
}

/// The text with a permutation of the particles that have the same attributes as the first one.
fn reorder(text: &str, random: &mut Rng) -> Option<String> {
    let mut particles: Vec<HashMap<String, String>> = Vec::new();
    edit::edit(text, |AttributeValue { tag, number, name, value }| {
        if tag == "particle" {
            particles.resize_with(particles.len().max(number + 1), HashMap::new);
            particles[number].insert(name.to_owned(), value.to_owned());
        }
        None
    })?;
    let names = |number: usize| particles[number].keys().collect::<HashSet<_>>();
    let alike: Vec<usize> =
        (0..particles.len()).filter(|number| names(*number) == names(0)).collect();
    let mut shuffled = alike.clone();
    random.shuffle(&mut shuffled);
    if shuffled == alike && !alike.is_empty() {
        shuffled.rotate_left(1);
    }
    let mut old: Vec<usize> = (0..particles.len()).collect();
    let mut new = old.clone();
    for (place, particle) in alike.into_iter().zip(shuffled) {
        (old[place], new[particle]) = (particle, place);
    }
    edit::edit(text, |AttributeValue { tag, number, name, value }| match (tag, name) {
        ("particle", _) => particles[old[number]].get(name).cloned(),
        ("edgecolor", _) => None,
        (_, "i" | "j") => Some(new.get(value.trim().parse::<usize>().ok()?)?.to_string()),
        _ => None,
    })
}

/// A scene with the first step of our simulator.
struct SteppedScene {
    text: String,
    scene: Scene,
    start: State,
    /// The state after the first step.
    next: State,
    /// The largest coordinate over all states.
    reach: f64,
}

impl SteppedScene {
    /// `None` if the text is not a scene with a step, or our simulator fails on it.
    fn of(text: String) -> Option<Self> {
        let parsed = xml::parse(&text, "scene.xml", &vocabulary(), &ParseOptions::default());
        let scene = parsed.ok()?.scene;
        let mut states = builtin::start(&scene, LinearSolver::Auto);
        let mut state = State::zeros(Shape::of(&scene));
        let mut first = Vec::with_capacity(2);
        let mut reach: f64 = 0.0;
        while states.read(&mut state).ok()? {
            if first.len() < 2 {
                first.push(state.clone());
            }
            reach = reach.max(largest(&state.positions));
        }
        let [start, next] = <[State; 2]>::try_from(first).ok()?;
        Some(Self { text, scene, start, next, reach })
    }

    /// The scene of the suite, altered by the first of these changes that has a visible effect.
    fn alter(case: &Case, changes: impl Iterator<Item = Alteration>) -> Option<(Alteration, Self)> {
        let original = Self::of(read_text(&case.files.first()?.path, MAX_MEBIBYTES).ok()?)?;
        let seed = u64::from_str_radix(case.scene_hash.get(..16)?, 16).ok()?;
        let mut changes = changes;
        changes.find_map(|change| {
            let mut random = Rng::with_seed(seed);
            let text = change.apply(&original.text, &original.scene, &mut random)?;
            let altered = Self::of(text)?;
            let is_tame = altered.reach <= 2.0 * original.reach;
            (is_tame && altered.shows_beside(&original)).then_some((change, altered))
        })
    }

    /// Whether the step of the original scene and a step without forces are both wrong for this scene.
    fn shows_beside(&self, original: &Self) -> bool {
        let free = State { velocities: self.start.velocities.clone(), ..self.next.clone() };
        !self.is_within(&original.next, WRONG) && !self.is_within(&free, WRONG)
    }

    /// Whether `state` agrees with the state after the first step, to this tolerance.
    fn is_within(&self, state: &State, tolerance: f64) -> bool {
        // A NaN agrees with nothing.
        let within = |expected: &[f64], got: &[f64]| {
            let bound = tolerance * largest(expected);
            expected.iter().zip(got).all(|(expected, got)| (expected - got).abs() <= bound)
        };
        within(&self.next.positions, &state.positions)
            && within(&self.next.velocities, &state.velocities)
    }

    /// Whether the submission's first step is right; `None` if a limit or the grader's machine prevented the run.
    fn is_stepped_by(&self, run: Runs<'_>) -> Option<bool> {
        let mut states = match run(&self.text, &self.scene) {
            Ok(states) => states,
            Err(
                Verdict::GraderFault(_)
                | Verdict::Fail(
                    Failure::TimedOut { .. }
                    | Failure::NotRun { .. }
                    | Failure::OutOfMemory { .. }
                    | Failure::TooMuchOutput { .. }
                    | Failure::TooManyProcesses { .. },
                ),
            ) => return None,
            Err(_) => return Some(false),
        };
        let mut state = State::zeros(Shape::of(&self.scene));
        let is_read = (0..2).all(|_| states.read(&mut state) == Ok(true));
        Some(is_read && self.is_within(&state, RIGHT))
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

/// Runs a submission on a scene, given as text and parsed.
pub type Runs<'a> = &'a dyn Fn(&str, &Scene) -> Result<Box<dyn StateSource>, Verdict>;

/// [`look_for_copies`] for a program.
pub fn of_program(
    suite: &Suite,
    program: &Program,
    passed: &HashSet<&str>,
    probing: Option<&Probing>,
) -> Option<Copied> {
    look_for_copies(suite, passed, probing, &|text, scene| {
        Ok(Box::new(program.run(SceneSource::Xml(text), Shape::of(scene))?))
    })
}

/// Runs a submission on altered scenes, unless something else shows that it simulates. Returns the evidence if it
/// takes no right step in any of them.
pub fn look_for_copies(
    suite: &Suite,
    passed: &HashSet<&str>,
    probing: Option<&Probing>,
    run: Runs<'_>,
) -> Option<Copied> {
    let is_right = |part: &probe::PartReport| part.force_finding.verdict == probe::Verdict::Correct;
    if probing.is_some_and(|probing| probing.parts.iter().any(is_right)) {
        return None;
    }
    let alterations = candidates(suite, passed).into_iter().enumerate();
    let alterations = alterations.filter_map(|(number, case)| {
        let changes = Alteration::ALL.into_iter().cycle().skip(number % Alteration::ALL.len());
        Some((case, SteppedScene::alter(case, changes.take(Alteration::ALL.len()))?))
    });
    let mut failed: Vec<(&Case, Alteration)> = Vec::new();
    for (case, (change, altered)) in alterations.take(MOST) {
        match altered.is_stepped_by(run) {
            Some(true) => return None,
            Some(false) => failed.push((case, change)),
            None => {}
        }
    }
    let features: HashSet<&Feature> = failed.iter().map(|(case, _)| &case.feature).collect();
    if failed.len() < FEWEST || features.len() < FEWEST_FEATURES {
        return None;
    }
    let bytes = failed.first().filter(|(case, _)| fails_as_other_bytes(case, run) == Some(true));
    Some(Copied {
        passed: passed.len(),
        bytes: bytes.map(|(case, _)| case.id.clone()),
        altered: failed.into_iter().map(|(case, change)| (case.id.clone(), change)).collect(),
    })
}

/// Whether the submission's first step is wrong in a shipped scene with a line break appended to its file.
fn fails_as_other_bytes(case: &Case, run: Runs<'_>) -> Option<bool> {
    let text = read_text(&case.files.first()?.path, MAX_MEBIBYTES).ok()?;
    Some(!SteppedScene::of(text + "\n")?.is_stepped_by(run)?)
}

/// Passed scenes that may be altered: one of each feature, then a second one of each, and so on. Within a feature,
/// two-dimensional scenes with several particles and few steps come first.
fn candidates<'a>(suite: &'a Suite, passed: &HashSet<&str>) -> Vec<&'a Case> {
    let is_candidate = |case: &&Case| {
        let is_xml = case
            .files
            .first()
            .is_some_and(|file| file.path.extension().is_some_and(|extension| extension == "xml"));
        is_xml && !case.scene.forces.is_empty() && passed.contains(case.id.as_str())
    };
    let mut cases: Vec<&Case> = suite.cases.iter().filter(is_candidate).collect();
    cases.sort_by_key(|case| {
        let Scene { dimension, particles, .. } = &case.scene;
        (dimension.count(), particles.len() < 2, case.scene.n_steps() * particles.len() as u64)
    });
    let mut seen: HashMap<&Feature, usize> = HashMap::new();
    let mut ranked: Vec<(usize, &Case)> = Vec::with_capacity(cases.len());
    for case in cases {
        let rank = seen.entry(&case.feature).or_default();
        ranked.push((*rank, case));
        *rank += 1;
    }
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().map(|(_, case)| case).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::suite::Section;

    fn shipped() -> Suite {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let sections = [(Section::Required, root.join("assets"))];
        Suite::load(&sections, &ParseOptions::default()).unwrap()
    }

    /// The scene without the values that a change alters.
    fn without(change: Alteration, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        for particle in &mut scene.particles {
            match change {
                Alteration::Positions => particle.position = [0.0; 3],
                Alteration::Velocities => particle.velocity = [0.0; 3],
                Alteration::Masses => particle.mass = 0.0,
                Alteration::Order => {}
            }
        }
        scene
    }

    #[test]
    fn a_change_alters_one_respect_of_free_particles_by_a_little() {
        let suite = shipped();
        let mut used = [0; 4];
        for case in suite.cases.iter().filter(|case| !case.scene.forces.is_empty()) {
            for change in Alteration::ALL {
                let Some((_, altered)) = SteppedScene::alter(case, [change].into_iter()) else {
                    continue;
                };
                used[change as usize] += 1;
                let mut original = case.scene.clone();
                original.name = altered.scene.name.clone();
                assert_ne!(altered.scene, original, "{} {change:?}", case.id);
                if change == Alteration::Order {
                    continue;
                }
                let [own, other] = [&altered.scene, &original].map(|scene| without(change, scene));
                // Numbers may get longer; source locations then differ in their columns only.
                assert_eq!(own.particles, other.particles, "{} {change:?}", case.id);
                assert_eq!(own.edges, other.edges);
                let [size, speed] = scales(&original);
                for (new, old) in altered.scene.particles.iter().zip(&original.particles) {
                    assert!(!old.fixed || new == old, "{}", case.id);
                    assert!((new.mass / old.mass - 1.0).abs() < 0.11);
                    for axis in 0..3 {
                        assert!((new.position[axis] - old.position[axis]).abs() < 0.021 * size);
                        assert!((new.velocity[axis] - old.velocity[axis]).abs() < 0.11 * speed);
                    }
                }
            }
        }
        // Masses have no effect on free fall.
        assert!(used.iter().all(|count| *count > 25), "{used:?}");
        let again =
            |case: &Case| Some(SteppedScene::alter(case, Alteration::ALL.into_iter())?.1.text);
        assert!(suite.cases.iter().all(|case| again(case) == again(case)));
    }

    #[test]
    fn particles_in_another_order_take_the_same_step() {
        let sorted = |values: &[f64]| {
            let mut values = values.to_vec();
            values.sort_by(f64::total_cmp);
            values
        };
        let mut count = 0;
        for case in shipped().cases {
            let path = &case.files[0].path;
            let original = SteppedScene::of(read_text(path, MAX_MEBIBYTES).unwrap()).unwrap();
            let text = reorder(&original.text, &mut Rng::with_seed(1)).unwrap();
            let other = SteppedScene::of(text).unwrap();
            count += usize::from(other.start != original.start);
            let pairs = [
                (sorted(&original.next.positions), sorted(&other.next.positions)),
                (sorted(&original.next.velocities), sorted(&other.next.velocities)),
            ];
            for (expected, got) in pairs {
                let bound = 1e-9 * largest(&expected);
                let near = |(a, b): (&f64, &f64)| (a - b).abs() <= bound;
                assert!(expected.iter().zip(&got).all(near), "{}", case.id);
            }
        }
        assert!(count > 60, "{count} scenes in another order");
    }
}
