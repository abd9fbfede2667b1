#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cube_file.h"
#include "transport/cube.h"

/* --- one link ------------------------------------------------------------- */

static int read_device(const struct host_cube_file *file,
                       const config_setting_t *pair, int end,
                       char device[SERIAL_NAME_MAX], struct host_error *error) {
    const char *name = config_setting_get_string_elem(pair, end);
    if (name == NULL || strlen(name) >= SERIAL_NAME_MAX ||
        config_setting_length(pair) != 2) {
        return host_cube_wrong(
            file, pair, error,
            "serial: not two devices; write [\"/dev/ttyS1\", "
            "\"/dev/ttyUSB0\"], the first at `node`");
    }
    snprintf(device, SERIAL_NAME_MAX, "%s", name);
    return 0;
}

static int host_cube_read_modem(struct host_cube_file *file,
                                const config_setting_t *group,
                                struct host_cube_wire *wire,
                                struct host_error *error);

static int read_line(struct host_cube_file *file, const config_setting_t *group,
                     struct host_cube_wire *wire, struct host_error *error) {
    const config_setting_t *pair = config_setting_get_member(group, "serial");
    const config_setting_t *flow = config_setting_get_member(group, "rtscts");
    int baud = 115200;
    wire->serial = true;
    if (!host_cube_take_number(group, "baud", 300, 20000000, &baud)) {
        return host_cube_wrong(file, config_setting_get_member(group, "baud"),
                               error,
                               "baud: not a rate of a serial wire; give 300 to "
                               "20000000");
    }
    if (flow != NULL && config_setting_type(flow) != CONFIG_TYPE_BOOL) {
        return host_cube_wrong(
            file, flow, error,
            "rtscts: neither true nor false; give one of them");
    }
    wire->baud = (uint32_t)baud;
    wire->rts_cts = flow != NULL && config_setting_get_bool(flow) != 0;
    return read_device(file, pair, 0, wire->device[0], error) != 0 ||
                   read_device(file, pair, 1, wire->device[1], error) != 0
               ? error->code
               : host_cube_read_modem(file, group, wire, error);
}

/* A wire over TCP is guarded by the cube's key, unless the user says that it
 * is not. */
static int read_guard(const struct host_cube_file *file,
                      const config_setting_t *group,
                      struct host_cube_wire *wire, struct host_error *error) {
    const config_setting_t *insecure =
        config_setting_get_member(group, "insecure");
    if (insecure != NULL && config_setting_type(insecure) != CONFIG_TYPE_BOOL) {
        return host_cube_wrong(
            file, insecure, error,
            "insecure: neither true nor false; give one of them");
    }
    wire->insecure = insecure != NULL && config_setting_get_bool(insecure) != 0;
    if (!file->has_key && !wire->insecure) {
        return host_cube_wrong(
            file, config_setting_get_member(group, "tcp"), error,
            "tcp without a key; make one with: incode key FILE, and add key = "
            "\"FILE\"; at the top (or unix = \"PATH\"; on one machine, or "
            "insecure = true; here)");
    }
    return 0;
}

static int read_net(const struct host_cube_file *file,
                    const config_setting_t *group, struct host_cube_wire *wire,
                    struct host_error *error) {
    const config_setting_t *at = config_setting_get_member(group, "tcp");
    const config_setting_t *via = config_setting_get_member(group, "via");
    if (host_cube_resolve(file, at, &wire->at, error) != 0)
        return error->code;
    wire->via = wire->at;
    if (via != NULL && host_cube_resolve(file, via, &wire->via, error) != 0)
        return error->code;
    return read_guard(file, group, wire, error);
}

static int read_path(const struct host_cube_file *file,
                     const config_setting_t *group, struct host_cube_wire *wire,
                     struct host_error *error) {
    const config_setting_t *unix_path =
        config_setting_get_member(group, "unix");
    char path[TCP_PATH_MAX + 1];
    if (host_cube_beside(file, unix_path, path, sizeof path) != 0 ||
        tcp_address_set_path(&wire->at, path) != 0) {
        return host_cube_wrong(file, unix_path, error,
                               "unix: not a path of 1 to 107 bytes, that of "
                               "this file's folder included; write "
                               "\"/run/cube/01\"");
    }
    wire->via = wire->at;
    return 0;
}

/* A node's number, or the host. */
static int read_end(const struct host_cube_file *file,
                    const config_setting_t *group, const char *name,
                    uint16_t *node, struct host_error *error) {
    const config_setting_t *end = config_setting_get_member(group, name);
    const char *text = end == NULL ? NULL : config_setting_get_string(end);
    int number = 0;
    if (text != NULL && strcmp(text, "host") == 0 && strcmp(name, "to") == 0) {
        *node = CUBE_HOST;
        return 0;
    }
    if (end == NULL ||
        !host_cube_is_number(end, 0, (int)file->nodes - 1, &number)) {
        char message[120];
        snprintf(message, sizeof message,
                 "%s: not a node of this cube; give 0 to %u%s", name,
                 file->nodes - 1,
                 strcmp(name, "to") == 0 ? ", or \"host\"" : "");
        return host_cube_wrong(file, end == NULL ? group : end, error, message);
    }
    *node = (uint16_t)number;
    return 0;
}

/* A setting that does nothing beside a wire of that kind was meant for another.
 */
static int check_beside(const struct host_cube_file *file,
                        const config_setting_t *group, const char *kind,
                        struct host_error *error) {
    static const char *const of[][2] = {
        {"via", "tcp"},       {"insecure", "tcp"}, {"baud", "serial"},
        {"rtscts", "serial"}, {"dtr", "serial"},   {"rts", "serial"}};
    for (size_t i = 0; i < sizeof of / sizeof of[0]; i++) {
        const config_setting_t *setting =
            config_setting_get_member(group, of[i][0]);
        if (setting != NULL && strcmp(of[i][1], kind) != 0) {
            char text[120];
            snprintf(text, sizeof text,
                     "%s: does nothing beside %s; leave it out, it is for "
                     "links with %s",
                     of[i][0], kind, of[i][1]);
            return host_cube_wrong(file, setting, error, text);
        }
    }
    return 0;
}

int host_cube_read_wire(struct host_cube_file *file, config_setting_t *group,
                        struct host_error *error) {
    static const char *const names[] = {"node", "to",     "tcp",      "via",
                                        "unix", "serial", "baud",     "rtscts",
                                        "dtr",  "rts",    "insecure", NULL};
    struct host_cube_wire *wire = &file->wire[file->wires];
    memset(wire, 0, sizeof *wire);
    wire->line = config_setting_source_line(group);
    if (host_cube_check_names(file, group, names, error) != 0 ||
        read_end(file, group, "node", &wire->node, error) != 0 ||
        read_end(file, group, "to", &wire->to, error) != 0)
        return error->code;
    if (wire->to != CUBE_HOST &&
        __builtin_popcount(wire->node ^ wire->to) != 1) {
        return host_cube_wrong(
            file, group, error,
            "no neighbours in a cube; their numbers must differ in "
            "one binary digit");
    }
    bool tcp = config_setting_get_member(group, "tcp") != NULL;
    bool local = config_setting_get_member(group, "unix") != NULL;
    bool serial = config_setting_get_member(group, "serial") != NULL;
    if (tcp + local + serial != 1) {
        return host_cube_wrong(
            file, group, error,
            "none or several of tcp, unix and serial; give one of them");
    }
    if (check_beside(file, group,
                     serial  ? "serial"
                     : local ? "unix"
                             : "tcp",
                     error) != 0)
        return error->code;
    int status = serial  ? read_line(file, group, wire, error)
                 : local ? read_path(file, group, wire, error)
                         : read_net(file, group, wire, error);
    if (serial && (file->serial_baud == 0 || wire->baud < file->serial_baud))
        file->serial_baud = wire->baud;
    file->wires++;
    return status;
}

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

/* The host's machine has the ports of all nodes that it starts. */
static unsigned owner(const struct host_cube_file *file, unsigned node) {
    return node == CUBE_HOST || file->local[node] ? CUBE_HOST : node;
}

/* --- all of them ---------------------------------------------------------- */

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

int host_cube_check_ends(const struct host_cube_file *file,
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

int host_cube_check_wires(const struct host_cube_file *file,
                          const config_setting_t *list,
                          struct host_error *error) {
    const struct host_cube_wire *first = host_cube_host_wire(file, 0);
    const struct host_cube_wire *second = host_cube_host_wire(file, 1);
    char text[120];
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
                snprintf(text, sizeof text,
                         "no link between nodes %u and %u; add { node = %u; "
                         "to = %u; .. }",
                         i, other, i, other);
                return host_cube_wrong(file, list, error, text);
            }
        }
    }
    if (first == NULL || first->node != 0) {
        return host_cube_wrong(
            file, list, error,
            "the host's first link must be that of node 0; begin "
            "with { node = 0; to = \"host\"; .. }");
    }
    if (second != NULL &&
        (second->node == 0 || host_cube_host_wire(file, 2) != NULL)) {
        return host_cube_wrong(
            file, list, error,
            "a second link of the host must be another node's, and "
            "there is no third; leave it out");
    }
    return 0;
}

/* The lines that reset boards and have them wait in their loader. */

static const char *const kinds[HOST_LINES] = {
    [HOST_LINE_RESET] = "reset", [HOST_LINE_BOOT] = "boot"};

const char *host_line_name(enum host_line_kind kind) {
    return kinds[kind];
}

const struct host_cube_pin *host_cube_pin(const struct host_cube_file *file,
                                          unsigned node,
                                          enum host_line_kind kind) {
    for (unsigned i = 0; i < file->pins; i++)
        if (file->pin[i].node == node && file->pin[i].kind == kind)
            return &file->pin[i];
    return NULL;
}

int host_cube_make_pins(struct host_cube_file *file, unsigned entries,
                        struct host_error *error) {
    /* Beside them, DTR and RTS of the host's two wires: no more are read, as
     * each is a node's that has none. */
    size_t most = (size_t)HOST_LINES * entries + 4;
    file->pin = calloc(most, sizeof *file->pin);
    return file->pin == NULL ? host_fail_memory(error, "the cube file") : 0;
}

/* "reset: WHAT" */
static int wrong(const struct host_cube_file *file,
                 const config_setting_t *where, const char *name,
                 const char *what, struct host_error *error) {
    char text[200];
    snprintf(text, sizeof text, "%s: %s", name, what);
    return host_cube_wrong(file, where, error, text);
}

static bool is_same(const struct host_cube_pin *a,
                    const struct host_cube_pin *b) {
    return a->wire == b->wire &&
           (a->wire >= 0
                ? a->rts == b->rts
                : strcmp(a->chip, b->chip) == 0 &&
                      strcmp(a->name, b->name) == 0 && a->offset == b->offset);
}

/* Adds it, if it is the only one to do that, and does only that. */
static int add(struct host_cube_file *file, const config_setting_t *where,
               const struct host_cube_pin *pin, struct host_error *error) {
    const char *name = kinds[pin->kind];
    char text[160];
    for (unsigned i = 0; i < file->pins; i++) {
        const struct host_cube_pin *other = &file->pin[i];
        bool again = other->node == pin->node && other->kind == pin->kind;
        if (again || is_same(other, pin)) {
            snprintf(text, sizeof text,
                     again ? "node %u has one in line %u; leave one of them out"
                           : "node %u has that line as well, by line %u of "
                             "this file; give each its own",
                     other->node, other->line);
            return wrong(file, where, name, text, error);
        }
    }
    file->pin[file->pins] = *pin;
    file->pin[file->pins++].line = config_setting_source_line(where);
    return 0;
}

/* --- of a GPIO chip ------------------------------------------------------- */

/* A name that fits, and is one. */
static bool take_name(const config_setting_t *setting,
                      char name[HOST_PIN_NAME_MAX]) {
    const char *text =
        setting == NULL ? NULL : config_setting_get_string(setting);
    if (text == NULL || *text == '\0' || strlen(text) >= HOST_PIN_NAME_MAX)
        return false;
    memcpy(name, text, strlen(text) + 1);
    return true;
}

/* Its name, or its number on the chip. */
static bool take_line(const config_setting_t *setting,
                      struct host_cube_pin *pin) {
    int offset = 0;
    if (take_name(setting, pin->name))
        return true;
    bool good =
        setting != NULL && host_cube_is_number(setting, 0, 65535, &offset);
    pin->offset = (unsigned)offset;
    return good;
}

/* What may be left out: false. */
static bool take_bool(const config_setting_t *group, const char *name,
                      bool *value) {
    const config_setting_t *setting = config_setting_get_member(group, name);
    *value = setting != NULL && config_setting_get_bool(setting) != 0;
    return setting == NULL || config_setting_type(setting) == CONFIG_TYPE_BOOL;
}

static int read_chip_line(struct host_cube_file *file,
                          const config_setting_t *group, unsigned node,
                          enum host_line_kind kind, struct host_error *error) {
    static const char *const names[] = {"chip", "line", "active_low",
                                        "open_drain", NULL};
    struct host_cube_pin pin = {
        .node = (uint16_t)node, .kind = kind, .wire = -1};
    const char *what = NULL;
    if (!config_setting_is_group(group)) {
        return wrong(file, group, kinds[kind],
                     "no group in braces; write { chip = \"gpiochip0\"; line = "
                     "17; active_low = true; }",
                     error);
    }
    if (host_cube_check_names(file, group, names, error) != 0)
        return error->code;
    if (!take_name(config_setting_get_member(group, "chip"), pin.chip)) {
        what = "chip: not given, or no name of 1 to 63 bytes; write chip = "
               "\"gpiochip0\"; or its label, as gpioinfo shows it";
    } else if (!take_line(config_setting_get_member(group, "line"), &pin)) {
        what = "line: not given, or neither a number nor a name; write line = "
               "17; or its name in quotes, as gpioinfo shows it";
    } else if (!take_bool(group, "active_low", &pin.active_low)) {
        what = "active_low: neither true nor false; give one of them";
    } else if (!take_bool(group, "open_drain", &pin.open_drain)) {
        what = "open_drain: neither true nor false; give one of them";
    } else if (pin.open_drain && !pin.active_low) {
        what = "open_drain: such a line can only pull low; add active_low = "
               "true; or leave it out";
    }
    return what == NULL ? add(file, group, &pin, error)
                        : wrong(file, group, kinds[kind], what, error);
}

int host_cube_read_pins(struct host_cube_file *file,
                        const config_setting_t *group, unsigned node,
                        struct host_error *error) {
    for (int k = 0; k < HOST_LINES && error->code == 0; k++) {
        const config_setting_t *line =
            config_setting_get_member(group, kinds[k]);
        if (line != NULL) {
            (void)read_chip_line(file, line, node, (enum host_line_kind)k,
                                 error);
        }
    }
    return error->code;
}

/* --- of the host's port --------------------------------------------------- */

static int read_modem_line(struct host_cube_file *file,
                           const config_setting_t *setting,
                           const struct host_cube_wire *wire, bool rts,
                           struct host_error *error) {
    struct host_cube_pin pin = {.node = wire->node, .rts = rts};
    const char *text = config_setting_get_string(setting), *what = NULL;
    for (unsigned i = 0; i < file->wires; i++)
        pin.wire += file->wire[i].to == CUBE_HOST ? 1 : 0;
    if (text != NULL && strcmp(text, kinds[HOST_LINE_BOOT]) == 0)
        pin.kind = HOST_LINE_BOOT;
    else if (text == NULL || strcmp(text, kinds[HOST_LINE_RESET]) != 0)
        what = "does neither; give \"reset\" or \"boot\"";
    if (wire->to != CUBE_HOST || pin.wire > 1) {
        what = "not at a wire of the host, which sets its own ports alone; "
               "leave it out";
    } else if (rts && wire->rts_cts) {
        what = "holds the other end back where rtscts = true; leave one of "
               "them out";
    }
    return what == NULL
               ? add(file, setting, &pin, error)
               : wrong(file, setting, rts ? "rts" : "dtr", what, error);
}

/* Adds what DTR and RTS of a wire's port do, and sets what they are beside. */
static int host_cube_read_modem(struct host_cube_file *file,
                                const config_setting_t *group,
                                struct host_cube_wire *wire,
                                struct host_error *error) {
    const config_setting_t *dtr = config_setting_get_member(group, "dtr");
    const config_setting_t *rts = config_setting_get_member(group, "rts");
    wire->dtr_low = dtr != NULL;
    wire->rts_low = rts != NULL;
    if (dtr != NULL && read_modem_line(file, dtr, wire, false, error) != 0)
        return error->code;
    return rts == NULL ? 0 : read_modem_line(file, rts, wire, true, error);
}
