#include "emulate.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

#include "host/base/create.h"
#include "host/base/options.h"
#include "host/base/text.h"
#include "host/base/progress.h"
#include "host/formats/output.h"
#include "host/nodes/board_emulated.h"
#include "transport/drivers/tcp.h"

enum { LOOK_US = 20000 };

struct emulate {
    const struct host_board *board;
    unsigned nodes;
    uint64_t linux_nodes; /* a bit for each */
    const char *list;     /* of them, as given; NULL: there are none */
    bool open;            /* boards are not joined */
    bool empty;           /* and their chips have no image */
    const char *file;
    char directory[PATH_MAX];
    int folder; /* the directory, open, and locked */
    struct host_error *error;
};

/* --- the arguments -------------------------------------------------------- */

static void take_board(void *into, const char *value,
                       struct host_error *error) {
    struct emulate *e = into;
    char allowed[HOST_BARE_NAMES];
    host_bare_names(allowed);
    e->board = host_bare_named(value);
    if (e->board == NULL) {
        host_fail(error, HOST_USAGE,
                  "--board %s: no board that is emulated; allowed: %s", value,
                  allowed);
    }
}

static char *list_boards(const char *text) {
    char names[HOST_BARE_NAMES], *whole = NULL;
    host_bare_names(names);
    return asprintf(&whole, "%s%s", text, names) < 0 ? NULL : whole;
}

/* "2,3" */
static void take_linux(void *into, const char *value,
                       struct host_error *error) {
    struct emulate *e = into;
    const char *at = value;
    char *end = NULL;
    e->list = value;
    e->linux_nodes = 0;
    do {
        unsigned long node = strtoul(at, &end, 10);
        bool good = *at >= '0' && *at <= '9' && node < HOST_EMULATED_MAX &&
                    (*end == ',' || *end == '\0');
        if (!good) {
            host_fail(error, HOST_USAGE,
                      "--linux %s: no list of nodes; give their numbers, as in "
                      "2,3",
                      value);
            return;
        }
        e->linux_nodes |= UINT64_C(1) << node;
        at = end + 1;
    } while (*end == ',');
}

static const struct host_option rows[] = {
    {"board", 0, "NAME", "One of ", .take = take_board, .fill = list_boards},
    {"nodes", 0, "N", "Nodes of the cube", HOST_AT(struct emulate, nodes),
     .most = HOST_EMULATED_MAX, .powers = ""},
    {"linux", 0, "N,N",
     "These nodes are no boards, but processes that each run on the cube "
     "starts for itself",
     .take = take_linux},
    {"open", 0, NULL,
     "Joins no boards: between node 1 and node 3 each listens at its end, "
     "FILE.d/1-3.socket and FILE.d/3-1.socket, for what is put between them",
     HOST_AT(struct emulate, open)},
    {"empty", 0, NULL,
     "Puts no image into new flash chips: boards have their loaders alone, as "
     "when they are bought, and wait for incode flash",
     HOST_AT(struct emulate, empty)},
    {"output", 'o', "FILE",
     "The cube file to write. Sockets, consoles and flash chips are in FILE.d",
     HOST_AT(struct emulate, file)},
    {0}};

static int check(const struct emulate *e) {
    uint64_t all = (UINT64_C(1) << e->nodes) - 1;
    if (e->board == NULL || e->nodes == 0 || e->file == NULL ||
        *e->file == '\0' || strcmp(e->file, "-") == 0) {
        return host_fail(e->error, HOST_USAGE,
                         "emulate: --board, --nodes or -o FILE is missing; "
                         "give all three");
    }
    unsigned most = host_bare_nodes_max(e->board->bare);
    if (e->nodes > most) {
        return host_fail(e->error, HOST_USAGE,
                         "--nodes %u: %s has UARTs for a cube of %u; give %u "
                         "or fewer",
                         e->nodes, e->board->name, most, most);
    }
    if ((e->linux_nodes & ~all) != 0 || e->linux_nodes == all) {
        return host_fail(e->error, HOST_USAGE,
                         "--linux %s: not some of nodes 0 to %u; leave a board "
                         "to emulate",
                         e->list, e->nodes - 1);
    }
    return 0;
}

/* --- what it leaves ------------------------------------------------------- */

/* The directory beside the file, for one program at a time. */
static int take_directory(struct emulate *e) {
    struct tcp_address longest;
    char path[PATH_MAX + 32];
    int size = snprintf(e->directory, sizeof e->directory, "%s.d", e->file);
    snprintf(path, sizeof path, "%s/console15.socket", e->directory);
    if (size >= (int)sizeof e->directory ||
        tcp_address_set_path(&longest, path) != 0) {
        return host_fail(e->error, HOST_USAGE,
                         "-o %s: too long a path for the sockets beside it; "
                         "give a shorter one, or go to its folder",
                         e->file);
    }
    e->folder = host_folder_open(e->directory, e->error);
    if (e->folder < 0)
        return e->error->code;
    if (flock(e->folder, LOCK_EX | LOCK_NB) != 0) {
        return host_fail(
            e->error, HOST_INPUT,
            "%s: %s; end what uses it, or give another -o", e->directory,
            errno == EWOULDBLOCK ? "another incode emulate has its boards there"
                                 : strerror(errno));
    }
    return 0;
}

#define FIRST_LINE "# Boards that incode emulate runs"

/* What a person has written is neither replaced nor, in the end, removed. */
static int check_file(const struct emulate *e) {
    char text[sizeof FIRST_LINE] = "";
    int file = open(e->file, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0 && errno != ELOOP)
        return 0;
    ssize_t size = file < 0 ? -1 : read(file, text, sizeof text - 1);
    if (file >= 0)
        (void)close(file);
    return size == 0 || (size > 0 && strcmp(text, FIRST_LINE) == 0)
               ? 0
               : host_fail(e->error, HOST_INPUT,
                           "%s: not a file that incode emulate has written; "
                           "give another -o",
                           e->file);
}

static bool is_linux(const struct emulate *e, unsigned node) {
    return (e->linux_nodes >> node & 1) != 0;
}

/* A link that somebody else than two boards has an end of.  A board listens. */
static void put_link(struct host_output *out, const char *folder, unsigned node,
                     int to, const char *name) {
    char line[PATH_MAX + 100], other[16] = "\"host\"";
    if (to >= 0)
        snprintf(other, sizeof other, "%d", to);
    snprintf(line, sizeof line,
             "%s    { node = %u; to = %s; unix = \"%s/%s\"; }",
             to < 0 ? "" : ",\n", node, other, folder, name);
    host_output_text(out, line);
}

static void put_links(struct host_output *out, const struct emulate *e,
                      const char *folder) {
    char name[32];
    host_output_text(out, "links = (\n");
    put_link(out, folder, 0, -1, "host.socket");
    for (unsigned i = 0; i < e->nodes; i++) {
        for (unsigned d = 0; 1u << d < e->nodes; d++) {
            unsigned other = i ^ 1u << d;
            bool mine = is_linux(e, i) ? is_linux(e, other) && i < other
                                       : is_linux(e, other);
            if (mine) {
                host_emulated_wire(i, 1 + d, name);
                put_link(out, folder, i, (int)other, name);
            }
        }
    }
    host_output_text(out, "\n);\n");
}

/* Names in it are beside it. */
static int write_file(const struct emulate *e) {
    struct host_output out;
    char text[400];
    unsigned dimension = (unsigned)__builtin_ctz(e->nodes);
    const char *slash = strrchr(e->directory, '/');
    const char *folder = slash == NULL ? e->directory : slash + 1;
    if (host_output_open(&out, e->file, e->error) != 0)
        return e->error->code;
    snprintf(text, sizeof text,
             FIRST_LINE ": it removes this file when it "
                        "ends.\ndimension = %u;\nboard = \"%s\";\n",
             dimension, e->board->name);
    host_output_text(&out, text);
    if (e->list != NULL) {
        host_output_text(&out, "nodes = (");
        for (unsigned i = 0, count = 0; i < e->nodes; i++) {
            if (is_linux(e, i)) {
                snprintf(text, sizeof text,
                         "%s\n    { node = %u; board = \"linux\"; }",
                         count++ == 0 ? "" : ",", i);
                host_output_text(&out, text);
            }
        }
        snprintf(text, sizeof text, "\n);\nstart = [%s];\n", e->list);
        host_output_text(&out, text);
    }
    put_links(&out, e, folder);
    (void)host_output_close(&out, 1, e->error);
    return host_output_commit(e->error);
}

/* --- its run -------------------------------------------------------------- */

static volatile sig_atomic_t ended;

static void end(int signal) {
    (void)signal;
    ended = 1;
}

/* A shell that runs no terminal has SIGINT ignored by what it puts behind it:
 * that is how such boards end, all the same.  SIGHUP stays as nohup has it. */
static void expect_end(void) {
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    const struct sigaction action = {.sa_handler = end};
    struct sigaction before;
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        bool kept = signals[i] == SIGHUP &&
                    sigaction(SIGHUP, NULL, &before) == 0 &&
                    before.sa_handler == SIG_IGN;
        if (!kept)
            (void)sigaction(signals[i], &action, NULL);
    }
}

static int start(const struct emulate *e, struct host_started *started) {
    struct host_cluster_options options = {.nodes = e->nodes,
                                           .memory = HOST_BOARD_MEMORY,
                                           .link = host_link_named("uart"),
                                           .left_out = e->linux_nodes,
                                           .directory = e->directory,
                                           .folder = e->folder,
                                           .open = e->open,
                                           .empty = e->empty};
    return e->board->start(e->board, &options, started, e->error);
}

/* Sockets lead nowhere any more; a folder that nothing was put to is not kept.
 */
static void remove_leftovers(const struct emulate *e) {
    char name[32];
    for (unsigned i = 0; i < e->nodes; i++) {
        for (unsigned u = 0; u < HOST_UARTS_MAX; u++) {
            host_emulated_wire(i, u, name);
            (void)unlinkat(e->folder, name, 0);
        }
        snprintf(name, sizeof name, "qmp%u.socket", i);
        (void)unlinkat(e->folder, name, 0);
    }
    (void)rmdir(e->directory);
}

/* Until a signal, or a board that cannot be kept running. */
static int keep(const struct emulate *e, struct host_machine *machine) {
    const struct timespec look = {.tv_nsec = 1000L * LOOK_US};
    unsigned restarts = 0;
    int status = 0;
    while (status == 0 && !ended) {
        (void)nanosleep(&look, NULL);
        status = machine->check(machine->context, e->error);
        if (machine->restarts(machine->context) != restarts) {
            restarts = machine->restarts(machine->context);
            host_note("emulate: a board's process ended, and is started again");
        }
    }
    return status;
}

/* The commands that go on from here. */
static void say_next(const struct emulate *e) {
    char image[PATH_MAX], from[PATH_MAX], file[PATH_MAX];
    bool known = host_firmware_find(e->board->name, image) &&
                 host_text_quote(from, sizeof from, image) == 0;
    if (host_text_quote(file, sizeof file, e->file) != 0)
        snprintf(file, sizeof file, "FILE");
    printf("%u node%s of %s: ", e->nodes, host_text_s(e->nodes),
           e->board->name);
    if (e->empty) {
        printf("incode flash --cube %s %s; then ", file,
               known ? from : "IMAGE");
    }
    printf("incode run POINTS --cube %s\n", file);
    (void)fflush(stdout);
}

int host_emulate(int argc, char **argv, struct host_error *error) {
    static const struct host_options options = {
        .rows = rows,
        .refusal = "one argument too many; give --board, --nodes and -o",
        .arguments = "",
        .about =
            "Starts emulated boards without an operating system, wired as a "
            "cube, and writes the cube file that leads to them. They stay "
            "until this is interrupted, which removes the file.\v"
            "The boards' flash chips stay in FILE.d: who starts them again on "
            "the same FILE has turned them all off and on.\n\n"
            "Example:\n"
            "  incode emulate --board mps2-an500 --nodes 4 -o lab.cube &\n"
            "  incode run points.xyz --cube lab.cube"};
    static struct emulate e = {.folder = -1};
    struct host_started started = {0};
    e.error = error;
    if (host_options_parse(&options, argc, argv, false, &e, NULL, error) != 0 ||
        check(&e) != 0 || check_file(&e) != 0 || take_directory(&e) != 0)
        return error->code;
    expect_end();
    if (start(&e, &started) != 0) {
        remove_leftovers(&e);
        return error->code;
    }
    struct host_machine *machine = &started.machine;
    int status = write_file(&e);
    expect_end();
    if (status == 0) {
        say_next(&e);
        status = keep(&e, machine);
        (void)unlink(e.file);
    }
    machine->stop(machine->context);
    remove_leftovers(&e);
    return status;
}
