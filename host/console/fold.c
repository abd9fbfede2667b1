#include "fold.h"

#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "node/roles/roles.h"
#include "host/base/text.h"
#include "host/nodes/emulator.h"

enum { SET_TEXT = 48, LINE = 1024, ROWS_FIRST = 16, TIME_TEXT = 32 };

/* Whether a time is of those of a row: all within 2 s and a tenth. */
static bool is_near(const struct host_fold_row *row, const uint32_t *time_s) {
    if (time_s == NULL || !row->timed)
        return time_s == NULL && !row->timed;
    uint32_t least = row->least < *time_s ? row->least : *time_s;
    uint32_t most = row->most > *time_s ? row->most : *time_s;
    return most - least <= 2 + least / 10;
}

static struct host_fold_row *row_of(struct host_fold *fold, bool of_host,
                                    const char *text, const uint32_t *time_s) {
    for (unsigned i = 0; i < fold->count; i++) {
        struct host_fold_row *row = &fold->row[i];
        if (row->of_host == of_host && strcmp(row->text, text) == 0 &&
            is_near(row, time_s))
            return row;
    }
    if (fold->count == fold->room) {
        unsigned room = fold->room == 0 ? ROWS_FIRST : 2 * fold->room;
        struct host_fold_row *more =
            realloc(fold->row, room * sizeof fold->row[0]);
        if (more == NULL)
            return NULL;
        fold->row = more;
        fold->room = room;
    }
    struct host_fold_row *row = &fold->row[fold->count];
    memset(row, 0, sizeof *row);
    row->text = strdup(text);
    row->of_host = of_host;
    fold->count += row->text != NULL;
    return row->text == NULL ? NULL : row;
}

static struct host_fold_row *add(struct host_fold *fold, unsigned node,
                                 const char *text, const uint32_t *time_s) {
    bool of_host = node == CUBE_HOST;
    struct host_fold_row *row = row_of(fold, of_host, text, time_s);
    fold->broken = fold->broken || row == NULL;
    if (row != NULL && !of_host)
        host_node_set_add(&row->set, node);
    return row;
}

void host_fold_add(struct host_fold *fold, unsigned node, const char *text) {
    (void)add(fold, node, text, NULL);
}

void host_fold_add_timed(struct host_fold *fold, unsigned node,
                         const char *text, uint32_t time_s) {
    struct host_fold_row *row = add(fold, node, text, &time_s);
    if (row == NULL)
        return;
    row->least = row->timed && row->least < time_s ? row->least : time_s;
    row->most = row->timed && row->most > time_s ? row->most : time_s;
    row->timed = true;
}

/* "61-64 s", "2 min": in the unit that suits the least. */
static void put_times(const struct host_fold_row *row, char text[TIME_TEXT]) {
    uint32_t s = row->least < 60 ? 1 : row->least < 3600 ? 60 : 3600;
    const char *unit = s == 1 ? "s" : s == 60 ? "min" : "h";
    if (row->least / s == row->most / s) {
        snprintf(text, TIME_TEXT, "%" PRIu32 " %s", row->least / s, unit);
    } else {
        snprintf(text, TIME_TEXT, "%" PRIu32 "-%" PRIu32 " %s", row->least / s,
                 row->most / s, unit);
    }
}

static void name_row(const struct host_fold_row *row, char text[SET_TEXT]) {
    if (row->of_host)
        snprintf(text, SET_TEXT, "host");
    else
        host_node_set_print(&row->set, text, SET_TEXT);
}

/* Its lines, each behind four blanks. */
static void print_lines(const char *text,
                        void (*line)(void *context, const char *text),
                        void *context) {
    char whole[LINE];
    while (*text != '\0') {
        const char *end = strchrnul(text, '\n');
        snprintf(whole, sizeof whole, "    %.*s", (int)(end - text), text);
        line(context, whole);
        text = *end == '\0' ? end : end + 1;
    }
}

static void print_row(const struct host_fold_row *row, const char *set,
                      int width, char whole[LINE]) {
    char times[TIME_TEXT];
    const char *mark = row->timed ? strchr(row->text, HOST_FOLD_TIME) : NULL;
    if (mark == NULL) {
        snprintf(whole, LINE, "%-*s  %s", width, set, row->text);
        return;
    }
    put_times(row, times);
    snprintf(whole, LINE, "%-*s  %.*s%*s%s", width, set,
             (int)(mark - row->text), row->text, HOST_FOLD_TIME_WIDTH, times,
             mark + 1);
}

void host_fold_print(const struct host_fold *fold, const char *heading,
                     void (*line)(void *context, const char *text),
                     void *context) {
    char set[SET_TEXT], whole[LINE];
    int width = heading == NULL ? 0 : (int)strlen("NODES");
    for (unsigned i = 0; i < fold->count; i++) {
        name_row(&fold->row[i], set);
        width = (int)strlen(set) > width ? (int)strlen(set) : width;
    }
    if (heading != NULL) {
        snprintf(whole, sizeof whole, "%-*s  %s", width, "NODES", heading);
        line(context, whole);
    }
    for (unsigned i = 0; i < fold->count; i++) {
        const struct host_fold_row *row = &fold->row[i];
        name_row(row, set);
        if (strchr(row->text, '\n') != NULL) {
            snprintf(whole, sizeof whole, "%s:", set);
            line(context, whole);
            print_lines(row->text, line, context);
        } else {
            print_row(row, set, width, whole);
            line(context, whole);
        }
    }
}

void host_fold_free(struct host_fold *fold) {
    for (unsigned i = 0; i < fold->count; i++)
        free(fold->row[i].text);
    free(fold->row);
    memset(fold, 0, sizeof *fold);
}

/* stat, memory, log: what a node says of its work, its memory and itself. */

enum { BAR_CELLS = 20, TEXT = 2048 };

static int ask_words(struct host_shell *shell, unsigned count,
                     const char *const *words, enum node_question what,
                     const char *heading, host_shell_tell *tell) {
    struct host_node_set set;
    return host_shell_set(shell, count == 0 ? NULL : words[0], &set) != 0
               ? shell->error.code
               : host_shell_ask_tell(shell, &set, what, heading, tell);
}

static void tell_short(unsigned node, struct host_fold *fold, json_t *object) {
    host_fold_add(fold, node, "an answer of another version");
    (void)json_object_set_new(object, "error",
                              json_string("an answer of another version"));
}

/* --- stat ----------------------------------------------------------------- */

static void tell_totals(struct host_shell *shell, unsigned node,
                        struct host_fold *fold, json_t *object) {
    struct node_finished_message t;
    const void *answer = host_shell_answer(shell, node, sizeof t);
    char row[160], built[HOST_SHELL_FIGURE], kept[HOST_SHELL_FIGURE];
    char busy[HOST_SHELL_FIGURE], in[HOST_SHELL_FIGURE], out[HOST_SHELL_FIGURE],
        most[HOST_SHELL_FIGURE], asked[HOST_SHELL_FIGURE],
        evicted[HOST_SHELL_FIGURE];
    if (answer == NULL) {
        tell_short(node, fold, object);
        return;
    }
    memcpy(&t, answer, sizeof t);
    const struct incode_statistics *s = &t.statistics;
    snprintf(row, sizeof row, "%7s %7s %9s %7s %7s %7s %7s %7s %6" PRIu64,
             host_shell_count(s->tetrahedra_built, built),
             host_shell_count(s->tetrahedra_kept, kept),
             host_shell_time(t.busy_us, busy),
             host_shell_count(s->page_requests, asked),
             host_shell_count(s->page_evictions, evicted),
             host_shell_bytes(t.bytes_in, in),
             host_shell_bytes(t.bytes_out, out),
             host_shell_bytes(t.memory_high_water, most), t.retransmitted);
    host_fold_add(fold, node, row);
    json_t *fields = json_pack(
        "{sI sI sI sf sf sI sI sI sI sI sI sI sI}", "tetrahedra_built",
        (json_int_t)s->tetrahedra_built, "tetrahedra_kept",
        (json_int_t)s->tetrahedra_kept, "make_tetra_calls",
        (json_int_t)s->make_tetra_calls, "cpu_s", 1e-6 * (double)t.busy_us,
        "wall_s", 1e-6 * (double)t.wall_us, "page_requests",
        (json_int_t)s->page_requests, "page_faults", (json_int_t)s->page_faults,
        "page_evictions", (json_int_t)s->page_evictions, "bytes_in",
        (json_int_t)t.bytes_in, "bytes_out", (json_int_t)t.bytes_out,
        "memory_high_water_bytes", (json_int_t)t.memory_high_water,
        "retransmitted_frames", (json_int_t)t.retransmitted, "overruns",
        (json_int_t)t.overruns);
    (void)json_object_update(object, fields);
    json_decref(fields);
}

int host_shell_stat(struct host_shell *shell, unsigned count,
                    const char *const *words) {
    return ask_words(shell, count, words, NODE_TOTALS,
                     "  BUILT    KEPT      BUSY  PAGES EVICTED      IN     OUT "
                     " MEMORY  AGAIN",
                     tell_totals);
}

/* --- memory --------------------------------------------------------------- */

struct map_text {
    char text[TEXT];
    size_t used;
    double all;
    json_t *parts;
};

static void add_part(struct map_text *m, const char *name, uint32_t bytes,
                     uint32_t count, const char *unit) {
    char figure[HOST_SHELL_FIGURE], bar[HOST_SHELL_BAR], more[48] = "";
    if (m->used >= sizeof m->text - 1)
        return;
    if (count > 0) {
        snprintf(more, sizeof more, "  %" PRIu32 " %s", count,
                 unit == NULL ? "" : unit);
    }
    m->used += (size_t)snprintf(
        m->text + m->used, sizeof m->text - m->used, "%-20s %7s %s%s\n", name,
        host_shell_bytes(bytes, figure),
        host_shell_bar(bytes / m->all, BAR_CELLS, bar), more);
    (void)json_array_append_new(
        m->parts, json_pack("{ss sI sI}", "name", name, "bytes",
                            (json_int_t)bytes, "count", (json_int_t)count));
}

static void tell_map(struct host_shell *shell, unsigned node,
                     struct host_fold *fold, json_t *object) {
    struct node_ready_message ready;
    const void *answer = host_shell_answer(shell, node, sizeof ready);
    if (answer == NULL) {
        tell_short(node, fold, object);
        return;
    }
    memcpy(&ready, answer, sizeof ready);
    const struct node_role *role = node_role_named(ready.role);
    const struct node_map *map = &ready.map;
    struct map_text m = {.all = map->memory > 0 ? map->memory : 1,
                         .parts = json_array()};
    char all[HOST_SHELL_FIGURE];
    uint64_t used = (uint64_t)map->fixed + map->cube + map->node;
    m.used = (size_t)snprintf(
        m.text, sizeof m.text, "%s in all, %s\n",
        host_shell_bytes(map->memory, all),
        role == NULL ? "no role yet: what a run gives it is free" : role->name);
    add_part(&m, "program and stack", map->fixed, 0, NULL);
    add_part(&m, "windows of links", map->cube, map->window, "frames a link");
    add_part(&m, "node's own state", map->node, 0, NULL);
    for (unsigned i = 0; role != NULL && i < NODE_TABLES_MAX; i++) {
        if (role->tables[i].name != NULL) {
            add_part(&m, role->tables[i].name, map->tables[i].bytes,
                     map->tables[i].count, role->tables[i].unit);
            used += map->tables[i].bytes;
        }
    }
    add_part(&m, "free", used < map->memory ? map->memory - (uint32_t)used : 0,
             0, NULL);
    host_fold_add(fold, node, m.text);
    (void)json_object_set_new(object, "memory_bytes",
                              json_integer(map->memory));
    (void)json_object_set_new(
        object, "role", role == NULL ? json_null() : json_string(role->name));
    (void)json_object_set_new(object, "parts", m.parts);
}

int host_shell_memory(struct host_shell *shell, unsigned count,
                      const char *const *words) {
    return ask_words(shell, count, words, NODE_MEMORY, NULL, tell_map);
}

/* --- log ------------------------------------------------------------------ */

/* As a person can read it: lines stay lines, what a terminal would obey is
 * escaped. */
static void tell_log(struct host_shell *shell, unsigned node,
                     struct host_fold *fold, json_t *object) {
    const struct host_session_node *n = &shell->session.node[node];
    char text[4 * HOST_SESSION_ANSWER_BYTES + 1];
    size_t used = 0;
    for (size_t i = 0; i < n->size; i++) {
        uint8_t c = n->answer[i];
        bool plain = c == '\n' || (c >= ' ' && c <= '~');
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 plain ? "%c" : "\\x%02x", c);
    }
    while (used > 0 && text[used - 1] == '\n')
        used--;
    text[used] = '\0';
    host_fold_add(fold, node, used == 0 ? "nothing to say" : text);
    (void)json_object_set_new(object, "log", json_string(text));
}

int host_shell_log(struct host_shell *shell, unsigned count,
                   const char *const *words) {
    return ask_words(shell, count, words, NODE_LOG, NULL, tell_log);
}

/* nodes: who is there, what is missing, and what to do next. */

enum { WIRES_US = 10000000 }; /* for those of nodes that have just begun */

/* A field of fixed length, as a text that a terminal can be given. */
static const char *field(const uint8_t *bytes, size_t size, char *text) {
    size_t i = 0;
    for (; i < size && bytes[i] != 0; i++)
        text[i] = (char)(bytes[i] >= ' ' && bytes[i] <= '~' ? bytes[i] : '?');
    text[i] = '\0';
    return text;
}

static bool is_zero(const uint8_t *bytes, size_t size) {
    bool zero = true;
    for (size_t i = 0; i < size; i++)
        zero = zero && bytes[i] == 0;
    return zero;
}

static const char *hex(const uint8_t *bytes, size_t size, char *text) {
    for (size_t i = 0; i < size; i++)
        snprintf(text + 2 * i, 3, "%02x", bytes[i]);
    return text;
}

static void tell_who(struct host_shell *shell, unsigned node,
                     struct host_fold *fold, json_t *object) {
    static const char *const kinds[] = {"?", "process", "program", "loader"};
    const struct node_who *w = &shell->session.node[node].who;
    const struct node_role *role = node_role_named(w->role);
    char board[NODE_BOARD_BYTES + 1], version[NODE_VERSION_BYTES + 1];
    char loader[NODE_VERSION_BYTES + 1];
    char digest[2 * NODE_DIGEST_BYTES + 1], serial[2 * NODE_SERIAL_BYTES + 1];
    char row[200], memory[HOST_SHELL_FIGURE], boot[12], wires[16];
    const char *kind = kinds[w->kind <= NODE_KIND_LOADER ? w->kind : 0];
    (void)field(w->board, sizeof w->board, board);
    (void)field(w->version, sizeof w->version, version);
    (void)field(w->loader, sizeof w->loader, loader);
    (void)hex(w->digest, sizeof w->digest, digest);
    (void)hex(w->serial, sizeof w->serial, serial);
    if (w->protocol != NODE_PROTOCOL) {
        snprintf(row, sizeof row,
                 "of another version: it speaks protocol %" PRIu32
                 ", this host %d; bring the same to both",
                 w->protocol, NODE_PROTOCOL);
        host_fold_add(fold, node, row);
        (void)json_object_set_new(object, "error", json_string(row));
        return;
    }
    bool looking = shell->looking; /* then links tells of wires */
    unsigned links = looking ? 0 : host_session_links(&shell->session, node);
    unsigned links_up =
        looking ? 0 : host_session_links_up(&shell->session, node);
    snprintf(boot, sizeof boot, "%" PRIu32, w->boot);
    snprintf(wires, sizeof wires, "%u of %u", links_up, links);
    if (links_up == links)
        snprintf(wires, sizeof wires, looking ? "-" : "all");
    snprintf(row, sizeof row, "%-12s %-8s %-10s %-8.8s %5s %c %7s  %-8s %s",
             board, kind, version,
             is_zero(w->digest, sizeof w->digest) ? "-" : digest,
             w->boot == 0 ? "-" : boot, HOST_FOLD_TIME,
             host_shell_bytes(w->memory, memory), wires,
             role == NULL ? "-" : role->name);
    host_fold_add_timed(fold, node, row, w->uptime_s);
    json_t *fields = json_pack(
        "{ss ss ss ss ss ss sI sI sI sI sI si si ss?}", "board", board, "kind",
        kind, "version", version, "loader", loader, "digest", digest, "serial",
        serial, "number", (json_int_t)w->number, "boot", (json_int_t)w->boot,
        "epoch", (json_int_t)w->epoch, "uptime_s", (json_int_t)w->uptime_s,
        "memory_bytes", (json_int_t)w->memory, "links", (int)links, "links_up",
        (int)links_up, "role", role == NULL ? NULL : role->name);
    (void)json_object_update(object, fields);
    json_decref(fields);
}

/* --- what is wrong between them ------------------------------------------- */

struct faults {
    struct host_shell *shell;
    json_t *list;
};

static void tell_fault(void *context, unsigned node, unsigned link,
                       const char *text) {
    struct faults *faults = context;
    host_shell_say(faults->shell, "%s", text);
    (void)json_array_append_new(faults->list,
                                json_pack("{si si ss}", "node", (int)node,
                                          "link", (int)link, "error", text));
}

static unsigned tell_faults(struct host_shell *shell) {
    struct faults faults = {shell, json_array()};
    unsigned count = host_session_faults(&shell->session, tell_fault, &faults);
    if (shell->object != NULL)
        (void)json_object_set(shell->object, "wires", faults.list);
    json_decref(faults.list);
    return count;
}

/* The image that these boards would be given, where they are of one kind and it
 * was built; what to put there, else. */
static const char *name_image(const struct host_shell *shell,
                              const struct host_node_set *set,
                              char path[PATH_MAX]) {
    char board[NODE_BOARD_BYTES + 1] = "", quoted[PATH_MAX];
    bool alike = true;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct node_who *w = &shell->session.node[i].who;
        if (host_node_set_has(set, i)) {
            alike = alike &&
                    (board[0] == '\0' || strncmp(board, (const char *)w->board,
                                                 NODE_BOARD_BYTES) == 0);
            memcpy(board, w->board, NODE_BOARD_BYTES);
        }
    }
    if (!alike || !host_firmware_find(board, path) ||
        host_text_quote(quoted, sizeof quoted, path) != 0)
        return "IMAGE";
    return strcpy(path, quoted);
}

/* Nodes that are there, and would not run as they are. */
static void tell_next(struct host_shell *shell) {
    struct host_node_set loaders = {{0}}, worn = {{0}}, programs = {{0}};
    const struct node_who *first = NULL;
    bool mixed = false, process = false;
    const char *where = host_where(&shell->machine);
    char names[72], image[PATH_MAX];
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct node_who *w = &shell->session.node[i].who;
        if (!shell->session.node[i].there || w->protocol != NODE_PROTOCOL)
            continue;
        if (w->kind == NODE_KIND_LOADER) {
            host_node_set_add(w->boot == 0 ? &worn : &loaders, i);
            continue;
        }
        process = process || w->kind == NODE_KIND_PROCESS;
        host_node_set_add(&programs, i);
        first = first == NULL ? w : first;
        mixed =
            mixed || memcmp(first->version, w->version, sizeof w->version) != 0;
    }
    if (host_node_set_count(&loaders) > 0) {
        host_node_set_name(&loaders, names, sizeof names);
        host_shell_say(shell,
                       "%s: in the boot loader, with no program running; "
                       "bring one with: incode flash %s %s",
                       names, where, name_image(shell, &loaders, image));
    }
    if (host_node_set_count(&worn) > 0) {
        host_node_set_name(&worn, names, sizeof names);
        host_shell_say(shell,
                       "%s: in the boot loader, as the flash takes no record "
                       "of a start; why: incode console %s -c 'log %s'",
                       names, where, strchr(names, ' ') + 1);
    }
    if (mixed && process) {
        host_shell_say(shell,
                       "the nodes run different versions; bring the same to "
                       "all with: incode deploy %s",
                       where);
    } else if (mixed) {
        host_shell_say(shell,
                       "the nodes run different versions; bring the same to "
                       "all with: incode flash %s %s",
                       where, name_image(shell, &programs, image));
    }
}

int host_shell_nodes(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_node_set set;
    if (host_shell_set(shell, count == 0 ? NULL : words[0], &set) != 0)
        return shell->error.code;
    if (!shell->looking && (host_shell_ask(shell, &set, NODE_WHO, 0) != 0 ||
                            host_session_settle_wires(&shell->session, WIRES_US,
                                                      &shell->error) != 0))
        return shell->error.code;
    int status = host_shell_ask_tell(
        shell, &set, NODE_WHO,
        "BOARD        RUNS     VERSION    IMAGE     BOOT        UP  MEMORY  "
        "LINKS    ROLE",
        tell_who);
    if (count > 0 || shell->looking)
        return status;
    unsigned faults = tell_faults(shell);
    tell_next(shell);
    return status != 0 || faults == 0
               ? status
               : host_fail(&shell->error, HOST_CUBE,
                           "nodes: all are there, and %u wire%s not as %s "
                           "should be; put right what is named above",
                           faults, faults == 1 ? " is" : "s are",
                           faults == 1 ? "it" : "they");
}
