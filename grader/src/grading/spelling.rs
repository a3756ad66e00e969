//! Scenes that fail by how their file is written: legal XML that the program does not read.
//!
//! The program runs on the same scene in a plain file. If that is better, files in which one thing alone is written as in the
//! scene's own say which of them it does not read.

use std::collections::BTreeMap;

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

/// Positions and velocities at the start are read if they differ by this, relative to 1 or their size: files of traces may
/// have few digits.
const READ: f64 = 1e-4;

/// Something that a file may do, and a plain one does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Habit {
    Quotes,
    Blanks,
    Lines,
    Numbers,
    EndTags,
    Comments,
}

impl Habit {
    const ALL: [Self; 6] =
        [Self::Quotes, Self::Blanks, Self::Lines, Self::Numbers, Self::EndTags, Self::Comments];

    fn words(self) -> &'static str {
        match self {
            Self::Quotes => "attributes in single quotes",
            Self::Blanks => "white space around = or line breaks inside a tag",
            Self::Lines => "several elements on a line",
            Self::Numbers => {
                "numbers with an exponent, a plus sign, or no digit on one side of the point"
            }
            Self::EndTags => "elements that end with a tag of their own",
            Self::Comments => "comments",
        }
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

/// Runs failed scenes again where their file is not written plainly. Marks those whose failure it explains, and says what is
/// not read.
pub(super) fn misread(
    program: &Program,
    oracle: &Oracle,
    judged: &mut [Judged<'_>],
) -> Vec<Finding> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let unread: Vec<Option<String>> =
        judged.par_iter().map(|judged| unread(program, oracle, judged)).collect();
    for (judged, words) in judged.iter_mut().zip(unread) {
        judged.is_misread = words.is_some();
        found
            .entry(words.unwrap_or_default())
            .or_default()
            .extend(judged.is_misread.then(|| judged.case.id.clone()));
    }
    let found = found.into_iter().filter(|(_, scenes)| !scenes.is_empty());
    found.map(|(words, scenes)| Finding::of_misread(&words, scenes)).collect()
}

/// What the program does not read in a file that fails, in words.
fn unread(program: &Program, oracle: &Oracle, judged: &Judged<'_>) -> Option<String> {
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
    let plain = plainly(&text, &Habit::ALL);
    if is_plain(&text, &plain, &written) {
        return None;
    }
    let reach = |text: &str| {
        let (comparison, states) = judge(case, oracle, result.criteria.clone(), || {
            Ok(Box::new(program.run(SceneSource::Xml(text), Shape::of(&case.scene))?))
        });
        reached(&case.scene, &comparison.verdict, &states)
    };
    let best = reach(&written);
    if best <= reached(&case.scene, verdict, states) {
        return None;
    }
    let is_unread = |habit: &Habit| {
        let others: Vec<Habit> = Habit::ALL.into_iter().filter(|other| other != habit).collect();
        let alone = plainly(&text, &others);
        alone != plain && reach(&alone) < best
    };
    let mut unread: Vec<&str> = Vec::new();
    if reach(&plain) == best {
        unread.extend(Habit::ALL.iter().filter(|habit| is_unread(habit)).map(|one| one.words()));
    }
    if unread.is_empty() {
        return Some("something in how these files are written is".to_owned());
    }
    Some(format!("{} are", unread.join(", and ")))
}

/// Whether a file is as `written`, but for comments, blank lines and indentation. `plain` is the file without habits.
fn is_plain(text: &str, plain: &str, written: &str) -> bool {
    let lines = plainly(text, &[Habit::Comments]);
    let has_one_a_line = lines.lines().all(|line| line.matches('<').count() <= 1);
    let in_file = outline(plain);
    let in_written = outline(written);
    let is_in_order = |(here, there): (&Vec<&str>, &Vec<&str>)| {
        there.iter().filter(|name| here.contains(name)).eq(here.iter())
    };
    plainly(text, &[Habit::Comments, Habit::Lines]) == plain
        && has_one_a_line
        && in_file.len() == in_written.len()
        && in_file.iter().zip(&in_written).all(is_in_order)
}

/// The tag of each element, and the names of its attributes, in a file with one element a line and double quotes.
fn outline(text: &str) -> Vec<Vec<&str>> {
    let elements = text.lines().filter(|line| line.trim_start().starts_with('<'));
    let names = elements.map(|line| {
        let outside_quotes = line.split('"').step_by(2);
        let words = outside_quotes.flat_map(|part| part.split(['<', '/', '>', '=', ' ']));
        words.filter(|word| !word.is_empty()).collect()
    });
    names.collect()
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
        read.chain(moving).zip(got).all(|(a, b)| (a - b).abs() <= READ * a.abs().max(1.0))
    };
    if states.first().is_some_and(is_read) { Reached::Start } else { Reached::Nothing }
}

/// The text of a valid scene without these habits.
fn plainly(text: &str, without: &[Habit]) -> String {
    let is_without = |habit: Habit| without.contains(&habit);
    let mut reader = Reader::from_str(text);
    let mut out = String::new();
    // The end of the last start tag, if nothing but white space followed.
    let mut open = None;
    while let Ok(event) = reader.read_event() {
        let raw: &str = &event;
        let is_tag = matches!(event, Event::Start(_) | Event::Empty(_) | Event::End(_));
        let is_childless = matches!(event, Event::End(_)) && is_without(Habit::EndTags);
        if let Some(end) = open.filter(|_| is_childless) {
            out.truncate(end);
            out.insert(end - 1, '/');
            open = None;
            continue;
        }
        if is_tag && is_without(Habit::Lines) && !out.is_empty() && !out.ends_with('\n') {
            out.push('\n');
        }
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
            Event::Start(_) => out.extend(["<", &tag(raw, without), ">"]),
            Event::Empty(_) => out.extend(["<", &tag(raw, without), "/>"]),
            Event::End(_) => out.extend(["</", raw, ">"]),
            Event::Decl(_) | Event::PI(_) => out.extend(["<?", raw, "?>"]),
            Event::DocType(_) => out.extend(["<!DOCTYPE ", raw, ">"]),
            Event::CData(_) => out.extend(["<![CDATA[", raw, "]]>"]),
            Event::GeneralRef(_) => out.extend(["&", raw, ";"]),
        }
        open = matches!(event, Event::Start(_)).then_some(out.len());
    }
    out
}

/// The name and the attributes of a tag without these habits.
fn tag(raw: &str, without: &[Habit]) -> String {
    let is_without = |habit: Habit| without.contains(&habit);
    let blank = |text: &str, plain: &'static str| {
        if is_without(Habit::Blanks) { plain.to_owned() } else { text.to_owned() }
    };
    let split = |text: &str, at: usize| (text[..at].to_owned(), text[at..].to_owned());
    let name = raw.find(char::is_whitespace).unwrap_or(raw.len());
    let (mut out, mut rest) = split(raw, name);
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
        out.extend([&blank(&before, " "), &key, mark, value_text, mark]);
        rest = value[end + 2..].to_owned();
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
        assert_eq!(plainly(TEXT, &[]), TEXT);
        assert_eq!(
            plainly(TEXT, &Habit::ALL),
            "<?xml version='1.0'?>\n<scene>\n<particle m=\"0.3\" px=\"0.4\"/>\n<edge i=\"0\" j=\"1\"/>\n</scene>"
        );
        for (habit, from, to) in
            [(Habit::Comments, "<!-- a > b -->", ""), (Habit::EndTags, "></particle>", "/>")]
        {
            assert_eq!(plainly(TEXT, &[habit]), TEXT.replace(from, to), "{habit:?}");
        }
    }

    #[test]
    fn a_file_in_the_usual_order_is_plain() {
        let written =
            "<scene>\n  <edge i=\"0\" j=\"1\" radius=\"0.1\"/>\n  <drag b=\"1.0\"/>\n</scene>\n";
        let is_plain = |text: &str| is_plain(text, &plainly(text, &Habit::ALL), written);
        let edge = "<edge i=\"0\" j=\"1\"/>";
        let drag = "<drag b=\"1.0\"/>";
        let file = |elements: [&str; 2]| {
            format!("<!-- a -->\n<scene>\n\n {}\n</scene>", elements.join("\n"))
        };
        assert!(is_plain(&file([edge, drag])));
        assert!(!is_plain(&file([drag, edge])));
        assert!(!is_plain(&file(["<edge j=\"1\" i=\"0\"/>", drag])));
        assert!(!is_plain(&file([edge, "<drag b='1.0'/>"])));
        assert!(!is_plain(&file([edge, drag]).replace("/>\n<", "/><")));
    }
}
