#include "on_cube.h"

#include "host/nodes/remote.h"
#include "transport/secure_wipe.h"

/* Until another program of this machine has ended. */
enum { IN_USE_US = 5000000 };

/* One run a program. */
static struct host_cube_file the_file;
static void (*stop_remote)(void *context);

/* Its wires are closed: nothing needs the key. */
static void stop(void *context) {
    stop_remote(context);
    secure_wipe(the_file.key, sizeof the_file.key);
}

static int begin(const struct host_run_options *options,
                 struct host_run_result *result, struct host_machine *machine,
                 struct host_error *error) {
    static struct host_remote remote;
    static char program[4096];
    (void)result;
    if (host_remote_free(&the_file, IN_USE_US, error) != 0 ||
        host_remote_program(&the_file, options->node_program, program,
                            sizeof program, error) != 0 ||
        host_remote_start(&remote, &the_file, program, error) != 0) {
        return error->code;
    }
    *machine = host_remote_machine(&remote);
    stop_remote = machine->stop;
    machine->stop = stop;
    return 0;
}

int host_run_on_cube(struct host_run_options *options,
                     struct host_error *error) {
    unsigned asked = options->nodes;
    if (host_cube_file_read(&the_file, options->cube, error) != 0) {
        return error->code;
    }
    if (asked != 0 && asked != the_file.nodes) {
        return host_fail(error, HOST_USAGE,
                         "--nodes %u: the cube of %s has %u; leave it out",
                         asked, options->cube, the_file.nodes);
    }
    if (options->table) {
        return host_fail(error, HOST_USAGE,
                         "--table: compares with one node, and the cube of %s "
                         "has its own; leave it out",
                         options->cube);
    }
    if (options->node_program != NULL &&
        host_remote_started(&the_file) == NULL) {
        return host_fail(error, HOST_USAGE,
                         "--node-program: the host starts none of the nodes of "
                         "%s; leave it out",
                         options->cube);
    }
    options->nodes = the_file.nodes;
    options->memory = the_file.memory;
    options->board = the_file.board;
    options->link = host_cube_link(&the_file);
    for (unsigned i = 0; i < the_file.nodes; i++) {
        options->processors += !the_file.local[i];
    }
    const struct host_cube_wire *wire = host_cube_host_wire(&the_file, 0);
    options->wire_bytes_s = wire == NULL   ? 0
                            : wire->serial ? wire->baud / 10
                            : host_cube_is_bare(&the_file, wire->node)
                                ? HOST_BARE_WIRE_BYTES
                                : 0;
    options->begin = begin;
    return 0;
}
