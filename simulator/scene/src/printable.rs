//! Text of a file made inert: printing it steers no terminal.

/// Some lines of text; the characters that steer become `�`.
pub fn text(text: &str) -> String {
    shown(text, |character| character == '\n')
}

/// One line of text; the characters that steer, and ends of lines, become `�`.
pub fn line(text: &str) -> String {
    shown(text, |_| false)
}

fn shown(text: &str, is_kept: fn(char) -> bool) -> String {
    let inert = |character| match character {
        '\t' => ' ',
        kept if is_kept(kept) || !steers(kept) => kept,
        _ => char::REPLACEMENT_CHARACTER,
    };
    text.chars().map(inert).collect()
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
