/* The list of tetrahedra: canonical order against a plain sort, the digest
 * against a known one. */

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "host/mesh/adjacency.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

static uint64_t state = 3;

static uint32_t draw(uint32_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((state >> 33) % below);
}

static void add(struct host_tetrahedra *tets, uint32_t a, uint32_t b,
                uint32_t c, uint32_t d) {
    struct host_error error = {0};
    uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, &error);
    assert_non_null(row);
    const uint32_t v[4] = {a, b, c, d};
    memcpy(*row, v, sizeof v);
    host_tetrahedra_keep(tets, 1);
}

/* Ascending vertices, then whether the row is an even permutation of them. */
static void key_of(const uint32_t v[4], uint32_t key[5]) {
    memcpy(key, v, 4 * sizeof *v);
    key[4] = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3 - i; k++) {
            if (key[k] > key[k + 1]) {
                uint32_t t = key[k];
                key[k] = key[k + 1];
                key[k + 1] = t;
                key[4] ^= 1;
            }
        }
    }
}

static int compare_keys(const void *p, const void *q) {
    const uint32_t *a = p, *b = q;
    for (int i = 0; i < 5; i++)
        if (a[i] != b[i])
            return a[i] < b[i] ? -1 : 1;
    return 0;
}

static void check_sort(uint64_t n, uint32_t vertices, uint32_t crowd) {
    struct host_tetrahedra tets = {0};
    uint32_t(*key)[5] = malloc(n * sizeof *key);
    assert_non_null(key);
    for (uint64_t i = 0; i < n; i++) {
        uint32_t a = i % 2 == 0 ? draw(vertices) : draw(crowd), b, c, d;
        do {
            b = i % 3 == 0 ? draw(crowd) : draw(vertices);
        } while (b == a);
        do {
            c = draw(vertices);
        } while (c == a || c == b);
        do {
            d = draw(vertices);
        } while (d == a || d == b || d == c);
        add(&tets, a, b, c, d);
        key_of(tets.v[i], key[i]);
    }
    qsort(key, n, sizeof *key, compare_keys);
    for (int again = 0; again < 3; again++) {
        host_tetrahedra_sort(&tets);
        for (uint64_t i = 0; i < n; i++) {
            uint32_t mine[5];
            const uint32_t *v = tets.v[i];
            key_of(v, mine);
            assert_memory_equal(mine, key[i], 4 * sizeof *mine);
            assert_true(v[0] == mine[0] && v[1] == mine[1]);
            /* of equal sets either orientation may come first */
            if ((i == 0 || memcmp(key[i], key[i - 1], 16) != 0) &&
                (i + 1 == n || memcmp(key[i], key[i + 1], 16) != 0))
                assert_int_equal(mine[4], key[i][4]);
        }
        for (uint64_t i = 0; again == 1 && i < n; i++) {
            uint32_t *v = tets.v[i], first = v[0]; /* in order, but not so */
            v[0] = v[1], v[1] = v[2], v[2] = first;
        }
    }
    host_tetrahedra_free(&tets);
    free(key);
}

TEST(order_is_canonical) {
    check_sort(1, 4, 4);
    check_sort(24, 4, 4);
    check_sort(1000, 12, 3);
    check_sort(1000, 4000000000u, 2);
    check_sort(100000, 300, 2);
    check_sort(200000, 70000, 2);
    check_sort(300000, 20000000, 5);
}

/* The same with rows in files: a thread has room for 65,536 in memory.  The
 * last two have more than that with one first vertex. */
TEST(order_is_canonical_where_rows_are_aside) {
    struct host_scratch scratch;
    struct host_error error = {0};
    struct host_call call = {
        .threads = 2, .memory_max = UINT64_MAX, .scratch = &scratch};
    assert_int_equal(
        host_scratch_begin_own(&scratch, "/tmp", 16 << 20, 2, &error), 0);
    host_call_enter(&call);
    check_sort(100000, 70000, 70000);
    check_sort(200000, 20000000, 5000);
    check_sort(200000, 4000000000u, 1000000);
    check_sort(300000, 70000, 2);
    check_sort(300000, 4000000000u, 2);
    assert_int_equal(scratch.arrays, 0);
    assert_int_equal(call.memory, 0);
    host_call_enter(NULL);
    host_scratch_end(&scratch);
}

TEST(every_permutation_keeps_its_sign) {
    for (int code = 0; code < 256; code++) {
        uint32_t v[4] = {(uint32_t)code & 3, (uint32_t)code >> 2 & 3,
                         (uint32_t)code >> 4 & 3, (uint32_t)code >> 6};
        bool used[4] = {false};
        for (int i = 0; i < 4; i++)
            used[v[i]] = true;
        if (!used[0] || !used[1] || !used[2] || !used[3])
            continue;
        struct host_tetrahedra tets = {0};
        uint32_t before[5];
        key_of(v, before);
        add(&tets, v[0], v[1], v[2], v[3]);
        host_tetrahedra_sort(&tets);
        const uint32_t even[4] = {0, 1, 2, 3}, odd[4] = {0, 1, 3, 2};
        assert_memory_equal(tets.v[0], before[4] == 0 ? even : odd, 16);
        host_tetrahedra_free(&tets);
    }
}

TEST(digests_are_known) {
    struct host_tetrahedra tets = {0};
    struct host_digest digest;
    host_digest(&tets, &digest);
    assert_string_equal(digest.text,
                        "sha256:e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b93"
                        "4ca495991b7852b855");
    add(&tets, 1, 0, 3, 2); /* of the one tetrahedron 0 1 2 3 */
    host_tetrahedra_sort(&tets);
    host_digest(&tets, &digest);
    assert_string_equal(digest.text,
                        "sha256:baed642339816affb3fe8719792d0e4ce82f12db72b737"
                        "3d244eaa65445800fe");
    host_tetrahedra_free(&tets);
}

TEST(mapping_and_cutting) {
    struct host_tetrahedra tets = {0};
    const uint32_t map[5] = {50, 40, 30, 20, 10};
    for (int i = 0; i < 1000; i++)
        add(&tets, 0, 1, 2, 3 + (uint32_t)i % 2);
    host_tetrahedra_map(&tets, map);
    for (int i = 0; i < 1000; i++) {
        const uint32_t expected[4] = {50, 40, 30, i % 2 == 0 ? 20 : 10};
        assert_memory_equal(tets.v[i], expected, 16);
    }
    host_tetrahedra_cut(&tets, 7);
    assert_int_equal(tets.count, 7);
    host_tetrahedra_cut(&tets, 9);
    assert_int_equal(tets.count, 7);
    host_tetrahedra_free(&tets);
}

/* Beyond what numbers a neighbour: told before a tetrahedron is looked at. */
TEST(too_many_for_neighbours) {
    const struct host_tetrahedra tets = {.count = UINT32_MAX};
    struct host_adjacency adjacency;
    struct host_error error = {0};
    assert_int_equal(host_adjacency_make(&adjacency, &tets, 4, &error),
                     HOST_BROKEN);
    assert_non_null(strstr(error.text, "2^32 - 1 tetrahedra or more"));
    assert_non_null(strstr(error.text, "; do without these"));
}
