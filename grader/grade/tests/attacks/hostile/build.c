/* Builds that mean harm. TRACE is empty: a build hands in nothing. Its working directory is the copy of the
 * submission's folder that the runs are started from. */
#include "hostile.h"

static void build_nothing(void) {}
static void build_daemon(void) {
    if (fork() == 0) {
        setsid();
        if (fork()) _exit(0);
        close(0), close(1), close(2);
        /* Sooner, it would be a build that has not ended yet. */
        usleep(300000);
        for (int k = 0; k < 30000; ++k) {
            usleep(1000);
            unlink("hostile");
            close(open("late", O_WRONLY | O_CREAT, 0644));
        }
        _exit(0);
    }
}
static void build_writes_outside(void) {
    refused(open(target, O_WRONLY), "the target");
    refused(unlink(target), "the target removed");
    const char *places[] = {"../escaped", "../../escaped", "/var/tmp/escaped", "/escaped", "/usr/escaped", "/root/escaped"};
    for (unsigned k = 0; k < LENGTH(places); ++k) {
        /* The sandbox may have a root above the copy; the harness looks whether anything stays. */
        int file = open(places[k], O_WRONLY | O_CREAT, 0644);
        if (file >= 0 && places[k][0] == '/') breach(places[k]);
    }
    close(open("/tmp/escaped", O_WRONLY | O_CREAT, 0644));
    close(open("/dev/shm/escaped", O_WRONLY | O_CREAT, 0644));
}
static void build_reads(void) { cannot_read(target); }
static void exchange_for_link(const char *name, const char *to) {
    unlink(name);
    if (symlink(to, name)) _exit(45);
}
static void build_link_to_oracle(void) { exchange_for_link("hostile", target); }
static void build_trace_from_oracle(void) { exchange_for_link("right.csv", target); }
static void build_trace_from_device(void) { exchange_for_link("right.csv", "/dev/zero"); }
static void build_folder_link(void) {
    /* A folder of the result that leads away. */
    if (symlink("/", "root") || symlink("..", "above") || symlink(target, "oracle")) _exit(45);
}
static void build_set_user_id(void) {
    /* A program that runs cannot be written, and its mode can be changed all the same. */
    chmod("hostile", 06777);
    copy("hostile", "privileged");
    chmod("privileged", 06777);
    chmod(".", 07777);
    mkdir("sticky", 07777);
    chmod("sticky", 07777);
}
static void build_deep_folders(void) {
    for (int k = 0; k < 15000; ++k)
        if (mkdir("d", 0755) || chdir("d")) break;
}
static void build_sparse_file(void) {
    int file = open("sparse", O_WRONLY | O_CREAT, 0644);
    if (ftruncate(file, 1200L << 20)) {}
}
static void build_pipe(void) {
    unlink("hostile");
    if (mkfifo("hostile", 0777)) _exit(45);
}
static void build_pipe_as_trace(void) {
    unlink("right.csv");
    if (mkfifo("right.csv", 0777)) _exit(45);
}
static void build_closed_folders(void) {
    mkdir("closed", 0755);
    close(open("closed/file", O_WRONLY | O_CREAT, 0));
    mkdir("closed/below", 0755);
    chmod("closed/below", 0);
    chmod("closed", 0);
    close(open("unreadable", O_WRONLY | O_CREAT, 0));
}
static void build_closed_itself(void) { chmod(".", 0); }
static void build_many_files(void) {
    char name[32];
    for (int k = 0; k < 20000; ++k) {
        snprintf(name, sizeof name, "file-%d", k);
        int file = open(name, O_WRONLY | O_CREAT, 0644);
        if (file < 0) _exit(45);
        close(file);
    }
}
static void build_names(void) {
    copy("right.csv", "twice");
    if (link("twice", "second")) _exit(45);
    unlink("right.csv");
    if (link("second", "right.csv")) _exit(45);
}
static void build_manifest(void) {
    unlink("submission.toml");
    FILE *file = fopen("submission.toml", "w");
    if (!file) _exit(45);
    fprintf(file, "run = [\"/bin/sh\", \"-c\", \"echo BREACH >&2; exit 42\", \"{scene}\", \"{trace}\"]\n");
    fclose(file);
}
static void build_removes_itself(void) { unlink("hostile"); }
static void build_forks(void) {
    fuse();
    while (armed()) {
        int process = fork();
        if (process == 0) fuse();
        if (process < 0) usleep(1000);
    }
}
static void build_sleeps(void) { pause_for_ever(); }
static void build_floods(void) {
    static char block[1 << 16];
    memset(block, 'x', sizeof block);
    int file = open("flood", O_WRONLY | O_CREAT, 0644);
    for (long total = 0; write(file, block, sizeof block) > 0; total += sizeof block)
        if (total > 4L << 30) breach("a build without end");
}
static void build_fails(void) {
    dprintf(2, "\033[2J]]><script>\xff\xfe\n");
    _exit(1);
}
static void build_locks(void) {
    /* Builds may lock their own files, as package managers do. */
    int file = open("lock", O_RDWR | O_CREAT, 0644);
    if (syscall(SYS_flock, file, LOCK_EX)) _exit(45);
}
/* For runs of what was built. */
static void built_late_file(void) {
    usleep(500000);
    refused(access(own("late"), F_OK), "a file that a build's daemon wrote");
}
static void built_links_lead_nowhere(void) {
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s%s", own("root"), target);
    cannot_read(path);
    cannot_read(own("oracle"));
    refused(open(own("root/escaped"), O_WRONLY | O_CREAT, 0644), "a file by a link of the build");
}

const struct mode build_modes[] = {
    MODE(build_nothing), MODE(build_daemon), MODE(build_writes_outside), MODE(build_reads), MODE(build_link_to_oracle),
    MODE(build_trace_from_oracle), MODE(build_trace_from_device), MODE(build_folder_link), MODE(build_set_user_id),
    MODE(build_deep_folders), MODE(build_sparse_file), MODE(build_pipe), MODE(build_pipe_as_trace),
    MODE(build_closed_folders), MODE(build_closed_itself), MODE(build_many_files), MODE(build_names),
    MODE(build_manifest), MODE(build_removes_itself), MODE(build_forks), MODE(build_sleeps), MODE(build_floods),
    MODE(build_fails), MODE(build_locks), MODE(built_late_file), MODE(built_links_lead_nowhere), {0},
};
