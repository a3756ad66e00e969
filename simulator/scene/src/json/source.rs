//! A text being parsed: its name, locations in it, and the warnings about it.

use crate::error::{JsonProblem, SceneError};
use crate::lines::LineCounter;
use crate::{Location, MAX_WARNINGS};

/// A text with what is needed to name a place in it.
pub(super) struct Source<'a> {
    pub(super) name: &'a str,
    pub(super) text: &'a str,
    lines: LineCounter<'a>,
}

impl<'a> Source<'a> {
    pub(super) fn new(name: &'a str, text: &'a str) -> Self {
        Self { name, text, lines: LineCounter::new(text) }
    }

    /// Where `part`, a slice of the text, starts.
    pub(super) fn offset_of(&self, part: &str) -> usize {
        part.as_ptr() as usize - self.text.as_ptr() as usize
    }

    pub(super) fn locate(&mut self, offset: usize) -> Location {
        self.lines.locate(offset)
    }

    pub(super) fn error(&mut self, offset: usize, problem: JsonProblem) -> SceneError {
        SceneError::new(self.name, self.locate(offset), problem.into())
    }

    /// A problem of the text as a whole.
    pub(super) fn whole(&self, problem: JsonProblem) -> SceneError {
        SceneError::whole_file(self.name, problem.into())
    }
}

/// The warnings on both files.
pub(super) struct Warnings {
    pub(super) strict: bool,
    pub(super) kept: Vec<SceneError>,
    pub(super) count: usize,
}

impl Warnings {
    /// A remark at a place; under `strict`, an error.
    pub(super) fn add(
        &mut self,
        source: &mut Source<'_>,
        offset: usize,
        problem: JsonProblem,
    ) -> Result<(), SceneError> {
        if self.strict {
            return Err(source.error(offset, problem));
        }
        self.count += 1;
        if self.kept.len() < MAX_WARNINGS {
            self.kept.push(source.error(offset, problem));
        }
        Ok(())
    }
}

/// The beginning of what the user wrote, for a message.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 40;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
