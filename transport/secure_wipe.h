/* Zeros that a compiler must write, where nobody reads them: over keys that
 * were used, and all that they can be computed from. */
#ifndef TRANSPORT_SECURE_WIPE_H
#define TRANSPORT_SECURE_WIPE_H

#include <stddef.h>

void secure_wipe(void *memory, size_t size);

#endif
