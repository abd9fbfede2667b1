#include "adjacency.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

enum {
    POLL_ROWS = 1 << 10, /* between two polls of whether it is cancelled */
    AROUND = 1 << 16     /* bytes that one place far from others touches */
};

/* Every so many tetrahedra, of which each touches a place of its own. */
static bool is_to_end(uint64_t i) {
    if (i % POLL_ROWS == 0)
        host_call_trim(POLL_ROWS * 256);
    return i % POLL_ROWS == 0 && host_call_cancelled();
}

static uint32_t lower(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static uint32_t higher(uint32_t a, uint32_t b) {
    return a < b ? b : a;
}

/* first[p] .. first[p + 1]: where the rows with vertex p at `rank` stand in
 * `order` (NULL: only count). */
static void index_by(const struct host_tetrahedra *tets, int rank,
                     uint32_t vertices, uint32_t *first, uint32_t *order) {
    for (uint64_t i = 0; i < tets->count; i++) {
        if (is_to_end(i))
            return;
        first[tets->v[i][rank] + 1]++;
    }
    for (uint32_t p = 0; p < vertices; p++)
        first[p + 1] += first[p];
    if (order == NULL)
        return;
    for (uint64_t i = 0; i < tets->count; i++) {
        if (is_to_end(i))
            return;
        order[first[tets->v[i][rank]]++] = (uint32_t)i;
    }
    memmove(first + 1, first, (size_t)vertices * sizeof *first);
    first[0] = 0;
}

static int sort_seconds(struct host_adjacency *a, struct host_error *error) {
    uint32_t(*row)[4] =
        host_tetrahedra_room(&a->seconds, a->tets->count, error);
    if (row == NULL)
        return error->code;
    for (uint64_t i = 0; i < a->tets->count && !is_to_end(i); i++) {
        const uint32_t *v = a->tets->v[i];
        row[i][0] = v[1];
        row[i][1] = lower(v[2], v[3]);
        row[i][2] = higher(v[2], v[3]);
        row[i][3] = (uint32_t)i;
    }
    host_tetrahedra_keep(&a->seconds, a->tets->count);
    host_rows_sort(&a->seconds);
    return 0;
}

static int index_all(struct host_adjacency *a, struct host_error *error) {
    size_t first = ((size_t)a->vertices + 1) * sizeof(uint32_t);
    size_t order = (size_t)a->tets->count * sizeof(uint32_t);
    bool is_aside = a->tets->count > host_call_share() / sizeof *a->tets->v;
    a->first_by_lowest = host_map(first);
    a->first_by_second = host_map(first);
    a->by_second = is_aside ? NULL : host_map(order);
    if (a->first_by_lowest == NULL || a->first_by_second == NULL ||
        (a->by_second == NULL && !is_aside))
        return host_fail_memory(error, "the neighbours of the tetrahedra");
    if (is_aside && sort_seconds(a, error) != 0)
        return error->code;
    index_by(a->tets, 0, a->vertices, a->first_by_lowest, NULL);
    if (is_aside)
        index_by(&a->seconds, 0, a->vertices, a->first_by_second, NULL);
    else
        index_by(a->tets, 1, a->vertices, a->first_by_second, a->by_second);
    return host_call_cancelled()
               ? host_fail(error, HOST_BROKEN, "host: cancelled")
               : 0;
}

int host_adjacency_make(struct host_adjacency *a,
                        const struct host_tetrahedra *tets, uint32_t vertices,
                        struct host_error *error) {
    *a = (struct host_adjacency){.tets = tets, .vertices = vertices};
    if (tets->count >= UINT32_MAX) {
        return host_fail(
            error, HOST_BROKEN,
            "host: the neighbours of 2^32 - 1 tetrahedra or more "
            "cannot be numbered for a file of them; do without these, or take "
            "fewer points");
    }
    if (index_all(a, error) != 0)
        host_adjacency_free(a);
    return error->code;
}

void host_adjacency_free(struct host_adjacency *a) {
    size_t first = ((size_t)a->vertices + 1) * sizeof(uint32_t);
    size_t order =
        a->tets == NULL ? 0 : (size_t)a->tets->count * sizeof(uint32_t);
    host_unmap(a->first_by_lowest, first);
    host_unmap(a->first_by_second, first);
    host_unmap(a->by_second, order);
    host_tetrahedra_free(&a->seconds);
    *a = (struct host_adjacency){0};
}

void host_group_free(struct host_group *group) {
    host_unmap(group->facet, group->capacity * sizeof *group->facet);
    *group = (struct host_group){0};
}

static int reserve(struct host_group *group, size_t count,
                   struct host_error *error) {
    group->count = 0;
    if (group->capacity >= count)
        return 0;
    struct host_facet *grown =
        host_remap(group->facet, group->capacity * sizeof *group->facet,
                   2 * count * sizeof *group->facet);
    if (grown == NULL)
        return host_fail_memory(error, "the facets at a vertex");
    group->facet = grown;
    group->capacity = 2 * count;
    return 0;
}

static int compare(const void *p, const void *q) {
    const struct host_facet *a = p, *b = q;
    if (a->others != b->others)
        return a->others < b->others ? -1 : 1;
    return a->tet < b->tet ? -1 : a->tet > b->tet;
}

static void sort_group(struct host_group *group) {
    enum { INSERTION_MAX = 100 };
    struct host_facet *f = group->facet;
    if (group->count > INSERTION_MAX) {
        qsort(f, group->count, sizeof *f, compare);
        return;
    }
    for (size_t i = 1; i < group->count; i++) {
        struct host_facet t = f[i];
        size_t j = i;
        while (j > 0 && compare(&t, &f[j - 1]) < 0) {
            f[j] = f[j - 1];
            j--;
        }
        f[j] = t;
    }
}

static void add(struct host_group *group, uint32_t q, uint32_t r, uint32_t tet,
                uint32_t corner) {
    group->facet[group->count++] = (struct host_facet){
        (uint64_t)lower(q, r) << 32 | higher(q, r), tet, corner};
}

int host_adjacency_group(const struct host_adjacency *a, uint32_t p,
                         struct host_group *group, struct host_error *error) {
    uint32_t i = a->first_by_lowest[p], end = a->first_by_lowest[p + 1];
    uint32_t j = a->first_by_second[p], last = a->first_by_second[p + 1];
    if (reserve(group, 3 * (size_t)(end - i) + (last - j), error) != 0)
        return error->code;
    for (; i < end; i++) {
        const uint32_t *v = a->tets->v[i];
        add(group, v[2], v[3], i, 1);
        add(group, v[1], v[3], i, 2);
        add(group, v[1], v[2], i, 3);
    }
    for (; j < last && a->by_second == NULL; j++) {
        const uint32_t *row = a->seconds.v[j];
        add(group, row[1], row[2], row[3], 0);
    }
    for (; j < last; j++) {
        const uint32_t *v = a->tets->v[a->by_second[j]];
        add(group, v[2], v[3], a->by_second[j], 0);
    }
    host_call_trim(group->count * sizeof *a->tets->v);
    sort_group(group);
    return 0;
}

void host_facet_outward(const uint32_t tet[4], uint32_t corner,
                        uint32_t facet[3]) {
    static const uint8_t outward[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    for (int i = 0; i < 3; i++)
        facet[i] = tet[outward[corner][i]];
}
