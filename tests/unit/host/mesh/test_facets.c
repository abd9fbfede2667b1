/* Hull facets by cancelling, against counting, on blocks of cubes cut into
 * tetrahedra: each cube into the six that go round its diagonal. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "host/mesh/facets.h"

/* The corners of a cube as steps along x, y, z in each of the six orders;
 * an odd order is turned to positive orientation. */
static void add_cube(struct host_tetrahedra *tets, uint32_t corner,
                     const uint32_t step[3], struct host_error *error)
{
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                    {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (int i = 0; i < 6; i++) {
        uint32_t a = corner + step[order[i][0]];
        uint32_t b = a + step[order[i][1]];
        uint32_t c = b + step[order[i][2]];
        uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, error);
        assert_non_null(row);
        (*row)[0] = corner;
        (*row)[1] = i < 3 ? a : b;
        (*row)[2] = i < 3 ? b : a;
        (*row)[3] = c;
        host_tetrahedra_keep(tets, 1);
    }
}

static void test_blocks(void **unused)
{
    (void)unused;
    for (uint32_t n = 1; n <= 9; n++) {
        struct host_tetrahedra tets = {0};
        struct host_error error = {0};
        const uint32_t step[3] = {1, n + 1, (n + 1) * (n + 1)};
        uint64_t facets = 0;
        for (uint32_t i = 0; i < n * n * n; i++) {
            add_cube(&tets,
                     i % n * step[0] + i / n % n * step[1] +
                         i / n / n * step[2],
                     step, &error);
        }
        assert_int_equal(host_hull_facets(&tets, (n + 1) * (n + 1) * (n + 1),
                                          &facets, &error),
                         0);
        assert_int_equal(facets, 12 * n * n);
        host_tetrahedra_free(&tets);
    }
}

static void test_nothing(void **unused)
{
    (void)unused;
    struct host_tetrahedra tets = {0};
    struct host_error error = {0};
    uint64_t facets = 1;
    assert_int_equal(host_hull_facets(&tets, 64, &facets, &error), 0);
    assert_int_equal(facets, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
