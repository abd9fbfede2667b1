/* The primitives of sign_suite.h from libsodium: on the host, and on boards,
 * whose loaders are linked with a part of it that is built for them. */
#ifndef TRANSPORT_DRIVERS_SIGN_SODIUM_H
#define TRANSPORT_DRIVERS_SIGN_SODIUM_H

#include "transport/sign_suite.h"

extern const struct sign_suite sign_sodium;

#endif
