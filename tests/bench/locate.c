/* Point location by the library, as the peers of `incode bench peers` do it.
 *
 *     locate POINTS.npy QUERIES.npy THREADS
 *
 * prints how many queries are in a tetrahedron, the times of one call, and a
 * sum over these tetrahedra: peer.hpp has it for the others. */
#include "host/library/incode.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now); /* clock: a benchmark */
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* x, y, z of each row; NULL: it cannot be read. */
static double *read_npy(const char *path, uint64_t *rows) {
    uint8_t head[10];
    double *xyz = NULL;
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return NULL;
    if (fread(head, 1, 10, f) == 10 && fseek(f, 0, SEEK_END) == 0) {
        long end = ftell(f), begin = 10 + head[8] + 256 * head[9];
        size_t bytes = end > begin ? (size_t)(end - begin) : 0;
        xyz = malloc(bytes + 1);
        *rows = bytes / 24;
        if (xyz != NULL && (fseek(f, begin, SEEK_SET) != 0 ||
                            fread(xyz, 1, bytes, f) != bytes)) {
            free(xyz);
            xyz = NULL;
        }
    }
    (void)fclose(f);
    return xyz;
}

/* Of the coordinates of a tetrahedron's vertices, in any order. */
static uint64_t mix(const double *xyz, const uint32_t v[4]) {
    uint64_t sum = 0;
    for (int i = 0; i < 4; i++) {
        uint64_t bits[3];
        memcpy(bits, xyz + 3 * (size_t)v[i], sizeof bits);
        uint64_t x = bits[0] + 3 * bits[1] + 5 * bits[2];
        sum += (x ^ x >> 29) * UINT64_C(0x9e3779b97f4a7c15);
    }
    return sum;
}

int main(int count, char **word) {
    uint64_t points = 0, queries = 0, inside = 0, sum = 0;
    if (count != 4)
        return 2;
    double *xyz = read_npy(word[1], &points);
    double *query = read_npy(word[2], &queries);
    struct incode_options o = {.flags = INCODE_NEIGHBORS};
    struct incode_tetrahedra t;
    if (xyz == NULL || query == NULL)
        exit(3);
    uint64_t *found = malloc(queries * sizeof *found + 1);
    if (found == NULL || incode_delaunay(xyz, points, &o, &t) != INCODE_OK)
        exit(3);
    o = (struct incode_options){.threads = (unsigned)atoi(word[3])};
    double cpu = -seconds(CLOCK_PROCESS_CPUTIME_ID);
    double wall = -seconds(CLOCK_MONOTONIC);
    enum incode_status status =
        incode_locate(xyz, points, &t, query, queries, &o, found, NULL);
    cpu += seconds(CLOCK_PROCESS_CPUTIME_ID);
    wall += seconds(CLOCK_MONOTONIC);
    if (status != INCODE_OK) {
        fprintf(stderr, "%s\n", incode_status_text(status));
        exit(1);
    }
    for (uint64_t i = 0; i < queries; i++) {
        if (found[i] == INCODE_NONE64)
            continue;
        inside++;
        sum += (i + 1) * mix(xyz, t.vertex[found[i]]);
    }
    printf("{\"tetrahedra\": %llu, \"cpu_s\": %.6f, \"wall_s\": %.6f, "
           "\"digest\": \"sum:%016llx\"}\n",
           (unsigned long long)inside, cpu, wall, (unsigned long long)sum);
    free(found);
    free(query);
    free(xyz);
    incode_tetrahedra_free(&t);
    return 0;
}
