//! Frame of a page, and HTML text that is escaped by construction.
//!
//! Only string literals become markup. Everything else is escaped, whatever it contains.

use std::fmt::Write;
use std::io;

use grader::boundary::printed::steers;

/// Policy of every page: scripts and styles from the same site or from files, and no other request. Text in a page
/// can so never run as a script.
const POLICY: &str = "default-src 'none'; script-src 'self' file:; style-src 'self' file:; img-src data:; \
                      base-uri 'none'; form-action 'none'";

/// Scripts of every page, in the order in which they are loaded.
pub(super) const SCRIPTS: [&str; 9] = [
    "base.js",
    "chart.js",
    "gestures.js",
    "strain.js",
    "view.js",
    "player.js",
    "stage.js",
    "gallery.js",
    "table.js",
];

/// Start of bold text in a text report.
const BOLD_START: &str = "\u{1b}[1m";

/// End of styled text in a text report.
const STYLE_END: &str = "\u{1b}[0m";

/// HTML text.
#[derive(Default)]
pub struct Html(String);

/// Attributes of an element. An attribute without a value is written alone.
pub type Attributes<'a> = &'a [(&'static str, &'a str)];

impl Html {
    /// Adds markup.
    pub fn markup(&mut self, markup: &'static str) -> &mut Self {
        self.0.push_str(markup);
        self
    }

    /// Adds escaped text.
    pub fn text(&mut self, text: &str) -> &mut Self {
        for character in text.chars() {
            match character {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                '\'' => self.0.push_str("&#39;"),
                '\n' => self.0.push('\n'),
                steering if steers(steering) => self.0.push(char::REPLACEMENT_CHARACTER),
                harmless => self.0.push(harmless),
            }
        }
        self
    }

    /// Adds the start of an element.
    pub fn open(&mut self, tag: &'static str, attributes: Attributes<'_>) -> &mut Self {
        self.markup("<").markup(tag);
        for (name, value) in attributes {
            self.markup(" ").markup(name).markup("=\"").text(value).markup("\"");
        }
        self.markup(">")
    }

    /// Adds the end of an element.
    pub fn close(&mut self, tag: &'static str) -> &mut Self {
        self.markup("</").markup(tag).markup(">")
    }

    /// Adds an element with text.
    pub fn element(
        &mut self,
        tag: &'static str,
        attributes: Attributes<'_>,
        text: &str,
    ) -> &mut Self {
        self.open(tag, attributes).text(text).close(tag)
    }

    /// Adds the lines of a text report as list items: bold text stays bold, other styles are dropped.
    ///
    /// # Errors
    /// If `write` fails.
    pub fn lines(&mut self, write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> io::Result<()> {
        let mut bytes = Vec::new();
        write(&mut bytes)?;
        for line in String::from_utf8_lossy(&bytes).lines() {
            self.markup("<li>");
            for (number, part) in line.trim().split(BOLD_START).enumerate() {
                let plain = |text: &str| anstream::adapter::strip_str(text).to_string();
                match part.split_once(STYLE_END).filter(|_| number > 0) {
                    Some((bold, rest)) => {
                        self.element("strong", &[], &plain(bold)).text(&plain(rest));
                    }
                    None => {
                        self.text(&plain(part));
                    }
                }
            }
            self.markup("</li>");
        }
        Ok(())
    }

    /// Adds a text report as it is, without its styles.
    ///
    /// # Errors
    /// If `write` fails.
    pub fn report(&mut self, write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> io::Result<()> {
        let mut bytes = Vec::new();
        write(&mut bytes)?;
        let text = String::from_utf8_lossy(&bytes);
        let plain = anstream::adapter::strip_str(&text).to_string();
        self.element("pre", &[("tabindex", "0")], &plain);
        Ok(())
    }

    /// The text.
    pub(super) fn into_string(self) -> String {
        self.0
    }

    /// Whether nothing was added.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds a link.
    pub fn link(&mut self, href: &str, text: &str) -> &mut Self {
        self.element("a", &[("href", href)], text)
    }

    /// Adds other HTML text.
    pub fn append(&mut self, other: &Self) -> &mut Self {
        self.0.push_str(&other.0);
        self
    }

    /// Adds data for the page's scripts: JSON in an element with this id. No text in it can end the element.
    pub fn data(&mut self, id: &str, json: &str) -> &mut Self {
        self.open("script", &[("type", "application/json"), ("id", id)]);
        self.0.push_str(&json.replace('<', "\\u003c"));
        self.close("script")
    }
}

/// The rest of a page around its content.
pub struct Page<'a> {
    /// Title of the window.
    pub title: &'a str,
    /// Number of folders between the page and the folder with the assets.
    pub depth: usize,
    /// Links to the pages above this one, from the top: address and text.
    pub above: &'a [(String, String)],
}

impl Page<'_> {
    /// The document.
    pub fn render(&self, content: &Html) -> Vec<u8> {
        let assets = format!("{}assets/", "../".repeat(self.depth));
        let mut html = Html::default();
        html.markup("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n")
            .open("meta", &[("http-equiv", "Content-Security-Policy"), ("content", POLICY)])
            .markup("\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n")
            .open("meta", &[("name", "generator"), ("content", super::GENERATOR)])
            .markup("\n<meta name=\"color-scheme\" content=\"light dark\">\n")
            .element("title", &[], self.title)
            .markup("\n")
            .open("link", &[("rel", "stylesheet"), ("href", &format!("{assets}report.css"))])
            .markup("\n<link rel=\"icon\" href=\"data:,\">\n");
        for script in SCRIPTS {
            html.open("script", &[("defer", ""), ("src", &format!("{assets}{script}"))])
                .close("script")
                .markup("\n");
        }
        html.markup("</head>\n<body>\n<a class=\"skip\" href=\"#content\">Skip to content</a>\n");
        html.markup("<header class=\"top\"><nav aria-label=\"Pages above\"><ol>");
        for (address, text) in self.above {
            html.markup("<li>").link(address, text).markup("</li>");
        }
        html.markup("<li>").element("span", &[("aria-current", "page")], self.title);
        html.markup("</li></ol></nav></header>\n<main id=\"content\">\n");
        html.append(content);
        html.markup("\n</main>\n<footer>Made by Spring Oracle ")
            .text(env!("CARGO_PKG_VERSION"))
            .markup(". This page needs no network.</footer>\n</body>\n</html>\n");
        html.0.into_bytes()
    }
}

/// A relative address: every byte that has a meaning in addresses is escaped, except `/`.
pub fn address(path: &str) -> String {
    let mut address = String::new();
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'/' => {
                address.push(char::from(byte));
            }
            _ => {
                let _ = write!(address, "%{byte:02X}");
            }
        }
    }
    address
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn text_never_becomes_markup() {
        let mut html = Html::default();
        html.element("p", &[("title", "\"><script>")], "</p><script>alert(1)</script>\u{1b}[2J]]>");
        html.data("data", r#"{"a":"</script><script>alert(1)//"}"#);
        let expected = "<p title=\"&quot;&gt;&lt;script&gt;\">&lt;/p&gt;&lt;script&gt;alert(1)&lt;/script&gt;\u{fffd}[2J]]&gt;</p>\
                        <script type=\"application/json\" id=\"data\">{\"a\":\"\\u003c/script>\\u003cscript>alert(1)//\"}</script>";
        assert_eq!(html.0, expected);
    }

    #[test]
    fn bold_text_of_a_report_stays_bold() {
        let mut html = Html::default();
        let (bold, dim) = (crate::table::BOLD, crate::table::DIM);
        html.lines(|out| writeln!(out, "  Cause: {bold}a < b{bold:#} {dim}(2 of 3){dim:#}"))
            .unwrap();
        assert_eq!(html.0, "<li>Cause: <strong>a &lt; b</strong> (2 of 3)</li>");
    }

    #[test]
    fn page_links_escape_file_names() {
        assert_eq!(address("a b/#?%é.html"), "a%20b/%23%3F%25%C3%A9.html");
    }
}
