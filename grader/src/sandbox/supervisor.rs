//! The supervisor: makes a world for the program, watches what it uses, and ends it.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use nix::sched::{CloneFlags, unshare};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{
    Pid, Signal, WaitOptions, getegid, geteuid, getppid, kill_process, set_child_subreaper,
    set_parent_process_death_signal,
};
use serde::{Deserialize, Serialize};

use super::keeper::{Ended, Order, Started, keep};
use super::usage::{of_tree, visit_descendants};
use super::{End, Exceeded, Job, Outcome, SandboxError, too_much_output};

/// The first word of the command line of a supervisor.
const SUPERVISOR: &str = "--sandbox-supervisor";

/// The first word of the command line of a keeper.
const KEEPER: &str = "--sandbox-keeper";

/// The user that a program run by the superuser takes itself for.
const NOBODY: u32 = 65534;

/// The first pause between two looks at a run; each is half as long again as the last.
const FIRST_PAUSE: Duration = Duration::from_millis(1);

/// Processes that are ended at once.
const AT_ONCE: usize = 10_000;

/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);

/// What a supervisor is asked to do.
#[derive(Serialize, Deserialize)]
struct Request {
    /// Who asks.
    parent: i32,
    job: Job,
}

/// Runs a program to its end, in the care of a supervisor that is this launcher.
pub(super) fn run(launcher: &Path, job: &Job) -> Result<Outcome, SandboxError> {
    let fail = |error: io::Error| SandboxError(error.to_string());
    let mut supervisor = start(launcher, SUPERVISOR).map_err(fail)?;
    let request = Request { parent: std::process::id().cast_signed(), job: job.clone() };
    send(&mut supervisor, &request).map_err(fail)?;
    let output = supervisor.wait_with_output().map_err(fail)?;
    let answer: Option<Result<Outcome, String>> = serde_json::from_slice(&output.stdout).ok();
    answer
        .ok_or_else(|| SandboxError(format!("the supervisor ended with {}", output.status)))?
        .map_err(SandboxError)
}

/// Does a supervisor's or keeper's work where this process was started as one; otherwise `None`. To be called
/// first of all, before any thread or file.
pub fn serve() -> Option<ExitCode> {
    let role = std::env::args_os().nth(1)?;
    let answered = match role.to_str()? {
        SUPERVISOR => serve_supervisor(),
        KEEPER => serve_keeper(),
        _ => return None,
    };
    Some(if answered.is_ok() { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

fn start(launcher: &Path, role: &str) -> io::Result<Child> {
    let mut command = Command::new(launcher);
    command.arg(OsStr::new(role)).env_clear();
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()
}

fn send(child: &mut Child, message: &impl Serialize) -> io::Result<()> {
    let mut stdin = child.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
    stdin.write_all(&serde_json::to_vec(message)?)
}

fn serve_supervisor() -> io::Result<()> {
    let request = serde_json::from_reader(io::stdin().lock())?;
    tell(&supervise(request))
}

fn serve_keeper() -> io::Result<()> {
    die_with_parent(None).map_err(io::Error::other)?;
    // Whether the supervisor ended before that can only be told by its end of the pipe: from a world of one's own,
    // parents outside have no number.
    let stdout = io::stdout();
    let mut pipe = [PollFd::new(&stdout, PollFlags::OUT)];
    poll(&mut pipe, Some(&Timespec::default()))?;
    if pipe[0].revents().contains(PollFlags::ERR) {
        return Err(io::ErrorKind::BrokenPipe.into());
    }
    let order = serde_json::from_reader(io::stdin().lock())?;
    keep(&order, tell, tell)
}

fn tell(message: &impl Serialize) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(&serde_json::to_vec(message)?)?;
    stdout.flush()
}

/// Has the kernel end this process with the one that started it.
fn die_with_parent(expected: Option<i32>) -> Result<(), String> {
    let fail = |error: rustix::io::Errno| error.to_string();
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(fail)?;
    // Whatever is orphaned comes to this process, and not to the system's first.
    set_child_subreaper(Pid::from_raw(1)).map_err(fail)?;
    match expected {
        // It may have ended before the kernel was told.
        Some(parent) if getppid().map(Pid::as_raw_pid) != Some(parent) => {
            Err("the grader ended".to_owned())
        }
        _ => Ok(()),
    }
}

fn supervise(Request { parent, job }: Request) -> Result<Outcome, String> {
    die_with_parent(Some(parent))?;
    close_inherited().map_err(|error| error.to_string())?;
    let isolated = isolate().map_err(|error| format!("namespaces: {error}"))?;
    let fail = |error: io::Error| format!("the keeper: {error}");
    let mut keeper = start(Path::new("/proc/self/exe"), KEEPER).map_err(fail)?;
    let order = Order { job, isolated };
    send(&mut keeper, &order).map_err(fail)?;
    let mut told = Vec::new();
    let exceeded = watch(&mut keeper, &order.job, &mut told).map_err(fail)?;
    keeper.kill().map_err(fail)?;
    let status = keeper.wait().map_err(fail)?;
    hunt_down();
    let mut told = serde_json::Deserializer::from_slice(&told);
    let started: Option<Started> = Deserialize::deserialize(&mut told).ok();
    let ended: Option<Ended> = Deserialize::deserialize(&mut told).ok();
    let protections = match started {
        Some(started) => started?,
        // Where starting it takes all the time there is.
        None if exceeded.is_some() => Vec::new(),
        None => return Err(format!("the keeper ended with {status}")),
    };
    let end = match (exceeded.or_else(|| too_much_output(&order.job)), ended) {
        (Some(exceeded), _) => End::Exceeded(exceeded),
        (None, Some(ended)) => ended?,
        (None, None) => return Err(format!("the keeper ended with {status}")),
    };
    Ok(Outcome { end, protections })
}

/// Follows a run until it ends or meets a limit. What the keeper tells is appended to `told`.
fn watch(keeper: &mut Child, job: &Job, told: &mut Vec<u8>) -> io::Result<Option<Exceeded>> {
    let mut stdout = keeper.stdout.take().ok_or(io::ErrorKind::BrokenPipe)?;
    let number = keeper.id().cast_signed();
    let started = Instant::now();
    let mut pause = FIRST_PAUSE;
    let mut buffer = [0; 4096];
    loop {
        let timeout = Timespec::try_from(pause).map_err(io::Error::other)?;
        let ready = poll(&mut [PollFd::new(&stdout, PollFlags::IN)], Some(&timeout))?;
        if ready > 0 {
            match stdout.read(&mut buffer)? {
                0 => return Ok(None),
                count => told.extend(&buffer[..count]),
            }
            continue;
        }
        let looked = Instant::now();
        let exceeded = exceeded(number, job, started.elapsed()).or_else(|| too_much_output(job));
        if exceeded.is_some() {
            return Ok(exceeded);
        }
        // Where there is much to look at, looking must not be what the time goes into.
        pause = (pause * 3 / 2).min(LONGEST_PAUSE).max(looked.elapsed() * 10);
    }
}

/// The limit of the whole tree that is exceeded, if one is.
fn exceeded(keeper: i32, Job { limits, .. }: &Job, elapsed: Duration) -> Option<Exceeded> {
    // The keeper has one thread, and another for a moment.
    let most_threads = limits.processes + 2;
    let usage = of_tree(keeper, most_threads);
    match () {
        () if elapsed.as_secs_f64() > limits.wall => Some(Exceeded::Wall),
        () if usage.cpu > limits.cpu => Some(Exceeded::Cpu),
        () if usage.memory > limits.memory => Some(Exceeded::Memory),
        () if usage.threads > most_threads => Some(Exceeded::Processes),
        () => None,
    }
}

/// Closes what whoever started the grader left open.
fn close_inherited() -> io::Result<()> {
    let mut open = Vec::new();
    for entry in fs::read_dir("/proc/self/fd")? {
        open.extend(entry?.file_name().to_str().and_then(|name| name.parse::<i32>().ok()));
    }
    for descriptor in open.into_iter().filter(|descriptor| *descriptor > 2) {
        // That of the listing itself is closed by now.
        let _ = nix::unistd::close(descriptor);
    }
    Ok(())
}

/// Gives what this process starts a world of its own; false where the system does not offer one.
fn isolate() -> io::Result<bool> {
    let (user, group) = (geteuid().as_raw(), getegid().as_raw());
    if unshare(CloneFlags::CLONE_NEWUSER | CloneFlags::CLONE_NEWPID).is_err() {
        return Ok(false);
    }
    let inside = |number: u32| if number == 0 { NOBODY } else { number };
    fs::write("/proc/self/setgroups", "deny")?;
    fs::write("/proc/self/uid_map", format!("{} {user} 1", inside(user)))?;
    fs::write("/proc/self/gid_map", format!("{} {group} 1", inside(group)))?;
    Ok(true)
}

/// Ends whatever is left of the run. In a world of their own, all have ended with the keeper.
fn hunt_down() {
    let own = std::process::id().cast_signed();
    loop {
        visit_descendants(own, AT_ONCE, |process| {
            // It may have ended by itself.
            let _ = Pid::from_raw(process).map(|process| kill_process(process, Signal::KILL));
        });
        // Until none is left to wait for.
        match rustix::process::wait(WaitOptions::NOHANG) {
            Err(rustix::io::Errno::CHILD) => return,
            Ok(Some(_)) => {}
            _ => std::thread::sleep(FIRST_PAUSE / 10),
        }
    }
}
