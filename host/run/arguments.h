/* The arguments of `incode run`, and of what shares them. */
#ifndef HOST_ARGUMENTS_H
#define HOST_ARGUMENTS_H

#include "run.h"

/* argv[0] is the name for messages ("incode run").  0, or the command ends with
 * error->code: see host_options_parse. */
int host_arguments_run(int argc, char **argv, struct host_run_options *options,
                       struct host_error *error);

/* The same where somebody else says what is wrong: prints nothing. */
int host_arguments_try(int argc, char **argv, struct host_run_options *options);

/* What the parts of `incode run`'s arguments share: their keys and what was
 * given (arguments.c), what of it goes together (arguments_together.c), and the
 * texts of --help that are made of tables (arguments_help.c). */

enum {
    /* Options of a cube of nodes. */
    KEY_STRATEGY = 256,
    KEY_PARTITION,
    KEY_INDEX,
    KEY_NODES,
    KEY_FACE_RULE,
    KEY_BUILD,
    KEY_LINK,
    KEY_BOARD,
    KEY_PATIENCE,
    KEY_CUBE,
    KEY_MEMORY,
    KEY_LINDA,
    KEY_CLUSTER,
    KEY_BUILDERS,
    KEY_FACES_PER_JOB,
    KEY_JOBS_PER_WORKER,
    KEY_EXPLAIN,
    KEY_TABLE,
    KEY_MAP,
    KEY_WINDOW,
    KEY_SHUFFLE_SEED,
    KEY_HOST_STALL,
    KEY_HOST_RATE,
    KEY_HOST_RATE_TIME,
    KEY_HOST_UNPLUG,
    KEY_BOARD_RESET, /* in the order of enum host_trouble_kind */
    KEY_BOARD_STOP,
    KEY_BOARD_KILL,
    KEY_SEED,
    KEY_NODE_PROGRAM,
    /* Options of every run. */
    KEY_THREADS,
    KEY_STATS,
    KEY_VERIFY,
    KEY_NO_VERIFY,
    KEY_NO_PROGRESS,
    KEY_PROGRESS,
    KEY_FORMAT,
    KEY_END
};

struct host_arguments {
    struct host_run_options *options;
    struct host_error *error;
    unsigned linda; /* of the rows of --linda */
    uint64_t given; /* bits of keys from KEY_STRATEGY on */
};

#endif
