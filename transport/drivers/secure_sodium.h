/* The primitives of secure.h from libsodium.
 *
 * Memory: none.  Work: libsodium's; no allocation, no start-up call.
 *
 *     secure_shake_init(&shake, &secure_sodium, key, true, nonce);
 */
#ifndef TRANSPORT_DRIVERS_SECURE_SODIUM_H
#define TRANSPORT_DRIVERS_SECURE_SODIUM_H

#include "transport/secure.h"

extern const struct secure_suite secure_sodium;

#endif
