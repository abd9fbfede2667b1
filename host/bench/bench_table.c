#include "bench_table.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/progress.h"
#include "host/base/create.h"

enum { CELLS_MAX = 20, NAME = 18, VALUE = 8 };

const char *const host_bench_peer_titles[HOST_BENCH_PEERS] = {
    "CGAL", "TetGen", "Qhull", "HXT", "HXT x2"};

const char *host_bench_peer_title(const struct host_bench_class *c,
                                  unsigned peer) {
    return c->queries > 0 && peer == HOST_BENCH_QHULL
               ? "scipy"
               : host_bench_peer_titles[peer];
}

/* A figure of a row, and what it is held to. */
struct cell {
    const char *title;
    double value;
    int digits;
    bool held;   /* the column has goals */
    bool most;   /* the goal is the most, else the least */
    bool beyond; /* the limit was reached: the value is a bound */
    double goal; /* 0: this row has none */
};

struct cells {
    struct cell cell[CELLS_MAX];
    unsigned count;
};

static struct cell *add(struct cells *c, const char *title, double value,
                        int digits) {
    struct cell *cell = &c->cell[c->count++];
    *cell = (struct cell){.title = title, .value = value, .digits = digits};
    return cell;
}

static void add_held(struct cells *c, const char *title, double value,
                     bool most, double goal) {
    struct cell *cell = add(c, title, value, 2);
    cell->held = true;
    cell->most = most;
    cell->goal = goal;
}

static double over(double a, double b) {
    return a > 0 && b > 0 ? a / b : 0;
}

static double each(double s, const struct host_bench_result *r) {
    return over(1e9 * s, (double)r->tetrahedra);
}

static bool has_steps(const struct host_bench_class *c) {
    return c->made[1].step > 0;
}

static double step(const struct host_bench_table *t,
                   const struct host_bench_result *r) {
    return t->class->first
               ? over(each(r->node, r), each(t->first.node, &t->first))
           : strcmp(t->before_name, r->name) == 0
               ? over(r->node, t->before.node)
               : 0;
}

static void add_times(struct cells *c, const struct host_bench_table *t,
                      const struct host_bench_result *r) {
    bool wall = t->class->wall, queries = t->class->queries > 0;
    add(c, wall ? "clock" : queries ? "incode" : "node", each(r->node, r), 0);
    if (!wall && !queries)
        add(c, "+ host", each(r->host > 0 ? r->node + r->host : 0, r), 0);
    for (unsigned i = 0; i < HOST_BENCH_PEERS; i++) {
        if (t->peer[i]) {
            add(c, host_bench_peer_title(t->class, i), each(r->peer[i], r), 0)
                ->beyond = r->peer_late[i];
        }
    }
    if (t->peer[0])
        add_held(c, "CGAL /", over(r->peer[0], r->node), false, r->ratio);
    if (t->peer[0] && !wall && !queries) {
        add(c, "+ host", over(r->peer[0], r->host > 0 ? r->node + r->host : 0),
            2);
    }
}

static void collect(struct cells *c, const struct host_bench_table *t,
                    const struct host_bench_result *r) {
    const struct host_bench_class *class = t->class;
    c->count = 0;
    add(c, "points", (double)r->points, 0);
    add(c, class->queries > 0 ? "found" : "tetrahedra", (double)r->tetrahedra,
        0);
    add_times(c, t, r);
    if (class->queries > 0)
        return;
    add_held(c, "seconds", r->late ? t->limit_s : r->node, true, r->seconds);
    c->cell[c->count - 1].beyond = r->late;
    if (class->extra_ms > 0 && t->peer[0]) {
        add_held(c, "ms more",
                 r->node > 0 && r->peer[0] > 0
                     ? fmax(1e3 * (r->node + r->host_all - r->peer[0]), 1e-9)
                     : 0,
                 true, class->extra_ms);
    }
    add(c, "pages", (double)r->pages, 0);
    add(c, "asked for", (double)r->pages_asked, 0);
    add_held(c, "/ pages", over((double)r->pages_asked, (double)r->pages), true,
             class->pages_most);
    if (class->versus != NULL) {
        bool late = class->narrower ? r->other_late : r->late;
        double more = class->narrower ? r->other : r->node;
        double less = class->narrower ? r->node : r->other;
        add_held(c, class->versus, over(late ? t->limit_s : more, less), true,
                 class->versus_most);
        c->cell[c->count - 1].beyond = late;
    }
    if (has_steps(class))
        add_held(c, "step", step(t, r), true, r->step);
}

static bool reached(const struct cell *cell) {
    return cell->value > 0 && !cell->beyond &&
           (cell->most ? cell->value <= cell->goal : cell->value >= cell->goal);
}

static void print_text(const struct cell *cell, const char *value,
                       const char *goal) {
    if (cell->held)
        printf(" %*s %-6s", VALUE, value, goal);
    else
        printf(" %*s", cell->digits == 0 ? VALUE + 2 : VALUE, value);
}

static void print_cell(struct host_bench_table *t, const struct cell *cell) {
    char value[32] = "-", goal[32] = "";
    if (cell->value > 0) {
        (void)snprintf(value, sizeof value, "%s%.*f", cell->beyond ? "> " : "",
                       cell->digits, cell->value);
    }
    if (cell->goal > 0) {
        bool well = reached(cell);
        (void)snprintf(goal, sizeof goal, "%s%.3g%s",
                       cell->most ? "<=" : ">=", cell->goal, well ? " " : "!");
        t->goals++;
        t->reached += well ? 1 : 0;
    }
    print_text(cell, value, goal);
}

void host_bench_table_begin(struct host_bench_table *table,
                            const struct host_bench_class *c,
                            const bool peer[HOST_BENCH_PEERS], double limit_s) {
    static const struct host_bench_result nothing = {.name = ""};
    struct cells cells;
    memset(table, 0, sizeof *table);
    table->class = c;
    table->limit_s = limit_s;
    memcpy(table->peer, peer, sizeof table->peer);
    collect(&cells, table, &nothing);
    host_progress_erase();
    printf("\n%s: %s\n%-*s", c->name, c->title, NAME, "");
    for (unsigned i = 0; i < cells.count; i++)
        print_text(&cells.cell[i], cells.cell[i].title, "");
    printf("\n");
    (void)fflush(stdout);
}

void host_bench_table_row(struct host_bench_table *table,
                          const struct host_bench_result *result) {
    struct cells cells;
    collect(&cells, table, result);
    host_progress_erase();
    printf("%-*.*s", NAME, NAME, result->name);
    for (unsigned i = 0; i < cells.count; i++)
        print_cell(table, &cells.cell[i]);
    printf("\n");
    (void)fflush(stdout);
    for (unsigned i = 0; i < HOST_BENCH_PEERS; i++) {
        double ratio =
            over(result->peer[i], result->late ? table->limit_s : result->node);
        if (ratio > 0 && table->rows < HOST_BENCH_ROWS_MAX)
            table->ratio[i][table->ratios[i]++] = ratio;
    }
    if (table->rows++ == 0)
        table->first = *result;
    table->before = *result;
    (void)snprintf(table->before_name, sizeof table->before_name, "%s",
                   result->name);
}

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double mean(const double *ratio, unsigned n) {
    double sum = 0;
    for (unsigned i = 0; i < n; i++)
        sum += log(ratio[i]);
    return exp(sum / n);
}

unsigned host_bench_table_end(struct host_bench_table *table) {
    const struct host_bench_class *c = table->class;
    for (unsigned i = 0; i < HOST_BENCH_PEERS; i++) {
        double *ratio = table->ratio[i], goal = c->summary[i];
        unsigned n = table->ratios[i];
        /* The clock on two threads is no match for processor time. */
        if (n == 0 || (i == HOST_BENCH_THREADED && !c->wall))
            continue;
        qsort(ratio, n, sizeof *ratio, compare);
        double middle = c->means ? mean(ratio, n)
                                 : 0.5 * (ratio[(n - 1) / 2] + ratio[n / 2]);
        printf("%s / incode: %s %.2f", host_bench_peer_title(c, i),
               c->means ? "geometric mean" : "median", middle);
        if (goal > 0) {
            printf(" >=%.3g%s", goal, middle >= goal ? "" : "!");
            table->goals++;
            table->reached += middle >= goal ? 1 : 0;
        }
        printf(", least %.2f, most %.2f, of %u\n", ratio[0], ratio[n - 1], n);
    }
    if (table->goals > 0)
        printf("goals reached: %u of %u\n", table->reached, table->goals);
    (void)fflush(stdout);
    return table->goals - table->reached;
}

/* --- gnuplot -------------------------------------------------------------- */

/* gnuplot, with these as its standard input and output: as waitpid has it, or
 * -1. */
static int gnuplot(const char *word, int in, int out) {
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        (void)dup2(in, STDIN_FILENO);
        (void)dup2(out, STDOUT_FILENO);
        (void)execlp("gnuplot", "gnuplot", word, (char *)NULL);
        _exit(127);
    }
    return child < 0 || waitpid(child, &status, 0) < 0 ? -1 : status;
}

int host_gnuplot_there(const char *path, struct host_error *error) {
    int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    int status = nothing < 0 ? -1 : gnuplot("--version", nothing, nothing);
    (void)close(nothing);
    return status == 0 ? 0
                       : host_fail(error, HOST_INPUT,
                                   "%s: gnuplot is not installed; install "
                                   "gnuplot-nox, or leave --svg out",
                                   path);
}

/* With its standard input from the script and its output to the file, whose
 * name may have any letters. */
int host_gnuplot_draw(FILE *script, const char *path,
                      struct host_error *error) {
    (void)fflush(script);
    rewind(script);
    FILE *out = host_create_over(path);
    if (out == NULL) {
        return host_fail(error, HOST_INPUT, "%s: %s; choose another file", path,
                         strerror(errno));
    }
    int status = gnuplot("-", fileno(script), fileno(out));
    (void)fclose(out);
    if (status != 0) {
        (void)unlink(path);
        return host_fail(error, HOST_BROKEN,
                         "%s: gnuplot does not draw it; see what it says",
                         path);
    }
    return 0;
}
