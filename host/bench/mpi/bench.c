#include "bench.h"

#include <stdio.h>
#include <string.h>

#include "host/bench/bench.h"
#include "transport/drivers/mpi.h"

static struct mpi_place place;
static struct mpi_pipe wire;

static void idle(void *context, uint64_t wait_us) {
    (void)context;
    mpi_sleep(&place, &wire, 1, NULL, wait_us);
}

int host_mpi_bench(void) {
    struct host_bench_row row;
    struct host_bench_end end;
    memset(&row, 0, sizeof row);
    memset(&end, 0, sizeof end);
    if (mpi_place_open(&place) != 0 || place.ranks != 2)
        return 1;
    mpi_pipe_open(&wire, &place, 1 - place.rank, MPI_TAG_PIPES);
    end.pipe = mpi_link_pipe(&wire);
    end.idle = idle;
    end.settings.window = 8;
    int status = host_bench_end(&end, (unsigned)place.rank, &row);
    if (status == 0 && place.rank == 0) {
        printf("%.3f %.3f %.3f %.3f %.6f\n", row.bytes_per_s, row.round_trip_us,
               row.hop_us, row.cpu_us, row.retransmitted);
    }
    (void)mpi_place_part(&place, &wire, 1, 1000000);
    mpi_place_close(&place);
    MPI_Finalize();
    return status == 0 ? 0 : 1;
}
