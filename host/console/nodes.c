#include "nodes.h"

#include "host/base/options.h"
#include "host/base/progress.h"
#include "place.h"
#include "script.h"

enum { KEY_JSON = 512, SETTLE_US = 12000000 };

struct options {
    struct host_site_options site;
    bool json;
    struct host_error *error;
};

static const struct argp_option own_rows[] = {
    {NULL, 0, NULL, 0, "What is printed:", 3},
    {"json", KEY_JSON, NULL, 0, "Print an object of JSON", 3},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state) {
    struct options *o = state->input;
    switch (key) {
    case KEY_JSON:
        o->json = true;
        return 0;
    case ARGP_KEY_ARG:
        host_fail(o->error, HOST_USAGE,
                  "%s: no argument of nodes; to name a cube file, write --cube",
                  value);
        return 0;
    default:
        return host_site_option(&o->site, key, value, o->error);
    }
}

/* Those that begin may need a moment. */
static int wait_for_all(struct host_shell *shell, struct host_error *error) {
    struct host_node_set all;
    host_node_set_all(&all, shell->machine.nodes);
    return host_visit_settle(&shell->visit, &all, SETTLE_US, error);
}

/* Beside another program it looks on, and says beside whom. */
static int reach(struct host_shell *shell, struct host_error *error) {
    struct host_holder holder;
    char text[HOST_HOLDER_TEXT];
    if (host_shell_is_held(shell, &holder)) {
        host_note("nodes: a look beside %s, which has the cube",
                  host_holder_text(&holder, text, sizeof text));
        return 0;
    }
    return host_shell_open(shell, error) != 0 ? error->code
                                              : wait_for_all(shell, error);
}

int host_nodes_command(int argc, char **argv, struct host_error *error) {
    static struct host_console_place place;
    static struct host_shell shell;
    struct options options = {.error = error};
    struct argp_option rows[HOST_OPTIONS_MAX];
    host_site_table(rows, own_rows);
    const struct argp argp = {
        rows,
        parse,
        "",
        "Tells which nodes of a cube are there, what is missing, what is wired "
        "wrongly, and what to do next. Exit status: 0 all nodes and wires are "
        "there, 4 not.",
        NULL,
        NULL,
        NULL};
    if (host_options_parse(&argp, argc, argv, 0, &options, error) != 0) {
        return error->code;
    }
    host_console_place_init(&place, &options.site);
    host_shell_init(&shell, &place.place, host_script_sink(), options.json);
    struct host_error lost = {0};
    int status = host_site_check(&options.site, &lost);
    status = status == 0 ? reach(&shell, &lost) : status;
    status = status != 0 && !shell.open && !shell.in_use
                 ? host_shell_fail(&shell, "nodes", &lost)
                 : host_shell_line(&shell, "nodes"); /* says what it is */
    host_shell_close(&shell);
    host_console_place_end(&place);
    return status;
}
