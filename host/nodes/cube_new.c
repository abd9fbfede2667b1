#include "cube_new.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cube_file.h"
#include "host/base/text.h"
#include "host/base/create.h"
#include "host/base/options.h"
#include "transport/secure_wipe.h"

#define NEVER UINT64_MAX

static void print_wire(const struct host_cube_wire *wire, unsigned link,
                       bool first, char text[HOST_NODE_OPTION_BYTES]) {
    char address[HOST_NODE_OPTION_BYTES / 2];
    if (wire->serial) {
        snprintf(text, HOST_NODE_OPTION_BYTES, "%u=serial:%s:%u%s", link,
                 wire->device[first ? 0 : 1], wire->baud,
                 wire->rts_cts ? ":rtscts" : "");
        return;
    }
    host_cube_print_address(first ? &wire->at : &wire->via, address,
                            sizeof address);
    snprintf(text, HOST_NODE_OPTION_BYTES, "%u=%s%s:%s", link,
             tcp_address_path(&wire->at) != NULL ? "unix-" : "",
             first ? "listen" : "call", address);
}

unsigned host_cube_node_options(
    const struct host_cube_file *file, unsigned node,
    char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES]) {
    unsigned n = 0, count;
    const struct host_cube_wire *second = host_cube_host_wire(file, 1);
    const struct host_cube_wire *host = node == 0 ? host_cube_host_wire(file, 0)
                                        : second != NULL && second->node == node
                                            ? second
                                            : NULL;
    const struct {
        const char *name;
        uint64_t value, usual; /* the program's default; NEVER: always given */
    } numbers[] = {{"--node", node, NEVER},
                   {"--dimension", file->dimension, NEVER},
                   {"--memory", file->memory, 4u << 20},
                   {"--window", file->window, 0},
                   {"--dead", UINT64_C(1000000) * file->dead_s, 0},
                   {"--serial-baud", file->serial_baud, 0},
                   {"--host-port", node != 0 && host != NULL ? 1 : 0, 0}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        if (numbers[i].value == numbers[i].usual)
            continue;
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%s", numbers[i].name);
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%llu",
                 (unsigned long long)numbers[i].value);
    }
    if (file->has_key) {
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--key");
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%.*s",
                 HOST_NODE_OPTION_BYTES - 1, file->key_path);
    }
    char *insecure = NULL;
    for (unsigned d = 0; d <= file->dimension; d++) {
        const struct host_cube_wire *wire =
            d == file->dimension
                ? host
                : host_cube_between(file, node, node ^ 1u << d, &count);
        if (wire == NULL)
            continue;
        if (wire->insecure && insecure == NULL) {
            snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--insecure");
            insecure = options[n++];
            insecure[0] = '\0';
        }
        if (wire->insecure) {
            size_t used = strlen(insecure);
            snprintf(insecure + used, HOST_NODE_OPTION_BYTES - used, "%s%u",
                     used == 0 ? "" : ",", d);
        }
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--wire");
        print_wire(wire, d, wire->node == node, options[n++]);
    }
    if (file->board_of[node] != host_board_row(0)) {
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "--board");
        snprintf(options[n++], HOST_NODE_OPTION_BYTES, "%s",
                 file->board_of[node]->name);
    }
    return n;
}

const char *host_cube_start_line(const struct host_cube_file *file,
                                 unsigned node, char *line, size_t size) {
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    unsigned count = host_cube_node_options(file, node, options);
    const char *program = file->board_of[node]->program;
    if (program == NULL || host_text_quote(line, size, program) != 0)
        return NULL;
    for (unsigned k = 0; k < count; k++) {
        size_t used = strlen(line);
        if (size - used < 2 ||
            host_text_quote(line + used + 1, size - used - 1, options[k]) != 0)
            return NULL;
        line[used] = ' ';
    }
    return line;
}

const char *host_cube_wire_name(const struct host_cube_wire *wire, char *name,
                                size_t size) {
    if (wire->serial)
        snprintf(name, size, "%s", wire->device[1]);
    else
        host_cube_print_address(&wire->via, name, size);
    return name;
}

/* What a person does who has a board in the hand. */
static void print_bare(const struct host_cube_file *file, unsigned node) {
    const struct host_board *board = file->board_of[node];
    char name[HOST_NODE_OPTION_BYTES];
    unsigned count;
    printf("# node %u (%s): put its firmware on it, %s of make firmware, by "
           "incode flash; UART 0: ",
           node, board->name, board->bare->image);
    for (unsigned k = 0; k < 2; k++) {
        const struct host_cube_wire *wire = host_cube_host_wire(file, k);
        if (wire != NULL && wire->node == node)
            printf("host, ");
    }
    printf("console");
    for (unsigned d = 0; d < file->dimension; d++) {
        const struct host_cube_wire *wire =
            host_cube_between(file, node, node ^ 1u << d, &count);
        printf("; %u: node %u", d + 1, node ^ 1u << d);
        if (wire != NULL) {
            print_wire(wire, d, wire->node == node, name);
            printf(" (%s)", strchr(name, '=') + 1);
        }
    }
    printf("\n");
}

/* `incode cube FILE`: prints how each node is started. */
static int host_cube_print(const char *path, struct host_error *error) {
    /* A byte becomes "$(printf '\\377')" at most. */
    static char line[20 * HOST_NODE_OPTIONS_MAX * HOST_NODE_OPTION_BYTES];
    static struct host_cube_file file;
    if (host_cube_file_read(&file, path, error) != 0)
        return error->code;
    for (unsigned i = 0; i < file.nodes; i++) {
        if (host_cube_is_bare(&file, i)) {
            print_bare(&file, i);
        } else {
            (void)host_cube_start_line(&file, i, line, sizeof line);
            printf("%s\n", line);
        }
    }
    host_cube_file_free(&file);
    return 0;
}

/* --- cube new ------------------------------------------------------------- */

enum {
    FIRST_PORT = 7400,
    HOST_BYTES = 128 /* of one of a list */
};

struct cube_new {
    const char *file;   /* to check */
    const char *output; /* to write */
    unsigned nodes, dimension;
    const char *device, *hosts;
    const struct host_board *board;
    struct host_error *error;
};

static void take_board(void *into, const char *name, struct host_error *error) {
    struct cube_new *c = into;
    c->board = host_board_named(name);
    if (c->board == NULL) {
        host_fail(error, HOST_USAGE,
                  "--board %s: not one that there is; incode run --help lists "
                  "them",
                  name);
    }
}

static const struct host_option rows[] = {
    {"new", 0, "N", "Write a cube file of N nodes to start from",
     HOST_AT(struct cube_new, nodes), .most = HOST_NODES_MAX, .powers = ""},
    {"serial", 0, "DEVICE",
     "Of it: serial wires, and the host's is DEVICE (/dev/ttyUSB0)",
     HOST_AT(struct cube_new, device), .omitted = "/dev/ttyUSB0"},
    {"tcp", 0, "HOST,HOST,..",
     "Of it: a machine for each node, wires over TCP, a key for them; "
     "USER@HOST where incode deploy is to log in so",
     HOST_AT(struct cube_new, hosts)},
    {"board", 0, "NAME",
     "Of it: what the nodes run on, linux or a board without a system",
     .take = take_board},
    {"output", 'o', "FILE", "Of it: the file, which must not be there yet",
     HOST_AT(struct cube_new, output)},
    {0}};

/* "pi@10.0.0.11": the k-th of the list; "": there are fewer. */
static void host_of(const struct cube_new *c, unsigned k,
                    char text[HOST_BYTES]) {
    const char *at = c->hosts;
    while (k > 0 && at != NULL) {
        at = strchr(at, ',');
        at = at == NULL ? NULL : at + 1;
        k--;
    }
    snprintf(text, HOST_BYTES, "%.*s", at == NULL ? 0 : (int)strcspn(at, ","),
             at == NULL ? "" : at);
}

/* That stands in quotation marks of a cube file as it is. */
static bool is_word(const char *text) {
    bool good = true;
    for (const char *at = text; *at != '\0'; at++)
        good = good && *at > ' ' && *at < 0x7f && *at != '"' && *at != '\\';
    return good;
}

static const char *address_of(const char *host) {
    const char *at = strrchr(host, '@');
    return at == NULL ? host : at + 1;
}

/* One for each node, neither more nor fewer. */
static int check_hosts(const struct cube_new *c) {
    char host[HOST_BYTES];
    bool good = true;
    for (unsigned i = 0; i <= c->nodes; i++) {
        host_of(c, i, host);
        good = good && (i == c->nodes) == (host[0] == '\0') && host[0] != '-' &&
               is_word(host) && strlen(host) < HOST_BYTES - 1;
    }
    return good ? 0
                : host_fail(c->error, HOST_USAGE,
                            "--tcp %s: not %u hosts; give one for each node, "
                            "as in 10.0.0.10,10.0.0.11",
                            c->hosts, c->nodes);
}

static int check(struct cube_new *c) {
    if (c->nodes > 0 && c->device != NULL && c->file != NULL) {
        c->device = c->file; /* --serial DEVICE, with a blank */
        c->file = NULL;
    }
    if (c->nodes == 0 && c->file == NULL) {
        return host_fail(c->error, HOST_USAGE,
                         "cube: too few arguments; give FILE to check it, or "
                         "--new N -o FILE to write one");
    }
    if (c->nodes == 0 || c->file != NULL) {
        return c->output == NULL && c->device == NULL && c->hosts == NULL &&
                       c->board == NULL && c->nodes == 0
                   ? 0
                   : host_fail(c->error, HOST_USAGE,
                               "cube: --new N writes a file, and FILE alone "
                               "checks one; give --new N -o FILE, or FILE");
    }
    if (c->output == NULL) {
        return host_fail(c->error, HOST_USAGE,
                         "cube --new: no file to write; add -o lab.cube");
    }
    bool bare = c->board != NULL && c->board->bare != NULL;
    if (c->hosts != NULL && (bare || c->device != NULL)) {
        return host_fail(
            c->error, HOST_USAGE, "--tcp: %s; leave one of them out",
            bare ? "that board has no network" : "not beside --serial");
    }
    if (c->device != NULL && !is_word(c->device)) {
        return host_fail(c->error, HOST_USAGE,
                         "--serial %s: no name of a port; give one such as "
                         "/dev/ttyUSB0, or usb:SERIAL of an adapter",
                         c->device);
    }
    if (c->hosts != NULL && check_hosts(c) != 0)
        return c->error->code;
    c->dimension = (unsigned)__builtin_ctz(c->nodes);
    if (bare && c->nodes > host_bare_nodes_max(c->board->bare)) {
        return host_fail(c->error, HOST_USAGE,
                         "--new %u: %s has UARTs for a cube of %u; give %u or "
                         "fewer",
                         c->nodes, c->board->name,
                         host_bare_nodes_max(c->board->bare),
                         host_bare_nodes_max(c->board->bare));
    }
    return 0;
}

/* --- what it writes ------------------------------------------------------- */

/* Every pair of neighbours, the smaller first; what is between them. */
static void put_pairs(FILE *out, const struct cube_new *c,
                      void (*put)(FILE *out, const struct cube_new *c,
                                  unsigned node, unsigned d)) {
    for (unsigned i = 0; i < c->nodes; i++) {
        for (unsigned d = 0; d < c->dimension; d++) {
            if ((i & 1u << d) == 0) {
                (void)fprintf(out, ",\n    { node = %u; to = %u; ", i,
                              i | 1u << d);
                put(out, c, i, d);
                (void)fputs(" }", out);
            }
        }
    }
    (void)fputs("\n);\n", out);
}

static void put_unix(FILE *out, const struct cube_new *c, unsigned node,
                     unsigned d) {
    (void)c;
    (void)fprintf(out, "unix = \"%u-%u.socket\";", node, node | 1u << d);
}

static void put_serial(FILE *out, const struct cube_new *c, unsigned node,
                       unsigned d) {
    (void)c;
    (void)node;
    (void)fprintf(out,
                  "serial = [\"/dev/ttyUSB%u\", \"/dev/ttyUSB%u\"];\n"
                  "      baud = 921600;",
                  d, d);
}

/* A port of its own for each link of a machine. */
static void put_tcp(FILE *out, const struct cube_new *c, unsigned node,
                    unsigned d) {
    char host[HOST_BYTES];
    host_of(c, node, host);
    (void)fprintf(out, "tcp = \"%s:%u\";", address_of(host),
                  FIRST_PORT + 1 + node * c->dimension + d);
}

static void put_local(FILE *out, const struct cube_new *c) {
    (void)fputs("# The host starts these nodes itself, on its own machine.\n"
                "start = [",
                out);
    for (unsigned i = 0; i < c->nodes; i++)
        (void)fprintf(out, "%s%u", i == 0 ? "" : ", ", i);
    (void)fputs("];\nlinks = (\n"
                "    { node = 0; to = \"host\"; unix = \"host.socket\"; }",
                out);
    put_pairs(out, c, put_unix);
}

static void put_boards(FILE *out, const struct cube_new *c) {
    const char *device = c->device == NULL ? "/dev/ttyUSB0" : c->device;
    (void)fprintf(out,
                  "board = \"%s\";\n"
                  "# EDIT: the host's port.  usb:NUMBER is an adapter by its "
                  "serial number.\n"
                  "# From board to board UART goes to UART: incode cube says "
                  "which.\n"
                  "links = (\n    { node = 0; to = \"host\"; serial = [\"UART "
                  "0\", \"%s\"];\n      baud = %u; }\n);\n",
                  c->board->name, device, c->board->bare->serial_baud);
}

static void put_lines(FILE *out, const struct cube_new *c) {
    (void)fprintf(out,
                  "# EDIT: serial = [port at `node`, port at `to`], of its own "
                  "machine each.\n"
                  "links = (\n    { node = 0; to = \"host\"; serial = "
                  "[\"/dev/ttyUSB%u\", \"%s\"];\n      baud = 921600; }",
                  c->dimension, c->device);
    put_pairs(out, c, put_serial);
}

static void put_machines(FILE *out, const struct cube_new *c, const char *key) {
    char host[HOST_BYTES];
    (void)fprintf(out,
                  "# Whoever has a copy of this key can join the cube.\n"
                  "key = \"%s\";\n"
                  "# EDIT: who incode deploy logs in as; take out what you "
                  "start by hand.\n"
                  "nodes = (",
                  key);
    for (unsigned i = 0; i < c->nodes; i++) {
        host_of(c, i, host);
        (void)fprintf(out, "%s\n    { node = %u; ssh = \"%s\"; }",
                      i == 0 ? "" : ",", i, host);
    }
    host_of(c, 0, host);
    (void)fprintf(out,
                  "\n);\n# At `node` this address is listened on, by `to` it "
                  "is called.\nlinks = (\n"
                  "    { node = 0; to = \"host\"; tcp = \"%s:%u\"; }",
                  address_of(host), (unsigned)FIRST_PORT);
    put_pairs(out, c, put_tcp);
}

/* The key of a new cube, beside its file: one that is there is taken. */
static int make_key(const struct cube_new *c, char *path, size_t size) {
    const char *slash = strrchr(c->output, '/');
    const char *name = slash == NULL ? c->output : slash + 1;
    const char *dot = strrchr(name, '.');
    int stem = dot == NULL || dot == name ? (int)strlen(c->output)
                                          : (int)(dot - c->output);
    if (snprintf(path, size, "%.*s.key", stem, c->output) >= (int)size) {
        return host_fail(c->error, HOST_USAGE,
                         "-o %s: too long; give a shorter name", c->output);
    }
    return access(path, F_OK) == 0 ? 0 : host_key_make(path, c->error);
}

static int write_new(const struct cube_new *c) {
    char key[4096] = "";
    if (c->hosts != NULL && access(c->output, F_OK) != 0 &&
        make_key(c, key, sizeof key) != 0)
        return c->error->code;
    int fd = host_create(c->output, 0644);
    FILE *out = fd < 0 ? NULL : fdopen(fd, "w");
    if (out == NULL) {
        return host_fail(
            c->error, HOST_INPUT, "%s: %s; give another -o", c->output,
            errno == EEXIST ? "is there already, and stays" : strerror(errno));
    }
    (void)fprintf(out,
                  "# A cube of %u nodes, by incode cube --new.  Check it with: "
                  "incode cube FILE\n"
                  "dimension = %u;\n",
                  c->nodes, c->dimension);
    if (c->hosts != NULL) {
        const char *slash = strrchr(key, '/');
        put_machines(out, c, slash == NULL ? key : slash + 1);
    } else if (c->board != NULL && c->board->bare != NULL) {
        put_boards(out, c);
    } else if (c->device != NULL) {
        put_lines(out, c);
    } else {
        put_local(out, c);
    }
    bool good = ferror(out) == 0;
    if (fclose(out) != 0 || !good) {
        int reason = errno;
        (void)unlink(c->output);
        return host_fail(c->error, HOST_INPUT, "%s: %s; give another -o",
                         c->output, strerror(reason));
    }
    printf("%s: %u node%s%s%s; edit what says EDIT, then: incode cube %s\n",
           c->output, c->nodes, host_text_s(c->nodes),
           key[0] == '\0' ? "" : ", with the key ", key, c->output);
    return 0;
}

int host_cube_command(int argc, char **argv, struct host_error *error) {
    static const struct host_options options = {
        .rows = rows,
        .one = "FILE",
        .one_at = offsetof(struct cube_new, file),
        .arguments = "FILE\n--new N -o FILE",
        .about = "Checks a cube file, and prints how each of its nodes is "
                 "started. Or writes one to start from.\v"
                 "Example:\n"
                 "  incode cube --new 4 --tcp pi@10.0.0.10,pi@10.0.0.11,"
                 "pi@10.0.0.12,pi@10.0.0.13 -o lab.cube\n"
                 "  incode cube --new 8 --board mps2-an500 "
                 "--serial=/dev/ttyUSB0 -o lab.cube"};
    struct cube_new c = {.error = error};
    if (host_options_parse(&options, argc, argv, false, &c, NULL, error) != 0 ||
        check(&c) != 0)
        return error->code;
    return c.nodes > 0 ? write_new(&c) : host_cube_print(c.file, error);
}

/* --- keys ----------------------------------------------------------------- */

enum { TEXT_BYTES = 2 * SECURE_KEY_BYTES + 1 };

static bool draw_digits(char text[TEXT_BYTES]) {
    static const char digits[] = "0123456789abcdef";
    uint8_t key[SECURE_KEY_BYTES];
    if (getrandom(key, sizeof key, 0) != (ssize_t)sizeof key)
        return false;
    for (unsigned i = 0; i < SECURE_KEY_BYTES; i++) {
        text[2 * i] = digits[key[i] >> 4];
        text[2 * i + 1] = digits[key[i] & 15];
    }
    text[TEXT_BYTES - 1] = '\n';
    secure_wipe(key, sizeof key);
    return true;
}

static bool write_all(int fd, const char *text, size_t size) {
    while (size > 0) {
        ssize_t written = write(fd, text, size);
        if (written < 0 && errno != EINTR)
            return false;
        text += written > 0 ? written : 0;
        size -= written > 0 ? (size_t)written : 0;
    }
    return true;
}

/* False: errno says why. */
static bool fill(int fd, const char *text, size_t size, mode_t mode) {
    return fchmod(fd, mode) == 0 && write_all(fd, text, size) && fsync(fd) == 0;
}

int host_key_write(const char *path, const char *text, size_t size, mode_t mode,
                   struct host_error *error) {
    int fd = host_create(path, mode & 0600);
    if (fd < 0 && errno == EEXIST) {
        return host_fail(error, HOST_INPUT,
                         "%s: is there already, and may be a key in use; give "
                         "another name",
                         path);
    }
    bool good = fd >= 0 && fill(fd, text, size, mode);
    int reason = errno;
    if (fd >= 0 && close(fd) != 0 && good) {
        reason = errno;
        good = false;
    }
    if (good)
        return 0;
    if (fd >= 0)
        (void)unlink(path);
    return host_fail(error, HOST_INPUT,
                     "%s: %s; give a name where a file can be written", path,
                     strerror(reason));
}

int host_key_make(const char *path, struct host_error *error) {
    char text[TEXT_BYTES];
    int status =
        draw_digits(text)
            ? host_key_write(path, text, sizeof text, 0600, error)
            : host_fail(error, HOST_BROKEN,
                        "%s: %s; the kernel gives no random numbers, try again",
                        path, strerror(errno));
    secure_wipe(text, sizeof text);
    return status;
}
