//! The reports of one grading: checked before it starts, written when it has ended.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use grader::grading::Grading;
use grader::rubric::Rubric;
use grader::suite::Suite;
use report::SceneTimes;
use report::text::{Amount, NextCommands, TextOptions};
use report::wrap::WIDTH;

use crate::args::{Format, parse_kind};
use crate::output::{put, written};
use crate::pages::Pages;
use crate::stop::Stop;
use crate::terminal::width;

/// A report that `--report` asks for.
#[derive(Clone, PartialEq, Eq)]
pub(super) enum ReportArg {
    /// A format that stands alone, to a file or to the standard output.
    Plain(Format, Option<PathBuf>),
    /// Pages, in a folder or a file.
    Html(PathBuf),
    /// Results for Gradescope.
    Gradescope(PathBuf),
    /// Results for PrairieLearn.
    Prairielearn(PathBuf),
    /// Summary and annotations, where the environment of GitHub Actions says.
    Github,
    /// Points for Classroom 50.
    Classroom50(PathBuf),
}

/// A report with this file.
type WithFile = fn(Option<PathBuf>) -> Result<ReportArg, &'static str>;

impl ReportArg {
    /// The kinds of reports, by name.
    const KINDS: [(&str, WithFile); 8] = [
        ("text", |file| Ok(Self::Plain(Format::Text, file))),
        ("json", |file| Ok(Self::Plain(Format::Json, file))),
        ("junit", |file| Ok(Self::Plain(Format::Junit, file))),
        ("html", |file| {
            file.map(Self::Html)
                .ok_or("pages need a folder or a file: html=pages or html=report.html")
        }),
        ("gradescope", |file| {
            file.map(Self::Gradescope).ok_or("the results need a file: gradescope=results.json")
        }),
        ("prairielearn", |file| {
            file.map(Self::Prairielearn).ok_or("the results need a file: prairielearn=results.json")
        }),
        ("classroom50", |file| {
            file.map(Self::Classroom50).ok_or("the points need a file: classroom50=points.json")
        }),
        ("github", |file| match file {
            None => Ok(Self::Github),
            Some(_) => Err("the files are those that GitHub Actions names: leave out the file"),
        }),
    ];

    /// Parses the value of `--report`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let (with_file, file) = parse_kind(text, "report", &Self::KINDS)?;
        with_file(file).map_err(str::to_owned)
    }

    /// The file or folder; `None` for the standard output.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Self::Plain(_, file) => file.as_deref(),
            Self::Html(file)
            | Self::Gradescope(file)
            | Self::Prairielearn(file)
            | Self::Classroom50(file) => Some(file),
            Self::Github => None,
        }
    }
}

/// The reports of one grading.
pub(super) struct Reports {
    plain: Vec<(Format, Option<PathBuf>)>,
    pages: Vec<Pages>,
    /// Whether a result has pictures.
    has_pictures: bool,
    amount: Amount,
    /// The submission and the options with which commands find it; `None` for the built-in simulator.
    arguments: Option<String>,
}

/// Content of the reports.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    pub(super) grading: &'a Grading,
    pub(super) times: &'a SceneTimes,
    pub(super) suite: &'a Suite,
    pub(super) rubric: &'a Rubric,
}

impl Reports {
    /// Checks the reports that are asked for, and opens their folders.
    ///
    /// # Errors
    /// If two of them have the same destination, or a folder cannot be used.
    pub(super) fn open(
        asked: Vec<ReportArg>,
        amount: Amount,
        arguments: Option<String>,
    ) -> Result<Self, Stop> {
        let has_place = |report: &&ReportArg| **report != ReportArg::Github;
        let places: Vec<Option<&Path>> =
            asked.iter().filter(has_place).map(ReportArg::file).collect();
        for (number, file) in places.iter().enumerate() {
            if places[..number].contains(file) {
                let place = file.map_or("standard output".into(), Path::to_string_lossy);
                return Err(Stop::bad_input(format!(
                    "{place}: two reports have this destination\n  help: write one of them to another file, as in \
                     --report json=FILE"
                )));
            }
        }
        let is_document = |report: &ReportArg| {
            matches!(report, ReportArg::Plain(Format::Json | Format::Junit, None))
        };
        if asked.contains(&ReportArg::Github) && asked.iter().any(is_document) {
            return Err(Stop::bad_input(
                "--report github prints commands, which would stand in the other report\n  help: write that to a file, \
                 as in --report json=FILE",
            ));
        }
        let (plain, pages) = (Vec::new(), Vec::new());
        let mut reports = Self { plain, pages, has_pictures: false, amount, arguments };
        for report in asked {
            match report {
                ReportArg::Plain(format, file) => reports.plain.push((format, file)),
                ReportArg::Html(folder) => reports.pages.push(Pages::open(&folder)?),
                ReportArg::Prairielearn(_) => reports.has_pictures = true,
                // `Platforms` writes the results of all platforms.
                ReportArg::Gradescope(_) | ReportArg::Github | ReportArg::Classroom50(_) => {}
            }
        }
        Ok(reports)
    }

    /// Whether the reports need recordings of the comparisons.
    pub(super) fn need_recordings(&self) -> bool {
        self.has_pictures || !self.pages.is_empty()
    }

    /// Whether all reports can show a part of a run as such.
    pub(super) fn can_be_partial(&self) -> bool {
        self.plain.iter().all(|(format, _)| *format == Format::Text)
    }

    /// Writes the text reports of a run that was ended early. A program could mistake a partial JSON or JUnit report
    /// for a complete one.
    pub(super) fn write_partial(&self, shown: Shown<'_>) -> Result<(), Stop> {
        let texts = self.plain.iter().filter(|(format, _)| *format == Format::Text);
        texts.into_iter().try_for_each(|(format, file)| self.write_plain(*format, file, shown))
    }

    /// Writes every report.
    pub(super) fn write(&self, shown: Shown<'_>) -> Result<(), Stop> {
        for (format, file) in &self.plain {
            self.write_plain(*format, file, shown)?;
        }
        for pages in &self.pages {
            pages
                .publish(|sink| report::html::submission(shown.grading, shown.suite, &[], sink))?;
        }
        Ok(())
    }

    fn write_plain(
        &self,
        format: Format,
        file: &Option<PathBuf>,
        Shown { grading, times, .. }: Shown<'_>,
    ) -> Result<(), Stop> {
        let page = self.pages.first().map(|pages| pages.index().display().to_string());
        let next = self.arguments.clone().map(|arguments| NextCommands { arguments, page });
        let width = if file.is_some() { WIDTH } else { width() };
        let options = TextOptions { amount: self.amount, width, next };
        let text = |out: &mut dyn Write| report::text::write(out, grading, &options);
        put(&render(format, grading, times, text)?, file.as_deref())
    }
}

/// The report in a format; `text` writes the text format.
pub(super) fn render(
    format: Format,
    grading: &Grading,
    times: &SceneTimes,
    text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<Vec<u8>, Stop> {
    Ok(match format {
        Format::Text => written(|bytes| text(bytes))?,
        Format::Json => report::json::render(grading).map_err(Stop::fault)?.into_bytes(),
        Format::Junit => report::junit::render(grading, times).map_err(Stop::fault)?.into_bytes(),
    })
}
