/* Reads, writes and finds files that are not the submission's. */
#include "hostile.h"
#include <sys/fanotify.h>
#include <sys/inotify.h>
#include <sys/statfs.h>
#include <sys/xattr.h>

static void read_oracle(void) { cannot_read(target); }

static void read_by_link(void) {
    if (symlink(target, "link") == 0) cannot_read("link");
    refused(link(target, "hard"), "hard link to the oracle");
}

static void read_by_proc(void) {
    char path[4200];
    const char *roots[] = {"/proc/self/root", "/proc/1/root", "/proc/self/cwd/../../../../../../.."};
    for (unsigned k = 0; k < LENGTH(roots); ++k) {
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
        if (process == getpid()) continue;
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

/* The submission may write to places in its root; the harness looks whether anything stays
 * there. A run must not reach its neighbours. */
static void write_elsewhere(void) {
    const char *places[] = {"/var/tmp/escaped", "/escaped", "/usr/escaped", "/etc/escaped",
                            "/root/escaped", "/home/escaped", "/run/escaped", "/opt/escaped"};
    for (unsigned k = 0; k < LENGTH(places); ++k) refused(open(places[k], O_WRONLY | O_CREAT, 0644), places[k]);
    const char *shared[] = {"/tmp/escaped", "/dev/shm/escaped", "../escaped"};
    for (unsigned k = 0; k < LENGTH(shared); ++k) close(open(shared[k], O_WRONLY | O_CREAT, 0644));
    mkdir("../escaped-folder", 0755);
    /* The path of the trace leads to the folder by its name, wherever that is. */
    char here[4096];
    if (getcwd(here, sizeof here) && rename(here, "/tmp/moved") == 0) rename("/tmp/moved", here);
}

/* Existence: a call must answer the same for TARGET, which exists, and for a name that does not exist. */
static char missing[PATH_MAX];
static void same(long first, int first_error, long second, int second_error, const char *what) {
    if ((first < 0) != (second < 0) || (first < 0 && first_error != second_error)) breach(what);
}
#define TELLS(call, what)                                                                                         \
    do {                                                                                                          \
        const char *path = target;                                                                                \
        long first = (call);                                                                                      \
        int first_error = errno;                                                                                  \
        path = missing;                                                                                           \
        long second = (call);                                                                                     \
        same(first, first_error, second, errno, what);                                                            \
    } while (0)

static void name_missing(void) { snprintf(missing, sizeof missing, "%s-missing", target); }
static void exists_by_stat(void) {
    struct stat status;
    name_missing();
    TELLS(stat(path, &status), "stat");
    TELLS(lstat(path, &status), "lstat");
    TELLS(fstatat(AT_FDCWD, path, &status, AT_NO_AUTOMOUNT), "fstatat");
}
static void exists_by_statx(void) {
    struct statx status;
    name_missing();
    TELLS(statx(AT_FDCWD, path, 0, STATX_ALL, &status), "statx");
    TELLS(statx(AT_FDCWD, path, AT_STATX_DONT_SYNC, 0, &status), "statx without a field");
}
static void exists_by_access(void) {
    name_missing();
    TELLS(access(path, F_OK), "access");
    TELLS(access(path, R_OK), "access to read");
    TELLS(syscall(NR_faccessat2, AT_FDCWD, path, F_OK, AT_EACCESS), "faccessat2");
}
static void exists_by_readlink(void) {
    char link[64];
    name_missing();
    TELLS(readlink(path, link, sizeof link), "readlink");
}
static void exists_by_statfs(void) {
    struct statfs status;
    name_missing();
    TELLS(statfs(path, &status), "statfs");
    TELLS(pathconf(path, _PC_NAME_MAX), "pathconf");
}
static void exists_by_open(void) {
    name_missing();
    TELLS(open(path, O_RDONLY), "open");
    TELLS(open(path, O_PATH), "open of a path");
    TELLS(open(path, O_WRONLY | O_CREAT | O_EXCL, 0600), "open to create");
}
static void exists_by_making(void) {
    name_missing();
    TELLS(mkdir(path, 0755), "mkdir");
    TELLS(symlink("nothing", path), "symlink");
    TELLS(rename(path, "mine"), "rename");
    TELLS(rmdir(path), "rmdir");
    TELLS(link(path, "mine"), "link");
}
static void exists_by_execution(void) {
    char *none[] = {NULL};
    name_missing();
    TELLS(execve(path, none, none), "execve");
    TELLS(chdir(path), "chdir");
    TELLS(truncate(path, 0), "truncate");
}
static void exists_by_xattr(void) {
    char value[64];
    name_missing();
    TELLS(getxattr(path, "user.none", value, sizeof value), "getxattr");
    TELLS(listxattr(path, value, sizeof value), "listxattr");
}
static void watch_by_inotify(void) {
    int watcher = inotify_init1(0);
    denied(watcher, "inotify");
}
static void watch_by_fanotify(void) {
    denied(fanotify_init(FAN_CLASS_NOTIF, O_RDONLY), "fanotify");
    denied(fanotify_init(FAN_REPORT_FID, O_RDONLY), "fanotify of handles");
    denied(syscall(SYS_fanotify_mark, -1, 0, 0, AT_FDCWD, NULL), "fanotify_mark");
}
static void watch_by_dnotify(void) {
    int folder = open(own(""), O_RDONLY | O_DIRECTORY);
    if (folder >= 0) refused(fcntl(folder, F_NOTIFY, DN_MODIFY | DN_CREATE), "dnotify of its own folder");
    folder = open("/usr/bin", O_RDONLY | O_DIRECTORY);
    if (folder >= 0) refused(fcntl(folder, F_NOTIFY, DN_ACCESS), "dnotify of the system");
}
static void read_by_handle(void) {
    struct {
        struct file_handle head;
        char bytes[128];
    } handle = {.head = {.handle_bytes = 128}};
    int mount;
    denied(name_to_handle_at(AT_FDCWD, "/usr/bin/env", &handle.head, &mount, 0), "name_to_handle_at");
    denied(name_to_handle_at(AT_FDCWD, right, &handle.head, &mount, 0), "name_to_handle_at of its own");
    denied(open_by_handle_at(AT_FDCWD, &handle.head, O_RDONLY), "open_by_handle_at");
}
static void list_mounts(void) {
    uint64_t request[4] = {32, UINT64_MAX, 0, 0}, answer[64];
    denied(syscall(NR_listmount, request, answer, 64, 0), "listmount");
    denied(syscall(NR_statmount, request, answer, sizeof answer, 0), "statmount");
    denied(syscall(NR_quotactl_fd, 1, 0, 0, NULL), "quotactl_fd");
}
/* TARGET is a mount point of the machine, TARGET2 the source of its root. */
static void read_mounts(void) {
    const char *tables[] = {"/proc/mounts",         "/proc/self/mounts",   "/proc/self/mountinfo",
                            "/proc/self/mountstats", "/proc/1/mountinfo", "/etc/mtab"};
    for (unsigned k = 0; k < LENGTH(tables); ++k) {
        FILE *table = fopen(tables[k], "r");
        if (!table) continue;
        static char line[1 << 16];
        while (fgets(line, sizeof line, table))
            for (char *word = strtok(line, " \n"); word; word = strtok(NULL, " \n"))
                if (!strcmp(word, target)) breach(tables[k]);
        fclose(table);
    }
}
/* TARGET's folder holds what the submission must not see. */
static void list_neighbours(void) {
    char folder[PATH_MAX];
    for (int up = 1; up <= 3; ++up) {
        snprintf(folder, sizeof folder, "%s", target);
        for (int k = 0; k < up; ++k) *strrchr(folder, '/') = 0;
        DIR *listing = opendir(folder);
        if (!listing) continue;
        for (struct dirent *entry; (entry = readdir(listing));)
            if (!strcmp(entry->d_name, "other") || !strcmp(entry->d_name, "expected") ||
                !strcmp(entry->d_name, "solution.c"))
                breach("a listing of another's folder");
        closedir(listing);
    }
}
static void read_by_path_descriptor(void) {
    char path[64], byte;
    int found = open(target, O_PATH);
    if (found < 0) return;
    snprintf(path, sizeof path, "/proc/self/fd/%d", found);
    cannot_read(path);
    refused(openat(found, "", O_RDONLY), "openat of a path");
    refused(read(found, &byte, 1), "read of a path");
    char *none[] = {NULL};
    execveat(found, "", none, none, AT_EMPTY_PATH);
}
static void read_by_openat2(void) {
    for (uint64_t resolve = 0; resolve < 64; ++resolve) {
        uint64_t how[3] = {O_RDONLY, 0, resolve};
        refused(syscall(NR_openat2, AT_FDCWD, target, how, sizeof how), "openat2");
    }
}
static void read_first_process(void) {
    const char *names[] = {"mem",   "environ", "maps",    "smaps",   "pagemap", "stack", "syscall", "auxv",
                           "io",    "fd/0",    "fd/1",    "fd/2",    "cwd/.",   "root/.", "exe",     "map_files",
                           "fd",    "personality", "timers", "ns/mnt"};
    char path[64];
    const int processes[] = {1, getppid()};
    for (unsigned process = 0; process < 2; ++process)
        for (unsigned k = 0; k < LENGTH(names); ++k) {
            if (processes[process] == 0) continue;
            snprintf(path, sizeof path, "/proc/%d/%s", processes[process], names[k]);
            int file = open(path, O_RDONLY | O_NONBLOCK);
            char bytes[4096];
            struct dirent *entry;
            if (file < 0) continue;
            /* A folder that cannot be listed, and a file that cannot be read, tell nothing. */
            if (read(file, bytes, sizeof bytes) > 0) breach(path);
            DIR *folder = fdopendir(file);
            while (folder && (entry = readdir(folder)))
                if (entry->d_name[0] != '.') breach(path);
            if (folder) closedir(folder);
            else close(file);
        }
}
static void read_devices(void) {
    const char *devices[] = {"/dev/mem",     "/dev/kmem",        "/dev/port",     "/dev/kmsg",     "/dev/vda",
                             "/dev/sda",     "/dev/nvme0n1",     "/dev/dm-0",     "/dev/loop0",    "/dev/loop-control",
                             "/dev/fuse",    "/dev/kvm",         "/dev/net/tun",  "/dev/tty",      "/dev/tty0",
                             "/dev/console", "/dev/ptmx",        "/dev/pts/0",    "/dev/pts/ptmx", "/dev/userfaultfd",
                             "/dev/hpet",    "/dev/rtc0",        "/dev/snapshot", "/dev/uinput",   "/dev/input/event0",
                             "/dev/dri/card0", "/dev/mapper/control", "/dev/cpu/0/msr", "/dev/vhost-net", "/dev/vsock",
                             "/dev/mqueue",  "/dev/hugepages",   "/proc/kcore",   "/proc/kmsg",    "/proc/kpageflags",
                             "/proc/kpagecount", "/proc/sysrq-trigger", "/sys/kernel/debug", "/sys/kernel/tracing",
                             "/sys/kernel/notes", "/sys/firmware", "/sys/class/net", "/sys/fs/cgroup"};
    for (unsigned k = 0; k < LENGTH(devices); ++k) {
        refused(open(devices[k], O_RDONLY | O_NONBLOCK | O_NOCTTY), devices[k]);
        refused(open(devices[k], O_WRONLY | O_NONBLOCK | O_NOCTTY), devices[k]);
    }
}
static void make_devices(void) {
    refused(mknod("device", S_IFCHR | 0666, 0x103), "a character device");
    refused(mknod("device", S_IFBLK | 0666, 0xfe00), "a block device");
    refused(mknod("/dev/device", S_IFCHR | 0666, 0x103), "a character device in /dev");
}
/* Opens to write, and writes nothing. */
static void write_kernel_settings(void) {
    const char *settings[] = {"/proc/sys/kernel/core_pattern",       "/proc/sys/kernel/hostname",
                              "/proc/sys/kernel/modprobe",           "/proc/sys/kernel/sysrq",
                              "/proc/sys/kernel/ns_last_pid",        "/proc/sys/kernel/shmmax",
                              "/proc/sys/kernel/sem",                "/proc/sys/kernel/msgmax",
                              "/proc/sys/fs/mqueue/queues_max",      "/proc/sys/net/ipv4/ip_forward",
                              "/proc/sys/vm/drop_caches",            "/proc/sys/vm/overcommit_memory",
                              "/proc/sys/user/max_user_namespaces",  "/proc/sys/fs/file-max",
                              "/proc/sys/fs/binfmt_misc/register",   "/proc/sysrq-trigger",
                              "/proc/mtrr",                          "/proc/acpi/wakeup",
                              "/proc/bus/pci/00/00.0",               "/proc/irq/default_smp_affinity",
                              "/proc/timer_list",                    "/proc/dynamic_debug/control"};
    for (unsigned k = 0; k < LENGTH(settings); ++k) refused(open(settings[k], O_WRONLY), settings[k]);
}
static void write_process_settings(void) {
    const char *settings[] = {"uid_map", "gid_map", "setgroups", "projid_map", "loginuid", "autogroup",
                              "oom_score_adj", "oom_adj", "attr/current", "attr/exec", "sched", "timerslack_ns",
                              "clear_refs", "coredump_filter", "timens_offsets", "comm"};
    char path[64];
    for (unsigned k = 0; k < LENGTH(settings); ++k) {
        snprintf(path, sizeof path, "/proc/self/%s", settings[k]);
        refused(open(path, O_WRONLY), path);
        snprintf(path, sizeof path, "/proc/1/%s", settings[k]);
        refused(open(path, O_WRONLY), path);
        if (getppid() <= 1) continue;
        snprintf(path, sizeof path, "/proc/%d/%s", getppid(), settings[k]);
        refused(open(path, O_WRONLY), path);
    }
}
static void write_sys(void) {
    const char *settings[] = {"/sys/power/state", "/sys/kernel/mm/ksm/run", "/sys/kernel/mm/transparent_hugepage/enabled",
                              "/sys/kernel/uevent_helper", "/sys/devices/system/cpu/cpu1/online",
                              "/sys/devices/system/cpu/cpu0/uevent", "/sys/fs/cgroup/cgroup.procs",
                              "/sys/fs/cgroup/cgroup.subtree_control", "/sys/module/kernel/parameters/panic"};
    for (unsigned k = 0; k < LENGTH(settings); ++k) refused(open(settings[k], O_WRONLY), settings[k]);
    refused(mkdir("/sys/fs/cgroup/escaped", 0755), "a cgroup");
    refused(mkdir("/sys/fs/cgroup/unified/escaped", 0755), "a cgroup");
}
static void write_system(void) {
    const char *files[] = {"/usr/bin/env", "/bin/sh", "/etc/passwd", "/etc/ld.so.cache", "/etc/hosts", "/etc/localtime"};
    const char *folders[] = {"/usr", "/usr/bin", "/usr/lib", "/usr/local/bin", "/lib", "/bin", "/sbin", "/etc",
                             "/proc", "/sys", "/", "/dev/fd"};
    char path[64];
    for (unsigned k = 0; k < LENGTH(files); ++k) refused(open(files[k], O_WRONLY), files[k]);
    for (unsigned k = 0; k < LENGTH(folders); ++k) {
        snprintf(path, sizeof path, "%s/escaped", folders[k]);
        refused(open(path, O_WRONLY | O_CREAT, 0644), path);
        refused(mkdir(path, 0755), path);
        refused(symlink("x", path), path);
        refused(open(folders[k], O_TMPFILE | O_RDWR, 0644), path);
    }
    refused(open("/etc/ld.so.preload", O_WRONLY | O_CREAT, 0644), "ld.so.preload");
}
static void write_own_folder(void) {
    refused(open(right, O_WRONLY), "its own file");
    refused(open(right, O_RDWR | O_APPEND), "its own file to append");
    refused(open(right, O_RDONLY | O_TRUNC), "its own file to truncate");
    refused(truncate(right, 0), "truncate");
    refused(open(own("new"), O_WRONLY | O_CREAT, 0644), "a new file in its folder");
    refused(open(own(""), O_TMPFILE | O_RDWR, 0644), "a nameless file in its folder");
    refused(mkdir(own("new"), 0755), "a new folder in its folder");
    refused(symlink("x", own("new")), "a new link in its folder");
    refused(link(right, own("new")), "a second name in its folder");
    refused(mkfifo(own("new"), 0644), "a new pipe in its folder");
    refused(rename(right, own("new")), "rename");
    refused(syscall(SYS_renameat2, AT_FDCWD, right, AT_FDCWD, own("submission.toml"), 2), "exchange");
    refused(unlink(right), "unlink");
    refused(rmdir(own("")), "rmdir of its folder");
    int file = open(right, O_RDONLY);
    refused(ftruncate(file, 0), "ftruncate of what is open to read");
    refused(fallocate(file, 0, 0, 1 << 16), "fallocate of what is open to read");
    void *memory = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory != MAP_FAILED) breach("a writable mapping of its own file");
}
static void write_own_by_second_name(void) {
    refused(link(right, "second"), "a second name of its own file");
    refused(linkat(AT_FDCWD, right, AT_FDCWD, "second", AT_SYMLINK_FOLLOW), "the same by linkat");
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", open(right, O_RDONLY));
    refused(linkat(AT_FDCWD, path, AT_FDCWD, "second", AT_SYMLINK_FOLLOW), "the same by a descriptor");
    refused(rename(right, "second"), "its own file moved into the scratch folder");
    refused(open(path, O_WRONLY), "its own file opened again to write");
    refused(open(path, O_RDWR), "its own file opened again to read and write");
}
static void write_by_proc_root(void) {
    char path[PATH_MAX + 64];
    const char *roots[] = {"/proc/self/root", "/proc/1/root", "/proc/self/cwd/../../../../../../..", "/proc/1/cwd/../../../.."};
    for (unsigned k = 0; k < LENGTH(roots); ++k) {
        snprintf(path, sizeof path, "%s%s", roots[k], right);
        refused(open(path, O_WRONLY), path);
        snprintf(path, sizeof path, "%s%s", roots[k], target);
        refused(open(path, O_WRONLY), path);
        snprintf(path, sizeof path, "%s/usr/bin/env", roots[k]);
        refused(open(path, O_WRONLY), path);
    }
}
static void walk_up(void) {
    /* From a descriptor of a folder that is removed, and of one that is moved, `..` must not leave the world. */
    int home = open(".", O_RDONLY | O_DIRECTORY);
    mkdir("a", 0755), mkdir("a/b", 0755);
    int folder = open("a/b", O_RDONLY | O_DIRECTORY);
    rename("a/b", "b");
    char path[PATH_MAX + 128] = "";
    for (int k = 0; k < 20; ++k) strcat(path, "../");
    strcat(path, target + 1);
    refused(openat(folder, path, O_RDONLY), "a path from a moved folder");
    rmdir("b");
    refused(openat(folder, path, O_RDONLY), "a path from a removed folder");
    if (fchdir(folder) == 0) {
        refused(open(path, O_RDONLY), "a path from where no folder is");
        if (chdir(own("")) == 0) refused(open(path, O_RDONLY), "a path from its own folder");
    }
    if (fchdir(home)) _exit(45);
}
/* The first of two runs leaves files wherever it can, the second looks for them. */
static const char *const kept[] = {"left-behind", "/tmp/escaped-left", "/dev/shm/escaped-left", "/var/tmp/escaped-left",
                                   "/work/left-behind", "/run/escaped-left", "/escaped-left"};
static void leave_files(void) {
    for (unsigned k = 0; k < LENGTH(kept); ++k) close(open(kept[k], O_WRONLY | O_CREAT, 0644));
    close(open(own("left-behind"), O_WRONLY | O_CREAT, 0644));
    mkdir(".cache", 0755);
    close(open(".cache/left-behind", O_WRONLY | O_CREAT, 0644));
}
static void find_files(void) {
    for (unsigned k = 0; k < LENGTH(kept); ++k) refused(access(kept[k], F_OK), kept[k]);
    refused(access(own("left-behind"), F_OK), "a file in its folder");
    refused(access(".cache/left-behind", F_OK), "a cache");
}

const struct mode file_modes[] = {
    MODE(hand_in), MODE(read_oracle), MODE(read_by_link), MODE(read_by_proc), MODE(read_inherited),
    MODE(read_environment), MODE(overwrite), MODE(write_elsewhere), MODE(exists_by_stat), MODE(exists_by_statx),
    MODE(exists_by_access), MODE(exists_by_readlink), MODE(exists_by_statfs), MODE(exists_by_open),
    MODE(exists_by_making), MODE(exists_by_execution), MODE(exists_by_xattr), MODE(watch_by_inotify),
    MODE(watch_by_fanotify), MODE(watch_by_dnotify), MODE(read_by_handle), MODE(list_mounts), MODE(read_mounts),
    MODE(list_neighbours), MODE(read_by_path_descriptor), MODE(read_by_openat2), MODE(read_first_process),
    MODE(read_devices), MODE(make_devices), MODE(write_kernel_settings), MODE(write_process_settings),
    MODE(write_sys), MODE(write_system), MODE(write_own_folder), MODE(write_own_by_second_name),
    MODE(write_by_proc_root), MODE(walk_up), MODE(leave_files), MODE(find_files), {0},
};
