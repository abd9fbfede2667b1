/* Overwrites used keys, and everything from which they can be computed, with
 * zeros that the compiler must not leave out. */
#ifndef TRANSPORT_SECURE_WIPE_H
#define TRANSPORT_SECURE_WIPE_H

#include <stddef.h>

void secure_wipe(void *memory, size_t size);

#endif
