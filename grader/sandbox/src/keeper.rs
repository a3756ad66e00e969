//! The keeper of a run: builds the root file system, starts the program in it, and waits for it. The keeper is the
//! first process of its PID namespace, so that all descendants of the program end with it.

use std::env;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use nix::sched::{CloneFlags, unshare};
use nix::sys::resource::{Usage, UsageWho, getrusage};
use rustix::process::{
    DumpableBehavior, Pid, Resource, Rlimit, Signal, WaitOptions, getrlimit, kill_process_group,
    set_child_subreaper, set_dumpable_behavior, setrlimit,
};
use serde::Serialize;

use super::identity::User;
use super::limits::KEEPER_THREADS;
use super::process::{die_with_parent, kill_descendants};
use super::walls::{self, Walls, writable};
use super::{End, Exceeded, Job, Keep, spawn, world};

/// Limit on open files per process, of a run and of a build. Bounds the memory that a process can hold in sockets.
const OPEN_FILES: u64 = 256;
const OPEN_FILES_OF_BUILDS: u64 = 1024;

/// Limits of the kernel's memory for queued signals and timers, in number, and of memory that is locked, in bytes.
const PENDING_SIGNALS: u64 = 1024;
const LOCKED: u64 = 8 << 20;

/// Nice value of submissions.
const NICENESS: i32 = 5;

/// Fraction of the memory limit above which a failed program counts as out of memory.
const OUT_OF_MEMORY_FRACTION: f64 = 0.75;

/// Minimum fraction of the processor time limit that a program killed by `SIGXCPU` must have used. Below it, the
/// program sent the signal itself.
const MIN_CPU_FRACTION: f64 = 0.5;

/// A request to the keeper.
pub(super) struct Order {
    pub(super) walls: Walls,
    pub(super) job: Job,
    /// User of the run, if it has its own.
    pub(super) user: Option<User>,
}

/// The supervisor's message that the keeper may take its next step.
pub(super) const PROCEED: &[u8] = b" ";

/// The keeper's answer after a step: it has entered the root file system; it has started the program.
pub(super) type Done = Result<(), String>;

/// The keeper's last answer, after the program and all its processes have ended.
pub(super) type Ended = Result<End, String>;

/// Runs as the keeper of one run, a child of its supervisor. Standard input is a socket of the supervisor; the outputs are
/// the program's.
pub(super) fn serve(order: &Order) -> io::Result<()> {
    // Orphaned processes are re-parented to this process.
    set_child_subreaper(Pid::from_raw(1))?;
    let socket: UnixStream = rustix::stdio::stdin().try_clone_to_owned()?.into();
    let isolated = order.walls.namespaces.exist();
    if isolated {
        die_with_parent()?;
    }
    // Fails if the supervisor ended before this took effect.
    let proceed = || (&socket).read_exact(&mut [0; PROCEED.len()]);
    proceed()?;
    send(&socket, &enter(order))?;
    proceed()?;
    if !isolated {
        // In namespaces, the kernel ends the run with the supervisor.
        let (supervisor, user) = (socket.try_clone()?, order.user);
        std::thread::Builder::new().spawn(move || {
            // The supervisor sends nothing more; this returns when it ends.
            let _ = (&supervisor).read(&mut [0]);
            kill_descendants(user);
            std::process::exit(0);
        })?;
    }
    let followed = follow(order, &socket);
    if !isolated && followed.is_err() {
        // The supervisor has ended; this process must not end before its descendants.
        kill_descendants(order.user);
    }
    followed?;
    loop {
        std::thread::park();
    }
}

/// Runs the program to its end, and answers after each step.
fn follow(order: &Order, socket: &UnixStream) -> io::Result<()> {
    let child = match prepare(order) {
        Ok(child) => child,
        Err(error) => return send(socket, &Done::Err(error)),
    };
    send(socket, &Done::Ok(()))?;
    let ended = match child {
        Err(error) => Ok(End::NotStarted(error.to_string())),
        Ok(child) => wait_for(&child, &order.job).map_err(|error| error.to_string()),
    };
    if order.walls.namespaces.exist() {
        end_all();
    }
    send(socket, &ended)
}

/// Sends a message as one line.
pub(super) fn send(mut socket: &UnixStream, message: &impl Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(message)?;
    line.push(b'\n');
    socket.write_all(&line)
}

/// Enters the root file system and the working directory, where the supervisor finds it, even if the program moves it.
fn enter(Order { walls, job, user }: &Order) -> Done {
    if walls.namespaces.exist() {
        unshare(CloneFlags::CLONE_NEWNS | CloneFlags::CLONE_NEWCGROUP)
            .map_err(|error| format!("namespaces: {error}"))?;
        world::enter(walls, job, user.map(|user| user.owner))?;
    }
    env::set_current_dir(&writable(job, walls.namespaces)[0])
        .map_err(|error| format!("the working directory: {error}"))
}

/// Sets the limits and starts the program.
fn prepare(order: &Order) -> Result<io::Result<Child>, String> {
    let Order { walls, job, user } = order;
    limit_processes(order).map_err(|error| format!("limits: {error}"))?;
    // The program has the same user and must not read the keeper's memory.
    set_dumpable_behavior(DumpableBehavior::NotDumpable)
        .map_err(|error| format!("the keeper: {error}"))?;
    // Restrictions apply to a thread and its children; the keeper itself stays unrestricted.
    std::thread::scope(|scope| {
        let starter = std::thread::Builder::new().spawn_scoped(scope, || {
            // The supervisor must not compete for processor time with the processes that it watches.
            rustix::process::nice(NICENESS).map_err(|error| format!("priority: {error}"))?;
            walls::restrict(walls, job, *user)?;
            Ok(start(order))
        });
        let starter = starter.map_err(|error| format!("the keeper: {error}"))?;
        starter.join().unwrap_or_else(|_| Err("the keeper panicked".to_owned()))
    })
}

fn start(Order { walls, job, .. }: &Order) -> io::Result<Child> {
    let folders = writable(job, walls.namespaces);
    let working = &folders[0];
    let temporary = if walls.namespaces.exist() { "/tmp".into() } else { working.clone() };
    let input = job.input.as_ref().map(|name| File::open(working.join(name))).transpose()?;
    let mut command = Command::new(&job.program);
    command
        .args(&job.arguments)
        .current_dir(working)
        .env_clear()
        .env("PATH", search_path(job))
        .env("LANG", "C.UTF-8")
        .env("HOME", working)
        .env("TMPDIR", temporary)
        .stdin(input.map_or_else(Stdio::null, Stdio::from))
        .process_group(0);
    spawn(&mut command)
}

/// Value of `PATH`: the `bin` folders of the readable paths, then the system's.
fn search_path(job: &Job) -> OsString {
    let own = job.readable.iter().map(|folder| folder.join("bin")).filter(|bin| bin.is_dir());
    let system = ["/usr/local/bin", "/usr/bin", "/bin"].map(PathBuf::from);
    // If a path contains a colon, use the system's folders only.
    env::join_paths(own.chain(system.clone()))
        .or_else(|_| env::join_paths(system))
        .unwrap_or_default()
}

/// Sets the limits of each process, including the keeper.
fn limit_processes(Order { walls, job, user }: &Order) -> rustix::io::Result<()> {
    let limits = &job.limits;
    let at_most = |resource, most: u64| {
        // An ordinary user cannot raise a hard limit.
        let most = getrlimit(resource).maximum.map_or(most, |maximum| maximum.min(most));
        setrlimit(resource, Rlimit { current: Some(most), maximum: Some(most) })
    };
    let seconds = limits.cpu.ceil() as u64;
    setrlimit(Resource::Cpu, Rlimit { current: Some(seconds), maximum: Some(seconds + 1) })?;
    at_most(Resource::Data, limits.memory)?;
    at_most(Resource::Fsize, limits.trace)?;
    at_most(
        Resource::Nofile,
        match job.keep {
            Keep::File(..) | Keep::Each(..) => OPEN_FILES,
            Keep::Tree(_) => OPEN_FILES_OF_BUILDS,
        },
    )?;
    // With a limit of 0, the kernel would still pipe core dumps to the machine's collector (core(5)).
    at_most(Resource::Core, 1)?;
    // The limit counts all processes of the user.
    at_most(Resource::Sigpending, PENDING_SIGNALS)?;
    at_most(Resource::Msgqueue, 0)?;
    at_most(Resource::Memlock, LOCKED)?;
    let others = match user {
        Some(user) if user.is_exclusive => 0,
        Some(User { owner: (user, _), .. }) => threads_of(user.as_raw()),
        // In a user namespace, only those in it.
        None if walls.namespaces.exist() => 0,
        None => threads_of(rustix::process::getuid().as_raw()),
    };
    at_most(Resource::Nproc, limits.processes + KEEPER_THREADS + others)
}

/// Number of threads of a user on the machine.
fn threads_of(user: u32) -> u64 {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let threads = processes.filter_map(|process| {
        let owner = std::os::unix::fs::MetadataExt::uid(&process.metadata().ok()?);
        let tasks = || process.path().join("task").read_dir().map_or(0, Iterator::count);
        (owner == user).then(tasks)
    });
    threads.sum::<usize>() as u64
}

/// Waits for the program, and for orphaned processes.
fn wait_for(child: &Child, job: &Job) -> io::Result<End> {
    let program = Pid::from_child(child);
    let status = loop {
        match rustix::process::wait(WaitOptions::empty()) {
            Ok(Some((ended, status))) if ended == program => break status,
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    };
    let status = std::process::ExitStatus::from_raw(status.as_raw());
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN)?;
    let end = match (status.code(), status.signal()) {
        (Some(code), _) => End::Exited(code),
        (None, Some(libc::SIGXCPU)) if seconds(&usage) >= MIN_CPU_FRACTION * job.limits.cpu => {
            End::Exceeded(Exceeded::Cpu)
        }
        // The kernel sends SIGKILL a second later to a program that ignores SIGXCPU.
        (None, Some(libc::SIGKILL)) if seconds(&usage) >= job.limits.cpu => {
            End::Exceeded(Exceeded::Cpu)
        }
        (None, Some(libc::SIGXFSZ)) => End::Exceeded(Exceeded::Trace),
        (None, signal) => End::Signalled(signal.unwrap_or(0)),
    };
    // A program that cannot allocate memory usually fails.
    let failed = matches!(end, End::Exited(1..) | End::Signalled(_));
    let full = usage.max_rss() as f64 * 1024.0 >= OUT_OF_MEMORY_FRACTION * job.limits.memory as f64;
    Ok(if failed && full { End::Exceeded(Exceeded::Memory) } else { end })
}

/// Processor time in seconds.
fn seconds(usage: &Usage) -> f64 {
    let times = [usage.user_time(), usage.system_time()];
    times.map(|time| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6).iter().sum()
}

/// Kills every other process of this PID namespace and waits for all of them.
fn end_all() {
    loop {
        // Fails if there is none.
        let _ = kill_process_group(Pid::INIT, Signal::KILL);
        if matches!(rustix::process::wait(WaitOptions::empty()), Err(rustix::io::Errno::CHILD)) {
            return;
        }
    }
}
