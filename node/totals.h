/* Sums of statistics: over the jobs, the roles and the starts of a node.
 *
 * Memory: none.  Work: one pass over the counters.
 *
 *     struct node_finished_message sum = {0};
 *     node_totals_add(&sum, &first_start);
 *     node_totals_add(&sum, &second_start);
 */
#ifndef NODE_TOTALS_H
#define NODE_TOTALS_H

#include "message.h"

/* Counters add up; high waters are those of the higher.  `epoch` and `start`
 * stay. */
void node_totals_add(struct node_finished_message *sum,
                     const struct node_finished_message *more);

#endif
