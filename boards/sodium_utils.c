/* What libsodium's primitives call in its utils.c, which would bring an
 * allocator into a node or a loader with it. */
#include <stdint.h>

#include "transport/secure_wipe.h"

void sodium_memzero(void *memory, size_t size);
int sodium_is_zero(const uint8_t *bytes, size_t size);
int sodium_memcmp(const void *a, const void *b, size_t size);
void sodium_misuse(void) __attribute__((noreturn));

void sodium_memzero(void *memory, size_t size) {
    secure_wipe(memory, size);
}

/* In a time that says nothing of the bytes, as the next. */
int sodium_is_zero(const uint8_t *bytes, size_t size) {
    unsigned bits = 0;
    while (size-- > 0)
        bits |= *bytes++;
    return bits == 0;
}

int sodium_memcmp(const void *a, const void *b, size_t size) {
    const uint8_t *x = a, *y = b;
    unsigned bits = 0;
    while (size-- > 0)
        bits |= (unsigned)(*x++ ^ *y++);
    return bits == 0 ? 0 : -1;
}

void sodium_misuse(void) {
    __builtin_trap();
}
