//! `submission_metadata.json`: when a submission came in, its deadline, and the points of earlier ones.

use serde::{Deserialize, Deserializer};
use toml::value::{Datetime, Offset};

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

/// A point in time: seconds since 1970, in UTC.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Time(pub f64);

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

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let invalid = || {
            serde::de::Error::custom(format!(
                "{text:?} is no time with date and offset, such as 2026-02-01T23:59:00-08:00"
            ))
        };
        let datetime: Datetime = text.parse().map_err(|_| invalid())?;
        let (Some(date), Some(time), Some(offset)) =
            (datetime.date, datetime.time, datetime.offset)
        else {
            return Err(invalid());
        };
        let minutes = match offset {
            Offset::Z => 0,
            Offset::Custom { minutes } => i64::from(minutes),
        };
        let days = days_since_1970(date.year.into(), date.month.into(), date.day.into());
        let minute = days * 1440 + i64::from(time.hour) * 60 + i64::from(time.minute) - minutes;
        let second = f64::from(time.second.unwrap_or(0));
        let fraction = f64::from(time.nanosecond.unwrap_or(0)) * 1e-9;
        Ok(Self(minute as f64 * 60.0 + second + fraction))
    }
}

/// Days from 1970-01-01 to a date of the Gregorian calendar, by whole years from March to February.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    year * 365 + leap_days + (153 * month + 2) / 5 + day - 719_469
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

    fn time(text: &str) -> Result<f64, String> {
        let parsed: serde_json::Result<Time> = serde_json::from_str(&format!("{text:?}"));
        parsed.map(|time| time.0).map_err(|error| error.to_string())
    }

    #[test]
    fn times_are_read_with_their_offsets() {
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("1970-01-01T00:00:00.5+00:00", 0.5),
            ("2000-02-29T12:00:00+01:00", 951_822_000.0),
            ("2000-03-01T00:00:00Z", 951_868_800.0),
            ("2026-11-22T07:04:58.250000-08:00", 1_795_359_898.25),
            ("1969-12-31T23:59:59Z", -1.0),
        ] {
            assert_eq!(time(text), Ok(seconds), "{text}");
        }
        for text in ["2026-11-22", "2026-11-22T07:04:58", "yesterday", ""] {
            assert!(time(text).unwrap_err().contains("is no time"), "{text}");
        }
    }

    #[test]
    fn what_is_missing_is_no_deadline_and_no_points() {
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
