/* Where a host with a port is, as a user writes it: "name:7001",
 * "10.0.0.7:7001" or "[2001:db8::7]:7001".
 *
 * Memory: none.  Work: a look-up of a name that is no address.
 *
 *     if (host_resolve("lab-3:7000", &address, why, sizeof why) != 0)
 *         return host_fail(&error, HOST_CUBE, "--tcp lab-3:7000: %s", why);
 */
#ifndef HOST_RESOLVE_H
#define HOST_RESOLVE_H

#include "host/base/error.h"
#include "transport/drivers/tcp_address.h"

/* 0, or the code of the error that it is, and why: "WHAT; WHAT TO DO NEXT".
 * HOST_INPUT: it is not written so; HOST_CUBE: the name is not found. */
int host_resolve(const char *text, struct tcp_address *address, char *why,
                 size_t size);

#endif
