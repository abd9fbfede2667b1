#include "bench_boards_plot.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "host/base/create.h"

enum { WIDTH = 760, LEFT = 110, BAR = 520, TOP = 60, STEP = 44, HIGH = 26 };
enum { KEY_STEP = 70 };

static const char *const colors[HOST_ROOMS] = {"#4477aa", "#aaccee", "#228833",
                                               "#ccbb44", "#66ccee", "#bbbbbb",
                                               "#ee6677", "#aa3377", "#777777"};

double host_boards_share(const struct host_boards_row *row, unsigned room) {
    double all = 0;
    for (unsigned i = 0; i < HOST_ROOMS; i++) {
        all += row->counted[i];
    }
    return all > 0 ? 100 * row->counted[room] / all : 0;
}

static void draw_row(FILE *file, const struct host_boards_row *row, double most,
                     int y) {
    double x = LEFT, length = BAR * row->instructions / most;
    fprintf(file, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s</text>\n",
            LEFT - 8, y + HIGH - 8, row->board);
    for (unsigned i = 0; i < HOST_ROOMS; i++) {
        double part = length * host_boards_share(row, i) / 100;
        fprintf(file,
                "<rect x=\"%.1f\" y=\"%d\" width=\"%.1f\" height=\"%d\" "
                "fill=\"%s\"/>\n",
                x, y, part, HIGH, colors[i]);
        x += part;
    }
    fprintf(file, "<text x=\"%.1f\" y=\"%d\">%.0f</text>\n", x + 6,
            y + HIGH - 8, row->instructions);
}

static void draw_key(FILE *file, int y) {
    for (unsigned i = 0; i < HOST_ROOMS; i++) {
        int x = LEFT + (int)i * KEY_STEP;
        fprintf(file,
                "<rect x=\"%d\" y=\"%d\" width=\"10\" height=\"10\" "
                "fill=\"%s\"/>\n<text x=\"%d\" y=\"%d\" "
                "font-size=\"10\">%s</text>\n",
                x, y, colors[i], x + 13, y + 9, host_room_names[i]);
    }
}

int host_boards_plot(const char *path, const struct host_boards_row *rows,
                     unsigned count, struct host_error *error) {
    double most = 1;
    int y = TOP;
    for (unsigned i = 0; i < count; i++) {
        most = rows[i].instructions > most ? rows[i].instructions : most;
    }
    FILE *file = host_create_over(path);
    if (file != NULL) {
        fprintf(file,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" "
                "height=\"%d\" font-family=\"sans-serif\" font-size=\"13\">\n"
                "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n"
                "<text x=\"%d\" y=\"24\">Instructions a tetrahedron, and "
                "where they go</text>\n",
                WIDTH, TOP + (int)count * STEP + 10, LEFT);
        draw_key(file, TOP - 24);
        for (unsigned i = 0; i < count; i++, y += STEP) {
            draw_row(file, &rows[i], most, y);
        }
        fprintf(file, "</svg>\n");
    }
    if (file == NULL || ferror(file) != 0 || fclose(file) != 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; choose another file", path,
                  strerror(errno));
    }
    return error->code;
}
