/* What the user is told of nodes and wires while a run goes on: a line each, as
 * `incode: node 3 link 1: WHAT; WHAT TO DO NEXT`, on standard error, whatever
 * else is quiet, or to whom the machine names.  Part of service.h.
 *
 * Memory: none.  Work: a line.
 *
 *     host_notice(&service, 3, "no answer for %u s; look after it", 2);
 */
#ifndef HOST_NOTICES_H
#define HOST_NOTICES_H

#include "service.h"

enum { HOST_NOTICE_BYTES = 2000 }; /* of a line, cut there */

void host_notice(struct host_service *service, unsigned node,
                 const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The same of one of its links. */
void host_notice_of(struct host_service *service, unsigned node, unsigned link,
                    const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* The same of the host's own wire, or of no node in particular. */
void host_notice_line(struct host_service *service, const char *line);

#endif
