#include "tetrahedra.h"

#include <stdbool.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

uint32_t (*host_tetrahedra_room(struct host_tetrahedra *tets, uint64_t n,
                                struct host_error *error))[4] {
    if (tets->capacity - tets->count < n) {
        uint64_t capacity = tets->capacity + tets->capacity / 2 + n + 4096;
        void *v = host_remap(tets->v, tets->capacity * sizeof *tets->v,
                             capacity * sizeof *tets->v);
        if (v == NULL) { /* no more than is needed */
            capacity = tets->count + n;
            v = host_remap(tets->v, tets->capacity * sizeof *tets->v,
                           capacity * sizeof *tets->v);
        }
        if (v == NULL) {
            host_fail_memory(error, "the tetrahedra");
            return NULL;
        }
        tets->v = v;
        tets->capacity = capacity;
    }
    return tets->v + tets->count;
}

void host_tetrahedra_cut(struct host_tetrahedra *tets, uint64_t count) {
    if (count < tets->count)
        tets->count = count;
}

void host_tetrahedra_trim(struct host_tetrahedra *tets) {
    void *v = host_remap(tets->v, tets->capacity * sizeof *tets->v,
                         tets->count * sizeof *tets->v);
    if (v != NULL) {
        tets->v = v;
        tets->capacity = tets->count;
    }
}

void host_tetrahedra_free(struct host_tetrahedra *tets) {
    host_unmap(tets->v, tets->capacity * sizeof *tets->v);
    *tets = (struct host_tetrahedra){0};
}

struct mapping {
    uint32_t (*to)[4];
    const uint32_t (*from)[4];
    uint64_t count;
    const uint32_t *map;
    unsigned parts;
    bool is_aside;
};

static void map_some(uint32_t (*to)[4], const uint32_t (*from)[4],
                     uint64_t count, const uint32_t *map) {
    if (map == NULL)
        memmove(to, from, (size_t)count * sizeof *to);
    for (uint64_t i = 0; map != NULL && i < count; i++)
        for (int k = 0; k < 4; k++)
            to[i][k] = map[from[i][k]];
}

static void map_part(void *context, unsigned part) {
    enum { POLL = 1 << 11 };
    const struct mapping *m = context;
    uint64_t each = m->count / m->parts, i = each * part;
    uint64_t last = part + 1 == m->parts ? m->count : i + each;
    while (i < last && !host_call_cancelled()) {
        uint64_t n = last - i > POLL ? POLL : last - i;
        if (m->is_aside) {
            uint32_t row[POLL][4];
            host_fetch(row, m->from[i], (size_t)n * sizeof *row);
            map_some(row, (const uint32_t(*)[4])row, n, m->map);
            host_store(m->to[i], row, (size_t)n * sizeof *row);
            host_call_trim((size_t)n * sizeof *m->map);
        } else {
            map_some(m->to + i, m->from + i, n, m->map);
        }
        i += n;
    }
}

static void map_rows(uint32_t (*to)[4], const uint32_t (*from)[4],
                     uint64_t count, const uint32_t *map) {
    enum { FORK_ROWS = 1 << 14 }; /* fewer are not worth a thread */
    struct mapping m = {to,
                        from,
                        count,
                        map,
                        count < FORK_ROWS ? 1 : host_threads(),
                        count > host_call_share() / sizeof *to};
    host_fork_all(m.parts, map_part, &m);
}

void host_tetrahedra_map(struct host_tetrahedra *tets, const uint32_t *map) {
    map_rows(tets->v, (const uint32_t(*)[4])tets->v, tets->count, map);
}

int host_tetrahedra_join(struct host_tetrahedra *tets, unsigned lists,
                         const uint32_t *map, struct host_error *error) {
    uint64_t all = 0;
    for (unsigned i = 1; i < lists; i++)
        all += tets[i].count;
    if (all > 0 && host_tetrahedra_room(&tets[0], all, error) == NULL)
        return error->code;
    if (map != NULL)
        host_tetrahedra_map(&tets[0], map);
    for (unsigned i = 1; i < lists; i++) {
        map_rows(tets[0].v + tets[0].count, (const uint32_t(*)[4])tets[i].v,
                 tets[i].count, map);
        tets[0].count += tets[i].count;
        host_tetrahedra_free(&tets[i]);
    }
    return 0;
}
