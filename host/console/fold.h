/* What nodes have to say, of which most say the same: equal rows become one,
 * with the set of those who said it, as cluster shells show it.
 *
 * Memory: each row that differs, and 128 bytes. */
#ifndef HOST_CONSOLE_FOLD_H
#define HOST_CONSOLE_FOLD_H

#include "host/base/node_set.h"

enum { HOST_FOLD_TIME_WIDTH = 9 };

struct host_fold_row {
    char *text;
    bool timed;           /* it has a time, of which it is known */
    uint32_t least, most; /* seconds of it */
    struct host_node_set set;
    bool of_host; /* no node said it, the host did */
};

/* All zero: empty. */
struct host_fold {
    unsigned count, room;
    bool broken; /* a row found no memory */
    struct host_fold_row *row;
};

/* A row of a node, or of CUBE_HOST; of several lines, if need be. */
void host_fold_add(struct host_fold *fold, unsigned node, const char *text);

/* The same with a time, as of being up, which never is the same twice: one in
 * `text` stands where HOST_FOLD_TIME does, HOST_FOLD_TIME_WIDTH wide.  Times
 * that are near share a row, and are told from the least to the most; those of
 * a node that has begun anew are not. */
#define HOST_FOLD_TIME '\1'
void host_fold_add_timed(struct host_fold *fold, unsigned node,
                         const char *text, uint32_t time_s);

/* A heading, unless it is NULL, and the rows in the order in which they came
 * first; those of several lines stand beneath their set. */
void host_fold_print(const struct host_fold *fold, const char *heading,
                     void (*line)(void *context, const char *text),
                     void *context);

void host_fold_free(struct host_fold *fold);

#endif
