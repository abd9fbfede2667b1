/* top: what moves while nodes work, a row each, with bars. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "commands.h"
#include "host/base/error.h"
#include "node/roles/roles.h"

enum {
    EVERY_US = 1000000,
    FIRST_US = 500000, /* between the two looks of a single picture */
    CELLS_MIN = 6,
    CELLS_MAX = 20,
    FIXED_COLUMNS = 52, /* beside the bars, of which there are four */
    TEXT_A_NODE = 256,
    LOOK_US = 50000, /* between looks at the person */
    UART_BITS = 10
};

/* A node's answers now and before. */
struct look {
    bool there, before_there;
    uint64_t us, before_us; /* when they came */
    struct node_top now, before;
};

struct top {
    struct look *look; /* of each node */
    uint64_t most;     /* bytes a second that the busiest wires carried */
    char *text;
    size_t used, room;
    unsigned cells;
};

static double rate(const struct look *look, uint64_t now, uint64_t before) {
    uint64_t us = look->us - look->before_us;
    return !look->before_there || us == 0 || now < before
               ? 0.0
               : 1e6 * (double)(now - before) / (double)us;
}

static double part(uint64_t used, uint64_t all) {
    return all == 0 ? 0.0 : (double)used / (double)all;
}

static double wire_rate(const struct look *look) {
    return rate(look, look->now.bytes_in + look->now.bytes_out,
                look->before.bytes_in + look->before.bytes_out);
}

/* Of what its wires could carry both ways, where their rate is known; else of
 * the most that was seen. */
static double wire_part(const struct host_shell *shell, const struct top *top,
                        const struct look *look) {
    double could =
        2.0 * shell->machine.serial_baud / UART_BITS *
        (shell->machine.dimension > 0 ? shell->machine.dimension : 1);
    could = shell->machine.serial_baud > 0 ? could : (double)top->most;
    return could > 0.0 ? wire_rate(look) / could : 0.0;
}

static void write_row(const struct host_shell *shell, struct top *top,
                      unsigned node, char *row, size_t size) {
    const struct look *l = &top->look[node];
    const struct node_top *t = &l->now;
    const struct node_role *role = node_role_named(t->role);
    char bar[4][HOST_SHELL_BAR], wire[HOST_SHELL_FIGURE],
        built[HOST_SHELL_FIGURE];
    if (!l->there) {
        snprintf(row, size, "%4u  no answer", node);
        return;
    }
    snprintf(row, size, "%4u %-12.12s %3.0f%% %s %s %s %s %6s/s %7s", node,
             role == NULL ? "-" : role->name,
             100.0 * rate(l, t->busy_us, l->before.busy_us) * 1e-6,
             host_shell_bar(part(t->used, t->memory), top->cells, bar[0]),
             host_shell_bar(part(t->held, t->pages), top->cells, bar[1]),
             host_shell_bar(part(t->open, t->faces), top->cells, bar[2]),
             host_shell_bar(wire_part(shell, top, l), top->cells, bar[3]),
             host_shell_bytes((uint64_t)wire_rate(l), wire),
             host_shell_count(t->built, built));
}

static void draw(struct host_shell *shell, struct top *top,
                 const struct host_node_set *set) {
    int width = (int)top->cells + 2;
    top->used = (size_t)snprintf(
        top->text, top->room, "NODE %-12s %4s %-*s %-*s %-*s %-*s %8s %7s\n",
        "ROLE", "BUSY", width, "MEMORY", width, "PAGES", width, "FRONT", width,
        "LINKS", "WIRE", "BUILT");
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        char row[TEXT_A_NODE];
        if (host_node_set_has(set, i) && top->used + TEXT_A_NODE < top->room) {
            write_row(shell, top, i, row, sizeof row);
            top->used += (size_t)snprintf(top->text + top->used,
                                          top->room - top->used, "%s\n", row);
        }
    }
}

static int look(struct host_shell *shell, struct top *top,
                const struct host_node_set *set) {
    if (host_shell_ask(shell, set, NODE_TOP, 0) != 0)
        return shell->error.code;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        struct look *l = &top->look[i];
        const void *answer = host_shell_answer(shell, i, sizeof l->now);
        l->before = l->now;
        l->before_us = l->us;
        l->before_there = l->there;
        l->there = answer != NULL;
        if (answer != NULL) {
            memcpy(&l->now, answer, sizeof l->now);
            l->us = shell->machine.now_us(shell->machine.context);
        }
        double wire = l->there ? wire_rate(l) : 0.0;
        top->most = wire > (double)top->most ? (uint64_t)wire : top->most;
    }
    return 0;
}

static int pause_for(struct host_shell *shell, uint64_t us) {
    const struct host_machine *m = &shell->machine;
    const struct host_shell_sink *sink = shell->sink;
    if (shell->looking) {
        for (uint64_t slept = 0; slept < us; slept += LOOK_US) {
            (void)usleep(LOOK_US);
            if (sink->interrupted != NULL && sink->interrupted(sink->context)) {
                shell->watch.cut = true;
                return host_fail(&shell->error, HOST_CUBE, "interrupted");
            }
        }
        return 0;
    }
    uint64_t end = m->now_us(m->context) + us;
    for (uint64_t now = end - us; now < end; now = m->now_us(m->context))
        if (host_session_round(&shell->session, end - now, &shell->error) != 0)
            return shell->error.code;
    return 0;
}

static void tell_object(struct host_shell *shell, const struct top *top,
                        const struct host_node_set *set) {
    json_t *list = json_array();
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct look *l = &top->look[i];
        const struct node_top *t = &l->now;
        const struct node_role *role = node_role_named(t->role);
        if (!host_node_set_has(set, i))
            continue;
        json_t *object =
            json_pack("{si sb}", "node", (int)i, "there", (int)l->there);
        json_t *fields = json_pack(
            "{ss? sI sI sI sI sI sI sf sf sI}", "role",
            role == NULL ? NULL : role->name, "memory_bytes",
            (json_int_t)t->memory, "used_bytes", (json_int_t)t->used, "pages",
            (json_int_t)t->pages, "pages_held", (json_int_t)t->held, "faces",
            (json_int_t)t->faces, "faces_open", (json_int_t)t->open, "busy",
            1e-6 * rate(l, t->busy_us, l->before.busy_us),
            "wire_bytes_per_second", wire_rate(l), "tetrahedra_built",
            (json_int_t)t->built);
        if (l->there)
            (void)json_object_update(object, fields);
        json_decref(fields);
        (void)json_array_append_new(list, object);
    }
    if (shell->object != NULL)
        (void)json_object_set(shell->object, "nodes", list);
    json_decref(list);
}

static void say_text(struct host_shell *shell, char *text) {
    for (char *line = strtok(text, "\n"); line != NULL;
         line = strtok(NULL, "\n"))
        host_shell_say(shell, "%s", line);
}

static int show(struct host_shell *shell, struct top *top,
                const struct host_node_set *set) {
    const struct host_shell_sink *sink = shell->sink;
    bool live = sink->picture != NULL && !shell->json;
    int status = look(shell, top, set);
    if (status == 0)
        status = pause_for(shell, FIRST_US);
    do {
        unsigned columns =
            sink->columns == NULL ? 80 : sink->columns(sink->context);
        unsigned room = columns > FIXED_COLUMNS ? columns - FIXED_COLUMNS : 0;
        top->cells = room / 4 < CELLS_MIN   ? CELLS_MIN
                     : room / 4 > CELLS_MAX ? CELLS_MAX
                                            : room / 4;
        status = status == 0 ? look(shell, top, set) : status;
        if (status == 0)
            draw(shell, top, set);
        if (status != 0 || !live || !sink->picture(sink->context, top->text))
            break;
        status = pause_for(shell, EVERY_US);
    } while (true);
    if (live)
        (void)sink->picture(sink->context, NULL);
    if (live && shell->watch.cut) { /* the person has seen enough */
        shell->watch.cut = false;
        memset(&shell->error, 0, sizeof shell->error);
        status = 0;
        draw(shell, top, set);
    }
    if (status != 0)
        return status;
    tell_object(shell, top, set);
    say_text(shell, top->text);
    return host_shell_fail_absent(shell, set);
}

int host_shell_top(struct host_shell *shell, unsigned count,
                   const char *const *words) {
    struct host_node_set set;
    if (host_shell_set(shell, count == 0 ? NULL : words[0], &set) != 0)
        return shell->error.code;
    struct top top = {.room = (shell->machine.nodes + 2) * TEXT_A_NODE};
    top.look = calloc(shell->machine.nodes, sizeof top.look[0]);
    top.text = malloc(top.room);
    int status = top.look == NULL || top.text == NULL
                     ? host_fail_memory(&shell->error, "the picture")
                     : show(shell, &top, &set);
    free(top.look);
    free(top.text);
    return status;
}
