//! The reports of one grading: checked before it starts, written when it has ended.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use grader::grading::Grading;
use grader::rubric::Rubric;
use grader::suite::Suite;
use report::SceneTimes;
use report::text::TextOptions;

use crate::args::{Format, GradeArgs, ReportArg, ReportKind};
use crate::output::put;
use crate::pages::Pages;
use crate::stop::Stop;

/// The reports of one grading.
pub(super) struct Reports {
    plain: Vec<(Format, Option<PathBuf>)>,
    pages: Vec<Pages>,
    /// Whether a result has pictures.
    has_pictures: bool,
    details: usize,
}

/// What the reports show.
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
    pub(super) fn open(args: &GradeArgs) -> Result<Self, Stop> {
        let asked = args.reports();
        let has_place = |report: &&ReportArg| report.kind != ReportKind::Github;
        let places: Vec<&ReportArg> = asked.iter().filter(has_place).collect();
        for (number, ReportArg { file, .. }) in places.iter().enumerate() {
            if places[..number].iter().any(|earlier| earlier.file == *file) {
                let place = file.as_deref().map_or("standard output".into(), Path::to_string_lossy);
                return Err(Stop::bad_input(format!(
                    "{place}: two reports have this destination\n  help: write one of them to another file, as in \
                     --report json=FILE"
                )));
            }
        }
        let has_commands = asked.iter().any(|report| report.kind == ReportKind::Github);
        let is_document = |report: &&ReportArg| {
            report.file.is_none()
                && matches!(report.kind, ReportKind::Plain(Format::Json | Format::Junit))
        };
        if has_commands && asked.iter().any(|report| is_document(&report)) {
            return Err(Stop::bad_input(
                "--report github prints commands, which would stand in the other report\n  help: write that to a file, \
                 as in --report json=FILE",
            ));
        }
        let mut reports = Self {
            plain: Vec::new(),
            pages: Vec::new(),
            has_pictures: asked.iter().any(|report| report.kind == ReportKind::Prairielearn),
            details: args.judge.details,
        };
        for ReportArg { kind, file } in asked {
            match (kind, file) {
                (ReportKind::Plain(format), file) => reports.plain.push((format, file)),
                (ReportKind::Html, Some(folder)) => reports.pages.push(Pages::open(&folder)?),
                // The command line gives pages a folder. `Platforms` writes the others.
                (ReportKind::Html, None) => {}
                (ReportKind::Gradescope | ReportKind::Prairielearn | ReportKind::Github, _) => {}
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
            pages.write("", |sink| {
                report::html::submission(shown.grading, shown.suite, &[], sink)
            })?;
            pages.announce();
        }
        Ok(())
    }

    fn write_plain(
        &self,
        format: Format,
        file: &Option<PathBuf>,
        Shown { grading, times, .. }: Shown<'_>,
    ) -> Result<(), Stop> {
        let options = TextOptions { details: self.details };
        let text = |out: &mut dyn Write| report::text::write(out, grading, options);
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
    let mut bytes = Vec::new();
    match format {
        Format::Text => text(&mut bytes).map_err(Stop::fault)?,
        Format::Json => bytes = report::json::render(grading).map_err(Stop::fault)?.into_bytes(),
        Format::Junit => {
            bytes = report::junit::render(grading, times).map_err(Stop::fault)?.into_bytes();
        }
    }
    Ok(bytes)
}
