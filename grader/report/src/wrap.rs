//! Wrapping of lines at the width of a terminal.

use anstream::adapter::strip_str;

/// Width where there is no terminal, and the largest one: longer lines are hard to read.
pub const WIDTH: usize = 80;

/// Indentation of the lines that continue another one.
const CONTINUED: usize = 2;

/// The text with every line broken at blanks where it is wider than `width` columns, and words that are wider broken
/// anywhere. Lines that continue another one are indented further. Styles take no column.
pub fn wrap(text: &str, width: usize) -> String {
    let mut wrapped = String::with_capacity(text.len());
    for line in text.lines() {
        if columns(line) <= width {
            wrapped += line;
        } else {
            wrap_line(&mut wrapped, line, width);
        }
        wrapped.push('\n');
    }
    wrapped
}

fn columns(text: &str) -> usize {
    strip_str(text).to_string().chars().count()
}

fn wrap_line(wrapped: &mut String, line: &str, width: usize) {
    let words = line.trim_start_matches(' ');
    let indent = (line.len() - words.len()).min(width / 2);
    let hanging = (indent + CONTINUED).min(width / 2);
    *wrapped += &" ".repeat(indent);
    let mut column = indent;
    // Blanks are kept inside a line and dropped where it is broken.
    let mut blanks = 0;
    for word in words.split(' ') {
        let size = columns(word);
        if column > hanging && column + blanks + size > width {
            *wrapped = format!("{}\n{}", wrapped.trim_end_matches(' '), " ".repeat(hanging));
            (column, blanks) = (hanging, 0);
        }
        *wrapped += &" ".repeat(blanks);
        column += blanks;
        if column + size > width {
            for character in strip_str(word).to_string().chars() {
                if column == width {
                    *wrapped += &format!("\n{}", " ".repeat(hanging));
                    column = hanging;
                }
                wrapped.push(character);
                column += 1;
            }
        } else {
            *wrapped += word;
            column += size;
        }
        blanks = 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::BAD;

    #[test]
    fn lines_are_broken_at_blanks_and_long_words_anywhere() {
        let text = "short\n  one two three four\n  abcdefghijklmnop end\n";
        let expected = "short\n  one two\n    three\n    four\n  abcdefghij\n    klmnop\n    end\n";
        assert_eq!(wrap(text, 12), expected);
        for width in 20..40 {
            let wide = "    a word, and anotherwordthatiswiderthanthewholelineofaterminal, c  d\n";
            assert!(wrap(wide, width).lines().all(|line| line.chars().count() <= width));
        }
    }

    #[test]
    fn styles_take_no_column() {
        let text = format!("  {BAD}one two{BAD:#} three\n");
        assert_eq!(wrap(&text, 15), text);
        assert_eq!(wrap(&text, 10), format!("  {BAD}one two{BAD:#}\n    three\n"));
    }
}
