/* How long a worker works between two looks at the links, on a processor on
 * which a unit of work takes long: the clock ticks with what the triangulator
 * has looked at and built.  Point by point, where nothing tells what was done,
 * it ticks with the basic blocks that incode/ has executed. */

#include "host/mesh/gen.h"
#include "host/mesh/order.h"
#include "node/page_check.h"
#include "node/roles/worker.h"
#include "tests/unit/incode/work_clock.h"
#include "tests/unit/test.h"

enum { MEMORY = 4 << 20, WANTED = 512 };

static struct {
    void *arena;
    struct node_counted counted;
    struct node_fault fault;
    struct host_order order;
    uint32_t wanted[WANTED], count; /* pages that it has asked for */
    uint64_t tick_us;               /* of 64 points looked at, or a
                                       tetrahedron */
    uint64_t looks;                 /* at the clock */
    uint64_t blocks_a_us;           /* instead, unless it is 0 */
} world;

static const struct node_role *const role = &node_worker_role;

/* --- links, in the place of transport/cube.c ------------------------------ */

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    (void)cube;
    assert_int_equal(dest, CUBE_HOST);
    if (type == NODE_PAGE_REQUEST) {
        assert_true(world.count + size / 4 <= WANTED);
        memcpy(&world.wanted[world.count], data, size);
        world.count += (uint32_t)(size / 4);
    }
    return 0;
}

unsigned cube_room(const struct cube *cube, uint16_t dest) {
    (void)cube, (void)dest;
    return 1;
}

/* --- the clock ------------------------------------------------------------ */

static struct node_finished_message totals(void) {
    struct node_finished_message sum;
    memset(&sum, 0, sizeof sum);
    role->totals(world.arena, &sum, 0);
    return sum;
}

static uint64_t now(void) {
    if (world.blocks_a_us != 0)
        return work_blocks / world.blocks_a_us;
    struct incode_statistics s = totals().statistics;
    return world.tick_us * (s.candidates / 64 + s.tetrahedra_built);
}

static uint64_t now_us(void *context) {
    (void)context;
    world.looks++;
    return now();
}

/* --- runs ----------------------------------------------------------------- */

static void open_worker(enum incode_index index, enum incode_build build,
                        unsigned count) {
    bool grid = index == INCODE_GRID;
    struct node_setup_message setup = {.nodes = 1, .credits = 1u << 30};
    struct host_points points = {0};
    struct host_error error = {0};
    struct node_job_message job = {.epoch = 1};
    const struct host_order *order = &world.order;
    memset(&world, 0, sizeof world);
    assert_int_equal(host_gen("uniform", count, 3, &points, &error), 0);
    assert_int_equal(host_order_make(&world.order, "test", points.xyz, count,
                                     HOST_ADAPTIVE, 1, grid, &error),
                     0);
    host_points_free(&points);
    world.arena = aligned_alloc(NODE_ALIGNMENT, MEMORY);
    assert_non_null(world.arena);
    setup.setup.bricks = order->bricks;
    setup.setup.index = (uint8_t)index;
    setup.setup.build = (uint8_t)build;
    memcpy(setup.setup.lo, order->lo, sizeof order->lo);
    memcpy(setup.setup.hi, order->hi, sizeof order->hi);
    if (grid)
        memcpy(setup.setup.cells, order->cells, sizeof setup.setup.cells);
    assert_true(
        role->start(world.arena, MEMORY, &setup, &world.counted, &world.fault));
    job.job.last = order->bricks;
    memcpy(job.job.lo, order->lo, sizeof order->lo);
    memcpy(job.job.hi, order->hi, sizeof order->hi);
    const struct cube_message message = {.source = CUBE_HOST,
                                         .type = NODE_JOB,
                                         .data = (const uint8_t *)&job,
                                         .size = sizeof job};
    role->message(world.arena, &message, 0);
}

static void close_worker(void) {
    host_order_free(&world.order);
    free(world.arena);
}

static void deliver(void) {
    struct node_page_message body;
    while (world.count > 0) {
        body.head.page = world.wanted[--world.count];
        size_t size = host_page(&world.order, body.head.page, body.data);
        const struct cube_message message = {
            .source = CUBE_HOST,
            .type = NODE_PAGE,
            .data = (const uint8_t *)&body,
            .size = (uint16_t)node_page_seal(&body, 0, size)};
        role->message(world.arena, &message, 0);
    }
    assert_false(node_fault_is_set(&world.fault));
}

/* The longest time between two looks at the links. */
static uint64_t longest(uint64_t tick_us) {
    struct node_pace pace;
    uint64_t most = 0;
    world.tick_us = tick_us;
    node_pace_init(&pace, now_us, NULL);
    for (unsigned i = 0; role->done(world.arena) == 0; i++) {
        assert_true(i < 10000000);
        uint64_t begun = now();
        node_pace_begin(&pace, begun);
        (void)role->work(world.arena, &pace);
        uint64_t took = now() - begun;
        most = took > most ? took : most;
        (void)role->send(world.arena);
        deliver();
    }
    return most;
}

/* Where 64 points take 30 us, and where they take next to nothing. */
TEST(no_index_works_for_long) {
    static const struct {
        enum incode_index index;
        unsigned points;
    } runs[] = {{INCODE_NAIVE, 1500}, {INCODE_GRID, 3000}, {INCODE_KD, 3000}};
    for (unsigned i = 0; i < sizeof runs / sizeof runs[0]; i++) {
        uint64_t built[2];
        for (unsigned slow = 0; slow < 2; slow++) {
            open_worker(runs[i].index, INCODE_BUILD_FACES, runs[i].points);
            uint64_t most = longest(slow ? 30 : 0);
            assert_true(most <= NODE_PACE_US);
            built[slow] = totals().statistics.tetrahedra_kept;
            close_worker();
        }
        assert_int_equal(built[0], built[1]);
    }
}

/* Where it is quick, the clock is looked at once for many steps. */
TEST(a_quick_processor_looks_seldom) {
    open_worker(INCODE_KD, INCODE_BUILD_FACES, 3000);
    (void)longest(0);
    assert_true(world.looks < totals().statistics.vertices / 10);
    close_worker();
}

/* Half of the tetrahedra of 9,000 points are a hundred milliseconds' work,
 * where a microsecond is as many blocks as it is on a processor of 2.5 GHz. */
TEST(points_are_inserted_a_few_at_a_time) {
    open_worker(INCODE_KD, INCODE_BUILD_POINTS, 9000);
    world.blocks_a_us = 500;
    uint64_t begun = now(), most = longest(0), all = now() - begun;
    print_message("at most %u of %u us, %u looks at the clock\n",
                  (unsigned)most, (unsigned)all, (unsigned)world.looks);
    assert_true(totals().statistics.tetrahedra_by_points > 50000);
    assert_true(world.looks > 20);
    assert_true(most <= NODE_PACE_US);
    close_worker();
}

/* A processor on which work takes ten milliseconds a unit, and a look that
 * finds none nothing. */
struct slow {
    uint64_t now_us;
    uint32_t most; /* units of a step */
    bool has_work;
};

static uint64_t slow_now_us(void *context) {
    const struct slow *slow = context;
    return slow->now_us;
}

static bool slow_step(void *context, uint32_t units, uint32_t *spent) {
    struct slow *slow = context;
    *spent = slow->has_work ? units : 1;
    slow->now_us += slow->has_work ? units * UINT64_C(10000) : 0;
    if (slow->has_work && units > slow->most)
        slow->most = units;
    return slow->has_work;
}

/* However often a node has looked for work in vain, it does not take work for
 * quick. */
TEST(looks_in_vain_teach_nothing) {
    struct slow slow = {.now_us = 1};
    struct node_pace pace;
    node_pace_init(&pace, slow_now_us, &slow);
    for (int i = 0; i < 2000; i++) {
        slow.has_work = i >= 1000;
        node_pace_begin(&pace, slow.now_us);
        (void)node_pace_work(&pace, slow_step, &slow);
    }
    assert_int_equal(slow.most, NODE_PACE_UNITS_MIN);
}
