/* Privileges, namespaces, mounts, and calls that no simulator needs. An argument of a dangerous call is one that
 * the kernel refuses; the sandbox has to refuse it first. */
#include "hostile.h"
#include <linux/seccomp.h>
#include <sys/fsuid.h>
#include <sys/mount.h>
#include <sys/timex.h>

static const int namespaces[] = {CLONE_NEWUSER, CLONE_NEWPID, CLONE_NEWNET, CLONE_NEWNS,
                                 CLONE_NEWIPC,  CLONE_NEWUTS, CLONE_NEWCGROUP, 0x80 /* CLONE_NEWTIME */};

static void new_privileges(void) {
    refused(mount("none", "/mnt", "tmpfs", 0, ""), "mount");
    refused(unshare(CLONE_NEWUSER), "unshare");
    refused(syscall(SYS_setns, 0, 0), "setns");
    refused(chroot("/"), "chroot");
    refused(setuid(0), "the superuser");
    refused(syscall(SYS_clone, CLONE_NEWUSER | SIGCHLD, 0, 0, 0, 0), "clone");
    refused(syscall(SYS_clone3, NULL, 0), "clone3");
    refused(syscall(SYS_bpf, 0, NULL, 0), "bpf");
    refused(syscall(SYS_userfaultfd, 0), "userfaultfd");
    refused(syscall(SYS_io_uring_setup, 1, NULL), "io_uring");
    refused(syscall(SYS_keyctl, 0, 0, 0), "keys");
    refused(syscall(SYS_perf_event_open, NULL, 0, 0, 0, 0), "perf");
}
static void namespaces_by_unshare(void) {
    for (unsigned k = 0; k < LENGTH(namespaces); ++k) {
        denied(syscall(SYS_unshare, namespaces[k]), "unshare");
        denied(syscall(SYS_unshare, namespaces[k] | CLONE_NEWUSER), "unshare with a user namespace");
    }
    denied(syscall(SYS_unshare, CLONE_FILES), "unshare of descriptors");
}
static void namespaces_by_clone(void) {
    for (unsigned k = 0; k + 1 < LENGTH(namespaces); ++k) {
        long child = syscall(SYS_clone, namespaces[k] | SIGCHLD, 0, 0, 0, 0);
        if (child == 0) _exit(0);
        denied(child, "clone");
        child = syscall(SYS_clone, namespaces[k] | CLONE_NEWUSER | SIGCHLD, 0, 0, 0, 0);
        if (child == 0) _exit(0);
        denied(child, "clone with a user namespace");
    }
}
static void namespaces_by_clone3(void) {
    for (unsigned k = 0; k < LENGTH(namespaces); ++k) {
        uint64_t arguments[11] = {(unsigned)namespaces[k] | CLONE_NEWUSER, 0, 0, 0, SIGCHLD};
        long child = syscall(SYS_clone3, arguments, sizeof arguments);
        if (child == 0) _exit(0);
        denied(child, "clone3");
    }
}
static void namespaces_by_setns(void) {
    const char *names[] = {"user", "pid", "net", "mnt", "ipc", "uts", "cgroup", "time"};
    char path[64];
    for (unsigned k = 0; k < LENGTH(names); ++k)
        for (int first = 0; first < 2; ++first) {
            snprintf(path, sizeof path, "/proc/%s/ns/%s", first ? "1" : "self", names[k]);
            int file = open(path, O_RDONLY);
            denied(syscall(SYS_setns, file, 0), "setns");
            if (file < 0) continue;
            /* NS_GET_USERNS, NS_GET_PARENT, NS_GET_PID_FROM_PIDNS, NS_MNT_GET_NEXT, NS_MNT_GET_PREV */
            int process = 1;
            refused(ioctl(file, _IO(0xb7, 1)), "the namespace above");
            refused(ioctl(file, _IO(0xb7, 2)), "the parent of a namespace");
            refused(ioctl(file, _IOR(0xb7, 6, int), process) > 1 ? 0 : -1, "a process outside");
            char information[64] = {64};
            refused(ioctl(file, _IOR(0xb7, 11, char[16]), information), "the next mount namespace");
            refused(ioctl(file, _IOR(0xb7, 12, char[16]), information), "the mount namespace before");
        }
}
static void mounts_by_old_calls(void) {
    const char *nowhere = "/nowhere-at-all";
    denied(mount("none", nowhere, "tmpfs", 0, ""), "mount");
    denied(mount(nowhere, nowhere, NULL, MS_BIND | MS_REC, NULL), "bind mount");
    denied(mount(NULL, nowhere, NULL, MS_REMOUNT | MS_BIND, NULL), "remount");
    denied(mount(NULL, nowhere, NULL, MS_MOVE, NULL), "move of a mount");
    denied(mount(NULL, nowhere, NULL, MS_SHARED | MS_REC, NULL), "propagation");
    denied(umount2(nowhere, MNT_DETACH), "umount2");
    denied(umount2(nowhere, 0), "umount");
}
static void mounts_by_new_calls(void) {
    char attributes[32] = {0};
    denied(syscall(NR_open_tree, AT_FDCWD, "/nowhere-at-all", 1), "open_tree");
    denied(syscall(NR_open_tree_attr, AT_FDCWD, "/nowhere-at-all", 1, attributes, 32), "open_tree_attr");
    denied(syscall(NR_move_mount, -1, "", -1, "", 4), "move_mount");
    denied(syscall(NR_fsopen, "nothing", 0), "fsopen");
    denied(syscall(NR_fsconfig, -1, 0, NULL, NULL, 0), "fsconfig");
    denied(syscall(NR_fsmount, -1, 0, 0), "fsmount");
    denied(syscall(NR_fspick, AT_FDCWD, "/nowhere-at-all", 0), "fspick");
    denied(syscall(NR_mount_setattr, AT_FDCWD, "/nowhere-at-all", 0, attributes, 32), "mount_setattr");
}
static void other_roots(void) {
    denied(chroot("/nowhere-at-all"), "chroot");
    denied(syscall(SYS_pivot_root, "/nowhere-at-all", "/nowhere-at-all"), "pivot_root");
    denied(chroot("."), "chroot of its folder");
}
static void other_identities(void) {
    const int numbers[] = {0, 1, 33, 1000, 65534};
    for (unsigned k = 0; k < LENGTH(numbers); ++k) {
        int number = numbers[k];
        if ((unsigned)number != getuid()) {
            refused(setuid(number), "setuid");
            refused(setreuid(number, number), "setreuid");
            refused(setresuid(number, number, number), "setresuid");
            refused(setresuid(-1, number, -1), "setresuid of the effective one");
            setfsuid(number);
            if (setfsuid(-1) == number) breach("setfsuid");
        }
        if ((unsigned)number != getgid()) {
            refused(setgid(number), "setgid");
            refused(setregid(number, number), "setregid");
            refused(setresgid(number, number, number), "setresgid");
            setfsgid(number);
            if (setfsgid(-1) == number) breach("setfsgid");
        }
        gid_t groups[1] = {number};
        refused(syscall(SYS_setgroups, 1, groups), "setgroups");
    }
    if (getuid() == 0 || geteuid() == 0) breach("the superuser");
}
/* Executes the program with a set-user-ID bit; TARGET tells it that it is that one. */
static void am_i_privileged(void) {
    if (getuid() != geteuid() || getgid() != getegid()) breach("another user by a set-user-ID program");
    uint32_t head[2] = {0x20080522, 0}, sets[6] = {0};
    if (syscall(SYS_capget, head, sets) == 0 && (sets[0] | sets[1])) breach("capabilities of a set-user-ID program");
    _exit(0);
}
static void execute_it(const char *path) {
    int child = fork(), status;
    if (child == 0) {
        execl(path, path, "am_i_privileged", scene, "", right, "nothing", NULL);
        _exit(0);
    }
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 42) _exit(42);
}
/* The harness has given `privileged` in the submission's folder a set-user-ID bit. */
static void set_user_id_of_own_folder(void) { execute_it(own("privileged")); }
static void set_user_id_of_scratch(void) {
    copy(program, "bits");
    chmod("bits", 06755);
    execute_it("./bits");
    int file = open("born", O_WRONLY | O_CREAT, 06777);
    fchmod(file, 06777);
    /* The answer may be that of a call which was not made. */
    struct stat status;
    if (fchown(file, 0, 0) == 0 && fstat(file, &status) == 0 && status.st_uid == 0 && getuid() != 0)
        breach("a file of the superuser");
    if (fchown(file, getuid(), 0) == 0 && fstat(file, &status) == 0 && status.st_gid == 0 && getgid() != 0)
        breach("a file of the superuser's group");
    close(file);
    mkdir("folder", 02777);
    chmod("folder", 02777);
    mknod("node", S_IFREG | 06777, 0);
    /* The harness looks for such files from outside meanwhile. */
    usleep(300000);
}
static void set_user_id_of_system(void) {
    const char *programs[] = {"/bin/su", "/usr/bin/passwd", "/usr/bin/sudo", "/usr/bin/mount", "/usr/bin/newgrp"};
    for (unsigned k = 0; k < LENGTH(programs); ++k) {
        int ends[2], child;
        if (access(programs[k], X_OK) || pipe(ends) || (child = fork()) < 0) continue;
        if (child == 0) {
            dup2(ends[0], 0), close(1), close(2);
            execl(programs[k], programs[k], "-S", NULL);
            _exit(0);
        }
        close(ends[0]);
        char path[64], line[256];
        for (int look = 0; look < 20; ++look) {
            usleep(2000);
            snprintf(path, sizeof path, "/proc/%d/status", child);
            FILE *status = fopen(path, "r");
            unsigned user = 1, effective = 1;
            while (status && fgets(line, sizeof line, status))
                if (sscanf(line, "Uid: %u %u", &user, &effective) == 2 && user != effective)
                    breach(programs[k]);
            if (status) fclose(status);
        }
        close(ends[1]);
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
    }
}
static void trace_with_set_user_id(void) {
    hand_in();
    chmod(trace, 06777);
    usleep(300000);
}
static void execute_memory(void) {
    int file = syscall(SYS_memfd_create, "program", 0);
    denied(file, "memfd_create");
    denied(syscall(NR_memfd_secret, 0), "memfd_secret");
    int nameless = open(".", O_TMPFILE | O_RDWR, 0755);
    if (nameless < 0) return;
    /* It may execute files that it may write; it is the same user still. */
    char *arguments[] = {"program", "am_i_privileged", "", "", (char *)right, "nothing", NULL}, *none[] = {NULL};
    if (fork() == 0) {
        execveat(nameless, "", arguments, none, AT_EMPTY_PATH);
        _exit(0);
    }
    wait(NULL);
}
#ifdef __x86_64__
static void calls_of_x32(void) {
    const int x32 = 0x40000000;
    int ends[2];
    refused(syscall(x32 | SYS_chmod, right, 0777), "chmod of x32");
    refused(syscall(x32 | SYS_fchmodat, AT_FDCWD, right, 0777), "fchmodat of x32");
    refused(syscall(x32 | SYS_chown, right, getuid(), getgid()), "chown of x32");
    refused(syscall(x32 | SYS_socket, 1, 1, 0), "socket of x32");
    refused(syscall(x32 | SYS_socketpair, 1, 2, 0, ends), "socketpair of x32");
    refused(syscall(x32 | SYS_mount, "none", "/nowhere", "tmpfs", 0, ""), "mount of x32");
    refused(syscall(x32 | SYS_unshare, CLONE_NEWUSER), "unshare of x32");
    refused(syscall(x32 | 521, 0, 0, 0, 0), "ptrace of x32");
    refused(syscall(x32 | SYS_open, right, O_RDONLY), "open of x32");
    for (int call = 512; call < 548; ++call) refused(syscall(x32 | call, -1, 0, 0, 0, 0, 0), "a call of x32");
}
static long call_of_i386(long call, long first, long second, long third) {
    long result;
    __asm__ volatile("int $0x80" : "=a"(result) : "a"(call), "b"(first), "c"(second), "d"(third) : "memory", "r8", "r9", "r10", "r11");
    return result;
}
static long i386_number;
static void one_call_of_i386(void) {
    static char path[] = "nowhere";
    if (call_of_i386(i386_number, (long)path, 0777, 0) != -ENOSYS) _exit(42);
}
/* getpid, chmod, mount, socketcall, ptrace, unshare, socket, open, kill, setuid. A killed child is refused. */
static void calls_of_i386(void) {
    const int calls[] = {20, 15, 21, 102, 26, 310, 359, 5, 37, 23};
    for (unsigned k = 0; k < LENGTH(calls); ++k) {
        i386_number = calls[k];
        int status = in_child(one_call_of_i386);
        if (WIFEXITED(status) && WEXITSTATUS(status)) breach("a call of i386");
    }
}
static void ports(void) {
    denied(syscall(SYS_iopl, 3), "iopl");
    denied(syscall(SYS_ioperm, 0x80, 1, 1), "ioperm");
    denied(syscall(SYS_modify_ldt, 0, NULL, 0), "modify_ldt to read");
    char entry[16] = {0};
    denied(syscall(SYS_modify_ldt, 1, entry, sizeof entry), "modify_ldt to write");
}
#else
static void calls_of_x32(void) {}
static void calls_of_i386(void) {}
static void ports(void) {}
#endif
static void unknown_calls(void) {
    for (int call = 470; call <= 600; ++call)
        if (syscall(call, -1L, 0, 0, 0, 0, 0) >= 0 || errno != ENOSYS) breach("a call that is not known");
#ifdef __x86_64__
    /* Filters do not see 335 and 336, which belong to probes of programs. */
    for (int call = 337; call < 424; ++call)
        if (syscall(call, -1L, 0, 0, 0, 0, 0) >= 0 || errno != ENOSYS) breach("a number of no call");
#endif
    const long numbers[] = {0x7fffffff, -1L, 1L << 31, 0x3fffffff};
    for (unsigned k = 0; k < LENGTH(numbers); ++k)
        if (syscall(numbers[k], -1L, 0, 0, 0, 0, 0) >= 0 || errno != ENOSYS) breach("a number out of range");
}
static void rings(void) {
    char parameters[120] = {0};
    denied(syscall(NR_io_uring_setup, 1, parameters), "io_uring_setup");
    denied(syscall(NR_io_uring_enter, -1, 0, 0, 0, NULL, 0), "io_uring_enter");
    denied(syscall(NR_io_uring_register, -1, 0, NULL, 0), "io_uring_register");
    uint64_t context = 0;
    denied(syscall(SYS_io_setup, 1, &context), "io_setup");
}
static void programs_in_the_kernel(void) {
    char attributes[128] = {0};
    for (int command = 0; command < 38; ++command)
        denied(syscall(SYS_bpf, command, attributes, sizeof attributes), "bpf");
}
static void counters(void) {
    char attributes[128] = {0};
    *(uint32_t *)(attributes + 4) = sizeof attributes;
    denied(syscall(SYS_perf_event_open, attributes, 0, -1, -1, 0), "perf_event_open");
    denied(syscall(SYS_perf_event_open, attributes, -1, 0, -1, 0), "perf_event_open of a processor");
}
static void faults(void) {
    denied(syscall(SYS_userfaultfd, 0), "userfaultfd");
    denied(syscall(SYS_userfaultfd, 1), "userfaultfd of the user");
}
/* The sandbox may also kill whoever makes these calls. */
static long number, first, second, third, fourth, fifth;
static void make_call(void) { denied(syscall(number, first, second, third, fourth, fifth), "a call of administration"); }
static void denied_or_killed(long call, long one, long two, long three, long four, long five) {
    number = call, first = one, second = two, third = three, fourth = four, fifth = five;
    int status = in_child(make_call);
    if (WIFSIGNALED(status) && WTERMSIG(status) != SIGSYS) breach("a child ended by another signal");
}
static void modules(void) {
    denied_or_killed(SYS_init_module, 0, 0, (long)"", 0, 0);
    denied_or_killed(SYS_finit_module, -1, (long)"", 0, 0, 0);
    denied_or_killed(SYS_delete_module, (long)"no-such-module", O_NONBLOCK, 0, 0, 0);
}
static void other_kernels(void) {
    /* More segments than there may be. */
    denied_or_killed(SYS_kexec_load, 0, 1000, 0, 0, 0);
    denied_or_killed(SYS_kexec_file_load, -1, -1, 0, (long)"", 0);
    /* Neither magic number is right. */
    denied_or_killed(SYS_reboot, 1, 2, 3, 0, 0);
}
static void administration(void) {
    const char *nowhere = "/nowhere-at-all";
    denied_or_killed(SYS_swapon, (long)nowhere, 0, 0, 0, 0);
    denied_or_killed(SYS_swapoff, (long)nowhere, 0, 0, 0, 0);
    denied(syscall(SYS_acct, nowhere), "acct");
    denied(syscall(SYS_sethostname, NULL, 100000), "sethostname");
    denied(syscall(SYS_setdomainname, NULL, 100000), "setdomainname");
    denied(syscall(SYS_quotactl, -1, NULL, 0, NULL), "quotactl");
    denied(syscall(NR_quotactl_fd, -1, -1, 0, NULL), "quotactl_fd");
#ifdef SYS_lookup_dcookie
    denied(syscall(SYS_lookup_dcookie, 0, NULL, 0), "lookup_dcookie");
#endif
    denied(syscall(SYS_syslog, 10, NULL, 0), "the size of the kernel's messages");
    denied(syscall(SYS_syslog, 3, NULL, -1), "the kernel's messages");
    /* It would hang up the terminal of whoever runs this without protection. */
    if (open("/dev/tty", O_RDONLY) < 0) denied(syscall(SYS_vhangup), "vhangup");
}
static void clocks(void) {
    struct timex wrong = {.modes = ADJ_TICK, .tick = 0};
    denied(syscall(SYS_settimeofday, (void *)8, NULL), "settimeofday");
    denied(syscall(SYS_clock_settime, CLOCK_REALTIME, (void *)8), "clock_settime");
    denied(syscall(SYS_adjtimex, &wrong), "adjtimex");
    denied(syscall(SYS_clock_adjtime, CLOCK_REALTIME, &wrong), "clock_adjtime");
}
static void old_calls(void) {
#ifdef __x86_64__
    const int calls[] = {SYS_uselib, SYS_sysfs, SYS_ustat, SYS__sysctl, SYS_nfsservctl, SYS_get_kernel_syms,
                         SYS_query_module, SYS_create_module, SYS_getpmsg, SYS_putpmsg, SYS_afs_syscall,
                         SYS_tuxcall, SYS_security, SYS_vserver, SYS_epoll_ctl_old, SYS_epoll_wait_old,
                         SYS_remap_file_pages};
    for (unsigned k = 0; k < LENGTH(calls); ++k) denied(syscall(calls[k], 0, 0, 0, 0, 0, 0), "an old call");
#endif
}
static void filters(void) {
    struct sock_filter_ {
        uint16_t code;
        uint8_t yes, no;
        uint32_t value;
    } allow = {6, 0, 0, 0x7fff0000};
    struct {
        unsigned short length;
        struct sock_filter_ *filter;
    } filter = {1, &allow};
    /* With a listener, another process of the run would answer calls in place of the kernel. */
    denied(syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &filter), "a listener of calls");
    /* A second filter that allows all must not undo the one above. */
    syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &filter);
    prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0);
    refused(syscall(SYS_socket, 1, 1, 0), "a socket after its own filter");
    denied(syscall(SYS_unshare, CLONE_NEWUSER), "unshare after its own filter");
}
static void rules_of_its_own(void) {
    /* Its own rules allow everything, and must not undo those above. */
    uint64_t attributes[3] = {0x1fff, 0, 0};
    long rules = syscall(NR_landlock_create_ruleset, attributes, 8, 0);
    if (rules >= 0) {
        struct {
            uint64_t allowed;
            int32_t parent;
        } __attribute__((packed)) rule = {0x1fff, open("/", O_PATH)};
        syscall(NR_landlock_add_rule, rules, 1, &rule, 0);
        syscall(NR_landlock_restrict_self, rules, 0);
    }
    cannot_read(target);
    refused(open(right, O_WRONLY), "its own file after its own rules");
}
static void personalities(void) {
    const unsigned long kinds[] = {0x0400000, 0x0040000, 0x0020000, 0x0008, 0x0100000};
    for (unsigned k = 0; k < LENGTH(kinds); ++k) syscall(SYS_personality, kinds[k]);
    denied(syscall(SYS_unshare, CLONE_NEWUSER), "unshare under another personality");
    refused(syscall(SYS_socket, 2, 1, 0), "a socket under another personality");
}
static void memory_policies(void) {
    /* On itself they are harmless; the number of another process is refused. */
    unsigned long nodes = 1;
    refused(syscall(SYS_migrate_pages, 1, 8, &nodes, &nodes), "pages of the first");
    refused(syscall(NR_set_mempolicy_home_node, 0, 0, 1000, 0), "a node that there is not");
}
static void security_modules(void) {
    char context[64] = {0};
    denied(syscall(NR_lsm_set_self_attr, 0, context, 64, 0), "lsm_set_self_attr");
}

const struct mode kernel_modes[] = {
    MODE(new_privileges), MODE(namespaces_by_unshare), MODE(namespaces_by_clone), MODE(namespaces_by_clone3),
    MODE(namespaces_by_setns), MODE(mounts_by_old_calls), MODE(mounts_by_new_calls), MODE(other_roots),
    MODE(other_identities), MODE(am_i_privileged), MODE(set_user_id_of_own_folder), MODE(set_user_id_of_scratch),
    MODE(set_user_id_of_system), MODE(trace_with_set_user_id), MODE(execute_memory), MODE(calls_of_x32),
    MODE(calls_of_i386), MODE(ports), MODE(unknown_calls), MODE(rings), MODE(programs_in_the_kernel),
    MODE(counters), MODE(faults), MODE(modules), MODE(other_kernels), MODE(administration), MODE(clocks),
    MODE(old_calls), MODE(filters), MODE(rules_of_its_own), MODE(personalities), MODE(memory_policies),
    MODE(security_modules), {0},
};
