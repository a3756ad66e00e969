//! Failed runs of programs.

use sandbox::NotKept;
use serde::{Deserialize, Serialize};

use crate::boundary::printed::Untrusted;

/// A failed run, and what the program printed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[error("{end}{output}")]
pub struct RunFailure {
    /// How it ended.
    pub end: RunEnd,
    /// The end of the program's output.
    pub output: LastOutput,
}

/// How a run failed. Limits are those of the run: times in seconds, sizes in bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
pub enum RunEnd {
    /// With this exit status.
    #[error("ended with exit status {0}")]
    Exited(i32),
    /// By this signal.
    #[error("killed by {}", sandbox::signal_name(*.0))]
    Killed(i32),
    /// The system refused to start the program.
    #[error(
        "cannot be started: {}: {}\n  help: make it executable, and keep it in a folder of the system, in the \
         submission or below a --readable folder", program.text(), error.text()
    )]
    NotStarted {
        /// Its path.
        program: Untrusted,
        /// The system's message.
        error: Untrusted,
    },
    /// It exceeded the limit of processor time.
    #[error("used more than {0} s of processor time")]
    Processor(f64),
    /// It exceeded the limit of elapsed time.
    #[error("still ran after {0} s")]
    Wall(f64),
    /// The hand-in used its budget of time before.
    #[error("not run: the hand-in used its budget of {0} s")]
    Budget(f64),
    /// It exceeded the limit of memory.
    #[error("needs more than {} MiB of memory", mebibytes(*.0))]
    Memory(u64),
    /// It exceeded the limit of processes.
    #[error("ran more than {0} processes and threads")]
    Processes(u64),
    /// It exceeded the limit of files' sizes.
    #[error("wrote more than {} MiB into its folder", mebibytes(*.0))]
    Folder(u64),
    /// It exceeded the limit of standard output.
    #[error("wrote more than {} MiB to standard output", mebibytes(*.0))]
    Stdout(u64),
    /// It exceeded the limit of standard error.
    #[error("wrote more than {} MiB to standard error", mebibytes(*.0))]
    Stderr(u64),
    /// It exceeded the limit of files.
    #[error("made more than {0} files")]
    Files(u64),
    /// It ended with exit status 0 and left no usable trace.
    #[error("{}", without_trace(file, reason))]
    NoTrace {
        /// The name of the trace.
        file: String,
        /// Why it was not kept.
        reason: NotKept,
    },
}

impl RunEnd {
    /// The verdict's name.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Exited(_) | Self::Killed(_) | Self::NotStarted { .. } => "crashed",
            Self::Processor(_) | Self::Wall(_) => "timed-out",
            Self::Budget(_) => "not-run",
            Self::Memory(_) => "out-of-memory",
            Self::Processes(_) => "too-many-processes",
            Self::Folder(_) | Self::Stdout(_) | Self::Stderr(_) | Self::Files(_) => {
                "too-much-output"
            }
            Self::NoTrace { reason: NotKept::TooLarge(_), .. } => "too-much-output",
            Self::NoTrace { .. } => "no-output",
        }
    }

    /// The exit status; `None` if the program was killed or not started.
    pub fn exit_status(&self) -> Option<i32> {
        match self {
            Self::Exited(status) => Some(*status),
            Self::NoTrace { .. } => Some(0),
            _ => None,
        }
    }

    /// The name of the signal that killed the program.
    pub fn signal(&self) -> Option<String> {
        if let Self::Killed(number) = self { Some(sandbox::signal_name(*number)) } else { None }
    }

    /// The limit that was exceeded, as `--limit` names it, with its value.
    pub fn limit(&self) -> Option<(&'static str, f64)> {
        Some(match self {
            Self::Processor(seconds) => ("cpu", *seconds),
            Self::Wall(seconds) => ("wall", *seconds),
            Self::Budget(seconds) => ("budget", *seconds),
            Self::Memory(bytes) => ("memory", *bytes as f64),
            Self::Processes(count) => ("processes", *count as f64),
            Self::Folder(bytes) | Self::NoTrace { reason: NotKept::TooLarge(bytes), .. } => {
                ("trace", *bytes as f64)
            }
            Self::Stdout(bytes) => ("stdout", *bytes as f64),
            Self::Stderr(bytes) => ("stderr", *bytes as f64),
            Self::Files(count) => ("files", *count as f64),
            Self::Exited(_) | Self::Killed(_) | Self::NotStarted { .. } | Self::NoTrace { .. } => {
                return None;
            }
        })
    }
}

fn mebibytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

fn without_trace(file: &str, reason: &NotKept) -> String {
    match reason {
        NotKept::Missing => "ended with exit status 0, but wrote no trace".to_owned(),
        NotKept::TooLarge(_) => format!("{file} {reason}"),
        _ => format!("ended with exit status 0, but {file} {reason}"),
    }
}

/// The end of a program's output: of standard error, else of standard output.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastOutput {
    /// The last lines; empty if it printed nothing.
    pub text: Untrusted,
    /// Whether the sandbox may hide a file that the program says is missing.
    pub misses_file: bool,
}

impl std::fmt::Display for LastOutput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.text.is_empty() {
            return Ok(());
        }
        write!(f, "; it printed:\n{}", self.text.text())?;
        if self.misses_file {
            write!(
                f,
                "\n  help: programs see the system's folders and their own; if the missing file is elsewhere, name its \
                 folder with --readable"
            )?;
        }
        Ok(())
    }
}
