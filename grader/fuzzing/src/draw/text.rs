//! The file of a drawn scene. One in four is awkward, and legal. Each of these is drawn for a file by itself, so that one that fails
//! has few of them:
//!
//! - elements in another order, of a kind together or not, and attributes in another order;
//! - white space of any of its four characters, wherever there may be some;
//! - single quotes, end tags, line ends of other systems or none;
//! - a declaration, and comments in which there is what looks like an element, a string or an end of something;
//! - numbers in other spellings of the same decimal, attributes that hold their default;
//! - elements and attributes for drawings, whose texts hold any character, as it is or as a reference.

use scene::schema::{ForceSchema, ParameterSchema};
use scene::{Dimension, EDGE_RADIUS, PARTICLE_RADIUS, Scene};
use simulator::vocabulary;

use super::plain;
use crate::choices::Choices;

/// White space, which must be there.
const SPACES: &[&str] = &[" ", "\t", "\n", "\r\n", "\n    ", "  ", " \t ", "\r"];

/// White space, which may be there.
const GAPS: &[&str] = &["", " ", "\t", "\n"];

/// Ends of lines, which is white space between elements.
const LINE_ENDS: &[&str] = &["\n", "\r\n", "", "\n\n", "\n\t", "\r"];

/// Quotes of values.
const QUOTES: &[char] = &['"', '\''];

/// Beginnings of a file.
const DECLARATIONS: &[&str] = &[
    "",
    "<?xml version=\"1.0\"?>\n",
    "<?xml version='1.0' encoding='UTF-8' standalone='yes'?>\n",
    "<?xml version = \"1.0\" encoding = \"utf-8\" ?>",
];

/// Words with a meaning somewhere in XML, and none within a text.
const WORDS: &[&str] = &[
    "a",
    " ",
    ">",
    "<",
    "/>",
    "&",
    "'",
    "\"",
    "=",
    "</scene>",
    "<!-",
    "->",
    "?",
    "é",
    "]]>",
    "m=\"9\"",
    "\t",
    "\n",
    "#",
    "&lt;",
    "<edge i=\"0\" j=\"1\"/>",
    "<duration time='9'/>",
    "//",
    "{",
    "%s",
    "\\",
];

/// How a file is written. The first of a list is the plain way.
struct Style {
    spaces: &'static [&'static str],
    gaps: &'static [&'static str],
    line_end: &'static str,
    quotes: &'static [char],
    has_comments: bool,
    has_end_tags: bool,
    has_spellings: bool,
}

/// All of a list in one file of four, otherwise its first.
fn some<T>(all: &'static [T], choices: &mut Choices) -> &'static [T] {
    if choices.chance(4) { all } else { &all[..1] }
}

impl Style {
    fn draw(choices: &mut Choices) -> Self {
        let spaces = some(SPACES, choices);
        let line_ends = some(LINE_ENDS, choices);
        Self {
            spaces,
            gaps: if spaces.len() > 1 { some(GAPS, choices) } else { &GAPS[..1] },
            line_end: choices.one_of(line_ends),
            quotes: some(QUOTES, choices),
            has_comments: choices.chance(4),
            has_end_tags: choices.chance(4),
            has_spellings: choices.chance(4),
        }
    }

    /// A comment, seldom, in a file that has some.
    fn comment(&self, choices: &mut Choices) -> String {
        if !self.has_comments || !choices.chance(4) {
            return String::new();
        }
        let mut text = words(choices);
        while text.contains("--") {
            text = text.replace("--", "-");
        }
        format!("<!-- {text} -->")
    }
}

/// The text; `None` if no file can hold the scene.
pub(super) fn of(scene: &Scene, spelling: &str, choices: &mut Choices) -> Option<String> {
    let written = plain(scene)?;
    let name = format!("type=\"{}\"", scene.integrator.name);
    let written = written.replace(&name, &format!("type=\"{spelling}\""));
    if !choices.chance(4) {
        return Some(written);
    }
    let lines = written.lines().filter(|line| line.starts_with("  <"));
    let mut elements: Vec<Element> = lines.filter_map(Element::of).collect();
    let style = &Style::draw(choices);
    if choices.chance(4) {
        add_looks(&mut elements, scene, choices);
    }
    if choices.chance(4) {
        add_defaults(&mut elements, scene, choices);
    }
    if choices.chance(6) {
        elements = reordered(elements, choices);
    }
    let end = style.line_end;
    let declarations = some(DECLARATIONS, choices);
    let mut text = choices.one_of(declarations).to_owned();
    text += &style.comment(choices);
    text += &format!("<scene{}>{end}", choices.one_of(style.gaps));
    for element in elements {
        text += &style.comment(choices);
        element.write(&mut text, style, choices);
        text += end;
    }
    text += &format!("</scene{}>", choices.one_of(style.gaps));
    text += &style.comment(choices);
    Some(text)
}

/// An element of a written scene.
struct Element {
    tag: String,
    attributes: Vec<(String, Value)>,
}

/// The value of an attribute.
enum Value {
    /// A number or a name.
    Plain(String),
    /// A text, as it is meant.
    Text(String),
}

impl Element {
    /// The element of a line.
    fn of(line: &str) -> Option<Self> {
        let inner = line.trim().strip_prefix('<')?.strip_suffix("/>")?;
        let (tag, rest) = inner.split_once(' ').unwrap_or((inner, ""));
        let pairs =
            rest.split("\" ").filter_map(|pair| pair.trim_end_matches('"').split_once("=\""));
        let pairs = pairs.map(|(name, value)| (name.to_owned(), Value::Plain(value.to_owned())));
        Some(Self { tag: tag.to_owned(), attributes: pairs.collect() })
    }

    fn new<const N: usize>(tag: &str, attributes: [(&str, Value); N]) -> Self {
        let attributes = attributes.into_iter().map(|(name, value)| (name.to_owned(), value));
        Self { tag: tag.to_owned(), attributes: attributes.collect() }
    }

    fn write(&self, text: &mut String, style: &Style, choices: &mut Choices) {
        *text += &format!("  <{}", self.tag);
        for (name, value) in &self.attributes {
            let [space, before, after] =
                [style.spaces, style.gaps, style.gaps].map(|list| choices.one_of(list));
            let quote = choices.one_of(style.quotes);
            let value = match value {
                Value::Plain(value) if style.has_spellings => respelt(value, choices),
                Value::Plain(value) => value.clone(),
                Value::Text(value) => escaped(value, quote, choices),
            };
            *text += &format!("{space}{name}{before}={after}{quote}{value}{quote}");
        }
        *text += choices.one_of(style.gaps);
        if style.has_end_tags && choices.chance(8) {
            let comment = style.comment(choices);
            *text += &format!(">{comment}</{}{}>", self.tag, choices.one_of(style.gaps));
        } else {
            *text += "/>";
        }
    }
}

/// The elements in another order. Those of a kind are numbered by theirs.
fn reordered(elements: Vec<Element>, choices: &mut Choices) -> Vec<Element> {
    let mut kinds: Vec<Vec<Element>> = Vec::new();
    for mut element in elements {
        choices.shuffle(&mut element.attributes);
        match kinds.iter_mut().find(|kind| kind[0].tag == element.tag) {
            Some(kind) => kind.push(element),
            None => kinds.push(vec![element]),
        }
    }
    choices.shuffle(&mut kinds);
    if !choices.chance(8) {
        return kinds.into_iter().flatten().collect();
    }
    let mut left: Vec<_> = kinds.into_iter().map(|kind| kind.into_iter().peekable()).collect();
    let mut all = Vec::new();
    while !left.is_empty() {
        let place = choices.below(left.len());
        all.extend(left[place].next());
        if left[place].peek().is_none() {
            drop(left.remove(place));
        }
    }
    all
}

/// Adds elements and attributes that only drawings use.
fn add_looks(elements: &mut Vec<Element>, scene: &Scene, choices: &mut Choices) {
    for element in &mut *elements {
        if element.tag == "particle" && choices.chance(2) {
            element.attributes.push(("tag".to_owned(), Value::Text(words(choices))));
        }
        if ["particle", "edge"].contains(&element.tag.as_str()) && choices.chance(2) {
            element.attributes.push(("radius".to_owned(), share(choices)));
        }
    }
    let color = |tag: &str, number: Option<usize>, choices: &mut Choices| {
        let mut element = Element::new(
            tag,
            [("r", share(choices)), ("g", share(choices)), ("b", share(choices))],
        );
        if let Some(number) = number {
            element.attributes.insert(0, ("i".to_owned(), Value::Plain(number.to_string())));
        }
        element
    };
    let counts = [("particlecolor", scene.particles.len()), ("edgecolor", scene.edges.len())];
    for (tag, count) in counts {
        if count > 0 && choices.chance(4) {
            let number = choices.below(count);
            elements.push(color(tag, Some(number), choices));
        }
    }
    if choices.chance(4) {
        let mut path = color("particlepath", Some(choices.below(scene.particles.len())), choices);
        path.attributes.push(("duration".to_owned(), share(choices)));
        elements.push(path);
    }
    if choices.chance(4) {
        elements.push(color("backgroundcolor", None, choices));
    }
    if choices.chance(4) {
        let [cx, cy, size] = [share(choices), share(choices), Value::Plain("2.0".to_owned())];
        elements.push(Element::new("viewport", [("cx", cx), ("cy", cy), ("size", size)]));
    }
    if choices.chance(4) {
        elements.push(Element::new("maxsimfreq", [("max", Value::Plain("60.0".to_owned()))]));
    }
    if choices.chance(4) {
        elements.insert(0, Element::new("scenetag", [("tag", Value::Text(words(choices)))]));
    }
    if choices.chance(10) {
        elements.insert(0, Element::new("description", [("text", Value::Text(words(choices)))]));
    }
}

/// A number from 0 to 1.
fn share(choices: &mut Choices) -> Value {
    Value::Plain(choices.one_of(&["0.1", "0.0", "1.0", "0.25"]).to_owned())
}

/// Adds attributes that hold what stands for a missing one.
fn add_defaults(elements: &mut [Element], scene: &Scene, choices: &mut Choices) {
    let vocabulary = vocabulary();
    for element in elements {
        let constant = |parameter: &ParameterSchema| {
            let is_there = scene.dimension == Dimension::Three || !parameter.three_dimensional;
            Some((parameter.name, parameter.default.filter(|_| is_there)?))
        };
        let of_force =
            |schema: &ForceSchema| schema.parameters.iter().filter_map(constant).collect();
        let defaults: Vec<(&str, f64)> = match element.tag.as_str() {
            "particle" => vec![("radius", PARTICLE_RADIUS)],
            "edge" => vec![("radius", EDGE_RADIUS)],
            tag => vocabulary.force(tag).map(of_force).unwrap_or_default(),
        };
        for (name, value) in defaults {
            let is_given = element.attributes.iter().any(|(given, _)| given == name);
            if !is_given && choices.chance(8) {
                element.attributes.push((name.to_owned(), Value::Plain(format!("{value:?}"))));
            }
        }
    }
}

/// Some words.
fn words(choices: &mut Choices) -> String {
    (0..1 + choices.below(6)).map(|_| choices.one_of(WORDS)).collect()
}

/// A text as the value of an attribute: each character as it is, if it may stand there, or as a reference.
fn escaped(text: &str, quote: char, choices: &mut Choices) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        let name = match character {
            '&' => Some("amp"),
            '<' => Some("lt"),
            '>' => Some("gt"),
            '"' => Some("quot"),
            '\'' => Some("apos"),
            _ => None,
        };
        let is_space = ['\t', '\n', '\r'].contains(&character);
        let may_stand = !is_space && !['&', '<', quote].contains(&character);
        match (choices.below(8), name) {
            (0..=4, _) if may_stand => escaped.push(character),
            (0..=5, Some(name)) => escaped += &format!("&{name};"),
            (6, _) => escaped += &format!("&#x{:x};", u32::from(character)),
            _ => escaped += &format!("&#{};", u32::from(character)),
        }
    }
    escaped
}

/// A number in another spelling, where it has a point: the same decimal, or all digits of the binary number.
fn respelt(value: &str, choices: &mut Choices) -> String {
    let Ok(number) = value.parse::<f64>() else { return value.to_owned() };
    let (sign, digits) = value.split_at(value.len() - value.trim_start_matches('-').len());
    let (mantissa, exponent) = digits.split_once('e').unwrap_or((digits, ""));
    let Some((whole, fraction)) = mantissa.split_once('.') else { return value.to_owned() };
    let e = if exponent.is_empty() { String::new() } else { format!("e{exponent}") };
    let shift = exponent.parse::<i32>().unwrap_or(0);
    match choices.below(16) {
        1 if fraction == "0" => format!("{sign}{whole}{e}"),
        2 if fraction == "0" => format!("{sign}{whole}.{e}"),
        3 if whole == "0" && fraction != "0" => format!("{sign}.{fraction}{e}"),
        4 => format!("{sign}{mantissa}00{e}"),
        5 => format!("{sign}0{mantissa}{e}"),
        6 if sign.is_empty() => format!("+{value}"),
        7 => format!("{sign}{mantissa}E{shift:+03}"),
        8 => format!("{sign}{mantissa}e{shift}"),
        9 => format!("{sign}{whole}{fraction}e{}", shift - fraction.len() as i32),
        10 => format!("{sign}0.{whole}{fraction}e{}", shift + whole.len() as i32),
        11 => format!("{number:.40e}"),
        _ => value.to_owned(),
    }
}
