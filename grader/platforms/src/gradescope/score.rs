//! The points that count for a submission, by the rubric.
//!
//! ```text
//! own     = what lateness leaves of required + extra credit
//! counted = max(own, points of earlier submissions)     with `keep = "best"`; else own
//! ```

use grader::grading::Grading;
use grader::grading::points;
use grader::rubric::late::{Keep, LateRule, Lateness, PlatformRule};
use grader::suite::Section;

use super::metadata::Metadata;

/// The points of a submission.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Score {
    /// Points earned, extra credit included.
    pub earned: f64,
    /// The deduction for lateness, if it is late.
    pub lateness: Option<Lateness>,
    /// The points of the submission, after the deduction for lateness.
    pub own: f64,
    /// The points that count.
    pub counted: f64,
}

impl Score {
    /// The points of a grading. Without metadata, nothing is late and there is no earlier submission.
    pub fn of(
        grading: &Grading,
        (late, platform): (LateRule, PlatformRule),
        metadata: Option<&Metadata>,
    ) -> Self {
        let sections = [Section::Required, Section::ExtraCredit];
        let credits = sections.map(|section| grading.totals(section).credit);
        // Where points are withheld, none are earned.
        let shown = credits.iter().filter_map(|credit| credit.shown(grading.faults));
        // A sum of nothing is -0, which platforms refuse as negative.
        let earned = shown.sum::<f64>() + 0.0;
        let seconds = metadata.and_then(Metadata::seconds_late);
        let lateness = seconds.and_then(|seconds| late.lateness(seconds));
        let own = lateness.map_or(earned, |lateness| lateness.remaining(earned));
        let counted = own.max(before(platform, metadata));
        Self { earned, lateness, own, counted }
    }

    /// The points of a submission that was not graded.
    pub fn not_graded(platform: PlatformRule, metadata: &Metadata) -> Self {
        Self { counted: before(platform, Some(metadata)), ..Self::default() }
    }

    /// The points of a submission over the limit: with `keep = "last"`, those of the one before it.
    pub fn refused(platform: PlatformRule, metadata: &Metadata) -> Self {
        let kept = match platform.keep {
            Keep::Best => metadata.best_before(),
            Keep::Last => metadata.last_before(),
        };
        Self { counted: kept.map_or(0.0, |kept| kept.max(0.0)), ..Self::default() }
    }

    /// The reasons for changes of the points, a sentence each.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if let Some(Lateness { days, percent }) = self.lateness {
            remarks.push(format!(
                "Late, on day {days} after the deadline: {} % of the points are taken off, {} of {} remain.",
                points::shown(percent),
                points::shown(self.own),
                points::shown(self.earned)
            ));
        }
        if self.counted > self.own {
            remarks.push(format!(
                "An earlier submission has {} points. The best submission counts.",
                points::shown(self.counted)
            ));
        }
        remarks
    }
}

/// The points of the best earlier submission, if that counts; else 0.
fn before(platform: PlatformRule, metadata: Option<&Metadata>) -> f64 {
    match platform.keep {
        Keep::Best => {
            metadata.and_then(Metadata::best_before).map_or(0.0, |before| before.max(0.0))
        }
        Keep::Last => 0.0,
    }
}
