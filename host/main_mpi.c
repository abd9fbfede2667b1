/* `incode run` in rank 0 of MPI: the host as it is elsewhere, on a cube of
 * ranks.  The program incode becomes this one where mpirun has started it, and
 * starts mpirun where nobody has (host/run/launch.h). */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "host/bench/mpi/bench.h"
#include "host/nodes/mpi/ranks.h"
#include "host/run/arguments.h"
#include "host/run/launch.h"
#include "host/run/run.h"
#include "incode/predicates/predicates.h"
#include "transport/drivers/mpi_environment.h"

static struct host_ranks ranks;

static int begin(const struct host_run_options *options,
                 struct host_run_result *result, struct host_machine *machine,
                 struct host_error *error) {
    if (host_ranks_begin(&ranks, result->nodes, options->memory,
                         options->window, error) != 0)
        return error->code;
    *machine = host_ranks_machine(&ranks);
    result->memory_held = ", besides what Open MPI takes for itself";
    result->socket_send_bytes = MPI_PIPE_SLOTS * MPI_PIPE_BYTES;
    result->socket_receive_bytes = MPI_PIPE_SLOTS * MPI_PIPE_BYTES;
    return 0;
}

static int run(int argc, char **argv, struct host_error *error) {
    static struct host_run_result result;
    struct host_run_options options = {0};
    if (host_ranks_open(&ranks, error) != 0 ||
        host_begin_processor(error) != 0 ||
        host_arguments_run(argc, argv, &options, error) != 0)
        return error->code;
    unsigned nodes = (unsigned)ranks.place.ranks - 1;
    if (options.nodes != 0 && options.nodes != nodes) {
        return host_fail(error, HOST_USAGE,
                         "--nodes %u: mpirun has started %u nodes and a host; "
                         "leave --nodes out, or give mpirun -np %u",
                         options.nodes, nodes, options.nodes + 1);
    }
    options.nodes = nodes;
    options.begin = begin;
    options.direct = false;
    ranks.cubes_due = options.table ? 2 : 1; /* one node alone comes first */
    return host_run(&options, &result, error);
}

int main(int argc, char **argv) {
    struct host_error error = {0};
    static char name[] = "incode run";
    host_begin("incode-mpi");
    prctl(PR_SET_PDEATHSIG, SIGTERM); /* gone with the launcher's daemon */
    mpi_environment();
    MPI_Init(&argc, &argv);
    if (argc == 2 && strcmp(argv[1], HOST_MPI_BENCH) == 0)
        return host_mpi_bench();
    argv[0] = name;
    const char *fault = incode_arithmetic_fault();
    int status = fault == NULL
                     ? run(argc, argv, &error)
                     : host_fail(&error, HOST_BROKEN,
                                 "this machine: %s; build without flags that "
                                 "loosen floating point",
                                 fault);
    /* The launcher knows how a rank was lost. */
    bool heard = host_launch_report(status, ranks.lost, ranks.terminated);
    if (status != 0 && !(heard && (ranks.lost != 0 || ranks.terminated)))
        (void)fprintf(stderr, "incode: %s\n", error.text);
    host_ranks_close(&ranks, status);
    return status;
}
