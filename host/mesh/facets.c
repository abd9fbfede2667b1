#include "facets.h"

#include "host/base/memory.h"

/* A well-mixed word (the finaliser of Steele, Lea and Flood's SplitMix64). */
static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* Adds the facet (a, b, c), seen from inside, to its vertices. */
static void add_facet(uint64_t *sum, uint32_t a, uint32_t b, uint32_t c)
{
    uint64_t sign = (uint64_t)0 - ((a > b) ^ (b > c) ^ (a > c));
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    uint32_t least = low < c ? low : c, most = high > c ? high : c;
    uint32_t middle = a ^ b ^ c ^ least ^ most;
    uint64_t number = mix((uint64_t)least << 32 | middle) + most;
    number = (mix(number) ^ sign) - sign;
    sum[a] += number;
    sum[b] += number;
    sum[c] += number;
}

int host_hull_facets(const struct host_tetrahedra *tets, uint64_t vertices,
                     uint64_t *facets, struct host_error *error)
{
    uint64_t *sum = host_map(vertices * sizeof *sum);
    uint64_t on_hull = 0;
    if (sum == NULL) {
        return host_fail_memory(error, "counting the hull");
    }
    for (uint64_t i = 0; i < tets->count; i++) {
        const uint32_t *v = tets->v[i];
        add_facet(sum, v[1], v[2], v[3]);
        add_facet(sum, v[0], v[3], v[2]);
        add_facet(sum, v[0], v[1], v[3]);
        add_facet(sum, v[0], v[2], v[1]);
    }
    for (uint64_t v = 0; v < vertices; v++) {
        on_hull += sum[v] != 0;
    }
    host_unmap(sum, vertices * sizeof *sum);
    *facets = on_hull < 4 ? 0 : 2 * on_hull - 4;
    return 0;
}
