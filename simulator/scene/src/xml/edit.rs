//! Replaces attribute values in the text of a scene; all other bytes stay.
//!
//! Comments, white space, the order of elements and of attributes remain as their author wrote them, so that any
//! program that reads the scene reads the edited one as well. Time and memory in proportion to the text.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// An attribute of an element of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeValue<'a> {
    /// The element's tag.
    pub tag: &'a str,
    /// The element's number among those with the same tag, from 0.
    pub number: usize,
    /// The attribute's name.
    pub name: &'a str,
    /// Its value, as it is spelt.
    pub value: &'a str,
}

/// The text of a scene, with the values that `replace` returns in place of those it was given. It is called for each
/// attribute in the order of the text. `None` if the text is not well-formed XML.
///
/// A value is written as it is: one with `"`, `<` or `&` has to be escaped.
pub fn edit(
    text: &str,
    mut replace: impl FnMut(AttributeValue<'_>) -> Option<String>,
) -> Option<String> {
    // The reader's positions do not count a byte order mark.
    let (mark, text) = text.split_at(if text.starts_with('\u{feff}') { 3 } else { 0 });
    let mut reader = Reader::from_str(text);
    let mut counts: Vec<(String, usize)> = Vec::new();
    let (mut edited, mut copied, mut depth) = (String::with_capacity(text.len()), 0, 0_usize);
    let mut element = |start: &BytesStart<'_>, offset: usize| {
        let tag = start.name().into_inner();
        let number = match counts.iter_mut().find(|(known, _)| known == tag) {
            Some((_, count)) => {
                *count += 1;
                *count
            }
            None => {
                counts.push((tag.to_owned(), 0));
                0
            }
        };
        // Names and values are slices of the element's own text, which follows its `<`.
        let content = start.as_ptr() as usize;
        for attribute in start.attributes() {
            let attribute = attribute.ok()?;
            let (name, value) = (attribute.key.into_inner(), attribute.value.as_ref());
            let Some(new) = replace(AttributeValue { tag, number, name, value }) else { continue };
            let begin = offset + 1 + (value.as_ptr() as usize - content);
            edited.push_str(text.get(copied..begin)?);
            edited.push_str(&new);
            copied = begin + value.len();
        }
        Some(())
    };
    loop {
        let offset = reader.buffer_position() as usize;
        match reader.read_event().ok()? {
            Event::Start(start) => {
                if depth == 1 {
                    element(&start, offset)?;
                }
                depth += 1;
            }
            Event::Empty(start) if depth == 1 => element(&start, offset)?,
            Event::End(_) => depth = depth.checked_sub(1)?,
            Event::Eof => break,
            _ => {}
        }
    }
    edited.push_str(text.get(copied..)?);
    Some(mark.to_owned() + &edited)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\u{feff}<?xml version='1.0'?>\r\n<!-- <particle m='1'/> -->\n<scene>\n\
        <unknown><particle m=\"9\"/></unknown><particle  m = '1.50'\tpx=\"&#45;2\" tag=\"a&quot;b\"></particle>\n\
        <particle px=\"3\" m=\"\"/><edge i='0' j='1'/>\n</scene>\n<!-- end -->";

    #[test]
    fn unedited_text_keeps_its_bytes() {
        let mut seen = Vec::new();
        let note = |attribute: AttributeValue<'_>| {
            let AttributeValue { tag, number, name, value } = attribute;
            seen.push(format!("{tag} {number} {name} {value}"));
            None
        };
        assert_eq!(edit(TEXT, note).as_deref(), Some(TEXT));
        let expected = [
            "particle 0 m 1.50",
            "particle 0 px &#45;2",
            "particle 0 tag a&quot;b",
            "particle 1 px 3",
            "particle 1 m ",
            "edge 0 i 0",
            "edge 0 j 1",
        ];
        assert_eq!(seen, expected);
        assert_eq!(edit("<scene><particle></scene>", |_| None), None);
    }

    #[test]
    fn a_value_is_replaced_where_it_stands() {
        let double = |attribute: AttributeValue<'_>| {
            (attribute.tag == "particle" && attribute.name == "m").then(|| "two".to_owned())
        };
        let expected = TEXT.replace("1.50", "two").replace("m=\"\"", "m=\"two\"");
        assert_eq!(edit(TEXT, double), Some(expected));
    }
}
