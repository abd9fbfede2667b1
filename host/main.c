/* The host program.  Nothing here but its commands and their arguments. */
#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/base/parse.h"
#include "host/base/text.h"
#include "host/bench/bench_links.h"
#include "host/bench/bench_paper.h"
#include "host/check/verify.h"
#include "host/files/output.h"
#include "host/formats/convert.h"
#include "host/formats/read.h"
#include "host/formats/write.h"
#include "host/machines/cube_file.h"
#include "host/mesh/gen.h"
#include "host/mesh/tetrahedra.h"
#include "host/run/arguments.h"
#include "host/run/begin.h"
#include "host/run/launch.h"
#include "host/run/on_cube.h"
#include "host/run/run.h"
#include "host/sim/sim.h"
#include "incode/predicates/predicates.h"

const char *argp_program_version = "incode 0.1.0";

enum { ARGUMENTS_MAX = 4 };

/* What the small commands take: arguments, and a few options. */
struct simple {
    const char *argument[ARGUMENTS_MAX];
    unsigned count, least, most;
    const char *output;
    uint64_t seed;
    unsigned nodes;
    const char *wanted; /* names of the arguments */
};

static error_t parse_simple(int key, char *value, struct argp_state *state)
{
    struct simple *s = state->input;
    uint64_t n = 0;
    switch (key) {
    case 'o':
        s->output = value;
        return 0;
    case 's':
        if (host_parse_number(value, 0, UINT64_MAX, &s->seed) != 0) {
            argp_error(state, "--seed %s: not a number; give 0 or more", value);
        }
        return 0;
    case 'n':
        if (host_parse_number(value, 1, HOST_PROCESSES_MAX, &n) != 0 ||
            (n & (n - 1)) != 0) {
            argp_error(state,
                       "--nodes %s: not a number of nodes of a cube; "
                       "allowed: 1, 2, 4, 8, 16, 32, 64",
                       value);
        }
        s->nodes = (unsigned)n;
        return 0;
    case ARGP_KEY_ARG:
        if (s->count == s->most) {
            argp_error(state, "%s: one argument too many; see --help", value);
        }
        s->argument[s->count++] = value;
        return 0;
    case ARGP_KEY_END:
        if (s->count < s->least) {
            argp_error(state, "%s: too few arguments; give all of these",
                       s->wanted);
        }
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static void parse(int argc, char **argv, const struct argp_option *options,
                  const char *arguments, const char *about, unsigned count,
                  struct simple *simple)
{
    const struct argp argp = {options, parse_simple, arguments, about,
                              NULL,    NULL,         NULL};
    simple->least = count;
    simple->most = count;
    simple->wanted = arguments;
    (void)argp_parse(&argp, argc, argv, 0, NULL, simple);
}

static int command_run(int argc, char **argv, struct host_error *error)
{
    static struct host_run_result result;
    struct host_run_options options = {0};
    int rank = host_launch_rank();
    if (rank > 0 && host_arguments_try(argc, argv, &options) != 0) {
        return 0; /* rank 0 says what is wrong, and ends with its status */
    }
    if (rank <= 0 && host_arguments_run(argc, argv, &options, error) != 0) {
        return error->code;
    }
    if (options.link->ranks) {
        return rank >= 0 ? host_launch_become(rank, argv, error)
                         : host_launch_mpi(argv, &options, error);
    }
    if (options.cube != NULL && host_run_on_cube(&options, error) != 0) {
        return error->code;
    }
    return host_run(&options, &result, error);
}

static int command_gen(int argc, char **argv, struct host_error *error)
{
    static const struct argp_option options[] = {
        {"seed", 's', "S", 0,
         "Another seed makes other points of uniform, bubbles, sphere and hub; "
         "the other kinds have no chance in them. Default: 1",
         0},
        {"output", 'o', "FILE", 0,
         "Write to FILE, by its extension; -, the default, is .xyz on standard "
         "output",
         0},
        {0}};
    struct host_points points = {0};
    struct simple s = {.seed = 1, .output = "-"};
    uint64_t n;
    parse(argc, argv, options, "KIND N",
          "Makes N points of a KIND: uniform, bubbles, bluntfin, sphere, "
          "grid, rotated (a grid turned out of its axes), or hub (one point "
          "amid N-1 on a sphere). N: 4 to 4294901760 (2^32 - 2^16).",
          2, &s);
    if (host_parse_number(s.argument[1], HOST_GEN_MIN, host_gen_max, &n) != 0) {
        return host_fail(error, HOST_USAGE,
                         "gen %s %s: not a number of points; give %d to "
                         "%llu",
                         s.argument[0], s.argument[1], HOST_GEN_MIN,
                         (unsigned long long)host_gen_max);
    }
    int status = host_gen(s.argument[0], n, s.seed, &points, error);
    if (status == 0) {
        host_points_write(s.output, &points, error);
    }
    host_points_free(&points);
    return host_output_commit(error);
}

static int command_verify(int argc, char **argv, struct host_error *error)
{
    static struct host_verify_report report;
    struct host_points points = {0};
    struct host_tetrahedra tets = {0};
    struct simple s = {0};
    parse(argc, argv, NULL, "POINTS TETS",
          "Checks exactly that TETS is the Delaunay triangulation of POINTS: "
          "every tetrahedron positive, no vertex inside the sphere of a "
          "neighbour, facets in pairs or on the convex hull, every distinct "
          "point a vertex, Euler's relation.",
          2, &s);
    int status = host_points_read(s.argument[0], &points, error);
    if (status == 0) {
        status = host_tetrahedra_read(s.argument[1], &tets, NULL, error);
    }
    if (status == 0) {
        status = host_verify(&points, &tets, &report, error);
        if (status == HOST_UNVERIFIED) {
            fputs(report.text, stderr);
        }
    }
    if (status == 0) {
        host_say(stdout,
                 "%s: %llu tetrahedra, %llu hull facets: the Delaunay "
                 "triangulation of %llu distinct points of %s\n",
                 s.argument[1], (unsigned long long)report.tetrahedra,
                 (unsigned long long)report.hull_facets,
                 (unsigned long long)report.distinct, s.argument[0]);
    }
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    return status;
}

static int command_digest(int argc, char **argv, struct host_error *error)
{
    struct host_tetrahedra tets = {0};
    struct host_digest digest;
    struct simple s = {0};
    parse(argc, argv, NULL, "TETS",
          "Prints the digest of a file of tetrahedra: SHA-256 of its rows, "
          "vertices and rows in ascending order.",
          1, &s);
    int status = host_tetrahedra_read(s.argument[0], &tets, NULL, error);
    if (status == 0) {
        host_tetrahedra_sort(&tets);
        host_digest(&tets, &digest);
        printf("%s\n", digest.text);
    }
    host_tetrahedra_free(&tets);
    return status;
}

static int command_convert(int argc, char **argv, struct host_error *error)
{
    struct simple s = {0};
    parse(argc, argv, NULL, "IN OUT",
          "Converts points to points, or tetrahedra to tetrahedra, by the "
          "files' extensions.",
          2, &s);
    return host_convert(s.argument[0], s.argument[1], error);
}

static int command_cube(int argc, char **argv, struct host_error *error)
{
    struct simple s = {0};
    parse(argc, argv, NULL, "FILE",
          "Checks a cube file, and prints how each of its nodes is started.", 1,
          &s);
    return host_cube_print(s.argument[0], error);
}

static int command_bench(int argc, char **argv, struct host_error *error)
{
    static const struct argp_option options[] = {
        {"nodes", 'n', "N", 0, "Up to N nodes. Default: 8", 0}, {0}};
    struct host_run_options run;
    struct simple s = {.nodes = 8};
    parse(argc, argv, options, "paper|links",
          "Measures this machine: paper prints Tables 2 and 4 of Cignoni, "
          "Laforenza, Perego, Scopigno and Montani (1995); links prints what a "
          "link does over each driver.",
          1, &s);
    if (strcmp(s.argument[0], "links") == 0) {
        return host_bench_links(error);
    }
    if (strcmp(s.argument[0], "paper") != 0) {
        return host_fail(error, HOST_USAGE,
                         "bench %s: not in this version; allowed: "
                         "paper, links",
                         s.argument[0]);
    }
    host_run_defaults(&run);
    return host_bench_paper(&run, s.nodes, error);
}

static int command_sim(int argc, char **argv, struct host_error *error)
{
    struct host_sim_options options;
    if (host_sim_arguments(argc, argv, &options, error) != 0) {
        return error->code;
    }
    return host_sim_seeds(&options, error);
}

/* A command is a row: help and messages list it from here. */
struct command {
    const char *name, *arguments;
    const char *help; /* what it does, in a line or two */
    int (*run)(int argc, char **argv, struct host_error *error);
};

enum { HELP_COLUMN = 23, TEXT_MAX = 2048 };

static const struct command commands[] = {
    {"run", "POINTS -o OUT", "triangulate on a cube of nodes", command_run},
    {"gen", "KIND N -o FILE",
     "make points: uniform, bubbles, bluntfin, sphere, grid,\nrotated, hub",
     command_gen},
    {"verify", "POINTS TETS", "check a triangulation exactly", command_verify},
    {"digest", "TETS", "print what tells triangulations apart", command_digest},
    {"convert", "IN OUT", "from one file format to another", command_convert},
    {"cube", "FILE", "check a cube file, print what starts its nodes",
     command_cube},
    {"bench", "paper|links", "the paper's tables on this machine; its links",
     command_bench},
    {"sim", "--seeds A..B", "whole cubes in virtual time, with faults",
     command_sim}};

enum { COMMANDS = sizeof commands / sizeof commands[0] };

/* "run, gen, verify" */
static const char *command_names(void)
{
    static char names[TEXT_MAX];
    size_t used = 0;
    for (size_t i = 0; i < COMMANDS; i++) {
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s",
                                 i == 0 ? "" : ", ", commands[i].name);
    }
    return names;
}

/* As argp asks for it: the commands, where its text has %s. */
static char *list_commands(int key, const char *text, void *input)
{
    char rows[TEXT_MAX] = "", usage[64], *whole = NULL;
    size_t used = 0;
    (void)input;
    if (key != ARGP_KEY_HELP_POST_DOC) {
        return (char *)text;
    }
    for (size_t i = 0; i < COMMANDS; i++) {
        const struct command *c = &commands[i];
        const char *more = strchr(c->help, '\n');
        int first = more == NULL ? (int)strlen(c->help) : (int)(more - c->help);
        snprintf(usage, sizeof usage, "  %s %s", c->name, c->arguments);
        used += (size_t)snprintf(rows + used, sizeof rows - used, "%-*s%.*s\n",
                                 HELP_COLUMN, usage, first, c->help);
        if (more != NULL) {
            used += (size_t)snprintf(rows + used, sizeof rows - used, "%*s%s\n",
                                     HELP_COLUMN, "", more + 1);
        }
    }
    return asprintf(&whole, text, rows) < 0 ? NULL : whole;
}

/* Stops at the first word that is no option: the command. */
/* NOLINTNEXTLINE(readability-non-const-parameter): argp's signature */
static error_t parse_top(int key, char *value, struct argp_state *state)
{
    int *command = state->input;
    switch (key) {
    case ARGP_KEY_ARG:
        (void)value;
        *command = state->next - 1;
        state->next = state->argc;
        return 0;
    case ARGP_KEY_NO_ARGS:
        argp_error(state, "no command; allowed: %s", command_names());
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int dispatch(int argc, char **argv, struct host_error *error)
{
    static char name[64];
    for (size_t i = 0; i < COMMANDS; i++) {
        if (strcmp(argv[0], commands[i].name) == 0) {
            snprintf(name, sizeof name, "incode %s", commands[i].name);
            argv[0] = name;
            return commands[i].run(argc, argv, error);
        }
    }
    return host_fail(error, HOST_USAGE, "%s: no such command; allowed: %s",
                     argv[0], command_names());
}

/* What was printed, help included, has to arrive. */
static void finish_stdout(void)
{
    struct host_error error = {0};
    if (host_output_printed(&error) != 0) {
        (void)fprintf(stderr, "incode: %s\n", error.text);
        _exit(HOST_INPUT);
    }
}

int main(int argc, char **argv)
{
    static const struct argp argp = {
        NULL,
        parse_top,
        "COMMAND ARGUMENT...",
        "Exact Delaunay tetrahedra on a hypercube of small nodes.\v"
        "Commands:\n%s\n"
        "incode COMMAND --help says more of each.",
        NULL,
        list_commands,
        NULL};
    struct host_error error = {0};
    int command = 0;
    argp_err_exit_status = HOST_USAGE;
    host_begin();
    (void)atexit(finish_stdout);
    (void)argp_parse(&argp, argc, argv, ARGP_IN_ORDER, NULL, &command);
    const char *fault = incode_arithmetic_fault();
    if (fault != NULL) {
        fprintf(stderr,
                "incode: this machine: %s; run make clean and make without "
                "flags that loosen floating point\n",
                fault);
        return HOST_BROKEN;
    }
    int status = dispatch(argc - command, argv + command, &error);
    if (status != 0) {
        if (error.text[0] != '\0') { /* else it is said */
            fprintf(stderr, "incode: %s\n", error.text);
        }
        return status;
    }
    return 0;
}
