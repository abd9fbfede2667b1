/* A line on the terminal that shows how far the work is, its rate and the time
 * that is left.  Nothing where standard error is no terminal.
 *
 * Memory: the struct.  Work: a line at most ten times a second.
 *
 *     struct host_progress progress;
 *     host_progress_start(&progress, true);
 *     host_progress_show(&progress, done, total, tetrahedra);
 *     host_progress_end(&progress);
 */
#ifndef HOST_PROGRESS_H
#define HOST_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

struct host_progress {
    bool shown; /* a line stands on the terminal */
    bool wanted;
    uint64_t start_us, next_us;
};

/* wanted: false for quiet. */
void host_progress_start(struct host_progress *progress, bool wanted);
void host_progress_show(struct host_progress *progress, uint64_t done,
                        uint64_t total, uint64_t tetrahedra);
void host_progress_end(struct host_progress *progress);

#endif
