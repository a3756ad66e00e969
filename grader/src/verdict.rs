//! Verdict on one scene: a pass, or one named failure.

use std::fmt;

use crate::boundary::printed::{self, Untrusted};

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
        matches!(self, Self::Fail(Failure::NotImplemented { .. }))
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

/// How a submission failed on a scene. The form of a trace is judged before its numbers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Failure {
    /// The files of the submission cannot be read, or are too many or too large.
    #[error("{}", detail.text())]
    BadHandIn {
        /// Which, and why.
        detail: Untrusted,
    },
    /// The program lacks a feature of the scene: it says so, or its trace is what follows without it.
    #[error("{}", detail.text())]
    NotImplemented {
        /// What the program said, or what is left out.
        detail: Untrusted,
        /// The integrator, force or format that the program named; `None` if it named none.
        lacks: Option<String>,
    },
    /// A folder of traces has none of this scene.
    #[error("{}", detail.text())]
    Missing {
        /// The expected path.
        detail: Untrusted,
    },
    /// The trace is missing, or there are several.
    #[error("{}", detail.text())]
    NoOutput {
        /// The expected path, or the paths.
        detail: Untrusted,
    },
    /// The simulator failed.
    #[error("{}", detail.text())]
    Crashed {
        /// The exit status or signal, and the program's output.
        detail: Untrusted,
    },
    /// The build failed, so that there is no program.
    #[error("{}", detail.text())]
    BuildFailed {
        /// The exit status or signal, and the build's output.
        detail: Untrusted,
    },
    /// A program exceeded its time limit.
    #[error("{}", detail.text())]
    TimedOut {
        /// The limit.
        detail: Untrusted,
    },
    /// The hand-in used its budget of time before this scene.
    #[error("{}", detail.text())]
    NotRun {
        /// The budget.
        detail: Untrusted,
    },
    /// A program exceeded its memory limit.
    #[error("{}", detail.text())]
    OutOfMemory {
        /// The limit.
        detail: Untrusted,
    },
    /// A program exceeded an output limit.
    #[error("{}", detail.text())]
    TooMuchOutput {
        /// The output and its limit.
        detail: Untrusted,
    },
    /// A program exceeded its limit of processes.
    #[error("{}", detail.text())]
    TooManyProcesses {
        /// The limit.
        detail: Untrusted,
    },
    /// The trace is not in its format.
    #[error("{}", detail.text())]
    Malformed {
        /// The place and the fault.
        detail: Untrusted,
    },
    /// The trace holds an infinity or a NaN.
    #[error("{}{value} in the trace: {place}", printed::text(&prefix(location.as_ref())))]
    NotFinite {
        /// The file and the place in it, where the trace is a file.
        location: Option<String>,
        /// The number's place.
        place: Place,
        /// The number.
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
    /// The trace continues after the last state.
    #[error("the trace has more than {expected} states")]
    TooLong {
        /// States it should hold.
        expected: u64,
    },
    /// The states agree up to the prediction horizon, but a step is wrong by itself, or the energy or the momentum beyond it.
    #[error("{}", detail.text())]
    Drifts {
        /// The step and the error.
        detail: Untrusted,
    },
    /// The trace is right, but the program fails on altered copies of the scene.
    #[error("{}", printed::text(detail))]
    FailsAltered {
        /// What it does not show.
        detail: String,
    },
    /// The numbers are out of tolerance.
    #[error("the trace differs from the oracle's")]
    Differs,
}

impl Failure {
    /// Whether it is about the numbers of a trace, which findings explain.
    pub fn has_numbers(&self) -> bool {
        matches!(self, Self::Differs | Self::Drifts { .. } | Self::FailsAltered { .. })
    }

    /// The name of a hand-in whose files cannot be graded.
    pub const BAD_HAND_IN: &str = "bad-hand-in";

    /// The failure's name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BadHandIn { .. } => Self::BAD_HAND_IN,
            Self::NotImplemented { .. } => "not-implemented",
            Self::Missing { .. } => "missing",
            Self::NoOutput { .. } => "no-output",
            Self::Crashed { .. } => "crashed",
            Self::BuildFailed { .. } => "build-failed",
            Self::TimedOut { .. } => "timed-out",
            Self::NotRun { .. } => "not-run",
            Self::OutOfMemory { .. } => "out-of-memory",
            Self::TooMuchOutput { .. } => "too-much-output",
            Self::TooManyProcesses { .. } => "too-many-processes",
            Self::Malformed { .. } => "malformed",
            Self::NotFinite { .. } => "not-finite",
            Self::TooShort { .. } => "too-short",
            Self::TooLong { .. } => "too-long",
            Self::Drifts { .. } => "drifts",
            Self::FailsAltered { .. } => "fails-altered",
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

/// `location` as a prefix of a message.
pub(crate) fn prefix(location: Option<&String>) -> String {
    location.map(|location| format!("{location}: ")).unwrap_or_default()
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
    fn no_message_contains_terminal_control_or_invalid_xml() {
        let detail = || Untrusted::from("a\u{1b}[2J\u{fffe}\u{b}\nb");
        let expected = "a\u{fffd}[2J\u{fffd}\u{fffd}\nb";
        for failure in [
            Failure::BadHandIn { detail: detail() },
            Failure::NotImplemented { detail: detail(), lacks: None },
            Failure::Missing { detail: detail() },
            Failure::NoOutput { detail: detail() },
            Failure::Crashed { detail: detail() },
            Failure::BuildFailed { detail: detail() },
            Failure::TimedOut { detail: detail() },
            Failure::NotRun { detail: detail() },
            Failure::OutOfMemory { detail: detail() },
            Failure::TooMuchOutput { detail: detail() },
            Failure::TooManyProcesses { detail: detail() },
            Failure::Malformed { detail: detail() },
        ] {
            assert_eq!(failure.to_string(), expected, "{}", failure.name());
        }
        assert_eq!(
            Fault::NotRun { detail: detail().raw(printed::RawUse::Part).to_owned() }.to_string(),
            expected
        );
    }
}
