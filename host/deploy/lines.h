/* The boards' lines: on a terminal that has room for all of them a row a board
 * shows what it is at; what came of it is printed once, when all are done.
 *
 * Memory: none.  Work: a line a board, ten times a second at most.
 *
 *     struct host_deploy_lines lines;
 *     host_deploy_lines_begin(&lines, 4, false);
 *     host_deploy_lines_show(&lines, boards, 4);
 *     host_deploy_lines_end(&lines, boards, 4);
 */
#ifndef HOST_DEPLOY_LINES_H
#define HOST_DEPLOY_LINES_H

#include <stdbool.h>

#include "board.h"

struct host_deploy_lines {
    bool quiet, live;
};

void host_deploy_lines_begin(struct host_deploy_lines *lines, unsigned boards,
                             bool quiet);
/* When anything may have changed. */
void host_deploy_lines_show(const struct host_deploy_lines *lines,
                            const struct host_deploy_board *boards,
                            unsigned count);
/* When all is done: last lines, what is wrong, and notes. */
void host_deploy_lines_end(const struct host_deploy_lines *lines,
                           const struct host_deploy_board *boards,
                           unsigned count);

#endif
