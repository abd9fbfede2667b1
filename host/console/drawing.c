#include "drawing.h"

#include <string.h>

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
        if (i == at && state != HOST_WIRE_UP) {
            put(c, x, y, mark_of(state));
        } else if (c->cell[y][x] == ' ' || d == 0) {
            put(c, x, y, gap ? ' ' : line);
        }
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
        while (used > 0 && c->cell[y][used - 1] == ' ') {
            used--;
        }
        if (drawn) {
            fprintf(out, "%.*s\n", used, c->cell[y]);
        }
    }
}

void host_drawing_draw(const struct host_drawing *drawing, FILE *out) {
    struct canvas c;
    unsigned nodes = 1u << drawing->dimension;
    unsigned dimensions = drawing->dimension < 3 ? drawing->dimension : 3;
    memset(c.cell, ' ', sizeof c.cell);
    for (unsigned d = dimensions; d-- > 0;) {
        for (unsigned i = 0; i < nodes; i++) {
            if ((i >> d & 1) == 0) {
                draw_wire(&c, i, d, drawing->wire[i][d]);
            }
        }
    }
    for (unsigned i = 0; i < nodes; i++) {
        draw_node(&c, i, drawing->absent[i]);
    }
    print_canvas(&c, drawing->dimension, out);
    if (drawing->dimension == HOST_DRAWING_MAX) {
        draw_between(drawing, out);
    }
    enum host_wire_state host = drawing->wire[0][drawing->dimension];
    char mark = host == HOST_WIRE_UP ? '|' : mark_of(host);
    fprintf(out, "%*s%c\n%*shost\n", LEFT, "", mark, LEFT, "");
}

void host_drawing_row(const struct host_drawing *drawing, unsigned node,
                      char text[CUBE_LINKS_MAX + 1]) {
    for (unsigned d = 0; d < drawing->dimension; d++) {
        text[d] = mark_of(drawing->wire[node & ~(1u << d)][d]);
    }
    text[drawing->dimension] = '\0';
}
