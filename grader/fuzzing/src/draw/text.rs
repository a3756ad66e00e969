//! The file of a drawn scene. One in four is awkward, and legal: elements and attributes in other orders, comments, empty lines,
//! line ends of other systems, end tags, single quotes, numbers with an exponent or with more zeros.

use scene::Scene;

use super::plain;
use crate::choices::Choices;

/// The text; `None` if no file can hold the scene.
pub(super) fn of(scene: &Scene, spelling: &str, choices: &mut Choices) -> Option<String> {
    let written = plain(scene)?;
    let name = format!("type=\"{}\"", scene.integrator.name);
    let written = written.replace(&name, &format!("type=\"{spelling}\""));
    if !choices.chance(4) {
        return Some(written);
    }
    let elements = written.lines().filter(|line| line.starts_with("  <"));
    // Kinds in another order; elements of a kind are numbered by theirs.
    let mut kinds: Vec<(&str, Vec<Element<'_>>)> = Vec::new();
    for element in elements.filter_map(Element::of) {
        match kinds.iter_mut().find(|(tag, _)| *tag == element.tag) {
            Some((_, known)) => known.push(element),
            None => kinds.push((element.tag, vec![element])),
        }
    }
    choices.shuffle(&mut kinds);
    let end = if choices.chance(4) { "\r\n" } else { "\n" };
    let mut text = format!("<?xml version=\"1.0\"?>{end}<!-- a > b & <c/> -->{end}<scene>{end}");
    for mut element in kinds.into_iter().flat_map(|(_, elements)| elements) {
        choices.shuffle(&mut element.attributes);
        text += &element.written(choices);
        text += end;
        if choices.chance(2) {
            text += end;
        }
    }
    text += "</scene>";
    Some(text)
}

/// An element of a written scene.
struct Element<'a> {
    tag: &'a str,
    /// Names and values.
    attributes: Vec<(&'a str, &'a str)>,
}

impl<'a> Element<'a> {
    /// The element of a line.
    fn of(line: &'a str) -> Option<Self> {
        let inner = line.trim().strip_prefix('<')?.strip_suffix("/>")?;
        let (tag, rest) = inner.split_once(' ').unwrap_or((inner, ""));
        let pairs =
            rest.split("\" ").filter_map(|pair| pair.trim_end_matches('"').split_once("=\""));
        Some(Self { tag, attributes: pairs.collect() })
    }

    fn written(&self, choices: &mut Choices) -> String {
        let quote = if choices.chance(2) { '\'' } else { '"' };
        let gap = if choices.chance(2) { "\n    " } else { " " };
        let mut text = format!("  <{}", self.tag);
        for (name, value) in &self.attributes {
            let value = respelt(value, choices);
            text += &format!("{gap}{name}={quote}{value}{quote}");
        }
        text + &if choices.chance(2) { format!("></{}>", self.tag) } else { " />".to_owned() }
    }
}

/// The same number in another spelling, where it has a point.
fn respelt(value: &str, choices: &mut Choices) -> String {
    let is_plain = value.contains('.') && !value.contains('e') && value.parse::<f64>().is_ok();
    if !is_plain {
        return value.to_owned();
    }
    match choices.below(12) {
        1 => format!("{value}00"),
        2 => format!("{value}e0"),
        3 => format!("{value}E+00"),
        _ => value.to_owned(),
    }
}
