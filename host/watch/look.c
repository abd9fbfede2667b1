#include "look.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <netinet/in.h>
#include <poll.h>
#include <pwd.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "host/base/text.h"
#include "transport/drivers/tcp.h"
#include "host/base/error.h"

/* NODE_PROBE has nodes send to each other: that is not to look. */
static const char *const names[NODE_QUESTIONS + 1] = {
    [NODE_WHO] = "who",       [NODE_LINKS] = "links",   [NODE_TOP] = "top",
    [NODE_MEMORY] = "memory", [NODE_TOTALS] = "totals", [NODE_LOG] = "log"};

const char *host_look_name(enum node_question what) {
    return (unsigned)what <= NODE_QUESTIONS ? names[what] : NULL;
}

enum node_question host_look_question(const char *name) {
    for (unsigned i = 0; name != NULL && i <= NODE_QUESTIONS; i++)
        if (names[i] != NULL && strcmp(names[i], name) == 0)
            return (enum node_question)i;
    return (enum node_question)0;
}

/* --- holder --------------------------------------------------------------- */

enum { NAME_BYTES = 16, START_FIELD = 22, DAY_S = 86400 };

socklen_t host_holder_address(const char *wire, struct sockaddr_un *address) {
    uint8_t digest[NAME_BYTES];
    char hex[2 * NAME_BYTES + 1];
    memset(address, 0, sizeof *address);
    address->sun_family = AF_UNIX;
    (void)crypto_generichash(digest, sizeof digest, (const uint8_t *)wire,
                             strlen(wire), NULL, 0);
    (void)sodium_bin2hex(hex, sizeof hex, digest, sizeof digest);
    int size = snprintf(address->sun_path + 1, sizeof address->sun_path - 1,
                        "incode-look-%s", hex);
    return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 +
                       (size_t)size);
}

/* A file of /proc/PID; how many bytes. */
static size_t read_of(pid_t pid, const char *name, char *text, size_t size) {
    char path[64];
    snprintf(path, sizeof path, "/proc/%ld/%s", (long)pid, name);
    int file = open(path, O_RDONLY | O_CLOEXEC);
    ssize_t n = file < 0 ? -1 : read(file, text, size - 1);
    if (file >= 0)
        close(file);
    text[n > 0 ? n : 0] = '\0';
    return n > 0 ? (size_t)n : 0;
}

static void find_command(struct host_holder *holder) {
    char line[sizeof holder->command];
    size_t used = read_of(holder->pid, "cmdline", line, sizeof line);
    while (used > 0 && line[used - 1] == '\0')
        used--;
    for (size_t i = 0; i < used; i++)
        line[i] = line[i] == '\0' ? ' ' : line[i];
    size_t name = strcspn(line, " ");
    while (name > 0 && line[name - 1] != '/')
        name--;
    host_text_printable(holder->command, sizeof holder->command, line + name);
    if (used == 0)
        snprintf(holder->command, sizeof holder->command, "a program");
}

static void find_user(struct host_holder *holder) {
    const struct passwd *user = getpwuid(holder->uid);
    if (user != NULL) {
        host_text_printable(holder->user, sizeof holder->user, user->pw_name);
    } else {
        snprintf(holder->user, sizeof holder->user, "user %lu",
                 (unsigned long)holder->uid);
    }
}

/* The kernel counts ticks from its own start to that of the process. */
static void find_since(struct host_holder *holder) {
    char text[1024];
    struct timespec up;
    const char *at = NULL;
    long a_second = sysconf(_SC_CLK_TCK);
    if (read_of(holder->pid, "stat", text, sizeof text) > 0)
        at = strrchr(text, ')'); /* the name before it may hold anything */
    for (int field = 2; at != NULL && field < START_FIELD; field++)
        at = strchr(at + 1, ' ');
    if (at != NULL && a_second > 0 && clock_gettime(CLOCK_BOOTTIME, &up) == 0) {
        int64_t began_s = strtoll(at, NULL, 10) / a_second;
        holder->since_s = (int64_t)time(NULL) - (int64_t)up.tv_sec + began_s;
    }
}

static bool host_holder_of(struct host_holder *holder, int file) {
    struct ucred peer;
    socklen_t size = sizeof peer;
    memset(holder, 0, sizeof *holder);
    if (getsockopt(file, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
        peer.pid <= 0)
        return false;
    holder->pid = peer.pid;
    holder->uid = peer.uid;
    find_command(holder);
    find_user(holder);
    find_since(holder);
    return true;
}

/* --- whether a process has a wire open ------------------------------------ */

/* Whether the process still has the user that took the meeting place. */
static bool is_of_user(const struct host_holder *holder) {
    char text[2048];
    unsigned long real, effective;
    (void)read_of(holder->pid, "status", text, sizeof text);
    const char *line = strstr(text, "\nUid:");
    return line != NULL &&
           sscanf(line, "\nUid: %lu %lu", &real, &effective) == 2 &&
           effective == holder->uid;
}

static bool is_device(int file, const char *path) {
    struct stat device, open_file;
    return stat(path, &device) == 0 && fstat(file, &open_file) == 0 &&
           S_ISCHR(device.st_mode) && S_ISCHR(open_file.st_mode) &&
           device.st_rdev == open_file.st_rdev;
}

/* The process may have opened the socket by a path relative to its folder. */
static bool is_called(pid_t pid, const struct sockaddr_un *peer,
                      const char *path) {
    char called[sizeof peer->sun_path + 64];
    struct stat one, other;
    snprintf(called, sizeof called, "/proc/%ld/%s/%.*s", (long)pid,
             peer->sun_path[0] == '/' ? "root" : "cwd",
             (int)sizeof peer->sun_path, peer->sun_path);
    return peer->sun_path[0] != '\0' && stat(called, &one) == 0 &&
           stat(path, &other) == 0 && one.st_dev == other.st_dev &&
           one.st_ino == other.st_ino;
}

static bool is_at(const struct sockaddr *peer, const char *text) {
    struct tcp_address address;
    const struct sockaddr *to = &address.to.any;
    if (tcp_address_parse(&address, text) != 0 ||
        peer->sa_family != to->sa_family)
        return false;
    if (to->sa_family == AF_INET) {
        const struct sockaddr_in *a = (const void *)peer, *b = (const void *)to;
        return a->sin_port == b->sin_port &&
               a->sin_addr.s_addr == b->sin_addr.s_addr;
    }
    const struct sockaddr_in6 *a = (const void *)peer, *b = (const void *)to;
    return a->sin6_port == b->sin6_port &&
           memcmp(&a->sin6_addr, &b->sin6_addr, sizeof a->sin6_addr) == 0;
}

/* wire: "KIND:PATH" of host/nodes/remote.h. */
static bool is_wire(pid_t pid, int file, const char *wire) {
    union {
        struct sockaddr any;
        struct sockaddr_un un;
        struct sockaddr_storage storage;
    } peer;
    socklen_t size = sizeof peer;
    const char *path = strchr(wire, ':');
    memset(&peer, 0, sizeof peer);
    if (path++ == NULL)
        return false;
    if (strncmp(wire, "serial:", 7) == 0)
        return is_device(file, path);
    if (getpeername(file, &peer.any, &size) != 0)
        return false;
    return peer.any.sa_family == AF_UNIX ? is_called(pid, &peer.un, path)
                                         : is_at(&peer.any, path);
}

/* Checks each open file of the process by a copy, which the kernel gives to
 * root. */
static bool has_open(const struct host_holder *holder, const char *wire) {
    char path[64];
    int process = pidfd_open(holder->pid, 0);
    snprintf(path, sizeof path, "/proc/%ld/fd", (long)holder->pid);
    DIR *folder = process < 0 ? NULL : opendir(path);
    const struct dirent *entry;
    bool found = false;
    while (folder != NULL && !found && is_of_user(holder) &&
           (entry = readdir(folder)) != NULL) {
        int file =
            pidfd_getfd(process, (int)strtol(entry->d_name, NULL, 10), 0);
        if (file >= 0) {
            found = is_wire(holder->pid, file, wire);
            close(file);
        }
    }
    if (folder != NULL)
        closedir(folder);
    if (process >= 0)
        close(process);
    return found;
}

/* Any user may take a meeting place.  A holder is believed if it belongs to
 * this user or to root.  Root also believes another user's process that has the
 * wire open. */
static bool host_holder_believed(const struct host_holder *holder,
                                 const char *wire) {
    return holder->uid == geteuid() || holder->uid == 0 ||
           (geteuid() == 0 && has_open(holder, wire));
}

/* --- who has it ----------------------------------------------------------- */

/* One that takes no calls for so long that its queue is full has the wire, and
 * nobody is told who it is. */
bool host_holder_find(struct host_holder *holder, const char *wire) {
    struct sockaddr_un address;
    socklen_t size = host_holder_address(wire, &address);
    int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    bool found = file >= 0;
    if (found && connect(file, (const struct sockaddr *)&address, size) == 0) {
        found = host_holder_of(holder, file) && holder->pid != getpid() &&
                (geteuid() != 0 || host_holder_believed(holder, wire));
    } else if (found) {
        found = errno == EAGAIN;
        memset(holder, 0, sizeof *holder);
        snprintf(holder->command, sizeof holder->command,
                 "a program that stands still");
    }
    if (file >= 0)
        close(file);
    return found;
}

const char *host_holder_text(const struct host_holder *holder, char *text,
                             size_t size) {
    char since[48] = "";
    time_t began = (time_t)holder->since_s;
    struct tm tm;
    if (holder->since_s != 0 && localtime_r(&began, &tm) != NULL) {
        bool today = time(NULL) - began < DAY_S;
        (void)strftime(since, sizeof since,
                       today ? ", since %H:%M" : ", since %Y-%m-%d %H:%M", &tm);
    }
    if (holder->pid == 0) {
        snprintf(text, size, "%s", holder->command);
    } else {
        snprintf(text, size, "%s, process %ld of %s%s", holder->command,
                 (long)holder->pid, holder->user, since);
    }
    return text;
}

/* --- look ----------------------------------------------------------------- */

enum {
    GREETING_US = 3000000,
    LINE_FIRST = 4096,
    ANSWER_MAX = 4 << 20 /* of 1,024 nodes, each with the longest answer */
};

static int fail_silent(const struct host_look *look, const char *what,
                       struct host_error *error) {
    char text[HOST_HOLDER_TEXT];
    return host_fail(error, HOST_CUBE,
                     "%s: %s; look again in a moment, and if it says nothing "
                     "then either, end it with: kill %ld",
                     host_holder_text(&look->holder, text, sizeof text), what,
                     (long)look->holder.pid);
}

/* --- lines ---------------------------------------------------------------- */

static bool make_room(struct host_look *l) {
    size_t room = l->room == 0 ? LINE_FIRST : 2 * l->room;
    char *line = room > ANSWER_MAX ? NULL : realloc(l->line, room);
    if (line == NULL)
        return false;
    l->line = line;
    l->room = room;
    return true;
}

/* Reads until the line is whole: 0, or HOST_CUBE. */
static int read_line(struct host_look *l, uint64_t wait_us,
                     struct host_error *error) {
    uint64_t begun_us = host_now_us(), passed_us = 0;
    l->used = 0;
    for (;; passed_us = host_now_us() - begun_us) {
        struct pollfd wait = {l->file, POLLIN, 0};
        if (passed_us >= wait_us)
            return fail_silent(l, "has the cube, and does not answer", error);
        if (poll(&wait, 1, (int)((wait_us - passed_us + 999) / 1000)) <= 0)
            continue;
        if (l->used == l->room && !make_room(l))
            return host_fail_memory(error, "an answer");
        ssize_t n =
            recv(l->file, l->line + l->used, l->room - l->used, MSG_DONTWAIT);
        if (n < 0 && (errno == EAGAIN || errno == EINTR))
            continue;
        if (n <= 0) {
            return host_fail(error, HOST_CUBE,
                             "who had the cube has ended; try again");
        }
        l->used += (size_t)n;
        if (l->line[l->used - 1] == '\n') {
            l->line[l->used - 1] = '\0';
            return 0;
        }
    }
}

/* A line's object, or NULL; *error is told. */
static json_t *read_object(struct host_look *l, uint64_t wait_us,
                           struct host_error *error) {
    char why[160], text[HOST_HOLDER_TEXT];
    if (read_line(l, wait_us, error) != 0)
        return NULL;
    json_t *object = json_loads(l->line, 0, NULL);
    const char *said = json_string_value(json_object_get(object, "error"));
    if (object == NULL) {
        (void)fail_silent(l, "has the cube, and says what is no answer", error);
    } else if (said != NULL) {
        host_text_printable(why, sizeof why, said);
        (void)host_fail(error, HOST_CUBE, "%s has the cube: %s",
                        host_holder_text(&l->holder, text, sizeof text), why);
        json_decref(object);
        object = NULL;
    }
    return object;
}

static uint64_t number(const json_t *object, const char *key) {
    json_int_t value = json_integer_value(json_object_get(object, key));
    return value > 0 ? (uint64_t)value : 0;
}

/* --- opening -------------------------------------------------------------- */

static int take_greeting(struct host_look *l, struct host_error *error) {
    json_t *object = read_object(l, GREETING_US, error);
    if (object == NULL)
        return error->code;
    uint64_t protocol = number(object, "protocol");
    uint64_t nodes = number(object, "nodes");
    l->dimension = (unsigned)number(object, "dimension");
    l->serial_baud = (uint32_t)number(object, "serial_baud");
    json_decref(object);
    if (protocol != NODE_PROTOCOL || nodes == 0 || nodes > CUBE_NODES_MAX ||
        l->dimension > CUBE_DIMENSION_MAX || nodes != 1u << l->dimension)
        return fail_silent(l, "has the cube, and is of another version", error);
    l->nodes = (unsigned)nodes;
    l->node = calloc(nodes, sizeof *l->node);
    l->answers = malloc(nodes * CUBE_PAYLOAD_MAX);
    if (l->node == NULL || l->answers == NULL)
        return host_fail_memory(error, "the nodes' answers");
    for (size_t i = 0; i < nodes; i++)
        l->node[i].answer = l->answers + i * CUBE_PAYLOAD_MAX;
    return 0;
}

int host_look_open(struct host_look *look, const char *wire,
                   struct host_error *error) {
    struct sockaddr_un address;
    socklen_t size = host_holder_address(wire, &address);
    char text[HOST_HOLDER_TEXT];
    memset(look, 0, sizeof *look);
    look->file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (look->file < 0) {
        return host_fail(error, HOST_BROKEN, "a socket: %s; close some files",
                         strerror(errno));
    }
    /* One that stands still would let nobody wait for a place in its queue. */
    struct timeval most = {GREETING_US / 1000000, 0};
    (void)setsockopt(look->file, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    if (connect(look->file, (struct sockaddr *)&address, size) != 0 ||
        !host_holder_of(&look->holder, look->file)) {
        return host_fail(error, HOST_CUBE,
                         "%s: no program of this machine has it; is the cube "
                         "with a host elsewhere?",
                         wire);
    }
    /* Another user's program could invent what it says of the cube. */
    if (!host_holder_believed(&look->holder, wire)) {
        return host_fail(error, HOST_CUBE, "%s %s",
                         host_holder_text(&look->holder, text, sizeof text),
                         geteuid() != 0
                             ? "has the cube; ask them"
                             : "says that it has the cube, and does not have "
                               "its wire open; ask them, or end it");
    }
    return take_greeting(look, error);
}

/* --- asking --------------------------------------------------------------- */

static void take_answer(struct host_look *l, const char *key, const char *hex) {
    char *end;
    unsigned long node = strtoul(key, &end, 10);
    size_t size;
    if (*key == '\0' || *end != '\0' || node >= l->nodes || hex == NULL ||
        sodium_hex2bin(l->node[node].answer, CUBE_PAYLOAD_MAX, hex, strlen(hex),
                       NULL, &size, NULL) != 0)
        return;
    l->node[node].size = size;
    l->node[node].answered = true;
}

static int send_question(const struct host_look *l,
                         const struct host_node_set *set,
                         enum node_question what, struct host_error *error) {
    char nodes[HOST_LOOK_QUESTION_BYTES - 64], line[HOST_LOOK_QUESTION_BYTES];
    host_node_set_print(set, nodes, sizeof nodes);
    int size =
        snprintf(line, sizeof line, "{\"ask\":\"%s\",\"nodes\":\"%s\"}\n",
                 host_look_name(what), nodes);
    return send(l->file, line, (size_t)size, MSG_NOSIGNAL) == size
               ? 0
               : host_fail(error, HOST_CUBE,
                           "who had the cube has ended; try again");
}

int host_look_ask(struct host_look *look, const struct host_node_set *set,
                  enum node_question what, uint64_t wait_us,
                  struct host_error *error) {
    struct host_look *l = look;
    const char *key;
    json_t *value;
    for (unsigned i = 0; i < l->nodes; i++)
        l->node[i].answered = false;
    if (host_look_name(what) == NULL) {
        return host_fail(error, HOST_CUBE,
                         "that is not for those who look on; wait until the "
                         "cube is free");
    }
    if (send_question(l, set, what, error) != 0)
        return error->code;
    json_t *object = read_object(l, wait_us, error);
    if (object == NULL)
        return error->code;
    l->committed = number(object, "committed");
    l->bricks = number(object, "bricks");
    l->tetrahedra = number(object, "tetrahedra");
    json_object_foreach(json_object_get(object, "answers"), key, value) {
        take_answer(l, key, json_string_value(value));
    }
    json_decref(object);
    return 0;
}

void host_look_close(struct host_look *look) {
    if (look->file >= 0)
        close(look->file);
    free(look->line);
    free(look->node);
    free(look->answers);
    memset(look, 0, sizeof *look);
    look->file = -1;
}
