//! Failures of a submission on a scene.

use sandbox::NotKept;
use scene::trace::{TraceError, TraceFault};

use super::run::{RunEnd, RunFailure};
use super::{Place, number};
use crate::boundary::printed::{self, Untrusted};
use crate::suite::NoTrace;

/// How a submission failed on a scene. The form of a trace is judged before its numbers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Failure {
    /// The files of the submission cannot be read, are too many or too large, or are not what is graded.
    #[error("{}", reason.text())]
    BadHandIn {
        /// Which, and why.
        reason: Untrusted,
    },
    /// The program lacks a feature of the scene.
    #[error("{0}")]
    NotImplemented(Lack),
    /// A folder of traces has none of this scene, or several.
    #[error("{}", printed::text(&no_trace(.0)))]
    NoTrace(NoTrace),
    /// A trace cannot be opened.
    #[error("there is no trace: {}", reason.text())]
    Unreadable {
        /// Why.
        reason: Untrusted,
    },
    /// A run of the program failed.
    #[error("{0}")]
    Run(RunFailure),
    /// A simulator that runs without a sandbox gave up.
    #[error("{}", reason.text())]
    GaveUp {
        /// Why.
        reason: Untrusted,
    },
    /// The program reads the simplest scene under neither calling convention.
    #[error("{0}")]
    NotGreeted(Box<NotGreeted>),
    /// The scene was not run, after failures on other scenes.
    #[error("not run: {0}")]
    Skipped(Skipped),
    /// The build failed, so that there is no program.
    #[error("{0}")]
    BuildFailed(BuildFailure),
    /// The trace is not in its format.
    #[error("{}{fault}", location_of(location.as_ref()))]
    Malformed {
        /// The file and the place in it, where the trace is a file.
        location: Option<String>,
        /// The fault.
        fault: FormFault,
    },
    /// The trace holds an infinity or a NaN.
    #[error("{}{value} in the trace: {place}", location_of(location.as_ref()))]
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
    /// The states agree up to the prediction horizon, but the motion beyond it is wrong.
    #[error("the states agree up to the prediction horizon, step {horizon}{drift}")]
    Drifts {
        /// The first state that is not compared.
        horizon: u64,
        /// The fault.
        drift: Drift,
    },
    /// The trace is right, but the program fails on altered copies of the scene.
    #[error(
        "the trace agrees with the oracle's, but the program fails on every altered copy of scenes with {}",
        printed::text(terms)
    )]
    FailsAltered {
        /// The terms that the program does not show, in words.
        terms: String,
    },
    /// A function gives something else than it must.
    #[error("{}", printed::text(detail))]
    WrongFunction {
        /// The mistake in words.
        detail: String,
    },
    /// The numbers are out of tolerance.
    #[error("the trace differs from the oracle's")]
    Differs,
}

impl Failure {
    /// The name of a hand-in whose files cannot be graded.
    pub const BAD_HAND_IN: &str = "bad-hand-in";

    /// Whether the first row of a trace has step 1. It is read on then.
    pub fn starts_at_one(&self) -> bool {
        matches!(
            self,
            Self::Malformed { fault: FormFault::Content(fault), .. } if fault.starts_at_one()
        )
    }

    /// Whether it is about the numbers of a trace, which findings explain.
    pub fn has_numbers(&self) -> bool {
        matches!(self, Self::Differs | Self::Drifts { .. } | Self::FailsAltered { .. })
    }

    /// The stable machine-readable name, in lower case.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BadHandIn { .. } => Self::BAD_HAND_IN,
            Self::NotImplemented(_) => "not-implemented",
            Self::NoTrace(NoTrace::Missing { .. }) => "missing",
            Self::NoTrace(NoTrace::Several { .. }) | Self::Unreadable { .. } => "no-output",
            Self::Run(RunFailure { end, .. }) => end.name(),
            Self::GaveUp { .. } | Self::Skipped(Skipped::Crashes { .. }) => "crashed",
            Self::Skipped(Skipped::TimeOuts { .. } | Skipped::Features { .. }) => "timed-out",
            Self::NotGreeted(failures) => failures.telling().name(),
            Self::BuildFailed(_) => "build-failed",
            Self::Malformed { .. } => "malformed",
            Self::NotFinite { .. } => "not-finite",
            Self::TooShort { .. } => "too-short",
            Self::TooLong { .. } => "too-long",
            Self::Drifts { .. } => "drifts",
            Self::FailsAltered { .. } => "fails-altered",
            Self::WrongFunction { .. } => "wrong-function",
            Self::Differs => "differs",
        }
    }

    /// Whether a run took too long.
    pub fn is_timeout(&self) -> bool {
        let timed_out =
            |run: &RunFailure| matches!(run.end, RunEnd::Processor(_) | RunEnd::Wall(_));
        matches!(self, Self::Run(run) if timed_out(run))
    }

    /// Whether the simulator ended with an error.
    pub fn is_crash(&self) -> bool {
        let crashed = |run: &RunFailure| {
            matches!(run.end, RunEnd::Exited(_) | RunEnd::Killed(_) | RunEnd::NotStarted { .. })
        };
        matches!(self, Self::GaveUp { .. }) || matches!(self, Self::Run(run) if crashed(run))
    }

    /// Whether the simulator ended well, but left no trace that can be read.
    pub(crate) fn is_without_trace(&self) -> bool {
        let left_none = |run: &RunFailure| matches!(&run.end, RunEnd::NoTrace { reason, .. } if !matches!(reason, NotKept::TooLarge(_)));
        matches!(self, Self::Unreadable { .. }) || matches!(self, Self::Run(run) if left_none(run))
    }

    /// Whether a program may have failed so because it lacks an integrator.
    pub(crate) fn may_lack_a_method(&self) -> bool {
        self.is_crash() || self.is_without_trace() || matches!(self, Self::Malformed { .. })
    }

    /// The same kind of failure of a trace file.
    pub(crate) fn of_trace(error: TraceError) -> Self {
        match error {
            TraceError::Unreadable { .. } => Self::Unreadable { reason: error.to_string().into() },
            TraceError::Line { path, line, fault } => Self::Malformed {
                location: Some(format!("{}:{line}", path.display())),
                fault: FormFault::Content(fault),
            },
            TraceError::Record { path, record, fault } => Self::Malformed {
                location: Some(format!("{}: record {record}", path.display())),
                fault: FormFault::Content(fault),
            },
        }
    }

    /// A trace that is malformed as a whole.
    pub(crate) fn malformed(fault: FormFault) -> Self {
        Self::Malformed { location: None, fault }
    }
}

impl From<RunFailure> for Failure {
    fn from(failure: RunFailure) -> Self {
        Self::Run(failure)
    }
}

/// `location` as a prefix of a message.
fn location_of(location: Option<&String>) -> String {
    location.map(|location| format!("{}: ", printed::text(location))).unwrap_or_default()
}

fn no_trace(found: &NoTrace) -> String {
    match found {
        NoTrace::Missing { .. } => format!("there is no trace: {found}"),
        NoTrace::Several { .. } => format!("ambiguous trace: {found}"),
    }
}

/// How a missing feature shows.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Lack {
    /// The program refuses the scene.
    #[error("the program does not offer {}: {failure}", name.as_deref().unwrap_or("this scene"))]
    Refused {
        /// The integrator, force or format that it names; `None` if it names none.
        name: Option<String>,
        /// How it failed.
        failure: RunFailure,
    },
    /// The trace is that of the scene without the feature.
    #[error("{}", printed::text(words))]
    LeftOut {
        /// The feature, in words.
        words: String,
    },
}

/// The failures of a program under both calling conventions.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "no readable trace of a single free particle\n  called as `{} -s scene.xml -d 0 -o trace.bin`: {fosssim}\n  called as \
     `{0} scene.xml -o trace.csv`: {plain}",
    printed::text(program)
)]
pub struct NotGreeted {
    /// The program's name.
    pub program: String,
    /// Its failure under the convention of FOSSSim.
    pub fosssim: Failure,
    /// Its failure under the plain convention.
    pub plain: Failure,
}

impl NotGreeted {
    /// The more telling failure. A crash or a missing trace is the usual reaction to an unknown convention; but a signal
    /// does not end a program that merely does not know its arguments.
    pub fn telling(&self) -> &Failure {
        let gives_up = |failure: &Failure| failure.is_crash() || failure.is_without_trace();
        let is_killed = matches!(&self.plain, Failure::Run(run) if run.end.signal().is_some());
        let says_more = is_killed || !gives_up(&self.plain);
        if gives_up(&self.fosssim) && says_more { &self.plain } else { &self.fosssim }
    }
}

/// Why a scene was not run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Skipped {
    /// Scenes of its feature timed out before.
    #[error("{count} time-outs before in this feature")]
    TimeOuts {
        /// Their number.
        count: usize,
    },
    /// Scenes of its feature crashed alike before.
    #[error("{count} crashes with the same message before: {last}")]
    Crashes {
        /// Their number.
        count: usize,
        /// The last of them.
        last: Box<Failure>,
    },
    /// The first scenes of other features all timed out.
    #[error("the first scenes of {count} features all timed out")]
    Features {
        /// Their number.
        count: usize,
    },
}

/// How a build failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BuildFailure {
    /// Its run failed.
    #[error("the build {0}")]
    Run(RunFailure),
    /// The folder that it left cannot be used.
    #[error("the built folder {0}")]
    NotKept(NotKept),
}

/// A fault in the form of a trace.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FormFault {
    /// A line or a record is wrong.
    #[error("{}", printed::text(&.0.to_string()))]
    Content(TraceFault),
    /// There is no state.
    #[error("the trace is empty")]
    Empty,
    /// The first state has none of the velocity components of the simplest scene.
    #[error("the first state of the trace has nothing of the velocity ({}, {})", .0[0], .0[1])]
    NoVelocity([f64; 2]),
    /// The first state is not the scene's.
    #[error("the trace does not start from the scene's state: particle {particle}")]
    Start {
        /// The first particle that differs.
        particle: usize,
    },
    /// A state has the wrong time.
    #[error("state {state} has the time {} instead of {}", number(*found), number(*expected))]
    Time {
        /// Its number.
        state: u64,
        /// Its time.
        found: f64,
        /// The time it should have.
        expected: f64,
    },
}

/// A motion that is wrong beyond the prediction horizon.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Drift {
    /// A step is wrong by itself.
    #[error(
        ", but a step is wrong by itself: {place} is {} after one step from the trace's own state {}, not {} (off by \
         {residual:.1e}; correct programs differ by up to {envelope:.1e}, tolerance {tolerance:.1e})",
        number(*expected), place.step - 1, number(*got)
    )]
    Step {
        /// The number.
        place: Place,
        /// Its value after a correct step.
        expected: f64,
        /// Its value in the trace.
        got: f64,
        /// The residual of the particle.
        residual: f64,
        /// Differences between correct programs.
        envelope: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// The energy or the momentum is wrong.
    #[error(
        "; at step {step} the {quantity} (correct programs differ by up to {envelope:.1e}, tolerance {tolerance:.1e})",
        quantity = conserved(*quantity, *difference)
    )]
    Conserved {
        /// Which.
        quantity: Conserved,
        /// The state.
        step: u64,
        /// The difference from the oracle's.
        difference: f64,
        /// Differences between correct programs.
        envelope: f64,
        /// The tolerance.
        tolerance: f64,
    },
}

/// A conserved quantity of a trace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Conserved {
    /// The energy.
    Energy {
        /// The oracle's.
        expected: f64,
        /// The trace's.
        got: f64,
    },
    /// The momentum.
    Momentum,
}

fn conserved(quantity: Conserved, difference: f64) -> String {
    match quantity {
        Conserved::Energy { expected, got } => {
            format!("energy is off by {difference:.1e}: {got:.6e} instead of {expected:.6e}")
        }
        Conserved::Momentum => format!("momentum is off by {difference:.1e}"),
    }
}
