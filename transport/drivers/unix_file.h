/* Sockets with a path: their file, and the kernel's identification of the peer.
 * Such a wire needs no key, because the file is for its owner only, and each
 * end checks that the other is the same user, or root. */
#ifndef TRANSPORT_DRIVERS_UNIX_FILE_H
#define TRANSPORT_DRIVERS_UNIX_FILE_H

#include <poll.h>
#include <stdint.h>

#include "tcp.h"

/* Binds a socket to its path, with rights for this user alone (mode 0600).  A
 * socket that nobody listens on any more is replaced.  0, or -1 and errno:
 * EADDRINUSE if somebody does, EEXIST if the file is none of a socket. */
int unix_file_bind(int fd, const struct tcp_address *address);

/* Two connected sockets without a path, non-blocking, closed on exec: 0, or -1
 * and errno.  The kernel counts each call's bytes as hundreds more: of single
 * bytes a socket takes 278 before it is full. */
int unix_file_pair(int fds[2]);

/* Whether the process at the other end of a connection belongs to this user, or
 * root. */
bool unix_file_peer_is_ours(int fd);

/* Removes the file, if it is a socket that nobody listens on. */
void unix_file_remove(const struct tcp_address *address);

/* Waiting for files that are ready. */

/* Sleeps until a file is ready, or wait_us are over.  For the first awake_us it
 * stays awake and yields the processor to others, so that on a free processor a
 * byte that comes soon does not wait for a wake-up. */
void wait_files(struct pollfd *fds, nfds_t count, uint64_t wait_us,
                uint64_t awake_us);

#endif
