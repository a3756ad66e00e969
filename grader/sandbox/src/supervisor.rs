//! The supervisor of a run: creates the namespaces, starts the keeper, enforces the limits, ends the run, and copies
//! out the files to keep.

use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use fork::Fork;
use nix::sched::{CloneFlags, unshare};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, Signal, getppid, kill_process, set_child_subreaper, umask};
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

use super::cgroup::{ControlGroup, Parent};
use super::identity::{Claim, User};
use super::keeper::{self, Done, Ended, Order, PROCEED};
use super::limits::KEEPER_THREADS;
use super::process::{MASK, die_with_parent, end_with, kill_descendants, wait_for};
use super::starter::{Entered, Starters};
use super::tree::{self, Owner};
use super::usage::{Meter, unnamed_files};
use super::walls::{Namespaces, Walls};
use super::{End, Exceeded, Job, NotKept, Outcome, Output, SandboxError, identity, keep};

/// The first pause between two polls of a run; each pause is 1.5 times the last.
const FIRST_PAUSE: Duration = Duration::from_millis(1);

/// Flags to open a working directory.
const FOLDER: OFlags = OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);

/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_millis(10);

/// How often a run on disk may write as many bytes as its files may have.
const REWRITES: u64 = 4;

/// A request to a supervisor.
#[derive(Serialize, Deserialize)]
struct Request {
    walls: Walls,
    job: Job,
}

/// Runs a program to its end under a supervisor.
pub(super) fn run(starters: &Starters, walls: &Walls, job: &Job) -> Result<Outcome, SandboxError> {
    let fail = |error: io::Error| SandboxError(error.to_string());
    let request = Request { walls: walls.clone(), job: job.clone() };
    let request = serde_json::to_string(&request).map_err(|error| fail(error.into()))?;
    let answer = starters.ask(walls, &request).map_err(fail)?;
    let answer: Option<Result<Outcome, String>> = serde_json::from_str(&answer).ok();
    answer
        .ok_or_else(|| SandboxError("its supervisor ended without an answer".to_owned()))?
        .map_err(SandboxError)
}

/// Runs as a supervisor, a child of the starter, unless the starter's place was refused. Standard input is a socket of
/// `grade`.
pub(super) fn serve(starter: Pid, entered: &Entered, request: &str) -> io::Result<()> {
    umask(MASK);
    close_inherited()?;
    let mut grader: UnixStream = rustix::stdio::stdin().try_clone_to_owned()?.into();
    let request = serde_json::from_str(request)?;
    let supervise = |parent| supervise(request, starter, parent, &grader);
    let answer = entered.as_ref().map_err(String::clone).and_then(|it| supervise(it.as_ref()));
    grader.write_all(&serde_json::to_vec(&answer)?)
}

fn supervise(
    Request { walls, job }: Request,
    starter: Pid,
    parent: Option<&Parent>,
    grader: &UnixStream,
) -> Result<Outcome, String> {
    // Orphaned processes are re-parented to this process, not to init.
    set_child_subreaper(Pid::from_raw(1)).map_err(|error| error.to_string())?;
    if walls.namespaces.exist() {
        die_with_parent().map_err(|error| error.to_string())?;
    }
    // The starter may have ended before the request took effect.
    if getppid() != Some(starter) {
        return Err("the grader ended".to_owned());
    }
    let claim = walls.own_user.then(|| Claim::new(grader, &job.limits)).transpose();
    let claim = claim.map_err(|error| format!("the user of the run: {error}"))?;
    let user = claim.as_ref().map(|claim| claim.user);
    let fail = |error: io::Error| format!("the folder of the run: {error}");
    if let (Some(user), Namespaces::None) = (user, walls.namespaces) {
        identity::hand_over(&job, user.owner).map_err(fail)?;
    }
    isolate(walls.namespaces)?;
    let group = |job: &Job, keeper| {
        let group = |parent| ControlGroup::begin(parent, starter, &job.limits, keeper);
        parent.map(group).transpose()
    };
    let mut run = Run::start(Order { walls, job, user }, group)?;
    let exceeded = run.watch(grader).map_err(|error| format!("the run: {error}"))?;
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

/// Creates the namespaces of this process's children: those of a run that neither the starter nor the keeper creates.
fn isolate(namespaces: Namespaces) -> Result<(), String> {
    let own = CloneFlags::CLONE_NEWPID | CloneFlags::CLONE_NEWIPC | CloneFlags::CLONE_NEWUTS;
    if namespaces.exist() {
        unshare(own).map_err(|error| format!("namespaces: {error}"))
    } else {
        Ok(())
    }
}

/// A running program.
struct Run {
    job: Job,
    /// The keeper, until it has been waited for.
    keeper: Option<Pid>,
    socket: BufReader<UnixStream>,
    /// Read ends of the pipes of the program's outputs, and the output so far.
    outputs: [(Option<OwnedFd>, Output); 2],
    group: Option<ControlGroup>,
    user: Option<User>,
    isolated: bool,
    /// The working directory, even if the program moves it.
    working: Option<OwnedFd>,
    ended: Option<Ended>,
    meter: Meter,
}

impl Run {
    /// Starts the keeper, in the group that is made for it.
    fn start(
        order: Order,
        group: impl Fn(&Job, Pid) -> Result<Option<ControlGroup>, String>,
    ) -> Result<Self, String> {
        let owner = order.user.map(|user| user.owner);
        let fail = |error: io::Error| format!("the keeper: {error}");
        let (own, theirs) = UnixStream::pair().map_err(fail)?;
        let (stdout, stdout_end) = output_pipe(owner).map_err(fail)?;
        let (stderr, stderr_end) = output_pipe(owner).map_err(fail)?;
        let keeper = match fork::fork().map_err(fail)? {
            Fork::Child => end_with(|| {
                rustix::stdio::dup2_stdin(&theirs)?;
                rustix::stdio::dup2_stdout(&stdout_end)?;
                rustix::stdio::dup2_stderr(&stderr_end)?;
                close_inherited()?;
                std::env::set_current_dir("/")?;
                keeper::serve(&order)
            }),
            Fork::Parent(keeper) => Pid::from_raw(keeper),
        };
        drop((theirs, stdout_end, stderr_end));
        let isolated = order.walls.namespaces.exist();
        let mut run = Self {
            job: order.job,
            keeper,
            socket: BufReader::new(own),
            outputs: [stdout, stderr].map(|pipe| (Some(pipe), Output::default())),
            group: None,
            user: order.user,
            isolated,
            working: None,
            ended: None,
            meter: Meter::new(order.walls.groups.is_none(), !isolated),
        };
        if let Some(keeper) = keeper {
            run.group = group(&run.job, keeper)?;
        }
        run.proceed()?;
        if let Some(keeper) = keeper {
            let path = format!("/proc/{}/cwd", keeper.as_raw_nonzero());
            let opened = rustix::fs::open(path, FOLDER, Mode::empty());
            run.working = Some(opened.map_err(|error| fail(error.into()))?);
        }
        run.proceed()?;
        Ok(run)
    }

    /// Lets the keeper take its next step, and waits for the end of it.
    fn proceed(&mut self) -> Result<(), String> {
        let fail = |error: io::Error| format!("the keeper: {error}");
        self.socket.get_mut().write_all(PROCEED).map_err(fail)?;
        let mut line = String::new();
        self.socket.read_line(&mut line).map_err(fail)?;
        let done: Option<Done> = serde_json::from_str(&line).ok();
        done.unwrap_or_else(|| Err(self.ended_by_itself()))
    }

    /// The message if the keeper ended by itself.
    fn ended_by_itself(&mut self) -> String {
        match self.end() {
            Ok(status) => format!("the keeper ended with {status}"),
            Err(error) => format!("the keeper: {error}"),
        }
    }

    /// Follows the run until it ends or exceeds a limit.
    fn watch(&mut self, grader: &UnixStream) -> io::Result<Option<Exceeded>> {
        let started = Instant::now();
        let mut pause = FIRST_PAUSE;
        let mut looked = started;
        loop {
            let timeout = Timespec::try_from(pause).map_err(io::Error::other)?;
            let mut descriptors = vec![
                PollFd::new(self.socket.get_ref(), PollFlags::IN),
                PollFd::new(grader, PollFlags::empty()),
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
                // The grader has ended: nothing receives the result.
                self.end()?;
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
                // With many processes, polling must not take most of the time. Its processor time counts: a wait
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
        // Files that have neither a name nor a descriptor, but are mapped, show in this alone.
        let written = limits.trace.saturating_mul(REWRITES).cast_signed();
        let most_threads = limits.processes + KEEPER_THREADS;
        let (keeper, isolated) = (self.keeper?.as_raw_nonzero().get(), self.isolated);
        let meter = &mut self.meter;
        let mut look = || {
            let unnamed = if isolated { 0 } else { unnamed_files(keeper) };
            (meter.measure(keeper, most_threads, limits.memory), unnamed)
        };
        let (usage, unnamed) = match self.user.filter(|_| !isolated) {
            None => look(),
            // In a container, root may be unable to see the open files of another user's processes. That user can.
            Some(User { owner, .. }) => std::thread::scope(|scope| {
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
            () if unnamed >= limits.trace || usage.written > written => Some(Exceeded::Trace),
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
            (None, None) => return Err(self.ended_by_itself()),
        };
        let fail = |error: io::Error| format!("the keeper: {error}");
        if !self.isolated {
            // With namespaces, the keeper ended all processes before it answered.
            self.end().map_err(fail)?;
        }
        let kept = match (&end, &self.working) {
            (end, Some(working)) if self.job.keep.is_due(end) => keep(working, &self.job),
            _ => Err(NotKept::Missing),
        };
        // The tmpfs exists as long as the directory is open.
        self.working = None;
        self.end().map_err(fail)?;
        let [stdout, stderr] = [0, 1].map(|number: usize| self.outputs[number].1.printed());
        Ok(Outcome { end, kept, stdout, stderr })
    }

    /// Kills every process of the run and waits for all of them. Returns the status of the keeper, which may have ended by
    /// itself.
    fn end(&mut self) -> io::Result<ExitStatus> {
        let Some(keeper) = self.keeper.take() else { return Ok(ExitStatus::default()) };
        kill_process(keeper, Signal::KILL)?;
        let status = wait_for(keeper)?;
        if !self.isolated {
            kill_descendants(self.user);
        }
        self.group = None;
        Ok(status)
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

/// Processor time of this process, whichever thread of it measures.
fn processor_time() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ProcessCPUTime)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncated_output_keeps_its_ends() {
        let mut output = Output::default();
        output.push(b"first\n");
        output.push(&[b'a'; 5000]);
        output.push(b"end");
        assert_eq!(output.total, 5009);
        let printed = output.printed();
        assert!(printed.text.ends_with("aend") && printed.text.len() == 4096);
        assert!(printed.head.starts_with("first\na") && printed.head.len() == 4096);
        assert_eq!((printed.is_cut(), printed.breaks), (true, 1));
        let few = crate::Printed::from(b"few".as_slice());
        assert_eq!((few.raw(), few.is_cut()), ("few", false));
    }
}
