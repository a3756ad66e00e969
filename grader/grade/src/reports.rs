//! The reports of one grading: checked before it starts, written when it has ended.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use grader::grading::Grading;
use grader::rubric::Rubric;
use grader::suite::Suite;
use platforms::gradescope::metadata::Metadata;
use platforms::gradescope::results::{self, Results};
use platforms::gradescope::score::Score;
use report::SceneTimes;
use report::text::TextOptions;

use crate::args::{Format, GradeArgs, ReportArg, ReportKind};
use crate::output::put;
use crate::pages::Pages;
use crate::stop::{Exit, Stop, complain};

/// The reports of one grading.
pub(super) struct Reports {
    plain: Vec<(Format, Option<PathBuf>)>,
    pages: Vec<Pages>,
    gradescope: Option<PathBuf>,
    metadata: Option<Metadata>,
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
        for (number, ReportArg { file, .. }) in asked.iter().enumerate() {
            if asked[..number].iter().any(|earlier| earlier.file == *file) {
                let place = file.as_deref().map_or("standard output".into(), Path::to_string_lossy);
                return Err(Stop::bad_input(format!(
                    "{place}: two reports have this destination\n  help: write one of them to another file, as in \
                     --report json=FILE"
                )));
            }
        }
        let metadata = args.metadata.as_deref().map(read_metadata).transpose()?;
        let mut reports = Self {
            plain: Vec::new(),
            pages: Vec::new(),
            gradescope: None,
            metadata,
            details: args.judge.details,
        };
        for ReportArg { kind, file } in asked {
            match (kind, file) {
                (ReportKind::Plain(format), file) => reports.plain.push((format, file)),
                (ReportKind::Html, Some(folder)) => reports.pages.push(Pages::open(&folder)?),
                (ReportKind::Gradescope, file) => reports.gradescope = file,
                // The command line gives pages a folder.
                (ReportKind::Html, None) => {}
            }
        }
        Ok(reports)
    }

    /// Whether the reports need recordings of the comparisons.
    pub(super) fn need_recordings(&self) -> bool {
        !self.pages.is_empty()
    }

    /// Whether all reports can show a part of a run as such.
    pub(super) fn can_be_partial(&self) -> bool {
        self.gradescope.is_none() && self.plain.iter().all(|(format, _)| *format == Format::Text)
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
        if let Some(file) = &self.gradescope {
            let Shown { grading, times, rubric, .. } = shown;
            let rules = (rubric.late(), rubric.platform());
            let score = Score::of(grading, rules, self.metadata.as_ref());
            let results = Results { grading, times, score, platform: rubric.platform() };
            put(results.render().map_err(Stop::fault)?.as_bytes(), Some(file))?;
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

/// Writes results that say why nothing was graded, for a platform that shows nothing else. Students read whether
/// time ran out; the reason is for the instructor.
pub(super) fn write_not_graded(args: &GradeArgs, Stop(exit, reason): &Stop) {
    let message = match exit {
        Exit::Interrupted => format!(
            "Your submission was not graded to the end, because grading took too long ({reason}). It has no points. \
             If your program is slow, make it faster; else tell your instructor."
        ),
        _ => "Your submission was not graded: the autograder has a fault, which is not yours. Your instructor can see \
              the reason, and run it again."
            .to_owned(),
    };
    for ReportArg { kind, file } in args.reports() {
        if let (ReportKind::Gradescope, Some(file)) = (kind, file) {
            let written = results::not_graded(&message, reason).map_err(Stop::fault);
            let written = written.and_then(|text| put(text.as_bytes(), Some(&file)));
            if let Err(Stop(_, error)) = written {
                complain("error", error);
            }
        }
    }
}

fn read_metadata(path: &Path) -> Result<Metadata, Stop> {
    let unusable = |error: &dyn std::fmt::Display| {
        let path = path.display();
        Stop::bad_input(format!("{path}: the metadata of the submission cannot be used: {error}"))
    };
    let text = std::fs::read_to_string(path).map_err(|error| unusable(&error))?;
    Metadata::parse(&text).map_err(|error| unusable(&error))
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
