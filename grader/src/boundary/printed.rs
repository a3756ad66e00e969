//! Text from students' files and programs, and the forms in which it is inert: it steers no terminal, starts no formula.

use std::fmt;
use std::path::Path;

use sandbox::Printed;
use sandbox::scratch::without_paths;
use scene::printable;
pub use scene::printable::steers;
use serde::{Deserialize, Serialize, Serializer};

/// Maximum number of bytes shown of an end of an output.
const SHOWN: usize = 2_000;

/// Maximum number of characters of a text that must fit one line: a path of a few folders.
const LINE: usize = 400;

/// Maximum number of characters of a path.
const PATH: usize = 100;

/// Text that a student wrote, or a program of a student: held as it came, and shown in an inert form only.
///
/// ```
/// let name = grader::boundary::printed::Untrusted::from("ada\u{1b}[2J");
/// assert_eq!(name.line(), "ada\u{fffd}[2J");
/// ```
///
/// It cannot be printed as it is:
///
/// ```compile_fail,E0277
/// let name = grader::boundary::printed::Untrusted::from("ada\u{1b}[2J");
/// println!("{name}");
/// ```
///
/// Nor is it a `&str` by itself:
///
/// ```compile_fail,E0308
/// let name = grader::boundary::printed::Untrusted::from("ada\u{1b}[2J");
/// let text: &str = &name;
/// ```
#[derive(Clone, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(transparent)]
pub struct Untrusted(String);

/// Why untrusted text is needed as it was written. None of these shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RawUse {
    /// It is compared with, or searched for, known text.
    Comparison,
    /// It is a part of other untrusted text.
    Part,
    /// It is parsed.
    Parsing,
}

impl Untrusted {
    /// Some lines of text, without the random names of scratch folders.
    pub fn text(&self) -> String {
        text(&self.0)
    }

    /// One line of text, of limited length.
    pub fn line(&self) -> String {
        without_paths(&line(&self.0))
    }

    /// A cell of a table that a spreadsheet opens.
    pub fn cell(&self) -> String {
        inert(&self.line())
    }

    /// Whether the text is empty.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The text as it was written.
    pub fn raw(&self, _: RawUse) -> &str {
        &self.0
    }
}

impl fmt::Debug for Untrusted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.text())
    }
}

impl Serialize for Untrusted {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text())
    }
}

impl From<String> for Untrusted {
    fn from(text: String) -> Self {
        Self(text)
    }
}

impl From<&Path> for Untrusted {
    fn from(path: &Path) -> Self {
        path.to_string_lossy().into_owned().into()
    }
}

impl From<&str> for Untrusted {
    fn from(text: &str) -> Self {
        Self(text.to_owned())
    }
}

/// The end of a program's output, which prints its error last, without terminal control.
///
/// Escape sequences and control characters are removed. Bidirectional controls and other control characters of Unicode
/// become `�`. Spaces at the ends of lines and empty lines are removed.
pub(crate) fn tail(printed: &Printed) -> String {
    harmless(last_lines(printed))
}

/// Both ends of a build's output, as the first error of a compiler is the cause of the others.
pub(crate) fn ends(printed: &Printed) -> String {
    let text = printed.raw();
    if !printed.is_cut() && text.len() <= 2 * SHOWN {
        return harmless(text);
    }
    let start = if printed.is_cut() { printed.raw_head() } else { text };
    let end = (0..=SHOWN).rev().find(|end| start.is_char_boundary(*end)).unwrap_or_default();
    let head = &start[..start[..end].rfind('\n').map_or(0, |last| last + 1)];
    let tail = last_lines(printed);
    let shown = head.matches('\n').count() + tail.matches('\n').count();
    let left_out = printed.breaks().saturating_sub(shown as u64);
    let parts = [harmless(head), format!("… {left_out} lines left out …"), harmless(tail)];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("\n")
}

/// The last whole lines that are shown.
fn last_lines(printed: &Printed) -> &str {
    let text = printed.raw();
    let start = text.len().saturating_sub(SHOWN);
    let start = (start..).find(|start| text.is_char_boundary(*start)).unwrap_or_default();
    // If the first line was cut, its rest may be half an escape sequence.
    let cut = printed.is_cut() || start > 0;
    let text = &text[start..];
    if cut { text.split_once('\n').map_or("", |(_, rest)| rest) } else { text }
}

/// Lines without terminal control.
fn harmless(text: &str) -> String {
    let stripped = anstream::adapter::strip_str(text).to_string();
    let lines = stripped.split(['\n', '\r']).map(|line| {
        let shown = line.chars().map(|character| match character {
            '\t' => ' ',
            harmless if !steers(harmless) => harmless,
            _ => char::REPLACEMENT_CHARACTER,
        });
        shown.collect::<String>().trim_end().to_owned()
    });
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
}

/// Text of some lines, without terminal control, characters that XML forbids, and the random names of scratch folders.
/// Every message that contains text of a submission passes through here.
pub fn text(text: &str) -> String {
    without_paths(&printable::text(text))
}

/// A path on one line; the end of a long one.
pub(crate) fn path(path: &[u8]) -> String {
    let path = String::from_utf8_lossy(path);
    let skipped = path.chars().count().saturating_sub(PATH);
    let end: String = path.chars().skip(skipped).collect();
    let shown = line(&end);
    if skipped > 0 { format!("…{shown}") } else { shown }
}

/// One line of text, without terminal control.
pub(crate) fn line(text: &str) -> String {
    printable::line(&text.chars().take(LINE).collect::<String>())
}

/// Escapes text so that no spreadsheet reads a part of it as a formula, whatever its cell separator: puts `'` before
/// each possible start of a formula.
pub fn inert(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut begins = true;
    for character in text.chars() {
        if begins && "=+-@＝＋－＠".contains(character) {
            shown.push('\'');
        }
        let ends = ",;|\t\r\n\"'".contains(character);
        begins = ends || begins && character.is_whitespace();
        shown.push(character);
    }
    shown
}

/// A table as CSV, with names and texts of submissions: no cell is a formula ([`inert`]), or steers a terminal.
pub struct InertCsv(csv::Writer<Vec<u8>>);

impl InertCsv {
    /// A table with a header line.
    ///
    /// # Errors
    /// Never in practice: the output is memory.
    pub fn new(header: impl IntoIterator<Item = impl AsRef<str>>) -> csv::Result<Self> {
        let mut table = Self(csv::Writer::from_writer(Vec::new()));
        table.row(header)?;
        Ok(table)
    }

    /// Adds a row.
    ///
    /// # Errors
    /// If it has another number of cells than the header.
    pub fn row(&mut self, cells: impl IntoIterator<Item = impl AsRef<str>>) -> csv::Result<()> {
        let cells = cells.into_iter().map(|cell| inert(&printable::text(cell.as_ref())));
        self.0.write_record(cells)
    }

    /// The bytes of the table.
    ///
    /// # Errors
    /// Never in practice: the output is memory.
    pub fn bytes(self) -> csv::Result<Vec<u8>> {
        self.0.into_inner().map_err(|error| error.into_error().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(bytes: &[u8]) -> String {
        tail(&Printed::from(bytes))
    }

    #[test]
    fn terminal_control_is_removed() {
        assert_eq!(shown(b"plain\n\n  text \n"), "plain\n  text");
        assert_eq!(shown(b"\x1b[2J\x1b[1;1Hwiped"), "wiped");
        assert_eq!(shown(b"\x1b]0;title\x07after"), "after");
        assert_eq!(shown(b"PASS\x08\x08\x08\x08FAIL"), "PASSFAIL");
        assert_eq!(shown("a\u{202e}b\u{9b}31mc".as_bytes()), "a�b�31mc");
        assert_eq!(shown(b"\xff\xfe"), "��");
        let all: Vec<u8> = (0..=255).collect();
        assert!(!shown(&all).chars().any(|character| steers(character) && character != '\n'));
    }

    #[test]
    fn text_keeps_line_breaks_and_no_other_control() {
        assert_eq!(text("a\tb\nc\u{1b}[2J\u{ffff}\u{b}\r"), "a b\nc�[2J���");
        assert_eq!(path(b"src/a\xff\n.c"), "src/a��.c");
        assert_eq!(path("ab".repeat(500).as_bytes()).chars().count(), 1 + PATH);
    }

    #[test]
    fn no_cell_of_a_table_is_a_formula() {
        let mut table = InertCsv::new(["name", "=1"]).unwrap();
        table.row(["=HYPERLINK(\"x\";\"+y\")", "a;-b\u{202e}"]).unwrap();
        let text = String::from_utf8(table.bytes().unwrap()).unwrap();
        assert_eq!(text, "name,'=1\n\"'=HYPERLINK(\"\"x\"\";\"\"'+y\"\")\",a;'-b�\n");
    }

    #[test]
    fn line_contains_no_line_break() {
        assert_eq!(line("Ada\n\u{1b}[2J\u{202e}"), "Ada��[2J�");
        assert_eq!(line(&"x".repeat(1000)).len(), LINE);
    }

    #[test]
    fn untrusted_text_is_inert_in_each_form() {
        let eve = Untrusted::from("=1\u{1b}]0;x\u{7}\n\u{202e}");
        assert_eq!(eve.text(), "=1�]0;x�\n�");
        assert_eq!(eve.line(), "=1�]0;x���");
        assert_eq!(eve.cell(), "'=1�]0;x���");
        assert_eq!(format!("{eve:?}"), "\"=1�]0;x�\\n�\"");
        assert_eq!(serde_json::to_string(&eve).unwrap(), "\"=1�]0;x�\\n�\"");
        let read: Untrusted = serde_json::from_str("\"\\u001b\"").unwrap();
        assert_eq!(read.raw(RawUse::Comparison), "\u{1b}");
    }

    #[test]
    fn end_of_long_output_is_shown() {
        let long = "line\n".repeat(10_000) + "the last";
        let text = shown(long.as_bytes());
        assert!(text.ends_with("the last") && text.len() <= SHOWN);
        assert_eq!(shown("x".repeat(5_000).as_bytes()), "");
    }

    #[test]
    fn of_a_build_the_first_error_is_shown_too() {
        let shown = |lines: usize| {
            let numbered = (0..lines).map(|number| format!("line {number}\n"));
            ends(&Printed::from(numbered.collect::<String>().as_bytes()))
        };
        // All is there, once: kept whole, cut in the middle, and longer than what is kept.
        for lines in [10, 420, 500, 800, 5_000] {
            let text = shown(lines);
            let found: Vec<usize> =
                text.lines().filter_map(|line| line.strip_prefix("line ")?.parse().ok()).collect();
            let gaps: Vec<usize> = found.windows(2).map(|pair| pair[1] - pair[0] - 1).collect();
            let left_out: usize = gaps.iter().sum();
            assert_eq!((found[0], found[found.len() - 1]), (0, lines - 1), "{text}");
            assert_eq!(found.len() + left_out, lines);
            let marked = format!("… {left_out} lines left out …");
            assert_eq!(text.contains(&marked), left_out > 0, "{text}");
            assert_eq!(text.contains("left out"), left_out > 0, "{text}");
            assert!(text.len() <= 2 * SHOWN + 40);
        }
    }
}
