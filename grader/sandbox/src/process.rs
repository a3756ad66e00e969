//! Processes of a run: ending with the parent, and ending every descendant.

use std::io;
use std::time::Duration;

use rustix::fs::Mode;
use rustix::process::{Pid, Signal, WaitOptions, kill_process, set_parent_process_death_signal};

use super::identity;
use super::usage::visit_descendants;

/// Processes that are ended at once.
const AT_ONCE: usize = 10_000;

/// Between two looks at processes that are ending.
const PAUSE: Duration = Duration::from_micros(100);

/// Whatever the grader's mask is, a program's user may read what is made for it.
pub(super) const MASK: Mode = Mode::WGRP.union(Mode::WOTH);

/// Has the kernel kill this process when its parent ends.
pub(super) fn die_with_parent() -> io::Result<()> {
    Ok(set_parent_process_death_signal(Some(Signal::KILL))?)
}

/// Ends every process below this one, and every process of the run's user.
pub(super) fn hunt_down(owner: Option<(u32, u32)>) {
    let own = std::process::id().cast_signed();
    loop {
        if let Some(owner) = owner {
            identity::kill_all(identity::owner(owner));
        }
        visit_descendants(own, AT_ONCE, |process| {
            // It may have ended by itself.
            let _ = Pid::from_raw(process).map(|process| kill_process(process, Signal::KILL));
        });
        // Until none is left to wait for.
        match rustix::process::wait(WaitOptions::NOHANG) {
            Err(rustix::io::Errno::CHILD) => return,
            Ok(Some(_)) => {}
            _ => std::thread::sleep(PAUSE),
        }
    }
}
