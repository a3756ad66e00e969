//! A run without protection, on any system: it ends at its time, with its process group where there are any.

use std::fs::File;
use std::io;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::{End, Exceeded, Job, Outcome, SandboxError, spawn, too_much_output};

/// The first pause between two looks at a running program; each pause is half as long again as the last.
const FIRST_PAUSE: Duration = Duration::from_micros(200);

/// The longest pause between two looks at a running program.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);

/// Runs a program to its end.
pub(super) fn run(job: &Job) -> Result<Outcome, SandboxError> {
    let fail = |error: io::Error| SandboxError(error.to_string());
    let stdout = File::create(&job.stdout).map_err(fail)?;
    let stderr = File::create(&job.stderr).map_err(fail)?;
    let mut command = Command::new(&job.program);
    command.args(&job.arguments).current_dir(&job.scratch);
    command.stdin(Stdio::null()).stdout(stdout).stderr(stderr);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let end = match spawn(&mut command) {
        Ok(mut child) => wait(&mut child, job).map_err(fail)?,
        Err(error) => End::NotStarted(error.to_string()),
    };
    Ok(Outcome { end, protections: Vec::new() })
}

fn wait(child: &mut Child, job: &Job) -> io::Result<End> {
    let started = Instant::now();
    let mut pause = FIRST_PAUSE;
    loop {
        let status = child.try_wait()?;
        let late = started.elapsed().as_secs_f64() > job.limits.wall;
        let exceeded = late.then_some(Exceeded::Wall).or_else(|| too_much_output(job));
        match (exceeded, status) {
            (None, Some(status)) => return Ok(end_of(status)),
            (None, None) => {}
            (Some(exceeded), status) => {
                if status.is_none() {
                    end(child)?;
                    child.wait()?;
                }
                return Ok(End::Exceeded(exceeded));
            }
        }
        std::thread::sleep(pause);
        pause = (pause * 3 / 2).min(LONGEST_PAUSE);
    }
}

fn end_of(status: ExitStatus) -> End {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return End::Signalled(signal);
    }
    End::Exited(status.code().unwrap_or(-1))
}

/// Ends the child, and what it started.
#[cfg(unix)]
fn end(child: &mut Child) -> io::Result<()> {
    use rustix::process::{Pid, Signal, kill_process_group};
    // Until it is waited for, its number belongs to no other process.
    Ok(kill_process_group(Pid::from_child(child), Signal::KILL)?)
}

/// Ends the child.
#[cfg(not(unix))]
fn end(child: &mut Child) -> io::Result<()> {
    child.kill()
}
