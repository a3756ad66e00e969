//! Arranges a class folder: a folder for each hand-in, named after its students, and what the platform says about it.
//!
//! Files are copied by the walk of untrusted hand-ins, which follows no link. The arranged folder appears whole, by renaming.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{HandInParts, Layout, LayoutError, PassedOver, Reading, read};
use crate::boundary::printed::{InertCsv, RawUse, Untrusted, steers};
use crate::class::roster::{Roster, Student};
use crate::submission::hand_in::{self, HandIn};

/// Maximum length of a name, in characters.
const LONGEST: usize = 80;

/// A student, as far as a platform says. Text is empty if it does not.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// Name; of Canvas, in small letters without spaces, last name first.
    pub name: String,
    /// The university's ID.
    pub id: String,
    /// The ID in Canvas.
    pub canvas_id: String,
    /// Login.
    pub login: String,
    /// Email address.
    pub email: String,
}

/// A platform's data on a hand-in.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandInFacts {
    /// The name of its folder.
    pub folder: String,
    /// Whose it is.
    pub people: Vec<Person>,
    /// Whether it is marked as late.
    pub late: bool,
    /// When it came in; empty if the platform does not say.
    pub submitted: String,
    /// When its newest file was changed, in seconds since 1970.
    pub changed: Option<i64>,
    /// The names that it had.
    pub from: Vec<String>,
}

/// A class folder that was arranged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arranged {
    /// Its layout.
    pub layout: Layout,
    /// The hand-ins.
    pub hand_ins: Vec<HandInFacts>,
    /// The entries that are no hand-ins.
    pub passed_over: Vec<PassedOver>,
}

impl Arranged {
    /// Arranges the folder at `from` in the folder `to`, which is replaced. `named` is its layout, if it is not to be
    /// recognised. A folder that is flat is left as it is, and `None` returned, unless `is_unpacked` from an archive.
    ///
    /// # Errors
    /// If the folder cannot be read or written, or does not have the layout.
    pub fn make(
        (from, to): (&Path, &Path),
        named: Option<Layout>,
        roster: Option<&Roster>,
        is_unpacked: bool,
    ) -> Result<Option<Self>, LayoutError> {
        let (folder, layout, Reading { hand_ins, rest }) = read(from, named, is_unpacked)?;
        if layout == Layout::Flat && !is_unpacked {
            return Ok(None);
        }
        let failed = |source| LayoutError::Io { path: to.to_path_buf(), source };
        let parent = to.parent().unwrap_or(Path::new("."));
        let new = fs::create_dir_all(parent)
            .and_then(|()| tempfile::tempdir_in(parent))
            .map_err(failed)?;
        let below = new.path().join("hand-ins");
        fs::create_dir(&below).map_err(failed)?;
        let mut arranged = Self { layout, hand_ins: Vec::new(), passed_over: rest };
        for found in named_apart(hand_ins, roster) {
            let name = found.facts.folder.clone();
            match copy(&folder.path, &below.join(&name), found)? {
                Ok(facts) => arranged.hand_ins.push(facts),
                Err(reason) => arranged.passed_over.push(PassedOver { name, reason }),
            }
        }
        // A link is moved, not followed.
        match fs::rename(to, new.path().join("old")) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            _ => fs::rename(&below, to).map_err(failed)?,
        }
        Ok(Some(arranged))
    }

    /// The platform's data on the hand-in in this folder.
    pub fn of(&self, folder: &str) -> Option<&HandInFacts> {
        self.hand_ins.iter().find(|facts| facts.folder == folder)
    }
}

/// Copies the files of a hand-in to a separate folder. Defects of the hand-in are the inner error.
fn copy(
    folder: &Path,
    to: &Path,
    found: HandInParts,
) -> Result<Result<HandInFacts, String>, LayoutError> {
    let HandInParts { mut facts, parts } = found;
    let failed = |source| LayoutError::Io { path: to.to_path_buf(), source };
    if !parts.iter().any(|part| part.to.is_empty()) {
        fs::create_dir(to).map_err(failed)?;
    }
    let mut names = BTreeSet::new();
    for part in parts {
        let from = folder.join(&part.from);
        let to = match &*part.to {
            "" => to.to_path_buf(),
            name => to.join(free_name(name, &mut names)),
        };
        let copied = hand_in::last_changed(&from).and_then(|changed| {
            HandIn::open(&from)?.copy_to(&to)?;
            Ok(changed)
        });
        match copied {
            Ok(changed) => facts.changed = facts.changed.max(changed.map(|time| time.0 as i64)),
            Err(source) if source.is_fault() => {
                return Err(LayoutError::NotCopied { path: from, source });
            }
            Err(error) => {
                // A part of a hand-in would be graded as the whole.
                let _ = fs::remove_dir_all(&to);
                return Ok(Err(error.to_string()));
            }
        }
        facts.from.push(part.from.to_string_lossy().into_owned());
    }
    Ok(Ok(facts))
}

/// The name, or with a number behind it if a file of the hand-in already has it: names that differ may become the same.
fn free_name(name: &str, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name} ({number})"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    names.find(|name| taken.insert(name.to_lowercase())).unwrap_or_default()
}

/// The hand-ins with distinct names: those of its students in the roster, else that of the platform, else its own in
/// the folder.
fn named_apart(mut hand_ins: Vec<HandInParts>, roster: Option<&Roster>) -> Vec<HandInParts> {
    for found in &mut hand_ins {
        let students = found.facts.people.iter().map(|person| {
            let place = owner(person, &roster?.students)?;
            Some(label(&roster?.students[place]))
        });
        let labels: Option<Vec<String>> = students.collect();
        let labels =
            labels.filter(|labels| !labels.is_empty() && !labels.iter().any(String::is_empty));
        let name = labels.map_or_else(|| found.facts.folder.clone(), |labels| labels.join("+"));
        found.facts.folder = file_name(&name);
    }
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for found in &hand_ins {
        *counts.entry(found.facts.folder.to_lowercase()).or_default() += 1;
    }
    for (number, found) in hand_ins.iter_mut().enumerate() {
        if counts.get(&found.facts.folder.to_lowercase()) != Some(&1) {
            let own = found.parts.first().map(|part| part.from.to_string_lossy().into_owned());
            // No other name ends like this, since file names of one folder differ.
            found.facts.folder = file_name(&format!(
                "{} ({})",
                found.facts.folder,
                own.unwrap_or_else(|| number.to_string())
            ));
        }
    }
    hand_ins
}

/// A short name of a student: login, ID, email address, or name.
fn label(student: &Student) -> String {
    let known = [&student.login, &student.id, &student.email, &student.name];
    known.into_iter().find(|text| !text.is_empty()).map_or_else(String::new, Untrusted::line)
}

/// A name that is safe as that of a file in a folder.
pub(super) fn file_name(name: &str) -> String {
    let plain = |character: char| {
        if steers(character) || "/\\\0".contains(character) { '_' } else { character }
    };
    let plain: String = name.chars().map(plain).take(LONGEST).collect();
    let trimmed = plain.trim().trim_start_matches('.');
    if trimmed.is_empty() { "_".to_owned() } else { trimmed.to_owned() }
}

/// The place of the one student who fits: by ID, login or email address, else by name.
fn owner(person: &Person, students: &[Student]) -> Option<usize> {
    let same = |text: &str, other: &Untrusted| {
        let other = other.raw(RawUse::Comparison);
        !text.is_empty() && text.trim().eq_ignore_ascii_case(other.trim())
    };
    let by_key = |student: &Student| {
        let local = student.email.raw(RawUse::Comparison).split('@').next().unwrap_or_default();
        same(&person.canvas_id, &student.canvas_id)
            || same(&person.id, &student.id)
            || same(&person.id, &student.login)
            || same(&person.login, &student.login)
            || same(&person.login, &local.into())
            || same(&person.email, &student.email)
    };
    let by_name = |student: &Student| {
        let name = student.name.raw(RawUse::Comparison);
        let turned = match name.split_once(',') {
            Some((last, first)) => [format!("{last}{first}"), format!("{first}{last}")],
            None => match name.rsplit_once(' ') {
                Some((first, last)) => [format!("{last}{first}"), format!("{first}{last}")],
                None => [name.to_owned(), String::new()],
            },
        };
        let wanted = squashed(&person.name);
        !wanted.is_empty() && turned.iter().any(|name| squashed(name) == wanted)
    };
    let only = |fits: &dyn Fn(&Student) -> bool| {
        let mut fitting = (0..students.len()).filter(|place| fits(&students[*place]));
        fitting.next().filter(|_| fitting.next().is_none())
    };
    only(&by_key).or_else(|| only(&by_name))
}

/// Letters and digits alone, in lower case.
fn squashed(name: &str) -> String {
    name.chars()
        .filter(|character| character.is_alphanumeric())
        .flat_map(char::to_lowercase)
        .collect()
}

/// Tells a roster which hand-in is whose, and when it came in, where its own columns do not. Of several hand-ins of one student,
/// none is assigned.
pub fn assign(roster: &mut Roster, arranged: &Arranged) {
    let mut of: BTreeMap<usize, Vec<&HandInFacts>> = BTreeMap::new();
    for facts in &arranged.hand_ins {
        for place in facts.people.iter().filter_map(|person| owner(person, &roster.students)) {
            of.entry(place).or_default().push(facts);
        }
    }
    for (place, found) in of {
        let student = &mut roster.students[place];
        if let [facts] = found[..]
            && student.folder.is_empty()
        {
            student.folder = facts.folder.as_str().into();
            student.submitted = student.submitted.or(facts.submitted.parse().ok());
        }
    }
}

/// The facts as CSV, for people.
///
/// # Errors
/// Never in practice.
pub fn table(arranged: &Arranged) -> csv::Result<Vec<u8>> {
    let columns =
        ["folder", "name", "id", "canvas id", "login", "email", "late", "submitted", "files"];
    let mut table = InertCsv::new(columns)?;
    for facts in &arranged.hand_ins {
        let joined = |fact: fn(&Person) -> &String| {
            facts.people.iter().map(fact).map(String::as_str).collect::<Vec<_>>().join(" + ")
        };
        table.row([
            facts.folder.as_str(),
            &joined(|person| &person.name),
            &joined(|person| &person.id),
            &joined(|person| &person.canvas_id),
            &joined(|person| &person.login),
            &joined(|person| &person.email),
            if facts.late { "late" } else { "" },
            &facts.submitted,
            &facts.from.join(", "),
        ])?;
    }
    table.bytes()
}
