#include "bench.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "host/base/error.h"
#include "bench_boards.h"
#include "bench_peers.h"
#include "bench_links.h"
#include "paper.h"
#include "bench_scale.h"
#include "bench_scaling.h"
#include "host/base/options.h"
#include "host/base/text.h"
#include "host/service/machine.h"
#include "bench_table.h"
#include "host/base/progress.h"

enum {
    PINGS = 200,
    FIRST = 16, /* messages of the first trial, by which the second is sized */
    MOST = 200000,
    TRIAL_US = 700000,
    PATIENCE_US = 20000000,
    LINGER_US = 30000,
    FAST_BAUD = 3000000 /* as which a pseudo-terminal counts */
};

/* What a message asks, in its first byte. */
enum { ECHO, STREAM, DATA, USED, LEAVE };

struct bench {
    struct host_bench_end *end;
    struct link *link;
    uint64_t heard_us;
    uint32_t due; /* of a stream: to be written, */
    uint32_t got; /* and read */
    bool left;
    uint8_t answer[HOST_BENCH_SMALL];
};

uint64_t host_bench_used_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static bool say(struct bench *b, uint8_t what, uint64_t value, size_t size) {
    uint8_t bytes[HOST_BENCH_MESSAGE] = {what};
    memcpy(bytes + 8, &value, sizeof value);
    return link_write(b->link, bytes, size, NULL, 0) == 0;
}

/* False: no room for the answer yet. */
static bool take(struct bench *b, const struct link_message *m, unsigned role) {
    uint64_t value;
    uint8_t what = m->data[0];
    memcpy(&value, m->data + 8, sizeof value);
    if (role == 1 && what == ECHO)
        return say(b, ECHO, value, m->size);
    if (role == 1 && what == USED)
        return say(b, USED, host_bench_used_us(), HOST_BENCH_SMALL);
    if (what == STREAM)
        b->due = (uint32_t)value;
    else if (what == DATA)
        b->got++;
    else if (what == LEAVE)
        b->left = true;
    memcpy(b->answer, m->data, HOST_BENCH_SMALL);
    return true;
}

/* One look at the link: how many messages came. */
static unsigned turn(struct bench *b, unsigned role) {
    struct link_message message;
    unsigned got = 0;
    uint64_t now = host_now_us();
    int moved = link_poll_receive(b->link, now);
    while (link_read(b->link, &message) && take(b, &message, role)) {
        link_release(b->link);
        b->heard_us = now;
        got++;
    }
    while (b->due > 0 && say(b, DATA, 0, HOST_BENCH_MESSAGE))
        b->due--;
    moved += link_poll_send(b->link, host_now_us());
    if (got == 0 && moved == 0)
        b->end->idle(b->end->context, link_next_due_us(b->link, now));
    return got;
}

static bool patient(const struct bench *b) {
    return host_now_us() - b->heard_us < PATIENCE_US;
}

/* Microseconds from question to answer; < 0: there is none. */
static double ask(struct bench *b, uint8_t what, size_t size) {
    uint64_t begin = host_now_us();
    while (!say(b, what, 0, size))
        (void)turn(b, 0);
    while (turn(b, 0) == 0)
        if (!patient(b))
            return -1;
    return (double)(host_now_us() - begin);
}

static double mean_round_trip(struct bench *b, size_t size) {
    double sum = 0;
    uint64_t begin = host_now_us();
    for (unsigned i = 1; i <= PINGS; i++) {
        double us = ask(b, ECHO, size);
        sum += us;
        if (us < 0 || host_now_us() - begin > TRIAL_US)
            return us < 0 ? us : sum / i;
    }
    return sum / PINGS;
}

/* `count` messages each way at once: microseconds. */
static double stream(struct bench *b, uint32_t count) {
    uint64_t begin = host_now_us();
    while (!say(b, STREAM, count, HOST_BENCH_SMALL))
        (void)turn(b, 0);
    b->due = count;
    b->got = 0;
    while (b->got < count || b->due > 0 || !link_idle(b->link)) {
        (void)turn(b, 0);
        if (!patient(b))
            return -1;
    }
    return (double)(host_now_us() - begin);
}

static uint64_t used_by_both(struct bench *b) {
    uint64_t other;
    (void)ask(b, USED, HOST_BENCH_SMALL);
    memcpy(&other, b->answer + 8, sizeof other);
    return other + host_bench_used_us();
}

static int measure(struct bench *b, struct host_bench_row *row) {
    row->round_trip_us =
        ask(b, ECHO, HOST_BENCH_SMALL) < 0 ? -1 : 0; /* shakes hands */
    if (row->round_trip_us < 0)
        return -1;
    row->round_trip_us = mean_round_trip(b, HOST_BENCH_SMALL);
    row->hop_us = mean_round_trip(b, HOST_BENCH_MESSAGE) / 2;
    double trial = stream(b, FIRST);
    double fits = FIRST * (double)TRIAL_US / trial;
    uint32_t count = fits < FIRST ? FIRST : fits > MOST ? MOST : (uint32_t)fits;
    uint64_t used = used_by_both(b);
    double us = stream(b, count);
    used = used_by_both(b) - used;
    const struct link_statistics *s = link_statistics(b->link);
    row->bytes_per_s = 1e6 * count * HOST_BENCH_MESSAGE / us;
    row->cpu_us = (double)used / (2.0 * count);
    row->retransmitted = (double)s->retransmitted / (double)s->frames_sent;
    return trial < 0 || us < 0 ? -1 : 0;
}

/* Until the farewell has arrived, as far as that can be told. */
static void linger(struct bench *b) {
    uint64_t begin = host_now_us();
    while (host_now_us() - begin < LINGER_US) {
        (void)link_poll(b->link, host_now_us());
        b->end->idle(b->end->context, LINGER_US / 10);
    }
}

int host_bench_end(struct host_bench_end *end, unsigned role,
                   struct host_bench_row *row) {
    struct bench b = {.end = end, .heard_us = host_now_us()};
    struct link_config config = end->settings;
    int status = -1;
    config.pipe = end->pipe;
    config.epoch = (uint32_t)b.heard_us | 1;
    config.node = (uint16_t)role;
    config.peer_node = (uint16_t)(1 - role);
    size_t bytes = link_bytes(&config);
    void *memory = malloc(bytes);
    b.link = memory == NULL ? NULL : link_init(memory, bytes, &config);
    if (b.link != NULL && role == 0) {
        status = measure(&b, row);
        (void)say(&b, LEAVE, 0, HOST_BENCH_SMALL);
        linger(&b);
    } else if (b.link != NULL) {
        while (!b.left && patient(&b))
            (void)turn(&b, role);
        linger(&b);
        status = b.left ? 0 : -1;
    }
    free(memory);
    return status;
}

struct link_config host_bench_serial(uint32_t baud) {
    struct link_config config = {.window = 14, .message_max = 1608};
    link_for_serial(&config, baud == 0 ? FAST_BAUD : baud);
    return config;
}

/* --- bench arguments ------------------------------------------------------ */

enum {
    NODES = 256,
    NODES_QUICK = 64,
    SCALING_NODES = 64,
    SCALING_NODES_QUICK = 8
};

struct arguments {
    const char *what; /* the benchmark */
    struct host_paper_options paper;
    struct host_bench_peers_options peers;
    struct host_scale_options scale;
    uint64_t given;
};

static void take_class(void *into, const char *value,
                       struct host_error *error) {
    ((struct arguments *)into)->peers.class = value;
    if (host_bench_class_named(value) == NULL) {
        host_fail(error, HOST_USAGE,
                  "--class %s: not in this version; allowed: %s", value,
                  host_bench_class_names());
    }
}

static void take_argument(void *into, const char *value,
                          struct host_error *error) {
    struct arguments *a = into;
    if (a->what == NULL) {
        a->what = value;
    } else if (a->peers.names == HOST_BENCH_NAMES_MAX) {
        host_fail(error, HOST_USAGE, "%s: more than %d names; give directories",
                  value, HOST_BENCH_NAMES_MAX);
    } else {
        a->peers.name[a->peers.names++] = value;
    }
}

/* Under each heading, which names the benchmarks that have them. */
static const struct host_option rows[] = {
    {.help = "Of paper:"},
    {"table", 0, "LIST",
     "Some tables alone, with commas between: 1 to 7, 11 (the figure), "
     "relation, goals, check (of the model)",
     HOST_AT(struct arguments, paper.tables)},
    {"strategy", 0, "NAME", "One strategy alone",
     HOST_AT(struct arguments, paper.strategy)},
    {"bluntfin", 0, "FILE",
     "The grid of NASA's Blunt Fin. Default: one like it",
     HOST_AT(struct arguments, paper.bluntfin)},
    {"million", 0, NULL, "The goal for 1,000,000 points on 1,024 nodes, too",
     HOST_AT(struct arguments, paper.large)},
    {.help = "Of peers:"},
    {"rounds", 0, "N", "Medians of N rounds. Default: 3",
     HOST_AT(struct arguments, peers.rounds), .least = 1,
     .most = HOST_BENCH_ROUNDS_MAX},
    {"class", 0, "NAME",
     "One class alone: uniform, files, volumes, real, small, thin, growth, "
     "extremes, locate or cube; real, small and cube are of the files given; "
     "in locate the peer qhull is scipy",
     .take = take_class},
    {"peers", 0, "LIST",
     "Some peers alone, with commas between: cgal, tetgen, qhull, hxt, hxt2 "
     "(hxt on two threads)",
     HOST_AT(struct arguments, peers.peers)},
    {"large", 0, NULL, "Sets of a million points too",
     HOST_AT(struct arguments, peers.large)},
    {"limit", 0, "S",
     "End a run after S seconds, and go on without. Default: 60",
     HOST_AT(struct arguments, peers.limit_s), .least = 1, .most = 1000000},
    {.help = "Of paper and scaling:"},
    {"quick", 0, NULL,
     "A tenth of the points, up to 64 nodes; or 30,000 points, up to 8",
     HOST_AT(struct arguments, paper.quick)},
    {"nodes", 'n', "N", "Up to N nodes. Default: 256; or 64",
     HOST_AT(struct arguments, paper.nodes_max), .most = HOST_NODES_MAX,
     .powers = ""},
    {.help = "Of scale:"},
    {"sizes", 0, "LIST",
     "Numbers of points, with commas between. Default: 1000000,10000000",
     HOST_AT(struct arguments, scale.sizes)},
    {"host-memory", 0, "SIZE", "The limit of every second run. Default: 200M",
     HOST_AT(struct arguments, scale.memory)},
    {"scratch", 0, "DIR",
     "Folder for the files: 400 bytes a point. Default: $TMPDIR, else /tmp",
     HOST_AT(struct arguments, scale.folder)},
    {.help = "Of paper, scaling, scale and boards:"},
    {"csv", 0, "FILE", "All rows, as CSV",
     HOST_AT(struct arguments, paper.csv)},
    {"svg", 0, "FILE",
     "Figure 11 or both curves, by gnuplot; or each board's instructions as a "
     "bar",
     HOST_AT(struct arguments, paper.svg)},
    {0}};

static const struct host_options options = {
    .rows = rows,
    .argument = take_argument,
    .arguments =
        "paper\nlinks\nboards\nscaling\nscale\npeers [DIRECTORY|FILE]...",
    .about =
        "Measures this machine: paper prints Tables 1 to 7 and figure 11 of "
        "Cignoni, Laforenza, Perego, Scopigno and Montani (1995) beside the "
        "paper's figures, for up to 256 nodes in virtual time; links prints "
        "what a link does over each driver; boards, in the source tree, what a "
        "tetrahedron costs each bare board, emulated, in instructions and "
        "bytes, and where they go; scaling, what a point costs from 1,000 to "
        "10,000,000 points, measured, and from 1 to 64 nodes, in virtual time; "
        "scale, the time, memory and scratch disk of a point from file to "
        "file, without a limit of memory and within one; peers, in the source "
        "tree, runs CGAL, TetGen, Qhull and HXT in turn "
        "with this program on points that it makes and on those given, and "
        "prints times, ratios and the goals of each class."};

/* An option that the benchmark has not, or NULL. */
static const char *other_option(const struct arguments *a) {
    const char *heading = "";
    for (unsigned i = 0; rows[i].help != NULL; i++) {
        heading = rows[i].name == NULL ? rows[i].help : heading;
        if ((a->given >> i & 1) != 0 && strstr(heading, a->what) == NULL)
            return rows[i].name;
    }
    return NULL;
}

/* Options and arguments that the benchmark has not. */
static int check(const struct arguments *a, struct host_error *error) {
    static const char *const all[] = {"paper",   "links", "boards",
                                      "scaling", "scale", "peers"};
    bool known = false, peers = strcmp(a->what, "peers") == 0;
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        known = known || strcmp(a->what, all[i]) == 0;
    if (!known) {
        return host_fail(error, HOST_USAGE,
                         "bench %s: not in this version; allowed: paper, "
                         "links, boards, scaling, scale, peers",
                         a->what);
    }
    const char *other = other_option(a);
    if (other != NULL) {
        return host_fail(error, HOST_USAGE,
                         "--%s: no option of bench %s; see "
                         "incode bench --help",
                         other, a->what);
    }
    return peers || a->peers.names == 0
               ? 0
               : host_fail(error, HOST_USAGE,
                           "%s: one argument too many; bench "
                           "%s takes none",
                           a->peers.name[0], a->what);
}

int host_bench(int argc, char **argv, struct host_error *error) {
    struct arguments a = {
        .peers = {.rounds = 3, .limit_s = 60},
        .scale = {.sizes = "1000000,10000000", .memory = "200M"}};
    if (host_options_parse(&options, argc, argv, false, &a, &a.given, error) !=
        0)
        return error->code;
    if (a.what == NULL) {
        return host_fail(error, HOST_USAGE,
                         "%s: too few arguments; give paper, links, boards, "
                         "scaling, scale or peers, see --help",
                         argv[0]);
    }
    if (check(&a, error) != 0)
        return error->code;
    if (strcmp(a.what, "links") == 0)
        return host_bench_links(error);
    if (strcmp(a.what, "boards") == 0) {
        struct host_bench_boards_options boards = {a.paper.csv, a.paper.svg};
        return host_bench_boards(&boards, error);
    }
    if (strcmp(a.what, "peers") == 0)
        return host_bench_peers(&a.peers, error);
    if (strcmp(a.what, "scale") == 0) {
        a.scale.csv = a.paper.csv;
        a.scale.svg = a.paper.svg;
        return host_bench_scale(&a.scale, error);
    }
    if (strcmp(a.what, "scaling") == 0) {
        struct host_scaling_options scaling = {a.paper.quick, a.paper.nodes_max,
                                               a.paper.csv, a.paper.svg};
        if (scaling.nodes_max == 0) {
            scaling.nodes_max =
                scaling.quick ? SCALING_NODES_QUICK : SCALING_NODES;
        }
        return host_bench_scaling(&scaling, error);
    }
    if (a.paper.nodes_max == 0)
        a.paper.nodes_max = a.paper.quick ? NODES_QUICK : NODES;
    return host_bench_paper(&a.paper, error);
}

/* --- bench build ---------------------------------------------------------- */

enum { MAKE_S = 600 };

static const struct {
    const char *name, *program, *threads, *header, *package;
} peers[HOST_BENCH_PEERS] = {
    {"cgal", "cgal", NULL, "/usr/include/CGAL/version.h", "libcgal-dev"},
    {"tetgen", "tetgen", NULL, "/usr/include/tetgen.h", "libtet1.5-dev"},
    {"qhull", "qhull", NULL, "/usr/include/libqhull_r/qhull_ra.h",
     "libqhull-dev"},
    {"hxt", "hxt", "1", "/usr/include/gmsh.h", "libgmsh-dev"},
    {"hxt2", "hxt", "2", "/usr/include/gmsh.h", "libgmsh-dev"},
};

/* Where this program was made; "build" where it is installed. */
static void build_folder(char folder[PATH_MAX]) {
    char archive[PATH_MAX + 32];
    ssize_t n = readlink("/proc/self/exe", folder, PATH_MAX - 1);
    folder[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash != NULL)
        *slash = '\0';
    (void)snprintf(archive, sizeof archive, "%s/libcore.a", folder);
    if (access(archive, R_OK) != 0)
        (void)snprintf(folder, PATH_MAX, "build");
}

/* Bit i: peer i is wanted. */
static int parse(const char *wanted, unsigned *set, struct host_error *error) {
    *set = 0;
    for (const char *at = wanted; *at != '\0';) {
        size_t n = strcspn(at, ",");
        unsigned i = 0;
        while (i < HOST_BENCH_PEERS && (strlen(peers[i].name) != n ||
                                        memcmp(peers[i].name, at, n) != 0))
            i++;
        if (i == HOST_BENCH_PEERS) {
            return host_fail(error, HOST_USAGE,
                             "--peers %.*s: not in this version; allowed: "
                             "cgal, tetgen, qhull, hxt, hxt2",
                             (int)n, at);
        }
        *set |= 1u << i;
        at += n + (at[n] == ',' ? 1 : 0);
    }
    return 0;
}

static int make(const char *folder, const char *path,
                struct host_error *error) {
    char program[] = "make", silent[] = "-s", build[PATH_MAX + 16];
    char target[PATH_MAX + 32];
    char *const words[] = {program, silent, build, target, NULL};
    struct host_trial trial;
    (void)snprintf(build, sizeof build, "BUILD=%s", folder);
    (void)snprintf(target, sizeof target, "%s", path);
    if (host_trial_run(words, MAKE_S, &trial, error) != 0)
        return error->code;
    return trial.status == 0
               ? 0
               : host_fail(error, HOST_BROKEN,
                           "%s: it cannot be made (%s); run make %s, or leave "
                           "it out",
                           path, trial.said, path);
}

static int need_source(const char *bench, struct host_error *error) {
    return access("Makefile", R_OK) == 0 &&
                   access("tests/bench/peer.hpp", R_OK) == 0
               ? 0
               : host_fail(error, HOST_USAGE,
                           "bench %s: there is no tests/bench here, of which "
                           "it is made; run it at the top of the source tree",
                           bench);
}

int host_bench_made(const char *name, char path[4096],
                    struct host_error *error) {
    char folder[PATH_MAX];
    if (need_source("boards", error) != 0)
        return error->code;
    build_folder(folder);
    (void)snprintf(path, 4096, "%.4000s/peers/%s", folder, name);
    return make(folder, path, error);
}

int host_bench_build(struct host_bench_builds *builds, const char *wanted,
                     struct host_error *error) {
    char folder[PATH_MAX];
    unsigned set;
    memset(builds, 0, sizeof *builds);
    if (wanted == NULL)
        wanted = "cgal,tetgen,qhull,hxt,hxt2";
    if (parse(wanted, &set, error) != 0)
        return error->code;
    if (need_source("peers", error) != 0)
        return error->code;
    build_folder(folder);
    host_progress_phase("making the peers", NULL);
    for (unsigned i = 0; i < HOST_BENCH_PEERS && error->code == 0; i++) {
        if ((set >> i & 1) == 0)
            continue;
        if (access(peers[i].header, R_OK) != 0) {
            host_note("%s: left out, as it is not installed; to have it: apt "
                      "install %s",
                      host_bench_peer_titles[i], peers[i].package);
            continue;
        }
        (void)snprintf(builds->path[i], sizeof builds->path[i],
                       "%.4000s/peers/%s", folder, peers[i].program);
        builds->threads[i] = peers[i].threads;
        builds->there[i] = make(folder, builds->path[i], error) == 0;
    }
    return error->code;
}
