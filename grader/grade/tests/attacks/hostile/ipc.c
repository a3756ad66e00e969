/* Objects and locks by which processes of different runs could meet. TARGET names what the bystander has made:
 * its System V key, its message queue and its socket. */
#include "hostile.h"
#include <mqueue.h>
#include <semaphore.h>
#include <stddef.h>
#include <sys/ipc.h>
#include <sys/msg.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/un.h>

static void leave_behind(void) {
    refused(shmget(IPC_PRIVATE, 4096, 0600), "shared memory");
    refused(syscall(SYS_memfd_create, "x", 0), "memory without a limit");
}
static void make_system_v(void) {
    denied(shmget(0x5eed, 4096, IPC_CREAT | 0666), "shared memory");
    denied(semget(0x5eed, 1, IPC_CREAT | 0666), "a semaphore");
    denied(msgget(0x5eed, IPC_CREAT | 0666), "a message queue");
    denied(shmget(IPC_PRIVATE, 4096, IPC_CREAT | 0666), "private shared memory");
}
static void find_system_v(void) {
    int key = atoi(target);
    refused(shmget(key, 0, 0), "another's shared memory");
    refused(semget(key, 0, 0), "another's semaphore");
    refused(msgget(key, 0), "another's message queue");
    for (int identifier = 0; identifier < 64; ++identifier) {
        if ((long)shmat(identifier, NULL, SHM_RDONLY) != -1) breach("another's shared memory by its number");
        struct shmid_ds status;
        refused(shmctl(identifier, IPC_STAT, &status), "another's status");
        refused(shmctl(identifier, SHM_STAT, &status), "another's status by its place");
        refused(semctl(identifier, 0, GETVAL), "another's semaphore by its number");
        refused(msgrcv(identifier, &status, 8, 0, IPC_NOWAIT), "another's message");
    }
    const char *tables[] = {"/proc/sysvipc/shm", "/proc/sysvipc/sem", "/proc/sysvipc/msg"};
    static char text[1 << 16];
    for (unsigned k = 0; k < LENGTH(tables); ++k) {
        int table = open(tables[k], O_RDONLY);
        ssize_t count = table < 0 ? 0 : read(table, text, sizeof text - 1);
        text[count > 0 ? count : 0] = 0;
        if (strstr(text, target)) breach(tables[k]);
    }
}
static void message_queue(void) {
    denied(syscall(SYS_mq_open, target + 1, O_RDWR, 0, NULL), "another's message queue");
    denied(syscall(SYS_mq_open, "escaped", O_RDWR | O_CREAT, 0666, NULL), "a message queue");
    denied(syscall(SYS_mq_unlink, "escaped-none"), "a message queue removed");
}
static void connect_by_name(void) {
    /* TARGET2 is the path of the bystander's socket; its abstract name is the same. */
    const int kinds[] = {SOCK_STREAM, SOCK_DGRAM, SOCK_SEQPACKET};
    for (unsigned k = 0; k < LENGTH(kinds); ++k) {
        int handle = socket(AF_UNIX, kinds[k], 0);
        if (handle < 0) continue;
        struct sockaddr_un name = {.sun_family = AF_UNIX};
        strncpy(name.sun_path, target, sizeof name.sun_path - 1);
        refused(connect(handle, (struct sockaddr *)&name, sizeof name), "a socket by its path");
        memset(name.sun_path, 0, sizeof name.sun_path);
        strncpy(name.sun_path + 1, target, sizeof name.sun_path - 2);
        refused(connect(handle, (struct sockaddr *)&name, offsetof(struct sockaddr_un, sun_path) + 1 + strlen(target)),
                "a socket by its abstract name");
        breach("a socket");
    }
}
static void socketpair_reused(void) {
    int ends[2], handle;
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) return;
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    socklen_t length = offsetof(struct sockaddr_un, sun_path) + 1 + strlen(target);
    strncpy(name.sun_path + 1, target, sizeof name.sun_path - 2);
    struct sockaddr none = {.sa_family = AF_UNSPEC};
    connect(ends[0], &none, sizeof none);
    shutdown(ends[0], SHUT_RDWR);
    close(ends[1]);
    refused(connect(ends[0], (struct sockaddr *)&name, length), "connect of a pair's end");
    struct sockaddr_un own_name = {.sun_family = AF_UNIX, .sun_path = "\0escaped"};
    refused(bind(ends[0], (struct sockaddr *)&own_name, sizeof own_name), "a name of a pair's end");
    refused(bind(ends[0], (struct sockaddr *)&own_name, sizeof(sa_family_t)), "any name of a pair's end");
    struct sockaddr_un path_name = {.sun_family = AF_UNIX, .sun_path = "socket-file"};
    refused(bind(ends[0], (struct sockaddr *)&path_name, sizeof path_name), "a path of a pair's end");
    refused(listen(ends[0], 1), "listen on a pair's end");
    if ((handle = accept(ends[0], NULL, NULL)) >= 0) breach("accept on a pair's end");
    refused(sendto(ends[0], "x", 1, MSG_NOSIGNAL, (struct sockaddr *)&name, length), "sendto by a pair's end");
}
static void socket_cookies(void) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) return;
    const int options[] = {57 /* SO_COOKIE */, 71 /* SO_NETNS_COOKIE */};
    for (size_t k = 0; k < sizeof options / sizeof *options; ++k) {
        unsigned long long cookie = 0;
        socklen_t length = sizeof cookie;
        refused(getsockopt(ends[0], SOL_SOCKET, options[k], &cookie, &length), "a number of the whole machine");
    }
    int type = 0;
    socklen_t length = sizeof type;
    if (getsockopt(ends[0], SOL_SOCKET, SO_TYPE, &type, &length)) breach("the kind of a socket is not told");
}
static void socketpair_kinds(void) {
    /* Run-time libraries start processes with a pair that keeps packets. */
    const int kinds[] = {SOCK_DGRAM, SOCK_RAW, SOCK_RDM};
    int ends[2];
    for (unsigned k = 0; k < LENGTH(kinds); ++k) {
        refused(socketpair(AF_UNIX, kinds[k], 0, ends), "a pair of another kind");
        refused(socketpair(AF_UNIX, kinds[k] | SOCK_CLOEXEC, 0, ends), "a pair of another kind with a flag");
    }
    for (int family = 2; family < 47; ++family)
        refused(socketpair(family, SOCK_STREAM, 0, ends), "a pair of another family");
}
static void rights_by_socketpair(void) {
    /* A descriptor that was sent is what it was: open to read, below the same roots. */
    int ends[2], file = open(right, O_RDONLY), got = -1;
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) return;
    char byte = 0, control[CMSG_SPACE(sizeof(int))] = {0};
    struct iovec part = {&byte, 1};
    struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1, .msg_control = control, .msg_controllen = sizeof control};
    struct cmsghdr *head = CMSG_FIRSTHDR(&message);
    head->cmsg_level = SOL_SOCKET, head->cmsg_type = SCM_RIGHTS, head->cmsg_len = CMSG_LEN(sizeof(int));
    memcpy(CMSG_DATA(head), &file, sizeof file);
    if (sendmsg(ends[0], &message, 0) < 0 || recvmsg(ends[1], &message, 0) < 0) return;
    head = CMSG_FIRSTHDR(&message);
    if (head) memcpy(&got, CMSG_DATA(head), sizeof got);
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", got);
    refused(open(path, O_WRONLY), "a sent descriptor opened to write");
    /* Credentials of another. */
    struct ucred credentials = {1, 0, 0};
    int on = 1;
    setsockopt(ends[1], SOL_SOCKET, SO_PASSCRED, &on, sizeof on);
    char more[CMSG_SPACE(sizeof credentials)] = {0};
    message = (struct msghdr){.msg_iov = &part, .msg_iovlen = 1, .msg_control = more, .msg_controllen = sizeof more};
    head = CMSG_FIRSTHDR(&message);
    head->cmsg_level = SOL_SOCKET, head->cmsg_type = SCM_CREDENTIALS, head->cmsg_len = CMSG_LEN(sizeof credentials);
    memcpy(CMSG_DATA(head), &credentials, sizeof credentials);
    refused(sendmsg(ends[0], &message, 0), "another's credentials");
}

/* A lock on a file that all runs can read would be a signal from one to another. */
static void locks_on(const char *path) {
    int file = open(path, O_RDONLY);
    if (file < 0) return;
    struct flock lock = {.l_type = F_RDLCK, .l_whence = SEEK_SET, .l_len = 1};
    refused(syscall(SYS_flock, file, LOCK_SH | LOCK_NB), "flock");
    refused(syscall(SYS_flock, file, LOCK_EX | LOCK_NB), "flock alone");
    refused(fcntl(file, F_SETLK, &lock), "a lock of a process");
    refused(fcntl(file, F_OFD_SETLK, &lock), "a lock of a descriptor");
    lock.l_pid = 0;
    refused(fcntl(file, F_GETLK, &lock), "a look at a lock");
    lock.l_pid = 0;
    refused(fcntl(file, F_OFD_GETLK, &lock), "a look at a lock of a descriptor");
    refused(fcntl(file, F_SETLEASE, F_RDLCK), "a lease");
    refused(fcntl(file, 1039 /* F_SETDELEG of later kernels */, &lock), "a delegation");
}
static void lock_own_file(void) { locks_on(right); }
static void lock_system_file(void) {
    locks_on("/usr/bin/env");
    locks_on("/usr/bin");
    locks_on("/dev/null");
    locks_on("/proc/self/exe");
}
static void keys(void) {
    denied(syscall(SYS_add_key, "user", "escaped", "x", 1, -4), "a key of the user");
    denied(syscall(SYS_add_key, "user", "escaped", "x", 1, -3), "a key of the session");
    denied(syscall(SYS_request_key, "user", "escaped", NULL, 0), "a request for a key");
    for (int keyring = -1; keyring > -9; --keyring) denied(syscall(SYS_keyctl, 0, keyring, 1), "a keyring");
    denied(syscall(SYS_keyctl, 1, NULL), "a keyring of its own");
    const char *tables[] = {"/proc/keys"};
    for (unsigned k = 0; k < LENGTH(tables); ++k) {
        char byte;
        int table = open(tables[k], O_RDONLY);
        if (table >= 0 && read(table, &byte, 1) > 0) breach(tables[k]);
    }
}
/* Names that a second run would find. The calls may work inside the sandbox. */
static void leave_shared_names(void) {
    int memory = shm_open("/escaped-memory", O_RDWR | O_CREAT, 0666);
    if (memory >= 0 && ftruncate(memory, 4096)) {}
    sem_open("/escaped-semaphore", O_CREAT, 0666, 1);
    syscall(SYS_mq_open, "escaped-queue", O_RDWR | O_CREAT, 0666, NULL);
    shmget(0x5eed, 4096, IPC_CREAT | 0666);
    semget(0x5eed, 1, IPC_CREAT | 0666);
    msgget(0x5eed, IPC_CREAT | 0666);
    syscall(SYS_add_key, "user", "escaped", "x", 1, -4);
}
static void find_shared_names(void) {
    refused(shm_open("/escaped-memory", O_RDONLY, 0), "shared memory of an earlier run");
    if (sem_open("/escaped-semaphore", 0) != SEM_FAILED) breach("a semaphore of an earlier run");
    refused(syscall(SYS_mq_open, "escaped-queue", O_RDWR, 0, NULL), "a message queue of an earlier run");
    refused(shmget(0x5eed, 0, 0), "System V memory of an earlier run");
    refused(semget(0x5eed, 0, 0), "a System V semaphore of an earlier run");
    refused(msgget(0x5eed, 0), "a System V queue of an earlier run");
    refused(syscall(SYS_request_key, "user", "escaped", NULL, 0), "a key of an earlier run");
}
static void page_cache(void) {
    /* Which pages of a file are in memory tells what another run has read. */
    int file = open("/usr/bin/env", O_RDONLY);
    unsigned char pages[64];
    uint64_t range[2] = {0, 4096}, counts[5];
    void *memory = mmap(NULL, 4096, PROT_READ, MAP_SHARED, file, 0);
    denied(mincore(memory, 4096, pages), "mincore");
    denied(syscall(NR_cachestat, file, range, counts, 0), "cachestat");
    denied(syscall(SYS_readahead, file, 0, 4096), "readahead");
    struct iovec part = {pages, sizeof pages};
    denied(syscall(SYS_preadv2, file, &part, 1, 0, 0, 8 /* RWF_NOWAIT */), "a read that does not wait");
    denied(syscall(SYS_preadv2, file, &part, 1, 0, 0, 0x80 /* RWF_DONTCACHE */), "a read that empties the cache");
}
/* Takes a file out of memory, so that another run reads it from the disk. */
static void page_cache_emptied(void) {
    static char block[1 << 16];
    struct rusage before, after;
    int file = open("/usr/bin/env", O_RDONLY);
    for (int k = 0; k < 2; ++k) {
        getrusage(RUSAGE_SELF, &before);
        for (off_t at = 0; pread(file, block, sizeof block, at) > 0; at += sizeof block) {}
        getrusage(RUSAGE_SELF, &after);
        if (k == 0) posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
        else if (after.ru_inblock > before.ru_inblock) breach("a file was taken out of memory");
    }
}
/* Counts of the machine since its start, such as of its processes. */
static void counts_of_machine(void) {
    const char *files[] = {"/proc/stat",    "/proc/loadavg", "/proc/meminfo",    "/proc/vmstat",
                           "/proc/uptime",  "/proc/diskstats", "/proc/interrupts", "/proc/softirqs",
                           "/proc/zoneinfo", "/proc/schedstat", "/proc/sys/fs/inode-nr", "/proc/sys/kernel/ns_last_pid"};
    for (unsigned k = 0; k < LENGTH(files); ++k) cannot_read(files[k]);
}
/* The arguments of the first process, a part of the grader, name no folder of the machine. */
static void folders_in_arguments(void) {
    char arguments[4096];
    int file = open("/proc/1/cmdline", O_RDONLY);
    if (file < 0) return;
    ssize_t count = read(file, arguments, sizeof arguments);
    if (getppid() == 1 && count > 0 && memchr(arguments, '/', count)) breach("a folder in the arguments");
}

const struct mode ipc_modes[] = {
    MODE(leave_behind), MODE(make_system_v), MODE(find_system_v), MODE(message_queue), MODE(connect_by_name),
    MODE(socketpair_reused), MODE(socketpair_kinds), MODE(socket_cookies), MODE(rights_by_socketpair), MODE(lock_own_file),
    MODE(lock_system_file), MODE(keys), MODE(leave_shared_names), MODE(find_shared_names), MODE(page_cache),
    MODE(page_cache_emptied), MODE(counts_of_machine), MODE(folders_in_arguments), {0},
};
