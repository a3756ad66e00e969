//! `submission_metadata.json`: when a submission came in, its deadline, and the points of earlier ones.

use grader::time::Time;
use serde::{Deserialize, Deserializer};

/// The part of the metadata that points depend on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Metadata {
    /// When the submission came in.
    pub created_at: Time,
    /// Its assignment.
    pub assignment: AssignmentTimes,
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

/// An earlier submission.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Previous {
    /// Its points; `None` if it has none.
    #[serde(default, deserialize_with = "points")]
    pub score: Option<f64>,
}

impl Metadata {
    /// Reads the metadata.
    ///
    /// # Errors
    /// If the text is no such document.
    pub fn parse(text: &str) -> serde_json::Result<Self> {
        serde_json::from_str(text)
    }

    /// Seconds from the deadline to the submission; `None` without a deadline.
    pub fn seconds_late(&self) -> Option<f64> {
        self.assignment.due_date.map(|due| self.created_at.0 - due.0)
    }

    /// The most points of an earlier submission.
    pub fn best_before(&self) -> Option<f64> {
        let scores = self.previous_submissions.iter().filter_map(|previous| previous.score);
        scores.filter(|score| score.is_finite()).reduce(f64::max)
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
}
