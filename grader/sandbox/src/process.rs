//! Process control: ending with the parent, and killing every descendant.

use std::io;
use std::time::Duration;

use rustix::fs::Mode;
use rustix::process::{Pid, Signal, WaitOptions, kill_process, set_parent_process_death_signal};

use super::identity;
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

/// Kills every descendant of this process, and every process of the run's user.
pub(super) fn kill_descendants(owner: Option<(u32, u32)>) {
    let own = std::process::id().cast_signed();
    loop {
        if let Some(owner) = owner {
            identity::kill_all(identity::owner(owner));
        }
        visit_descendants(own, MAX_PER_PASS, |process| {
            // The process may have ended by itself.
            let _ = Pid::from_raw(process).map(|process| kill_process(process, Signal::KILL));
        });
        // Until there is no child left.
        match rustix::process::wait(WaitOptions::NOHANG) {
            Err(rustix::io::Errno::CHILD) => return,
            Ok(Some(_)) => {}
            _ => std::thread::sleep(PAUSE),
        }
    }
}
