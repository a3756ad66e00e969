/* The output of a run: its trace, its text and its exit status. */
#include "hostile.h"

static void output_link(void) {
    if (symlink(target, trace)) _exit(45);
}
static void output_device(void) {
    if (symlink("/dev/zero", trace)) _exit(45);
}
static void output_folder(void) {
    if (mkdir(trace, 0755)) _exit(45);
}
/* A pipe or a socket as trace is the submission's own in its world. Without one, it cannot be made. */
static void output_fifo(void) {
    if (mkfifo(trace, 0644) == 0) _exit(0);
}
static void output_socket_file(void) {
    if (mknod(trace, S_IFSOCK | 0644, 0) == 0) _exit(0);
}
static void output_second_name(void) {
    copy(right, "other");
    if (link("other", trace)) _exit(45);
}
static void output_link_to_stdout(void) {
    if (symlink("/proc/self/fd/1", trace)) _exit(45);
}
static void output_link_to_stdin(void) {
    if (symlink("/dev/stdin", trace)) _exit(45);
}
static void output_link_to_own(void) {
    if (symlink(right, trace)) _exit(45);
}
static void output_link_to_itself(void) {
    if (symlink(trace, trace)) _exit(45);
}
static void output_link_to_nothing(void) {
    if (symlink("/nowhere/at/all", trace)) _exit(45);
}
static void output_name_of_own(void) { refused(link(right, trace), "a second name of its own file"); }
static void output_unreadable(void) {
    hand_in();
    chmod(trace, 0);
}
static void output_in_closed_folder(void) {
    hand_in();
    chmod(".", 0);
}
static void output_under_other_names(void) {
    const char *names[] = {"trace.csv\n", "trace.csv ", " trace.csv", "TRACE.CSV", "trace.csv\r", "trace.csv.", "trace"};
    for (unsigned k = 0; k < LENGTH(names); ++k) copy(right, names[k]);
    _exit(0);
}
static void working_folder_removed(void) {
    hand_in();
    mkdir("below", 0755);
    if (chdir("below") == 0) rmdir("../below");
    if (rename("..", "/tmp/moved") == 0) breach("the folder above moved away");
    _exit(0);
}
/* A daemon that goes on exchanging the trace for a link, while its parent ends well. */
static void output_exchanged(void) {
    hand_in();
    copy(right, "good");
    if (symlink(target, "bad")) _exit(45);
    if (fork() == 0) {
        setsid();
        for (long k = 0; k < 2000000; ++k) syscall(SYS_renameat2, AT_FDCWD, k % 2 ? "good" : "bad", AT_FDCWD, trace, 2);
        _exit(0);
    }
    usleep(20000);
    _exit(0);
}
static void output_exchanged_for_folder(void) {
    hand_in();
    mkdir("folder", 0755);
    if (fork() == 0) {
        setsid();
        for (long k = 0; k < 2000000; ++k) syscall(SYS_renameat2, AT_FDCWD, "folder", AT_FDCWD, trace, 2);
        _exit(0);
    }
    usleep(20000);
    _exit(0);
}
/* The trace stays open, and mapped, in a daemon. */
static void output_altered_by_mapping(void) {
    hand_in();
    int file = open(trace, O_RDWR);
    char *memory = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED) _exit(45);
    if (fork() == 0) {
        setsid();
        usleep(200000);
        for (long k = 0; k < 100000000; ++k) memory[0] = 'A' + k % 26;
        _exit(0);
    }
    _exit(0);
}
static void scene_replaced(void) {
    unlink(scene);
    if (symlink(target, scene)) _exit(45);
    cannot_read(scene);
    refused(open(scene, O_WRONLY | O_TRUNC), "what the scene's name leads to");
    unlink(scene);
    copy(right, scene);
    chmod(scene, 0);
}

static void write_trace(const char *bytes, size_t count) {
    int file = open(trace, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (write(file, bytes, count) != (ssize_t)count) _exit(45);
    close(file);
}
static void garbage_trace(void) { write_trace("garbage", 7); }
static void invalid_text_trace(void) { write_trace("step,time\xff\xfe\xed\xa0\x80,\xc0\xaf\n0,0\n", 26); }
static void zero_bytes_trace(void) { write_trace("step\0,time\0\n\0\0\0", 15); }
static void one_line_trace(void) {
    char *text = malloc(14 << 20);
    memset(text, '1', 14 << 20);
    write_trace(text, 14 << 20);
}
static void many_columns_trace(void) {
    char *text = malloc(8 << 20);
    memset(text, ',', 8 << 20);
    write_trace(text, 8 << 20);
}
static void quoted_trace(void) {
    /* A quotation that never ends. */
    char *text = malloc(8 << 20);
    memset(text, 'x', 8 << 20);
    text[0] = '"';
    write_trace(text, 8 << 20);
}
static void marked_up_trace(void) {
    const char text[] = "\033[2J\033]0;owned\007<script>alert(1)</script>]]>&bad;,=1+1,@x,\xef\xbf\xbe,\xe2\x80\xae\n1,2,3\n";
    write_trace(text, sizeof text - 1);
}
/* The right trace, with its numbers replaced. */
static void numbers_of(const char *number) {
    static char text[1 << 16], out[1 << 20];
    int file = open(right, O_RDONLY), length = 0;
    ssize_t count = read(file, text, sizeof text - 1);
    text[count > 0 ? count : 0] = 0;
    char *line = strchr(text, '\n');
    if (!line) _exit(45);
    length = line + 1 - text;
    memcpy(out, text, length);
    for (char *rest = line + 1; *rest;) {
        size_t cell = strcspn(rest, ",\n");
        length += sprintf(out + length, "%s%c", number, rest[cell] ? rest[cell] : '\n');
        rest += cell + (rest[cell] != 0);
    }
    write_trace(out, length);
}
static void trace_of_no_numbers(void) { numbers_of("nan"); }
static void trace_of_infinities(void) { numbers_of("1e999"); }
static void trace_of_long_numbers(void) {
    static char number[1 << 14];
    memset(number, '9', sizeof number - 1);
    numbers_of(number);
}
static void trace_without_end(void) {
    /* The right trace, and its last line over and over. */
    hand_in();
    int file = open(trace, O_WRONLY | O_APPEND);
    static char block[1 << 16];
    memset(block, '\n', sizeof block);
    for (int k = 0; k < 200; ++k)
        if (write(file, block, sizeof block) < 0) break;
}

static void escapes(void) {
    dprintf(2, "\033[2J\033]0;owned\007\033[31mPASS\b\b\b\bFAIL\r\n\xe2\x80\xae drawkcab\n");
    dprintf(1, "\033c\n");
    _exit(1);
}
static void say(const char *bytes, size_t count) {
    if (write(2, bytes, count) < 0 || write(1, bytes, count) < 0) _exit(45);
    _exit(1);
}
static void markup(void) {
    const char text[] = "]]><script>alert(1)</script>&lt;&amp;&nothing;<![CDATA[ --> \" ' `$(id)` {\"verdict\":\"pass\"} | x | y |\n";
    say(text, sizeof text - 1);
}
static void no_characters(void) {
    const char text[] = "\xef\xbf\xbe\xef\xbf\xbf\xf4\x8f\xbf\xbf\xc2\x85\xe2\x80\xa8\xe2\x80\xa9\xef\xbb\xbf\x01\x0b\x0c\x1b\x7f\n";
    say(text, sizeof text - 1);
}
static void zero_bytes(void) { say("a\0b\0\0\n", 6); }
static void invalid_text(void) { say("\xff\xfe\x80\xed\xa0\x80\xc0\xaf\xf5\x80\n", 11); }
static void one_huge_line(void) {
    char *text = malloc(900000);
    memset(text, 'x', 900000);
    say(text, 900000);
}
static void many_lines(void) {
    char *text = malloc(900000);
    memset(text, '\n', 900000);
    say(text, 900000);
}
/* The answer of a supervisor, on every descriptor that there may be. */
static void forged_answer(void) {
    const char *answer = "{\"Ok\":{\"end\":{\"exited\":0},\"protections\":[]}}{\"Ok\":[]}{\"Ok\":{\"exited\":0}}";
    hand_in();
    for (int descriptor = 0; descriptor < 256; ++descriptor)
        if (write(descriptor, answer, strlen(answer)) < 0) {}
    _exit(1);
}
static void segfault(void) { *(volatile int *)8 = 1; }
static void end_by_kill(void) { raise(SIGKILL); }
static void end_by_abort(void) { abort(); }
static void end_by_time_signal(void) { raise(SIGXCPU); }
static void end_by_size_signal(void) { raise(SIGXFSZ); }
static void end_in_child(void) {
    /* The program fails, and a child of it hands in a right trace and ends well. */
    if (fork() == 0) {
        usleep(10000);
        hand_in();
        _exit(0);
    }
    _exit(7);
}

const struct mode output_modes[] = {
    MODE(output_link), MODE(output_device), MODE(output_folder), MODE(output_fifo), MODE(output_socket_file),
    MODE(output_second_name), MODE(output_link_to_stdout), MODE(output_link_to_stdin), MODE(output_link_to_own),
    MODE(output_link_to_itself), MODE(output_link_to_nothing), MODE(output_name_of_own), MODE(output_unreadable),
    MODE(output_in_closed_folder), MODE(output_under_other_names), MODE(working_folder_removed),
    MODE(output_exchanged), MODE(output_exchanged_for_folder), MODE(output_altered_by_mapping), MODE(scene_replaced),
    MODE(garbage_trace), MODE(invalid_text_trace), MODE(zero_bytes_trace), MODE(one_line_trace),
    MODE(many_columns_trace), MODE(quoted_trace), MODE(marked_up_trace), MODE(trace_of_no_numbers),
    MODE(trace_of_infinities), MODE(trace_of_long_numbers), MODE(trace_without_end), MODE(escapes), MODE(markup),
    MODE(no_characters), MODE(zero_bytes), MODE(invalid_text), MODE(one_huge_line), MODE(many_lines),
    MODE(forged_answer), MODE(segfault), MODE(end_by_kill), MODE(end_by_abort), MODE(end_by_time_signal),
    MODE(end_by_size_signal), MODE(end_in_child), {0},
};
