//! Allowed system calls, as a seccomp filter (`seccomp(2)`).
//!
//! The list contains the calls that the C libraries, the run-time systems of C, C++, Rust, Python, Java and Node, and
//! their compilers use. Every other call returns `ENOSYS`, as on a kernel without it, so that libraries fall back to
//! an older call. This includes calls of future kernels and of the x32 ABI. A call of another architecture kills the
//! process.
//!
//! When a filter is installed, the kernel evaluates it for every call number. Calls whose answer does not depend on
//! arguments are therefore found by binary search; the others continue to the part that compares arguments.

use std::collections::BTreeMap;

use seccompiler::{
    BackendError, BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp,
    SeccompCondition, SeccompFilter, SeccompRule, TargetArch, sock_filter,
};

/// Parameters of a filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Policy {
    /// The keeper is process 1; processes outside have no number here.
    pub(super) isolated: bool,
    /// Signals cannot reach processes outside the run.
    pub(super) signals_stay: bool,
    /// The run has its own user, who owns no files outside.
    pub(super) own_user: bool,
    /// The run is a build: it may lock files.
    pub(super) builds: bool,
    /// The kernel counts the memory of the run.
    pub(super) is_counted: bool,
}

/// Calls allowed with any arguments.
#[rustfmt::skip]
const ALLOWED: &[i64] = &[
    // Reading and writing.
    libc::SYS_read, libc::SYS_write, libc::SYS_readv, libc::SYS_writev, libc::SYS_pread64, libc::SYS_pwrite64,
    libc::SYS_preadv, libc::SYS_pwritev, libc::SYS_lseek, libc::SYS_sendfile,
    libc::SYS_copy_file_range, libc::SYS_splice, libc::SYS_tee, libc::SYS_fsync, libc::SYS_fdatasync,
    libc::SYS_ftruncate, libc::SYS_truncate,
    // Files.
    libc::SYS_openat, libc::SYS_close, libc::SYS_close_range, libc::SYS_dup, libc::SYS_dup3,
    libc::SYS_newfstatat, libc::SYS_fstat, libc::SYS_statx, libc::SYS_statfs, libc::SYS_fstatfs, libc::SYS_faccessat,
    libc::SYS_faccessat2, libc::SYS_readlinkat, libc::SYS_getdents64, libc::SYS_getcwd, libc::SYS_chdir,
    libc::SYS_fchdir, libc::SYS_mkdirat, libc::SYS_unlinkat, libc::SYS_linkat, libc::SYS_symlinkat,
    libc::SYS_renameat, libc::SYS_renameat2, libc::SYS_umask, libc::SYS_getxattr, libc::SYS_lgetxattr,
    libc::SYS_fgetxattr, libc::SYS_listxattr, libc::SYS_llistxattr, libc::SYS_flistxattr,
    // Pipes, events and pairs of sockets.
    libc::SYS_pipe2, libc::SYS_ppoll, libc::SYS_pselect6, libc::SYS_epoll_create1, libc::SYS_epoll_ctl,
    libc::SYS_epoll_pwait, libc::SYS_epoll_pwait2, libc::SYS_eventfd2, libc::SYS_signalfd4, libc::SYS_timerfd_create,
    libc::SYS_timerfd_settime, libc::SYS_timerfd_gettime, libc::SYS_sendto, libc::SYS_recvfrom, libc::SYS_sendmsg,
    libc::SYS_recvmsg, libc::SYS_shutdown, libc::SYS_getsockname, libc::SYS_getpeername,
    // Memory.
    libc::SYS_munmap, libc::SYS_mprotect, libc::SYS_mremap, libc::SYS_brk, libc::SYS_madvise,
    libc::SYS_msync, libc::SYS_mlock, libc::SYS_mlock2, libc::SYS_munlock, libc::SYS_mlockall, libc::SYS_munlockall,
    libc::SYS_membarrier, libc::SYS_get_mempolicy, libc::SYS_set_mempolicy, libc::SYS_mbind, libc::SYS_pkey_alloc,
    libc::SYS_pkey_free, libc::SYS_pkey_mprotect, libc::SYS_mseal,
    // Processes and threads.
    libc::SYS_execve, libc::SYS_execveat, libc::SYS_exit, libc::SYS_exit_group, libc::SYS_wait4, libc::SYS_waitid,
    libc::SYS_getpid, libc::SYS_getppid, libc::SYS_gettid, libc::SYS_getpgid, libc::SYS_setpgid, libc::SYS_getsid,
    libc::SYS_setsid, libc::SYS_getuid, libc::SYS_geteuid, libc::SYS_getgid, libc::SYS_getegid, libc::SYS_getresuid,
    libc::SYS_getresgid, libc::SYS_getgroups, libc::SYS_setuid, libc::SYS_setgid, libc::SYS_setresuid,
    libc::SYS_setresgid, libc::SYS_setreuid, libc::SYS_setregid, libc::SYS_capget,
    libc::SYS_set_tid_address, libc::SYS_set_robust_list, libc::SYS_get_robust_list, libc::SYS_rseq, libc::SYS_futex,
    libc::SYS_futex_waitv, FUTEX_WAKE, FUTEX_WAIT, FUTEX_REQUEUE, libc::SYS_restart_syscall,
    libc::SYS_sched_yield, libc::SYS_sched_getaffinity, libc::SYS_sched_getparam, libc::SYS_sched_getscheduler,
    libc::SYS_sched_getattr, libc::SYS_sched_get_priority_max, libc::SYS_sched_get_priority_min,
    libc::SYS_sched_rr_get_interval, libc::SYS_getpriority, libc::SYS_getrlimit, libc::SYS_setrlimit,
    libc::SYS_getrusage, libc::SYS_times, libc::SYS_sysinfo, libc::SYS_uname, libc::SYS_getcpu, libc::SYS_getrandom,
    // Signals to the process itself.
    libc::SYS_rt_sigaction, libc::SYS_rt_sigprocmask, libc::SYS_rt_sigreturn, libc::SYS_rt_sigpending,
    libc::SYS_rt_sigtimedwait, libc::SYS_rt_sigsuspend, libc::SYS_sigaltstack,
    // Time.
    libc::SYS_nanosleep, libc::SYS_clock_nanosleep, libc::SYS_clock_gettime, libc::SYS_clock_getres,
    libc::SYS_gettimeofday, libc::SYS_getitimer, libc::SYS_setitimer, libc::SYS_timer_create, libc::SYS_timer_settime,
    libc::SYS_timer_gettime, libc::SYS_timer_getoverrun, libc::SYS_timer_delete,
];

/// Calls that exist only on older architectures.
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

// Too new for some versions of the C library; the numbers are the same on all architectures.
#[cfg(target_arch = "x86_64")]
const MAP_SHADOW_STACK: i64 = 453;
const FUTEX_WAKE: i64 = 454;
const FUTEX_WAIT: i64 = 455;
const FUTEX_REQUEUE: i64 = 456;
const FCHMODAT2: i64 = 452;

/// Signals to processes by number.
const SIGNALS: &[i64] =
    &[libc::SYS_kill, libc::SYS_tkill, libc::SYS_rt_sigqueueinfo, libc::SYS_rt_tgsigqueueinfo];

/// Calls that change file modes, which only the owner may do, and the index of the mode argument.
#[rustfmt::skip]
const MODES: &[(i64, u8)] = &[
    (libc::SYS_fchmod, 1), (libc::SYS_fchmodat, 2), (FCHMODAT2, 2),
    #[cfg(target_arch = "x86_64")] (libc::SYS_chmod, 1),
];

/// Calls that change owners and times of files. Anyone may set neither owner nor group, which changes a time; so does
/// a write to a world-writable file.
#[rustfmt::skip]
const ATTRIBUTES: &[i64] = &[
    libc::SYS_fchown, libc::SYS_fchownat, libc::SYS_utimensat,
    #[cfg(target_arch = "x86_64")] libc::SYS_chown,
    #[cfg(target_arch = "x86_64")] libc::SYS_lchown,
    #[cfg(target_arch = "x86_64")] libc::SYS_utime,
    #[cfg(target_arch = "x86_64")] libc::SYS_utimes,
    #[cfg(target_arch = "x86_64")] libc::SYS_futimesat,
];

/// Calls that create files, with the indices of the arguments for flags (if any) and mode.
#[rustfmt::skip]
const MAKING: &[(i64, Option<u8>, u8)] = &[
    (libc::SYS_openat, Some(2), 3), (libc::SYS_mkdirat, None, 2),
    #[cfg(target_arch = "x86_64")] (libc::SYS_open, Some(1), 2),
    #[cfg(target_arch = "x86_64")] (libc::SYS_creat, None, 1),
    #[cfg(target_arch = "x86_64")] (libc::SYS_mkdir, None, 1),
];

/// Advice about the page cache, which all runs share. It is accepted and has no effect.
const ADVICE: &[i64] = &[libc::SYS_fadvise64, libc::SYS_sync_file_range];

/// Calls that read and write with flags, the argument 5.
const FLAGGED: &[i64] = &[libc::SYS_preadv2, libc::SYS_pwritev2];

/// Flags that do not ask about the page cache.
const HARMLESS_FLAGS: i32 = libc::RWF_HIPRI | libc::RWF_DSYNC | libc::RWF_SYNC | libc::RWF_APPEND;

/// Calls that only an attack would make. They kill the process.
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

/// Flags of `clone` that create namespaces.
const NAMESPACES: i32 = libc::CLONE_NEWUSER
    | libc::CLONE_NEWPID
    | libc::CLONE_NEWNET
    | libc::CLONE_NEWNS
    | libc::CLONE_NEWIPC
    | libc::CLONE_NEWUTS
    | libc::CLONE_NEWCGROUP;

/// Operations of `fcntl` on descriptors only: no locks, leases or signals.
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

/// Operations of `fcntl` on locks, which are visible to other runs.
const LOCKS: &[i32] = &[
    libc::F_GETLK,
    libc::F_SETLK,
    libc::F_SETLKW,
    libc::F_OFD_GETLK,
    libc::F_OFD_SETLK,
    libc::F_OFD_SETLKW,
];

/// The option of a socket that tells the number of its network namespace; libc does not have it.
const SO_NETNS_COOKIE: i32 = 71;

/// Operations of `ioctl` on descriptors, and queries about terminals.
const CONTROLS: &[u64] = &[
    libc::TCGETS,
    0x802c_542a, // TCGETS2
    libc::TIOCGWINSZ,
    libc::TIOCGPGRP,
    libc::FIONREAD,
    libc::FIONBIO,
    libc::FIOCLEX,
    libc::FIONCLEX,
    0x4004_9409, // FICLONE
];

type Rules = BTreeMap<i64, Vec<SeccompRule>>;

/// Answers that do not depend on arguments.
type Answers = BTreeMap<u32, SeccompAction>;

/// Restricts the calling thread and its children to the calls above.
///
/// # Errors
/// If the kernel does not support filters.
pub(super) fn restrict(policy: Policy) -> Result<(), Error> {
    seccompiler::apply_filter(&filter(policy)?)
}

fn filter(policy: Policy) -> Result<BpfProgram, Error> {
    let errno = |number: i32| SeccompAction::Errno(number.cast_unsigned());
    let architecture = TargetArch::try_from(std::env::consts::ARCH)?;
    // On read-only mounts, the kernel refuses every change. Elsewhere, pretend success: linkers and build tools
    // fail otherwise.
    let attributes = if policy.isolated { SeccompAction::Allow } else { errno(0) };
    let mut answers = Answers::new();
    // Where files are on disk, this call takes space faster than the supervisor looks; libraries write zeros instead.
    let allocation = if policy.isolated { SeccompAction::Allow } else { errno(libc::EOPNOTSUPP) };
    let groups: [(&[i64], SeccompAction); 7] = [
        (ALLOWED, SeccompAction::Allow),
        (ALLOWED_HERE, SeccompAction::Allow),
        (ATTRIBUTES, attributes.clone()),
        (ADVICE, errno(0)),
        (&[libc::SYS_fallocate], allocation),
        (&[libc::SYS_socket], errno(libc::EACCES)),
        (KILLED, SeccompAction::KillProcess),
    ];
    for (calls, answer) in groups {
        answers.extend(calls.iter().map(|call| (*call as u32, answer.clone())));
    }
    for (call, _) in MODES {
        answers.insert(*call as u32, attributes.clone());
    }
    let mut rules = Rules::new();
    for (call, conditions) in conditional(policy)? {
        if conditions.is_empty() {
            answers.insert(call as u32, SeccompAction::Allow);
        } else {
            answers.remove(&(call as u32));
            rules.insert(call, conditions);
        }
    }
    let otherwise = errno(libc::ENOSYS);
    let rest = SeccompFilter::new(rules, otherwise, SeccompAction::Allow, architecture)?;
    let rest = BpfProgram::try_from(rest)?;
    let mut program = search(&answers)?;
    program.extend(rest);
    Ok(program)
}

/// First part of the filter: returns the fixed answers. A call without one, and every call of another architecture,
/// continues after its end.
fn search(answers: &Answers) -> Result<BpfProgram, Error> {
    // bpf(4): of `struct seccomp_data`, the number of the call and the architecture.
    const NUMBER: u32 = 0;
    const ARCHITECTURE: u32 = 4;
    let load = |offset| instruction(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, offset);
    // Start of each range of call numbers with the same answer. `None` jumps to the end.
    let mut pieces: Vec<(u32, Option<&SeccompAction>)> = vec![(0, None)];
    for (call, answer) in answers {
        let last = pieces.last().filter(|(first, _)| *first == *call).is_some();
        if last {
            pieces.pop();
        }
        if pieces.last().is_none_or(|(_, before)| *before != Some(answer)) {
            pieces.push((*call, Some(answer)));
        }
        pieces.push((call + 1, None));
    }
    let tree = halves(&pieces)?;
    let end = tree.len() as u32;
    let mut program = vec![load(ARCHITECTURE)];
    let audit = match std::env::consts::ARCH {
        "x86_64" => AUDIT_X86_64,
        "aarch64" => AUDIT_AARCH64,
        _ => AUDIT_RISCV64,
    };
    program.push(sock_filter {
        jt: 1,
        ..instruction(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, audit)
    });
    program.push(instruction(libc::BPF_JMP | libc::BPF_JA, end + 1));
    program.push(load(NUMBER));
    let behind = |(at, mut instruction): (usize, sock_filter)| {
        if instruction.code == JUMP_BEHIND {
            instruction.k = end - 1 - at as u32;
        }
        instruction
    };
    program.extend(tree.into_iter().enumerate().map(behind));
    Ok(program)
}

/// `AUDIT_ARCH_…` of the kernel's `linux/audit.h`.
const AUDIT_X86_64: u32 = 0xc000_003e;
const AUDIT_AARCH64: u32 = 0xc000_00b7;
const AUDIT_RISCV64: u32 = 0xc000_00f3;

/// An unconditional jump to the end of the search; the distance is filled in later.
const JUMP_BEHIND: u16 = (libc::BPF_JMP | libc::BPF_JA) as u16;

fn halves(pieces: &[(u32, Option<&SeccompAction>)]) -> Result<BpfProgram, Error> {
    if let [(_, answer)] = pieces {
        return Ok(vec![match answer {
            Some(answer) => {
                let returned = u32::from((*answer).clone());
                instruction(libc::BPF_RET | libc::BPF_K, returned)
            }
            None => instruction(u32::from(JUMP_BEHIND), 0),
        }]);
    }
    let (low, high) = pieces.split_at(pieces.len() / 2);
    let (below, above) = (halves(low)?, halves(high)?);
    // Skip the lower half.
    let distance = u8::try_from(below.len())
        .map_err(|_| BackendError::FilterTooLarge(below.len() + above.len()))?;
    let mut program = vec![sock_filter {
        jt: distance,
        ..instruction(libc::BPF_JMP | libc::BPF_JGE | libc::BPF_K, high[0].0)
    }];
    program.extend(below.into_iter().chain(above));
    Ok(program)
}

fn instruction(code: u32, k: u32) -> sock_filter {
    sock_filter { code: code as u16, jt: 0, jf: 0, k }
}

/// Rules for calls that depend on the policy or on arguments; a call with no conditions is allowed.
fn conditional(policy: Policy) -> Result<Rules, Error> {
    let equal = |argument, value: u64| rule(&[(argument, SeccompCmpOp::Eq, value)]);
    let any = |argument, values: &[u64]| -> Result<Vec<SeccompRule>, Error> {
        values.iter().map(|value| equal(argument, *value)).collect()
    };
    let operations = |values: &[i32]| -> Vec<u64> {
        values.iter().map(|value| u64::from(value.cast_unsigned())).collect()
    };
    let mut rules = Rules::new();

    if policy.isolated {
        // A filter cannot read its flags and mode.
        rules.insert(libc::SYS_openat2, vec![]);
    }
    for call in FLAGGED {
        let others = u64::from((!HARMLESS_FLAGS).cast_unsigned());
        rules.insert(*call, vec![rule(&[(5, SeccompCmpOp::MaskedEq(others), 0)])?]);
    }
    // A process that hides its files from the supervisor could fill the disk with them, and one that gets huge pages back
    // could hide memory behind their parts.
    let refused = [libc::PR_SET_DUMPABLE, libc::PR_SET_THP_DISABLE];
    let other = refused.map(|control| (0, SeccompCmpOp::Ne, u64::from(control.cast_unsigned())));
    rules.insert(libc::SYS_prctl, vec![rule(&other)?]);
    rules.insert(libc::SYS_mmap, mappings(policy)?);
    let namespaces = u64::from(NAMESPACES.cast_unsigned());
    rules.insert(libc::SYS_clone, vec![rule(&[(0, SeccompCmpOp::MaskedEq(namespaces), 0)])?]);
    // Rust's standard library starts processes with a SEQPACKET pair.
    let pair = |kind: i32| {
        // Mask of the socket's kind, without its flags.
        const KIND: u64 = 0xf;
        let [unix, kind] = [libc::AF_UNIX, kind].map(|number| u64::from(number.cast_unsigned()));
        rule(&[(0, SeccompCmpOp::Eq, unix), (1, SeccompCmpOp::MaskedEq(KIND), kind)])
    };
    let pairs = vec![pair(libc::SOCK_STREAM)?, pair(libc::SOCK_SEQPACKET)?];
    rules.insert(libc::SYS_socketpair, pairs);
    // Cookies are numbers that the kernel counts for the whole machine, and that a run can raise for the next one.
    let level = (1, SeccompCmpOp::Ne, u64::from(libc::SOL_SOCKET.cast_unsigned()));
    let cookies = [libc::SO_COOKIE, SO_NETNS_COOKIE];
    let other = cookies.map(|option| (2, SeccompCmpOp::Ne, u64::from(option.cast_unsigned())));
    rules.insert(libc::SYS_getsockopt, vec![rule(&[level])?, rule(&other)?]);
    let mut fcntl = any(1, &operations(DESCRIPTORS))?;
    if policy.builds {
        fcntl.extend(any(1, &operations(LOCKS))?);
        rules.insert(libc::SYS_flock, vec![]);
    }
    rules.insert(libc::SYS_fcntl, fcntl);
    rules.insert(libc::SYS_ioctl, any(1, CONTROLS)?);
    const ASK: u64 = 0xffff_ffff;
    rules.insert(libc::SYS_personality, any(0, &[0, ASK])?);

    // Limits and priority of the calling process only.
    rules.insert(libc::SYS_prlimit64, vec![equal(0, 0)?]);
    let process = u64::from(libc::PRIO_PROCESS);
    rules.insert(
        libc::SYS_setpriority,
        vec![rule(&[(0, SeccompCmpOp::Eq, process), (1, SeccompCmpOp::Eq, 0)])?],
    );
    // Libraries pass the IDs of the run's threads. The keeper, process 1, is not one of them.
    let own = if policy.isolated { rule(&[(0, SeccompCmpOp::Ne, 1)])? } else { equal(0, 0)? };
    for call in [
        libc::SYS_sched_setaffinity,
        libc::SYS_sched_setscheduler,
        libc::SYS_sched_setparam,
        libc::SYS_sched_setattr,
    ] {
        rules.insert(call, vec![own.clone()]);
    }
    if !policy.isolated {
        // Never a set-user-ID or set-group-ID file on disk: others could run it as this user.
        const SET_IDS: u64 = 0o6000;
        const MAKES: u64 = (libc::O_CREAT | libc::O_TMPFILE) as u64;
        let harmless = |mode| rule(&[(mode, SeccompCmpOp::MaskedEq(SET_IDS), 0)]);
        for (call, flags, mode) in MAKING {
            let opens = flags.map(|flags| rule(&[(flags, SeccompCmpOp::MaskedEq(MAKES), 0)]));
            let mut allowed = vec![harmless(*mode)?];
            allowed.extend(opens.transpose()?);
            rules.insert(*call, allowed);
        }
        if policy.own_user {
            for (call, mode) in MODES {
                rules.insert(*call, vec![harmless(*mode)?]);
            }
        }
    }
    // `abort` must work.
    let abort = equal(2, libc::SIGABRT.cast_unsigned().into())?;
    rules.insert(libc::SYS_tgkill, vec![abort]);
    if policy.signals_stay {
        rules.extend(SIGNALS.iter().chain(&[libc::SYS_tgkill]).map(|call| (*call, vec![])));
    }
    Ok(rules)
}

/// Rules for `mmap`, whose arguments are the address, the length, the protection and the flags. No process shows the pages of
/// a shared object without a file that it does not map any more; the supervisor counts mappings, each of at most a page.
fn mappings(policy: Policy) -> Result<Vec<SeccompRule>, Error> {
    if policy.is_counted {
        return Ok(vec![]);
    }
    let [shared, nameless, huge] = [libc::MAP_SHARED, libc::MAP_ANONYMOUS, libc::MAP_HUGETLB]
        .map(|flag| u64::from(flag.cast_unsigned()));
    let page = rustix::param::page_size() as u64;
    let small = [
        SeccompCondition::new(1, SeccompCmpArgLen::Qword, SeccompCmpOp::Le, page)?,
        SeccompCondition::new(3, SeccompCmpArgLen::Dword, SeccompCmpOp::MaskedEq(huge), 0)?,
    ];
    let is = |mask, value| rule(&[(3, SeccompCmpOp::MaskedEq(mask), value)]);
    Ok(vec![is(shared, 0)?, is(nameless, 0)?, SeccompRule::new(small.to_vec())?])
}

/// A rule that requires all of these conditions (argument index, comparison, value). Compares the lower 32 bits, as
/// the kernel reads these arguments.
fn rule(conditions: &[(u8, SeccompCmpOp, u64)]) -> Result<SeccompRule, Error> {
    let condition = |(argument, operation, value): &(u8, SeccompCmpOp, u64)| {
        SeccompCondition::new(*argument, SeccompCmpArgLen::Dword, operation.clone(), *value)
    };
    Ok(SeccompRule::new(conditions.iter().map(condition).collect::<Result<_, _>>()?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The answer of the search; `None` if it continues after its end.
    fn run(program: &[sock_filter], architecture: u32, number: u32) -> Option<u32> {
        let (mut at, mut loaded) = (0, 0);
        while let Some(instruction) = program.get(at) {
            let sock_filter { code, jt, jf, k } = instruction;
            at += 1;
            match u32::from(*code) {
                code if code == libc::BPF_LD | libc::BPF_W | libc::BPF_ABS => {
                    loaded = if *k == 0 { number } else { architecture };
                }
                code if code == libc::BPF_JMP | libc::BPF_JA => at += *k as usize,
                code if code == libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K => {
                    at += usize::from(if loaded == *k { *jt } else { *jf });
                }
                code if code == libc::BPF_JMP | libc::BPF_JGE | libc::BPF_K => {
                    at += usize::from(if loaded >= *k { *jt } else { *jf });
                }
                code if code == libc::BPF_RET | libc::BPF_K => return Some(*k),
                code => panic!("{code}"),
            }
        }
        assert_eq!(at, program.len());
        None
    }

    #[test]
    fn filter_search_finds_exactly_the_listed_calls() {
        let (allow, kill) = (SeccompAction::Allow, SeccompAction::KillProcess);
        let mut answers = Answers::new();
        for (call, answer) in [(0, &allow), (1, &allow), (2, &kill), (7, &kill), (8, &allow)] {
            answers.insert(call, answer.clone());
        }
        answers.extend((20..200).step_by(3).map(|call| (call, allow.clone())));
        let program = search(&answers).unwrap();
        let here = match std::env::consts::ARCH {
            "x86_64" => AUDIT_X86_64,
            "aarch64" => AUDIT_AARCH64,
            _ => AUDIT_RISCV64,
        };
        for call in (0..600).chain([0x4000_0000, 0x4000_0001, u32::MAX]) {
            let expected = answers.get(&call).map(|answer| u32::from(answer.clone()));
            assert_eq!(run(&program, here, call), expected, "{call}");
            assert_eq!(run(&program, here ^ 1, call), None, "{call}");
        }
    }

    #[test]
    fn a_policy_fits_into_a_filter() {
        for bits in 0..32 {
            let policy = Policy {
                isolated: bits & 1 != 0,
                signals_stay: bits & 2 != 0,
                own_user: bits & 4 != 0,
                builds: bits & 8 != 0,
                is_counted: bits & 16 != 0,
            };
            // The kernel's limit.
            assert!(filter(policy).unwrap().len() <= 4096);
        }
    }
}
