/* The primitives of secure_suite.h from libsodium.
 *
 * Memory: none.  Work: libsodium's; no allocation, no start-up call.
 *
 *     struct secure_self self = {.suite = &secure_sodium, .key = key};
 */
#ifndef TRANSPORT_DRIVERS_SECURE_SODIUM_H
#define TRANSPORT_DRIVERS_SECURE_SODIUM_H

#include "transport/secure.h"

extern const struct secure_suite secure_sodium;

#endif
