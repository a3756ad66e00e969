//! Scenes that fail by how their file is written: legal XML that the program does not read.
//!
//! The program runs on the same scene in a plain file. If that is better, files in which one thing alone is written as in the
//! scene's own say which of them it does not read.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::Event;
use rayon::prelude::*;
use scene::trace::{Shape, State};
use scene::{Scene, write};

use super::altered::MAX_MEBIBYTES;
use super::judge::{Judged, judge};
use crate::boundary::own_file::read_text;
use crate::oracle::Oracle;
use crate::submission::program::{Program, SceneSource};
use crate::verdict::{Failure, Verdict};
use diagnosis::findings::Finding;

/// Positions and velocities are near to others if they differ by this, relative to 1 or their size: files of traces may have
/// few digits.
const READ: f64 = 1e-4;

/// Something that a file may do, and a plain one does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Habit<'a> {
    Quotes,
    Blanks,
    Lines,
    Numbers,
    EndTags,
    Comments,
    /// Elements of this tag have their attributes in another order than usual.
    Attributes(&'a str),
    /// The first of these elements stands before what it names.
    Before(&'a str, Named),
}

/// The objects that an element refers to by number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Named {
    Particles,
    Edge,
}

impl Named {
    /// The objects that elements of this tag with these attributes refer to.
    fn by(tag: &str, attributes: &[&str]) -> Option<Self> {
        if attributes.contains(&"edge") {
            return Some(Self::Edge);
        }
        let has_particle = attributes.iter().any(|name| ["i", "i1"].contains(name));
        (has_particle && tag != "edgecolor").then_some(Self::Particles)
    }

    fn tag(self) -> &'static str {
        match self {
            Self::Particles => "particle",
            Self::Edge => "edge",
        }
    }
}

impl<'a> Habit<'a> {
    /// Those of how tags and numbers are written.
    const SPELLINGS: [Self; 6] =
        [Self::Quotes, Self::Blanks, Self::Lines, Self::Numbers, Self::EndTags, Self::Comments];

    /// All that files of such a scene may have, given the file that is `written` plainly.
    fn all(written: &Outline<'a>) -> Vec<Self> {
        let mut all = Self::SPELLINGS.to_vec();
        for (tag, attributes) in &written.attributes {
            let named = Named::by(tag, attributes);
            all.push(Self::Attributes(tag));
            all.extend(named.map(|named| Self::Before(tag, named)));
        }
        all
    }

    fn words(self) -> String {
        let words = match self {
            Self::Quotes => "attributes in single quotes",
            Self::Blanks => "white space around = or line breaks inside a tag",
            Self::Lines => "several elements on a line",
            Self::Numbers => {
                "numbers with an exponent, a plus sign, or no digit on one side of the point"
            }
            Self::EndTags => "elements that end with a tag of their own",
            Self::Comments => "comments",
            Self::Attributes(tag) => {
                return format!("attributes of {tag} in another order than usual");
            }
            Self::Before(tag, Named::Edge) => return format!("{tag}s before their edge"),
            Self::Before(tag, Named::Particles) => return format!("{tag}s before their particles"),
        };
        words.to_owned()
    }
}

/// How far a program comes with a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Reached {
    Nothing,
    /// The initial state is right.
    Start,
    Passes,
}

/// Spelling habits in the file of a failed scene that a program does not read.
struct Unread {
    /// The habits, in words; none if they are not known.
    words: Vec<String>,
    /// Whether it comes further with a plain file; otherwise its states are others then.
    is_shown: bool,
}

/// Runs failed scenes again where their file is not written plainly. Marks those whose failure it explains, and says what is
/// not read.
pub(super) fn misread(
    program: &Program,
    oracle: &Oracle,
    judged: &mut [Judged<'_>],
) -> Vec<Finding> {
    let unread: Vec<Option<Unread>> =
        judged.par_iter().map(|judged| unread(program, oracle, judged)).collect();
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (judged, words) in judged.iter_mut().zip(said(&unread)) {
        judged.is_misread = words.is_some();
        found
            .entry(words.unwrap_or_default())
            .or_default()
            .extend(judged.is_misread.then(|| judged.case.id.clone()));
    }
    let found = found.into_iter().filter(|(_, scenes)| !scenes.is_empty());
    found.map(|(words, scenes)| Finding::of_misread(&words, scenes)).collect()
}

/// The remark on each scene. One that fails by another mistake as well shows no habits but those that others show.
fn said(unread: &[Option<Unread>]) -> Vec<Option<String>> {
    let shown = unread.iter().flatten().filter(|one| one.is_shown);
    let shown: BTreeSet<&String> = shown.flat_map(|one| &one.words).collect();
    let of = |one: &Unread| match one.words.as_slice() {
        [] => one.is_shown.then(|| "something in how these files are written is".to_owned()),
        words => {
            let is_known = one.is_shown || words.iter().all(|words| shown.contains(words));
            is_known.then(|| format!("{} are", words.join(", and ")))
        }
    };
    unread.iter().map(|one| one.as_ref().and_then(of)).collect()
}

fn unread(program: &Program, oracle: &Oracle, judged: &Judged<'_>) -> Option<Unread> {
    let Judged { case, result, states, .. } = judged;
    let verdict = &result.comparison.verdict;
    let says_why = matches!(verdict, Verdict::Fail(Failure::NotImplemented(_)));
    let file = case.files.first().filter(|file| file.name.extension() == Some("xml".as_ref()))?;
    if verdict.is_pass() || says_why {
        return None;
    }
    let text = read_text(&file.path, MAX_MEBIBYTES).ok()?;
    let mut written = Vec::new();
    write::write(&case.scene, &mut written).ok()?;
    let written = String::from_utf8(written).ok()?;
    let usual = Outline::of(&written);
    let all = Habit::all(&usual);
    let plain = plainly(&text, &all, &usual);
    if is_plain(&text, &plain, &usual) {
        return None;
    }
    let run = |text: &str| {
        let (comparison, states) = judge(case, oracle, result.criteria.clone(), || {
            Ok(Box::new(program.run(SceneSource::Xml(text), Shape::of(&case.scene))?))
        });
        (reached(&case.scene, &comparison.verdict, &states), states)
    };
    let (best, read) = run(&written);
    let is_shown = best > reached(&case.scene, verdict, states);
    if !is_shown && are_close(&read, states) {
        return None;
    }
    let is_worse = |text: &str| {
        let (reached, states) = run(text);
        if is_shown { reached < best } else { !are_close(&read, &states) }
    };
    let is_unread = |habit: &Habit<'_>| {
        let others: Vec<Habit<'_>> = all.iter().filter(|other| *other != habit).copied().collect();
        let alone = plainly(&text, &others, &usual);
        alone != plain && is_worse(&alone)
    };
    let mut words: Vec<String> = Vec::new();
    if !is_worse(&plain) {
        words.extend(all.iter().filter(|habit| is_unread(habit)).map(|one| one.words()));
    }
    Some(Unread { words, is_shown })
}

/// Whether these are as many states, and close to each other.
fn are_close(a: &[State], b: &[State]) -> bool {
    let numbers = |states: &[State]| -> Vec<f64> {
        states.iter().flat_map(|one| [&one.positions, &one.velocities]).flatten().copied().collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| is_near(*a, *b))
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= READ * a.abs().max(1.0)
}

/// Whether a file is as the one `written` plainly, but for comments, blank lines and indentation. `plain` is the file without
/// habits.
fn is_plain(text: &str, plain: &str, written: &Outline<'_>) -> bool {
    let lines = plainly(text, &[Habit::Comments], written);
    let has_one_a_line = lines.lines().all(|line| line.matches('<').count() <= 1);
    let in_file = Outline::of(plain).elements;
    let in_written = &written.elements;
    let is_in_order = |(here, there): (&Vec<&str>, &Vec<&str>)| {
        there.iter().filter(|name| here.contains(name)).eq(here.iter())
    };
    plainly(text, &[Habit::Comments, Habit::Lines], written) == plain
        && has_one_a_line
        && in_file.len() == in_written.len()
        && in_file.iter().zip(in_written).all(is_in_order)
}

/// The tags and attributes of a file with one element a line and double quotes.
struct Outline<'a> {
    /// The tag of each element, and the names of its attributes.
    elements: Vec<Vec<&'a str>>,
    /// The attributes of all elements of a tag, in their order.
    attributes: BTreeMap<&'a str, Vec<&'a str>>,
}

impl<'a> Outline<'a> {
    fn of(text: &'a str) -> Self {
        let elements = text.lines().filter(|line| line.trim_start().starts_with('<'));
        let names = elements.map(|line| {
            let outside_quotes = line.split('"').step_by(2);
            let words = outside_quotes.flat_map(|part| part.split(['<', '/', '>', '=', ' ']));
            words.filter(|word| !word.is_empty()).collect()
        });
        let elements: Vec<Vec<&str>> = names.collect();
        let mut attributes: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (tag, names) in elements.iter().filter_map(|element| element.split_first()) {
            let known = attributes.entry(tag).or_default();
            let mut place = 0;
            for name in names {
                match known.iter().position(|other| other == name) {
                    Some(at) => place = at + 1,
                    None => {
                        known.insert(place, name);
                        place += 1;
                    }
                }
            }
        }
        Self { elements, attributes }
    }
}

fn reached(scene: &Scene, verdict: &Verdict, states: &[State]) -> Reached {
    if verdict.is_pass() {
        return Reached::Passes;
    }
    let axes = scene.dimension.count();
    let is_read = |state: &State| {
        let read = scene.particles.iter().flat_map(|particle| &particle.position[..axes]);
        let moving = scene.particles.iter().flat_map(|particle| &particle.velocity[..axes]);
        let got = state.positions.iter().chain(&state.velocities);
        read.chain(moving).zip(got).all(|(a, b)| is_near(*a, *b))
    };
    if states.first().is_some_and(is_read) { Reached::Start } else { Reached::Nothing }
}

/// The text of a valid scene without these habits.
fn plainly(text: &str, without: &[Habit<'_>], written: &Outline<'_>) -> String {
    let is_without = |habit: Habit<'_>| without.contains(&habit);
    let mut reader = Reader::from_str(text);
    let mut out = String::new();
    let mut elements: Vec<Range<usize>> = Vec::new();
    // The end of the last start tag, if nothing but white space followed.
    let mut open = None;
    while let Ok(event) = reader.read_event() {
        let raw: &str = &event;
        let is_tag = matches!(event, Event::Start(_) | Event::Empty(_) | Event::End(_));
        let is_childless = matches!(event, Event::End(_)) && is_without(Habit::EndTags);
        if let Some(end) = open.filter(|_| is_childless) {
            out.truncate(end);
            out.insert(end - 1, '/');
            if let Some(element) = elements.last_mut() {
                element.end = out.len();
            }
            open = None;
            continue;
        }
        if is_tag && is_without(Habit::Lines) && !out.is_empty() && !out.ends_with('\n') {
            out.push('\n');
        }
        let start = out.len();
        match &event {
            Event::Eof => break,
            Event::Text(_) if raw.trim().is_empty() => {
                if !is_without(Habit::Lines) {
                    out.push_str(raw);
                }
                continue;
            }
            Event::Text(_) => out.push_str(raw),
            Event::Comment(_) if is_without(Habit::Comments) => continue,
            Event::Comment(_) => out.extend(["<!--", raw, "-->"]),
            Event::Start(_) => out.extend(["<", &tag(raw, without, written), ">"]),
            Event::Empty(_) => out.extend(["<", &tag(raw, without, written), "/>"]),
            Event::End(_) => out.extend(["</", raw, ">"]),
            Event::Decl(_) | Event::PI(_) => out.extend(["<?", raw, "?>"]),
            Event::DocType(_) => out.extend(["<!DOCTYPE ", raw, ">"]),
            Event::CData(_) => out.extend(["<![CDATA[", raw, "]]>"]),
            Event::GeneralRef(_) => out.extend(["&", raw, ";"]),
        }
        open = matches!(event, Event::Start(_)).then_some(out.len());
        match &event {
            Event::Start(_) | Event::Empty(_) if elements_tag(raw) != "scene" => {
                elements.push(start..out.len());
            }
            Event::End(_) if elements_tag(raw) != "scene" => {
                if let Some(element) = elements.last_mut() {
                    element.end = out.len();
                }
            }
            _ => {}
        }
    }
    let before = without.iter().filter_map(|habit| match habit {
        Habit::Before(tag, named) => Some((*tag, *named)),
        _ => None,
    });
    in_order(&out, &elements, &before.collect::<Vec<_>>())
}

/// The text with what is named before the first element that names it, for each of these pairs.
fn in_order(text: &str, elements: &[Range<usize>], before: &[(&str, Named)]) -> String {
    let mut moved: Vec<&str> = elements.iter().map(|element| &text[element.clone()]).collect();
    // Particles last: they stand before edges, too.
    for named in [Named::Edge, Named::Particles] {
        let is_namer = |element: &&str| before.contains(&(elements_tag(&element[1..]), named));
        let first = moved.iter().position(is_namer).unwrap_or(moved.len());
        moved[first..].sort_by_key(|element| elements_tag(&element[1..]) != named.tag());
    }
    let mut out = String::new();
    let mut end = 0;
    for (place, element) in elements.iter().zip(moved) {
        out.extend([&text[end..place.start], element]);
        end = place.end;
    }
    out + &text[end..]
}

/// The tag of an element whose text begins with it.
fn elements_tag(text: &str) -> &str {
    let end = text.find(|c: char| c.is_whitespace() || ['/', '>'].contains(&c));
    &text[..end.unwrap_or(text.len())]
}

/// The name and the attributes of a tag without these habits.
fn tag(raw: &str, without: &[Habit<'_>], written: &Outline<'_>) -> String {
    let is_without = |habit: Habit<'_>| without.contains(&habit);
    let blank = |text: &str, plain: &'static str| {
        if is_without(Habit::Blanks) { plain.to_owned() } else { text.to_owned() }
    };
    let split = |text: &str, at: usize| (text[..at].to_owned(), text[at..].to_owned());
    let name = elements_tag(raw);
    let (mut out, mut rest) = split(raw, name.len());
    let mut blanks: Vec<String> = Vec::new();
    let mut attributes: Vec<(String, String)> = Vec::new();
    while let Some(start) = rest.find(|c: char| !c.is_whitespace()) {
        let (before, attribute) = split(&rest, start);
        let Some(quote) = attribute.find(['"', '\'']) else { break };
        let (key, value) = split(&attribute, quote);
        let mark = if value.starts_with('"') { '"' } else { '\'' };
        let Some(end) = value[1..].find(mark) else { break };
        let value_text = &value[1..=end];
        let key =
            if is_without(Habit::Blanks) { key.replace(char::is_whitespace, "") } else { key };
        let is_double = is_without(Habit::Quotes) && !value_text.contains('"');
        let mark = if is_double { "\"" } else { &value[..1] };
        let plain = plain_number(value_text).filter(|_| is_without(Habit::Numbers));
        let value_text = plain.as_deref().unwrap_or(value_text);
        blanks.push(blank(&before, " "));
        attributes.push((key, [mark, value_text, mark].concat()));
        rest = value[end + 2..].to_owned();
    }
    if is_without(Habit::Attributes(name)) {
        let usual = written.attributes.get(name).map_or(&[][..], Vec::as_slice);
        let place = |key: &str| {
            let key = key.trim_end_matches(|c: char| c.is_whitespace() || c == '=');
            usual.iter().position(|name| *name == key)
        };
        // Attributes that the plain file leaves out stay where they are.
        let places: Vec<usize> =
            (0..attributes.len()).filter(|at| place(&attributes[*at].0).is_some()).collect();
        let mut known: Vec<_> = places.iter().map(|at| attributes[*at].clone()).collect();
        known.sort_by_key(|(key, _)| place(key));
        for (at, attribute) in places.into_iter().zip(known) {
            attributes[at] = attribute;
        }
    }
    for (blank, (key, value)) in blanks.iter().zip(&attributes) {
        out.extend([blank.as_str(), key, value]);
    }
    out + &blank(&rest, "")
}

/// A number as digits and a point, if it is not written so.
fn plain_number(text: &str) -> Option<String> {
    let number: f64 = text.trim().parse().ok().filter(|number: &f64| number.is_finite())?;
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let is_plain = digits.chars().all(|c| c.is_ascii_digit() || c == '.')
        && is_digit(digits.chars().next())
        && is_digit(digits.chars().next_back());
    (!is_plain).then(|| number.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "<?xml version='1.0'?>\n<scene><!-- a > b -->\n  <particle\n m = '3e-1' px=\".4\" ></particle><edge i=\"+0\"\tj='1.'/>\n</scene>\n";

    #[test]
    fn files_lose_one_habit_or_all() {
        let usual = Outline::of("");
        assert_eq!(plainly(TEXT, &[], &usual), TEXT);
        assert_eq!(
            plainly(TEXT, &Habit::SPELLINGS, &usual),
            "<?xml version='1.0'?>\n<scene>\n<particle m=\"0.3\" px=\"0.4\"/>\n<edge i=\"0\" j=\"1\"/>\n</scene>"
        );
        for (habit, from, to) in
            [(Habit::Comments, "<!-- a > b -->", ""), (Habit::EndTags, "></particle>", "/>")]
        {
            assert_eq!(plainly(TEXT, &[habit], &usual), TEXT.replace(from, to), "{habit:?}");
        }
    }

    #[test]
    fn elements_and_attributes_take_their_usual_order() {
        let lines = |lines: &[&str]| format!("<scene>\n{}\n</scene>", lines.join("\n"));
        let particle = "<particle m=\"1\" px=\"0\"/>";
        let [edge, odd_edge] = ["<edge i=\"0\" j=\"1\"/>", "<edge j=\"1\" radius=\"2\" i=\"0\"/>"];
        let [spring, odd_spring] =
            ["<springforce edge=\"0\" k=\"2\"/>", "<springforce k=\"2\" edge=\"0\"/>"];
        let written = lines(&[particle, particle, edge, edge, spring]);
        let usual = Outline::of(&written);
        let all = Habit::all(&usual);
        let odd = lines(&[odd_spring, odd_edge, "<!-- a -->", particle, edge, particle]);
        for (without, expected) in [
            (
                Habit::Attributes("springforce"),
                lines(&[spring, odd_edge, "<!-- a -->", particle, edge, particle]),
            ),
            (
                Habit::Attributes("edge"),
                lines(&[
                    odd_spring,
                    "<edge i=\"0\" radius=\"2\" j=\"1\"/>",
                    "<!-- a -->",
                    particle,
                    edge,
                    particle,
                ]),
            ),
            (
                Habit::Before("springforce", Named::Edge),
                lines(&[odd_edge, edge, "<!-- a -->", odd_spring, particle, particle]),
            ),
            (
                Habit::Before("edge", Named::Particles),
                lines(&[odd_spring, particle, "<!-- a -->", particle, odd_edge, edge]),
            ),
        ] {
            assert!(all.contains(&without));
            assert_eq!(plainly(&odd, &[without], &usual), expected, "{without:?}");
        }
        let plain = plainly(&odd, &all, &usual);
        assert_eq!(
            plain,
            lines(&[particle, particle, "<edge i=\"0\" radius=\"2\" j=\"1\"/>", edge, spring])
        );
    }

    #[test]
    fn scenes_with_another_mistake_show_what_others_show() {
        let unread = |words: &[&str], is_shown: bool| {
            Some(Unread { words: words.iter().map(|one| (*one).to_owned()).collect(), is_shown })
        };
        let all = [
            unread(&["a"], true),
            unread(&["a"], false),
            unread(&["a", "b"], false),
            unread(&[], false),
            unread(&[], true),
            None,
        ];
        let said = said(&all);
        let said: Vec<Option<&str>> = said.iter().map(Option::as_deref).collect();
        let something = Some("something in how these files are written is");
        assert_eq!(said, [Some("a are"), Some("a are"), None, None, something, None]);
    }

    #[test]
    fn attributes_that_some_elements_lack_have_their_place() {
        let written = "<edge i=\"0\" c=\"1\"/>\n<edge i=\"0\" a=\"1\" b=\"1\" c=\"1\"/>\n<edge b=\"1\" d=\"1\"/>";
        assert_eq!(Outline::of(written).attributes["edge"], ["i", "a", "b", "d", "c"]);
    }

    #[test]
    fn a_file_in_the_usual_order_is_plain() {
        let written = "<scene>\n  <edge i=\"0\" j=\"1\" radius=\"0.1\"/>\n  <springforce edge=\"0\" k=\"1.0\"/>\n</scene>\n";
        let usual = Outline::of(written);
        let all = Habit::all(&usual);
        let is_plain = |text: &str| is_plain(text, &plainly(text, &all, &usual), &usual);
        let edge = "<edge i=\"0\" j=\"1\"/>";
        let spring = "<springforce edge=\"0\" k=\"1.0\"/>";
        let file = |elements: [&str; 2]| {
            format!("<!-- a -->\n<scene>\n\n {}\n</scene>", elements.join("\n"))
        };
        assert!(is_plain(&file([edge, spring])));
        assert!(!is_plain(&file([spring, edge])));
        assert!(!is_plain(&file(["<edge j=\"1\" i=\"0\"/>", spring])));
        assert!(!is_plain(&file([edge, "<springforce edge=\"0\" k='1.0'/>"])));
        assert!(!is_plain(&file([edge, spring]).replace("/>\n<", "/><")));
    }
}
