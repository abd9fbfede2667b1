/* The row of `incode bench links` for MPI: two ranks of this program, started
 * by the bench with the word HOST_MPI_BENCH, of which rank 0 prints the
 * figures. */
#ifndef HOST_MPI_BENCH_H
#define HOST_MPI_BENCH_H

#define HOST_MPI_BENCH "bench-link"

/* After MPI_Init; ends MPI.  0, or 1 where the ranks did not meet. */
int host_mpi_bench(void);

#endif
