#include "facets.h"

#include <stdbool.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

enum { PARTS_MAX = 2 };

/* A well-mixed word (the finaliser of Steele, Lea and Flood's SplitMix64). */
static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* Twice the area between the origin and the edge from point p to point q. */
static uint64_t area(uint64_t p, uint64_t q)
{
    uint64_t low = UINT32_MAX;
    return (p & low) * (q >> 32) - (q & low) * (p >> 32);
}

/* Adds at each vertex the triangle of the three others, seen from there. */
static void add_row(uint64_t *sum, const uint32_t v[4])
{
    uint64_t a = mix(v[0]), b = mix(v[1]), c = mix(v[2]), d = mix(v[3]);
    uint64_t ab = area(a, b), ac = area(a, c), ad = area(a, d);
    uint64_t bc = area(b, c), bd = area(b, d), cd = area(c, d);
    sum[v[0]] += bd - bc - cd;
    sum[v[1]] += ac + cd - ad;
    sum[v[2]] += ad - ab - bd;
    sum[v[3]] += ab + bc - ac;
}

struct count {
    const struct host_tetrahedra *tets;
    uint64_t vertices;
    uint64_t *sum[PARTS_MAX];
    unsigned parts;
};

static void count_part(void *context, unsigned part)
{
    const struct count *c = context;
    uint64_t first = c->tets->count * part / c->parts;
    uint64_t last = c->tets->count * (part + 1) / c->parts;
    for (uint64_t i = first; i < last; i++) {
        add_row(c->sum[part], c->tets->v[i]);
    }
}

static uint64_t count_vertices(const struct count *c)
{
    uint64_t on_hull = 0;
    for (uint64_t v = 0; v < c->vertices; v++) {
        uint64_t sum = 0;
        for (unsigned i = 0; i < c->parts; i++) {
            sum += c->sum[i][v];
        }
        on_hull += sum != 0;
    }
    return on_hull;
}

int host_hull_facets(const struct host_tetrahedra *tets, uint64_t vertices,
                     uint64_t *facets, struct host_error *error)
{
    struct count c = {.tets = tets, .vertices = vertices};
    c.parts = host_threads() < PARTS_MAX ? host_threads() : PARTS_MAX;
    bool enough = true;
    for (unsigned i = 0; i < c.parts; i++) {
        c.sum[i] = host_map(vertices * sizeof *c.sum[i]);
        enough = enough && c.sum[i] != NULL;
    }
    if (enough) {
        host_fork_all(c.parts, count_part, &c);
        uint64_t on_hull = count_vertices(&c);
        *facets = on_hull < 4 ? 0 : 2 * on_hull - 4;
    } else {
        host_fail_memory(error, "counting the hull");
    }
    for (unsigned i = 0; i < c.parts; i++) {
        host_unmap(c.sum[i], vertices * sizeof *c.sum[i]);
    }
    return error->code;
}
