/* What libsodium's primitives call in its utils.c, which would bring an
 * allocator into the node with it.
 *
 * Memory, work: none to speak of. */
#include <stdint.h>

#include "transport/secure_wipe.h"

void sodium_memzero(void *memory, size_t size);
int sodium_is_zero(const uint8_t *bytes, size_t size);
void sodium_misuse(void) __attribute__((noreturn));

void sodium_memzero(void *memory, size_t size)
{
    secure_wipe(memory, size);
}

/* In a time that says nothing of the bytes. */
int sodium_is_zero(const uint8_t *bytes, size_t size)
{
    unsigned bits = 0;
    while (size-- > 0) {
        bits |= *bytes++;
    }
    return bits == 0;
}

void sodium_misuse(void)
{
    __builtin_trap();
}
