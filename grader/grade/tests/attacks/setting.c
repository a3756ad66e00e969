/* Starts a command in a poorer setting than this one, to see what protection is left there.
 *
 *     setting OPTION... -- COMMAND
 *
 *     --user UID             as this user, of the group of the same number and of no other
 *     --no-user-namespaces   user namespaces are refused, as some systems do
 *     --no-landlock          the kernel has no Landlock
 *     --no-admin             without the capabilities that containers drop, CAP_SYS_ADMIN the first of them
 *     --no-capabilities      without any
 *     --rootless UID         as root of a user namespace that has two IDs, UID for root and the next one for 65534
 *     --no-groups            control groups cannot be found, as in containers
 */
#define _GNU_SOURCE
#include <errno.h>
#include <grp.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#ifndef SYS_clone3
#define SYS_clone3 435
#endif
#define NR_landlock_create_ruleset 444

static void fail(const char *what) {
    perror(what);
    exit(125);
}

/* Refuses one call with this error; where `flag` is not 0, only where the first argument has it. */
static void refuse(int call, uint32_t flag, int error) {
    struct sock_filter filter[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 3),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, args)),
        /* Without a flag this compares with 0 in a way that always holds. */
        BPF_JUMP(BPF_JMP | (flag ? BPF_JSET : BPF_JGE) | BPF_K, flag, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | error),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    struct sock_fprog program = {sizeof filter / sizeof *filter, filter};
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0) return;
    /* Only the superuser may do it without this promise, which also holds below. */
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)) fail("no_new_privs");
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program)) fail("seccomp");
}

/* Keeps the capabilities of this set only. */
static void keep(uint64_t kept) {
    for (int capability = 0; capability < 64; ++capability)
        if (!(kept >> capability & 1) && prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) && errno != EINVAL)
            fail("the bounding set");
    prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
    struct __user_cap_header_struct head = {_LINUX_CAPABILITY_VERSION_3, 0};
    struct __user_cap_data_struct sets[2];
    if (syscall(SYS_capget, &head, sets)) fail("capget");
    for (int half = 0; half < 2; ++half) {
        sets[half].permitted &= kept >> (32 * half);
        sets[half].effective = sets[half].permitted;
        sets[half].inheritable = 0;
    }
    if (syscall(SYS_capset, &head, sets)) fail("capset");
}

/* Becomes root of a user namespace with two IDs. Only a process outside may write such a map. */
static void become_rootless(int user) {
    int entered[2], status;
    if (pipe(entered)) fail("pipe");
    int parent = getpid(), child = fork();
    if (child == 0) {
        char byte, path[64];
        if (read(entered[0], &byte, 1) != 1) _exit(1);
        const char *maps[] = {"uid_map", "gid_map"};
        for (int k = 0; k < 2; ++k) {
            snprintf(path, sizeof path, "/proc/%d/%s", parent, maps[k]);
            FILE *map = fopen(path, "w");
            if (!map || fprintf(map, "0 %d 1\n65534 %d 1\n", user, user + 1) < 0 || fclose(map)) _exit(1);
        }
        _exit(0);
    }
    if (child < 0 || unshare(CLONE_NEWUSER) || write(entered[1], "x", 1) != 1) fail("a user namespace");
    if (waitpid(child, &status, 0) != child || status) fail("the map of a user namespace");
    close(entered[0]);
    close(entered[1]);
}

int main(int count, char **arguments) {
    /* The capabilities that containers keep. */
    const int container[] = {CAP_CHOWN,   CAP_DAC_OVERRIDE, CAP_FSETID,           CAP_FOWNER,    CAP_MKNOD,
                             CAP_NET_RAW, CAP_SETGID,       CAP_SETUID,           CAP_SETFCAP,   CAP_SETPCAP,
                             CAP_KILL,    CAP_SYS_CHROOT,   CAP_NET_BIND_SERVICE, CAP_AUDIT_WRITE};
    uint64_t kept = ~0ULL;
    int user = -1, rootless = -1, namespaces = 1, landlock = 1, groups = 1, k = 1;
    for (; k < count && strcmp(arguments[k], "--"); ++k) {
        if (!strcmp(arguments[k], "--user") && k + 1 < count) user = atoi(arguments[++k]);
        else if (!strcmp(arguments[k], "--rootless") && k + 1 < count) rootless = atoi(arguments[++k]);
        else if (!strcmp(arguments[k], "--no-user-namespaces")) namespaces = 0;
        else if (!strcmp(arguments[k], "--no-groups")) groups = 0;
        else if (!strcmp(arguments[k], "--no-landlock")) landlock = 0;
        else if (!strcmp(arguments[k], "--no-admin")) {
            kept = 0;
            for (unsigned m = 0; m < sizeof container / sizeof *container; ++m) kept |= 1ULL << container[m];
        } else if (!strcmp(arguments[k], "--no-capabilities")) kept = 0;
        else return fprintf(stderr, "setting: there is no option %s\n", arguments[k]), 125;
    }
    if (k + 1 >= count) return fprintf(stderr, "setting: no command\n"), 125;
    if (!groups && (unshare(CLONE_NEWNS) || mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL) ||
                    mount("none", "/sys/fs/cgroup", "tmpfs", MS_RDONLY, NULL)))
        fail("control groups");
    if (rootless >= 0) {
        become_rootless(rootless);
        if (setgroups(0, NULL) || setresgid(0, 0, 0) || setresuid(0, 0, 0)) fail("root of a user namespace");
    }
    /* As the superuser, filters come first: they need no promise then. */
    if (!namespaces) {
        refuse(SYS_unshare, CLONE_NEWUSER, EPERM);
        refuse(SYS_clone, CLONE_NEWUSER, EPERM);
        refuse(SYS_clone3, 0, ENOSYS);
    }
    if (!landlock) refuse(NR_landlock_create_ruleset, 0, ENOSYS);
    if (kept != ~0ULL) keep(kept);
    if (user >= 0) {
        /* A process that escapes a sandbox must not take all the processes that the machine has. */
        struct rlimit most = {600, 600};
        if (setrlimit(RLIMIT_NPROC, &most)) fail("setrlimit");
        if (setgroups(0, NULL)) fail("setgroups");
        if (setresgid(user, user, user)) fail("setresgid");
        if (setresuid(user, user, user)) fail("setresuid");
        /* A process that changed its user cannot be looked at by it, until it executes another program. */
    }
    execvp(arguments[k + 1], arguments + k + 1);
    fail(arguments[k + 1]);
}
