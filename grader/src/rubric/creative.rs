//! Credit for creative scenes, from the judges' marks.
//!
//! ```text
//! credit = cap / 100 · required points · mean of all marks / maximum
//! ```
//!
//! The mean is over the criteria and over the judges. The credit is extra: it is at most the cap, and a scene without
//! marks has none.

use serde::Deserialize;

use super::bounded::bounded;
use crate::boundary::printed;
use crate::rubric::late::Percent;
use crate::verdict::number;

/// A criterion of the hand-outs.
#[derive(Debug, Clone, Copy)]
pub struct Criterion {
    /// Its column in the sheet for marks.
    pub column: &'static str,
    /// The requirement.
    pub meaning: &'static str,
}

/// The criteria (section "Creative Scene").
pub const CRITERIA: [Criterion; 3] = [
    Criterion {
        column: "ingredients",
        meaning: "How well the scene shows off the milestone's magic ingredients",
    },
    Criterion {
        column: "aesthetics",
        meaning: "Aesthetic considerations: the more beautiful, the better",
    },
    Criterion { column: "originality", meaning: "Originality" },
];

/// The rubric's rule for creative scenes, `[creative]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CreativeRule {
    /// Credit for the best marks, in per cent of the required points.
    pub cap: Percent,
    /// Best mark of a criterion.
    pub maximum: MaximumMark,
}

impl Default for CreativeRule {
    fn default() -> Self {
        Self { cap: Percent(15.0), maximum: MaximumMark(10.0) }
    }
}

bounded! {
    /// A best mark: above 0.
    pub struct MaximumMark, |value| value > 0.0 && value <= 1e6,
    "a maximum mark is above 0 and at most 1e6, not {}", number(value)
}

impl CreativeRule {
    /// A mark in a cell; `None` if it is empty.
    ///
    /// # Errors
    /// If it is no number, or not from 0 to the maximum.
    pub fn mark(&self, cell: &str) -> Result<Option<f64>, String> {
        if cell.is_empty() {
            return Ok(None);
        }
        let mark: Option<f64> = cell.parse().ok().filter(|mark: &f64| mark.is_finite());
        let no_number = || {
            let cell = printed::line(cell);
            format!(
                "{cell:?} is no number\n  help: write it as in 7.5; leave the cell empty for no mark"
            )
        };
        let mark = mark.ok_or_else(no_number)?;
        let MaximumMark(maximum) = self.maximum;
        let out_of_range = || {
            format!(
                "marks are from 0 to {maximum}, not {}\n  help: correct it, or set `maximum` in [creative] of the rubric",
                number(mark)
            )
        };
        (0.0..=maximum).contains(&mark).then_some(Some(mark)).ok_or_else(out_of_range)
    }

    /// The credit for some marks, of an assignment with so many required points.
    pub fn credit(&self, marks: &[[f64; CRITERIA.len()]], required: f64) -> CreativeCredit {
        CreativeCredit {
            marks: marks.to_vec(),
            maximum: self.maximum.0,
            points: self.cap.0 / 100.0 * required,
        }
    }
}

/// Credit for a creative scene.
#[derive(Debug, Clone, PartialEq)]
pub struct CreativeCredit {
    /// Marks by criterion, of one judge each; empty if it has no mark.
    pub marks: Vec<[f64; CRITERIA.len()]>,
    /// Best mark of a criterion.
    pub maximum: f64,
    /// Points for the best marks.
    pub points: f64,
}

impl CreativeCredit {
    /// The mean mark of each criterion; `None` if there is no mark.
    pub fn means(&self) -> Option<[f64; CRITERIA.len()]> {
        let judges = self.marks.len() as f64;
        let mean = |place: usize| self.marks.iter().map(|marks| marks[place]).sum::<f64>() / judges;
        (!self.marks.is_empty()).then(|| [0, 1, 2].map(mean))
    }

    /// The points earned; `None` if there is no mark.
    pub fn earned(&self) -> Option<f64> {
        let mean = self.means()?.iter().sum::<f64>() / CRITERIA.len() as f64;
        // Of a rubric whose maximum is lower now, marks may be above it.
        Some((self.points * mean / self.maximum).min(self.points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn best_marks_earn_the_cap_and_no_marks_earn_zero() {
        let rule = CreativeRule::default();
        let earned = |marks: &[[f64; 3]]| rule.credit(marks, 40.0).earned();
        assert_eq!(earned(&[[10.0; 3]]), Some(6.0));
        assert_eq!(earned(&[[10.0, 5.0, 0.0]]), Some(3.0));
        assert_eq!(earned(&[[10.0; 3], [0.0; 3]]), Some(3.0));
        assert_eq!(earned(&[[0.0; 3]]), Some(0.0));
        assert_eq!(earned(&[]), None);
        let stricter = CreativeRule { maximum: MaximumMark(5.0), ..rule };
        assert_eq!(stricter.credit(&[[10.0; 3]], 40.0).earned(), Some(6.0));
    }
}
