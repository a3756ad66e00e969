//! The supervisor of a run: creates the namespaces, starts the keeper, enforces the limits, ends the run, and copies
//! out the files to keep.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sched::{CloneFlags, unshare};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, getegid, geteuid, getppid, set_child_subreaper, umask};
use rustix::thread::{CapabilitySet, configure_capability_in_ambient_set};
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

use super::cgroup::ControlGroup;
use super::keeper::{self, Ended, Order, Started};
use super::limits::KEEPER_THREADS;
use super::process::{MASK, die_with_parent, kill_descendants};
use super::tree::{self, Owner};
use super::usage::{Meter, unnamed_files};
use super::walls::{Namespaces, Walls};
use super::{
    End, Exceeded, Job, NotKept, Outcome, Output, SWEEPER, SandboxError, cgroup, identity, keep,
    scratch,
};

/// First argument of a supervisor process.
pub(super) const SUPERVISOR: &str = "--sandbox-supervisor";

/// First argument of a keeper process.
pub(super) const KEEPER: &str = "--sandbox-keeper";

/// Time for the processes of a killed grader to end before a sweeper removes its folders.
const SWEEP_PAUSE: Duration = Duration::from_millis(100);

/// The first pause between two polls of a run; each pause is 1.5 times the last.
const FIRST_PAUSE: Duration = Duration::from_millis(1);

/// Flags to open a working directory.
const FOLDER: OFlags = OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);

/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);

/// A request to a supervisor.
#[derive(Serialize, Deserialize)]
struct Request {
    /// The requesting process.
    parent: i32,
    walls: Walls,
    job: Job,
}

/// Runs a program to its end under a supervisor, which is an instance of `launcher`.
pub(super) fn run(launcher: &Path, walls: &Walls, job: &Job) -> Result<Outcome, SandboxError> {
    let fail = |error: io::Error| SandboxError(error.to_string());
    let mut command = Command::new(launcher);
    command.arg(OsStr::new(SUPERVISOR)).env_clear();
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut supervisor = command.spawn().map_err(fail)?;
    let parent = std::process::id().cast_signed();
    let request = Request { parent, walls: walls.clone(), job: job.clone() };
    // Closing its input would end the run.
    let stdin: Option<ChildStdin> = supervisor.stdin.take();
    if let Some(mut stdin) = stdin.as_ref() {
        let mut line = serde_json::to_vec(&request).map_err(|error| fail(error.into()))?;
        line.push(b'\n');
        stdin.write_all(&line).map_err(fail)?;
    }
    let output = supervisor.wait_with_output().map_err(fail)?;
    drop(stdin);
    let answer: Option<Result<Outcome, String>> = serde_json::from_slice(&output.stdout).ok();
    answer
        .ok_or_else(|| SandboxError(format!("the supervisor ended with {}", output.status)))?
        .map_err(SandboxError)
}

/// A process that removes the scratch folders of this process if this one is killed.
#[derive(Debug)]
pub(super) struct Sweeper(Child);

impl Sweeper {
    /// Removes the folders of killed graders, and starts a process that does so when this one ends. Call it after
    /// control groups are set up, because the new process inherits the grader's group.
    pub(super) fn start(launcher: &Path) -> io::Result<Self> {
        scratch::sweep();
        let mut command = Command::new(launcher);
        let temporary = std::env::var_os("TMPDIR").map(|folder| ("TMPDIR", folder));
        command.arg(OsStr::new(SWEEPER)).env_clear().envs(temporary);
        // It ends when its input closes, at the end of this process. Signals of the terminal do not reach it.
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        command.spawn().map(Self)
    }
}

impl Drop for Sweeper {
    fn drop(&mut self) {
        // This process removes its own folders.
        let _ = self.0.kill();
        let _ = self.0.wait();
        cgroup::leave();
    }
}

pub(super) fn serve_sweeper() -> io::Result<()> {
    io::copy(&mut io::stdin().lock(), &mut io::sink())?;
    scratch::sweep();
    // Running processes may have held a folder for a moment.
    std::thread::sleep(SWEEP_PAUSE);
    scratch::sweep();
    cgroup::leave();
    Ok(())
}

pub(super) fn serve() -> io::Result<()> {
    umask(MASK);
    let mut line = String::new();
    io::stdin().lock().read_line(&mut line)?;
    let answer = supervise(serde_json::from_str(&line)?);
    let mut stdout = io::stdout().lock();
    stdout.write_all(&serde_json::to_vec(&answer)?)?;
    stdout.flush()
}

fn supervise(Request { parent, walls, job }: Request) -> Result<Outcome, String> {
    // Orphaned processes are re-parented to this process, not to init.
    set_child_subreaper(Pid::from_raw(1)).map_err(|error| error.to_string())?;
    if walls.namespaces.exist() {
        die_with_parent().map_err(|error| error.to_string())?;
    }
    // The parent may have ended before the request took effect.
    if getppid().map(Pid::as_raw_pid) != Some(parent) {
        return Err("the grader ended".to_owned());
    }
    close_inherited().map_err(|error| error.to_string())?;
    let owner = walls.own_user.then(identity::own);
    let fail = |error: io::Error| format!("the folder of the run: {error}");
    if let (Some(owner), Namespaces::None) = (owner, walls.namespaces) {
        identity::hand_over(&job, owner).map_err(fail)?;
    }
    let group = walls.control_group.as_deref();
    let group = group.map(|parent| ControlGroup::create(parent, &job.limits)).transpose()?;
    isolate(walls.namespaces)?;
    let mut run = Run::start(&walls, job, owner, group)?;
    let exceeded = run.watch().map_err(|error| format!("the run: {error}"))?;
    run.finish(exceeded)
}

/// Closes inherited file descriptors.
fn close_inherited() -> io::Result<()> {
    let mut open = Vec::new();
    for entry in fs::read_dir("/proc/self/fd")? {
        open.extend(entry?.file_name().to_str().and_then(|name| name.parse::<i32>().ok()));
    }
    for descriptor in open.into_iter().filter(|descriptor| *descriptor > 2) {
        // The descriptor of the listing itself is already closed.
        let _ = nix::unistd::close(descriptor);
    }
    Ok(())
}

/// Creates the namespaces of this process's children, except those of mounts and of control groups, which the
/// keeper creates.
fn isolate(namespaces: Namespaces) -> Result<(), String> {
    let others = CloneFlags::CLONE_NEWPID
        | CloneFlags::CLONE_NEWNET
        | CloneFlags::CLONE_NEWIPC
        | CloneFlags::CLONE_NEWUTS;
    let fail = |error: &dyn std::fmt::Display| format!("namespaces: {error}");
    match namespaces {
        Namespaces::None => {}
        Namespaces::Privileged => unshare(others).map_err(|error| fail(&error))?,
        Namespaces::User => {
            let (user, group) = (geteuid().as_raw(), getegid().as_raw());
            unshare(CloneFlags::CLONE_NEWUSER | others).map_err(|error| fail(&error))?;
            let map = || {
                fs::write("/proc/self/setgroups", "deny")?;
                fs::write("/proc/self/uid_map", format!("{user} {user} 1"))?;
                fs::write("/proc/self/gid_map", format!("{group} {group} 1"))
            };
            map().map_err(|error| fail(&error))?;
            // The keeper needs the capability to mount, which an ordinary user's process loses on exec.
            let raise = || {
                let mut sets = rustix::thread::capabilities(None)?;
                sets.inheritable |= CapabilitySet::SYS_ADMIN;
                rustix::thread::set_capabilities(None, sets)?;
                configure_capability_in_ambient_set(CapabilitySet::SYS_ADMIN, true)
            };
            raise().map_err(|error| fail(&error))?;
        }
    }
    Ok(())
}

/// A running program.
struct Run {
    job: Job,
    keeper: Child,
    socket: BufReader<UnixStream>,
    /// Read ends of the pipes of the program's outputs, and the output so far.
    outputs: [(Option<OwnedFd>, Output); 2],
    group: Option<ControlGroup>,
    owner: Option<Owner>,
    isolated: bool,
    /// The working directory, once it exists.
    working: Option<OwnedFd>,
    ended: Option<Ended>,
    meter: Meter,
}

impl Run {
    fn start(
        walls: &Walls,
        job: Job,
        owner: Option<Owner>,
        group: Option<ControlGroup>,
    ) -> Result<Self, String> {
        let fail = |error: io::Error| format!("the keeper: {error}");
        let (own, theirs) = UnixStream::pair().map_err(fail)?;
        let (stdout, stdout_end) = output_pipe(owner).map_err(fail)?;
        let (stderr, stderr_end) = output_pipe(owner).map_err(fail)?;
        let mut command = Command::new("/proc/self/exe");
        command.arg(OsStr::new(KEEPER)).env_clear().current_dir("/");
        command.stdin(Stdio::from(OwnedFd::from(theirs)));
        let mut keeper = command.stdout(stdout_end).stderr(stderr_end).spawn().map_err(fail)?;
        // The command held the other ends.
        drop(command);
        if let Some(group) = &group {
            group.add(keeper.id())?;
        }
        let isolated = walls.namespaces.exist();
        let order = Order {
            walls: walls.clone(),
            job,
            owner: owner.map(|(user, group)| (user.as_raw(), group.as_raw())),
        };
        // Open it before the program can move it.
        let mut working = match isolated {
            true => None,
            false => Some(tree::open_folder(&order.job.folder).map_err(fail)?),
        };
        keeper::send(&own, &order).map_err(fail)?;
        let mut socket = BufReader::new(own);
        let mut line = String::new();
        socket.read_line(&mut line).map_err(fail)?;
        let started: Option<Started> = serde_json::from_str(&line).ok();
        if started.is_none() {
            let status = keeper.wait().map_err(fail)?;
            return Err(format!("the keeper ended with {status}"));
        }
        started.unwrap_or(Ok(()))?;
        let job = order.job;
        if isolated {
            let path = format!("/proc/{}/cwd", keeper.id());
            let opened = rustix::fs::open(path, FOLDER, Mode::empty());
            working = Some(opened.map_err(|error| fail(error.into()))?);
        }
        let outputs = [stdout, stderr].map(|pipe| (Some(pipe), Output::default()));
        let (ended, meter) = (None, Meter::default());
        Ok(Self { job, keeper, socket, outputs, group, owner, isolated, working, ended, meter })
    }

    /// Follows the run until it ends or exceeds a limit.
    fn watch(&mut self) -> io::Result<Option<Exceeded>> {
        let started = Instant::now();
        let mut pause = FIRST_PAUSE;
        let grader = io::stdin();
        let mut looked = started;
        loop {
            let timeout = Timespec::try_from(pause).map_err(io::Error::other)?;
            let mut descriptors = vec![
                PollFd::new(self.socket.get_ref(), PollFlags::IN),
                PollFd::new(&grader, PollFlags::empty()),
            ];
            let open = self.outputs.iter().filter_map(|(pipe, _)| pipe.as_ref());
            descriptors.extend(open.map(|pipe| PollFd::new(pipe, PollFlags::IN)));
            // The second answer may have arrived with the first.
            let mut answered = !self.socket.buffer().is_empty();
            let timeout = if answered { Timespec::default() } else { timeout };
            poll(&mut descriptors, Some(&timeout))?;
            let ready = |number: usize| !descriptors[number].revents().is_empty();
            answered |= ready(0);
            let orphaned = ready(1);
            if orphaned {
                // The parent has ended: nothing receives the result.
                self.end();
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            if let Some(exceeded) = self.read_outputs()? {
                return Ok(Some(exceeded));
            }
            if answered {
                let mut line = String::new();
                self.socket.read_line(&mut line)?;
                self.ended = serde_json::from_str(&line).ok();
                // The last output of the program.
                return self.read_outputs();
            }
            if looked.elapsed() >= pause {
                let before = processor_time();
                if let Some(exceeded) = self.exceeded(started.elapsed()) {
                    return Ok(Some(exceeded));
                }
                // With many processes, polling must not take most of the time. What counts is its processor time: a wait
                // for a processor that the program keeps busy must not make the polls rarer.
                let spent = processor_time().saturating_sub(before);
                pause = (pause * 3 / 2).min(LONGEST_PAUSE).max(spent * 2);
                looked = Instant::now();
            }
        }
    }

    /// Reads the output printed so far; returns the exceeded limit on output, if any.
    fn read_outputs(&mut self) -> io::Result<Option<Exceeded>> {
        let limits = self.job.limits;
        let most = [(limits.stdout, Exceeded::Stdout), (limits.stderr, Exceeded::Stderr)];
        let mut buffer = [0; 1 << 16];
        for ((pipe, output), (most, exceeded)) in self.outputs.iter_mut().zip(most) {
            while let Some(open) = pipe {
                match rustix::io::read(&*open, &mut buffer) {
                    Ok(0) => *pipe = None,
                    Ok(count) => output.push(&buffer[..count]),
                    Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => break,
                    Err(error) => return Err(error.into()),
                }
                if output.total >= most {
                    return Ok(Some(exceeded));
                }
            }
        }
        Ok(None)
    }

    /// The exceeded limit of the whole run, if any.
    fn exceeded(&mut self, elapsed: Duration) -> Option<Exceeded> {
        let limits = self.job.limits;
        let most_threads = limits.processes + KEEPER_THREADS;
        let (keeper, isolated) = (self.keeper.id().cast_signed(), self.isolated);
        let meter = &mut self.meter;
        let mut look = || {
            let unnamed = if isolated { 0 } else { unnamed_files(keeper) };
            (meter.measure(keeper, most_threads, limits.memory), unnamed)
        };
        let (usage, unnamed) = match self.owner.filter(|_| !isolated) {
            None => look(),
            // In a container, root may be unable to see the open files of another user's processes. That user can.
            Some(owner) => std::thread::scope(|scope| {
                let watcher = std::thread::Builder::new().spawn_scoped(scope, || {
                    identity::become_unprivileged(Some(owner)).ok().map(|()| look())
                });
                watcher.ok().and_then(|watcher| watcher.join().ok().flatten()).unwrap_or_default()
            }),
        };
        match () {
            () if elapsed.as_secs_f64() > limits.wall => Some(Exceeded::Wall),
            () if usage.cpu > limits.cpu => Some(Exceeded::Cpu),
            () if usage.memory > limits.memory => Some(Exceeded::Memory),
            () if usage.threads > most_threads => Some(Exceeded::Processes),
            () if unnamed >= limits.trace => Some(Exceeded::Trace),
            () => self
                .group
                .as_ref()
                .and_then(|group| group.exceeded(&limits))
                .or_else(|| self.exceeded_size()),
        }
    }

    /// The exceeded limit of the working directory, if any.
    fn exceeded_size(&self) -> Option<Exceeded> {
        if !self.isolated {
            return tree::exceeded_size(&self.job.folder, self.job.limits);
        }
        // The kernel enforces these limits.
        let left = rustix::fs::fstatvfs(self.working.as_ref()?).ok()?;
        match () {
            () if left.f_bfree == 0 => Some(Exceeded::Trace),
            () if left.f_ffree == 0 => Some(Exceeded::Files),
            () => None,
        }
    }

    /// Ends the remaining processes, copies out the files to keep, and returns the result.
    fn finish(mut self, exceeded: Option<Exceeded>) -> Result<Outcome, String> {
        let exceeded = exceeded
            .or_else(|| self.group.as_ref().and_then(|group| group.exceeded(&self.job.limits)))
            .or_else(|| self.exceeded_size());
        let end = match (exceeded, self.ended.take()) {
            (Some(exceeded), _) => End::Exceeded(exceeded),
            (None, Some(ended)) => ended?,
            (None, None) => {
                // The keeper may have ended by itself. Its status is lost to the code that waits for all processes.
                let _ = self.keeper.kill();
                let status = self.keeper.wait().map_err(|error| error.to_string());
                self.end();
                return Err(format!("the keeper ended with {}", status?));
            }
        };
        if !self.isolated {
            // With namespaces, the keeper ended all processes before it answered.
            self.end();
        }
        let kept = match (&end, &self.working) {
            (End::Exited(0), Some(working)) => keep(working.as_fd(), &self.job),
            _ => Err(NotKept::Missing),
        };
        // The tmpfs exists as long as the directory is open.
        self.working = None;
        self.end();
        let [stdout, stderr] = [0, 1].map(|number: usize| self.outputs[number].1.printed());
        Ok(Outcome { end, kept, stdout, stderr })
    }

    /// Kills every process of the run and waits for all of them.
    fn end(&mut self) {
        // The keeper may have ended by itself.
        let _ = self.keeper.kill();
        if self.isolated {
            let _ = self.keeper.wait();
        } else {
            kill_descendants(self.owner.map(|(user, group)| (user.as_raw(), group.as_raw())));
        }
        self.group = None;
    }
}

/// A pipe for an output of the program: the non-blocking read end, and the write end, owned by the program's user.
fn output_pipe(owner: Option<Owner>) -> io::Result<(OwnedFd, OwnedFd)> {
    let (read, write) = rustix::pipe::pipe_with(rustix::pipe::PipeFlags::CLOEXEC)?;
    rustix::io::ioctl_fionbio(&read, true)?;
    if let Some((user, group)) = owner {
        rustix::fs::fchown(&write, Some(user), Some(group))?;
    }
    Ok((read, write))
}

/// Processor time of this thread.
fn processor_time() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_keeps_its_end() {
        let mut output = Output::default();
        output.push(&[b'a'; 5000]);
        output.push(b"end");
        assert_eq!(output.total, 5003);
        let printed = output.printed();
        assert!(printed.cut && printed.text.ends_with("aend") && printed.text.len() == 4096);
        let mut few = Output::default();
        few.push(b"few");
        assert_eq!(few.printed(), super::super::Printed { text: "few".to_owned(), cut: false });
    }
}
