//! Process control: ending with the parent, waiting for a child, and killing every descendant.

use std::io;
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;
use std::time::Duration;

use rustix::fs::Mode;
use rustix::process::{
    Pid, Signal, WaitOptions, kill_process, set_parent_process_death_signal, waitpid,
};

use super::identity::User;
use super::usage::visit_descendants;

/// Number of processes killed in one pass.
const MAX_PER_PASS: usize = 10_000;

/// Pause between two checks whether processes have ended.
const PAUSE: Duration = Duration::from_micros(100);

/// Umask under which a program's user can read the files made for it, whatever the grader's own umask.
pub(super) const MASK: Mode = Mode::WGRP.union(Mode::WOTH);

/// Asks the kernel to kill this process when its parent ends.
pub(super) fn die_with_parent() -> io::Result<()> {
    Ok(set_parent_process_death_signal(Some(Signal::KILL))?)
}

/// Kills every descendant of this process, and every process of the run's user if no other run has it.
pub(super) fn kill_descendants(user: Option<User>) {
    let own = std::process::id().cast_signed();
    loop {
        // Until there is no child left.
        match rustix::process::wait(WaitOptions::NOHANG) {
            Err(rustix::io::Errno::CHILD) => return,
            Ok(Some(_)) => continue,
            _ => {}
        }
        if let Some(user) = user {
            user.kill_all();
        }
        visit_descendants(own, MAX_PER_PASS, |process| {
            // The process may have ended by itself.
            let _ = Pid::from_raw(process).map(|process| kill_process(process, Signal::KILL));
        });
        std::thread::sleep(PAUSE);
    }
}

/// Ends a forked process after its work.
pub(super) fn end_with(work: impl FnOnce() -> io::Result<()>) -> ! {
    std::process::exit(if work().is_ok() { 0 } else { 3 })
}

/// Waits for a child to end, and returns its status.
pub(super) fn wait_for(child: Pid) -> io::Result<ExitStatus> {
    loop {
        match waitpid(Some(child), WaitOptions::empty()) {
            Ok(Some((_, status))) => return Ok(ExitStatus::from_raw(status.as_raw())),
            Ok(None) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    }
}
