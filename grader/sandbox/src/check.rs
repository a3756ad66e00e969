//! Finds the strongest protection that the system grants, and tests each part from the inside: runs this program under
//! protection and tries the forbidden actions.

use std::fs::{self, Permissions};
use std::io::{self, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use rustix::fs::inotify::{self, CreateFlags};
use rustix::process::{Pid, Resource, getppid, getrlimit, test_kill_process};
use serde::{Deserialize, Serialize};

use super::cgroup::Groups;
use super::landlock::{self, Reach};
use super::starter::Starters;
use super::walls::{self, Namespaces, Walls};
use super::{
    End, Job, Keep, Limits, Outcome, Protected, Protection, SandboxError, scratch, supervisor,
};

/// First argument of the test program.
pub(super) const CHECK: &str = "--sandbox-check";

/// Time limit of the test program, in seconds.
const LONGEST: f64 = 30.0;

/// Timeout of a connection.
const CONNECTION: Duration = Duration::from_millis(200);

/// Targets that must be out of reach.
#[derive(Debug, Serialize, Deserialize)]
struct Targets {
    /// A world-readable file.
    file: PathBuf,
    /// A world-readable file in a folder that only its owner may open.
    closed: PathBuf,
    /// A port of the loopback interface with a listener.
    port: u16,
    /// A process of the same user.
    process: i32,
    /// Limit of processor time, in seconds.
    cpu: u64,
}

/// The strongest protection that the system grants.
pub(super) fn strongest(launcher: &Path) -> Result<Protected, SandboxError> {
    let launcher = fs::canonicalize(launcher)
        .map_err(|error| SandboxError(format!("{}: {error}", launcher.display())))?;
    let landlock = offers_landlock();
    let (groups, no_group) = match Groups::find(&launcher) {
        Ok(groups) => (Some(groups), None),
        Err(reason) => (None, Some(reason)),
    };
    let system = walls::system();
    let starters = Starters::new(launcher.clone());
    let candidates: &[(Namespaces, bool)] = if rustix::process::geteuid().is_root() {
        &[(Namespaces::Privileged, true), (Namespaces::None, true), (Namespaces::None, false)]
    } else {
        &[(Namespaces::User, false), (Namespaces::None, false)]
    };
    let mut refused: Vec<String> = no_group.into_iter().collect();
    for &(namespaces, own_user) in candidates {
        let (groups, system) = (groups.clone(), system.clone());
        let walls = Walls { namespaces, own_user, landlock, groups, system };
        match test(&starters, &launcher, &walls) {
            Ok(protections) => {
                if !landlock && !protections.contains(&Protection::Files) {
                    refused.push("Landlock: the kernel does not offer it".to_owned());
                }
                let refused = (!refused.is_empty()).then(|| refused.join("; "));
                return Ok(Protected { starters, walls, protections, refused });
            }
            Err(SandboxError(error)) => refused.push(error),
        }
    }
    Err(SandboxError(refused.join("; ")))
}

/// Whether the kernel offers Landlock, tried in a separate thread.
fn offers_landlock() -> bool {
    let restricted = std::thread::spawn(|| {
        landlock::restrict(&Reach {
            readable: Vec::new(),
            devices: Vec::new(),
            writable: Vec::new(),
        })
    });
    restricted.join().is_ok_and(|in_force| in_force.is_ok_and(|in_force| in_force.files))
}

/// The protections that hold under these restrictions.
fn test(
    starters: &Starters,
    launcher: &Path,
    walls: &Walls,
) -> Result<Vec<Protection>, SandboxError> {
    let folder = scratch::scratch_folder().map_err(SandboxError::no_scratch)?;
    let fail = |error: io::Error| SandboxError(format!("the test of protections: {error}"));
    let (working, file) = (folder.path().join("work"), folder.path().join("file"));
    fs::create_dir(&working).map_err(fail)?;
    fs::write(&file, "out of reach").map_err(fail)?;
    // Make them world-readable, so that only the sandbox can keep the program out.
    let everybody = |path: &Path, mode| fs::set_permissions(path, Permissions::from_mode(mode));
    everybody(&file, 0o666).and_then(|()| everybody(folder.path(), 0o777)).map_err(fail)?;
    let closed = folder.path().join("closed").join("file");
    let close = |folder: &Path| {
        fs::create_dir(folder)?;
        fs::copy(&file, &closed)?;
        everybody(folder, 0o700)
    };
    closed.parent().map_or(Ok(()), close).map_err(fail)?;
    // The run's own user may be unable to reach the launcher in its place.
    const EXECUTABLE: u32 = 0o005;
    let mode = fs::metadata(launcher).map_err(fail)?.mode();
    let reachable = walls.namespaces.exist() && mode & EXECUTABLE == EXECUTABLE;
    let program = if walls.own_user && !reachable {
        folder.path().join("launcher")
    } else {
        launcher.to_path_buf()
    };
    if program != launcher {
        fs::copy(launcher, &program).map_err(fail)?;
    }
    let before = fs::metadata(&file).map_err(fail)?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0));
    let limits = Limits { wall: LONGEST, ..Limits::default() };
    let targets = Targets {
        file: file.clone(),
        closed,
        port: listener.as_ref().ok().and_then(|at| at.local_addr().ok()).map_or(0, |at| at.port()),
        process: std::process::id().cast_signed(),
        cpu: limits.cpu.ceil() as u64 + 1,
    };
    let targets = serde_json::to_string(&targets).map_err(|error| fail(error.into()))?;
    let job = Job {
        program: program.clone(),
        arguments: vec![CHECK.into(), targets.into()],
        folder: working,
        input: None,
        keep: Keep::File("nothing".to_owned(), folder.path().join("nothing")),
        readable: vec![program],
        limits,
    };
    let Outcome { end, stdout, stderr, .. } = supervisor::run(starters, walls, &job)?;
    if end != End::Exited(0) {
        let said = stderr.text.trim();
        return Err(SandboxError(format!("the test of protections ended with {end:?} {said}")));
    }
    let mut protections: Vec<Protection> =
        serde_json::from_str(&stdout.text).map_err(|error| fail(error.into()))?;
    let after = fs::metadata(&file).map_err(fail)?;
    let attributes = |of: &fs::Metadata| (of.mode(), of.uid(), of.gid(), of.mtime(), of.ctime());
    let unchanged = attributes(&before) == attributes(&after);
    // A program that runs as root has nearly all rights, and can create files that others run as root.
    let is_root = rustix::process::geteuid().is_root() && !walls.own_user;
    // The supervisor uses these files to track processes.
    let followed = Path::new("/proc/thread-self/children").exists();
    let has_files = unchanged && !is_root && protections.contains(&Protection::Files);
    protections.retain(|protection| match protection {
        Protection::Files => has_files,
        Protection::ClosedFolders => walls.own_user && !has_files,
        // The kernel does not limit the number of root's processes.
        Protection::Limits => followed && !is_root,
        // A run does not begin outside its group.
        Protection::Memory => walls.groups.is_some(),
        _ => true,
    });
    Ok(protections)
}

/// Tries the forbidden actions and prints the protections that hold.
pub(super) fn serve() -> io::Result<()> {
    let argument = std::env::args().nth(2).unwrap_or_default();
    let targets: Targets = serde_json::from_str(&argument)?;
    let all = Protection::ALL.into_iter().chain([Protection::ClosedFolders]);
    let held: Vec<Protection> = all.filter(|protection| holds(*protection, &targets)).collect();
    io::stdout().write_all(&serde_json::to_vec(&held)?)
}

fn holds(protection: Protection, targets: &Targets) -> bool {
    // The keeper is process 1 only in a new PID namespace.
    let alone = getppid() == Some(Pid::INIT);
    match protection {
        Protection::Files => {
            let beside = targets.file.with_file_name("made");
            // The grader compares the attributes afterwards.
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
        // The supervisor knows.
        Protection::Memory => true,
        Protection::ClosedFolders => {
            fs::read(&targets.closed).is_err() && fs::write(&targets.closed, "reached").is_err()
        }
    }
}
