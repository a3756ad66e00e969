//! Table of attacks, one row each.

use super::setting::Setting;
use super::setting::Setting::{Container, RootlessContainer, UserWithoutNamespaces};

/// The target of an attack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// Nothing outside the submission.
    Nothing,
    /// The oracle's trace of the scene.
    Oracle,
    /// A scene that is not graded.
    OtherScene,
    /// Another submission.
    OtherSubmission,
    /// A file of the home folder.
    Home,
    /// The report.
    Report,
    /// A process of the machine.
    Process,
    /// A port of the machine.
    Port,
    /// The key of System V objects of a process of the machine.
    Key,
    /// The name of its message queue.
    Queue,
    /// The path of its socket.
    Socket,
    /// A mount point of the machine.
    Mount,
}

use Target::{
    Home, Key, Mount, Nothing, Oracle, OtherScene, OtherSubmission, Port, Process, Queue, Report,
    Socket,
};

/// A verdict, by its name in reports. `breach`: the attack got through.
type Verdicts = &'static [&'static str];

/// One attack.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attack {
    /// Description in the document.
    pub(crate) what: &'static str,
    /// The mode of the hostile program.
    pub(crate) mode: &'static str,
    /// The object of the attack.
    pub(crate) target: Target,
    /// The allowed verdicts.
    pub(crate) expected: Verdicts,
    /// The mode of its build; empty if there is no build.
    pub(crate) build: &'static str,
    /// The mode of an earlier run of the same submission; or empty.
    pub(crate) earlier: &'static str,
    /// Limits that override the usual ones.
    pub(crate) limits: &'static [&'static str],
    /// Verdicts for settings in which they differ.
    pub(crate) differs: &'static [(Setting, Verdicts)],
    /// Whether it takes memory or disk that no process shows: it runs alone, and gets through if the machine shows it.
    pub(crate) is_measured: bool,
}

impl Attack {
    const fn new(
        what: &'static str,
        mode: &'static str,
        target: Target,
        expected: Verdicts,
    ) -> Self {
        let none: &[&str] = &[];
        Self {
            what,
            mode,
            target,
            expected,
            build: "",
            earlier: "",
            limits: none,
            differs: &[],
            is_measured: false,
        }
    }

    const fn built_by(mut self, mode: &'static str) -> Self {
        self.build = mode;
        self
    }

    const fn after(mut self, mode: &'static str) -> Self {
        self.earlier = mode;
        self
    }

    const fn measured(mut self) -> Self {
        self.is_measured = true;
        self
    }

    const fn limits(mut self, limits: &'static [&'static str]) -> Self {
        self.limits = limits;
        self
    }

    const fn but(mut self, differs: &'static [(Setting, Verdicts)]) -> Self {
        self.differs = differs;
        self
    }

    /// The allowed verdicts in this setting.
    pub(crate) fn expected_in(&self, setting: Setting) -> Verdicts {
        let differs = self.differs.iter().find(|(other, _)| *other == setting);
        differs.map_or(self.expected, |(_, verdicts)| verdicts)
    }
}

const PASS: Verdicts = &["pass"];
const CRASHED: Verdicts = &["crashed"];
const NO_OUTPUT: Verdicts = &["no-output"];
const MALFORMED: Verdicts = &["malformed"];
const TIMED_OUT: Verdicts = &["timed-out"];
const OUT_OF_MEMORY: Verdicts = &["out-of-memory"];
/// Counted by the kernel, or refused where it does not count.
const REFUSED_OR_COUNTED: Verdicts = &["pass", "out-of-memory"];
const TOO_MUCH: Verdicts = &["too-much-output"];
const BUILD_FAILED: Verdicts = &["build-failed"];
/// The kernel refuses more processes, or the supervisor counts too many.
const TOO_MANY: Verdicts = &["too-many-processes", "timed-out"];
/// The call is refused, or its use is noticed.
const REFUSED_OR_TOO_MUCH: Verdicts = &["pass", "too-much-output"];
/// The space is full, or its use is noticed.
const TOO_MUCH_OR_FULL: Verdicts = &["pass", "crashed", "too-much-output", "out-of-memory"];
/// The file with the trace's name is one of the two.
const EITHER: Verdicts = &["pass", "no-output"];

/// Landlock does not hide the existence of files.
const WITHOUT_WORLD: &[(Setting, Verdicts)] = &[
    (UserWithoutNamespaces, &["breach"]),
    (Container, &["breach"]),
    (RootlessContainer, &["breach"]),
];

/// All of them.
pub(crate) const ATTACKS: &[Attack] = &[
    // Files of others.
    Attack::new("hand in a right trace", "hand_in", Nothing, PASS),
    Attack::new("read the oracle by its path", "read_oracle", Oracle, PASS),
    Attack::new("read the oracle by a symbolic and by a hard link", "read_by_link", Oracle, PASS),
    Attack::new("read the oracle through /proc", "read_by_proc", Oracle, PASS),
    Attack::new("read the oracle by a path descriptor", "read_by_path_descriptor", Oracle, PASS),
    Attack::new("read the oracle by every way of openat2", "read_by_openat2", Oracle, PASS),
    Attack::new("walk up from a moved and from a removed folder", "walk_up", Oracle, PASS),
    Attack::new("use what descriptors the grader inherited", "read_inherited", Nothing, PASS),
    Attack::new("read the grader's environment and memory", "read_environment", Nothing, PASS),
    Attack::new(
        "read /proc of the first process and of the parent",
        "read_first_process",
        Nothing,
        PASS,
    ),
    Attack::new("read another scene", "read_oracle", OtherScene, PASS),
    Attack::new("read another submission", "read_oracle", OtherSubmission, PASS),
    Attack::new("read the home folder", "read_oracle", Home, PASS),
    Attack::new("list the folders of other submissions", "list_neighbours", OtherSubmission, PASS),
    Attack::new("list the folders above the oracle", "list_neighbours", Oracle, PASS),
    Attack::new("open devices of the machine", "read_devices", Nothing, PASS),
    Attack::new("make devices", "make_devices", Nothing, PASS),
    Attack::new("read the machine's mounts", "read_mounts", Mount, PASS),
    Attack::new("list mounts by number", "list_mounts", Nothing, PASS),
    Attack::new("open files by handle", "read_by_handle", Nothing, PASS),
    Attack::new("find the oracle by stat", "exists_by_stat", Oracle, PASS).but(WITHOUT_WORLD),
    Attack::new("find the oracle by statx", "exists_by_statx", Oracle, PASS).but(WITHOUT_WORLD),
    Attack::new("find the oracle by access", "exists_by_access", Oracle, PASS).but(WITHOUT_WORLD),
    Attack::new("find the oracle by readlink", "exists_by_readlink", Oracle, PASS)
        .but(WITHOUT_WORLD),
    Attack::new("find the oracle by statfs and pathconf", "exists_by_statfs", Oracle, PASS)
        .but(WITHOUT_WORLD),
    Attack::new("find the oracle by open", "exists_by_open", Oracle, PASS).but(WITHOUT_WORLD),
    Attack::new("find the oracle by mkdir, link and rename", "exists_by_making", Oracle, PASS)
        .but(WITHOUT_WORLD),
    Attack::new("find the oracle by execve and chdir", "exists_by_execution", Oracle, PASS)
        .but(WITHOUT_WORLD),
    Attack::new("find the oracle by its extended attributes", "exists_by_xattr", Oracle, PASS)
        .but(WITHOUT_WORLD),
    Attack::new("find the home folder by stat", "exists_by_stat", Home, PASS).but(WITHOUT_WORLD),
    Attack::new("watch files by inotify", "watch_by_inotify", Nothing, PASS),
    Attack::new("watch files by fanotify", "watch_by_fanotify", Nothing, PASS),
    Attack::new("watch folders by dnotify", "watch_by_dnotify", Nothing, PASS),
    Attack::new("overwrite the oracle", "overwrite", Oracle, PASS),
    Attack::new("overwrite the report", "overwrite", Report, PASS),
    Attack::new("write beside its folder, and move the folder", "write_elsewhere", Nothing, PASS),
    Attack::new("write the system's files and folders", "write_system", Nothing, PASS),
    Attack::new("write settings of the kernel", "write_kernel_settings", Nothing, PASS),
    Attack::new("write settings of processes", "write_process_settings", Nothing, PASS),
    Attack::new("write /sys, and make a cgroup", "write_sys", Nothing, PASS),
    Attack::new("write its own submission", "write_own_folder", Nothing, PASS),
    Attack::new(
        "write its own submission by a second name",
        "write_own_by_second_name",
        Nothing,
        PASS,
    ),
    Attack::new("write through roots and folders in /proc", "write_by_proc_root", Oracle, PASS),
    Attack::new("find files that an earlier run left", "find_files", Nothing, PASS)
        .after("leave_files"),
    // Attributes of files.
    Attack::new("change the oracle's mode", "chmod_target", Oracle, PASS),
    Attack::new("change the oracle's owner", "chown_target", Oracle, PASS),
    Attack::new("change the oracle's times", "utimes_target", Oracle, PASS),
    Attack::new("change the oracle's extended attributes", "xattr_target", Oracle, PASS),
    Attack::new("change the oracle's flags", "file_attr_target", Oracle, PASS),
    Attack::new("change another submission's mode", "chmod_target", OtherSubmission, PASS),
    Attack::new("change another submission's times", "utimes_target", OtherSubmission, PASS),
    Attack::new("change the home folder's extended attributes", "xattr_target", Home, PASS),
    Attack::new("change attributes through /proc", "attributes_by_proc", Oracle, PASS),
    Attack::new(
        "change attributes of its own submission's files",
        "attributes_of_own_file",
        Nothing,
        PASS,
    ),
    Attack::new(
        "change attributes of its own submission's folder",
        "attributes_of_own_folder",
        Nothing,
        PASS,
    ),
    Attack::new(
        "change attributes by descriptors open to read",
        "attributes_by_descriptor",
        Nothing,
        PASS,
    ),
    Attack::new(
        "change attributes by path descriptors",
        "attributes_by_path_descriptor",
        Oracle,
        PASS,
    ),
    Attack::new(
        "change attributes by /proc/self/fd",
        "attributes_by_proc_descriptor",
        Oracle,
        PASS,
    ),
    Attack::new("change attributes of the system's files", "attributes_of_system", Nothing, PASS),
    Attack::new("change attributes of devices", "attributes_of_devices", Nothing, PASS),
    Attack::new(
        "change attributes of its standard streams",
        "attributes_of_standard_streams",
        Nothing,
        PASS,
    ),
    // Invalid traces.
    Attack::new("a link to the oracle as trace", "output_link", Oracle, NO_OUTPUT),
    Attack::new("a link to a device as trace", "output_device", Nothing, NO_OUTPUT),
    Attack::new("a link to standard output as trace", "output_link_to_stdout", Nothing, NO_OUTPUT),
    Attack::new("a link to standard input as trace", "output_link_to_stdin", Nothing, NO_OUTPUT),
    Attack::new("a link to its own file as trace", "output_link_to_own", Nothing, NO_OUTPUT),
    Attack::new("a link to itself as trace", "output_link_to_itself", Nothing, NO_OUTPUT),
    Attack::new("a link to nothing as trace", "output_link_to_nothing", Nothing, NO_OUTPUT),
    Attack::new("a folder as trace", "output_folder", Nothing, NO_OUTPUT),
    Attack::new("a pipe as trace", "output_fifo", Nothing, EITHER),
    Attack::new("a socket as trace", "output_socket_file", Nothing, EITHER),
    Attack::new("a file of two names as trace", "output_second_name", Nothing, NO_OUTPUT),
    Attack::new("a second name of its own file as trace", "output_name_of_own", Nothing, PASS),
    Attack::new("a trace that nobody may read", "output_unreadable", Nothing, EITHER),
    Attack::new(
        "a trace in a folder that nobody may enter",
        "output_in_closed_folder",
        Nothing,
        EITHER,
    ),
    Attack::new("a trace under similar names", "output_under_other_names", Nothing, NO_OUTPUT),
    Attack::new("remove the working folder", "working_folder_removed", Nothing, PASS),
    Attack::new("exchange the trace for a link without end", "output_exchanged", Oracle, EITHER),
    Attack::new(
        "exchange the trace for a folder without end",
        "output_exchanged_for_folder",
        Nothing,
        EITHER,
    ),
    Attack::new("alter the trace after the end", "alter_afterwards", Nothing, PASS),
    Attack::new(
        "alter the trace by a mapping after the end",
        "output_altered_by_mapping",
        Nothing,
        PASS,
    ),
    Attack::new("replace the scene by a link to another", "scene_replaced", OtherScene, PASS),
    Attack::new("a trace of millions of zeros", "sparse_trace", Nothing, MALFORMED),
    Attack::new("garbage as trace", "garbage_trace", Nothing, MALFORMED),
    Attack::new("a trace that is no text", "invalid_text_trace", Nothing, MALFORMED),
    Attack::new("a trace with zero bytes", "zero_bytes_trace", Nothing, MALFORMED),
    Attack::new("a trace of one line of 14 MB", "one_line_trace", Nothing, MALFORMED),
    Attack::new("a trace of 8 million columns", "many_columns_trace", Nothing, MALFORMED),
    Attack::new("a trace with a quotation that never ends", "quoted_trace", Nothing, MALFORMED),
    Attack::new("a trace of markup and terminal escapes", "marked_up_trace", Nothing, MALFORMED),
    Attack::new(
        "a trace of NaN",
        "trace_of_no_numbers",
        Nothing,
        &["malformed", "not-finite", "wrong"],
    ),
    Attack::new(
        "a trace of 1e999",
        "trace_of_infinities",
        Nothing,
        &["malformed", "not-finite", "wrong"],
    ),
    Attack::new(
        "a trace of numbers of 16,000 digits",
        "trace_of_long_numbers",
        Nothing,
        &["malformed", "not-finite", "wrong", "crashed"],
    ),
    Attack::new(
        "a right trace and 13 MB of empty lines",
        "trace_without_end",
        Nothing,
        &["pass", "malformed"],
    ),
    // Processes.
    Attack::new("fork bomb", "fork_bomb", Nothing, TOO_MANY),
    Attack::new("vfork bomb", "vfork_bomb", Nothing, TOO_MANY),
    Attack::new("thread bomb", "thread_bomb", Nothing, TOO_MANY),
    Attack::new("threads in many processes", "processes_and_threads", Nothing, TOO_MANY),
    Attack::new("zombies without end", "zombie_flood", Nothing, TOO_MANY),
    Attack::new("spin", "spin", Nothing, TIMED_OUT),
    Attack::new(
        "spin in children that nobody waits for",
        "spin_in_short_children",
        Nothing,
        TIMED_OUT,
    )
    .limits(&["wall=30", "cpu=1"]),
    Attack::new("spin in short-lived orphans", "spin_in_orphans", Nothing, TIMED_OUT)
        .limits(&["wall=30", "cpu=1"]),
    Attack::new("spin in short-lived threads", "spin_in_short_threads", Nothing, TIMED_OUT)
        .limits(&["wall=30", "cpu=1"]),
    Attack::new("sleep", "sleep_long", Nothing, TIMED_OUT),
    Attack::new("stop itself", "stop_itself", Nothing, TIMED_OUT),
    Attack::new("ignore every signal", "ignore_signals", Nothing, TIMED_OUT),
    Attack::new("a vfork that never returns", "vfork_without_end", Nothing, TIMED_OUT),
    Attack::new("execute itself without end", "execute_without_end", Nothing, TIMED_OUT),
    Attack::new(
        "end the first thread, and spin in another",
        "leader_ends_and_thread_spins",
        Nothing,
        TIMED_OUT,
    ),
    Attack::new(
        "end the first thread, and hand in from another",
        "leader_ends_first",
        Nothing,
        PASS,
    ),
    // It writes until it is killed: on a busy machine, too much.
    Attack::new(
        "a daemon that outlives its parent",
        "daemon_outlives",
        Nothing,
        REFUSED_OR_TOO_MUCH,
    ),
    Attack::new(
        "daemons that ignore every signal under another name",
        "stubborn_daemons",
        Nothing,
        PASS,
    ),
    Attack::new("a stopped daemon", "stopped_daemon", Nothing, PASS),
    Attack::new("orphans that another process adopts", "own_reaper", Nothing, PASS),
    Attack::new("a daemon that keeps standard output open", "output_kept_open", Nothing, PASS),
    Attack::new("kill the grader and others", "kill_others", Process, PASS),
    Attack::new("kill all processes", "kill_all", Nothing, &["pass", "crashed"]),
    Attack::new(
        "kill by queues, groups, descriptors and timers",
        "kill_by_other_calls",
        Process,
        PASS,
    ),
    Attack::new("stop the grader", "stop_others", Nothing, PASS),
    Attack::new("see other processes", "see_others", Process, PASS).but(WITHOUT_WORLD),
    Attack::new("trace the grader and others", "trace_others", Process, PASS),
    Attack::new("trace by every request", "trace_by_any_request", Process, PASS),
    Attack::new("read and change others' memory", "memory_of_others", Process, PASS),
    Attack::new("handles of processes", "handles_of_processes", Process, PASS),
    Attack::new("limit others", "limit_others", Nothing, PASS),
    Attack::new("read and change others' limits", "limits_of_others", Process, PASS),
    Attack::new("change others' priorities", "priorities_of_others", Process, PASS),
    Attack::new("change others' scheduling", "schedule_others", Process, PASS),
    Attack::new("raise its own limits", "raise_limits", Nothing, PASS),
    Attack::new("timers without end", "timers", Nothing, PASS),
    Attack::new("queued signals without end", "signals_in_queue", Nothing, PASS),
    Attack::new("controls of its process", "process_controls", Nothing, PASS),
    Attack::new("use capabilities", "capabilities", Nothing, PASS),
    Attack::new("use a terminal", "terminal", Nothing, PASS),
    Attack::new("inherit a mask, ignored signals and a folder", "inherited_state", Nothing, PASS),
    Attack::new("inherit the environment", "environment", Nothing, PASS),
    // Memory.
    Attack::new("memory bomb", "memory_bomb", Nothing, OUT_OF_MEMORY),
    Attack::new("bomb of shared memory", "shared_memory_bomb", Nothing, REFUSED_OR_COUNTED),
    Attack::new("memory in many processes", "forked_memory_bomb", Nothing, OUT_OF_MEMORY),
    Attack::new("memory in orphans", "memory_of_orphans", Nothing, OUT_OF_MEMORY),
    Attack::new("a gigabyte in one call", "memory_at_once", Nothing, REFUSED_OR_COUNTED),
    Attack::new("memory in page tables", "page_tables", Nothing, OUT_OF_MEMORY),
    Attack::new("memory in huge pages", "huge_pages", Nothing, PASS),
    Attack::new("shared pages that nobody maps", "hidden_pages", Nothing, REFUSED_OR_COUNTED)
        .measured(),
    Attack::new(
        "shared pages of /dev/zero that nobody maps",
        "hidden_pages_of_zero",
        Nothing,
        REFUSED_OR_COUNTED,
    )
    .measured(),
    Attack::new("60,000 mappings in twenty processes", "many_mappings", Nothing, OUT_OF_MEMORY)
        .measured(),
    Attack::new(
        "60,000 shared objects in twenty processes",
        "many_objects",
        Nothing,
        OUT_OF_MEMORY,
    )
    .measured(),
    Attack::new(
        "huge pages of which a part is kept",
        "parts_of_huge_pages",
        Nothing,
        REFUSED_OR_COUNTED,
    )
    .limits(&["wall=60"])
    .measured(),
    Attack::new("pages in a chain of forks", "chain_of_pages", Nothing, OUT_OF_MEMORY),
    Attack::new("mappings in a chain of forks", "chain_of_mappings", Nothing, REFUSED_OR_COUNTED)
        .measured(),
    Attack::new(
        "memory in unlinked files",
        "unlinked_mappings",
        Nothing,
        &["too-much-output", "out-of-memory", "crashed"],
    ),
    Attack::new("memory in full pipes", "full_pipes", Nothing, &["pass", "out-of-memory"]),
    Attack::new(
        "memory in full socket pairs",
        "full_socketpairs",
        Nothing,
        &["pass", "out-of-memory"],
    ),
    Attack::new("memory in descriptors in flight", "descriptors_in_flight", Nothing, PASS),
    Attack::new("locked memory", "locked_memory", Nothing, &["pass", "out-of-memory"]),
    Attack::new("recursion without end", "endless_recursion", Nothing, CRASHED),
    Attack::new("honest: 100 MB shared by four children", "honest_sharing", Nothing, PASS),
    Attack::new("honest: 4 MB mapped fifty times", "honest_mappings", Nothing, PASS),
    Attack::new("honest: 64 GB reserved and not used", "honest_reservation", Nothing, PASS),
    // Bytes, files and folders.
    Attack::new("flood of trace", "flood_trace", Nothing, TOO_MUCH),
    Attack::new("flood of standard output", "flood_stdout", Nothing, TOO_MUCH),
    Attack::new("flood of standard error", "flood_stderr", Nothing, TOO_MUCH),
    Attack::new(
        "flood of standard output by a daemon",
        "flood_later",
        Nothing,
        REFUSED_OR_TOO_MUCH,
    ),
    Attack::new("files without end", "many_files", Nothing, TOO_MUCH),
    Attack::new("fill the disk with files of fair size", "many_large_files", Nothing, TOO_MUCH),
    Attack::new("a trace that claims a petabyte", "huge_claim", Nothing, TOO_MUCH),
    Attack::new("a sparse trace of a gigabyte", "sparse_over_limit", Nothing, TOO_MUCH),
    Attack::new("a growing file without a name", "unlinked_file", Nothing, TOO_MUCH),
    Attack::new(
        "a growing file that never had a name",
        "nameless_file",
        Nothing,
        REFUSED_OR_TOO_MUCH,
    ),
    Attack::new("many unlinked files", "unlinked_files", Nothing, &["too-much-output", "crashed"]),
    Attack::new("mapped files without a name", "mapped_files", Nothing, TOO_MUCH_OR_FULL)
        .measured(),
    Attack::new(
        "mapped files without a name, allocated at once",
        "mapped_allocations",
        Nothing,
        TOO_MUCH_OR_FULL,
    )
    .measured(),
    Attack::new("allocate a gigabyte", "large_allocation", Nothing, REFUSED_OR_TOO_MUCH),
    Attack::new("fill /tmp and /dev/shm", "shared_folders", Nothing, REFUSED_OR_TOO_MUCH),
    Attack::new("20,000 folders in each other", "deep_folders", Nothing, TOO_MUCH),
    Attack::new("folders of long names in each other", "deep_long_folders", Nothing, TOO_MUCH),
    Attack::new("files of odd names", "odd_names", Nothing, PASS),
    Attack::new("a file of many names", "many_names", Nothing, TOO_MUCH),
    Attack::new("long links without end", "many_links", Nothing, TOO_MUCH),
    Attack::new("extended attributes without end", "many_attributes", Nothing, REFUSED_OR_TOO_MUCH),
    Attack::new("descriptors without end", "many_descriptors", Nothing, PASS),
    Attack::new("files that come and go", "churn", Nothing, PASS),
    // Objects between processes.
    Attack::new("leave shared memory behind", "leave_behind", Nothing, PASS),
    Attack::new("make System V objects", "make_system_v", Nothing, PASS),
    Attack::new("find System V objects of others", "find_system_v", Key, PASS),
    Attack::new("open message queues", "message_queue", Queue, PASS),
    Attack::new("connect to sockets by path and by abstract name", "connect_by_name", Socket, PASS),
    Attack::new("use the end of a socket pair as a socket", "socketpair_reused", Socket, PASS),
    Attack::new("socket pairs of other kinds", "socketpair_kinds", Nothing, PASS),
    Attack::new("numbers of sockets that the kernel counts", "socket_cookies", Nothing, PASS),
    Attack::new("send descriptors and credentials", "rights_by_socketpair", Nothing, PASS),
    Attack::new("signal to another run by locks on its own file", "lock_own_file", Nothing, PASS),
    Attack::new(
        "signal to another run by locks on the system's files",
        "lock_system_file",
        Nothing,
        PASS,
    ),
    Attack::new("ask which pages of a file are in memory", "page_cache", Nothing, PASS),
    Attack::new("take a file out of memory", "page_cache_emptied", Nothing, PASS),
    Attack::new("read the machine's counts", "counts_of_machine", Nothing, PASS),
    Attack::new("read the grader's folder in arguments", "folders_in_arguments", Nothing, PASS),
    Attack::new("keys and keyrings", "keys", Nothing, PASS),
    Attack::new("find shared objects that an earlier run left", "find_shared_names", Nothing, PASS)
        .after("leave_shared_names"),
    // The network.
    Attack::new("connect to loopback", "connect_loopback", Port, PASS),
    Attack::new("connect out", "connect_out", Port, PASS),
    Attack::new("send a datagram", "send_datagram", Port, PASS),
    Attack::new("a socket of the file system", "unix_socket", Nothing, PASS),
    Attack::new("sockets of every family", "every_family", Nothing, PASS),
    Attack::new("arguments with high bits", "every_family_with_high_bits", Nothing, PASS),
    Attack::new("see the machine's network", "network_seen", Port, PASS),
    // The kernel.
    Attack::new("gain privileges, make namespaces, mount", "new_privileges", Nothing, PASS),
    Attack::new("namespaces by unshare", "namespaces_by_unshare", Nothing, PASS),
    Attack::new("namespaces by clone", "namespaces_by_clone", Nothing, PASS),
    Attack::new("namespaces by clone3", "namespaces_by_clone3", Nothing, PASS),
    Attack::new("enter namespaces, and find those above", "namespaces_by_setns", Nothing, PASS),
    Attack::new("mounts by the old calls", "mounts_by_old_calls", Nothing, PASS),
    Attack::new("mounts by the new calls", "mounts_by_new_calls", Nothing, PASS),
    Attack::new("another root", "other_roots", Nothing, PASS),
    Attack::new("another user or group", "other_identities", Nothing, PASS),
    Attack::new(
        "a set-user-ID program in its submission",
        "set_user_id_of_own_folder",
        Nothing,
        PASS,
    ),
    Attack::new("set-user-ID files in the scratch folder", "set_user_id_of_scratch", Nothing, PASS),
    Attack::new("set-user-ID programs of the system", "set_user_id_of_system", Nothing, PASS),
    Attack::new("a trace with set-user-ID bits", "trace_with_set_user_id", Nothing, PASS),
    Attack::new("execute memory and nameless files", "execute_memory", Nothing, PASS),
    Attack::new("calls of the x32 ABI", "calls_of_x32", Nothing, PASS),
    Attack::new("calls of i386", "calls_of_i386", Nothing, PASS),
    Attack::new("calls that are not known", "unknown_calls", Nothing, PASS),
    Attack::new("ports and segments", "ports", Nothing, PASS),
    Attack::new("asynchronous calls", "rings", Nothing, PASS),
    Attack::new("programs in the kernel", "programs_in_the_kernel", Nothing, PASS),
    Attack::new("performance counters", "counters", Nothing, PASS),
    Attack::new("page faults handled by itself", "faults", Nothing, PASS),
    Attack::new("modules of the kernel", "modules", Nothing, PASS),
    Attack::new("another kernel, and a restart", "other_kernels", Nothing, PASS),
    Attack::new("administration of the machine", "administration", Nothing, PASS),
    Attack::new("clocks of the machine", "clocks", Nothing, PASS),
    Attack::new("obsolete calls", "old_calls", Nothing, PASS),
    Attack::new("filters of its own", "filters", Nothing, PASS),
    Attack::new("access rules of its own", "rules_of_its_own", Oracle, PASS),
    Attack::new("other personalities", "personalities", Nothing, PASS),
    Attack::new("memory policies of others", "memory_policies", Nothing, PASS),
    Attack::new("settings of security modules", "security_modules", Nothing, PASS),
    // Text and exit status.
    Attack::new("terminal escapes", "escapes", Nothing, CRASHED),
    Attack::new("markup", "markup", Nothing, CRASHED),
    Attack::new("code points that are no characters", "no_characters", Nothing, CRASHED),
    Attack::new("zero bytes", "zero_bytes", Nothing, CRASHED),
    Attack::new("text that is not UTF-8", "invalid_text", Nothing, CRASHED),
    Attack::new("a line of 900 kB", "one_huge_line", Nothing, CRASHED),
    Attack::new("900,000 lines", "many_lines", Nothing, CRASHED),
    Attack::new("forge the supervisor's answer", "forged_answer", Nothing, CRASHED),
    Attack::new("crash", "segfault", Nothing, CRASHED),
    Attack::new("abort", "end_by_abort", Nothing, CRASHED),
    Attack::new("kill itself", "end_by_kill", Nothing, CRASHED),
    Attack::new(
        "end itself by the signal of the time limit",
        "end_by_time_signal",
        Nothing,
        &["crashed", "timed-out"],
    ),
    Attack::new(
        "end itself by the signal of the size limit",
        "end_by_size_signal",
        Nothing,
        &["crashed", "too-much-output"],
    ),
    Attack::new("exit 0 with no output", "nothing", Nothing, NO_OUTPUT),
    Attack::new("exit 1 with a right trace", "exit_1_with_a_right_trace", Nothing, CRASHED),
    Attack::new("fail, and hand in from a child", "end_in_child", Nothing, CRASHED),
    // Builds.
    Attack::new("change what an honest build made", "attributes_of_built", Nothing, PASS)
        .built_by("build_nothing"),
    Attack::new("write what an honest build made", "write_own_folder", Nothing, PASS)
        .built_by("build_nothing"),
    Attack::new("a build that leaves a daemon", "built_late_file", Nothing, PASS)
        .built_by("build_daemon"),
    Attack::new("a build that overwrites the oracle", "hand_in", Oracle, PASS)
        .built_by("build_writes_outside"),
    Attack::new("a build that reads the oracle", "hand_in", Oracle, PASS).built_by("build_reads"),
    Attack::new("a build that finds the oracle by stat", "hand_in", Oracle, PASS)
        .built_by("exists_by_stat")
        .but(WITHOUT_WORLD),
    Attack::new("a build that connects to loopback", "hand_in", Port, PASS)
        .built_by("connect_loopback"),
    Attack::new("a build that gains privileges", "hand_in", Nothing, PASS)
        .built_by("new_privileges"),
    Attack::new("a build that changes the oracle's mode", "hand_in", Oracle, PASS)
        .built_by("chmod_target"),
    Attack::new("a build that changes the system's attributes", "hand_in", Nothing, PASS)
        .built_by("attributes_of_system"),
    Attack::new(
        "a build that makes the program a link to the oracle",
        "hand_in",
        Oracle,
        &["crashed", "build-failed"],
    )
    .built_by("build_link_to_oracle"),
    Attack::new(
        "a build that makes its data a link to the oracle",
        "hand_in",
        Oracle,
        &["crashed", "build-failed"],
    )
    .built_by("build_trace_from_oracle"),
    Attack::new(
        "a build that makes its data a link to a device",
        "hand_in",
        Nothing,
        &["crashed", "too-much-output", "build-failed"],
    )
    .built_by("build_trace_from_device"),
    Attack::new(
        "a build that leaves links out of its folder",
        "built_links_lead_nowhere",
        Oracle,
        &["pass", "build-failed"],
    )
    .built_by("build_folder_link"),
    Attack::new("a build that leaves set-user-ID files", "attributes_of_built", Nothing, PASS)
        .built_by("build_set_user_id"),
    Attack::new(
        "a build that leaves 15,000 folders in each other",
        "hand_in",
        Nothing,
        &["pass", "build-failed"],
    )
    .built_by("build_deep_folders"),
    Attack::new(
        "a build that leaves a sparse file of 1.2 GB",
        "hand_in",
        Nothing,
        &["pass", "build-failed"],
    )
    .built_by("build_sparse_file"),
    Attack::new(
        "a build that makes the program a pipe",
        "hand_in",
        Nothing,
        &["crashed", "build-failed"],
    )
    .built_by("build_pipe"),
    Attack::new(
        "a build that makes its data a pipe",
        "hand_in",
        Nothing,
        &["crashed", "build-failed", "timed-out"],
    )
    .built_by("build_pipe_as_trace"),
    Attack::new("a build that closes its folders", "hand_in", Nothing, &["pass", "build-failed"])
        .built_by("build_closed_folders"),
    Attack::new(
        "a build that closes its own folder",
        "hand_in",
        Nothing,
        &["pass", "build-failed"],
    )
    .built_by("build_closed_itself"),
    Attack::new("a build that leaves 20,000 files", "hand_in", Nothing, &["pass", "build-failed"])
        .built_by("build_many_files"),
    Attack::new("a build that leaves files of several names", "hand_in", Nothing, PASS)
        .built_by("build_names"),
    Attack::new("a build that replaces its manifest", "hand_in", Nothing, PASS)
        .built_by("build_manifest"),
    Attack::new(
        "a build that removes its program",
        "hand_in",
        Nothing,
        &["crashed", "build-failed"],
    )
    .built_by("build_removes_itself"),
    Attack::new("a build that forks without end", "hand_in", Nothing, BUILD_FAILED)
        .built_by("build_forks"),
    Attack::new("a build that sleeps", "hand_in", Nothing, BUILD_FAILED).built_by("build_sleeps"),
    Attack::new("a build that fills the disk", "hand_in", Nothing, BUILD_FAILED)
        .built_by("build_floods"),
    Attack::new("a build that fails with hostile text", "hand_in", Nothing, BUILD_FAILED)
        .built_by("build_fails"),
    Attack::new("a build that leaves shared objects", "find_shared_names", Nothing, PASS)
        .built_by("leave_shared_names"),
    Attack::new("honest: a build that locks a file", "hand_in", Nothing, PASS)
        .built_by("build_locks"),
];
