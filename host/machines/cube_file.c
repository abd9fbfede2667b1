#include "cube_file.h"

#include <errno.h>
#include <libconfig.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/parse.h"
#include "transport/cube.h"
#include "transport/drivers/key_file.h"

enum { TEXT_MAX = 4 << 20 };

/* --- values -------------------------------------------------------------- */

static int wrong(const struct host_cube_file *file,
                 const config_setting_t *where, struct host_error *error,
                 const char *what)
{
    return host_fail(error, HOST_INPUT, "%s:%u: %s", file->path,
                     where == NULL ? 1 : config_setting_source_line(where),
                     what);
}

/* A member that must be known: others are mistakes in writing. */
static int check_names(const struct host_cube_file *file,
                       const config_setting_t *group, const char *const names[],
                       struct host_error *error)
{
    for (int i = 0; i < config_setting_length(group); i++) {
        const config_setting_t *member =
            config_setting_get_elem(group, (unsigned)i);
        const char *name = config_setting_name(member);
        bool known = false;
        for (unsigned k = 0; names[k] != NULL; k++) {
            known = known || strcmp(names[k], name) == 0;
        }
        if (!known) {
            char text[160];
            snprintf(text, sizeof text,
                     "%.60s: no such setting here; see README.md for those "
                     "that there are",
                     name);
            return wrong(file, member, error, text);
        }
    }
    return 0;
}

/* A whole number from lo to hi.  What libconfig reads of a setting of another
 * type, or of one beyond an int, is 0. */
static bool is_number(const config_setting_t *setting, int lo, int hi,
                      int *value)
{
    long long n = config_setting_get_int64(setting);
    int type = config_setting_type(setting);
    if ((type != CONFIG_TYPE_INT && type != CONFIG_TYPE_INT64) || n < lo ||
        n > hi) {
        return false;
    }
    *value = (int)n;
    return true;
}

/* The same of a member, which may be left out: *value stays as it is. */
static bool take_number(const config_setting_t *group, const char *name, int lo,
                        int hi, int *value)
{
    const config_setting_t *member = config_setting_get_member(group, name);
    return member == NULL || is_number(member, lo, hi, value);
}

/* "HOST:PORT", "[ADDRESS]:PORT": looked up once, before the run. */
static int resolve(const struct host_cube_file *file,
                   const config_setting_t *where, struct tcp_address *address,
                   struct host_error *error)
{
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *found = NULL;
    const char *text = config_setting_get_string(where);
    char host[256];
    const char *colon = text == NULL ? NULL : strrchr(text, ':');
    uint64_t port = 0;
    if (text != NULL && tcp_address_parse(address, text) == 0) {
        return 0;
    }
    if (colon == NULL || (size_t)(colon - text) >= sizeof host ||
        host_parse_number(colon + 1, 1, 65535, &port) != 0) {
        return wrong(file, where, error,
                     "not a host with a port; write \"name:7001\", "
                     "\"10.0.0.7:7001\" or \"[2001:db8::7]:7001\"");
    }
    snprintf(host, sizeof host, "%.*s", (int)(colon - text), text);
    int status = getaddrinfo(host, colon + 1, &hints, &found);
    if (status != 0) {
        return host_fail(error, HOST_CUBE,
                         "%s:%u: host %s: %s; correct the name or give its "
                         "address",
                         file->path, config_setting_source_line(where), host,
                         gai_strerror(status));
    }
    memcpy(&address->to, found->ai_addr, found->ai_addrlen);
    address->size = found->ai_addrlen;
    freeaddrinfo(found);
    return 0;
}

static void print_address(const struct tcp_address *address, char *text,
                          size_t size)
{
    char host[NI_MAXHOST], port[NI_MAXSERV];
    if (getnameinfo(&address->to.any, address->size, host, sizeof host, port,
                    sizeof port, NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        snprintf(text, size, "?");
        return;
    }
    snprintf(text, size, strchr(host, ':') != NULL ? "[%s]:%s" : "%s:%s", host,
             port);
}

static int read_key(struct host_cube_file *file, const config_setting_t *where,
                    struct host_error *error)
{
    const char *name = config_setting_get_string(where);
    const char *slash = strrchr(file->path, '/');
    char message[HOST_STRAP_BYTES + 200];
    if (name == NULL) {
        return wrong(file, where, error,
                     "key: not a file's name; write it in "
                     "quotes");
    }
    int beside =
        name[0] == '/' || slash == NULL ? 0 : (int)(slash - file->path) + 1;
    if (snprintf(file->key_path, sizeof file->key_path, "%.*s%s", beside,
                 file->path, name) >= (int)sizeof file->key_path) {
        return wrong(file, where, error, "key: too long a path; move the file");
    }
    enum key_file_state state = key_file_read(file->key_path, file->key);
    int reason = state == KEY_FILE_UNREADABLE ? errno : 0;
    struct key_file_text fault = key_file_text(state);
    file->has_key = state == KEY_FILE_GOOD || state == KEY_FILE_SEEN;
    if (fault.what == NULL) {
        return 0;
    }
    snprintf(message, sizeof message, "key %s: %s%s%s; %s", file->key_path,
             fault.what, reason == 0 ? "" : ": ",
             reason == 0 ? "" : strerror(reason), fault.next);
    if (!file->has_key) {
        return wrong(file, where, error, message);
    }
    fprintf(stderr, "incode: %s:%u: %s\n", file->path,
            config_setting_source_line(where), message);
    return 0;
}

/* --- wires --------------------------------------------------------------- */

static int read_device(const struct host_cube_file *file,
                       const config_setting_t *pair, int end,
                       char device[SERIAL_NAME_MAX], struct host_error *error)
{
    const char *name = config_setting_get_string_elem(pair, end);
    if (name == NULL || strlen(name) >= SERIAL_NAME_MAX ||
        config_setting_length(pair) != 2) {
        return wrong(file, pair, error,
                     "serial: not two devices; write [\"/dev/ttyS1\", "
                     "\"/dev/ttyUSB0\"], the first at `node`");
    }
    snprintf(device, SERIAL_NAME_MAX, "%s", name);
    return 0;
}

static int read_line(const struct host_cube_file *file,
                     const config_setting_t *group, struct host_cube_wire *wire,
                     struct host_error *error)
{
    const config_setting_t *pair = config_setting_get_member(group, "serial");
    const config_setting_t *flow = config_setting_get_member(group, "rtscts");
    int baud = 115200;
    wire->serial = true;
    if (!take_number(group, "baud", 300, 20000000, &baud)) {
        return wrong(file, config_setting_get_member(group, "baud"), error,
                     "baud: not a rate of a serial wire; give 300 to "
                     "20000000");
    }
    if (flow != NULL && config_setting_type(flow) != CONFIG_TYPE_BOOL) {
        return wrong(file, flow, error,
                     "rtscts: neither true nor false; give one of them");
    }
    wire->baud = (uint32_t)baud;
    wire->rts_cts = flow != NULL && config_setting_get_bool(flow) != 0;
    return read_device(file, pair, 0, wire->device[0], error) != 0 ||
                   read_device(file, pair, 1, wire->device[1], error) != 0
               ? error->code
               : 0;
}

static int read_net(const struct host_cube_file *file,
                    const config_setting_t *group, struct host_cube_wire *wire,
                    struct host_error *error)
{
    const config_setting_t *at = config_setting_get_member(group, "tcp");
    const config_setting_t *via = config_setting_get_member(group, "via");
    if (resolve(file, at, &wire->at, error) != 0) {
        return error->code;
    }
    wire->via = wire->at;
    if (via != NULL && resolve(file, via, &wire->via, error) != 0) {
        return error->code;
    }
    if (!file->has_key && !(tcp_address_is_loopback(&wire->at) &&
                            tcp_address_is_loopback(&wire->via))) {
        return wrong(file, at, error,
                     "tcp between machines without a key; add key = \"FILE\" "
                     "at the top");
    }
    return 0;
}

/* A node's number, or the host. */
static int read_end(const struct host_cube_file *file,
                    const config_setting_t *group, const char *name,
                    uint16_t *node, struct host_error *error)
{
    const config_setting_t *end = config_setting_get_member(group, name);
    const char *text = end == NULL ? NULL : config_setting_get_string(end);
    int number = 0;
    if (text != NULL && strcmp(text, "host") == 0 && strcmp(name, "to") == 0) {
        *node = CUBE_HOST;
        return 0;
    }
    if (end == NULL || !is_number(end, 0, (int)file->nodes - 1, &number)) {
        char message[120];
        snprintf(message, sizeof message,
                 "%s: not a node of this cube; give 0 to %u%s", name,
                 file->nodes - 1,
                 strcmp(name, "to") == 0 ? ", or \"host\"" : "");
        return wrong(file, end == NULL ? group : end, error, message);
    }
    *node = (uint16_t)number;
    return 0;
}

static int read_wire(struct host_cube_file *file, config_setting_t *group,
                     struct host_error *error)
{
    static const char *const names[] = {"node",   "to",   "tcp",    "via",
                                        "serial", "baud", "rtscts", NULL};
    struct host_cube_wire *wire = &file->wire[file->wires];
    memset(wire, 0, sizeof *wire);
    wire->line = config_setting_source_line(group);
    if (check_names(file, group, names, error) != 0 ||
        read_end(file, group, "node", &wire->node, error) != 0 ||
        read_end(file, group, "to", &wire->to, error) != 0) {
        return error->code;
    }
    if (wire->to != CUBE_HOST &&
        __builtin_popcount(wire->node ^ wire->to) != 1) {
        return wrong(file, group, error,
                     "no neighbours in a cube; their numbers must differ in "
                     "one binary digit");
    }
    bool tcp = config_setting_get_member(group, "tcp") != NULL;
    bool serial = config_setting_get_member(group, "serial") != NULL;
    if (tcp == serial) {
        return wrong(file, group, error,
                     "neither or both of tcp and serial; give one of them");
    }
    int status = serial ? read_line(file, group, wire, error)
                        : read_net(file, group, wire, error);
    if (serial && (file->serial_baud == 0 || wire->baud < file->serial_baud)) {
        file->serial_baud = wire->baud;
    }
    file->wires++;
    return status;
}

/* The wire between two, either way round. */
static const struct host_cube_wire *between(const struct host_cube_file *file,
                                            unsigned a, unsigned b,
                                            unsigned *count)
{
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
host_cube_host_wire(const struct host_cube_file *file, unsigned k)
{
    for (unsigned i = 0; i < file->wires; i++) {
        if (file->wire[i].to == CUBE_HOST && k-- == 0) {
            return &file->wire[i];
        }
    }
    return NULL;
}

/* The host's machine has the ports of all nodes that it starts. */
static unsigned owner(const struct host_cube_file *file, unsigned node)
{
    return node == CUBE_HOST || file->local[node] ? CUBE_HOST : node;
}

/* Two that listen at one address: on one machine, or at one address of all. */
static bool same_address(const struct host_cube_file *file,
                         const struct host_cube_wire *a,
                         const struct host_cube_wire *b)
{
    return !a->serial && !b->serial && a->at.size == b->at.size &&
           memcmp(&a->at.to, &b->at.to, a->at.size) == 0 &&
           (!tcp_address_is_any(&a->at) ||
            owner(file, a->node) == owner(file, b->node));
}

/* The device at the ends of both that is the same one; NULL: none. */
static const char *same_device(const struct host_cube_file *file,
                               const struct host_cube_wire *a,
                               const struct host_cube_wire *b)
{
    const char *found = NULL;
    for (int i = 0; i < 4 && a->serial && b->serial; i++) {
        unsigned left = i / 2 == 0 ? a->node : a->to;
        unsigned right = i % 2 == 0 ? b->node : b->to;
        if (owner(file, left) == owner(file, right) &&
            strcmp(a->device[i / 2], b->device[i % 2]) == 0) {
            found = a->device[i / 2];
        }
    }
    return found;
}

/* "nodes 0 and 1", "node 0 and the host" */
static void name_wire(const struct host_cube_wire *wire, char text[40])
{
    if (wire->to == CUBE_HOST) {
        snprintf(text, 40, "node %u and the host", wire->node);
    } else {
        snprintf(text, 40, "nodes %u and %u", wire->node, wire->to);
    }
}

/* No two links share an end. */
static int check_ends(const struct host_cube_file *file,
                      struct host_error *error)
{
    char address[HOST_STRAP_BYTES / 2], names[2][40];
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
                print_address(&w->at, address, sizeof address);
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

/* Each wire once, and the host's. */
static int check_wires(const struct host_cube_file *file,
                       const config_setting_t *list, struct host_error *error)
{
    const struct host_cube_wire *first = host_cube_host_wire(file, 0);
    const struct host_cube_wire *second = host_cube_host_wire(file, 1);
    char text[120];
    for (unsigned i = 0; i < file->nodes; i++) {
        for (unsigned d = 0; d < file->dimension; d++) {
            unsigned count = 0, other = i ^ 1u << d;
            const struct host_cube_wire *w = between(file, i, other, &count);
            if (count > 1) {
                return host_fail(error, HOST_INPUT,
                                 "%s:%u: a second link between nodes %u and "
                                 "%u; leave one of them out",
                                 file->path, w->line, i, other);
            }
            if (count == 0) {
                snprintf(text, sizeof text,
                         "no link between nodes %u and %u; add { node = %u; "
                         "to = %u; .. }",
                         i, other, i, other);
                return wrong(file, list, error, text);
            }
        }
    }
    if (first == NULL || first->node != 0) {
        return wrong(file, list, error,
                     "the host's first link must be that of node 0; begin "
                     "with { node = 0; to = \"host\"; .. }");
    }
    if (second != NULL &&
        (second->node == 0 || host_cube_host_wire(file, 2) != NULL)) {
        return wrong(file, list, error,
                     "a second link of the host must be another node's, and "
                     "there is no third; leave it out");
    }
    return 0;
}

/* --- the file ------------------------------------------------------------ */

static int read_board(struct host_cube_file *file, const config_setting_t *root,
                      struct host_error *error)
{
    const config_setting_t *where = config_setting_get_member(root, "board");
    const char *name =
        where == NULL ? host_board_name(0) : config_setting_get_string(where);
    char text[120] = "board: not one that there is; give ";
    file->board = name == NULL ? NULL : host_board_named(name);
    if (file->board != NULL) {
        return 0;
    }
    for (unsigned i = 0; host_board_name(i) != NULL; i++) {
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s\"%s\"",
                 i == 0 ? "" : " or ", host_board_name(i));
    }
    return wrong(file, where, error, text);
}

/* The nodes that the host starts. */
static int read_start(struct host_cube_file *file, const config_setting_t *root,
                      struct host_error *error)
{
    const config_setting_t *start = config_setting_get_member(root, "start");
    bool many = start != NULL && (config_setting_is_array(start) ||
                                  config_setting_is_list(start));
    bool good = start == NULL || many;
    for (int i = 0; good && many && i < config_setting_length(start); i++) {
        int node = 0;
        good = is_number(config_setting_get_elem(start, (unsigned)i), 0,
                         (int)file->nodes - 1, &node);
        if (good && file->local[node]) {
            return wrong(file, start, error,
                         "start: a node twice; name each once");
        }
        file->local[node] |= good;
    }
    return good ? 0
                : wrong(file, start, error,
                        "start: not numbers of nodes; write [0, 1, 2]");
}

static int read_memory(struct host_cube_file *file,
                       const config_setting_t *root, struct host_error *error)
{
    const config_setting_t *memory = config_setting_get_member(root, "memory");
    const char *text =
        memory == NULL ? "4M" : config_setting_get_string(memory);
    return text != NULL && host_parse_bytes(text, &file->memory) == 0 &&
                   file->memory >= 256 * 1024 &&
                   file->memory <= UINT64_C(1) << 30
               ? 0
               : wrong(file, memory, error,
                       "memory: not a size; write \"4M\", from 640K to "
                       "1G, or less to a small cube");
}

static int read_nodes(struct host_cube_file *file, const config_setting_t *root,
                      struct host_error *error)
{
    const config_setting_t *key = config_setting_get_member(root, "key");
    int dimension = -1, window = 0, dead = 30;
    if (!take_number(root, "dimension", 0, CUBE_DIMENSION_MAX, &dimension) ||
        dimension < 0) {
        return wrong(file, config_setting_get_member(root, "dimension"), error,
                     "dimension: not given or not 0 to 10; a cube of 8 nodes "
                     "has dimension = 3;");
    }
    if (!take_number(root, "window", 1, LINK_WINDOW_MAX, &window)) {
        return wrong(file, config_setting_get_member(root, "window"), error,
                     "window: not a number of frames; give 1 to 64");
    }
    if (!take_number(root, "dead", 0, 3600, &dead)) {
        return wrong(file, config_setting_get_member(root, "dead"), error,
                     "dead: not seconds of silence; give 0 (never) to "
                     "3600");
    }
    file->dimension = (unsigned)dimension;
    file->nodes = 1u << dimension;
    file->window = (unsigned)window;
    file->dead_s = (unsigned)dead;
    if (read_memory(file, root, error) != 0 ||
        read_board(file, root, error) != 0 ||
        read_start(file, root, error) != 0) {
        return error->code;
    }
    return key == NULL ? 0 : read_key(file, key, error);
}

static int read_settings(struct host_cube_file *file, const config_t *config,
                         struct host_error *error)
{
    static const char *const names[] = {"dimension", "board", "memory",
                                        "window",    "key",   "start",
                                        "dead",      "links", NULL};
    const config_setting_t *root = config_root_setting(config);
    const config_setting_t *links = config_setting_get_member(root, "links");
    if (check_names(file, root, names, error) != 0 ||
        read_nodes(file, root, error) != 0) {
        return error->code;
    }
    if (links == NULL || !config_setting_is_list(links)) {
        return wrong(file, links, error,
                     "links: no list; write links = ( { node = 0; to = "
                     "\"host\"; .. }, .. );");
    }
    unsigned count = (unsigned)config_setting_length(links);
    file->wire = calloc(count + 1, sizeof *file->wire);
    if (file->wire == NULL) {
        return host_fail_memory(error, "the cube file");
    }
    for (unsigned i = 0; i < count; i++) {
        config_setting_t *group = config_setting_get_elem(links, i);
        if (!config_setting_is_group(group)) {
            return wrong(file, links, error,
                         "links: not a list of groups in braces");
        }
        if (read_wire(file, group, error) != 0) {
            return error->code;
        }
    }
    return check_wires(file, links, error) != 0 ? error->code
                                                : check_ends(file, error);
}

/* The whole text, as libconfig ends the program where it cannot read; NULL: as
 * the error says. */
static char *read_text(const char *path, struct host_error *error)
{
    FILE *stream = fopen(path, "re");
    char *text = stream == NULL ? NULL : malloc(TEXT_MAX + 1);
    size_t size = text == NULL ? 0 : fread(text, 1, TEXT_MAX + 1, stream);
    int status = 0;
    if (stream == NULL || ferror(stream)) {
        status = host_fail(error, HOST_INPUT, "%s: %s; check name and rights",
                           path, strerror(errno));
    } else if (text == NULL) {
        status = host_fail_memory(error, "the cube file");
    } else if (size > TEXT_MAX || memchr(text, '\0', size) != NULL) {
        status = host_fail(error, HOST_INPUT,
                           "%s: not a text of at most 4 MB; give the cube's "
                           "file",
                           path);
    } else {
        text[size] = '\0';
    }
    if (stream != NULL) {
        fclose(stream);
    }
    if (status != 0) {
        free(text);
        text = NULL;
    }
    return text;
}

int host_cube_file_read(struct host_cube_file *file, const char *path,
                        struct host_error *error)
{
    config_t config;
    int status;
    memset(file, 0, sizeof *file);
    file->path = path;
    char *text = read_text(path, error);
    if (text == NULL) {
        return error->code;
    }
    config_init(&config);
    if (config_read_string(&config, text) == CONFIG_TRUE) {
        status = read_settings(file, &config, error);
    } else {
        status = host_fail(
            error, HOST_INPUT, "%s:%d: %s; correct it, README.md has examples",
            path, config_error_line(&config), config_error_text(&config));
    }
    config_destroy(&config);
    free(text);
    if (status != 0) {
        host_cube_file_free(file);
    }
    return status;
}

void host_cube_file_free(struct host_cube_file *file)
{
    free(file->wire);
    file->wire = NULL;
    memset(file->key, 0, sizeof file->key);
}

/* --- straps -------------------------------------------------------------- */

static void print_wire(const struct host_cube_wire *wire, unsigned link,
                       bool first, char text[HOST_STRAP_BYTES])
{
    char address[HOST_STRAP_BYTES / 2];
    if (wire->serial) {
        snprintf(text, HOST_STRAP_BYTES, "%u=serial:%s:%u%s", link,
                 wire->device[first ? 0 : 1], wire->baud,
                 wire->rts_cts ? ":rtscts" : "");
        return;
    }
    print_address(first ? &wire->at : &wire->via, address, sizeof address);
    snprintf(text, HOST_STRAP_BYTES, "%u=%s:%s", link,
             first ? "listen" : "call", address);
}

unsigned host_cube_straps(const struct host_cube_file *file, unsigned node,
                          char straps[HOST_STRAPS_MAX][HOST_STRAP_BYTES])
{
    unsigned n = 0, count;
    const struct host_cube_wire *second = host_cube_host_wire(file, 1);
    const struct host_cube_wire *host = node == 0 ? host_cube_host_wire(file, 0)
                                        : second != NULL && second->node == node
                                            ? second
                                            : NULL;
    const struct {
        const char *name;
        uint64_t value;
    } numbers[] = {{"--node", node},
                   {"--dimension", file->dimension},
                   {"--memory", file->memory},
                   {"--window", file->window},
                   {"--dead", UINT64_C(1000000) * file->dead_s},
                   {"--lines", file->serial_baud},
                   {"--host-wire", host != NULL ? 1 : 0}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        snprintf(straps[n++], HOST_STRAP_BYTES, "%s", numbers[i].name);
        snprintf(straps[n++], HOST_STRAP_BYTES, "%llu",
                 (unsigned long long)numbers[i].value);
    }
    if (file->has_key) {
        snprintf(straps[n++], HOST_STRAP_BYTES, "--key");
        snprintf(straps[n++], HOST_STRAP_BYTES, "%.*s", HOST_STRAP_BYTES - 1,
                 file->key_path);
    }
    for (unsigned d = 0; d <= file->dimension; d++) {
        const struct host_cube_wire *wire =
            d == file->dimension ? host
                                 : between(file, node, node ^ 1u << d, &count);
        if (wire != NULL) {
            snprintf(straps[n++], HOST_STRAP_BYTES, "--wire");
            print_wire(wire, d, wire->node == node, straps[n++]);
        }
    }
    snprintf(straps[n++], HOST_STRAP_BYTES, "--board");
    snprintf(straps[n++], HOST_STRAP_BYTES, "%s", file->board->name);
    return n;
}

int host_cube_print(const char *path, struct host_error *error)
{
    static char straps[HOST_STRAPS_MAX][HOST_STRAP_BYTES];
    static struct host_cube_file file;
    if (host_cube_file_read(&file, path, error) != 0) {
        return error->code;
    }
    for (unsigned i = 0; i < file.nodes; i++) {
        unsigned count = host_cube_straps(&file, i, straps);
        printf("incode-node");
        for (unsigned k = 0; k < count; k++) {
            printf(" %s", straps[k]);
        }
        printf("\n");
    }
    host_cube_file_free(&file);
    return 0;
}
