/* The arguments of `incode run`, and of what shares them. */
#ifndef HOST_ARGUMENTS_H
#define HOST_ARGUMENTS_H

#include "host/base/options.h"
#include "run.h"

/* argv[0] is the name for messages ("incode run").  0, or the command ends with
 * error->code: see host_options_parse. */
int host_arguments_run(int argc, char **argv, struct host_run_options *options,
                       struct host_error *error);

/* The same where somebody else says what is wrong: prints nothing. */
int host_arguments_try(int argc, char **argv, struct host_run_options *options);

/* Beside those of the program, options of all runs to come, for struct
 * host_run_options: tests have some for the faults that they make. */
void host_arguments_add(const struct host_option *more);

#endif
