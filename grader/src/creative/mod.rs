//! Checks of a creative scene: a scene of the student's own, which people judge.
//!
//! ```text
//! NAME_ASSIGNMENT.xml ──> sandbox: examine ──> Examined, picture ──> name, format, features, run, overlap, film
//!                          parse, run, draw     strict JSON
//! ```
//!
//! A scene is an untrusted program. It is found without following links (`find.rs`), parsed, run and drawn in the sandbox
//! (`examiner.rs`, `examine.rs`), and judged outside by what was found there.
//!
//! | check | passes if |
//! | --- | --- |
//! | name | the file is called `NAME_ASSIGNMENT.xml` (or `.json`), such as `ab1234_t1m2.xml` |
//! | format | the file is a scene without unknown elements |
//! | features | the scene stays within the assignment and uses a force or an integrator that is new in it |
//! | run | every step succeeds within the time limit, and the motion does not depend on the time step alone |
//! | overlap | no two particles overlap, as they are drawn, in any state that a film shows |
//! | film | a film of the same name lies next to the file; where both are alone, of any name |
//!
//! New in `t1m2` is what `t1m1` does not have. In an assignment without such a predecessor, everything is new.

mod examine;
mod examiner;
mod film;
mod find;
mod motion;
mod overlap;
mod run;

use std::path::Path;

use sandbox::SandboxError;
use sha2::{Digest, Sha256};

use crate::boundary::door::Door;
use crate::boundary::printed::{self, Untrusted};
use crate::submission::hand_in::HandInError;
use crate::submission::hand_in::place::Place;
use crate::suite::assignment::{Assignment, Scope};

pub use examine::{Examined, Facts};
pub use examiner::{Examiner, Picture, Wanted, limits, serve};
pub use film::starts_as_film;
pub use find::{Entry, find};
pub use motion::Motion;
pub use run::blows_up;

/// A creative scene with the results of its checks.
#[derive(Debug)]
pub struct Creative {
    /// The path of the file.
    pub path: Untrusted,
    /// Its path from the folder of all scenes.
    pub below: Untrusted,
    /// The name of the assignment that the file's name ends in, or that was given.
    pub assignment: Option<String>,
    /// The checks, in a fixed order.
    pub checks: Vec<Check>,
    /// The scene's own description.
    pub description: Option<Untrusted>,
    /// Its drawing; `None` if the file is no scene, or its check was ended.
    pub picture: Option<Picture>,
    /// SHA-256 of the file; of its path, if it is refused.
    pub hash: [u8; 32],
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
    /// The finding, with the remedy if it failed.
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

/// Requirements of creative scenes.
#[derive(Debug, Clone, Copy)]
pub struct Rules<'a> {
    /// The assignments that names of files may end in.
    pub assignments: &'a [Assignment],
    /// The assignment of every scene, whatever its name says.
    pub assignment: Option<&'a Assignment>,
}

/// Why a scene was not checked.
#[derive(Debug, thiserror::Error)]
pub enum NotChecked {
    /// Its file is not read.
    #[error(transparent)]
    Refused(#[from] HandInError),
    /// The sandbox did not run, through no fault of the scene.
    #[error(transparent)]
    NotRun(#[from] SandboxError),
}

/// Checks the scene in the file at the path `below` from the folder `base`. `None` if it is JSON that is not meant to be
/// a scene.
///
/// # Errors
/// If its file is not read, or the sandbox did not run.
pub fn check(
    (base, below): (&Path, &Path),
    examiner: &Examiner,
    wanted: Wanted,
    rules: Rules<'_>,
) -> Result<Option<Creative>, NotChecked> {
    let place = Place::open(base, below)?;
    let bytes = place.read(Door::CreativeScene)?;
    let name = Path::new(below.file_name().unwrap_or_default());
    let path = base.join(below);
    let found = examiner.examine(&place, (name, &bytes), wanted)?;
    let (found, picture) = match found {
        Ok((Examined::NoScene, _)) => return Ok(None),
        Ok((examined, picture)) => (Ok(examined), picture),
        Err(ended) => (Err(ended), None),
    };
    let description = match &found {
        Ok(Examined::Scene(facts)) => facts.description.as_deref().map(Untrusted::from),
        _ => None,
    };
    let film = film::check(&place, &path);
    let (assignment, checks) = judge(&path, found, film, rules);
    let hash = Sha256::digest(&bytes).into();
    let (path, below) = (path.as_path().into(), below.into());
    Ok(Some(Creative { path, below, assignment, checks, description, picture, hash }))
}

impl Creative {
    /// A file or a folder that is not read, at the path `below` from the folder `base`.
    pub fn refused((base, below): (&Path, &Path), reason: String) -> Self {
        let path = base.join(below);
        Self {
            path: path.as_path().into(),
            below: below.into(),
            assignment: None,
            checks: vec![Check::new("file", Err(reason))],
            description: None,
            picture: None,
            hash: Sha256::digest(path.as_os_str().as_encoded_bytes()).into(),
        }
    }
}

/// The checks of a scene, from what was found in the sandbox: the reason, if its run there was ended.
fn judge(
    path: &Path,
    found: Result<Examined, String>,
    film: Result<String, String>,
    rules: Rules<'_>,
) -> (Option<String>, Vec<Check>) {
    let (named, name) = check_name(path, rules.assignments);
    let assignment = rules.assignment.or(named);
    let mut checks = vec![name];
    match found {
        Ok(Examined::Scene(facts)) => {
            let features =
                assignment.map(|assignment| features(&facts, assignment, rules.assignments));
            let unnamed =
                "the name does not say which assignment it is for; name one with --assignment";
            checks.push(Check::new("format", facts.format));
            checks.push(match features {
                Some(found) => Check::new("features", found),
                None => Check::not_made("features", unnamed),
            });
            checks.push(Check::new("run", facts.run));
            checks.push(Check::new("overlap", facts.overlap));
        }
        Ok(Examined::Malformed(error)) => {
            checks.push(Check::new("format", Err(error)));
            let others = ["features", "run", "overlap"];
            checks.extend(others.map(|name| Check::not_made(name, "the file is no scene")));
        }
        Ok(Examined::NeedsMesh { .. } | Examined::NoScene) => {}
        Err(ended) => {
            let unknown = |name| Check::not_made(name, "the check of the scene was ended");
            checks.extend(["format", "features"].map(unknown));
            checks.push(Check::new("run", Err(ended)));
            checks.push(unknown("overlap"));
        }
    }
    checks.push(Check::new("film", film));
    (assignment.map(|assignment| assignment.name.clone()), checks)
}

/// Checks the name of the file, and finds the assignment in it.
fn check_name<'a>(path: &Path, assignments: &'a [Assignment]) -> (Option<&'a Assignment>, Check) {
    let file = printed::line(&path.file_name().unwrap_or_default().to_string_lossy());
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

/// Tags of forces, and spellings of integrators, of an assignment; `None`: all.
fn words(assignment: &Assignment) -> [Option<&[String]>; 2] {
    let Scope { forces, integrators, .. } = assignment.scope();
    [forces.as_deref(), integrators.as_deref()]
}

/// The features of the assignment that the scene uses.
fn features(
    facts: &Facts,
    assignment: &Assignment,
    assignments: &[Assignment],
) -> Result<String, String> {
    let allows = |words: Option<&[String]>, word: &str| {
        words.is_none_or(|words| words.iter().any(|known| known == word))
    };
    let Scope { dimensions, optional_forces, .. } = assignment.scope();
    // Each word with its kind: 0 for a force, 1 for an integrator.
    let forces = facts.forces.iter().map(|tag| (0, tag.as_str()));
    let used: Vec<(usize, &str)> = forces.chain([(1, facts.integrator.as_str())]).collect();
    let own = words(assignment);
    let is_beyond = |(kind, word): &(usize, &str)| {
        let is_optional = *kind == 0 && optional_forces.iter().any(|tag| tag == word);
        !is_optional && !allows(own[*kind], word)
    };
    let mut beyond: Vec<String> =
        used.iter().copied().filter(is_beyond).map(|(_, word)| word.to_owned()).collect();
    let dimension = facts.dimension;
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

#[cfg(test)]
mod tests;
