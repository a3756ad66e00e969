//! Points in time, as text with a date, a time and an offset from UTC.

use std::str::FromStr;

use serde::{Deserialize, Deserializer};
use toml::value::{Datetime, Offset};

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
        let no_time = || NoTime(text.to_owned());
        let datetime: Datetime = text.parse().map_err(|_| no_time())?;
        let (Some(date), Some(time), Some(offset)) =
            (datetime.date, datetime.time, datetime.offset)
        else {
            return Err(no_time());
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

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Days from 1970-01-01 to a date of the Gregorian calendar, by whole years from March to February.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    year * 365 + leap_days + (153 * month + 2) / 5 + day - 719_469
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
        for text in ["2026-11-22", "2026-11-22T07:04:58", "yesterday", ""] {
            let error = text.parse::<Time>().unwrap_err().to_string();
            assert!(error.contains("is no time"), "{text}");
        }
    }
}
