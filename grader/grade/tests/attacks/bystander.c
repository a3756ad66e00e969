/* A process of the machine that attacks are after. It makes objects that other processes could find, prints
 *
 *     PROCESS KEY QUEUE SOCKET
 *
 * and removes the objects when its standard input ends. `bystander FOLDER`: the folder of its socket. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <mqueue.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <stddef.h>
#include <sys/msg.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

int main(int count, char **arguments) {
    if (count < 2) return 2;
    umask(0);
    int key = 0x20000000 | getpid();
    char queue[64];
    snprintf(queue, sizeof queue, "/bystander-%d", getpid());
    int memory = shmget(key, 4096, IPC_CREAT | IPC_EXCL | 0666);
    int semaphore = semget(key, 1, IPC_CREAT | IPC_EXCL | 0666);
    int messages = msgget(key, IPC_CREAT | IPC_EXCL | 0666);
    mqd_t mail = mq_open(queue, O_RDWR | O_CREAT, 0666, NULL);
    /* One socket by its path, one of the same name without a file. */
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    snprintf(name.sun_path, sizeof name.sun_path, "%s/bystander", arguments[1]);
    int by_path = socket(AF_UNIX, SOCK_STREAM, 0), abstract = socket(AF_UNIX, SOCK_STREAM, 0);
    if (bind(by_path, (struct sockaddr *)&name, sizeof name) || listen(by_path, 8)) perror("bind");
    chmod(name.sun_path, 0777);
    char path[sizeof name.sun_path];
    memcpy(path, name.sun_path, sizeof path);
    memset(name.sun_path, 0, sizeof name.sun_path);
    memcpy(name.sun_path + 1, path, strlen(path));
    if (bind(abstract, (struct sockaddr *)&name, offsetof(struct sockaddr_un, sun_path) + 1 + strlen(path)) ||
        listen(abstract, 8))
        perror("bind without a file");
    printf("%d %d %s %s\n", getpid(), key, queue, path);
    fflush(stdout);
    char byte;
    while (read(0, &byte, 1) > 0 || errno == EINTR) {}
    shmctl(memory, IPC_RMID, NULL);
    semctl(semaphore, 0, IPC_RMID);
    msgctl(messages, IPC_RMID, NULL);
    if (mail >= 0) mq_unlink(queue);
    unlink(path);
    return 0;
}
