/* The network. TARGET is a port of the machine on which the harness listens. */
#include "hostile.h"
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

static void connect_to(int family, int kind, const char *address) {
    int handle = socket(family, kind, 0);
    if (handle < 0) return;
    struct sockaddr_in where = {.sin_family = AF_INET, .sin_port = htons(atoi(target))};
    inet_pton(AF_INET, address, &where.sin_addr);
    if (connect(handle, (struct sockaddr *)&where, sizeof where) == 0) breach(address);
    breach("a socket");
}
static void connect_loopback(void) { connect_to(AF_INET, SOCK_STREAM, "127.0.0.1"); }
static void connect_out(void) { connect_to(AF_INET, SOCK_STREAM, "192.0.2.1"); }
static void send_datagram(void) { connect_to(AF_INET, SOCK_DGRAM, "127.0.0.1"); }
static void unix_socket(void) {
    refused(socket(AF_UNIX, SOCK_STREAM, 0), "a socket of the file system");
}
static void every_family(void) {
    for (int family = 0; family < 50; ++family)
        for (int kind = 1; kind < 7; ++kind) {
            denied(socket(family, kind, 0), "a socket");
            denied(socket(family, kind | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), "a socket with flags");
        }
    denied(socket(AF_INET, SOCK_RAW, IPPROTO_ICMP), "a raw socket");
    denied(socket(AF_INET, SOCK_DGRAM, IPPROTO_ICMP), "a ping socket");
    denied(socket(AF_NETLINK, SOCK_RAW, 0), "netlink");
    denied(socket(AF_ALG, SOCK_SEQPACKET, 0), "a socket of algorithms");
}
static void every_family_with_high_bits(void) {
    /* A filter that compares 64 bits where the kernel looks at 32 lets these through. */
    denied(syscall(SYS_socket, AF_INET | (1L << 32), SOCK_STREAM, 0), "a family with high bits");
    denied(syscall(SYS_socket, AF_UNIX | (1L << 40), SOCK_STREAM, 0), "a family with high bits");
    int ends[2];
    refused(syscall(SYS_socketpair, AF_UNIX | (1L << 32), SOCK_DGRAM | (1L << 32), 0, ends), "a pair with high bits");
    refused(syscall(SYS_fcntl, open(right, O_RDONLY), F_SETLEASE | (1L << 32), F_RDLCK), "a lease with high bits");
    refused(syscall(SYS_clone, (unsigned long)CLONE_NEWUSER | (1UL << 33) | SIGCHLD, 0, 0, 0, 0), "clone with high bits");
}
static void network_seen(void) {
    const char *tables[] = {"/proc/net/tcp", "/proc/net/tcp6", "/proc/self/net/tcp", "/proc/1/net/tcp", "/proc/net/unix"};
    char port[16];
    snprintf(port, sizeof port, ":%04X ", atoi(target));
    static char line[1 << 12];
    for (unsigned k = 0; k < LENGTH(tables); ++k) {
        FILE *table = fopen(tables[k], "r");
        if (!table) continue;
        while (fgets(line, sizeof line, table))
            if (strstr(line, port) || strstr(line, "escaped")) breach(tables[k]);
        fclose(table);
    }
    cannot_read("/sys/class/net/lo/address"), cannot_read("/sys/class/net/eth0/address");
    cannot_read("/etc/resolv.conf");
}

const struct mode network_modes[] = {
    MODE(connect_loopback), MODE(connect_out), MODE(send_datagram), MODE(unix_socket), MODE(every_family),
    MODE(every_family_with_high_bits), MODE(network_seen), {0},
};
