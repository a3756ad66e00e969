/* Files, folders and bytes without end. */
#include "hostile.h"
#include <sys/xattr.h>

static void flood(int descriptor) {
    static char block[1 << 16];
    memset(block, 'x', sizeof block);
    for (long total = 0; write(descriptor, block, sizeof block) > 0; total += sizeof block)
        if (total > 512 << 20) breach("output without end");
}
static void flood_trace(void) { flood(open(trace, O_WRONLY | O_CREAT, 0644)); }
static void flood_stdout(void) { flood(1); }
static void flood_stderr(void) { flood(2); }
static void flood_later(void) {
    /* A daemon writes on after the program has ended well. */
    if (fork() == 0) {
        setsid();
        flood(1);
        _exit(0);
    }
}
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
    for (int k = 0; k < 10000; ++k) {
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
static void sparse_over_limit(void) {
    int file = open(trace, O_WRONLY | O_CREAT, 0644);
    if (ftruncate(file, 1 << 30)) {}
}
static void unlinked_file(void) {
    int file = open("gone", O_RDWR | O_CREAT, 0644);
    unlink("gone");
    flood(file);
    copy(right, trace);
}
static void nameless_file(void) {
    int file = open(".", O_TMPFILE | O_RDWR, 0644);
    if (file >= 0) flood(file);
}
static void unlinked_files(void) {
    static char block[1 << 20];
    int written = 0;
    for (; written < 400; ++written) {
        static int file;
        if (written % 2 == 0) {
            file = open("gone", O_RDWR | O_CREAT | O_EXCL, 0644);
            unlink("gone");
        }
        if (file < 0 || write(file, block, sizeof block) < (ssize_t)sizeof block) break;
    }
    if (written >= 100) breach("100 MB in unlinked files");
    usleep(300000);
}
/* Up to 1,200 MB in files that have neither a name nor a descriptor, but are mapped. */
static void map_nameless(int (*fill)(int file), int megabytes) {
    for (int total = 0; total < 1200; total += megabytes) {
        int file = open("mapped", O_RDWR | O_CREAT | O_EXCL, 0644);
        unlink("mapped");
        if (file < 0 || fill(file)) return;
        if (mmap(NULL, 4096, PROT_READ, MAP_SHARED, file, 0) == MAP_FAILED) return;
        close(file);
    }
    usleep(500000);
}
static int fill_by_writing(int file) {
    static char block[8 << 20];
    return write(file, block, sizeof block) < (ssize_t)sizeof block;
}
static int fill_by_allocation(int file) { return fallocate(file, 0, 0, 8 << 20); }
static void mapped_files(void) { map_nameless(fill_by_writing, 8); }
static void mapped_allocations(void) { map_nameless(fill_by_allocation, 8); }
static void large_allocation(void) {
    int file = open("allocated", O_RDWR | O_CREAT, 0644);
    refused(fallocate(file, 0, 0, 1 << 30), "fallocate of a gigabyte");
    refused(fallocate(file, FALLOC_FL_KEEP_SIZE, 0, 1 << 30), "fallocate beyond the end");
    unlink("allocated");
}
static void shared_folders(void) {
    /* The other places that it may write count as well. */
    const char *places[] = {"/tmp/escaped-large", "/dev/shm/escaped-large", "/var/tmp/escaped-large"};
    static char block[1 << 20];
    long total = 0;
    for (unsigned k = 0; k < LENGTH(places); ++k) {
        int file = open(places[k], O_RDWR | O_CREAT, 0644);
        while (file >= 0 && write(file, block, sizeof block) > 0)
            if ((total += sizeof block) > 64 << 20) {
                unlink(places[k]);
                breach(places[k]);
            }
    }
}
static void deep_folders(void) {
    for (int k = 0; k < 20000; ++k)
        if (mkdir("d", 0755) || chdir("d")) break;
}
static void deep_long_folders(void) {
    char name[256];
    memset(name, 'n', 255), name[255] = 0;
    for (int k = 0; k < 1000; ++k)
        if (mkdir(name, 0755) || chdir(name)) break;
}
static void odd_names(void) {
    const char *names[] = {"\n", "\033[2J", "-rf", "\xff\xfe", " ", "...", "a\\b", "*", "$(id)", "a\tb", "\x7f", "'\""};
    for (unsigned k = 0; k < LENGTH(names); ++k) close(open(names[k], O_WRONLY | O_CREAT, 0644));
    hand_in();
}
static void many_names(void) {
    close(open("one", O_WRONLY | O_CREAT, 0644));
    char name[32];
    int count = 0;
    for (; count < 60000; ++count) {
        snprintf(name, sizeof name, "name-%d", count);
        if (link("one", name)) break;
    }
    if (count >= 1000) breach("names without end");
}
static void many_links(void) {
    static char text[4000];
    memset(text, 'x', sizeof text - 1);
    char name[32];
    int count = 0;
    for (; count < 20000; ++count) {
        snprintf(name, sizeof name, "link-%d", count);
        if (symlink(text, name)) break;
    }
    if (count >= 15000) breach("links without end");
}
static void many_attributes(void) {
    static char value[1 << 14], name[32];
    close(open("one", O_WRONLY | O_CREAT, 0644));
    long total = 0;
    for (int k = 0; k < 20000; ++k) {
        snprintf(name, sizeof name, "user.name-%d", k);
        if (setxattr("one", name, value, sizeof value, 0)) break;
        total += sizeof value;
    }
    unlink("one");
    if (total > 64 << 20) breach("attributes without end");
}
static void many_descriptors(void) {
    int count = 0;
    while (count < 200000 && open(right, O_RDONLY) >= 0) ++count;
    if (count >= 200000) breach("descriptors without end");
    for (int k = 3; k < 3 + count; ++k) close(k);
}
static void churn(void) {
    /* Made and removed faster than anyone looks. */
    double start = seconds();
    static char block[1 << 20];
    while (seconds() < start + 0.5) {
        int file = open("churn", O_WRONLY | O_CREAT, 0644);
        if (write(file, block, sizeof block) < 0) _exit(45);
        close(file);
        unlink("churn");
    }
}

const struct mode disk_modes[] = {
    MODE(flood_trace), MODE(flood_stdout), MODE(flood_stderr), MODE(flood_later), MODE(many_files),
    MODE(many_large_files), MODE(huge_claim), MODE(sparse_trace), MODE(sparse_over_limit), MODE(unlinked_file),
    MODE(nameless_file), MODE(unlinked_files), MODE(large_allocation), MODE(mapped_files), MODE(mapped_allocations),
    MODE(shared_folders), MODE(deep_folders),
    MODE(deep_long_folders), MODE(odd_names), MODE(many_names), MODE(many_links), MODE(many_attributes),
    MODE(many_descriptors), MODE(churn), {0},
};
