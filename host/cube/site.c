#include "site.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "transport/bytes.h"
#include "transport/frame.h"
#include "transport/link_internal.h"
#include "host/base/text.h"
#include "host/base/progress.h"
#include "host/nodes/port.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/secure_wipe.h"

enum { ASK_US = 100000, IN_BYTES = 4096, OUT_BYTES = 192 };

struct listener {
    struct host_greeting *greeting;
    uint8_t in[IN_BYTES], out[OUT_BYTES];
    size_t heard, due, sent;
};

/* An acknowledgement of session 0, which is nobody's, has whoever hears it
 * greet.  A greeting of epoch 0 is passed over. */
static void make_question(struct listener *l, bool first_hello) {
    struct frame_header hello = {.kind = LINK_HELLO, .size = LINK_HELLO_SIZE};
    struct frame_header ask = {.kind = LINK_ACK};
    uint8_t payload[LINK_HELLO_SIZE] = {LINK_VERSION};
    l->sent = 0;
    l->due = 1;
    l->out[0] = 0;
    if (first_hello) {
        bytes_put16(payload + 2, CUBE_HOST);
        l->due += frame_encode(l->out + l->due, &hello, payload);
    }
    l->due += frame_encode(l->out + l->due, &ask, NULL);
}

static void take_frame(struct listener *l, const uint8_t *bytes, size_t size) {
    struct host_greeting *g = l->greeting;
    struct frame_header header;
    uint8_t hello[LINK_HELLO_SIZE];
    if (!frame_decode(bytes, size, &header, hello, sizeof hello))
        return;
    g->learns = g->learns || (header.kind == LINK_ACK && header.session == 0);
    if (header.kind == LINK_HELLO && header.size == sizeof hello &&
        hello[7] != 0) {
        g->found = true;
        g->port = hello[1];
        g->node = bytes_get16(hello + 2);
        g->peer_node = bytes_get16(hello + 4);
        g->dimension = (uint8_t)(hello[7] - 1);
        g->frame_payload = bytes_get16(hello + 18);
    }
}

static void hear(struct listener *l, const struct link_pipe *pipe) {
    int got =
        pipe->receive(pipe->context, l->in + l->heard, sizeof l->in - l->heard);
    size_t begin = 0;
    if (got <= 0) {
        l->heard = got < 0 ? 0 : l->heard;
        return;
    }
    l->heard += (size_t)got;
    for (size_t i = 0; i < l->heard; i++) {
        if (l->in[i] == 0) {
            take_frame(l, l->in + begin, i - begin);
            begin = i + 1;
        }
    }
    l->heard -= begin;
    memmove(l->in, l->in + begin, l->heard);
    if (l->heard == sizeof l->in)
        l->heard = 0; /* no frame is so long */
}

/* Asks by machine->pipe until somebody greets, wait_us at most; first_hello:
 * who is there listens for a link's greeting first, as over a socket. */
static void host_greeting_wait(struct host_greeting *greeting,
                               const struct host_machine *machine,
                               bool first_hello, uint64_t wait_us) {
    struct listener l;
    uint64_t begun_us = machine->now_us(machine->context), now_us = begun_us,
             asked_us = 0;
    memset(greeting, 0, sizeof *greeting);
    memset(&l, 0, sizeof l);
    l.greeting = greeting;
    while (!greeting->found && now_us - begun_us < wait_us) {
        if (asked_us == 0 || now_us - asked_us >= ASK_US) {
            make_question(&l, first_hello);
            asked_us = now_us;
        }
        if (l.sent < l.due) {
            int taken = machine->pipe.send(machine->pipe.context,
                                           l.out + l.sent, l.due - l.sent);
            l.sent = taken < 0 ? 0 : l.sent + (size_t)taken;
        }
        hear(&l, &machine->pipe);
        if (!greeting->found)
            machine->idle(machine->context, ASK_US / 4);
        now_us = machine->now_us(machine->context);
    }
}

/* --- site ----------------------------------------------------------------- */

enum {
    BAUD = 115200,
    GREETING_US = 3000000,
    DIMENSION_UNKNOWN = 0xff /* as SECURE_PORT_UNKNOWN */
};

const struct host_option host_site_rows[] = {
    {.help = "Where the cube is, one of:"},
    {"cube", 0, "FILE", "As the cube file says; see README.md",
     HOST_AT(struct host_site_options, cube)},
    {"port", 0, "DEVICE",
     "Node 0 is at this serial port: a name, or usb:SERIAL of an adapter",
     HOST_AT(struct host_site_options, port)},
    {"tcp", 0, "HOST:PORT", "Node 0 listens there",
     HOST_AT(struct host_site_options, tcp)},
    {"unix", 0, "PATH", "Node 0 is at this socket of the same machine",
     HOST_AT(struct host_site_options, unix_path)},
    {.help = "Without a cube file:"},
    {"cube-nodes", 0, "N",
     "Nodes of the cube, a power of two. Default: as node 0 says; a board that "
     "nobody has told yet who it is does not say",
     HOST_AT(struct host_site_options, nodes), .most = HOST_NODES_MAX,
     .powers = ""},
    {"baud", 0, "RATE", "Of the serial port. Default: 115200",
     HOST_AT(struct host_site_options, baud), .least = 300, .most = 4000000},
    {"key", 0, "FILE", "The cube's key, for --tcp",
     HOST_AT(struct host_site_options, key)},
    {"insecure", 0, NULL, "--tcp without a key",
     HOST_AT(struct host_site_options, insecure)},
    {0}};

int host_site_check(const struct host_site_options *options,
                    struct host_error *error) {
    const struct host_site_options *o = options;
    int places = (o->cube != NULL) + (o->port != NULL) + (o->tcp != NULL) +
                 (o->unix_path != NULL);
    if (places != 1) {
        return host_fail(error, HOST_USAGE,
                         "%s; give --cube FILE, or --port, --tcp or --unix of "
                         "the wire to node 0",
                         places == 0 ? "the cube: where is it?"
                                     : "the cube: it is named twice");
    }
    if (o->tcp != NULL && o->key == NULL && !o->insecure) {
        return host_fail(error, HOST_USAGE,
                         "--tcp %s: a wire over TCP has a key; give --key "
                         "FILE, the cube's, or --insecure",
                         o->tcp);
    }
    const struct {
        bool vain;
        const char *name, *with;
    } vain[] = {{o->key != NULL && o->tcp == NULL, "--key", "--tcp"},
                {o->insecure && o->tcp == NULL, "--insecure", "--tcp"},
                {o->baud != 0 && o->port == NULL, "--baud", "--port"},
                {o->nodes != 0 && o->cube != NULL, "--cube-nodes",
                 "--port, --tcp and --unix"}};
    for (size_t i = 0; i < sizeof vain / sizeof vain[0]; i++) {
        if (vain[i].vain) {
            return host_fail(error, HOST_USAGE,
                             "%s: goes with %s alone; leave it out",
                             vain[i].name, vain[i].with);
        }
    }
    return 0;
}

/* " NAME VALUE", or false: it does not fit. */
static bool put_word(char *text, size_t size, const char *name,
                     const char *value) {
    size_t used = strlen(text);
    int head = snprintf(text + used, size - used, "%s--%s%s",
                        used == 0 ? "" : " ", name, value == NULL ? "" : " ");
    used += (size_t)head;
    return used < size &&
           (value == NULL ||
            host_text_quote(text + used, size - used, value) == 0);
}

void host_site_text(const struct host_site_options *options, char *text,
                    size_t size) {
    const struct host_site_options *o = options;
    char nodes[24], baud[24];
    snprintf(nodes, sizeof nodes, "%u", o->nodes);
    snprintf(baud, sizeof baud, "%llu", (unsigned long long)o->baud);
    const struct {
        bool given;
        const char *name, *value;
    } words[] = {{o->cube != NULL, "cube", o->cube},
                 {o->port != NULL, "port", o->port},
                 {o->tcp != NULL, "tcp", o->tcp},
                 {o->unix_path != NULL, "unix", o->unix_path},
                 {o->nodes != 0, "cube-nodes", nodes},
                 {o->baud != 0, "baud", baud},
                 {o->key != NULL, "key", o->key},
                 {o->insecure, "insecure", NULL}};
    bool fits = true;
    text[0] = '\0';
    for (size_t i = 0; fits && i < sizeof words / sizeof words[0]; i++) {
        fits = !words[i].given ||
               put_word(text, size, words[i].name, words[i].value);
    }
    if (!fits)
        snprintf(text, size, "--cube FILE");
}

/* --- a wire instead of a file --------------------------------------------- */

static int read_key(struct host_cube_file *file, const char *path,
                    struct host_error *error) {
    enum key_file_state state = key_file_read(path, file->key);
    int reason = state == KEY_FILE_UNREADABLE ? errno : 0;
    struct key_file_text fault = key_file_text(state);
    file->has_key = state == KEY_FILE_GOOD || state == KEY_FILE_SEEN;
    if (fault.what == NULL)
        return 0;
    if (!file->has_key) {
        return host_fail(error, HOST_INPUT, "key %s: %s%s%s; %s", path,
                         fault.what, reason == 0 ? "" : ": ",
                         reason == 0 ? "" : strerror(reason), fault.next);
    }
    host_note("key %s: %s; %s", path, fault.what, fault.next);
    return 0;
}

static int take_address(struct host_cube_wire *wire,
                        const struct host_site_options *o,
                        struct host_error *error) {
    char why[400];
    if (o->unix_path != NULL) {
        return tcp_address_set_path(&wire->via, o->unix_path) == 0
                   ? 0
                   : host_fail(error, HOST_USAGE,
                               "--unix %s: no path of a socket; give one of 1 "
                               "to %d bytes",
                               o->unix_path, TCP_PATH_MAX);
    }
    int code = host_resolve(o->tcp, &wire->via, why, sizeof why);
    return code == 0 ? 0
                     : host_fail(error, code == HOST_INPUT ? HOST_USAGE : code,
                                 "--tcp %s: %s", o->tcp, why);
}

/* One wire, to node 0 of a cube of which nothing is known yet. */
static int make_file(struct host_site *site, const struct host_site_options *o,
                     struct host_error *error) {
    struct host_cube_file *file = &site->file;
    struct host_cube_wire *wire = calloc(1, sizeof *wire);
    memset(file, 0, sizeof *file);
    if (wire == NULL)
        return host_fail_memory(error, "the wire");
    const char *name = o->port != NULL  ? "--port"
                       : o->tcp != NULL ? "--tcp"
                                        : "--unix";
    snprintf(site->path, sizeof site->path, "%s %.200s", name,
             o->port != NULL  ? o->port
             : o->tcp != NULL ? o->tcp
                              : o->unix_path);
    file->path = site->path;
    file->nodes = 1;
    file->dimension = DIMENSION_UNKNOWN;
    file->wire = wire;
    file->wires = 1;
    file->board = host_board_row(0);
    file->board_of[0] = file->board;
    wire->to = CUBE_HOST;
    wire->insecure = o->insecure;
    if (o->port != NULL) {
        wire->serial = true;
        wire->baud = o->baud == 0 ? BAUD : (uint32_t)o->baud;
        file->serial_baud = wire->baud;
        if (strlen(o->port) >= sizeof wire->device[1]) {
            return host_fail(error, HOST_USAGE,
                             "--port %s: too long a name; give one of %zu "
                             "bytes at most",
                             o->port, sizeof wire->device[1] - 1);
        }
        snprintf(wire->device[1], sizeof wire->device[1], "%s", o->port);
        return 0;
    }
    if (take_address(wire, o, error) != 0)
        return error->code;
    wire->at = wire->via;
    return o->key == NULL ? 0 : read_key(file, o->key, error);
}

static void pass_over(const char *text) {
    (void)text;
}

/* What it notes is noted when it is opened. */
int host_site_read(const struct host_site_options *options,
                   struct host_error *error) {
    static struct host_cube_file file;
    memset(&file, 0, sizeof file);
    host_note_to(pass_over);
    if (options->cube != NULL)
        (void)host_cube_file_read(&file, options->cube, error);
    else if (options->key != NULL)
        (void)read_key(&file, options->key, error);
    host_note_to(NULL);
    host_cube_file_free(&file);
    return error->code;
}

static void set_nodes(struct host_cube_file *file, unsigned dimension) {
    file->dimension = dimension;
    file->nodes = 1u << dimension;
    for (unsigned i = 0; i < file->nodes; i++)
        file->board_of[i] = file->board;
}

/* Nobody has greeted: why, as far as it is known. */
static int fail_silent(struct host_site *site, const struct host_greeting *g,
                       struct host_error *error) {
    const struct host_machine machine = host_remote_machine(&site->remote);
    const char *doubt = machine.doubt(machine.context, 0);
    if (doubt != NULL) {
        return host_fail(error, HOST_CUBE, "%s: %s%s", site->path, doubt,
                         strchr(doubt, ';') != NULL
                             ? ""
                             : "; is node 0 on, and at this wire?");
    }
    return host_fail(
        error, HOST_CUBE, "%s: %s", site->path,
        g->learns ? "a board is there that nobody has told who it is; say of "
                    "how many nodes the cube is: --cube-nodes 1 for a board "
                    "alone"
        : site->file.wire[0].serial
            ? "nobody answers; is node 0 on, at this wire, at this --baud? A "
              "board that is new may not speak first: --cube-nodes N says of "
              "how many nodes the cube is"
            : "nobody answers; is node 0 on, and at this wire? A board that is "
              "new may not speak first: --cube-nodes N says of how many nodes "
              "the cube is");
}

/* What node 0 says of its cube.  Its wires' settings follow from the longest
 * frame that it takes: those of a serial wire are shorter. */
static int take_greeting(struct host_site *site,
                         const struct host_site_options *o,
                         const struct host_greeting *g,
                         struct host_error *error) {
    struct host_cube_file *file = &site->file;
    if (g->found && (g->node != 0 || g->peer_node != CUBE_HOST)) {
        return host_fail(error, HOST_CUBE,
                         "%s: this wire leads to node %u port %u; put it into "
                         "node 0's host port",
                         site->path, g->node, g->port);
    }
    if (!g->found && o->nodes == 0)
        return fail_silent(site, g, error);
    if (g->found && g->dimension > CUBE_DIMENSION_MAX) {
        return host_fail(error, HOST_CUBE,
                         "%s: node 0 speaks of a cube of dimension %u; is its "
                         "program of this version?",
                         site->path, g->dimension);
    }
    if (g->found && o->nodes != 0 && o->nodes != 1u << g->dimension) {
        return host_fail(error, HOST_CUBE,
                         "--cube-nodes %u: node 0 is of a cube of %u; leave it "
                         "out",
                         o->nodes, 1u << g->dimension);
    }
    set_nodes(file,
              g->found ? g->dimension : (unsigned)__builtin_ctz(o->nodes));
    bool serial =
        g->found ? g->frame_payload != CUBE_PAYLOAD_MAX + 8 : g->learns;
    if (serial && file->serial_baud == 0)
        file->serial_baud = BAUD;
    return 0;
}

static int open_wire(struct host_site *site, const struct host_site_options *o,
                     struct host_error *error) {
    struct host_greeting greeting;
    if (make_file(site, o, error) != 0 ||
        host_remote_start(&site->remote, &site->file, "", error) != 0)
        return error->code;
    struct host_machine machine = host_remote_machine(&site->remote);
    host_greeting_wait(&greeting, &machine, o->port == NULL, GREETING_US);
    if (take_greeting(site, o, &greeting, error) != 0) {
        host_remote_stop(&site->remote);
        return error->code;
    }
    site->machine = host_remote_machine(&site->remote);
    site->machine.start_line = NULL; /* nothing is known of it */
    return 0;
}

static int open_file(struct host_site *site, const struct host_site_options *o,
                     struct host_error *error) {
    if (host_cube_file_read(&site->file, o->cube, error) != 0)
        return error->code;
    if (host_remote_program(&site->file, NULL, site->program,
                            sizeof site->program, error) != 0 ||
        host_remote_start(&site->remote, &site->file, site->program, error) !=
            0)
        return error->code;
    site->machine = host_remote_machine(&site->remote);
    return 0;
}

int host_site_open(struct host_site *site,
                   const struct host_site_options *options,
                   struct host_error *error) {
    memset(site, 0, sizeof *site);
    int status = host_site_check(options, error);
    if (status == 0) {
        host_site_text(options, site->where, sizeof site->where);
        status = options->cube != NULL ? open_file(site, options, error)
                                       : open_wire(site, options, error);
    }
    site->machine.where = site->where;
    if (status != 0)
        host_cube_file_free(&site->file);
    return status;
}

void host_site_close(struct host_site *site) {
    host_remote_stop(&site->remote);
    host_cube_file_free(&site->file); /* and wipes the key */
}
