/* What the host of a cube keeps is taken again: a brick counts if all of its
 * tetrahedra are there, and if it was not to be done again. */
#include <fcntl.h>
#include <unistd.h>

#include "host/base/create.h"
#include "host/service/kept.h"
#include "tests/unit/host/service/small_order.h"

enum { NODES = 2, ROWS = 5 /* of a brick */, LATER_US = 1000000 };

static struct host_order order;
static struct host_ledger ledger;
static struct host_tetrahedra tets;
static struct host_journal journal;
static struct host_kept kept;
static char path[64];
static int folder;
static uint64_t now_us;

/* A host that starts, and takes what is kept. */
static void begin(void) {
    struct host_error error = {0};
    assert_int_equal(
        host_journal_open(&journal, folder, "spool", "spool", &error), 0);
    assert_int_equal(host_ledger_init(&ledger, order.bricks, NODES, &error), 0);
    ledger.owner_rule = INCODE_OWNER_LOWEST;
    kept = (struct host_kept){.journal = &journal, .key = 1};
    assert_int_equal(host_kept_load(&kept, &ledger, &order, &tets, &error), 0);
    if (ledger.committed > 0)
        (void)host_ledger_abandon(&ledger, 1, &order, &tets);
    host_kept_lost(&kept, &ledger, &tets);
    (void)host_ledger_open(&ledger, 0, 0, order.bricks);
}

static void end(void) {
    host_journal_close(&journal);
    host_kept_free(&kept);
    host_ledger_free(&ledger);
    host_tetrahedra_free(&tets);
}

static int set_up(void **unused) {
    struct host_error error = {0};
    (void)unused;
    (void)snprintf(path, sizeof path, "/tmp/incode-kept-XXXXXX");
    if (mkdtemp(path) == NULL)
        return -1;
    folder = host_folder_open(path, &error);
    order = small_order(2);
    begin();
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    end();
    host_order_free(&order);
    (void)unlinkat(folder, "spool", 0);
    (void)close(folder);
    return rmdir(path);
}

static void put_rows(uint32_t brick, uint32_t count) {
    struct host_error error = {0};
    uint32_t(*v)[4] = host_tetrahedra_room(&tets, count, &error);
    assert_non_null(v);
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < 4; k++)
            v[i][k] = brick * INCODE_BRICK_POINTS + i + k;
    host_tetrahedra_keep(&tets, count);
    host_kept_rows(&kept, &ledger, &order, (const uint32_t(*)[4])v, count);
    assert_int_equal(host_ledger_found(&ledger, 0, count, &error), 0);
}

static void commit(uint32_t brick) {
    struct host_error error = {0};
    assert_int_equal(host_ledger_commit(&ledger, 0, brick), 0);
    assert_int_equal(host_kept_brick(&kept, &ledger, brick, &error), 0);
}

static void write_record(void) {
    struct host_error error = {0};
    now_us += LATER_US;
    assert_int_equal(host_kept_write(&kept, &tets, now_us, &error), 0);
}

static void put_brick(uint32_t brick) {
    put_rows(brick, ROWS);
    commit(brick);
    write_record();
}

/* A loss: what is not committed is dropped. */
static void lose(void) {
    struct host_error error = {0};
    assert_int_equal(host_kept_lose(&kept, &tets, &error), 0);
    (void)host_ledger_abandon(&ledger, 1, &order, &tets);
    host_kept_lost(&kept, &ledger, &tets);
    (void)host_ledger_open(&ledger, 0, 0, order.bricks);
}

static void start_again(void) {
    end();
    begin();
}

/* Flips a bit of byte `at` of the file. */
static void flip(uint64_t at) {
    uint8_t byte;
    int file = openat(folder, "spool", O_RDWR);
    assert_int_equal(pread(file, &byte, 1, (off_t)at), 1);
    byte ^= 4;
    assert_int_equal(pwrite(file, &byte, 1, (off_t)at), 1);
    assert_int_equal(close(file), 0);
}

/* Committed bricks are these bits, and the list has their tetrahedra alone. */
static void assert_bricks(unsigned bits) {
    unsigned committed = 0, has[8] = {0};
    for (uint32_t b = 0; b < 8; b++)
        committed |= host_ledger_committed(&ledger, b) ? 1u << b : 0;
    assert_int_equal(committed, bits);
    assert_int_equal(kept.resumed, __builtin_popcount(bits));
    for (uint64_t i = 0; i < tets.count; i++)
        has[tets.v[i][0] / INCODE_BRICK_POINTS]++;
    for (uint32_t b = 0; b < 8; b++)
        assert_int_equal(has[b], (bits >> b & 1) * ROWS);
}

TEST_WITH(test_committed_bricks, set_up, tear_down) {
    (void)fixture;
    put_brick(0);
    put_rows(2, 3); /* goes on in the next record */
    put_brick(3);
    put_rows(2, 0);
    start_again();
    assert_bricks(1 | 8);
    put_brick(2);
    start_again();
    assert_bricks(1 | 4 | 8);
}

TEST_WITH(test_rows_of_two_records, set_up, tear_down) {
    (void)fixture;
    put_rows(2, 3);
    put_brick(0);
    put_rows(2, ROWS - 3);
    commit(2);
    write_record();
    start_again();
    assert_bricks(1 | 4);
}

/* A brick some of whose tetrahedra were in a damaged record does not count. */
TEST_WITH(test_rows_that_are_missing, set_up, tear_down) {
    (void)fixture;
    put_rows(2, 3);
    put_brick(0);
    uint64_t first = journal.end;
    put_rows(2, ROWS - 3);
    put_brick(1);
    commit(2);
    write_record();
    put_brick(3);
    flip(70); /* of the first record's payload */
    start_again();
    assert_int_equal(kept.unsound, 1);
    assert_bricks(2 | 8);
    flip(70);
    flip(first + 8); /* the head of the second */
    start_again();
    assert_bricks(1 | 8);
    assert_true(journal.damaged > 0);
}

/* What a loss dropped comes again, and counts once. */
TEST_WITH(test_a_loss, set_up, tear_down) {
    (void)fixture;
    put_rows(2, 4);
    put_brick(0);
    lose();
    put_rows(2, 1); /* with the four that were dropped: as many as it has */
    put_brick(1);
    put_rows(2, ROWS - 1);
    commit(2);
    write_record();
    start_again();
    assert_bricks(1 | 2 | 4);
}

/* The number of a generation says so even if its first record is damaged. */
TEST_WITH(test_a_loss_behind_damage, set_up, tear_down) {
    (void)fixture;
    put_rows(2, 4);
    put_brick(0);
    lose();
    uint64_t second = journal.end;
    put_rows(2, 4);
    put_brick(1);
    put_rows(2, 1);
    commit(2);
    write_record();
    flip(second + 70);
    start_again();
    assert_bricks(1);
}

TEST_WITH(test_bricks_to_be_done_again, set_up, tear_down) {
    struct host_error error = {0};
    (void)fixture;
    put_brick(0);
    put_brick(1);
    host_ledger_reopen(&ledger, 1);
    assert_int_equal(host_kept_brick(&kept, &ledger, 1, &error), 0);
    lose();
    start_again();
    assert_bricks(1);
    put_brick(1);
    start_again();
    assert_bricks(1 | 2);
}

/* Not more often than it is time; at a loss at once. */
TEST_WITH(test_when_it_is_written, set_up, tear_down) {
    struct host_error error = {0};
    (void)fixture;
    put_brick(0);
    uint64_t end_before = journal.end;
    put_rows(1, ROWS);
    commit(1);
    assert_int_equal(host_kept_write(&kept, &tets, now_us + 1, &error), 0);
    assert_int_equal(journal.end, end_before);
    lose();
    assert_true(journal.end > end_before);
    start_again();
    assert_bricks(1 | 2);
}

TEST_WITH(test_another_order, set_up, tear_down) {
    struct host_error error = {0};
    (void)fixture;
    put_brick(0);
    end();
    assert_int_equal(
        host_journal_open(&journal, folder, "spool", "spool", &error), 0);
    assert_int_equal(host_ledger_init(&ledger, order.bricks, NODES, &error), 0);
    kept = (struct host_kept){.journal = &journal, .key = 2};
    assert_int_equal(host_kept_load(&kept, &ledger, &order, &tets, &error), 0);
    assert_bricks(0);
}

TEST(test_nothing_to_keep) {
    struct host_error error = {0};
    host_kept_rows(NULL, &ledger, &order, NULL, 3);
    assert_int_equal(host_kept_load(NULL, &ledger, &order, &tets, &error), 0);
    assert_int_equal(host_kept_brick(NULL, &ledger, 0, &error), 0);
    assert_int_equal(host_kept_write(NULL, &tets, 0, &error), 0);
    assert_int_equal(host_kept_lose(NULL, &tets, &error), 0);
    host_kept_lost(NULL, &ledger, &tets);
    host_kept_free(NULL);
}
