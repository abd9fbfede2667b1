#include <stdbool.h>
#include <string.h>

#include "check.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/duplicates.h"

static int verify_rows(const struct host_points *points,
                       const struct host_tetrahedra *tets,
                       enum host_check_depth depth,
                       struct host_check_report *report,
                       struct host_error *error) {
    size_t rows = (size_t)points->count;
    uint32_t *lowest = host_map(rows * sizeof *lowest);
    struct host_sites sites = {
        .xyz = points->xyz, .lowest = lowest, .count = rows};
    if (lowest == NULL ||
        (rows > 0 && host_distinct_rows(points->xyz, rows, lowest) == 0))
        host_fail_memory(error, "the check");
    else
        host_check(&sites, tets, depth, NULL, report, error);
    host_unmap(lowest, rows * sizeof *lowest);
    return error->code;
}

/* --- of tetrahedra that are put aside ------------------------------------- */

/* Rows in no order would bring a page back for each vertex.  So the points are
 * ordered in space, and tetrahedra get the vertex numbers of that order, in
 * which neighbours are close: window by window of the rows, as many as a thread
 * has memory for. */

enum { BLOCK_ROWS = 1 << 11 };

struct window {
    uint32_t *vertex; /* [rows] INCODE_NONE: there is none */
    uint64_t first, rows;
};

static void fill_window(const struct window *w,
                        const struct host_order *order) {
    uint64_t count = (uint64_t)order->bricks * INCODE_BRICK_POINTS;
    memset(w->vertex, 0xff, (size_t)w->rows * sizeof *w->vertex);
    for (uint64_t v = 0; v < count; v++) {
        uint64_t row = order->row[v];
        if (v % BLOCK_ROWS == 0)
            host_call_trim(BLOCK_ROWS * sizeof *order->row);
        if (row != INCODE_NONE && row >= w->first && row - w->first < w->rows)
            w->vertex[row - w->first] = (uint32_t)v;
    }
}

/* False: a vertex is no row, or one that repeats another. */
static bool renumber_some(const struct window *w, const uint32_t (*from)[4],
                          uint32_t (*to)[4], size_t n) {
    bool sound = true;
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 4; k++) {
            uint64_t row = from[i][k];
            if (row < w->first || row - w->first >= w->rows)
                continue;
            to[i][k] = w->vertex[row - w->first];
            sound = sound && to[i][k] != INCODE_NONE;
        }
    return sound;
}

static bool renumber_by(const struct window *w,
                        const struct host_tetrahedra *tets,
                        struct host_tetrahedra *to, uint64_t rows) {
    uint32_t from[BLOCK_ROWS][4], next[BLOCK_ROWS][4];
    bool sound = true;
    for (uint64_t i = 0; i < tets->count && sound; i += BLOCK_ROWS) {
        uint64_t left = tets->count - i;
        size_t n = left < BLOCK_ROWS ? (size_t)left : BLOCK_ROWS;
        host_fetch(from, tets->v[i], n * sizeof *from);
        if (w->first > 0)
            host_fetch(next, to->v[i], n * sizeof *next);
        for (size_t k = 0; k < n && w->first == 0; k++)
            for (int c = 0; c < 4; c++)
                sound = sound && from[k][c] < rows;
        sound = sound &&
                renumber_some(w, (const uint32_t(*)[4])from, next, n) &&
                !host_call_cancelled();
        host_store(to->v[i], next, n * sizeof *next);
    }
    return sound;
}

static bool renumber(const struct host_order *order,
                     const struct host_tetrahedra *tets,
                     struct host_tetrahedra *to, struct host_error *error) {
    struct window w = {.rows = 2 * host_call_share() / sizeof *w.vertex};
    size_t bytes = (size_t)w.rows * sizeof *w.vertex;
    w.vertex = host_map_resident(bytes);
    bool sound = w.vertex != NULL &&
                 host_tetrahedra_room(to, tets->count, error) != NULL;
    for (; sound && w.first < order->rows; w.first += w.rows) {
        fill_window(&w, order);
        sound = renumber_by(&w, tets, to, order->rows);
    }
    host_unmap(w.vertex, bytes);
    if (sound) {
        host_tetrahedra_keep(to, tets->count);
        host_tetrahedra_sort(to);
    }
    return sound;
}

/* False: not so, as where all points lie in a plane; nothing is known then. */
static bool verify_aside(const struct host_points *points,
                         const struct host_tetrahedra *tets,
                         enum host_check_depth depth,
                         struct host_check_report *report,
                         struct host_error *error) {
    struct host_order order = {0};
    struct host_tetrahedra numbered = {0};
    struct host_error none = {0};
    bool sound = host_order_make(&order, "points", points->xyz, points->count,
                                 HOST_ADAPTIVE, 1, false, &none) == 0 &&
                 renumber(&order, tets, &numbered, &none);
    if (sound) {
        struct host_sites sites = host_sites_of_order(&order);
        host_check(&sites, &numbered, depth, NULL, report, error);
        report->points = points->count;
    }
    host_tetrahedra_free(&numbered);
    host_order_free(&order);
    return sound;
}

int host_verify(const struct host_points *points,
                const struct host_tetrahedra *tets, enum host_check_depth depth,
                struct host_check_report *report, struct host_error *error) {
    if (tets->count > host_call_share() / sizeof *tets->v &&
        verify_aside(points, tets, depth, report, error))
        return error->code;
    return verify_rows(points, tets, depth, report, error);
}
