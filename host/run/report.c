#include "report.h"

#include <string.h>
#include <unistd.h>

#include "host/base/text.h"
#include "host/mesh/names.h"
#include "host/service/strategies/strategies.h"
#include "node/roles/roles.h"

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

void host_report_head(FILE *file, const char *title) {
    fprintf(file,
            "\n%s\n"
            "%5s %8s %8s %8s %8s %5s %10s %6s %8s %8s %5s\n",
            title, "nodes", "t_min", "t_max", "t_IO", "speed-up", "eff.",
            "tetrahedra", "dupl.", "cpu_max", "speed-up", "eff.");
}

void host_report_row(FILE *file, const struct host_run_result *r,
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

void host_report_notes(FILE *file) {
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

uint64_t host_node_stack_bytes(const struct host_node_report *report) {
    uint32_t told = report->statistics.stack_bytes;
    return told > 0 ? told : HOST_STACK_BYTES;
}

static void map_line(FILE *file, uint64_t bytes, const char *what,
                     uint64_t count, const char *unit) {
    fprintf(file, "%12llu  %s", (unsigned long long)bytes, what);
    if (count > 0) {
        fprintf(file, " (%llu %s)", (unsigned long long)count, unit);
    }
    fputc('\n', file);
}

void host_report_map(FILE *file, const struct host_run_result *result) {
    const struct node_map *m = &result->node[0].map.map;
    const struct node_role *role = node_role_named(result->node[0].map.role);
    uint64_t stack = host_node_stack_bytes(&result->node[0]);
    unsigned links = 1;
    while (1u << (links - 1) < result->nodes) {
        links++;
    }
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

void host_report_run(FILE *file, const struct host_run_options *options,
                     const struct host_run_result *result,
                     const struct host_run_result *alone) {
    const struct host_run_result *r = result;
    host_say(file, "%s: %llu %spoints, %llu tetrahedra, %s\n", options->input,
             (unsigned long long)r->points,
             r->duplicates > 0 ? "distinct " : "",
             (unsigned long long)r->tetrahedra, r->digest.text);
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
    if (options->explain) {
        fprintf(file, "auto: %s\n", r->why);
    }
    fprintf(file, "%s on ", r->strategy->name);
    if (r->lost > 0) {
        fprintf(file, "%u of ", r->nodes - r->lost);
    }
    fprintf(file, "%u %s%s", r->nodes, options->direct ? "thread" : "node",
            r->nodes == 1 ? "" : "s");
    if (r->lost > 0 || r->restarts > 0) {
        fprintf(file, ", %u lost, %u started again", r->lost, r->restarts);
    }
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
    if (options->map) {
        host_report_map(file, r);
    }
}
