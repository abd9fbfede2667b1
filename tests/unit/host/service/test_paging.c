/* When the user is told that a run spends its time on pages, and what then. */

#include "host/service/parts.h"
#include "tests/unit/test.h"

/* Of 200,000 points on a sphere, two nodes of 4M. */
enum { NODES = 2, PAGES = 3226, FRAMES = 1105 };

static char told[256];
static unsigned lines;

static void on_line(void *context, const char *line) {
    (void)context;
    snprintf(told, sizeof told, "%s", line);
    lines++;
}

static struct host_service service;
static struct host_machine machine = {.nodes = NODES, .told = on_line};
static struct host_order order;
static struct host_tetrahedra tets;
static struct host_node_report reports[NODES];

static void begin(uint64_t memory, uint64_t tetrahedra) {
    memset(&service, 0, sizeof service);
    memset(reports, 0, sizeof reports);
    order.tree.pages = PAGES;
    tets.count = tetrahedra;
    reports[1].map.map.pages = FRAMES;
    service.machine = &machine;
    service.order = &order;
    service.tets = &tets;
    service.report = reports;
    service.generations = 1;
    service.memory = memory;
    lines = 0;
}

static void send(uint64_t pages) {
    while (pages-- > 0)
        host_paging_sent(&service);
}

TEST(test_told_once) {
    begin(4 << 20, 1000);
    send(NODES * PAGES + HOST_PAGING_AGAIN_MIN - 1);
    assert_int_equal(lines, 0);
    send(1000000);
    host_paging_end(&service);
    assert_int_equal(lines, 1);
    assert_string_equal(
        told, "--memory 4M: a node holds 34 % of these points at a time, and "
              "much of the time goes into pages that it asks for again; "
              "--memory 16M would hold all of them");
}

TEST(test_not_told) {
    begin(4 << 20, 1200000); /* more came of it than it cost */
    send(NODES * PAGES + 199999);
    host_paging_end(&service);
    assert_int_equal(lines, 0);
    send(1);
    assert_int_equal(lines, 1);
    begin(0, 1000); /* nobody wants to know */
    send(1000000);
    assert_int_equal(lines, 0);
    begin(4 << 20, 1000); /* each generation needs them anew */
    service.generations = 100;
    send(100 * NODES * PAGES);
    assert_int_equal(lines, 0);
}

/* What nodes have from each other shows at the end. */
TEST(test_other_nodes) {
    begin(4 << 20, 1000);
    reports[0].statistics.statistics.page_requests = 1000000;
    host_paging_end(&service);
    assert_int_equal(lines, 1);
}

TEST(test_cube) {
    begin(4 << 20, 1000);
    service.memory_of = "boxes.cube";
    send(1000000);
    assert_int_equal(lines, 1);
    assert_null(strstr(told, "--memory"));
    assert_string_equal(
        told, "boxes.cube: memory 4M: a node holds 34 % of these points at a "
              "time, and much of the time goes into pages that it asks for "
              "again; nodes with 16M would hold all of them");
}

TEST(test_advice) {
    assert_int_equal(host_paging_memory(4 << 20, 1105, 1106), 8 << 20);
    assert_int_equal(host_paging_memory(4 << 20, 1105, 4420), 16 << 20);
    assert_int_equal(host_paging_memory(1433600, 335, 336), 2 << 20);
    assert_int_equal(host_paging_memory(512 << 10, 78, 163), 1 << 20);
    assert_int_equal(host_paging_memory(4 << 20, 1105, 1 << 30),
                     HOST_MEMORY_MAX);
    begin(HOST_MEMORY_MAX, 1000);
    send(1000000);
    assert_non_null(strstr(told, "; more nodes would share them"));
    begin(512 << 20, 1000);
    order.tree.pages = 1000000;
    send(10000000);
    assert_non_null(strstr(told, "; --memory 1G would hold more of them"));
}
