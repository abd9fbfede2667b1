/* Changes point sets for tests: exact scaling, mirroring, rotation, shuffling
 * and the way back from a shuffled set's tetrahedra to the original's rows.
 *
 *     points scale 500 < a.xyz > b.xyz          every coordinate times 2^500
 *     points mirror < a.xyz > b.xyz                               x becomes -x
 *     points rotate 0 < a.xyz > b.xyz      out of the axes, and so out of ties
 *     points shuffle 7 < a.xyz > b.xyz
 *     points unshuffle 7 a.xyz < b.ele > a.ele   rows of a for rows of b
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct set {
    double (*p)[3];
    uint32_t count;
};

static void *must(void *memory) {
    if (memory == NULL) {
        perror("points");
        exit(1);
    }
    return memory;
}

static struct set read_points(FILE *in) {
    struct set set = {NULL, 0};
    uint32_t capacity = 0;
    double p[3];
    while (fscanf(in, "%lf %lf %lf", &p[0], &p[1], &p[2]) == 3) {
        if (set.count == capacity) {
            capacity = capacity == 0 ? 1024 : 2 * capacity;
            set.p = must(realloc(set.p, capacity * sizeof *set.p));
        }
        memcpy(set.p[set.count++], p, sizeof p);
    }
    return set;
}

static void print_point(const double p[3]) {
    printf("%.17g %.17g %.17g\n", p[0], p[1], p[2]);
}

/* from[new row] = old row, by Fisher and Yates. */
static uint32_t *permutation(uint32_t count, uint64_t seed) {
    uint32_t *from = must(malloc((count + 1) * sizeof *from));
    uint64_t state = seed * 0x9e3779b97f4a7c15u + 0x2545f4914f6cdd1du;
    for (uint32_t i = 0; i < count; i++)
        from[i] = i;
    for (uint32_t i = count; i > 1; i--) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        uint32_t j = (uint32_t)((state >> 32) * i >> 32);
        uint32_t swap = from[i - 1];
        from[i - 1] = from[j];
        from[j] = swap;
    }
    return from;
}

/* By the angles of cosines 3/5 and 5/13, about z and then about x. */
static void rotate(double p[3]) {
    double x = (3.0 * p[0] - 4.0 * p[1]) / 5.0;
    double y = (4.0 * p[0] + 3.0 * p[1]) / 5.0;
    p[0] = x;
    p[1] = (5.0 * y - 12.0 * p[2]) / 13.0;
    p[2] = (12.0 * y + 5.0 * p[2]) / 13.0;
}

static const struct set *compared;

static int by_point(const void *a, const void *b) {
    uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    for (int d = 0; d < 3; d++) {
        double x = compared->p[i][d], y = compared->p[j][d];
        if (x != y)
            return x < y ? -1 : 1;
    }
    return i < j ? -1 : 1;
}

/* lowest[row] = lowest row with the same point. */
static uint32_t *lowest_rows(const struct set *set) {
    uint32_t *rows = permutation(set->count, 0);
    uint32_t *lowest = must(malloc((set->count + 1) * sizeof *lowest));
    compared = set;
    qsort(rows, set->count, sizeof *rows, by_point);
    for (uint32_t i = 0; i < set->count; i++) {
        const double *p = set->p[rows[i]];
        const double *before = i == 0 ? NULL : set->p[rows[i - 1]];
        int same = i > 0 && p[0] == before[0] && p[1] == before[1] &&
                   p[2] == before[2];
        lowest[rows[i]] = same ? lowest[rows[i - 1]] : rows[i];
    }
    compared = NULL;
    free(rows);
    return lowest;
}

/* An .ele numbered from 0, its vertices mapped; comments are dropped. */
static int unshuffle(const struct set *set, const uint32_t *from) {
    uint32_t *lowest = lowest_rows(set);
    unsigned long rows = 0, row, v[4];
    int done = scanf("%lu %*[^\n]", &rows) == 1;
    printf("%lu 4 0\n", rows);
    for (unsigned long i = 0; done && i < rows; i++) {
        done =
            scanf("%lu %lu %lu %lu %lu", &row, &v[0], &v[1], &v[2], &v[3]) == 5;
        printf("%lu", i);
        for (int k = 0; done && k < 4; k++) {
            done = v[k] < set->count;
            printf(" %u", done ? lowest[from[v[k]]] : 0);
        }
        printf("\n");
    }
    free(lowest);
    return done ? 0 : 1;
}

int main(int argc, char **argv) {
    const char *verb = argc > 1 ? argv[1] : "";
    long argument = argc > 2 ? strtol(argv[2], NULL, 10) : 0;
    FILE *in = argc > 3 ? fopen(argv[3], "r") : stdin;
    struct set set = read_points(must(in));
    uint32_t *from = permutation(set.count, (uint64_t)argument);
    int status = 0;
    if (strcmp(verb, "unshuffle") == 0)
        status = unshuffle(&set, from);
    for (uint32_t i = 0; i < set.count && argc < 4; i++) {
        double p[3];
        memcpy(p, set.p[strcmp(verb, "shuffle") == 0 ? from[i] : i], sizeof p);
        for (int d = 0; d < 3 && strcmp(verb, "scale") == 0; d++)
            p[d] = ldexp(p[d], (int)argument);
        if (strcmp(verb, "mirror") == 0)
            p[0] = -p[0];
        if (strcmp(verb, "rotate") == 0)
            rotate(p);
        print_point(p);
    }
    free(from);
    free(set.p);
    return status;
}
