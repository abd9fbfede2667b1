#include "on_cube.h"

#include "host/machines/remote.h"
#include "transport/secure_wipe.h"

/* One run a program. */
static struct host_cube_file the_file;
static void (*stop_remote)(void *context);

/* Its wires are closed: nothing needs the key. */
static void stop(void *context)
{
    stop_remote(context);
    secure_wipe(the_file.key, sizeof the_file.key);
}

/* Whether there are nodes that the host starts. */
static bool starts_some(const struct host_cube_file *file)
{
    bool some = false;
    for (unsigned i = 0; i < file->nodes; i++) {
        some = some || file->local[i];
    }
    return some;
}

static int begin(const struct host_run_options *options,
                 struct host_run_result *result, struct host_machine *machine,
                 struct host_error *error)
{
    static struct host_remote remote;
    static char program[4096];
    (void)result;
    if ((starts_some(&the_file) &&
         host_cluster_program(options->node_program, the_file.board->program,
                              program, sizeof program, error) != 0) ||
        host_remote_start(&remote, &the_file, program, error) != 0) {
        return error->code;
    }
    *machine = host_remote_machine(&remote);
    stop_remote = machine->stop;
    machine->stop = stop;
    return 0;
}

int host_run_on_cube(struct host_run_options *options, struct host_error *error)
{
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
    if (options->node_program != NULL && !starts_some(&the_file)) {
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
    options->wire_bytes_s = wire != NULL && wire->serial ? wire->baud / 10 : 0;
    options->begin = begin;
    return 0;
}
