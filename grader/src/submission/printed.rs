//! What a stranger's program printed, made fit to be shown.

use crate::sandbox::Printed;

/// The most of it that is shown, in bytes: the end, for that is where programs say why they gave up.
const SHOWN: usize = 2_000;

/// The most characters of a line that is not to be more.
const LINE: usize = 100;

/// The end of what was printed, without what would steer a terminal.
///
/// Escape sequences and control characters are taken out. What turns the direction of writing, and whatever
/// else would steer, becomes `�`; spaces at the ends of lines and empty lines go.
pub(super) fn tail(printed: &Printed) -> String {
    let start = printed.text.len().saturating_sub(SHOWN);
    let start = (start..).find(|start| printed.text.is_char_boundary(*start)).unwrap_or_default();
    let text = &printed.text[start..];
    // Of a first line that was cut, the rest may be half an escape sequence.
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

/// One line of text, without what would steer a terminal.
pub(super) fn line(text: &str) -> String {
    let shown = |character| if steers(character) { char::REPLACEMENT_CHARACTER } else { character };
    text.chars().take(LINE).map(shown).collect()
}

/// Whether a terminal would do something other than show it.
pub(crate) fn steers(character: char) -> bool {
    character.is_control()
        || matches!(
            character,
            // Marks, embeddings, overrides and isolates of direction; line and paragraph separators.
            '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(bytes: &[u8]) -> String {
        tail(&Printed { text: String::from_utf8_lossy(bytes).into_owned(), cut: false })
    }

    #[test]
    fn nothing_that_steers_a_terminal_is_left() {
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
