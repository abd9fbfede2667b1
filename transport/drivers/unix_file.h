/* What a socket with a path has and one of TCP has not: a file, and a kernel
 * that says who is at the other end.  Such a wire needs no key: the file is for
 * its owner alone, and each end asks whether the other is the same user, or
 * root. */
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

/* Whether who is at the other end of a connection is this user, or root. */
bool unix_file_peer_is_ours(int fd);

/* Removes the file, if it is a socket that nobody listens on. */
void unix_file_remove(const struct tcp_address *address);

/* Waiting for files that are ready. */

/* Sleeps until a file is ready, or wait_us are over.  For the first awake_us it
 * stays awake, and gives way to whoever has work: where a processor is free,
 * what comes soon need not wait to be woken for. */
void wait_files(struct pollfd *fds, nfds_t count, uint64_t wait_us,
                uint64_t awake_us);

#endif
