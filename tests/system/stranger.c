/* A stranger on this machine for the system tests: calls whatever the processes
 * below one listen on, TCP and unix sockets, over and over until SIGTERM, and
 * is silent there, sends noise, half a greeting, what it heard there or
 * elsewhere, or floods it with calls.  Run by root it calls as nobody, a user
 * who has no rights there.
 *
 *     stranger SEED PID
 *
 * At its end it prints how many of its calls were taken, and each listener that
 * it has found, a line each: `tcp PORT`, `unix PATH`.
 */
#include <arpa/inet.h>
#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

enum {
    PROCESSES_MAX = 256,
    SOCKETS_MAX = 4096,
    TARGETS_MAX = 256,
    CALLS_MAX = 128,
    BYTES_MAX = 4096,
    LOOK_US = 250000, /* between two looks for listeners */
    ROUND_MS = 2,
    CALLS_A_ROUND = 4,
    NOBODY = 65534
};

enum manner { SILENT, NOISE, HALF, ECHO, REPLAY, FLOOD, MANNERS };

struct target {
    union {
        struct sockaddr any;
        struct sockaddr_in in;
        struct sockaddr_in6 in6;
        struct sockaddr_un un;
    } address;
    socklen_t size;
};

struct call {
    int fd; /* -1: unused */
    enum manner manner;
    uint64_t end_us;
    bool spoke;
};

static struct {
    uint64_t random;
    pid_t process[PROCESSES_MAX];
    unsigned processes;
    unsigned long socket[SOCKETS_MAX]; /* their inodes */
    unsigned sockets;
    struct target target[TARGETS_MAX];
    unsigned targets;
    struct call call[CALLS_MAX];
    uint8_t heard[BYTES_MAX]; /* by any of the calls, the last */
    size_t heard_size;
    unsigned long taken[2], refused; /* over TCP, over unix sockets */
} all;

static volatile sig_atomic_t ended;

static void end(int number) {
    (void)number;
    ended = 1;
}

static uint64_t draw(uint64_t below) {
    all.random = all.random * 6364136223846793005u + 1442695040888963407u;
    return (all.random >> 33) % below;
}

static uint64_t now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now); /* clock: when it calls next */
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* --- who listens where ---------------------------------------------------- */

static bool is_ours(pid_t pid) {
    for (unsigned i = 0; i < all.processes; i++)
        if (all.process[i] == pid)
            return true;
    return false;
}

static pid_t parent_of(const char *pid) {
    char path[64], text[512] = "";
    int parent = 0;
    snprintf(path, sizeof path, "/proc/%.16s/stat", pid);
    FILE *file = fopen(path, "re");
    if (file == NULL)
        return 0;
    size_t size = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[size] = '\0';
    const char *name_end = strrchr(text, ')');
    if (name_end == NULL || sscanf(name_end + 1, " %*c %d", &parent) != 1)
        return 0;
    return parent;
}

/* All processes below the first, but this one. */
static void find_processes(void) {
    all.processes = 1;
    for (bool more = true; more;) {
        DIR *directory = opendir("/proc");
        const struct dirent *entry;
        more = false;
        while (directory != NULL && (entry = readdir(directory)) != NULL) {
            pid_t pid = (pid_t)atoi(entry->d_name);
            if (pid > 0 && pid != getpid() && !is_ours(pid) &&
                all.processes < PROCESSES_MAX &&
                is_ours(parent_of(entry->d_name))) {
                all.process[all.processes++] = pid;
                more = true;
            }
        }
        if (directory != NULL)
            closedir(directory);
    }
}

static void find_sockets(void) {
    all.sockets = 0;
    for (unsigned i = 0; i < all.processes; i++) {
        char path[64];
        snprintf(path, sizeof path, "/proc/%d/fd", (int)all.process[i]);
        DIR *directory = opendir(path);
        const struct dirent *entry;
        while (directory != NULL && (entry = readdir(directory)) != NULL) {
            char link[384], what[64] = "";
            unsigned long inode;
            snprintf(link, sizeof link, "%s/%s", path, entry->d_name);
            if (readlink(link, what, sizeof what - 1) > 0 &&
                sscanf(what, "socket:[%lu]", &inode) == 1 &&
                all.sockets < SOCKETS_MAX)
                all.socket[all.sockets++] = inode;
        }
        if (directory != NULL)
            closedir(directory);
    }
}

static bool has_socket(unsigned long inode) {
    for (unsigned i = 0; i < all.sockets; i++)
        if (all.socket[i] == inode)
            return true;
    return false;
}

static void add_target(const struct target *target) {
    for (unsigned i = 0; i < all.targets; i++)
        if (all.target[i].size == target->size &&
            memcmp(&all.target[i].address, &target->address, target->size) == 0)
            return;
    if (all.targets < TARGETS_MAX)
        all.target[all.targets++] = *target;
}

/* A line of /proc/net/tcp or tcp6: number, address:port in hexadecimal, peer,
 * state (0A: listens), ..., inode. */
static void look_at_tcp(const char *line) {
    char address[64];
    unsigned port, state;
    unsigned long inode;
    struct target t = {.size = sizeof t.address.in};
    if (sscanf(line, " %*d: %63[0-9A-Fa-f]:%x %*s %x %*s %*s %*s %*s %*s %lu",
               address, &port, &state, &inode) != 4 ||
        state != 0x0a || !has_socket(inode))
        return;
    if (strlen(address) == 8) {
        t.address.in.sin_family = AF_INET;
        t.address.in.sin_port = htons((uint16_t)port);
        t.address.in.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    } else {
        t.size = sizeof t.address.in6;
        t.address.in6.sin6_family = AF_INET6;
        t.address.in6.sin6_port = htons((uint16_t)port);
        t.address.in6.sin6_addr = in6addr_loopback;
    }
    add_target(&t);
}

/* One of /proc/net/unix: address, count, protocol, flags (bit 16: listens),
 * type, state, inode, path (@: of no file). */
static void look_at_unix(const char *line) {
    struct target t = {0};
    char path[sizeof t.address.un.sun_path + 1] = "";
    unsigned flags, type;
    unsigned long inode;
    if (sscanf(line, "%*s %*s %*s %x %x %*s %lu %107s", &flags, &type, &inode,
               path) != 4 ||
        (flags & 0x10000) == 0 || !has_socket(inode))
        return;
    t.address.un.sun_family = AF_UNIX;
    memcpy(t.address.un.sun_path, path, strlen(path));
    t.size = sizeof t.address.un;
    if (path[0] == '@') {
        t.address.un.sun_path[0] = '\0';
        t.size =
            (socklen_t)(offsetof(struct sockaddr_un, sun_path) + strlen(path));
    }
    add_target(&t);
}

static void look_into(const char *path, void (*look)(const char *line)) {
    char line[512];
    FILE *file = fopen(path, "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        look(line);
    if (file != NULL)
        fclose(file);
}

static void look(void) {
    find_processes();
    find_sockets();
    look_into("/proc/net/tcp", look_at_tcp);
    look_into("/proc/net/tcp6", look_at_tcp);
    look_into("/proc/net/unix", look_at_unix);
}

/* --- what it says --------------------------------------------------------- */

static void say(const struct call *c, const void *bytes, size_t size) {
    (void)!send(c->fd, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
}

static void speak(struct call *c) {
    static const uint8_t greeting[] = {'i', 'n', 'c', 'o', 'd', 'e', 's'};
    uint8_t bytes[BYTES_MAX] = {0};
    size_t size = 1 + draw(sizeof bytes);
    for (size_t i = 0; i < size; i++)
        bytes[i] = (uint8_t)draw(256);
    if (c->manner == HALF) {
        /* As a greeting begins, in any version, and no more of it. */
        memcpy(bytes, greeting, sizeof greeting);
        bytes[sizeof greeting] = (uint8_t)draw(8);
        size = 1 + draw(40);
    }
    if (c->manner == NOISE || c->manner == HALF)
        say(c, bytes, size);
    else if (c->manner == REPLAY)
        say(c, all.heard, all.heard_size);
    c->spoke = true;
}

static void hang_up(struct call *c) {
    close(c->fd);
    c->fd = -1;
}

static void hear(struct call *c) {
    uint8_t bytes[BYTES_MAX];
    ssize_t got = recv(c->fd, bytes, sizeof bytes, MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN)) {
        hang_up(c);
        return;
    }
    if (got > 0) {
        memcpy(all.heard, bytes, (size_t)got);
        all.heard_size = (size_t)got;
        if (c->manner == ECHO)
            say(c, bytes, (size_t)got);
    }
}

static bool connect_as_nobody(int fd, const struct target *t) {
    bool root = geteuid() == 0;
    if (root && seteuid(NOBODY) != 0)
        return false;
    bool taken =
        connect(fd, &t->address.any, t->size) == 0 || errno == EINPROGRESS;
    return (!root || seteuid(0) == 0) && taken;
}

/* Who is of the same user may say on a unix socket what a neighbour says. */
static enum manner draw_manner(const struct target *t) {
    enum manner manner = (enum manner)draw(MANNERS);
    bool allowed = t->address.any.sa_family == AF_UNIX && geteuid() != 0;
    return allowed && (manner == ECHO || manner == REPLAY) ? SILENT : manner;
}

static void call_one(void) {
    const struct target *t = &all.target[draw(all.targets)];
    struct call *c = &all.call[draw(CALLS_MAX)];
    if (c->fd >= 0)
        hang_up(c);
    int fd = socket(t->address.any.sa_family,
                    SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return;
    bool taken = connect_as_nobody(fd, t);
    if (!taken) {
        all.refused++;
        close(fd);
        return;
    }
    all.taken[t->address.any.sa_family == AF_UNIX]++;
    *c = (struct call){fd, draw_manner(t), 0, false};
    if (c->manner == FLOOD) {
        hang_up(c);
        return;
    }
    c->end_us = now_us() + draw(2000000);
}

static void serve(struct call *c) {
    struct pollfd p = {c->fd, POLLIN | (c->spoke ? 0 : POLLOUT), 0};
    if (poll(&p, 1, 0) <= 0)
        p.revents = 0;
    if ((p.revents & POLLOUT) != 0 && !c->spoke)
        speak(c);
    if ((p.revents & (POLLIN | POLLHUP | POLLERR)) != 0)
        hear(c);
    if (c->fd >= 0 && now_us() >= c->end_us)
        hang_up(c);
}

static void run(void) {
    uint64_t next_us = 0;
    while (!ended) {
        if (now_us() >= next_us) {
            look();
            next_us = now_us() + LOOK_US;
        }
        for (unsigned i = 0; i < CALLS_A_ROUND && all.targets > 0; i++)
            call_one();
        for (unsigned i = 0; i < CALLS_MAX; i++)
            if (all.call[i].fd >= 0)
                serve(&all.call[i]);
        (void)poll(NULL, 0, ROUND_MS); /* clock: so often */
    }
}

static void print_target(const struct target *t) {
    const char *path = t->address.un.sun_path;
    if (t->address.any.sa_family != AF_UNIX) {
        printf("tcp %u\n", ntohs(t->address.in.sin_port)); /* as sin6_port */
    } else {
        printf("unix %s%s\n", path[0] == '\0' ? "@" : "",
               path[0] == '\0' ? path + 1 : path);
    }
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: stranger SEED PID\n");
        return 2;
    }
    (void)signal(SIGTERM, end);
    all.random = strtoull(argv[1], NULL, 10) * 2 + 1;
    all.process[0] = (pid_t)atoi(argv[2]);
    for (unsigned i = 0; i < CALLS_MAX; i++)
        all.call[i].fd = -1;
    run();
    printf("%lu tcp %lu unix calls taken, %lu refused\n", all.taken[0],
           all.taken[1], all.refused);
    for (unsigned i = 0; i < all.targets; i++)
        print_target(&all.target[i]);
    return 0;
}
