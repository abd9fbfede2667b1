/* Waiting for files that are ready.
 *
 * Memory: none.  Work: system calls until one is.
 *
 *     wait_files(fds, count, wait_us, 0);
 */
#ifndef TRANSPORT_DRIVERS_WAIT_H
#define TRANSPORT_DRIVERS_WAIT_H

#include <poll.h>
#include <stdint.h>

/* Sleeps until a file is ready, or wait_us are over.  For the first awake_us it
 * stays awake, and gives way to whoever has work: where a processor is free,
 * what comes soon need not wait to be woken for. */
void wait_files(struct pollfd *fds, nfds_t count, uint64_t wait_us,
                uint64_t awake_us);

#endif
