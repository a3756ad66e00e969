//! Handling of Ctrl-C and SIGTERM. The first signal ends the running programs, and `grade` reports what it has
//! graded; another one a second later ends `grade` at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::stop::{Exit, Stop};

/// Whether an interrupt was requested.
#[derive(Clone, Default)]
pub(super) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Installs the signal handlers.
    pub(super) fn listen() -> Result<Self, Stop> {
        let interrupt = Self::default();
        #[cfg(unix)]
        unix::listen(&interrupt.0).map_err(Stop::fault)?;
        Ok(interrupt)
    }

    pub(super) fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// # Errors
    /// If an interrupt was requested.
    pub(super) fn check(&self, done: &str) -> Result<(), Stop> {
        if self.is_requested() { Err(Stop(Exit::Interrupted, done.to_owned())) } else { Ok(()) }
    }
}

#[cfg(unix)]
mod unix {
    use std::fs;
    use std::io;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;
    use std::time::{Duration, Instant};

    use grader::boundary::own_file;
    use rustix::process::{Pid, Signal, getpid, kill_process, kill_process_group};
    use sandbox::STARTER;
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;
    use signal_hook::iterator::Signals;

    use crate::stop::Exit;

    /// Pause between two searches for children: a thread may have been about to start one.
    const PAUSE: Duration = Duration::from_millis(5);

    /// Time after the first signal in which another one changes nothing: `timeout` sends one to its program, and at once
    /// another to its process group.
    const SAME: Duration = Duration::from_secs(1);

    pub(super) fn listen(requested: &Arc<AtomicBool>) -> io::Result<()> {
        let ends_at_once = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            let condition = Arc::clone(&ends_at_once);
            flag::register_conditional_shutdown(signal, Exit::Interrupted as i32, condition)?;
            flag::register(signal, Arc::clone(requested))?;
        }
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        thread::spawn(move || {
            if signals.forever().next().is_some() {
                let first = Instant::now();
                loop {
                    end_programs();
                    thread::sleep(PAUSE);
                    ends_at_once.store(first.elapsed() >= SAME, Ordering::Relaxed);
                }
            }
        });
        Ok(())
    }

    /// Kills the supervisors of protected programs, and so the programs, and the process groups of unprotected
    /// programs. Without /proc, programs run to their end.
    fn end_programs() {
        for pid in programs().unwrap_or_default() {
            // An unprotected program leads its own process group.
            let _ = kill_process_group(pid, Signal::KILL);
            let _ = kill_process(pid, Signal::KILL);
        }
    }

    /// The children of this process and of the sandbox's starters, but not the starters.
    fn programs() -> io::Result<Vec<Pid>> {
        let mut parents = vec![getpid().as_raw_nonzero().to_string()];
        let mut processes = Vec::new();
        for entry in fs::read_dir("/proc")?.flatten() {
            let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse::<i32>().ok())
            else {
                continue;
            };
            let stat = own_file::text(&entry.path().join("stat")).unwrap_or_default();
            // `pid (name) state parent …`; the name may contain blanks and parentheses.
            let parent = stat.rsplit_once(')').and_then(|(_, rest)| rest.split_whitespace().nth(1));
            let Some(parent) = parent.map(str::to_owned) else { continue };
            let command = own_file::read(&entry.path().join("cmdline")).unwrap_or_default();
            let is_starter = command.split(|byte| *byte == 0).nth(1) == Some(STARTER.as_bytes());
            if is_starter && parent == parents[0] {
                parents.push(pid.to_string());
            } else {
                processes.push((pid, parent));
            }
        }
        let is_program = |(_, parent): &(i32, String)| parents.contains(parent);
        let programs = processes.into_iter().filter(is_program);
        Ok(programs.filter_map(|(pid, _)| Pid::from_raw(pid)).collect())
    }
}
