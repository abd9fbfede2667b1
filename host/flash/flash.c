#include "flash.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>

#include "host/base/text.h"
#include "spread.h"
#include "host/base/options.h"
#include "host/base/progress.h"
#include "host/cube/lines.h"
#include "host/cube/site.h"
#include "sign.h"

enum { LINE = 2048, LIST = 160 };

static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
enum { SIGNALS = sizeof signals / sizeof signals[0] };

static struct sigaction before[SIGNALS];
static volatile sig_atomic_t came;

static void keep(int number) {
    came = number;
}

/* From here on signals are kept, and up to there. */
static void host_flash_cut_begin(void) {
    const struct sigaction action = {.sa_handler = keep,
                                     .sa_flags = (int)SA_RESETHAND};
    came = 0;
    for (int i = 0; i < SIGNALS; i++)
        if (sigaction(signals[i], NULL, &before[i]) == 0 &&
            before[i].sa_handler != SIG_IGN) /* as nohup has it */
            (void)sigaction(signals[i], &action, NULL);
}

static void host_flash_cut_end(void) {
    for (int i = 0; i < SIGNALS; i++)
        (void)sigaction(signals[i], &before[i], NULL);
}

/* The signal that came; 0: none has. */
static int host_flash_cut(void) {
    return came;
}

/* What a node does now that nobody sends it anything; of several as well. */
static const char *state_of(const struct host_spread *spread, unsigned i) {
    const struct host_spread_node *n = &spread->node[i];
    switch (n->phase) {
    case HOST_SPREAD_BEGINS:
    case HOST_SPREAD_TAKES:
    case HOST_SPREAD_WHOLE:
        return "in the loader, and what has come is kept; turned off and on, "
               "what was there before runs";
    case HOST_SPREAD_VERIFIED:
        return "in the loader; turned off and on, the new image runs";
    case HOST_SPREAD_STARTS:
    case HOST_SPREAD_DONE:
    case HOST_SPREAD_HAS:
        return "with the new image";
    default:
        return n->left ? "on the way into the loader; turned off and on, "
                         "what was there before runs"
                       : "as before";
    }
}

static void tell_states(FILE *out, const struct host_spread *spread) {
    struct host_node_set told = {{0}};
    unsigned nodes = spread->session->machine->nodes;
    for (unsigned i = 0; i < nodes; i++) {
        struct host_node_set set = {{0}};
        char name[LIST];
        if (!spread_wanted(spread, i) || host_node_set_has(&told, i))
            continue;
        for (unsigned k = i; k < nodes; k++) {
            if (spread_wanted(spread, k) &&
                state_of(spread, k) == state_of(spread, i)) {
                host_node_set_add(&set, k);
                host_node_set_add(&told, k);
            }
        }
        host_node_set_name(&set, name, sizeof name);
        host_say(out, "incode: flash: %s: %s\n", name, state_of(spread, i));
    }
}

void host_flash_cut_tell(FILE *out, const struct host_spread *spread, int argc,
                         char *const *argv) {
    char line[LINE];
    int used = snprintf(line, sizeof line, "incode flash");
    tell_states(out, spread);
    for (int i = 1; i < argc && used + 2 < LINE; i++) {
        line[used++] = ' ';
        if (host_text_quote(line + used, sizeof line - (size_t)used, argv[i]) !=
            0) {
            snprintf(line, sizeof line, "the same command");
            break;
        }
        used += (int)strlen(line + used);
    }
    host_say(out, "incode: flash: interrupted; go on with: %s\n", line);
}

/* Returns where no signal came; else ends the program by it. */
static void host_flash_cut_finish(void) {
    if (came != 0) {
        (void)signal(came, SIG_DFL);
        (void)raise(came);
    }
}

/* --- flash show ----------------------------------------------------------- */

enum { FLASH_SHOW_LIST = 160, FLASH_SHOW_LINE = 600 };

static const struct host_spread_node *node_of(const struct host_flash_show *s,
                                              unsigned i) {
    return &s->spread->node[i];
}

void host_flash_show_begin(struct host_flash_show *show,
                           const struct host_spread *spread, bool quiet) {
    *show = (struct host_flash_show){.spread = spread, .quiet = quiet};
    for (unsigned i = 0; i < spread->session->machine->nodes; i++)
        if (host_node_set_has(&spread->options.nodes, i))
            show->node[show->wanted++] = (uint16_t)i;
    host_progress_begin(!quiet);
    unsigned most = host_progress_rows_max();
    if (most > 0) {
        show->nodes_a_row = (show->wanted + most - 1) / most;
        show->rows = (show->wanted + show->nodes_a_row - 1) / show->nodes_a_row;
        host_progress_rows(show->rows);
    }
}

/* Of several nodes, what the one says that is farthest behind. */
static void draw_row(const struct host_flash_show *s, unsigned row) {
    struct host_node_set set = {{0}};
    enum host_spread_phase phase = HOST_SPREAD_LOST;
    unsigned from = row * s->nodes_a_row, count = 0;
    char head[FLASH_SHOW_LIST + 8], tail[FLASH_SHOW_LIST];
    double part = 0.0;
    for (unsigned k = from; k < s->wanted && k < from + s->nodes_a_row; k++) {
        const struct host_spread_node *n = node_of(s, s->node[k]);
        bool whole = n->phase > HOST_SPREAD_TAKES;
        phase = n->phase < phase ? n->phase : phase;
        part += whole ? 1.0 : (double)n->held / (double)n->blocks;
        count++;
        host_node_set_add(&set, s->node[k]);
    }
    bool moves =
        phase >= HOST_SPREAD_BEGINS && phase <= HOST_SPREAD_DONE && count > 0;
    host_node_set_name(&set, head, sizeof head);
    snprintf(tail, sizeof tail, "%s", host_spread_phase_text(phase));
    host_progress_row(row, head, moves ? part / count : -1.0, tail);
}

void host_flash_show_draw(const struct host_flash_show *show) {
    for (unsigned row = 0; row < show->rows; row++)
        draw_row(show, row);
    host_progress_draw();
}

void host_flash_show_change(const struct host_flash_show *show, unsigned node) {
    const struct host_spread_node *n = node_of(show, node);
    bool silent = n->phase == HOST_SPREAD_BEGINS ||
                  n->phase == HOST_SPREAD_WHOLE ||
                  (n->phase == HOST_SPREAD_TAKES && n->held != 0) ||
                  n->phase >= HOST_SPREAD_HAS;
    if (show->rows == 0 && !show->quiet && !silent)
        host_note("flash: node %u: %s", node, host_spread_phase_text(n->phase));
}

/* --- at the end ----------------------------------------------------------- */

/* Those that are as node `first` is, by what is said of them. */
static struct host_node_set alike(const struct host_flash_show *s,
                                  unsigned first) {
    struct host_node_set set = {{0}};
    const struct host_session_node *seen = s->spread->session->node;
    for (unsigned k = 0; k < s->wanted; k++) {
        unsigned i = s->node[k];
        const struct host_spread_node *a = node_of(s, i),
                                      *b = node_of(s, first);
        if (a->phase == b->phase && strcmp(a->text, b->text) == 0 &&
            memcmp(seen[i].who.version, seen[first].who.version,
                   sizeof seen[i].who.version) == 0)
            host_node_set_add(&set, i);
    }
    return set;
}

/* "mps2-an500 0.1.0, number 3" */
static const char *name_image(const struct host_flash_show *s,
                              char text[FLASH_SHOW_LIST]) {
    const struct loader_image *image = &s->spread->image;
    snprintf(text, FLASH_SHOW_LIST, "%s %s, number %u", image->board,
             image->version, image->number);
    return text;
}

static void say_each(const struct host_flash_show *s,
                     void (*say)(const struct host_flash_show *s, unsigned i,
                                 bool one, char line[FLASH_SHOW_LINE])) {
    struct host_node_set told = {{0}};
    for (unsigned k = 0; k < s->wanted; k++) {
        char nodes[FLASH_SHOW_LIST + 8], line[FLASH_SHOW_LINE] = "";
        unsigned i = s->node[k];
        if (host_node_set_has(&told, i))
            continue;
        struct host_node_set set = alike(s, i);
        for (unsigned b = 0; b < sizeof told.bits; b++)
            told.bits[b] |= set.bits[b];
        say(s, i, host_node_set_count(&set) == 1, line);
        if (line[0] != '\0') {
            host_node_set_name(&set, nodes, sizeof nodes);
            host_say(stdout, "%s: %s\n", nodes, line);
        }
    }
    (void)fflush(stdout);
}

static void say_result(const struct host_flash_show *s, unsigned i, bool one,
                       char line[FLASH_SHOW_LINE]) {
    const struct host_spread_node *n = node_of(s, i);
    char image[FLASH_SHOW_LIST];
    name_image(s, image);
    if (n->phase == HOST_SPREAD_DONE)
        snprintf(line, FLASH_SHOW_LINE, "%s %s", one ? "runs" : "run", image);
    else if (n->phase == HOST_SPREAD_HAS)
        snprintf(line, FLASH_SHOW_LINE, "had %s already", image);
    else if (n->phase == HOST_SPREAD_PASSED)
        snprintf(line, FLASH_SHOW_LINE, "passed over, as it %s", n->text);
}

void host_flash_show_result(const struct host_flash_show *show) {
    if (!show->quiet)
        say_each(show, say_result);
}

static void say_plan(const struct host_flash_show *s, unsigned i, bool one,
                     char line[FLASH_SHOW_LINE]) {
    const struct host_spread_node *n = node_of(s, i);
    const struct node_who *who = &s->spread->session->node[i].who;
    char image[FLASH_SHOW_LIST];
    name_image(s, image);
    if (n->phase == HOST_SPREAD_LEAVES) {
        snprintf(line, FLASH_SHOW_LINE,
                 "would restart and be given %s: it runs %.*s", image,
                 (int)sizeof who->version, (const char *)who->version);
    } else if (n->phase == HOST_SPREAD_BEGINS) {
        snprintf(line, FLASH_SHOW_LINE,
                 "would be given %s: it is in its loader", image);
    } else {
        say_result(s, i, one, line);
    }
}

void host_flash_show_plan(const struct host_flash_show *show) {
    say_each(show, say_plan);
}

/* --- flash ---------------------------------------------------------------- */

enum { PATIENCE_S = 60, STEP_US = 50000 };

struct flash {
    struct host_site_options where;
    int argc;
    char **argv;
    const char *path, *nodes; /* NULL: all */
    uint64_t patience_s;
    bool quiet, dry_run, reset, force;
    struct host_image file;
    struct host_site site;
    struct host_session session;
    struct host_node_set set;
    struct host_spread spread;
    struct host_flash_show show;
    struct host_error *error;
};

/* --- the arguments -------------------------------------------------------- */

static int parse_all(struct flash *f, int argc, char **argv) {
    static const struct host_option rows[] = {
        {.help = "What is done:"},
        {"nodes", 0, "SET", "These alone, as in 0-3,7. Default: all",
         HOST_AT(struct flash, nodes)},
        {"dry-run", 0, NULL,
         "Says what would be done with each, and does nothing",
         HOST_AT(struct flash, dry_run)},
        {"reset", 0, NULL,
         "Resets the boards first, by the lines that the cube file gives them",
         HOST_AT(struct flash, reset)},
        {"force", 0, NULL,
         "Boards that run this image as well: they prove its signature, verify "
         "what they have of it, and start it anew",
         HOST_AT(struct flash, force)},
        {"patience", 0, "SECONDS",
         "Gives a node up that gets no further for so long. Default: 60",
         HOST_AT(struct flash, patience_s), .least = 1, .most = 86400},
        {"quiet", 'q', NULL, "Says nothing but what is wrong",
         HOST_AT(struct flash, quiet)},
        {0}};
    static const struct host_options options = {
        .rows = rows,
        .more = host_site_rows,
        .more_at = offsetof(struct flash, where),
        .one = "IMAGE",
        .one_at = offsetof(struct flash, path),
        .needed = true,
        .arguments = "IMAGE",
        .about =
            "Brings an image to the boards of a cube, all at once: node 0 "
            "takes it from the host, and it spreads over the cube's links. A "
            "board that has it already is left alone; what a transfer that "
            "broke has left on one is not sent again.\v"
            "Where no image is good, or one does not come up, a board keeps or "
            "takes the one before.\n\n"
            "Example:\n"
            "  incode flash --cube lab.cube build/firmware/mps2-an500.img"};
    return host_options_parse(&options, argc, argv, false, f, NULL, f->error);
}

/* --- before --------------------------------------------------------------- */

static int open_image(struct flash *f) {
    if (host_image_open(&f->file, f->path, f->error) != 0)
        return f->error->code;
    enum loader_fault fault = host_image_fault(&f->file);
    if (fault == LOADER_GOOD)
        return 0;
    host_image_close(&f->file);
    if (fault == LOADER_UNSIGNED) {
        return host_fail(f->error, HOST_INPUT,
                         "%s: %s; sign it: incode sign %s --key FILE", f->path,
                         loader_fault_text(fault), f->path);
    }
    return host_fail(f->error, HOST_INPUT, "%s: %s; copy or build it anew",
                     f->path, loader_fault_text(fault));
}

/* What is no set in any cube is told before a port is opened. */
static int check_nodes(struct flash *f) {
    return f->nodes == NULL ? 0
                            : host_node_set_parse(&f->set, f->nodes,
                                                  CUBE_NODES_MAX, f->error);
}

static const char *board_in_file(void *context, unsigned node) {
    const struct flash *f = context;
    return f->where.cube == NULL ? NULL : f->site.file.board_of[node]->name;
}

/* Of what the cube file says of boards, one has to fit. */
static int choose_nodes(struct flash *f) {
    const char *board = f->file.image.board;
    unsigned nodes = f->site.machine.nodes;
    bool fits = f->where.cube == NULL;
    if (f->nodes == NULL)
        host_node_set_all(&f->set, nodes);
    else if (host_node_set_parse(&f->set, f->nodes, nodes, f->error) != 0)
        return f->error->code;
    for (unsigned i = 0; i < nodes; i++) {
        fits = fits || (host_node_set_has(&f->set, i) &&
                        strcmp(board_in_file(f, i), board) == 0);
    }
    return fits ? 0
                : host_fail(f->error, HOST_INPUT,
                            "%s: is for %s, and %s has none among these nodes; "
                            "give the image of its boards",
                            f->path, board, f->where.cube);
}

/* Those without a line start their program, and are told to restart. */
static int reset(struct flash *f) {
    struct host_lines lines;
    unsigned count = 0;
    if (f->where.cube == NULL) {
        return host_fail(f->error, HOST_USAGE,
                         "--reset: only a cube file says which lines reset "
                         "boards; give --cube FILE");
    }
    if (host_lines_open(&lines, &f->site.file, &f->site.remote, f->error) != 0)
        return f->error->code;
    int status = 0;
    for (unsigned i = 0; status == 0 && i < f->site.machine.nodes; i++) {
        if (host_node_set_has(&f->set, i) &&
            host_lines_has(&f->site.file, i, HOST_LINE_RESET)) {
            status = host_lines_reset(&lines, i, true, f->error);
            count++;
        }
    }
    host_lines_close(&lines);
    return status == 0 && count == 0
               ? host_fail(f->error, HOST_INPUT,
                           "%s: gives none of these nodes a reset line; leave "
                           "--reset out, or name the line",
                           f->where.cube)
               : status;
}

/* --- the transfer --------------------------------------------------------- */

static bool draw_serial(void *context, uint8_t serial[NODE_SERIAL_BYTES]) {
    (void)context;
    return getrandom(serial, NODE_SERIAL_BYTES, 0) == NODE_SERIAL_BYTES;
}

static void changed(void *context, unsigned node) {
    const struct flash *f = context;
    host_flash_show_change(&f->show, node);
}

static void say(void *context, const char *line) {
    (void)context;
    host_note("flash: %s", line);
}

/* What is missing would be waited for. */
static int plan(struct flash *f) {
    char why[HOST_SPREAD_TEXT];
    host_flash_show_plan(&f->show);
    if (host_spread_result(&f->spread, f->error) != 0)
        return f->error->code;
    for (unsigned i = 0; i < f->site.machine.nodes; i++) {
        if (host_node_set_has(&f->set, i) &&
            f->spread.node[i].phase == HOST_SPREAD_AWAITED) {
            return host_fail(
                f->error, HOST_CUBE, "node %u: %s", i,
                host_session_reason(&f->session, i, why, sizeof why));
        }
    }
    return 0;
}

static int spread(struct flash *f) {
    int status = host_spread_look(&f->spread, f->error);
    if (status == 0 && f->dry_run)
        return plan(f);
    host_flash_cut_begin();
    while (status == 0 && host_flash_cut() == 0 &&
           !host_spread_over(&f->spread)) {
        status = host_spread_step(&f->spread, STEP_US, f->error);
        host_flash_show_draw(&f->show);
    }
    if (host_flash_cut() != 0) {
        host_progress_end();
        host_flash_cut_tell(stderr, &f->spread, f->argc, f->argv);
        return HOST_CUBE;
    }
    host_flash_cut_end();
    status = status == 0 ? host_spread_run(&f->spread, f->error) : status;
    host_progress_end();
    if (status != 0)
        return status;
    host_flash_show_result(&f->show);
    return host_spread_result(&f->spread, f->error);
}

static int session(struct flash *f) {
    const struct host_spread_options options = {.image = f->file.source.data,
                                                .bytes = f->file.source.bytes,
                                                .nodes = f->set,
                                                .patience_us =
                                                    f->patience_s * 1000000,
                                                .again = f->force,
                                                .context = f,
                                                .board = board_in_file,
                                                .serial = draw_serial,
                                                .changed = changed,
                                                .say = say};
    if (host_session_open(&f->session, &f->site.machine, f->error) != 0)
        return f->error->code;
    int status = host_spread_open(&f->spread, &f->session, &options, f->error);
    if (status == 0) {
        host_flash_show_begin(&f->show, &f->spread, f->quiet || f->dry_run);
        status = spread(f);
        host_spread_close(&f->spread);
    }
    host_session_close(&f->session);
    return status;
}

int host_flash(int argc, char **argv, struct host_error *error) {
    static struct flash f = {.patience_s = PATIENCE_S};
    f.error = error;
    f.argc = argc;
    f.argv = argv;
    if (parse_all(&f, argc, argv) != 0 || check_nodes(&f) != 0 ||
        host_site_check(&f.where, error) != 0 || open_image(&f) != 0)
        return error->code;
    int status = host_site_open(&f.site, &f.where, error);
    if (status == 0) {
        bool ready = choose_nodes(&f) == 0 && (!f.reset || reset(&f) == 0);
        status = ready ? session(&f) : error->code;
        host_site_close(&f.site);
    }
    host_image_close(&f.file);
    host_flash_cut_finish();
    return status;
}
