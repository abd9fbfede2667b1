/* What nodes have to say, of which most say the same: equal rows become one,
 * with the set of those who said it, as cluster shells show it.
 *
 * Memory: each row that differs, and 128 bytes.  Work: a row is compared with
 * those that differ.
 *
 *     host_fold_add(&fold, 3, "up  0.4 ms");
 *     host_fold_add(&fold, 4, "up  0.4 ms");
 *     host_fold_print(&fold, "STATE RTT", say, NULL); // "3-4    up  0.4 ms"
 *     host_fold_free(&fold);
 */
#ifndef HOST_CONSOLE_FOLD_H
#define HOST_CONSOLE_FOLD_H

#include "host/base/node_set.h"

struct host_fold_row {
    char *text;
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

/* A heading, unless it is NULL, and the rows in the order in which they came
 * first; those of several lines stand beneath their set. */
void host_fold_print(const struct host_fold *fold, const char *heading,
                     void (*line)(void *context, const char *text),
                     void *context);

void host_fold_free(struct host_fold *fold);

#endif
