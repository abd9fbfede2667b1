/* stat, memory, log: what a node says of its work, its memory and itself. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "node/roles/roles.h"

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
    if (m->used >= sizeof m->text - 1) {
        return;
    }
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
    const struct host_visit_node *n = &shell->visit.node[node];
    char text[4 * HOST_VISIT_ANSWER_BYTES + 1];
    size_t used = 0;
    for (size_t i = 0; i < n->size; i++) {
        uint8_t c = n->answer[i];
        bool plain = c == '\n' || (c >= ' ' && c <= '~');
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 plain ? "%c" : "\\x%02x", c);
    }
    while (used > 0 && text[used - 1] == '\n') {
        used--;
    }
    text[used] = '\0';
    host_fold_add(fold, node, used == 0 ? "nothing to say" : text);
    (void)json_object_set_new(object, "log", json_string(text));
}

int host_shell_log(struct host_shell *shell, unsigned count,
                   const char *const *words) {
    return ask_words(shell, count, words, NODE_LOG, NULL, tell_log);
}
