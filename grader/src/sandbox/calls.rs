//! The system calls that a program may make, as a seccomp filter (`seccomp(2)`).
//!
//! The list holds what the C libraries, the run-time systems of C, C++, Rust, Python, Java and Node, and their
//! compilers use. The kernel answers every other call with `ENOSYS`, as a kernel would that does not know it, so that
//! libraries fall back to an older one; that goes for calls of kernels to come, and for the x32 ABI. A call of another
//! architecture kills the process.

use std::collections::BTreeMap;

use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition,
    SeccompFilter, SeccompRule, TargetArch,
};

/// What a filter depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Policy {
    /// The keeper is process 1, and no process outside can be named.
    pub(super) isolated: bool,
    /// Signals reach no process outside of the run.
    pub(super) signals_stay: bool,
    /// Modes, owners and times of files outside cannot be changed: they are on read-only mounts, or another user's.
    pub(super) attributes_stay: bool,
    /// It is a build: it may lock files.
    pub(super) builds: bool,
}

/// Calls without conditions.
#[rustfmt::skip]
const ALLOWED: &[i64] = &[
    // Reading and writing.
    libc::SYS_read, libc::SYS_write, libc::SYS_readv, libc::SYS_writev, libc::SYS_pread64, libc::SYS_pwrite64,
    libc::SYS_preadv, libc::SYS_pwritev, libc::SYS_preadv2, libc::SYS_pwritev2, libc::SYS_lseek, libc::SYS_sendfile,
    libc::SYS_copy_file_range, libc::SYS_splice, libc::SYS_tee, libc::SYS_fsync, libc::SYS_fdatasync,
    libc::SYS_sync_file_range, libc::SYS_fadvise64, libc::SYS_ftruncate, libc::SYS_truncate, libc::SYS_fallocate,
    // Files.
    libc::SYS_openat, libc::SYS_openat2, libc::SYS_close, libc::SYS_close_range, libc::SYS_dup, libc::SYS_dup3,
    libc::SYS_newfstatat, libc::SYS_fstat, libc::SYS_statx, libc::SYS_statfs, libc::SYS_fstatfs, libc::SYS_faccessat,
    libc::SYS_faccessat2, libc::SYS_readlinkat, libc::SYS_getdents64, libc::SYS_getcwd, libc::SYS_chdir,
    libc::SYS_fchdir, libc::SYS_mkdirat, libc::SYS_unlinkat, libc::SYS_linkat, libc::SYS_symlinkat,
    libc::SYS_renameat, libc::SYS_renameat2, libc::SYS_umask, libc::SYS_getxattr, libc::SYS_lgetxattr,
    libc::SYS_fgetxattr, libc::SYS_listxattr, libc::SYS_llistxattr, libc::SYS_flistxattr,
    // Pipes, events and pairs of sockets.
    libc::SYS_pipe2, libc::SYS_ppoll, libc::SYS_pselect6, libc::SYS_epoll_create1, libc::SYS_epoll_ctl,
    libc::SYS_epoll_pwait, libc::SYS_epoll_pwait2, libc::SYS_eventfd2, libc::SYS_signalfd4, libc::SYS_timerfd_create,
    libc::SYS_timerfd_settime, libc::SYS_timerfd_gettime, libc::SYS_sendto, libc::SYS_recvfrom, libc::SYS_sendmsg,
    libc::SYS_recvmsg, libc::SYS_shutdown, libc::SYS_getsockname, libc::SYS_getpeername, libc::SYS_getsockopt,
    // Memory.
    libc::SYS_mmap, libc::SYS_munmap, libc::SYS_mprotect, libc::SYS_mremap, libc::SYS_brk, libc::SYS_madvise,
    libc::SYS_msync, libc::SYS_mlock, libc::SYS_mlock2, libc::SYS_munlock, libc::SYS_mlockall, libc::SYS_munlockall,
    libc::SYS_membarrier, libc::SYS_get_mempolicy, libc::SYS_set_mempolicy, libc::SYS_mbind, libc::SYS_pkey_alloc,
    libc::SYS_pkey_free, libc::SYS_pkey_mprotect, libc::SYS_mseal,
    // Processes and threads.
    libc::SYS_execve, libc::SYS_execveat, libc::SYS_exit, libc::SYS_exit_group, libc::SYS_wait4, libc::SYS_waitid,
    libc::SYS_getpid, libc::SYS_getppid, libc::SYS_gettid, libc::SYS_getpgid, libc::SYS_setpgid, libc::SYS_getsid,
    libc::SYS_setsid, libc::SYS_getuid, libc::SYS_geteuid, libc::SYS_getgid, libc::SYS_getegid, libc::SYS_getresuid,
    libc::SYS_getresgid, libc::SYS_getgroups, libc::SYS_setuid, libc::SYS_setgid, libc::SYS_setresuid,
    libc::SYS_setresgid, libc::SYS_setreuid, libc::SYS_setregid, libc::SYS_capget, libc::SYS_prctl,
    libc::SYS_set_tid_address, libc::SYS_set_robust_list, libc::SYS_get_robust_list, libc::SYS_rseq, libc::SYS_futex,
    libc::SYS_futex_waitv, FUTEX_WAKE, FUTEX_WAIT, FUTEX_REQUEUE, libc::SYS_restart_syscall,
    libc::SYS_sched_yield, libc::SYS_sched_getaffinity, libc::SYS_sched_getparam, libc::SYS_sched_getscheduler,
    libc::SYS_sched_getattr, libc::SYS_sched_get_priority_max, libc::SYS_sched_get_priority_min,
    libc::SYS_sched_rr_get_interval, libc::SYS_getpriority, libc::SYS_getrlimit, libc::SYS_setrlimit,
    libc::SYS_getrusage, libc::SYS_times, libc::SYS_sysinfo, libc::SYS_uname, libc::SYS_getcpu, libc::SYS_getrandom,
    // Signals of one's own.
    libc::SYS_rt_sigaction, libc::SYS_rt_sigprocmask, libc::SYS_rt_sigreturn, libc::SYS_rt_sigpending,
    libc::SYS_rt_sigtimedwait, libc::SYS_rt_sigsuspend, libc::SYS_sigaltstack,
    // Time.
    libc::SYS_nanosleep, libc::SYS_clock_nanosleep, libc::SYS_clock_gettime, libc::SYS_clock_getres,
    libc::SYS_gettimeofday, libc::SYS_getitimer, libc::SYS_setitimer, libc::SYS_timer_create, libc::SYS_timer_settime,
    libc::SYS_timer_gettime, libc::SYS_timer_getoverrun, libc::SYS_timer_delete,
];

/// Calls that only older architectures have.
#[cfg(target_arch = "x86_64")]
#[rustfmt::skip]
const ALLOWED_HERE: &[i64] = &[
    libc::SYS_open, libc::SYS_creat, libc::SYS_stat, libc::SYS_lstat, libc::SYS_access, libc::SYS_readlink,
    libc::SYS_mkdir, libc::SYS_rmdir, libc::SYS_unlink, libc::SYS_link, libc::SYS_symlink, libc::SYS_rename,
    libc::SYS_getdents, libc::SYS_dup2, libc::SYS_pipe, libc::SYS_select, libc::SYS_poll, libc::SYS_epoll_create,
    libc::SYS_epoll_wait, libc::SYS_eventfd, libc::SYS_signalfd, libc::SYS_fork, libc::SYS_vfork, libc::SYS_getpgrp,
    libc::SYS_pause, libc::SYS_alarm, libc::SYS_time, libc::SYS_arch_prctl, MAP_SHADOW_STACK,
];
#[cfg(not(target_arch = "x86_64"))]
const ALLOWED_HERE: &[i64] = &[];

// Too new for every version of the C library; the numbers are those of all architectures.
#[cfg(target_arch = "x86_64")]
const MAP_SHADOW_STACK: i64 = 453;
const FUTEX_WAKE: i64 = 454;
const FUTEX_WAIT: i64 = 455;
const FUTEX_REQUEUE: i64 = 456;
const FCHMODAT2: i64 = 452;

/// Signals to processes by their number.
const SIGNALS: &[i64] =
    &[libc::SYS_kill, libc::SYS_tkill, libc::SYS_rt_sigqueueinfo, libc::SYS_rt_tgsigqueueinfo];

/// Modes, owners and times of files.
#[rustfmt::skip]
const ATTRIBUTES: &[i64] = &[
    libc::SYS_fchmod, libc::SYS_fchmodat, FCHMODAT2, libc::SYS_fchown, libc::SYS_fchownat, libc::SYS_utimensat,
    #[cfg(target_arch = "x86_64")] libc::SYS_chmod,
    #[cfg(target_arch = "x86_64")] libc::SYS_chown,
    #[cfg(target_arch = "x86_64")] libc::SYS_lchown,
    #[cfg(target_arch = "x86_64")] libc::SYS_utime,
    #[cfg(target_arch = "x86_64")] libc::SYS_utimes,
    #[cfg(target_arch = "x86_64")] libc::SYS_futimesat,
];

/// Calls that only an attack makes. They kill the process.
const KILLED: &[i64] = &[
    libc::SYS_kexec_load,
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    libc::SYS_kexec_file_load,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_reboot,
    libc::SYS_swapon,
    libc::SYS_swapoff,
];

/// Flags of `clone` that ask for namespaces.
const NAMESPACES: i32 = libc::CLONE_NEWUSER
    | libc::CLONE_NEWPID
    | libc::CLONE_NEWNET
    | libc::CLONE_NEWNS
    | libc::CLONE_NEWIPC
    | libc::CLONE_NEWUTS
    | libc::CLONE_NEWCGROUP;

/// Operations of `fcntl` on descriptors alone: no locks, leases or signals.
const DESCRIPTORS: &[i32] = &[
    libc::F_DUPFD,
    libc::F_GETFD,
    libc::F_SETFD,
    libc::F_GETFL,
    libc::F_SETFL,
    libc::F_DUPFD_CLOEXEC,
    libc::F_GETPIPE_SZ,
    libc::F_SETPIPE_SZ,
    libc::F_ADD_SEALS,
    libc::F_GET_SEALS,
];

/// Operations of `fcntl` on locks, which other runs see.
const LOCKS: &[i32] = &[
    libc::F_GETLK,
    libc::F_SETLK,
    libc::F_SETLKW,
    libc::F_OFD_GETLK,
    libc::F_OFD_SETLK,
    libc::F_OFD_SETLKW,
];

/// Operations of `ioctl` on descriptors, and questions about terminals.
const CONTROLS: &[u64] = &[
    libc::TCGETS as u64,
    0x802c_542a, // TCGETS2
    libc::TIOCGWINSZ as u64,
    libc::TIOCGPGRP as u64,
    libc::FIONREAD as u64,
    libc::FIONBIO as u64,
    libc::FIOCLEX as u64,
    libc::FIONCLEX as u64,
    0x4004_9409, // FICLONE
];

type Rules = BTreeMap<i64, Vec<SeccompRule>>;

/// Restricts the calling thread, and what it starts, to the calls above.
///
/// # Errors
/// Where the kernel has no filters.
pub(super) fn restrict(policy: Policy) -> Result<(), Error> {
    let errno = |number: i32| SeccompAction::Errno(number.cast_unsigned());
    let unconditionally = |calls: &[i64]| calls.iter().map(|call| (*call, vec![])).collect();
    // Of several filters, the strictest answer counts. The last one lets no further filter be added.
    if !policy.attributes_stay {
        // With the answer "done", for linkers and build tools do not go on without.
        apply(unconditionally(ATTRIBUTES), SeccompAction::Allow, errno(0))?;
    }
    let sockets = unconditionally(&[libc::SYS_socket]);
    apply(sockets, SeccompAction::Allow, errno(libc::EACCES))?;
    apply(unconditionally(KILLED), SeccompAction::Allow, SeccompAction::KillProcess)?;
    apply(allowed(policy)?, errno(libc::ENOSYS), SeccompAction::Allow)
}

fn apply(rules: Rules, otherwise: SeccompAction, matching: SeccompAction) -> Result<(), Error> {
    let architecture = TargetArch::try_from(std::env::consts::ARCH)?;
    let filter = SeccompFilter::new(rules, otherwise, matching, architecture)?;
    seccompiler::apply_filter(&BpfProgram::try_from(filter)?)
}

fn allowed(policy: Policy) -> Result<Rules, Error> {
    let equal = |argument, value: u64| rule(&[(argument, SeccompCmpOp::Eq, value)]);
    let any = |argument, values: &[u64]| -> Result<Vec<SeccompRule>, Error> {
        values.iter().map(|value| equal(argument, *value)).collect()
    };
    let operations = |values: &[i32]| -> Vec<u64> {
        values.iter().map(|value| u64::from(value.cast_unsigned())).collect()
    };
    let mut rules: Rules =
        ALLOWED.iter().chain(ALLOWED_HERE).map(|call| (*call, vec![])).collect();

    let namespaces = u64::from(NAMESPACES.cast_unsigned());
    rules.insert(
        libc::SYS_clone,
        vec![rule(&[(0, SeccompCmpOp::MaskedEq(namespaces), 0)])?],
    );
    // Rust's standard library starts processes with a pair of the second kind.
    let pair = |kind: i32| {
        // Without its flags.
        const KIND: u64 = 0xf;
        let [unix, kind] = [libc::AF_UNIX, kind].map(|number| u64::from(number.cast_unsigned()));
        rule(&[(0, SeccompCmpOp::Eq, unix), (1, SeccompCmpOp::MaskedEq(KIND), kind)])
    };
    let pairs = vec![pair(libc::SOCK_STREAM)?, pair(libc::SOCK_SEQPACKET)?];
    rules.insert(libc::SYS_socketpair, pairs);
    let mut fcntl = any(1, &operations(DESCRIPTORS))?;
    if policy.builds {
        fcntl.extend(any(1, &operations(LOCKS))?);
        rules.insert(libc::SYS_flock, vec![]);
    }
    rules.insert(libc::SYS_fcntl, fcntl);
    rules.insert(libc::SYS_ioctl, any(1, CONTROLS)?);
    const ASK: u64 = 0xffff_ffff;
    rules.insert(libc::SYS_personality, any(0, &[0, ASK])?);

    // Of no process but itself: limits, priority.
    rules.insert(libc::SYS_prlimit64, vec![equal(0, 0)?]);
    let process = u64::from(libc::PRIO_PROCESS);
    rules.insert(
        libc::SYS_setpriority,
        vec![rule(&[(0, SeccompCmpOp::Eq, process), (1, SeccompCmpOp::Eq, 0)])?],
    );
    // Libraries name their threads here, which are among the run's own processes. The keeper is not.
    let own = if policy.isolated { rule(&[(0, SeccompCmpOp::Ne, 1)])? } else { equal(0, 0)? };
    for call in [
        libc::SYS_sched_setaffinity,
        libc::SYS_sched_setscheduler,
        libc::SYS_sched_setparam,
        libc::SYS_sched_setattr,
    ] {
        rules.insert(call, vec![own.clone()]);
    }
    // `abort` has to work.
    let abort = equal(2, libc::SIGABRT.cast_unsigned().into())?;
    rules.insert(libc::SYS_tgkill, vec![abort]);
    if policy.signals_stay {
        rules.extend(SIGNALS.iter().chain(&[libc::SYS_tgkill]).map(|call| (*call, vec![])));
    }
    // Answered by the other filters.
    rules.extend(ATTRIBUTES.iter().chain(&[libc::SYS_socket]).map(|call| (*call, vec![])));
    Ok(rules)
}

/// All of these conditions on arguments: number, comparison, value. The upper half of an argument does not count:
/// the kernel reads these as 32 bits.
fn rule(conditions: &[(u8, SeccompCmpOp, u64)]) -> Result<SeccompRule, Error> {
    let condition = |(argument, operation, value): &(u8, SeccompCmpOp, u64)| {
        SeccompCondition::new(*argument, SeccompCmpArgLen::Dword, operation.clone(), *value)
    };
    Ok(SeccompRule::new(conditions.iter().map(condition).collect::<Result<_, _>>()?)?)
}
