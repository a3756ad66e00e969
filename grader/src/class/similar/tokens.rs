//! Tokens of source code, without names, values, comments and layout.
//!
//! ```text
//! double kinetic = 0.5 * m[i];  // of one      ->    W W = N * W [ W ] ;
//! ```
//!
//! A name becomes `W`, a number `N`, a string or character `S`; a word that directs control or begins a definition stays
//! itself, and so does every other character. Names of types are names: replacing `double` by `float` changes nothing.
//! Lines that only name libraries are left out. One tokenizer reads every language; a [`Language`] states what differs.

/// A language's tokens.
#[derive(Debug)]
pub(super) struct Language {
    /// Extensions of its files, in lower case.
    extensions: &'static [&'static str],
    line_comment: &'static str,
    /// How comments of several lines begin and end.
    block_comment: Option<(&'static str, &'static str)>,
    /// Whether such comments nest.
    nests: bool,
    /// How strings begin and end; longer ones first.
    strings: &'static [Quote],
    raw: Option<Raw>,
    /// Whether `/` may begin a regular expression.
    has_regex: bool,
    /// First words of lines that name libraries.
    imports: &'static [&'static str],
}

/// How a string begins and ends. A backslash escapes the character after it.
#[derive(Debug)]
struct Quote {
    mark: &'static str,
    /// Whether it may span lines. One that may not ends with its line at the latest.
    spans_lines: bool,
}

/// Strings in which a backslash is a character like others.
#[derive(Debug, PartialEq)]
enum Raw {
    /// `R"mark(text)mark"`
    Cpp,
    /// `r#"text"#`; and a single `'` may begin the name of a lifetime
    Rust,
}

const fn line(mark: &'static str) -> Quote {
    Quote { mark, spans_lines: false }
}

const fn lines(mark: &'static str) -> Quote {
    Quote { mark, spans_lines: true }
}

/// C, which the other languages with braces differ from.
const C: Language = Language {
    extensions: &["c"],
    line_comment: "//",
    block_comment: Some(("/*", "*/")),
    nests: false,
    strings: &[line("\""), line("'")],
    raw: None,
    has_regex: false,
    imports: &["#include"],
};

/// The languages.
const LANGUAGES: [Language; 6] = [
    C,
    Language {
        extensions: &[
            "cpp", "cc", "cxx", "c++", "h", "hh", "hpp", "hxx", "h++", "inl", "ipp", "tpp", "tcc",
            "txx", "inc", "cu", "cuh",
        ],
        raw: Some(Raw::Cpp),
        imports: &["#include", "using"],
        ..C
    },
    Language {
        extensions: &["rs"],
        nests: true,
        strings: &[lines("\""), line("'")],
        raw: Some(Raw::Rust),
        imports: &["use", "extern"],
        ..C
    },
    Language {
        extensions: &["py"],
        line_comment: "#",
        block_comment: None,
        strings: &[lines("\"\"\""), lines("'''"), line("\""), line("'")],
        imports: &["import", "from"],
        ..C
    },
    Language {
        extensions: &["js", "mjs", "cjs"],
        strings: &[lines("`"), line("\""), line("'")],
        has_regex: true,
        imports: &["import"],
        ..C
    },
    Language {
        extensions: &["java"],
        strings: &[lines("\"\"\""), line("\""), line("'")],
        imports: &["import", "package"],
        ..C
    },
];

/// Words that direct control or begin a definition, in any of the languages.
const KEYWORDS: [&str; 33] = [
    "if", "else", "elif", "for", "while", "do", "loop", "switch", "match", "case", "default",
    "break", "continue", "return", "yield", "goto", "try", "catch", "except", "finally", "throw",
    "raise", "in", "class", "struct", "enum", "impl", "trait", "fn", "def", "function", "lambda",
    "new",
];

const NAME: u32 = 0x11_0000;
const NUMBER: u32 = NAME + 1;
const STRING: u32 = NAME + 2;
const FIRST_KEYWORD: u32 = NAME + 3;

/// A token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Token {
    /// A character, or a number above all characters.
    pub(super) kind: u32,
    /// Its line, from 1.
    pub(super) line: u32,
}

/// The language of a file, by the extension of its name.
pub(super) fn language(name: &str) -> Option<&'static Language> {
    let (_, extension) = name.rsplit_once('.')?;
    let extension = extension.to_ascii_lowercase();
    LANGUAGES.iter().find(|language| language.extensions.contains(&&*extension))
}

/// The tokens of a source, whatever it contains; linear in its length.
pub(super) fn tokens(text: &str, language: &Language) -> Vec<Token> {
    let mut reader = Reader { rest: text, line: 1, begins_line: true, last: None };
    let mut tokens = Vec::new();
    while let Some(character) = reader.rest.chars().next() {
        let line = reader.line;
        let begins_line = reader.begins_line;
        let kind = reader.next(character, language);
        if let Some(kind) = kind {
            tokens.push(Token { kind, line });
            reader.last = Some(kind);
        }
        reader.begins_line = kind.is_none() && (begins_line || reader.line > line);
    }
    tokens
}

/// A position in a source.
struct Reader<'a> {
    rest: &'a str,
    line: u32,
    /// Whether only space precedes it in its line.
    begins_line: bool,
    /// The token before it.
    last: Option<u32>,
}

impl Reader<'_> {
    /// Steps over what begins with `character`, and returns its kind if it is a token.
    fn next(&mut self, character: char, language: &Language) -> Option<u32> {
        if character.is_whitespace() {
            self.skip(character.len_utf8());
            return None;
        }
        if self.begins_line && language.imports.iter().any(|word| self.begins_with_word(word)) {
            self.skip_line();
            return None;
        }
        if self.rest.starts_with(language.line_comment) {
            self.skip_line();
            return None;
        }
        if let Some((begin, end)) = language.block_comment
            && self.rest.starts_with(begin)
        {
            self.skip_comment(begin, end, language.nests);
            return None;
        }
        if let Some(length) = language.raw.as_ref().and_then(|raw| raw.length(self.rest)) {
            self.skip(length);
            return Some(STRING);
        }
        if character == '\'' && language.raw == Some(Raw::Rust) && is_lifetime(self.rest) {
            self.skip(1);
            return Some(u32::from('\''));
        }
        if let Some(quote) = language.strings.iter().find(|quote| self.rest.starts_with(quote.mark))
        {
            self.skip(quote.length(self.rest));
            return Some(STRING);
        }
        if language.has_regex
            && !self.last.is_some_and(ends_value)
            && let Some(length) = regex_length(self.rest)
        {
            self.skip(length);
            return Some(STRING);
        }
        if character.is_ascii_digit() {
            self.skip(number_length(self.rest));
            return Some(NUMBER);
        }
        if is_of_word(character) {
            let length = self.rest.find(|c| !is_of_word(c)).unwrap_or(self.rest.len());
            let word = &self.rest[..length];
            let place = KEYWORDS.iter().position(|keyword| *keyword == word);
            self.skip(length);
            return Some(place.map_or(NAME, |place| FIRST_KEYWORD + place as u32));
        }
        self.skip(character.len_utf8());
        Some(u32::from(character))
    }

    fn skip(&mut self, length: usize) {
        let (skipped, rest) = self.rest.split_at(length);
        self.line += skipped.bytes().filter(|byte| *byte == b'\n').count() as u32;
        self.rest = rest;
    }

    fn skip_line(&mut self) {
        self.skip(self.rest.find('\n').unwrap_or(self.rest.len()));
    }

    fn skip_comment(&mut self, begin: &str, end: &str, nests: bool) {
        let mut depth = 0;
        loop {
            if self.rest.starts_with(end) {
                self.skip(end.len());
                depth -= 1;
            } else if self.rest.starts_with(begin) && (nests || depth == 0) {
                self.skip(begin.len());
                depth += 1;
            } else if let Some(character) = self.rest.chars().next() {
                self.skip(character.len_utf8());
            } else {
                return;
            }
            if depth == 0 {
                return;
            }
        }
    }

    fn begins_with_word(&self, word: &str) -> bool {
        let rest = self.rest.strip_prefix(word);
        rest.is_some_and(|rest| !rest.starts_with(is_of_word))
    }
}

impl Quote {
    /// The length of the string that a text begins with.
    fn length(&self, text: &str) -> usize {
        let bytes = text.as_bytes();
        let mut at = self.mark.len();
        while at < bytes.len() {
            match bytes[at] {
                _ if bytes[at..].starts_with(self.mark.as_bytes()) => return at + self.mark.len(),
                b'\n' if !self.spans_lines => return at,
                b'\\' => at += 1 + text[at + 1..].chars().next().map_or(0, char::len_utf8),
                _ => at += text[at..].chars().next().map_or(1, char::len_utf8),
            }
        }
        bytes.len()
    }
}

impl Raw {
    /// The length of the raw string that a text begins with, if it begins with one.
    fn length(&self, text: &str) -> Option<usize> {
        let (head, end) = match self {
            Self::Cpp => {
                let after = text.strip_prefix("R\"")?;
                // The standard allows 16 characters.
                let mark = &after[..after.bytes().take(17).position(|byte| byte == b'(')?];
                (2 + mark.len() + 1, format!("){mark}\""))
            }
            Self::Rust => {
                let after = text.strip_prefix('r').or_else(|| text.strip_prefix("br"))?;
                let marks = after.len() - after.trim_start_matches('#').len();
                after[marks..].strip_prefix('"')?;
                (text.len() - after.len() + marks + 1, format!("\"{}", "#".repeat(marks)))
            }
        };
        Some(text[head..].find(&end).map_or(text.len(), |at| head + at + end.len()))
    }
}

/// Whether a token may be the end of a value, after which `/` divides.
fn ends_value(kind: u32) -> bool {
    [NAME, NUMBER, STRING].contains(&kind) || [')', ']', '}'].map(u32::from).contains(&kind)
}

/// The length of the regular expression that a text begins with, if it begins with one that ends in its line.
fn regex_length(text: &str) -> Option<usize> {
    let line = text.strip_prefix('/')?.split('\n').next()?;
    let (mut in_class, mut is_escaped) = (false, false);
    for (at, character) in line.char_indices() {
        match character {
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            '[' => in_class = true,
            ']' => in_class = false,
            '/' if !in_class => return Some(1 + at + 1),
            _ => {}
        }
    }
    None
}

fn is_of_word(character: char) -> bool {
    character.is_alphanumeric() || character == '_' || character == '$'
}

/// Whether a text that begins with `'` begins with the name of a lifetime.
fn is_lifetime(text: &str) -> bool {
    let mut characters = text.chars().skip(1);
    let begins = characters.next().is_some_and(|c| c.is_alphabetic() || c == '_');
    begins && characters.next() != Some('\'')
}

/// The length of the number that a text begins with: digits, letters and `_`, with `.` or `'` between two of these, and
/// the sign of an exponent.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let is_hexadecimal = text.starts_with("0x") || text.starts_with("0X");
    let mut at = 1;
    while at < bytes.len() {
        let next_is_digit = bytes.get(at + 1).is_some_and(u8::is_ascii_hexdigit);
        let follows_exponent = !is_hexadecimal && matches!(bytes[at - 1], b'e' | b'E');
        let belongs = match bytes[at] {
            byte if byte.is_ascii_alphanumeric() || byte == b'_' => true,
            b'.' | b'\'' => next_is_digit,
            b'+' | b'-' => follows_exponent && next_is_digit,
            _ => false,
        };
        if !belongs {
            break;
        }
        at += 1;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tokens in one line: names `W`, numbers `N`, strings `S`, keywords and other characters as they are.
    fn shown(text: &str, file: &str) -> String {
        let show = |token: Token| match token.kind {
            NAME => "W".to_owned(),
            NUMBER => "N".to_owned(),
            STRING => "S".to_owned(),
            keyword if keyword >= FIRST_KEYWORD => {
                KEYWORDS[(keyword - FIRST_KEYWORD) as usize].to_owned()
            }
            other => char::from_u32(other).unwrap().to_string(),
        };
        let tokens = tokens(text, language(file).unwrap());
        tokens.into_iter().map(show).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn names_values_comments_and_layout_do_not_count() {
        let one = "#include <cmath>\n// the energy\ndouble energy(const V& x) { return 0.5e-3 * x[0]; /* a */ }";
        let two = "#include <map>\nfloat\n  E(const V& q)\n{\n  return 2'000.f * q[11];\n}\n";
        assert_eq!(shown(one, "a.cpp"), "W W ( W W & W ) { return N * W [ N ] ; }");
        assert_eq!(shown(one, "a.cpp"), shown(two, "b.h"));
    }

    #[test]
    fn each_language_has_its_comments_and_strings() {
        for (file, text, wanted) in [
            ("a.c", "a /* b /* c */ d \"//\\\"e\" '\"' f", "W W S S W"),
            ("a.cpp", "s = R\"x(\" ) // )x\"; t", "W = S ; W"),
            ("a.cc", "a \"open\nb", "W S W"),
            ("a.rs", "/* a /* b */ c */ d<'e> 'f' r#\"g\" //\"# h", "W < ' W > S S W"),
            ("a.rs", "use a::b;\nlet x = 1..n;", "W W = N . . W ;"),
            ("a.py", "import a # b\nx = '''c\n# d''' + \"#e\" # f\ng", "W = S + S W"),
            ("a.py", "def f(x):\n    return x[1:2] // 3", "def W ( W ) : return W [ N : N ] / / N"),
            ("a.js", "import a;\nlet b = `c // ${d}` // e", "W W = S"),
            ("a.js", "a(/[/*]\\/\"/g) / b / c", "W ( S W ) / W / W"),
            ("a.tpp", "#include \"b\"\nc", "W"),
            (
                "a.java",
                "package a;\nString b = \"\"\"\n \"c\" \"\"\"; new D()",
                "W W = S ; new W ( )",
            ),
            ("a.C", "x = 0x1F - 1e-3 - y", "W = N - N - W"),
        ] {
            assert_eq!(shown(text, file), wanted, "{file}: {text}");
        }
        assert!(language("a.o").is_none() && language("Makefile").is_none());
    }

    #[test]
    fn lines_are_counted_through_comments_and_strings() {
        let text = "a /*\n\n*/ b\n'''\n''' c";
        let lines = |file: &str| {
            let tokens = tokens(text, language(file).unwrap());
            tokens.into_iter().map(|token| token.line).collect::<Vec<_>>()
        };
        assert_eq!(lines("a.cpp")[..2], [1, 3]);
        assert_eq!(lines("a.py").last(), Some(&5));
    }

    #[test]
    fn unterminated_tokens_end_with_the_text() {
        for text in [
            "/*",
            "\"",
            "'",
            "\"\\",
            "'é",
            "R\"(",
            "r#\"",
            "'''a\\",
            "1e",
            "1.",
            "é'é",
            "\\",
            "R\"é(x",
            "R\"R\"R\"0123456789abcdef(",
        ] {
            for language in &LANGUAGES {
                tokens(text, language);
            }
        }
    }
}
