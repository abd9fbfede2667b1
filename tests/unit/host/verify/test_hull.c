/* The check of a surface by itself, on facets that no boundary of tetrahedra
 * can be: open, or turned inside out. */
#include "host/verify/parts.h"
#include "tests/unit/host/verify/check_world.h"

struct heard {
    const char *what;
    int times;
};

static void hear_one(void *context, const uint64_t *tets, int tet_count,
                     const uint32_t *vertices, int count, const char *what) {
    struct heard *h = context;
    (void)tets, (void)tet_count, (void)vertices, (void)count;
    h->times += strcmp(what, h->what) == 0;
}

/* Of the tetrahedra {0 1 2 3}, {0 1 3 4} and {0 5 1 6}, facets as corner + 4 *
 * tetrahedron; returns how often it hears `what`. */
static int heard(const uint32_t *facets, int n, const char *what) {
    static const double xyz[21] = {0, 0, 0,  1, 0, 0, 0, 1, 0, 0, 0,
                                   1, 0, -1, 0, 1, 1, 0, 0, 0, -1};
    static uint32_t v[3][4] = {{0, 1, 2, 3}, {0, 1, 3, 4}, {0, 5, 1, 6}};
    static const uint32_t lowest[7] = {0, 1, 2, 3, 4, 5, 6};
    const struct host_tetrahedra tets = {v, 3, 3};
    const struct host_sites sites = {NULL, xyz, lowest, 7};
    struct host_hull hull = {.sites = &sites, .tets = &tets};
    struct heard h = {what, 0};
    const struct host_hull_listener listener = {&h, hear_one};
    struct host_error error = {0};
    for (int i = 0; i < n; i++) {
        assert_int_equal(
            host_hull_add(&hull, facets[i] / 4, facets[i] % 4, &error), 0);
    }
    assert_int_equal(host_hull_check(&hull, &listener, &error), 0);
    host_hull_free(&hull);
    return h.times;
}

static const char *const other_than_two =
    "is an edge of other than two hull facets";
static const char *const opposite = "has hull facets of opposite orientation";

TEST(open_surfaces_are_found) {
    assert_int_equal(heard((const uint32_t[]){0, 1, 2, 3}, 4, other_than_two),
                     0);
    assert_int_equal(heard((const uint32_t[]){0, 1, 2}, 3, other_than_two), 3);
    /* four at edge 0 1, one at edges 0 2, 1 2, 0 4, 1 4 */
    assert_int_equal(
        heard((const uint32_t[]){2, 3, 4 + 2, 4 + 3}, 4, other_than_two), 5);
}

/* Facet (0 1 3) of the first, and (0 3 1) of the second, run along their common
 * edges each way; facets (0 2 1) and (0 3 1) both from 1 to 0. */
TEST(turned_facets_are_found) {
    assert_int_equal(heard((const uint32_t[]){2, 4 + 3}, 2, opposite), 0);
    assert_int_equal(heard((const uint32_t[]){3, 4 + 3}, 2, opposite), 1);
}

/* Facets (0 2 1) and (0 1 5) lie in one plane and over each other. */
TEST(folds_are_found) {
    assert_int_equal(
        heard((const uint32_t[]){3, 8 + 3}, 2, "is a dent of the hull"), 1);
}

TEST(nothing_has_no_hull) {
    assert_int_equal(heard(NULL, 0, "there is no hull"), 1);
}
