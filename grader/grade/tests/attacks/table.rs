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
    Home, Key, Mount, Oracle, OtherScene, OtherSubmission, Port, Process, Queue, Report, Socket,
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

/// An attack on nothing outside the submission, which must not get through.
const fn attack(what: &'static str, mode: &'static str) -> Attack {
    Attack {
        what,
        mode,
        target: Target::Nothing,
        expected: PASS,
        build: "",
        earlier: "",
        limits: &[],
        differs: &[],
        is_measured: false,
    }
}

impl Attack {
    const fn on(mut self, target: Target) -> Self {
        self.target = target;
        self
    }

    const fn gives(mut self, verdicts: Verdicts) -> Self {
        self.expected = verdicts;
        self
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
    attack("hand in a right trace", "hand_in"),
    attack("read the oracle by its path", "read_oracle").on(Oracle),
    attack("read the oracle by a symbolic and by a hard link", "read_by_link").on(Oracle),
    attack("read the oracle through /proc", "read_by_proc").on(Oracle),
    attack("read the oracle by a path descriptor", "read_by_path_descriptor").on(Oracle),
    attack("read the oracle by every way of openat2", "read_by_openat2").on(Oracle),
    attack("walk up from a moved and from a removed folder", "walk_up").on(Oracle),
    attack("use what descriptors the grader inherited", "read_inherited"),
    attack("read the grader's environment and memory", "read_environment"),
    attack("read /proc of the first process and of the parent", "read_first_process"),
    attack("read another scene", "read_oracle").on(OtherScene),
    attack("read another submission", "read_oracle").on(OtherSubmission),
    attack("read the home folder", "read_oracle").on(Home),
    attack("list the folders of other submissions", "list_neighbours").on(OtherSubmission),
    attack("list the folders above the oracle", "list_neighbours").on(Oracle),
    attack("open devices of the machine", "read_devices"),
    attack("make devices", "make_devices"),
    attack("read the machine's mounts", "read_mounts").on(Mount),
    attack("list mounts by number", "list_mounts"),
    attack("open files by handle", "read_by_handle"),
    attack("find the oracle by stat", "exists_by_stat").on(Oracle).but(WITHOUT_WORLD),
    attack("find the oracle by statx", "exists_by_statx").on(Oracle).but(WITHOUT_WORLD),
    attack("find the oracle by access", "exists_by_access").on(Oracle).but(WITHOUT_WORLD),
    attack("find the oracle by readlink", "exists_by_readlink").on(Oracle).but(WITHOUT_WORLD),
    attack("find the oracle by statfs and pathconf", "exists_by_statfs")
        .on(Oracle)
        .but(WITHOUT_WORLD),
    attack("find the oracle by open", "exists_by_open").on(Oracle).but(WITHOUT_WORLD),
    attack("find the oracle by mkdir, link and rename", "exists_by_making")
        .on(Oracle)
        .but(WITHOUT_WORLD),
    attack("find the oracle by execve and chdir", "exists_by_execution")
        .on(Oracle)
        .but(WITHOUT_WORLD),
    attack("find the oracle by its extended attributes", "exists_by_xattr")
        .on(Oracle)
        .but(WITHOUT_WORLD),
    attack("find the home folder by stat", "exists_by_stat").on(Home).but(WITHOUT_WORLD),
    attack("watch files by inotify", "watch_by_inotify"),
    attack("watch files by fanotify", "watch_by_fanotify"),
    attack("watch folders by dnotify", "watch_by_dnotify"),
    attack("overwrite the oracle", "overwrite").on(Oracle),
    attack("overwrite the report", "overwrite").on(Report),
    attack("write beside its folder, and move the folder", "write_elsewhere"),
    attack("write the system's files and folders", "write_system"),
    attack("write settings of the kernel", "write_kernel_settings"),
    attack("write settings of processes", "write_process_settings"),
    attack("write /sys, and make a cgroup", "write_sys"),
    attack("write its own submission", "write_own_folder"),
    attack("write its own submission by a second name", "write_own_by_second_name"),
    attack("write through roots and folders in /proc", "write_by_proc_root").on(Oracle),
    attack("find files that an earlier run left", "find_files").after("leave_files"),
    // Attributes of files.
    attack("change the oracle's mode", "chmod_target").on(Oracle),
    attack("change the oracle's owner", "chown_target").on(Oracle),
    attack("change the oracle's times", "utimes_target").on(Oracle),
    attack("change the oracle's extended attributes", "xattr_target").on(Oracle),
    attack("change the oracle's flags", "file_attr_target").on(Oracle),
    attack("change another submission's mode", "chmod_target").on(OtherSubmission),
    attack("change another submission's times", "utimes_target").on(OtherSubmission),
    attack("change the home folder's extended attributes", "xattr_target").on(Home),
    attack("change attributes through /proc", "attributes_by_proc").on(Oracle),
    attack("change attributes of its own submission's files", "attributes_of_own_file"),
    attack("change attributes of its own submission's folder", "attributes_of_own_folder"),
    attack("change attributes by descriptors open to read", "attributes_by_descriptor"),
    attack("change attributes by path descriptors", "attributes_by_path_descriptor").on(Oracle),
    attack("change attributes by /proc/self/fd", "attributes_by_proc_descriptor").on(Oracle),
    attack("change attributes of the system's files", "attributes_of_system"),
    attack("change attributes of devices", "attributes_of_devices"),
    attack("change attributes of its standard streams", "attributes_of_standard_streams"),
    // Invalid traces.
    attack("a link to the oracle as trace", "output_link").on(Oracle).gives(NO_OUTPUT),
    attack("a link to a device as trace", "output_device").gives(NO_OUTPUT),
    attack("a link to standard output as trace", "output_link_to_stdout").gives(NO_OUTPUT),
    attack("a link to standard input as trace", "output_link_to_stdin").gives(NO_OUTPUT),
    attack("a link to its own file as trace", "output_link_to_own").gives(NO_OUTPUT),
    attack("a link to itself as trace", "output_link_to_itself").gives(NO_OUTPUT),
    attack("a link to nothing as trace", "output_link_to_nothing").gives(NO_OUTPUT),
    attack("a folder as trace", "output_folder").gives(NO_OUTPUT),
    attack("a pipe as trace", "output_fifo").gives(EITHER),
    attack("a socket as trace", "output_socket_file").gives(EITHER),
    attack("a file of two names as trace", "output_second_name").gives(NO_OUTPUT),
    attack("a second name of its own file as trace", "output_name_of_own"),
    attack("a trace that nobody may read", "output_unreadable").gives(EITHER),
    attack("a trace in a folder that nobody may enter", "output_in_closed_folder").gives(EITHER),
    attack("a trace under similar names", "output_under_other_names").gives(NO_OUTPUT),
    attack("remove the working folder", "working_folder_removed"),
    attack("exchange the trace for a link without end", "output_exchanged")
        .on(Oracle)
        .gives(EITHER),
    attack("exchange the trace for a folder without end", "output_exchanged_for_folder")
        .gives(EITHER),
    attack("alter the trace after the end", "alter_afterwards"),
    attack("alter the trace by a mapping after the end", "output_altered_by_mapping"),
    attack("replace the scene by a link to another", "scene_replaced").on(OtherScene),
    attack("a trace of millions of zeros", "sparse_trace").gives(MALFORMED),
    attack("garbage as trace", "garbage_trace").gives(MALFORMED),
    attack("a trace that is no text", "invalid_text_trace").gives(MALFORMED),
    attack("a trace with zero bytes", "zero_bytes_trace").gives(MALFORMED),
    attack("a trace of one line of 14 MB", "one_line_trace").gives(MALFORMED),
    attack("a trace of 8 million columns", "many_columns_trace").gives(MALFORMED),
    attack("a trace with a quotation that never ends", "quoted_trace").gives(MALFORMED),
    attack("a trace of markup and terminal escapes", "marked_up_trace").gives(MALFORMED),
    attack("a trace of NaN", "trace_of_no_numbers").gives(&["malformed", "not-finite", "wrong"]),
    attack("a trace of 1e999", "trace_of_infinities").gives(&["malformed", "not-finite", "wrong"]),
    attack("a trace of numbers of 16,000 digits", "trace_of_long_numbers").gives(&[
        "malformed",
        "not-finite",
        "wrong",
        "crashed",
    ]),
    attack("a right trace and 13 MB of empty lines", "trace_without_end")
        .gives(&["pass", "malformed"]),
    // Processes.
    attack("fork bomb", "fork_bomb").gives(TOO_MANY),
    attack("vfork bomb", "vfork_bomb").gives(TOO_MANY),
    attack("thread bomb", "thread_bomb").gives(TOO_MANY),
    attack("threads in many processes", "processes_and_threads").gives(TOO_MANY),
    attack("zombies without end", "zombie_flood").gives(TOO_MANY),
    attack("spin", "spin").gives(TIMED_OUT),
    attack("spin in children that nobody waits for", "spin_in_short_children")
        .gives(TIMED_OUT)
        .limits(&["wall=30", "cpu=1"]),
    attack("spin in short-lived orphans", "spin_in_orphans")
        .gives(TIMED_OUT)
        .limits(&["wall=30", "cpu=1"]),
    attack("spin in short-lived threads", "spin_in_short_threads")
        .gives(TIMED_OUT)
        .limits(&["wall=30", "cpu=1"]),
    attack("sleep", "sleep_long").gives(TIMED_OUT),
    attack("stop itself", "stop_itself").gives(TIMED_OUT),
    attack("ignore every signal", "ignore_signals").gives(TIMED_OUT),
    attack("a vfork that never returns", "vfork_without_end").gives(TIMED_OUT),
    attack("execute itself without end", "execute_without_end").gives(TIMED_OUT),
    attack("end the first thread, and spin in another", "leader_ends_and_thread_spins")
        .gives(TIMED_OUT),
    attack("end the first thread, and hand in from another", "leader_ends_first"),
    // It writes until it is killed: on a busy machine, too much.
    attack("a daemon that outlives its parent", "daemon_outlives").gives(REFUSED_OR_TOO_MUCH),
    attack("daemons that ignore every signal under another name", "stubborn_daemons"),
    attack("a stopped daemon", "stopped_daemon"),
    attack("orphans that another process adopts", "own_reaper"),
    attack("a daemon that keeps standard output open", "output_kept_open"),
    attack("kill the grader and others", "kill_others").on(Process),
    attack("kill all processes", "kill_all").gives(&["pass", "crashed"]),
    attack("kill by queues, groups, descriptors and timers", "kill_by_other_calls").on(Process),
    attack("stop the grader", "stop_others"),
    attack("see other processes", "see_others").on(Process).but(WITHOUT_WORLD),
    attack("trace the grader and others", "trace_others").on(Process),
    attack("trace by every request", "trace_by_any_request").on(Process),
    attack("read and change others' memory", "memory_of_others").on(Process),
    attack("handles of processes", "handles_of_processes").on(Process),
    attack("limit others", "limit_others"),
    attack("read and change others' limits", "limits_of_others").on(Process),
    attack("change others' priorities", "priorities_of_others").on(Process),
    attack("change others' scheduling", "schedule_others").on(Process),
    attack("raise its own limits", "raise_limits"),
    attack("timers without end", "timers"),
    attack("queued signals without end", "signals_in_queue"),
    attack("controls of its process", "process_controls"),
    attack("use capabilities", "capabilities"),
    attack("use a terminal", "terminal"),
    attack("inherit a mask, ignored signals and a folder", "inherited_state"),
    attack("inherit the environment", "environment"),
    // Memory.
    attack("memory bomb", "memory_bomb").gives(OUT_OF_MEMORY),
    attack("bomb of shared memory", "shared_memory_bomb").gives(REFUSED_OR_COUNTED),
    attack("memory in many processes", "forked_memory_bomb").gives(OUT_OF_MEMORY),
    attack("memory in orphans", "memory_of_orphans").gives(OUT_OF_MEMORY),
    attack("a gigabyte in one call", "memory_at_once").gives(REFUSED_OR_COUNTED),
    attack("memory in page tables", "page_tables").gives(OUT_OF_MEMORY),
    attack("memory in huge pages", "huge_pages"),
    attack("shared pages that nobody maps", "hidden_pages").gives(REFUSED_OR_COUNTED).measured(),
    attack("shared pages of /dev/zero that nobody maps", "hidden_pages_of_zero")
        .gives(REFUSED_OR_COUNTED)
        .measured(),
    attack("60,000 mappings in twenty processes", "many_mappings").gives(OUT_OF_MEMORY).measured(),
    attack("60,000 shared objects in twenty processes", "many_objects")
        .gives(OUT_OF_MEMORY)
        .measured(),
    attack("huge pages of which a part is kept", "parts_of_huge_pages")
        .gives(REFUSED_OR_COUNTED)
        .limits(&["wall=60"])
        .measured(),
    attack("pages in a chain of forks", "chain_of_pages").gives(OUT_OF_MEMORY),
    attack("mappings in a chain of forks", "chain_of_mappings")
        .gives(REFUSED_OR_COUNTED)
        .measured(),
    attack("memory in unlinked files", "unlinked_mappings").gives(&[
        "too-much-output",
        "out-of-memory",
        "crashed",
    ]),
    attack("memory in full pipes", "full_pipes").gives(&["pass", "out-of-memory"]),
    attack("memory in full socket pairs", "full_socketpairs").gives(&["pass", "out-of-memory"]),
    attack("memory in descriptors in flight", "descriptors_in_flight"),
    attack("locked memory", "locked_memory").gives(&["pass", "out-of-memory"]),
    attack("recursion without end", "endless_recursion").gives(CRASHED),
    attack("honest: 100 MB shared by four children", "honest_sharing"),
    attack("honest: 4 MB mapped fifty times", "honest_mappings"),
    attack("honest: 64 GB reserved and not used", "honest_reservation"),
    // Bytes, files and folders.
    attack("flood of trace", "flood_trace").gives(TOO_MUCH),
    attack("flood of standard output", "flood_stdout").gives(TOO_MUCH),
    attack("flood of standard error", "flood_stderr").gives(TOO_MUCH),
    attack("flood of standard output by a daemon", "flood_later").gives(REFUSED_OR_TOO_MUCH),
    attack("files without end", "many_files").gives(TOO_MUCH),
    attack("fill the disk with files of fair size", "many_large_files").gives(TOO_MUCH),
    attack("a trace that claims a petabyte", "huge_claim").gives(TOO_MUCH),
    attack("a sparse trace of a gigabyte", "sparse_over_limit").gives(TOO_MUCH),
    attack("a growing file without a name", "unlinked_file").gives(TOO_MUCH),
    attack("a growing file that never had a name", "nameless_file").gives(REFUSED_OR_TOO_MUCH),
    attack("many unlinked files", "unlinked_files").gives(&["too-much-output", "crashed"]),
    attack("mapped files without a name", "mapped_files").gives(TOO_MUCH_OR_FULL).measured(),
    attack("mapped files without a name, allocated at once", "mapped_allocations")
        .gives(TOO_MUCH_OR_FULL)
        .measured(),
    attack("allocate a gigabyte", "large_allocation").gives(REFUSED_OR_TOO_MUCH),
    attack("fill /tmp and /dev/shm", "shared_folders").gives(REFUSED_OR_TOO_MUCH),
    attack("20,000 folders in each other", "deep_folders").gives(TOO_MUCH),
    attack("folders of long names in each other", "deep_long_folders").gives(TOO_MUCH),
    attack("files of odd names", "odd_names"),
    attack("a file of many names", "many_names").gives(TOO_MUCH),
    attack("long links without end", "many_links").gives(TOO_MUCH),
    attack("extended attributes without end", "many_attributes").gives(REFUSED_OR_TOO_MUCH),
    attack("descriptors without end", "many_descriptors"),
    attack("files that come and go", "churn"),
    // Objects between processes.
    attack("leave shared memory behind", "leave_behind"),
    attack("make System V objects", "make_system_v"),
    attack("find System V objects of others", "find_system_v").on(Key),
    attack("open message queues", "message_queue").on(Queue),
    attack("connect to sockets by path and by abstract name", "connect_by_name").on(Socket),
    attack("use the end of a socket pair as a socket", "socketpair_reused").on(Socket),
    attack("socket pairs of other kinds", "socketpair_kinds"),
    attack("numbers of sockets that the kernel counts", "socket_cookies"),
    attack("send descriptors and credentials", "rights_by_socketpair"),
    attack("signal to another run by locks on its own file", "lock_own_file"),
    attack("signal to another run by locks on the system's files", "lock_system_file"),
    attack("ask which pages of a file are in memory", "page_cache"),
    attack("take a file out of memory", "page_cache_emptied"),
    attack("read the machine's counts", "counts_of_machine"),
    attack("read the grader's folder in arguments", "folders_in_arguments"),
    attack("keys and keyrings", "keys"),
    attack("find shared objects that an earlier run left", "find_shared_names")
        .after("leave_shared_names"),
    // The network.
    attack("connect to loopback", "connect_loopback").on(Port),
    attack("connect out", "connect_out").on(Port),
    attack("send a datagram", "send_datagram").on(Port),
    attack("a socket of the file system", "unix_socket"),
    attack("sockets of every family", "every_family"),
    attack("arguments with high bits", "every_family_with_high_bits"),
    attack("see the machine's network", "network_seen").on(Port),
    // The kernel.
    attack("gain privileges, make namespaces, mount", "new_privileges"),
    attack("namespaces by unshare", "namespaces_by_unshare"),
    attack("namespaces by clone", "namespaces_by_clone"),
    attack("namespaces by clone3", "namespaces_by_clone3"),
    attack("enter namespaces, and find those above", "namespaces_by_setns"),
    attack("mounts by the old calls", "mounts_by_old_calls"),
    attack("mounts by the new calls", "mounts_by_new_calls"),
    attack("another root", "other_roots"),
    attack("another user or group", "other_identities"),
    attack("a set-user-ID program in its submission", "set_user_id_of_own_folder"),
    attack("set-user-ID files in the scratch folder", "set_user_id_of_scratch"),
    attack("set-user-ID programs of the system", "set_user_id_of_system"),
    attack("a trace with set-user-ID bits", "trace_with_set_user_id"),
    attack("execute memory and nameless files", "execute_memory"),
    attack("calls of the x32 ABI", "calls_of_x32"),
    attack("calls of i386", "calls_of_i386"),
    attack("calls that are not known", "unknown_calls"),
    attack("ports and segments", "ports"),
    attack("asynchronous calls", "rings"),
    attack("programs in the kernel", "programs_in_the_kernel"),
    attack("performance counters", "counters"),
    attack("page faults handled by itself", "faults"),
    attack("modules of the kernel", "modules"),
    attack("another kernel, and a restart", "other_kernels"),
    attack("administration of the machine", "administration"),
    attack("clocks of the machine", "clocks"),
    attack("obsolete calls", "old_calls"),
    attack("filters of its own", "filters"),
    attack("access rules of its own", "rules_of_its_own").on(Oracle),
    attack("other personalities", "personalities"),
    attack("memory policies of others", "memory_policies"),
    attack("settings of security modules", "security_modules"),
    // Text and exit status.
    attack("terminal escapes", "escapes").gives(CRASHED),
    attack("markup", "markup").gives(CRASHED),
    attack("code points that are no characters", "no_characters").gives(CRASHED),
    attack("zero bytes", "zero_bytes").gives(CRASHED),
    attack("text that is not UTF-8", "invalid_text").gives(CRASHED),
    attack("a line of 900 kB", "one_huge_line").gives(CRASHED),
    attack("900,000 lines", "many_lines").gives(CRASHED),
    attack("forge the supervisor's answer", "forged_answer").gives(CRASHED),
    attack("crash", "segfault").gives(CRASHED),
    attack("abort", "end_by_abort").gives(CRASHED),
    attack("kill itself", "end_by_kill").gives(CRASHED),
    attack("end itself by the signal of the time limit", "end_by_time_signal")
        .gives(&["crashed", "timed-out"]),
    attack("end itself by the signal of the size limit", "end_by_size_signal")
        .gives(&["crashed", "too-much-output"]),
    attack("exit 0 with no output", "nothing").gives(NO_OUTPUT),
    attack("exit 1 with a right trace", "exit_1_with_a_right_trace").gives(CRASHED),
    attack("fail, and hand in from a child", "end_in_child").gives(CRASHED),
    // Builds.
    attack("change what an honest build made", "attributes_of_built").built_by("build_nothing"),
    attack("write what an honest build made", "write_own_folder").built_by("build_nothing"),
    attack("a build that leaves a daemon", "built_late_file").built_by("build_daemon"),
    attack("a build that overwrites the oracle", "hand_in")
        .on(Oracle)
        .built_by("build_writes_outside"),
    attack("a build that reads the oracle", "hand_in").on(Oracle).built_by("build_reads"),
    attack("a build that finds the oracle by stat", "hand_in")
        .on(Oracle)
        .built_by("exists_by_stat")
        .but(WITHOUT_WORLD),
    attack("a build that connects to loopback", "hand_in").on(Port).built_by("connect_loopback"),
    attack("a build that gains privileges", "hand_in").built_by("new_privileges"),
    attack("a build that changes the oracle's mode", "hand_in").on(Oracle).built_by("chmod_target"),
    attack("a build that changes the system's attributes", "hand_in")
        .built_by("attributes_of_system"),
    attack("a build that makes the program a link to the oracle", "hand_in")
        .on(Oracle)
        .gives(&["crashed", "build-failed"])
        .built_by("build_link_to_oracle"),
    attack("a build that makes its data a link to the oracle", "hand_in")
        .on(Oracle)
        .gives(&["crashed", "build-failed"])
        .built_by("build_trace_from_oracle"),
    attack("a build that makes its data a link to a device", "hand_in")
        .gives(&["crashed", "too-much-output", "build-failed"])
        .built_by("build_trace_from_device"),
    attack("a build that leaves links out of its folder", "built_links_lead_nowhere")
        .on(Oracle)
        .gives(&["pass", "build-failed"])
        .built_by("build_folder_link"),
    attack("a build that leaves set-user-ID files", "attributes_of_built")
        .built_by("build_set_user_id"),
    attack("a build that leaves 15,000 folders in each other", "hand_in")
        .gives(&["pass", "build-failed"])
        .built_by("build_deep_folders"),
    attack("a build that leaves a sparse file of 1.2 GB", "hand_in")
        .gives(&["pass", "build-failed"])
        .built_by("build_sparse_file"),
    attack("a build that makes the program a pipe", "hand_in")
        .gives(&["crashed", "build-failed"])
        .built_by("build_pipe"),
    attack("a build that makes its data a pipe", "hand_in")
        .gives(&["crashed", "build-failed", "timed-out"])
        .built_by("build_pipe_as_trace"),
    attack("a build that closes its folders", "hand_in")
        .gives(&["pass", "build-failed"])
        .built_by("build_closed_folders"),
    attack("a build that closes its own folder", "hand_in")
        .gives(&["pass", "build-failed"])
        .built_by("build_closed_itself"),
    attack("a build that leaves 20,000 files", "hand_in")
        .gives(&["pass", "build-failed"])
        .built_by("build_many_files"),
    attack("a build that leaves files of several names", "hand_in").built_by("build_names"),
    attack("a build that replaces its manifest", "hand_in").built_by("build_manifest"),
    attack("a build that removes its program", "hand_in")
        .gives(&["crashed", "build-failed"])
        .built_by("build_removes_itself"),
    attack("a build that forks without end", "hand_in").gives(BUILD_FAILED).built_by("build_forks"),
    attack("a build that sleeps", "hand_in").gives(BUILD_FAILED).built_by("build_sleeps"),
    attack("a build that fills the disk", "hand_in").gives(BUILD_FAILED).built_by("build_floods"),
    attack("a build that fails with hostile text", "hand_in")
        .gives(BUILD_FAILED)
        .built_by("build_fails"),
    attack("a build that leaves shared objects", "find_shared_names")
        .built_by("leave_shared_names"),
    attack("honest: a build that locks a file", "hand_in").built_by("build_locks"),
];
