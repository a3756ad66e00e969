/* Changes attributes of files. Every change sets the value that is there already, and only the time of the last
 * change tells that it was made: nothing is harmed where it succeeds. */
#include "hostile.h"
#include <sys/xattr.h>
#include <utime.h>

/* ioctls of linux/fs.h, which does not go with sys/mount.h. */
#define GET_FLAGS _IOR('f', 1, long)
#define SET_FLAGS _IOW('f', 2, long)
#define GET_VERSION _IOR('v', 1, long)
#define SET_VERSION _IOW('v', 2, long)
struct fsxattr_ {
    uint32_t flags, extent, extents, project, cow;
    char padding[8];
};
#define GET_XATTR _IOR('X', 31, struct fsxattr_)
#define SET_XATTR _IOW('X', 32, struct fsxattr_)

static struct stat before;

static void by_chmod(const char *path) {
    mode_t mode = before.st_mode & 07777;
    chmod(path, mode);
    fchmodat(AT_FDCWD, path, mode, 0);
    syscall(SYS_fchmodat, AT_FDCWD, path, mode);
    syscall(NR_fchmodat2, AT_FDCWD, path, mode, 0);
    syscall(NR_fchmodat2, AT_FDCWD, path, mode, AT_SYMLINK_NOFOLLOW);
}
static void by_chown(const char *path) {
    if (chown(path, before.st_uid, before.st_gid)) {}
    if (lchown(path, before.st_uid, before.st_gid)) {}
    if (fchownat(AT_FDCWD, path, before.st_uid, before.st_gid, 0)) {}
    if (fchownat(AT_FDCWD, path, getuid(), getgid(), AT_SYMLINK_NOFOLLOW)) {}
    if (chown(path, -1, -1)) {}
    if (chown(path, -1, getgid())) {}
}
static void by_utimes(const char *path) {
    struct timespec times[2] = {before.st_atim, before.st_mtim};
    struct timeval rough[2] = {{before.st_atim.tv_sec, 0}, {before.st_mtim.tv_sec, 0}};
    struct utimbuf old = {before.st_atim.tv_sec, before.st_mtim.tv_sec};
    utimensat(AT_FDCWD, path, times, 0);
    utimensat(AT_FDCWD, path, times, AT_SYMLINK_NOFOLLOW);
    utimes(path, rough);
    lutimes(path, rough);
    futimesat(AT_FDCWD, path, rough);
    utime(path, &old);
}
static void by_xattr(const char *path) {
    const char *names[] = {"user.escaped", "trusted.escaped", "security.escaped"};
    for (unsigned k = 0; k < LENGTH(names); ++k) {
        uint64_t value[2] = {(uintptr_t) "1", 1};
        setxattr(path, names[k], "1", 1, 0);
        lsetxattr(path, names[k], "1", 1, 0);
        syscall(NR_setxattrat, AT_FDCWD, path, 0, names[k], value, sizeof value);
        removexattr(path, names[k]);
        lremovexattr(path, names[k]);
        syscall(NR_removexattrat, AT_FDCWD, path, 0, names[k]);
    }
    setxattr(path, "system.posix_acl_access", "\2\0\0\0", 4, 0);
}
static void by_file_attr(const char *path) {
    uint32_t attributes[8] = {0};
    syscall(NR_file_setattr, AT_FDCWD, path, attributes, 24, 0);
    syscall(NR_file_setattr, AT_FDCWD, path, attributes, 24, AT_SYMLINK_NOFOLLOW);
}
static void by_ioctl(int file) {
    long flags = 0;
    struct fsxattr_ extended = {0};
    if (ioctl(file, GET_FLAGS, &flags) == 0 || errno == EPERM || errno == ENOSYS) ioctl(file, SET_FLAGS, &flags);
    if (ioctl(file, GET_XATTR, &extended) == 0) ioctl(file, SET_XATTR, &extended);
    if (ioctl(file, GET_VERSION, &flags) == 0) ioctl(file, SET_VERSION, &flags);
}
static void by_descriptor(int file) {
    struct timespec times[2] = {before.st_atim, before.st_mtim};
    mode_t mode = before.st_mode & 07777;
    fchmod(file, mode);
    fchmodat(file, "", mode, AT_EMPTY_PATH);
    syscall(NR_fchmodat2, file, "", mode, AT_EMPTY_PATH);
    if (fchown(file, before.st_uid, before.st_gid)) {}
    if (fchown(file, -1, -1)) {}
    if (fchownat(file, "", before.st_uid, before.st_gid, AT_EMPTY_PATH)) {}
    futimens(file, times);
    syscall(SYS_utimensat, file, NULL, times, 0);
    syscall(SYS_utimensat, file, "", times, AT_EMPTY_PATH);
    fsetxattr(file, "user.escaped", "1", 1, 0);
    fremovexattr(file, "user.escaped");
    uint64_t value[2] = {(uintptr_t) "1", 1};
    syscall(NR_setxattrat, file, "", AT_EMPTY_PATH, "user.escaped", value, sizeof value);
    syscall(NR_removexattrat, file, "", AT_EMPTY_PATH, "user.escaped");
    by_ioctl(file);
}

/* A stamp of the same moment would hide a change. */
static void look(const char *path, void (*change)(const char *path)) {
    struct stat after;
    usleep(20000);
    int seen = stat(path, &before) == 0;
    if (!seen) memset(&before, 0, sizeof before), before.st_mode = 0644, before.st_uid = getuid();
    change(path);
    if (seen && (stat(path, &after) || altered(&before, &after))) breach(path);
}
static void look_at_descriptor(int file, const char *what) {
    struct stat after;
    usleep(20000);
    if (file < 0 || fstat(file, &before)) return;
    by_descriptor(file);
    if (fstat(file, &after) || altered(&before, &after)) breach(what);
}
static void every_way(const char *path) {
    by_chmod(path), by_chown(path), by_utimes(path), by_xattr(path), by_file_attr(path);
}

static void chmod_target(void) {
    look(target, by_chmod);
    refused(chmod(target, 04777) ? -1 : access(target, X_OK), "chmod with another mode");
}
static void chown_target(void) { look(target, by_chown); }
static void utimes_target(void) { look(target, by_utimes); }
static void xattr_target(void) { look(target, by_xattr); }
static void file_attr_target(void) { look(target, by_file_attr); }
static void attributes_by_proc(void) {
    char path[PATH_MAX + 64];
    const char *roots[] = {"/proc/self/root", "/proc/self/cwd/../../../../../../..", "/proc/1/root",
                           "/proc/1/cwd/../../../../../..", "/proc/thread-self/root"};
    const char *files[] = {target, right, "/usr/bin/env"};
    for (unsigned root = 0; root < LENGTH(roots); ++root)
        for (unsigned file = 0; file < LENGTH(files); ++file) {
            snprintf(path, sizeof path, "%s%s", roots[root], files[file]);
            look(path, every_way);
        }
}
static void attributes_of_own_file(void) {
    look(right, every_way);
    look(own("hostile"), every_way);
    look(own("submission.toml"), every_way);
}
static void attributes_of_own_folder(void) {
    look(own(""), every_way);
    look(own("."), every_way);
    look_at_descriptor(open(own(""), O_RDONLY | O_DIRECTORY), "a descriptor of its own folder");
    look_at_descriptor(open(own(""), O_PATH), "a path descriptor of its own folder");
}
static void attributes_by_descriptor(void) {
    look_at_descriptor(open(right, O_RDONLY), "a descriptor of its own file");
    look_at_descriptor(open(program, O_RDONLY), "a descriptor of its own program");
    look_at_descriptor(open("/proc/self/exe", O_RDONLY), "a descriptor of what it runs");
}
static void attributes_by_path_descriptor(void) {
    look_at_descriptor(open(right, O_PATH), "a path descriptor of its own file");
    look_at_descriptor(open("/usr/bin/env", O_PATH), "a path descriptor of the system");
    look_at_descriptor(open(target, O_PATH), "a path descriptor of another's file");
}
static void attributes_by_proc_descriptor(void) {
    const char *files[] = {right, "/usr/bin/env", target, "/"};
    char path[64];
    for (unsigned k = 0; k < LENGTH(files); ++k) {
        int file = open(files[k], O_PATH);
        if (file < 0) continue;
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
        /* The root of a world may be the submission's own. */
        if (strcmp(files[k], "/")) look(path, every_way);
        snprintf(path, sizeof path, "/dev/fd/%d", file);
        if (strcmp(files[k], "/")) look(path, every_way);
    }
    look("/proc/self/exe", every_way);
}
static void attributes_of_system(void) {
    const char *files[] = {"/usr/bin/env", "/usr", "/bin", "/lib64/ld-linux-x86-64.so.2", "/etc/ld.so.cache"};
    for (unsigned k = 0; k < LENGTH(files); ++k) {
        look(files[k], every_way);
        look_at_descriptor(open(files[k], O_RDONLY), files[k]);
    }
}
static void attributes_of_devices(void) {
    const char *files[] = {"/dev/null", "/dev/zero", "/dev/full", "/dev/urandom"};
    for (unsigned k = 0; k < LENGTH(files); ++k) {
        look(files[k], every_way);
        look_at_descriptor(open(files[k], O_RDONLY), files[k]);
        look_at_descriptor(open(files[k], O_WRONLY), files[k]);
    }
}
/* A pipe belongs to the run. A file or a device behind a standard stream does not. */
static void attributes_of_standard_streams(void) {
    const char *names[] = {"standard input", "standard output", "standard error"};
    char path[64];
    for (int stream = 0; stream < 3; ++stream) {
        struct stat status, after;
        if (fstat(stream, &status)) continue;
        usleep(20000);
        fchmod(stream, S_ISREG(status.st_mode) ? 04777 : status.st_mode & 07777);
        before = status;
        by_descriptor(stream);
        snprintf(path, sizeof path, "/proc/self/fd/%d", stream);
        every_way(path);
        if (S_ISFIFO(status.st_mode)) continue;
        if (fstat(stream, &after) || altered(&status, &after)) breach(names[stream]);
    }
}
/* After a build, the folder is the run's to read alone. */
static void attributes_of_built(void) {
    attributes_of_own_file();
    attributes_of_own_folder();
    attributes_by_descriptor();
    refused(open(program, O_WRONLY), "what was built, to write");
    refused(unlink(program), "what was built, to remove");
    refused(rename(program, own("moved")), "what was built, to move");
    refused(open(own("new"), O_WRONLY | O_CREAT, 0644), "a new file beside what was built");
    struct stat status;
    if (stat(program, &status) == 0 && status.st_mode & 07000) breach("a set-user-ID program");
}

const struct mode attribute_modes[] = {
    MODE(chmod_target), MODE(chown_target), MODE(utimes_target), MODE(xattr_target), MODE(file_attr_target),
    MODE(attributes_by_proc), MODE(attributes_of_own_file), MODE(attributes_of_own_folder),
    MODE(attributes_by_descriptor), MODE(attributes_by_path_descriptor), MODE(attributes_by_proc_descriptor),
    MODE(attributes_of_system), MODE(attributes_of_devices), MODE(attributes_of_standard_streams),
    MODE(attributes_of_built), {0},
};
