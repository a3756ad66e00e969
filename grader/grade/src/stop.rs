//! How a run of `grade` ends, and what it says on the standard error.

use std::io::Write;

/// How a run of `grade` ends.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Exit {
    /// All passed.
    Passed = 0,
    /// Something failed.
    Failed = 1,
    /// Bad usage or input.
    BadInput = 2,
    /// The grader itself is at fault.
    GraderFault = 3,
    /// Ended early by a signal: 128 + SIGINT, as shells have it.
    Interrupted = 130,
}

/// A message for the user, and the exit code that goes with it.
pub(super) struct Stop(pub(super) Exit, pub(super) String);

impl Stop {
    pub(super) fn bad_input(error: impl std::fmt::Display) -> Self {
        Self(Exit::BadInput, error.to_string())
    }

    pub(super) fn fault(error: impl std::fmt::Display) -> Self {
        Self(Exit::GraderFault, error.to_string())
    }
}

/// Says something to whoever started `grade`.
pub(super) fn complain(kind: &str, message: impl std::fmt::Display) {
    let _ = writeln!(anstream::stderr(), "{kind}: {message}");
}
