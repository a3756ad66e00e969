//! Points in time, as text with a date, a time and an offset from UTC.

use std::str::FromStr;

use jiff::Timestamp;
use serde::{Deserialize, Deserializer};

/// A point in time: seconds since 1970, in UTC.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Time(pub f64);

/// Text that is no point in time.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no time with date and offset, such as 2026-02-01T23:59:00-08:00")]
pub struct NoTime(String);

impl FromStr for Time {
    type Err = NoTime;

    fn from_str(text: &str) -> Result<Self, NoTime> {
        let timestamp: Timestamp = text.parse().map_err(|_| NoTime(text.to_owned()))?;
        Ok(Self(timestamp.as_duration().as_secs_f64()))
    }
}

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_with_their_offsets() {
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("1970-01-01 00:00:00Z", 0.0),
            ("1970-01-01T00:00:00.5+00:00", 0.5),
            ("2000-02-29T12:00:00+01:00", 951_822_000.0),
            ("2000-03-01T00:00:00Z", 951_868_800.0),
            ("2026-11-22T07:04:58.250000-08:00", 1_795_359_898.25),
            ("1969-12-31T23:59:59Z", -1.0),
        ] {
            assert_eq!(text.parse(), Ok(Time(seconds)), "{text}");
        }
        for text in ["2026-02-29T00:00:00Z", "2026-11-22", "2026-11-22T07:04:58", "yesterday", ""] {
            let error = text.parse::<Time>().unwrap_err().to_string();
            assert!(error.contains("is no time"), "{text}");
        }
    }
}
