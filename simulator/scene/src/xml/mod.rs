//! Parser for the course's XML scenes.
//!
//! The parser is a pull parser over the text in memory: no recursion, no entity expansion, one pass,
//! time and memory in proportion to the file. Elements may come in any order: what names another
//! element by its number is resolved after the last one.

mod attributes;
pub mod edit;
mod elements;
mod resolve;
mod unresolved;

use quick_xml::Reader;
use quick_xml::errors::{Error as XmlError, IllFormedError};
use quick_xml::events::{BytesStart, Event};

use super::error::{Problem, SceneError};
use super::lines::LineCounter;
use super::schema::Vocabulary;
use super::{MAX_WARNINGS, ParseOptions, Parsed};
use crate::spelling::closest;
use unresolved::UnresolvedScene;

/// Elements of the schema that are not forces.
const ELEMENTS: &[&str] = &[
    "description",
    "scenetag",
    "duration",
    "integrator",
    "maxsimfreq",
    "particle",
    "edge",
    "particlecolor",
    "edgecolor",
    "backgroundcolor",
    "particlepath",
    "viewport",
];

/// Beginnings of the tags by which the course's later milestones add physics: contacts, rigid and
/// elastic bodies. A program that skipped them, or a force that it does not know, would simulate another
/// scene.
const UNMODELLED: &[&str] = &["collision", "halfplane", "rigidbody", "elasticbody"];

/// Elements may stand this deep inside each other; only unknown ones stand deeper than 2.
const MAX_DEPTH: usize = 32;

/// Reads a scene from its text. `name` is what messages call it.
///
/// # Errors
/// If the text is not well-formed XML, or is not a scene this vocabulary can express. The error
/// names line and column.
pub fn parse(
    text: &str,
    name: &str,
    vocabulary: &Vocabulary,
    options: &ParseOptions,
) -> Result<Parsed, SceneError> {
    let mut parser = Parser {
        text,
        name,
        vocabulary,
        options,
        lines: LineCounter::new(text),
        warnings: Vec::new(),
        n_warnings: 0,
        draft: UnresolvedScene::default(),
    };
    parser.read_document()?;
    parser.finish()
}

struct Parser<'a> {
    text: &'a str,
    name: &'a str,
    vocabulary: &'a Vocabulary,
    options: &'a ParseOptions,
    lines: LineCounter<'a>,
    warnings: Vec<SceneError>,
    n_warnings: usize,
    draft: UnresolvedScene,
}

impl Parser<'_> {
    fn read_document(&mut self) -> Result<(), SceneError> {
        let mut reader = Reader::from_str(self.text);
        // The open elements: name, offset, and whether what it holds is read.
        let mut open: Vec<(String, usize)> = Vec::new();
        let mut root_seen = false;
        loop {
            let offset = reader.buffer_position() as usize;
            let event = match reader.read_event() {
                Ok(event) => event,
                Err(error) => {
                    return Err(self.malformed(&error, reader.error_position() as usize, &open));
                }
            };
            match event {
                Event::Start(start) => {
                    self.enter(&start, offset, &open, &mut root_seen)?;
                    open.push((start.name().into_inner().to_owned(), offset));
                    if open.len() > MAX_DEPTH {
                        return Err(self.error(offset, Problem::TooDeep { limit: MAX_DEPTH }));
                    }
                }
                Event::Empty(start) => self.enter(&start, offset, &open, &mut root_seen)?,
                Event::End(_) => {
                    open.pop();
                }
                Event::Text(text) => {
                    self.stray_text(&text.into_inner(), offset, open.len())?;
                }
                Event::CData(text) => self.stray_text(&text.into_inner(), offset, open.len())?,
                Event::GeneralRef(reference) => {
                    let name = reference.into_inner();
                    let known = ["lt", "gt", "amp", "quot", "apos"].contains(&&*name);
                    if !known && !name.starts_with('#') {
                        let detail = format!("there is no entity &{name};");
                        return Err(self.error(offset, Problem::Malformed { detail }));
                    }
                    self.stray_text(&format!("&{name};"), offset, open.len())?;
                }
                Event::DocType(_) => return Err(self.error(offset, Problem::Doctype)),
                Event::Comment(_) | Event::Decl(_) | Event::PI(_) => {}
                Event::Eof => break,
            }
        }
        if let Some((tag, offset)) = open.pop() {
            return Err(self.error(offset, Problem::Truncated { tag }));
        }
        if !root_seen {
            let blank = self.text.trim().is_empty();
            let problem = if blank { Problem::Empty } else { Problem::NoRoot };
            return Err(SceneError::whole_file(self.name, problem));
        }
        Ok(())
    }

    fn malformed(
        &mut self,
        error: &XmlError,
        offset: usize,
        open: &[(String, usize)],
    ) -> SceneError {
        if let (XmlError::IllFormed(IllFormedError::MissingEndTag(_)), Some((tag, offset))) =
            (error, open.last())
        {
            return self.error(*offset, Problem::Truncated { tag: tag.clone() });
        }
        self.error(offset, Problem::Malformed { detail: error.to_string() })
    }

    /// Reads the element that starts at `offset`.
    fn enter(
        &mut self,
        start: &BytesStart<'_>,
        offset: usize,
        open: &[(String, usize)],
        root_seen: &mut bool,
    ) -> Result<(), SceneError> {
        let name = start.name();
        let tag = name.into_inner();
        match open {
            [] if *root_seen => {
                Err(self.error(offset, Problem::SecondRoot { found: tag.to_owned() }))
            }
            [] if tag != "scene" => {
                Err(self.error(offset, Problem::WrongRoot { found: tag.to_owned() }))
            }
            [] => {
                *root_seen = true;
                let element = self.element(start, "scene", offset)?;
                self.check_attributes(&element, &[])
            }
            [_] => self.read_element(start, tag, offset),
            [_, (parent, _), ..] if self.is_known(parent) => {
                let (tag, inner) = (parent.clone(), tag.to_owned());
                Err(self.error(offset, Problem::Nested { tag, inner }))
            }
            // Inside an element that was reported as unknown.
            _ => Ok(()),
        }
    }

    fn is_known(&self, tag: &str) -> bool {
        ELEMENTS.contains(&tag) || self.vocabulary.force(tag).is_some()
    }

    fn stray_text(&mut self, text: &str, offset: usize, depth: usize) -> Result<(), SceneError> {
        let trimmed = text.trim_start();
        if trimmed.is_empty() || depth > 2 {
            return Ok(());
        }
        let offset = offset + (text.len() - trimmed.len());
        let shown: String = trimmed.trim_end().chars().take(40).collect();
        if depth == 0 {
            let detail = format!("{shown:?} stands outside of the root element");
            return Err(self.error(offset, Problem::Malformed { detail }));
        }
        self.warn(offset, Problem::StrayText { text: shown })
    }

    fn error(&mut self, offset: usize, problem: Problem) -> SceneError {
        SceneError::new(self.name, self.lines.locate(offset), problem)
    }

    /// Whether a further remark is kept, and not only counted.
    fn keeps_warnings(&self) -> bool {
        self.warnings.len() < MAX_WARNINGS
    }

    /// A remark; under `strict`, an error.
    fn warn(&mut self, offset: usize, problem: Problem) -> Result<(), SceneError> {
        let remark = self.error(offset, problem);
        if self.options.strict {
            return Err(remark);
        }
        self.n_warnings += 1;
        if self.keeps_warnings() {
            self.warnings.push(remark);
        }
        Ok(())
    }
}
