//! Gradescope's export of submissions: folders `submission_N`, and `submission_metadata.yml`, which says whose they are.
//!
//! ```yaml
//! submission_123:
//!   :submitters:
//!   - :name: Ada Lovelace
//!     :sid: al1815
//!     :email: ada@x.edu
//!   :created_at: 2026-02-01 23:59:00.123456000 Z
//! ```
//!
//! A group has several submitters. All else in it is passed over, also the output of earlier autograders. A key that stands twice
//! in a table is refused, since two tables would become one.

use std::collections::{BTreeMap, BTreeSet};

use saphyr_parser::{Event, Parser};

use super::arrange::Person;
use super::{ClassFolder, FolderEntry, HandInFacts, HandInParts, LayoutError, PassedOver, Reading};
use crate::boundary::door::Door;
use crate::boundary::printed::{self, RawUse, Untrusted};
use crate::time::Time;

/// Name of the file.
const METADATA: &str = "submission_metadata.yml";

/// Maximum depth of tables and lists in each other.
const MAX_DEPTH: usize = 100;

/// Reads the folder. Unless a person named the layout, the metadata are read only if most entries fit: else a student may
/// have written them.
pub(super) fn read(folder: &ClassFolder, is_named: bool) -> Result<Reading, LayoutError> {
    let is_submission = |entry: &&FolderEntry| {
        let number = entry.name.strip_prefix("submission_").filter(|_| entry.is_folder);
        number.is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let is_metadata = |entry: &&FolderEntry| entry.name == METADATA && !entry.is_folder;
    let n_submissions = folder.entries.iter().filter(is_submission).count();
    let n_metadata = folder.entries.iter().filter(is_metadata).count();
    let fits = 2 * n_submissions + n_metadata > folder.entries.len();
    let mut known = BTreeMap::new();
    if n_metadata > 0 && (fits || is_named) {
        let path = folder.path.join(METADATA);
        let text = Door::Export
            .text(&path)
            .map_err(|error| LayoutError::Closed { path: path.clone(), error })?;
        known = parse(&text).map_err(|(line, message)| LayoutError::Metadata {
            path,
            line,
            message,
        })?;
    }
    let (mut hand_ins, mut rest) = (Vec::new(), Vec::new());
    for entry in folder.entries.iter().filter(|entry| !is_metadata(entry)) {
        if is_submission(&entry) {
            let facts = known.remove(&entry.name).unwrap_or_default();
            let mut found = HandInParts::new(&entry.name, entry.whole());
            let shown = |person: &Person| {
                [&person.id, &person.email, &person.name]
                    .into_iter()
                    .find(|text| !text.is_empty())
                    .cloned()
            };
            let names: Vec<String> = facts.people.iter().filter_map(shown).collect();
            let name = if names.is_empty() { entry.name.clone() } else { names.join("+") };
            found.facts = HandInFacts { folder: name, ..facts };
            hand_ins.push(found);
        } else {
            rest.push(entry.passed_over("it is no submission of Gradescope"));
        }
    }
    let reason = format!("{METADATA} names it, and there is no such folder");
    known.retain(|name, _| folder.refused.iter().all(|refused| refused.name != *name));
    rest.extend(known.into_keys().map(|name| PassedOver { name, reason: reason.clone() }));
    Ok(Reading { hand_ins, rest })
}

/// A list or a table that is open.
enum Open {
    List,
    Table {
        /// The keys so far, without the marks of Ruby's symbols.
        keys: BTreeSet<String>,
        /// The key whose value comes next.
        key: Option<String>,
    },
}

/// The submissions of the file, by the names of their folders.
///
/// # Errors
/// The line and a message, if it is no YAML, or says one thing twice.
pub fn parse(text: &Untrusted) -> Result<BTreeMap<String, HandInFacts>, (usize, String)> {
    let mut found: BTreeMap<String, HandInFacts> = BTreeMap::new();
    let mut open: Vec<Open> = Vec::new();
    let mut documents = 0;
    for event in Parser::new_from_str(text.raw(RawUse::Parsing)) {
        let (event, span) =
            event.map_err(|error| (error.marker().line(), printed::text(error.info())))?;
        let refused = |message: String| Err((span.start.line(), message));
        let is_key = matches!(open.last(), Some(Open::Table { key: None, .. }));
        match event {
            Event::DocumentStart(..) => {
                documents += 1;
                if documents > 1 {
                    return refused("a second document".to_owned());
                }
            }
            Event::MappingStart(..) | Event::SequenceStart(..) | Event::Alias(_) if is_key => {
                return refused("a key that is no text".to_owned());
            }
            Event::MappingStart(..) | Event::SequenceStart(..) if open.len() == MAX_DEPTH => {
                return refused(format!("more than {MAX_DEPTH} tables and lists in each other"));
            }
            Event::MappingStart(..) => {
                if let [_, _, Open::List] = &open[..]
                    && let Some(facts) = submission(&open, &mut found)
                {
                    facts.people.push(Person::default());
                }
                open.push(Open::Table { keys: BTreeSet::new(), key: None });
            }
            Event::SequenceStart(..) => open.push(Open::List),
            Event::MappingEnd | Event::SequenceEnd => {
                open.pop();
                if let Some(Open::Table { key, .. }) = open.last_mut() {
                    *key = None;
                }
            }
            Event::Scalar(value, ..) => match open.last_mut() {
                Some(Open::Table { keys, key: key @ None }) => {
                    let shown = printed::text(&value);
                    if !keys.insert(bare(&shown).to_owned()) {
                        return refused(format!("the key {shown} stands twice"));
                    }
                    *key = Some(shown);
                }
                Some(Open::Table { key, .. }) => {
                    let key = key.take().unwrap_or_default();
                    if let Some(facts) = submission(&open, &mut found) {
                        fill(facts, open.len(), &key, &printed::text(&value));
                    }
                }
                _ => {}
            },
            // It repeats a value from before; none of these is one.
            Event::Alias(_) => {
                if let Some(Open::Table { key, .. }) = open.last_mut() {
                    *key = None;
                }
            }
            _ => {}
        }
    }
    Ok(found)
}

/// The facts of the submission that is open.
fn submission<'a>(
    open: &[Open],
    found: &'a mut BTreeMap<String, HandInFacts>,
) -> Option<&'a mut HandInFacts> {
    let [Open::Table { key: Some(name), .. }, Open::Table { key, .. }, inner @ ..] = open else {
        return None;
    };
    let is_of_submitters = key.as_deref().is_some_and(|key| bare(key) == "submitters");
    let is_known = inner.is_empty() || is_of_submitters && matches!(inner, [Open::List, ..]);
    is_known.then(|| found.entry(name.clone()).or_default())
}

/// Takes a fact at this depth of tables and lists.
fn fill(facts: &mut HandInFacts, depth: usize, key: &str, value: &str) {
    let value = if ["~", "null"].contains(&value) { "" } else { value };
    if (depth, bare(key)) == (2, "created_at") {
        facts.submitted = time(value);
    }
    let Some(person) = facts.people.last_mut().filter(|_| depth == 4) else { return };
    match bare(key) {
        "name" => person.name = value.to_owned(),
        "sid" => person.id = value.to_owned(),
        "email" => person.email = value.to_owned(),
        _ => {}
    }
}

/// A key without the mark of Ruby's symbols.
fn bare(key: &str) -> &str {
    key.strip_prefix(':').unwrap_or(key)
}

/// A time that may have spaces between date, time and offset, as our times are written; empty if it is none.
fn time(text: &str) -> String {
    let parts: Vec<&str> = text.split_whitespace().collect();
    let text = match parts[..] {
        [date, time, zone] => format!("{date}T{time}{}", zone.replace("UTC", "Z")),
        _ => text.to_owned(),
    };
    if text.parse::<Time>().is_ok() { text } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submitters_and_times_are_read_and_nothing_else() {
        let text = "---\nsubmission_1:\n  :submitters:\n  - :name: Ada Lovelace\n    :sid: al1815\n    :email: ada@x.edu\n  - :name: 'O''Brien, \"Bob\"'\n    :sid: ''\n    :email: bob@x.edu\n  :created_at: 1970-01-01 00:01:00.500000000 Z\n  :score: 3.0\n  :results:\n    tests:\n    - :name: Eve\n      output: |-\n        submission_9:\n          :submitters:\n    :submitters:\n    - :name: Mallory\n  :history:\n  - :name: Trudy\n    :created_at: 1999-01-01 00:00:00 Z\nsubmission_2:\n  :submitters: []\n  :created_at: 1970-01-01 01:00:00 +01:00\n";
        let parse = |text: &str| parse(&text.into());
        let found = parse(text).unwrap();
        assert_eq!(found.keys().collect::<Vec<_>>(), ["submission_1", "submission_2"]);
        let [ada, bob] = &found["submission_1"].people[..] else { panic!("{found:?}") };
        assert_eq!((&*ada.name, &*ada.id, &*ada.email), ("Ada Lovelace", "al1815", "ada@x.edu"));
        assert_eq!((&*bob.name, &*bob.id), ("O'Brien, \"Bob\"", ""));
        let submitted = |name: &str| found[name].submitted.parse();
        assert_eq!(submitted("submission_1"), Ok(Time(60.5)));
        assert_eq!(submitted("submission_2"), Ok(Time(0.0)));
        assert_eq!(parse("a: [\nb: }\n").unwrap_err().0, 2);
        // An alias is a value, and shifts no key.
        let found = parse("a:\n  :x: &id v\n  :y: *id\n  :created_at: 1970-01-01 00:01:00 Z\n");
        assert_eq!(found.unwrap()["a"].submitted.parse(), Ok(Time(60.0)));
    }

    #[test]
    fn what_is_said_twice_is_refused_by_its_line() {
        let person = "a:\n  :submitters:\n  - :sid: x\n";
        for (text, line, message) in [
            ("a: {}\nb: {}\na: {}\n".to_owned(), 3, "the key a stands twice"),
            ("a:\n  :created_at: x\n  created_at: y\n".to_owned(), 3, "created_at stands twice"),
            (format!("{person}    :sid: y\n"), 4, "the key :sid stands twice"),
            (format!("{person}  :submitters: []\n"), 4, "the key :submitters stands twice"),
            ("a: {}\n---\na: {}\n".to_owned(), 2, "a second document"),
            ("x: &id a\n*id : {}\n".to_owned(), 2, "a key that is no text"),
            ("? {a: b}\n: c\n".to_owned(), 1, "a key that is no text"),
            ("a: ".to_owned() + &"[".repeat(200), 1, "more than 100 tables and lists"),
        ] {
            let (found, told) = parse(&text.as_str().into()).unwrap_err();
            assert!(found == line && told.contains(message), "{text}: {found}: {told}");
        }
    }
}
