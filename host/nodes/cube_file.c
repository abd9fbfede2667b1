#include "cube_file.h"

#include <errno.h>
#include <fcntl.h>
#include <libconfig.h>
#include <netdb.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "transport/cube.h"
#include "transport/secure_wipe.h"

/* --- what is there -------------------------------------------------------- */

const struct host_cube_wire *
host_cube_between(const struct host_cube_file *file, unsigned a, unsigned b,
                  unsigned *count) {
    const struct host_cube_wire *found = NULL;
    *count = 0;
    for (unsigned i = 0; i < file->wires; i++) {
        const struct host_cube_wire *w = &file->wire[i];
        if ((w->node == a && w->to == b) || (w->node == b && w->to == a)) {
            found = w;
            (*count)++;
        }
    }
    return found;
}

const struct host_cube_wire *
host_cube_host_wire(const struct host_cube_file *file, unsigned k) {
    for (unsigned i = 0; i < file->wires; i++)
        if (file->wire[i].to == CUBE_HOST && k-- == 0)
            return &file->wire[i];
    return NULL;
}

/* "nodes 0 and 1", "node 0 and the host" */
static void name_wire(const struct host_cube_wire *wire, char text[40]) {
    if (wire->to == CUBE_HOST)
        snprintf(text, 40, "node %u and the host", wire->node);
    else
        snprintf(text, 40, "nodes %u and %u", wire->node, wire->to);
}

void host_cube_name_wire(const struct host_cube_file *file,
                         const struct host_cube_wire *wire, char text[160]) {
    char ends[40];
    name_wire(wire, ends);
    snprintf(text, 160, "%.80s:%u: the wire between %s", file->path, wire->line,
             ends);
}

const struct host_link *host_cube_link(const struct host_cube_file *file) {
    const char *first = NULL;
    for (unsigned i = 0; i < file->wires; i++) {
        const struct host_cube_wire *w = &file->wire[i];
        const char *name =
            w->serial ? "serial"
            : host_cube_is_bare(file, w->node) || host_cube_is_bare(file, w->to)
                ? "uart"
            : tcp_address_path(&w->at) != NULL ? "unix"
                                               : "tcp";
        if (first != NULL && strcmp(first, name) != 0)
            return host_link_named("mixed");
        first = name;
    }
    return host_link_named(first);
}

const struct host_cube_pin *host_cube_pin(const struct host_cube_file *file,
                                          unsigned node,
                                          enum host_line_kind kind) {
    for (unsigned i = 0; i < file->pins; i++)
        if (file->pin[i].node == node && file->pin[i].kind == kind)
            return &file->pin[i];
    return NULL;
}

const struct host_cube_ssh *host_cube_ssh(const struct host_cube_file *file,
                                          unsigned node) {
    return file->ssh != NULL && node < file->nodes &&
                   file->ssh[node].to[0] != '\0'
               ? &file->ssh[node]
               : NULL;
}

/* --- links ---------------------------------------------------------------- */

static int wrong(const struct host_cube_file *file, unsigned line,
                 struct host_error *error, const char *what, ...) {
    char text[300];
    va_list arguments;
    va_start(arguments, what);
    vsnprintf(text, sizeof text, what, arguments);
    va_end(arguments);
    return host_fail(error, HOST_INPUT, "%s:%u: %s", file->path, line, text);
}

/* The host's machine has the ports of all nodes that it starts. */
static unsigned owner(const struct host_cube_file *file, unsigned node) {
    return node == CUBE_HOST || file->local[node] ? CUBE_HOST : node;
}

/* Whether both have an end on one machine, as far as that is known. */
static bool meet(const struct host_cube_file *file,
                 const struct host_cube_wire *a,
                 const struct host_cube_wire *b) {
    return owner(file, a->node) == owner(file, b->node) ||
           owner(file, a->node) == owner(file, b->to) ||
           owner(file, a->to) == owner(file, b->node) ||
           owner(file, a->to) == owner(file, b->to);
}

/* Two that listen at one address: on one machine, or at one address of all. */
static bool same_address(const struct host_cube_file *file,
                         const struct host_cube_wire *a,
                         const struct host_cube_wire *b) {
    if (a->serial || b->serial || a->at.size != b->at.size ||
        memcmp(&a->at.to, &b->at.to, a->at.size) != 0)
        return false;
    return tcp_address_path(&a->at) != NULL ? meet(file, a, b)
           : tcp_address_is_any(&a->at)
               ? owner(file, a->node) == owner(file, b->node)
               : true;
}

/* The device at the ends of both that is the same one; NULL: none. */
static const char *same_device(const struct host_cube_file *file,
                               const struct host_cube_wire *a,
                               const struct host_cube_wire *b) {
    const char *found = NULL;
    for (int i = 0; i < 4 && a->serial && b->serial; i++) {
        unsigned left = i / 2 == 0 ? a->node : a->to;
        unsigned right = i % 2 == 0 ? b->node : b->to;
        if (owner(file, left) == owner(file, right) &&
            strcmp(a->device[i / 2], b->device[i % 2]) == 0)
            found = a->device[i / 2];
    }
    return found;
}

/* Whether no two links share an end. */
static int check_ends(const struct host_cube_file *file,
                      struct host_error *error) {
    char address[HOST_NODE_OPTION_BYTES / 2], names[2][40];
    for (unsigned i = 0; i < file->wires; i++) {
        const struct host_cube_wire *w = &file->wire[i];
        const char *what = w->serial &&
                                   owner(file, w->node) == owner(file, w->to) &&
                                   strcmp(w->device[0], w->device[1]) == 0
                               ? w->device[0]
                               : NULL;
        unsigned other = i;
        for (unsigned k = 0; k < i && what == NULL; k++) {
            what = same_device(file, &file->wire[k], w);
            if (what == NULL && same_address(file, &file->wire[k], w)) {
                host_cube_print_address(&w->at, address, sizeof address);
                what = address;
            }
            other = k;
        }
        if (what != NULL) {
            name_wire(w, names[0]);
            name_wire(&file->wire[other], names[1]);
            return host_fail(error, HOST_INPUT,
                             "%s:%u: the link between %s has %s, and so has "
                             "that between %s in line %u; give each end of a "
                             "link its own",
                             file->path, w->line, names[0], what, names[1],
                             file->wire[other].line);
        }
    }
    return 0;
}

/* Whether each wire of the cube is there once, and the host's. */
static int check_wires(const struct host_cube_file *file,
                       struct host_error *error) {
    const struct host_cube_wire *first = host_cube_host_wire(file, 0);
    const struct host_cube_wire *second = host_cube_host_wire(file, 1);
    for (unsigned i = 0; i < file->nodes; i++) {
        for (unsigned d = 0; d < file->dimension; d++) {
            unsigned count = 0, other = i ^ 1u << d;
            const struct host_cube_wire *w =
                host_cube_between(file, i, other, &count);
            if (count > 1) {
                return host_fail(error, HOST_INPUT,
                                 "%s:%u: a second link between nodes %u and "
                                 "%u; leave one of them out",
                                 file->path, w->line, i, other);
            }
            if (count == 0 && !(host_cube_is_bare(file, i) &&
                                host_cube_is_bare(file, other))) {
                return wrong(file, file->links_line, error,
                             "no link between nodes %u and %u; add { node = "
                             "%u; to = %u; .. }",
                             i, other, i, other);
            }
        }
    }
    if (first == NULL || first->node != 0) {
        return wrong(file, file->links_line, error,
                     "the host's first link must be that of node 0; begin "
                     "with { node = 0; to = \"host\"; .. }");
    }
    if (second != NULL &&
        (second->node == 0 || host_cube_host_wire(file, 2) != NULL)) {
        return wrong(file, file->links_line, error,
                     "a second link of the host must be another node's, and "
                     "there is no third; leave it out");
    }
    return 0;
}

/* --- boards --------------------------------------------------------------- */

static int check_node(struct host_cube_file *file, unsigned node,
                      struct host_error *error) {
    const struct host_board *board = file->board_of[node];
    const struct host_cube_ssh *ssh = host_cube_ssh(file, node);
    if (ssh != NULL && (file->local[node] || board->bare != NULL)) {
        return wrong(file, ssh->line, error, "ssh: node %u %s", node,
                     file->local[node]
                         ? "is started by the host itself; take it out of "
                           "start, or leave ssh out"
                         : "has no system to log in to; leave ssh out");
    }
    if (board->bare == NULL)
        return 0;
    if (file->serial_baud == 0 || board->bare->serial_baud < file->serial_baud)
        file->serial_baud = board->bare->serial_baud;
    if (file->nodes > host_bare_nodes_max(board->bare)) {
        return wrong(file, file->dimension_line, error,
                     "dimension: node %u (%s) has UARTs for dimension %u; give "
                     "no more",
                     node, board->name, board->bare->uarts - 1);
    }
    if (file->local[node]) {
        return wrong(file, file->start_line, error,
                     "start: node %u (%s) is no program of this machine; take "
                     "it out, and start it with: incode emulate",
                     node, board->name);
    }
    if (file->memory != HOST_BOARD_MEMORY) {
        return wrong(file, file->memory_line, error,
                     "memory: node %u (%s) has 4M; leave it out", node,
                     board->name);
    }
    return 0;
}

static int check_uart(const struct host_cube_file *file,
                      const struct host_cube_wire *wire, unsigned node,
                      struct host_error *error) {
    const struct host_board *board = file->board_of[node];
    const char *what = NULL;
    char text[80];
    if (!wire->serial && tcp_address_path(&wire->at) == NULL) {
        what = "has no TCP; give unix or serial";
    } else if (wire->serial && wire->baud != board->bare->serial_baud) {
        snprintf(text, sizeof text, "has UARTs of baud = %u; give that",
                 board->bare->serial_baud);
        what = text;
    } else if (!wire->serial && wire->node != node) {
        what = "cannot call; give it as `node`, and the other as `to`";
    }
    return what == NULL ? 0
                        : wrong(file, wire->line, error, "node %u (%s) %s",
                                node, board->name, what);
}

static int check(struct host_cube_file *file, struct host_error *error) {
    if (check_wires(file, error) != 0)
        return error->code;
    for (unsigned i = 0; i < file->nodes && error->code == 0; i++)
        (void)check_node(file, i, error);
    for (unsigned i = 0; i < file->wires && error->code == 0; i++) {
        const struct host_cube_wire *wire = &file->wire[i];
        const unsigned ends[] = {wire->node, wire->to};
        for (int k = 0; k < 2; k++)
            if (host_cube_is_bare(file, ends[k]))
                (void)check_uart(file, wire, ends[k], error);
    }
    return error->code != 0 ? error->code : check_ends(file, error);
}

void host_cube_print_address(const struct tcp_address *address, char *text,
                             size_t size) {
    if (tcp_address_path(address) != NULL) {
        snprintf(text, size, "%s", tcp_address_path(address));
        return;
    }
    char host[NI_MAXHOST], port[NI_MAXSERV];
    if (getnameinfo(&address->to.any, address->size, host, sizeof host, port,
                    sizeof port, NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        snprintf(text, size, "?");
        return;
    }
    snprintf(text, size, strchr(host, ':') != NULL ? "[%s]:%s" : "%s:%s", host,
             port);
}

enum { TEXT_MAX = 4 << 20 }; /* that of 1,024 nodes has half a MiB */

/* --- the text ------------------------------------------------------------- */

/* A cube file has three brackets in each other and nine settings side by side.
 * The library bounds neither, compares each setting's name with all beside it,
 * and opens what @include names, be it a pipe; where it cannot go on it ends
 * the program. */
enum { DEPTH_MAX = 16, BESIDE_MAX = 64 };

struct scan {
    const char *at;
    unsigned line, depth;
    unsigned settings[DEPTH_MAX + 1]; /* beside each other, at each depth */
};

/* Past a text in quotes or a comment; `at` where there is none. */
static const char *skip(const char *at) {
    if (*at == '"') {
        do {
            at += *at == '\\' && at[1] != '\0' ? 2 : 1;
        } while (*at != '\0' && *at != '"');
        return at + (*at == '"');
    }
    if (*at == '#' || (at[0] == '/' && at[1] == '/'))
        return at + strcspn(at, "\n");
    if (at[0] == '/' && at[1] == '*') {
        const char *end = strstr(at + 2, "*/");
        return end == NULL ? at + strlen(at) : end + 2;
    }
    return at;
}

/* What is wrong with the character there, or NULL. */
static const char *take(struct scan *s) {
    switch (*s->at) {
    case '(':
    case '[':
    case '{':
        if (s->depth == DEPTH_MAX)
            return "too many brackets in each other; give three at most";
        s->settings[++s->depth] = 0;
        return NULL;
    case ')':
    case ']':
    case '}':
        s->depth -= s->depth > 0 ? 1 : 0;
        return NULL;
    case '=':
    case ':':
        return ++s->settings[s->depth] > BESIDE_MAX
                   ? "more settings beside each other than there are; see "
                     "host/nodes/README.md for those"
                   : NULL;
    case '@':
        return "@: a cube file stands alone; write what it would @include in "
               "its place";
    default:
        return NULL;
    }
}

/* Whether the library can be given a text: HOST_INPUT with the line where it
 * asks for other files, or for more than any cube file has.  Work: a pass. */
static int look_through(const char *path, const char *text,
                        struct host_error *error) {
    struct scan s = {.at = text, .line = 1};
    while (*s.at != '\0') {
        const char *end = skip(s.at);
        const char *why = end == s.at ? take(&s) : NULL;
        if (why != NULL)
            return host_fail(error, HOST_INPUT, "%s:%u: %s", path, s.line, why);
        end += end == s.at ? 1 : 0;
        for (; s.at < end; s.at++)
            s.line += *s.at == '\n' ? 1 : 0;
    }
    return 0;
}

/* Read here, as libconfig ends the program where it cannot.  The name may be
 * that of a pipe, which would be waited for. */
static int open_text(const char *path, struct host_error *error) {
    struct stat about;
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd < 0 || fstat(fd, &about) != 0) {
        host_fail(error, HOST_INPUT, "%s: %s; check name and rights", path,
                  strerror(errno));
    } else if (!S_ISREG(about.st_mode)) {
        host_fail(error, HOST_INPUT, "%s: %s; give the cube's file", path,
                  S_ISDIR(about.st_mode) ? "a directory" : "a pipe or device");
    } else {
        return fd;
    }
    if (fd >= 0)
        close(fd);
    return -1;
}

/* NULL: as the error says. */
static char *read_text(const char *path, struct host_error *error) {
    int fd = open_text(path, error);
    char *text = fd < 0 ? NULL : malloc(TEXT_MAX + 1);
    size_t size = 0;
    ssize_t got = text == NULL ? 0 : 1;
    while (got > 0 && size <= TEXT_MAX) {
        got = read(fd, text + size, TEXT_MAX + 1 - size);
        size += got > 0 ? (size_t)got : 0;
    }
    if (fd < 0)
        return NULL;
    if (text == NULL) {
        host_fail_memory(error, "the cube file");
    } else if (got < 0) {
        host_fail(error, HOST_INPUT, "%s: %s; check name and rights", path,
                  strerror(errno));
    } else if (size > TEXT_MAX || memchr(text, '\0', size) != NULL) {
        host_fail(error, HOST_INPUT,
                  "%s: not a text of at most %d MiB; give the cube's file",
                  path, TEXT_MAX >> 20);
    } else {
        text[size] = '\0';
    }
    close(fd);
    if (error->code != 0) {
        free(text);
        text = NULL;
    }
    return text;
}

int host_cube_file_parse(struct host_cube_file *file, const char *path,
                         const char *text, struct host_error *error) {
    config_t config;
    int status;
    memset(file, 0, sizeof *file);
    file->path = path;
    if (look_through(path, text, error) != 0)
        return error->code;
    config_init(&config);
    if (config_read_string(&config, text) == CONFIG_TRUE) {
        status = host_cube_read_settings(file, &config, error) != 0
                     ? error->code
                     : check(file, error);
    } else {
        status =
            host_fail(error, HOST_INPUT,
                      "%s:%d: %s; correct it as in boards/linux/examples", path,
                      config_error_line(&config), config_error_text(&config));
    }
    config_destroy(&config);
    if (status != 0)
        host_cube_file_free(file);
    return status;
}

int host_cube_file_read(struct host_cube_file *file, const char *path,
                        struct host_error *error) {
    char *text = read_text(path, error);
    int status = text == NULL ? error->code
                              : host_cube_file_parse(file, path, text, error);
    free(text);
    return status;
}

void host_cube_file_free(struct host_cube_file *file) {
    free(file->wire);
    free(file->pin);
    free(file->ssh);
    file->wire = NULL;
    file->pin = NULL;
    file->ssh = NULL;
    secure_wipe(file->key, sizeof file->key);
}
