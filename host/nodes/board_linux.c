/* Nodes as processes of this machine, of the program of boards/linux. */
#include "boards.h"

static int start(const struct host_board *board,
                 const struct host_cluster_options *options,
                 struct host_started *started, struct host_error *error) {
    static struct host_cluster cluster;
    static char program[4096];
    struct host_cluster_options mine = *options;
    mine.program = program;
    if (host_cluster_program(options->program, board->program, program,
                             sizeof program, error) != 0 ||
        host_cluster_start(&cluster, &mine, error) != 0) {
        return error->code;
    }
    started->machine = host_cluster_machine(&cluster);
    started->limited = cluster.limited;
    started->memory_held = cluster.limited
                               ? ", held by the kernel"
                               : " (a sanitizer build: not held by the kernel)";
    (void)tcp_buffers(cluster.port[0].tcp.fd, &started->send_bytes,
                      &started->receive_bytes);
    return 0;
}

const struct host_board host_board_linux = {
    .name = "linux",
    .help = "processes of this machine",
    .program = "incode-node",
    .start = start,
};
