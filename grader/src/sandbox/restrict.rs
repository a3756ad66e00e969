//! What a thread gives up before it starts a stranger's program, which then has no way to get it back.
//!
//! Landlock (`landlock(7)`) leaves the system's programs and libraries to read and the scratch folder to
//! write. seccomp (`seccomp(2)`) refuses the calls below with `EPERM`, a list rather than its complement, for a
//! program's run-time library may use anything harmless. Both hold for the thread and all it starts.

use std::collections::BTreeMap;
use std::path::Path;

use landlock::{
    ABI, Access, AccessFs, AccessNet, LandlockStatus, Ruleset, RulesetAttr, RulesetCreatedAttr,
    RulesetError, RulesetStatus, Scope, path_beneath_rules,
};
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
    SeccompRule, TargetArch,
};

use super::{Job, Protection};

/// Where systems keep programs, libraries and what these need to start.
pub(super) const SYSTEM: &[&str] = &[
    "/usr",
    "/bin",
    "/sbin",
    "/lib",
    "/lib32",
    "/lib64",
    "/nix/store",
    "/gnu/store",
    "/etc/ld.so.cache",
    "/etc/ld.so.conf",
    "/etc/ld.so.conf.d",
    "/etc/ld.so.preload",
    "/etc/alternatives",
    "/etc/localtime",
    "/sys/devices/system/cpu",
];

/// Devices that programs read and write, and that keep nothing.
const DEVICES: &[&str] = &["/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"];

/// The last version of Landlock whose rights are handled, and of its rules on files.
const FILES: ABI = ABI::V5;

/// With earlier versions files can be truncated.
const FIRST_WITH_TRUNCATION: ABI = ABI::V3;

/// The first version that keeps signals in.
const FIRST_WITH_SIGNALS: ABI = ABI::V6;

/// Calls that are refused whatever their arguments.
const REFUSED: &[i64] = &[
    // The network, sockets of the file system, and what would get around the list.
    libc::SYS_socket,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    // Other processes.
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_process_madvise,
    libc::SYS_process_mrelease,
    libc::SYS_pidfd_open,
    libc::SYS_pidfd_getfd,
    libc::SYS_pidfd_send_signal,
    libc::SYS_kcmp,
    libc::SYS_migrate_pages,
    libc::SYS_move_pages,
    // Memory that no limit of a process counts, and that outlives it.
    libc::SYS_memfd_create,
    libc::SYS_memfd_secret,
    libc::SYS_shmget,
    libc::SYS_msgget,
    libc::SYS_semget,
    libc::SYS_mq_open,
    libc::SYS_add_key,
    libc::SYS_request_key,
    libc::SYS_keyctl,
    // Another view of the system.
    libc::SYS_unshare,
    libc::SYS_setns,
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_pivot_root,
    libc::SYS_chroot,
    libc::SYS_open_tree,
    libc::SYS_move_mount,
    libc::SYS_fsopen,
    libc::SYS_fsconfig,
    libc::SYS_fsmount,
    libc::SYS_fspick,
    libc::SYS_mount_setattr,
    libc::SYS_open_by_handle_at,
    libc::SYS_name_to_handle_at,
    libc::SYS_fanotify_init,
    // The system itself.
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_userfaultfd,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_kexec_load,
    libc::SYS_reboot,
    libc::SYS_swapon,
    libc::SYS_swapoff,
    libc::SYS_acct,
    libc::SYS_quotactl,
    libc::SYS_syslog,
    libc::SYS_sethostname,
    libc::SYS_setdomainname,
    libc::SYS_settimeofday,
    libc::SYS_clock_settime,
    libc::SYS_clock_adjtime,
    libc::SYS_adjtimex,
    libc::SYS_lookup_dcookie,
    libc::SYS_vhangup,
];

/// Signals to others, where nothing else keeps them in.
const SIGNALS: &[i64] =
    &[libc::SYS_kill, libc::SYS_tkill, libc::SYS_rt_sigqueueinfo, libc::SYS_rt_tgsigqueueinfo];

/// Flags of `clone` that ask for a world of one's own.
const NEW_NAMESPACES: &[i32] = &[
    libc::CLONE_NEWUSER,
    libc::CLONE_NEWPID,
    libc::CLONE_NEWNET,
    libc::CLONE_NEWNS,
    libc::CLONE_NEWIPC,
    libc::CLONE_NEWUTS,
    libc::CLONE_NEWCGROUP,
];

/// Restricts the calling thread, and returns what is then in force. `isolated`: whether it sees no other
/// processes and no network.
pub(super) fn thread(job: &Job, isolated: bool) -> Result<Vec<Protection>, String> {
    let version = files(job).map_err(|error| format!("Landlock: {error}"))?;
    let signals_stay = isolated || version >= FIRST_WITH_SIGNALS;
    let calls = calls(signals_stay).map_err(|error| format!("seccomp: {error}"))?;
    let in_force = |protection: &Protection| match protection {
        Protection::Files => version >= FIRST_WITH_TRUNCATION,
        Protection::Network => isolated || calls,
        Protection::Signals => signals_stay || calls,
        Protection::Processes => isolated,
        Protection::SystemCalls => calls,
        Protection::Limits => Path::new("/proc/thread-self/children").exists(),
    };
    Ok(Protection::ALL.into_iter().filter(in_force).collect())
}

/// Leaves the thread the files that it needs. Returns the version that the kernel offers.
fn files(job: &Job) -> Result<ABI, RulesetError> {
    let all = AccessFs::from_all(FILES);
    let special =
        AccessFs::MakeChar | AccessFs::MakeBlock | AccessFs::MakeSock | AccessFs::MakeFifo;
    let read = AccessFs::from_read(FILES);
    let devices = AccessFs::ReadFile | AccessFs::WriteFile;
    let status = Ruleset::default()
        .handle_access(all)?
        .handle_access(AccessNet::from_all(ABI::V4))?
        .scope(Scope::from_all(FIRST_WITH_SIGNALS))?
        .create()?
        .add_rules(path_beneath_rules(SYSTEM, read))?
        .add_rules(path_beneath_rules(DEVICES, devices))?
        .add_rules(path_beneath_rules(&job.readable, read))?
        .add_rules(path_beneath_rules([&job.scratch], all & !special))?
        .restrict_self()?;
    Ok(match (status.ruleset, status.landlock) {
        (RulesetStatus::NotEnforced, _) => ABI::Unsupported,
        (_, LandlockStatus::Available { effective_abi, .. }) => effective_abi,
        _ => ABI::Unsupported,
    })
}

/// Refuses the thread the calls above; false where the kernel offers no filters.
fn calls(signals_stay: bool) -> Result<bool, seccompiler::Error> {
    let architecture = TargetArch::try_from(std::env::consts::ARCH)?;
    // Whoever asks `clone3`, whose flags no filter can see, is sent back to `clone`.
    let unknown = rules_of([(libc::SYS_clone3, vec![])]);
    let missing = SeccompAction::Errno(libc::ENOSYS as u32);
    let refused = SeccompAction::Errno(libc::EPERM as u32);
    for (rules, action) in [(refused_calls(signals_stay)?, refused), (unknown, missing)] {
        let filter = SeccompFilter::new(rules, SeccompAction::Allow, action, architecture)?;
        match seccompiler::apply_filter(&BpfProgram::try_from(filter)?) {
            Ok(()) => {}
            Err(seccompiler::Error::Seccomp(_)) => return Ok(false),
            Err(error) => return Err(error),
        }
    }
    Ok(true)
}

type Rules = BTreeMap<i64, Vec<SeccompRule>>;

fn refused_calls(signals_stay: bool) -> Result<Rules, seccompiler::Error> {
    let one = |argument, operation, value: u64| -> Result<SeccompRule, seccompiler::Error> {
        let condition = SeccompCondition::new(argument, SeccompCmpArgLen::Dword, operation, value)?;
        Ok(SeccompRule::new(vec![condition])?)
    };
    let worlds = NEW_NAMESPACES.iter().map(|flag| {
        let flag = u64::from(flag.cast_unsigned());
        one(0, SeccompCmpOp::MaskedEq(flag), flag)
    });
    let mut calls: Vec<(i64, Vec<SeccompRule>)> =
        REFUSED.iter().map(|call| (*call, vec![])).collect();
    calls.push((libc::SYS_clone, worlds.collect::<Result<_, _>>()?));
    // Limits of other processes.
    calls.push((libc::SYS_prlimit64, vec![one(0, SeccompCmpOp::Ne, 0)?]));
    if !signals_stay {
        calls.extend(SIGNALS.iter().map(|call| (*call, vec![])));
        // `abort` has to work.
        let others = one(2, SeccompCmpOp::Ne, libc::SIGABRT as u64)?;
        calls.push((libc::SYS_tgkill, vec![others]));
    }
    Ok(rules_of(calls))
}

/// With the numbers that the same calls have in the x32 ABI.
fn rules_of(calls: impl IntoIterator<Item = (i64, Vec<SeccompRule>)>) -> Rules {
    let mut rules = Rules::new();
    for (call, conditions) in calls {
        if cfg!(target_arch = "x86_64") {
            rules.insert(call | 0x4000_0000, conditions.clone());
        }
        rules.insert(call, conditions);
    }
    rules
}
