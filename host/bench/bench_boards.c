#include "bench_boards.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/base/create.h"
#include "bench.h"
#include "bench_peers.h"
#include "bench_scaling.h"
#include "host/base/progress.h"
#include "host/nodes/boards.h"

const char *const host_room_names[HOST_ROOMS] = {
    [HOST_ROOM_PREDICATES] = "predicates", [HOST_ROOM_DOUBLES] = "doubles",
    [HOST_ROOM_SEARCH] = "search",         [HOST_ROOM_COMPLEX] = "complex",
    [HOST_ROOM_POINTS] = "points",         [HOST_ROOM_COPYING] = "copying",
    [HOST_ROOM_LINKS] = "links",           [HOST_ROOM_NODE] = "node",
    [HOST_ROOM_BOARD] = "board",
};

/* The first with which an object's path begins, in its board's folder. */
static const struct {
    const char *path;
    enum host_room room;
} rooms[] = {
    {"incode/predicates/", HOST_ROOM_PREDICATES},
    {"incode/apex/", HOST_ROOM_SEARCH},
    {"incode/pages/", HOST_ROOM_SEARCH},
    {"incode/front/", HOST_ROOM_COMPLEX},
    {"incode/complex/", HOST_ROOM_COMPLEX},
    {"incode/", HOST_ROOM_POINTS},
    {"transport/", HOST_ROOM_LINKS},
    {"node/", HOST_ROOM_NODE},
    {"boards/bare/memory.o", HOST_ROOM_COPYING},
    {"boards/bare/sqrt.o", HOST_ROOM_DOUBLES},
    {"boards/", HOST_ROOM_BOARD},
};

struct function {
    uint64_t from, bytes;
    enum host_room room;
};

/* In ascending order. */
struct functions {
    struct function *all;
    size_t count;
};

/* Behind the last "/firmware/BOARD/"; NULL: it is none of the firmware's. */
static const char *in_board(const char *path) {
    static const char firmware[] = "/firmware/";
    const char *found = NULL;
    for (const char *at = path; (at = strstr(at, firmware)) != NULL; at++)
        found = at;
    found = found == NULL ? NULL : strchr(found + sizeof firmware - 1, '/');
    return found == NULL ? NULL : found + 1;
}

static bool room_of(const char *path, enum host_room *room) {
    const char *object = in_board(path);
    for (size_t i = 0; object != NULL && i < sizeof rooms / sizeof rooms[0];
         i++) {
        if (strncmp(object, rooms[i].path, strlen(rooms[i].path)) == 0) {
            *room = rooms[i].room;
            return true;
        }
    }
    *room = HOST_ROOM_DOUBLES;
    return strstr(path, "libgcc.a(") != NULL;
}

static int by_address(const void *a, const void *b) {
    const struct function *f = a, *g = b;
    return (f->from > g->from) - (f->from < g->from);
}

static bool keep(struct functions *functions, struct function function) {
    enum { STEP = 1024 };
    if (functions->count % STEP == 0) {
        struct function *more =
            realloc(functions->all, (functions->count + STEP) * sizeof *more);
        if (more == NULL)
            return false;
        functions->all = more;
    }
    functions->all[functions->count++] = function;
    return true;
}

/* " .text.NAME  0xADDRESS  0xBYTES  OBJECT", the name on a line of its own
 * where it is long. */
static bool read_map(FILE *file, struct functions *functions) {
    char line[4096], object[4096];
    bool laid_out = false, code = false;
    struct function function;
    while (fgets(line, sizeof line, file) != NULL) {
        const char *at = strstr(line, " 0x");
        laid_out |= strncmp(line, "Linker script and memory map", 28) == 0;
        if (line[0] == ' ' && line[1] == '.') {
            code = strncmp(line, " .text", 6) == 0 ||
                   strncmp(line, " .vectors", 9) == 0;
        }
        if (laid_out && code && at != NULL &&
            sscanf(at, " 0x%" SCNx64 " 0x%" SCNx64 " %4095s", &function.from,
                   &function.bytes, object) == 3 &&
            function.bytes > 0 && room_of(object, &function.room) &&
            !keep(functions, function))
            return false;
    }
    if (functions->count > 0) {
        qsort(functions->all, functions->count, sizeof *functions->all,
              by_address);
    }
    return functions->count > 0;
}

/* What lies in no function is the board's. */
static enum host_room room_at(const struct functions *functions,
                              uint64_t address) {
    size_t low = 0, high = functions->count;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (functions->all[middle].from <= address)
            low = middle;
        else
            high = middle;
    }
    const struct function *function = &functions->all[low];
    return address - function->from < function->bytes ? function->room
                                                      : HOST_ROOM_BOARD;
}

static void add(FILE *file, const struct functions *functions,
                double counted[HOST_ROOMS]) {
    uint64_t block[3]; /* address, instructions, times: struct count */
    while (fread(block, sizeof block, 1, file) == 1 && block[1] != 0) {
        if (block[0] >= functions->all[0].from) { /* else it is the loader's */
            counted[room_at(functions, block[0])] +=
                (double)block[1] * (double)block[2];
        }
    }
}

static int add_folder(const char *folder, const struct functions *functions,
                      double counted[HOST_ROOMS], struct host_error *error) {
    char path[8192];
    struct dirent *entry;
    DIR *open_folder = opendir(folder);
    if (open_folder == NULL) {
        return host_fail(error, HOST_BROKEN, "%s: %s; run it again", folder,
                         strerror(errno));
    }
    while ((entry = readdir(open_folder)) != NULL && error->code == 0) {
        if (strstr(entry->d_name, ".count") == NULL)
            continue;
        (void)snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        FILE *file = fopen(path, "rbe");
        if (file == NULL) {
            host_fail(error, HOST_BROKEN, "%s: %s; run it again", path,
                      strerror(errno));
            continue;
        }
        add(file, functions, counted);
        (void)fclose(file);
        (void)remove(path);
    }
    (void)closedir(open_folder);
    return error->code;
}

int host_boards_count(const char *map, const char *folder,
                      double counted[HOST_ROOMS], struct host_error *error) {
    struct functions functions = {NULL, 0};
    FILE *file = fopen(map, "re");
    bool good = file != NULL && read_map(file, &functions);
    if (file != NULL)
        (void)fclose(file);
    if (!good) {
        host_fail(error, HOST_BROKEN,
                  "%s: no map of a linker; make it with: make firmware", map);
    } else {
        (void)add_folder(folder, &functions, counted, error);
    }
    free(functions.all);
    return error->code;
}

/* --- bench boards plot ---------------------------------------------------- */

enum { WIDTH = 760, LEFT = 110, BAR = 520, TOP = 60, STEP = 44, HIGH = 26 };
enum { KEY_STEP = 70 };

static const char *const colors[HOST_ROOMS] = {"#4477aa", "#aaccee", "#228833",
                                               "#ccbb44", "#66ccee", "#bbbbbb",
                                               "#ee6677", "#aa3377", "#777777"};

double host_boards_share(const struct host_boards_row *row, unsigned room) {
    double all = 0;
    for (unsigned i = 0; i < HOST_ROOMS; i++)
        all += row->counted[i];
    return all > 0 ? 100 * row->counted[room] / all : 0;
}

static void draw_row(FILE *file, const struct host_boards_row *row, double most,
                     int y) {
    double x = LEFT, length = BAR * row->instructions / most;
    fprintf(file, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s</text>\n",
            LEFT - 8, y + HIGH - 8, row->board);
    for (unsigned i = 0; i < HOST_ROOMS; i++) {
        double part = length * host_boards_share(row, i) / 100;
        fprintf(file,
                "<rect x=\"%.1f\" y=\"%d\" width=\"%.1f\" height=\"%d\" "
                "fill=\"%s\"/>\n",
                x, y, part, HIGH, colors[i]);
        x += part;
    }
    fprintf(file, "<text x=\"%.1f\" y=\"%d\">%.0f</text>\n", x + 6,
            y + HIGH - 8, row->instructions);
}

static void draw_key(FILE *file, int y) {
    for (unsigned i = 0; i < HOST_ROOMS; i++) {
        int x = LEFT + (int)i * KEY_STEP;
        fprintf(file,
                "<rect x=\"%d\" y=\"%d\" width=\"10\" height=\"10\" "
                "fill=\"%s\"/>\n<text x=\"%d\" y=\"%d\" "
                "font-size=\"10\">%s</text>\n",
                x, y, colors[i], x + 13, y + 9, host_room_names[i]);
    }
}

/* 0, or HOST_BROKEN. */
static int host_boards_plot(const char *path,
                            const struct host_boards_row *rows, unsigned count,
                            struct host_error *error) {
    double most = 1;
    int y = TOP;
    for (unsigned i = 0; i < count; i++)
        most = rows[i].instructions > most ? rows[i].instructions : most;
    FILE *file = host_create_over(path);
    if (file != NULL) {
        fprintf(file,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" "
                "height=\"%d\" font-family=\"sans-serif\" font-size=\"13\">\n"
                "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n"
                "<text x=\"%d\" y=\"24\">Instructions a tetrahedron, and "
                "where they go</text>\n",
                WIDTH, TOP + (int)count * STEP + 10, LEFT);
        draw_key(file, TOP - 24);
        for (unsigned i = 0; i < count; i++, y += STEP)
            draw_row(file, &rows[i], most, y);
        fprintf(file, "</svg>\n");
    }
    if (file == NULL || ferror(file) != 0 || fclose(file) != 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; choose another file", path,
                  strerror(errno));
    }
    return error->code;
}

/* --- bench boards --------------------------------------------------------- */

enum { POINTS = 5000, LIMIT_S = 900, NODES = 2, NODES_WORD = 4 };

/* An instruction of an emulated processor takes it 2^SHIFT ns: so its own clock
 * counts them. */
enum { SHIFT = 3 };

struct bench {
    const struct host_bench_boards_options *options;
    struct host_bench_set set;
    char folder[64];    /* of the emulators' stand-ins, and what they leave */
    char counter[4096]; /* tests/bench/instructions.c */
    char stats[80];
    char digest[80]; /* of processes of this machine */
    struct host_boards_row row[HOST_BOARDS_ROWS];
    unsigned rows;
};

/* --- the emulator, with what counts --------------------------------------- */

/* A program of its name, which is found before it and becomes it. */
static int stand_in(const struct bench *b, const struct host_bare *bare,
                    const char *program, struct host_error *error) {
    char path[160];
    (void)snprintf(path, sizeof path, "%s/%s", b->folder, bare->program);
    int fd = host_create(path, 0700);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "w");
    if (file != NULL) {
        fprintf(file,
                "#!/bin/sh\nexec '%s' \"$@\" -icount shift=%d,sleep=on "
                "-plugin '%s,folder=%s'\n",
                program, SHIFT, b->counter, b->folder);
    }
    if (file == NULL || fclose(file) != 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; make room there", path,
                  strerror(errno));
    }
    return error->code;
}

static void take_away(const struct bench *b, const char *name) {
    char path[PATH_MAX];
    (void)snprintf(path, sizeof path, "%s/%s", b->folder, name);
    (void)remove(path);
}

/* A run that failed leaves counts there. */
static void take_all_away(const struct bench *b) {
    struct dirent *entry;
    DIR *folder = opendir(b->folder);
    while (folder != NULL && (entry = readdir(folder)) != NULL)
        if (entry->d_name[0] != '.')
            take_away(b, entry->d_name);
    if (folder != NULL)
        (void)closedir(folder);
    (void)rmdir(b->folder);
}

/* Programs are found in the folder first, or as they were. */
static void find_first(const struct bench *b, const char *before) {
    char path[8192];
    (void)snprintf(path, sizeof path, "%s:%s", b->folder, before);
    (void)setenv("PATH", b->folder[0] == '\0' ? before : path, 1);
}

/* --- a run
 * -------------------------------------------------------------------- */

static double sum_of(json_t *nodes, const char *name) {
    double sum = 0;
    size_t i;
    json_t *node;
    json_array_foreach(nodes, i, node) {
        sum += json_number_value(json_object_get(node, name));
    }
    return sum;
}

/* What the statistics of the run say of the row. */
static int read_stats(const struct bench *b, struct host_boards_row *row,
                      struct host_error *error) {
    json_t *root = json_load_file(b->stats, 0, NULL);
    json_t *nodes = json_object_get(root, "per_node");
    double tetrahedra = json_number_value(json_object_get(root, "tetrahedra"));
    if (!(tetrahedra > 0)) {
        json_decref(root);
        return host_fail(error, HOST_BROKEN,
                         "%s: no statistics of a run; run it again", b->stats);
    }
    row->nodes = NODES;
    row->points = b->set.points;
    row->tetrahedra = (uint64_t)tetrahedra;
    row->instructions =
        sum_of(nodes, "cpu_s") * 1e9 / (1 << SHIFT) / tetrahedra;
    row->bytes_in = sum_of(nodes, "bytes_in") / tetrahedra;
    row->bytes_out = sum_of(nodes, "bytes_out") / tetrahedra;
    json_decref(root);
    return 0;
}

/* A run on that board, with the right result. */
static int run(struct bench *b, const char *board, struct host_error *error) {
    char nodes[NODES_WORD];
    const char *words[] = {
        "/proc/self/exe", "run",     b->set.path, "-q",     "--format", "npy",
        "--strategy",     "spatial", "--board",   board,    "--nodes",  nodes,
        "--patience",     "600",     "--stats",   b->stats, NULL};
    struct host_trial trial;
    (void)snprintf(nodes, sizeof nodes, "%d", NODES);
    if (host_trial_run((char *const *)words, LIMIT_S, &trial, error) != 0)
        return error->code;
    if (trial.late || trial.status != 0) {
        return host_fail(error, HOST_CUBE, "%s: %s; see incode run --board %s",
                         board, trial.late ? "not ended in time" : trial.said,
                         board);
    }
    json_t *root = json_load_file(b->stats, 0, NULL);
    const char *digest = json_string_value(json_object_get(root, "digest"));
    if (b->digest[0] == '\0' && digest != NULL)
        (void)snprintf(b->digest, sizeof b->digest, "%s", digest);
    if (digest == NULL || strcmp(digest, b->digest) != 0) {
        host_fail(error, HOST_BROKEN,
                  "%s: its tetrahedra are not those of this machine; try: "
                  "tests/system/arithmetic.sh",
                  board);
    }
    json_decref(root);
    return error->code;
}

/* A row, with the emulator counting. */
static int measure(struct bench *b, const struct host_board *board,
                   struct host_error *error) {
    struct host_boards_row *row = &b->row[b->rows];
    struct host_emulator emulator;
    const char *path = getenv("PATH");
    char map[PATH_MAX + 8];
    char *before = strdup(path == NULL ? "/usr/bin:/bin" : path);
    if (before == NULL ||
        host_emulator_find(board->bare, &emulator, error) != 0 ||
        stand_in(b, board->bare, emulator.program, error) != 0) {
        free(before);
        return error->code;
    }
    (void)snprintf(map, sizeof map, "%s", emulator.image);
    char *end = strrchr(map, '.');
    (void)snprintf(end, 5, ".map");
    row->board = board->name;
    host_progress_phase(board->name, NULL);
    find_first(b, before);
    if (run(b, board->name, error) == 0 && read_stats(b, row, error) == 0 &&
        host_boards_count(map, b->folder, row->counted, error) == 0)
        b->rows++;
    (void)setenv("PATH", before, 1);
    take_away(b, board->bare->program);
    host_progress_phase("", NULL);
    free(before);
    return error->code;
}

/* --- what is printed
 * ------------------------------------------------------------ */

static void print_head(void) {
    printf("Instructions a tetrahedron, of the nodes while they do not wait "
           "(%d of a board,\n%d uniform points); where all go that are "
           "executed, in percent; bytes a\ntetrahedron that nodes take from, "
           "and put on, their wires.\n\n%-11s %7s",
           NODES, POINTS, "board", "instr.");
    for (unsigned i = 0; i < HOST_ROOMS; i++)
        printf(" %*s", (int)strlen(host_room_names[i]) + 1, host_room_names[i]);
    printf(" %6s %6s\n", "in", "out");
}

static void print_row(const struct host_boards_row *row) {
    printf("%-11s %7.0f", row->board, row->instructions);
    for (unsigned i = 0; i < HOST_ROOMS; i++) {
        printf(" %*.1f", (int)strlen(host_room_names[i]) + 1,
               host_boards_share(row, i));
    }
    printf(" %6.1f %6.1f\n", row->bytes_in, row->bytes_out);
    fflush(stdout);
}

static int write_csv(const struct bench *b, struct host_error *error) {
    const char *path = b->options->csv;
    FILE *file = host_create_over(path);
    if (file != NULL) {
        fprintf(file, "board,nodes,points,tetrahedra,instructions");
        for (unsigned i = 0; i < HOST_ROOMS; i++)
            fprintf(file, ",%s_percent", host_room_names[i]);
        fprintf(file, ",bytes_in,bytes_out\n");
        for (unsigned n = 0; n < b->rows; n++) {
            const struct host_boards_row *row = &b->row[n];
            fprintf(file, "%s,%u,%llu,%llu,%.0f", row->board, row->nodes,
                    (unsigned long long)row->points,
                    (unsigned long long)row->tetrahedra, row->instructions);
            for (unsigned i = 0; i < HOST_ROOMS; i++)
                fprintf(file, ",%.2f", host_boards_share(row, i));
            fprintf(file, ",%.2f,%.2f\n", row->bytes_in, row->bytes_out);
        }
    }
    if (file == NULL || ferror(file) != 0 || fclose(file) != 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; choose another file", path,
                  strerror(errno));
    }
    return error->code;
}

static int bench_all(struct bench *b, struct host_error *error) {
    const struct host_board *board;
    if (run(b, "linux", error) != 0)
        return error->code;
    print_head();
    for (unsigned i = 0; (board = host_board_row(i)) != NULL; i++) {
        if (board->bare == NULL)
            continue;
        if (measure(b, board, error) != 0)
            return error->code;
        print_row(&b->row[b->rows - 1]);
    }
    if (b->options->csv != NULL && write_csv(b, error) != 0)
        return error->code;
    return b->options->svg == NULL
               ? 0
               : host_boards_plot(b->options->svg, b->row, b->rows, error);
}

int host_bench_boards(const struct host_bench_boards_options *options,
                      struct host_error *error) {
    static struct bench b;
    const char *tmp = getenv("TMPDIR");
    memset(&b, 0, sizeof b);
    b.options = options;
    b.set.file = -1;
    if (host_bench_made("instructions.so", b.counter, error) != 0 ||
        host_bench_set_made(&b.set, "uniform", POINTS, 1, error) != 0) {
        host_bench_set_free(&b.set);
        return error->code;
    }
    (void)snprintf(b.folder, sizeof b.folder, "%.40s/incode-bench.XXXXXX",
                   tmp == NULL ? "/tmp" : tmp);
    if (mkdtemp(b.folder) == NULL) {
        host_fail(error, HOST_BROKEN, "%s: %s; name another in TMPDIR",
                  b.folder, strerror(errno));
    } else {
        (void)snprintf(b.stats, sizeof b.stats, "%s/stats", b.folder);
        (void)bench_all(&b, error);
        take_all_away(&b);
    }
    host_bench_set_free(&b.set);
    return error->code;
}
