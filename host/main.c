/* The host program.  Nothing here but its commands and their arguments. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/base/limits.h"
#include "host/base/options.h"
#include "host/base/text.h"
#include "host/bench/bench.h"
#include "host/verify/check.h"
#include "host/console/console.h"
#include "host/deploy/deploy.h"
#include "host/draw/draw.h"
#include "host/formats/output.h"
#include "host/flash/flash.h"
#include "host/flash/sign.h"
#include "host/formats/convert.h"
#include "host/formats/formats.h"
#include "host/formats/read.h"
#include "host/formats/write.h"
#include "host/nodes/cube_file.h"
#include "host/nodes/cube_new.h"
#include "host/mesh/gen.h"
#include "host/mesh/tetrahedra.h"
#include "host/run/arguments.h"
#include "host/run/launch.h"
#include "host/run/emulate.h"
#include "host/run/choose.h"
#include "host/run/run.h"
#include "host/sim/sim.h"
#include "incode/predicates/predicates.h"
#include "node/version.h"

const char *argp_program_version = "incode " NODE_VERSION;

enum { ARGUMENTS_MAX = 4 };

/* What the small commands take: arguments, and a few options. */
struct simple {
    const char *argument[ARGUMENTS_MAX];
    unsigned count, wants;
    const char *output;
    const char *format;
    uint64_t seed;
    bool sign;
    struct host_limits limits;
    const char *wanted; /* names of the arguments */
};

static void take_argument(void *into, const char *value,
                          struct host_error *error) {
    struct simple *s = into;
    if (s->count == s->wants) {
        host_fail(error, HOST_USAGE,
                  "%s: one argument too many; give %s, and quote names with "
                  "blanks",
                  value, s->wanted);
        return;
    }
    s->argument[s->count++] = value;
}

/* The text with the formats behind it, to be freed. */
static char *list_formats(const char *text, enum host_use use) {
    char list[HOST_FORMAT_LIST_MAX], *whole = NULL;
    host_format_list(use, list, sizeof list);
    return asprintf(&whole, "%s %s", text, list) < 0 ? NULL : whole;
}

static char *list_read(const char *text) {
    return list_formats(text, HOST_READ_POINTS);
}

static char *list_written(const char *text) {
    return list_formats(text, HOST_WRITE_POINTS);
}

/* Not 0: the command ends with error->code. */
static int parse(int argc, char **argv, const struct host_option *rows,
                 const char *arguments, const char *about, unsigned count,
                 struct simple *simple, struct host_error *error) {
    const struct host_options options = {.rows = rows,
                                         .argument = take_argument,
                                         .arguments = arguments,
                                         .about = about};
    const char *blank = strrchr(argv[0], ' '); /* incode gen */
    simple->wants = count;
    simple->wanted = arguments;
    if (host_options_parse(&options, argc, argv, false, simple, NULL, error) !=
            0 ||
        simple->count == count)
        return error->code;
    return host_fail(error, HOST_USAGE,
                     "%s: too few arguments; give %s, see %s --help",
                     blank == NULL ? argv[0] : blank + 1, arguments, argv[0]);
}

static int command_run(int argc, char **argv, struct host_error *error) {
    static struct host_run_result result;
    struct host_run_options options = {0};
    int rank = host_launch_rank();
    if (rank > 0 && host_arguments_try(argc, argv, &options) != 0)
        return 0; /* rank 0 says what is wrong, and ends with its status */
    if (rank <= 0 && host_arguments_run(argc, argv, &options, error) != 0)
        return error->code;
    if (options.link->ranks) {
        return rank >= 0 ? host_launch_become(rank, argv, error)
                         : host_launch_mpi(argv, &options, error);
    }
    if (options.cube != NULL && host_run_on_cube(&options, error) != 0)
        return error->code;
    return host_run(&options, &result, error);
}

static int command_gen(int argc, char **argv, struct host_error *error) {
    static const struct host_option options[] = {
        {"seed", 's', "S",
         "Another seed makes other points; bluntfin, grid and rotated have no "
         "chance in them. Default: 1",
         HOST_AT(struct simple, seed), .most = UINT64_MAX},
        {"output", 'o', "FILE",
         "Write to FILE, by its extension; -, the default, is .xyz on standard "
         "output",
         HOST_AT(struct simple, output)},
        {"format", 0, "NAME", "What FILE is to be, where no extension tells:",
         HOST_AT(struct simple, format), .fill = list_written},
        HOST_LIMITS_ROWS(struct simple, limits.memory, limits.folder),
        {0}};
    struct host_points points = {0};
    struct simple s = {.seed = 1};
    uint64_t n;
    if (parse(argc, argv, options, "KIND N",
              "Makes N points of a KIND: uniform, bubbles, bluntfin, sphere, "
              "grid, rotated (a grid turned out of its axes), hub (one point "
              "amid N-1 on a sphere), shell (of thickness 0.001), cylinder, "
              "torus, terrain (whole heights on a square grid), scales "
              "(coordinates from 2^-1000 to 2^1000), or lines (two that do not "
              "meet). N: 4 to 4294901760 (2^32 - 2^16).",
              2, &s, error) != 0)
        return error->code;
    if (host_parse_number(s.argument[0], 0, UINT64_MAX, &n) == 0) {
        return host_fail(error, HOST_USAGE,
                         "gen %s %s: the kind comes before the number; write "
                         "gen %s %s",
                         s.argument[0], s.argument[1], s.argument[1],
                         s.argument[0]);
    }
    bool number = host_parse_number(s.argument[1], 0, UINT64_MAX, &n) == 0;
    if (!number || n < HOST_GEN_MIN || n > host_gen_max) {
        return host_fail(error, HOST_USAGE, "gen %s %s: %s; give %d to %llu",
                         s.argument[0], s.argument[1],
                         number ? "too few points, or too many"
                                : "not a whole number of points",
                         HOST_GEN_MIN, (unsigned long long)host_gen_max);
    }
    if (s.output == NULL && isatty(STDOUT_FILENO)) {
        return host_fail(error, HOST_USAGE,
                         "gen: the points would go to the terminal; give -o "
                         "FILE, or -o - to see them");
    }
    s.output = s.output == NULL ? "-" : s.output;
    if (host_limits_enter(&s.limits, 0, NULL, s.output, error) == 0 &&
        host_gen(s.argument[0], n, s.seed, &points, error) == 0)
        host_points_write_as(s.output, s.format, &points, error);
    host_points_free(&points);
    (void)host_limits_leave();
    return host_output_commit(error);
}

static int verify(const struct simple *s, struct host_error *error) {
    static struct host_check_report report;
    struct host_points points = {0};
    struct host_tetrahedra tets = {0};
    int status = host_points_read_as(s->argument[0], s->format, &points, error);
    if (status == 0) {
        host_points_note(s->argument[0], &points);
        status = host_tetrahedra_read(s->argument[1], &tets, NULL, error);
    }
    if (status == 0) {
        status =
            host_verify(&points, &tets, HOST_CHECK_DELAUNAY, &report, error);
        if (status == HOST_UNVERIFIED)
            fputs(report.text, stderr);
    }
    if (status == 0) {
        host_say(stdout,
                 "%s: %llu tetrahedra, %llu hull facets: the Delaunay "
                 "triangulation of %llu distinct points of %s\n",
                 s->argument[1], (unsigned long long)report.tetrahedra,
                 (unsigned long long)report.hull_facets,
                 (unsigned long long)report.distinct, s->argument[0]);
    }
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    return status;
}

static int command_verify(int argc, char **argv, struct host_error *error) {
    static const struct host_option options[] = {
        {"format", 0, "NAME", "What POINTS holds, where no extension tells:",
         HOST_AT(struct simple, format), .fill = list_read},
        HOST_LIMITS_ROWS(struct simple, limits.memory, limits.folder),
        {0}};
    struct simple s = {0};
    if (parse(
            argc, argv, options, "POINTS TETS",
            "Checks exactly that TETS is the Delaunay triangulation of POINTS: "
            "every tetrahedron positive, no vertex inside the sphere of a "
            "neighbour, facets in pairs or on the convex hull, every distinct "
            "point a vertex.",
            2, &s, error) != 0)
        return error->code;
    int status = host_limits_enter(&s.limits, 0, s.argument[1], NULL, error);
    if (status == 0)
        status = verify(&s, error);
    (void)host_limits_leave();
    return status;
}

static int command_digest(int argc, char **argv, struct host_error *error) {
    static const struct host_option options[] = {
        HOST_LIMITS_ROWS(struct simple, limits.memory, limits.folder), {0}};
    struct host_tetrahedra tets = {0};
    struct host_digest digest;
    struct simple s = {0};
    if (parse(argc, argv, options, "TETS",
              "Prints the digest of a file of tetrahedra: SHA-256 of its rows, "
              "vertices and rows in ascending order.",
              1, &s, error) != 0)
        return error->code;
    if (host_limits_enter(&s.limits, 0, s.argument[0], NULL, error) == 0 &&
        host_tetrahedra_read(s.argument[0], &tets, NULL, error) == 0) {
        host_tetrahedra_sort(&tets);
        host_digest(&tets, &digest);
        printf("%s\n", digest.text);
    }
    host_tetrahedra_free(&tets);
    (void)host_limits_leave();
    return error->code;
}

static int command_convert(int argc, char **argv, struct host_error *error) {
    static const struct host_option options[] = {
        {"format", 0, "NAME",
         "IN holds points, and no extension tells of what format:",
         HOST_AT(struct simple, format), .fill = list_read},
        HOST_LIMITS_ROWS(struct simple, limits.memory, limits.folder),
        {0}};
    struct simple s = {0};
    if (parse(argc, argv, options, "IN OUT",
              "Converts points to points, or tetrahedra to tetrahedra, by the "
              "files' extensions.",
              2, &s, error) != 0)
        return error->code;
    if (host_limits_enter(&s.limits, 0, s.argument[0], s.argument[1], error) ==
        0)
        (void)host_convert(s.argument[0], s.format, s.argument[1], error);
    (void)host_limits_leave();
    return error->code;
}

static int command_draw(int argc, char **argv, struct host_error *error) {
    struct host_draw_options options = {0};
    if (host_draw_arguments(argc, argv, &options, error) != 0)
        return error->code;
    if (host_limits_enter(&options.limits, 0, options.tets, options.output,
                          error) == 0)
        (void)host_draw(&options, error);
    (void)host_limits_leave();
    return error->code;
}

static int command_key(int argc, char **argv, struct host_error *error) {
    static const struct host_option options[] = {
        {"sign", 0, NULL,
         "Makes a pair to sign images with instead: the secret half in FILE, "
         "the public one in FILE.pub",
         HOST_AT(struct simple, sign)},
        {0}};
    struct simple s = {0};
    if (parse(
            argc, argv, options, "FILE",
            "Makes the key of a cube, 64 random hexadecimal digits, in a new "
            "file that its owner alone can read.  Whoever has a copy can join "
            "the cube: give one to each machine of it, and to nobody else.",
            1, &s, error) != 0)
        return error->code;
    return s.sign ? host_sign_key_make(s.argument[0], error)
                  : host_key_make(s.argument[0], error);
}

static int command_sim(int argc, char **argv, struct host_error *error) {
    struct host_sim_options options = {0};
    if (host_sim_arguments(argc, argv, &options, error) != 0)
        return error->code;
    return host_sim_seeds(&options, error);
}

/* A command is a row: help and messages list it from here. */
struct command {
    const char *name, *arguments;
    const char *help; /* what it does, in a line or two */
    int (*run)(int argc, char **argv, struct host_error *error);
};

enum { HELP_COLUMN = 29, TEXT_MAX = 2048 };

static int command_help(int argc, char **argv, struct host_error *error);

static const struct command commands[] = {
    {"run", "POINTS -o OUT", "triangulate on a cube of nodes", command_run},
    {"gen", "KIND N -o FILE",
     "make points: uniform, bubbles, bluntfin, sphere,\ncylinder, torus, "
     "shell, terrain and others",
     command_gen},
    {"verify", "POINTS TETS", "check a triangulation exactly", command_verify},
    {"digest", "TETS", "print what tells triangulations apart", command_digest},
    {"convert", "IN OUT", "from one file format to another", command_convert},
    {"draw", "POINTS TETS -o FILE", "a section, as SVG or PNG", command_draw},
    {"cube", "FILE",
     "check a cube file, print what starts its nodes;\nwrite one "
     "to start from (--new)",
     host_cube_command},
    {"nodes", "--cube FILE|..",
     "who is there, what is missing or wired wrongly,\nand what to do next",
     host_nodes_command},
    {"console", "--cube FILE|..",
     "look at a cube, and tell its nodes what to do", host_console_command},
    {"key", "FILE", "make a cube's key; --sign: a pair to sign images",
     command_key},
    {"flash", "--cube FILE IMAGE",
     "bring a program to all boards of a cube at once", host_flash},
    {"sign", "IMAGE --key FILE", "sign a program for boards", host_sign},
    {"image", "IMAGE", "say what is in an image, and who signed it",
     host_image_show},
    {"deploy", "--cube FILE", "put nodes on boards with Linux, over ssh",
     host_deploy},
    {"emulate", "-o FILE.cube",
     "boards without a system, emulated, and the cube\nfile that leads to them",
     host_emulate},
    {"bench", "paper|links|..",
     "the paper's tables on this machine; its links;\nbare boards; a "
     "point's cost; other triangulators",
     host_bench},
    {"sim", "--seeds A..B", "whole cubes in virtual time, with faults",
     command_sim},
    {"help", "[COMMAND]", "this list, or what --help says of a command",
     command_help}};

enum { COMMANDS = sizeof commands / sizeof commands[0] };

/* "run, gen, verify" */
static const char *command_names(void) {
    static char names[TEXT_MAX];
    size_t used = 0;
    for (size_t i = 0; i < COMMANDS; i++) {
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s",
                                 i == 0 ? "" : ", ", commands[i].name);
    }
    return names;
}

/* The commands, where the text has %s. */
static char *list_commands(const char *text) {
    char rows[TEXT_MAX] = "", usage[64], *whole = NULL;
    size_t used = 0;
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

static const char *command_name(const void *unused, unsigned i) {
    (void)unused;
    return i < COMMANDS ? commands[i].name : NULL;
}

static const struct host_options top = {
    .first = true, /* which is the command */
    .arguments = "COMMAND ARGUMENT...",
    .about = "Exact Delaunay tetrahedra on a hypercube of small nodes.\v"
             "Commands:\n%s\n"
             "incode COMMAND --help says more of each, and README.md of all.",
    .fill = list_commands};

/* No command: what was meant. */
static int refuse_command(const char *word, struct host_error *error) {
    char quoted[512];
    const char *nearest = host_text_nearest(word, command_name, NULL);
    bool there = nearest == NULL && access(word, F_OK) == 0;
    if (there || strchr(word, '.') != NULL) { /* which no command has */
        bool fits = host_text_quote(quoted, sizeof quoted, word) == 0;
        return host_fail(
            error, HOST_USAGE,
            "%s: a file's name, no command; to triangulate it, write "
            "incode run %s -o OUT",
            word, fits ? quoted : "POINTS");
    }
    return host_fail(
        error, HOST_USAGE, "%s: no such command; %s%s%sallowed: %s", word,
        nearest == NULL ? "" : "did you mean ", nearest == NULL ? "" : nearest,
        nearest == NULL ? "" : "? ", command_names());
}

static int dispatch(int argc, char **argv, struct host_error *error) {
    static char name[64];
    for (size_t i = 0; i < COMMANDS; i++) {
        if (strcmp(argv[0], commands[i].name) == 0) {
            snprintf(name, sizeof name, "incode %s", commands[i].name);
            argv[0] = name;
            return commands[i].run(argc, argv, error);
        }
    }
    return refuse_command(argv[0], error);
}

static int command_help(int argc, char **argv, struct host_error *error) {
    static char program[] = "incode", option[] = "--help";
    if (argc > 2) {
        return host_fail(error, HOST_USAGE,
                         "%s: one command too many; incode help says more of "
                         "one",
                         argv[2]);
    }
    if (argc == 2 && argv[1][0] != '-' && strcmp(argv[1], "help") != 0) {
        char *words[] = {argv[1], option, NULL};
        return dispatch(2, words, error);
    }
    char *words[] = {program, option, NULL};
    int none = 0;
    return host_options_parse(&top, 2, words, false, &none, NULL, error);
}

/* What was printed, help included, has to arrive. */
static void finish_stdout(void) {
    struct host_error error = {0};
    if (host_output_printed(&error) != 0) {
        (void)fprintf(stderr, "incode: %s\n", error.text);
        _exit(HOST_INPUT);
    }
}

static int run(int argc, char **argv, struct host_error *error) {
    int command = 0;
    if (host_options_parse(&top, argc, argv, false, &command, NULL, error) != 0)
        return error->code;
    if (command == 0) {
        return host_fail(error, HOST_USAGE,
                         "COMMAND: none is given; allowed: %s",
                         command_names());
    }
    if (host_begin_processor(error) != 0)
        return error->code;
    const char *fault = incode_arithmetic_fault();
    if (fault != NULL) {
        return host_fail(error, HOST_BROKEN,
                         "this machine: %s; run make clean and make without "
                         "flags that loosen floating point",
                         fault);
    }
    return dispatch(argc - command, argv + command, error);
}

int main(int argc, char **argv) {
    static char name[] = "incode";
    struct host_error error = {0};
    host_begin("incode");
    (void)atexit(finish_stdout);
    argv[0] = name;
    int status = run(argc, argv, &error);
    if (status != 0 && error.text[0] != '\0') /* else it is said */
        fprintf(stderr, "incode: %s\n", error.text);
    return status;
}
