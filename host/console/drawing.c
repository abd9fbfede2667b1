/* A drawing of the cube's wires in letters, dead and wrong ones marked: as a
 * person sees it up to dimension 4, as a matrix beyond. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include "transport/cube.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"

enum { HOST_DRAWING_MAX = 4 }; /* dimensions */

enum host_wire_state {
    HOST_WIRE_UP,
    HOST_WIRE_UNKNOWN, /* nobody at its ends has answered */
    HOST_WIRE_DOWN,
    HOST_WIRE_DEAD,
    HOST_WIRE_WRONG
};

struct host_drawing {
    unsigned dimension;
    uint8_t wire[CUBE_NODES_MAX][CUBE_LINKS_MAX]; /* of the lower end; link
                                                     `dimension` of node 0: the
                                                     host's */
    bool absent[CUBE_NODES_MAX];
};

/* A cube of three dimensions: dimension 0 to the right, 1 up, 2 to the back. */
enum {
    RIGHT = 12,
    UP = 4,
    BACK_X = 5,
    BACK_Y = 2,
    LEFT = 4,
    ROWS = UP + BACK_Y + 1,
    COLUMNS = 34,
    CUBES_APART = 30
};

struct canvas {
    char cell[ROWS][2 * COLUMNS];
};

struct place {
    int x, y;
};

static char mark_of(enum host_wire_state state) {
    static const char marks[] = {'+', '.', '!', 'x', '?'};
    return marks[state];
}

static struct place place_of(unsigned node) {
    return (struct place){
        LEFT + (int)(node & 1) * RIGHT + (int)(node >> 2 & 1) * BACK_X +
            (int)(node >> 3 & 1) * CUBES_APART,
        ROWS - 1 - (int)(node >> 1 & 1) * UP - (int)(node >> 2 & 1) * BACK_Y};
}

static void put(struct canvas *c, int x, int y, char letter) {
    c->cell[y][x] = letter;
}

/* Along a wire, with its mark in the middle, or a little before it, where no
 * other wire passes; what does not work is dotted. */
static void draw_wire(struct canvas *c, unsigned node, unsigned d,
                      enum host_wire_state state) {
    struct place a = place_of(node), b = place_of(node | 1u << d);
    int steps = d == 0 ? RIGHT : d == 1 ? UP : BACK_Y;
    int at = d == 0 ? RIGHT / 2 - 2 : d == 1 ? UP - 1 : 1;
    char line = d == 0 ? '-' : d == 1 ? '|' : '/';
    for (int i = 1; i < steps; i++) {
        int x = a.x + (b.x - a.x) * i / steps;
        int y = a.y + (b.y - a.y) * i / steps;
        bool gap = state != HOST_WIRE_UP && d == 0 && i % 2 == 0;
        if (i == at && state != HOST_WIRE_UP)
            put(c, x, y, mark_of(state));
        else if (c->cell[y][x] == ' ' || d == 0)
            put(c, x, y, gap ? ' ' : line);
    }
}

static void draw_node(struct canvas *c, unsigned node, bool absent) {
    char text[16];
    struct place at = place_of(node);
    int length = snprintf(text, sizeof text, absent ? "(%u)" : "%u", node);
    int x = at.x - (absent ? 1 : 0);
    memcpy(&c->cell[at.y][x], text, (size_t)length);
}

/* Wires of dimension 3 join what stands in the same place of both cubes. */
static void draw_between(const struct host_drawing *drawing, FILE *out) {
    fprintf(out, "\n    each node of the left to its counterpart:\n   ");
    for (unsigned i = 0; i < 8; i++) {
        enum host_wire_state state = drawing->wire[i][3];
        char mark = state == HOST_WIRE_UP ? '-' : mark_of(state);
        fprintf(out, " %u-%c-%u", i, mark, i + 8);
    }
    fputc('\n', out);
}

static void print_canvas(const struct canvas *c, unsigned dimension,
                         FILE *out) {
    for (int y = 0; y < ROWS; y++) {
        int used = (int)sizeof c->cell[y];
        bool drawn = dimension > 2 || y >= ROWS - 1 - UP;
        drawn = drawn && (dimension > 1 || y == ROWS - 1);
        while (used > 0 && c->cell[y][used - 1] == ' ')
            used--;
        if (drawn)
            fprintf(out, "%.*s\n", used, c->cell[y]);
    }
}

/* Up to HOST_DRAWING_MAX. */
static void host_drawing_draw(const struct host_drawing *drawing, FILE *out) {
    struct canvas c;
    unsigned nodes = 1u << drawing->dimension;
    unsigned dimensions = drawing->dimension < 3 ? drawing->dimension : 3;
    memset(c.cell, ' ', sizeof c.cell);
    for (unsigned d = dimensions; d-- > 0;) {
        for (unsigned i = 0; i < nodes; i++)
            if ((i >> d & 1) == 0)
                draw_wire(&c, i, d, drawing->wire[i][d]);
    }
    for (unsigned i = 0; i < nodes; i++)
        draw_node(&c, i, drawing->absent[i]);
    print_canvas(&c, drawing->dimension, out);
    if (drawing->dimension == HOST_DRAWING_MAX)
        draw_between(drawing, out);
    enum host_wire_state host = drawing->wire[0][drawing->dimension];
    char mark = host == HOST_WIRE_UP ? '|' : mark_of(host);
    fprintf(out, "%*s%c\n%*shost\n", LEFT, "", mark, LEFT, "");
}

/* A letter for each link of a node. */
static void host_drawing_row(const struct host_drawing *drawing, unsigned node,
                             char text[CUBE_LINKS_MAX + 1]) {
    for (unsigned d = 0; d < drawing->dimension; d++)
        text[d] = mark_of(drawing->wire[node & ~(1u << d)][d]);
    text[drawing->dimension] = '\0';
}

/* wires: the cube as its nodes see it, and what is wrong with it. */

static enum host_wire_state state_of(const struct node_link_state *link) {
    return link->dead                    ? HOST_WIRE_DEAD
           : link->state == LINK_REFUSED ? HOST_WIRE_WRONG
           : link->state == LINK_UP || link->state == LINK_SILENT
               ? HOST_WIRE_UP
               : HOST_WIRE_DOWN;
}

static void add_end(struct host_drawing *drawing, unsigned node, unsigned d,
                    const struct node_link_state *link) {
    unsigned lower = d < drawing->dimension ? node & ~(1u << d) : node;
    uint8_t *wire = &drawing->wire[lower][d];
    enum host_wire_state state = state_of(link);
    if (*wire == HOST_WIRE_UNKNOWN || state > *wire)
        *wire = (uint8_t)state;
}

static struct node_link_state
host_shell_own_link(const struct host_shell *shell);

static void host_shell_note_lost(struct host_shell *shell, unsigned node);

static void gather(struct host_shell *shell, struct host_drawing *drawing) {
    struct node_link_state link = host_shell_own_link(shell);
    drawing->dimension = shell->machine.dimension;
    memset(drawing->wire, HOST_WIRE_UNKNOWN, sizeof drawing->wire);
    add_end(drawing, 0, drawing->dimension, &link);
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct host_session_node *n = &shell->session.node[i];
        drawing->absent[i] = !n->answered;
        for (unsigned d = 0; n->answered && d < drawing->dimension &&
                             (d + 1) * sizeof link <= n->size;
             d++) {
            memcpy(&link, n->answer + d * sizeof link, sizeof link);
            add_end(drawing, i, d, &link);
        }
        if (n->answered)
            host_shell_note_lost(shell, i);
    }
}

static void say_line(void *context, const char *text) {
    host_shell_say(context, "%s", text);
}

/* Beyond what a person can see: a row a node, equal ones folded. */
static void tell_matrix(struct host_shell *shell,
                        const struct host_drawing *drawing) {
    struct host_fold fold = {0};
    char text[CUBE_LINKS_MAX + 1], heading[] = "0123456789";
    heading[drawing->dimension] = '\0';
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        host_drawing_row(drawing, i, text);
        host_fold_add(&fold, i, text);
    }
    host_fold_print(&fold, heading, say_line, shell);
    host_fold_free(&fold);
}

static void tell_drawing(struct host_shell *shell,
                         const struct host_drawing *drawing) {
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return;
    host_drawing_draw(drawing, out);
    if (fclose(out) == 0) {
        for (char *p = text, *end; *p != '\0'; p = end + 1) {
            end = strchr(p, '\n');
            host_shell_say(shell, "%.*s", (int)(end - p), p);
        }
    }
    free(text);
}

static const char *host_shell_state(const struct node_link_state *link,
                                    char *text, size_t size);

/* "wrong wire: node 3 link 1" of an end of the wire that says so, or NULL. */
static const char *said_by_end(const struct host_shell *shell, unsigned node,
                               unsigned d, char *text, size_t size) {
    const struct host_session_node *n = &shell->session.node[node];
    struct node_link_state link;
    if (d == shell->machine.dimension) {
        link = host_shell_own_link(shell);
        return host_shell_state(&link, text, size);
    }
    if (!n->answered || (d + 1) * sizeof link > n->size)
        return NULL;
    memcpy(&link, n->answer + d * sizeof link, sizeof link);
    return state_of(&link) == HOST_WIRE_UP
               ? NULL
               : host_shell_state(&link, text, size);
}

/* Each wire that is not up; their number. */
static unsigned tell_faults(struct host_shell *shell,
                            const struct host_drawing *drawing, json_t *list) {
    unsigned faults = 0;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        for (unsigned d = 0; d <= drawing->dimension; d++) {
            char to[16] = "the host", text[64], own[64];
            bool host = d == drawing->dimension;
            unsigned peer = host ? 0 : i ^ 1u << d;
            const char *why = said_by_end(shell, i, d, own, sizeof own);
            if ((host ? i != 0 : peer < i) ||
                drawing->wire[i][d] == HOST_WIRE_UP)
                continue;
            if (why == NULL && !host)
                why = said_by_end(shell, peer, d, own, sizeof own);
            if (!host)
                snprintf(to, sizeof to, "node %u", peer);
            snprintf(text, sizeof text, "%s",
                     why == NULL ? "neither end answers" : why);
            host_shell_say(shell, "node %u link %u to %s: %s", i, d, to, text);
            (void)json_array_append_new(list, json_pack("{si si ss}", "node",
                                                        (int)i, "link", (int)d,
                                                        "state", text));
            faults++;
        }
    }
    return faults;
}

static int tell(struct host_shell *shell, const struct host_drawing *drawing) {
    json_t *list = json_array();
    char wrong[CUBE_FAULT_BYTES];
    if (drawing->dimension <= HOST_DRAWING_MAX)
        tell_drawing(shell, drawing);
    else
        tell_matrix(shell, drawing);
    unsigned faults = tell_faults(shell, drawing, list);
    bool crossed = cube_wiring_fault(shell->session.cube, wrong);
    if (crossed)
        host_shell_say(shell, "%s", wrong);
    if (faults > 0) {
        host_shell_say(shell, "x dead  ! down  ? wrong  . nobody tells  (n) "
                              "does not answer");
    }
    if (shell->object != NULL) {
        (void)json_object_set_new(shell->object, "dimension",
                                  json_integer(drawing->dimension));
        (void)json_object_set(shell->object, "not_up", list);
    }
    json_decref(list);
    return faults == 0 ? 0
                       : host_fail(&shell->error, HOST_CUBE,
                                   "wires: %u %s not up; look at their plugs, "
                                   "and whether the nodes at both ends are on",
                                   faults, faults == 1 ? "is" : "are");
}

int host_shell_wires(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_node_set all;
    (void)count, (void)words;
    host_node_set_all(&all, shell->machine.nodes);
    if (host_shell_ask(shell, &all, NODE_LINKS, 0) != 0)
        return shell->error.code;
    struct host_drawing *drawing = calloc(1, sizeof *drawing);
    if (drawing == NULL)
        return host_fail_memory(&shell->error, "the drawing");
    gather(shell, drawing);
    int status = tell(shell, drawing);
    free(drawing);
    return status;
}

/* links: how each link of each node is, and what was lost on it. */

/* How a link is, as struct node_link_state has it: "up", "dead", "wrong wire:
 * node 3"; of the host's own wire as well. */
static const char *host_shell_state(const struct node_link_state *link,
                                    char *text, size_t size) {
    static const char *const states[] = {"down",   "opening", "up",   "silent",
                                         "closed", "closed",  "wrong"};
    static const char *const refusals[] = {"",           "another version",
                                           "wrong wire", "another cube",
                                           "no sizes",   "with another host"};
    bool refused = link->state == LINK_REFUSED &&
                   link->refusal < sizeof refusals / sizeof refusals[0];
    const char *state = link->state < sizeof states / sizeof states[0]
                            ? states[link->state]
                            : "?";
    if (link->dead) {
        snprintf(text, size, "dead");
    } else if (refused && link->refusal == LINK_WRONG_WIRE &&
               link->peer_node != CUBE_HOST) {
        snprintf(text, size, "wrong wire: node %u link %u", link->peer_node,
                 link->peer_port);
    } else if (refused && link->refusal == LINK_WRONG_WIRE) {
        snprintf(text, size, "wrong wire: the host");
    } else {
        snprintf(text, size, "%s", refused ? refusals[link->refusal] : state);
    }
    return text;
}

static struct node_link_state
host_shell_own_link(const struct host_shell *shell) {
    const struct cube *cube = shell->session.cube;
    const struct link_statistics *s = cube_link_statistics(cube, 0);
    const struct link_peer *peer = cube_link_peer(cube, 0);
    uint64_t bad = s->bad_header + s->bad_crc + s->bad_code;
    return (struct node_link_state){
        .state = (uint8_t)cube_link_state(cube, 0),
        .refusal = (uint8_t)peer->refusal,
        .peer_port = peer->port,
        .dead = cube_link_is_dead(cube, 0),
        .peer_node = peer->node,
        .rtt_us = s->rtt_us,
        .frames_in = (uint32_t)s->frames_received,
        .frames_out = (uint32_t)s->frames_sent,
        .retransmitted = (uint32_t)s->retransmitted,
        .bad = (uint32_t)bad,
        .lost = (uint32_t)s->resynchronised,
        .bytes_in = s->bytes_received,
        .bytes_out = s->bytes_sent,
    };
}

/* Remembers what was lost on the links of a node that has answered NODE_LINKS,
 * and notes what has been lost since it did before. */
static void host_shell_note_lost(struct host_shell *shell, unsigned node) {
    const struct host_session_node *n = &shell->session.node[node];
    struct node_link_state link;
    for (unsigned d = 0; !shell->looking && d < CUBE_LINKS_MAX &&
                         (d + 1) * sizeof link <= n->size;
         d++) {
        struct host_shell_lost *before =
            &shell->lost[(size_t)node * CUBE_LINKS_MAX + d];
        memcpy(&link, n->answer + d * sizeof link, sizeof link);
        uint32_t lost = link.lost == UINT32_MAX ? 0 : link.lost;
        bool same = before->epoch == n->who.epoch && before->epoch != 0;
        if (same && lost != before->lost) {
            host_shell_note(shell,
                            "node %u link %u: %" PRIu32 " more bytes "
                            "lost: its driver had no room for them",
                            node, d, lost - before->lost);
        }
        if (same && link.bad != before->bad) {
            host_shell_note(shell,
                            "node %u link %u: %" PRIu32 " more damaged frames",
                            node, d, link.bad - before->bad);
        }
        *before = (struct host_shell_lost){n->who.epoch, link.bad, lost};
    }
}

static void tell_link(struct host_shell *shell, unsigned node, unsigned d,
                      const struct node_link_state *link,
                      struct host_fold *fold, json_t *list) {
    char text[160], state[48], rtt[HOST_SHELL_FIGURE], lost[HOST_SHELL_FIGURE];
    char in[HOST_SHELL_FIGURE], out[HOST_SHELL_FIGURE], to[8];
    bool known = link->lost != UINT32_MAX;
    (void)host_shell_state(link, state, sizeof state);
    snprintf(lost, sizeof lost, "%" PRIu32, link->lost);
    snprintf(to, sizeof to, "%u", d);
    if (node != CUBE_HOST && d == shell->machine.dimension)
        snprintf(to, sizeof to, "host");
    snprintf(text, sizeof text,
             "%-5s %-9s %9s %7s %7s %6" PRIu32 " %6" PRIu32 " %6s", to, state,
             link->rtt_us == 0 ? "-" : host_shell_time(link->rtt_us, rtt),
             host_shell_bytes(link->bytes_in, in),
             host_shell_bytes(link->bytes_out, out), link->retransmitted,
             link->bad, known ? lost : "-");
    host_fold_add(fold, node, text);
    json_t *object = json_pack(
        "{si ss sI sI sI sI sI sI sI}", "link", (int)d, "state", state,
        "rtt_us", (json_int_t)link->rtt_us, "frames_in",
        (json_int_t)link->frames_in, "frames_out", (json_int_t)link->frames_out,
        "retransmitted", (json_int_t)link->retransmitted, "bad",
        (json_int_t)link->bad, "bytes_in", (json_int_t)link->bytes_in,
        "bytes_out", (json_int_t)link->bytes_out);
    (void)json_object_set_new(object, "lost",
                              known ? json_integer(link->lost) : json_null());
    (void)json_array_append_new(list, object);
}

static void show_links_tell(struct host_shell *shell, unsigned node,
                            struct host_fold *fold, json_t *object) {
    const struct host_session_node *n = &shell->session.node[node];
    struct node_link_state link;
    json_t *list = json_array();
    for (unsigned d = 0; d < CUBE_LINKS_MAX && (d + 1) * sizeof link <= n->size;
         d++) {
        memcpy(&link, n->answer + d * sizeof link, sizeof link);
        tell_link(shell, node, d, &link, fold, list);
    }
    (void)json_object_set_new(object, "links", list);
    host_shell_note_lost(shell, node);
}

int host_shell_links(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_node_set set;
    struct host_fold own = {0};
    static const char heading[] =
        "LINK  STATE     ROUNDTRIP      IN     OUT  AGAIN    BAD   LOST";
    if (host_shell_set(shell, count == 0 ? NULL : words[0], &set) != 0)
        return shell->error.code;
    int status =
        host_shell_ask_tell(shell, &set, NODE_LINKS, heading, show_links_tell);
    if (shell->looking)
        return status;
    struct node_link_state link = host_shell_own_link(shell);
    json_t *list = json_array();
    tell_link(shell, CUBE_HOST, 0, &link, &own, list);
    if (own.count > 0)
        host_shell_say(shell, "host   %s", own.row[0].text);
    if (shell->object != NULL)
        (void)json_object_set(shell->object, "host", json_array_get(list, 0));
    json_decref(list);
    host_fold_free(&own);
    return status;
}
