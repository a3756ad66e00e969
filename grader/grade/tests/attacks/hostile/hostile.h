/* Declarations that all hostile modes share.
 *
 *     hostile MODE SCENE TRACE RIGHT TARGET...
 *
 * RIGHT is a correct trace of the scene, in the submission's own folder. TARGET is what the mode attacks. A mode
 * that gets through says BREACH and exits with status 42. A mode that is refused returns, and `main` hands in the
 * correct trace. A mode that attacks a limit does not return.
 *
 * Every mode is harmless on a machine without protection: loops end at a bound, an attribute is set to the value
 * that it has, and a dangerous call gets an argument that the kernel refuses. */
#ifndef HOSTILE_H
#define HOSTILE_H
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Numbers of calls that the C library's headers may not have yet. */
#ifndef SYS_clone3
#define SYS_clone3 435
#endif
#define NR_open_tree 428
#define NR_move_mount 429
#define NR_fsopen 430
#define NR_fsconfig 431
#define NR_fsmount 432
#define NR_fspick 433
#define NR_pidfd_open 434
#define NR_pidfd_send_signal 424
#define NR_io_uring_setup 425
#define NR_io_uring_enter 426
#define NR_io_uring_register 427
#define NR_openat2 437
#define NR_pidfd_getfd 438
#define NR_faccessat2 439
#define NR_process_madvise 440
#define NR_mount_setattr 442
#define NR_quotactl_fd 443
#define NR_landlock_create_ruleset 444
#define NR_landlock_add_rule 445
#define NR_landlock_restrict_self 446
#define NR_memfd_secret 447
#define NR_process_mrelease 448
#define NR_set_mempolicy_home_node 450
#define NR_cachestat 451
#define NR_fchmodat2 452
#define NR_statmount 457
#define NR_listmount 458
#define NR_lsm_set_self_attr 460
#define NR_setxattrat 463
#define NR_removexattrat 466
#define NR_open_tree_attr 467
#define NR_file_setattr 469

struct mode {
    const char *name;
    void (*run)(void);
};
#define MODE(name) {#name, name}

/* One table a file, each ended by a mode without a name. */
extern const struct mode file_modes[], attribute_modes[], process_modes[], memory_modes[], disk_modes[],
    ipc_modes[], network_modes[], kernel_modes[], output_modes[], build_modes[];

extern const char *program, *scene, *trace, *right, *target, *target2;

void breach(const char *what) __attribute__((noreturn));

/* A breach where the result is not a failure. */
void refused(long result, const char *what);

/* For calls that a run must not reach at all: a breach unless the result is a failure by ENOSYS, EPERM or EACCES.
 * Any other error comes from the kernel's own code behind the call. */
void denied(long result, const char *what);

void copy(const char *from, const char *to);
void hand_in(void);
void cannot_read(const char *path);

/* RIGHT's folder, which is the submission's; with a name in it. */
const char *own(const char *name);

/* Counts a new process or thread of a bomb. Past 300 it is a breach, and all processes of the bomb end. */
void fuse(void);

/* The condition of a bomb's loops: its processes end when the fuse has blown, and after 30 s. */
int armed(void);

/* Runs `attack` in a child, and passes a breach of it on. Returns the child's wait status. */
int in_child(void (*attack)(void));

/* Waits for ever, but for 60 s: no mode is left on a machine without protection. */
void pause_for_ever(void) __attribute__((noreturn));

/* Whether the attributes of a file differ between two looks; the access time aside. */
int altered(const struct stat *before, const struct stat *after);

double seconds(void);

#define LENGTH(array) (sizeof(array) / sizeof *(array))
#endif
