#include "paper_list.h"

#include <math.h>
#include <stdlib.h>

#include "host/base/clock.h"
#include "incode/front/afl.h"
#include "incode/pages/bricks.h"

enum { TIMES = 3 };

/* The faces of a tetrahedron of positive orientation, seen from outside. */
static const uint8_t faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};

/* In the list of its lowest vertex, turned until that comes first. */
static void toggle(struct incode_afl *afl, const uint32_t v[4],
                   const uint8_t face[3]) {
    uint32_t f[3] = {v[face[0]], v[face[1]], v[face[2]]};
    unsigned first =
        f[0] < f[1] ? (f[0] < f[2] ? 0 : 2) : (f[1] < f[2] ? 1 : 2);
    incode_afl_toggle(afl, f[first], f[(first + 1) % 3], f[(first + 2) % 3]);
}

int host_paper_list(const struct host_tetrahedra *tets, uint64_t vertices,
                    struct host_paper_list *list, struct host_error *error) {
    struct incode_afl afl;
    uint32_t capacity = (uint32_t)(2 * tets->count + 4);
    uint32_t bricks = (uint32_t)(vertices / INCODE_BRICK_POINTS + 1);
    void *memory = malloc(incode_afl_bytes(capacity, bricks));
    if (memory == NULL) {
        return host_fail_memory(error, "the active face list");
    }
    list->seconds = INFINITY;
    for (int times = 0; times < TIMES; times++) {
        incode_afl_init(&afl, memory, capacity, bricks, NULL);
        uint64_t start = host_now_us();
        for (uint64_t i = 0; i < tets->count; i++) {
            for (int k = 0; k < 4; k++) {
                toggle(&afl, tets->v[i], faces[k]);
            }
        }
        list->seconds =
            fmin(list->seconds, 1e-6 * (double)(host_now_us() - start));
    }
    list->searches = afl.searches;
    list->accesses = (double)afl.looks / (double)afl.searches;
    list->longest = afl.count_max;
    free(memory);
    return 0;
}
