//! Checks of a creative scene: a scene of the student's own, which people judge.
//!
//! ```text
//! NAME_ASSIGNMENT.xml ──> name, format, features, run, overlap, film
//!                                                  │
//!                                                  └──> Motion: playback and contact sheet
//! ```
//!
//! | check | passes if |
//! | --- | --- |
//! | name | the file is called `NAME_ASSIGNMENT.xml` (or `.json`), such as `ab1234_t1m2.xml` |
//! | format | the file is a scene without unknown elements |
//! | features | the scene stays within the assignment and uses a force or an integrator that is new in it |
//! | run | every step succeeds within the time limit, and the motion does not depend on the time step alone |
//! | overlap | no two particles overlap, as they are drawn, in any state that a film shows |
//! | film | a film lies beside the file |
//!
//! New in `t1m2` is what `t1m1` does not have. In an assignment without such a predecessor, everything is new.
//!
//! A scene that blows up follows the time step, not its forces. The check runs the scene again at half of the time step
//! and compares the largest kinetic energies. An accurate motion has nearly the same one; a method that damps at large
//! time steps, or lets an orbit drift, stays within a factor of ten.

mod credit;
mod film;
mod motion;
mod overlap;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use simulator::scene::{self, ParseOptions, Scene};
use simulator::simulation::Simulation;
use simulator::vocabulary;

use crate::assignment::{Assignment, Scope};

pub use credit::{CRITERIA, CreativeCredit, CreativeRule, Criterion, MaximumMark};
pub use motion::Motion;

/// Largest ratio of the largest kinetic energies at a time step and at half of it.
const MAX_RATIO: f64 = 10.0;

/// Kinetic energies below this share of the largest potential energy are rounding errors.
const ROUNDING: f64 = 1e-12;

/// A creative scene with the results of its checks.
#[derive(Debug)]
pub struct Creative {
    /// The file.
    pub path: PathBuf,
    /// Its name without the folder.
    pub file: String,
    /// The name of the assignment that the file's name ends in, or that was given.
    pub assignment: Option<String>,
    /// The checks, in a fixed order.
    pub checks: Vec<Check>,
    /// The scene, and its motion as far as it could be simulated; `None` if the file is no scene.
    pub shown: Option<(Scene, Motion)>,
    /// The content of the file.
    pub bytes: Vec<u8>,
}

impl Creative {
    /// Whether every check passed.
    pub fn is_pass(&self) -> bool {
        self.checks.iter().all(|check| check.outcome == Outcome::Passed)
    }
}

/// A check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// Its name: one word.
    pub name: &'static str,
    /// Its outcome.
    pub outcome: Outcome,
    /// What was found, and what to do if it failed.
    pub found: String,
}

/// Outcome of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It passed.
    Passed,
    /// It failed.
    Failed,
    /// It could not be made.
    NotMade,
}

impl Outcome {
    /// Its word in reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::NotMade => "not checked",
        }
    }
}

impl Check {
    fn new(name: &'static str, found: Result<String, String>) -> Self {
        match found {
            Ok(found) => Self { name, outcome: Outcome::Passed, found },
            Err(found) => Self { name, outcome: Outcome::Failed, found },
        }
    }

    fn not_made(name: &'static str, reason: &str) -> Self {
        Self { name, outcome: Outcome::NotMade, found: reason.to_owned() }
    }
}

/// What creative scenes are checked against.
#[derive(Debug, Clone, Copy)]
pub struct Rules<'a> {
    /// The assignments that names of files may end in.
    pub assignments: &'a [Assignment],
    /// The assignment of every scene, whatever its name says.
    pub assignment: Option<&'a Assignment>,
    /// Time limit of each of the two runs.
    pub limit: Duration,
}

/// Checks the scene in a file.
///
/// # Errors
/// If the file cannot be read.
pub fn check(path: &Path, rules: Rules<'_>) -> Result<Creative, scene::error::SceneError> {
    let bytes = scene::read_bounded(path)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (named, name) = check_name(path, &file, rules.assignments);
    let assignment = rules.assignment.or(named);
    let mut checks = vec![name];
    let parsed = scene::parse_bytes(&bytes, path, &vocabulary(), &ParseOptions::default());
    let shown = match parsed {
        Err(error) => {
            checks.push(Check::new("format", Err(error.to_string())));
            for name in ["features", "run", "overlap"] {
                checks.push(Check::not_made(name, "the file is no scene"));
            }
            None
        }
        Ok(parsed) => {
            let scene = parsed.scene;
            checks.push(Check::new(
                "format",
                match parsed.warnings.first() {
                    None => Ok(contents(&scene)),
                    Some(warning) => {
                        Err(format!("{warning}\n(number of warnings: {})", parsed.n_warnings))
                    }
                },
            ));
            checks.push(match assignment {
                Some(assignment) => {
                    let spelling = &parsed.integrator_spelling;
                    let found = features(&scene, spelling, assignment, rules.assignments);
                    Check::new("features", found)
                }
                None => Check::not_made(
                    "features",
                    "the name does not say which assignment it is for; name one with --assignment",
                ),
            });
            let (run, motion) = run(&scene, rules.limit);
            checks.push(Check::new("run", run));
            checks.push(Check::new("overlap", overlap::check(&scene, &motion)));
            Some((scene, motion))
        }
    };
    checks.push(Check::new("film", film::check(path)));
    let assignment = assignment.map(|assignment| assignment.name.clone());
    Ok(Creative { path: path.to_path_buf(), file, assignment, checks, shown, bytes })
}

/// Checks the name of the file, and finds the assignment in it.
fn check_name<'a>(
    path: &Path,
    file: &str,
    assignments: &'a [Assignment],
) -> (Option<&'a Assignment>, Check) {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let author = |assignment: &Assignment| {
        let author = stem.strip_suffix(&assignment.name)?.strip_suffix('_')?;
        let is_plain = author.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
        (is_plain && !author.is_empty()).then(|| author.to_owned())
    };
    let found = assignments.iter().find_map(|each| Some((each, author(each)?)));
    match found {
        Some((assignment, author)) => {
            let found = format!("{author}, for assignment {}", assignment.name);
            (Some(assignment), Check::new("name", Ok(found)))
        }
        None => {
            let known: Vec<&str> = assignments.iter().map(|each| each.name.as_str()).collect();
            let message = format!(
                "{file} does not have the form NAME_ASSIGNMENT.xml\n\
                 help: call it as in ab1234_{}.xml, with letters, digits and - in the first part; the assignments are {}",
                known.last().unwrap_or(&"t1m1"),
                known.join(", ")
            );
            (None, Check::new("name", Err(message)))
        }
    }
}

/// What a scene consists of.
fn contents(scene: &Scene) -> String {
    let count = |number: usize, what: &str| {
        format!("{number} {what}{}", if number == 1 { "" } else { "s" })
    };
    format!(
        "{}, {}, {}; {} in {}D, {} s in steps of {} s",
        count(scene.particles.len(), "particle"),
        count(scene.edges.len(), "edge"),
        count(scene.forces.len(), "force"),
        scene.integrator.name,
        scene.dimension.count(),
        scene.duration,
        scene.time_step,
    )
}

/// Tags of forces, and spellings of integrators, of an assignment; `None`: all.
fn words(assignment: &Assignment) -> [Option<&[String]>; 2] {
    let Scope { forces, integrators, .. } = assignment.scope();
    [forces.as_deref(), integrators.as_deref()]
}

/// The features of the assignment that the scene uses.
fn features(
    scene: &Scene,
    spelling: &str,
    assignment: &Assignment,
    assignments: &[Assignment],
) -> Result<String, String> {
    let allows = |words: Option<&[String]>, word: &str| {
        words.is_none_or(|words| words.iter().any(|known| known == word))
    };
    let Scope { dimensions, optional_forces, .. } = assignment.scope();
    let mut tags: Vec<&str> = scene.forces.iter().map(|force| force.schema.tag).collect();
    tags.sort_unstable();
    tags.dedup();
    // Each word with its kind: 0 for a force, 1 for an integrator.
    let used: Vec<(usize, &str)> =
        tags.into_iter().map(|tag| (0, tag)).chain([(1, spelling)]).collect();
    let own = words(assignment);
    let is_beyond = |(kind, word): &(usize, &str)| {
        let is_optional = *kind == 0 && optional_forces.iter().any(|tag| tag == word);
        !is_optional && !allows(own[*kind], word)
    };
    let mut beyond: Vec<String> =
        used.iter().copied().filter(is_beyond).map(|(_, word)| word.to_owned()).collect();
    let dimension = scene.dimension.count();
    if dimensions.as_ref().is_some_and(|known| !known.contains(&dimension)) {
        beyond.push(format!("{dimension} dimensions"));
    }
    let name = &assignment.name;
    if !beyond.is_empty() {
        return Err(format!(
            "{name} does not have {}\nhelp: `grade assignments {name}` lists what it has",
            beyond.join(", ")
        ));
    }
    let before = predecessor(assignment, assignments).map(words);
    let is_new =
        |(kind, word): &(usize, &str)| before.is_none_or(|before| !allows(before[*kind], word));
    let listed = |words: &[(usize, &str)]| {
        words.iter().map(|(_, word)| *word).collect::<Vec<_>>().join(", ")
    };
    let new: Vec<_> = used.into_iter().filter(is_new).collect();
    if new.is_empty() {
        let kinds = own.into_iter().enumerate();
        let offered = kinds.flat_map(|(kind, words)| {
            words.unwrap_or_default().iter().map(move |word| (kind, word.as_str()))
        });
        let offered: Vec<_> = offered.filter(is_new).collect();
        return Err(format!(
            "it uses nothing that is new in {name}\nhelp: use one of {}",
            listed(&offered)
        ));
    }
    Ok(listed(&new))
}

/// The assignment before this one in a numbered sequence: `t1m1` for `t1m2`.
fn predecessor<'a>(assignment: &Assignment, all: &'a [Assignment]) -> Option<&'a Assignment> {
    let stem = assignment.name.trim_end_matches(|c: char| c.is_ascii_digit());
    let number: u32 = assignment.name[stem.len()..].parse().ok()?;
    let before = format!("{stem}{}", number.checked_sub(1)?);
    all.iter().find(|each| each.name == before)
}

/// Runs the scene, and again at half of the time step.
fn run(scene: &Scene, limit: Duration) -> (Result<String, String>, Motion) {
    let mut motion = Motion::new(scene);
    let started = Instant::now();
    let first = energy_of(scene, limit, Some(&mut motion));
    let took = started.elapsed().as_secs_f64();
    let halved = Scene { time_step: 0.5 * scene.time_step, ..scene.clone() };
    let found = first.and_then(|first| {
        let second = energy_of(&halved, limit, None)
            .map_err(|error| format!("at half of the time step: {error}"))?;
        let h = scene.time_step;
        let kinetic = format!(
            "the largest kinetic energy is {} at the time step of {h} s, and {} at half of it",
            short(first.kinetic),
            short(second.kinetic)
        );
        if differ(&first, &second) {
            return Err(format!("it blows up: {kinetic}\nhelp: shorten the time step"));
        }
        Ok(format!("{} steps in {took:.1} s; {kinetic}", scene.n_steps()))
    });
    (found, motion)
}

/// Whether the motion of a scene follows its time step, in a run of any length.
///
/// # Errors
/// If a step fails, at the time step or at half of it.
pub(crate) fn blows_up(scene: &Scene) -> Result<bool, String> {
    let first = energy_of(scene, Duration::MAX, None)?;
    let halved = Scene { time_step: 0.5 * scene.time_step, ..scene.clone() };
    Ok(differ(&first, &energy_of(&halved, Duration::MAX, None)?))
}

/// Whether the largest kinetic energies of two runs differ by more than rounding and drift.
fn differ(first: &Peaks, second: &Peaks) -> bool {
    let floor = ROUNDING * first.potential.max(second.potential);
    let (large, small) = (first.kinetic.max(floor), second.kinetic.max(floor));
    large > MAX_RATIO * small || small > MAX_RATIO * large
}

/// A number with four digits.
fn short(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        _ if (1e-3..1e5).contains(&value) => {
            let decimals = (3.0 - value.log10().floor()).max(0.0);
            format!("{value:.*}", decimals as usize)
        }
        _ => format!("{value:.3e}"),
    }
}

/// Largest energies of a run.
struct Peaks {
    kinetic: f64,
    /// The largest magnitude of the potential energy.
    potential: f64,
}

/// Runs a scene to its end.
fn energy_of(
    scene: &Scene,
    limit: Duration,
    mut motion: Option<&mut Motion>,
) -> Result<Peaks, String> {
    let started = Instant::now();
    let mut simulation = Simulation::new(scene);
    let mut peaks = Peaks { kinetic: 0.0, potential: 0.0 };
    loop {
        let state = simulation.state();
        if let Some(motion) = &mut motion {
            motion.add(scene, state);
        }
        let energies = simulation.energies().map_err(|error| error.to_string())?;
        peaks.kinetic = peaks.kinetic.max(energies.kinetic);
        peaks.potential = peaks.potential.max(energies.potential.abs());
        if started.elapsed() > limit {
            return Err(format!(
                "step {} of {} is not reached within {} s\nhelp: shorten the scene, or set another limit with --seconds",
                state.step + 1,
                scene.n_steps(),
                limit.as_secs_f64()
            ));
        }
        if !simulation.advance().map_err(|error| error.to_string())? {
            return Ok(peaks);
        }
    }
}

#[cfg(test)]
mod tests;
