//! Errors in the options of a generator.

use std::fmt;

use super::{MAX_PAIRS, MAX_PARTICLES};
use scene::MAX_STEPS;
use scene::schema::{Domain, Refusal};

/// Invalid options of a generator.
///
/// Displays as the problem, and a second line `  help: remedy`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct GenerateError(#[from] pub GenerateErrorKind);

/// Kinds of errors in the options.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum GenerateErrorKind {
    #[error("{option} is {value}, and must be {must_be}")]
    OutOfDomain { option: &'static str, value: f64, must_be: &'static str },
    #[error("{option} is {value}, and must be from {least} to {most}")]
    Count { option: &'static str, value: u64, least: u64, most: u64 },
    #[error("this scene would have {particles} particles, and may have at most {MAX_PARTICLES}")]
    TooManyParticles { particles: u64 },
    #[error(
        "this scene would have {pairs} springs, elements or pairs, and may have at most {MAX_PAIRS}"
    )]
    TooManyPairs { pairs: u64 },
    #[error("duration {duration:?} s at a time step of {time_step:?} s is {steps:.1e} steps")]
    TooManySteps { duration: f64, time_step: f64, steps: f64 },
    #[error("{integrator} has no option {option:?}")]
    UnknownOption { integrator: &'static str, option: String },
    #[error("{integrator} takes no {option}={text:?}: it must be {must_be}")]
    OptionValue { integrator: &'static str, option: String, text: String, must_be: String },
    #[error("{integrator} cannot simulate these <{tag}>, because each {}", refusal.because)]
    Refused { integrator: &'static str, tag: &'static str, refusal: Refusal },
    #[error("springs of the law green have no damping")]
    NoDamping,
    #[error("the {what} of particle {particle} comes out as {value}")]
    Particle { what: &'static str, particle: usize, value: f64 },
    #[error("the rest length of a spring comes out as {value}")]
    RestLength { value: f64 },
    #[error("an element comes out flat")]
    Flat,
    #[error("{bodies} bodies {min_distance} apart do not fit within a radius of {radius}")]
    NoRoom { bodies: u64, min_distance: f64, radius: f64 },
}

impl fmt::Display for GenerateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let remedy = match &self.0 {
            GenerateErrorKind::OutOfDomain { .. }
            | GenerateErrorKind::Count { .. }
            | GenerateErrorKind::OptionValue { .. } => "choose another value",
            GenerateErrorKind::UnknownOption { .. } => "simulate --help lists the options of each",
            GenerateErrorKind::Refused { refusal, .. } => refusal.remedy,
            GenerateErrorKind::NoDamping => "set the damping to 0, or use the law hooke",
            GenerateErrorKind::TooManyParticles { .. } | GenerateErrorKind::TooManyPairs { .. } => {
                "make it smaller"
            }
            GenerateErrorKind::TooManySteps { .. } => {
                return write!(
                    f,
                    "{}\n  help: at most {MAX_STEPS:e} steps are simulated; shorten the duration or lengthen the step",
                    self.0
                );
            }
            GenerateErrorKind::Particle { .. }
            | GenerateErrorKind::RestLength { .. }
            | GenerateErrorKind::Flat => "choose lengths and masses of ordinary size",
            GenerateErrorKind::NoRoom { .. } => {
                "increase the radius, or reduce the minimum distance"
            }
        };
        write!(f, "{}\n  help: {remedy}", self.0)
    }
}

/// Checks that a value is in its domain.
pub(super) fn check(
    option: &'static str,
    value: f64,
    domain: Domain,
) -> Result<(), GenerateErrorKind> {
    if domain.contains(value) {
        return Ok(());
    }
    Err(GenerateErrorKind::OutOfDomain { option, value, must_be: domain.describe() })
}

/// Refuses a number of things outside of a range; returns it in a width that products do not leave.
pub(super) fn count(
    option: &'static str,
    value: u64,
    least: u64,
) -> Result<u64, GenerateErrorKind> {
    if (least..=MAX_PARTICLES).contains(&value) {
        return Ok(value);
    }
    Err(GenerateErrorKind::Count { option, value, least, most: MAX_PARTICLES })
}
