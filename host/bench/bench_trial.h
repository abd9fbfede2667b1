/* A program that is run to be measured: the time that it says it took, or that
 * it was ended at its limit.
 *
 * Memory: what it says, a few KiB.  Work: a process, and a look ten times a
 * second.
 *
 *     char name[] = "build/peers/cgal", file[] = "u.npy";
 *     char *const words[] = {name, file, NULL};
 *     if (host_trial_run(words, 60, &trial, &error) == 0 && !trial.late)
 *         printf("%.3f s\n", trial.cpu_s);
 */
#ifndef HOST_BENCH_TRIAL_H
#define HOST_BENCH_TRIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "host/base/error.h"

struct host_trial {
    bool late;  /* it was ended at the limit; nothing else is known then */
    int status; /* that it ended with; 128 and the number of a signal */
    uint64_t tetrahedra, pages_asked, pages;
    double cpu_s; /* processor time: of all nodes, or of a peer */
    /* Of the host: what time_triangulation_s covers, and all, files apart. */
    double host_s, host_all_s;
    double wall_s;
    double whole_s;  /* by the clock, from its start to its end */
    char digest[80]; /* empty: it says none */
    char said[400];  /* the last line on standard error */
};

/* Runs `words`, found as a shell finds them, with nothing as standard input.
 * What is on its standard output, statistics of a run or a peer's, fills the
 * trial; else all of that stays 0.  Its end, whatever it is, is no error. */
int host_trial_run(char *const words[], double limit_s,
                   struct host_trial *trial, struct host_error *error);

#endif
