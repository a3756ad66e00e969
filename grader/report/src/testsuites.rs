//! JUnit XML document: suites with properties and cases, valid by the schema of Jenkins (`junit-10.xsd`).

use std::io;
use std::time::Duration;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

/// The document.
pub(super) struct Document {
    /// Name of the document.
    pub(super) name: String,
    /// Written in this order.
    pub(super) suites: Vec<TestSuite>,
}

/// A suite of cases.
#[derive(Default)]
pub(super) struct TestSuite {
    /// Name of the suite.
    pub(super) name: String,
    /// Name and value.
    pub(super) properties: Vec<(&'static str, String)>,
    /// Written in this order.
    pub(super) cases: Vec<TestCase>,
}

/// A case: passed, or not.
pub(super) struct TestCase {
    name: String,
    /// How long it took, if measured.
    time: Option<Duration>,
    problem: Option<CaseProblem>,
}

/// Why a case has not passed.
struct CaseProblem {
    kind: ProblemKind,
    ty: Option<String>,
    message: String,
}

/// Kind of a problem.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ProblemKind {
    /// Judged wrong.
    Failure,
    /// Could not be judged.
    Error,
    /// Not run.
    Skipped,
}

impl ProblemKind {
    fn tag(self) -> &'static str {
        match self {
            Self::Failure => "failure",
            Self::Error => "error",
            Self::Skipped => "skipped",
        }
    }
}

impl TestCase {
    /// A case that passed.
    pub(super) fn passed(name: impl Into<String>) -> Self {
        Self { name: name.into(), time: None, problem: None }
    }

    /// A case that did not pass; `ty` classifies the reason.
    pub(super) fn not_passed(
        name: impl Into<String>,
        kind: ProblemKind,
        ty: Option<&str>,
        message: String,
    ) -> Self {
        let problem = CaseProblem { kind, ty: ty.map(str::to_owned), message };
        Self { problem: Some(problem), ..Self::passed(name) }
    }

    /// The case, with the time that it took if measured.
    pub(super) fn taking(self, time: Option<Duration>) -> Self {
        Self { time, ..self }
    }
}

impl Document {
    /// The document as text, with a newline at its end.
    ///
    /// # Errors
    /// Never in practice: it writes to memory.
    pub(super) fn render(&self) -> io::Result<String> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 4);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        let cases = || self.suites.iter().flat_map(|suite| &suite.cases);
        writer
            .create_element("testsuites")
            .with_attribute(("name", clean(&self.name).as_str()))
            .with_attribute(("tests", cases().count().to_string().as_str()))
            .with_attribute(("failures", count(cases(), ProblemKind::Failure).as_str()))
            .with_attribute(("errors", count(cases(), ProblemKind::Error).as_str()))
            .with_attributes(time(cases()).as_deref().map(|seconds| ("time", seconds)))
            .write_inner_content(|writer| {
                self.suites.iter().try_for_each(|suite| suite.write(writer))
            })?;
        let mut text = String::from_utf8(writer.into_inner()).map_err(io::Error::other)?;
        text.push('\n');
        Ok(text)
    }
}

impl TestSuite {
    fn write(&self, writer: &mut Writer<Vec<u8>>) -> io::Result<()> {
        let cases = || self.cases.iter();
        let element = writer
            .create_element("testsuite")
            .with_attribute(("name", clean(&self.name).as_str()))
            .with_attribute(("tests", cases().count().to_string().as_str()))
            .with_attribute(("skipped", count(cases(), ProblemKind::Skipped).as_str()))
            .with_attribute(("errors", count(cases(), ProblemKind::Error).as_str()))
            .with_attribute(("failures", count(cases(), ProblemKind::Failure).as_str()))
            .with_attributes(time(cases()).as_deref().map(|seconds| ("time", seconds)));
        if self.properties.is_empty() && self.cases.is_empty() {
            element.write_empty()?;
            return Ok(());
        }
        element.write_inner_content(|writer| {
            if !self.properties.is_empty() {
                writer.create_element("properties").write_inner_content(|writer| {
                    for (name, value) in &self.properties {
                        writer
                            .create_element("property")
                            .with_attribute(("name", *name))
                            .with_attribute(("value", clean(value).as_str()))
                            .write_empty()?;
                    }
                    Ok(())
                })?;
            }
            // Viewers group cases by the dots of their class names.
            let class = clean(&self.name).replace(" / ", ".");
            cases().try_for_each(|case| case.write(writer, &class))
        })?;
        Ok(())
    }
}

impl TestCase {
    fn write(&self, writer: &mut Writer<Vec<u8>>, class: &str) -> io::Result<()> {
        let name = clean(&self.name);
        let element = writer
            .create_element("testcase")
            .with_attribute(("name", name.as_str()))
            .with_attribute(("classname", class))
            .with_attributes(time([self]).as_deref().map(|seconds| ("time", seconds)));
        let Some(CaseProblem { kind, ty, message }) = &self.problem else {
            element.write_empty()?;
            return Ok(());
        };
        element.write_inner_content(|writer| {
            let message = clean(message);
            let first_line = message.lines().next().unwrap_or_default();
            let mut element =
                writer.create_element(kind.tag()).with_attribute(("message", first_line));
            if let Some(ty) = ty {
                element = element.with_attribute(("type", ty.as_str()));
            }
            // An attribute loses line breaks; a text keeps them.
            if message.contains('\n') {
                element.write_text_content(BytesText::new(&message))?;
            } else {
                element.write_empty()?;
            }
            Ok(())
        })?;
        Ok(())
    }
}

/// Seconds that these cases took; `None` if none was measured.
fn time<'a>(cases: impl IntoIterator<Item = &'a TestCase>) -> Option<String> {
    let times = cases.into_iter().filter_map(|case| case.time);
    times.reduce(|a, b| a + b).map(|time| format!("{:.3}", time.as_secs_f64()))
}

/// Number of cases with a problem of this kind, as text.
fn count<'a>(cases: impl Iterator<Item = &'a TestCase>, kind: ProblemKind) -> String {
    let is_counted =
        |case: &&TestCase| case.problem.as_ref().is_some_and(|problem| problem.kind == kind);
    cases.filter(is_counted).count().to_string()
}

/// Text without terminal escape sequences and without characters that XML 1.0 does not allow.
fn clean(text: &str) -> String {
    let is_allowed = |character: &char| matches!(character, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..);
    anstream::adapter::strip_str(text).to_string().chars().filter(is_allowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_that_xml_does_not_allow_are_removed() {
        let message = "a\u{1}\u{8}\u{b}\u{1b}[31mred\u{1b}[0m\u{fffe}\u{ffff}\t\u{1f600} <&\">";
        let suite = TestSuite {
            name: "suite".to_owned(),
            cases: vec![TestCase::not_passed(
                "case",
                ProblemKind::Error,
                Some("crashed"),
                message.into(),
            )],
            ..TestSuite::default()
        };
        let text = Document { name: "\0all".to_owned(), suites: vec![suite] }.render().unwrap();
        assert!(text.contains("<testsuites name=\"all\" tests=\"1\""), "{text}");
        let expected = "message=\"ared&#9;\u{1f600} &lt;&amp;&quot;&gt;\" type=\"crashed\"/>";
        assert!(text.contains(expected), "{text}");
    }
}
