//! Sanitizes output of untrusted programs for display.

use sandbox::Printed;

use sandbox::scratch::without_paths;

/// Maximum number of bytes shown, from the end: programs print their error last.
const SHOWN: usize = 2_000;

/// Maximum number of characters of a text that must fit one line.
const LINE: usize = 100;

/// Maximum number of characters of a path.
const PATH: usize = 100;

/// The end of a program's output, without terminal control.
///
/// Escape sequences and control characters are removed. Bidirectional controls and other control characters of Unicode
/// become `�`. Spaces at the ends of lines and empty lines are removed.
pub(super) fn tail(printed: &Printed) -> String {
    let start = printed.text.len().saturating_sub(SHOWN);
    let start = (start..).find(|start| printed.text.is_char_boundary(*start)).unwrap_or_default();
    let text = &printed.text[start..];
    // If the first line was cut, its rest may be half an escape sequence.
    let cut = printed.cut || start > 0;
    let text = if cut { text.split_once('\n').map_or("", |(_, rest)| rest) } else { text };
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
    let shown = |character| match character {
        '\t' => ' ',
        '\n' => '\n',
        character if steers(character) => char::REPLACEMENT_CHARACTER,
        harmless => harmless,
    };
    without_paths(&text.chars().map(shown).collect::<String>())
}

/// A path on one line; the end of a long one.
pub(super) fn path(path: &[u8]) -> String {
    let path = String::from_utf8_lossy(path);
    let skipped = path.chars().count().saturating_sub(PATH);
    let end: String = path.chars().skip(skipped).collect();
    let shown = line(&end);
    if skipped > 0 { format!("…{shown}") } else { shown }
}

/// One line of text, without terminal control.
pub(super) fn line(text: &str) -> String {
    let shown = |character| if steers(character) { char::REPLACEMENT_CHARACTER } else { character };
    text.chars().take(LINE).map(shown).collect()
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

/// Whether a terminal interprets the character, or XML forbids it.
pub fn steers(character: char) -> bool {
    character.is_control()
        || matches!(
            character,
            // Marks, embeddings, overrides and isolates of direction; line and paragraph separators.
            '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
            // Not characters of XML 1.0.
            | '\u{fffe}' | '\u{ffff}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(bytes: &[u8]) -> String {
        tail(&Printed { text: String::from_utf8_lossy(bytes).into_owned(), cut: false })
    }

    #[test]
    fn no_terminal_control_is_left() {
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
    fn text_keeps_its_lines_and_nothing_else() {
        assert_eq!(text("a\tb\nc\u{1b}[2J\u{ffff}\u{b}\r"), "a b\nc�[2J���");
        assert_eq!(path(b"src/a\xff\n.c"), "src/a��.c");
        assert_eq!(path("ab".repeat(500).as_bytes()).chars().count(), 1 + PATH);
    }

    #[test]
    fn a_line_stays_one() {
        assert_eq!(line("Ada\n\u{1b}[2J\u{202e}"), "Ada��[2J�");
        assert_eq!(line(&"x".repeat(1000)).len(), LINE);
    }

    #[test]
    fn the_end_is_shown() {
        let long = "line\n".repeat(10_000) + "the last";
        let text = shown(long.as_bytes());
        assert!(text.ends_with("the last") && text.len() <= SHOWN);
        assert_eq!(shown("x".repeat(5_000).as_bytes()), "");
    }
}
