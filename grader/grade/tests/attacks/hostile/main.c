/* A hostile submission. Each mode tries one attack; hostile.h tells how. */
#include "hostile.h"

const char *program, *scene, *trace, *right, *target, *target2;

void breach(const char *what) {
    dprintf(2, "BREACH: %s\n", what);
    _exit(42);
}

void refused(long result, const char *what) {
    if (result >= 0) breach(what);
}

void denied(long result, const char *what) {
    if (result >= 0) breach(what);
    if (errno == ENOSYS || errno == EPERM || errno == EACCES) return;
    dprintf(2, "BREACH: %s reached the kernel: %s\n", what, strerror(errno));
    _exit(42);
}

void copy(const char *from, const char *to) {
    static char buffer[1 << 16];
    int in = open(from, O_RDONLY), out = open(to, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ssize_t count;
    if (in < 0 || out < 0) _exit(43);
    while ((count = read(in, buffer, sizeof buffer)) > 0)
        if (write(out, buffer, count) != count) _exit(44);
    close(in);
    close(out);
}

void hand_in(void) { copy(right, trace); }

void cannot_read(const char *path) { refused(open(path, O_RDONLY), path); }

const char *own(const char *name) {
    static char paths[4][PATH_MAX];
    static int next;
    char *path = paths[next++ % 4];
    const char *slash = strrchr(right, '/');
    snprintf(path, PATH_MAX, "%.*s%s%s", (int)(slash - right), right, *name ? "/" : "", name);
    return path;
}

/* Shared by all processes of a mode. */
static struct {
    int count, blown;
    double end;
} *bomb;

int armed(void) {
    if (!bomb->blown && seconds() < bomb->end) return 1;
    _exit(42);
}

void fuse(void) {
    enum { MOST = 300 };
    armed();
    if (__atomic_add_fetch(&bomb->count, 1, __ATOMIC_RELAXED) <= MOST) return;
    bomb->blown = 1;
    breach("processes without end");
}

int in_child(void (*attack)(void)) {
    int status = 0, child = fork();
    if (child == 0) {
        attack();
        _exit(0);
    }
    if (child < 0 || waitpid(child, &status, 0) < 0) _exit(48);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 42) _exit(42);
    return status;
}

void pause_for_ever(void) {
    double start = seconds();
    while (seconds() < start + 60) usleep(100000);
    _exit(49);
}

int altered(const struct stat *before, const struct stat *after) {
    return before->st_mode != after->st_mode || before->st_uid != after->st_uid ||
           before->st_gid != after->st_gid || before->st_size != after->st_size ||
           before->st_nlink != after->st_nlink || before->st_mtim.tv_sec != after->st_mtim.tv_sec ||
           before->st_mtim.tv_nsec != after->st_mtim.tv_nsec ||
           before->st_ctim.tv_sec != after->st_ctim.tv_sec || before->st_ctim.tv_nsec != after->st_ctim.tv_nsec;
}

double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

int main(int count, char **arguments) {
    static const struct mode *const tables[] = {file_modes,   attribute_modes, process_modes, memory_modes,
                                                disk_modes,   ipc_modes,       network_modes, kernel_modes,
                                                output_modes, build_modes};
    if (count < 6) return 46;
    const char *mode = arguments[1];
    program = arguments[0];
    scene = arguments[2], trace = arguments[3], right = arguments[4], target = arguments[5];
    target2 = count > 6 ? arguments[6] : "";
    alarm(60);
    bomb = mmap(NULL, sizeof *bomb, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    bomb->end = seconds() + 30;
    if (!strcmp(mode, "nothing")) return 0;
    if (!strcmp(mode, "exit_1_with_a_right_trace")) {
        hand_in();
        return 1;
    }
    for (unsigned table = 0; table < LENGTH(tables); ++table)
        for (const struct mode *entry = tables[table]; entry->name; ++entry)
            if (!strcmp(mode, entry->name)) {
                entry->run();
                /* A mode that made something else of the trace keeps it. A build has no trace. */
                struct stat status;
                if (*trace && lstat(trace, &status) && errno == ENOENT) hand_in();
                return 0;
            }
    return 47;
}
