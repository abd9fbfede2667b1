#include "tetrahedra.h"

#include <nettle/sha2.h>
#include <stdio.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

uint32_t (*host_tetrahedra_room(struct host_tetrahedra *tets, uint64_t n,
                                struct host_error *error))[4] {
    if (tets->capacity - tets->count < n) {
        uint64_t capacity = tets->capacity + tets->capacity / 2 + n + 4096;
        void *v = host_remap(tets->v, tets->capacity * sizeof *tets->v,
                             capacity * sizeof *tets->v);
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
    if (count < tets->count) {
        tets->count = count;
    }
}

void host_tetrahedra_free(struct host_tetrahedra *tets) {
    host_unmap(tets->v, tets->capacity * sizeof *tets->v);
    *tets = (struct host_tetrahedra){0};
}

struct mapping {
    struct host_tetrahedra *tets;
    const uint32_t *map;
    unsigned parts;
};

static void map_part(void *context, unsigned part) {
    const struct mapping *m = context;
    uint64_t each = m->tets->count / m->parts;
    uint64_t first = each * part;
    uint64_t last = part + 1 == m->parts ? m->tets->count : first + each;
    for (uint64_t i = first; i < last; i++) {
        for (int k = 0; k < 4; k++) {
            m->tets->v[i][k] = m->map[m->tets->v[i][k]];
        }
    }
}

void host_tetrahedra_map(struct host_tetrahedra *tets, const uint32_t *map) {
    struct mapping m = {tets, map, host_threads()};
    host_fork_all(m.parts, map_part, &m);
}

void host_digest(const struct host_tetrahedra *tets,
                 struct host_digest *digest) {
    enum { ROWS = 2048 };
    struct sha256_ctx sha;
    sha256_init(&sha);
    uint32_t row[ROWS][4];
    for (uint64_t done = 0; done < tets->count;) {
        uint64_t n = tets->count - done < ROWS ? tets->count - done : ROWS;
        memcpy(row, tets->v + done, n * sizeof *row);
        for (uint64_t i = 0; i < n; i++) {
            uint32_t c = row[i][2], d = row[i][3];
            row[i][2] = c < d ? c : d;
            row[i][3] = c < d ? d : c;
        }
        sha256_update(&sha, n * sizeof *row, (const uint8_t *)row);
        done += n;
    }
    uint8_t sum[SHA256_DIGEST_SIZE];
    sha256_digest(&sha, sizeof sum, sum);
    char *out = digest->text + sprintf(digest->text, "sha256:");
    for (size_t i = 0; i < sizeof sum; i++) {
        out += sprintf(out, "%02x", sum[i]);
    }
}
