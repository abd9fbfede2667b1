/* The settings of a cube file: a table for each kind of group. */
#include <errno.h>
#include <libconfig.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cube_file.h"
#include "host/base/progress.h"
#include "host/base/text.h"
#include "port.h"
#include "transport/cube.h"
#include "transport/drivers/secure_sodium.h"

enum kind {
    NUMBER, /* from lo to hi */
    NODE,   /* of this cube */
    END,    /* NODE or "host" */
    TRUTH,
    TEXT, /* of lo to hi bytes */
    LIST, /* of groups */
    OTHER /* its reader looks what it is */
};

/* What a setting may be.  A group's settings are a table. */
struct field {
    const char *name;
    enum kind kind;
    int lo, hi, usual; /* usual: a number that is left out */
    bool needed;
    const char *beside;             /* without that setting it does nothing */
    bool (*good)(const char *text); /* NULL: any text is */
    const char *what;               /* is wrong, and what to write */
};

struct value {
    const config_setting_t *at; /* NULL: left out */
    int number;
    const char *text; /* NULL: it is none */
};

struct reader {
    struct host_cube_file *file;
    struct host_error *error;
    const char *in; /* the setting that has the group; NULL: not told */
};

/* HOST_INPUT: "FILE:LINE: IN: NAME: WHAT"; where: NULL is the first line. */
static int wrong(const struct reader *r, const config_setting_t *where,
                 const char *name, const char *what, ...) {
    char text[HOST_NODE_OPTION_BYTES + 300];
    unsigned line = where == NULL ? 0 : config_setting_source_line(where);
    va_list arguments;
    va_start(arguments, what);
    vsnprintf(text, sizeof text, what, arguments);
    va_end(arguments);
    return host_fail(r->error, HOST_INPUT, "%s:%u: %s%s%s: %s", r->file->path,
                     line == 0 ? 1 : line, r->in == NULL ? "" : r->in,
                     r->in == NULL ? "" : ": ", name, text);
}

/* Whether it is a whole number from lo to hi.  What libconfig reads of a
 * setting of another type, or of one beyond an int, is 0. */
static bool is_number(const config_setting_t *setting, int lo, int hi,
                      int *value) {
    long long n = config_setting_get_int64(setting);
    int type = config_setting_type(setting);
    if ((type != CONFIG_TYPE_INT && type != CONFIG_TYPE_INT64) || n < lo ||
        n > hi)
        return false;
    *value = (int)n;
    return true;
}

static bool is_list(const config_setting_t *setting) {
    bool good = config_setting_is_list(setting);
    for (int i = 0; good && i < config_setting_length(setting); i++)
        good = config_setting_is_group(
            config_setting_get_elem(setting, (unsigned)i));
    return good;
}

static bool is_as_said(const struct reader *r, const struct field *field,
                       struct value *v) {
    size_t bytes = v->text == NULL ? 0 : strlen(v->text);
    switch (field->kind) {
    case NUMBER:
        return is_number(v->at, field->lo, field->hi, &v->number);
    case END:
        if (v->text != NULL && strcmp(v->text, "host") == 0) {
            v->number = CUBE_HOST;
            return true;
        }
        return is_number(v->at, 0, (int)r->file->nodes - 1, &v->number);
    case NODE:
        return is_number(v->at, 0, (int)r->file->nodes - 1, &v->number);
    case TRUTH:
        v->number = config_setting_get_bool(v->at);
        return config_setting_type(v->at) == CONFIG_TYPE_BOOL;
    case TEXT:
        return v->text != NULL && bytes >= (size_t)field->lo &&
               bytes <= (size_t)field->hi &&
               (field->good == NULL || field->good(v->text));
    case LIST:
        return is_list(v->at);
    case OTHER:
        break;
    }
    return true;
}

static int say_wrong(const struct reader *r, const config_setting_t *where,
                     const struct field *field) {
    if (field->kind == TRUTH) {
        return wrong(r, where, field->name,
                     "neither true nor false; give one of them");
    }
    if (field->kind == NODE || field->kind == END) {
        return wrong(
            r, where, field->name, "not a node of this cube; give 0 to %u%s",
            r->file->nodes - 1, field->kind == END ? ", or \"host\"" : "");
    }
    return wrong(r, where, field->name, "%s", field->what);
}

/* A setting without effect was meant for another group. */
static int check_beside(const struct reader *r, const config_setting_t *group,
                        const struct field *field, const struct value *v) {
    static const char *const kinds[] = {"serial", "unix", "tcp"};
    const char *kind = NULL;
    if (v->at == NULL || field->beside == NULL ||
        config_setting_get_member(group, field->beside) != NULL)
        return 0;
    for (int i = 0; i < 3 && kind == NULL; i++)
        if (config_setting_get_member(group, kinds[i]) != NULL)
            kind = kinds[i];
    return wrong(r, v->at, field->name,
                 "does nothing %s %s; leave it out, it is for those with %s",
                 kind == NULL ? "without" : "beside",
                 kind == NULL ? field->beside : kind, field->beside);
}

/* The settings of a group, in the order of its table.  A name that the table
 * has not is a mistake in writing. */
static int take_group(const struct reader *r, const config_setting_t *group,
                      const struct field fields[], unsigned count,
                      struct value v[]) {
    for (unsigned k = 0; k < count; k++)
        v[k] = (struct value){.number = fields[k].usual};
    for (int i = 0; i < config_setting_length(group); i++) {
        const config_setting_t *member =
            config_setting_get_elem(group, (unsigned)i);
        const char *name = config_setting_name(member);
        unsigned k = 0;
        while (k < count && strcmp(fields[k].name, name) != 0)
            k++;
        if (k == count) {
            char start[61];
            snprintf(start, sizeof start, "%s", name);
            return wrong(r, member, start,
                         "no such setting here; see host/nodes/README.md for "
                         "those that there are");
        }
        v[k].at = member;
        v[k].text = config_setting_get_string(member);
    }
    for (unsigned k = 0; k < count; k++) {
        const struct field *field = &fields[k];
        if (check_beside(r, group, field, &v[k]) != 0)
            return r->error->code;
        if (v[k].at == NULL ? field->needed : !is_as_said(r, field, &v[k]))
            return say_wrong(r, v[k].at == NULL ? group : v[k].at, field);
    }
    return 0;
}

/* A file's name as it is to be opened, beside the cube file unless it begins
 * with a slash: 0, or -1 where it is none, or does not fit. */
static int beside(const struct host_cube_file *file, const char *name,
                  char *path, size_t size) {
    const char *slash = strrchr(file->path, '/');
    if (name == NULL || name[0] == '\0')
        return -1;
    int folder =
        name[0] == '/' || slash == NULL ? 0 : (int)(slash - file->path) + 1;
    int length = snprintf(path, size, "%.*s%s", folder, file->path, name);
    return length < (int)size ? 0 : -1;
}

static unsigned line_of(const struct value *v) {
    return v->at == NULL ? 1 : config_setting_source_line(v->at);
}

/* --- lines to boards ------------------------------------------------------ */

static const char *const line_names[HOST_LINES] = {
    [HOST_LINE_RESET] = "reset", [HOST_LINE_BOOT] = "boot"};

const char *host_line_name(enum host_line_kind kind) {
    return line_names[kind];
}

static bool is_line_name(const char *text) {
    return strcmp(text, line_names[HOST_LINE_RESET]) == 0 ||
           strcmp(text, line_names[HOST_LINE_BOOT]) == 0;
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
static int add_pin(const struct reader *r, const config_setting_t *where,
                   const struct host_cube_pin *pin) {
    struct host_cube_file *file = r->file;
    for (unsigned i = 0; i < file->pins; i++) {
        const struct host_cube_pin *other = &file->pin[i];
        bool again = other->node == pin->node && other->kind == pin->kind;
        if (again || is_same(other, pin)) {
            return wrong(
                r, where, line_names[pin->kind],
                again ? "node %u has one in line %u; leave one of them out"
                      : "node %u has that line as well, by line %u of this "
                        "file; give each its own",
                other->node, other->line);
        }
    }
    file->pin[file->pins] = *pin;
    file->pin[file->pins++].line = config_setting_source_line(where);
    return 0;
}

#define LINE_WHAT                                                              \
    "not given, or neither a number nor a name; write line = 17; or its name " \
    "in quotes, as gpioinfo shows it"

/* The line of a GPIO chip that an entry of `nodes` names. */
static int read_pin(const struct reader *r, const config_setting_t *group,
                    unsigned node, enum host_line_kind kind) {
    enum { CHIP, LINE, ACTIVE_LOW, OPEN_DRAIN, FIELDS };
    static const struct field fields[FIELDS] = {
        {"chip", TEXT, 1, HOST_PIN_NAME_MAX - 1, .needed = true,
         .what = "not given, or no name of 1 to 63 bytes; write chip = "
                 "\"gpiochip0\"; or its label, as gpioinfo shows it"},
        {"line", OTHER, .needed = true, .what = LINE_WHAT},
        {.name = "active_low", .kind = TRUTH},
        {.name = "open_drain", .kind = TRUTH}};
    struct host_cube_pin pin = {
        .node = (uint16_t)node, .kind = kind, .wire = -1};
    const struct reader in = {r->file, r->error, line_names[kind]};
    struct value v[FIELDS];
    int offset = 0;
    if (!config_setting_is_group(group)) {
        return wrong(r, group, line_names[kind],
                     "no group in braces; write { chip = \"gpiochip0\"; line = "
                     "17; active_low = true; }");
    }
    if (take_group(&in, group, fields, FIELDS, v) != 0)
        return r->error->code;
    const char *name = v[LINE].text;
    bool named =
        name != NULL && *name != '\0' && strlen(name) < sizeof pin.name;
    if (!named && !is_number(v[LINE].at, 0, 65535, &offset))
        return say_wrong(&in, v[LINE].at, &fields[LINE]);
    pin.offset = (unsigned)offset;
    strcpy(pin.chip, v[CHIP].text);
    strcpy(pin.name, named ? name : "");
    pin.active_low = v[ACTIVE_LOW].number != 0;
    pin.open_drain = v[OPEN_DRAIN].number != 0;
    if (pin.open_drain && !pin.active_low) {
        return wrong(&in, v[OPEN_DRAIN].at, fields[OPEN_DRAIN].name,
                     "such a line can only pull low; add active_low = true; or "
                     "leave it out");
    }
    return add_pin(r, group, &pin);
}

/* What DTR or RTS of the host's own port does. */
static int read_modem_line(const struct reader *r, const struct value *v,
                           const struct host_cube_wire *wire, bool rts) {
    const char *name = rts ? "rts" : "dtr";
    struct host_cube_pin pin = {.node = wire->node, .rts = rts};
    if (v->at == NULL)
        return 0;
    for (unsigned i = 0; i < r->file->wires; i++)
        pin.wire += r->file->wire[i].to == CUBE_HOST ? 1 : 0;
    if (wire->to != CUBE_HOST || pin.wire > 1) {
        return wrong(r, v->at, name,
                     "not at a wire of the host, which sets its own ports "
                     "alone; leave it out");
    }
    if (rts && wire->rts_cts) {
        return wrong(r, v->at, name,
                     "holds the other end back where rtscts = true; leave one "
                     "of them out");
    }
    pin.kind = strcmp(v->text, line_names[HOST_LINE_BOOT]) == 0
                   ? HOST_LINE_BOOT
                   : HOST_LINE_RESET;
    return add_pin(r, v->at, &pin);
}

/* --- links ---------------------------------------------------------------- */

enum {
    LINK_NODE,
    LINK_TO,
    LINK_TCP,
    LINK_VIA,
    LINK_INSECURE,
    LINK_UNIX,
    LINK_SERIAL,
    LINK_BAUD,
    LINK_RTSCTS,
    LINK_DTR,
    LINK_RTS,
    LINK_FIELDS
};

#define LINE_DOES .what = "does neither; give \"reset\" or \"boot\""

static const struct field link_fields[LINK_FIELDS] = {
    [LINK_NODE] = {"node", NODE, .needed = true},
    [LINK_TO] = {"to", END, .needed = true},
    [LINK_TCP] = {.name = "tcp", .kind = OTHER},
    [LINK_VIA] = {"via", OTHER, .beside = "tcp"},
    [LINK_INSECURE] = {"insecure", TRUTH, .beside = "tcp"},
    [LINK_UNIX] = {"unix", TEXT, 1, TCP_PATH_MAX,
                   .what = "not a path of 1 to 107 bytes, that of this file's "
                           "folder included; write \"/run/cube/01\""},
    [LINK_SERIAL] = {"serial", OTHER,
                     .what = "not two devices; write [\"/dev/ttyS1\", "
                             "\"/dev/ttyUSB0\"], the first at `node`"},
    [LINK_BAUD] = {"baud", NUMBER, 300, 20000000, 115200, .beside = "serial",
                   .what = "not a rate of a serial wire; give 300 to "
                           "20000000"},
    [LINK_RTSCTS] = {"rtscts", TRUTH, .beside = "serial"},
    [LINK_DTR] = {"dtr", TEXT, 1, 5, .beside = "serial", .good = is_line_name,
                  LINE_DOES},
    [LINK_RTS] = {"rts", TEXT, 1, 5, .beside = "serial", .good = is_line_name,
                  LINE_DOES},
};

static int read_serial(const struct reader *r, const struct value v[],
                       struct host_cube_wire *wire) {
    const config_setting_t *pair = v[LINK_SERIAL].at;
    for (int end = 0; end < 2; end++) {
        const char *name = config_setting_get_string_elem(pair, end);
        if (name == NULL || strlen(name) >= SERIAL_NAME_MAX ||
            config_setting_length(pair) != 2)
            return say_wrong(r, pair, &link_fields[LINK_SERIAL]);
        strcpy(wire->device[end], name);
    }
    wire->serial = true;
    wire->baud = (uint32_t)v[LINK_BAUD].number;
    wire->rts_cts = v[LINK_RTSCTS].number != 0;
    wire->dtr_low = v[LINK_DTR].at != NULL;
    wire->rts_low = v[LINK_RTS].at != NULL;
    if (r->file->serial_baud == 0 || wire->baud < r->file->serial_baud)
        r->file->serial_baud = wire->baud;
    return read_modem_line(r, &v[LINK_DTR], wire, false) != 0
               ? r->error->code
               : read_modem_line(r, &v[LINK_RTS], wire, true);
}

/* "HOST:PORT", "[ADDRESS]:PORT": looked up once, before the run. */
static int resolve(const struct reader *r, const struct value *v,
                   struct tcp_address *address) {
    char why[400];
    int code =
        host_resolve(v->text == NULL ? "" : v->text, address, why, sizeof why);
    return code == 0 ? 0
                     : host_fail(r->error, code, "%s:%u: %s", r->file->path,
                                 line_of(v), why);
}

/* A wire over TCP is guarded by the cube's key, unless the user says that it
 * is not. */
static int read_tcp(const struct reader *r, const struct value v[],
                    struct host_cube_wire *wire) {
    if (resolve(r, &v[LINK_TCP], &wire->at) != 0)
        return r->error->code;
    wire->via = wire->at;
    if (v[LINK_VIA].at != NULL && resolve(r, &v[LINK_VIA], &wire->via) != 0)
        return r->error->code;
    wire->insecure = v[LINK_INSECURE].number != 0;
    return r->file->has_key || wire->insecure
               ? 0
               : wrong(r, v[LINK_TCP].at, "tcp",
                       "without a key; make one with: incode key FILE, and add "
                       "key = \"FILE\"; at the top (or unix = \"PATH\"; on one "
                       "machine, or insecure = true; here)");
}

static int read_unix(const struct reader *r, const struct value v[],
                     struct host_cube_wire *wire) {
    char path[TCP_PATH_MAX + 1];
    if (beside(r->file, v[LINK_UNIX].text, path, sizeof path) != 0 ||
        tcp_address_set_path(&wire->at, path) != 0)
        return say_wrong(r, v[LINK_UNIX].at, &link_fields[LINK_UNIX]);
    wire->via = wire->at;
    return 0;
}

static int read_link(const struct reader *r, const config_setting_t *group) {
    struct host_cube_file *file = r->file;
    struct host_cube_wire *wire = &file->wire[file->wires];
    unsigned line = config_setting_source_line(group);
    struct value v[LINK_FIELDS];
    if (take_group(r, group, link_fields, LINK_FIELDS, v) != 0)
        return r->error->code;
    *wire = (struct host_cube_wire){.node = (uint16_t)v[LINK_NODE].number,
                                    .to = (uint16_t)v[LINK_TO].number,
                                    .line = line};
    if (wire->to != CUBE_HOST &&
        __builtin_popcount(wire->node ^ wire->to) != 1) {
        return host_fail(r->error, HOST_INPUT,
                         "%s:%u: no neighbours in a cube; their numbers must "
                         "differ in one binary digit",
                         file->path, line);
    }
    bool tcp = v[LINK_TCP].at != NULL, serial = v[LINK_SERIAL].at != NULL;
    if (tcp + serial + (v[LINK_UNIX].at != NULL) != 1) {
        return host_fail(r->error, HOST_INPUT,
                         "%s:%u: none or several of tcp, unix and serial; give "
                         "one of them",
                         file->path, line);
    }
    int status = serial ? read_serial(r, v, wire)
                 : tcp  ? read_tcp(r, v, wire)
                        : read_unix(r, v, wire);
    file->wires++;
    return status;
}

static int read_links(const struct reader *r, const struct value *v) {
    struct host_cube_file *file = r->file;
    unsigned count = (unsigned)config_setting_length(v->at);
    file->links_line = line_of(v);
    if (count > file->nodes * (file->dimension + 2) + 8) {
        return wrong(r, v->at, "links",
                     "many more than the cube has; name each once");
    }
    file->wire = calloc(count + 1, sizeof *file->wire);
    if (file->wire == NULL)
        return host_fail_memory(r->error, "the cube file");
    for (unsigned i = 0; i < count && r->error->code == 0; i++)
        (void)read_link(r, config_setting_get_elem(v->at, i));
    return r->error->code;
}

/* --- nodes ---------------------------------------------------------------- */

static const struct host_board *take_board(const struct reader *r,
                                           const struct value *v) {
    const struct host_board *board =
        v->text == NULL ? NULL : host_board_named(v->text);
    char names[160] = "";
    for (unsigned i = 0; board == NULL && host_board_name(i) != NULL; i++) {
        size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s\"%s\"",
                 i == 0 ? "" : " or ", host_board_name(i));
    }
    if (board == NULL)
        wrong(r, v->at, "board", "not one that there is; give %s", names);
    return board;
}

/* A word that no shell, and no option of ssh, takes for anything else. */
static bool is_destination(const char *text) {
    bool good = text[0] != '\0' && text[0] != '-';
    for (const char *at = text; *at != '\0'; at++) {
        good =
            good && *at > ' ' && *at < 0x7f && strchr("'\"\\`$", *at) == NULL;
    }
    return good;
}

/* A line feed would end a line of a unit of systemd. */
static bool is_folder(const char *text) {
    bool good = text[0] != '\0';
    for (const char *at = text; *at != '\0'; at++)
        good = good && (uint8_t)*at >= ' ' && *at != 0x7f;
    return good;
}

static int add_ssh(const struct reader *r, unsigned node, const char *to,
                   const char *folder, unsigned line) {
    struct host_cube_file *file = r->file;
    if (to == NULL)
        return 0;
    if (file->ssh == NULL)
        file->ssh = calloc(file->nodes, sizeof *file->ssh);
    if (file->ssh == NULL)
        return host_fail_memory(r->error, "the cube file");
    strcpy(file->ssh[node].to, to);
    strcpy(file->ssh[node].folder, folder == NULL ? "" : folder);
    file->ssh[node].line = line;
    return 0;
}

/* An entry of `nodes`. */
static int read_node(const struct reader *r, const config_setting_t *group,
                     bool named[HOST_NODES_MAX]) {
    enum { NUMBER_OF, BOARD, SSH, FOLDER, RESET, BOOT, FIELDS };
    static const struct field fields[FIELDS] = {
        {"node", NODE, .needed = true},
        {.name = "board", .kind = OTHER},
        {"ssh", TEXT, 1, HOST_SSH_MAX - 1, .good = is_destination,
         .what = "not who and where; write \"pi@10.0.0.11\" or "
                 "\"ssh://pi@10.0.0.11:2222\""},
        {"folder", TEXT, 1, HOST_SSH_MAX - 1, .good = is_folder,
         .beside = "ssh",
         .what = "not a folder of the board; write \"/opt/incode\", or leave "
                 "it out"},
        {.name = "reset", .kind = OTHER},
        {.name = "boot", .kind = OTHER}};
    struct value v[FIELDS];
    if (take_group(r, group, fields, FIELDS, v) != 0)
        return r->error->code;
    unsigned node = (unsigned)v[NUMBER_OF].number;
    if (config_setting_length(group) < 2) {
        return wrong(r, group, "nodes",
                     "an entry with nothing of its node; write { node = 1; "
                     "board = \"mps2-an500\"; }");
    }
    if (named[node])
        return wrong(r, group, "nodes", "a node twice; name each once");
    named[node] = true;
    if (v[BOARD].at != NULL)
        r->file->board_of[node] = take_board(r, &v[BOARD]);
    if (r->error->code == 0)
        add_ssh(r, node, v[SSH].text, v[FOLDER].text,
                config_setting_source_line(group));
    for (int k = 0; k < HOST_LINES && r->error->code == 0; k++) {
        const struct value *line = &v[k == HOST_LINE_RESET ? RESET : BOOT];
        if (line->at != NULL)
            (void)read_pin(r, line->at, node, (enum host_line_kind)k);
    }
    return r->error->code;
}

/* One board for all, or by name for some. */
static int read_nodes(const struct reader *r, const struct value *all,
                      const struct value *list) {
    static bool named[HOST_NODES_MAX];
    struct host_cube_file *file = r->file;
    int entries = list->at == NULL ? 0 : config_setting_length(list->at);
    memset(named, 0, sizeof named);
    file->board = all->at == NULL ? host_board_row(0) : take_board(r, all);
    for (unsigned i = 0; i < file->nodes; i++)
        file->board_of[i] = file->board;
    /* Beside them, DTR and RTS of the host's two wires: no more are read, as
     * each is a node's that has none. */
    file->pin =
        calloc((size_t)HOST_LINES * (unsigned)entries + 4, sizeof *file->pin);
    if (file->pin == NULL)
        return host_fail_memory(r->error, "the cube file");
    for (int i = 0; r->error->code == 0 && i < entries; i++)
        (void)read_node(r, config_setting_get_elem(list->at, (unsigned)i),
                        named);
    for (unsigned i = 0; i < file->nodes; i++)
        if (file->board_of[i] != file->board_of[0])
            file->board = &host_board_mixed;
        else if (i == 0)
            file->board = file->board_of[0];
    return r->error->code;
}

/* --- the whole ------------------------------------------------------------ */

static int read_key(const struct reader *r, const struct value *v) {
    struct host_cube_file *file = r->file;
    if (v->at == NULL)
        return 0;
    if (v->text == NULL)
        return wrong(r, v->at, "key", "not a file's name; write it in quotes");
    if (beside(file, v->text, file->key_path, sizeof file->key_path) != 0) {
        return wrong(r, v->at, "key",
                     "none, or too long a path; make one with: incode key "
                     "FILE");
    }
    enum key_file_state state = key_file_read(file->key_path, file->key);
    const char *reason = state == KEY_FILE_UNREADABLE ? strerror(errno) : "";
    struct key_file_text fault = key_file_text(state);
    file->has_key = state == KEY_FILE_GOOD || state == KEY_FILE_SEEN;
    if (fault.what == NULL)
        return 0;
    if (file->has_key) {
        host_note("%s:%u: key: %s: %s; %s", file->path, line_of(v),
                  file->key_path, fault.what, fault.next);
        return 0;
    }
    return wrong(r, v->at, "key", "%s: %s%s%s; %s", file->key_path, fault.what,
                 *reason == '\0' ? "" : ": ", reason, fault.next);
}

/* The nodes that the host starts. */
static int read_start(const struct reader *r, const struct value *v) {
    bool good = v->at == NULL || config_setting_is_array(v->at) ||
                config_setting_is_list(v->at);
    int count = v->at == NULL || !good ? 0 : config_setting_length(v->at);
    r->file->start_line = line_of(v);
    for (int i = 0; good && i < count; i++) {
        int node = 0;
        good = is_number(config_setting_get_elem(v->at, (unsigned)i), 0,
                         (int)r->file->nodes - 1, &node);
        if (good && r->file->local[node])
            return wrong(r, v->at, "start", "a node twice; name each once");
        r->file->local[node] |= good;
    }
    return good ? 0
                : wrong(r, v->at, "start",
                        "not numbers of nodes; write [0, 1, 2]");
}

static int read_memory(const struct reader *r, const struct value *v) {
    uint64_t *memory = &r->file->memory;
    const char *text = v->at == NULL ? "4M" : v->text;
    r->file->memory_line = line_of(v);
    return text != NULL && host_parse_bytes(text, memory) == 0 &&
                   *memory >= 256 * 1024 && *memory <= UINT64_C(1) << 30
               ? 0
               : wrong(r, v->at, "memory",
                       "not a size; write \"4M\", from 640K to 1G, or less to "
                       "a small cube");
}

int host_cube_read_settings(struct host_cube_file *file,
                            const struct config_t *config,
                            struct host_error *error) {
    enum {
        DIMENSION,
        MEMORY,
        BOARD,
        NODES,
        START,
        KEY,
        WINDOW,
        DEAD,
        LINKS,
        FIELDS
    };
    static const struct field fields[FIELDS] = {
        {"dimension", NUMBER, 0, CUBE_DIMENSION_MAX, .needed = true,
         .what = "not given or not 0 to 10; a cube of 8 nodes has dimension = "
                 "3;"},
        {.name = "memory", .kind = OTHER},
        {.name = "board", .kind = OTHER},
        {"nodes", LIST,
         .what = "not a list of groups in braces; write nodes = ( { node = 1; "
                 "board = \"mps2-an500\"; }, .. );"},
        {.name = "start", .kind = OTHER},
        {.name = "key", .kind = OTHER},
        {"window", NUMBER, 1, LINK_WINDOW_MAX,
         .what = "not a number of frames; give 1 to 64"},
        {"dead", NUMBER, 0, 3600, 30,
         .what = "not seconds of silence; give 0 (never) to 3600"},
        {"links", LIST, .needed = true,
         .what = "not a list of groups in braces; write links = ( { node = 0; "
                 "to = \"host\"; .. }, .. );"}};
    const struct reader *r = &(struct reader){file, error, NULL};
    struct value v[FIELDS];
    if (take_group(r, config_root_setting(config), fields, FIELDS, v) != 0)
        return r->error->code;
    file->dimension = (unsigned)v[DIMENSION].number;
    file->dimension_line = line_of(&v[DIMENSION]);
    file->nodes = 1u << file->dimension;
    file->window = (unsigned)v[WINDOW].number;
    file->dead_s = (unsigned)v[DEAD].number;
    return read_memory(r, &v[MEMORY]) != 0 ||
                   read_nodes(r, &v[BOARD], &v[NODES]) != 0 ||
                   read_start(r, &v[START]) != 0 || read_key(r, &v[KEY]) != 0 ||
                   read_links(r, &v[LINKS]) != 0
               ? error->code
               : 0;
}
