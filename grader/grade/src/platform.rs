//! Results for course platforms: written in any case, also if nothing was graded, because a platform shows nothing else.

use std::path::{Path, PathBuf};

use grader::boundary::door::Door;
use grader::boundary::printed::RawUse;
use platforms::gradescope::metadata::Metadata;
use platforms::gradescope::results::{self, Results};
use platforms::gradescope::score::Score;
use platforms::prairielearn;

use crate::actions::Actions;
use crate::args::{GradeArgs, ReportArg, ReportKind};
use crate::output::put;
use crate::reports::Shown;
use crate::stop::{Exit, Stop, complain};

/// What students read if the reason is not theirs.
const FAULT: &str = "Your submission was not graded: the autograder has a fault, which is not yours. Your instructor can \
                     see the reason, and run it again.";

/// The platforms that the results are for.
pub(super) struct Platforms {
    gradescope: Option<PathBuf>,
    prairielearn: Option<PathBuf>,
    actions: Option<Actions>,
}

impl Platforms {
    /// The platforms that the command line names.
    ///
    /// # Errors
    /// If this is not the environment of one of them.
    pub(super) fn begin(args: &GradeArgs) -> Result<Self, Stop> {
        let reports = args.reports();
        let file = |kind| {
            let mut files = reports.iter().filter(|report| report.kind == kind);
            files.next().and_then(|ReportArg { file, .. }| file.clone())
        };
        let (gradescope, prairielearn) =
            (file(ReportKind::Gradescope), file(ReportKind::Prairielearn));
        let is_step = reports.iter().any(|report| report.kind == ReportKind::Github);
        let actions = is_step.then(Actions::begin).transpose()?;
        Ok(Self { gradescope, prairielearn, actions })
    }

    /// Whether no platform's results are to be written.
    pub(super) fn is_empty(&self) -> bool {
        self.gradescope.is_none() && self.prairielearn.is_none() && self.actions.is_none()
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
        self.actions.as_ref().map_or(Ok(()), |actions| actions.end(grading, times, details))
    }

    /// Writes results that say why nothing was graded. On Gradescope, students read whether time ran out, and only
    /// instructors any other reason; an earlier submission counts as the rubric says, if that can be read.
    pub(super) fn write_not_graded(&self, Stop(exit, reason): &Stop, args: &GradeArgs) {
        let message = match exit {
            Exit::Interrupted => format!(
                "Your submission was not graded to the end, because grading took too long ({reason}). It has no \
                 points. If your program, or its build, is slow, make it faster; else tell your instructor."
            ),
            _ => FAULT.to_owned(),
        };
        let gradescope = self.gradescope.as_ref().map(|file| {
            let score = score_of_earlier(args).unwrap_or_default();
            let text = results::not_graded(&message, reason, score).map_err(Stop::fault)?;
            put(text.as_bytes(), Some(file))
        });
        let prairielearn = self.prairielearn.as_ref().map(|file| {
            let text = prairielearn::results::not_gradable(&message).map_err(Stop::fault)?;
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

/// The points that a submission keeps that was not graded.
fn score_of_earlier(args: &GradeArgs) -> Option<Score> {
    let metadata = read_metadata(args.metadata.as_deref()?).ok()?;
    let inputs = args.suite.read_for(&args.judge.judging()).ok()?;
    Some(Score::not_graded(inputs.rubric.platform(), &metadata))
}

/// Reads the metadata of a submission.
pub(super) fn read_metadata(path: &Path) -> Result<Metadata, Stop> {
    let unusable = |error: &dyn std::fmt::Display| {
        let path = path.display();
        Stop::bad_input(format!("{path}: the metadata of the submission cannot be used: {error}"))
    };
    let text = Door::Metadata.text(path).map_err(|error| unusable(&error))?;
    Metadata::parse(text.raw(RawUse::Parsing)).map_err(|error| unusable(&error))
}
