//! Output to streams that may be terminals, or the log of a step of GitHub Actions.

use std::io::{self, Write};

use grader::boundary::printed::steers;
use report::wrap::WIDTH;

/// Smallest width of text: on narrower terminals, lines are cut by the terminal.
const NARROW: usize = 40;

/// The styles of reports: end, bold, dimmed, red, green, yellow.
const STYLES: [&str; 6] =
    ["\u{1b}[0m", "\u{1b}[1m", "\u{1b}[2m", "\u{1b}[31m", "\u{1b}[32m", "\u{1b}[33m"];

/// A stream that may be a terminal. Everything that this program prints passes through it, and it steers no terminal.
pub(super) struct Terminal<W: Write> {
    stream: W,
    /// Written, but not yet shown: a sequence may come in parts.
    held: Vec<u8>,
}

/// The number of columns of text on standard output: those of the terminal, and 80 without a terminal or on a wider one.
pub(super) fn width() -> usize {
    let columns = terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    columns.map_or(WIDTH, |columns| columns.clamp(NARROW, WIDTH))
}

/// Output to this stream.
pub(super) fn terminal<W: Write>(stream: W) -> Terminal<W> {
    Terminal { stream, held: Vec::new() }
}

impl<W: Write> Write for Terminal<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.held.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let shown = inert(&String::from_utf8_lossy(&std::mem::take(&mut self.held)));
        let is_step = std::env::var_os("GITHUB_ACTIONS").is_some();
        let shown = if is_step { without_commands(&shown) } else { shown };
        self.stream.write_all(shown.as_bytes())?;
        self.stream.flush()
    }
}

impl<W: Write> Drop for Terminal<W> {
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// The text without characters that steer a terminal, except ends of lines and the styles of reports. Text of students
/// is inert before; this is the second layer.
pub(super) fn inert(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(character) = rest.chars().next() {
        let style = STYLES.into_iter().find(|style| rest.starts_with(style));
        let (part, after) = rest.split_at(style.map_or(character.len_utf8(), str::len));
        if style.is_some() || character == '\n' || !steers(character) {
            shown += part;
        }
        rest = after;
    }
    shown
}

/// The text without commands to GitHub Actions: `::name` at the start of a line, behind blanks, and `##[name]` anywhere.
fn without_commands(text: &str) -> String {
    let quiet = |line: &str| {
        let command = line.trim_start();
        let blanks = &line[..line.len() - command.len()];
        let quiet = if command.starts_with("::") {
            format!("{blanks}: {}", &command[1..])
        } else {
            line.to_owned()
        };
        quiet.replace("##[", "# #[")
    };
    text.split_inclusive('\n').map(quiet).collect()
}

#[cfg(test)]
mod tests {
    use report::table::{BAD, BOLD, DIM, GOOD, ODD};

    use super::*;

    #[test]
    fn text_gives_no_commands_to_actions() {
        let eve = "a::b\n::error::x\n \t::add-mask::y\nz ##[warning]w\n";
        assert_eq!(
            without_commands(eve),
            "a::b\n: :error::x\n \t: :add-mask::y\nz # #[warning]w\n"
        );
    }

    #[test]
    fn terminal_output_keeps_styles_and_no_other_control() {
        for style in [BAD, BOLD, DIM, GOOD, ODD] {
            let styled = format!("{style}a{style:#}\n");
            assert_eq!(inert(&styled), styled);
        }
        let eve = "\u{1b}[2J\u{1b}]0;x\u{7}\u{1b}[8mb\r\u{9b}31m\u{202e}c\u{1b}";
        assert_eq!(inert(eve), "[2J]0;x[8mb31mc");
        let mut stream = Vec::new();
        let mut out = terminal(&mut stream);
        for part in ["\u{1b}", "[1ma\u{1b}", "[2", "J"] {
            out.write_all(part.as_bytes()).unwrap();
        }
        drop(out);
        assert_eq!(stream, "\u{1b}[1ma[2J".as_bytes());
    }
}
