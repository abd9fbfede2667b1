/* What libsodium's primitives call in its utils.c, which would bring an
 * allocator into the node with it.
 *
 * Memory, work: none to speak of. */
#include <stddef.h>
#include <stdint.h>

void sodium_memzero(void *memory, size_t size);
void sodium_misuse(void) __attribute__((noreturn));

void sodium_memzero(void *memory, size_t size)
{
    volatile uint8_t *at = memory;
    while (size-- > 0) {
        *at++ = 0;
    }
}

void sodium_misuse(void)
{
    __builtin_trap();
}
