/* The order of the points against plain definitions: every row once, regions
 * and boxes as stated, pages as nodes will see them. */
#include <math.h>

#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "host/mesh/duplicates.h"
#include "host/mesh/order.h"
#include "incode/pages/pager.h"
#include "tests/unit/test.h"

static uint64_t state = 7;

static double draw(void) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double *random_points(size_t n, double levels) {
    double *xyz = malloc(n * 3 * sizeof *xyz);
    assert_non_null(xyz);
    for (size_t i = 0; i < 3 * n; i++) {
        double c = draw();
        xyz[i] = levels > 0 ? floor(c * levels) : c;
    }
    return xyz;
}

static int same(const double *p, const double *q) {
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

static int compare_rows(const void *a, const void *b, void *context) {
    const double *xyz = context;
    const uint32_t *p = a, *q = b;
    for (int d = 0; d < 3; d++) {
        double x = xyz[3 * (size_t)*p + (size_t)d];
        double y = xyz[3 * (size_t)*q + (size_t)d];
        if (x != y)
            return x < y ? -1 : 1;
    }
    return *p < *q ? -1 : *p > *q;
}

/* The lowest row of each point, by sorting. */
static uint8_t *lowest_rows(double *xyz, size_t n, size_t *distinct) {
    uint32_t *rows = malloc(n * sizeof *rows);
    uint8_t *lowest = calloc(n, 1);
    assert_non_null(rows);
    assert_non_null(lowest);
    for (size_t i = 0; i < n; i++)
        rows[i] = (uint32_t)i;
    qsort_r(rows, n, sizeof *rows, compare_rows, xyz);
    *distinct = 0;
    for (size_t i = 0; i < n; i++) {
        if (i == 0 ||
            !same(xyz + 3 * (size_t)rows[i], xyz + 3 * (size_t)rows[i - 1])) {
            lowest[rows[i]] = 1;
            ++*distinct;
        }
    }
    free(rows);
    return lowest;
}

static void check_rows(const struct host_order *order, double *xyz, size_t n) {
    size_t distinct;
    uint8_t *lowest = lowest_rows(xyz, n, &distinct);
    assert_int_equal(order->points, distinct);
    assert_int_equal(order->duplicates, n - distinct);
    size_t seen = 0;
    for (uint32_t b = 0; b < order->bricks; b++) {
        assert_in_range(order->fill[b], 1, INCODE_BRICK_POINTS);
        for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i++) {
            uint32_t v = b * INCODE_BRICK_POINTS + i;
            double p[3], last[3];
            host_vertex(order, v, p);
            if (i >= order->fill[b]) {
                host_vertex(order, b * 64 + order->fill[b] - 1u, last);
                assert_true(same(p, last));
                assert_int_equal(order->row[v], INCODE_NONE);
                continue;
            }
            seen++;
            assert_true(order->row[v] < n);
            assert_true(same(p, xyz + 3 * (size_t)order->row[v]));
            assert_int_equal(lowest[order->row[v]], 1);
            lowest[order->row[v]] = 2;
        }
    }
    assert_int_equal(seen, distinct);
    free(lowest);
}

static void check_regions(const struct host_order *order,
                          enum host_partition partition) {
    uint32_t brick = 0, points = 0;
    for (uint32_t r = 0; r < order->regions; r++) {
        const struct host_region *region = &order->region[r];
        assert_int_equal(region->first, brick);
        assert_int_equal(region->last - region->first,
                         (region->points + 63) / 64);
        uint32_t mine = 0;
        for (; brick < region->last; brick++) {
            assert_true(order->fill[brick] == 64 || brick + 1 == region->last);
            mine += order->fill[brick];
            for (uint32_t i = 0; i < order->fill[brick]; i++) {
                double p[3];
                host_vertex(order, brick * 64 + i, p);
                for (int d = 0; d < 3; d++) {
                    assert_true(p[d] >= region->lo[d]);
                    assert_true(p[d] <= region->hi[d]);
                    assert_true(partition != HOST_UNIFORM ||
                                p[d] < region->hi[d] ||
                                region->hi[d] == order->hi[d]);
                }
            }
        }
        assert_int_equal(mine, region->points);
        points += mine;
    }
    assert_int_equal(brick, order->bricks);
    assert_int_equal(points, order->points);
}

static void check_boxes(const struct host_order *order) {
    const struct incode_tree *tree = &order->tree;
    double box_lo[3][INCODE_FANOUT], box_hi[3][INCODE_FANOUT];
    union incode_page page;
    for (uint32_t l = 1; l < tree->levels; l++) {
        for (uint32_t c = 0; c < tree->count[l] * INCODE_FANOUT; c++) {
            uint32_t number = tree->base[l] + c / INCODE_FANOUT;
            assert_int_equal(incode_tree_level(tree, number), l);
            assert_int_equal(host_page(order, number, &page), 1568);
            incode_boxes_axes(&page.boxes, box_lo, box_hi);
            uint64_t width = 1;
            for (uint32_t k = 1; k < l; k++)
                width *= INCODE_FANOUT;
            double lo[3] = {INFINITY, INFINITY, INFINITY};
            double hi[3] = {-INFINITY, -INFINITY, -INFINITY};
            for (uint64_t b = c * width;
                 b < (c + 1) * width && b < order->bricks; b++) {
                for (uint32_t i = 0; i < order->fill[b]; i++) {
                    double p[3];
                    host_vertex(order, (uint32_t)b * 64 + i, p);
                    for (int d = 0; d < 3; d++) {
                        lo[d] = fmin(lo[d], p[d]);
                        hi[d] = fmax(hi[d], p[d]);
                    }
                }
            }
            for (int d = 0; d < 3; d++) {
                double slack = page.boxes.unit * 0x1p-22;
                uint32_t i = c % INCODE_FANOUT;
                assert_true(box_lo[d][i] <= lo[d]);
                assert_true(box_hi[d][i] >= hi[d]);
                assert_true(box_lo[d][i] >= lo[d] - slack);
                assert_true(box_hi[d][i] <= hi[d] + slack);
            }
        }
    }
}

static void check_bricks(const struct host_order *order) {
    double page[192];
    for (uint32_t b = 0; b < order->bricks; b++) {
        size_t count = order->fill[b];
        assert_int_equal(host_page(order, b, page), 24 * count);
        for (uint32_t i = 0; i < count; i++) {
            double p[3], q[3] = {page[i], page[count + i], page[2 * count + i]};
            host_vertex(order, b * 64 + i, p);
            assert_true(same(p, q));
        }
    }
    assert_int_equal(host_page(order, order->tree.pages, page), 0);
}

static void check_grid(const struct host_order *order) {
    uint32_t cells = order->cells[0] * order->cells[1] * order->cells[2];
    const struct incode_tree *tree = &order->tree;
    assert_true(cells >= 1 && cells <= order->points);
    assert_int_equal(order->first_of_cell[0], 0);
    assert_int_equal(order->first_of_cell[cells], order->points);
    union incode_page first, list;
    for (uint32_t c = 0; c < cells; c++) {
        host_page(order, tree->cells_base + c / INCODE_PAGE_WORDS, &first);
        assert_int_equal(first.words.word[c % INCODE_PAGE_WORDS],
                         order->first_of_cell[c]);
        for (uint32_t i = order->first_of_cell[c];
             i < order->first_of_cell[c + 1]; i++) {
            host_page(order, tree->list_base + i / INCODE_PAGE_WORDS, &list);
            uint32_t v = list.words.word[i % INCODE_PAGE_WORDS];
            assert_true(order->row[v] != INCODE_NONE);
            double p[3];
            host_vertex(order, v, p);
            assert_int_equal(
                incode_cell_of(order->lo, order->hi, order->cells, p), c);
        }
    }
}

static void check_all(double *xyz, size_t n, enum host_partition partition,
                      uint32_t regions) {
    struct host_order order;
    struct host_error error = {0};
    assert_int_equal(host_order_make(&order, "test", xyz, n, partition, regions,
                                     true, &error),
                     0);
    check_rows(&order, xyz, n);
    check_regions(&order, partition);
    check_boxes(&order);
    check_bricks(&order);
    check_grid(&order);
    host_order_free(&order);
}

TEST(every_row_once) {
    const size_t sizes[] = {4, 5, 9, 63, 64, 65, 129, 1000, 2049, 70000};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        for (int levels = 0; levels <= 12; levels += 6) {
            for (uint32_t regions = 1; regions <= 32; regions *= 8) {
                double *xyz = random_points(sizes[i], levels);
                xyz[0] = -0.5; /* whatever was drawn, they span the space */
                xyz[4] = -1.5;
                xyz[8] = -2.5;
                check_all(xyz, sizes[i], HOST_ADAPTIVE, regions);
                check_all(xyz, sizes[i], HOST_UNIFORM, regions);
                free(xyz);
            }
        }
    }
}

/* The same where points are put aside: in parts, of about equal numbers. */
TEST(every_row_once_where_they_are_aside) {
    const double levels[] = {0, 40, 12};
    struct host_scratch scratch;
    struct host_error error = {0};
    struct host_call call = {
        .threads = 4, .memory_max = UINT64_MAX, .scratch = &scratch};
    assert_int_equal(
        host_scratch_begin_own(&scratch, "/tmp", 1 << 20, 4, &error), 0);
    host_call_enter(&call);
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
        struct host_order order;
        double *xyz = random_points(70000, levels[i]);
        for (uint32_t regions = 1; regions <= 128; regions *= 32) {
            check_all(xyz, 70000, HOST_ADAPTIVE, regions);
            check_all(xyz, 70000, HOST_UNIFORM, regions);
        }
        assert_int_equal(host_order_make(&order, "test", xyz, 70000,
                                         HOST_ADAPTIVE, 8, false, &error),
                         0);
        for (uint32_t r = 0; r < 8; r++)
            assert_in_range(order.region[r].points, order.points / 8 / 3 * 2,
                            order.points / 8 / 2 * 3);
        host_order_free(&order);
        free(xyz);
    }
    assert_int_equal(scratch.arrays, 0);
    assert_int_equal(call.memory, 0);
    host_call_enter(NULL);
    host_scratch_end(&scratch);
}

/* Bricks as tight as a k-d arrangement makes them, and box pages too. */
TEST(bricks_are_compact) {
    size_t n = 100000;
    double *xyz = random_points(n, 0);
    struct host_order order;
    struct host_error error = {0};
    assert_int_equal(host_order_make(&order, "test", xyz, n, HOST_ADAPTIVE, 1,
                                     false, &error),
                     0);
    double surface = 0, pages = 0;
    for (uint32_t c = 0; c < order.tree.count[0]; c++) {
        const struct incode_boxes *b = &order.boxes[c / INCODE_FANOUT];
        uint32_t i = c % INCODE_FANOUT;
        double e[3];
        for (int d = 0; d < 3; d++)
            e[d] = b->unit * (double)(b->hi[d][i] - b->lo[d][i]);
        surface += 2 * (e[0] * e[1] + e[1] * e[2] + e[2] * e[0]);
    }
    for (uint32_t c = 0; c < order.tree.count[1]; c++) {
        const struct incode_boxes *b =
            &order.boxes[order.tree.base[2] - order.tree.base[1] +
                         c / INCODE_FANOUT];
        uint32_t i = c % INCODE_FANOUT;
        pages += pow(b->unit, 3) * (double)(b->hi[0][i] - b->lo[0][i]) *
                 (double)(b->hi[1][i] - b->lo[1][i]) *
                 (double)(b->hi[2][i] - b->lo[2][i]);
    }
    double cube = 6 * cbrt((double)order.bricks); /* perfect cubes */
    assert_true(surface < 1.15 * cube);
    assert_true(pages < 1.3);
    host_order_free(&order);
    free(xyz);
}

/* A region is a function of the points, whatever their order in the input. */
TEST(shuffling_changes_no_region) {
    size_t n = 5000;
    double *xyz = random_points(n, 9);
    struct host_order a, b;
    struct host_error error = {0};
    host_order_make(&a, "test", xyz, n, HOST_ADAPTIVE, 8, false, &error);
    for (size_t i = n - 1; i > 0; i--) {
        size_t j = (size_t)(draw() * (double)(i + 1));
        for (size_t d = 0; d < 3; d++) {
            double t = xyz[3 * i + d];
            xyz[3 * i + d] = xyz[3 * j + d];
            xyz[3 * j + d] = t;
        }
    }
    host_order_make(&b, "test", xyz, n, HOST_ADAPTIVE, 8, false, &error);
    assert_int_equal(error.code, 0);
    assert_int_equal(a.bricks, b.bricks);
    for (uint32_t k = 0; k < a.bricks; k++) {
        assert_int_equal(a.fill[k], b.fill[k]);
        for (uint32_t i = 0; i < a.fill[k]; i++) {
            double p[3], q[3];
            int found = 0;
            host_vertex(&a, 64 * k + i, p);
            for (uint32_t j = 0; j < b.fill[k]; j++) {
                host_vertex(&b, 64 * k + j, q);
                found += same(p, q);
            }
            assert_int_equal(found, 1);
        }
    }
    host_order_free(&a);
    host_order_free(&b);
    free(xyz);
}

TEST(signed_zeros_are_one) {
    const double xyz[] = {0.0, 0.0, 0.0,  1, 0, 0, 0, 1, 0,   0, 0, 1,
                          -0., 0.0, -0.0, 1, 0, 0, 0, 1, -0., 2, 2, 2};
    struct host_order order;
    struct host_error error = {0};
    assert_int_equal(host_order_make(&order, "test", xyz, 8, HOST_ADAPTIVE, 1,
                                     false, &error),
                     0);
    assert_int_equal(order.points, 5);
    assert_int_equal(order.duplicates, 3);
    assert_int_equal(order.negative_zeros, 3);
    for (uint32_t v = 0; v < 5; v++) {
        double p[3];
        host_vertex(&order, v, p);
        assert_false(signbit(p[0]) || signbit(p[1]) || signbit(p[2]));
        assert_true(order.row[v] < 4 || order.row[v] == 7);
    }
    host_order_free(&order);
}

/* Each thread counts its rows. */
TEST(signed_zeros_are_counted) {
    const size_t rows = (1 << 17) + 5;
    double *xyz = random_points(rows, 0);
    struct host_distinct distinct;
    struct host_error error = {0};
    uint64_t count = 0;
    for (size_t i = 0; i < 3 * rows; i += 7) {
        xyz[i] = i % 2 == 0 ? -0.0 : 0.0;
        count += i % 2 == 0;
    }
    assert_int_equal(host_distinct_make(&distinct, xyz, rows, &error), 0);
    assert_int_equal(distinct.negative_zeros, count);
    host_distinct_free(&distinct);
    free(xyz);
}

TEST(extreme_coordinates) {
    double *xyz = random_points(3000, 0);
    for (size_t i = 0; i < 9000; i++) {
        int power = i % 7 == 0 ? 1023 : i % 7 == 1 ? -1074 : 0;
        xyz[i] = ldexp(xyz[i] - 0.5, power);
    }
    check_all(xyz, 3000, HOST_ADAPTIVE, 8);
    check_all(xyz, 3000, HOST_UNIFORM, 8);
    free(xyz);
}

/* The origin of the only page of boxes, and the middle of all points. */
static void origin_of(const double *xyz, size_t n, double origin[3],
                      double middle[3]) {
    struct host_order order;
    struct host_error error = {0};
    assert_int_equal(host_order_make(&order, "test", xyz, n, HOST_ADAPTIVE, 1,
                                     false, &error),
                     0);
    assert_int_equal(order.tree.levels, 2);
    memcpy(origin, order.boxes[0].origin, sizeof order.boxes[0].origin);
    for (int d = 0; d < 3; d++)
        middle[d] = 0.5 * order.lo[d] + 0.5 * order.hi[d];
    host_order_free(&order);
}

/* A brick of one point is no reason to move the origin; one that is small is.
 */
TEST(boxes_are_finest_where_they_are_small) {
    enum { POINTS = 16 * INCODE_BRICK_POINTS };
    double origin[3], middle[3], *xyz = random_points(POINTS + 1, 0);
    origin_of(xyz, POINTS + 1, origin, middle);
    assert_true(same(origin, middle));
    for (size_t i = 0; i < (size_t)3 * POINTS / 2; i++)
        xyz[i] = 0.25 + 0x1p-20 * xyz[i];
    origin_of(xyz, POINTS + 1, origin, middle);
    for (int d = 0; d < 3; d++)
        assert_true(fabs(origin[d] - 0.25) < 0x1p-19);
    free(xyz);
}

TEST(flat_input_is_refused) {
    struct host_order order;
    struct host_error error = {0};
    double xyz[3 * 200];
    for (int i = 0; i < 200; i++) {
        int pair = i / 2; /* 100 distinct ones */
        double t = pair;
        xyz[3 * i] = t, xyz[3 * i + 1] = 2 * t, xyz[3 * i + 2] = 3 * t;
    }
    assert_int_equal(host_order_make(&order, "a.xyz", xyz, 200, HOST_UNIFORM, 4,
                                     true, &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "a.xyz: all 100 distinct points"));
    assert_non_null(strstr(error.text, "line"));
    for (int i = 0; i < 200; i++) {
        xyz[3 * i + 1] = i % 17;
        xyz[3 * i + 2] = xyz[3 * i] - 4 * xyz[3 * i + 1];
    }
    error = (struct host_error){0};
    assert_int_equal(host_order_make(&order, "a.xyz", xyz, 200, HOST_UNIFORM, 4,
                                     true, &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "plane"));
    error = (struct host_error){0};
    assert_int_equal(
        host_order_make(&order, "a.xyz", xyz, 3, HOST_UNIFORM, 1, 0, &error),
        HOST_INPUT);
    assert_non_null(strstr(error.text, "3 distinct points"));
    error = (struct host_error){0};
    assert_int_equal(
        host_order_make(&order, "a.xyz", xyz, 0, HOST_UNIFORM, 1, 0, &error),
        HOST_INPUT);
}
