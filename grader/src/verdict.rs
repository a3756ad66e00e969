//! What becomes of one scene: a pass, or one named failure.

use std::fmt;

use crate::printed;

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
    /// The verdict's name: stable, in lower case, fit for machines.
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

/// How a submission failed on a scene. What is wrong with a trace's form is judged before its numbers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Failure {
    /// The files of the submission cannot be read, or are too many or too large.
    #[error("{}", printed::text(detail))]
    BadHandIn {
        /// Which, and why.
        detail: String,
    },
    /// There is no trace, or no telling which of two it is.
    #[error("{}", printed::text(detail))]
    NoOutput {
        /// Where it was looked for.
        detail: String,
    },
    /// The simulator gave up.
    #[error("{}", printed::text(detail))]
    Crashed {
        /// What it said.
        detail: String,
    },
    /// There is no program, for its build failed.
    #[error("{}", printed::text(detail))]
    BuildFailed {
        /// What the build said.
        detail: String,
    },
    /// A program did not end in its time.
    #[error("{}", printed::text(detail))]
    TimedOut {
        /// What time it is.
        detail: String,
    },
    /// A program needs more memory than it may have.
    #[error("{}", printed::text(detail))]
    OutOfMemory {
        /// How much it may have.
        detail: String,
    },
    /// A program writes more than it may.
    #[error("{}", printed::text(detail))]
    TooMuchOutput {
        /// What, and how much it may be.
        detail: String,
    },
    /// A program starts more processes than it may have.
    #[error("{}", printed::text(detail))]
    TooManyProcesses {
        /// How many it may have.
        detail: String,
    },
    /// The trace is not in its format.
    #[error("{}", printed::text(detail))]
    Malformed {
        /// Where and how.
        detail: String,
    },
    /// The trace holds an infinity or a NaN.
    #[error("{}{value} in the trace: {place}", printed::text(&prefix(location.as_ref())))]
    NotFinite {
        /// The file and the place in it, where the trace is a file.
        location: Option<String>,
        /// Where.
        place: Place,
        /// What stands there.
        value: f64,
    },
    /// The trace ends early.
    #[error("the trace ends after {states} of {expected} states")]
    TooShort {
        /// States it holds.
        states: u64,
        /// States it should hold.
        expected: u64,
    },
    /// The trace goes on after the last state.
    #[error("the trace goes on after its last state, number {expected}")]
    TooLong {
        /// States it should hold.
        expected: u64,
    },
    /// The states agree as long as they can be predicted, and the energy or the momentum is wrong beyond.
    #[error("{}", printed::text(detail))]
    Drifts {
        /// Where, and by how much.
        detail: String,
    },
    /// The numbers are out of tolerance.
    #[error("the trace differs from the oracle's")]
    Differs,
}

impl Failure {
    /// The failure's name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BadHandIn { .. } => "bad-hand-in",
            Self::NoOutput { .. } => "no-output",
            Self::Crashed { .. } => "crashed",
            Self::BuildFailed { .. } => "build-failed",
            Self::TimedOut { .. } => "timed-out",
            Self::OutOfMemory { .. } => "out-of-memory",
            Self::TooMuchOutput { .. } => "too-much-output",
            Self::TooManyProcesses { .. } => "too-many-processes",
            Self::Malformed { .. } => "malformed",
            Self::NotFinite { .. } => "not-finite",
            Self::TooShort { .. } => "too-short",
            Self::TooLong { .. } => "too-long",
            Self::Drifts { .. } => "drifts",
            Self::Differs => "differs",
        }
    }
}

/// Why a scene could not be judged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// There is no oracle trace.
    #[error("there is no oracle trace {trace}; make it with `grade oracle regenerate`")]
    NoOracle {
        /// Where it was looked for.
        trace: String,
    },
    /// The oracle's trace is of another version of the scene.
    #[error(
        "the scene was edited after its oracle trace was made; review it and run `grade oracle regenerate`"
    )]
    StaleOracle,
    /// The oracle's trace was edited after it was made.
    #[error(
        "the oracle trace {trace} is not the one its manifest records; restore it or run `grade oracle regenerate`"
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
    /// The program could not be run, through no fault of its own.
    #[error("{}", printed::text(detail))]
    NotRun {
        /// Why.
        detail: String,
    },
    /// The grader broke off.
    #[error(
        "the grader broke off, which is a defect of grade; please report it: {}",
        printed::text(detail)
    )]
    Internal {
        /// What it said.
        detail: String,
    },
}

/// `location` in front of a message.
pub(crate) fn prefix(location: Option<&String>) -> String {
    location.map(|location| format!("{location}: ")).unwrap_or_default()
}

/// A number in as few characters as tell it apart from any other: 1e308 has no 309 digits.
pub fn number(value: f64) -> String {
    // The other notation of Rust has every digit.
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

/// What of a particle.
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
    /// The coordinate as a trace's header calls it, without the particle: `x`, `vy`, ….
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
    use super::*;

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
    fn no_message_holds_what_a_terminal_or_xml_would_not_take() {
        let detail = || "a\u{1b}[2J\u{fffe}\u{b}\nb".to_owned();
        let expected = "a\u{fffd}[2J\u{fffd}\u{fffd}\nb";
        for failure in [
            Failure::BadHandIn { detail: detail() },
            Failure::NoOutput { detail: detail() },
            Failure::Crashed { detail: detail() },
            Failure::BuildFailed { detail: detail() },
            Failure::TimedOut { detail: detail() },
            Failure::OutOfMemory { detail: detail() },
            Failure::TooMuchOutput { detail: detail() },
            Failure::TooManyProcesses { detail: detail() },
            Failure::Malformed { detail: detail() },
        ] {
            assert_eq!(failure.to_string(), expected, "{}", failure.name());
        }
        assert_eq!(Fault::NotRun { detail: detail() }.to_string(), expected);
    }
}
