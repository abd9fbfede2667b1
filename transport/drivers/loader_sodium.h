/* What a loader and its signers ask of a library, by libsodium: on the host,
 * and on boards, whose loaders are linked with a part of it that is built for
 * them.
 *
 * Memory: the caller's of a hash.  Work: libsodium's.
 *
 *     const struct loader_suite *suite = &loader_sodium;
 *     suite->begin(hash);
 */
#ifndef TRANSPORT_DRIVERS_LOADER_SODIUM_H
#define TRANSPORT_DRIVERS_LOADER_SODIUM_H

#include "node/loader/suite.h"

extern const struct loader_suite loader_sodium;

#endif
