#include "bench_scaling.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/error.h"
#include "bench_table.h"
#include "host/base/progress.h"
#include "bench_peers.h"
#include "host/base/create.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "bench_links.h"

enum { LOOK_MS = 100 };

/* In the child. */
static _Noreturn void become(char *const words[], pid_t bench, int out,
                             int err) {
    int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == bench) { /* else it ended before it could be watched */
        (void)dup2(null, STDIN_FILENO);
        (void)dup2(out, STDOUT_FILENO);
        (void)dup2(err, STDERR_FILENO);
        (void)execvp(words[0], words);
        (void)dprintf(STDERR_FILENO, "%s: %s\n", words[0], strerror(errno));
    }
    _exit(127);
}

/* Waits for the child, which it ends at the limit. */
static void await(pid_t child, double limit_s, struct host_trial *trial) {
    uint64_t begin = host_now_us();
    int end = pidfd_open(child, 0), status = 0;
    struct pollfd ended = {.fd = end, .events = POLLIN};
    while (poll(&ended, 1, LOOK_MS) <= 0) {
        double s = 1e-6 * (double)(host_now_us() - begin);
        if (s > limit_s) {
            trial->late = true;
            (void)kill(child, SIGKILL);
            break;
        }
    }
    (void)close(end);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    trial->status =
        WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/* The last line that is not empty. */
static void last_line(FILE *err, char *text, size_t size) {
    char line[400];
    rewind(err);
    while (fgets(line, sizeof line, err) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (line[0] != '\0')
            (void)snprintf(text, size, "%s", line);
    }
}

static double real(const json_t *object, const char *name) {
    return json_number_value(json_object_get(object, name));
}

static uint64_t whole(const json_t *object, const char *name) {
    return (uint64_t)json_integer_value(json_object_get(object, name));
}

static void read_said(FILE *out, struct host_trial *t) {
    rewind(out);
    json_t *said = json_loadf(out, 0, NULL);
    json_t *nodes = json_object_get(said, "per_node"), *node;
    const char *digest = json_string_value(json_object_get(said, "digest"));
    size_t i;
    t->tetrahedra = whole(said, "tetrahedra");
    t->pages = whole(said, "pages");
    t->peak_bytes = whole(said, "host_peak_bytes");
    t->scratch_bytes = whole(said, "scratch_bytes");
    t->run_s = real(said, "time_total_s") - real(said, "time_verify_s");
    t->host_s = real(said, "host_triangulation_cpu_s");
    t->host_all_s = real(said, "host_cpu_s");
    t->cpu_s = real(said, "cpu_s");
    t->wall_s = real(said, nodes == NULL ? "wall_s" : "time_triangulation_s");
    (void)snprintf(t->digest, sizeof t->digest, "%s",
                   digest == NULL ? "" : digest);
    json_array_foreach(nodes, i, node) {
        t->cpu_s += real(node, "cpu_s");
        t->pages_asked += whole(node, "page_requests");
    }
    json_decref(said);
}

int host_trial_run(char *const words[], double limit_s,
                   struct host_trial *trial, struct host_error *error) {
    FILE *out = tmpfile(), *err = tmpfile();
    pid_t bench = getpid();
    uint64_t begin = host_now_us();
    memset(trial, 0, sizeof *trial);
    pid_t child = out == NULL || err == NULL ? -1 : fork();
    if (child == 0)
        become(words, bench, fileno(out), fileno(err));
    if (child < 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; free memory or room in /tmp",
                  words[0], strerror(errno));
    } else {
        await(child, limit_s, trial);
        trial->whole_s = 1e-6 * (double)(host_now_us() - begin);
        last_line(err, trial->said, sizeof trial->said);
        if (!trial->late && trial->status == 0)
            read_said(out, trial);
    }
    if (out != NULL)
        (void)fclose(out);
    if (err != NULL)
        (void)fclose(err);
    return error->code;
}

/* --- scaling rows --------------------------------------------------------- */

const char *const host_scaling_strategies[HOST_SCALING_STRATEGIES] = {
    "spatial", "exchange"};

static const double most_of_a_million = 1.15;

/* Nanoseconds for each of so many. */
static double each(double s, uint64_t count) {
    return 1e9 * s / (double)count;
}

static const struct host_scaling_point *
row_of(const struct host_scaling_rows *rows, uint64_t points) {
    for (unsigned i = 0; i < rows->points; i++)
        if (rows->point[i].points == points)
            return &rows->point[i];
    return NULL;
}

/* The heads of both tables. */
static void host_scaling_points_head(struct host_scaling_rows *rows) {
    host_progress_erase();
    printf("Uniform points, sequential on one node of 4M: ns of processor time "
           "a point, of the\nnode, of the host (files apart) and of both; ns a "
           "tetrahedron of both; ns by the clock\na point; the node's against "
           "the node's of 1,000,000 points.  The least of so many runs.\n\n"
           "%10s %10s %4s %8s %8s %8s %8s %8s %6s\n",
           "points", "tetrahedra", "runs", "node", "host", "both", "a tet.",
           "clock", "/ 1M");
    (void)fflush(stdout);
    if (rows->csv != NULL) {
        fputs("how,strategy,nodes,points,tetrahedra,node_ns,host_ns,clock_ns,"
              "busiest_ns,all_ns,wire_bytes\n",
              rows->csv);
    }
}

/* Takes a row and prints it.  One of 10,000,000 points is held to 1.15 times
 * what a point costs of 1,000,000. */
static void host_scaling_points_row(struct host_scaling_rows *rows,
                                    const struct host_scaling_point *point) {
    const struct host_scaling_point *p = &rows->point[rows->points++];
    rows->point[rows->points - 1] = *point;
    const struct host_scaling_point *million = row_of(rows, 1000000);
    double node = each(p->node_s, p->points);
    double host = each(p->host_s, p->points);
    double clock = each(p->wall_s, p->points);
    host_progress_erase();
    printf("%10llu %10llu %4u %8.0f %8.0f %8.0f %8.0f %8.0f",
           (unsigned long long)p->points, (unsigned long long)p->tetrahedra,
           p->runs, node, host, node + host,
           each(p->node_s + p->host_s, p->tetrahedra), clock);
    if (million != NULL) {
        double ratio = node / each(million->node_s, million->points);
        printf(" %6.2f", ratio);
        if (p->points == 10000000) {
            printf(" <=%.2f%s", most_of_a_million,
                   ratio <= most_of_a_million ? "" : "!");
        }
    }
    printf("\n");
    (void)fflush(stdout);
    if (rows->csv != NULL) {
        fprintf(rows->csv,
                "measured,sequential,1,%llu,%llu,%.6g,%.6g,%.6g,,,\n",
                (unsigned long long)p->points,
                (unsigned long long)p->tetrahedra, node, host, clock);
    }
}

static void host_scaling_nodes_head(uint64_t points) {
    host_progress_erase();
    printf("\nUniform %llu in virtual time, at the prices of this machine's "
           "model, as processes here\nshare processors: ns of processor time a "
           "point, of the busiest node and of all\ntogether; speed-up and "
           "efficiency by the busiest; bytes on the host's wire a\n"
           "tetrahedron, all that there are.\n\n%5s",
           (unsigned long long)points, "nodes");
    for (int i = 0; i < HOST_SCALING_STRATEGIES; i++) {
        printf(" | %-8s %8s %8s %5s %6s", host_scaling_strategies[i], "all",
               "speed-up", "eff.", "bytes");
    }
    printf("\n");
    (void)fflush(stdout);
}

/* The first of the strategy. */
static double alone(const struct host_scaling_rows *rows,
                    const char *strategy) {
    unsigned i = 0;
    while (strcmp(rows->node[i].strategy, strategy) != 0)
        i++;
    return rows->node[i].busiest_s;
}

static void host_scaling_nodes_row(struct host_scaling_rows *rows,
                                   const struct host_scaling_node *node) {
    const struct host_scaling_node *n = &rows->node[rows->nodes++];
    rows->node[rows->nodes - 1] = *node;
    double speed_up = alone(rows, n->strategy) / n->busiest_s;
    double bytes = n->wire_bytes / (double)n->tetrahedra;
    bool first = strcmp(n->strategy, host_scaling_strategies[0]) == 0;
    host_progress_erase();
    if (first)
        printf("%5u", n->nodes);
    printf(" | %8.1f %8.1f %8.2f %5.2f %6.2f", each(n->busiest_s, n->points),
           each(n->all_s, n->points), speed_up, speed_up / n->nodes, bytes);
    printf("%s",
           strcmp(n->strategy,
                  host_scaling_strategies[HOST_SCALING_STRATEGIES - 1]) == 0
               ? "\n"
               : "");
    (void)fflush(stdout);
    if (rows->csv != NULL) {
        fprintf(rows->csv, "modelled,%s,%u,%llu,%llu,,,,%.6g,%.6g,%.6g\n",
                n->strategy, n->nodes, (unsigned long long)n->points,
                (unsigned long long)n->tetrahedra,
                each(n->busiest_s, n->points), each(n->all_s, n->points),
                bytes);
    }
}

/* --- the figure ----------------------------------------------------------- */

static void put_data(const struct host_scaling_rows *rows, FILE *plot) {
    fprintf(plot, "$p << END\n");
    for (unsigned i = 0; i < rows->points; i++) {
        const struct host_scaling_point *p = &rows->point[i];
        fprintf(plot, "%llu %.6g %.6g %.6g\n", (unsigned long long)p->points,
                each(p->node_s, p->points), each(p->host_s, p->points),
                each(p->node_s + p->host_s, p->points));
    }
    fprintf(plot, "END\n");
    for (int k = 0; k < HOST_SCALING_STRATEGIES; k++) {
        fprintf(plot, "$n%d << END\n", k);
        for (unsigned i = 0; i < rows->nodes; i++) {
            const struct host_scaling_node *n = &rows->node[i];
            if (strcmp(n->strategy, host_scaling_strategies[k]) == 0) {
                fprintf(plot, "%u %.6g %.6g\n", n->nodes,
                        each(n->busiest_s, n->points),
                        each(n->all_s, n->points));
            }
        }
        fprintf(plot, "END\n");
    }
}

static void put_panels(FILE *plot) {
    static const char form[] = "with linespoints pointtype 7 pointsize 0.5";
    fprintf(plot,
            "set terminal svg size 1000,520 dynamic\n"
            "set multiplot layout 1,2\nset logscale x\n"
            "set key below vertical maxrows 4 font ',10'\n"
            "set title \"ns of processor time a point, one node of 4M\"\n"
            "set xlabel \"points\"\nset format x \"10^{%%L}\"\n"
            "set yrange [0:*]\n"
            "plot $p using 1:2 %s title \"node\", $p using 1:3 %s title "
            "\"host\", $p using 1:4 %s title \"both\"\n"
            "set title \"ns a point in virtual time\"\n"
            "set xlabel \"nodes\"\nset format x \"%%g\"\n"
            "set logscale x 2\nset logscale y\nset yrange [*:*]\nplot ",
            form, form, form);
    for (int k = 0; k < HOST_SCALING_STRATEGIES; k++) {
        fprintf(plot,
                "%s$n%d using 1:2 %s title \"%s: the busiest node\", $n%d "
                "using 1:3 %s title \"%s: all nodes\"",
                k == 0 ? "" : ", ", k, form, host_scaling_strategies[k], k,
                form, host_scaling_strategies[k]);
    }
    fprintf(plot, "\nunset multiplot\n");
}

/* 0, or as host_gnuplot_draw. */
static int host_scaling_draw(const struct host_scaling_rows *rows,
                             const char *path, struct host_error *error) {
    FILE *script = tmpfile();
    if (script == NULL) {
        return host_fail(error, HOST_BROKEN, "%s: %s; free memory", path,
                         strerror(errno));
    }
    put_data(rows, script);
    put_panels(script);
    int status = host_gnuplot_draw(script, path, error);
    (void)fclose(script);
    return status;
}

/* --- bench scaling -------------------------------------------------------- */

enum {
    LIMIT_S = 3600,
    RUNS_MAX = 5,
    RUNS_POINTS = 300000, /* of all runs of a row, if there are more than one */
    NODES_POINTS = 100000,
    QUICK = 10, /* so many times fewer points for the nodes */
    QUICK_POINTS = 30000
};

static const uint64_t sizes[] = {1000,   3000,    10000,   30000,   100000,
                                 300000, 1000000, 3000000, 10000000};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

/* --- points --------------------------------------------------------------- */

static double least(double before, double now, bool first) {
    return first || now < before ? now : before;
}

static int run_once(const struct host_bench_set *set,
                    struct host_scaling_point *row, struct host_error *error) {
    const char *const words[] = {
        "/proc/self/exe", "run", set->path,    "--format",   "npy",     "-q",
        "--stats",        "-",   "--strategy", "sequential", "--nodes", "1",
        "--memory",       "4M",  NULL};
    struct host_trial trial;
    if (host_trial_run((char *const *)words, LIMIT_S, &trial, error) != 0)
        return error->code;
    if (trial.late || trial.status != 0 || trial.tetrahedra == 0) {
        return host_fail(error, HOST_BROKEN,
                         "bench scaling: %llu points ended with status %d: "
                         "%s; run that alone",
                         (unsigned long long)set->points, trial.status,
                         trial.said);
    }
    bool first = row->runs++ == 0;
    row->tetrahedra = trial.tetrahedra;
    row->node_s = least(row->node_s, trial.cpu_s, first);
    row->host_s = least(row->host_s, trial.host_all_s, first);
    row->wall_s = least(row->wall_s, trial.wall_s, first);
    return 0;
}

static int measure_points(struct host_scaling_rows *rows, uint64_t points,
                          struct host_error *error) {
    struct host_bench_set set;
    struct host_scaling_point row = {.points = points};
    uint64_t fits = RUNS_POINTS / points;
    unsigned runs = fits < 1 ? 1 : fits < RUNS_MAX ? (unsigned)fits : RUNS_MAX;
    char phase[48];
    (void)snprintf(phase, sizeof phase, "%llu points",
                   (unsigned long long)points);
    host_progress_phase(phase, NULL);
    int status = host_bench_set_made(&set, "uniform", points, 1, error);
    for (unsigned i = 0; i < runs && status == 0; i++)
        status = run_once(&set, &row, error);
    host_bench_set_free(&set);
    if (status == 0)
        host_scaling_points_row(rows, &row);
    return status;
}

/* --- nodes ---------------------------------------------------------------- */

static int model_nodes(struct host_scaling_rows *rows,
                       const struct host_points *points, const char *strategy,
                       unsigned nodes, struct host_error *error) {
    static struct host_virtual_run run;
    struct host_run_options options;
    char phase[48];
    host_run_defaults(&options);
    options.strategy = host_strategy_named(strategy);
    options.nodes = nodes;
    options.build = INCODE_BUILD_FACES; /* to which the prices are fitted */
    options.quiet = true;
    run = (struct host_virtual_run){.machine = &host_bench_here,
                                    .options = &options};
    (void)snprintf(phase, sizeof phase, "%s, %u nodes", strategy, nodes);
    host_progress_phase(phase, NULL);
    if (host_virtual_run(&run, points, error) != 0)
        return error->code;
    const struct host_run_result *r = &run.result;
    struct host_scaling_node row = {.strategy = strategy,
                                    .nodes = nodes,
                                    .points = r->points,
                                    .tetrahedra = r->tetrahedra};
    row.wire_bytes = (double)(r->bytes_sent + r->bytes_received);
    for (unsigned i = 0; i < nodes; i++) {
        double busy_s = 1e-6 * (double)r->node[i].statistics.busy_us;
        row.all_s += busy_s;
        row.busiest_s = busy_s > row.busiest_s ? busy_s : row.busiest_s;
    }
    host_scaling_nodes_row(rows, &row);
    return 0;
}

static int model_all(struct host_scaling_rows *rows, unsigned nodes_max,
                     uint64_t count, struct host_error *error) {
    struct host_points points = {0};
    int status = host_gen("uniform", count, 1, &points, error);
    host_scaling_nodes_head(count);
    for (unsigned n = 1; n <= nodes_max && status == 0; n *= 2) {
        for (int i = 0; i < HOST_SCALING_STRATEGIES && status == 0; i++) {
            status = model_nodes(rows, &points, host_scaling_strategies[i], n,
                                 error);
        }
    }
    host_points_free(&points);
    return status;
}

/* --- all ------------------------------------------------------------------ */

static int print_all(const struct host_scaling_options *o,
                     struct host_scaling_rows *rows, struct host_error *error) {
    int status = 0;
    host_scaling_points_head(rows);
    for (int i = 0; i < SIZES && status == 0; i++)
        if (!o->quick || sizes[i] <= QUICK_POINTS)
            status = measure_points(rows, sizes[i], error);
    if (status == 0) {
        status =
            model_all(rows, o->nodes_max,
                      o->quick ? NODES_POINTS / QUICK : NODES_POINTS, error);
    }
    host_progress_erase();
    if (status == 0 && o->svg != NULL &&
        host_scaling_draw(rows, o->svg, error) == 0)
        printf("\nDrawn in %s.\n", o->svg);
    return error->code;
}

int host_bench_scaling(const struct host_scaling_options *options,
                       struct host_error *error) {
    const struct host_scaling_options *o = options;
    if (o->svg != NULL && host_gnuplot_there(o->svg, error) != 0)
        return error->code;
    struct host_scaling_rows *rows = calloc(1, sizeof *rows);
    if (rows == NULL)
        return host_fail_memory(error, "the rows");
    if (o->csv != NULL && (rows->csv = host_create_over(o->csv)) == NULL) {
        host_fail(error, HOST_INPUT, "%s: %s; choose another file", o->csv,
                  strerror(errno));
    } else {
        host_progress_begin(true);
        (void)print_all(o, rows, error);
        host_progress_end();
    }
    if (rows->csv != NULL) {
        bool well = ferror(rows->csv) == 0;
        if ((fclose(rows->csv) != 0 || !well) && error->code == 0) {
            host_fail(error, HOST_BROKEN, "%s: %s; choose another place",
                      o->csv, strerror(errno));
        }
    }
    free(rows);
    return error->code;
}
