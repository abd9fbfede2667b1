#include "bench_peers.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bench.h"
#include "bench_table.h"
#include "bench_scaling.h"
#include "host/base/progress.h"
#include "host/formats/formats.h"
#include "host/run/run.h"

/* --- bench class ---------------------------------------------------------- */

static const struct host_bench_class classes[] = {
    {.name = "uniform",
     .title = "evenly spread points; sequential, one node of 4M",
     .made = {{.kind = "uniform", .n = 20000, .ratio = 2.5},
              {.kind = "uniform", .n = 100000, .ratio = 2.5},
              {.kind = "uniform", .n = 1000000, .ratio = 3, .large = true}},
     .way = HOST_WAY_ALONE,
     .summary = {2.5, 2.5, 10}},
    {.name = "files",
     .title = "whole programs by the clock, .npy to .npy; default options",
     .made = {{.kind = "uniform", .n = 100000},
              {.kind = "uniform", .n = 1000000, .ratio = 2}},
     .way = HOST_WAY_USUAL,
     .wall = true,
     .whole = true},
    {.name = "volumes",
     .title = "other volumes; sequential, one node of 4M; step: a tetrahedron "
              "against Uniform's",
     .made = {{.kind = "uniform", .n = 20000},
              {.kind = "bubbles", .n = 20000, .step = 1.5},
              {.kind = "bluntfin", .n = 40960, .step = 2},
              {.kind = "rotated", .n = 1000000, .step = 3, .large = true}},
     .way = HOST_WAY_ALONE,
     .first = true},
    {.name = "real",
     .title = "files of 5,000 points or more; sequential, one node of 4M",
     .files = HOST_FILES_MANY,
     .way = HOST_WAY_ALONE,
     .ratio = 1,
     .summary = {2}},
    {.name = "small",
     .title = "files of fewer points; sequential, one node of 4M",
     .files = HOST_FILES_FEW,
     .way = HOST_WAY_ALONE,
     .extra_ms = 5},
    {.name = "thin",
     .title = "a shell and a terrain; default options, against 64M",
     .made = {{.kind = "shell", .n = 200000}, {.kind = "terrain", .n = 160000}},
     .way = HOST_WAY_USUAL,
     .other = HOST_WAY_ROOMY,
     .versus = "/ 64M",
     .versus_most = 1.5,
     .pages_most = 4},
    {.name = "growth",
     .title = "surfaces of one kind; sequential, one node of 4M, against "
              "512K; step: against half the points",
     .made = {{.kind = "sphere", .n = 12500, .ratio = 1},
              {.kind = "sphere", .n = 25000, .ratio = 1, .step = 2.4},
              {.kind = "sphere", .n = 50000, .ratio = 1, .step = 2.4},
              {.kind = "sphere", .n = 100000, .ratio = 1, .step = 2.4},
              {.kind = "cylinder", .n = 12500},
              {.kind = "cylinder", .n = 25000, .step = 2.4},
              {.kind = "cylinder", .n = 50000, .step = 2.4},
              {.kind = "cylinder", .n = 100000, .step = 2.4},
              {.kind = "torus", .n = 12500},
              {.kind = "torus", .n = 25000, .step = 2.4},
              {.kind = "torus", .n = 50000, .step = 2.4},
              {.kind = "torus", .n = 100000, .step = 2.4}},
     .way = HOST_WAY_ALONE,
     .other = HOST_WAY_NARROW,
     .narrower = true,
     .versus = "512K /",
     .versus_most = 3},
    {.name = "extremes",
     .title = "all scales, and skew lines; sequential, one node of 4M",
     .made = {{.kind = "scales", .n = 3000, .seconds = 5},
              {.kind = "lines", .n = 2000, .seconds = 5}},
     .way = HOST_WAY_ALONE},
    {.name = "locate",
     .title = "200,000 queries on one thread, ns a query that is found; CGAL's "
              "in the order of its spatial sort",
     .made = {{.kind = "uniform", .n = 20000, .ratio = 1.5},
              {.kind = "uniform", .n = 100000, .ratio = 1.5},
              {.kind = "uniform", .n = 1000000, .ratio = 1.5, .large = true}},
     .queries = 200000,
     .summary = {1.5, 0, 10}},
    {.name = "cube",
     .title = "files of 5,000 points or more by the clock; spatial, 8 nodes of "
              "512K, against 1M",
     .files = HOST_FILES_MANY,
     .way = HOST_WAY_CUBE,
     .other = HOST_WAY_CUBE_2,
     .wall = true,
     .means = true,
     .versus = "/ 1M",
     .versus_most = 4,
     .ratio = 0.05,
     .summary = {1.0 / 3}},
};

enum { CLASSES = sizeof classes / sizeof classes[0] };

/* Goals of sets that are known by name: surfaces, and those that are hard. */
static const struct {
    const char *name;
    double ratio;
} goals[] = {{"bunny", 1.5},       {"globe_terrain", 1.5},
             {"tank", 1.5},        {"terrain", 1.5},
             {"bullet", 1.5},      {"wing_layers", 0.5},
             {"axial_stage", 0.5}, {"torus", 0.5},
             {"trajectory", 0.5},  {"buildings_crop", 0.5}};

static const char *const ways[HOST_WAYS][7] = {
    [HOST_WAY_ALONE] = {"--strategy", "sequential", "--nodes", "1", "--memory",
                        "4M"},
    [HOST_WAY_NARROW] = {"--strategy", "sequential", "--nodes", "1", "--memory",
                         "512K"},
    [HOST_WAY_ROOMY] = {"--memory", "64M"},
    [HOST_WAY_CUBE] = {"--strategy", "spatial", "--nodes", "8", "--memory",
                       "512K"},
    [HOST_WAY_CUBE_2] = {"--strategy", "spatial", "--nodes", "8", "--memory",
                         "1M"},
};

/* Row i; NULL past the last. */
static const struct host_bench_class *host_bench_class_row(unsigned i) {
    return i < CLASSES ? &classes[i] : NULL;
}

const struct host_bench_class *host_bench_class_named(const char *name) {
    for (unsigned i = 0; i < CLASSES; i++)
        if (strcmp(name, classes[i].name) == 0)
            return &classes[i];
    return NULL;
}

const char *host_bench_class_names(void) {
    static char names[256];
    size_t used = 0;
    for (unsigned i = 0; i < CLASSES; i++) {
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s",
                                 i == 0 ? "" : ", ", classes[i].name);
    }
    return names;
}

/* Its options, ended by NULL. */
static const char *const *host_bench_way_options(enum host_bench_way way) {
    return ways[way];
}

/* The ratio that a file of this name is held to in a class; *named: it has one
 * of its own, and counts as one of many points. */
static double host_bench_goal(const struct host_bench_class *c,
                              const char *name, bool *named) {
    *named = false;
    for (unsigned i = 0; i < sizeof goals / sizeof goals[0]; i++) {
        if (strcmp(name, goals[i].name) == 0) {
            *named = true;
            return c->wall ? c->ratio : goals[i].ratio;
        }
    }
    return c->ratio;
}

/* --- bench peers ---------------------------------------------------------- */

/* Who takes turns: this program in two ways, then the peers. */
enum { MAIN, OTHER, PEER, TURNS = PEER + HOST_BENCH_PEERS, WORDS_MAX = 16 };

struct turns {
    unsigned rounds;
    bool late, failed;
    double cpu_s[HOST_BENCH_ROUNDS_MAX], host_s[HOST_BENCH_ROUNDS_MAX];
    double host_all_s[HOST_BENCH_ROUNDS_MAX];
    double wall_s[HOST_BENCH_ROUNDS_MAX];
    struct host_trial trial; /* the first */
};

struct bench {
    const struct host_bench_peers_options *options;
    const struct host_bench_class *class;
    struct host_bench_builds builds;
    struct host_bench_table table;
    struct turns turns[TURNS];
    char *file[HOST_BENCH_ROWS_MAX]; /* those given, and in directories */
    unsigned files, wrong;
    char to_file[4096];   /* CGAL from file to file, once it is needed */
    char locate[2][4096]; /* point location: the library's, CGAL's */
    struct host_bench_set query;
    char folder[32], target[48];  /* of what whole programs write; else empty */
    bool there[HOST_BENCH_PEERS]; /* in this class */
    bool left_out;                /* the set at hand has no triangulation */
};

/* --- one set -------------------------------------------------------------- */

/* The command of a turn that locates queries; false: it has none. */
static bool command_to_locate(const struct bench *b, unsigned turn,
                              const struct host_bench_set *set,
                              const char *words[WORDS_MAX]) {
    unsigned n = 0;
    bool scipy = turn == PEER + HOST_BENCH_QHULL;
    words[n++] = scipy ? "/usr/bin/python3" : b->locate[turn == MAIN ? 0 : 1];
    if (scipy)
        words[n++] = "tests/bench/scipy_locate.py";
    words[n++] = set->path;
    words[n++] = b->query.path;
    if (turn == MAIN)
        words[n++] = "1";
    words[n] = NULL;
    return turn == MAIN || (turn >= PEER && b->there[turn - PEER]);
}

/* The command of a turn; false: it has none in this class. */
static bool command(struct bench *b, unsigned turn,
                    const struct host_bench_set *set,
                    const char *words[WORDS_MAX]) {
    unsigned n = 0;
    bool first = b->turns[turn].rounds == 0;
    enum host_bench_way way = turn == MAIN ? b->class->way : b->class->other;
    if (b->class->queries > 0)
        return command_to_locate(b, turn, set, words);
    if (turn >= PEER && b->class->whole) {
        words[n++] = b->to_file;
        words[n++] = set->path;
        words[n++] = b->target;
        words[n] = NULL;
        return turn == PEER && b->builds.there[0];
    }
    if (turn >= PEER) {
        words[n++] = b->builds.path[turn - PEER];
        words[n++] = set->path;
        words[n] = b->builds.threads[turn - PEER];
        if (words[n] == NULL && first)
            words[n] = "digest";
        words[++n] = NULL;
        return b->builds.there[turn - PEER];
    }
    static const char *const head[] = {
        "/proc/self/exe", "run", NULL, "--format", "npy", "-q", "--stats", "-"};
    for (; n < sizeof head / sizeof head[0]; n++)
        words[n] = head[n] == NULL ? set->path : head[n];
    for (const char *const *o = host_bench_way_options(way); *o != NULL; o++)
        words[n++] = *o;
    if (b->class->whole) {
        words[n++] = "-o";
        words[n++] = b->target;
    }
    words[n] = NULL;
    return way != HOST_WAY_NONE;
}

static const char *title_of(const struct bench *b, unsigned turn) {
    return turn < PEER ? "incode"
                       : host_bench_peer_title(b->class, turn - PEER);
}

/* What went wrong in a turn; its set is left to the others. */
static void note_failure(struct bench *b, unsigned turn,
                         const struct host_bench_set *set,
                         const struct host_trial *trial) {
    b->turns[turn].failed = true;
    if (turn < PEER && trial->status == HOST_INPUT) {
        b->left_out = true;
        const char *why = strstr(trial->said, set->path);
        host_note("%s: left out%s", set->name,
                  why == NULL ? "" : why + strlen(set->path));
        return;
    }
    b->wrong += turn < PEER || b->class->queries > 0 ? 1 : 0;
    host_note("%s: %s ended with status %d: %s", set->name, title_of(b, turn),
              trial->status, trial->said);
}

static int take_turn(struct bench *b, unsigned turn, unsigned round,
                     const struct host_bench_set *set,
                     struct host_error *error) {
    const char *words[WORDS_MAX];
    char phase[64];
    struct turns *t = &b->turns[turn];
    struct host_trial trial;
    if (t->late || t->failed || !command(b, turn, set, words))
        return 0;
    (void)snprintf(phase, sizeof phase, "%.14s %llu: %s %u/%u", set->name,
                   (unsigned long long)set->points, title_of(b, turn),
                   round + 1, b->options->rounds);
    host_progress_phase(phase, NULL);
    int status = host_trial_run((char *const *)words, b->options->limit_s,
                                &trial, error);
    host_progress_phase("", NULL);
    t->late = trial.late;
    if (status == 0 && !trial.late &&
        (trial.status != 0 || trial.tetrahedra == 0)) {
        note_failure(b, turn, set, &trial);
    } else if (status == 0 && !trial.late) {
        if (t->rounds == 0)
            t->trial = trial;
        t->cpu_s[t->rounds] = trial.cpu_s;
        t->host_s[t->rounds] = trial.host_s;
        t->host_all_s[t->rounds] = trial.host_all_s;
        t->wall_s[t->rounds++] = b->class->whole ? trial.whole_s : trial.wall_s;
    }
    return status;
}

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *s, unsigned n) {
    qsort(s, n, sizeof *s, compare);
    return n == 0 ? 0 : 0.5 * (s[(n - 1) / 2] + s[n / 2]);
}

static double time_of(const struct bench *b, struct turns *t) {
    bool wall = b->class->wall || t == &b->turns[PEER + HOST_BENCH_THREADED];
    return t->late || t->failed
               ? 0
               : median(wall ? t->wall_s : t->cpu_s, t->rounds);
}

/* CGAL breaks ties as this program does: its tetrahedra are the same. */
static void check_digests(struct bench *b, const struct host_bench_set *set) {
    const char *first = b->turns[MAIN].trial.digest;
    for (unsigned turn = OTHER; turn <= PEER; turn++) {
        const char *other = b->turns[turn].trial.digest;
        if (first[0] != '\0' && other[0] != '\0' && strcmp(first, other) != 0) {
            b->wrong++;
            host_note("%s: %s, where %s has %s", set->name, first,
                      turn == OTHER ? "another memory" : "CGAL", other);
        }
    }
}

/* By turns, A B A B; then a row. */
static int measure(struct bench *b, const struct host_bench_set *set,
                   struct host_bench_result *r, struct host_error *error) {
    memset(b->turns, 0, sizeof b->turns);
    b->left_out = false;
    for (unsigned round = 0; round < b->options->rounds; round++) {
        for (unsigned turn = 0; turn < TURNS && !b->left_out; turn++)
            if (take_turn(b, turn, round, set, error) != 0)
                return error->code;
    }
    if (b->left_out)
        return 0;
    struct turns *own = &b->turns[MAIN];
    check_digests(b, set);
    r->name = set->name;
    r->points = set->points;
    for (unsigned turn = TURNS; turn-- > 0;)
        if (b->turns[turn].trial.tetrahedra > 0)
            r->tetrahedra = b->turns[turn].trial.tetrahedra;
    r->pages = own->trial.pages;
    r->pages_asked = own->trial.pages_asked;
    r->node = time_of(b, own);
    r->host = own->late ? 0 : median(own->host_s, own->rounds);
    r->host_all = own->late ? 0 : median(own->host_all_s, own->rounds);
    r->late = own->late;
    r->other = time_of(b, &b->turns[OTHER]);
    r->other_late = b->turns[OTHER].late;
    for (unsigned i = 0; i < HOST_BENCH_PEERS; i++) {
        r->peer[i] = time_of(b, &b->turns[PEER + i]);
        r->peer_late[i] = b->turns[PEER + i].late;
    }
    host_bench_table_row(&b->table, r);
    return 0;
}

/* --- files ---------------------------------------------------------------- */

static int add_file(struct bench *b, char *path, struct host_error *error) {
    if (path == NULL || b->files == HOST_BENCH_ROWS_MAX) {
        free(path);
        return host_fail(error, HOST_USAGE,
                         "bench peers: more than %d files; give fewer",
                         HOST_BENCH_ROWS_MAX);
    }
    b->file[b->files++] = path;
    return 0;
}

/* Of a directory, what has an extension of points. */
static int add_directory(struct bench *b, const char *path,
                         struct host_error *error) {
    struct dirent **entry;
    int count = scandir(path, &entry, NULL, alphasort);
    if (count < 0) {
        return host_fail(error, HOST_INPUT,
                         "%s: %s; give a directory of point "
                         "sets",
                         path, strerror(errno));
    }
    for (int i = 0; i < count; i++) {
        char *name = NULL;
        if (error->code == 0 &&
            host_format_of(entry[i]->d_name, HOST_READ_POINTS) != NULL) {
            (void)add_file(b,
                           asprintf(&name, "%s/%s", path, entry[i]->d_name) < 0
                               ? NULL
                               : name,
                           error);
        }
        free(entry[i]);
    }
    free(entry);
    return error->code;
}

static int find_files(struct bench *b, struct host_error *error) {
    for (unsigned i = 0; i < b->options->names && error->code == 0; i++) {
        const char *name = b->options->name[i];
        struct stat status;
        if (stat(name, &status) != 0) {
            host_fail(error, HOST_INPUT, "%s: %s; give files or directories",
                      name, strerror(errno));
        } else if (S_ISDIR(status.st_mode)) {
            (void)add_directory(b, name, error);
        } else {
            (void)add_file(b, strdup(name), error);
        }
    }
    return error->code;
}

/* --- classes -------------------------------------------------------------- */

/* Those of the files that are of this class. */
static int measure_files(struct bench *b, struct host_error *error) {
    const struct host_bench_class *c = b->class;
    for (unsigned i = 0; i < b->files && error->code == 0; i++) {
        struct host_bench_set set;
        struct host_bench_result result = {0};
        struct host_error unreadable = {0};
        bool named;
        host_progress_phase("reading", NULL);
        int status = host_bench_set_read(&set, b->file[i], &unreadable);
        result.ratio = host_bench_goal(c, set.name, &named);
        if (status != 0)
            host_note("left out: %s", unreadable.text);
        else if ((named || set.points >= HOST_BENCH_FEW) ==
                 (c->files == HOST_FILES_MANY))
            (void)measure(b, &set, &result, error);
        host_bench_set_free(&set);
    }
    return error->code;
}

static int measure_made(struct bench *b, struct host_error *error) {
    for (const struct host_bench_made *m = b->class->made;
         m->kind != NULL && error->code == 0; m++) {
        struct host_bench_set set;
        struct host_bench_result result = {
            .ratio = m->ratio, .seconds = m->seconds, .step = m->step};
        if (m->large && !b->options->large)
            continue;
        host_progress_phase("making points", NULL);
        if (host_bench_set_made(&set, m->kind, m->n, 1, error) == 0)
            (void)measure(b, &set, &result, error);
        host_bench_set_free(&set);
    }
    return error->code;
}

/* CGAL's whole program, and a place on a disk for what such write. */
static int make_target(struct bench *b, struct host_error *error) {
    if (b->builds.there[0] &&
        host_bench_made("cgal_file", b->to_file, error) != 0)
        return error->code;
    (void)strcpy(b->folder, "/tmp/incode-bench.XXXXXX");
    if (mkdtemp(b->folder) == NULL) {
        b->folder[0] = '\0';
        return host_fail(error, HOST_INPUT, "/tmp: %s; make room there",
                         strerror(errno));
    }
    (void)snprintf(b->target, sizeof b->target, "%s/out.npy", b->folder);
    return 0;
}

/* What locates queries, and the queries. */
static int make_locate(struct bench *b, struct host_error *error) {
    const char *wanted = b->options->peers;
    bool *there = b->there,
         scipy = wanted == NULL || strstr(wanted, "qhull") != NULL;
    memset(there, 0, sizeof b->there);
    there[0] = b->builds.there[0];
    there[HOST_BENCH_QHULL] =
        scipy && access("/usr/lib/python3/dist-packages/scipy", R_OK) == 0;
    if (scipy && !there[HOST_BENCH_QHULL])
        host_note("scipy: left out, as it is not installed; to have it: apt "
                  "install python3-scipy");
    if (host_bench_made("locate", b->locate[0], error) != 0 ||
        (there[0] && host_bench_made("cgal_locate", b->locate[1], error) != 0))
        return error->code;
    return host_bench_set_made(&b->query, "uniform", b->class->queries, 2,
                               error);
}

static void remove_target(struct bench *b) {
    host_bench_set_free(&b->query);
    if (b->folder[0] != '\0') {
        (void)unlink(b->target);
        (void)rmdir(b->folder);
        b->folder[0] = '\0';
    }
}

static int measure_class(struct bench *b, const struct host_bench_class *c,
                         struct host_error *error) {
    if (c->files != HOST_FILES_NONE && b->files == 0)
        return 0;
    b->class = c;
    memcpy(b->there, b->builds.there, sizeof b->there);
    if ((c->whole && make_target(b, error) != 0) ||
        (c->queries > 0 && make_locate(b, error) != 0)) {
        remove_target(b);
        return error->code;
    }
    host_bench_table_begin(&b->table, c, b->there, b->options->limit_s);
    int status = c->files == HOST_FILES_NONE ? measure_made(b, error)
                                             : measure_files(b, error);
    host_progress_erase();
    (void)host_bench_table_end(&b->table);
    remove_target(b);
    return status;
}

/* What the tables say of themselves. */
static void print_notes(const struct bench *b) {
    printf("Medians of %u rounds.  node: ns of processor time a tetrahedron, "
           "of all nodes;\n+ host: and of the host, from the points in its "
           "memory to the tetrahedra there;\npeers: of one call with the "
           "points in memory; HXT x2: by the clock,\non two threads.  ms more: "
           "with all that the host does, files apart.  CGAL /: its time to\n"
           "the node's.  !: a goal that is not reached.\n",
           b->options->rounds);
}

int host_bench_peers(const struct host_bench_peers_options *options,
                     struct host_error *error) {
    static struct bench bench;
    struct bench *b = &bench;
    const struct host_bench_class *c;
    memset(b, 0, sizeof *b);
    b->options = options;
    b->query.file = -1;
    host_progress_begin(true);
    if (find_files(b, error) == 0 &&
        host_bench_build(&b->builds, options->peers, error) == 0) {
        host_progress_erase();
        print_notes(b);
        for (unsigned i = 0;
             error->code == 0 && (c = host_bench_class_row(i)) != NULL; i++)
            if (options->class == NULL || strcmp(options->class, c->name) == 0)
                (void)measure_class(b, c, error);
    }
    host_progress_end();
    for (unsigned i = 0; i < b->files; i++)
        free(b->file[i]);
    if (error->code == 0 && b->wrong > 0) {
        host_fail(error, HOST_BROKEN,
                  "bench peers: %u runs failed or differ from CGAL's "
                  "tetrahedra; run those sets with --verify",
                  b->wrong);
    }
    return error->code;
}
