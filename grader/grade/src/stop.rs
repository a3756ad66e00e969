//! Exit codes, and messages on standard error.

use std::io::Write;
use std::path::Path;

use crate::terminal::terminal;

/// Exit code of `grade`.
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
    /// Interrupted by a signal: 128 + SIGINT, the convention of shells.
    Interrupted = 130,
}

impl Exit {
    /// Whether all passed.
    pub(super) fn of(passed: bool) -> Self {
        if passed { Self::Passed } else { Self::Failed }
    }
}

/// An exit code, and the message for the user.
pub(super) struct Stop(pub(super) Exit, pub(super) String);

impl Stop {
    pub(super) fn bad_input(error: impl std::fmt::Display) -> Self {
        Self(Exit::BadInput, error.to_string())
    }

    pub(super) fn fault(error: impl std::fmt::Display) -> Self {
        Self(Exit::GraderFault, error.to_string())
    }

    /// Makes an error about a file or folder of the user's.
    pub(super) fn about<E: std::fmt::Display>(path: &Path) -> impl Fn(E) -> Self {
        move |error| Self::bad_input(format!("{}: {error}", path.display()))
    }
}

/// Writes `kind: message` to standard error.
pub(super) fn complain(kind: &str, message: impl std::fmt::Display) {
    let mut out = terminal(anstream::stderr());
    let _ = writeln!(out, "{kind}: {message}").and_then(|()| out.flush());
}
