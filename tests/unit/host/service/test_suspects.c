/* Which node is doubted, and when: nodes that answer each after its own time,
 * and whose neighbours say so where one is silent for long, in virtual time. */

#include "host/service/parts.h"
#include "tests/unit/test.h"

enum {
    DIMENSION = 3,
    NODES = 8,
    STEP_US = 20000, /* between two checks */
    LINK_US =
        1200000, /* without a byte, and a node says that a link is silent */
    SECOND = 1000000,
    NEVER = 0x7fffffff
};

static struct host_service service;
static struct host_machine machine;
static struct host_work work;
static struct host_node node[NODES];
static struct host_node_report report[NODES];
static bool lost[NODES];
static uint64_t now_us, told_us; /* when a node was doubted first; 0: none */
static char told[400];

static int send_nothing(void *context, const uint8_t *bytes, size_t size) {
    (void)context, (void)bytes;
    return (int)size;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a pipe's signature */
static int receive_nothing(void *context, uint8_t *bytes, size_t size) {
    (void)context, (void)bytes, (void)size;
    return 0;
}

static void hear(void *context, const char *line) {
    (void)context;
    if (told_us == 0) {
        told_us = now_us;
        snprintf(told, sizeof told, "%s", line);
    }
}

static int set_up(void **unused) {
    struct host_error error = {0};
    (void)unused;
    memset(&service, 0, sizeof service);
    memset(node, 0, sizeof node);
    machine =
        (struct host_machine){.nodes = NODES,
                              .dimension = DIMENSION,
                              .epoch = 3,
                              .pipe = {NULL, send_nothing, receive_nothing},
                              .told = hear};
    service.machine = &machine;
    service.node = node;
    service.report = report;
    service.work = work;
    service.work.lost = lost;
    service.patience_us = 60 * SECOND;
    service.started = true;
    service.cube = host_cube_make(&machine, 0, &service.cube_memory, &error);
    assert_non_null(service.cube);
    for (unsigned i = 0; i < NODES; i++) {
        report[i].up = true;
        node[i].links = (1u << DIMENSION) - 1;
    }
    now_us = told_us = 0;
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    free(service.cube_memory);
    return 0;
}

/* Until then; node i answers whenever it has been silent for after_us[i]. */
static void pass(uint64_t until_us, const uint64_t after_us[NODES]) {
    for (; now_us < until_us; now_us += STEP_US) {
        for (unsigned i = 0; i < NODES; i++) {
            if (node[i].silent_us >= after_us[i]) {
                node[i].silent_us = 0;
                host_suspects_heard(&service, i, false);
            }
            node[i].silent_us += STEP_US;
            for (unsigned d = 0; d < DIMENSION; d++) {
                uint32_t bit = (uint32_t)1 << d;
                struct host_node *other = &node[i ^ 1u << d];
                other->silent = node[i].silent_us > LINK_US
                                    ? other->silent | bit
                                    : other->silent & ~bit;
            }
        }
        host_suspects_check(&service, STEP_US);
    }
}

/* More nodes than processors: all are slow, and one is for once slower. */
TEST_WITH(a_busy_machine_is_no_reason, set_up, tear_down) {
    uint64_t slow[NODES];
    for (unsigned i = 0; i < NODES; i++)
        slow[i] = 900000 + 30000 * i;
    pass(10 * SECOND, slow);
    for (unsigned i = 1; i < NODES; i++) {
        uint64_t usual = slow[i];
        slow[i] = 1700000;
        pass(now_us + 4 * SECOND, slow);
        slow[i] = usual;
        pass(now_us + 4 * SECOND, slow);
    }
    if (told_us != 0)
        fail_msg("%s", told);
}

/* One that answers no more is found among quick ones in no time, and among slow
 * ones when it is silent for longer than they are. */
TEST_WITH(one_that_stands_still_is_named, NULL, NULL) {
    for (unsigned i = 1; i < NODES; i++) {
        for (unsigned busy = 0; busy < 2; busy++) {
            uint64_t after_us[NODES];
            char start[40];
            (void)set_up(fixture);
            for (unsigned k = 0; k < NODES; k++)
                after_us[k] = busy == 0 ? 60000 : 900000 + 30000 * k;
            pass(10 * SECOND, after_us);
            assert_int_equal(told_us, 0);
            uint64_t silent_since_us = now_us - node[i].silent_us;
            after_us[i] = NEVER;
            pass(now_us + 10 * SECOND, after_us);
            assert_in_range(told_us - silent_since_us,
                            busy == 0 ? 1300000 : 1800000,
                            busy == 0 ? 1400000 : 2400000);
            snprintf(start, sizeof start, "node %u link", i);
            assert_non_null(strstr(told, start));
            (void)tear_down(fixture);
        }
    }
}
