#include "flash.h"

#include <argp.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>

#include "flash_cut.h"
#include "flash_show.h"
#include "host/base/options.h"
#include "host/base/progress.h"
#include "host/base/text.h"
#include "host/cube/lines.h"
#include "host/cube/site.h"
#include "image_file.h"

enum {
    KEY_NODES = 1024,
    KEY_DRY_RUN,
    KEY_RESET,
    KEY_FORCE,
    KEY_PATIENCE,
    PATIENCE_S = 60,
    STEP_US = 50000
};

struct flash {
    struct host_site_options where;
    int argc;
    char **argv;
    const char *path, *nodes; /* NULL: all */
    uint64_t patience_s;
    bool quiet, dry_run, reset, force;
    struct host_image file;
    struct host_site site;
    struct host_visit visit;
    struct host_node_set set;
    struct host_spread spread;
    struct host_flash_show show;
    struct host_error *error;
};

/* --- the arguments -------------------------------------------------------- */

static const struct argp_option options_of_flash[] = {
    {NULL, 0, NULL, 0, "What is done:", 3},
    {"nodes", KEY_NODES, "SET", 0, "These alone, as in 0-3,7. Default: all", 3},
    {"dry-run", KEY_DRY_RUN, NULL, 0,
     "Says what would be done with each, and does nothing", 3},
    {"reset", KEY_RESET, NULL, 0,
     "Resets the boards first, by the lines that the cube file gives them", 3},
    {"force", KEY_FORCE, NULL, 0,
     "Boards that run this image as well: they prove its signature, verify "
     "what they have of it, and start it anew",
     3},
    {"patience", KEY_PATIENCE, "SECONDS", 0,
     "Gives a node up that gets no further for so long. Default: 60", 3},
    {"quiet", 'q', NULL, 0, "Says nothing but what is wrong", 3},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state) {
    struct flash *f = state->input;
    switch (key) {
    case KEY_NODES:
        f->nodes = value;
        return 0;
    case KEY_DRY_RUN:
        f->dry_run = true;
        return 0;
    case KEY_RESET:
        f->reset = true;
        return 0;
    case KEY_FORCE:
        f->force = true;
        return 0;
    case 'q':
        f->quiet = true;
        return 0;
    case KEY_PATIENCE:
        (void)host_option_number("patience", value, 1, 86400, &f->patience_s,
                                 f->error);
        return 0;
    case ARGP_KEY_ARG:
    case ARGP_KEY_END:
        (void)host_option_argument(key, "IMAGE", value, &f->path, f->error);
        return 0;
    default:
        return host_site_option(&f->where, key, value, f->error);
    }
}

static int parse_all(struct flash *f, int argc, char **argv) {
    static struct argp_option options[HOST_OPTIONS_MAX];
    static const struct argp argp = {
        options,
        parse,
        "IMAGE",
        "Brings an image to the boards of a cube, all at once: node 0 takes it "
        "from the host, and it spreads over the cube's links. A board that has "
        "it already is left alone; what a transfer that broke has left on one "
        "is not sent again.\v"
        "Where no image is good, or one does not come up, a board keeps or "
        "takes the one before.\n\n"
        "Example:\n"
        "  incode flash --cube lab.cube build/firmware/mps2-an500.img",
        NULL,
        NULL,
        NULL};
    host_site_table(options, options_of_flash);
    return host_options_parse(&argp, argc, argv, 0, f, f->error);
}

/* --- before --------------------------------------------------------------- */

static int open_image(struct flash *f) {
    if (host_image_open(&f->file, f->path, f->error) != 0) {
        return f->error->code;
    }
    enum loader_fault fault = host_image_fault(&f->file);
    if (fault == LOADER_GOOD) {
        return 0;
    }
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
    if (f->nodes == NULL) {
        host_node_set_all(&f->set, nodes);
    } else if (host_node_set_parse(&f->set, f->nodes, nodes, f->error) != 0) {
        return f->error->code;
    }
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
    if (host_lines_open(&lines, &f->site.file, &f->site.remote, f->error) !=
        0) {
        return f->error->code;
    }
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
    if (host_spread_result(&f->spread, f->error) != 0) {
        return f->error->code;
    }
    for (unsigned i = 0; i < f->site.machine.nodes; i++) {
        if (host_node_set_has(&f->set, i) &&
            f->spread.node[i].phase == HOST_SPREAD_AWAITED) {
            return host_fail(f->error, HOST_CUBE, "node %u: %s", i,
                             host_visit_reason(&f->visit, i, why, sizeof why));
        }
    }
    return 0;
}

static int spread(struct flash *f) {
    int status = host_spread_look(&f->spread, f->error);
    if (status == 0 && f->dry_run) {
        return plan(f);
    }
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
    if (status != 0) {
        return status;
    }
    host_flash_show_result(&f->show);
    return host_spread_result(&f->spread, f->error);
}

static int visit(struct flash *f) {
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
    if (host_visit_open(&f->visit, &f->site.machine, f->error) != 0) {
        return f->error->code;
    }
    int status = host_spread_open(&f->spread, &f->visit, &options, f->error);
    if (status == 0) {
        host_flash_show_begin(&f->show, &f->spread, f->quiet || f->dry_run);
        status = spread(f);
        host_spread_close(&f->spread);
    }
    host_visit_close(&f->visit);
    return status;
}

int host_flash(int argc, char **argv, struct host_error *error) {
    static struct flash f = {.patience_s = PATIENCE_S};
    f.error = error;
    f.argc = argc;
    f.argv = argv;
    if (parse_all(&f, argc, argv) != 0 || check_nodes(&f) != 0 ||
        host_site_check(&f.where, error) != 0 || open_image(&f) != 0) {
        return error->code;
    }
    int status = host_site_open(&f.site, &f.where, error);
    if (status == 0) {
        bool ready = choose_nodes(&f) == 0 && (!f.reset || reset(&f) == 0);
        status = ready ? visit(&f) : error->code;
        host_site_close(&f.site);
    }
    host_image_close(&f.file);
    host_flash_cut_finish();
    return status;
}
