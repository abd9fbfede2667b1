#include "report.h"

#include <jansson.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "host/base/text.h"
#include "host/mesh/points.h"
#include "host/service/strategies/strategies.h"
#include "node/roles/roles.h"
#include "boards/processor/processor.h"
#include "host/formats/output.h"

/* The processor time of the busiest node: what t_max would be if every node
 * had a processor to itself. */
static double busiest(const struct host_run_result *r) {
    double most = 0.0;
    for (unsigned i = 0; i < r->nodes; i++) {
        double s = 1e-6 * (double)r->node[i].statistics.busy_us;
        most = s > most ? s : most;
    }
    return most;
}

static double ratio(double a, double b) {
    return b > 0.0 ? a / b : 0.0;
}

/* The columns of the paper's Table 2: their head, under a title; a row, with
 * the speed-up against `alone`; and what the columns are. */
static void host_report_head(FILE *file, const char *title) {
    fprintf(file,
            "\n%s\n"
            "%5s %8s %8s %8s %8s %5s %10s %6s %8s %8s %5s\n",
            title, "nodes", "t_min", "t_max", "t_IO", "speed-up", "eff.",
            "tetrahedra", "dupl.", "cpu_max", "speed-up", "eff.");
}

static void host_report_row(FILE *file, const struct host_run_result *r,
                            const struct host_run_result *alone) {
    double wall = ratio(alone->t_max_s, r->t_max_s);
    double cpu = ratio(busiest(alone), busiest(r));
    fprintf(file,
            "%5u %8.3f %8.3f %8.3f %8.2f %5.2f %10llu %6.3f %8.3f %8.2f "
            "%5.2f\n",
            r->nodes, r->t_min_s, r->t_max_s, r->time_io_s, wall,
            wall / r->nodes, (unsigned long long)r->tetrahedra,
            ratio((double)r->built, (double)r->tetrahedra), busiest(r), cpu,
            cpu / r->nodes);
}

static void host_report_notes(FILE *file) {
    fprintf(file,
            "Seconds; t_min, t_max: of the fastest and the slowest node, on "
            "the clock, %ld\nprocessors shared by all.  cpu_max: processor "
            "time of the busiest node, and the\nspeed-up and efficiency that "
            "follow for a machine with a processor a node.\n",
            sysconf(_SC_NPROCESSORS_ONLN));
}

static void node_lines(FILE *file, const struct host_run_result *r) {
    fprintf(file, "\n%4s %10s %10s %8s %8s %8s %8s %8s %10s\n", "node", "built",
            "kept", "pages", "faults", "evicted", "AFL max", "spilled",
            "memory");
    for (unsigned i = 0; i < r->nodes; i++) {
        const struct node_finished_message *f = &r->node[i].statistics;
        const struct incode_statistics *s = &f->statistics;
        fprintf(
            file, "%4u %10llu %10llu %8llu %8llu %8llu %8llu %8llu %10llu\n", i,
            (unsigned long long)s->tetrahedra_built,
            (unsigned long long)s->tetrahedra_kept,
            (unsigned long long)s->page_requests,
            (unsigned long long)s->page_faults,
            (unsigned long long)s->page_evictions,
            (unsigned long long)s->afl_max, (unsigned long long)s->afl_spilled,
            (unsigned long long)f->memory_high_water);
    }
    fprintf(file, "Of %llu bytes of data memory a node%s.\n",
            (unsigned long long)r->memory,
            r->memory_held == NULL ? "" : r->memory_held);
}

/* Of a node's memory: what its board tells, or what processes have. */
static uint64_t host_node_stack_bytes(const struct host_node_report *report) {
    uint32_t told = report->statistics.stack_bytes;
    return told > 0 ? told : HOST_STACK_BYTES;
}

static void map_line(FILE *file, uint64_t bytes, const char *what,
                     uint64_t count, const char *unit) {
    fprintf(file, "%12llu  %s", (unsigned long long)bytes, what);
    if (count > 0)
        fprintf(file, " (%llu %s)", (unsigned long long)count, unit);
    fputc('\n', file);
}

/* How the tables of node 0 fill its memory. */
static void host_report_map(FILE *file, const struct host_run_result *result) {
    const struct node_map *m = &result->node[0].map.map;
    const struct node_role *role = node_role_named(result->node[0].map.role);
    uint64_t stack = host_node_stack_bytes(&result->node[0]);
    unsigned links = 1;
    while (1u << (links - 1) < result->nodes)
        links++;
    fprintf(file, "\nMemory map of node 0, bytes of %llu\n",
            (unsigned long long)result->memory);
    map_line(file, stack, "stack", 0, "");
    map_line(file, m->fixed - stack, ".data, .bss", 0, "");
    map_line(file, m->node, "node program", 0, "");
    map_line(file, m->cube, "windows of links", links * m->window,
             "frames each way");
    uint64_t used = m->fixed + m->node + m->cube;
    for (unsigned i = 0; role != NULL && i < NODE_TABLES_MAX; i++) {
        if (role->tables[i].name != NULL) {
            map_line(file, m->tables[i].bytes, role->tables[i].name,
                     role->tables[i].unit == NULL ? 0 : m->tables[i].count,
                     role->tables[i].unit);
        }
        used += m->tables[i].bytes;
    }
    map_line(file, result->memory - used, "left over", 0, "");
    if (result->board->bare == NULL) {
        fprintf(file,
                "Outside it, in the kernel: %d and %d bytes of buffers for "
                "each end of a wire.\n",
                result->socket_send_bytes, result->socket_receive_bytes);
    }
}

static void report(FILE *file, const struct host_run_options *options,
                   const struct host_run_result *result,
                   const struct host_run_result *alone) {
    const struct host_run_result *r = result;
    host_say(file, "%s: %llu %spoints, %llu tetrahedra, %s\n", options->input,
             (unsigned long long)r->points,
             r->duplicates > 0 ? "distinct " : "",
             (unsigned long long)r->tetrahedra,
             options->row_order == HOST_AS_MADE
                 ? "in the order in which they were made, so without a digest"
                 : r->digest.text);
    if (r->duplicates > 0) {
        fprintf(file,
                "%llu of %llu points are duplicates; each stands for its "
                "lowest row\n",
                (unsigned long long)r->duplicates, (unsigned long long)r->rows);
    }
    if (r->negative_zeros > 0) {
        fprintf(file, "coordinates of -0.0, which count as 0.0: %llu\n",
                (unsigned long long)r->negative_zeros);
    }
    if (options->explain)
        fprintf(file, "auto: %s\n", r->why);
    fprintf(file, "%s on ", r->strategy->name);
    if (r->lost > 0)
        fprintf(file, "%u of ", r->nodes - r->lost);
    fprintf(file, "%u %s%s", r->nodes, options->direct ? "thread" : "node",
            r->nodes == 1 ? "" : "s");
    if (r->lost > 0 || r->restarts > 0)
        fprintf(file, ", %u lost, %u started again", r->lost, r->restarts);
    fprintf(file, ": %.3f s to triangulate (%.3f Mtet/s), %.3f s in all%s\n",
            r->time_triangulation_s,
            1e-6 * ratio((double)r->tetrahedra, r->time_triangulation_s),
            r->time_total_s, r->verified ? "; verified" : "");
    if (alone != NULL) {
        char title[128];
        snprintf(title, sizeof title, "%s, %s partition, index %s",
                 r->strategy->title, host_partitions[r->partition],
                 host_indexes[r->index]);
        host_report_head(file, title);
        host_report_row(file, alone, alone);
        host_report_row(file, r, alone);
        host_report_notes(file);
        node_lines(file, r);
    }
    if (options->map)
        host_report_map(file, r);
}

/* --- stats ---------------------------------------------------------------- */

double host_candidates_mean(const struct host_run_result *result) {
    return result->make_tetra_calls == 0
               ? 0.0
               : (double)result->candidates / (double)result->make_tetra_calls;
}

double host_candidates_p99(const struct host_run_result *result) {
    uint64_t calls = 0, seen = 0;
    for (unsigned k = 0; k < 24; k++)
        calls += result->candidates_histogram[k];
    for (unsigned k = 0; k < 24; k++) {
        seen += result->candidates_histogram[k];
        if (calls > 0 && seen >= calls - calls / 100)
            return exp2(0.5 * (k + 1));
    }
    return 0.0;
}

static void put(json_t *object, const char *name, uint64_t value) {
    json_object_set_new(object, name, json_integer((json_int_t)value));
}

static void put_real(json_t *object, const char *name, double value) {
    json_object_set_new(object, name, json_real(value));
}

static void put_text(json_t *object, const char *name, const char *value) {
    json_object_set_new(object, name, json_string(value));
}

/* How a node found its tetrahedra, over all of its jobs. */
static const char *built_by(const struct incode_statistics *s) {
    return s->tetrahedra_built == 0                         ? "none"
           : s->tetrahedra_by_points == 0                   ? "faces"
           : s->tetrahedra_by_points == s->tetrahedra_built ? "points"
                                                            : "both";
}

/* How the node's memory is filled, in bytes. */
static json_t *map_object(const struct host_run_result *r, unsigned i) {
    const struct node_map *m = &r->node[i].map.map;
    const struct node_role *role = node_role_named(r->node[i].map.role);
    uint64_t stack = host_node_stack_bytes(&r->node[i]);
    json_t *o = json_object();
    put(o, "stack", stack);
    put(o, "static", m->fixed > stack ? m->fixed - stack : 0);
    put(o, "node", m->node);
    put(o, "links", m->cube);
    uint64_t used = m->fixed + m->node + m->cube;
    for (unsigned k = 0; role != NULL && k < NODE_TABLES_MAX; k++) {
        if (role->tables[k].name != NULL)
            put(o, role->tables[k].name, m->tables[k].bytes);
        used += m->tables[k].bytes;
    }
    put(o, "left_over", r->memory > used ? r->memory - used : 0);
    return o;
}

/* Of a node, or of a thread that takes its place. */
static json_t *node_object(const struct host_run_result *r, unsigned i) {
    const struct host_node_report *report = &r->node[i];
    const struct node_finished_message *f = &report->statistics;
    const struct incode_statistics *s = &f->statistics;
    const struct node_role *role = node_role_named(report->map.role);
    json_t *o = json_object();
    put(o, "node", i);
    put_text(o, "role", role == NULL ? "none" : role->name);
    put_text(o, "built_by", built_by(s));
    put(o, "tetrahedra_built", s->tetrahedra_built);
    put(o, "tetrahedra_kept", s->tetrahedra_kept);
    put(o, "make_tetra_calls", s->make_tetra_calls);
    put_real(o, "cpu_s", 1e-6 * (double)f->busy_us);
    put_real(o, "wall_s", 1e-6 * (double)f->wall_us);
    put(o, "vertices", s->vertices);
    put(o, "vertices_waited", s->vertices_waited);
    put(o, "stars_lent", s->stars_lent);
    put(o, "stars_borrowed", s->stars_borrowed);
    put(o, "tetrahedra_late", s->tetrahedra_late);
    put(o, "tree_searches", s->tree_searches);
    put(o, "seeds", s->seeds);
    put(o, "page_requests", s->page_requests);
    put(o, "page_faults", s->page_faults);
    put(o, "page_evictions", s->page_evictions);
    put(o, "page_bytes", report->page_bytes);
    put(o, "pages_held", f->pages_held);
    put(o, "pages_forwarded", f->pages_forwarded);
    put(o, "afl_max", s->afl_max);
    put(o, "afl_spilled", s->afl_spilled);
    put(o, "exact_orient3d", s->tally.exact_orient3d);
    put(o, "exact_in_sphere", s->tally.exact_in_sphere);
    put(o, "bytes_in", f->bytes_in);
    put(o, "bytes_out", f->bytes_out);
    put(o, "retransmitted_frames", f->retransmitted);
    put(o, "memory_high_water_bytes", f->memory_high_water);
    put(o, "memory_frames", report->map.map.pages);
    put(o, "look_us_max", f->look_us_max);
    if (f->stack_bytes > 0) { /* its board tells */
        put(o, "stack_bytes", f->stack_bytes);
        put(o, "stack_high_water_bytes", f->stack_high_water);
        put(o, "overruns", f->overruns);
    }
    json_object_set_new(o, "memory_map", map_object(r, i));
    return o;
}

static void put_times(json_t *o, const struct host_run_result *r) {
    put_real(o, "time_total_s", r->time_total_s);
    put_real(o, "time_io_s", r->time_io_s);
    put_real(o, "time_triangulation_s", r->time_triangulation_s);
    put_real(o, "time_start_up_s", r->time_start_up_s);
    put_real(o, "time_read_s", r->time_read_s);
    put_real(o, "time_order_s", r->time_order_s);
    put_real(o, "time_verify_s", r->time_verify_s);
    put_real(o, "time_write_s", r->time_write_s);
    put_real(o, "t_min_s", r->t_min_s);
    put_real(o, "t_max_s", r->t_max_s);
}

static json_t *run_object(const struct host_run_result *r) {
    json_t *o = json_object();
    json_t *nodes = json_array();
    put(o, "points", r->rows);
    put(o, "distinct_points", r->points);
    put(o, "duplicates", r->duplicates);
    put(o, "negative_zeros", r->negative_zeros);
    put(o, "tetrahedra", r->tetrahedra);
    put(o, "hull_facets", r->hull_facets);
    if (r->digest.text[0] != '\0')
        put_text(o, "digest", r->digest.text);
    else
        json_object_set_new(o, "digest", json_null()); /* as made */
    put_text(o, "strategy", r->strategy->name);
    put_text(o, "strategy_why", r->why);
    put_text(o, "partition", host_partitions[r->partition]);
    put_text(o, "index", host_indexes[r->index]);
    put_text(o, "link", r->link->name);
    put_text(o, "board", r->board->name);
    put_text(o, "processor", processor_level());
    put(o, "nodes", r->nodes);
    put(o, "memory_bytes", r->memory);
    json_object_set_new(o, "memory_limited", json_boolean(r->limited));
    json_object_set_new(o, "verified", json_boolean(r->verified));
    put_times(o, r);
    put_real(o, "host_cpu_s", r->host_cpu_s);
    put_real(o, "host_triangulation_cpu_s", r->host_triangulation_cpu_s);
    put(o, "host_peak_bytes", r->host_peak_bytes);
    put(o, "host_memory_bytes", r->host_memory);
    put(o, "scratch_bytes", r->scratch_bytes);
    put(o, "bricks", r->bricks);
    put(o, "resumed_bricks", r->resumed_bricks);
    put(o, "pages", r->pages);
    put_real(o, "tetrahedra_per_second",
             r->time_triangulation_s > 0.0
                 ? (double)r->tetrahedra / r->time_triangulation_s
                 : 0.0);
    put(o, "make_tetra_calls", r->make_tetra_calls);
    put_real(o, "duplication_factor",
             r->tetrahedra > 0 ? (double)r->built / (double)r->tetrahedra
                               : 0.0);
    put(o, "exact_orient3d", r->exact_orient3d);
    put(o, "exact_in_sphere", r->exact_in_sphere);
    put_real(o, "candidates_mean", host_candidates_mean(r));
    put_real(o, "candidates_p99", host_candidates_p99(r));
    put(o, "vertices", r->vertices);
    put(o, "vertices_waited", r->vertices_waited);
    put(o, "stars_lent", r->stars_lent);
    put(o, "stars_borrowed", r->stars_borrowed);
    put(o, "tetrahedra_late", r->tetrahedra_late);
    put(o, "faces_spilled", r->faces_spilled);
    put(o, "socket_send_bytes", (uint64_t)r->socket_send_bytes);
    put(o, "socket_receive_bytes", (uint64_t)r->socket_receive_bytes);
    put(o, "host_bytes_sent", r->bytes_sent);
    put(o, "host_bytes_received", r->bytes_received);
    put(o, "retransmitted_frames", r->retransmitted);
    put(o, "nodes_lost", r->lost);
    put(o, "nodes_excluded", r->excluded);
    put(o, "checks_failed", r->checks_failed);
    put(o, "node_restarts", r->restarts);
    put(o, "generations", r->generations);
    put(o, "missing_wires", r->missing_wires);
    for (unsigned i = 0; i < r->nodes; i++)
        json_array_append_new(nodes, node_object(r, i));
    json_object_set_new(o, "per_node", nodes);
    return o;
}

static int put_bytes(const char *bytes, size_t n, void *out) {
    host_output_bytes(out, bytes, n);
    return 0;
}

int host_stats_write(const char *path, const struct host_run_result *result,
                     struct host_error *error) {
    size_t flags = JSON_INDENT(2) | JSON_REAL_PRECISION(9);
    json_t *object = run_object(result);
    struct host_output out;
    if (host_output_open(&out, path, error) == 0) {
        if (json_dump_callback(object, put_bytes, &out, flags) != 0)
            host_fail_memory(error, "the statistics");
        host_output_text(&out, "\n");
        host_output_close(&out, 1, error);
    }
    json_decref(object);
    return error->code;
}

/* Whether standard output takes tetrahedra or statistics. */
static bool stdout_is_data(const struct host_run_options *options) {
    bool data = options->stats != NULL && strcmp(options->stats, "-") == 0;
    for (unsigned i = 0; i < options->outputs; i++)
        data = data || strcmp(options->output[i], "-") == 0;
    return data;
}

int host_report(const struct host_run_options *options,
                const struct host_run_result *result,
                const struct host_run_result *alone, struct host_error *error) {
    FILE *file = stdout_is_data(options) ? stderr : stdout;
    report(file, options, result, alone);
    return file == stdout ? host_output_printed(error) : 0;
}
