//! Run without protection: enforces time and output limits, and ends the program with its children.

use std::fs::File;
use std::io::{self, Read};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::group::{self, Group};
use super::{End, Exceeded, Job, NotKept, Outcome, Output, SandboxError, keep, tree};

/// The first pause between two polls of a running program; each pause is 1.5 times the last.
const FIRST_PAUSE: Duration = Duration::from_micros(200);

/// The longest pause between two polls of a running program.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);

/// Time to wait for output after the program's end; a surviving process may hold the pipe open.
const OUTPUT_PAUSE: Duration = Duration::from_millis(200);

type Shared = Arc<Mutex<Output>>;

/// Runs a program to its end.
pub(super) fn run(job: &Job) -> Result<Outcome, SandboxError> {
    let fail = |error: io::Error| SandboxError(error.to_string());
    let mut command = Command::new(&job.program);
    command.args(&job.arguments).current_dir(&job.folder);
    let input = job.input.as_ref().map(|name| File::open(job.folder.join(name)));
    let input = input.transpose().map_err(fail)?;
    command.stdin(input.map_or_else(Stdio::null, Stdio::from));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut program = match Group::start(command) {
        Ok(program) => program,
        Err(error) => {
            return Ok(Outcome {
                end: End::NotStarted(error.to_string()),
                kept: Err(NotKept::Missing),
                stdout: Output::default().printed(),
                stderr: Output::default().printed(),
            });
        }
    };
    let (stdout, stderr) = program.outputs();
    let stdout = stdout.map(read).unwrap_or_default();
    let stderr = stderr.map(read).unwrap_or_default();
    let end = wait(&mut program, job, &stdout, &stderr).map_err(fail)?;
    let deadline = Instant::now() + OUTPUT_PAUSE;
    while Arc::strong_count(&stdout) + Arc::strong_count(&stderr) > 2 && Instant::now() < deadline {
        std::thread::sleep(FIRST_PAUSE);
    }
    let kept = match end {
        _ if job.keep.is_due(&end) => {
            let working = tree::open_folder(&job.folder).map_err(fail)?;
            keep(&working, job)
        }
        _ => Err(NotKept::Missing),
    };
    let printed = |output: &Shared| output.lock().unwrap_or_else(PoisonError::into_inner).printed();
    Ok(Outcome { end, kept, stdout: printed(&stdout), stderr: printed(&stderr) })
}

/// Reads an output to its end in another thread, which then drops its reference to the result.
fn read(mut pipe: impl Read + Send + 'static) -> Shared {
    let output = Shared::default();
    let shared = Arc::clone(&output);
    std::thread::spawn(move || {
        let mut buffer = [0; 1 << 14];
        while let Ok(count @ 1..) = pipe.read(&mut buffer) {
            shared.lock().unwrap_or_else(PoisonError::into_inner).push(&buffer[..count]);
        }
    });
    output
}

fn wait(program: &mut Group, job: &Job, stdout: &Shared, stderr: &Shared) -> io::Result<End> {
    let started = Instant::now();
    let mut pause = FIRST_PAUSE;
    let total = |output: &Shared| output.lock().unwrap_or_else(PoisonError::into_inner).total;
    loop {
        let status = program.try_wait()?;
        let exceeded = match () {
            () if started.elapsed().as_secs_f64() > job.limits.wall => Some(Exceeded::Wall),
            () if total(stdout) >= job.limits.stdout => Some(Exceeded::Stdout),
            () if total(stderr) >= job.limits.stderr => Some(Exceeded::Stderr),
            () => tree::exceeded_size(&job.folder, job.limits),
        };
        match (exceeded, status) {
            (None, Some(status)) => return Ok(group::end(status)),
            (None, None) => {}
            (Some(exceeded), status) => {
                if status.is_none() {
                    program.kill()?;
                }
                return Ok(End::Exceeded(exceeded));
            }
        }
        std::thread::sleep(pause);
        pause = (pause * 3 / 2).min(LONGEST_PAUSE);
    }
}
