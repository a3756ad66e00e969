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
//! A group has several submitters. All else in it is passed over, also the output of earlier autograders.

use std::collections::BTreeMap;

use saphyr_parser::{Event, Parser};

use super::arrange::Person;
use super::{ClassFolder, FolderEntry, HandInFacts, HandInParts, LayoutError, PassedOver, Reading};
use crate::boundary::{own_file, printed};
use crate::time::Time;

/// Name of the file.
const METADATA: &str = "submission_metadata.yml";

/// Maximum size of the file, in MiB: it has the results of every submission.
const MAX_MEBIBYTES: u64 = 512;

pub(super) fn read(folder: &ClassFolder) -> Result<Reading, LayoutError> {
    let is_submission = |entry: &&FolderEntry| {
        let number = entry.name.strip_prefix("submission_").filter(|_| entry.is_folder);
        number.is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let is_metadata = |entry: &&FolderEntry| entry.name == METADATA;
    let mut known = BTreeMap::new();
    if folder.entries.iter().any(|entry| is_metadata(&entry)) {
        let path = folder.path.join(METADATA);
        let text = own_file::read_text(&path, MAX_MEBIBYTES)
            .map_err(|source| LayoutError::Io { path: path.clone(), source })?;
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
    rest.extend(known.into_keys().map(|name| PassedOver { name, reason: reason.clone() }));
    Ok(Reading { hand_ins, rest })
}

/// A list or a table that is open, with the key in it whose value comes next.
enum Open {
    List,
    Table(Option<String>),
}

/// The submissions of the file.
///
/// # Errors
/// The line and a message, if it is no YAML.
fn parse(text: &str) -> Result<BTreeMap<String, HandInFacts>, (usize, String)> {
    let mut found: BTreeMap<String, HandInFacts> = BTreeMap::new();
    let mut open: Vec<Open> = Vec::new();
    for event in Parser::new_from_str(text) {
        let (event, _) =
            event.map_err(|error| (error.marker().line(), printed::text(error.info())))?;
        match event {
            Event::MappingStart(..) => {
                if let [_, _, Open::List] = &open[..]
                    && let Some(facts) = submission(&open, &mut found)
                {
                    facts.people.push(Person::default());
                }
                open.push(Open::Table(None));
            }
            Event::SequenceStart(..) => open.push(Open::List),
            Event::MappingEnd | Event::SequenceEnd => {
                open.pop();
                if let Some(Open::Table(key)) = open.last_mut() {
                    *key = None;
                }
            }
            Event::Scalar(value, ..) => match open.last_mut() {
                Some(Open::Table(key @ None)) => *key = Some(value.into_owned()),
                Some(Open::Table(key)) => {
                    let key = key.take().unwrap_or_default();
                    if let Some(facts) = submission(&open, &mut found) {
                        fill(facts, open.len(), &key, &printed::text(&value));
                    }
                }
                _ => {}
            },
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
    let [Open::Table(Some(name)), Open::Table(key), inner @ ..] = open else { return None };
    let is_of_submitters = key.as_deref().is_some_and(|key| bare(key) == "submitters");
    let is_known = inner.is_empty() || is_of_submitters && matches!(inner, [Open::List, ..]);
    is_known.then(|| found.entry(printed::text(name)).or_default())
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
        let found = parse(text).unwrap();
        assert_eq!(found.keys().collect::<Vec<_>>(), ["submission_1", "submission_2"]);
        let [ada, bob] = &found["submission_1"].people[..] else { panic!("{found:?}") };
        assert_eq!((&*ada.name, &*ada.id, &*ada.email), ("Ada Lovelace", "al1815", "ada@x.edu"));
        assert_eq!((&*bob.name, &*bob.id), ("O'Brien, \"Bob\"", ""));
        let submitted = |name: &str| found[name].submitted.parse();
        assert_eq!(submitted("submission_1"), Ok(Time(60.5)));
        assert_eq!(submitted("submission_2"), Ok(Time(0.0)));
        assert_eq!(parse("a: [\nb: }\n").unwrap_err().0, 2);
    }
}
