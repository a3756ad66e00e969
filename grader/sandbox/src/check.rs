//! Finds the strongest protection that the system grants, and tests each part of it from the inside: a program, which
//! is this one, is run under it and tries what it is to be kept from.

use std::fs::{self, Permissions};
use std::io::{self, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use rustix::fs::inotify::{self, CreateFlags};
use rustix::process::{Pid, Resource, getppid, getrlimit, test_kill_process};
use serde::{Deserialize, Serialize};

use super::landlock::{self, Reach};
use super::walls::{self, Namespaces, Walls};
use super::{
    End, Job, Keep, Limits, Outcome, Protected, Protection, SandboxError, scratch, supervisor,
};

/// The first word of the command line of the program that tries.
pub(super) const CHECK: &str = "--sandbox-check";

/// The time that a connection has.
const CONNECTION: Duration = Duration::from_millis(200);

/// What is to be out of reach.
#[derive(Debug, Serialize, Deserialize)]
struct Targets {
    /// A file that all may read.
    file: PathBuf,
    /// A port of the loopback interface on which somebody listens.
    port: u16,
    /// A process of the same user.
    process: i32,
    /// Seconds of processor time that the program may have.
    cpu: u64,
}

/// The strongest protection that is granted.
pub(super) fn strongest(launcher: &Path) -> Result<Protected, SandboxError> {
    let launcher = fs::canonicalize(launcher)
        .map_err(|error| SandboxError(format!("{}: {error}", launcher.display())))?;
    let landlock = offers_landlock();
    let control_group = super::cgroup::delegated();
    let system = walls::system();
    let sweeper = supervisor::Sweeper::start(&launcher)
        .map_err(|error| SandboxError(format!("{}: {error}", launcher.display())))?;
    let candidates: &[(Namespaces, bool)] = match rustix::process::geteuid().is_root() {
        true => {
            &[(Namespaces::Privileged, true), (Namespaces::None, true), (Namespaces::None, false)]
        }
        false => &[(Namespaces::User, false), (Namespaces::None, false)],
    };
    let mut refused: Vec<String> = Vec::new();
    for &(namespaces, own_user) in candidates {
        let (control_group, system) = (control_group.clone(), system.clone());
        let walls = Walls { namespaces, own_user, landlock, control_group, system };
        match test(&launcher, &walls) {
            Ok(protections) => {
                if !landlock && !protections.contains(&Protection::Files) {
                    refused.push("Landlock: the kernel does not offer it".to_owned());
                }
                let refused = (!refused.is_empty()).then(|| refused.join("; "));
                return Ok(Protected { launcher, walls, protections, refused, _sweeper: sweeper });
            }
            Err(SandboxError(error)) => refused.push(error),
        }
    }
    Err(SandboxError(refused.join("; ")))
}

/// Whether the kernel offers Landlock, tried by a thread that does nothing else.
fn offers_landlock() -> bool {
    let restricted = std::thread::spawn(|| {
        landlock::restrict(&Reach { readable: Vec::new(), devices: &[], writable: Vec::new() })
    });
    restricted.join().is_ok_and(|in_force| in_force.is_ok_and(|in_force| in_force.files))
}

/// The protections that hold behind these walls.
fn test(launcher: &Path, walls: &Walls) -> Result<Vec<Protection>, SandboxError> {
    let folder = scratch::scratch_folder().map_err(SandboxError::no_scratch)?;
    let fail = |error: io::Error| SandboxError(format!("the test of protections: {error}"));
    let (working, file) = (folder.path().join("work"), folder.path().join("file"));
    fs::create_dir(&working).map_err(fail)?;
    fs::write(&file, "out of reach").map_err(fail)?;
    // So that nothing but the walls keeps the program from them.
    let everybody = |path: &Path, mode| fs::set_permissions(path, Permissions::from_mode(mode));
    everybody(&file, 0o666).and_then(|()| everybody(folder.path(), 0o777)).map_err(fail)?;
    // A user of its own may not get at the launcher where it is.
    let program = match walls.own_user {
        true => folder.path().join("launcher"),
        false => launcher.to_path_buf(),
    };
    if walls.own_user {
        fs::copy(launcher, &program).map_err(fail)?;
    }
    let before = fs::metadata(&file).map_err(fail)?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0));
    let limits = Limits::default();
    let targets = Targets {
        file: file.clone(),
        port: listener.as_ref().ok().and_then(|at| at.local_addr().ok()).map_or(0, |at| at.port()),
        process: std::process::id().cast_signed(),
        cpu: limits.cpu.ceil() as u64 + 1,
    };
    let targets = serde_json::to_string(&targets).map_err(|error| fail(error.into()))?;
    let job = Job {
        program: program.clone(),
        arguments: vec![CHECK.into(), targets.into()],
        folder: working,
        keep: Keep::File("nothing".to_owned(), folder.path().join("nothing")),
        readable: vec![program],
        limits,
    };
    let Outcome { end, stdout, stderr, .. } = supervisor::run(launcher, walls, &job)?;
    if end != End::Exited(0) {
        let said = stderr.text.trim();
        return Err(SandboxError(format!("the test of protections ended with {end:?} {said}")));
    }
    let mut protections: Vec<Protection> =
        serde_json::from_str(&stdout.text).map_err(|error| fail(error.into()))?;
    let after = fs::metadata(&file).map_err(fail)?;
    let attributes = |of: &fs::Metadata| (of.mode(), of.uid(), of.gid(), of.mtime(), of.ctime());
    let unchanged = attributes(&before) == attributes(&after);
    // A program that runs as root is kept from little, and makes files that others run as root.
    let is_root = rustix::process::geteuid().is_root() && !walls.own_user;
    // What the supervisor follows processes by.
    let followed = Path::new("/proc/thread-self/children").exists();
    protections.retain(|protection| match protection {
        Protection::Files => unchanged && !is_root,
        // The kernel lets root start any number of processes.
        Protection::Limits => followed && !is_root,
        _ => true,
    });
    Ok(protections)
}

/// Tries what a program is to be kept from, and prints the protections that hold.
pub(super) fn serve() -> io::Result<()> {
    let argument = std::env::args().nth(2).unwrap_or_default();
    let targets: Targets = serde_json::from_str(&argument)?;
    let held: Vec<Protection> =
        Protection::ALL.into_iter().filter(|protection| holds(*protection, &targets)).collect();
    io::stdout().write_all(&serde_json::to_vec(&held)?)
}

fn holds(protection: Protection, targets: &Targets) -> bool {
    // The keeper is process 1 only in a PID namespace of its own.
    let alone = getppid() == Some(Pid::INIT);
    match protection {
        Protection::Files => {
            let beside = targets.file.with_file_name("made");
            // The grader compares its attributes afterwards.
            let _ = fs::set_permissions(&targets.file, Permissions::from_mode(0o600));
            let _ = std::os::unix::fs::chown(&targets.file, None, None);
            let _ = fs::File::open(&targets.file).and_then(|file| file.set_modified(UNIX_EPOCH));
            fs::read(&targets.file).is_err()
                && fs::write(&targets.file, "reached").is_err()
                && fs::write(beside, "made").is_err()
        }
        Protection::Network => {
            let address = SocketAddr::from((Ipv4Addr::LOCALHOST, targets.port));
            TcpStream::connect_timeout(&address, CONNECTION).is_err()
        }
        Protection::Signals => {
            alone || Pid::from_raw(targets.process).is_none_or(|it| test_kill_process(it).is_err())
        }
        Protection::Processes => alone,
        Protection::SystemCalls => inotify::init(CreateFlags::empty())
            .is_err_and(|error| error == rustix::io::Errno::NOSYS),
        Protection::Limits => getrlimit(Resource::Cpu).maximum == Some(targets.cpu),
    }
}
