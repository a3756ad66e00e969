//! `submission_metadata.json`: when a submission came in, its deadline, and the points of earlier ones.

use grader::rubric::late::SubmissionLimit;
use grader::time::Time;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

/// The part of the metadata that points depend on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Metadata {
    /// When the submission came in.
    pub created_at: Time,
    /// Its assignment.
    pub assignment: AssignmentTimes,
    /// The students whose submission it is.
    #[serde(default)]
    pub users: Vec<User>,
    /// Earlier submissions of the same students.
    #[serde(default)]
    pub previous_submissions: Vec<Previous>,
}

/// The times of an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct AssignmentTimes {
    /// The deadline, if there is one.
    pub due_date: Option<Time>,
}

/// A student.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct User {
    /// The times of a student with an extension.
    #[serde(default)]
    pub assignment: Option<AssignmentTimes>,
}

/// An earlier submission.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Previous {
    /// When it came in.
    #[serde(default)]
    pub submission_time: Option<Time>,
    /// Its points; `None` if it has none.
    #[serde(default, deserialize_with = "points")]
    pub score: Option<f64>,
    /// Its results.
    #[serde(default)]
    pub results: Value,
}

impl Previous {
    /// Whether it was over the limit, and not graded.
    fn is_refused(&self) -> bool {
        self.results["extra_data"][REFUSED] == true
    }
}

/// Mark of a submission over the limit, in the data stored with its results.
pub(super) const REFUSED: &str = "refused";

impl Metadata {
    /// Reads the metadata.
    ///
    /// # Errors
    /// If the text is no such document.
    pub fn parse(text: &str) -> serde_json::Result<Self> {
        serde_json::from_str(text)
    }

    /// The deadline: of the students of a group, the latest that applies to one of them.
    fn due(&self) -> Option<Time> {
        let general = self.assignment.due_date;
        let own = self.users.iter().map(|user| user.assignment.and_then(|own| own.due_date));
        let dates = own.map(|own| own.or(general)).reduce(|a, b| Some(Time(a?.0.max(b?.0))));
        dates.unwrap_or(general)
    }

    /// Seconds from the deadline to the submission; `None` without a deadline.
    pub fn seconds_late(&self) -> Option<f64> {
        self.due().map(|due| self.created_at.0 - due.0)
    }

    /// The most points of an earlier submission.
    pub fn best_before(&self) -> Option<f64> {
        let scores = self.previous_submissions.iter().filter_map(|previous| previous.score);
        scores.filter(|score| score.is_finite()).reduce(f64::max)
    }

    /// The points of the latest earlier submission that was graded.
    pub fn last_before(&self) -> Option<f64> {
        let graded = self.previous_submissions.iter().filter(|previous| !previous.is_refused());
        let time = |previous: &Previous| previous.submission_time.map_or(f64::MIN, |time| time.0);
        let last = graded.max_by(|a, b| time(a).total_cmp(&time(b)))?;
        last.score.filter(|score| score.is_finite())
    }

    /// How long after this submission the next one is graded, in seconds, if this one is over the limit.
    pub fn over(&self, limit: SubmissionLimit) -> Option<f64> {
        let period = limit.hours.0 * 3600.0;
        let graded = self.previous_submissions.iter().filter(|previous| !previous.is_refused());
        let ages =
            graded.filter_map(|previous| Some(self.created_at.0 - previous.submission_time?.0));
        let mut recent: Vec<f64> = ages.filter(|age| (0.0..period).contains(age)).collect();
        recent.sort_by(f64::total_cmp);
        recent.get(limit.submissions.get() - 1).map(|age| period - age)
    }
}

/// Points as a number or as text.
fn points<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Points {
        Number(f64),
        Text(String),
        Nothing(()),
    }
    match Points::deserialize(deserializer)? {
        Points::Number(points) => Ok(Some(points)),
        Points::Text(text) => text.trim().parse().map(Some).map_err(serde::de::Error::custom),
        Points::Nothing(()) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_metadata_means_no_deadline_and_no_points() {
        let metadata = Metadata::parse(
            r#"{"created_at": "2026-01-02T00:00:00Z", "assignment": {"due_date": null},
                "previous_submissions": [{"score": "3.5"}, {"score": null}, {"score": 2}, {}]}"#,
        )
        .unwrap();
        assert_eq!((metadata.seconds_late(), metadata.best_before()), (None, Some(3.5)));
        let metadata = Metadata::parse(
            r#"{"created_at": "2026-01-02T00:00:00Z", "assignment": {"due_date": "2026-01-01T23:00:00Z"}}"#,
        )
        .unwrap();
        assert_eq!((metadata.seconds_late(), metadata.best_before()), (Some(3600.0), None));
    }

    #[test]
    fn latest_deadline_of_a_group_applies() {
        let late = |general: &str, users: &str| {
            let text = format!(
                r#"{{"created_at": "2026-01-03T00:00:00Z", "assignment": {{"due_date": {general}}}, "users": {users}}}"#
            );
            Metadata::parse(&text).unwrap().seconds_late().map(|seconds| seconds / 3600.0)
        };
        let (first, extended) = (r#""2026-01-01T00:00:00Z""#, r#""2026-01-02T12:00:00Z""#);
        let own = |date: &str| format!(r#"{{"id": 1, "assignment": {{"due_date": {date}}}}}"#);
        let plain = r#"{"id": 2, "assignment": null}"#;
        for (general, users, hours) in [
            (first, "[]".to_owned(), Some(48.0)),
            (first, format!("[{}]", own(extended)), Some(12.0)),
            (first, format!("[{plain}, {}]", own(extended)), Some(12.0)),
            (first, format!("[{}]", own("null")), Some(48.0)),
            (extended, format!("[{}]", own(first)), Some(48.0)),
            ("null", format!("[{}]", own(extended)), Some(12.0)),
            ("null", format!("[{plain}, {}]", own(extended)), None),
        ] {
            assert_eq!(late(general, &users), hours, "{general} {users}");
        }
    }

    #[test]
    fn limit_counts_graded_submissions_before_this_one() {
        let refused = r#", "results": {"extra_data": {"refused": true}}"#;
        let metadata = |hours: &[(f64, &str)]| {
            let previous = hours.iter().map(|(before, more)| {
                let minutes = 24 * 60 - (before * 60.0) as i64;
                let time = format!("2026-01-01T{:02}:{:02}:00Z", minutes / 60, minutes % 60);
                format!(r#"{{"submission_time": "{time}", "score": {before}{more}}}"#)
            });
            let previous = previous.collect::<Vec<_>>().join(", ");
            Metadata::parse(&format!(
                r#"{{"created_at": "2026-01-02T00:00:00Z", "assignment": {{"due_date": null}}, "previous_submissions": [{previous}]}}"#
            ))
            .unwrap()
        };
        let limit = SubmissionLimit {
            submissions: std::num::NonZeroUsize::new(2).unwrap(),
            hours: grader::rubric::late::Hours(6.0),
        };
        let over = |hours: &[(f64, &str)]| metadata(hours).over(limit).map(|wait| wait / 3600.0);
        assert_eq!(over(&[(1.0, ""), (6.0, "")]), None);
        assert_eq!(over(&[(1.0, ""), (5.5, "")]), Some(0.5));
        assert_eq!(over(&[(5.5, ""), (4.0, ""), (1.0, "")]), Some(2.0));
        assert_eq!(over(&[(5.5, ""), (4.0, refused), (1.0, refused)]), None);
        assert_eq!(metadata(&[(5.5, ""), (4.0, ""), (1.0, refused)]).last_before(), Some(4.0));
    }
}
