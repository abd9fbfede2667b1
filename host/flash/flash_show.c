#include "flash_show.h"

#include <stdio.h>
#include <string.h>

#include "host/base/text.h"

enum { LIST = 160, LINE = 600 };

static const struct host_spread_node *node_of(const struct host_flash_show *s,
                                              unsigned i) {
    return &s->spread->node[i];
}

void host_flash_show_begin(struct host_flash_show *show,
                           const struct host_spread *spread, bool quiet) {
    *show = (struct host_flash_show){.spread = spread, .quiet = quiet};
    for (unsigned i = 0; i < spread->visit->machine->nodes; i++) {
        if (host_node_set_has(&spread->options.nodes, i)) {
            show->node[show->wanted++] = (uint16_t)i;
        }
    }
    host_progress_begin(!quiet);
    unsigned most = host_progress_rows_max();
    if (most > 0) {
        show->nodes_a_row = (show->wanted + most - 1) / most;
        show->rows = (show->wanted + show->nodes_a_row - 1) / show->nodes_a_row;
        host_progress_rows(show->rows);
    }
}

/* Of several nodes, what the one says that is farthest behind. */
static void draw_row(const struct host_flash_show *s, unsigned row) {
    struct host_node_set set = {{0}};
    enum host_spread_phase phase = HOST_SPREAD_LOST;
    unsigned from = row * s->nodes_a_row, count = 0;
    char head[LIST + 8], tail[LIST];
    double part = 0.0;
    for (unsigned k = from; k < s->wanted && k < from + s->nodes_a_row; k++) {
        const struct host_spread_node *n = node_of(s, s->node[k]);
        bool whole = n->phase > HOST_SPREAD_TAKES;
        phase = n->phase < phase ? n->phase : phase;
        part += whole ? 1.0 : (double)n->held / (double)n->blocks;
        count++;
        host_node_set_add(&set, s->node[k]);
    }
    bool moves =
        phase >= HOST_SPREAD_BEGINS && phase <= HOST_SPREAD_DONE && count > 0;
    host_node_set_name(&set, head, sizeof head);
    snprintf(tail, sizeof tail, "%s", host_spread_phase_text(phase));
    host_progress_row(row, head, moves ? part / count : -1.0, tail);
}

void host_flash_show_draw(const struct host_flash_show *show) {
    for (unsigned row = 0; row < show->rows; row++) {
        draw_row(show, row);
    }
    host_progress_draw();
}

void host_flash_show_change(const struct host_flash_show *show, unsigned node) {
    const struct host_spread_node *n = node_of(show, node);
    bool silent = n->phase == HOST_SPREAD_BEGINS ||
                  n->phase == HOST_SPREAD_WHOLE ||
                  (n->phase == HOST_SPREAD_TAKES && n->held != 0) ||
                  n->phase >= HOST_SPREAD_HAS;
    if (show->rows == 0 && !show->quiet && !silent) {
        host_note("flash: node %u: %s", node, host_spread_phase_text(n->phase));
    }
}

/* --- at the end ----------------------------------------------------------- */

/* Those that are as node `first` is, by what is said of them. */
static struct host_node_set alike(const struct host_flash_show *s,
                                  unsigned first) {
    struct host_node_set set = {{0}};
    const struct host_visit_node *seen = s->spread->visit->node;
    for (unsigned k = 0; k < s->wanted; k++) {
        unsigned i = s->node[k];
        const struct host_spread_node *a = node_of(s, i),
                                      *b = node_of(s, first);
        if (a->phase == b->phase && strcmp(a->text, b->text) == 0 &&
            memcmp(seen[i].who.version, seen[first].who.version,
                   sizeof seen[i].who.version) == 0) {
            host_node_set_add(&set, i);
        }
    }
    return set;
}

/* "mps2-an500 0.1.0, number 3" */
static const char *name_image(const struct host_flash_show *s,
                              char text[LIST]) {
    const struct loader_image *image = &s->spread->image;
    snprintf(text, LIST, "%s %s, number %u", image->board, image->version,
             image->number);
    return text;
}

static void say_each(const struct host_flash_show *s,
                     void (*say)(const struct host_flash_show *s, unsigned i,
                                 bool one, char line[LINE])) {
    struct host_node_set told = {{0}};
    for (unsigned k = 0; k < s->wanted; k++) {
        char nodes[LIST + 8], line[LINE] = "";
        unsigned i = s->node[k];
        if (host_node_set_has(&told, i)) {
            continue;
        }
        struct host_node_set set = alike(s, i);
        for (unsigned b = 0; b < sizeof told.bits; b++) {
            told.bits[b] |= set.bits[b];
        }
        say(s, i, host_node_set_count(&set) == 1, line);
        if (line[0] != '\0') {
            host_node_set_name(&set, nodes, sizeof nodes);
            host_say(stdout, "%s: %s\n", nodes, line);
        }
    }
    (void)fflush(stdout);
}

static void say_result(const struct host_flash_show *s, unsigned i, bool one,
                       char line[LINE]) {
    const struct host_spread_node *n = node_of(s, i);
    char image[LIST];
    name_image(s, image);
    if (n->phase == HOST_SPREAD_DONE) {
        snprintf(line, LINE, "%s %s", one ? "runs" : "run", image);
    } else if (n->phase == HOST_SPREAD_HAS) {
        snprintf(line, LINE, "had %s already", image);
    } else if (n->phase == HOST_SPREAD_PASSED) {
        snprintf(line, LINE, "passed over, as it %s", n->text);
    }
}

void host_flash_show_result(const struct host_flash_show *show) {
    if (!show->quiet) {
        say_each(show, say_result);
    }
}

static void say_plan(const struct host_flash_show *s, unsigned i, bool one,
                     char line[LINE]) {
    const struct host_spread_node *n = node_of(s, i);
    const struct node_who *who = &s->spread->visit->node[i].who;
    char image[LIST];
    name_image(s, image);
    if (n->phase == HOST_SPREAD_LEAVES) {
        snprintf(line, LINE, "would restart and be given %s: it runs %.*s",
                 image, (int)sizeof who->version, (const char *)who->version);
    } else if (n->phase == HOST_SPREAD_BEGINS) {
        snprintf(line, LINE, "would be given %s: it is in its loader", image);
    } else {
        say_result(s, i, one, line);
    }
}

void host_flash_show_plan(const struct host_flash_show *show) {
    say_each(show, say_plan);
}
