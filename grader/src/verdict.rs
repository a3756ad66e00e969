//! Verdict on one scene: a pass, or one named failure.

mod failure;
mod run;

use std::fmt;

use crate::boundary::printed;

pub use failure::{BuildFailure, Conserved, Drift, Failure, FormFault, Lack, NotGreeted, Skipped};
pub use run::{LastOutput, RunEnd, RunFailure};

/// The outcome of one scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The trace agrees with the oracle's.
    Pass,
    /// The submission is wrong.
    Fail(Failure),
    /// The scene could not be judged, through no fault of the submission. Its points are neither earned nor lost.
    GraderFault(Fault),
}

impl Verdict {
    /// Whether the submission lacks what the scene needs.
    pub fn is_lack(&self) -> bool {
        matches!(self, Self::Fail(Failure::NotImplemented(_)))
    }

    /// The stable machine-readable name, in lower case.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail(failure) => failure.name(),
            Self::GraderFault(_) => "grader-fault",
        }
    }

    /// Whether it is a pass.
    pub fn is_pass(&self) -> bool {
        *self == Self::Pass
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pass => write!(f, "agrees with the oracle"),
            Self::Fail(failure) => failure.fmt(f),
            Self::GraderFault(fault) => fault.fmt(f),
        }
    }
}

/// Why a scene could not be judged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// There is no oracle trace.
    #[error("there is no oracle trace {trace}; make it with `grade oracle regenerate`")]
    NoOracle {
        /// The path where it was expected.
        trace: String,
    },
    /// The oracle's trace was made from another version of the scene.
    #[error(
        "the scene was edited after its oracle trace was made; review it and run `grade oracle regenerate`"
    )]
    StaleOracle,
    /// The oracle's trace was edited after it was made.
    #[error(
        "the oracle trace {trace} does not match its manifest; restore it or run `grade oracle regenerate`"
    )]
    AlteredOracle {
        /// The trace.
        trace: String,
    },
    /// The oracle's trace cannot be used.
    #[error("the oracle trace cannot be used: {detail}")]
    BrokenOracle {
        /// Why.
        detail: String,
    },
    /// The program could not be run, through no fault of the submission.
    #[error("{}", printed::text(detail))]
    NotRun {
        /// Why.
        detail: String,
    },
    /// The grader panicked.
    #[error("internal error of grade, please report it: {}", printed::text(detail))]
    Internal {
        /// The panic message.
        detail: String,
    },
}

impl Fault {
    /// Whether the oracle's trace is the reason, which is the same for every submission.
    pub fn is_of_oracle(&self) -> bool {
        matches!(
            self,
            Self::NoOracle { .. }
                | Self::StaleOracle
                | Self::AlteredOracle { .. }
                | Self::BrokenOracle { .. }
        )
    }
}

/// A number in its shortest unambiguous notation: 1e308 is not written with 309 digits.
pub fn number(value: f64) -> String {
    // Rust's `Display` notation has all digits.
    let text = format!("{value:?}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// A number in a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Number of the state: 0 is the initial one.
    pub step: u64,
    /// Particle, from 0.
    pub particle: usize,
    /// Position or velocity.
    pub quantity: Quantity,
    /// Coordinate: 0 is x.
    pub axis: usize,
}

/// A quantity of a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Its position.
    Position,
    /// Its velocity.
    Velocity,
}

impl Quantity {
    /// "position" or "velocity".
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
        }
    }
}

impl Place {
    /// The coordinate's name in a trace's header, without the particle: `x`, `vy`, ….
    pub fn coordinate(&self) -> &'static str {
        match self.quantity {
            Quantity::Position => ["x", "y", "z"][self.axis],
            Quantity::Velocity => ["vx", "vy", "vz"][self.axis],
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "step {}, particle {}, {}", self.step, self.particle, self.coordinate())
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use scene::trace::TraceFault;

    use super::*;
    use crate::boundary::printed::Untrusted;
    use crate::suite::NoTrace;

    #[test]
    fn numbers_are_short_and_read_back_the_same() {
        for value in [0.0, -0.0, 1.0, 0.1, -1e308, f64::MIN_POSITIVE, 123_456_789.25, 1e16, 1e-7] {
            let text = number(value);
            assert!(text.len() < 25, "{text}");
            assert_eq!(text.parse(), Ok(value));
        }
        assert_eq!((number(2.0).as_str(), number(1e300).as_str()), ("2", "1e300"));
    }

    #[test]
    fn no_message_contains_terminal_control_or_invalid_xml() {
        let eve = || Untrusted::from("a\u{1b}[2J\u{fffe}\u{b}\nb");
        let text = || eve().raw(printed::RawUse::Part).to_owned();
        let run = || {
            let output = LastOutput { text: eve(), misses_file: false };
            RunFailure { end: RunEnd::Exited(1), output }
        };
        let path = PathBuf::from(text());
        let fault = TraceFault::NotANumber { column: "x0".to_owned(), text: text() };
        for failure in [
            Failure::BadHandIn { reason: eve() },
            Failure::NotImplemented(Lack::Refused { name: None, failure: run() }),
            Failure::NotImplemented(Lack::LeftOut { words: text() }),
            Failure::NoTrace(NoTrace::Missing { stem: path.clone(), other_case: Some(path) }),
            Failure::Unreadable { reason: eve() },
            run().into(),
            RunFailure {
                end: RunEnd::NotStarted { program: eve(), error: eve() },
                output: LastOutput::default(),
            }
            .into(),
            Failure::GaveUp { reason: eve() },
            Failure::NotGreeted(Box::new(NotGreeted {
                program: text(),
                fosssim: run().into(),
                plain: run().into(),
            })),
            Failure::Skipped(Skipped::Crashes { count: 3, last: Box::new(run().into()) }),
            Failure::BuildFailed(BuildFailure::Run(run())),
            Failure::Malformed { location: Some(text()), fault: FormFault::Content(fault) },
            Failure::FailsAltered { terms: text() },
        ] {
            let message = failure.to_string();
            assert!(!message.chars().any(|c| c != '\n' && printed::steers(c)), "{message:?}");
            assert!(
                message.contains("a\u{fffd}[2J\u{fffd}\u{fffd}\nb") || message.contains("\\u{1b}"),
                "{message:?}"
            );
        }
        assert_eq!(Fault::NotRun { detail: text() }.to_string(), eve().text());
    }
}
