//! Finds, parses and validates attributes, with their places in the text.

use std::borrow::Cow;

use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;
use quick_xml::events::attributes::AttrError;

use super::unresolved::Reference;
use super::{Parser, closest};
use crate::error::{Problem, SceneError};
use crate::schema::Domain;

/// An element with its attributes.
pub(super) struct Element<'a> {
    pub(super) tag: &'static str,
    pub(super) offset: usize,
    pub(super) attributes: Vec<Attribute<'a>>,
}

impl<'a> Element<'a> {
    pub(super) fn find(&self, name: &str) -> Option<&Attribute<'a>> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }
}

pub(super) struct Attribute<'a> {
    pub(super) name: &'a str,
    pub(super) value: Cow<'a, str>,
    pub(super) offset: usize,
}

/// Where in the element's text, and what.
fn describe(error: &AttrError) -> (usize, String) {
    match *error {
        AttrError::ExpectedEq(position) => (position, "an attribute has no value".to_owned()),
        AttrError::ExpectedValue(position) => (position, "a value is missing after `=`".to_owned()),
        AttrError::UnquotedValue(position) => (position, "a value has no quotes".to_owned()),
        AttrError::ExpectedQuote(position, _) => {
            (position, "a closing quote is missing".to_owned())
        }
        AttrError::Duplicated(position, _) => (position, "an attribute is given twice".to_owned()),
    }
}

impl Parser<'_> {
    pub(super) fn element<'b>(
        &mut self,
        start: &'b BytesStart<'_>,
        tag: &'static str,
        offset: usize,
    ) -> Result<Element<'b>, SceneError> {
        let mut attributes = Vec::with_capacity(10);
        let content_offset = offset + 1;
        let content = start.as_ptr() as usize;
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|error| {
                let (position, detail) = describe(&error);
                let detail = format!("in <{tag}>, {detail}");
                self.error(content_offset + position, Problem::Malformed { detail })
            })?;
            let name = attribute.key.into_inner();
            // Keys are slices of the element's own text.
            let offset = content_offset + (name.as_ptr() as usize - content);
            let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| {
                let detail = format!("in <{tag}>, the value of {name:?}: {error}");
                self.error(offset, Problem::Malformed { detail })
            })?;
            attributes.push(Attribute { name, value, offset });
        }
        Ok(Element { tag, offset, attributes })
    }

    /// Remarks on attributes that the element does not have.
    pub(super) fn check_attributes(
        &mut self,
        element: &Element<'_>,
        known: &[&'static str],
    ) -> Result<(), SceneError> {
        for attribute in &element.attributes {
            if !known.contains(&attribute.name) {
                let closest =
                    if self.keeps_warnings() { closest(attribute.name, known) } else { None };
                let suggestion = closest.filter(|suggestion| element.find(suggestion).is_none());
                let (tag, name) = (element.tag.to_owned(), attribute.name.to_owned());
                let problem = Problem::UnknownAttribute { tag, attribute: name, suggestion };
                self.warn(attribute.offset, problem)?;
            }
        }
        Ok(())
    }

    pub(super) fn text_of<'e>(
        &mut self,
        element: &'e Element<'_>,
        name: &'static str,
    ) -> Result<&'e str, SceneError> {
        match element.find(name) {
            Some(attribute) => Ok(&attribute.value),
            None => {
                let given: Vec<&str> =
                    element.attributes.iter().map(|attribute| attribute.name).collect();
                let similar = closest(name, &given).map(str::to_owned);
                let (tag, attribute) = (element.tag.to_owned(), name.to_owned());
                Err(self
                    .error(element.offset, Problem::MissingAttribute { tag, attribute, similar }))
            }
        }
    }

    pub(super) fn number(
        &mut self,
        element: &Element<'_>,
        name: &'static str,
        domain: Domain,
    ) -> Result<f64, SceneError> {
        let text = self.text_of(element, name)?.trim();
        let at = |problem: fn(String, String, String) -> Problem| {
            problem(element.tag.to_owned(), name.to_owned(), text.to_owned())
        };
        let offset = element.find(name).map_or(element.offset, |attribute| attribute.offset);
        match text.parse::<f64>() {
            Ok(value) if domain.contains(value) => Ok(value),
            Ok(value) if value.is_infinite() && text.contains(|c: char| c.is_ascii_digit()) => {
                let problem = at(|tag, attribute, text| Problem::Overflow { tag, attribute, text });
                Err(self.error(offset, problem))
            }
            Ok(_) => Err(self.out_of_domain(element, name, domain.describe())),
            Err(_) => {
                let problem =
                    at(|tag, attribute, text| Problem::NotANumber { tag, attribute, text });
                Err(self.error(offset, problem))
            }
        }
    }

    pub(super) fn number_or(
        &mut self,
        element: &Element<'_>,
        name: &'static str,
        domain: Domain,
        default: f64,
    ) -> Result<f64, SceneError> {
        match element.find(name) {
            Some(_) => self.number(element, name, domain),
            None => Ok(default),
        }
    }

    pub(super) fn reference(
        &mut self,
        element: &Element<'_>,
        name: &'static str,
    ) -> Result<Reference, SceneError> {
        let text = self.text_of(element, name)?.trim();
        let offset = element.find(name).map_or(element.offset, |attribute| attribute.offset);
        match text.parse() {
            Ok(index) => Ok(Reference { index, tag: element.tag, attribute: name, offset }),
            Err(_) => {
                let (tag, attribute, text) =
                    (element.tag.to_owned(), name.to_owned(), text.to_owned());
                Err(self.error(offset, Problem::NotAnIndex { tag, attribute, text }))
            }
        }
    }

    pub(super) fn out_of_domain(
        &mut self,
        element: &Element<'_>,
        name: &str,
        must_be: impl Into<Cow<'static, str>>,
    ) -> SceneError {
        let must_be = must_be.into();
        let attribute = element.find(name);
        let text = attribute.map_or(String::new(), |attribute| attribute.value.trim().to_owned());
        let offset = attribute.map_or(element.offset, |attribute| attribute.offset);
        let (tag, attribute) = (element.tag.to_owned(), name.to_owned());
        self.error(offset, Problem::OutOfDomain { tag, attribute, text, must_be })
    }
}
