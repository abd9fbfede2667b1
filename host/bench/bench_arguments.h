/* `incode bench`: its arguments, and the benchmark that they name.
 *
 * Memory: the options.  Work: that of the benchmark.
 *
 *     static char name[] = "incode bench", what[] = "links";
 *     char *words[] = {name, what, NULL};
 *     if (host_bench(2, words, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_ARGUMENTS_H
#define HOST_BENCH_ARGUMENTS_H

#include "host/base/error.h"

/* The whole command; argv[0] is its name for messages. */
int host_bench(int argc, char **argv, struct host_error *error);

#endif
