//! A program in a job object of Windows. In a page of a browser, no program starts.

use std::io;
use std::process::{ChildStderr, ChildStdout, Command, ExitStatus};

#[cfg(not(windows))]
use std::process::Child;

#[cfg(windows)]
use process_wrap::std::{ChildWrapper, CommandWrap, JobObject};

use crate::End;

/// A running program, with the processes that it starts.
#[cfg(windows)]
pub(crate) struct Group(Box<dyn ChildWrapper>);

/// A running program.
#[cfg(not(windows))]
pub(crate) struct Group(Child);

impl Group {
    #[cfg(windows)]
    pub(crate) fn start(command: Command) -> io::Result<Self> {
        CommandWrap::from(command).wrap(JobObject).spawn().map(Self)
    }

    #[cfg(not(windows))]
    pub(crate) fn start(mut command: Command) -> io::Result<Self> {
        command.spawn().map(Self)
    }

    #[cfg(windows)]
    pub(crate) fn outputs(&mut self) -> (Option<ChildStdout>, Option<ChildStderr>) {
        (self.0.stdout().take(), self.0.stderr().take())
    }

    #[cfg(not(windows))]
    pub(crate) fn outputs(&mut self) -> (Option<ChildStdout>, Option<ChildStderr>) {
        (self.0.stdout.take(), self.0.stderr.take())
    }

    pub(crate) fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        self.0.try_wait()
    }

    /// Ends the program and its processes.
    #[cfg(windows)]
    pub(crate) fn kill(&mut self) -> io::Result<()> {
        self.0.start_kill()?;
        self.0.inner_mut().wait().map(drop)
    }

    #[cfg(not(windows))]
    pub(crate) fn kill(&mut self) -> io::Result<()> {
        self.0.kill()
    }
}

/// How a program ended by itself.
pub(crate) fn end(status: ExitStatus) -> End {
    End::Exited(status.code().unwrap_or(-1))
}

/// The signal's name: programs end without signals here.
pub(crate) fn signal_name(_number: i32) -> Option<String> {
    None
}
