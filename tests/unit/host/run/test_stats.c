/* The statistics have every name that scripts rely on, and its value. */
#define TEST_OWN_MAIN
#include <stdbool.h>
#include <unistd.h>

#include "tests/unit/test.h"
#include <jansson.h>
#include <sys/wait.h>

#include "host/base/memory.h"
#include "host/formats/output.h"
#include "host/run/report.h"
#include "host/service/strategies/strategies.h"

static const char *const names[] = {"points",
                                    "distinct_points",
                                    "duplicates",
                                    "negative_zeros",
                                    "tetrahedra",
                                    "hull_facets",
                                    "host_bytes_sent",
                                    "host_bytes_received",
                                    "digest",
                                    "strategy",
                                    "partition",
                                    "index",
                                    "link",
                                    "board",
                                    "nodes",
                                    "memory_bytes",
                                    "time_total_s",
                                    "time_io_s",
                                    "time_triangulation_s",
                                    "t_min_s",
                                    "t_max_s",
                                    "host_cpu_s",
                                    "host_triangulation_cpu_s",
                                    "host_peak_bytes",
                                    "host_memory_bytes",
                                    "scratch_bytes",
                                    "pages",
                                    "tetrahedra_per_second",
                                    "make_tetra_calls",
                                    "duplication_factor",
                                    "exact_orient3d",
                                    "exact_in_sphere",
                                    "retransmitted_frames",
                                    "per_node"};

static const char *const node_names[] = {"node",
                                         "built_by",
                                         "tetrahedra_built",
                                         "tetrahedra_kept",
                                         "make_tetra_calls",
                                         "cpu_s",
                                         "page_requests",
                                         "page_faults",
                                         "page_evictions",
                                         "afl_max",
                                         "afl_spilled",
                                         "bytes_in",
                                         "bytes_out",
                                         "memory_high_water_bytes"};

static void fill(struct host_run_result *r) {
    memset(r, 0, sizeof *r);
    r->rows = 100;
    r->points = 99;
    r->tetrahedra = 500;
    r->built = 600;
    r->time_triangulation_s = 2.0;
    r->nodes = 4;
    r->strategy = &host_spatial;
    r->index = INCODE_KD;
    r->link = host_link_named("serial");
    r->board = host_board_named("linux");
    r->make_tetra_calls = 1000;
    r->candidates = 64000;
    r->candidates_histogram[10] = 980;
    r->candidates_histogram[14] = 20;
    strcpy(r->digest.text, "sha256:00");
    for (unsigned i = 0; i < 4; i++) {
        r->node[i].statistics.busy_us = 1500000;
        r->node[i].statistics.stack_bytes = 49152; /* as a board tells */
        struct incode_statistics *s = &r->node[i].statistics.statistics;
        s->tetrahedra_built = 150 + i;
        s->tetrahedra_by_points = i == 1 ? 151 : i == 2 ? 7 : 0;
    }
    r->node[3].statistics.statistics.tetrahedra_built = 0;
}

/* What is written of a result, read again. */
static json_t *written(const struct host_run_result *result) {
    struct host_error error = {0};
    char path[] = "/tmp/incode-stats-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    assert_int_equal(host_stats_write(path, result, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    json_t *o = json_load_file(path, 0, NULL);
    unlink(path);
    assert_non_null(o);
    return o;
}

TEST(test_names) {
    static struct host_run_result result;
    fill(&result);
    json_t *o = written(&result);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        assert_non_null(json_object_get(o, names[i]));
    assert_int_equal(json_integer_value(json_object_get(o, "points")), 100);
    assert_int_equal(json_integer_value(json_object_get(o, "distinct_points")),
                     99);
    assert_string_equal(json_string_value(json_object_get(o, "strategy")),
                        "spatial");
    assert_string_equal(json_string_value(json_object_get(o, "link")),
                        "serial");
    assert_string_equal(json_string_value(json_object_get(o, "board")),
                        "linux");
    assert_true(json_real_value(json_object_get(o, "duplication_factor")) ==
                1.2);
    assert_true(json_real_value(json_object_get(o, "tetrahedra_per_second")) ==
                250.0);
    json_t *nodes = json_object_get(o, "per_node");
    assert_int_equal(json_array_size(nodes), 4);
    for (size_t k = 0; k < 4; k++) {
        json_t *node = json_array_get(nodes, k);
        for (size_t i = 0; i < sizeof node_names / sizeof node_names[0]; i++)
            assert_non_null(json_object_get(node, node_names[i]));
        static const char *const built_by[] = {"faces", "points", "both",
                                               "none"};
        assert_int_equal(
            json_integer_value(json_object_get(node, "tetrahedra_built")),
            k == 3 ? 0 : 150 + k);
        assert_string_equal(
            json_string_value(json_object_get(node, "built_by")), built_by[k]);
    }
    json_decref(o);
}

/* Whether a row of the table has `name` in its first column. */
static bool documented(const char *table, const char *name) {
    char quoted[64];
    snprintf(quoted, sizeof quoted, "`%s`", name);
    for (const char *row = table; (row = strstr(row, "\n| `")) != NULL;) {
        const char *end = strstr(row + 3, " |");
        const char *at = strstr(++row, quoted);
        if (at != NULL && at < end)
            return true;
    }
    return false;
}

static unsigned undocumented(const char *table, json_t *object) {
    unsigned count = 0;
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        if (!documented(table, name)) {
            print_error("README.md has no row of `%s` under Statistics\n",
                        name);
            count++;
        }
    }
    return count;
}

/* Names of the first column that neither the run nor a node has. */
static unsigned unwritten(const char *table, json_t *run, json_t *node) {
    unsigned count = 0;
    for (const char *row = table; (row = strstr(row, "\n| `")) != NULL;) {
        const char *end = strstr(row + 3, " |");
        while ((row = strchr(row, '`')) != NULL && row < end) {
            char name[64] = "";
            size_t n = strcspn(++row, "`");
            assert_true(n < sizeof name);
            memcpy(name, row, n);
            row += n + 1;
            if (json_object_get(run, name) == NULL &&
                json_object_get(node, name) == NULL) {
                print_error("README.md: `%s` is not written\n", name);
                count++;
            }
        }
        row = end;
    }
    return count;
}

/* README.md has a row for each field that is written, and for no other. */
TEST(test_documented) {
    static struct host_run_result result;
    static char text[1 << 18];
    FILE *file = fopen("host/README.md", "r");
    assert_non_null(file);
    assert_true(fread(text, 1, sizeof text - 1, file) > 0);
    (void)fclose(file);
    char *table = strstr(text, "\n## Statistics\n");
    assert_non_null(table);
    char *end = strstr(table + 1, "\n## ");
    assert_non_null(end);
    *end = '\0';
    fill(&result);
    json_t *run = written(&result);
    json_t *node = json_array_get(json_object_get(run, "per_node"), 0);
    assert_int_equal(undocumented(table, run) + undocumented(table, node), 0);
    assert_int_equal(unwritten(table, run, node), 0);
    json_decref(run);
}

TEST(test_candidates) {
    static struct host_run_result result;
    fill(&result);
    assert_true(host_candidates_mean(&result) == 64.0);
    /* 2 % lie in the class that ends at 2^7.5. */
    assert_true(host_candidates_p99(&result) > 181.0);
    assert_true(host_candidates_p99(&result) < 182.0);
}

TEST(test_unwritable) {
    static struct host_run_result result;
    struct host_error error = {0};
    fill(&result);
    assert_int_equal(
        host_stats_write("/nowhere/at/all/s.json", &result, &error),
        HOST_INPUT);
    assert_non_null(strstr(error.text, "/nowhere/at/all/s.json: "));
}

/* In a process that a large one became, as a shell or a script starts it. */
static char *self;

TEST(test_peak_is_its_own) {
    const size_t large = (size_t)192 << 20;
    int pair[2], status = -1;
    uint64_t peak = 0;
    char *bytes = host_map(large);
    assert_non_null(bytes);
    memset(bytes, 1, large);
    assert_true(host_memory_peak() >= large);
    assert_int_equal(pipe(pair), 0);
    pid_t child = fork();
    if (child == 0) {
        char argument[] = "peak";
        char *const again[] = {self, argument, NULL};
        dup2(pair[1], STDOUT_FILENO);
        execv(self, again);
        _exit(127);
    }
    close(pair[1]);
    assert_int_equal(read(pair[0], &peak, sizeof peak), sizeof peak);
    close(pair[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    assert_in_range(peak, 65536, large - 1);
    host_unmap(bytes, large);
}

int main(int argc, char **argv) {
    self = argv[0];
    if (argc > 1 && strcmp(argv[1], "peak") == 0) {
        uint64_t peak = host_memory_peak();
        return write(STDOUT_FILENO, &peak, sizeof peak) == sizeof peak ? 0 : 1;
    }
    return test_run();
}
