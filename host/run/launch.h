/* `incode run --link mpi`: in a rank that mpirun or a scheduler has started,
 * this program becomes the host's (incode-mpi) or a node's (incode-node-mpi);
 * where nobody has started ranks, it starts mpirun, and watches over it.
 *
 * Started from here, rank 0 has the standard input, output and error of this
 * process itself (handed over on a socket), and says its exit status there;
 * what mpirun and the libraries print is kept back, and explained where the
 * ranks do not start or one is lost.
 *
 * Memory: 16 KiB of what mpirun says.  Work: sleeps until the ranks are done.
 */
#ifndef HOST_LAUNCH_H
#define HOST_LAUNCH_H

#include "run.h"

/* What a program of the host needs of its process, whatever started it:
 * descriptors 0 to 2 are open, so that no file or wire gets their numbers; the
 * ends of its children are reported, even if its parent ignores those of its
 * own; and signals are set as outputs need them (output.h). */

/* Called first of all.  name: the process is listed under it, even if it was
 * started as /proc/self/exe. */
void host_begin(const char *name);

/* Takes the code for that level of processors which the environment forces, if
 * it does. */
int host_begin_processor(struct host_error *error);

/* Of the launcher's making, as the environment has it; -1: no rank. */
int host_launch_rank(void);

/* The host's rank becomes incode-mpi, another incode-node-mpi: returns only
 * where that fails. */
int host_launch_become(int rank, char **argv, struct host_error *error);

/* Starts mpirun with as many ranks as options ask for and waits for their end:
 * the run's status, with no text in *error where rank 0 has said it itself.
 * argv: those of `incode run`. */
int host_launch_mpi(char **argv, const struct host_run_options *options,
                    struct host_error *error);

/* In rank 0, at its end: tells host_launch_mpi the exit status, and whether a
 * rank was lost (which; or 0) or the job was ended from outside.  False where
 * nobody is there to be told. */
bool host_launch_report(int status, int lost, bool ended);

#endif
