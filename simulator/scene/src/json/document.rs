//! The JSON object of a scene: its keys and values, with their places in the text.
//!
//! Values are kept as slices of the text, checked for their grammar and not parsed further than a scene
//! needs. Nothing recurses, however deep a value is; numbers are parsed by the standard library, which
//! rounds correctly.

use std::fmt;

use serde::de::{Deserializer as _, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::source::{Source, Warnings, excerpt};
use crate::error::{JsonProblem, SceneError};
use crate::schema::Domain;
use crate::spelling::closest;

/// The keys of a scene, with likely alternative names.
const KEYS: &[(&str, &[&str])] = &[
    ("obj", &["obj", "mesh"]),
    ("k", &["k", "stiffness"]),
    ("m", &["m", "mass"]),
    ("b", &["b", "pinned", "fixed"]),
    ("wind", &["wind"]),
    ("png", &["png", "texture"]),
];

/// Keys and values in the order of the file.
pub(super) struct Document<'a> {
    entries: Vec<Entry<'a>>,
}

/// A key and its value.
struct Entry<'a> {
    key: String,
    key_offset: usize,
    value: &'a str,
}

/// A text that is not a JSON object.
pub(super) enum NoDocument {
    /// The text is not well-formed.
    Malformed(SceneError),
    /// It is something else than an object.
    NotAnObject(SceneError),
}

impl<'a> Document<'a> {
    pub(super) fn read(source: &mut Source<'a>) -> Result<Self, NoDocument> {
        let blank = source.text.trim_start();
        if blank.is_empty() {
            return Err(NoDocument::Malformed(source.whole(JsonProblem::Empty)));
        }
        let start = source.offset_of(blank);
        let mut deserializer = serde_json::Deserializer::from_str(source.text);
        let read = deserializer
            .deserialize_map(Entries)
            .and_then(|entries| deserializer.end().map(|()| entries));
        let entries = read.map_err(|error| match error.classify() {
            serde_json::error::Category::Data => {
                NoDocument::NotAnObject(source.error(start, JsonProblem::NotAnObject))
            }
            _ => NoDocument::Malformed(malformed(source, &error)),
        })?;
        let entry = |(key, value): (&'a RawValue, &'a RawValue)| {
            // The grammar of the key was checked; what may be wrong still is an escape.
            let text = serde_json::from_str::<String>(key.get());
            let key_offset = source.offset_of(key.get());
            text.map(|key| Entry { key, key_offset, value: value.get() }).map_err(|error| {
                let detail = without_location(&error);
                let problem = JsonProblem::Malformed { detail };
                NoDocument::Malformed(source.error(key_offset, problem))
            })
        };
        Ok(Self { entries: entries.into_iter().map(entry).collect::<Result<_, _>>()? })
    }

    /// Whether the object is meant to be a scene.
    pub(super) fn is_scene(&self) -> bool {
        self.entries.iter().any(|entry| entry.key == "obj" || entry.key == "k")
    }

    /// An error for a key that is given twice, and a remark for one that is unknown.
    pub(super) fn check_keys(
        &self,
        source: &mut Source<'_>,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let mut by_key: Vec<&Entry<'_>> = self.entries.iter().collect();
        by_key.sort_by_key(|entry| (&entry.key, entry.key_offset));
        let repeated = by_key.windows(2).filter(|pair| pair[0].key == pair[1].key);
        if let Some([first, second]) = repeated.min_by_key(|pair| pair[1].key_offset) {
            let (key, first) = (excerpt(&second.key), source.locate(first.key_offset).line);
            return Err(source.error(second.key_offset, JsonProblem::RepeatedKey { key, first }));
        }
        for Entry { key, key_offset, .. } in &self.entries {
            if !KEYS.iter().any(|(known, _)| known == key) {
                let suggestion = suggestion(key).filter(|suggestion| !self.has(suggestion));
                let key = excerpt(key);
                warnings.add(source, *key_offset, JsonProblem::UnknownKey { key, suggestion })?;
            }
        }
        Ok(())
    }

    fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|entry| entry.key == key)
    }

    /// The text of a value.
    pub(super) fn find(&self, key: &str) -> Option<&'a str> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| entry.value)
    }

    /// A number, if the key is there.
    pub(super) fn number(
        &self,
        source: &mut Source<'_>,
        key: &'static str,
        domain: Domain,
    ) -> Result<Option<f64>, SceneError> {
        let Some(text) = self.find(key) else { return Ok(None) };
        let offset = source.offset_of(text);
        match parse_number(text) {
            Some(value) if domain.contains(value) => Ok(Some(value)),
            Some(value) if value.is_infinite() => {
                Err(source.error(offset, JsonProblem::Overflow { key, text: excerpt(text) }))
            }
            _ => Err(wrong_value(source, key, text, domain.describe())),
        }
    }

    /// A string, if the key is there.
    pub(super) fn string(
        &self,
        source: &mut Source<'_>,
        key: &'static str,
    ) -> Result<Option<String>, SceneError> {
        let Some(text) = self.find(key) else { return Ok(None) };
        match serde_json::from_str(text) {
            Ok(string) => Ok(Some(string)),
            Err(_) => Err(wrong_value(source, key, text, "a string")),
        }
    }

    /// True or false; false if the key is not there.
    pub(super) fn boolean(
        &self,
        source: &mut Source<'_>,
        key: &'static str,
    ) -> Result<bool, SceneError> {
        match self.find(key) {
            None | Some("false") => Ok(false),
            Some("true") => Ok(true),
            Some(text) => Err(wrong_value(source, key, text, "true or false")),
        }
    }

    /// The texts of a list's elements, or of the value where it is no list; none without the key.
    pub(super) fn list(&self, key: &str) -> Vec<&'a str> {
        let Some(text) = self.find(key) else { return Vec::new() };
        match serde_json::from_str::<Vec<&RawValue>>(text) {
            Ok(elements) => elements.into_iter().map(RawValue::get).collect(),
            Err(_) => vec![text],
        }
    }
}

/// The number that a value's text is, if it is one; infinite where it is too large.
pub(super) fn parse_number(text: &str) -> Option<f64> {
    // JSON has no infinity and no NaN, but the standard library does.
    let is_number = text.starts_with(|c: char| c == '-' || c.is_ascii_digit());
    if is_number { text.parse().ok() } else { None }
}

pub(super) fn wrong_value(
    source: &mut Source<'_>,
    key: &'static str,
    text: &str,
    must_be: &'static str,
) -> SceneError {
    let offset = source.offset_of(text);
    source.error(offset, JsonProblem::Value { key, text: excerpt(text), must_be })
}

fn suggestion(word: &str) -> Option<&'static str> {
    let words: Vec<&str> = KEYS.iter().flat_map(|(_, words)| words.iter().copied()).collect();
    let closest = closest(word, &words)?;
    KEYS.iter().find(|(_, words)| words.contains(&closest)).map(|(key, _)| *key)
}

fn malformed(source: &mut Source<'_>, error: &serde_json::Error) -> SceneError {
    let detail = without_location(error);
    if error.is_eof() {
        return source.error(source.text.trim_end().len(), JsonProblem::Truncated { detail });
    }
    // Its columns count bytes, and 0 is the end of the line before.
    let before = source.text.split_inclusive('\n').take(error.line().saturating_sub(1));
    let mut offset = before.map(str::len).sum::<usize>() + error.column().saturating_sub(1);
    offset = offset.min(source.text.len());
    source.error(offset, JsonProblem::Malformed { detail })
}

/// The message without the place, which stands before it in ours.
fn without_location(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    message.strip_suffix(&place).unwrap_or(&message).to_owned()
}

/// Takes the entries of an object as they stand in the text.
struct Entries;

impl<'de> Visitor<'de> for Entries {
    type Value = Vec<(&'de RawValue, &'de RawValue)>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        Ok(entries)
    }
}
