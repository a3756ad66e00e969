/* Processes, threads, processor time, and other processes. */
#include "hostile.h"
#include <linux/prctl.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

static void fork_bomb(void) {
    fuse();
    while (armed()) {
        int process = fork();
        if (process == 0) fuse();
        if (process < 0) usleep(1000);
    }
}
static void *wait_for_ever(void *unused) {
    for (;;) pause();
    return unused;
}
static void thread_bomb(void) {
    while (armed()) {
        pthread_t thread;
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        pthread_attr_setstacksize(&attributes, 1 << 14);
        if (pthread_create(&thread, &attributes, wait_for_ever, NULL)) usleep(1000);
        else fuse();
    }
}
static void vfork_bomb(void) {
    while (armed()) {
        /* The parent sleeps until the child is another program, with a separate count of processes: it must not
         * start any more. */
        int process = vfork();
        if (process == 0) {
            execl("/proc/self/exe", program, "sleep_long", scene, trace, right, "nothing", target2, NULL);
            _exit(0);
        }
        if (process < 0) usleep(1000);
        else fuse();
    }
}
static void processes_and_threads(void) {
    pthread_t thread;
    for (int k = 0; k < 9; ++k)
        if (fork() == 0) {
            for (int m = 0; m < 9; ++m) pthread_create(&thread, NULL, wait_for_ever, NULL);
            pause_for_ever();
        }
    pause_for_ever();
}
static void zombie_flood(void) {
    while (armed()) {
        int process = fork();
        if (process == 0) _exit(0);
        if (process > 0) fuse();
        else usleep(1000);
    }
}
static void spin(void) {
    for (volatile int k = 0;; ++k) {}
}
static void sleep_long(void) { pause_for_ever(); }
static void stop_itself(void) { raise(SIGSTOP); pause(); }
static void ignore_signals(void) {
    for (int k = 1; k < 65; ++k) signal(k, SIG_IGN);
    pause_for_ever();
}
static void vfork_without_end(void) {
    if (syscall(SYS_vfork) == 0) pause_for_ever();
}
static void execute_without_end(void) {
    char count[16];
    int number = atoi(target) + 1;
    if (number > 100000) breach("programs without end");
    snprintf(count, sizeof count, "%d", number);
    execl("/proc/self/exe", program, "execute_without_end", scene, trace, right, count, target2, NULL);
}

/* Processor time, which is no less on a busy machine. */
static void burn(double most) {
    struct timespec spent;
    do {
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
    } while (spent.tv_sec + 1e-9 * spent.tv_nsec < most);
}
/* Until whoever else holds the other end has ended, one after the other, so that few are there at once. */
static void until_closed(int ends[2]) {
    char byte;
    close(ends[1]);
    if (read(ends[0], &byte, 1) != 0) abort();
    close(ends[0]);
}
/* Each ends before anyone looks, and nobody waits for it. */
static void spin_in_children(double time) {
    signal(SIGCHLD, SIG_IGN);
    double start = seconds();
    while (seconds() < start + 20) {
        int ends[2];
        if (pipe(ends) != 0) return;
        if (fork() == 0) {
            burn(time);
            _exit(0);
        }
        until_closed(ends);
    }
}
static void spin_in_short_children(void) { spin_in_children(0.02); }
static void spin_in_shorter_children(void) { spin_in_children(0.004); }
static void spin_in_orphans(void) {
    double start = seconds();
    while (seconds() < start + 20) {
        int ends[2];
        if (pipe(ends) != 0) return;
        int process = fork();
        if (process == 0) {
            if (fork() == 0) {
                setsid();
                burn(0.02);
            }
            _exit(0);
        }
        waitpid(process, NULL, 0);
        until_closed(ends);
    }
}
static void *burn_in_thread(void *unused) {
    burn(0.02);
    return unused;
}
static void spin_in_short_threads(void) {
    double start = seconds();
    while (seconds() < start + 28) {
        pthread_t thread;
        if (pthread_create(&thread, NULL, burn_in_thread, NULL) == 0) pthread_join(thread, NULL);
    }
}

static void daemon_outlives(void) {
    if (fork() == 0) {
        setsid();
        if (fork() == 0) {
            close(0), close(1), close(2);
            for (int k = 0; k < 60000; ++k) {
                usleep(1000);
                copy("/dev/zero", "after");
            }
        }
        _exit(0);
    }
    wait(NULL);
}
static void stubborn_daemons(void) {
    for (int k = 0; k < 8; ++k)
        if (fork() == 0) {
            setsid();
            if (fork()) _exit(0);
            for (int number = 1; number < 65; ++number) signal(number, SIG_IGN);
            sigset_t all;
            sigfillset(&all);
            sigprocmask(SIG_BLOCK, &all, NULL);
            prctl(PR_SET_PDEATHSIG, 0);
            prctl(PR_SET_DUMPABLE, 0);
            prctl(PR_SET_NAME, "kworker/0:1");
            pause_for_ever();
        }
    while (wait(NULL) > 0) {}
}
static void lasting_daemons(void) {
    stubborn_daemons();
    pause_for_ever();
}
/* Honest: long enough that other runs end meanwhile. */
static void honest_pause(void) { usleep(150000); }
static void stopped_daemon(void) {
    int process = fork();
    if (process == 0) {
        setsid();
        raise(SIGSTOP);
        pause_for_ever();
    }
    waitpid(process, NULL, WUNTRACED);
}
static void own_reaper(void) {
    /* Its orphans come to it, not to whoever watches the run. */
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    if (fork() == 0) {
        prctl(PR_SET_CHILD_SUBREAPER, 1);
        if (fork() == 0) {
            setsid();
            pause_for_ever();
        }
        pause_for_ever();
    }
    usleep(20000);
}
static void output_kept_open(void) {
    if (fork() == 0) {
        setsid();
        pause_for_ever();
    }
}
static void alter_afterwards(void) {
    hand_in();
    if (fork() == 0) {
        setsid();
        /* Sooner, it would be a run that has not ended yet. */
        usleep(200000);
        for (int k = 0; k < 1000000; ++k) {
            int file = open(trace, O_WRONLY);
            if (write(file, "altered!", 8) < 0) {}
            close(file);
        }
    }
    _exit(0);
}
static void *hand_in_later(void *unused) {
    usleep(100000);
    hand_in();
    exit(0);
    return unused;
}
static void leader_ends_first(void) {
    pthread_t thread;
    pthread_create(&thread, NULL, hand_in_later, NULL);
    pthread_exit(NULL);
}
static void *spin_in_thread(void *unused) {
    spin();
    return unused;
}
static void leader_ends_and_thread_spins(void) {
    pthread_t thread;
    pthread_create(&thread, NULL, spin_in_thread, NULL);
    pthread_exit(NULL);
}

static void kill_others(void) {
    signal(SIGTERM, SIG_IGN);
    /* Without a parent in its world, 0 would be its own group. */
    if (getppid() > 0) kill(getppid(), SIGKILL);
    kill(1, SIGKILL);
    kill(atoi(target), SIGKILL);
    syscall(SYS_tgkill, atoi(target), atoi(target), SIGKILL);
    int handle = syscall(SYS_pidfd_open, atoi(target), 0);
    if (handle >= 0) breach("a handle of another process");
    if (kill(atoi(target), 0) == 0) breach("another process is in sight");
}
static void kill_all(void) {
    /* In earnest only where it sees none but its own. */
    if (getpid() < 100 && fork() == 0) {
        setsid();
        kill(-1, SIGKILL);
        _exit(0);
    }
    usleep(50000);
    hand_in();
}
static void kill_by_other_calls(void) {
    const int processes[] = {1, getppid(), atoi(target)};
    siginfo_t info = {.si_code = SI_QUEUE};
    for (unsigned k = 0; k < LENGTH(processes); ++k) {
        int process = processes[k];
        if (process <= 0) continue;
        syscall(SYS_tkill, process, SIGKILL);
        syscall(SYS_tgkill, process, process, SIGKILL);
        syscall(SYS_rt_sigqueueinfo, process, SIGKILL, &info);
        syscall(SYS_rt_tgsigqueueinfo, process, process, SIGKILL, &info);
        /* The group of the first would be all processes there are. */
        if (process != 1) killpg(process, SIGKILL);
        char path[64];
        snprintf(path, sizeof path, "/proc/%d", process);
        int folder = open(path, O_RDONLY | O_DIRECTORY);
        if (folder >= 0) refused(syscall(NR_pidfd_send_signal, folder, SIGKILL, NULL, 0), "a signal by a folder of /proc");
    }
    /* A descriptor that sends its signals to another. */
    for (unsigned k = 0; k < LENGTH(processes); ++k) {
        int ends[2];
        if (processes[k] <= 0 || pipe(ends)) continue;
        fcntl(ends[0], F_SETOWN, processes[k]);
        fcntl(ends[0], F_SETSIG, SIGKILL);
        fcntl(ends[0], F_SETFL, O_ASYNC);
        if (write(ends[1], "x", 1) < 0) {}
    }
    /* A timer whose signals go to another's thread. */
    struct sigevent event = {.sigev_notify = SIGEV_THREAD_ID, .sigev_signo = SIGKILL};
    event._sigev_un._tid = atoi(target);
    int timer;
    refused(syscall(SYS_timer_create, CLOCK_MONOTONIC, &event, &timer), "a timer of another's thread");
}
static void stop_others(void) {
    const int signals[] = {SIGSTOP, SIGTSTP, SIGTTIN, SIGTTOU};
    for (unsigned k = 0; k < LENGTH(signals); ++k) {
        signal(signals[k], SIG_IGN);
        if (getppid() > 0) kill(getppid(), signals[k]);
        kill(1, signals[k]);
    }
}
static void see_others(void) {
    /* TARGET is a process of the machine. */
    char path[64];
    const char *names[] = {"", "/stat", "/status", "/cmdline", "/comm", "/cgroup"};
    for (unsigned k = 0; k < LENGTH(names); ++k) {
        snprintf(path, sizeof path, "/proc/%s%s", target, names[k]);
        cannot_read(path);
        if (*names[k] == 0 && access(path, F_OK) == 0) breach("another process exists");
    }
    if (getsid(atoi(target)) > 0 || getpgid(atoi(target)) > 0) breach("another's session");
    struct timespec interval;
    if (sched_rr_get_interval(atoi(target), &interval) == 0) breach("another's time slice");
    clockid_t clock = (~(clockid_t)atoi(target) << 3) | 2;
    if (clock_gettime(clock, &interval) == 0) breach("another's processor time");
}
static void trace_others(void) {
    refused(ptrace(PTRACE_ATTACH, atoi(target), 0, 0), "ptrace");
    refused(ptrace(PTRACE_ATTACH, getppid(), 0, 0), "ptrace of its parent");
    refused(ptrace(PTRACE_SEIZE, 1, 0, 0), "ptrace of the first");
    char byte;
    struct iovec here = {&byte, 1}, there = {&byte, 1};
    refused(process_vm_readv(getppid(), &here, 1, &there, 1, 0), "another's memory");
}
static void trace_by_any_request(void) {
    const int processes[] = {1, getppid(), atoi(target)};
    for (unsigned k = 0; k < LENGTH(processes); ++k) {
        denied(ptrace(PTRACE_SEIZE, processes[k], 0, PTRACE_O_EXITKILL), "PTRACE_SEIZE");
        denied(ptrace(PTRACE_ATTACH, processes[k], 0, 0), "PTRACE_ATTACH");
    }
    denied(ptrace(PTRACE_TRACEME, 0, 0, 0), "PTRACE_TRACEME");
    int child = fork();
    if (child == 0) pause_for_ever();
    denied(ptrace(PTRACE_ATTACH, child, 0, 0), "PTRACE_ATTACH of a child");
    kill(child, SIGKILL);
}
static void memory_of_others(void) {
    char byte;
    struct iovec here = {&byte, 1}, there = {&byte, 1};
    const int processes[] = {1, getppid(), atoi(target), getpid()};
    for (unsigned k = 0; k < LENGTH(processes); ++k) {
        int process = processes[k];
        denied(syscall(SYS_process_vm_readv, process, &here, 1, &there, 1, 0), "process_vm_readv");
        denied(syscall(SYS_process_vm_writev, process, &here, 1, &there, 1, 0), "process_vm_writev");
        denied(syscall(SYS_kcmp, process, getpid(), 0, 0, 0), "kcmp");
        denied(syscall(SYS_move_pages, process, 0, NULL, NULL, NULL, 0), "move_pages");
        denied(syscall(SYS_migrate_pages, process, 0, NULL, NULL), "migrate_pages");
    }
    denied(syscall(NR_process_madvise, -1, &here, 1, MADV_COLD, 0), "process_madvise");
    denied(syscall(NR_process_mrelease, -1, 0), "process_mrelease");
}
static void handles_of_processes(void) {
    const int processes[] = {1, getppid(), atoi(target)};
    for (unsigned k = 0; k < LENGTH(processes); ++k)
        denied(syscall(NR_pidfd_open, processes[k], 0), "pidfd_open");
    denied(syscall(NR_pidfd_getfd, 0, 0, 0), "pidfd_getfd");
    denied(syscall(NR_pidfd_send_signal, -1, 0, NULL, 0), "pidfd_send_signal");
}

/* Whose scheduling must stay: the first of its world, its parent, a process of the machine. */
static int others[3];
static void name_others(void) { others[0] = 1, others[1] = getppid(), others[2] = atoi(target); }
static void limit_others(void) {
    unsigned long limits[2] = {0, 0};
    if (getppid() > 0) refused(syscall(SYS_prlimit64, getppid(), 0, limits, NULL), "limits of its parent");
}
static void limits_of_others(void) {
    struct rlimit limits;
    name_others();
    for (int k = 0; k < 3; ++k)
        for (int resource = 0; resource < 16; ++resource) {
            if (others[k] <= 0) continue;
            refused(syscall(SYS_prlimit64, others[k], resource, NULL, &limits), "another's limits are read");
            limits.rlim_cur = limits.rlim_max = 1 << 30;
            if (others[k] != 1) refused(syscall(SYS_prlimit64, others[k], resource, &limits, NULL), "another's limits");
        }
}
static void priorities_of_others(void) {
    name_others();
    for (int k = 0; k < 3; ++k) {
        if (others[k] <= 0) continue;
        errno = 0;
        int priority = getpriority(PRIO_PROCESS, others[k]);
        if (errno) priority = 19;
        refused(setpriority(PRIO_PROCESS, others[k], priority), "priority of another");
        refused(setpriority(PRIO_PGRP, others[k], priority), "priority of another's group");
        int io = syscall(SYS_ioprio_get, 1, others[k]);
        refused(syscall(SYS_ioprio_set, 1, others[k], io < 0 ? 0 : io), "priority of another's disk");
        refused(syscall(SYS_ioprio_set, 2, others[k], io < 0 ? 0 : io), "priority of a group's disk");
    }
    /* All processes of the user: where they are seen, the grader is one of them. */
    errno = 0;
    int before = getpriority(PRIO_PROCESS, getppid());
    if (errno == 0 && getppid() > 0) {
        setpriority(PRIO_USER, 0, before + 1);
        setpriority(PRIO_USER, getuid(), before + 1);
        if (getpriority(PRIO_PROCESS, getppid()) != before) breach("priority of all of the user");
    }
    refused(setpriority(PRIO_PROCESS, 0, -20), "a better priority");
}
static void schedule_others(void) {
    name_others();
    for (int k = 0; k < 3; ++k) {
        if (others[k] <= 0) continue;
        struct sched_param parameter = {0};
        cpu_set_t set;
        struct {
            uint32_t size, policy;
            uint64_t flags;
            int32_t nice;
            uint32_t priority;
            uint64_t runtime, deadline, period;
        } attributes = {.size = 48};
        sched_getaffinity(getpid(), sizeof set, &set);
        int policy = sched_getscheduler(others[k]);
        if (policy < 0) policy = SCHED_OTHER;
        refused(sched_setaffinity(others[k], sizeof set, &set), "affinity of another");
        refused(sched_setscheduler(others[k], policy, &parameter), "scheduler of another");
        refused(sched_setparam(others[k], &parameter), "parameter of another");
        refused(syscall(SYS_sched_setattr, others[k], &attributes, 0), "attributes of another");
    }
    struct sched_param real_time = {.sched_priority = 50};
    refused(sched_setscheduler(0, SCHED_FIFO, &real_time), "real time");
    refused(sched_setscheduler(0, SCHED_RR, &real_time), "real time");
}
static void raise_limits(void) {
    for (int resource = 0; resource < 16; ++resource) {
        struct rlimit limits, more;
        if (getrlimit(resource, &limits) || limits.rlim_max == RLIM_INFINITY) continue;
        more = limits;
        more.rlim_max += 1;
        refused(setrlimit(resource, &more), "a higher limit");
        refused(syscall(SYS_prlimit64, 0, resource, &more, NULL), "a higher limit by prlimit");
        refused(syscall(SYS_prlimit64, getpid(), resource, &more, NULL), "a higher limit by its number");
    }
    /* With 1, the kernel starts no program that collects dumps either: core(5). */
    struct rlimit cores;
    if (getrlimit(RLIMIT_CORE, &cores) == 0 && cores.rlim_max > 1) breach("core dumps");
}
static void timers(void) {
    struct itimerval often = {{0, 100}, {0, 100}};
    signal(SIGALRM, SIG_IGN), signal(SIGVTALRM, SIG_IGN), signal(SIGPROF, SIG_IGN);
    for (int kind = 0; kind < 3; ++kind) setitimer(kind, &often, NULL);
    int count = 0;
    struct sigevent event = {.sigev_notify = SIGEV_NONE};
    for (; count < 200000; ++count) {
        int timer;
        if (syscall(SYS_timer_create, CLOCK_MONOTONIC, &event, &timer)) break;
    }
    if (count >= 200000) breach("timers without end");
}
static void signals_in_queue(void) {
    sigset_t all;
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, NULL);
    union sigval value = {0};
    int count = 0;
    while (count < 4000 && sigqueue(getpid(), SIGRTMIN + 1, value) == 0) ++count;
    if (count >= 4000) breach("signals without end");
}
static void process_controls(void) {
    if (prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) != 1) breach("new privileges");
    refused(prctl(PR_SET_NO_NEW_PRIVS, 0, 0, 0, 0), "new privileges again");
    refused(prctl(PR_SET_DUMPABLE, 0, 0, 0, 0), "descriptors that the supervisor cannot see");
    refused(prctl(PR_SET_THP_DISABLE, 0, 0, 0, 0), "huge pages again");
    for (int capability = 0; capability < 41; ++capability) {
        refused(prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, capability, 0, 0), "an ambient capability");
        if (prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_IS_SET, capability, 0, 0) > 0) breach("an ambient capability");
    }
    refused(prctl(PR_SET_SECUREBITS, 0x2f, 0, 0, 0), "secure bits");
    refused(prctl(PR_SET_MM, PR_SET_MM_START_CODE, 4096, 0, 0), "another start of code");
    refused(prctl(PR_SET_TSC, 99, 0, 0, 0), "a mode that there is not");
    refused(prctl(PR_SCHED_CORE, PR_SCHED_CORE_SHARE_TO, 1, 0, 0), "core scheduling of the first");
    refused(prctl(PR_MCE_KILL, PR_MCE_KILL_SET, 99, 0, 0), "machine checks");
}
static void capabilities(void) {
    FILE *status = fopen("/proc/self/status", "r");
    static char line[4096];
    unsigned long long value;
    while (status && fgets(line, sizeof line, status))
        if ((sscanf(line, "CapInh: %llx", &value) == 1 || sscanf(line, "CapPrm: %llx", &value) == 1 ||
             sscanf(line, "CapEff: %llx", &value) == 1 || sscanf(line, "CapAmb: %llx", &value) == 1) &&
            value)
            breach(line);
    uint32_t head[2] = {0x20080522, 0}, sets[6] = {0};
    if (syscall(SYS_capget, head, sets) == 0 && (sets[0] | sets[1] | sets[2] | sets[3] | sets[4] | sets[5]))
        breach("capabilities");
    head[0] = 0x20080522;
    memset(sets, 255, sizeof sets);
    refused(syscall(SYS_capset, head, sets), "all capabilities");
    memset(sets, 0, sizeof sets);
    sets[2] = 1 << 21;
    refused(syscall(SYS_capset, head, sets), "an inheritable capability");
}
static void terminal(void) {
    refused(open("/dev/tty", O_RDWR), "the controlling terminal");
    char letter = 'x';
    for (int stream = 0; stream < 3; ++stream) {
        refused(ioctl(stream, TIOCSTI, &letter), "TIOCSTI");
        letter = 3;
        refused(ioctl(stream, TIOCLINUX, &letter), "TIOCLINUX");
        refused(ioctl(stream, TIOCSCTTY, 1), "TIOCSCTTY");
        if (isatty(stream)) breach("a terminal");
    }
    setsid();
    refused(open("/dev/console", O_RDWR), "the console");
    refused(open("/dev/ptmx", O_RDWR), "a new terminal");
}
static void inherited_state(void) {
    /* The grader was started with another mask. The signals that it ignores are no secret. */
    mode_t mask = umask(022);
    if (mask != 022 && mask != 077) breach("the mask of the grader");
    sigset_t blocked;
    sigprocmask(SIG_BLOCK, NULL, &blocked);
    for (int number = 1; number < 65; ++number)
        if (sigismember(&blocked, number) == 1) breach("a blocked signal");
    char here[PATH_MAX], byte;
    if (!getcwd(here, sizeof here)) breach("no working directory");
    if (read(0, &byte, 1) > 0) breach("standard input");
    if (strlen(target) > 1 && !strncmp(here, target, strlen(target))) breach("the grader's working directory");
}
static void environment(void) {
    extern char **environ;
    /* TARGET is the stage's folder, TARGET2 the submission's. */
    for (char **entry = environ; *entry; ++entry) {
        if (strstr(*entry, "secret") || strstr(*entry, "SECRET")) breach(*entry);
        const char *known[] = {"PATH=", "LANG=", "HOME=", "TMPDIR=", "LC_", "USER=", "LOGNAME=", "TZ=", "SHELL=",
                               "XDG_", "OMP_", "PWD=", "TERM=", "TMP=", "TEMP=", "SOURCE_DATE_EPOCH="};
        unsigned k = 0;
        while (k < LENGTH(known) && strncmp(*entry, known[k], strlen(known[k]))) ++k;
        if (k == LENGTH(known)) breach(*entry);
    }
}

const struct mode process_modes[] = {
    MODE(fork_bomb), MODE(thread_bomb), MODE(vfork_bomb), MODE(processes_and_threads), MODE(zombie_flood),
    MODE(spin), MODE(sleep_long), MODE(stop_itself), MODE(ignore_signals), MODE(vfork_without_end),
    MODE(execute_without_end), MODE(spin_in_short_children), MODE(spin_in_shorter_children), MODE(spin_in_orphans), MODE(spin_in_short_threads),
    MODE(daemon_outlives), MODE(stubborn_daemons), MODE(lasting_daemons),
    MODE(honest_pause), MODE(stopped_daemon), MODE(own_reaper), MODE(output_kept_open),
    MODE(alter_afterwards), MODE(leader_ends_first), MODE(leader_ends_and_thread_spins), MODE(kill_others),
    MODE(kill_all), MODE(kill_by_other_calls), MODE(stop_others), MODE(see_others), MODE(trace_others),
    MODE(trace_by_any_request), MODE(memory_of_others), MODE(handles_of_processes), MODE(limit_others),
    MODE(limits_of_others), MODE(priorities_of_others), MODE(schedule_others), MODE(raise_limits), MODE(timers),
    MODE(signals_in_queue), MODE(process_controls), MODE(capabilities), MODE(terminal), MODE(inherited_state),
    MODE(environment), {0},
};
