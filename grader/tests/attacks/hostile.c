/* A submission that means harm. Each mode tries one thing; where it gets through, it says BREACH and ends with
 * status 42. Where it does not, it hands in a right trace, so that its verdict is a pass, or does the harm that
 * its limits have to end.
 *
 *     hostile MODE SCENE TRACE RIGHT TARGET...
 *
 * RIGHT is a right trace of the scene, TARGET what the mode is after. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *trace, *right, *target;

static void breach(const char *what) {
    dprintf(2, "BREACH: %s\n", what);
    _exit(42);
}

/* A breach where the result is not a failure. */
static void refused(long result, const char *what) {
    if (result >= 0) breach(what);
}

static void copy(const char *from, const char *to) {
    static char buffer[1 << 16];
    int in = open(from, O_RDONLY), out = open(to, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ssize_t count;
    if (in < 0 || out < 0) _exit(43);
    while ((count = read(in, buffer, sizeof buffer)) > 0)
        if (write(out, buffer, count) != count) _exit(44);
    close(in);
    close(out);
}

static void hand_in(void) { copy(right, trace); }

static void cannot_read(const char *path) { refused(open(path, O_RDONLY), path); }

static void read_oracle(void) { cannot_read(target); }

static void read_by_link(void) {
    if (symlink(target, "link") == 0) cannot_read("link");
    refused(link(target, "hard"), "hard link to the oracle");
}

static void read_by_proc(void) {
    char path[4200];
    const char *roots[] = {"/proc/self/root", "/proc/1/root", "/proc/self/cwd/../../../../../../.."};
    for (int k = 0; k < 3; ++k) {
        snprintf(path, sizeof path, "%s%s", roots[k], target);
        cannot_read(path);
    }
}

static void read_inherited(void) {
    for (int descriptor = 3; descriptor < 1024; ++descriptor)
        if (fcntl(descriptor, F_GETFD) >= 0) breach("an inherited descriptor");
}

static void read_environment(void) {
    if (getenv("ATTACK_SECRET")) breach("the environment");
    char path[64];
    for (int process = 1; process < 50; ++process) {
        snprintf(path, sizeof path, "/proc/%d/environ", process);
        cannot_read(path);
        snprintf(path, sizeof path, "/proc/%d/mem", process);
        cannot_read(path);
    }
    snprintf(path, sizeof path, "/proc/%d/environ", getppid());
    cannot_read(path);
}

static void overwrite(void) {
    refused(open(target, O_WRONLY), "open to write");
    refused(open(target, O_RDONLY | O_TRUNC), "open to truncate");
    refused(truncate(target, 0), "truncate");
    refused(unlink(target), "unlink");
    refused(rename(target, "mine"), "rename away");
    copy(right, "mine");
    refused(rename("mine", target), "rename over");
    unlink("mine");
}

static void write_elsewhere(void) {
    const char *places[] = {"../escaped", "/tmp/escaped", "/var/tmp/escaped", "/dev/shm/escaped", "/escaped"};
    for (int k = 0; k < 5; ++k) refused(open(places[k], O_WRONLY | O_CREAT, 0644), places[k]);
    refused(mkdir("../folder", 0755), "a folder beside its own");
    char here[4096];
    if (getcwd(here, sizeof here)) refused(rename(here, "/tmp/moved"), "its folder moved away");
}

static void output_link(void) {
    if (symlink(target, trace)) _exit(45);
}
static void output_device(void) {
    if (symlink("/dev/zero", trace)) _exit(45);
}
static void output_folder(void) {
    if (mkdir(trace, 0755)) _exit(45);
}
static void output_fifo(void) { refused(mkfifo(trace, 0644), "a pipe"); }
static void output_socket_file(void) { refused(mknod(trace, S_IFSOCK | 0644, 0), "a socket file"); }
static void output_second_name(void) {
    copy(right, "other");
    if (link("other", trace)) _exit(45);
}

/* Whatever is wrong with the sandbox, the machine it is tested on shall live: this goes off before that. */
static void fuse(void) {
    enum { MOST = 1500 };
    static int *count;
    if (!count)
        count = mmap(NULL, sizeof *count, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (__atomic_add_fetch(count, 1, __ATOMIC_RELAXED) > MOST) breach("processes without end");
}
static void fork_bomb(void) {
    fuse();
    for (;;) {
        int process = fork();
        if (process == 0) fuse();
        if (process < 0) usleep(1000);
    }
}
static void *spin_forever(void *unused) {
    for (;;) pause();
    return unused;
}
static void thread_bomb(void) {
    for (;;) {
        pthread_t thread;
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        pthread_attr_setstacksize(&attributes, 1 << 14);
        fuse();
        if (pthread_create(&thread, &attributes, spin_forever, NULL)) pause();
    }
}
static void memory_bomb(void) {
    for (;;) {
        char *memory = malloc(1 << 20);
        if (!memory) abort();
        memset(memory, 1, 1 << 20);
    }
}
static void shared_memory_bomb(void) {
    for (;;) {
        char *memory =
            mmap(NULL, 1 << 22, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED) pause();
        memset(memory, 1, 1 << 22);
    }
}
static void forked_memory_bomb(void) {
    /* Each stays below the limit. */
    for (int k = 0; k < 6; ++k)
        if (fork() == 0) {
            char *memory = malloc(48 << 20);
            if (memory) memset(memory, k, 48 << 20);
            for (;;) pause();
        }
    for (;;) pause();
}
static void spin(void) {
    for (volatile int k = 0;; ++k) {}
}
static void sleep_long(void) { sleep(1000); }
static void stop_itself(void) { raise(SIGSTOP); pause(); }
static void ignore_signals(void) {
    for (int k = 1; k < 65; ++k) signal(k, SIG_IGN);
    for (;;) sleep(1);
}

static void flood(int descriptor) {
    static char block[1 << 16];
    memset(block, 'x', sizeof block);
    while (write(descriptor, block, sizeof block) > 0) {}
}
static void flood_trace(void) { flood(open(trace, O_WRONLY | O_CREAT, 0644)); }
static void flood_stdout(void) { flood(1); }
static void flood_stderr(void) { flood(2); }
static void many_files(void) {
    char name[32];
    for (int k = 0; k < 100000; ++k) {
        snprintf(name, sizeof name, "file-%d", k);
        close(open(name, O_WRONLY | O_CREAT, 0644));
    }
}
static void many_large_files(void) {
    /* Each is smaller than a file may be. */
    char name[32];
    for (int k = 0;; ++k) {
        snprintf(name, sizeof name, "file-%d", k);
        int file = open(name, O_WRONLY | O_CREAT, 0644);
        static char block[1 << 20];
        for (int m = 0; m < 4; ++m)
            if (write(file, block, sizeof block) < 0) break;
        close(file);
    }
}
static void huge_claim(void) {
    int file = open(trace, O_WRONLY | O_CREAT, 0644);
    if (ftruncate(file, 1000000000000000) == 0) breach("a petabyte");
}
static void sparse_trace(void) {
    int file = open(trace, O_WRONLY | O_CREAT, 0644);
    if (ftruncate(file, 15 << 20)) _exit(45);
}
static void garbage_trace(void) {
    int file = open(trace, O_WRONLY | O_CREAT, 0644);
    if (write(file, "garbage", 7) != 7) _exit(45);
}

static void daemon_outlives(void) {
    if (fork() == 0) {
        setsid();
        if (fork() == 0) {
            close(0), close(1), close(2);
            for (;;) {
                usleep(1000);
                copy("/dev/zero", "after");
            }
        }
        _exit(0);
    }
    wait(NULL);
}
static void alter_afterwards(void) {
    hand_in();
    if (fork() == 0) {
        setsid();
        /* Sooner, it would be a run that has not ended yet. */
        usleep(200000);
        for (;;) {
            int file = open(trace, O_WRONLY);
            if (write(file, "altered!", 8) < 0) {}
            close(file);
        }
    }
    _exit(0);
}

static void kill_others(void) {
    signal(SIGTERM, SIG_IGN);
    kill(getppid(), SIGKILL);
    kill(1, SIGKILL);
    kill(atoi(target), SIGKILL);
    syscall(SYS_tgkill, atoi(target), atoi(target), SIGKILL);
    int handle = syscall(SYS_pidfd_open, atoi(target), 0);
    if (handle >= 0) breach("a handle of another process");
    if (kill(atoi(target), 0) == 0) breach("another process is in sight");
}
static void trace_others(void) {
    refused(ptrace(PTRACE_ATTACH, atoi(target), 0, 0), "ptrace");
    refused(ptrace(PTRACE_ATTACH, getppid(), 0, 0), "ptrace of its parent");
    refused(ptrace(PTRACE_SEIZE, 1, 0, 0), "ptrace of the first");
    char byte;
    struct iovec here = {&byte, 1}, there = {&byte, 1};
    refused(process_vm_readv(getppid(), &here, 1, &there, 1, 0), "another's memory");
}
static void limit_others(void) {
    unsigned long limits[2] = {0, 0};
    refused(syscall(SYS_prlimit64, getppid(), 0, limits, NULL), "limits of its parent");
}

static void connect_to(int family, int kind, const char *address) {
    int handle = socket(family, kind, 0);
    if (handle < 0) return;
    struct sockaddr_in where = {.sin_family = AF_INET, .sin_port = htons(atoi(target))};
    inet_pton(AF_INET, address, &where.sin_addr);
    if (connect(handle, (struct sockaddr *)&where, sizeof where) == 0) breach(address);
    breach("a socket");
}
static void connect_loopback(void) { connect_to(AF_INET, SOCK_STREAM, "127.0.0.1"); }
static void connect_out(void) { connect_to(AF_INET, SOCK_STREAM, "192.0.2.1"); }
static void send_datagram(void) { connect_to(AF_INET, SOCK_DGRAM, "127.0.0.1"); }
static void unix_socket(void) {
    refused(socket(AF_UNIX, SOCK_STREAM, 0), "a socket of the file system");
}

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
static void leave_behind(void) {
    refused(shmget(IPC_PRIVATE, 4096, 0600), "shared memory");
    refused(syscall(SYS_memfd_create, "x", 0), "memory without a limit");
}

static void escapes(void) {
    dprintf(2, "\033[2J\033]0;owned\007\033[31mPASS\b\b\b\bFAIL\r\n\xe2\x80\xae drawkcab\n");
    dprintf(1, "\033c\n");
    _exit(1);
}
static void segfault(void) { *(volatile int *)8 = 1; }

static const struct {
    const char *name;
    void (*run)(void);
} modes[] = {
#define MODE(name) {#name, name}
    MODE(hand_in), MODE(read_oracle), MODE(read_by_link), MODE(read_by_proc), MODE(read_inherited),
    MODE(read_environment), MODE(overwrite), MODE(write_elsewhere), MODE(output_link),
    MODE(output_device), MODE(output_folder), MODE(output_fifo), MODE(output_socket_file),
    MODE(output_second_name), MODE(fork_bomb), MODE(thread_bomb), MODE(memory_bomb),
    MODE(shared_memory_bomb), MODE(forked_memory_bomb), MODE(spin), MODE(sleep_long),
    MODE(stop_itself), MODE(ignore_signals), MODE(flood_trace), MODE(flood_stdout),
    MODE(flood_stderr), MODE(many_files), MODE(many_large_files), MODE(huge_claim),
    MODE(sparse_trace), MODE(garbage_trace), MODE(daemon_outlives), MODE(alter_afterwards),
    MODE(kill_others), MODE(trace_others), MODE(limit_others), MODE(connect_loopback),
    MODE(connect_out), MODE(send_datagram), MODE(unix_socket), MODE(new_privileges),
    MODE(leave_behind), MODE(escapes), MODE(segfault),
};

int main(int count, char **arguments) {
    if (count < 6) return 46;
    const char *mode = arguments[1];
    trace = arguments[3], right = arguments[4], target = arguments[5];
    if (!strcmp(mode, "nothing")) return 0;
    if (!strcmp(mode, "exit_1_with_a_right_trace")) {
        hand_in();
        return 1;
    }
    for (unsigned k = 0; k < sizeof modes / sizeof *modes; ++k)
        if (!strcmp(mode, modes[k].name)) {
            modes[k].run();
            /* Whoever made something else of the trace, or was to be ended, does not come here. */
            struct stat status;
            if (lstat(trace, &status) && errno == ENOENT) hand_in();
            return 0;
        }
    return 47;
}
