/* The state of a run is that run's alone: other points, options or versions are
 * refused, and nothing is changed then; an order that is damaged is made
 * again. */
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/journal.h"
#include "host/mesh/gen.h"
#include "host/run/run.h"
#include "host/run/state.h"
#include "tests/unit/test.h"
#include "transport/frame.h"

enum { REGIONS = 4, COPY = 4096 };

static char above[64], folder[80], file[3][96];
static struct host_points points;
static struct host_order order;
static struct host_run_options options;
static struct host_run_result result;
static struct host_error error;

static int set_up(void **unused) {
    static const char *const names[] = {"state", "order", "spool"};
    (void)unused;
    (void)snprintf(above, sizeof above, "/tmp/incode-state-XXXXXX");
    if (mkdtemp(above) == NULL)
        return -1;
    (void)snprintf(folder, sizeof folder, "%s/kept", above);
    for (int i = 0; i < 3; i++)
        (void)snprintf(file[i], sizeof file[i], "%s/%s", folder, names[i]);
    error = (struct host_error){0};
    return host_gen("uniform", 3000, 1, &points, &error);
}

static int tear_down(void **unused) {
    (void)unused;
    host_points_free(&points);
    for (int i = 0; i < 3; i++)
        (void)unlink(file[i]);
    (void)rmdir(folder);
    return rmdir(above);
}

static void set_options(void) {
    host_run_defaults(&options);
    options.resume = folder;
    options.quiet = true;
    options.nodes = REGIONS;
    error = (struct host_error){0};
}

static int begin(void) {
    return host_state_begin(&options, &points, &error);
}

/* The end of a run, with that error. */
static void end(int code) {
    struct host_error of_run = {.code = code};
    assert_int_equal(host_state_end(&options, &of_run), code);
}

/* A run up to its work. */
static void start(void) {
    result = (struct host_run_result){
        .strategy = host_strategy_named("spatial"), .nodes = REGIONS};
    assert_int_equal(begin(), 0);
    assert_int_equal(host_state_order(options.state, &order, "test", &points,
                                      HOST_ADAPTIVE, REGIONS, false, &error),
                     0);
    assert_int_equal(host_state_start(options.state, &order, &result, &error),
                     0);
}

/* The same, and its end in the course of the work. */
static void run(bool done) {
    start();
    assert_int_equal(host_state_order_kept(options.state, &result, &error), 0);
    end(done ? 0 : HOST_BROKEN);
}

static size_t read_file(const char *path, char *bytes, size_t most) {
    int fd = open(path, O_RDONLY);
    ssize_t n = read(fd, bytes, most);
    assert_true(n >= 0);
    assert_int_equal(close(fd), 0);
    return (size_t)n;
}

static void write_file(const char *path, const char *bytes, size_t n) {
    int fd = open(path, O_WRONLY | O_TRUNC);
    assert_int_equal(write(fd, bytes, n), (ssize_t)n);
    assert_int_equal(close(fd), 0);
}

/* Replaces a line of the file `state`, in both copies. */
static void put_line(const char *line) {
    char bytes[2 * COPY], copy[COPY] = "",
                          *name = strndup(line, strcspn(line, " ") + 1);
    assert_int_equal(read_file(file[0], bytes, sizeof bytes), sizeof bytes);
    char *from = strstr(bytes, name), *crc = strstr(bytes, "\ncrc ");
    free(name);
    assert_non_null(from);
    assert_non_null(crc);
    int n =
        snprintf(copy, sizeof copy, "%.*s%s%.*s\n", (int)(from - bytes), bytes,
                 line, (int)(crc - strchr(from, '\n')), strchr(from, '\n'));
    (void)snprintf(copy + n, sizeof copy - (size_t)n, "crc %08x\n",
                   frame_crc32c(0, copy, (size_t)n));
    memcpy(bytes, copy, COPY);
    memcpy(bytes + COPY, copy, COPY);
    write_file(file[0], bytes, sizeof bytes);
}

static void assert_refused(int code, const char *why) {
    char before[2 * COPY], after[2 * COPY];
    struct stat spool[2];
    size_t n = read_file(file[0], before, sizeof before);
    assert_int_equal(stat(file[2], &spool[0]), 0);
    assert_int_equal(begin(), code);
    if (strstr(error.text, why) == NULL)
        fail_msg("%s: not %s", error.text, why);
    assert_int_equal(read_file(file[0], after, sizeof after), n);
    assert_memory_equal(before, after, n);
    assert_int_equal(stat(file[2], &spool[1]), 0);
    assert_int_equal(spool[0].st_size, spool[1].st_size);
    assert_int_equal(spool[0].st_mtim.tv_nsec, spool[1].st_mtim.tv_nsec);
}

TEST_WITH(test_what_is_left, set_up, tear_down) {
    struct stat about;
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    assert_int_equal(stat(folder, &about), 0);
    assert_int_equal(about.st_mode & 0777, 0700);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(stat(file[i], &about), 0);
        assert_int_equal(about.st_mode & 0777, 0600);
    }
    set_options();
    run(true);
    host_order_free(&order);
    assert_int_not_equal(stat(folder, &about), 0);
}

TEST_WITH(test_a_folder_that_was_there, set_up, tear_down) {
    struct stat about;
    (void)fixture;
    assert_int_equal(mkdir(folder, 0700), 0);
    set_options();
    run(true);
    host_order_free(&order);
    assert_int_equal(stat(folder, &about), 0);
    assert_int_not_equal(stat(file[0], &about), 0);
    assert_int_not_equal(stat(file[1], &about), 0);
    assert_int_not_equal(stat(file[2], &about), 0);
}

TEST_WITH(test_what_is_open, set_up, tear_down) {
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    set_options();
    options.nodes = 0;
    assert_int_equal(begin(), 0);
    assert_int_equal(options.nodes, REGIONS);
    assert_ptr_equal(options.strategy, host_strategy_named("spatial"));
    end(HOST_BROKEN);
}

TEST_WITH(test_another_run, set_up, tear_down) {
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    set_options();
    options.strategy = host_strategy_named("exchange");
    assert_refused(HOST_USAGE, "(--strategy spatial there, exchange now)");
    set_options();
    options.nodes = 8;
    assert_refused(HOST_USAGE, "(--nodes 4 there, 8 now)");
    set_options();
    options.partition = HOST_UNIFORM;
    assert_refused(HOST_USAGE, "(--partition adaptive there, uniform now)");
    set_options();
    options.index = INCODE_GRID;
    assert_refused(HOST_USAGE, "(--index kd there, grid now)");
    set_options();
    options.direct = true;
    assert_refused(HOST_USAGE, "(a run on nodes there, threads now)");
    set_options();
    points.xyz[8999] = 0.25;
    assert_refused(HOST_INPUT, "the points' digest");
    points.count--;
    set_options();
    assert_refused(HOST_INPUT, "(points: 3000 there, 2999 now)");
}

TEST_WITH(test_another_version, set_up, tear_down) {
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    put_line("version 0.0.1");
    set_options();
    assert_refused(HOST_INPUT, "(the version 0.0.1 there, ");
    put_line("incode-state 9");
    set_options();
    assert_refused(HOST_INPUT, "(the format 9 there, 2 now)");
}

/* One copy is enough; a run of which no copy is sound begins anew. */
TEST_WITH(test_a_damaged_state, set_up, tear_down) {
    char bytes[2 * COPY];
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    size_t n = read_file(file[0], bytes, sizeof bytes);
    char *nodes = strstr(bytes, "nodes 4");
    assert_non_null(nodes);
    for (int copies = 1; copies <= 3; copies++) {
        char damaged[2 * COPY];
        memcpy(damaged, bytes, sizeof damaged);
        for (int i = 0; i < 2; i++)
            if ((copies >> i & 1) != 0)
                damaged[nodes + 6 - bytes + i * COPY] = '8';
        write_file(file[0], damaged, n);
        set_options();
        options.nodes = 0;
        assert_int_equal(begin(), 0);
        assert_int_equal(options.nodes, copies == 3 ? 0 : REGIONS);
        end(HOST_BROKEN);
    }
}

TEST_WITH(test_other_files, set_up, tear_down) {
    static const char *const texts[] = {"notes\n", "incode\n-state"};
    (void)fixture;
    set_options();
    assert_int_equal(mkdir(folder, 0700), 0);
    for (int i = 0; i < 3; i++) {
        int fd = open(file[i], O_CREAT | O_WRONLY, 0600);
        assert_int_equal(close(fd), 0);
        for (int k = 0; k < 2; k++) {
            char bytes[64];
            set_options();
            write_file(file[i], texts[k], strlen(texts[k]));
            assert_int_equal(begin(), HOST_INPUT);
            assert_non_null(strstr(error.text, "was not made by incode run"));
            assert_int_equal(read_file(file[i], bytes, sizeof bytes),
                             strlen(texts[k]));
        }
        assert_int_equal(unlink(file[i]), 0);
    }
}

/* The same order, bit for bit; or none. */
static void assert_order(const struct host_order *o) {
    struct host_order right;
    assert_int_equal(host_order_make(&right, "test", points.xyz, points.count,
                                     HOST_ADAPTIVE, REGIONS, false, &error),
                     0);
    assert_int_equal(o->bricks, right.bricks);
    assert_int_equal(o->regions, right.regions);
    assert_memory_equal(&o->tree, &right.tree, sizeof right.tree);
    assert_memory_equal(o->brick, right.brick,
                        right.bricks * sizeof *right.brick);
    assert_memory_equal(o->fill, right.fill, right.bricks);
    assert_memory_equal(o->row, right.row,
                        right.bricks * INCODE_BRICK_POINTS * sizeof *right.row);
    assert_memory_equal(o->region, right.region,
                        REGIONS * sizeof *right.region);
    for (uint32_t page = 0; page < right.tree.pages; page++) {
        char here[INCODE_PAGE_BYTES], there[INCODE_PAGE_BYTES];
        size_t n = host_page(&right, page, there);
        assert_int_equal(host_page(o, page, here), n);
        assert_memory_equal(here, there, n);
    }
    host_order_free(&right);
}

/* Files of others that are as long as a copy of `state` is, or shorter. */
TEST_WITH(test_long_files, set_up, tear_down) {
    char bytes[COPY];
    (void)fixture;
    memset(bytes, 'x', sizeof bytes);
    assert_int_equal(mkdir(folder, 0700), 0);
    for (int i = 0; i < 3; i++)
        assert_int_equal(close(open(file[i], O_CREAT | O_WRONLY, 0600)), 0);
    for (size_t n = 0; n <= COPY; n += COPY / 4) {
        write_file(file[0], bytes, n);
        write_file(file[1], "precious", 8);
        set_options();
        assert_int_equal(begin(), HOST_INPUT);
        assert_non_null(strstr(error.text, n == 0
                                               ? "order: was not made by incode"
                                               : "state: was not made by "));
    }
    write_file(file[0], "", 0);
    memset(bytes, 0, 64);
    write_file(file[1], bytes, sizeof bytes);
    set_options();
    assert_int_equal(begin(), HOST_INPUT);
    assert_non_null(strstr(error.text, "order: was not made by incode"));
    write_file(file[0], bytes + COPY / 2, COPY / 2);
    write_file(file[1], "", 0);
    set_options();
    assert_int_equal(begin(), HOST_INPUT);
    assert_non_null(strstr(error.text, "state: was not made by incode"));
}

/* A run that was killed before the head of its first record was written. */
TEST_WITH(test_no_head, set_up, tear_down) {
    char bytes[COPY];
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    memset(bytes, 'x', sizeof bytes);
    memset(bytes, 0, 64);
    write_file(file[2], bytes, sizeof bytes);
    set_options();
    run(true);
    assert_order(&order);
    host_order_free(&order);
    assert_int_equal(access(folder, F_OK), -1);
}

/* What a loss of power may leave. */
TEST_WITH(test_zeros, set_up, tear_down) {
    static const char zeros[2 * COPY];
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    write_file(file[0], zeros, sizeof zeros);
    run(false);
    assert_order(&order);
    host_order_free(&order);
    set_options();
    run(true);
    host_order_free(&order);
}

/* What was kept was part of it. */
TEST_WITH(test_wrong_result, set_up, tear_down) {
    struct host_journal_head head = {.kind = 1};
    struct stat spool;
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    set_options();
    start();
    assert_true(host_state_is_resumed(options.state));
    assert_int_equal(
        host_journal_append(host_state_kept(options.state)->journal, &head,
                            NULL, 0, &error),
        0);
    assert_int_equal(stat(file[2], &spool), 0);
    assert_true(spool.st_size > 0);
    assert_int_equal(host_state_order_kept(options.state, &result, &error), 0);
    end(HOST_UNVERIFIED);
    assert_int_equal(stat(file[2], &spool), 0);
    assert_int_equal(spool.st_size, 0);
    host_order_free(&order);
}

TEST_WITH(test_one_process, set_up, tear_down) {
    struct host_run_options second;
    (void)fixture;
    set_options();
    second = options;
    assert_int_equal(begin(), 0);
    pid_t child = fork();
    if (child == 0)
        _exit(host_state_begin(&second, &points, &error) == HOST_INPUT &&
                      strstr(error.text, "in use by another run") != NULL
                  ? 0
                  : 1);
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    end(0);
}

TEST_WITH(test_orders, set_up, tear_down) {
    (void)fixture;
    set_options();
    run(false);
    assert_order(&order);
    host_order_free(&order);
    set_options();
    run(false);
    assert_order(&order);
    host_order_free(&order);
}

TEST_WITH(test_orders_with_a_grid, set_up, tear_down) {
    struct host_order right;
    (void)fixture;
    for (int i = 0; i < 2; i++) {
        set_options();
        options.index = INCODE_GRID;
        result = (struct host_run_result){
            .strategy = host_strategy_named("spatial"), .nodes = REGIONS};
        assert_int_equal(begin(), 0);
        assert_int_equal(host_state_order(options.state, &order, "test",
                                          &points, HOST_ADAPTIVE, REGIONS, true,
                                          &error),
                         0);
        assert_int_equal(
            host_state_start(options.state, &order, &result, &error), 0);
        assert_int_equal(host_state_order_kept(options.state, &result, &error),
                         0);
        end(HOST_BROKEN);
        if (i == 0)
            host_order_free(&order);
    }
    assert_int_equal(host_order_make(&right, "test", points.xyz, points.count,
                                     HOST_ADAPTIVE, REGIONS, true, &error),
                     0);
    assert_memory_equal(order.cells, right.cells, sizeof right.cells);
    assert_int_equal(order.tree.pages, right.tree.pages);
    for (uint32_t page = 0; page < right.tree.pages; page++) {
        char here[INCODE_PAGE_BYTES], there[INCODE_PAGE_BYTES];
        size_t n = host_page(&right, page, there);
        assert_int_equal(host_page(&order, page, here), n);
        assert_memory_equal(here, there, n);
    }
    host_order_free(&right);
    host_order_free(&order);
}

/* A damaged order is made again, whatever byte it is. */
TEST_WITH(test_a_damaged_order, set_up, tear_down) {
    static char bytes[1 << 18];
    (void)fixture;
    set_options();
    run(false);
    host_order_free(&order);
    size_t n = read_file(file[1], bytes, sizeof bytes);
    assert_true(n > 1000 && n < sizeof bytes);
    for (size_t at = 0; at < n; at += at < 600 ? 13 : 4099) {
        struct host_journal journal;
        bytes[at] ^= 16;
        write_file(file[1], bytes, n);
        bytes[at] ^= 16;
        int fd = open(folder, O_RDONLY);
        assert_int_equal(
            host_journal_open(&journal, fd, "order", "order", &error), 0);
        assert_int_equal(journal.records,
                         at >= sizeof(struct host_journal_head));
        if (journal.records == 1)
            assert_false(
                host_order_take(&order, &journal, journal.record[0].head.key));
        host_journal_close(&journal);
        assert_int_equal(close(fd), 0);
        if (at % 5 != 0)
            continue;
        set_options();
        run(false);
        assert_order(&order);
        host_order_free(&order);
    }
}

/* Records count for the order alone that they were made for. */
TEST_WITH(test_an_order_that_changes, set_up, tear_down) {
    struct stat about;
    (void)fixture;
    for (int i = 0; i < 2; i++) {
        struct host_journal journal;
        struct host_journal_head head = {.kind = 99};
        set_options();
        run(false);
        host_order_free(&order);
        int fd = open(folder, O_RDONLY);
        assert_int_equal(
            host_journal_open(&journal, fd, "spool", "spool", &error), 0);
        assert_int_equal(host_journal_append(&journal, &head, NULL, 0, &error),
                         0);
        host_journal_close(&journal);
        assert_int_equal(close(fd), 0);
        if (i == 1)
            put_line("key 0123456789abcdef");
        set_options();
        run(false);
        assert_order(&order);
        host_order_free(&order);
        assert_int_equal(stat(file[2], &about), 0);
        assert_int_equal(about.st_size > 0, i == 0);
    }
}
