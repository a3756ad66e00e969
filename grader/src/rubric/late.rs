//! The rubric's rule for late submissions, and its rules for course platforms.
//!
//! ```text
//! days    = 0 if late by at most the grace period, else the days begun since the deadline
//! percent = min(days · penalty, cap)      of the points earned, taken off
//! remain  = earned · (1 − percent / 100)
//! ```
//!
//! Times come from the platform or the roster, never from the clock: grading again gives the same.

use std::num::NonZeroUsize;

use serde::Deserialize;

use super::bounded::bounded;

/// Seconds in a day.
const DAY: f64 = 86_400.0;

/// The rule for late submissions, `[late]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LateRule {
    /// Per cent of the points earned that are taken off for each day begun.
    pub penalty: Percent,
    /// The most per cent that are taken off.
    pub cap: Percent,
    /// Minutes after the deadline that do not count.
    pub grace: Minutes,
}

impl Default for LateRule {
    fn default() -> Self {
        Self { penalty: Percent(0.0), cap: Percent(100.0), grace: Minutes(0.0) }
    }
}

/// Points lost by late submissions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lateness {
    /// Days begun since the deadline.
    pub days: f64,
    /// Per cent of the points earned that are taken off.
    pub percent: f64,
}

impl Lateness {
    /// The points that remain of those earned.
    pub fn remaining(&self, earned: f64) -> f64 {
        earned * (1.0 - self.percent / 100.0)
    }
}

impl LateRule {
    /// Points lost by a submission so many seconds after its deadline; `None` if it was in time.
    pub fn lateness(&self, seconds: f64) -> Option<Lateness> {
        if seconds <= self.grace.0 * 60.0 {
            return None;
        }
        let days = (seconds / DAY).ceil();
        Some(Lateness { days, percent: (days * self.penalty.0).min(self.cap.0) })
    }
}

/// The rules for course platforms, `[platform]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlatformRule {
    /// Which submission of a student counts.
    pub keep: Keep,
    /// When students see the results of hidden scenes.
    pub hidden: Visibility,
    /// Whether the platform shows a leaderboard.
    pub leaderboard: bool,
    /// How many submissions of a student are graded, if not all.
    pub limit: Option<SubmissionLimit>,
}

/// So many submissions are graded in so many hours, `[platform.limit]`: counts of hidden scenes could be probed by many.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubmissionLimit {
    /// Submissions that are graded.
    pub submissions: NonZeroUsize,
    /// In any period of so many hours.
    pub hours: Hours,
}

bounded! {
    /// A time of more than nothing and at most a year, in hours.
    pub struct Hours, |value| value > 0.0 && value <= 8760.0,
    "hours are more than 0 and at most 8760 (a year), not {value}"
}

/// Which submission of a student counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// The last one.
    #[default]
    Last,
    /// The one with the most points, after what lateness takes off.
    Best,
}

/// When students see a result.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// At once.
    #[default]
    Visible,
    /// After the due date.
    AfterDueDate,
    /// When the grades are published.
    AfterPublished,
}

bounded! {
    /// A number from 0 to 100.
    pub struct Percent, |value| (0.0..=100.0).contains(&value),
    "per cent are from 0 to 100, not {value}"
}

bounded! {
    /// A time of at most a year, in minutes.
    pub struct Minutes, |value| (0.0..=525_600.0).contains(&value),
    "minutes are from 0 to 525600 (a year), not {value}"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_days_count_from_the_deadline_after_grace() {
        let rule = LateRule { penalty: Percent(20.0), cap: Percent(50.0), grace: Minutes(15.0) };
        let percent = |seconds| rule.lateness(seconds).map(|late| (late.days, late.percent));
        assert_eq!(percent(-1.0), None);
        assert_eq!(percent(0.0), None);
        assert_eq!(percent(900.0), None);
        assert_eq!(percent(901.0), Some((1.0, 20.0)));
        assert_eq!(percent(DAY), Some((1.0, 20.0)));
        assert_eq!(percent(DAY + 1.0), Some((2.0, 40.0)));
        assert_eq!(percent(2.5 * DAY), Some((3.0, 50.0)));
        assert_eq!(LateRule::default().lateness(1.0), Some(Lateness { days: 1.0, percent: 0.0 }));
    }
}
