//! Results for course platforms: written in any case, also if nothing was graded, because a platform shows nothing else.

use std::path::{Path, PathBuf};

use grader::boundary::door::Door;
use grader::boundary::printed::RawUse;
use grader::rubric::late::PlatformRule;
use platforms::github::classroom50;
use platforms::gradescope::metadata::Metadata;
use platforms::gradescope::results::{self, Results};
use platforms::gradescope::score::Score;
use platforms::prairielearn;

use crate::actions::Actions;
use crate::output::put;
use crate::reports::{ReportArg, Shown};
use crate::stop::{Exit, Stop, complain};

/// Message to students if the reason is not theirs.
const FAULT: &str = "Your submission was not graded: the autograder has a fault, which is not yours. Your instructor can \
                     see the reason, and run it again.";

/// The platforms that the results are for.
#[derive(Default)]
pub(super) struct Platforms {
    gradescope: Option<PathBuf>,
    prairielearn: Option<PathBuf>,
    classroom50: Option<PathBuf>,
    actions: Option<Actions>,
}

impl Platforms {
    /// The platforms that the command line names.
    ///
    /// # Errors
    /// If this is not the environment of one of them.
    pub(super) fn begin(reports: &[ReportArg]) -> Result<Self, Stop> {
        let mut platforms = Self::default();
        for report in reports {
            match report {
                ReportArg::Gradescope(file) => platforms.gradescope = Some(file.clone()),
                ReportArg::Prairielearn(file) => platforms.prairielearn = Some(file.clone()),
                ReportArg::Classroom50(file) => platforms.classroom50 = Some(file.clone()),
                ReportArg::Github => platforms.actions = Some(Actions::begin()?),
                ReportArg::Plain(..) | ReportArg::Html(_) => {}
            }
        }
        Ok(platforms)
    }

    /// Whether no platform's results are to be written.
    pub(super) fn is_empty(&self) -> bool {
        let files = [&self.gradescope, &self.prairielearn, &self.classroom50];
        files.iter().all(|file| file.is_none()) && self.actions.is_none()
    }

    /// Writes the results.
    pub(super) fn write(
        &self,
        shown: Shown<'_>,
        metadata: Option<&Metadata>,
        details: usize,
    ) -> Result<(), Stop> {
        let Shown { grading, times, rubric, .. } = shown;
        if let Some(file) = &self.gradescope {
            let score = Score::of(grading, (rubric.late(), rubric.platform()), metadata);
            let results = Results { grading, times, score, platform: rubric.platform() };
            put(results.render().map_err(Stop::fault)?.as_bytes(), Some(file))?;
        }
        if let Some(file) = &self.prairielearn {
            let results = prairielearn::results::render(grading).map_err(Stop::fault)?;
            put(results.as_bytes(), Some(file))?;
        }
        if let Some(file) = &self.classroom50 {
            let points = classroom50::render(grading).map_err(Stop::fault)?;
            put(points.as_bytes(), Some(file))?;
        }
        self.actions.as_ref().map_or(Ok(()), |actions| actions.end(grading, details))
    }

    /// Writes that a submission is over the limit, if it is, by the metadata of Gradescope.
    pub(super) fn refuses(
        &self,
        rule: PlatformRule,
        metadata: Option<&Metadata>,
    ) -> Result<bool, Stop> {
        let (Some(file), Some(metadata), Some(limit)) = (&self.gradescope, metadata, rule.limit)
        else {
            return Ok(false);
        };
        let Some(wait) = metadata.over(limit) else { return Ok(false) };
        let text = results::refused(limit, wait, Score::refused(rule, metadata));
        put(text.map_err(Stop::fault)?.as_bytes(), Some(file))?;
        Ok(true)
    }

    /// Writes results that say why nothing was graded. On Gradescope, students read whether time ran out, and only
    /// instructors any other reason; `kept` are the points that earlier submissions keep there.
    pub(super) fn write_not_graded(
        &self,
        Stop(exit, reason): &Stop,
        kept: impl FnOnce() -> Option<Score>,
    ) {
        let message = match exit {
            Exit::Interrupted => format!(
                "Your submission was not graded to the end, because grading took too long ({reason}). It has no \
                 points. If your program, or its build, is slow, make it faster; else tell your instructor."
            ),
            _ => FAULT.to_owned(),
        };
        let gradescope = self.gradescope.as_ref().map(|file| {
            let score = kept().unwrap_or_default();
            let text = results::not_graded(&message, reason, score).map_err(Stop::fault)?;
            put(text.as_bytes(), Some(file))
        });
        let prairielearn = self.prairielearn.as_ref().map(|file| {
            let text = prairielearn::results::not_gradable(&message, "").map_err(Stop::fault)?;
            put(text.as_bytes(), Some(file))
        });
        let actions = self.actions.as_ref().map(|actions| actions.end_not_graded(reason));
        for written in [gradescope, prairielearn, actions].into_iter().flatten() {
            if let Err(Stop(_, error)) = written {
                complain("error", error);
            }
        }
    }
}

/// Reads the metadata of a submission.
pub(super) fn read_metadata(path: &Path) -> Result<Metadata, Stop> {
    let read = || {
        let text = Door::Metadata.text(path).map_err(|error| error.to_string())?;
        Metadata::parse(text.raw(RawUse::Parsing)).map_err(|error| error.to_string())
    };
    read().map_err(|error| {
        Stop::about(path)(format!("the metadata of the submission cannot be used: {error}"))
    })
}
