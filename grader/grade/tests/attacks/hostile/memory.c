/* Memory, counted and uncounted. */
#include "hostile.h"
#include <sys/socket.h>

static void memory_bomb(void) {
    for (int k = 0; k < 4000; ++k) {
        char *memory = malloc(1 << 20);
        if (!memory) abort();
        memset(memory, 1, 1 << 20);
    }
    breach("memory without end");
}
static void shared_memory_bomb(void) {
    for (int k = 0; k < 1000; ++k) {
        char *memory =
            mmap(NULL, 1 << 22, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED) return;
        memset(memory, 1, 1 << 22);
    }
    breach("shared memory without end");
}
static void forked_memory_bomb(void) {
    /* Each stays below the limit. */
    for (int k = 0; k < 6; ++k)
        if (fork() == 0) {
            char *memory = malloc(48 << 20);
            if (memory) memset(memory, k, 48 << 20);
            pause_for_ever();
        }
    pause_for_ever();
}
static void memory_at_once(void) {
    /* One call takes it all. */
    void *memory = mmap(NULL, 1 << 30, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (memory == MAP_FAILED) return;
    sleep(5);
    breach("a gigabyte at once");
}
static void memory_of_orphans(void) {
    for (int k = 0; k < 6; ++k)
        if (fork() == 0) {
            setsid();
            if (fork()) _exit(0);
            char *memory = malloc(48 << 20);
            if (memory) memset(memory, k, 48 << 20);
            pause_for_ever();
        }
    while (wait(NULL) > 0) {}
    pause_for_ever();
}
static void page_tables(void) {
    /* One page read in each 2 MiB takes a page of a table, which no process's resident size counts. */
    const size_t step = 2 << 20, many = 200000;
    char *memory = mmap(NULL, step * many, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) abort();
    madvise(memory, step * many, MADV_NOHUGEPAGE);
    volatile char sum = 0;
    for (size_t k = 0; k < many; ++k) sum += memory[k * step];
    sleep(1);
    breach("800 MB of page tables");
}
/* Pages of shared objects, which stay in memory although no process maps them: 700 MB. */
static void hide_pages(int file, int flags) {
    for (int k = 0; k < 44; ++k) {
        char *memory = mmap(NULL, 16 << 20, PROT_READ | PROT_WRITE, MAP_SHARED | flags, file, 0);
        if (memory == MAP_FAILED) return;
        for (int part = 0; part < 16; ++part) {
            memset(memory + (part << 20), 1, 1 << 20);
            madvise(memory + (part << 20), 1 << 20, MADV_DONTNEED);
        }
    }
    usleep(500000);
}
static void hidden_pages(void) { hide_pages(-1, MAP_ANONYMOUS); }
static void hidden_pages_of_zero(void) { hide_pages(open("/dev/zero", O_RDWR), 0); }
/* The kernel's memory for 60,000 mappings, or shared objects, in each of twenty processes. */
static void in_twenty_processes(void (*fill)(void)) {
    for (int k = 0; k < 20; ++k)
        if (fork() == 0) {
            fill();
            usleep(1500000);
            _exit(0);
        }
    while (wait(NULL) > 0) {}
}
static void map_pages(void) {
    for (int k = 0; k < 60000; ++k) {
        /* Neighbours of different protection are not merged. */
        char *page = mmap(NULL, 4096, k % 2 ? PROT_READ : PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (page == MAP_FAILED) return;
    }
}
static void share_pages(void) {
    for (int k = 0; k < 60000; ++k)
        if (mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0) == MAP_FAILED) return;
}
static void many_mappings(void) { in_twenty_processes(map_pages); }
static void many_objects(void) { in_twenty_processes(share_pages); }
static void huge_pages(void) {
    for (int k = 0; k < 512; ++k) {
        char *memory = mmap(NULL, 2 << 20, PROT_READ | PROT_WRITE,
                            MAP_PRIVATE | MAP_ANONYMOUS | MAP_HUGETLB, -1, 0);
        if (memory == MAP_FAILED) return;
        memset(memory, 1, 2 << 20);
    }
    breach("a gigabyte of huge pages");
}
/* The kernel keeps a huge page as long as one of its small pages is mapped: 600 MB behind 300 of them. */
static void parts_of_huge_pages(void) {
    const size_t huge = 2 << 20;
    prctl(PR_SET_THP_DISABLE, 0, 0, 0, 0);
    for (int k = 0; k < 300; ++k) {
        char *memory = mmap(NULL, 2 * huge, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED) abort();
        char *page = (char *)(((uintptr_t)memory + huge - 1) & ~(huge - 1));
        madvise(page, huge, MADV_HUGEPAGE);
        page[0] = 1;
        munmap(page + 4096, memory + huge - page + huge - 4096);
        if (page > memory) munmap(memory, page - memory);
    }
    usleep(500000);
}
/* Each process of a chain has separate pages, and shares those of its ancestors. */
static void chain_of_pages(void) {
    const size_t size = 24 << 20;
    char *memory = malloc(size);
    if (!memory) abort();
    memset(memory, 1, size);
    for (int k = 0; k < 20; ++k) {
        if (fork()) pause_for_ever();
        memset(memory, k, size / 2);
    }
    sleep(1);
    breach("250 MB in a chain of forks");
}
/* The kernel's memory for mappings that each process of a chain has from all its ancestors, which end. */
static void chain_of_mappings(void) {
    enum { MANY = 10000 };
    static char *pages[MANY];
    for (int k = 0; k < MANY; ++k) {
        int protection = k % 2 ? PROT_READ : PROT_READ | PROT_WRITE;
        pages[k] = mmap(NULL, 4096, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (pages[k] == MAP_FAILED) abort();
    }
    double end = seconds() + 3;
    if (fork()) {
        usleep(3500000);
        return;
    }
    while (seconds() < end) {
        for (int k = 0; k < MANY; k += 2) pages[k][0] = 1;
        if (fork()) _exit(0);
    }
}
static void unlinked_mappings(void) {
    for (int k = 0; k < 100; ++k) {
        int file = open("mapped", O_RDWR | O_CREAT | O_TRUNC, 0644);
        if (file < 0 || ftruncate(file, 4 << 20)) abort();
        char *memory = mmap(NULL, 4 << 20, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (memory == MAP_FAILED) abort();
        unlink("mapped");
        close(file);
        memset(memory, k, 4 << 20);
    }
    breach("400 MB in unlinked files");
}
/* Bytes that no process's memory counts, of all processes together. */
static long *stored;
static void fill_pipes(void) {
    static char block[1 << 16];
    memset(block, 1, sizeof block);
    int ends[2];
    while (pipe2(ends, O_NONBLOCK) == 0) {
        fcntl(ends[1], F_SETPIPE_SZ, 1 << 20);
        ssize_t count;
        while ((count = write(ends[1], block, sizeof block)) > 0)
            if (__atomic_add_fetch(stored, count, __ATOMIC_RELAXED) > 320 << 20) breach("320 MB in pipes");
    }
    usleep(500000);
}
static void fill_socketpairs(void) {
    static char block[1 << 16];
    memset(block, 1, sizeof block);
    int ends[2], size = 1 << 30;
    while (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) == 0)
        for (int end = 0; end < 2; ++end) {
            setsockopt(ends[end], SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
            ssize_t count;
            while ((count = write(ends[end], block, sizeof block)) > 0)
                if (__atomic_add_fetch(stored, count, __ATOMIC_RELAXED) > 320 << 20) breach("320 MB in sockets");
        }
    usleep(500000);
}
static void in_children(void (*fill)(void)) {
    stored = mmap(NULL, sizeof *stored, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    for (int k = 0; k < 6; ++k)
        if (fork() == 0) {
            fill();
            _exit(0);
        }
    int status;
    while (wait(&status) > 0)
        if (WIFEXITED(status) && WEXITSTATUS(status) == 42) _exit(42);
}
static void full_pipes(void) { in_children(fill_pipes); }
static void full_socketpairs(void) { in_children(fill_socketpairs); }
static void descriptors_in_flight(void) {
    int ends[2], count = 0, file = open(right, O_RDONLY);
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends)) return;
    for (; count < 100000; ++count) {
        char byte = 0, control[CMSG_SPACE(sizeof(int) * 100)] = {0};
        struct iovec part = {&byte, 1};
        struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1, .msg_control = control,
                                 .msg_controllen = sizeof control};
        struct cmsghdr *head = CMSG_FIRSTHDR(&message);
        head->cmsg_level = SOL_SOCKET, head->cmsg_type = SCM_RIGHTS, head->cmsg_len = CMSG_LEN(sizeof(int) * 100);
        for (int k = 0; k < 100; ++k) memcpy(CMSG_DATA(head) + k * sizeof(int), &file, sizeof(int));
        if (sendmsg(ends[0], &message, 0) < 0) break;
    }
    if (count >= 1000) breach("100,000 descriptors in flight");
}
static int deeper(int depth) {
    volatile char frame[4096];
    frame[0] = depth;
    return depth < 0 ? 0 : deeper(depth + 1) + frame[0];
}
static void endless_recursion(void) { _exit(deeper(0)); }
static void locked_memory(void) {
    for (int k = 0; k < 400; ++k) {
        char *memory = mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED || mlock(memory, 1 << 20)) return;
    }
    breach("400 MB of locked memory");
}
/* Honest: all children share what their parent has written, and count it once. */
static void honest_sharing(void) {
    char *memory = malloc(100 << 20);
    memset(memory, 1, 100 << 20);
    for (int k = 0; k < 4; ++k)
        if (fork() == 0) {
            volatile long sum = 0;
            for (long byte = 0; byte < 100 << 20; byte += 4096) sum += memory[byte];
            usleep(500000);
            _exit(0);
        }
    while (wait(NULL) > 0) {}
}
/* Honest: 4 MB, seen at fifty places. */
static void honest_mappings(void) {
    int file = open("mapped", O_RDWR | O_CREAT, 0644);
    if (ftruncate(file, 4 << 20)) _exit(45);
    for (int k = 0; k < 50; ++k) {
        char *memory = mmap(NULL, 4 << 20, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (memory == MAP_FAILED) _exit(45);
        memset(memory, k, 4 << 20);
    }
    usleep(200000);
    unlink("mapped");
}
/* Honest: much address space, of which little is touched, as garbage collectors reserve it. */
static void honest_reservation(void) {
    char *memory = mmap(NULL, 1L << 36, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) _exit(45);
    if (mprotect(memory, 1 << 20, PROT_READ | PROT_WRITE)) _exit(45);
    memset(memory, 1, 1 << 20);
}

const struct mode memory_modes[] = {
    MODE(memory_bomb), MODE(shared_memory_bomb), MODE(forked_memory_bomb), MODE(memory_at_once),
    MODE(memory_of_orphans), MODE(page_tables), MODE(hidden_pages), MODE(hidden_pages_of_zero),
    MODE(many_mappings), MODE(many_objects), MODE(huge_pages), MODE(parts_of_huge_pages), MODE(chain_of_pages),
    MODE(chain_of_mappings), MODE(unlinked_mappings), MODE(full_pipes), MODE(full_socketpairs), MODE(descriptors_in_flight), MODE(endless_recursion), MODE(locked_memory),
    MODE(honest_sharing), MODE(honest_mappings), MODE(honest_reservation), {0},
};
