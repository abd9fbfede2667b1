/* The primitives of secure_suite.h from libsodium, and the system's random
 * bytes.
 *
 * Memory: none.  Work: libsodium's; no allocation, no start-up call.
 *
 *     secure_shake_init(&shake, &secure_sodium, key, true, nonce);
 */
#ifndef TRANSPORT_DRIVERS_SECURE_SODIUM_H
#define TRANSPORT_DRIVERS_SECURE_SODIUM_H

#include "transport/secure.h"

extern const struct secure_suite secure_sodium;

/* As secure_source wants it; context: NULL. */
bool secure_system_random(void *context, uint8_t *bytes, size_t size);

#endif
