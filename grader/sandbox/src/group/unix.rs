//! A program as the leader of a process group.

use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus};

use rustix::process::{Pid, Signal, kill_process_group};

use crate::{End, spawn};

/// A running program, with the processes that it starts.
pub(crate) struct Group(Child);

impl Group {
    pub(crate) fn start(mut command: Command) -> io::Result<Self> {
        command.process_group(0);
        spawn(&mut command).map(Self)
    }

    pub(crate) fn outputs(&mut self) -> (Option<ChildStdout>, Option<ChildStderr>) {
        (self.0.stdout.take(), self.0.stderr.take())
    }

    pub(crate) fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        self.0.try_wait()
    }

    /// Ends a program that has not been waited for, so that its number is not reused.
    pub(crate) fn kill(&mut self) -> io::Result<()> {
        kill_process_group(Pid::from_child(&self.0), Signal::KILL)?;
        self.0.wait().map(drop)
    }
}

/// How a program ended by itself.
pub(crate) fn end(status: ExitStatus) -> End {
    let exited = || End::Exited(status.code().unwrap_or(-1));
    status.signal().map_or_else(exited, End::Signalled)
}

/// The signal's name, such as `SIGSEGV`, if it has one.
pub(crate) fn signal_name(number: i32) -> Option<String> {
    let signal = Signal::from_named_raw(number)?;
    let name = format!("{signal:?}");
    // Some versions of rustix quote the name.
    Some(format!("SIG{}", name.trim_matches('"').trim_start_matches("Signal::")))
}
