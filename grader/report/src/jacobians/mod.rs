//! Reports of Jacobian checks, one file per format.

pub(super) mod json;
pub(super) mod junit;

pub mod text;

use grader::white_box::{Estimate, Verdict};

/// An error with its uncertainty, such as `2.1e-13 ± 8e-13`.
pub(super) fn measured(Estimate { value, uncertainty }: Estimate) -> String {
    let value = if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") };
    let uncertainty =
        if uncertainty == 0.0 { "0".to_owned() } else { format!("{uncertainty:.0e}") };
    format!("{value} ± {uncertainty}")
}

/// A verdict as text reports spell it.
pub(super) fn words(verdict: Verdict) -> String {
    match verdict {
        Verdict::Correct => "correct".to_owned(),
        Verdict::CorrectZero => "correct (zero)".to_owned(),
        Verdict::Wrong => "WRONG".to_owned(),
        Verdict::Inconclusive(reason) => {
            format!("inconclusive ({})", reason.name().replace('-', " "))
        }
        Verdict::NotApplicable => "not applicable".to_owned(),
    }
}

/// `x`, `y` or `z`.
pub(super) fn axis(number: usize) -> &'static str {
    ["x", "y", "z"][number]
}
