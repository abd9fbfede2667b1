/* The options of a command, from its table for argp: what argp does, but that
 * whatever is wrong is a host_error, names the option that may have been meant,
 * and is printed as other errors are.
 *
 * Memory: 4 KB of stack. */
#ifndef HOST_OPTIONS_H
#define HOST_OPTIONS_H

#include <argp.h>
#include <stdint.h>

#include "error.h"

enum { HOST_OPTIONS_MAX = 96 }; /* rows of a table, groups and end included */

/* argv[0] is the name for messages ("incode run"); flags: of argp_parse; input:
 * what the parser of `argp` finds as state->input.  That parser tells its own
 * errors with host_fail and returns 0; of --help it hears nothing but what is
 * asked of it.  Not 0: the command ends now with error->code.  --help, -h and
 * --version end the program themselves.  If this program is installed, --help
 * names README.md by the path of the installed one. */
int host_options_parse(const struct argp *argp, int argc, char **argv,
                       unsigned flags, void *input, struct host_error *error);

/* For such a parser: the value of --`option`, a whole number from least to most
 * as host_parse_number has it.  0, or HOST_USAGE: *number stays as it is. */
int host_option_number(const char *option, const char *value, uint64_t least,
                       uint64_t most, uint64_t *number,
                       struct host_error *error);

/* The one argument of a command, which its help calls `name`, at ARGP_KEY_ARG;
 * where the command needs it, at ARGP_KEY_END too.  0, or HOST_USAGE: there is
 * one too many, or none. */
int host_option_argument(int key, const char *name, const char *value,
                         const char **argument, struct host_error *error);

#endif
